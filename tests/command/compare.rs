//! `fissure compare` on small results.

use std::path::{Path, PathBuf};
use std::process::Output;

use crate::support::command::{Folder, finish, fissure, succeed, text};
use fissure::output::ResultReader;

/// A plate with an initial velocity; its right half is the set `right`.
const DECK: &str = "
dimension = 'plane-stress'
parameters = { pull = 1, end = 2e-6 }
grid = { spacing = 1e-3, horizon = 2e-3 }
material.glass.pmb = { density = 2440, youngs_modulus = 72e9 }
body.plate = { material = 'glass', shape.box = { lower = [0, 0], upper = [0.02, 0.01] } }
set.right.where = 'x > 0.01'
initial.push.velocity = ['pull*x', 'pull*y*x']
time = { end = 'end', step = 1e-8 }
output = { every_steps = 50, fields = ['displacement', 'damage'] }
history.every_steps = 20
";

/// Open the result in an output folder.
fn open(folder: &Path) -> ResultReader {
    ResultReader::open(&folder.join("result.vtkhdf")).unwrap()
}

struct Runs {
    folder: Folder,
    deck: PathBuf,
}

impl Runs {
    fn new(name: &str) -> Self {
        let folder = Folder::new(name);
        let deck = folder.write("deck.toml", DECK);
        Self { folder, deck }
    }

    fn run(&self, name: &str, deck: &Path, options: &[&str]) -> PathBuf {
        let out = self.folder.join(name);
        let mut command = fissure(1);
        command
            .arg("run")
            .arg(deck)
            .args(["--quiet", "--threads", "1"]);
        succeed(command.args(options).arg("--output").arg(&out));
        out
    }
}

fn compare(first: &Path, second: &Path, options: &[&str]) -> Output {
    let mut command = fissure(1);
    finish(command.arg("compare").arg(first).arg(second).args(options))
}

#[track_caller]
fn expect(output: &Output, code: i32, words: &[&str]) {
    assert_eq!(output.status.code(), Some(code), "{}", text(output));
    for words in words {
        assert!(text(output).contains(words), "{words}: {}", text(output));
    }
}

#[test]
fn a_difference_is_found_with_its_point_and_time() {
    let runs = Runs::new("compare");
    let first = runs.run("first", &runs.deck, &[]);
    let same = runs.run("same", &runs.deck, &[]);
    let output = compare(&first, &same, &[]);
    expect(
        &output,
        0,
        &[
            "5 outputs of 200 points",
            "11 rows of the history",
            "the results are equal\n",
        ],
    );
    assert!(!text(&output).contains("DIFFERENT"), "{}", text(&output));

    let other = runs.run("other", &runs.deck, &["--set", "pull=1.001"]);
    let output = compare(&first, &other, &[]);
    let found = largest_difference(&first, &other);
    assert!(!found.is_empty());
    let printed = text(&output);
    let line = printed
        .lines()
        .find(|line| line.starts_with("displacement"))
        .unwrap();
    for words in found.split('|') {
        assert!(line.contains(words), "{words}: {line}");
    }
    expect(
        &output,
        1,
        &["damage        equal", "error: the results differ in 1 of "],
    );
    expect(&output, 1, &["kinetic_energy"]);

    // The relative difference of energies is twice the relative difference of displacements.
    expect(
        &compare(&first, &other, &["--tolerance", "0.0015"]),
        1,
        &["columns of the history"],
    );
    let options = ["--tolerance", "0.01", "--tolerance", "energy_error=inf"];
    expect(
        &compare(&first, &other, &options),
        0,
        &["the results are equal within the tolerance"],
    );
    let options = ["--tolerance", "0.01", "--tolerance", "displacement=1e-4"];
    expect(&compare(&first, &other, &options), 1, &["DIFFERENT"]);

    // A path below a file cannot be read.
    let unreadable = runs.deck.join("result.vtkhdf");
    expect(&compare(&first, &unreadable, &[]), 2, &["cannot read"]);

    let output = compare(&first, &other, &["--quiet"]);
    assert!(output.stdout.is_empty(), "{}", text(&output));
    for (options, words) in [
        (
            ["--tolerance", "damge=1"],
            "no common field or column `damge`; did you mean `damage`",
        ),
        (["--tolerance=-1", "-v"], "a number of at least 0"),
        (["--tolerance", "damage=much"], "a number of at least 0"),
    ] {
        expect(&compare(&first, &other, &options), 2, &[words]);
    }
    let missing = runs.folder.join("missing");
    expect(
        &compare(&first, &missing, &[]),
        2,
        &["cannot open the result file"],
    );
}

