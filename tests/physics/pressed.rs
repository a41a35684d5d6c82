//! Contact in relaxations: closed-form reactions, energies, and equal bits on any number of ranks and after a
//! restart.

use crate::support::history::{column, row};
use crate::support::saved::{state, whole};
use crate::support::{problem, simulate, simulate_on};
use fissure::comm::{Communicator, threads};
use fissure::solver::Simulation;
use fissure::solver::observers::HistoryObserver;

/// Run a deck, and return the named columns after each load step.
fn load_steps<const D: usize>(deck: &str, names: &[&str]) -> Vec<Vec<f64>> {
    simulate::<D, _>(deck, |mut simulation| {
        let mut observer = HistoryObserver::new(&simulation).unwrap();
        let places: Vec<usize> = names.iter().map(|name| column(&observer, name)).collect();
        let mut rows = Vec::new();
        while !simulation.is_over() {
            simulation.advance();
            simulation.check().unwrap_or_else(|error| panic!("{error}"));
            if simulation.progress.load_step.is_settled {
                let values = row(&mut observer, &mut simulation).values;
                rows.push(places.iter().map(|place| values[*place]).collect());
            }
        }
        rows
    })
}

/// Return a deck with a spacing of 1 m, E = 5 Pa and bonds between nearest neighbours only, which is a chain
/// of springs. The method is a relaxation with 4 load steps.
fn bars(bodies: &str) -> String {
    format!(
        "dimension = '1d'
        grid = {{ spacing = 1, horizon = 1.5, volume_correction = 'none' }}
        material.rubber.pmb = {{ density = 2, youngs_modulus = 5 }}
        {bodies}
        time = {{ end = 4, method = 'relaxation', relaxation = {{ load_steps = 4, tolerance = 1e-9 }} }}
        "
    )
}

/// Stiffnesses in [`bars`], N/m: 2E A ℓ/δ² of a bond, and E A/δ of a contact layer with the thickness δ.
const BOND: f64 = 2.0 * 5.0 / 2.25;
const LAYER: f64 = 5.0 / 1.5;

/// Assert that the energy error of each load step is small compared with `work`, J.
fn assert_balance(rows: &[Vec<f64>], error: usize, work: f64) {
    for row in rows {
        assert!(row[error].abs() < 1e-6 * work, "{row:?} of {work}");
    }
}

#[test]
fn a_block_between_a_rigid_floor_and_a_rigid_plate() {
    // The block has no support other than the contact.
    let deck = bars(
        "rigid.floor.half_space = { through = [0], normal = [1] }
        rigid.plate = { half_space = { through = [40], normal = [-1] }, motion = ['-0.1*t'] }
        body.bar = { material = 'rubber', shape.box = { lower = [0], upper = [40] } }",
    );
    let names = [
        "time",
        "rigid_floor_force_x",
        "rigid_plate_force_x",
        "external_work",
        "energy_error",
        "residual",
    ];
    let rows = load_steps::<1>(&deck, &names);
    assert_eq!(rows.len(), 4);
    // Half a contact layer at each end and 39 bonds act in series.
    let stiffness = 1.0 / (1.0 / LAYER + 39.0 / BOND);
    for row in &rows {
        let pressed = 0.1 * row[0];
        for force in [-row[1], row[2]] {
            assert!(
                (force / (stiffness * pressed) - 1.0).abs() < 1e-6,
                "{row:?}"
            );
        }
        let work = 0.5 * stiffness * pressed * pressed;
        assert!((row[3] / work - 1.0).abs() < 1e-6, "{row:?} for {work}");
        assert!(row[5] <= 1e-9, "{row:?}");
    }
    assert_balance(&rows, 4, rows[3][3]);
}

#[test]
fn two_blocks_pressed_together_and_pulled_apart() {
    let deck = bars(
        "contact.pair.hit.bodies = ['left', 'right']
        body.left = { material = 'rubber', shape.box = { lower = [0], upper = [20] } }
        body.right = { material = 'rubber', shape.box = { lower = [20], upper = [50] } }
        set = { first.where = 'x < 1', last.where = 'x > 49' }
        condition.hold = { set = 'first', displacement = [0] }
        condition.push = { set = 'last', displacement = ['0.1*ramp(t, 0, 2) - 0.4*ramp(t, 0, 1) + 0.5*ramp(t, 2, 4)'] }
        history.reactions = ['first']",
    );
    let names = [
        "time",
        "reaction_first_x",
        "contact_hit_force_x",
        "energy_error",
        "external_work",
    ];
    let rows = load_steps::<1>(&deck, &names);
    // One whole contact layer acts in series with 19 bonds on one side and 29 bonds on the other side. The
    // contact is open when the end has moved beyond its initial position.
    let stiffness = 1.0 / (1.0 / LAYER + 48.0 / BOND);
    for (row, moved) in rows.iter().zip([-0.35, -0.3, -0.05, 0.2]) {
        let force = stiffness * f64::max(-moved, 0.0);
        assert!((row[1] - force).abs() < 1e-6, "{row:?} for {force}");
        assert!((row[2] + force).abs() < 1e-6, "{row:?} for {force}");
    }
    // The contact opens within the last load step, so the work of the trapezoid rule is inaccurate in this
    // step.
    assert_balance(&rows[..3], 3, rows[0][4].abs());
}

