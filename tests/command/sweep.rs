//! `fissure sweep` on small decks.

use std::path::Path;
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use crate::support::command::{Folder, finish, fissure, succeed, text, wait};

/// An expanding plate, whose energy is proportional to the square of the speed.
const DECK: &str = "
dimension = 'plane-stress'
parameters = { dx = 1e-3, speed = 1 }
grid = { spacing = 'dx', horizon = '3*dx' }
material.glass.pmb = { density = 2440, youngs_modulus = 72e9 }
body.plate = { material = 'glass', shape.box = { lower = [0, 0], upper = [0.02, 0.01] } }
initial.push.velocity = ['speed*x/0.02', 0]
time = { end = 2e-6, step = 5e-8 }
output = { every = 2e-6, fields = ['damage'] }
history.every_steps = 5
";

struct Sweep {
    folder: Folder,
}

impl Sweep {
    fn new(name: &str) -> Self {
        let folder = Folder::new(name);
        folder.write("plate.toml", DECK);
        Self { folder }
    }

    /// Return the command `sweep` in the folder of the deck.
    fn command(&self, options: &[&str]) -> Command {
        let mut command = fissure(1);
        command.current_dir(&self.folder.0);
        command.args(["sweep", "plate.toml", "--threads", "1"]);
        command.args(options);
        command
    }

    fn fails(&self, options: &[&str], code: i32, words: &[&str]) {
        let output = finish(&mut self.command(options));
        expect(&output, code, words);
    }

    /// Read the columns of a table; names are without units.
    fn table(&self, name: &str) -> Vec<(String, Vec<String>)> {
        let text = std::fs::read_to_string(self.folder.join(name)).unwrap();
        let mut rows = text.lines().map(|row| row.split(','));
        let names = rows.next().unwrap();
        let mut columns: Vec<(String, Vec<String>)> = names
            .map(|name| (name.split(" [").next().unwrap().to_owned(), Vec::new()))
            .collect();
        for row in rows {
            for ((_, column), cell) in columns.iter_mut().zip(row) {
                column.push(cell.to_owned());
            }
        }
        columns
    }
}

fn expect(output: &Output, code: i32, words: &[&str]) {
    assert_eq!(output.status.code(), Some(code), "{}", text(output));
    for words in words {
        assert!(text(output).contains(words), "{words}: {}", text(output));
    }
}

fn column<'a>(table: &'a [(String, Vec<String>)], name: &str) -> &'a [String] {
    let found = table.iter().find(|(known, _)| known == name);
    &found.unwrap_or_else(|| panic!("{name}: {table:?}")).1
}

fn numbers(texts: &[String]) -> Vec<f64> {
    texts
        .iter()
        .map(|text| text.parse().unwrap_or(f64::NAN))
        .collect()
}

fn modified(path: &Path) -> std::time::SystemTime {
    std::fs::metadata(path).unwrap().modified().unwrap()
}

#[test]
fn combinations_are_run_and_tabled() {
    let sweep = Sweep::new("sweep");
    let options = [
        "--set",
        "speed=1,2",
        "--set",
        "dx=2e-3,1e-3",
        "--value",
        "max:kinetic_energy",
        "--value",
    ];
    let options = [&options[..], &["broken_bonds", "--jobs", "2", "-o", "here"]].concat();
    let printed = succeed(&mut sweep.command(&options));
    assert!(
        printed.contains("speed=2, dx=1e-3: complete after"),
        "{printed}"
    );
    assert!(printed.contains("max:kinetic_energy (J)"), "{printed}");
    let table = sweep.table("here/sweep.csv");
    assert_eq!(column(&table, "speed"), ["1", "1", "2", "2"]);
    assert_eq!(column(&table, "dx"), ["2e-3", "1e-3", "2e-3", "1e-3"]);
    assert_eq!(column(&table, "state"), ["complete"; 4]);
    // Each value equals the value of the run's history.
    let energies = numbers(column(&table, "max_kinetic_energy"));
    for (row, name) in ["speed=1,dx=2e-3", "speed=2,dx=1e-3"].iter().enumerate() {
        let history = sweep.table(&format!("here/{name}/history.csv"));
        let found = numbers(column(&history, "kinetic_energy"))
            .into_iter()
            .fold(0.0, f64::max);
        assert_eq!(energies[3 * row], found);
    }
    assert!(
        (energies[2] / energies[0] - 4.0).abs() < 0.05,
        "{energies:?}"
    );
    assert_eq!(numbers(column(&table, "last_broken_bonds")), [0.0; 4]);
    assert!(sweep.folder.join("here/max_kinetic_energy.png").exists());

    // Repeating the same command starts no run. A further value of a parameter starts only the missing runs.
    let history = sweep.folder.join("here/speed=1,dx=1e-3/history.csv");
    let before = modified(&history);
    let printed = succeed(&mut sweep.command(&options));
    assert!(
        printed.contains("4 of 4 runs are complete, 0 to do"),
        "{printed}"
    );
    let more: Vec<&str> = options
        .iter()
        .map(|word| {
            if *word == "speed=1,2" {
                "speed=1,2,3"
            } else {
                word
            }
        })
        .collect();
    let printed = succeed(&mut sweep.command(&more));
    assert!(
        printed.contains("4 of 6 runs are complete, 2 to do"),
        "{printed}"
    );
    assert_eq!(modified(&history), before);
    assert_eq!(
        column(&sweep.table("here/sweep.csv"), "state"),
        ["complete"; 6]
    );
    succeed(&mut sweep.command(&[&options[..], &["--overwrite", "--quiet"]].concat()));
    assert!(modified(&history) > before);
}