#[test]
fn what_only_one_result_has_is_named() {
    let runs = Runs::new("compare_parts");
    let whole = runs.run("whole", &runs.deck, &[]);
    let text = DECK
        .replace("['displacement', 'damage']", "['displacement', 'velocity']")
        .replace("every_steps = 50,", "every_steps = 50, set = 'right',");
    let deck = runs.folder.write("part.toml", &text);
    let part = runs.run("part", &deck, &[]);
    // The points of the right half are matched by their ids, and are equal.
    let output = compare(&whole, &part, &[]);
    expect(
        &output,
        1,
        &[
            "5 outputs of 100 points",
            "only in A: fields damage",
            "only in B: fields velocity",
            "only in A: 500 points, over all outputs",
            "displacement  equal",
            "position      equal",
            "error: the results differ in outputs, points, fields, rows or columns that one of them lacks",
        ],
    );
    expect(
        &compare(&part, &whole, &[]),
        1,
        &["only in B: 500 points, over all outputs"],
    );
    let longer = runs.run("longer", &runs.deck, &["--set", "end=3e-6"]);
    let output = compare(&whole, &longer, &[]);
    expect(
        &output,
        1,
        &[
            "only in B: outputs at 2.500 µs, 3.000 µs",
            "displacement  equal",
        ],
    );
    expect(&output, 1, &["only in B: 5 rows of the history"]);
}

/// On refined grids, ids do not ascend.
#[test]
fn refined_points_are_matched_by_id() {
    let runs = Runs::new("compare_refined");
    let refined = |name: &str, options: &[&str]| {
        let text = DECK.replace("pull = 1", "pull = 1, edge = 4e-3");
        let text = format!("{text}\nrefinement = {{ levels = 1, region.left.where = 'x < edge' }}");
        let deck = runs.folder.write("refined.toml", &text);
        runs.run(name, &deck, options)
    };
    let narrow = refined("narrow", &[]);
    let same = refined("same", &[]);
    let wide = refined("wide", &["--set", "edge=8e-3"]);
    let [few, many] = [&narrow, &wide].map(|out| {
        let reader = open(out);
        assert!(!reader.ids(0).unwrap().is_sorted());
        reader.points(0)
    });
    assert!(few < many, "{few} {many}");
    let all = format!("5 outputs of {few} points");
    let equal = [&all[..], "the results are equal\n"];
    expect(&compare(&narrow, &same, &[]), 0, &equal);

    // Without refinement, there are only the points of level 0.
    let coarse = runs.run("coarse", &runs.deck, &[]);
    for (first, second, shared, single) in [
        (&narrow, &wide, few, ["B", "A"]),
        (&wide, &narrow, few, ["A", "B"]),
        (&coarse, &wide, 200, ["B", "A"]),
        (&wide, &coarse, 200, ["A", "B"]),
    ] {
        let output = compare(first, second, &[]);
        let more = open(first).points(0).max(open(second).points(0));
        let more = 5 * (more - shared);
        let more = match (more / 1000, more % 1000) {
            (0, more) => more.to_string(),
            (thousands, rest) => format!("{thousands} {rest:03}"),
        };
        let shared = format!("5 outputs of {shared} points");
        let single_points = |name: &str| format!("only in {name}: {more} points, over all outputs");
        let words = [&shared, &single_points(single[0]), "position      equal"];
        expect(&output, 1, &words);
        assert!(!text(&output).contains(&single_points(single[1])));
        for words in largest_difference(first, second).split('|') {
            expect(&output, 1, &[words]);
        }
    }
}

