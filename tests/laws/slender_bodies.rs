//! Stiffness of bars with few points across, in tension, bending and torsion, compared with beam theory, and
//! stable steps with surface corrections.

use fissure::solver::Simulation;
use fissure::solver::observers::HistoryObserver;

use crate::support::history::row;
use crate::support::simulate;

const YOUNG: f64 = 1e9;
const RATIO: f64 = 0.25;
const SHEAR: f64 = YOUNG / (2.0 * (1.0 + RATIO));

/// Load case of a bar along x.
#[derive(Debug, Clone, Copy)]
enum Load {
    Torsion,
    Bending,
    Tension,
}

impl Load {
    /// Return the displacement of both ends for a curvature or twist k (1/m) or a strain k, with the lateral
    /// displacements of beam theory.
    fn displacement(self) -> &'static str {
        match self {
            Self::Torsion => "['free', '-k*x*z', 'k*x*y']",
            Self::Bending => "['-k*x*y', 'k*(x^2 + 0.25*(y^2 - z^2))/2', 'k*0.25*y*z']",
            Self::Tension => "['k*x', '-k*0.25*y', '-k*0.25*z']",
        }
    }

    /// Return the stiffness of a beam with a square section of this edge: G J and E I (N m²), E A (N).
    fn stiffness(self, edge: f64) -> f64 {
        match self {
            Self::Torsion => 0.140577 * SHEAR * edge.powi(4),
            Self::Bending => YOUNG * edge.powi(4) / 12.0,
            Self::Tension => YOUNG * edge.powi(2),
        }
    }
}

/// Return the stiffness of the middle of a square bar divided by the stiffness of the beam. `across` is the
/// number of points across, with unit spacing. The difference of the strain energies of two lengths
/// eliminates the ends.
fn stiffness((law, correction): (&str, &str), across: u32, load: Load) -> f64 {
    let curvature = 1e-4 / f64::from(across);
    let energy = |length: u32| {
        let (half_length, half) = (f64::from(length) / 2.0, f64::from(across) / 2.0);
        let text = format!(
            "dimension = '3d'
            parameters.k = {curvature}
            grid = {{ spacing = 1, horizon = 3.015, volume_correction = '{correction}', origin = [-{half_length}, -{half}, -{half}] }}
            material.solid.{law}
            body.bar = {{ material = 'solid', shape.box = {{ lower = [-{half_length}, -{half}, -{half}], upper = [{half_length}, {half}, {half}] }} }}
            set.ends.where = 'abs(x) > {half_length} - 4'
            condition.ends = {{ set = 'ends', displacement = {} }}
            time = {{ end = 1, method = 'relaxation', relaxation = {{ load_steps = 1, tolerance = 1e-5 }} }}
            ",
            load.displacement()
        );
        simulate::<3, _>(&text, |mut simulation: Simulation<3>| {
            let mut history = HistoryObserver::new(&simulation).unwrap();
            while !simulation.is_over() {
                simulation.advance();
                simulation.check().unwrap();
            }
            row(&mut history, &mut simulation).energies.strain
        })
    };
    let lengths = [3 * across + 8, 5 * across + 8];
    let [short, long] = lengths.map(energy);
    let by_length = (long - short) / f64::from(lengths[1] - lengths[0]);
    by_length / (0.5 * load.stiffness(f64::from(across)) * curvature * curvature)
}

/// Check correspondence bars with this many points across. `rows` has the expected stiffnesses in torsion and
/// bending for each control.
fn check(across: u32, rows: &[(&str, [f64; 2])]) {
    for (control, wanted) in rows {
        let law = format!(
            "correspondence = {{ density = 1000, youngs_modulus = {YOUNG}, poisson_ratio = {RATIO}, {control} }}"
        );
        for (load, wanted) in [Load::Torsion, Load::Bending].into_iter().zip(wanted) {
            let found = stiffness((&law, "none"), across, load);
            println!("{across} {control} {load:?}: {found:.3}");
            assert!(
                (found - wanted).abs() < 0.011,
                "{across} {control} {load:?}: {found}"
            );
        }
    }
}

#[test]
fn bars_of_four_points() {
    check(
        4,
        &[
            ("zero_energy = 'dispersion'", [0.90, 0.77]),
            ("zero_energy = 'wan2019'", [5.68, 3.83]),
        ],
    );
}

#[test]
fn bars_of_six_and_ten_points() {
    check(
        6,
        &[
            ("zero_energy = 'dispersion'", [1.04, 0.83]),
            ("zero_energy = 'wan2019'", [3.24, 2.14]),
            ("zero_energy = 'silling2017'", [4.52, 2.99]),
            ("zero_energy = 'none'", [0.50, 0.51]),
        ],
    );
    check(10, &[("zero_energy = 'dispersion'", [1.00, 0.93])]);
}

/// The expected values come from independent programs, which solve the cross-section problem of an infinite
/// bar with m = 3.
#[test]
fn surface_corrections_of_bars() {
    for (law, correction, across, wanted) in [
        ("pmb", "none", 4, [0.71, 0.50]),
        ("pmb", "energy", 4, [1.45, 1.12]),
        ("pmb", "directional", 4, [1.12, 0.86]),
        ("pmb", "directional", 6, [1.08, 0.96]),
        ("pmb", "tensor", 4, [1.01, 0.80]),
        ("pmb", "tensor", 6, [1.02, 0.90]),
        ("ordinary", "none", 4, [1.47, 1.09]),
        ("ordinary", "pals", 4, [0.986, 0.695]),
        ("ordinary", "pals", 6, [0.987, 0.822]),
    ] {
        let table = format!(
            "{law} = {{ density = 1000, youngs_modulus = {YOUNG}, poisson_ratio = {RATIO}, surface_correction = '{correction}' }}"
        );
        for (load, wanted) in [Load::Tension, Load::Bending].into_iter().zip(wanted) {
            let found = stiffness((&table, "exact"), across, load);
            println!("{law} {across} {correction} {load:?}: {found:.3}");
            assert!(
                (found - wanted).abs() < 0.011,
                "{law} {across} {correction} {load:?}: {found}"
            );
        }
    }
}

/// With a surface correction, the edges and corners of a block limit its stable step. A bound that does not
/// depend on the directions of the bonds would give ratios of 0.52 for "tensor" and 0.24 for "pals".
#[test]
fn stable_steps_with_surface_corrections() {
    let stable_step = |law: &str, correction: &str| {
        let text = format!(
            "dimension = '3d'
            grid = {{ spacing = 1, horizon = 3.015 }}
            material.solid.{law} = {{ density = 1000, youngs_modulus = {YOUNG}, poisson_ratio = {RATIO}, surface_correction = '{correction}' }}
            body.block = {{ material = 'solid', shape.box = {{ lower = [0, 0, 0], upper = [12, 10, 10] }} }}
            time.end = 1
            "
        );
        simulate::<3, _>(&text, |simulation: Simulation<3>| {
            simulation.undeformed.stable_step
        })
    };
    for (law, correction, least) in [
        ("pmb", "directional", 0.87),
        ("pmb", "tensor", 0.88),
        ("ordinary", "directional", 0.81),
        ("ordinary", "pals", 0.28),
    ] {
        let ratio = stable_step(law, correction) / stable_step(law, "none");
        assert!((least..1.0).contains(&ratio), "{law} {correction}: {ratio}");
    }
}
