//! Calibration of the laws: stiffness, stress, wave speeds and dispersion, compared with closed forms and
//! with sums over lattice offsets computed here.

use crate::support::{displace, simulate};
use fissure::problem::Field;
use fissure::solver::Simulation;
use fissure::solver::observers::Snapshot;

/// Return the deck of a body of unit spacing, with `half` points to each side of a central point at the
/// origin.
fn deck(dimension: &str, horizon: f64, half: u32, correction: &str, law: &str) -> String {
    let (lower, upper) = (-f64::from(half) - 0.5, f64::from(half) + 0.5);
    let (dimension, constraint) = match dimension {
        "uniaxial-stress" | "uniaxial-strain" => ("1d", format!("constraint = '{dimension}'")),
        _ => (dimension, String::new()),
    };
    let corner = |value: f64| match dimension {
        "1d" => format!("[{value}]"),
        "3d" => format!("[{value}, {value}, {value}]"),
        _ => format!("[{value}, {value}]"),
    };
    format!(
        "dimension = '{dimension}'
        {constraint}
        title = 'calibration'
        [grid]
        spacing = 1
        horizon = {horizon}
        origin = {}
        volume_correction = '{correction}'
        [material]
        rubber.{law}
        [body.block]
        material = 'rubber'
        shape.box = {{ lower = {}, upper = {} }}
        [time]
        end = 1
        ",
        corner(0.5),
        corner(lower),
        corner(upper),
    )
}

/// Return the 3-D trace of a strain divided by its trace over the axes of the problem.
fn trace_share(dimension: &str, ratio: f64) -> f64 {
    match dimension {
        "plane-stress" => (1.0 - 2.0 * ratio) / (1.0 - ratio),
        _ => 1.0,
    }
}

/// Return the index of the point at the origin.
fn centre<const D: usize>(simulation: &Simulation<D>) -> usize {
    let model = &simulation.model;
    let at_origin = |point: &usize| model.position(*point).iter().all(|x| x.abs() < 1e-9);
    (0..model.owned()).find(at_origin).expect("a central point")
}

/// Return strain energy density (J/m³), stress (Pa) and dilatation of the central point after a deformation.
fn response<const D: usize>(
    simulation: &mut Simulation<D>,
    map: impl Fn([f64; 3]) -> [f64; 3],
) -> (f64, [f64; 6], f64) {
    displace(simulation, map);
    let centre = centre(simulation);
    let snapshot = Snapshot::new(simulation);
    let stress = snapshot.field(simulation, Field::Stress);
    (
        snapshot.field(simulation, Field::StrainEnergyDensity)[centre],
        std::array::from_fn(|k| stress[6 * centre + k]),
        snapshot.field(simulation, Field::Dilatation)[centre],
    )
}

#[test]
fn bulk_stiffness_of_the_prototype_law_on_a_cubic_lattice() {
    for (horizon, expected) in [(2, 0.971), (3, 1.121), (4, 0.943)] {
        let law = "pmb = { density = 1, bulk_modulus = 2 }";
        let deck = deck("3d", f64::from(horizon), horizon, "none", law);
        let (energy, _, _) =
            simulate::<3, _>(&deck, |mut s| response(&mut s, |x| x.map(|x| 1.001 * x)));
        let ratio = energy / (4.5 * 2.0 * 1e-6);
        assert!((ratio - expected).abs() < 5e-4, "m = {horizon}: {ratio}");
    }
}

