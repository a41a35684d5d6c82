//! Small variants of the decks of contact in `inputs/`.

use crate::support::history::{column, row};
use crate::support::simulate_input;
use fissure::solver::Simulation;
use fissure::solver::observers::HistoryObserver;

/// The named columns at the end of a run, and at its middle.
fn ends(mut simulation: Simulation<'_, 3>, names: &[&str]) -> [Vec<f64>; 2] {
    let mut observer = HistoryObserver::new(&simulation).unwrap();
    let places: Vec<usize> = names.iter().map(|name| column(&observer, name)).collect();
    let mut look = |simulation: &mut Simulation<'_, 3>| -> Vec<f64> {
        let values = row(&mut observer, simulation).values;
        places.iter().map(|place| values[*place]).collect()
    };
    // The history needs its first row.
    look(&mut simulation);
    let mut middle = None;
    while !simulation.is_over() {
        simulation.advance();
        simulation.check().unwrap_or_else(|error| panic!("{error}"));
        let is_half = simulation.clock.time() >= 0.5 * simulation.clock.end();
        if is_half && simulation.load_step.is_settled && middle.is_none() {
            middle = Some(look(&mut simulation));
        }
    }
    [middle.unwrap(), look(&mut simulation)]
}

/// The force on the sphere at the end of `hertz.toml` over that of Hertz, with n spacings in the radius of contact and a
/// layer of contact that is k times as stiff as the block.
fn over_hertz(n: &str, k: &str) -> f64 {
    simulate_input::<3, _>("hertz", &[("n", n), ("k", k)], |simulation| {
        let names = ["time", "rigid_sphere_force_z", "residual"];
        let [_, last] = ends(simulation, &names);
        assert!(last[0] == 1.0 && last[2] <= 1e-4, "{last:?}");
        // E = 1 Pa, ν = 1/4, R = 1 m, d = 0.04 m.
        last[1] / (4.0 / 3.0 / (1.0 - 0.0625) * 0.04_f64.powf(1.5))
    })
}

#[test]
fn a_rigid_sphere_on_a_half_space_has_the_force_of_hertz() {
    // With a stiff layer the block alone is left.
    let stiff = over_hertz("2", "50");
    assert!((stiff - 1.0).abs() < 0.05, "{stiff}");
    // The default layer of contact, half a horizon of the same material, lies in series with it.
    let soft = over_hertz("2", "1");
    let [coarse, fine] = ["2", "3"].map(|n| over_hertz(n, "1.2*m"));
    assert!(
        soft < coarse && coarse < fine && fine < 1.0,
        "{soft} {coarse} {fine}"
    );
    assert!((fine - 1.0).abs() < 0.1, "{fine}");
    // The layer is thinner at the finer resolution.
    let ratio = (1.0 - coarse) / (1.0 - fine);
    assert!(ratio > 1.3, "{coarse} {fine}");
}

#[test]
fn an_indenter_breaks_glass_and_is_pulled_back() {
    let names = [
        "energy_error",
        "external_work",
        "kinetic_energy",
        "fracture_energy",
        "rigid_indenter_position_z",
        "rigid_indenter_force_z",
        "momentum_z",
    ];
    simulate_input::<3, _>("indenter", &[("dx", "1e-3")], |simulation| {
        let [middle, last] = ends(simulation, &names);
        assert!(last[3] > 0.01 * last[1], "{last:?}");
        assert!(last[0].abs() < 0.02 * last[1], "{last:?}");
        // Deepest in the middle, back at the start in the end.
        assert!(
            middle[4] < 0.0 && (last[4] - 1.5e-3).abs() < 1e-9,
            "{middle:?} {last:?}"
        );
        assert!(last[5] == 0.0 && last[6] < 0.0, "{last:?}");
    });
}

#[test]
fn a_tube_breaks_alike_on_a_lattice_and_not_with_scatter() {
    let parameters = |jitter, modulus| {
        [
            ("dx", "2.5e-3"),
            ("height", "20e-3"),
            ("end", "60e-6"),
            ("grid.jitter", jitter),
            ("damage.brittle.critical_stretch.weibull_modulus", modulus),
        ]
    };
    let names = [
        "energy_error",
        "kinetic_energy",
        "fracture_energy",
        "momentum_x",
        "momentum_y",
    ];
    // As fractions: error of the energy, sideways momentum.
    let run = |jitter, modulus| {
        simulate_input::<3, _>(
            "fragmenting_cylinder",
            &parameters(jitter, modulus),
            |simulation| {
                let [_, last] = ends(simulation, &names);
                assert!(last[2] > 0.1 * last[1], "{last:?}");
                assert!(last[0].abs() < 0.02 * last[1], "{last:?}");
                last[3].abs() + last[4].abs()
            },
        )
    };
    // The tube has a momentum of 0.1 kg times 200 m/s in each direction, which cancels.
    let [lattice, scattered] = [run("0", "1e9"), run("0.1", "20")];
    assert!(lattice < 1e-12, "{lattice}");
    assert!((1e-6..0.1).contains(&scattered), "{scattered}");
}
