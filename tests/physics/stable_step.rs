//! The stable step, compared with the largest frequency of a body.

use crate::support::history::row;
use crate::support::simulate;
use fissure::solver::Simulation;
use fissure::solver::bonds::BondUpdate;
use fissure::solver::observers::HistoryObserver;
use nalgebra::{DMatrix, Matrix3, Vector3};

/// A system of one or two bodies.
struct System {
    dimension: &'static str,
    text: String,
}

/// Return a block of one law, just large enough for a complete family in its middle.
fn block(dimension: &'static str, law: &str) -> System {
    let (horizon, lower, upper) = match dimension {
        "3d" => (2, "[0, 0, 0]", "[5, 6, 5]"),
        _ => (3, "[0, 0]", "[7, 8]"),
    };
    let text = format!(
        "grid = {{ volume_correction = 'none', spacing = 1, horizon = {horizon} }}
        material.rubber.{law}
        body.block = {{ material = 'rubber', shape.box = {{ lower = {lower}, upper = {upper} }} }}
        "
    );
    System { dimension, text }
}

/// Return two bodies side by side.
fn pair(laws: [&str; 2]) -> System {
    let [left, right] = laws;
    let text = format!(
        "grid = {{ volume_correction = 'none', spacing = 1, horizon = 3 }}
        material.left.{left}
        material.right.{right}
        body.left = {{ material = 'left', shape.box = {{ lower = [0, 0], upper = [5, 6] }} }}
        body.right = {{ material = 'right', shape.box = {{ lower = [5, 0], upper = [9, 6] }} }}
        "
    );
    System {
        dimension: "plane-stress",
        text,
    }
}

impl System {
    /// Return the deck at rest, with a step of 1 s.
    fn at_rest(&self) -> String {
        format!(
            "dimension = '{}'\n{}time = {{ end = 1, step = 1 }}",
            self.dimension, self.text
        )
    }

    /// Return the deck with small initial velocities that contain all frequencies.
    fn rattled(&self, step: f64, steps: u32) -> String {
        let velocity = match self.dimension {
            "3d" => "['1e-6*cos(3.1*x*y)', '1e-6*sin(7*x+z)', '1e-6*cos(z*z+x)']",
            _ => "['1e-6*cos(3.1*x*y)', '1e-6*sin(7*x+y)']",
        };
        format!(
            "dimension = '{}'
            {}
            initial.rattle.velocity = {velocity}
            time = {{ end = {}, step = {step} }}",
            self.dimension,
            self.text,
            f64::from(steps) * step
        )
    }
}

/// Return the largest frequency of small motions, 1/s, from the largest eigenvalue of M^(−1/2) K M^(−1/2). K
/// is minus the derivative of the forces ∫ f dV, computed by differences.
fn largest_frequency<const D: usize>(simulation: &mut Simulation<D>) -> f64 {
    const SHIFT: f64 = 1e-6;
    let points = simulation.model.owned();
    let mass: Vec<f64> = (0..points)
        .map(|k| simulation.model.density_of(k) * simulation.model.volume[k])
        .collect();
    let mut matrix = DMatrix::zeros(D * points, D * points);
    for column in 0..D * points {
        let [plus, minus] = [SHIFT, -SHIFT].map(|shift| {
            simulation.fields.displacement[column % D][column / D] = shift;
            simulation.evaluate(BondUpdate::None);
            simulation.fields.displacement[column % D][column / D] = 0.0;
            simulation.fields.internal_force.clone()
        });
        for row in 0..D * points {
            let (point, component) = (row / D, row % D);
            let difference = plus[component][point] - minus[component][point];
            let stiffness = -simulation.model.volume[point] * difference / (2.0 * SHIFT);
            matrix[(row, column)] = stiffness / (mass[point] * mass[column / D]).sqrt();
        }
    }
    let largest = matrix.amax();
    assert!(
        (&matrix - matrix.transpose()).amax() < 1e-8 * largest,
        "there is an energy"
    );
    matrix.symmetric_eigenvalues().max().sqrt()
}

