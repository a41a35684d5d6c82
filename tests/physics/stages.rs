//! Stages of a run. A body relaxed under a load stays at rest in a following explicit stage, and springs back
//! without the load. Bodies with a density scale move as expected.

use crate::support::history::{column, row, rows_to_the_end};
use crate::support::saved::{state, whole};
use crate::support::{problem, simulate, simulate_on};
use fissure::comm::{Communicator, threads};
use fissure::error::Warning;
use fissure::solver::Simulation;
use fissure::solver::observers::{Energies, HistoryObserver};

/// Return the deck of a bar fixed at one end and loaded at the other; `second` is the second stage, with or
/// without the load.
fn bar(second: &str) -> String {
    format!(
        "dimension = '1d'
        grid = {{ spacing = 1, horizon = 3 }}
        material.rubber.pmb = {{ density = 2, youngs_modulus = 5 }}
        body.bar = {{ material = 'rubber', shape.box = {{ lower = [0], upper = [30] }} }}
        set.left.where = 'x < 3'
        set.right.where = 'x > 29'
        condition.hold = {{ set = 'left', displacement = [0] }}
        condition.pull = {{ set = 'right', force = ['0.01*min(t, 1)'] }}
        time.end = 41
        [[stage]]
        end = 1
        method = 'relaxation'
        relaxation = {{ load_steps = 2, tolerance = 1e-10 }}
        [[stage]]
        {second}
        "
    )
}

/// Energies, and displacement of the bar's end, at the end of the first stage. The other fields are extremes
/// in the second stage.
struct Seen {
    preload: Energies,
    displacement: f64,
    lowest: f64,
    highest: f64,
    kinetic: f64,
    error: f64,
}

fn see(deck: &str) -> Seen {
    simulate(deck, |mut simulation: Simulation<1>| {
        let mut observer = HistoryObserver::new(&simulation).unwrap();
        let mut energies = |simulation: &mut Simulation<1>| row(&mut observer, simulation).energies;
        let last = simulation.model.owned() - 1;
        energies(&mut simulation);
        while !(simulation.is_stage_over() && simulation.clock.number() > 0) {
            simulation.advance();
        }
        assert_eq!(
            (simulation.progress.stage, simulation.clock.time()),
            (0, 1.0)
        );
        let displacement = simulation.fields.displacement[0][last];
        let mut seen = Seen {
            preload: energies(&mut simulation),
            displacement,
            lowest: f64::MAX,
            highest: f64::MIN,
            kinetic: 0.0,
            error: 0.0,
        };
        while !simulation.is_over() {
            simulation.advance();
            let displacement = simulation.fields.displacement[0][last];
            seen.lowest = seen.lowest.min(displacement);
            seen.highest = seen.highest.max(displacement);
            let now = energies(&mut simulation);
            seen.kinetic = seen.kinetic.max(now.kinetic);
            seen.error = seen.error.max((now.error - seen.preload.error).abs());
        }
        assert!((simulation.clock.time() - 41.0).abs() < 1e-9);
        assert_eq!(simulation.clock.number(), simulation.last_step());
        seen
    })
}

#[test]
fn a_relaxed_body_stays_at_rest() {
    let seen = see(&bar("safety = 0.5"));
    let strain = seen.preload.strain;
    assert!(strain > 0.0 && seen.preload.kinetic == 0.0);
    assert!(seen.kinetic < 1e-12 * strain, "{:e}", seen.kinetic);
    assert!(seen.highest - seen.lowest < 1e-6 * seen.displacement);
}

#[test]
fn a_body_that_is_let_go_swings_about_its_place() {
    let seen = see(&bar("safety = 0.1\n off = ['pull']"));
    let strain = seen.preload.strain;
    // The end has its lowest displacement after half a period, 2 L/c = 35 s with L = 28 m and c = √(E/ρ) =
    // √2.5 m/s. The second stage lasts 40 s.
    assert!((seen.lowest + seen.displacement).abs() < 0.1 * seen.displacement);
    assert!(
        (0.9..1.001).contains(&(seen.kinetic / strain)),
        "{}",
        seen.kinetic / strain
    );
    assert!(seen.error < 1e-3 * strain, "{:e}", seen.error / strain);
}

