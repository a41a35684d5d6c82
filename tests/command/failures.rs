//! An error on one rank ends all ranks soon, with one message and the right exit code. Files written before
//! stay readable.

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::support::command::{
    Folder, SmallDisc, finish, fissure, is_running, rank_processes, run_on_two_ranks, succeed,
    text, wait,
};
use fissure::output::ResultReader;

/// Return the deck of a small bar with the given `[time]` table and an output at every step.
fn bar(time: &str) -> String {
    format!(
        "dimension = 'plane-stress'
        grid = {{ volume_correction = 'none', spacing = 1, horizon = 3 }}
        material.rubber.pmb = {{ density = 2, youngs_modulus = 5 }}
        body.bar = {{ material = 'rubber', shape.box = {{ lower = [0, 0], upper = [60, 12] }} }}
        initial.pull.displacement = ['0.01*x*sin(x)', 0]
        output = {{ every_steps = 1 }}
        time = {{ {time} }}
        "
    )
}

/// Run a command that must fail with this exit code and print the message once; return its output.
fn failing(command: &mut Command, message: &str, code: i32) -> String {
    let output = finish(command);
    let printed = text(&output);
    assert_eq!(output.status.code(), Some(code), "{printed}");
    assert_eq!(printed.matches(message).count(), 1, "{printed}");
    assert_eq!(printed.matches("error:").count(), 1, "{printed}");
    printed
}

#[test]
fn a_wrong_row_that_one_rank_reads() {
    let folder = Folder::new("row");
    let mut rows: Vec<String> = (0..200).map(|k| format!("{k} 0 1 0")).collect();
    rows[180] = "180 zero 1 0".to_owned();
    folder.write("points.txt", &rows.join("\n"));
    let deck = folder.write(
        "deck.toml",
        "dimension = 'plane-stress'
        grid = { volume_correction = 'none', horizon = 3 }
        material.rubber.pmb = { density = 2, youngs_modulus = 5 }
        body.bar = { material = 'rubber', points.file = 'points.txt' }
        time = { end = 1 }
        ",
    );
    for ranks in [1, 3] {
        let mut command = fissure(ranks);
        command
            .arg("run")
            .arg(&deck)
            .arg("--output")
            .arg(folder.join("out"));
        let message = "points.txt:181: y must be a number, is `zero`";
        failing(&mut command, message, 2);
        assert!(!folder.join("out/result.vtkhdf").exists());
    }
}

#[test]
fn ranks_with_different_inputs() {
    let folder = Folder::new("inputs");
    folder.write("deck.toml", &bar("end = 3"));
    folder.write("longer.toml", &bar("end = 4"));
    folder.write("overlay.toml", "time.end = 4");
    let first = ["deck.toml", "--output", "out"];
    let another_deck = "rank 1 has another deck than rank 0";
    let another_folder = "rank 1 has another output folder than rank 0";
    let another_start = "rank 1 has another handling of existing files than rank 0";
    for (second, option, message) in [
        (["longer.toml", "--output", "out"], &[][..], another_deck),
        (first, &["--set", "time.end=4"], another_deck),
        (first, &["--with", "overlay.toml"], another_deck),
        (["deck.toml", "--output", "other"], &[], another_folder),
        (first, &["--overwrite"], another_start),
        (first, &["--restart"], another_start),
    ] {
        let second = [&second, option].concat();
        let mut command = run_on_two_ranks([(&folder.0, &first), (&folder.0, &second)]);
        failing(&mut command, message, 2);
        assert!(!folder.join("out").exists(), "{second:?}");
    }
}