#[test]
fn normalised_and_ordinary_laws_hold_the_classical_energy_of_expansion() {
    // The central point is three horizons from the surface. Its neighbours then also have complete families,
    // and the normalised law gives them the same constant.
    for (dimension, own) in [
        ("plane-stress", 1.0 / 3.0),
        ("plane-strain", 0.25),
        ("3d", 0.25),
    ] {
        for correction in ["none", "linear", "exact"] {
            for (kind, ratio) in [
                ("normalised_pmb", own),
                ("ordinary", own),
                ("ordinary", 0.4),
                ("ordinary", 0.1),
            ] {
                let law = format!(
                    "{kind} = {{ density = 1, youngs_modulus = 5, poisson_ratio = {ratio} }}"
                );
                let deck = deck(dimension, 2.0, 6, correction, &law);
                let strain = 1e-3;
                let map = |x: [f64; 3]| x.map(|x| (1.0 + strain) * x);
                let (energy, stress, dilatation) = match dimension {
                    "3d" => simulate::<3, _>(&deck, |mut s| response(&mut s, map)),
                    _ => simulate::<2, _>(&deck, |mut s| response(&mut s, map)),
                };
                // Classical: σ = E ε/(1−2ν) in 3-D, E ε/(1−ν) in plane stress, and E ε/((1+ν)(1−2ν)) in plane
                // strain.
                let (count, modulus) = match dimension {
                    "3d" => (3.0, 5.0 / (1.0 - 2.0 * ratio)),
                    "plane-stress" => (2.0, 5.0 / (1.0 - ratio)),
                    _ => (2.0, 5.0 / ((1.0 + ratio) * (1.0 - 2.0 * ratio))),
                };
                let expected = 0.5 * count * modulus * strain * strain;
                let case = format!("{dimension} {kind} {ratio} {correction}");
                assert!(
                    (energy / expected - 1.0).abs() < 1e-9,
                    "{case}: {energy} {expected}"
                );
                let trace = trace_share(dimension, ratio) * count * strain;
                assert!((dilatation / trace - 1.0).abs() < 1e-9, "{case}");
                let across = match dimension {
                    "plane-stress" => 0.0,
                    "plane-strain" => ratio * (stress[0] + stress[1]),
                    _ => stress[0],
                };
                assert!(
                    (stress[2] - across).abs() < 1e-9 * stress[0],
                    "{case}: {stress:?}"
                );
                // The output stress is Σ T ⊗ Y V with the deformed bonds Y = (1 + ε) ξ, hence the factor 1 +
                // ε.
                let expected = modulus * strain * (1.0 + strain);
                assert!(
                    (stress[0] / expected - 1.0).abs() < 1e-9,
                    "{case}: {stress:?}"
                );
                assert!(
                    (stress[1] / expected - 1.0).abs() < 1e-9,
                    "{case}: {stress:?}"
                );
                assert!(
                    stress[3].abs() < 1e-12 * expected.abs(),
                    "{case}: {stress:?}"
                );
            }
        }
    }
}

/// Return Σ ω|ξ|², Σ ω ξx⁴/|ξ|² and Σ ω ξx²ξy²/|ξ|² over the offsets of a lattice within a horizon.
fn moments(count: usize, horizon: f64, influence: impl Fn(f64) -> f64) -> [f64; 3] {
    let reach = horizon as i32;
    let range = |k: usize| if k < count { -reach..=reach } else { 0..=0 };
    let mut sums = [0.0; 3];
    for z in range(2) {
        for y in range(1) {
            for x in range(0) {
                let [x, y, z] = [x, y, z].map(f64::from);
                let square = x * x + y * y + z * z;
                if square > 0.0 && square <= horizon * horizon * (1.0 + 1e-9) {
                    let weight = influence(square.sqrt());
                    sums[0] += weight * square;
                    sums[1] += weight * x.powi(4) / square;
                    sums[2] += weight * x * x * y * y / square;
                }
            }
        }
    }
    sums
}