/// At the end of a stage, the conditions of this stage act, and not those of the next stage.
#[test]
fn a_load_without_a_value_at_the_end_of_its_stage_is_named() {
    let deck = "
        dimension = '1d'
        grid = { spacing = 1, horizon = 3 }
        material.rubber.pmb = { density = 2, youngs_modulus = 5 }
        body.bar = { material = 'rubber', shape.box = { lower = [0], upper = [30] } }
        set.right.where = 'x > 29'
        condition.pull = { set = 'right', force = ['1/(1 - t)'] }
        time = { end = 2, step = 0.5 }
        [[stage]]
        end = 1
        [[stage]]
        off = ['pull']
        ";
    let messages = simulate_on(2, deck, |mut simulation: Simulation<1>| {
        while !simulation.is_over() {
            simulation.advance();
        }
        simulation.check().unwrap_err().message
    });
    for message in messages {
        assert!(message.starts_with("[condition.pull] force: "), "{message}");
        assert!(message.contains(" at t = 1 s at point 29"), "{message}");
    }
}

#[test]
fn ranks_do_not_change_a_bit() {
    let run = |ranks: usize| {
        let deck = bar("off = ['pull']");
        let mut parts = simulate_on(ranks, &deck, |mut simulation: Simulation<1>| {
            while !simulation.is_over() {
                simulation.advance();
            }
            let (model, fields) = (&simulation.model, &simulation.fields);
            let bits = |point: usize| fields.displacement[0][point].to_bits();
            (0..model.owned())
                .map(|point| (model.ids[point], bits(point)))
                .collect::<Vec<_>>()
        })
        .concat();
        parts.sort_unstable();
        parts
    };
    let one = run(1);
    assert_eq!(run(2), one);
    assert_eq!(run(3), one);
}

#[test]
fn a_body_of_nine_times_the_density_moves_a_third_as_fast() {
    let deck = |scale: f64, end: f64| {
        format!(
            "dimension = '1d'
            grid = {{ spacing = 1, horizon = 3 }}
            material.rubber.pmb = {{ density = 2, youngs_modulus = 5 }}
            body.bar = {{ material = 'rubber', shape.box = {{ lower = [0], upper = [30] }} }}
            initial.stretch.displacement = ['0.001*x']
            time = {{ end = {end}, density_scale = {scale}, safety = 0.5 }}
            "
        )
    };
    let run = |deck: &str| {
        simulate(deck, |mut simulation: Simulation<1>| {
            let mut observer = HistoryObserver::new(&simulation).unwrap();
            while !simulation.is_over() {
                simulation.advance();
            }
            let row = row(&mut observer, &mut simulation);
            let mut columns = observer.columns().iter();
            let is_there = columns.any(|column| column.0 == "kinetic_ratio");
            let ratio = is_there.then(|| row.values[column(&observer, "kinetic_ratio")]);
            let last = simulation.model.owned() - 1;
            let displacement = simulation.fields.displacement[0][last];
            (simulation.clock.step(), displacement, row.energies, ratio)
        })
    };
    let (step, displacement, energies, none) = run(&deck(1.0, 7.0));
    let (scaled_step, scaled_displacement, scaled, ratio) = run(&deck(9.0, 21.0));
    assert!((scaled_step / step - 3.0).abs() < 1e-12);
    assert!((scaled_displacement - displacement).abs() < 1e-9 * displacement.abs());
    assert!((scaled.kinetic - energies.kinetic).abs() < 1e-9 * energies.kinetic);
    assert_eq!(none, None);
    assert_eq!(ratio, Some(scaled.kinetic / scaled.strain));
}