#[test]
fn ranks_with_different_copies_of_a_file() {
    let folder = Folder::new("copies");
    let deck = "dimension = 'plane-stress'
        grid = { volume_correction = 'none', horizon = 3 }
        material.rubber.pmb = { density = 2, youngs_modulus = 5 }
        body.bar = { material = 'rubber', points.file = 'points.txt' }
        set.some.file = 'ids.txt'
        initial.push.file = 'values.txt'
        time.end = 1
        ";
    let rows: String = (0..199)
        .map(|k| format!("{} {} 1 0\n", k % 100, k / 100))
        .collect();
    let points = |last: &str| format!("{rows}99 1 {last} 0\n");
    let values = |name: &str, last: &str| {
        let rows: String = (0..199).map(|k| format!("{k} 0.1\n")).collect();
        format!("id {name}\n{rows}199 {last}\n")
    };
    let write = |copy: &str| {
        std::fs::create_dir_all(folder.join(copy)).unwrap();
        for (name, content) in [
            ("deck.toml", deck),
            ("points.txt", &points("1")),
            ("ids.txt", "3 4 5\n"),
            ("values.txt", &values("ux", "0.1")),
        ] {
            folder.write(&format!("{copy}/{name}"), content);
        }
        folder.join(copy)
    };
    let (first, second) = (write("first"), write("second"));
    let out = folder.join("out");
    let arguments = ["deck.toml", "--output", out.to_str().unwrap()];
    let run = || run_on_two_ranks([(&first, &arguments), (&second, &arguments)]);
    let other_contents = "rank 1 reads other contents than rank 0";
    for (name, content, message) in [
        ("points.txt", &points("2")[..], other_contents),
        ("values.txt", &values("ux", "0.2"), other_contents),
        ("values.txt", &values("uy", "0.1"), "rank 1 has another"),
        (
            "ids.txt",
            "3 4 6\n",
            "rank 1 has another problem than rank 0",
        ),
    ] {
        write("second");
        folder.write(&format!("second/{name}"), content);
        failing(&mut run(), message, 2);
        assert!(!result_exists(&out), "{name}");
    }
    write("second");
    succeed(&mut run());
    assert!(result_exists(&out));
}

fn result_exists(out: &Path) -> bool {
    out.join("result.vtkhdf").exists()
}

#[test]
fn a_value_that_is_not_finite() {
    let folder = Folder::new("nan");
    // Frequent rows of the history would detect the growth of the energy earlier.
    let text = bar("end = 400, step = 4") + "history.every_steps = 1000";
    let deck = folder.write("deck.toml", &text);
    let mut messages = Vec::new();
    for ranks in [1, 2, 3] {
        let out = folder.join(format!("out{ranks}"));
        let mut command = fissure(ranks);
        command.arg("run").arg(&deck).arg("--output").arg(&out);
        let printed = failing(&mut command, "is not finite", 1);
        messages.push(
            printed
                .lines()
                .find(|line| line.contains("error:"))
                .unwrap()
                .to_owned(),
        );
        // The last output contains the values that are not finite.
        let reader = ResultReader::open(&out.join("result.vtkhdf")).unwrap();
        let last = reader.times().unwrap().len() - 1;
        let velocity = reader.field("velocity", last).unwrap();
        assert!(velocity.iter().any(|value| !value.is_finite()));
    }
    for part in ["step ", "point ", "body `bar`", "reference position ["] {
        assert!(messages[0].contains(part), "{}", messages[0]);
    }
    messages.dedup();
    assert_eq!(messages.len(), 1, "the same point on any number of ranks");
}

/// Motions of 1e300 m/s are finite, but their energy is not. No energy balance is tested in decks with a
/// temperature.
#[test]
fn an_energy_that_is_not_finite() {
    let folder = Folder::new("energy");
    let load = "
    condition.push = { set = 'all', body_force = [1e300, 0] }
    condition.warm = { set = 'all', temperature = 300 }
    history.every_steps = 1
    ";
    let expands = "youngs_modulus = 5, thermal_expansion = 1e-5, reference_temperature = 293";
    let text = bar("end = 2, step = 0.5").replace("youngs_modulus = 5", expands) + load;
    let deck = folder.write("deck.toml", &text);
    for ranks in [1, 2] {
        let out = folder.join(format!("out{ranks}"));
        let mut command = fissure(ranks);
        command.arg("run").arg(&deck).arg("--output").arg(&out);
        failing(&mut command, "an energy is not finite", 1);
    }
}

/// Run a deck until the disc is full; the run must print one error.
fn fill(ranks: usize, deck: &Path, out: &Path) {
    let mut command = fissure(ranks);
    command.arg("run").arg(deck).arg("--output").arg(out);
    let output = finish(&mut command);
    let printed = text(&output);
    assert_eq!(output.status.code(), Some(1), "{printed}");
    assert_eq!(printed.matches("error:").count(), 1, "{printed}");
    assert!(printed.contains("No space left"), "{printed}");
}

