//! Bodies in motion: conservation, order of the integrator, wave speed, the stable step, supports.

use crate::support::history::{column, row};
use crate::support::simulate;
use fissure::solver::Simulation;
use fissure::solver::observers::HistoryObserver;

/// Return the deck of an elastic block that is stretched, rotates and translates.
fn flying_block(step: f64) -> String {
    flying("pmb = { density = 2, youngs_modulus = 5 }", step)
}

/// Return the deck of a block of a law that is stretched, rotates and translates.
fn flying(law: &str, step: f64) -> String {
    format!(
        "dimension = '3d'
        grid = {{ volume_correction = 'none', spacing = 1, horizon = 3 }}
        material.rubber.{law}
        body.block = {{ material = 'rubber', shape.box = {{ lower = [0, 0, 0], upper = [8, 6, 5] }} }}
        [initial.motion]
        displacement = ['0.02*x', '-0.01*y*z/5', 0]
        velocity = ['1 - 0.02*y', '0.02*x', '0.01*x*y/8']
        [time]
        end = 8
        step = {step}
        "
    )
}

#[test]
fn momentum_is_constant_to_rounding() {
    simulate::<3, _>(&flying_block(0.08), |mut simulation| {
        let mut observer = HistoryObserver::new(&simulation).unwrap();
        let start = row(&mut observer, &mut simulation);
        while simulation.clock.number() < simulation.clock.last() {
            simulation.advance();
        }
        let end = row(&mut observer, &mut simulation);
        let total = 2.0 * 240.0;
        for axis in ["x", "y", "z"] {
            let column = column(&observer, &format!("momentum_{axis}"));
            let change = (end.values[column] - start.values[column]).abs();
            assert!(change < 1e-12 * total, "component {axis}: {change}");
        }
        let along = start.values[column(&observer, "momentum_x")];
        assert!(
            (along - total * 0.94).abs() < 1e-9,
            "mean velocity 1 − 0.02·3"
        );
    });
}

/// Laws with their variants, without and with damping.
const LAWS: [&str; 7] = [
    "pmb = { density = 2, youngs_modulus = 5 }",
    "normalised_pmb = { density = 2, youngs_modulus = 5 }",
    "normalised_pmb = { density = 2, youngs_modulus = 5, form = 'diehl2016' }",
    "linear_microelastic = { density = 2, youngs_modulus = 5 }",
    "ordinary = { density = 2, youngs_modulus = 5, poisson_ratio = 0.1 }",
    "ordinary = { density = 2, youngs_modulus = 5, poisson_ratio = 0.4, influence = 'linear' }",
    "pmb = { density = 2, youngs_modulus = 5, damping = 0.2 }",
];

#[test]
fn energy_drift_falls_by_four_when_the_step_halves() {
    for law in LAWS {
        let largest_error = |step: f64| {
            simulate::<3, _>(&flying(law, step), |mut simulation| {
                let mut observer = HistoryObserver::new(&simulation).unwrap();
                row(&mut observer, &mut simulation);
                let mut largest = 0.0_f64;
                while simulation.clock.number() < simulation.clock.last() {
                    simulation.advance();
                    largest = largest.max(row(&mut observer, &mut simulation).energies.error.abs());
                }
                largest
            })
        };
        let ratio = largest_error(0.08) / largest_error(0.04);
        assert!((3.6..4.4).contains(&ratio), "{law}: {ratio}");
    }
}