#[test]
fn the_ordinary_law_under_every_strain() {
    // The law assumes isotropic fourth moments of the family, which a square or cubic lattice does not have.
    // With m, A and B as returned by `moments`, the shear modulus is G (A − B) a/(2m) for an axis-parallel
    // deviatoric strain, and G B a/m for a shear along the axes. The factor a is 8 in the plane and 15 in
    // 3-D. Dilatation and pressure are exact.
    type Named = (&'static str, fn(f64) -> f64);
    let influences: [Named; 3] = [
        ("constant", |_| 1.0),
        ("linear", |r| 1.0 - r / 3.0),
        ("inverse", |r| 3.0 / r),
    ];
    for dimension in ["plane-stress", "plane-strain", "3d"] {
        let (count, factor) = if dimension == "3d" {
            (3, 15.0)
        } else {
            (2, 8.0)
        };
        for (name, influence) in influences {
            let nu = 0.4;
            let law = format!(
                "ordinary = {{ density = 1, youngs_modulus = 5, poisson_ratio = {nu}, influence = '{name}' }}"
            );
            let deck = deck(dimension, 3.0, 4, "none", &law);
            let [m, axial, mixed] = moments(count, 3.0, influence);
            let shear = 5.0 / (2.0 * (1.0 + nu));
            let tiny = 1e-7;
            let of = |map: &dyn Fn([f64; 3]) -> [f64; 3]| match count {
                3 => simulate::<3, _>(&deck, |mut s| response(&mut s, map)),
                _ => simulate::<2, _>(&deck, |mut s| response(&mut s, map)),
            };
            let case = format!("{dimension} {name}");
            // Shear: ε_xy = γ/2 with γ = 2·tiny.
            let (energy, stress, dilatation) = of(&|[x, y, z]| [x + tiny * y, y + tiny * x, z]);
            let modulus = shear * factor * mixed / m;
            let expected = 2.0 * modulus * tiny * tiny;
            assert!(
                (energy / expected - 1.0).abs() < 1e-5,
                "{case}: {energy} {expected}"
            );
            assert!(
                (stress[3] / (2.0 * modulus * tiny) - 1.0).abs() < 1e-5,
                "{case}"
            );
            assert!(dilatation.abs() < 1e-5 * tiny, "{case}: {dilatation}");
            assert!(
                (modulus / shear - 1.0).abs() < 0.25,
                "{case}: {}",
                modulus / shear
            );
            // Extension along one axis and equal shortening along another.
            let (energy, stress, dilatation) = of(&|[x, y, z]| [x + tiny * x, y - tiny * y, z]);
            let modulus = shear * factor * (axial - mixed) / (2.0 * m);
            let expected = 2.0 * modulus * tiny * tiny;
            assert!(
                (energy / expected - 1.0).abs() < 1e-5,
                "{case}: {energy} {expected}"
            );
            assert!(
                (stress[0] / (2.0 * modulus * tiny) - 1.0).abs() < 1e-5,
                "{case}"
            );
            assert!(dilatation.abs() < 1e-5 * tiny, "{case}: {dilatation}");
            // Extension along one axis: the mean stress is that of the classical solid.
            let (_, stress, dilatation) = of(&|[x, y, z]| [x + tiny * x, y, z]);
            let mean = stress[..count].iter().sum::<f64>() / f64::from(count as u32);
            let bulk = match dimension {
                "3d" => 5.0 / (3.0 * (1.0 - 2.0 * nu)),
                "plane-stress" => 5.0 / (2.0 * (1.0 - nu)),
                _ => 5.0 / (2.0 * (1.0 + nu) * (1.0 - 2.0 * nu)),
            };
            assert!((mean / (bulk * tiny) - 1.0).abs() < 1e-5, "{case}: {mean}");
            assert!(
                (dilatation / (trace_share(dimension, nu) * tiny) - 1.0).abs() < 1e-5,
                "{case}: {dilatation}"
            );
        }
    }
}

#[test]
fn a_bar_without_strain_across_has_stress_there() {
    let law = "pmb = { density = 1, youngs_modulus = 5 }";
    let map = |[x, y, z]: [f64; 3]| [1.001 * x, y, z];
    let deck = deck("uniaxial-strain", 3.0, 6, "exact", law);
    let (_, stress, dilatation) = simulate::<1, _>(&deck, |mut s| response(&mut s, map));
    // σ = (λ + 2μ) ε along the bar and λ ε across, with λ = μ = 2 Pa.
    for (entry, modulus) in [(0, 6.0), (1, 2.0), (2, 2.0)] {
        let expected = modulus * 1e-3 * 1.001;
        assert!((stress[entry] / expected - 1.0).abs() < 1e-2, "{stress:?}");
    }
    assert!(
        (stress[1] / stress[0] - 1.0 / 3.0).abs() < 1e-12,
        "{stress:?}"
    );
    assert!((dilatation / 1e-3 - 1.0).abs() < 1e-9, "{dilatation}");
}

#[test]
fn a_bar_that_contracts_freely_has_youngs_modulus_and_no_stress_across() {
    for (law, ratio) in [
        ("pmb = { density = 1, youngs_modulus = 5 }", 0.25),
        (
            "pmb = { density = 1, youngs_modulus = 5, poisson_ratio = 0.4 }",
            0.4,
        ),
        (
            "normalised_pmb = { density = 1, shear_modulus = 2, poisson_ratio = 0.25 }",
            0.25,
        ),
    ] {
        let stretch: f64 = 1.001;
        let deck = deck("1d", 30.0, 60, "exact", law);
        let (energy, stress, dilatation, cauchy, mises) =
            simulate::<1, _>(&deck, |mut simulation| {
                let map = |[x, y, z]: [f64; 3]| [stretch * x, y, z];
                let (energy, stress, dilatation) = response(&mut simulation, map);
                let snapshot = Snapshot::new(&mut simulation);
                let centre = centre(&simulation);
                let cauchy = snapshot.field(&mut simulation, Field::CauchyStress)[6 * centre];
                let mises = snapshot.field(&mut simulation, Field::VonMisesStress)[centre];
                (energy, stress, dilatation, cauchy, mises)
            });
        let strain = stretch - 1.0;
        assert!(
            (energy / (2.5 * strain * strain) - 1.0).abs() < 2e-3,
            "{law}: {energy}"
        );
        assert!(
            (stress[0] / (5.0 * strain * stretch) - 1.0).abs() < 2e-3,
            "{law}: {stress:?}"
        );
        assert_eq!(stress[1..], [0.0; 5]);
        let wanted = (1.0 - 2.0 * ratio) * strain;
        assert!(
            (dilatation / wanted - 1.0).abs() < 1e-9,
            "{law}: {dilatation}"
        );
        // The cross-section changes by the factor F^(−2ν), so the volume changes by F^(1 − 2ν).
        let volume = libm::pow(stretch, 1.0 - 2.0 * ratio);
        assert!(
            (cauchy * volume / stress[0] - 1.0).abs() < 1e-12,
            "{law}: {cauchy}"
        );
        assert!((mises / cauchy - 1.0).abs() < 1e-12, "{law}: {mises}");
    }
}

/// Return energy density and stress (xx, yy, zz, xy, yz, xz) of a bond-based law at a small strain, from the
/// sum over the offsets within the horizon: W = ¼ Σ c (n·E n)² |ξ| V, σ = ½ Σ c (n·E n) |ξ| n⊗n V.
fn lattice_response(
    count: usize,
    horizon: f64,
    strain: [[f64; 3]; 3],
    micromodulus: impl Fn(f64) -> f64,
) -> (f64, [f64; 6]) {
    let reach = horizon as i32;
    let range = |k: usize| if k < count { -reach..=reach } else { 0..=0 };
    let (mut energy, mut stress) = (0.0, [0.0; 6]);
    for z in range(2) {
        for y in range(1) {
            for x in range(0) {
                let offset = [x, y, z].map(f64::from);
                let length = offset.iter().map(|x| x * x).sum::<f64>().sqrt();
                if length == 0.0 || length > horizon * (1.0 + 1e-9) {
                    continue;
                }
                let normal = offset.map(|x| x / length);
                let mut stretch = 0.0;
                for a in 0..3 {
                    for b in 0..3 {
                        stretch += strain[a][b] * normal[a] * normal[b];
                    }
                }
                let c = micromodulus(length);
                energy += 0.25 * c * stretch * stretch * length;
                for (k, (a, b)) in [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)]
                    .into_iter()
                    .enumerate()
                {
                    stress[k] += 0.5 * c * stretch * length * normal[a] * normal[b];
                }
            }
        }
    }
    (energy, stress)
}

