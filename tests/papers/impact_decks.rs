//! Small variants of the contact decks in `inputs/`.

use std::fmt::Write as _;
use std::path::Path;

use crate::support::command::Folder;
use crate::support::history::{column, row};
use crate::support::simulate_input;
use fissure::comm::threads;
use fissure::deck;
use fissure::solver::Simulation;
use fissure::solver::observers::HistoryObserver;

/// Run a simulation, and return the named columns at half of the time and at the end.
fn ends(mut simulation: Simulation<'_, 3>, names: &[&str]) -> [Vec<f64>; 2] {
    let mut observer = HistoryObserver::new(&simulation).unwrap();
    let places: Vec<usize> = names.iter().map(|name| column(&observer, name)).collect();
    let mut look = |simulation: &mut Simulation<'_, 3>| -> Vec<f64> {
        let values = row(&mut observer, simulation).values;
        places.iter().map(|place| values[*place]).collect()
    };
    // Energy errors are relative to the first row.
    look(&mut simulation);
    let mut middle = None;
    while !simulation.is_over() {
        simulation.advance();
        simulation.check().unwrap_or_else(|error| panic!("{error}"));
        let is_half = simulation.clock.time() >= 0.5 * simulation.clock.end();
        if is_half && simulation.progress.load_step.is_settled && middle.is_none() {
            middle = Some(look(&mut simulation));
        }
    }
    [middle.unwrap(), look(&mut simulation)]
}

/// Run a simulation, and return the named columns after every `every` steps or load steps.
fn series<const D: usize>(
    mut simulation: Simulation<'_, D>,
    names: &[&str],
    every: u64,
) -> Vec<Vec<f64>> {
    let mut observer = HistoryObserver::new(&simulation).unwrap();
    let places: Vec<usize> = names.iter().map(|name| column(&observer, name)).collect();
    // Energy errors are relative to the first row.
    row(&mut observer, &mut simulation);
    let mut rows = Vec::new();
    while !simulation.is_over() {
        simulation.advance();
        simulation.check().unwrap_or_else(|error| panic!("{error}"));
        let is_due = simulation.clock.number().is_multiple_of(every) || simulation.is_over();
        if simulation.progress.load_step.is_settled && is_due {
            let values = row(&mut observer, &mut simulation).values;
            rows.push(places.iter().map(|place| values[*place]).collect());
        }
    }
    rows
}

/// Return the force on the sphere at the end of `hertz.toml`, divided by the force of Hertz. The radius of
/// contact has n spacings; the contact layer is k times as stiff as the block.
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
    // With a stiff layer, only the block deforms.
    let stiff = over_hertz("2", "50");
    assert!((stiff - 1.0).abs() < 0.05, "{stiff}");
    // The default contact layer, half a horizon of the same material, is in series with the block.
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

/// Return the points of `inputs/sphere.csv` with n spacings in the radius, as `inputs/sphere_points` does.
fn sphere_points(n: usize) -> String {
    let spacing = 1.0 / n as f64;
    let centre = |i: usize| (i as f64 + 0.5) * spacing - 1.0;
    let mut text = String::from("x,y,z,volume\n");
    for (x, y) in (0..4 * n * n).map(|k| (centre(k / (2 * n)), centre(k % (2 * n)))) {
        let square = 1.0 - x * x - y * y;
        if square <= 0.0 {
            continue;
        }
        let height = 2.0 * square.sqrt();
        let cells = (height / spacing).round().max(1.0);
        for cell in 0..cells as usize {
            let z = ((cell as f64 + 0.5) / cells - 0.5) * height;
            let volume = spacing * spacing * height / cells;
            writeln!(text, "{x},{y},{z},{volume}").unwrap();
        }
    }
    text
}

/// Return the largest relative deviation from the force of Hertz at an approach of 0.02 to 0.04 radii.
fn sphere_error(n: usize, file: &Path) -> f64 {
    let n = n.to_string();
    let set = [
        ("n", n.as_str()),
        ("body.sphere.points.file", file.to_str().unwrap()),
    ];
    simulate_input::<3, _>("sphere_between_plates", &set, |simulation| {
        let names = [
            "time",
            "rigid_upper_force_z",
            "rigid_lower_force_z",
            "residual",
        ];
        let rows = series(simulation, &names, 1);
        assert_eq!(rows.len(), 4);
        let error = |row: &Vec<f64>| {
            let [time, upper, lower, residual] = row[..] else {
                unreachable!()
            };
            // A residual of 1e-4 of all forces permits a difference of 0.6 % between the forces of the two
            // plates.
            assert!(residual <= 1e-4 && (upper + lower).abs() < 1e-2 * upper);
            // E = 1 Pa, ν = 1/4, R = 1 m.
            (upper / (4.0 / 3.0 / (1.0 - 0.0625) * (0.04 * time).powf(1.5)) - 1.0).abs()
        };
        rows[1..].iter().map(error).fold(0.0, f64::max)
    })
}