/// Return the stable step and the exact limit 2/ω, s.
fn steps<const D: usize>(system: &System) -> (f64, f64) {
    simulate::<D, _>(&system.at_rest(), |mut simulation| {
        let limit = 2.0 / largest_frequency(&mut simulation);
        (simulation.undeformed.stable_step, limit)
    })
}

/// Return the largest factor by which the energy has grown during `steps` steps of this size; infinity if the
/// motion overflows.
fn growth<const D: usize>(system: &System, step: f64, steps: u32) -> f64 {
    simulate::<D, _>(&system.rattled(step, steps), |mut simulation| {
        let mut observer = HistoryObserver::new(&simulation).unwrap();
        let mut energy = |simulation: &mut Simulation<D>| {
            let energies = row(&mut observer, simulation).energies;
            energies.kinetic + energies.strain
        };
        let start = energy(&mut simulation);
        let mut largest = start;
        for _ in 0..steps {
            simulation.advance();
            if simulation.check().is_err() {
                return f64::INFINITY;
            }
            largest = largest.max(energy(&mut simulation));
        }
        largest / start
    })
}

/// Return Σ V C n⊗n (1 − cos k·ξ) over the complete family of a lattice of spacing 1, with C = 1/|ξ|; without
/// a wave, Σ V C n⊗n.
fn lattice_sum(dimension: usize, horizon: f64, wave: Option<Vector3<f64>>) -> Matrix3<f64> {
    let reach = horizon as i32;
    let range = |k: usize| if k < dimension { -reach..=reach } else { 0..=0 };
    let mut sum = Matrix3::zeros();
    for x in range(0) {
        for y in range(1) {
            for z in range(2) {
                let bond = Vector3::new(x, y, z).map(f64::from);
                let length = bond.norm();
                if length > 0.0 && length <= horizon * (1.0 + 1e-9) {
                    let phase = wave.map_or(1.0, |wave| 1.0 - wave.dot(&bond).cos());
                    sum += bond * bond.transpose() / length.powi(3) * phase;
                }
            }
        }
    }
    sum
}

/// Return the usual step √(2ρ/Σ V c/|ξ|) (Silling & Askari 2005) for the lattice of [`block`], s.
fn usual(dimension: usize, density: f64, modulus: f64) -> f64 {
    let pi = std::f64::consts::PI;
    let (horizon, micromodulus) = match dimension {
        2 => (3.0_f64, 9.0 * modulus / (pi * 27.0)),
        _ => (2.0, 12.0 * modulus / (pi * 16.0)),
    };
    let sum = micromodulus * lattice_sum(dimension, horizon, None).trace();
    (2.0 * density / sum).sqrt()
}

const PMB: &str = "pmb = { density = 2, youngs_modulus = 5 }";

#[test]
fn the_step_is_root_of_the_dimension_larger_than_the_usual_one_and_within_the_limit() {
    fn check<const D: usize>(dimension: &'static str) {
        let (stable, limit) = steps::<D>(&block(dimension, PMB));
        let gain = stable / usual(D, 2.0, 5.0);
        assert!(
            (gain / (D as f64).sqrt() - 1.0).abs() < 1e-9,
            "{dimension}: {gain}"
        );
        assert!(stable <= limit, "{dimension}: {stable} {limit}");
    }
    check::<2>("plane-stress");
    check::<3>("3d");
}

#[test]
fn below_the_step_the_energy_is_bounded_and_beyond_the_limit_it_is_not() {
    fn check<const D: usize>(dimension: &'static str) {
        let system = block(dimension, PMB);
        let (stable, limit) = steps::<D>(&system);
        // In the Verlet method, the energy of a wave oscillates by a factor of up to 1/(1 − (ωΔt/2)²).
        for step in [0.98 * stable, 0.98 * limit] {
            let swing = 1.0 / (1.0 - (step / limit).powi(2));
            let found = growth::<D>(&system, step, 1000);
            assert!(
                found < 1.01 * swing,
                "{dimension}: {found}, at most {swing}"
            );
        }
        // With ωΔt = 2.04, the amplitude grows by a factor of 1.49 per step, and the energy by its square.
        let found = growth::<D>(&system, 1.02 * limit, 100);
        assert!(found > 1e9, "{dimension}: {found}");
    }
    check::<2>("plane-stress");
    check::<3>("3d");
}

