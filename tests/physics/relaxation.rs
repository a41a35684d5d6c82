//! Relaxation. The equilibrium equals an independent static solution of the same bonds, for any number of
//! load steps. Bonds break in equilibria, without dynamic overshoot. A restart within a load step gives equal
//! bits.

use crate::support::equilibria::{same_on_ranks, to_the_end, torn_plate};
use crate::support::history::{column, row};
use crate::support::saved::{state, whole};
use crate::support::{problem, simulate, simulate_on};
use fissure::comm::{Communicator, threads};
use fissure::error::ErrorKind;
use fissure::problem::Problem;
use fissure::solver::Simulation;
use fissure::solver::bonds::BondUpdate;
use fissure::solver::observers::{Energies, HistoryObserver, Snapshot};

/// Advance by one complete load step.
fn load_step<const D: usize>(simulation: &mut Simulation<D>) {
    simulation.advance();
    while !simulation.progress.load_step.is_settled {
        simulation.advance();
        simulation.check().unwrap_or_else(|error| panic!("{error}"));
    }
}

/// Return the deck of a plate with a hole under tension, fixed below.
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

/// Solve K u = f for the linear bonds of the plate, independently of the solver except for the positions.
/// Bonds follow from distances and supports from positions; the method is conjugate gradients. Return u for
/// each point.
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
                // The contributions of both ends, times both volumes.
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

/// Return the largest difference, divided by the largest displacement.
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
        let mut row = |simulation: &mut Simulation<2>| row(&mut observer, simulation).energies;
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

/// Run a simulation that fails, and return its error message.
fn failure<const D: usize>(mut simulation: Simulation<D>) -> String {
    loop {
        simulation.advance();
        if let Err(error) = simulation.check() {
            return error.message;
        }
        assert!(!simulation.is_over());
    }
}

/// Return the error message of the set-up on each rank.
fn refusals<const D: usize>(ranks: usize, deck: &str) -> Vec<String> {
    let problem = problem(deck);
    threads::run(ranks, |comm: &dyn Communicator| {
        let error = Simulation::<D>::new(&problem, comm).err().unwrap();
        assert_eq!(error.kind, ErrorKind::Input);
        error.message
    })
}

#[test]
fn a_body_that_nothing_holds_says_so() {
    let deck = plate_with_hole("load_steps = 2, iterations = 300")
        .replace(
            "hold = {",
            "other = { set = 'top', body_force = [0, 1e-9] }\n hold = {",
        )
        .replace(
            "set = 'bottom', displacement = [0, 0]",
            "set = 'bottom', displacement = ['free', 0]",
        );
    let wanted = "[condition.push] body_force: at t = 5.000000e-1 s, loads of 7.500e-4 N act along x on a piece of body \
                  `plate` that no support holds along x";
    for text in refusals::<2>(2, &deck) {
        assert!(text.contains(wanted), "{text}");
    }
}

/// Return the deck of a bar with a body force, N/m³, that acts in the second of four load steps only. `hold`
/// is a further condition.
fn weighed_bar(method: &str, weight: f64, hold: &str) -> String {
    format!(
        "dimension = '1d'
        grid = {{ spacing = 1, horizon = 3 }}
        material.m.pmb = {{ density = 2, youngs_modulus = 5 }}
        damage.brittle.critical_stretch = {{ critical_stretch = 0.02 }}
        body.a = {{ material = 'm', damage = 'brittle', shape.box = {{ lower = [0], upper = [12] }} }}
        set.left.where = 'x < 3'
        condition.weight = {{ set = 'a', body_force = ['if(t > 0.4 && t < 0.6, {weight}, 0)'] }}
        {hold}
        time = {{ end = 1, method = '{method}', relaxation = {{ load_steps = 4, iterations = 2000 }} }}
        "
    )
}

#[test]
fn a_body_does_not_drift_until_forces_are_round_off() {
    for method in ["relaxation", "static"] {
        let wanted = "loads of 1.200e-2 N act along x on a piece of body `a` that no support holds along x. The piece \
                      has 12 points";
        let text = simulate(&weighed_bar(method, 1e-3, ""), failure::<1>);
        assert!(text.starts_with("t = 5.000000e-1 s: "), "{method}: {text}");
        assert!(text.contains(wanted), "{method}: {text}");
    }
}

