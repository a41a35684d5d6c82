//! Helpers for relaxation and Newton's method.

use super::history::{column, row};
use super::saved::{state, whole};
use super::simulate_on;
use fissure::solver::Simulation;
use fissure::solver::observers::HistoryObserver;

/// Advance through all load steps to the end.
pub fn to_the_end<const D: usize>(simulation: &mut Simulation<D>) {
    while !simulation.is_over() {
        simulation.advance();
        simulation.check().unwrap_or_else(|error| panic!("{error}"));
    }
}

/// Advance through all load steps, and return the values of the named columns of the history at the end.
pub fn values_at_the_end<const D: usize, const N: usize>(
    mut simulation: Simulation<D>,
    names: [&str; N],
) -> [f64; N] {
    let observer = HistoryObserver::new(&simulation);
    let mut observer = observer.unwrap_or_else(|error| panic!("{error}"));
    to_the_end(&mut simulation);
    let values = row(&mut observer, &mut simulation).values;
    names.map(|name| values[column(&observer, name)])
}

/// Return the deck of a notched plate that tears under supports and a load. `time` has further keys of
/// `[time]`.
pub fn torn_plate(family: &str, time: &str) -> String {
    format!(
        "dimension = 'plane-stress'
        grid = {{ spacing = 1, horizon = 3, family = '{family}' }}
        material.sheet.pmb = {{ density = 2, youngs_modulus = 5 }}
        damage.brittle.critical_stretch = {{ critical_stretch = 0.02, alpha = 0.1 }}
        body.plate = {{ material = 'sheet', damage = 'brittle', shape.box = {{ lower = [0, 0], upper = [24, 16] }} }}
        crack.notch.segment = {{ from = [-1, 8], to = [8, 8] }}
        set.top.where = 'y > 13'
        set.bottom.where = 'y < 3'
        set.right.where = 'x > 22'
        condition.down = {{ set = 'bottom', velocity = [0, '-0.04'] }}
        condition.up = {{ set = 'top', displacement = [0, '0.04*t'] }}
        condition.push = {{ set = 'right', body_force = ['1e-4*t', 0] }}
        time = {{ end = 4, {time} }}
        "
    )
}

/// Assert that a plane problem has equal bits on one, two and three ranks, and that bonds break.
pub fn same_on_ranks(deck: &str) {
    let run = |ranks: usize| {
        let parts = simulate_on(ranks, deck, |mut simulation: Simulation<2>| {
            to_the_end(&mut simulation);
            state(&simulation).1
        });
        whole(parts)
    };
    let one = run(1);
    assert!(one.1.iter().any(|byte| *byte != one.1[0]), "no bond breaks");
    for ranks in [2, 3] {
        assert!(run(ranks) == one, "{ranks} ranks: {deck}");
    }
}
