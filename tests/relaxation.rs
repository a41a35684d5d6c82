//! Relaxation: the equilibrium is that of an independent static solution of the same bonds, whatever
//! the load steps; bonds break between equilibria, without the overshoot of a wave; it can be stopped
//! within a load step and goes on to the same bits.

use crate::support::saved::{state, whole};
use crate::support::{plan, simulate, simulate_on};
use fissure::comm::{Communicator, threads};
use fissure::deck::Plan;
use fissure::solver::Simulation;
use fissure::solver::bonds::Evolution;
use fissure::solver::observers::{HistoryObserver, Snapshot};

/// Makes all load steps.
fn to_the_end<const D: usize>(simulation: &mut Simulation<D>) {
    while !simulation.is_over() {
        simulation.advance();
        simulation.check().unwrap_or_else(|error| panic!("{error}"));
    }
}

/// Makes a whole load step.
fn load_step<const D: usize>(simulation: &mut Simulation<D>) {
    simulation.advance();
    while !simulation.load_step.is_settled {
        simulation.advance();
        simulation.check().unwrap_or_else(|error| panic!("{error}"));
    }
}

/// A plate with a hole that is pulled apart, fixed below.
fn plate_with_hole(relaxation: &str) -> String {
    format!(
        "dimension = 'plane-stress'
        thickness = 0.5
        grid = {{ spacing = 1, horizon = 3, volume_correction = 'none' }}
        material.sheet.linear_microelastic = {{ density = 2, youngs_modulus = 5 }}
        [body.plate]
        material = 'sheet'
        shape.difference = [
            {{ box = {{ lower = [0, 0], upper = [20, 30] }} }},
            {{ disc = {{ centre = [10, 15], radius = 4 }} }},
        ]
        [set]
        top.where = 'y > 27'
        bottom.where = 'y < 3'
        right.where = 'x > 19'
        [condition]
        hold = {{ set = 'bottom', displacement = [0, 0] }}
        pull = {{ set = 'top', displacement = ['free', '0.02*t'] }}
        push = {{ set = 'right', body_force = ['1e-4*t', 0] }}
        [time]
        end = 1
        method = 'relaxation'
        relaxation = {{ {relaxation} }}
        "
    )
}

/// Solves K u = f for the linear bonds of the plate, without any part of the solver but its points:
/// bonds by distance, supports by place, conjugate gradients. Returns u by component, by point.
fn static_solution(places: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let (young, ratio, thickness, horizon, volume) = (5.0, 1.0 / 3.0, 0.5, 3.0, 0.5);
    let pi = std::f64::consts::PI;
    let micromodulus = 6.0 * young / (pi * f64::powi(horizon, 3) * (1.0 - ratio) * thickness);
    let mut bonds = Vec::new();
    for (i, a) in places.iter().enumerate() {
        for (j, b) in places.iter().enumerate().skip(i + 1) {
            let bond = [b[0] - a[0], b[1] - a[1]];
            let length = bond[0].hypot(bond[1]);
            if length <= horizon * (1.0 + 1e-9) {
                // Both ends' share, times both volumes.
                let stiffness = micromodulus / length.powi(3) * volume * volume;
                bonds.push((i, j, bond, stiffness));
            }
        }
    }
    let forces = |u: &[[f64; 2]]| {
        let mut forces = vec![[0.0; 2]; u.len()];
        for (i, j, bond, stiffness) in &bonds {
            let along = (0..2).map(|d| bond[d] * (u[*j][d] - u[*i][d])).sum::<f64>();
            for d in 0..2 {
                forces[*i][d] += stiffness * along * bond[d];
                forces[*j][d] -= stiffness * along * bond[d];
            }
        }
        forces
    };
    let is_free = |place: &[f64; 2], d: usize| place[1] > 3.0 && (d == 0 || place[1] < 27.0);
    let dot = |a: &[[f64; 2]], b: &[[f64; 2]]| -> f64 {
        let pairs = a.iter().flatten().zip(b.iter().flatten());
        pairs.map(|(a, b)| a * b).sum()
    };
    let masked = |mut values: Vec<[f64; 2]>| {
        for (value, place) in values.iter_mut().zip(places) {
            for (d, value) in value.iter_mut().enumerate() {
                if !is_free(place, d) {
                    *value = 0.0;
                }
            }
        }
        values
    };
    let mut u: Vec<[f64; 2]> = places
        .iter()
        .map(|place| [0.0, if place[1] > 27.0 { 0.02 } else { 0.0 }])
        .collect();
    let mut residual = forces(&u);
    for (force, place) in residual.iter_mut().zip(places) {
        force[0] += if place[0] > 19.0 { 1e-4 * volume } else { 0.0 };
    }
    let mut residual = masked(residual);
    let mut direction = residual.clone();
    let start = dot(&residual, &residual);
    let mut square = start;
    while square > 1e-26 * start {
        let against = masked(forces(&direction));
        let length = -square / dot(&direction, &against);
        let step = |values: &mut [[f64; 2]], by: &[[f64; 2]], sign: f64| {
            for (value, by) in values.iter_mut().zip(by) {
                for d in 0..2 {
                    value[d] += sign * length * by[d];
                }
            }
        };
        step(&mut u, &direction, 1.0);
        step(&mut residual, &against, 1.0);
        let next = dot(&residual, &residual);
        for (direction, residual) in direction.iter_mut().zip(&residual) {
            for d in 0..2 {
                direction[d] = residual[d] + next / square * direction[d];
            }
        }
        square = next;
    }
    u
}