#[test]
fn a_full_disc() {
    let folder = Folder::new("disc");
    let Some(disc) = SmallDisc::mount(&folder, "2m") else {
        return;
    };
    let deck = folder.write("deck.toml", &bar("end = 100"));
    for ranks in [1, 2, 3] {
        let out = disc.join(format!("out{ranks}"));
        fill(ranks, &deck, &out);
        // Space for the whole result is allocated before the run, so that the error comes before any step.
        assert!(!out.join("result.vtkhdf").exists());
        std::fs::remove_dir_all(&out).unwrap();
    }
}

#[test]
fn overwriting_on_a_full_disc_leaves_no_part_of_the_earlier_run() {
    let folder = Folder::new("disc-overwrite");
    let Some(disc) = SmallDisc::mount(&folder, "2m") else {
        return;
    };
    let deck = folder.write("deck.toml", &bar("end = 100"));
    let further = bar("end = 3")
        .replace("output = {", "output = { part.every_steps = 1,")
        .replace(
            "material = 'rubber',",
            "material = 'rubber', damage = 'brittle',",
        )
        + "damage.brittle.critical_stretch.critical_stretch = 1
        history.crack.main.from = [0, 6]
        ";
    let small = folder.write("small.toml", &further);
    let entries = |out: &Path| {
        let names = std::fs::read_dir(out).unwrap();
        let mut names: Vec<String> = names
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .collect();
        names.sort();
        names
    };
    for ranks in [1, 2] {
        let out = disc.join(format!("out{ranks}"));
        let run = |deck: &Path| {
            let mut command = fissure(ranks);
            command.arg("run").arg(deck).arg("--overwrite");
            command.arg("--output").arg(&out);
            command
        };
        succeed(&mut run(&small));
        std::fs::write(out.join("result.vtkhdf.part"), "killed").unwrap();
        let there = entries(&out);
        for name in [
            "crack_main.csv",
            "history.csv",
            "result.xdmf",
            "result_part.vtkhdf",
        ] {
            assert!(there.iter().any(|entry| entry == name), "{there:?}");
        }
        failing(&mut run(&deck), "No space left", 1);
        assert_eq!(entries(&out), [".lock"]);
        std::fs::write(out.join("result.vtkhdf.part"), "killed").unwrap();
        succeed(&mut run(&small));
        assert!(!out.join("result.vtkhdf.part").exists());
        std::fs::remove_dir_all(&out).unwrap();
    }
}

#[test]
fn a_full_disc_while_points_are_born() {
    let folder = Folder::new("disc-growing");
    let Some(disc) = SmallDisc::mount(&folder, "2m") else {
        return;
    };
    let text = "dimension = 'plane-stress'
        grid = { spacing = 1, horizon = 3 }
        material.rubber.pmb = { density = 2, youngs_modulus = 5 }
        body.plate = { material = 'rubber', shape.box = { lower = [0, 0], upper = [40, 30] } }
        initial.pull.velocity = ['0.001*x', 0]
        refinement = { levels = 1, trigger = { where = 'x < t', every_steps = 10 } }
        output.every_steps = 2
        time.end = 60
        ";
    let deck = folder.write("deck.toml", text);
    for ranks in [1, 2] {
        let out = disc.join(format!("out{ranks}"));
        fill(ranks, &deck, &out);
        let reader = ResultReader::open(&out.join("result.vtkhdf")).unwrap();
        let last = reader.times().unwrap().len() - 1;
        assert!(last > 3 && reader.points(last) > reader.points(0), "{last}");
        for step in [0, last] {
            let displacement = reader.field("displacement", step).unwrap();
            assert_eq!(displacement.len(), 3 * reader.points(step));
            assert_eq!(reader.ids(step).unwrap().len(), reader.points(step));
        }
        std::fs::remove_dir_all(&out).unwrap();
    }
}

