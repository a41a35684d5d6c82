//! Decks: each bad deck gives the message written beside its mistake, good decks run and can be written out,
//! and no text makes the reader panic.
//!
//! In a bad deck, the line below the mistake repeats the marks of the error: carets below the marked text,
//! then the message. If the error points elsewhere (the end of the deck, a point file, no file), a line that
//! starts with `#!` has the whole first line of the error.

use std::path::{Path, PathBuf};

use fissure::comm::threads;
use fissure::deck::{self, Deck, Source};
use fissure::error::{ErrorKind, Result};
use fissure::problem::{Body, PointSource};
use fissure::solver::Simulation;
use fissure::solver::calibration::calibrated;
use fissure::survey::dry_run;
use proptest::prelude::*;
use proptest::sample::Index;

/// Return the decks of a folder, sorted by name.
pub fn decks(folder: &str) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).unwrap_or_else(|error| panic!("{folder}: {error}"));
    let mut paths: Vec<PathBuf> = entries
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|name| name == "toml"))
        .collect();
    paths.sort();
    paths
}

/// Return the decks of `tests/decks/good` and `inputs`, and the example deck.
fn right_decks() -> Vec<Source> {
    let paths = [decks("tests/decks/good"), decks("inputs")].concat();
    let mut sources: Vec<Source> = paths
        .iter()
        .map(|path| Source::read(path).unwrap())
        .collect();
    sources.push(Source::new("example.toml", deck::EXAMPLE));
    sources
}

/// Prepare the run of a deck. Return the number of points, and for each stage the first step (s) and the
/// number of steps.
pub fn prepare(source: &Source) -> Result<(u64, Vec<(f64, f64)>)> {
    let deck = Deck::new(source.clone())?;
    let problem = deck.problem()?;
    let look = calibrated(&problem).and_then(|problem| dry_run(&problem, 1, false));
    let look = look.map_err(|error| deck.locate(error))?;
    Ok((look.points, look.steps))
}

/// Return the expected error of a bad deck, read from its comments.
fn expected(path: &Path, text: &str) -> String {
    let mut before = "";
    for (line, number) in text.lines().zip(0..) {
        if let Some(first_line) = line.strip_prefix("#! ") {
            return first_line.to_owned();
        }
        let marks = line.strip_prefix('#').map(str::trim_start);
        if let Some(marks) = marks.filter(|marks| marks.starts_with('^')) {
            let message = marks.trim_start_matches('^').trim_start();
            let place = &line[..line.len() - marks.len()];
            let carets = &marks[..marks.len() - marks.trim_start_matches('^').len()];
            let column = place.chars().count() + 1;
            let gutter = " ".repeat(number.to_string().len());
            let place = place.replacen('#', " ", 1);
            return format!(
                "{}:{number}:{column}: {message}\n{gutter} |\n{number} | {before}\n\
                 {gutter} | {place}{carets}",
                path.display()
            );
        }
        before = line;
    }
    panic!("{}: says nowhere what is wrong", path.display());
}

#[test]
fn a_wrong_deck_gets_the_message_beside_its_mistake() {
    let paths = decks("tests/decks/bad");
    assert!(paths.len() >= 100, "{} wrong decks", paths.len());
    let mut failures = Vec::new();
    for path in &paths {
        let source = Source::read(path).unwrap();
        let expected = expected(path, &source.text);
        match prepare(&source) {
            Ok(_) => failures.push(format!("{}: no error", path.display())),
            Err(error) => {
                assert_eq!(error.kind, ErrorKind::Input, "{}", path.display());
                let matches = error.message == expected
                    || error.message.lines().next() == Some(expected.as_str());
                if !matches {
                    failures.push(format!("expected\n{expected}\nfound\n{error}"));
                }
            }
        }
    }
    assert!(failures.is_empty(), "{}", failures.join("\n\n"));
}

#[test]
fn a_right_deck_makes_a_run() {
    for source in right_decks() {
        let (points, stages) = prepare(&source).unwrap_or_else(|error| panic!("{error}"));
        let all_step = stages
            .iter()
            .all(|(step, steps)| *step > 0.0 && *steps >= 1.0);
        assert!(points > 0 && all_step, "{}", source.path.display());
    }
}

