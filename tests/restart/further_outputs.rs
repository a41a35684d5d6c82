//! Further results, `[output.NAME]`, with their own times, fields and points, on any number of ranks and
//! after restarts.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Duration;

use fissure::output::ResultReader;

use crate::support::command::{Folder, finish, fissure, succeed, text, wait};
use crate::support::datasets::{datasets, difference};

/// A notched plate that tears.
const PLATE: &str = "dimension = 'plane-stress'
    parameters = { end = 2e-5 }
    grid = { volume_correction = 'none', spacing = 2e-3, horizon = 6e-3 }
    material.glass.pmb = { density = 2440, youngs_modulus = 72e9 }
    damage.brittle.critical_stretch = { fracture_energy = 135, alpha = 0.25 }
    body.plate = { material = 'glass', damage = 'brittle', shape.box = { lower = [0, 0], upper = [0.06, 0.03] } }
    crack.notch.segment = { from = [-1, 0.016], to = [0.02, 0.016] }
    set.top.where = 'y > 0.028'
    set.path.where = 'abs(y - 0.016) < 0.004'
    set.bottom.where = 'y < 0.002'
    condition.pull = { set = 'top', traction = ['1e6*sin(1e6*t)', 20e6] }
    condition.push = { set = 'bottom', traction = [0, -20e6] }
    time = { end = 'end', step = 2e-8 }
    history.every_steps = 50
";

/// The main result.
const MAIN: &str = "output.every_steps = 100
    output.fields = ['displacement', 'broken_bonds', 'newly_broken_bonds']
";

/// Further results.
const FURTHER: &str = "output.often = { every_steps = 45, fields = ['broken_bonds', 'newly_broken_bonds'], set = 'path' }
    output.once = { times = ['11/20*end'], fields = ['velocity'], precision = 'single' }
    output.slow = { every = 7e-6, fields = ['newly_broken_bonds', 'strain_energy_density'] }
";

/// File names of the main result and the further results.
const FILES: [&str; 4] = [
    "result.vtkhdf",
    "result_often.vtkhdf",
    "result_once.vtkhdf",
    "result_slow.vtkhdf",
];

fn deck(folder: &Folder, name: &str, outputs: &[&str]) -> PathBuf {
    folder.write(name, &[&[PLATE, MAIN], outputs].concat().concat())
}

fn run(ranks: usize, deck: &Path, out: &Path, extra: &[&str]) -> Command {
    let mut command = fissure(ranks);
    command.arg("run").arg(deck).arg("--output").arg(out);
    command.args(extra);
    command
}

fn steps(file: &Path) -> Vec<u64> {
    ResultReader::open(file).unwrap().steps().unwrap()
}

/// Run a command that must succeed, and return its output with warnings.
fn printed_by(command: &mut Command) -> String {
    let output = finish(command);
    assert!(output.status.success(), "{}", text(&output));
    text(&output)
}

/// Assert that the results in two folders have equal bits.
fn are_equal(expected: &Path, found: &Path) {
    for file in FILES {
        let [expected, found] = [expected, found].map(|folder| datasets(&folder.join(file)));
        assert_eq!(difference(&expected, &found), None, "{file}");
    }
}