#[test]
fn rates_and_errors_follow_from_a_reference() {
    let sweep = Sweep::new("sweep-rates");
    // The kinetic energy at the start is proportional to the square of the speed.
    let options = [
        "--set",
        "speed=4,2,1",
        "--set",
        "dx=2e-3",
        "--value",
        "first:kinetic_energy",
    ];
    // The speed is not a resolution, so its rate is computed only with --x.
    succeed(&mut sweep.command(&options));
    let table = sweep.table("out/plate_sweep/sweep.csv");
    assert!(
        !table.iter().any(|(name, _)| name.ends_with("_rate")),
        "{table:?}"
    );
    succeed(&mut sweep.command(&[&options[..], &["--x", "speed"]].concat()));
    let table = sweep.table("out/plate_sweep/sweep.csv");
    let rates = numbers(column(&table, "first_kinetic_energy_rate"));
    assert!(rates[0].is_nan() && rates[1].is_nan(), "{rates:?}");
    assert!((rates[2] - 2.0).abs() < 1e-9, "{rates:?}");
    let energy = numbers(column(&table, "first_kinetic_energy"))[2];
    let reference = format!("{energy:?}");
    let printed =
        succeed(&mut sweep.command(&[&options[..], &["--reference", &reference]].concat()));
    assert!(printed.contains("+300.000 %"), "{printed}");
    let table = sweep.table("out/plate_sweep/sweep.csv");
    let errors = numbers(column(&table, "first_kinetic_energy_error"));
    assert!(
        (errors[0] - 15.0).abs() < 1e-9 && errors[2] == 0.0,
        "{errors:?}"
    );
    let rate = numbers(column(&table, "first_kinetic_energy_rate"))[1];
    assert!((rate - 5.0_f64.log2()).abs() < 1e-9, "{rate}");
}

#[test]
fn values_that_are_zipped_go_together_and_rows_are_chosen() {
    let sweep = Sweep::new("sweep-zip");
    let options = [
        "--set",
        "dx=2e-3,1e-3",
        "--set",
        "time.end=1e-6,2e-6",
        "--zip",
        "--value",
        "time",
        "-o",
        "o",
    ];
    let printed = succeed(&mut sweep.command(&[&options[..], &["--rows", "2"]].concat()));
    assert!(
        printed.contains("0 of 2 runs are complete, 1 to do"),
        "{printed}"
    );
    let table = sweep.table("o/sweep.csv");
    assert_eq!(column(&table, "state"), ["missing", "complete"]);
    assert_eq!(column(&table, "last_time")[0], "");
    succeed(&mut sweep.command(&options));
    let times = numbers(column(&sweep.table("o/sweep.csv"), "last_time"));
    assert!(
        (times[0] - 1e-6).abs() < 1e-12 && (times[1] - 2e-6).abs() < 1e-12,
        "{times:?}"
    );
}

#[test]
fn runs_are_started_by_a_launcher() {
    let sweep = Sweep::new("sweep-launcher");
    let mut command = sweep.command(&[
        "--set",
        "dx=2e-3",
        "--launcher",
        "mpirun --bind-to none -n 2",
    ]);
    command.envs([
        ("OMPI_ALLOW_RUN_AS_ROOT", "1"),
        ("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1"),
        ("OMPI_MCA_rmaps_base_oversubscribe", "1"),
        ("PRTE_MCA_rmaps_default_mapping_policy", ":oversubscribe"),
    ]);
    succeed(&mut command);
    let log =
        std::fs::read_to_string(sweep.folder.join("out/plate_sweep/dx=2e-3/log.txt")).unwrap();
    assert!(log.contains("2 ranks × 1 threads"), "{log}");
    let options = [
        "--set",
        "dx=2e-3",
        "-o",
        "other",
        "--launcher",
        "no-such-launcher -n 2",
    ];
    sweep.fails(&options, 1, &["cannot start no-such-launcher"]);
}