/// Return the deck of a block with a crack through it, whose halves are pressed together.
fn cracked_block(contact: &str) -> String {
    format!(
        "dimension = 'plane-strain'
        grid = {{ spacing = 1, horizon = 3.015 }}
        material.rubber.pmb = {{ density = 2, youngs_modulus = 5 }}
        {contact}
        body.block = {{ material = 'rubber', shape.box = {{ lower = [0, 0], upper = [10, 20] }} }}
        crack.through.segment = {{ from = [-1, 10], to = [11, 10] }}
        set = {{ top.where = 'y > 18', bottom.where = 'y < 2' }}
        condition.hold = {{ set = 'bottom', displacement = ['free', 0] }}
        condition.side = {{ set = 'bottom', displacement = [0, 'free'] }}
        condition.push = {{ set = 'top', displacement = [0, '-0.2*t'] }}
        history.force.top = {{ set = 'top', direction = [0, -1] }}
        time = {{ end = 1, method = 'relaxation', relaxation = {{ load_steps = 2, tolerance = 1e-6 }} }}
        "
    )
}

#[test]
fn a_closed_crack_carries_load_in_equilibrium() {
    let force = |deck: &str| {
        let rows = load_steps::<2>(deck, &["force_top"]);
        rows.last().unwrap()[0]
    };
    let whole = force(&cracked_block("").replace("crack.through", "#"));
    let closed = force(&cracked_block("contact = {}"));
    let open = force(&cracked_block(""));
    assert!(open.abs() < 1e-4 * whole, "{open} of {whole}");
    // The contact layer is in series with the 17 m between the supports, which gives the ratio
    // 17/(17 + 3.015/(1 − 1/16)) = 0.84. The crack faces are softer than the inside, which reduces this ratio
    // slightly.
    assert!(
        (0.77..0.86).contains(&(closed / whole)),
        "{closed} of {whole}"
    );
}

/// A rigid disc is pressed into a block that breaks; the block lies on another block.
const INDENTED: &str = "
    dimension = 'plane-strain'
    grid = { spacing = 1, horizon = 2.5 }
    contact = { restitution = 0.5 }
    material.rubber.pmb = { density = 2, youngs_modulus = 5 }
    damage.brittle.critical_stretch = { critical_stretch = 0.03 }
    body.lower = { material = 'rubber', shape.box = { lower = [0, 0], upper = [18, 4] } }
    body.upper = { material = 'rubber', damage = 'brittle', shape.box = { lower = [3, 4], upper = [15, 8] } }
    rigid.indenter = { shape.disc = { centre = [9.2, 10], radius = 2 }, motion = [0, '-0.3*t'] }
    set.ends.where = 'y < 2 && abs(x - 9) > 5'
    condition.hold = { set = 'ends', displacement = [0, 0] }
    time = { end = 6, method = 'relaxation', relaxation = { load_steps = 6, tolerance = 1e-4 } }
    ";

#[test]
fn ranks_do_not_change_a_bit_of_pressed_bodies() {
    let run = |ranks: usize| {
        let parts = simulate_on(ranks, INDENTED, |mut simulation: Simulation<2>| {
            while !simulation.is_over() {
                simulation.advance();
                simulation.check().unwrap_or_else(|error| panic!("{error}"));
            }
            let mut broken = 0;
            simulation.forces.for_each_broken(|_, _| broken += 1);
            (state(&simulation).1, broken)
        });
        let broken: u64 = parts.iter().map(|part| part.1).sum();
        (
            whole(parts.into_iter().map(|part| part.0).collect()),
            broken,
        )
    };
    let one = run(1);
    assert!(one.1 > 0, "no bond breaks");
    for ranks in [2, 3] {
        assert!(run(ranks) == one, "{ranks} ranks");
    }
}

#[test]
fn pressed_bodies_go_on_from_within_a_load_step_to_the_same_bits() {
    let problem = problem(INDENTED);
    let run = |stop: usize| {
        let parts = threads::run(2, |comm: &dyn Communicator| {
            let mut simulation = Simulation::<2>::new(&problem, comm).unwrap();
            let mut turns = 0;
            while turns < stop {
                simulation.advance();
                turns += 1;
            }
            if stop > 0 {
                let (order, saved) = state(&simulation);
                simulation = Simulation::new(&problem, comm).unwrap();
                simulation.restore(&order, &saved).unwrap();
            }
            while !simulation.is_over() {
                simulation.advance();
                turns += 1;
            }
            (state(&simulation).1, turns)
        });
        let turns = parts[0].1;
        (whole(parts.into_iter().map(|part| part.0).collect()), turns)
    };
    let (expected, turns) = run(0);
    for share in [0.2, 0.55, 0.9] {
        let found = run((share * turns as f64) as usize).0;
        assert!(found == expected, "stopped after {share} of {turns}");
    }
}