fn displacements(simulation: &Simulation<2>) -> Vec<[f64; 2]> {
    let u = &simulation.fields.displacement;
    (0..simulation.model.owned())
        .map(|point| [u[0][point], u[1][point]])
        .collect()
}

/// The largest difference as a share of the largest displacement.
fn difference(a: &[[f64; 2]], b: &[[f64; 2]]) -> f64 {
    let all = |values: &[[f64; 2]]| values.iter().flatten().copied().collect::<Vec<f64>>();
    let (a, b) = (all(a), all(b));
    let largest = b
        .iter()
        .fold(0.0, |most, value: &f64| value.abs().max(most));
    let differences = a.iter().zip(&b).map(|(a, b)| (a - b).abs());
    differences.fold(0.0, f64::max) / largest
}

#[test]
fn finds_the_static_solution_of_the_same_bonds() {
    let deck = plate_with_hole("load_steps = 1, tolerance = 1e-9");
    let (places, relaxed, work) = simulate(&deck, |mut simulation: Simulation<2>| {
        let mut observer = HistoryObserver::new(&simulation).unwrap();
        let mut row = |simulation: &mut Simulation<2>| {
            let snapshot = Snapshot::new(simulation);
            observer.row(simulation, &snapshot).energies
        };
        row(&mut simulation);
        to_the_end(&mut simulation);
        let model = &simulation.model;
        let places: Vec<[f64; 2]> = (0..model.owned())
            .map(|point| [model.reference[0][point], model.reference[1][point]])
            .collect();
        let relaxed = displacements(&simulation);
        (places, relaxed, row(&mut simulation))
    });
    let exact = static_solution(&places);
    let error = difference(&relaxed, &exact);
    assert!(error < 1e-6, "{error:e}");
    // The trapezoid rule is exact for a linear body.
    assert_eq!(work.kinetic, 0.0);
    assert!(
        work.strain > 0.0 && work.error.abs() < 1e-6 * work.strain,
        "{work:?}"
    );
}

#[test]
fn load_steps_do_not_change_the_equilibrium_of_an_elastic_body() {
    let run = |steps: u32| {
        let deck = plate_with_hole(&format!("load_steps = {steps}, tolerance = 1e-9"))
            .replace("linear_microelastic", "pmb");
        simulate(&deck, |mut simulation: Simulation<2>| {
            to_the_end(&mut simulation);
            assert_eq!(simulation.clock.number(), u64::from(steps));
            displacements(&simulation)
        })
    };
    let error = difference(&run(1), &run(5));
    assert!(error < 1e-6, "{error:e}");
}