#[test]
fn a_steady_load_keeps_the_total_energy() {
    // Emmrich & Weckner 2006, section 2: E_kin + E_el + E_ext is constant, with E_ext = −∫ b·u.
    for law in ["pmb", "linear_microelastic", "ordinary"] {
        let nu = if law == "ordinary" {
            ", poisson_ratio = 0.1"
        } else {
            ""
        };
        let drift = |step: f64| {
            let law = format!("{law} = {{ density = 2, youngs_modulus = 5{nu} }}");
            let text = format!(
                "{}
                [condition.load]
                set = 'all'
                body_force = ['0.01*x', '-0.02', '0.01*y']
                ",
                flying(&law, step)
            );
            let total = |simulation: &mut Simulation<3>| {
                let mut observer = HistoryObserver::new(simulation).unwrap();
                let energies = row(&mut observer, simulation).energies;
                let (model, u) = (&simulation.model, &simulation.fields.displacement);
                let external: f64 = (0..model.owned())
                    .map(|k| {
                        let [x, y, _] = model.position(k);
                        let power = 0.01 * x * u[0][k] - 0.02 * u[1][k] + 0.01 * y * u[2][k];
                        -power * model.volume[k]
                    })
                    .sum();
                energies.kinetic + energies.strain + external
            };
            simulate::<3, _>(&text, |mut simulation| {
                let start = total(&mut simulation);
                let mut largest = 0.0_f64;
                while simulation.clock.number() < simulation.clock.last() {
                    simulation.advance();
                    largest = largest.max((total(&mut simulation) - start).abs());
                }
                largest / start.abs()
            })
        };
        let (coarse, fine) = (drift(0.08), drift(0.04));
        assert!(coarse < 1e-3, "{law}: {coarse}");
        assert!(
            (3.6..4.4).contains(&(coarse / fine)),
            "{law}: {coarse} {fine}"
        );
    }
}

#[test]
fn damping_takes_the_energy_that_the_motion_loses() {
    // A body in free flight: u̇ falls as exp(−r t).
    let text = "dimension = '3d'
        grid = { volume_correction = 'none', spacing = 1, horizon = 3 }
        material.rubber.ordinary = { density = 2, youngs_modulus = 5, poisson_ratio = 0.3, damping = 0.25 }
        body.block = { material = 'rubber', shape.box = { lower = [0, 0, 0], upper = [4, 4, 4] } }
        initial.flight.velocity = [3, 0, 0]
        time = { end = 4, step = 0.01 }
        ";
    simulate::<3, _>(text, |mut simulation| {
        let mut observer = HistoryObserver::new(&simulation).unwrap();
        let start = row(&mut observer, &mut simulation).energies;
        while simulation.clock.number() < simulation.clock.last() {
            simulation.advance();
        }
        let end = row(&mut observer, &mut simulation).energies;
        let expected = 3.0 * (-1.0_f64).exp();
        for velocity in &simulation.fields.velocity[0] {
            assert!((velocity / expected - 1.0).abs() < 1e-5, "{velocity}");
        }
        let lost = start.kinetic * (1.0 - (-2.0_f64).exp());
        assert!((end.dissipated / lost - 1.0).abs() < 1e-5);
        assert!(end.error.abs() < 1e-5 * lost);
    });
}

#[test]
fn the_error_of_the_motion_falls_by_four_when_the_step_halves() {
    let end = |step: f64| {
        simulate::<3, _>(&flying_block(step), |mut simulation| {
            while simulation.clock.number() < simulation.clock.last() {
                simulation.advance();
            }
            simulation.fields.displacement[0].clone()
        })
    };
    let reference = end(0.005);
    let error = |step: f64| {
        let found = end(step);
        let differences = found.iter().zip(&reference).map(|(a, b)| (a - b).abs());
        differences.fold(0.0, f64::max)
    };
    let ratio = error(0.08) / error(0.04);
    assert!((3.6..4.5).contains(&ratio), "{ratio}");
}

#[test]
fn a_pulse_moves_at_the_lattice_speed() {
    // c_L² = (c/2ρ) Σ ξ⁴/|ξ|³ V. With m = 3 under uniaxial strain, c = 12E/(5·9dx²A) and Σ = 12 dx² A, so
    // c_L² = 1.6 E/ρ. A pulse at rest separates into two halves. Then the centroid of the right half moves at
    // the speed of long waves.
    let speed = (1.6_f64 * 5.0 / 2.0).sqrt();
    let text = "dimension = '1d'
        constraint = 'uniaxial-strain'
        grid = { volume_correction = 'none', spacing = 1, horizon = 3 }
        material.rubber.pmb = { density = 2, youngs_modulus = 5 }
        body.bar = { material = 'rubber', shape.box = { lower = [0], upper = [900] } }
        initial.pulse.displacement = ['1e-4 * exp(-((x - 450)/25)^2)']
        time.end = 160
        ";
    simulate::<1, _>(text, |mut simulation| {
        let centroid = |simulation: &Simulation<1>| {
            let u = &simulation.fields.displacement[0];
            let x = &simulation.model.reference[0];
            let right = || u.iter().zip(x).filter(|(_, x)| **x > 450.0);
            right().map(|(u, x)| u * x).sum::<f64>() / right().map(|(u, _)| u).sum::<f64>()
        };
        while simulation.clock.time() < 60.0 {
            simulation.advance();
        }
        let (begin, start) = (simulation.clock.time(), centroid(&simulation));
        while simulation.clock.number() < simulation.clock.last() {
            simulation.advance();
        }
        let found = (centroid(&simulation) - start) / (simulation.clock.time() - begin);
        assert!(
            (found / speed - 1.0).abs() < 0.005,
            "{found} instead of {speed}"
        );
    });
}

