//! Horizons as multiples of the mean spacing of points: values, equal bits, restarts and messages.

use std::path::{Path, PathBuf};

use fissure::comm::threads;
use fissure::deck::{self, Deck, Source};
use fissure::error::Error;
use fissure::output::ResultReader;
use fissure::problem::Problem;

use crate::support::command::{Folder, finish, fissure, succeed, text};
use crate::support::datasets::{datasets, difference};
use crate::support::recorded::record;

/// Write a mesh with the rectangles [0, 4] × [0, 2] and [0, 1] × [4, 5] of squares with the edges 1 and 0.5.
fn write_mesh(path: &Path) {
    let (mut nodes, mut elements) = (Vec::new(), Vec::new());
    let mut add = |corner: [f64; 2], edge: f64, counts: [usize; 2], group: u32| {
        for cell in 0..counts[0] * counts[1] {
            let low = [cell % counts[0], cell / counts[0]];
            let corners = [[0, 0], [1, 0], [1, 1], [0, 1]];
            for [i, j] in corners {
                let x = corner[0] + edge * (low[0] + i) as f64;
                let y = corner[1] + edge * (low[1] + j) as f64;
                nodes.push(format!("{} {x} {y} 0", nodes.len() + 1));
            }
            let last = nodes.len();
            let (element, first) = (elements.len() + 1, last - 3);
            elements.push(format!(
                "{element} 3 2 {group} 1 {first} {} {} {last}",
                first + 1,
                first + 2
            ));
        }
    };
    add([0.0, 0.0], 1.0, [4, 2], 1);
    add([0.0, 4.0], 0.5, [2, 2], 2);
    let text = format!(
        "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n{}\n{}\n$EndNodes\n$Elements\n{}\n{}\n$EndElements\n",
        nodes.len(),
        nodes.join("\n"),
        elements.len(),
        elements.join("\n")
    );
    std::fs::write(path, text).unwrap();
}

/// Write a plane-stress deck, and return its path. The deck has the bodies `coarse` and `fine` of the mesh, a
/// body of two points from a file, and a lattice of cells with different edges. `of_fine` is the horizon of
/// `fine`.
fn four_bodies(folder: &Folder, of_fine: &str) -> PathBuf {
    write_mesh(&folder.join("two.msh"));
    folder.write("points.csv", "x,y,volume\n9,0,0.2\n9,1,0.4\n");
    let deck = format!(
        "dimension = 'plane-stress'
        thickness = 0.1
        parameters = {{ m = 2.5 }}
        grid.horizon = 'm * spacing'
        interface.rule = 'none'
        material.rubber.pmb = {{ density = 2, youngs_modulus = 5 }}
        body.coarse = {{ material = 'rubber', points = {{ mesh = 'two.msh', block = 1, scale = 2 }} }}
        body.fine = {{ material = 'rubber', points = {{ mesh = 'two.msh', block = 2 }}, horizon = {of_fine} }}
        body.rows = {{ material = 'rubber', points.file = 'points.csv', horizon = '3*spacing' }}
        body.cells = {{ material = 'rubber', spacing = [4, 1], shape.box = {{ lower = [20, 0], upper = [32, 5] }} }}
        time = {{ end = 1 }}
        "
    );
    folder.write("deck.toml", &deck)
}

fn horizons(problem: &Problem) -> Vec<f64> {
    problem.bodies.iter().map(|body| body.horizon).collect()
}