#[test]
fn a_killed_run_leaves_its_complete_steps() {
    let folder = Folder::new("kill");
    let deck = folder.write("deck.toml", &bar("end = 1e5"));
    for ranks in [1, 2] {
        let out = folder.join(format!("out{ranks}"));
        let mut command = fissure(ranks);
        command.arg("run").arg(&deck).arg("--output").arg(&out);
        command.stdout(Stdio::null()).stderr(Stdio::null());
        let mut child = command.spawn().unwrap();
        let result = out.join("result.vtkhdf");
        let steps = || ResultReader::open(&result).and_then(|reader| reader.times());
        while steps().map_or(0, |times| times.len()) < 5 {
            std::thread::sleep(Duration::from_millis(50));
            assert!(
                child.try_wait().unwrap().is_none(),
                "the run ended by itself"
            );
        }
        child.kill().unwrap();
        child.wait().unwrap();
        // The ranks end a moment after mpirun.
        std::thread::sleep(Duration::from_secs(1));
        let reader = ResultReader::open(&result).unwrap();
        let times = reader.times().unwrap();
        assert!(times.len() >= 5);
        let displacement = reader.field("displacement", times.len() - 1).unwrap();
        assert_eq!(displacement.len(), 3 * 720);
        assert!(displacement.iter().all(|value| value.is_finite()));
    }
}

#[test]
fn ranks_end_soon_after_one_of_them_or_mpirun_is_killed() {
    const RANKS: usize = 7;
    /// Longest time until the other ranks have ended. Open MPI sends SIGTERM, waits a second, and sends
    /// SIGKILL; the limit allows for a busy machine.
    const SOON: Duration = Duration::from_secs(30);

    let kills: usize = std::env::var("FISSURE_KILLS").map_or(2, |text| text.parse().unwrap());
    let folder = Folder::new("others");
    let deck = folder.write(
        "deck.toml",
        &(bar("end = 1e5") + "checkpoint.every_steps = 5"),
    );
    let out = folder.join("out");
    let result = out.join("result.vtkhdf");
    let outputs = || ResultReader::open(&result).map_or(0, |it| it.times().map_or(0, |t| t.len()));
    let mut longest = Duration::ZERO;
    for trial in 0..kills {
        let mut command = fissure(RANKS);
        command.arg("run").arg(&deck).arg("--overwrite");
        command.arg("--output").arg(&out).stdout(Stdio::null());
        let child = command.stderr(Stdio::piped()).spawn().unwrap();
        let begin = Instant::now();
        // Every other pair of trials sends the kill during the start of MPI and of the run.
        let is_time = || match trial % 4 {
            0 | 1 => outputs() > 3,
            _ => begin.elapsed() > Duration::from_millis(100 * (trial as u64 % 13)),
        };
        while rank_processes(&child, RANKS).len() < RANKS || !is_time() {
            std::thread::sleep(Duration::from_millis(20));
            assert!(is_running(child.id()), "the run ended by itself");
        }
        let ranks = rank_processes(&child, RANKS);
        let victim = match trial % 2 {
            0 => ranks[trial / 2 % RANKS],
            _ => child.id(),
        };
        let kill = Command::new("kill")
            .args(["-9", &victim.to_string()])
            .status();
        assert!(kill.unwrap().success());
        let killed = Instant::now();
        while ranks.iter().any(|rank| is_running(*rank)) {
            std::thread::sleep(Duration::from_millis(20));
            assert!(killed.elapsed() < SOON, "trial {trial}: ranks still run");
        }
        longest = longest.max(killed.elapsed());
        assert!(!wait(child).status.success());
        let _ = std::fs::remove_file(&result);
    }
    println!("after a kill the last rank ended in {longest:.1?} at most, {kills} trials");
}

#[test]
fn a_result_is_never_replaced_without_being_asked_to() {
    let folder = Folder::new("overwrite");
    let deck = folder.write("deck.toml", &bar("end = 3"));
    let out = folder.join("out");
    let run = |ranks: usize, extra: &[&str]| {
        let mut command = fissure(ranks);
        command
            .arg("run")
            .arg(&deck)
            .arg("--output")
            .arg(&out)
            .args(extra);
        command
    };
    succeed(&mut run(1, &[]));
    let first = std::fs::read(out.join("result.vtkhdf")).unwrap();
    failing(&mut run(2, &[]), "exists already; --restart", 2);
    assert_eq!(std::fs::read(out.join("result.vtkhdf")).unwrap(), first);
    // An invalid deck is rejected before any file is replaced.
    std::fs::write(&deck, bar("end = -3")).unwrap();
    failing(
        &mut run(2, &["--overwrite"]),
        "[time] end: must be above 0",
        2,
    );
    assert_eq!(std::fs::read(out.join("result.vtkhdf")).unwrap(), first);
    std::fs::write(&deck, bar("end = 2")).unwrap();
    succeed(&mut run(2, &["--overwrite"]));
    let times = ResultReader::open(&out.join("result.vtkhdf"))
        .unwrap()
        .times()
        .unwrap();
    assert_eq!(*times.last().unwrap(), 2.0);
}

