//! Tables of values over time: motions follow the table, and loads equal those of the equivalent expressions.

use crate::support::command::Folder;
use crate::support::equilibria::{same_on_ranks, to_the_end, torn_plate};
use crate::support::saved::{state, whole};
use crate::support::{problem, simulate};
use fissure::comm::threads;
use fissure::deck::{self, Source};
use fissure::solver::Simulation;

/// Rows of a motion: time (s) and displacement (m).
const ROWS: [(f64, f64); 5] = [
    (0.0, 0.0),
    (0.11, 0.02),
    (0.37, 0.02),
    (0.61, -0.013),
    (1.0, 0.04),
];

/// Return the displacement (m) at a time (s). A run may pass its end by a part of a step, so the last segment
/// is extrapolated.
fn motion_at(time: f64) -> f64 {
    let k = (1..ROWS.len() - 1).find(|k| time < ROWS[*k].0);
    let k = k.unwrap_or(ROWS.len() - 1);
    let ((t0, u0), (t1, u1)) = (ROWS[k - 1], ROWS[k]);
    u0 + (u1 - u0) * ((time - t0) / (t1 - t0))
}

fn columns(rows: &[(f64, f64)]) -> String {
    let [times, values] = [0, 1].map(|k| {
        let numbers = rows.iter().map(|row| [row.0, row.1][k].to_string());
        numbers.collect::<Vec<_>>().join(", ")
    });
    format!("times = [{times}], values = [{values}]")
}

/// Return the deck of a plate whose left side follows a table, with further lines.
fn plate(more: &str) -> String {
    format!(
        "dimension = 'plane-stress'
        grid = {{ spacing = 1, horizon = 3 }}
        material.rubber.pmb = {{ density = 2, youngs_modulus = 5 }}
        body.plate = {{ material = 'rubber', shape.box = {{ lower = [0, 0], upper = [8, 6] }} }}
        set.left.where = 'x < 3'
        set.right.where = 'x > 5'
        {more}
        "
    )
}

#[test]
fn a_support_follows_its_table() {
    let deck = plate(&format!(
        "table.u = {{ {} }}
        condition.hold = {{ set = 'left', displacement = ['u', '-2*u'] }}
        time = {{ end = 1, step = 0.0137 }}",
        columns(&ROWS)
    ));
    simulate::<2, _>(&deck, |mut simulation| {
        let mut steps = 0;
        while !simulation.is_over() {
            simulation.advance();
            let wanted = motion_at(simulation.clock.time());
            for point in 0..simulation.model.owned() {
                if simulation.model.position(point)[0] < 3.0 {
                    let [x, y] = [0, 1].map(|d| simulation.fields.displacement[d][point]);
                    let error = (x - wanted).abs().max((y + 2.0 * wanted).abs());
                    assert!(error < 1e-15, "{error:e} at {}", simulation.clock.time());
                }
            }
            steps += 1;
        }
        assert!(steps > 70);
    });
}

#[test]
fn velocities_at_the_ends_of_a_table_are_its_slopes() {
    let deck = plate(
        "table.u = { times = [0, 1], values = [0, 0.1] }
        set.grip.where = 'x < 3'
        condition.hold = { set = 'grip', displacement = ['u', 'u'] }
        time = { end = 1, step = 0.02 }",
    );
    let velocities = |deck: &str| {
        simulate::<2, _>(deck, |mut simulation| {
            to_the_end(&mut simulation);
            simulation.fields.velocity.concat()
        })
    };
    let found = velocities(&deck);
    let wanted = velocities(&deck.replace("['u', 'u']", "['0.1*t', '0.1*t']"));
    for (found, wanted) in found.iter().zip(&wanted) {
        assert!((found - wanted).abs() < 1e-12, "{found} {wanted}");
    }
}

#[test]
fn load_steps_follow_a_table() {
    for method in ["static", "relaxation"] {
        let deck = plate(&format!(
            "table.u = {{ {} }}
            condition.hold = {{ set = 'left', displacement = [0, 0] }}
            condition.pull = {{ set = 'right', displacement = ['u', 'free'] }}
            time = {{ end = 1, method = '{method}', relaxation = {{ load_steps = 5, tolerance = 1e-8 }} }}",
            columns(&ROWS)
        ));
        simulate::<2, _>(&deck, |mut simulation| {
            let mut settled = 0;
            while !simulation.is_over() {
                simulation.advance();
                if !simulation.progress.load_step.is_settled {
                    continue;
                }
                settled += 1;
                let wanted = motion_at(f64::from(settled) * 0.2);
                let last = simulation.model.owned() - 1;
                let found = simulation.fields.displacement[0][last];
                assert!(
                    (found - wanted).abs() < 1e-15,
                    "{method}: {found} for {wanted}"
                );
            }
            assert_eq!(settled, 5, "{method}");
        });
    }
}

/// Return the displacements at the end of a run.
fn moved(deck: &str) -> Vec<f64> {
    simulate::<2, _>(deck, |mut simulation| {
        to_the_end(&mut simulation);
        simulation.fields.displacement.concat()
    })
}

