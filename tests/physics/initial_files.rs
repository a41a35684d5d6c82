//! Initial values from a file equal those of expressions, on any number of ranks.

use std::fmt::Write as _;

use crate::support::command::Folder;
use crate::support::saved::{state, whole};
use fissure::comm::threads;
use fissure::deck::{self, Source};
use fissure::solver::Simulation;

const DECK: &str = "dimension = 'plane-stress'
    grid = { spacing = 1, horizon = 3 }
    material.rubber.pmb = { density = 2, youngs_modulus = 5 }
    body.plate = { material = 'rubber', shape.box = { lower = [0, 0], upper = [9, 7] } }
    set.right.where = 'x > 4'
    time.end = 1\n";

/// Return the state at the start on `ranks` ranks, or the error.
fn start(folder: &Folder, initial: &str, ranks: usize) -> Result<(Vec<u64>, Vec<u8>), String> {
    let source = Source::new(folder.join("plate.toml"), format!("{DECK}{initial}"));
    let problem = deck::parse(&source).map_err(|error| error.message)?;
    let parts = threads::run(ranks, |comm| {
        let simulation = Simulation::<2>::new(&problem, comm);
        simulation.map(|simulation| state(&simulation).1)
    });
    let parts: Result<Vec<_>, _> = parts.into_iter().collect();
    let (values, bonds, _) = whole(parts.map_err(|error| error.message)?);
    Ok((values, bonds))
}

fn velocity(x: f64, y: f64) -> [f64; 2] {
    [0.125 * x - 0.5 * y, x * y / 64.0]
}

#[test]
fn values_of_a_file_are_those_of_expressions() {
    let folder = Folder::new("initial_files");
    let mut rows = Vec::new();
    for id in 0..63 {
        let (x, y) = ((id % 9) as f64 + 0.5, (id / 9) as f64 + 0.5);
        let [vx, vy] = velocity(x, y);
        rows.push((id, format!("{vx} 0.25 {vy}")));
    }
    let write = |name: &str, ids: bool, rows: &[(i32, String)]| {
        let mut text = String::from(if ids {
            "vx ux vy id\n"
        } else {
            "# by id\nvx ux vy\n"
        });
        for (id, row) in rows {
            let id = if ids { format!(" {id}") } else { String::new() };
            writeln!(text, "{row}{id}").unwrap();
        }
        folder.write(name, &text);
    };
    write("all.txt", false, &rows);
    rows.reverse();
    write("mixed.txt", true, &rows);
    rows.retain(|(id, _)| id % 9 > 3);
    write("right.txt", true, &rows);
    let expressions = "initial.push = { set = 'right', displacement = [0.25, 0], velocity = ['0.125*x - 0.5*y', 'x*y/64'] }";
    let expected = start(&folder, expressions, 1).unwrap();
    for name in ["all", "mixed", "right"] {
        for ranks in 1..5 {
            let initial = format!("initial.push = {{ set = 'right', file = '{name}.txt' }}");
            let found = start(&folder, &initial, ranks);
            assert!(found.as_ref() == Ok(&expected), "{name} on {ranks} ranks");
        }
    }
    // `right.txt` has no rows for points outside the set `right`.
    for ranks in 1..5 {
        let error = start(&folder, "initial.push.file = 'right.txt'", ranks).unwrap_err();
        assert!(
            error.contains("has no row for the point 0 of the set"),
            "{ranks}: {error}"
        );
    }
}

#[test]
fn a_wrong_row_is_named_with_its_line() {
    let folder = Folder::new("initial_rows");
    let many = format!("vx{}", "\n1".repeat(64));
    for (name, text, expected) in [
        (
            "word",
            "id vx\n3 1\n\n4 fast\n",
            ":4: column 2: must be a number, is `fast`",
        ),
        (
            "short",
            "id vx\n3\n",
            ":2: has 1 entries, must have 2 as the heading",
        ),
        (
            "negative",
            "id vx\n-3 1\n",
            ":2: id must be a whole number, 0 or more, is `-3`",
        ),
        (
            "beyond",
            "id vx\n63 1\n",
            ":2: id must be at most 62, the id of the last point, is 63",
        ),
        ("repeated", "id vx VX\n7 1 2\n", ":1: has two columns `vx`"),
        (
            "twice",
            "id vx\n7 1\n8 1\n7 2\n",
            ": has two rows for the point 7",
        ),
        (
            "many",
            &many,
            ": has 64 rows, must have at most one for each of the 63 points",
        ),
    ] {
        folder.write("wrong.txt", text);
        let initial = "initial.push = { set = 'right', file = 'wrong.txt' }";
        for ranks in 1..4 {
            let error = start(&folder, initial, ranks).unwrap_err();
            assert!(
                error
                    .lines()
                    .next()
                    .unwrap()
                    .ends_with(&format!("wrong.txt{expected}")),
                "{name}, {ranks}: {error}"
            );
        }
    }
}

#[test]
fn a_rebalance_does_not_read_the_file_again() {
    let folder = Folder::new("initial_rebalance");
    let text = (0..63).fold(String::from("vx\n"), |text, id| format!("{text}{id}\n"));
    folder.write("all.txt", &text);
    let deck = format!("{DECK}initial.push.file = 'all.txt'");
    let problem = deck::parse(&Source::new(folder.join("plate.toml"), deck)).unwrap();
    let parts = threads::run(2, |comm| {
        let mut simulation = Simulation::<2>::new(&problem, comm).unwrap();
        let before = state(&simulation).1;
        // The exchange is a barrier: both ranks have read the file.
        comm.max(&mut [0.0]);
        if comm.rank() == 0 {
            std::fs::remove_file(folder.join("all.txt")).unwrap();
        }
        comm.max(&mut [0.0]);
        let moved = simulation.repartition([3000, 1000][comm.rank()]).unwrap();
        (moved, before, state(&simulation).1)
    });
    assert!(parts[0].0 > 0);
    let (before, after) = parts
        .into_iter()
        .map(|(_, before, after)| (before, after))
        .unzip();
    assert_eq!(whole(before), whole(after));
}

#[test]
fn columns_that_are_not_read_cause_a_warning() {
    let folder = Folder::new("initial_columns");
    folder.write("all.txt", "id x vx u_y uz\n0 1 2 3 4\n");
    let deck = format!("{DECK}initial.push.file = 'all.txt'");
    let problem = deck::parse(&Source::new(folder.join("plate.toml"), deck)).unwrap();
    let warnings: Vec<_> = problem.warnings.iter().map(|w| &w.message[..]).collect();
    assert!(
        warnings.contains(&"[initial.push] file: these columns are not read: x, u_y, uz"),
        "{warnings:?}"
    );
}