#[test]
fn bond_based_laws_under_every_strain() {
    let tiny = 1e-7;
    let (horizon, modulus) = (3.0, 5.0);
    let pi = std::f64::consts::PI;
    for (dimension, count, section, c, energy, bulk_energy) in [
        // The last three numbers are for E = 1: c, the classical energy density at unit isotropic stretch,
        // and 9K/4 for the form `diehl2016`.
        ("uniaxial-strain", 1, 1.0, 12.0 / (5.0 * 9.0), 0.6, 0.0),
        ("uniaxial-stress", 1, 1.0, 2.0 / 9.0, 0.5, 0.0),
        ("1d", 1, 1.0, 2.0 / 9.0, 0.5, 0.0),
        (
            "plane-stress",
            2,
            0.5,
            6.0 / (pi * 27.0 * (2.0 / 3.0) * 0.5),
            1.5,
            2.25,
        ),
        (
            "plane-strain",
            2,
            0.5,
            48.0 / (5.0 * pi * 27.0 * 0.5),
            1.6,
            1.5,
        ),
        ("3d", 3, 1.0, 12.0 / (pi * 81.0), 3.0, 1.5),
    ] {
        let (c, energy, bulk_energy) = (c * modulus, energy * modulus, bulk_energy * modulus);
        let sum = |of: fn(f64) -> f64| {
            // The energy at unit stretch is ¼ Σ c r V, so c = 4 of(r)/r gives Σ of(r) V.
            let isotropic = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
            section * lattice_response(count, horizon, isotropic, |r| 4.0 * of(r) / r).0
        };
        let (lengths, volume) = (sum(|r| r), sum(|_| 1.0));
        let plain = move |_: f64| c;
        let normalised = move |_: f64| 4.0 * energy / lengths;
        let printed = move |r: f64| 4.0 * bulk_energy / volume / r;
        let general = |r: f64| 0.02 * (-r).exp() * r.powi(3);
        type Micromodulus<'a> = &'a dyn Fn(f64) -> f64;
        let laws: [(&str, Micromodulus); 8] = [
            ("pmb = { density = 1, youngs_modulus = 5 }", &plain),
            ("proportional = { density = 1, youngs_modulus = 5 }", &plain),
            (
                "pmb = { density = 1, youngs_modulus = 5, surface_correction = 'energy' }",
                &normalised,
            ),
            (
                "normalised_pmb = { density = 1, youngs_modulus = 5 }",
                &normalised,
            ),
            (
                "normalised_pmb = { density = 1, youngs_modulus = 5, form = 'diehl2016' }",
                &printed,
            ),
            (
                "linear_microelastic = { density = 1, youngs_modulus = 5 }",
                &plain,
            ),
            (
                "linear_microelastic = { density = 1, youngs_modulus = 5, surface_correction = 'energy' }",
                &normalised,
            ),
            (
                "linear_microelastic = { density = 1, youngs_modulus = 5, lambda = '0.02*exp(-r)' }",
                &general,
            ),
        ];
        for (law, micromodulus) in laws {
            if count == 1 && law.contains("diehl2016") {
                continue;
            }
            let thickness = if count == 2 { "thickness = 0.5\n" } else { "" };
            // Two horizons to each side, so that the neighbours have complete families.
            let deck = format!("{thickness}{}", deck(dimension, horizon, 6, "none", law));
            // Each component alone: a stretch along an axis, or a shear of two axes.
            for (a, b) in [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)] {
                if b >= count {
                    continue;
                }
                let mut strain = [[0.0; 3]; 3];
                strain[a][b] = tiny;
                strain[b][a] = tiny;
                let map = move |x: [f64; 3]| {
                    std::array::from_fn(|i| x[i] + (0..3).map(|j| strain[i][j] * x[j]).sum::<f64>())
                };
                let (energy, stress, _) = match count {
                    1 => simulate::<1, _>(&deck, |mut s| response(&mut s, map)),
                    2 => simulate::<2, _>(&deck, |mut s| response(&mut s, map)),
                    _ => simulate::<3, _>(&deck, |mut s| response(&mut s, map)),
                };
                let (expected, tensor) =
                    lattice_response(count, horizon, strain, |r| section * micromodulus(r));
                let case = format!("{dimension} {law} {a}{b}");
                assert!(
                    (energy / expected - 1.0).abs() < 1e-5,
                    "{case}: {energy} {expected}"
                );
                let scale = tensor
                    .iter()
                    .fold(0.0_f64, |scale, entry| scale.max(entry.abs()));
                for (k, (found, expected)) in stress.iter().zip(tensor).enumerate() {
                    // The normal stress perpendicular to the plane or bar is not a sum over bonds.
                    let along = !(count..3).contains(&k);
                    assert!(
                        !along || (found - expected).abs() < 1e-5 * scale,
                        "{case}: {stress:?} {tensor:?}"
                    );
                }
            }
        }
    }
}