#[test]
fn a_sweep_under_a_launcher_is_rejected() {
    let sweep = Sweep::new("sweep-launched");
    for (name, value) in [
        ("OMPI_COMM_WORLD_SIZE", "1"),
        ("PMI_RANK", "0"),
        ("SLURM_STEP_NUM_TASKS", "2"),
    ] {
        let mut command = sweep.command(&["--set", "dx=2e-3"]);
        let output = finish(command.env(name, value));
        let words = [name, "start fissure sweep without a launcher", "--launcher"];
        expect(&output, 2, &words);
        assert!(!sweep.folder.join("out").exists(), "{name}");
    }
    // The shell of an interactive job of Slurm.
    let mut command = sweep.command(&["--set", "dx=2e-3"]);
    succeed(command.env("SLURM_STEP_NUM_TASKS", "1"));
}

#[test]
fn mistakes_are_found_before_anything_runs() {
    let sweep = Sweep::new("sweep-mistakes");
    for (options, words) in [
        (&["--set", "dx"][..], "must be NAME=VALUE"),
        (
            &["--set", "sped=1,2"],
            "sped=1: --set sped=1: [parameters] of plate.toml has no `sped`; did you mean `speed`?",
        ),
        (&["--set", "dx=1e-3,-1"], "dx=-1: "),
        (
            &["--set", "dx=1,2", "--set", "dx=3"],
            "--set dx: is given twice",
        ),
        (
            &["--set", "dx=1e-3,2e-3", "--set", "speed=1,2,3", "--zip"],
            "--zip: dx has 2 values",
        ),
        (
            &["--set", "dx=1e-3", "--value", "mean:time"],
            "last, first, max or min",
        ),
        (
            &["--set", "dx=1e-3", "--reference", "2"],
            "there is no --value",
        ),
        (
            &["--set", "dx=1e-3", "--x", "dx"],
            "--x dx: has one value only",
        ),
        (
            &["--set", "dx=1e-3", "--rows", "2"],
            "--rows: `2` is not one of the rows 1 to 1",
        ),
        (
            &["--set", "dx=1e-3", "--launcher", " "],
            "--launcher: must be words",
        ),
    ] {
        sweep.fails(options, 2, &[words]);
        assert!(!sweep.folder.join("out").exists(), "{options:?}");
    }
    let output = finish(&mut sweep.command(&[]));
    expect(&output, 2, &["--set"]);
}

#[test]
fn what_is_there_already_is_not_replaced() {
    let sweep = Sweep::new("sweep-there");
    let options = ["--set", "dx=2e-3", "-o", "o"];
    let mut run = fissure(1);
    run.current_dir(&sweep.folder.0);
    succeed(run.args([
        "run",
        "plate.toml",
        "--quiet",
        "--set",
        "dx=2e-3",
        "--output",
        "o/dx=2e-3",
    ]));
    let result = sweep.folder.join("o/dx=2e-3/result.vtkhdf");
    let before = modified(&result);
    sweep.fails(
        &options,
        2,
        &["o/dx=2e-3 has a result that is not of a sweep"],
    );
    sweep.fails(
        &[&options[..], &["--overwrite"]].concat(),
        2,
        &["not of a sweep"],
    );
    assert_eq!(modified(&result), before);
    let options = ["--set", "dx=2e-3", "-o", "p"];
    succeed(&mut sweep.command(&options));
    let fixed = [&options[..], &["--set", "speed=3"]].concat();
    succeed(&mut sweep.command(&fixed));
    sweep.folder.write(
        "plate.toml",
        &DECK.replace("every_steps = 5", "every_steps = 10"),
    );
    sweep.fails(&options, 2, &["p/dx=2e-3 has a run of another deck"]);
    succeed(&mut sweep.command(&[&options[..], &["--overwrite"]].concat()));
}