#[test]
fn each_result_has_its_own_times_fields_and_points() {
    let folder = Folder::new("further-outputs");
    let deck_of_all = deck(&folder, "all.toml", &[FURTHER]);
    let all = folder.join("all");
    let printed = succeed(&mut run(1, &deck_of_all, &all, &[]));
    assert!(printed.contains("result_often.vtkhdf"), "{printed}");
    let [often, once, slow] = [1, 2, 3].map(|k| steps(&all.join(FILES[k])));
    let expected: Vec<u64> = (0..23).map(|k| 45 * k).chain([1000]).collect();
    assert_eq!(often, expected);
    assert_eq!(once, [0, 550, 1000]);
    assert_eq!(slow, [0, 350, 700, 1000]);
    let names = |file: &str| {
        let reader = ResultReader::open(&all.join(file)).unwrap();
        let fields = reader.fields().unwrap().into_iter();
        let names: Vec<String> = fields.map(|field| field.name).collect();
        names.join(" ")
    };
    assert_eq!(
        names("result_often.vtkhdf"),
        "block broken_bonds id newly_broken_bonds volume"
    );
    assert_eq!(names("result_once.vtkhdf"), "block id velocity volume");
    // Two rows on each side of the notch.
    let reader = ResultReader::open(&all.join("result_often.vtkhdf")).unwrap();
    assert_eq!(reader.positions(0).unwrap().len(), 4 * 30);
    // The newly broken bonds of all outputs of a file add up to the broken bonds.
    let mut so_far = vec![0.0; 4 * 30];
    for step in 0..often.len() {
        let new = reader.field("newly_broken_bonds", step).unwrap();
        so_far
            .iter_mut()
            .zip(new)
            .for_each(|(sum, new)| *sum += new);
        assert_eq!(so_far, reader.field("broken_bonds", step).unwrap());
    }
    assert!(so_far.iter().sum::<f64>() > 20.0);

    // The main result equals that of a run without further results.
    let alone = folder.join("alone");
    succeed(&mut run(1, &deck(&folder, "alone.toml", &[]), &alone, &[]));
    let [expected, found] = [&alone, &all].map(|folder| datasets(&folder.join(FILES[0])));
    assert_eq!(difference(&expected, &found), None);

    let three = folder.join("three");
    succeed(&mut run(3, &deck_of_all, &three, &[]));
    are_equal(&all, &three);

    // Commands accept the path of a result file.
    let mut compare = fissure(1);
    compare.arg("compare");
    compare.args([&all, &three].map(|folder| folder.join("result_often.vtkhdf")));
    succeed(&mut compare);
    let mut plot = fissure(1);
    plot.arg("plot").arg(all.join("result_often.vtkhdf"));
    succeed(plot.args(["--field", "broken_bonds"]));
    assert!(all.join("result_often_broken_bonds.png").exists());

    // No existing file is replaced without `--overwrite`.
    std::fs::remove_file(all.join("result.vtkhdf")).unwrap();
    std::fs::remove_file(all.join("history.csv")).unwrap();
    let refused = finish(&mut run(1, &deck_of_all, &all, &[]));
    let printed = text(&refused);
    assert_eq!(refused.status.code(), Some(2), "{printed}");
    assert!(
        printed.contains("result_often.vtkhdf exists already"),
        "{printed}"
    );
    succeed(&mut run(1, &deck_of_all, &all, &["--overwrite"]));
    are_equal(&three, &all);
}

#[test]
fn a_stopped_run_goes_on_in_all_its_results() {
    let folder = Folder::new("further-restart");
    let deck = deck(&folder, "deck.toml", &[FURTHER]);
    let whole = folder.join("whole");
    succeed(&mut run(1, &deck, &whole, &[]));
    for (name, signal, ranks) in [("stopped", "-TERM", [1, 3]), ("killed", "-KILL", [1, 1])] {
        let out = folder.join(name);
        let checkpoints = ["--set", "checkpoint.every_steps=35"];
        let mut command = run(ranks[0], &deck, &out, &checkpoints);
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().unwrap();
        let often = out.join("result_often.vtkhdf");
        let count = || ResultReader::open(&often).and_then(|reader| reader.steps());
        while count().map_or(0, |steps| steps.len()) < 5 {
            let ended = child.try_wait().unwrap();
            assert!(ended.is_none(), "the run ended by itself");
            std::thread::sleep(Duration::from_millis(10));
        }
        let sent = Command::new("kill")
            .args([signal, &child.id().to_string()])
            .status();
        assert!(sent.unwrap().success());
        let ended = wait(child);
        assert!(!ended.status.success(), "{}", text(&ended));
        assert!(*steps(&often).last().unwrap() < 1000);
        let restart = [&checkpoints[..], &["--restart"]].concat();
        succeed(&mut run(ranks[1], &deck, &out, &restart));
        are_equal(&whole, &out);
    }
}