#[test]
fn tables_act_as_the_expressions_that_they_stand_for() {
    for (condition, quantity) in [
        ("velocity = ['VALUE', 'free']", 0.02),
        ("traction = ['0.1*VALUE*y', 0], depth = 3", 0.2),
        ("force = [0, 'VALUE']", 0.3),
        ("body_force = ['VALUE', '-VALUE']", 0.01),
        ("pressure = 'VALUE', normal = [1, 0]", 0.1),
        ("temperature = '10*VALUE'", 7.0),
    ] {
        // The value rises from t = 0.25 to t = 0.75.
        let deck = |table: &str, value: &str| {
            plate(&format!(
                "{table}
                condition.act = {{ set = 'right', {} }}
                time = {{ end = 1, step = 0.02 }}",
                condition.replace("VALUE", value)
            ))
            .replace("density = 2,", "density = 2, thermal_expansion = 1e-4,")
        };
        let rows = [(0.0, 0.0), (0.25, 0.0), (0.75, quantity), (1.0, quantity)];
        let table = format!("table.load = {{ {} }}", columns(&rows));
        let by_table = moved(&deck(&table, "load"));
        let wanted = moved(&deck("", &format!("({quantity}*ramp(t, 0.25, 0.75))")));
        let size = wanted.iter().fold(0.0_f64, |size, u| size.max(u.abs()));
        assert!(size > 1e-5, "{condition}: {size}");
        for (found, wanted) in by_table.iter().zip(&wanted) {
            assert!(
                (found - wanted).abs() < 1e-12 * size,
                "{condition}: {found} {wanted}"
            );
        }
    }
}

#[test]
fn a_rigid_body_follows_a_table() {
    let deck = |motion: &str| {
        plate(&format!(
            "table.down = {{ times = [0, 0.5, 1], values = [0, -0.4, -0.1] }}
            rigid.stamp = {{ shape.disc = {{ centre = [4, 8.2], radius = 2 }}, motion = [0, \"{motion}\"] }}
            time = {{ end = 1, step = 0.02 }}"
        ))
    };
    let by_table = moved(&deck("down"));
    let wanted = moved(&deck("-0.4*ramp(t, 0, 0.5) + 0.3*ramp(t, 0.5, 1)"));
    let size = wanted.iter().fold(0.0_f64, |size, u| size.max(u.abs()));
    assert!(size > 1e-4, "{size}");
    for (found, wanted) in by_table.iter().zip(&wanted) {
        assert!((found - wanted).abs() < 1e-11 * size, "{found} {wanted}");
    }
}

#[test]
fn bits_are_the_same_on_ranks_and_after_a_restart() {
    let table = "table.up = { times = [0, 1, 2.5, 4], values = [0, 0.05, 0.11, 0.16] }";
    let relaxed = torn_plate("auto", "method = 'static', static.load_steps = 4");
    let deck = format!("{}\n{table}\n", relaxed.replace("'0.04*t'", "'up'"));
    same_on_ranks(&deck);
    let explicit = deck.replace("method = 'static', static.load_steps = 4", "step = 0.1");
    same_on_ranks(&explicit);
    let problem = problem(&explicit);
    let comm = threads::alone();
    let steps = |simulation: &mut Simulation<2>, count: usize| {
        (0..count).for_each(|_| simulation.advance());
        state(simulation)
    };
    let mut first = Simulation::<2>::new(&problem, &comm).unwrap();
    let (order, saved) = steps(&mut first, 15);
    let wanted = steps(&mut first, 15).1;
    let mut second = Simulation::<2>::new(&problem, &comm).unwrap();
    second.restore(&order, &saved).unwrap();
    let found = steps(&mut second, 15).1;
    assert!(whole(vec![found]) == whole(vec![wanted]));
}

#[test]
fn a_restart_compares_the_rows_and_not_the_file() {
    let folder = Folder::new("tables");
    let deck = plate(
        "table.u = { file = 'u.csv', column = 'ux' }
        condition.hold = { set = 'left', displacement = ['u', 0] }
        time.end = 1",
    );
    let path = folder.write("deck.toml", &deck);
    let explained = |rows: &str| {
        folder.write("u.csv", &format!("t,ux\n{rows}"));
        let text = deck::read(&path, &[]).unwrap().explain().unwrap();
        assert!(!text.contains("u.csv"), "{text}");
        Source::new("explained.toml", text)
    };
    let old = explained("0,0\n0.5,0.1\n2,0.3\n");
    let against = |rows: &str| deck::differences(&old, &explained(rows)).unwrap();
    assert!(against("0,0\n0.5,1e-1\n2.0,0.3\n").is_empty());
    // Rows that are added at the end are not a difference, because a later end of the run needs them.
    assert!(against("0,0\n0.5,0.1\n2,0.3\n3,9\n").is_empty());
    for other in [
        "0,0\n0.5,0.11\n2,0.3\n",
        "0,0\n0.51,0.1\n2,0.3\n",
        "0,0\n2,0.3\n",
    ] {
        let lines = against(other);
        assert_eq!(lines.len(), 1, "{other}: {lines:?}");
        assert!(
            lines[0].starts_with("condition.hold.displacement[0]: "),
            "{lines:?}"
        );
    }
}