#[test]
fn a_horizon_is_a_multiple_of_the_mean_spacing_of_each_body() {
    let folder = Folder::new("mean-spacing");
    let deck = four_bodies(&folder, "'2 * spacing'");
    let alone = deck::read(&deck, &[]).unwrap().problem().unwrap();
    // The mean area of the rows is (0.2 + 0.4)/(2 × 0.1). The mean edge of the cells is √(4 × 1).
    let expected = [2.5 * 2.0, 2.0 * 0.5, 3.0 * 3.0_f64.sqrt(), 2.5 * 2.0];
    for (found, expected) in horizons(&alone).into_iter().zip(expected) {
        assert!((found / expected - 1.0).abs() < 1e-14, "{found} {expected}");
    }
    // The grid has the largest horizon of the bodies without their own.
    assert_eq!(
        alone.horizon,
        alone.bodies[0].horizon.max(alone.bodies[3].horizon)
    );
    // The parameter `m` counts as used.
    assert!(alone.warnings.is_empty(), "{:?}", alone.warnings);
    for ranks in [2, 3] {
        let problems = threads::run(ranks, |comm| {
            let deck = deck::read(&deck, &[]).unwrap();
            deck.problem_on(comm).unwrap()
        });
        for problem in problems {
            assert_eq!(horizons(&problem), horizons(&alone));
            assert_eq!(problem.horizon, alone.horizon);
        }
    }
    // The deck that `explain` writes has horizons as numbers, so it needs no mesh.
    let full = deck::read(&deck, &[]).unwrap().explain().unwrap();
    std::fs::remove_file(folder.join("two.msh")).unwrap();
    let full = Deck::new(Source::new("full.toml", full)).unwrap();
    let again = full.problem().unwrap();
    assert_eq!(horizons(&again), horizons(&alone));
    assert_eq!(again.horizon, alone.horizon);
}

#[test]
fn the_mean_spacing_is_a_length_in_one_and_three_dimensions() {
    let folder = Folder::new("mean-spacing-of-files");
    folder.write("bar.csv", "x volume\n0 0.3\n1 0.5\n2 0.4\n");
    folder.write("block.csv", "x y z volume\n0 0 0 6\n1 0 0 10\n");
    for (dimension, file, expected) in [
        ("'1d'\ncross_section = 0.2", "bar.csv", 1.2 / 3.0 / 0.2),
        ("'3d'", "block.csv", 2.0),
    ] {
        let deck = format!(
            "dimension = {dimension}
            grid.horizon = '3 * spacing'
            material.rubber.pmb = {{ density = 2, youngs_modulus = 5 }}
            body.all_rows = {{ material = 'rubber', points.file = '{file}' }}
            time.end = 1
            "
        );
        let deck = folder.write("deck.toml", &deck);
        let problem = deck::read(&deck, &[]).unwrap().problem().unwrap();
        let found = problem.horizon;
        assert!((found / (3.0 * expected) - 1.0).abs() < 1e-14, "{found}");
    }
}

#[test]
fn a_lattice_has_exactly_its_spacing_and_a_parameter_replaces_it() {
    let horizon = |parameters: &str| {
        let text = format!(
            "dimension = '3d'
            parameters = {parameters}
            grid = {{ spacing = 0.1, horizon = '3.015 * spacing', quadrature = 'gauss' }}
            material.glass.pmb = {{ density = 2, youngs_modulus = 5 }}
            body.cube = {{ material = 'glass', shape.box = {{ lower = [0, 0, 0], upper = [1, 1, 1] }} }}
            time.end = 1e-5
            "
        );
        deck::parse(&Source::new("test.toml", text))
            .unwrap()
            .horizon
    };
    assert_eq!(horizon("{}"), 3.015 * 0.1);
    assert_eq!(horizon("{ spacing = 0.2 }"), 3.015 * 0.2);
}

#[test]
fn errors_of_meshes_and_files_are_those_of_a_deck_with_a_number() {
    let folder = Folder::new("mean-spacing-errors");
    let error = |deck: &Path, horizon: &str| -> Error {
        let set = [("grid.horizon".to_owned(), horizon.to_owned())];
        let deck = deck::read(deck, &set).unwrap();
        let of_ranks = threads::run(2, |comm| {
            let problem = deck.problem_on(comm)?;
            fissure::points::generate(&problem, comm).map_err(|error| deck.locate(error))
        });
        let mut errors = of_ranks.into_iter().map(Result::unwrap_err);
        let first = errors.next().unwrap();
        assert_eq!(errors.next().unwrap().message, first.message);
        first
    };
    let deck = four_bodies(&folder, "1");
    let text = std::fs::read_to_string(&deck).unwrap();
    let text = text.replace(", horizon = '3*spacing'", "");
    folder.write("bad.csv", "x,y,volume\n9,0,0.2\n9,1,0\n");
    for (old, new, message) in [
        ("points.csv", "bad.csv", "bad.csv:3: volume must be above 0"),
        (
            "block = 1",
            "block = 7",
            "[body.coarse] points block: the mesh has no group 7",
        ),
        ("'two.msh', block = 1", "'no.msh'", "cannot read the mesh"),
        (
            "block = 2",
            "block = 1",
            "[body.fine] points mesh: [body.coarse] already uses these elements",
        ),
    ] {
        let deck = folder.write("changed.toml", &text.replace(old, new));
        let [with_number, with_spacing] =
            ["5", "2.5 * spacing"].map(|horizon| error(&deck, horizon));
        assert!(with_spacing.message.contains(message), "{with_spacing}");
        assert_eq!(with_spacing.message, with_number.message);
    }
}