#[test]
fn a_piece_that_breaks_off_is_named() {
    let hold = "condition.hold = { set = 'left', displacement = [0] }";
    for method in ["relaxation", "static"] {
        for ranks in [1, 2] {
            let wanted = "loads of 9.000e-2 N act along x on a piece of body `a` that no support holds along x. The \
                          piece has 9 points; point 3 at [3.5] m is one of them";
            for text in simulate_on::<1, _>(ranks, &weighed_bar(method, 0.01, hold), failure) {
                assert!(text.contains(wanted), "{method}: {text}");
            }
        }
    }
}

/// Return the deck of a plate in three strips without bonds between them. The left strip is held along x and
/// moved along y.
fn strips(conditions: &str) -> String {
    format!(
        "dimension = 'plane-stress'
        grid = {{ spacing = 1, horizon = 3 }}
        material.sheet.pmb = {{ density = 2, youngs_modulus = 5 }}
        body.left = {{ material = 'sheet', shape.box = {{ lower = [0, 0], upper = [12, 6] }} }}
        body.right = {{ material = 'sheet', shape.box = {{ lower = [12, 0], upper = [30, 6] }} }}
        crack.first.segment = {{ from = [8, -1], to = [8, 7] }}
        crack.second.segment = {{ from = [18, -1], to = [18, 7] }}
        set.hold.where = 'x < 2'
        set.middle.where = 'x > 9 && x < 10'
        set.last.where = 'x > 28'
        condition.hold = {{ set = 'hold', displacement = [0, '1e-3*t'] }}
        {conditions}
        time = {{ end = 1, method = 'relaxation', relaxation = {{ load_steps = 1, iterations = 2000 }} }}
        "
    )
}

#[test]
fn a_loaded_piece_that_nothing_holds_is_named() {
    // The piece has 10 columns of 6 points. Its smallest id is the first point of the left body behind the
    // crack.
    let push = "condition.push = { set = 'middle', force = [0, 0.25] }";
    let wanted = "loads of 2.500e-1 N act along y on a piece of body `left` that no support holds along y. The \
                  piece has 60 points; point 8 at [8.5, 0.5] m is one of them";
    for ranks in [1, 2, 3] {
        for text in refusals::<2>(ranks, &strips(push)) {
            assert!(
                text.starts_with("[condition.push] force: "),
                "{ranks}: {text}"
            );
            assert!(text.contains(wanted), "{ranks}: {text}");
        }
    }
    // A support along x does not prevent motion along y.
    let guided = "condition.guide = { set = 'last', displacement = [0, 'free'] }
                  condition.push = { set = 'last', force = [0.25, 0.5] }";
    let text = refusals::<2>(1, &strips(guided)).remove(0);
    let wanted = "loads of 5.000e-1 N act along y on a piece of body `right` that no support holds along y. The \
                  piece has 72 points";
    assert!(text.contains(wanted), "{text}");
}

#[test]
fn pieces_at_rest_and_pieces_whose_loads_cancel_need_no_support() {
    let pull = "set.two.where = 'x > 16 && x < 18'
                condition.pull = { set = 'two', force = [0.02, 0] }
                condition.back = { set = 'middle', force = [-0.02, 0] }";
    // With loads, the tolerance is relative to the loads.
    for (conditions, bound) in [("", 1e-12), (pull, 1e-5)] {
        simulate(&strips(conditions), |mut simulation: Simulation<2>| {
            to_the_end(&mut simulation);
            let u = &simulation.fields.displacement;
            for point in 0..simulation.model.owned() {
                let x = simulation.model.position(point)[0];
                if x < 8.0 {
                    assert!((u[1][point] - 1e-3).abs() < bound, "{}", u[1][point]);
                } else if x > 18.0 || conditions.is_empty() {
                    assert_eq!([u[0][point], u[1][point]], [0.0; 2]);
                } else if x > 17.0 {
                    assert!(u[0][point] > 1e-3, "{}", u[0][point]);
                }
            }
        });
    }
}

/// Return the deck of a block whose left column is moved, without loads.
fn carried(motion: &str) -> String {
    format!(
        "dimension = 'plane-stress'
        thickness = 1e-3
        grid = {{ spacing = 1e-3, horizon = 3e-3 }}
        material.m.ordinary = {{ density = 1000, youngs_modulus = 1e9, poisson_ratio = 0.3 }}
        body.b = {{ material = 'm', shape.box = {{ lower = [0, 0], upper = [0.01, 0.004] }} }}
        set.left.where = 'x < 1e-3'
        condition.move = {{ set = 'left', {motion} }}
        time = {{ end = 1, method = 'relaxation', relaxation = {{ load_steps = 2, iterations = 5000 }} }}
        history.reactions = ['left']
        "
    )
}