#[test]
fn a_stage_may_be_one_step_long_up_to_rounding() {
    let deck = |stages: &str| {
        format!(
            "dimension = '1d'
            grid = {{ spacing = 1, horizon = 3 }}
            material.rubber.pmb = {{ density = 2, youngs_modulus = 5 }}
            body.bar = {{ material = 'rubber', shape.box = {{ lower = [0], upper = [10] }} }}
            {stages}
            "
        )
    };
    // In floating point, 1.2e-7 − 1e-7 is less than 2e-8, and 0.1 + 0.2 is more than 0.3.
    let short = "time.end = 2.2e-7
        [[stage]]
        end = 1e-7
        step = 1e-8
        [[stage]]
        end = 1.2e-7
        step = 2e-8
        [[stage]]
        step = 1e-8";
    let last = "time.end = 0.3
        [[stage]]
        end = 0.2
        step = 0.1
        [[stage]]
        end = '0.1 + 0.2'
        step = 0.1
        adaptive = { smallest = '0.1 + 0.2', largest = 0.3 }";
    for (stages, steps, end) in [(short, 21, 2.2e-7), (last, 3, 0.3)] {
        simulate(&deck(stages), |mut simulation: Simulation<1>| {
            while !simulation.is_over() {
                simulation.advance();
            }
            assert_eq!(simulation.clock.number(), steps);
            assert!((simulation.clock.time() / end - 1.0).abs() < 1e-12);
        });
    }
}

/// A prescribed velocity on one side of the block.
const GUIDE: &str = "set.left.where = 'x < 3'
        condition.guide = { set = 'left', velocity = [0.1, 'free'] }";

/// Return the deck of a moving block under a body force, with optional damping and an optional support. Its
/// density scale changes from 1 to 4 and then to 0.5.
fn flying(damping: f64, support: &str) -> String {
    format!(
        "dimension = 'plane-stress'
        grid = {{ spacing = 1, horizon = 3 }}
        material.rubber.pmb = {{ density = 2, youngs_modulus = 5, damping = {damping} }}
        body.block = {{ material = 'rubber', shape.box = {{ lower = [0, 0], upper = [8, 6] }} }}
        initial.flight.velocity = ['0.1 + 0.01*y', 0.05]
        {support}
        time = {{ end = 12, safety = 0.05 }}
        [[stage]]
        end = 4
        [[stage]]
        end = 8
        density_scale = 4
        [[stage]]
        density_scale = 0.5
        "
    )
}

#[test]
fn a_change_of_density_keeps_momentum_and_books_energy() {
    for (damping, support, free) in [(0.0, "", true), (0.02, "", false), (0.02, GUIDE, false)] {
        let deck = flying(damping, support);
        assert_eq!(
            problem_warnings(&deck),
            [
                "density_scale: changes from 1 to 4 at t = 4 s",
                "density_scale: changes from 4 to 0.5 at t = 8 s",
            ]
        );
        simulate(&deck, |mut simulation: Simulation<2>| {
            let mut observer = HistoryObserver::new(&simulation).unwrap();
            let rows = rows_to_the_end(&mut observer, &mut simulation);
            let of = |name: &str| -> Vec<f64> {
                let column = column(&observer, name);
                rows.iter().map(|row| row[column]).collect()
            };
            let (kinetic, error) = (of("kinetic_energy"), of("energy_error"));
            let most = kinetic.iter().copied().fold(0.0, f64::max);
            let worst = error.iter().fold(0.0_f64, |worst, e| worst.max(e.abs()));
            assert!(
                worst < 1e-3 * most,
                "{damping} {support}: {worst:e} of {most:e}"
            );
            let added = of("density_scale_energy");
            let last = added.len() - 1;
            assert_eq!(added[1], 0.0);
            assert!(added[last].abs() > 0.1 * most, "{} of {most}", added[last]);
            if free {
                for name in ["momentum_x", "momentum_y"] {
                    let momentum = of(name);
                    for later in &momentum {
                        assert!((later / momentum[0] - 1.0).abs() < 1e-12, "{name}: {later}");
                    }
                }
            }
        });
    }
}