#[test]
fn an_elastic_sphere_between_rigid_plates_has_the_force_of_hertz() {
    let folder = Folder::new("sphere");
    let [coarse, fine] = [6, 12].map(|n| {
        let file = folder.write(&format!("{n}.csv"), &sphere_points(n));
        sphere_error(n, &file)
    });
    let inputs = Path::new(env!("CARGO_MANIFEST_DIR")).join("inputs/sphere.csv");
    let middle = sphere_error(10, &inputs);
    assert!(middle < 0.1, "{middle}");
    assert!(fine < middle && middle < coarse, "{coarse} {middle} {fine}");
}

/// Return the angle between crack and notch (degrees), and the largest mean speed of the crack over 10 mm
/// (m/s). The angle is that of the line from the tip of the notch to the crack tip 40 mm above.
fn kalthoff(simulation: Simulation<'_, 3>) -> [f64; 2] {
    let names = ["time", "tip_upper_x", "tip_upper_y"];
    let rows = series(simulation, &names, 1);
    // Return the row in which the crack reaches a height above the notch (m).
    let passes = |height: f64| {
        let row = rows.iter().find(|row| row[2] >= 0.025 + height);
        row.expect("a crack leaves the notch")
    };
    let end = passes(0.04);
    let angle = (end[2] - 0.025).atan2(end[1] - 0.05).to_degrees();
    let speed = |k: u32| {
        let [from, to] = [0.01 * f64::from(k), 0.01 * f64::from(k + 1)].map(passes);
        (to[1] - from[1]).hypot(to[2] - from[2]) / (to[0] - from[0])
    };
    [angle, (1..4).map(speed).fold(0.0, f64::max)]
}

#[test]
fn a_projectile_and_its_prescribed_velocity_drive_the_same_crack_out_of_a_notch() {
    let set = [("dx", "2.5e-3"), ("end", "75e-6")];
    let [angle, speed] = simulate_input::<3, _>("kalthoff_winkler", &set, kalthoff);
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("inputs");
    let set = set.map(|(name, value)| (name.to_owned(), value.to_owned()));
    let overlay = folder.join("overlays/kalthoff_prescribed_velocity.toml");
    let deck = deck::read_with(&folder.join("kalthoff_winkler.toml"), &[overlay], &set);
    let problem = deck.and_then(|deck| deck.problem()).unwrap();
    let comm = threads::alone();
    let [prescribed, prescribed_speed] = kalthoff(Simulation::new(&problem, &comm).unwrap());
    // The angle is 62 degrees with half of the spacing and 70 in the experiment. The Rayleigh speed is 2800
    // m/s.
    for angle in [angle, prescribed] {
        assert!((52.0..70.0).contains(&angle), "{angle} {prescribed}");
    }
    for speed in [speed, prescribed_speed] {
        assert!(
            (1200.0..2800.0).contains(&speed),
            "{speed} {prescribed_speed}"
        );
    }
    assert!((angle - prescribed).abs() < 5.0, "{angle} {prescribed}");
}