#[test]
fn a_body_that_is_carried_without_loads_comes_to_rest() {
    // The last motion rotates the body by 0.3 rad about its lower left corner.
    let turned =
        "displacement = ['x*(cos(0.3*t) - 1) - y*sin(0.3*t)', 'x*sin(0.3*t) + y*(cos(0.3*t) - 1)']";
    let far = "initial.far.displacement = [100, 0]";
    for (motion, initial, size, wanted) in [
        ("displacement = ['1e-3*t', 0]", "", 1e-3, Some(1e-3)),
        // With this motion, energies are about 1e-38 J.
        ("displacement = ['1e-22*t', 0]", "", 1e-22, Some(1e-22)),
        (
            "displacement = ['100 + 1e-3*t', 0]",
            far,
            100.0,
            Some(100.001),
        ),
        (turned, "", 3e-3, None),
    ] {
        let deck = format!("{initial}\n{}", carried(motion));
        let rows = simulate_on::<2, _>(2, &deck, |mut simulation| {
            let mut observer = HistoryObserver::new(&simulation).unwrap();
            to_the_end(&mut simulation);
            let row = row(&mut observer, &mut simulation);
            let [sin, cos] = [libm::sin(0.3), libm::cos(0.3)];
            for point in 0..simulation.model.owned() {
                let [x, y, _] = simulation.model.position(point);
                let turned = [x * (cos - 1.0) - y * sin, x * sin + y * (cos - 1.0)];
                let wanted = wanted.map_or(turned, |along| [along, 0.0]);
                for d in 0..2 {
                    let error = (simulation.fields.displacement[d][point] - wanted[d]).abs();
                    assert!(error < 1e-10 * size, "{motion} {error:e}");
                }
            }
            row
        });
        let row = &rows[0];
        // Moving one column alone by u would need a force of about E h u.
        let reaction = row.values[row.values.len() - 2..].iter();
        let largest = reaction.fold(0.0_f64, |most, force| most.max(force.abs()));
        assert!(largest < 1e-12 * 1e6 * size, "{motion} {largest:e}");
        assert!(
            row.energies.strain < 1e-20 * 1e6 * size * size,
            "{motion} {row:?}"
        );
    }
}

#[test]
fn a_free_body_that_begins_deformed_relaxes() {
    let bent = "initial.bent.displacement = ['0.01*x + 0.002*y', '-0.003*y + 1e-5*sin(500*x)']";
    let is_held = |line: &&str| line.contains("condition.") || line.contains("history.");
    let deck = carried("displacement = [0, 0]");
    let deck = deck
        .lines()
        .filter(|line| !is_held(line))
        .collect::<Vec<_>>()
        .join("\n");
    let deck = deck.replace("time =", &format!("{bent}\ntime ="));
    // Without loads, the tolerance is relative to the forces at the start.
    let deck = deck.replace("load_steps = 2", "load_steps = 2, tolerance = 1e-11");
    simulate(&deck, |mut simulation: Simulation<2>| {
        let before = Snapshot::new(&mut simulation).stored.energy;
        to_the_end(&mut simulation);
        let energy = Snapshot::new(&mut simulation).stored.energy;
        let largest = |values: &[f64]| values.iter().fold(0.0_f64, |most, value| most.max(*value));
        assert!(largest(&before) > 1e4, "{before:?}");
        assert!(largest(&energy) < 1e-15, "{energy:?}");
    });
}

/// A notched strip that separates in its first load step.
const PARTS_AT_ONCE: &str = "
    dimension = 'plane-stress'
    thickness = 1e-3
    grid = { spacing = 1e-3, horizon = 3e-3 }
    material.m.pmb = { density = 1000, youngs_modulus = 1e9 }
    damage.brittle.critical_stretch = { critical_stretch = 1e-4 }
    body.strip = { material = 'm', damage = 'brittle', shape.box = { lower = [0, 0], upper = [0.016, 8e-3] } }
    crack.notch.segment = { from = [8e-3, 0], to = [8e-3, 6e-3] }
    set.left.where = 'x < 3e-3'
    set.right.where = 'x > 13e-3'
    condition.left = { set = 'left', displacement = [0, 0] }
    condition.right = { set = 'right', displacement = ['3e-6*t', 0] }
    time = { end = 1, method = 'relaxation', relaxation = { load_steps = 1, tolerance = 1e-4, iterations = 5000 } }
    history.reactions = ['right']
    ";