#[test]
fn a_body_that_nothing_holds_says_so() {
    let deck = plate_with_hole("load_steps = 1, iterations = 300")
        .replace(
            "hold = {",
            "other = { set = 'top', body_force = [0, 1e-9] }\n hold = {",
        )
        .replace(
            "set = 'bottom', displacement = [0, 0]",
            "set = 'bottom', displacement = ['free', 0]",
        );
    simulate(&deck, |mut simulation: Simulation<2>| {
        let error = loop {
            simulation.advance();
            if let Err(error) = simulation.check() {
                break error;
            }
        };
        let text = error.message;
        assert!(
            text.contains("no equilibrium within 300 iterations"),
            "{text}"
        );
        assert!(text.contains("a part that nothing holds?"), "{text}");
    });
}

/// A bar of brittle bonds that is pulled apart at its ends.
const BAR: &str = "
    dimension = '1d'
    grid = { spacing = 1, horizon = 3 }
    material.rubber.pmb = { density = 2, youngs_modulus = 5 }
    damage.brittle.critical_stretch = { critical_stretch = 0.0105, alpha = 0, no_failure = ['ends'] }
    body.bar = { material = 'rubber', damage = 'brittle', shape.box = { lower = [0], upper = [40] } }
    set.ends.where = 'x < 4 || x > 36'
    set.left.where = 'x < 3'
    set.right.where = 'x > 37'
    condition.left = { set = 'left', displacement = ['-0.19*t'] }
    condition.right = { set = 'right', displacement = ['0.19*t'] }
    time = { end = 1.5, method = 'relaxation', relaxation = { load_steps = 15, tolerance = 1e-8 } }
    history.reactions = ['right']
    ";

#[test]
fn a_bar_breaks_when_it_must_and_carries_nothing_from_then_on() {
    simulate(BAR, |mut simulation: Simulation<1>| {
        let mut observer = HistoryObserver::new(&simulation).unwrap();
        let columns: Vec<String> = observer.columns().iter().map(|c| c.0.clone()).collect();
        let find = |name: &str| columns.iter().position(|column| column == name).unwrap();
        let (force, broken) = (find("reaction_right_x"), find("broken_bonds"));
        let (residual, iterations) = (find("residual"), find("iterations"));
        let mut rows = Vec::new();
        let snapshot = Snapshot::new(&mut simulation);
        rows.push(observer.row(&mut simulation, &snapshot).values);
        while !simulation.is_over() {
            load_step(&mut simulation);
            let snapshot = Snapshot::new(&mut simulation);
            rows.push(observer.row(&mut simulation, &snapshot).values);
        }
        let first = rows.iter().position(|row| row[broken] > 0.0).unwrap();
        // Linear until then: 35 m between the outermost points that are held.
        let strain = 0.38 * rows[first][0] / 35.0;
        assert!((0.9..1.1).contains(&(strain / 0.0105)), "{:?}", rows[first]);
        let slope = rows[1][force] / rows[1][0];
        for row in &rows[1..first] {
            assert!(
                (row[force] / row[0] - slope).abs() < 1e-6 * slope,
                "{row:?}"
            );
        }
        // All bonds across one section, in the same load step; then both halves are free of forces.
        assert_eq!(rows.last().unwrap()[broken], rows[first][broken]);
        for row in &rows[first..] {
            assert!(row[force].abs() < 1e-6 * rows[first - 1][force], "{row:?}");
        }
        assert!(rows[1][iterations] >= 10.0, "{:?}", rows[1]);
        for row in &rows[1..] {
            assert!(row[residual] <= 1e-8, "{row:?}");
        }
    });
}

/// A notched plate that is torn, with bonds of two kinds.
fn torn(family: &str) -> String {
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
        time = {{ end = 4, method = 'relaxation', relaxation = {{ load_steps = 8, tolerance = 1e-5 }} }}
        "
    )
}