#[test]
fn a_launcher_of_another_mpi_does_not_run_the_deck_several_times() {
    let folder = Folder::new("launcher");
    let deck = folder.write("deck.toml", &bar("end = 3"));
    let out = folder.join("out");
    let run = |variables: &[(&str, &str)]| {
        let mut command = fissure(1);
        command.arg("run").arg(&deck).arg("--output").arg(&out);
        command.envs(variables.iter().copied());
        command
    };
    // Environment variables that the launchers of MPICH and Slurm set.
    for (variables, name) in [
        (&[("PMI_SIZE", "3"), ("PMI_RANK", "0")][..], "PMI_SIZE"),
        (
            &[("SLURM_STEP_NUM_TASKS", "3"), ("SLURM_PROCID", "0")],
            "SLURM_STEP_NUM_TASKS",
        ),
    ] {
        let message = format!("{name} says that 3 ranks were started");
        failing(&mut run(variables), &message, 2);
        assert!(!out.exists());
    }
    // Only the first rank prints the error. The other ranks wait before they exit, because the launcher ends
    // all ranks when one of them exits.
    let other = finish(&mut run(&[("PMI_SIZE", "3"), ("PMI_RANK", "1")]));
    assert_eq!(other.status.code(), Some(2));
    assert_eq!(text(&other), "");
    succeed(&mut run(&[("PMI_SIZE", "1"), ("SLURM_NTASKS", "3")]));
}

#[test]
fn wrong_arguments_are_told_once() {
    let mut command = fissure(3);
    command.args(["run", "deck.toml", "--thraeds", "2"]);
    failing(&mut command, "unexpected argument '--thraeds'", 2);
    let mut command = fissure(3);
    command.args(["run", "no_such_deck.toml"]);
    failing(&mut command, "cannot read the deck no_such_deck.toml", 2);
}

#[test]
fn an_output_folder_that_cannot_be_made() {
    let folder = Folder::new("folder");
    let deck = folder.write("deck.toml", &bar("end = 3"));
    let file = folder.write("taken", "a file, not a folder");
    let mut command = fissure(2);
    command
        .arg("run")
        .arg(&deck)
        .arg("--output")
        .arg(file.join("out"));
    failing(&mut command, "cannot create the folder", 1);
}

#[test]
fn a_load_that_loses_its_value_is_named() {
    let folder = Folder::new("lost");
    let deck = folder.write(
        "deck.toml",
        &(bar("end = 10")
            + "condition.pull = { set = 'all', body_force = [0, '0.01*sqrt(2 - t - x/60)'] }"),
    );
    let mut messages = Vec::new();
    for ranks in [1, 3] {
        let out = folder.join(format!("out{ranks}"));
        let mut command = fissure(ranks);
        command.arg("run").arg(&deck).arg("--output").arg(&out);
        let message = "[condition.pull] body_force: component y is NaN at t = ";
        let printed = failing(&mut command, message, 1);
        assert!(printed.contains("deck.toml:8:"), "{printed}");
        messages.push(
            printed
                .lines()
                .find(|line| line.contains(message))
                .unwrap()
                .to_owned(),
        );
    }
    messages.dedup();
    assert_eq!(messages.len(), 1, "{messages:?}");
}