#[test]
fn failed_runs_and_unknown_columns_are_reported() {
    let sweep = Sweep::new("sweep-failures");
    let options = ["--set", "dx=2e-3,1e-3", "--value", "kinetic", "-o", "o"];
    sweep.fails(
        &options,
        2,
        &[
            "--value last:kinetic:",
            "has no column `kinetic`; did you mean `kinetic_energy`?",
        ],
    );
    // No run was started.
    assert!(!sweep.folder.join("o").exists());
    let options = [
        "--set",
        "time.step=5e-8,1e-5",
        "--set",
        "time.end=1e-4",
        "--value",
        "time",
        "-o",
        "p",
    ];
    sweep.fails(
        &options,
        1,
        &[
            "time.step=1e-5: failed with exit code",
            "error: 1 of 2 runs failed",
            "log.txt",
        ],
    );
    let table = sweep.table("p/sweep.csv");
    assert_eq!(column(&table, "state"), ["complete", "failed"]);
}

#[test]
fn a_signal_stops_the_runs_and_the_same_command_continues() {
    for signal in [libc::SIGTERM, libc::SIGUSR1] {
        stops_and_continues(signal);
    }
}

#[test]
fn a_request_for_a_checkpoint_does_not_end_a_run_without_handlers() {
    let sweep = Sweep::new("sweep-early-signal");
    // The run installs its handlers 1 s after its start.
    sweep.folder.write("late.sh", "sleep 1\nexec \"$@\"\n");
    let options = ["--set", "dx=2e-3", "--launcher", "sh late.sh", "-o", "o"];
    let mut child = start(&mut sweep.command(&options));
    let log = sweep.folder.join("o/dx=2e-3/log.txt");
    wait_until(&mut child, || log.exists());
    send(&child, libc::SIGUSR2);
    expect(&wait(child), 0, &["dx=2e-3: complete after"]);
}

fn start(command: &mut Command) -> Child {
    let command = command.stdout(Stdio::piped()).stderr(Stdio::piped());
    command.spawn().unwrap()
}

fn send(child: &Child, signal: i32) {
    // SAFETY: the child has not been waited for, so its process id is still valid.
    unsafe {
        libc::kill(child.id() as i32, signal);
    }
}

/// Wait until a condition holds.
///
/// # Panics
/// If the child ends before, or after two minutes.
fn wait_until(child: &mut Child, holds: impl Fn() -> bool) {
    let start = Instant::now();
    while !holds() {
        let status = child.try_wait().unwrap();
        assert!(status.is_none(), "the command has ended: {status:?}");
        if start.elapsed() > Duration::from_secs(120) {
            child.kill().unwrap();
            panic!("the command hangs");
        }
        std::thread::sleep(Duration::from_millis(20));
    }
}

fn stops_and_continues(signal: i32) {
    let sweep = Sweep::new("sweep-signal");
    let options = [
        "--set",
        "dx=1e-3,0.5e-3",
        "--set",
        "time.end=1e-3",
        "--value",
        "step",
        "-o",
        "o",
    ];
    let mut child = start(&mut sweep.command(&options));
    let result = sweep.folder.join("o/dx=1e-3/history.csv");
    let rows = || std::fs::read_to_string(&result).map_or(0, |text| text.lines().count());
    wait_until(&mut child, || rows() >= 3);
    // The run continues after a checkpoint on request.
    send(&child, libc::SIGUSR2);
    let checkpoint = sweep.folder.join("o/dx=1e-3/checkpoint_0.h5");
    wait_until(&mut child, || checkpoint.exists());
    // Another stop signal within 1 s does not kill the run.
    send(&child, signal);
    send(&child, libc::SIGINT);
    let output = wait(child);
    let log = std::fs::read_to_string(sweep.folder.join("o/dx=1e-3/log.txt")).unwrap();
    assert!(log.contains("stopped by a signal after step"), "{log}");
    expect(
        &output,
        75,
        &["the sweep was stopped by a signal or a time limit; the same command continues it"],
    );
    assert!(checkpoint.exists());
    assert!(!sweep.folder.join("o/dx=1e-3/complete").exists());
    assert!(!sweep.folder.join("o/dx=0.5e-3").exists());
    let table = sweep.table("o/sweep.csv");
    assert_eq!(column(&table, "state"), ["incomplete", "missing"]);
    let printed = succeed(&mut sweep.command(&[&options[..], &["--rows", "1"]].concat()));
    assert!(printed.contains("dx=1e-3: complete after"), "{printed}");
    let log = std::fs::read_to_string(sweep.folder.join("o/dx=1e-3/log.txt")).unwrap();
    assert!(log.contains("continued after step"), "{log}");
    assert_eq!(
        numbers(column(&sweep.table("o/sweep.csv"), "last_step"))[0],
        20000.0
    );
}