/// Problems from Rust are checked by `Problem::check`, which must allow everything that a deck allows.
#[test]
fn the_problem_of_a_right_deck_passes_the_check() {
    let warned = decks("tests/decks/warned");
    let warned = warned.iter().map(|path| Source::read(path).unwrap());
    for source in right_decks().into_iter().chain(warned) {
        let problem = deck::parse(&source).unwrap_or_else(|error| panic!("{error}"));
        let path = source.path.display();
        (problem.check()).unwrap_or_else(|error| panic!("{path}: {error}"));
    }
}

#[test]
fn a_deck_with_its_defaults_written_out_is_the_same_deck() {
    for source in right_decks() {
        let explained = Source::new(source.path.clone(), deck::explain(&source).unwrap());
        let again = deck::explain(&explained).unwrap_or_else(|error| panic!("{error}"));
        assert_eq!(explained.text, again, "{}", source.path.display());
        let run = |source| prepare(source).unwrap();
        assert_eq!(run(&source), run(&explained), "{}", source.path.display());
    }
}

#[test]
fn a_deck_with_its_defaults_written_out_has_the_same_grid() {
    // Cells that start from 0 do not fit the first body, so the grids start in the corner of this body.
    let count = |corner: &str, fine: &str| {
        let text = format!(
            "dimension = 'plane-stress'
            grid = {{ spacing = 1, horizon = 3 }}
            material.glass.pmb = {{ density = 2440, youngs_modulus = 72e9 }}
            body.coarse = {{ material = 'glass', shape.box = {{ lower = {corner}, upper = [5.5, 5.5] }} }}
            body.fine = {{ material = 'glass', spacing = {fine}, shape.box = {{ lower = [7.2, 0.3], upper = [9.2, 4.3] }} }}
            time.end = 1e-5
            "
        );
        let source = Source::new("tests/decks/good/deck.toml", text);
        let full = deck::explain(&source).unwrap();
        let full = Source::new("tests/decks/good/full.toml", full);
        let origins = |source: &Source| {
            let problem = Deck::new(Source::new(source.path.clone(), source.text.clone()));
            let problem = problem.unwrap().problem().unwrap();
            let origin = |body: &Body| match &body.points {
                PointSource::Lattice { origin, .. } => *origin,
                _ => unreachable!("the body is a box"),
            };
            problem.bodies.iter().map(origin).collect::<Vec<_>>()
        };
        assert_eq!(origins(&source), origins(&full));
        prepare(&full).unwrap().0
    };
    assert_eq!(count("[0.5, 0.5]", "1"), 25 + 8);
    assert_eq!(count("[0.5, 0.5]", "0.5"), 25 + 32);
    assert_eq!(count("[0, 0.5]", "1"), 25 + 8);
}

#[test]
fn the_default_depth_is_written_out_if_all_bodies_have_it() {
    let depth = |set: &str, spacing: &str| {
        let text = format!(
            "dimension = 'plane-stress'
            grid = {{ spacing = 1, horizon = 3 }}
            material.glass.pmb = {{ density = 2440, youngs_modulus = 72e9 }}
            body.coarse = {{ material = 'glass', shape.box = {{ lower = [0, 0], upper = [5, 5] }} }}
            body.fine = {{ material = 'glass', spacing = {spacing}, shape.box = {{ lower = [5, 0], upper = [8, 5] }} }}
            set.top.where = 'y > 4'
            condition.pull = {{ set = '{set}', traction = [0, 1] }}
            time.end = 1e-5
            "
        );
        let full = deck::explain(&Source::new("deck.toml", text)).unwrap();
        let again = deck::explain(&Source::new("full.toml", full.clone())).unwrap();
        assert_eq!(full, again);
        let full: toml::Table = full.parse().unwrap();
        full["condition"]["pull"].get("depth").cloned()
    };
    assert_eq!(depth("coarse", "0.5"), Some(1.0.into()));
    assert_eq!(depth("fine", "0.5"), Some(0.5.into()));
    assert_eq!(depth("top", "1"), Some(1.0.into()));
    assert_eq!(depth("top", "0.5"), None);
    assert_eq!(depth("all", "0.5"), None);
}