#[test]
fn the_mean_spacing_of_a_mesh_gives_the_bits_of_its_number() {
    let read = |horizon: &str| {
        let set = [("grid.horizon".to_owned(), horizon.to_owned())];
        deck::read(Path::new("tests/decks/good/mesh_plate.toml"), &set).unwrap()
    };
    let with_spacing = read("3.5 * spacing").problem().unwrap();
    let horizon = with_spacing.horizon;
    assert!((5e-3..15e-3).contains(&horizon), "{horizon}");
    let with_number = read(&format!("{horizon:e}")).problem().unwrap();
    let expected = record(&with_number, 1, 1).datasets;
    for ranks in [1, 2, 3] {
        assert_eq!(
            record(&with_spacing, ranks, 1).datasets,
            expected,
            "{ranks} ranks"
        );
    }
}

#[test]
fn a_run_with_the_mean_spacing_restarts_with_the_same_horizon() {
    let folder = Folder::new("mean-spacing-restart");
    let mesh = std::fs::read("tests/decks/good/plate_with_hole.msh").unwrap();
    folder.write("plate_with_hole.msh", &mesh);
    let deck = std::fs::read_to_string("tests/decks/good/mesh_plate.toml").unwrap();
    let deck = deck
        .replace("horizon = 9e-3", "horizon = '3.5 * spacing'")
        .replace("[time]", "[output]\nevery_steps = 50\n[time]\nstep = 1e-7")
        .replace("[history]", "[history]\nevery_steps = 10");
    assert!(deck.contains("spacing") && deck.contains("step = 1e-7"));
    let deck = folder.write("plate.toml", &deck);
    let run = |ranks: usize, out: &Path, extra: &[&str]| {
        let mut command = fissure(ranks);
        command.arg("run").arg(&deck).arg("--output").arg(out);
        command.args(extra).arg("--quiet");
        command
    };
    let [whole, parts] = ["whole", "parts"].map(|name| folder.join(name));
    succeed(&mut run(1, &whole, &[]));
    succeed(&mut run(3, &parts, &["--set", "time.end=1e-5"]));
    succeed(&mut run(2, &parts, &["--restart"]));
    let [first, second] = [&whole, &parts].map(|out| datasets(&out.join("result.vtkhdf")));
    assert_eq!(difference(&first, &second), None);

    let result = ResultReader::open(&whole.join("result.vtkhdf")).unwrap();
    let attributes = result.attributes().unwrap();
    let (_, full) = attributes
        .into_iter()
        .find(|(name, _)| name == "deck_in_full")
        .unwrap();
    let full: toml::Table = full.parse().unwrap();
    let horizon = deck::read(&deck, &[]).unwrap().problem().unwrap().horizon;
    assert_eq!(full["grid"]["horizon"].as_float(), Some(horizon));
    assert_eq!(full["body"]["plate"]["horizon"].as_float(), Some(horizon));

    let printed = succeed(fissure(1).arg("check").arg(&deck));
    assert!(printed.contains("horizon 3.500 times as long"), "{printed}");

    // With a mesh of another area, the horizon differs from that of the checkpoint.
    let old = String::from_utf8(mesh).unwrap();
    let new = old.replace("\n1 5.656854 5.656854 0\n", "\n1 5.5 5.5 0\n");
    assert_ne!(new, old);
    folder.write("plate_with_hole.msh", &new);
    let output = finish(&mut run(2, &parts, &["--restart"]));
    assert_eq!(output.status.code(), Some(2), "{}", text(&output));
    assert!(
        text(&output).contains("body.plate.horizon: was "),
        "{}",
        text(&output)
    );
}