#[test]
fn a_strip_that_parts_in_its_first_load_step_carries_nothing_then() {
    let [first, second] = [1, 2].map(|ranks| {
        let rows = simulate_on::<2, _>(ranks, PARTS_AT_ONCE, |mut simulation| {
            let mut observer = HistoryObserver::new(&simulation).unwrap();
            to_the_end(&mut simulation);
            let row = row(&mut observer, &mut simulation);
            let reaction = row.values[row.values.len() - 2];
            // Without the notch, the reaction would be E h b ε = 1e9 · 1e-3 · 8e-3 · 3e-4 N.
            assert!(reaction.abs() < 1e-3 * 2.4, "{reaction}");
            assert!(row.broken > 0);
            for point in 0..simulation.model.owned() {
                if simulation.model.position(point)[0] > 0.011 {
                    let u = simulation.fields.displacement[0][point];
                    assert!((u - 3e-6).abs() < 0.01 * 3e-6, "{u}");
                }
            }
            row.values
        });
        rows[0]
            .iter()
            .map(|value| value.to_bits())
            .collect::<Vec<_>>()
    });
    assert_eq!(first, second);
}

/// Run a deck, and return the energies at the end of each load step.
fn energies_of_load_steps(deck: &str) -> Vec<Energies> {
    simulate(deck, |mut simulation: Simulation<1>| {
        let mut observer = HistoryObserver::new(&simulation).unwrap();
        let mut rows = Vec::new();
        while !simulation.is_over() {
            load_step(&mut simulation);
            rows.push(row(&mut observer, &mut simulation).energies);
        }
        rows
    })
}

#[test]
fn supports_put_in_what_breaking_frees_and_loses() {
    for steps in [1, 2, 15] {
        let deck = BAR.replace("load_steps = 15", &format!("load_steps = {steps}"));
        let rows = energies_of_load_steps(&deck);
        let last = rows.last().unwrap();
        assert!(
            last.fracture > 0.0 && last.strain < 1e-6 * last.work,
            "{last:?}"
        );
        let mut lost = 0.0;
        for row in &rows {
            let now = row.work - row.strain - row.fracture;
            assert!(
                now >= lost - 1e-7 * last.work,
                "{steps}: {now} after {lost} of {row:?}"
            );
            lost = now;
        }
        if steps == 1 {
            // Expected energy: ½ E ε² A L between the innermost supports.
            let strain: f64 = 0.38 * 1.5 / 35.0;
            let energy = 0.5 * 5.0 * strain * strain * 35.0;
            assert!(
                (0.9..1.1).contains(&(last.work / energy)),
                "{last:?} {energy}"
            );
        }
    }
}

#[test]
fn loads_do_work_on_what_breaking_lets_them_move() {
    // Only bonds between four points in the middle can break. Bonds that span these points carry the load
    // afterwards.
    let deck = |critical: f64| {
        format!(
            "dimension = '1d'
            grid = {{ spacing = 1, horizon = 3 }}
            material.rubber.pmb = {{ density = 2, youngs_modulus = 5 }}
            damage.brittle.critical_stretch = {{ critical_stretch = {critical}, alpha = 0, no_failure = ['safe'] }}
            body.bar = {{ material = 'rubber', damage = 'brittle', shape.box = {{ lower = [0], upper = [40] }} }}
            set.hold.where = 'x < 3'
            set.pull.where = 'x > 36'
            set.safe.where = 'x < 18 || x > 22'
            condition.hold = {{ set = 'hold', displacement = [0] }}
            condition.pull = {{ set = 'pull', force = ['0.05*t'] }}
            time = {{ end = 1, method = 'relaxation', relaxation = {{ load_steps = 2, tolerance = 1e-10 }} }}
            "
        )
    };
    // Return the mean displacement of the loaded points at the end, and the energies of both load steps.
    let run = |critical: f64| {
        let mean = simulate(&deck(critical), |mut simulation: Simulation<1>| {
            to_the_end(&mut simulation);
            let is_loaded = |point: &usize| simulation.model.position(*point)[0] > 36.0;
            let loaded = (0..simulation.model.owned()).filter(is_loaded);
            loaded
                .map(|point| simulation.fields.displacement[0][point])
                .sum::<f64>()
                / 4.0
        });
        (mean, energies_of_load_steps(&deck(critical)))
    };
    // The load gives a stretch of 0.01.
    let (whole, elastic) = run(1.0);
    let (torn, rows) = run(0.008);
    let [half, last] = rows[..] else {
        panic!("{rows:?}")
    };
    assert_eq!(half.work, elastic[0].work);
    assert!(
        (elastic[1].work / (0.5 * 0.05 * whole) - 1.0).abs() < 1e-7,
        "{elastic:?}"
    );
    assert!(
        last.fracture > 0.0 && torn > 1.01 * whole,
        "{last:?} {torn} {whole}"
    );
    let work = 0.5 * 0.05 * whole + 0.05 * (torn - whole);
    assert!((last.work / work - 1.0).abs() < 1e-7, "{last:?} {work}");
    let lost = last.work - last.strain - last.fracture;
    assert!(lost > 1e-3 * last.fracture, "{last:?}");
}