#[test]
fn energy_that_breaking_seems_to_give_hides_no_gain() {
    // With four times the stable step all bonds break, and they break far beyond equilibrium.
    let folder = Folder::new("torn");
    let deck = folder.write(
        "deck.toml",
        "dimension = 'plane-stress'
        grid = { spacing = 1e-3, horizon = 3e-3 }
        material.glass.correspondence = { density = 2440, youngs_modulus = 72e9, poisson_ratio = 0.22 }
        damage.brittle.energy = { fracture_energy = 135 }
        body.plate = { material = 'glass', damage = 'brittle', shape.box = { lower = [0, -0.02], upper = [0.1, 0.02] } }
        crack.notch.segment = { from = [-1, 0], to = [0.05, 0] }
        set.top.where = 'y > 0.019'
        set.bottom.where = 'y < -0.019'
        condition.up = { set = 'top', traction = [0, 14e6] }
        condition.down = { set = 'bottom', traction = [0, -14e6] }
        time = { end = 40e-6, step = 8e-7 }
        ",
    );
    let out = folder.join("out");
    let mut command = fissure(1);
    command.arg("run").arg(deck).arg("--output").arg(&out);
    failing(&mut command, "reduce the time step", 1);
}

#[test]
fn a_run_that_blows_up_is_an_error_while_its_numbers_are_still_finite() {
    let folder = Folder::new("blow-up");
    let law = "ordinary = { density = 2, youngs_modulus = 5, poisson_ratio = 0.3 }";
    let block = |time: &str| bar(time).replace("pmb = { density = 2, youngs_modulus = 5 }", law);
    let stable =
        crate::support::simulate::<2, _>(&block("end = 1"), |it| it.undeformed.stable_step);
    let run = |share: f64, steps: u32, ranks: usize| {
        let step = share * stable;
        let time = format!("end = {}, step = {step}", step * f64::from(steps));
        let deck = folder.write("deck.toml", &(block(&time) + "history.every_steps = 1"));
        let mut command = fissure(ranks);
        command.arg("run").arg(&deck).arg("--overwrite");
        command.arg("--output").arg(folder.join("out"));
        command
    };
    let mut errors = Vec::new();
    for ranks in [1, 2] {
        let printed = failing(&mut run(1.6, 120, ranks), "reduce the time step", 1);
        assert_eq!(printed.matches("warning: step").count(), 1, "{printed}");
        errors.push(
            printed
                .lines()
                .find(|line| line.contains("error:"))
                .unwrap()
                .to_owned(),
        );
        let reader = ResultReader::open(&folder.join("out/result.vtkhdf")).unwrap();
        let last = reader.times().unwrap().len() - 1;
        let velocity = reader.field("velocity", last).unwrap();
        assert!(velocity.iter().all(|value| value.is_finite()));
    }
    assert_eq!(errors[0], errors[1]);
    // No warning for a stable step, nor for a step just below the limit.
    for share in [0.8, 0.99] {
        let output = finish(&mut run(share, 400, 1));
        let printed = text(&output);
        assert!(output.status.success(), "{printed}");
        assert!(!printed.contains("the energy has grown"), "{printed}");
    }
}

#[test]
fn a_motion_that_jumps_is_no_blow_up() {
    let folder = Folder::new("jump");
    let deck = bar("end = 8")
        + "history.every_steps = 1
        set.end.where = 'x < 3'
        condition.jump = { set = 'end', displacement = ['0.5*step(t - 4)', 'free'] }";
    let deck = folder.write("deck.toml", &deck);
    let mut command = fissure(1);
    command
        .arg("run")
        .arg(&deck)
        .arg("--output")
        .arg(folder.join("out"));
    succeed(&mut command);
}

/// Return the deck of a strip at rest, held at one end and pulled at the other.
fn pulled(pull: &str, more: &str) -> String {
    format!(
        "dimension = 'plane-stress'
        grid = {{ spacing = 1e-3, horizon = 3e-3 }}
        material.rubber.pmb = {{ density = 1100, youngs_modulus = 3e6 }}
        body.strip = {{ material = 'rubber', shape.box = {{ lower = [0, 0], upper = [0.03, 0.01] }} }}
        set.left.where = 'x < 2e-3'
        set.right.where = 'x > 28e-3'
        condition.hold = {{ set = 'left', displacement = [0, 0] }}
        condition.pull = {{ set = 'right', {pull} }}
        {more}
        "
    )
}