/// Return the phase speed (m/s) of a plane wave along x, from the force on the central point.
fn phase_speed<const D: usize>(deck: &str, wave_number: f64, density: f64) -> f64 {
    simulate::<D, _>(deck, |mut simulation| {
        let amplitude = 1e-6 / wave_number;
        displace(&mut simulation, |[x, y, z]| {
            [x + amplitude * (wave_number * x).cos(), y, z]
        });
        let force = simulation.fields.internal_force[0][centre(&simulation)];
        (-force / (density * amplitude)).sqrt() / wave_number
    })
}

#[test]
fn long_waves_on_a_cubic_lattice_have_the_speed_of_the_lattice_sum() {
    let exact = (1.8_f64 * 2.0 / 3.0).sqrt();
    let found = |law: &str, horizon: f64, halves: u32| {
        let law = format!("{law} = {{ density = 3, bulk_modulus = 2 }}");
        let deck = deck("3d", horizon, halves * horizon as u32, "none", &law);
        phase_speed::<3>(&deck, 0.05 / horizon, 3.0) / exact
    };
    for (horizon, plain, normalised) in [
        (2.52, 1.130, 1.001),
        (3.0, 1.028, 0.971),
        (4.0, 0.967, 0.995),
        (6.0, 1.004, 0.990),
    ] {
        let ratio = found("pmb", horizon, 1);
        assert!(
            (ratio / plain - 1.0).abs() < 0.005,
            "pmb, m = {horizon}: {ratio}"
        );
        let ratio = found("normalised_pmb", horizon, 2);
        assert!(
            (ratio / normalised - 1.0).abs() < 0.005,
            "normalised, m = {horizon}: {ratio}"
        );
    }
}

