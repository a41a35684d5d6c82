//! The adaptive step. No step breaks more bonds of a point than allowed. The dissipated energy depends less
//! on the step. A restart at any step, on any number of ranks, gives the same bits.

use crate::support::command::{Folder, finish, fissure, text};
use crate::support::history::{column, rows_to_the_end};
use crate::support::saved::{state, whole};
use crate::support::{problem, simulate, simulate_on};
use fissure::comm::{Communicator, threads};
use fissure::solver::Simulation;
use fissure::solver::observers::HistoryObserver;

/// Return the deck of a notched plate that is pulled apart fast.
fn torn(time: &str) -> String {
    format!(
        "dimension = 'plane-stress'
        grid = {{ spacing = 1, horizon = 3 }}
        material.sheet.pmb = {{ density = 2, youngs_modulus = 5 }}
        damage.brittle.critical_stretch = {{ critical_stretch = 0.03, alpha = 0 }}
        body.plate = {{ material = 'sheet', damage = 'brittle', shape.box = {{ lower = [0, 0], upper = [30, 20] }} }}
        crack.notch.segment = {{ from = [-1, 10], to = [8, 10] }}
        set.top.where = 'y > 17'
        set.bottom.where = 'y < 3'
        condition.up = {{ set = 'top', velocity = [0, '0.05*ramp(t, 0, 2)'] }}
        condition.down = {{ set = 'bottom', velocity = [0, '-0.05*ramp(t, 0, 2)'] }}
        time = {{ end = 25, {time} }}
        "
    )
}

const RULE: &str = "adaptive = { most_broken = 3, stable_broken = 1, steps = 5 }";

#[test]
fn no_step_breaks_more_bonds_of_a_point_than_it_may() {
    let deck = torn(&format!("safety = 0.8, {RULE}"));
    let (rows, columns) = simulate(&deck, |mut simulation: Simulation<2>| {
        let mut observer = HistoryObserver::new(&simulation).unwrap();
        let rows = rows_to_the_end(&mut observer, &mut simulation);
        let names = ["time", "time_step", "undone_steps", "most_broken_bonds"];
        (rows, names.map(|name| column(&observer, name)))
    });
    let [time, size, undone, most] = columns;
    let last = rows.last().unwrap();
    assert!(last[undone] > 3.0, "{} steps undone", last[undone]);
    assert!((last[time] - 25.0).abs() < 1e-9, "ends at {}", last[time]);
    let largest = rows[0][size];
    for pair in rows.windows(2) {
        let [before, after] = pair else {
            unreachable!()
        };
        assert!(after[most] <= 3.0, "{after:?}");
        assert!(after[size] <= largest * (1.0 + 1e-12));
        let moved = after[time] - before[time];
        assert!(
            (moved - after[size]).abs() < 1e-9 * largest,
            "{moved} is not {}",
            after[size]
        );
    }
    // The step was reduced, and raised again.
    let smallest = rows.iter().map(|row| row[size]).fold(f64::MAX, f64::min);
    assert!(smallest <= 0.25 * largest, "{smallest} of {largest}");
    let raises = rows.windows(2).filter(|pair| pair[1][size] > pair[0][size]);
    assert!(raises.count() > 3);
}

#[test]
fn steps_that_are_long_for_bonds_that_break_are_told() {
    let folder = Folder::new("overshoot");
    let warned = |time: &str, options: &[&str]| {
        let deck = folder.write("deck.toml", &torn(time).replace("0.05*", "0.1*"));
        let mut command = fissure(1);
        command
            .arg("run")
            .arg(deck)
            .arg("--overwrite")
            .args(options);
        let output = finish(command.arg("--output").arg(folder.join("out")));
        assert!(output.status.success(), "{}", text(&output));
        text(&output).contains("bonds broke up to one step late")
    };
    assert!(warned("safety = 0.8", &[]));
    assert!(!warned("safety = 0.02", &[]));
    assert!(!warned("safety = 0.8", &["--quiet"]));
}

/// All bonds of a bar reach their criterion at the same time. With one load step, they break at 1.34 times
/// their critical stretch.
#[test]
fn load_steps_that_are_long_for_bonds_that_break_are_told() {
    let folder = Folder::new("overshoot_of_load_steps");
    let warned = |load_steps: u32| {
        let text_of_deck = format!(
            "dimension = '1d'
            grid = {{ spacing = 1, horizon = 3 }}
            material.rubber.pmb = {{ density = 2, youngs_modulus = 5 }}
            damage.brittle.critical_stretch = {{ critical_stretch = 0.0149, alpha = 0 }}
            body.bar = {{ material = 'rubber', damage = 'brittle', shape.box = {{ lower = [0], upper = [20] }} }}
            condition.pull = {{ set = 'all', displacement = ['0.02*t*x'] }}
            time = {{ end = 1, method = 'relaxation', relaxation.load_steps = {load_steps} }}"
        );
        let deck = folder.write("deck.toml", &text_of_deck);
        let mut command = fissure(1);
        command.arg("run").arg(deck).arg("--overwrite");
        let output = finish(command.arg("--output").arg(folder.join("out")));
        assert!(output.status.success(), "{}", text(&output));
        let told = text(&output);
        let found = told.contains("bonds broke up to one load step late");
        assert_eq!(found, told.contains("twice the `load_steps` and compare"));
        found
    };
    assert!(warned(1));
    assert!(!warned(4));
}