#[test]
fn a_direction_has_any_length_but_zero() {
    let force = |direction: &str| {
        let text = format!(
            "dimension = 'plane-stress'
            grid = {{ spacing = 1, horizon = 3 }}
            material.glass.pmb = {{ density = 2440, youngs_modulus = 72e9 }}
            body.plate = {{ material = 'glass', shape.box = {{ lower = [0, 0], upper = [5, 5] }} }}
            time.end = 1e-5
            history.force.push = {{ set = 'plate', direction = {direction} }}
            "
        );
        let deck = Deck::new(Source::new("tests/decks/good/deck.toml", text)).unwrap();
        deck.problem()
            .map(|problem| problem.history.support_forces[0].direction)
    };
    for direction in ["[3, 4]", "[3e-200, 4e-200]", "[3e200, 4e200]"] {
        let [x, y, z] = force(direction).unwrap();
        assert!(
            (x - 0.6).abs() < 1e-15 && (y - 0.8).abs() < 1e-15 && z == 0.0,
            "{direction}: {x} {y} {z}"
        );
    }
    assert!(force("[0, 0]").is_err());
}

/// A random change of a deck's text; positions are fractions of the text.
#[derive(Debug, Clone)]
enum Change {
    DeleteLine(Index),
    DuplicateLine(Index, Index),
    SwapLines(Index, Index),
    ReplaceToken(Index, Token),
    Truncate(Index),
    Insert(Index, String),
}

#[derive(Debug, Clone)]
enum Token {
    /// A copy of another token of the deck.
    Other(Index),
    Text(String),
}

/// Numbers at the limits of their types, other unusual values, delimiters and expressions.
const ODD: &[&str] = &[
    "0",
    "-1",
    "-0.0",
    "1e308",
    "1e-320",
    "1e999",
    "inf",
    "-inf",
    "nan",
    "1_0",
    "0x10",
    "2.5",
    "9223372036854775807",
    "9223372036854775808",
    "1979-05-27",
    "true",
    "[]",
    "{}",
    "\"\"",
    "\"",
    "'",
    "\"\"\"",
    "'''",
    "[[",
    "]]",
    "[",
    "]",
    "{",
    "}",
    "=",
    ".",
    ",",
    "#",
    "\\",
    "\"1/0\"",
    "\"0/0\"",
    "\"t\"",
    "\"x\"",
    "\"free\"",
    "\"all\"",
    "\"(\"",
    "\"-\"",
    "é",
    "\u{feff}",
    "\r",
    "\u{0}",
    "\t",
    "\n",
    "😀",
];

fn change() -> impl Strategy<Value = Change> {
    let text = prop_oneof![
        6 => prop::sample::select(ODD).prop_map(str::to_owned),
        2 => any::<f64>().prop_map(|number| format!("{number:e}")),
        2 => any::<i64>().prop_map(|number| number.to_string()),
        1 => "\\PC{0,8}",
        1 => (prop::sample::select(&["[", "{a=", "\"(", "\"-", "'2^", "a."][..]), 100..5000_usize)
            .prop_map(|(opening, times)| {
                let (quote, opening) = match opening.strip_prefix(['"', '\'']) {
                    Some(rest) => (&opening[..1], rest),
                    None => ("", opening),
                };
                format!("{quote}{}1{quote}", opening.repeat(times))
            }),
    ]
    .boxed();
    let token = prop_oneof![
        any::<Index>().prop_map(Token::Other),
        text.clone().prop_map(Token::Text),
    ];
    let at = any::<Index>;
    prop_oneof![
        2 => at().prop_map(Change::DeleteLine),
        1 => (at(), at()).prop_map(|(line, to)| Change::DuplicateLine(line, to)),
        1 => (at(), at()).prop_map(|(a, b)| Change::SwapLines(a, b)),
        6 => (at(), token).prop_map(|(at, token)| Change::ReplaceToken(at, token)),
        1 => at().prop_map(Change::Truncate),
        2 => (at(), text).prop_map(|(at, text)| Change::Insert(at, text)),
    ]
}

/// Return the byte ranges of words, numbers and single symbols.
fn tokens(text: &str) -> Vec<std::ops::Range<usize>> {
    let is_word = |c: char| c.is_alphanumeric() || "_-+.".contains(c);
    let mut tokens: Vec<std::ops::Range<usize>> = Vec::new();
    let mut in_word = false;
    for (at, c) in text.char_indices().filter(|(_, c)| !c.is_control()) {
        let end = at + c.len_utf8();
        match tokens.last_mut() {
            Some(last) if in_word && is_word(c) && last.end == at => last.end = end,
            _ if c == ' ' => {}
            _ => tokens.push(at..end),
        }
        in_word = is_word(c);
    }
    tokens
}