/// Loads and motions that begin while the body is at rest.
const PULLS: [&str; 6] = [
    "traction = ['1e5*step(t - 1e-4)', 0]",
    "traction = ['1e5*min(t/5e-4, 1)', 0]",
    "body_force = ['1e8*if(t > 1e-4, 1, 0)', 0]",
    "displacement = ['1e-4*step(t - 1e-4)', 'free']",
    "velocity = ['step(t - 1e-4)', 'free']",
    "force = ['sin(t/1e-4)', 0]",
];

#[test]
fn a_load_that_sets_in_is_no_blow_up() {
    let folder = Folder::new("sets-in");
    // With a row at every step, a row contains the load before the load has done any work.
    let each = PULLS.map(|pull| (pull, "history.every_steps = 1"));
    for (k, (pull, rows)) in each.into_iter().chain([(PULLS[0], "")]).enumerate() {
        let deck = pulled(pull, &format!("time.end = 3e-4\n{rows}"));
        let deck = folder.write("deck.toml", &deck);
        let mut command = fissure(1 + k % 2);
        command.arg("run").arg(&deck).arg("--overwrite");
        command.arg("--output").arg(folder.join("out"));
        let output = finish(&mut command);
        let printed = text(&output);
        assert!(output.status.success(), "{pull} {rows}: {printed}");
        assert!(
            !printed.contains("the energy has grown"),
            "{pull} {rows}: {printed}"
        );
    }
}

#[test]
fn a_load_that_sets_in_hides_no_blow_up() {
    let folder = Folder::new("sets-in-unstable");
    let stable = crate::support::simulate::<2, _>(&pulled(PULLS[0], "time.end = 1"), |it| {
        it.undeformed.stable_step
    });
    for pull in [PULLS[0], PULLS[1], PULLS[4]] {
        let step = 3.0 * stable;
        let time = format!("time = {{ end = {}, step = {step} }}", 60.0 * step);
        let deck = pulled(pull, &format!("{time}\nhistory.every_steps = 1"));
        let deck = folder.write("deck.toml", &deck);
        let mut command = fissure(1);
        command.arg("run").arg(&deck).arg("--overwrite");
        command.arg("--output").arg(folder.join("out"));
        failing(&mut command, "reduce the time step", 1);
    }
}

#[test]
fn an_explicit_stage_after_load_steps_can_blow_up() {
    let folder = Folder::new("blow-up-after-load-steps");
    let pull = "traction = ['1e5', 0]";
    let stable = crate::support::simulate::<2, _>(&pulled(pull, "time.end = 1"), |it| {
        it.undeformed.stable_step
    });
    let run = |share: f64| {
        let step = share * stable;
        let (first, end) = (100.0 * step, 160.0 * step);
        let stages = format!(
            "time = {{ end = {end}, step = {step} }}
            stage = [{{ end = {first}, method = 'static' }}, {{ off = ['pull'] }}]
            history.every_steps = 1"
        );
        let deck = folder.write("deck.toml", &pulled(pull, &stages));
        let mut command = fissure(1);
        command.arg("run").arg(&deck).arg("--overwrite");
        command.arg("--output").arg(folder.join("out"));
        command
    };
    succeed(&mut run(0.9));
    failing(&mut run(3.0), "reduce the time step", 1);
}

#[test]
fn families_that_do_not_fit_in_memory() {
    let folder = Folder::new("memory");
    // A law with a bond history and some thousands of bonds per point; the history takes about 1 GB.
    let deck = folder.write(
        "deck.toml",
        "dimension = '3d'
        grid = { spacing = 1, horizon = 12, volume_correction = 'none' }
        material.metal.elastic_plastic_pmb = { density = 2, youngs_modulus = 5, yield_stretch = 1 }
        body.block = { material = 'metal', shape.box = { lower = [0, 0, 0], upper = [16, 16, 16] } }
        time.end = 1
        ",
    );
    for arguments in [&["run", "--threads", "1"][..], &["check"]] {
        let mut command = Command::new("sh");
        let limited = "ulimit -v 1000000; exec \"$@\"";
        command.args(["-c", limited, "sh", env!("CARGO_BIN_EXE_fissure")]);
        command.args(arguments).arg(&deck).current_dir(&folder.0);
        let message = "[grid] horizon: with 12 m, 12.0 spacings, bonds, most of them within [body.block], take 0.9";
        failing(&mut command, message, 2);
    }
}
