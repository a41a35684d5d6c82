//! Energies with `surface_correction = "directional"`, compared with sums over the neighbours computed here
//! from the formulas in docs/src/theory/corrections.md.

use fissure::problem::Field;
use fissure::solver::Simulation;
use fissure::solver::observers::Snapshot;

use crate::support::{displace, simulate};

const YOUNG: f64 = 5.0;
const HORIZON: f64 = 3.0;
const EDGES: [i32; 3] = [5, 4, 3];

/// Displacement gradient. The sums below use stretches that are linear in this gradient. The relative error
/// of the sums is about the size of the gradient, 4e-6, so energies must agree to 1e-5.
const GRADIENT: [[f64; 3]; 3] = [
    [3e-6, 1e-6, -2e-6],
    [2e-6, -4e-6, 1e-6],
    [-1e-6, 3e-6, 2e-6],
];

/// Return length, direction and stretch of the bonds of the point with these indices in the block.
fn bonds(point: [i32; 3]) -> Vec<(f64, [f64; 3], f64)> {
    let mut found = Vec::new();
    for x in 0..EDGES[0] {
        for y in 0..EDGES[1] {
            for z in 0..EDGES[2] {
                let xi = [x - point[0], y - point[1], z - point[2]].map(f64::from);
                let length = xi.iter().map(|x| x * x).sum::<f64>().sqrt();
                if length > 0.0 && length <= HORIZON {
                    let n = xi.map(|x| x / length);
                    let each = (0..9).map(|k| n[k / 3] * GRADIENT[k / 3][k % 3] * n[k % 3]);
                    found.push((length, n, each.sum()));
                }
            }
        }
    }
    found
}

/// Return the factor of a bond of direction n from the factors g of the axes.
fn ellipsoid(n: [f64; 3], g: [f64; 3]) -> f64 {
    let sum: f64 = (0..3).map(|a| (n[a] / g[a]).powi(2)).sum();
    sum.powf(-0.5)
}

fn bond_based(bonds: &[(f64, [f64; 3], f64)]) -> f64 {
    let micromodulus = 12.0 * YOUNG / (std::f64::consts::PI * HORIZON.powi(4));
    let energy = |weight: &dyn Fn([f64; 3], f64) -> f64| -> f64 {
        let each = bonds.iter();
        each.map(|(length, n, stretch)| 0.25 * micromodulus * length * weight(*n, *stretch))
            .sum()
    };
    // The energy density of the solid with ν = 1/4 at unit extension: (λ + 2G)/2 = 0.6 E.
    let g = [0, 1, 2].map(|a| 0.6 * YOUNG / energy(&|n, _| n[a].powi(4)));
    energy(&|n, stretch| ellipsoid(n, g) * stretch * stretch)
}

fn ordinary(bonds: &[(f64, [f64; 3], f64)], ratio: f64) -> f64 {
    let (shear, bulk) = (
        YOUNG / (2.0 * (1.0 + ratio)),
        YOUNG / (3.0 * (1.0 - 2.0 * ratio)),
    );
    let sum = |term: &dyn Fn(f64, [f64; 3], f64) -> f64| -> f64 {
        let each = bonds.iter();
        each.map(|(length, n, stretch)| length * length * term(*length, *n, *stretch))
            .sum()
    };
    let weighted_volume = sum(&|_, _, _| 1.0);
    let (omega, sigma) = (3.0 / weighted_volume, 15.0 * shear / weighted_volume);
    // At unit extension along an axis the solid has the dilatation 1 and the deviatoric energy density
    // G dev H : dev H = ⅔ G.
    let of_axes = [0, 1, 2].map(|a| {
        let dilatation = sum(&|_, n, _| omega * n[a] * n[a]);
        let energy = sum(&|_, n, _| 0.5 * sigma * (n[a] * n[a] - 1.0 / 3.0).powi(2));
        [1.0 / dilatation, shear * 2.0 / 3.0 / energy]
    });
    let [volumetric, deviatoric] = [0, 1].map(|k| of_axes.map(|factors| factors[k]));
    let dilatation = sum(&|_, n, stretch| omega * ellipsoid(n, volumetric) * stretch);
    let energy = sum(&|_, n, stretch| {
        0.5 * sigma * ellipsoid(n, deviatoric) * (stretch - dilatation / 3.0).powi(2)
    });
    0.5 * bulk * dilatation * dilatation + energy
}

/// Check the energy density of every point of a block under a homogeneous strain.
fn check(law: &str, wanted: impl Fn(&[(f64, [f64; 3], f64)]) -> f64) {
    let [x, y, z] = EDGES;
    let text = format!(
        "dimension = '3d'
        grid = {{ spacing = 1, horizon = {HORIZON}, volume_correction = 'none', origin = [0, 0, 0] }}
        material.solid.{law}
        body.block = {{ material = 'solid', shape.box = {{ lower = [0, 0, 0], upper = [{x}, {y}, {z}] }} }}
        time.end = 1
        "
    );
    simulate::<3, _>(&text, |mut simulation: Simulation<3>| {
        displace(&mut simulation, |place| {
            std::array::from_fn(|a| {
                place[a] + (0..3).map(|b| GRADIENT[a][b] * place[b]).sum::<f64>()
            })
        });
        let snapshot = Snapshot::new(&mut simulation);
        let energies = snapshot.field(&mut simulation, Field::StrainEnergyDensity);
        assert_eq!(energies.len(), (x * y * z) as usize);
        for (point, energy) in energies.iter().enumerate() {
            let place = simulation.model.position(point);
            let wanted = wanted(&bonds([0, 1, 2].map(|d| place[d].floor() as i32)));
            assert!(
                (energy / wanted - 1.0).abs() < 1e-5,
                "{law}, {place:?}: {energy} {wanted}"
            );
        }
    });
}

#[test]
fn bond_based_energies() {
    let law = "pmb = { density = 1, youngs_modulus = 5, surface_correction = 'directional' }";
    check(law, bond_based);
}

#[test]
fn ordinary_energies() {
    let law = "ordinary = { density = 1, youngs_modulus = 5, poisson_ratio = 0.3, surface_correction = 'directional' }";
    check(law, |bonds| ordinary(bonds, 0.3));
}