#[test]
fn a_prescribed_velocity_moves_its_points_by_just_that() {
    // v = 0.2 + 0.1 t at one end, which has an initial displacement of 0.3.
    let text = "dimension = 'plane-stress'
        grid = { volume_correction = 'none', spacing = 1, horizon = 3 }
        material.rubber.pmb = { density = 2, youngs_modulus = 5 }
        body.bar = { material = 'rubber', shape.box = { lower = [0, 0], upper = [20, 4] } }
        set.left.where = 'x < 2'
        initial.shift = { set = 'left', displacement = [0.3, 0] }
        condition.push = { set = 'left', velocity = ['0.2 + 0.1*t', 'free'] }
        time = { end = 3, step = 0.05 }
        ";
    simulate::<2, _>(text, |mut simulation| {
        while simulation.clock.number() < simulation.clock.last() {
            simulation.advance();
        }
        let time = simulation.clock.time();
        for point in 0..simulation.model.owned() {
            if simulation.model.position(point)[0] < 2.0 {
                let u = simulation.fields.displacement[0][point];
                let v = simulation.fields.velocity[0][point];
                assert!(
                    (u - (0.3 + 0.2 * time + 0.05 * time * time)).abs() < 1e-12,
                    "{u}"
                );
                assert!((v - (0.2 + 0.1 * time)).abs() < 1e-12, "{v}");
            }
        }
    });
}

#[test]
fn a_motion_that_ends_with_the_run_stays_finite() {
    let text = "dimension = '1d'
        grid = { volume_correction = 'none', spacing = 1, horizon = 3 }
        material.rubber.pmb = { density = 2, youngs_modulus = 5 }
        body.bar = { material = 'rubber', shape.box = { lower = [0], upper = [20] } }
        set.left.where = 'x < 2'
        condition.push = { set = 'left', displacement = ['1e-3*sqrt(1 - (t/2)^2)'] }
        time.end = 2
        ";
    simulate::<1, _>(text, |mut simulation| {
        while simulation.clock.number() < simulation.clock.last() {
            simulation.advance();
        }
        simulation.check().unwrap();
        assert!(simulation.fields.velocity[0].iter().all(|v| v.is_finite()));
    });
    // A prescribed motion that becomes undefined during the run is an error.
    let text = text.replace("t/2", "t");
    simulate::<1, _>(&text, |mut simulation| {
        while simulation.clock.number() < simulation.clock.last() {
            simulation.advance();
        }
        assert!(simulation.check().is_err());
    });
}

/// Return the deck of a square or cube with small initial velocities that contain all frequencies.
fn rattled(dimension: &str, step: f64) -> String {
    let (upper, lower, velocity) = match dimension {
        "3d" => (
            "[7, 7, 7]",
            "[0, 0, 0]",
            "['1e-6*cos(3.1*x*y)', '1e-6*sin(7*x+z)', '1e-6*cos(z*z+x)']",
        ),
        _ => (
            "[15, 15]",
            "[0, 0]",
            "['1e-6*cos(3.1*x*y)', '1e-6*sin(7*x+y)']",
        ),
    };
    format!(
        "dimension = '{dimension}'
        grid = {{ volume_correction = 'none', spacing = 1, horizon = 3 }}
        material.rubber.pmb = {{ density = 2, youngs_modulus = 5 }}
        body.block = {{ material = 'rubber', shape.box = {{ lower = {lower}, upper = {upper} }} }}
        initial.rattle.velocity = {velocity}
        time = {{ end = {}, step = {step} }}
        ",
        2000.0 * step
    )
}