#[test]
fn the_step_of_every_law_is_within_the_limit() {
    let ordinary = |ratio: f64| {
        format!("ordinary = {{ density = 2, youngs_modulus = 5, poisson_ratio = {ratio} }}")
    };
    let laws = [
        "proportional = { density = 2, youngs_modulus = 5, surface_correction = 'energy' }".to_owned(),
        "normalised_pmb = { density = 2, youngs_modulus = 5 }".to_owned(),
        "normalised_pmb = { density = 2, youngs_modulus = 5, form = 'diehl2016' }".to_owned(),
        "linear_microelastic = { density = 2, youngs_modulus = 5 }".to_owned(),
        "linear_microelastic = { density = 2, youngs_modulus = 5, lambda = '5*exp(-r)' }".to_owned(),
        "proportional = { density = 2, youngs_modulus = 5, surface_correction = 'tensor' }".to_owned(),
        "proportional = { density = 2, youngs_modulus = 5, surface_correction = 'directional' }".to_owned(),
        "ordinary = { density = 2, youngs_modulus = 5, poisson_ratio = 0.4, surface_correction = 'directional' }"
            .to_owned(),
        "ordinary = { density = 2, youngs_modulus = 5, poisson_ratio = 0.4, surface_correction = 'pals' }"
            .to_owned(),
        "ordinary_viscoelastic = { density = 2, youngs_modulus = 5, poisson_ratio = 0.1, surface_correction = 'pals', relaxation_time = 1e9, relaxing_share = 0.5 }"
            .to_owned(),
        ordinary(-0.2),
        ordinary(0.1),
        ordinary(0.4),
        "ordinary = { density = 2, youngs_modulus = 5, poisson_ratio = 0.45, influence = 'inverse' }"
            .to_owned(),
        "correspondence = { density = 2, youngs_modulus = 5, poisson_ratio = 0.3 }".to_owned(),
        "bond_associated_correspondence = { density = 2, youngs_modulus = 5, poisson_ratio = 0.3 }"
            .to_owned(),
        "bond_associated_correspondence = { density = 2, youngs_modulus = 5, poisson_ratio = -0.2 }"
            .to_owned(),
    ];
    for law in &laws {
        for dimension in ["plane-stress", "plane-strain"] {
            let (stable, limit) = steps::<2>(&block(dimension, law));
            assert!(stable <= limit, "{dimension}, {law}: {stable} {limit}");
        }
        let (stable, limit) = steps::<3>(&block("3d", law));
        assert!(stable <= limit, "3d, {law}: {stable} {limit}");
    }
    let light = "pmb = { density = 0.5, youngs_modulus = 20 }";
    for other in [light, &ordinary(0.4), &laws[1]] {
        let (stable, limit) = steps::<2>(&pair([PMB, other]));
        assert!(stable <= limit, "{PMB} beside {other}: {stable} {limit}");
    }
}

#[test]
fn the_limit_of_the_cubic_lattice_is_nearly_twice_the_usual_step() {
    // Waves in the infinite lattice: ρ ω² is the largest eigenvalue of Σ V C n⊗n (1 − cos k·ξ). A finite body
    // has fewer bonds, so its frequencies are not higher.
    const PARTS: i32 = 24;
    for (horizon, expected) in [(2.0, 1.86), (3.0, 1.97), (4.0, 2.03)] {
        let rest = lattice_sum(3, horizon, None);
        let mut largest = 0.0_f64;
        // By symmetry, wave vectors with 0 ≤ z ≤ y ≤ x are sufficient.
        for x in 0..=PARTS {
            for y in 0..=x {
                for z in 0..=y {
                    let wave = Vector3::new(x, y, z).map(|k| f64::from(k) / f64::from(PARTS));
                    let sum = lattice_sum(3, horizon, Some(wave * std::f64::consts::PI));
                    largest = largest.max(sum.symmetric_eigenvalues().max());
                }
            }
        }
        // (2/ω)/√(2ρ/Σ V C), which does not depend on the density.
        let gain = (2.0 * rest.trace() / largest).sqrt();
        assert!((gain - expected).abs() < 0.01, "{horizon}: {gain}");
    }
}