#[test]
fn a_crack_whose_faces_slide_runs_at_the_load_of_a_beam() {
    let names = [
        "time",
        "reaction_middle_y",
        "probe_left_displacement_y",
        "probe_middle_displacement_y",
        "probe_right_displacement_y",
        "tip_crack_length",
        "friction_energy",
        "contact_faces_touching_pairs",
        "energy_error",
        "external_work",
    ];
    let set = [("dx", "0.6e-3"), ("depth", "0.24e-3")];
    simulate_input::<2, _>("end_notched_flexure", &set, |simulation| {
        let rows = series(simulation, &names, 50);
        // Compliance and critical load of beam theory; see the deck.
        let (half_span, half, crack, modulus) = (30e-3_f64, 3e-3_f64, 15e-3_f64, 72e9);
        let bending = (2.0 * half_span.powi(3) + 3.0 * crack.powi(3)) / (8.0 * half.powi(3));
        let shear = 0.3 * half_span / half * 2.0 * (1.0 + 1.0 / 3.0);
        let compliance = (bending + shear) / modulus;
        let critical = 4.0 * half / (3.0 * crack) * (100.0 * modulus * half).sqrt();
        let deflection = |row: &Vec<f64>| 0.5 * (row[2] + row[4]) - row[3];
        // Mean between 0.4 and 0.9 of the critical load, because the beam vibrates slightly.
        let before: Vec<&Vec<f64>> = rows
            .iter()
            .filter(|row| (0.4..0.9).contains(&(-row[1] / critical)) && row[5] < 0.016)
            .collect();
        assert!(before.len() > 20, "{}", before.len());
        let mean = |of: &dyn Fn(&Vec<f64>) -> f64| before.iter().map(|row| of(row)).sum::<f64>();
        let ratio = mean(&deflection) / mean(&|row| -row[1]) / compliance;
        assert!((0.88..1.0).contains(&ratio), "{ratio}");
        for row in &before {
            assert!(row[6] > 0.0 && row[7] > 0.0, "{row:?}");
        }
        // The crack jumps by at least 5 mm, and does not grow before the jump.
        let runs = rows.iter().position(|row| row[5] > 0.02).unwrap();
        let load = -rows[..runs].iter().map(|row| row[1]).fold(0.0, f64::min) / critical;
        assert!((1.0..1.5).contains(&load), "{load}");
        let last = rows.last().unwrap();
        assert!(last[8].abs() < 0.005 * last[9], "{last:?}");
    });
}

#[test]
fn a_copper_bar_that_hits_a_wall_becomes_as_short_as_in_finite_elements() {
    let names = [
        "field_top_mean",
        "field_foot_maximum",
        "singular_points",
        "energy_error",
        "dissipated_energy",
        "kinetic_energy",
    ];
    simulate_input::<3, _>("taylor_bar", &[("n", "20")], |simulation| {
        let [_, last] = ends(simulation, &names);
        // Final length (mm), from the last layer of points. Finite elements give 21.4 to 21.5; a finer
        // lattice is closer.
        let length = 32.4 + 1e3 * last[0];
        assert!((21.4..22.7).contains(&length), "{length}");
        // Radius of the foot (mm), from the points 1.5 spacings from the axis. Finite elements give 7.0 to
        // 7.2.
        let stretch = 1.0 + last[1] / (1.5 * 32.4e-3 / 20.0);
        assert!((6.4..7.6).contains(&(3.2 * stretch)), "{stretch}");
        // Nearly all of the energy is dissipated.
        assert!(last[2] == 0.0 && last[5] < 0.01 * last[4], "{last:?}");
        assert!(last[3].abs() < 1e-3 * last[4], "{last:?}");
    });
}

#[test]
fn a_copper_bar_that_hardens_by_its_rate_becomes_about_as_short_as_in_the_experiment() {
    let names = [
        "field_top_mean",
        "field_foot_maximum",
        "energy_error",
        "dissipated_energy",
        "kinetic_energy",
    ];
    simulate_input::<3, _>("taylor_bar_johnson_cook", &[("n", "20")], |simulation| {
        let [_, last] = ends(simulation, &names);
        // Final length (mm). The experiment gave 16.2; a finer lattice is closer.
        let length = 25.4 + 1e3 * last[0];
        assert!((16.2..18.0).contains(&length), "{length}");
        // Radius of the foot (mm), from the points 2.5 spacings from the axis. The experiment gave 6.75.
        let radius = 3.81 * (1.0 + last[1] / (2.5 * 25.4e-3 / 20.0));
        assert!((6.5..7.5).contains(&radius), "{radius}");
        // Nearly all of the energy is dissipated.
        assert!(last[4] < 0.01 * last[3], "{last:?}");
        assert!(last[2].abs() < 1e-3 * last[3], "{last:?}");
    });
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
        // The indenter is deepest at half of the time, and back at its initial position at the end.
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
    // Return the sum of the absolute lateral components of the momentum, kg m/s.
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
    // The momenta of the tube, 0.1 kg times 200 m/s in each direction, cancel.
    let [lattice, scattered] = [run("0", "1e9"), run("0.1", "20")];
    assert!(lattice < 1e-12, "{lattice}");
    assert!((1e-6..0.1).contains(&scattered), "{scattered}");
}