#[test]
fn the_stable_step_is_stable_and_larger_than_the_usual_one() {
    fn check<const D: usize>(dimension: &str) {
        let stable = simulate::<D, _>(&rattled(dimension, 0.01), |s| s.undeformed.stable_step);
        let (usual, growth) =
            simulate::<D, _>(&rattled(dimension, 0.98 * stable), |mut simulation| {
                let stiffness = simulation.forces.stiffness(&simulation.model);
                let trace = |point| (0..3).map(|k| stiffness[k][point]).sum::<f64>();
                let stiffest = (0..simulation.model.owned()).map(trace).fold(0.0, f64::max);
                let mut observer = HistoryObserver::new(&simulation).unwrap();
                let start = row(&mut observer, &mut simulation).energies.kinetic;
                while simulation.clock.number() < simulation.clock.last() {
                    simulation.advance();
                }
                let end = row(&mut observer, &mut simulation).energies;
                (
                    (2.0_f64 * 2.0 / stiffest).sqrt(),
                    (end.kinetic + end.strain) / start,
                )
            });
        assert!(
            (0.3..3.0).contains(&growth),
            "{dimension}: energy grew to {growth}"
        );
        let beyond = simulate::<D, _>(&rattled(dimension, 1.3 * stable), |mut simulation| {
            while simulation.clock.number() < simulation.clock.last() {
                simulation.advance();
            }
            simulation.check().is_err()
        });
        assert!(
            beyond,
            "{dimension}: a step far beyond the limit must not pass unseen"
        );
        let ratio = stable / usual;
        assert!(
            (ratio / (D as f64).sqrt() - 1.0).abs() < 0.01,
            "{dimension}: {ratio}"
        );
    }
    check::<2>("plane-stress");
    check::<3>("3d");
}

#[test]
fn supports_do_the_work_that_becomes_energy() {
    // A bar fixed at one end and moved at the other: kinetic + strain energy = work of the support, up to an
    // error of second order.
    let text = |step: f64| {
        format!(
            "dimension = 'plane-strain'
            grid = {{ volume_correction = 'none', spacing = 1, horizon = 3 }}
            material.rubber.pmb = {{ density = 2, youngs_modulus = 5 }}
            body.bar = {{ material = 'rubber', shape.box = {{ lower = [0, 0], upper = [40, 6] }} }}
            set.left.where = 'x < 3'
            set.right.where = 'x > 37'
            condition.hold = {{ set = 'left', displacement = [0, 0] }}
            [condition.pull]
            set = 'right'
            displacement = ['0.01*(1 - cos(pi*min(t, 60)/60))*x/40', 'free']
            [history]
            reactions = ['left', 'right']
            force.pull = {{ set = 'right', direction = [2, 0] }}
            force.slanted = {{ set = 'left', direction = [3, -4] }}
            [time]
            end = 100
            step = {step}
            "
        )
    };
    let largest_error = |step: f64| {
        simulate::<2, _>(&text(step), |mut simulation| {
            let mut observer = HistoryObserver::new(&simulation).unwrap();
            row(&mut observer, &mut simulation);
            let mut largest = 0.0_f64;
            while simulation.clock.number() < simulation.clock.last() {
                simulation.advance();
                largest = largest.max(row(&mut observer, &mut simulation).energies.error.abs());
            }
            let end = row(&mut observer, &mut simulation);
            let of = |name: &str| end.values[column(&observer, name)];
            assert!(of("reaction_right_x") > 0.0);
            assert!(of("reaction_left_x") < 0.0);
            // The length of a given direction vector does not matter.
            assert_eq!(of("force_pull"), of("reaction_right_x"));
            let [x, y] = ["reaction_left_x", "reaction_left_y"].map(of);
            let slanted = 0.6 * x - 0.8 * y;
            let difference = (of("force_slanted") - slanted).abs();
            assert!(difference < 1e-14 * slanted.abs(), "{difference}");
            let model = &simulation.model;
            let pulled = (0..model.owned()).find(|k| model.position(*k)[0] > 39.0);
            let u = simulation.fields.displacement[0][pulled.unwrap()];
            assert!((u - 0.02 * 39.5 / 40.0).abs() < 1e-15, "{u}");
            largest / end.energies.work
        })
    };
    let (coarse, fine) = (largest_error(0.5), largest_error(0.25));
    assert!(coarse < 0.01, "{coarse}");
    assert!((3.5..4.5).contains(&(coarse / fine)), "{coarse} {fine}");
}