/// The energy balance closes in each row, also if the motion of a support jumps between two steps.
#[test]
fn a_kink_of_a_support_does_not_spoil_the_energy_balance() {
    // The step is 0.1 s before t = 2 s, and 0.2 s after it.
    let adaptive = "step = 0.1, adaptive = { steps = 20, raise = 2, largest = 0.2, most_broken = 2, stable_broken = 1 }";
    let error = |motion: &str, time: &str| {
        let deck = format!(
            "dimension = '1d'
            grid = {{ spacing = 1, horizon = 3 }}
            material.rubber.pmb = {{ density = 2, youngs_modulus = 5, damping = 0.01 }}
            body.bar = {{ material = 'rubber', shape.box = {{ lower = [0], upper = [30] }} }}
            set.left.where = 'x < 3'
            condition.move = {{ set = 'left', {motion} }}
            time = {{ end = 6, {time} }}
            "
        );
        simulate(&deck, |mut simulation: Simulation<1>| {
            let mut observer = HistoryObserver::new(&simulation).unwrap();
            let rows = rows_to_the_end(&mut observer, &mut simulation);
            let names = ["energy_error", "external_work"];
            let [error, work] = names.map(|name| {
                let column = column(&observer, name);
                rows.iter()
                    .fold(0.0_f64, |most, row| most.max(row[column].abs()))
            });
            error / work
        })
    };
    for motion in [
        "displacement = ['0.01*max(t - 2, 0)']",
        "displacement = ['0.01*max(t - 1.95, 0)']",
        "displacement = ['0.01*max(t - 2.15, 0)']",
        "velocity = ['0.01*step(t - 2.05)']",
        "displacement = ['1e-3*min(t, 2)^2 + 4e-3*max(t - 2, 0)']",
        // The motion ends with the run.
        "displacement = ['0.01*4*ramp(t, 2, 6)']",
    ] {
        let [fixed, adaptive] = ["step = 0.2", adaptive].map(|time| error(motion, time));
        assert!(fixed < 0.01, "{motion}: {fixed:e}");
        assert!(
            adaptive < 1.1 * fixed,
            "{motion}: {adaptive:e}, fixed {fixed:e}"
        );
    }
    // Halved steps give a quarter of the error.
    let smooth = "displacement = ['0.01*(1 - cos(t))']";
    let finer = adaptive
        .replace("0.1", "0.05")
        .replace("20", "40")
        .replace("0.2", "0.1");
    let ratio = error(smooth, adaptive) / error(smooth, &finer);
    assert!((3.5..4.5).contains(&ratio), "{ratio}");
}

#[test]
fn ranks_do_not_change_a_bit() {
    let deck = torn(&format!("safety = 0.8, {RULE}"));
    let run = |ranks: usize| {
        let parts = simulate_on(ranks, &deck, |mut simulation: Simulation<2>| {
            while !simulation.is_over() {
                simulation.advance();
            }
            state(&simulation).1
        });
        whole(parts)
    };
    let one = run(1);
    assert!(run(2) == one);
    assert!(run(3) == one);
}

#[test]
fn goes_on_from_any_step_to_the_same_bits() {
    let problem = problem(&torn(&format!("safety = 0.8, {RULE}")));
    let run = |stop: u64| {
        let parts = threads::run(2, |comm: &dyn Communicator| {
            let mut simulation = Simulation::<2>::new(&problem, comm).unwrap();
            for _ in 0..stop {
                simulation.advance();
            }
            if stop > 0 {
                let (order, saved) = state(&simulation);
                simulation = Simulation::new(&problem, comm).unwrap();
                simulation.restore(&order, &saved).unwrap();
                assert_eq!(state(&simulation).1, saved);
            }
            while !simulation.is_over() {
                simulation.advance();
            }
            (state(&simulation).1, simulation.clock.number())
        });
        let number = parts[0].1;
        (
            whole(parts.into_iter().map(|part| part.0).collect()),
            number,
        )
    };
    let (expected, number) = run(0);
    for share in [0.3, 0.5, 0.6, 0.8] {
        let stop = (share * number as f64) as u64;
        assert!(run(stop).0 == expected, "stopped after {stop} of {number}");
    }
}