#[test]
fn a_restart_may_change_the_further_results() {
    let folder = Folder::new("further-changes");
    let first = deck(&folder, "deck.toml", &[FURTHER]);
    let out = folder.join("out");
    succeed(&mut run(1, &first, &out, &["--set", "end=1.1e-5"]));
    // One further result has been deleted, one has other fields, one is no longer in the deck, and one is
    // new.
    std::fs::remove_file(out.join("result_slow.vtkhdf")).unwrap();
    let once_before = datasets(&out.join("result_once.vtkhdf"));
    let changed = FURTHER
        .replace("'velocity'", "'displacement'")
        .replace("output.once", "output.other")
        .replace(
            "'newly_broken_bonds'], set",
            "'newly_broken_bonds', 'damage'], set",
        );
    let second = deck(&folder, "changed.toml", &[&changed]);
    let printed = printed_by(&mut run(2, &second, &out, &["--restart"]));
    assert!(
        printed.contains(
            "warning: [output.often]: the deck requests other fields: starting a new result"
        ) && printed.contains("result_often_until_step_550.vtkhdf")
            && printed.contains("warning: [output.slow]: the result file is missing"),
        "{printed}"
    );
    assert_eq!(datasets(&out.join("result_once.vtkhdf")), once_before);
    assert_eq!(
        steps(&out.join("result_often_until_step_550.vtkhdf")).last(),
        Some(&550)
    );
    assert_eq!(
        steps(&out.join("result_often.vtkhdf"))[..3],
        [550, 585, 630]
    );
    assert_eq!(steps(&out.join("result_other.vtkhdf")), [550, 1000]);
    assert_eq!(steps(&out.join("result_slow.vtkhdf")), [550, 700, 1000]);
    assert_eq!(
        steps(&out.join("result.vtkhdf"))[4..8],
        [400, 500, 550, 600]
    );
    // Counts of newly broken bonds continue if the file continues.
    let main = ResultReader::open(&out.join("result.vtkhdf")).unwrap();
    let [before, now] = [6, 7].map(|k| main.field("broken_bonds", k).unwrap());
    let new = main.field("newly_broken_bonds", 7).unwrap();
    assert!(
        before
            .iter()
            .zip(&new)
            .zip(&now)
            .all(|((before, new), now)| before + new == *now)
    );
    // A file of an output that the checkpoint does not contain is renamed.
    let third = deck(&folder, "third.toml", &[FURTHER]);
    let printed = printed_by(&mut run(
        1,
        &third,
        &out,
        &["--restart", "--set", "end=2.2e-5"],
    ));
    assert!(
        printed.contains("[output.once]: the checkpoint does not contain this output"),
        "{printed}"
    );
    assert_eq!(
        datasets(&out.join("result_once_until_step_1000.vtkhdf")),
        once_before
    );
}

#[test]
fn an_overwritten_run_leaves_no_results_of_outputs_that_the_deck_no_longer_has() {
    let folder = Folder::new("further-stale");
    let crack = "history.crack.main = { from = [0, 0.016] }\n";
    let first = deck(&folder, "deck.toml", &[FURTHER, crack]);
    let out = folder.join("out");
    succeed(&mut run(1, &first, &out, &["--set", "end=4e-7"]));
    // A result that a restart has renamed, and files of the user, must not be removed.
    let copy = |name: &str| std::fs::copy(out.join("result_once.vtkhdf"), out.join(name)).unwrap();
    copy("result_once_until_step_20.vtkhdf");
    folder.write("out/result_mine.vtkhdf", "not a result");
    std::fs::copy(out.join("crack_main.csv"), out.join("crack_mine.csv")).unwrap();

    let second = FURTHER.replace("output.once", "output.other");
    let second = deck(&folder, "second.toml", &[&second]);
    let refused = finish(&mut run(1, &second, &out, &[]));
    assert_eq!(refused.status.code(), Some(2), "{}", text(&refused));
    assert!(out.join("result_once.vtkhdf").exists());

    let printed = printed_by(&mut run(
        2,
        &second,
        &out,
        &["--set", "end=4e-7", "--overwrite"],
    ));
    let line = printed
        .lines()
        .find(|line| line.starts_with("removed files of"));
    let names = ["crack_main.csv", "result_once.vtkhdf", "result_once.xdmf"];
    let names = names.map(|name| out.join(name).display().to_string());
    let expected = format!("removed files of the earlier run: {}", names.join(", "));
    assert_eq!(line, Some(&expected[..]), "{printed}");
    let mut files: Vec<String> = std::fs::read_dir(&out)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .filter(|name| name.starts_with("result") || name.starts_with("crack"))
        .collect();
    files.sort();
    assert_eq!(
        files,
        [
            "crack_mine.csv",
            "result.vtkhdf",
            "result.xdmf",
            "result_mine.vtkhdf",
            "result_often.vtkhdf",
            "result_often.xdmf",
            "result_once_until_step_20.vtkhdf",
            "result_other.vtkhdf",
            "result_other.xdmf",
            "result_slow.vtkhdf",
            "result_slow.xdmf",
        ]
    );
}