#[test]
fn loads_accelerate_as_newton_says() {
    // A total force of 3 N on a free body of 2 kg/m³ · 240 m³, and the equal body force.
    for load in ["force = [3, 0, 0]", "body_force = ['3/240', 0, 0]"] {
        let text = format!(
            "dimension = '3d'
            grid = {{ volume_correction = 'none', spacing = 1, horizon = 3 }}
            material.rubber.pmb = {{ density = 2, youngs_modulus = 5 }}
            body.block = {{ material = 'rubber', shape.box = {{ lower = [0, 0, 0], upper = [8, 6, 5] }} }}
            condition.push = {{ set = 'all', {load} }}
            time = {{ end = 4 }}
            "
        );
        simulate::<3, _>(&text, |mut simulation| {
            let mut observer = HistoryObserver::new(&simulation).unwrap();
            row(&mut observer, &mut simulation);
            while simulation.clock.number() < simulation.clock.last() {
                simulation.advance();
            }
            let end = row(&mut observer, &mut simulation);
            let momentum = end.values[column(&observer, "momentum_x")];
            assert!((momentum / 12.0 - 1.0).abs() < 1e-12, "{momentum}");
            // The work is half of F²t²/m.
            let work = 0.5 * 12.0_f64.powi(2) / 480.0;
            assert!((end.energies.work / work - 1.0).abs() < 1e-9);
            assert!(end.energies.error.abs() < 1e-9 * work);
        });
    }
}

#[test]
fn a_pressure_pushes_against_its_normal() {
    let text = "dimension = 'plane-stress'
        thickness = 0.1
        grid = { volume_correction = 'none', spacing = 1, horizon = 3 }
        material.rubber.pmb = { density = 2, youngs_modulus = 5 }
        body.block = { material = 'rubber', shape.box = { lower = [0, 0], upper = [8, 6] } }
        set.top.where = 'y > 4'
        condition.press = { set = 'top', pressure = 0.5, normal = [0, 2], depth = 2 }
        time = { end = 1 }
        ";
    simulate::<2, _>(text, |simulation| {
        let volumes = simulation.model.volume.iter();
        let loads = simulation.fields.external_force.as_ref().unwrap();
        let loads = loads[1].iter().zip(volumes);
        let total: f64 = loads.map(|(force, volume)| force * volume).sum();
        // Pressure times area 8 × 0.1.
        assert!((total + 0.5 * 0.8).abs() < 1e-12, "{total}");
    });
}

#[test]
fn a_load_without_depth_acts_on_one_spacing_of_each_body() {
    // The load acts on two layers, each one spacing thick. Both bodies have a spacing that differs from that
    // of the grid.
    let text = "dimension = 'plane-stress'
        thickness = 0.1
        grid = { spacing = 2, horizon = 3 }
        interface.rule = 'none'
        material.rubber.pmb = { density = 2, youngs_modulus = 5 }
        body.coarse = { material = 'rubber', spacing = 1, shape.box = { lower = [0, 0], upper = [8, 6] } }
        body.fine = { material = 'rubber', spacing = 0.5, shape.box = { lower = [8, 0], upper = [12, 6] } }
        set.top.where = 'y > if(x < 8, 5, 5.5)'
        condition.pull = { set = 'top', traction = [3, 7] }
        condition.press = { set = 'top', pressure = 2, normal = [0, 1] }
        time = { end = 1 }
        ";
    for ranks in [1, 3] {
        let sums = crate::support::simulate_on::<2, _>(ranks, text, |simulation| {
            let model = &simulation.model;
            let loads = simulation.fields.external_force.as_ref().unwrap();
            let mut sums = [[0.0; 2]; 2];
            for point in 0..model.owned() {
                let body = simulation.problem.body_of(usize::from(model.block[point]));
                for (sum, load) in sums[body].iter_mut().zip(loads) {
                    *sum += load[point] * model.volume[point];
                }
            }
            sums
        });
        // Force per area times area, 8 × 0.1 and 4 × 0.1.
        for (body, area) in [0.8, 0.4].into_iter().enumerate() {
            for (component, expected) in [3.0 * area, (7.0 - 2.0) * area].into_iter().enumerate() {
                let found: f64 = sums.iter().map(|sums| sums[body][component]).sum();
                assert!((found - expected).abs() < 1e-12, "{found} {expected}");
            }
        }
    }
}

