//! Contact in relaxations: closed-form reactions, energies, thermal expansion, and equal bits on any number
//! of ranks and after a restart. Also the errors of runs that do not support their contact.

use std::time::Instant;

use crate::support::history::{column, row};
use crate::support::saved::{state, whole};
use crate::support::{displace, largest_force, problem, simulate, simulate_on};
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
fn no_time_of_a_relaxation_counts_twice() {
    let deck = bars(
        "rigid.floor.half_space = { through = [0], normal = [1] }
        rigid.plate = { half_space = { through = [40], normal = [-1] }, motion = ['-0.1*t'] }
        body.bar = { material = 'rubber', shape.box = { lower = [0], upper = [40] } }",
    );
    simulate(&deck, |mut simulation: Simulation<1>| {
        let start = Instant::now();
        while !simulation.is_over() {
            simulation.advance();
        }
        let (times, whole) = (simulation.times, start.elapsed());
        let phases = times.forces.whole() + times.contact + times.motion;
        assert!(!times.contact.is_zero());
        assert!(phases <= whole, "{phases:?} of {whole:?}");
    });
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

/// Return the deck [`bars`] in which every point has the thermal stretch 1e-6 t.
fn heated_bars(bodies: &str) -> String {
    let expands = "youngs_modulus = 5, thermal_expansion = 1e-6 }";
    let text = bars(bodies).replace("youngs_modulus = 5 }", expands);
    format!("{text}\ncondition.heat = {{ set = 'all', temperature = 't' }}\n")
}

#[test]
fn heated_bars_between_supports_press_on_each_other() {
    let deck = heated_bars(
        "contact.pair.hit.bodies = ['left', 'right']
        body.left = { material = 'rubber', shape.box = { lower = [0], upper = [20] } }
        body.right = { material = 'rubber', shape.box = { lower = [20], upper = [50] } }
        set = { first.where = 'x < 1', last.where = 'x > 49' }
        condition.hold = { set = 'first', displacement = [0] }
        condition.stop = { set = 'last', displacement = [0] }",
    );
    // The contact distance expands like the 48 bonds.
    let stiffness = 1.0 / (1.0 / LAYER + 48.0 / BOND);
    for row in load_steps::<1>(&deck, &["time", "contact_hit_force_x"]) {
        let force = stiffness * 49.0 * 1e-6 * row[0];
        // `force` is linear in the stretch, which is 4e-6 at the end.
        assert!((row[1] / force + 1.0).abs() < 1e-5, "{row:?} for {force}");
    }
}

#[test]
fn a_heated_bar_presses_on_rigid_plates() {
    let deck = heated_bars(
        "rigid.floor.half_space = { through = [0], normal = [1] }
        rigid.plate.half_space = { through = [40], normal = [-1] }
        body.bar = { material = 'rubber', shape.box = { lower = [0], upper = [40] } }",
    );
    let stiffness = 1.0 / (1.0 / LAYER + 39.0 / BOND);
    for row in load_steps::<1>(&deck, &["time", "rigid_plate_force_x"]) {
        let force = stiffness * 40.0 * 1e-6 * row[0];
        // `force` is linear in the stretch, which is 4e-6 at the end.
        assert!((row[1] / force - 1.0).abs() < 1e-5, "{row:?} for {force}");
    }
}

/// Set the thermal stretch of all points, and evaluate the forces at the present positions `map`.
fn heat<const D: usize>(
    simulation: &mut Simulation<D>,
    stretch: f64,
    map: impl Fn([f64; 3]) -> [f64; 3],
) {
    let column = simulation.fields.thermal_stretch.as_mut().unwrap();
    column.fill(stretch);
    displace(simulation, map);
}

#[test]
fn free_expansion_of_a_cracked_body_causes_no_contact() {
    for model in ["penalty", "short-range"] {
        let deck = format!(
            "dimension = 'plane-stress'
            grid = {{ spacing = 1, horizon = 3 }}
            contact.model = '{model}'
            material.rubber.pmb = {{ density = 2, youngs_modulus = 5, thermal_expansion = 1e-5 }}
            body.block = {{ material = 'rubber', shape.box = {{ lower = [-8, -8], upper = [8, 8] }} }}
            crack.edge.segment = {{ from = [-8, 0], to = [0, 0] }}
            condition.heat = {{ set = 'all', temperature = 0 }}
            time.end = 1
            "
        );
        simulate::<2, _>(&deck, |mut simulation| {
            for thermal in [-0.01, 0.01, 0.3] {
                heat(&mut simulation, thermal, |place| place);
                let scale = largest_force(&simulation);
                let free = |place: [f64; 3]| place.map(|x| (1.0 + thermal) * x);
                heat(&mut simulation, thermal, free);
                let force = largest_force(&simulation);
                assert!(
                    force < 1e-10 * scale,
                    "{model}, {thermal}: {force} of {scale}"
                );
            }
        });
    }
}

#[test]
fn heat_alone_brings_points_into_contact() {
    // The bars are 0.6 m farther apart than their contact distance. The search in the cold bars does not find
    // pairs with such a gap.
    let deck = "
        dimension = '1d'
        grid = { spacing = 1, horizon = 1.5, volume_correction = 'none' }
        material.rubber.pmb = { density = 2, youngs_modulus = 5, thermal_expansion = 1e-5 }
        contact.pair.hit.bodies = ['left', 'right']
        body.left = { material = 'rubber', shape.box = { lower = [0], upper = [20] } }
        body.right = { material = 'rubber', shape.box = { lower = [20], upper = [40] } }
        condition.heat = { set = 'all', temperature = 0 }
        time.end = 1
        ";
    for ranks in [1, 2] {
        let found = simulate_on::<1, _>(ranks, deck, |mut simulation| {
            let mut touching = |thermal: f64| {
                let apart = |[x, y, z]: [f64; 3]| [if x > 20.0 { x + 0.6 } else { x }, y, z];
                heat(&mut simulation, thermal, apart);
                let force = &simulation.fields.contact_force.as_ref().unwrap()[0];
                let owned = &force[..simulation.model.owned()];
                owned.iter().filter(|force| **force != 0.0).count()
            };
            [0.0, 0.59, 0.61, 0.3].map(&mut touching)
        });
        let all = [0, 1, 2, 3].map(|k| found.iter().map(|counts| counts[k]).sum::<usize>());
        assert_eq!(all, [0, 0, 2, 0], "{ranks} ranks");
    }
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

/// The fine body has many contacts that are stiffer than its bonds. If points lost their additional
/// fictitious density whenever they separate, they would bounce forever.
#[test]
fn a_contact_that_is_stiffer_than_the_bonds_comes_to_rest() {
    let deck = "
        dimension = 'plane-strain'
        grid = { spacing = 1, horizon = 3 }
        contact = {}
        material.rubber.pmb = { density = 2, youngs_modulus = 5 }
        body.coarse = { material = 'rubber', shape.box = { lower = [0, -6], upper = [6, 0] } }
        body.fine = { material = 'rubber', spacing = 0.25, horizon = 0.75, shape.box = { lower = [0, 0], upper = [6, 6] } }
        set = { bottom.where = 'y < -5', top.where = 'y > 5.75', left.where = 'x < 0.25 || (x < 1 && y < 0)' }
        condition.hold = { set = 'bottom', displacement = ['free', 0] }
        condition.side = { set = 'left', displacement = [0, 'free'] }
        condition.push = { set = 'top', traction = [0, '-0.005*t'] }
        history.reactions = ['bottom']
        time = { end = 1, method = 'relaxation', relaxation = { load_steps = 2, tolerance = 1e-6 } }
        ";
    let rows = load_steps::<2>(deck, &["reaction_bottom_y"]);
    for (row, load) in rows.iter().zip([0.015, 0.03]) {
        assert!((row[0] / load - 1.0).abs() < 1e-4, "{row:?} {load}");
    }
    assert_eq!(rows.len(), 2);
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

/// Return the deck [`INDENTED`] with temperatures that increase with time and along x.
fn heated_and_indented() -> String {
    let expands = "youngs_modulus = 5, thermal_expansion = 1e-3 }";
    let text = INDENTED.replace("youngs_modulus = 5 }", expands);
    format!("{text}\ncondition.heat = {{ set = 'all', temperature = '0.3*x*t' }}\n")
}

#[test]
fn ranks_do_not_change_a_bit_of_pressed_bodies() {
    for deck in [INDENTED, &heated_and_indented()] {
        check_ranks(deck);
    }
}

/// Check that a run has the same bits on one, two and three ranks.
fn check_ranks(deck: &str) {
    let run = |ranks: usize| {
        let parts = simulate_on(ranks, deck, |mut simulation: Simulation<2>| {
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
    for deck in [INDENTED, &heated_and_indented()] {
        check_restarts(deck);
    }
}

/// Check that a run that is restored at several times has the bits of a run without interruption.
fn check_restarts(deck: &str) {
    let problem = problem(deck);
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

#[test]
fn contact_that_a_run_does_not_support_is_rejected_without_a_deck() {
    let deck = |settings: &str| {
        problem(&format!(
            "dimension = 'plane-stress'
            grid = {{ spacing = 1, horizon = 3 }}
            material.rubber.pmb = {{ density = 2, youngs_modulus = 5 }}
            body.plate = {{ material = 'rubber', shape.box = {{ lower = [0, 0], upper = [8, 6] }} }}
            {settings}
            "
        ))
    };
    let with_method = |contact: &str, method: &str| {
        let mut problem = deck(&format!("time.end = 2\n{contact}"));
        let other = deck(&format!("time = {{ end = 2, method = '{method}' }}"));
        problem.time.method = other.time.method;
        problem
    };
    let mut refined = deck("time.end = 2\ncontact = {}");
    let trigger = deck("time.end = 2\nrefinement = { levels = 1, trigger = { energy = 0.5 } }");
    refined.refinement = trigger.refinement;
    let ball = |keys: &str| {
        format!("rigid.ball = {{ shape.disc = {{ centre = [4, 9], radius = 2 }}, {keys} }}")
    };
    let rough_pair = "contact.pair.own = { bodies = ['plate', 'plate'], static_friction = 0.3, model = 'penalty' }";
    let cases = [
        (refined, "[refinement.trigger]: contact is not available"),
        (
            with_method("contact = {}", "static"),
            "[time] method: \"static\"",
        ),
        (
            with_method(&ball("stiffness = 3"), "static"),
            "[time] method: \"static\"",
        ),
        (
            with_method("contact.friction = 0.3", "relaxation"),
            "[contact]: friction depends on velocities",
        ),
        (
            with_method(rough_pair, "relaxation"),
            "[contact.pair.own]: friction depends on velocities",
        ),
        (
            with_method(&ball("friction = 0.3"), "relaxation"),
            "[rigid.ball]: friction depends on velocities",
        ),
        (
            with_method(&ball("mass = 3"), "relaxation"),
            "[rigid.ball]: a free body is not available",
        ),
    ];
    for (problem, expected) in cases {
        let comm = threads::alone();
        let result = Simulation::<2>::new(&problem, &comm);
        let message = result.err().map(|error| error.message);
        let message = message.unwrap_or_else(|| panic!("no error: {expected}"));
        assert!(message.starts_with(expected), "{message}");
    }
}