#[test]
fn waves_in_a_bar_disperse_as_the_integral_says() {
    // ω² = 4M/(ρδ²) Cin(kδ), with the modulus M of uniaxial strain and Cin(x) = ∫₀ˣ (1 − cos t)/t dt.
    let modulus: f64 = 1.2 * 5.0;
    for (number, expected) in [
        (0.5, 0.9948),
        (1.0, 0.9794),
        (2.0, 0.9205),
        (std::f64::consts::PI, 0.8173),
    ] {
        let law = "proportional = { density = 3, youngs_modulus = 5 }";
        for correction in ["linear", "exact"] {
            let deck = deck("uniaxial-strain", 60.0, 70, correction, law);
            let found = phase_speed::<1>(&deck, number / 60.0, 3.0) / (modulus / 3.0).sqrt();
            assert!((found / expected - 1.0).abs() < 0.005, "{number}: {found}");
        }
    }
}

#[test]
fn gauss_points_integrate_a_cell() {
    // Two points per direction integrate cubic polynomials exactly: ∫ x² and ∫ x²y² over [−3/2, 3/2]²,
    // thickness 0.5 m.
    let text = "dimension = 'plane-strain'
        thickness = 0.5
        [grid]
        volume_correction = 'none'
        spacing = 1
        horizon = 1.5
        quadrature = 'gauss'
        origin = [0.5, 0.5]
        [material]
        rubber.proportional = { density = 1, youngs_modulus = 5 }
        [body.block]
        material = 'rubber'
        shape.box = { lower = [-1.5, -1.5], upper = [1.5, 1.5] }
        [time]
        end = 1
        ";
    simulate::<2, _>(text, |simulation| {
        let model = &simulation.model;
        assert_eq!(model.owned(), 36);
        let integral = |of: fn([f64; 3]) -> f64| {
            let values = (0..36).map(|k| of(model.position(k)) * model.volume[k]);
            values.sum::<f64>()
        };
        assert!((integral(|_| 1.0) / 4.5 - 1.0).abs() < 1e-12);
        assert!((integral(|[x, _, _]| x * x) / 3.375 - 1.0).abs() < 1e-12);
        assert!((integral(|[x, y, _]| x * x * y * y) / 2.53125 - 1.0).abs() < 1e-12);
    });
}

/// Bonds that a pre-crack cuts reduce the dilatation no more than bonds that a free side lacks.
#[test]
fn the_dilatation_beside_a_pre_crack_is_the_trace_of_the_strain() {
    for law in [
        "pmb = { density = 2, youngs_modulus = 5, surface_correction = 'tensor' }",
        "pmb = { density = 2, youngs_modulus = 5 }",
        "ordinary = { density = 2, youngs_modulus = 5, poisson_ratio = 0.25 }",
        "ordinary = { density = 2, youngs_modulus = 5, poisson_ratio = 0.25, surface_correction = 'pals' }",
        "correspondence = { density = 2, youngs_modulus = 5, poisson_ratio = 0.25 }",
    ] {
        let deck = deck("plane-strain", 3.0, 6, "none", law);
        let crack = "[crack.main.segment]\nfrom = [-7, 0.5]\nto = [7, 0.5]\n";
        simulate::<2, _>(&format!("{deck}\n{crack}"), |mut simulation| {
            displace(&mut simulation, |x| x.map(|x| 1.001 * x));
            let snapshot = Snapshot::new(&mut simulation);
            for dilatation in snapshot.field(&mut simulation, Field::Dilatation) {
                assert!(
                    (dilatation / 0.002 - 1.0).abs() < 1e-9,
                    "{law}: {dilatation}"
                );
            }
        });
    }
}