#[test]
fn bonds_that_break_at_the_start_are_counted() {
    let deck = "dimension = '1d'
        grid = { spacing = 1, horizon = 3 }
        material.rubber.pmb = { density = 2, youngs_modulus = 5 }
        damage.brittle.critical_stretch.critical_stretch = 0.1
        body.bar = { material = 'rubber', damage = 'brittle', shape.box = { lower = [0], upper = [40] } }
        initial.gap.displacement = ['if(x > 20, 1, 0)']
        time.end = 1
        ";
    for ranks in [1, 2] {
        let rows = crate::support::simulate_on::<1, _>(ranks, deck, |mut simulation| {
            let mut observer = HistoryObserver::new(&simulation).unwrap();
            row(&mut observer, &mut simulation)
        });
        for row in rows {
            assert!(row.energies.fracture > 0.0);
            // One bond of length 1, two of length 2 and three of length 3 cross the gap.
            assert_eq!(row.broken, 6);
        }
    }
}

#[test]
fn a_reaction_knows_a_motion_better_than_its_rounded_places() {
    for motion in [
        "displacement = ['1e3 + 2*t']",
        "velocity = ['2e6 + 0*t + x - x']",
    ] {
        let deck = format!(
            "dimension = '1d'
            grid = {{ spacing = 1, horizon = 3 }}
            material.rubber.pmb = {{ density = 2, youngs_modulus = 5 }}
            body.bar = {{ material = 'rubber', shape.box = {{ lower = [0], upper = [40] }} }}
            condition.carry = {{ set = 'bar', {motion} }}
            time = {{ end = 1e-4, step = 1e-6 }}
            "
        );
        simulate::<1, _>(&deck, |mut simulation| {
            while !simulation.clock.is_over() {
                simulation.advance();
                let [reaction] = simulation.fields.reaction.as_ref().unwrap();
                let largest = reaction.iter().fold(0.0_f64, |most, it| most.max(it.abs()));
                // Positions of 1e3 m are rounded to 1e-13 m. This limits the accuracy of bonds with a length
                // of 1 m and a modulus of 5 Pa.
                assert!(largest < 1e-11, "{motion}: {largest} N/m³");
            }
        });
    }
}

/// In the first row, the values of a support before the start must not count.
#[test]
fn a_support_has_its_reaction_from_the_first_row() {
    for (motion, speed, acceleration) in [
        ("velocity = ['0.2 + 3*t']", 0.2, 3.0),
        ("displacement = ['0.2*t + 1.5*t^2']", 0.2, 3.0),
        // Jumps at the start have no part in the reaction.
        ("velocity = [5]", 5.0, 0.0),
        ("displacement = ['0.3 + 2*t']", 2.0, 0.0),
        // The value after two steps is NaN.
        ("displacement = ['2*t + 0*sqrt(0.15 - t)']", 2.0, 0.0),
    ] {
        let deck = format!(
            "dimension = '1d'
            grid = {{ spacing = 1, horizon = 3 }}
            material.rubber.pmb = {{ density = 2, youngs_modulus = 5 }}
            body.bar = {{ material = 'rubber', shape.box = {{ lower = [0], upper = [40] }} }}
            condition.carry = {{ set = 'bar', {motion} }}
            history.reactions = ['bar']
            time = {{ end = 1, step = 0.1 }}
            "
        );
        simulate::<1, _>(&deck, |mut simulation| {
            let mass = 2.0 * simulation.model.volume.iter().sum::<f64>();
            let mut history = HistoryObserver::new(&simulation).unwrap();
            let [reaction, momentum] =
                ["reaction_bar_x", "momentum_x"].map(|name| column(&history, name));
            loop {
                let time = simulation.clock.time();
                let row = row(&mut history, &mut simulation).values;
                let found = [row[reaction], row[momentum]].map(|sum| sum / mass);
                for (found, expected) in found
                    .into_iter()
                    .zip([acceleration, speed + acceleration * time])
                {
                    let error = (found - expected).abs();
                    assert!(
                        error < 1e-9,
                        "{motion} at {time} s: {found}, not {expected}"
                    );
                }
                if motion.contains("sqrt") || simulation.clock.is_over() {
                    break;
                }
                simulation.advance();
            }
        });
    }
}

