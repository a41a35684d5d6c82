//! Paths and lengths of cracks in the history and in the tables beside the history.

use fissure::solver::Simulation;
use fissure::solver::observers::{Branch, HistoryObserver, Snapshot};

use crate::support::command::{Folder, finish, fissure, succeed, text};
use crate::support::history::column;
use crate::support::{simulate, simulate_on};

/// Return the branches of the only crack, and its length (m) and number of branches from the history.
fn crack(simulation: &mut Simulation<2>) -> (Vec<Branch>, [f64; 2]) {
    let mut observer = HistoryObserver::new(simulation).unwrap_or_else(|error| panic!("{error}"));
    let snapshot = Snapshot::new(simulation);
    let branches = observer.crack_paths(simulation, &snapshot).remove(0).1;
    let row = observer.row(simulation, &snapshot).values;
    let names = ["crack_main_length", "crack_main_branches"];
    let columns = names.map(|name| row[column(&observer, name)]);
    (branches, columns)
}

/// Return the deck of a plate of unit cells with cuts; the crack starts at the first point of the first cut.
fn plate(cuts: &[[[f64; 2]; 2]], width: f64) -> String {
    let [x, y] = cuts[0][0];
    let cut = |(k, [from, to]): (usize, &[[f64; 2]; 2])| {
        format!("crack.cut{k}.segment = {{ from = {from:?}, to = {to:?}, width = {width:?} }}\n")
    };
    let cuts: String = cuts.iter().enumerate().map(cut).collect();
    format!(
        "dimension = 'plane-stress'
        grid = {{ spacing = 1, horizon = 3 }}
        material.glass.pmb = {{ density = 2, youngs_modulus = 5 }}
        body.plate = {{ material = 'glass', shape.box = {{ lower = [-30, -30], upper = [30, 30] }} }}
        history.crack.main = {{ from = [{x:?}, {y:?}] }}
        time = {{ end = 1 }}
        {cuts}"
    )
}

/// Return the distance of a position from the line through two positions.
fn beside(place: [f64; 3], [from, to]: [[f64; 2]; 2]) -> f64 {
    let way = [to[0] - from[0], to[1] - from[1]];
    let cross = (place[0] - from[0]) * way[1] - (place[1] - from[1]) * way[0];
    cross.abs() / way[0].hypot(way[1])
}

#[test]
fn the_path_of_a_notch_is_the_notch_on_any_number_of_ranks() {
    for to in [[25.0, 0.0], [20.3, 20.1], [-12.0, 23.4], [-7.0, -24.0]] {
        let deck = plate(&[[[0.0, 0.0], to]], 0.0);
        let (branches, [length, count]) = simulate::<2, _>(&deck, |mut s| crack(&mut s));
        assert_eq!(count, 1.0, "{to:?}");
        let whole = to[0].hypot(to[1]);
        // At the tip the cut separates less than half of a family, so the found tip is slightly behind the
        // true tip.
        assert!(
            (whole - 1.8..whole + 0.6).contains(&length),
            "{to:?}: {length}"
        );
        for vertex in &branches[0] {
            let off = beside(vertex.place, [[0.0, 0.0], to]);
            assert!(off < 0.5, "{to:?}: {vertex:?} is {off} beside");
        }
        for ranks in [2, 3, 4] {
            for other in simulate_on::<2, _>(ranks, &deck, |mut s| crack(&mut s)) {
                assert_eq!(other, (branches.clone(), [length, count]));
            }
        }
    }
}

#[test]
fn a_band_is_as_long_as_a_cut_and_its_points_are_apart() {
    let cut = [[-25.0, 2.0], [10.0, -8.0]];
    let width = 2.4;
    let (branches, [length, _]) = simulate::<2, _>(&plate(&[cut], width), |mut simulation| {
        let snapshot = Snapshot::new(&mut simulation);
        let whole = f64::hypot(35.0, 10.0);
        for point in 0..simulation.model.owned() {
            let place = simulation.model.position(point);
            let along = ((place[0] + 25.0) * 35.0 - (place[1] - 2.0) * 10.0) / whole;
            let within = beside(place, cut) < 0.5 * width && (0.0..whole).contains(&along);
            let damage = snapshot.damage(&simulation.undeformed.family_volume, point);
            assert_eq!(damage == 1.0, within, "{place:?}: {damage}");
        }
        crack(&mut simulation)
    });
    let whole = f64::hypot(35.0, 10.0);
    assert!((length - whole).abs() < 1.5, "{length} {whole}");
    // A single damaged point may determine the tip, so its tolerance is larger.
    let (tip, others) = branches[0].split_last().unwrap();
    assert!(beside(tip.place, cut) < 1.0, "{tip:?}");
    for vertex in others {
        let off = beside(vertex.place, cut);
        assert!(off < 0.5, "{vertex:?} is {off} beside");
    }
}