#[test]
fn a_load_step_that_breaks_before_its_first_iteration_is_counted_once() {
    // All displacements are prescribed, so that every state is an equilibrium.
    let deck = "dimension = '1d'
        grid = { spacing = 1, horizon = 3 }
        material.rubber.pmb = { density = 2, youngs_modulus = 5 }
        damage.brittle.critical_stretch = { critical_stretch = 0.1, alpha = 0 }
        body.bar = { material = 'rubber', damage = 'brittle', shape.box = { lower = [0], upper = [40] } }
        condition.pull = { set = 'all', displacement = ['t*(0.01*x + if(x > 20, 1, 0))'] }
        time = { end = 1, method = 'relaxation', relaxation = { load_steps = 1 } }
        ";
    let rows = energies_of_load_steps(deck);
    let [row] = rows[..] else { panic!("{rows:?}") };
    assert!(row.fracture > 0.0 && row.strain > 0.0, "{row:?}");
    // The bonds of a bar are linear, and no point moves when bonds break, so no energy is lost.
    let lost = row.work - row.strain - row.fracture;
    assert!(lost.abs() < 1e-9 * row.work, "{row:?}");
}

/// A bar of brittle bonds that is pulled at its ends.
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
        let names = ["reaction_right_x", "broken_bonds", "residual", "iterations"];
        let columns = names.map(|name| column(&observer, name));
        let [force, broken, residual, iterations] = columns;
        let mut rows = vec![row(&mut observer, &mut simulation).values];
        while !simulation.is_over() {
            load_step(&mut simulation);
            rows.push(row(&mut observer, &mut simulation).values);
        }
        let first = rows.iter().position(|row| row[broken] > 0.0).unwrap();
        // The response is linear until then, with 35 m between the innermost points of the supports.
        let strain = 0.38 * rows[first][0] / 35.0;
        assert!((0.9..1.1).contains(&(strain / 0.0105)), "{:?}", rows[first]);
        let slope = rows[1][force] / rows[1][0];
        for row in &rows[1..first] {
            assert!(
                (row[force] / row[0] - slope).abs() < 1e-6 * slope,
                "{row:?}"
            );
        }
        // All bonds across one section break in the same load step; then both halves carry no force.
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

/// Return [`torn_plate`] with relaxation.
fn torn(family: &str) -> String {
    torn_plate(
        family,
        "method = 'relaxation', relaxation = { load_steps = 8, tolerance = 1e-5 }",
    )
}

#[test]
fn ranks_do_not_change_a_bit() {
    for family in ["lattice", "list"] {
        same_on_ranks(&torn(family));
    }
}

#[test]
fn goes_on_from_within_a_load_step_to_the_same_bits() {
    let problem: Problem = problem(&torn("lattice"));
    let run = |stop: usize| {
        let parts = threads::run(2, |comm: &dyn Communicator| {
            let mut simulation = Simulation::<2>::new(&problem, comm).unwrap();
            for _ in 0..stop {
                simulation.advance();
            }
            let settled = simulation.progress.load_step.is_settled;
            if stop > 0 {
                let (order, saved) = state(&simulation);
                simulation = Simulation::new(&problem, comm).unwrap();
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

/// A strip of a plastic solid is pulled to four times its yield strain. The reference force was computed with
/// 500 load steps. The limit load of a continuum is 2/√3 σ_y A = 6.93 N; families at surfaces carry more.
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
            // An evaluation with the stored bond history gives the forces of the equilibrium.
            let before = fields.internal_force.clone();
            simulation.evaluate(BondUpdate::None);
            assert_eq!(simulation.fields.internal_force, before, "{steps}");
        });
    }
}