/// Return the largest difference of the displacements of points with equal ids, as text. The bars separate
/// the parts that `compare` prints in one line.
fn largest_difference(first: &Path, second: &Path) -> String {
    let readers = [first, second].map(open);
    let (mut largest, mut found) = (0.0, String::new());
    for (index, time) in readers[0].times().unwrap().iter().enumerate() {
        let [a, b] = [0, 1].map(|side: usize| {
            let ids = readers[side].ids(index).unwrap();
            let values = readers[side].field("displacement", index).unwrap();
            (ids, values)
        });
        for (row, id) in a.0.iter().enumerate() {
            let Some(other) = b.0.iter().position(|other| other == id) else {
                continue;
            };
            for (k, name) in ["x", "y", "z"].iter().enumerate() {
                let difference = (a.1[3 * row + k] - b.1[3 * other + k]).abs();
                if difference > largest {
                    largest = difference;
                    found = format!(
                        "{largest:.3e} m|{name}, point {id} at|t = {:.3} µs",
                        1e6 * time
                    );
                }
            }
        }
    }
    found
}

/// A bar with more points than `compare` reads at once.
#[test]
fn many_refined_points_are_compared_in_blocks() {
    let runs = Runs::new("compare_blocks");
    let refined = |name: &str, refined: &str| {
        let text = format!(
            "
dimension = '1d'
constraint = 'uniaxial-stress'
grid = {{ spacing = 1e-3, horizon = 2e-3 }}
material.steel.pmb = {{ density = 7850, youngs_modulus = 200e9 }}
body.bar = {{ material = 'steel', shape.box = {{ lower = [0], upper = [70] }} }}
initial.push.velocity = ['sin(x)']
time = {{ end = 1e-8, step = 1e-8 }}
output = {{ every_steps = 1, fields = ['displacement'] }}
refinement = {{ levels = 1, region.part.where = '{refined}' }}
"
        );
        let deck = runs.folder.write("bar.toml", &text);
        runs.run(name, &deck, &[])
    };
    let left = refined("left", "x < 1");
    let right = refined("right", "x > 69");
    let output = compare(&left, &right, &[]);
    let words = [
        "2 outputs of 70 000 points",
        "only in A: 2 000 points, over all outputs",
        "only in B: 2 000 points, over all outputs",
        "position      equal",
    ];
    expect(&output, 1, &words);
}

/// Ids of refined points can exceed 2²⁴, so single precision would change them.
#[test]
fn fragments_are_exact_in_single_precision() {
    let runs = Runs::new("compare_fragments");
    let text = "
dimension = 'plane-stress'
grid = { spacing = 1, horizon = 2 }
material.glass.pmb = { density = 2, youngs_modulus = 5 }
damage.brittle.critical_stretch.critical_stretch = 0.01
body.plate = { material = 'glass', damage = 'brittle', shape.box = { lower = [0, 0], upper = [260, 260] } }
refinement = { levels = 4, region.corner.where = 'x > 257 and y > 257' }
set.corner.where = 'x > 256 and y > 256'
initial.pull.velocity = ['x', 'y']
time = { end = 0.1, step = 0.1 }
[output]
fields = ['fragment', 'damage']
set = 'corner'
precision = 'single'
double = { fields = ['fragment', 'damage'], set = 'corner' }
";
    let deck = runs.folder.write("fragments.toml", text);
    let out = runs.run("fragments", &deck, &[]);
    let double = out.join("result_double.vtkhdf");
    let reader = ResultReader::open(&double).unwrap();
    let largest = reader
        .field("fragment", 1)
        .unwrap()
        .into_iter()
        .fold(0.0, f64::max);
    assert!(largest > 16_777_216.0, "{largest}");
    let output = compare(&out.join("result.vtkhdf"), &double, &[]);
    assert!(
        crate::support::command::text(&output).contains("fragment  equal"),
        "{}",
        crate::support::command::text(&output)
    );
}