#[test]
fn ranks_do_not_change_a_bit() {
    for family in ["lattice", "list"] {
        let run = |ranks: usize| {
            let parts = simulate_on(ranks, &torn(family), |mut simulation: Simulation<2>| {
                to_the_end(&mut simulation);
                state(&simulation).1
            });
            whole(parts)
        };
        let one = run(1);
        let broken = one.1.iter().any(|byte| *byte != one.1[0]);
        assert!(broken);
        for ranks in [2, 3] {
            assert!(run(ranks) == one, "{family}, {ranks} ranks");
        }
    }
}

#[test]
fn goes_on_from_within_a_load_step_to_the_same_bits() {
    let plan: Plan = plan(&torn("lattice"));
    let run = |stop: usize| {
        let parts = threads::run(2, |comm: &dyn Communicator| {
            let mut simulation = Simulation::<2>::new(&plan, comm).unwrap();
            for _ in 0..stop {
                simulation.advance();
            }
            let settled = simulation.load_step.is_settled;
            if stop > 0 {
                let (order, saved) = state(&simulation);
                simulation = Simulation::new(&plan, comm).unwrap();
                simulation.restore(&order, &saved).unwrap();
                assert_eq!(state(&simulation).1, saved);
            }
            let mut turns = stop;
            while !simulation.is_over() {
                simulation.advance();
                simulation.check().unwrap_or_else(|error| panic!("{error}"));
                turns += 1;
            }
            (state(&simulation).1, settled, turns)
        });
        let (settled, turns) = (parts[0].1, parts[0].2);
        let parts = parts.into_iter().map(|part| part.0).collect();
        (whole(parts), settled, turns)
    };
    let (expected, _, turns) = run(0);
    let mut within = 0;
    for share in [0.1, 0.33, 0.5, 0.71, 0.9] {
        let (found, settled, _) = run((share * turns as f64) as usize);
        assert!(found == expected, "stopped after {share} of {turns}");
        within += usize::from(!settled);
    }
    assert!(within >= 3, "{within} stops within a load step");
}

/// A strip of a solid whose bonds flow is pulled to ten times its yield strain. Its force was measured with 500 load steps;
/// the bound of a continuum is 2/√3 σ_y A = 6.93 N, and families at surfaces carry more.
#[test]
fn bonds_that_flow_are_in_equilibrium_after_any_number_of_load_steps() {
    for steps in [1, 5, 20] {
        let deck = format!(
            "dimension = 'plane-strain'
            thickness = 1e-3
            grid = {{ spacing = 1e-3, horizon = 3e-3 }}
            material.soft.ordinary_plastic = {{ density = 1000, youngs_modulus = 1e9, poisson_ratio = 0.3, yield_stress = 1e6 }}
            body.strip = {{ material = 'soft', shape.box = {{ lower = [0, 0], upper = [0.02, 6e-3] }} }}
            set.left.where = 'x < 3e-3'
            set.right.where = 'x > 0.017'
            condition.left = {{ set = 'left', displacement = [0, 'free'] }}
            condition.right = {{ set = 'right', displacement = ['6e-5*t', 'free'] }}
            time = {{ end = 1, method = 'relaxation', relaxation = {{ load_steps = {steps} }} }}
            "
        );
        simulate(&deck, |mut simulation: Simulation<2>| {
            to_the_end(&mut simulation);
            let fields = &simulation.fields;
            let model = &simulation.model;
            let reaction = fields.reaction.as_ref().unwrap();
            let right = (0..model.owned()).filter(|k| model.position(*k)[0] > 0.017);
            let pull: f64 = right.map(|k| reaction[0][k] * model.volume[k]).sum();
            assert!((pull / 8.76 - 1.0).abs() < 5e-3, "{steps}: {pull} N");
            // The forces that go with the stored history are those of the equilibrium.
            let before = fields.internal_force.clone();
            simulation.evaluate(Evolution::None);
            assert_eq!(simulation.fields.internal_force, before, "{steps}");
        });
    }
}