fn apply(text: &mut String, change: &Change) {
    let mut lines: Vec<&str> = text.split('\n').collect();
    match change {
        Change::DeleteLine(at) => {
            lines.remove(at.index(lines.len()));
        }
        Change::DuplicateLine(from, to) => {
            let line = lines[from.index(lines.len())];
            lines.insert(to.index(lines.len()), line);
        }
        Change::SwapLines(a, b) => {
            let (a, b) = (a.index(lines.len()), b.index(lines.len()));
            lines.swap(a, b);
        }
        Change::ReplaceToken(at, with) => {
            let tokens = tokens(text);
            if tokens.is_empty() {
                return;
            }
            let new = match with {
                Token::Other(other) => text[tokens[other.index(tokens.len())].clone()].to_owned(),
                Token::Text(new) => new.clone(),
            };
            text.replace_range(tokens[at.index(tokens.len())].clone(), &new);
            return;
        }
        Change::Truncate(at) => {
            text.truncate(border(text, at));
            return;
        }
        Change::Insert(at, new) => {
            text.insert_str(border(text, at), new);
            return;
        }
    }
    *text = lines.join("\n");
}

/// Return a position between two characters.
fn border(text: &str, at: &Index) -> usize {
    text.floor_char_boundary(at.index(text.len() + 1))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]
    #[test]
    fn a_mutated_deck_is_an_error_or_a_deck_but_never_a_panic(
        which in any::<Index>(),
        changes in prop::collection::vec(change(), 1..4),
    ) {
        let decks = right_decks();
        let mut source = decks[which.index(decks.len())].clone();
        for change in &changes {
            apply(&mut source.text, change);
        }
        let explained = deck::explain(&source);
        match deck::parse(&source) {
            Err(error) => {
                // Errors in the rows of a table name the file of the table.
                let files = [source.path.clone(), source.path.with_file_name("pull.csv")];
                let places = files.map(|file| format!("{}:", file.display()));
                let mut messages = places.iter().map(|place| error.message.strip_prefix(place));
                let message = messages.find_map(|message| message);
                prop_assert!(message.is_some_and(|rest| rest.len() > 8), "{}", error);
                prop_assert!(explained.is_err());
            }
            Ok(_) => {
                let text = explained.unwrap();
                let again = deck::explain(&Source::new(source.path, text.clone()));
                prop_assert_eq!(again.map_err(|error| error.message), Ok(text));
            }
        }
    }
}

#[test]
fn defaults_are_the_accurate_ones() {
    use fissure::problem::VolumeCorrection;

    let deck = |grid: &str, body: &str| {
        let text = format!(
            "dimension = 'plane-stress'
            grid = {{ {grid} }}
            material.glass.pmb = {{ density = 2440, youngs_modulus = 72e9 }}
            damage.brittle.critical_stretch.fracture_energy = 135
            body.plate = {{ material = 'glass', damage = 'brittle', {body} }}
            time.end = 1e-5
            "
        );
        let source = Source::new("tests/decks/good/deck.toml", text);
        let deck = Deck::new(source).unwrap();
        let problem = deck.problem().unwrap();
        (deck.explain().unwrap(), problem)
    };
    let shape = "shape.box = { lower = [0, 0], upper = [0.06, 0.03] }";
    let (full, problem) = deck("spacing = 1e-3, horizon = 3e-3", shape);
    assert_eq!(problem.volume_correction, VolumeCorrection::Exact);
    assert_eq!(problem.bodies[0].damage.as_ref().unwrap().alpha, 0.0);
    assert!(full.contains("volume_correction = \"exact\""), "{full}");
    // Without a point at the centre of each square cell, the default is no volume correction.
    for (grid, body) in [
        ("spacing = [1e-3, 2e-3], horizon = 6e-3", shape),
        (
            "spacing = 1e-3, horizon = 3e-3, quadrature = 'gauss'",
            shape,
        ),
        ("horizon = 3e-3", "points.file = 'points.csv'"),
    ] {
        let (full, problem) = deck(grid, body);
        assert_eq!(problem.volume_correction, VolumeCorrection::None, "{grid}");
        assert!(full.contains("volume_correction = \"none\""), "{full}");
    }
}

