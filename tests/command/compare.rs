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
    let readers =
        [&first, &other].map(|out| ResultReader::open(&out.join("result.vtkhdf")).unwrap());
    let times = readers[0].times().unwrap();
    let ids = readers[0].ids(0).unwrap();
    let (mut largest, mut found) = (0.0, String::new());
    for (index, time) in times.iter().enumerate() {
        let [a, b] = [0, 1].map(|side: usize| readers[side].field("displacement", index).unwrap());
        for (entry, (a, b)) in a.iter().zip(&b).enumerate() {
            if (a - b).abs() > largest {
                largest = (a - b).abs();
                let name = ["x", "y", "z"][entry % 3];
                let point = ids[entry / 3];
                found = format!(
                    "{largest:.3e} m|{name}, point {point} at|t = {:.3} µs",
                    1e6 * time
                );
            }
        }
    }
    assert!(largest > 0.0);
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