#[test]
fn two_points_that_are_thrown_apart_lose_the_energy_of_their_bond() {
    const CRITICAL: f64 = 0.02;
    let (modulus, section, horizon) = (5.0, 0.5, 1.5);
    // c = 12E/(5δ²A), and ½ c s² |ξ| V² of a bond of 1 m between two points of 0.5 m³.
    let micromodulus = 12.0 * modulus / (5.0 * horizon * horizon * section);
    let bond = 0.5 * micromodulus * CRITICAL * CRITICAL * section * section;
    let thrown = |step: f64| {
        let text = format!(
            "dimension = '1d'
            constraint = 'uniaxial-strain'
            cross_section = {section}
            grid = {{ volume_correction = 'none', spacing = 1, horizon = {horizon} }}
            material.rubber.pmb = {{ density = 2, youngs_modulus = {modulus} }}
            damage.brittle.critical_stretch = {{ critical_stretch = {CRITICAL}, alpha = 0 }}
            body.bar = {{ material = 'rubber', damage = 'brittle', shape.box = {{ lower = [0], upper = [2] }} }}
            initial.throw.velocity = ['0.1*(x - 1)']
            time = {{ end = 1, step = {step} }}"
        );
        simulate::<1, _>(&text, |mut simulation| {
            let mut history = HistoryObserver::new(&simulation).unwrap();
            let before = row(&mut history, &mut simulation).energies;
            while !simulation.is_over() {
                simulation.advance();
            }
            let after = row(&mut history, &mut simulation);
            assert_eq!(after.broken, 1);
            assert_eq!(after.energies.strain, 0.0);
            (before.kinetic - after.energies.kinetic, after.energies)
        })
    };
    // However late the bond breaks, the lost energy equals the recorded fracture energy.
    for step in [0.04, 0.02, 0.01, 0.005, 0.0025, 1e-4] {
        let (lost, energies) = thrown(step);
        let error = (lost / energies.fracture - 1.0).abs();
        assert!(error < 1e-12, "{step}: {lost} {energies:?}");
        // The bond breaks within a step of the critical stretch, which it reaches after 0.2 s.
        let late = (lost / bond - 1.0).abs();
        assert!(late < 2.0 * step / 0.2, "{step}: {lost} {bond}");
    }
}

#[test]
fn the_step_follows_the_damping() {
    // With the undamped stable step, r Δt would be 80, 8 and 0.8.
    let deck = |rate: f64| {
        format!(
            "dimension = 'plane-stress'
            grid = {{ spacing = 1, horizon = 3 }}
            material.rubber.pmb = {{ density = 2, youngs_modulus = 5, damping = {rate} }}
            body.plate = {{ material = 'rubber', shape.box = {{ lower = [0, 0], upper = [12, 8] }} }}
            initial.push.velocity = ['0.01*x', 0]
            time.end = 3
            "
        )
    };
    for rate in [100.0, 10.0, 1.0] {
        simulate::<2, _>(&deck(rate), |mut simulation| {
            assert!(rate * simulation.clock.step() <= 0.4);
            let mut observer = HistoryObserver::new(&simulation).unwrap();
            let start = row(&mut observer, &mut simulation).energies.kinetic;
            while !simulation.is_over() {
                simulation.advance();
                let now = row(&mut observer, &mut simulation).energies;
                assert!(now.error.abs() < 0.05 * start, "{rate}: {now:?}");
                assert!(now.kinetic + now.strain <= 1.01 * start, "{rate}: {now:?}");
            }
            let end = row(&mut observer, &mut simulation).energies;
            assert!(end.kinetic < 0.1 * start, "{rate}: {end:?}");
        });
    }
}