#[test]
fn branches_are_apart() {
    let cuts = [
        [[-29.0, 0.0], [0.0, 0.0]],
        [[0.0, 0.0], [22.0, 15.0]],
        [[0.0, 0.0], [22.0, -15.0]],
    ];
    let (branches, [length, count]) = simulate::<2, _>(&plate(&cuts, 0.0), |mut s| crack(&mut s));
    assert_eq!((branches.len(), count), (2, 2.0));
    let whole = 29.0 + 2.0 * f64::hypot(22.0, 15.0);
    assert!((length - whole).abs() < 5.0, "{length} {whole}");
    let fork = branches[1][0].place;
    assert!(fork[0].hypot(fork[1]) < 3.0, "{fork:?}");
    for branch in &branches {
        let [x, y, _] = branch[branch.len() - 1].place;
        assert!(
            (x - 22.0).abs() < 1.5 && (y.abs() - 15.0).abs() < 1.5,
            "{x} {y}"
        );
    }
}

#[test]
fn there_is_no_crack_before_there_is_damage() {
    let deck = plate(&[[[0.0, 0.0], [10.0, 0.0]]], 0.0)
        .replace("from = [0.0, 0.0] }", "from = [-20, 0] }");
    let (branches, columns) = simulate::<2, _>(&deck, |mut s| crack(&mut s));
    assert!(branches.is_empty());
    assert_eq!(columns.map(f64::to_bits), [0, 0]);
}

#[test]
fn the_branches_of_the_benchmark_are_found_written_and_drawn() {
    let folder = Folder::new("crack_paths");
    let deck = include_str!("../../inputs/crack_branching.toml").to_owned()
        + "\n[history.crack.main]\nfrom = [0, 0]\n";
    let deck = folder.write("branching.toml", &deck);
    let run = |ranks, out: &str| {
        let mut command = fissure(ranks);
        command
            .arg("run")
            .arg(&deck)
            .arg("--output")
            .arg(folder.join(out));
        succeed(&mut command);
        std::fs::read_to_string(folder.join(out).join("crack_main.csv")).unwrap()
    };
    let table = run(1, "one");
    assert_eq!(table, run(2, "two"), "the bits depend on the ranks");

    let mut rows = table.lines();
    assert_eq!(rows.next(), Some("branch,x [m],y [m],length [m]"));
    let rows: Vec<[f64; 4]> = rows
        .map(|row| {
            let values: Vec<f64> = row.split(',').map(|value| value.parse().unwrap()).collect();
            values.try_into().unwrap()
        })
        .collect();
    let branch = |number: f64| rows.iter().filter(move |row| row[0] == number);
    assert_eq!(rows.last().unwrap()[0], 1.0, "two branches: {rows:?}");
    // The crack runs straight to the fork; then the branches run to the far edge, symmetric to each other.
    let fork = branch(1.0).next().unwrap();
    assert!(
        (0.053..0.08).contains(&fork[1]) && fork[2].abs() < 1e-3,
        "{fork:?}"
    );
    assert!(
        branch(0.0)
            .filter(|row| row[1] < fork[1])
            .all(|row| row[2].abs() < 1e-3)
    );
    let tips = [0.0, 1.0].map(|number| branch(number).next_back().unwrap());
    assert!(
        tips.iter().all(|tip| tip[1] > 0.095 && tip[2].abs() > 5e-3),
        "{tips:?}"
    );
    assert!((tips[0][2] + tips[1][2]).abs() < 1e-3, "{tips:?}");

    let history = std::fs::read_to_string(folder.join("one/history.csv")).unwrap();
    let mut lines = history.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let column = names
        .iter()
        .position(|name| *name == "crack_main_length [m]")
        .unwrap();
    let lengths: Vec<f64> = lines
        .map(|line| line.split(',').nth(column).unwrap().parse().unwrap())
        .collect();
    assert!(
        (lengths[0] - 0.05).abs() < 2e-3,
        "the notch is {} long",
        lengths[0]
    );
    let last = lengths[lengths.len() - 1];
    let both = tips[0][3] + tips[1][3] - fork[3];
    assert!((last - both).abs() < 1e-12, "{last} {both}");

    let picture = folder.join("path.png");
    let plot = |path: &std::path::Path| {
        let mut command = fissure(1);
        command.arg("plot").arg(folder.join("one/result.vtkhdf"));
        command.arg("--path").arg(path).arg("-o").arg(&picture);
        finish(&mut command)
    };
    let plain = plot(&folder.write("empty.csv", "x,y\n"));
    assert!(plain.status.success(), "{}", text(&plain));
    let without = std::fs::read(&picture).unwrap();
    let drawn = plot(&folder.join("one/crack_main.csv"));
    assert!(drawn.status.success(), "{}", text(&drawn));
    assert_ne!(without, std::fs::read(&picture).unwrap());
    for (wrong, message) in [
        ("x,z\n1,2\n", ":1: a path needs the columns `x` and `y`"),
        ("x [m],y [m]\n1,2\n\n3\n", ":4: has 1 values for 2 columns"),
        ("x,y\n1,two\n", ":2: `y` must be a number, is `two`"),
    ] {
        let output = plot(&folder.write("wrong.csv", wrong));
        assert_eq!(output.status.code(), Some(2));
        assert!(text(&output).contains(message), "{}", text(&output));
    }
}