/// Build a plane deck with cells of 0.1 m. Return the number of points of each body, the positions of all
/// points (m), and whether one lattice stores all bonds.
fn filled(grid: &str, bodies: &str) -> (Vec<usize>, Vec<[f64; 3]>, bool) {
    let text = format!(
        "dimension = 'plane-stress'
        grid = {{ spacing = 0.1, horizon = 0.3 {grid} }}
        material.glass.pmb = {{ density = 2, youngs_modulus = 5 }}
        {bodies}
        time.end = 1
        "
    );
    let source = Source::new("deck.toml", text);
    let problem = deck::parse(&source).unwrap_or_else(|error| panic!("{error}"));
    let comm = threads::alone();
    let simulation =
        Simulation::<2>::new(&problem, &comm).unwrap_or_else(|error| panic!("{error}"));
    let (model, forces) = (&simulation.model, &simulation.forces);
    let of = |body: usize| {
        let blocks = model.block.iter();
        blocks
            .filter(|block| problem.body_of(usize::from(**block)) == body)
            .count()
    };
    let counts = (0..problem.bodies.len()).map(of).collect();
    let places = (0..model.owned())
        .map(|point| model.position(point))
        .collect();
    (
        counts,
        places,
        forces.lattice_bonds() == forces.directed_bonds(),
    )
}

#[test]
fn a_body_of_whole_cells_is_filled_exactly() {
    let body = |name: &str, shape: &str| {
        format!("body.{name} = {{ material = 'glass', shape.{shape} }}\n")
    };
    let centred = body(
        "a",
        "box = { lower = [-0.25, -0.15], upper = [0.25, 0.15] }",
    );
    let (counts, places, _) = filled("", &centred);
    assert_eq!(counts, [15]);
    assert!(
        places
            .iter()
            .any(|place| place.iter().all(|x| x.abs() < 1e-12))
    );
    // With a given origin, points on all borders of the shape are included.
    assert_eq!(filled(", origin = [0, 0]", &centred).0, [24]);

    // Cells start from 0 if this fits the body.
    let (counts, places, _) = filled(
        "",
        &body("a", "box = { lower = [-0.3, 0.1], upper = [0.3, 0.4] }"),
    );
    assert_eq!(counts, [18]);
    for place in places {
        for x in &place[..2] {
            let cells = (x / 0.1 - 0.5).round();
            assert_eq!(*x, (cells + 0.5) * 0.1);
        }
    }

    // Bodies with the same cells share a grid. The first body that is a whole number of cells long sets the
    // origin of the grid.
    let disc = body("disc", "disc = { centre = [-0.6, 0], radius = 0.25 }");
    let other = body("b", "box = { lower = [0.25, -0.15], upper = [0.65, 0.15] }");
    let (counts, _, is_lattice) = filled("", &(disc + &centred + &other));
    assert_eq!(counts[1..], [15, 12]);
    assert!(is_lattice);

    // Bodies with cells of another size have another origin.
    let coarse = "body.b = { material = 'glass', spacing = 0.15, shape.box = { lower = [0.25, -0.15], upper = [0.7, 0.15] } }";
    assert_eq!(filled("", &(centred + coarse)).0, [15, 6]);

    // Other shapes with flat faces.
    let hole = "{ disc = { centre = [0, 0], radius = 0.04 } }";
    let outside = "{ box = { lower = [-0.25, -0.15], upper = [0.25, 0.15] } }";
    let pierced = body("a", &format!("difference = [{outside}, {hole}]"));
    assert_eq!(filled("", &pierced).0, [14]);
    let polygon = "polygon.vertices = [[-0.25, -0.15], [0.25, -0.15], [0.25, 0.15], [-0.25, 0.15]]";
    assert_eq!(filled("", &body("a", polygon)).0, [15]);
    let far = "{ box = { lower = [0.65, -0.15], upper = [0.85, 0.15] } }";
    let both = body("a", &format!("union = [{far}, {outside}]"));
    assert_eq!(filled("", &both).0, [21]);
}