/// A support that begins with a stage gives or takes kinetic energy by an impulse.
#[test]
fn the_work_of_a_support_includes_the_impulse_at_its_start() {
    for (before, condition, speed) in [
        ("off = ['drive']", "velocity = [0.5]", 0.3),
        (
            "off = ['drive']\nmethod = 'relaxation'",
            "velocity = [0.5]",
            0.0,
        ),
        ("off = ['drive']", "velocity = [0]", 0.3),
        (
            "off = ['drive']\ndensity_scale = 4",
            "velocity = [0.5]",
            0.3,
        ),
        ("off = ['drive']", "velocity = ['if(t < 2, 0, 0.5)']", 0.0),
        (
            "off = ['drive']",
            "displacement = ['max(0, t - 2)*0.5']",
            0.0,
        ),
    ] {
        let flight = if speed > 0.0 {
            format!("initial.flight = {{ set = 'right', velocity = [{speed}] }}")
        } else {
            String::new()
        };
        let deck = format!(
            "dimension = '1d'
            grid = {{ spacing = 1, horizon = 3 }}
            material.rubber.pmb = {{ density = 2, youngs_modulus = 5 }}
            body.bar = {{ material = 'rubber', shape.box = {{ lower = [0], upper = [30] }} }}
            set.right.where = 'x > 27'
            set.left.where = 'x < 2'
            condition.hold = {{ set = 'left', displacement = [0] }}
            condition.drive = {{ set = 'right', {condition} }}
            {flight}
            time = {{ end = 10, safety = 0.2 }}
            [[stage]]
            end = 2
            {before}
            [[stage]]
            "
        );
        simulate(&deck, |mut simulation: Simulation<1>| {
            let mut observer = HistoryObserver::new(&simulation).unwrap();
            let rows = rows_to_the_end(&mut observer, &mut simulation);
            let of = |name: &str| -> Vec<f64> {
                let column = column(&observer, name);
                rows.iter().map(|row| row[column]).collect()
            };
            let times = of("time");
            let second = times.iter().rposition(|time| *time <= 2.0 + 1e-9).unwrap();
            // The initial kinetic energy is lost when a relaxation begins.
            let first = if before.contains("relaxation") {
                second
            } else {
                0
            };
            let kinetic = of("kinetic_energy")
                .into_iter()
                .skip(first)
                .fold(0.0, f64::max);
            let error = of("energy_error");
            let change = error[error.len() - 1] - error[first];
            assert!(
                change.abs() < 0.01 * kinetic,
                "{before} {condition}: {change} of {kinetic}"
            );
        });
    }
}

/// Return the warnings of a deck, each from the key up to the first semicolon, without the location.
fn problem_warnings(deck: &str) -> Vec<String> {
    let short = |warning: &Warning| {
        let text = &warning.message;
        let text = text.split_once("]] ").map_or(&text[..], |(_, text)| text);
        text.split(';').next().unwrap_or_default().to_owned()
    };
    problem(deck).warnings.iter().map(short).collect()
}

#[test]
fn a_change_of_density_is_the_same_on_any_ranks_and_after_a_restart() {
    let deck = flying(0.02, GUIDE);
    let problem = problem(&deck);
    let run = |ranks: usize, stop: u64| {
        whole(threads::run(ranks, |comm: &dyn Communicator| {
            let mut simulation = Simulation::<2>::new(&problem, comm).unwrap();
            while !simulation.is_over() {
                if simulation.clock.number() == stop {
                    let (order, saved) = state(&simulation);
                    simulation = Simulation::new(&problem, comm).unwrap();
                    simulation.restore(&order, &saved).unwrap();
                }
                simulation.advance();
            }
            state(&simulation).1
        }))
    };
    let steps = simulate(&deck, |simulation: Simulation<2>| simulation.last_step());
    let one = run(1, u64::MAX);
    let at_change = simulate(&deck, |mut simulation: Simulation<2>| {
        while !simulation.is_stage_over() {
            simulation.advance();
        }
        simulation.clock.number()
    });
    for (ranks, stop) in [
        (3, u64::MAX),
        (1, at_change),
        (2, at_change + 1),
        (2, steps - 1),
    ] {
        assert_eq!(run(ranks, stop), one, "{ranks} ranks, stopped at {stop}");
    }
}
