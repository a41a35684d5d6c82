//! Checkpoints: a run that is killed or stopped at any time and restarted on any number of ranks has the bits
//! of an uninterrupted run.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use crate::support::command::{
    Folder, SmallDisc, finish, fissure, rank_processes, succeed, text, wait,
};
use crate::support::datasets::{datasets, difference, points_left};
use fissure::output::ResultReader;

/// Exit code of a run that stopped and can be restarted.
const STOPPED: i32 = 75;

/// Return the deck of a notched plate that is torn and shaken, long enough for interruptions.
fn plate(end: &str, extra: &str) -> String {
    format!(
        "dimension = 'plane-stress'
        parameters = {{ pull = 20e6, end = {end} }}
        grid = {{ volume_correction = 'none', spacing = 1e-3, horizon = 3e-3 }}
        material.glass.pmb = {{ density = 2440, youngs_modulus = 72e9 }}
        damage.brittle.critical_stretch = {{ fracture_energy = 135, alpha = 0.25 }}
        body.plate = {{ material = 'glass', damage = 'brittle', shape.box = {{ lower = [0, 0], upper = [0.06, 0.03] }} }}
        crack.notch.segment = {{ from = [-1, 0.015], to = [0.02, 0.015] }}
        set.top.where = 'y > 0.028'
        set.bottom.where = 'y < 0.002'
        condition.pull = {{ set = 'top', traction = ['1e6*sin(1e6*t)', 'pull'] }}
        condition.hold = {{ set = 'bottom', displacement = ['free', '-1e-8*ramp(t, 0, 1e-5)'] }}
        time = {{ end = 'end', step = 1e-8 }}
        output.every_steps = 200
        history = {{ every_steps = 50, reactions = ['bottom'], angular_momentum = true, field.load = {{ field = 'stress', component = 'yy', set = 'top', of = ['mean', 'maximum'] }}, probe.tip.at = [0.02, 0.015], probe.tip.fields = ['strain'], front.load = {{ from = [0.03, 0.03], direction = [0, -1], field = 'velocity', component = 'y', threshold = 0.1 }}, tip.notch = {{ from = [0, 0.015], direction = [1, 0] }}, j_integral.notch = {{ lower = [0.01, 0.007], upper = [0.03, 0.023] }}, crack.notch = {{ from = [0, 0.015] }} }}
        {extra}
        "
    )
}

fn run(ranks: usize, deck: &Path, out: &Path, extra: &[&str]) -> Command {
    let mut command = fissure(ranks);
    command
        .arg("run")
        .arg(deck)
        .arg("--output")
        .arg(out)
        .args(extra);
    command
}

fn result(out: &Path) -> PathBuf {
    out.join("result.vtkhdf")
}

fn send(signal: &str, process: u32) {
    let sent = Command::new("kill")
        .args([signal, &process.to_string()])
        .status();
    assert!(sent.unwrap().success());
}

/// Return whether a folder contains a checkpoint.
fn has_checkpoint(out: &Path) -> bool {
    ["checkpoint_0.h5", "checkpoint_1.h5"]
        .iter()
        .any(|name| out.join(name).exists())
}

/// Return the number of outputs of a result; 0 while a program writes to the result.
fn outputs(out: &Path) -> usize {
    let steps = ResultReader::open(&result(out)).and_then(|result| result.steps());
    steps.map_or(0, |steps| steps.len())
}

/// Return the number of lines of `history.csv`; 0 without this file.
fn rows(out: &Path) -> usize {
    let text = std::fs::read_to_string(out.join("history.csv"));
    text.map_or(0, |text| text.lines().count())
}

/// Start a run, and wait for its second output.
fn with_two_outputs(mut command: Command, out: &Path) -> Child {
    command.stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut child = command.spawn().unwrap();
    while outputs(out) < 2 {
        std::thread::sleep(Duration::from_millis(20));
        let ended = child.try_wait().unwrap();
        assert!(ended.is_none(), "the run ended by itself");
    }
    child
}

/// Kill one rank of a run after a delay; return whether the kill ended the run.
fn kill_after(mut command: Command, ranks: usize, delay: Duration) -> bool {
    let mut child = command
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    std::thread::sleep(delay);
    let process = rank_processes(&child, ranks).last().copied();
    let killed = process.is_some_and(|process| {
        child.try_wait().unwrap().is_none()
            && Command::new("kill")
                .args(["-9", &process.to_string()])
                .stderr(Stdio::null())
                .status()
                .unwrap()
                .success()
    });
    let output = wait(child);
    let ended_well = output.status.success();
    assert!(killed || ended_well, "{}", text(&output));
    killed && !ended_well
}

#[test]
fn killed_at_any_moment_and_continued_on_any_number_of_ranks() {
    survives_kills("kills", &plate("3e-5", "checkpoint.every_steps = 15"));
}

#[test]
fn killed_while_the_grid_grows_and_continued_on_any_number_of_ranks() {
    let more = "checkpoint.every_steps = 15
        refinement = { levels = 1, trigger = { damage = 0.2, energy = 0.5, every_steps = 25, coarsen_after = 2e-7 } }
        balance = { every_steps = 70, imbalance = 1 }";
    survives_kills(
        "kills-growing",
        &plate("6e-6", more).replace("step = 1e-8", "step = 5e-9"),
    );
}

/// Kill and restart runs of a deck. A checkpoint every 15 steps makes kills during a write likely.
/// tests/scripts/kill_test is the long form of this test.
fn survives_kills(name: &str, text: &str) {
    let kills: usize = std::env::var("FISSURE_KILLS").map_or(6, |text| text.parse().unwrap());
    let folder = Folder::new(name);
    let deck = folder.write("deck.toml", text);
    let whole = folder.join("whole");
    let begin = Instant::now();
    succeed(&mut run(2, &deck, &whole, &[]));
    let mut duration = begin.elapsed();
    let expected = datasets(&result(&whole));
    if text.contains("coarsen_after") {
        assert!(points_left(&expected), "no point has left");
    }
    let table = std::fs::read_to_string(whole.join("history.csv")).unwrap();

    let mut random = u64::from(std::process::id());
    let mut survived = 0;
    while survived < kills {
        let out = folder.join(format!("killed{survived}"));
        let mut killed = 0;
        loop {
            random = random
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            let share = 0.15 + 0.7 * (random >> 11) as f64 / (1_u64 << 53) as f64;
            let restart = has_checkpoint(&out);
            let ranks = if restart {
                1 + (killed + survived) % 4
            } else {
                2
            };
            let flags: &[&str] = if restart {
                &["--restart"]
            } else {
                &["--overwrite"]
            };
            let command = run(ranks, &deck, &out, flags);
            if killed < 3 && kill_after(command, ranks, duration.mul_f64(share)) {
                killed += 1;
                continue;
            }
            if killed == 0 {
                // The run is faster than the uninterrupted run, because the machine is less busy now.
                duration = duration.mul_f64(0.8);
            }
            if killed == 3 {
                succeed(&mut run(ranks, &deck, &out, flags));
            }
            break;
        }
        let found = datasets(&result(&out));
        assert_eq!(difference(&expected, &found), None, "after {killed} kills");
        assert_eq!(
            std::fs::read_to_string(out.join("history.csv")).unwrap(),
            table
        );
        survived += killed;
        std::fs::remove_dir_all(&out).unwrap();
    }
}

#[test]
fn a_signal_to_any_rank_stops_all_and_nothing_is_lost() {
    let folder = Folder::new("signals");
    let deck = folder.write("deck.toml", &plate("3e-5", ""));
    let whole = folder.join("whole");
    succeed(&mut run(1, &deck, &whole, &[]));
    let expected = datasets(&result(&whole));
    for (ranks, signal) in [
        (1, "-TERM"),
        (1, "-INT"),
        (2, "-USR1"),
        (2, "-TERM"),
        (3, "-USR1"),
    ] {
        let out = folder.join(format!("{ranks}{signal}"));
        let child = with_two_outputs(run(ranks, &deck, &out, &[]), &out);
        send(signal, *rank_processes(&child, ranks).last().unwrap());
        let output = wait(child);
        let printed = text(&output);
        assert_eq!(output.status.code(), Some(STOPPED), "{printed}");
        assert_eq!(
            printed.matches("stopped by a signal").count(),
            1,
            "{printed}"
        );
        assert!(has_checkpoint(&out));
        succeed(&mut run(4 - ranks, &deck, &out, &["--restart"]));
        assert_eq!(difference(&expected, &datasets(&result(&out))), None);
    }
}

#[test]
fn a_signal_during_the_set_up_ends_it() {
    let folder = Folder::new("set-up");
    // With this spacing, the set-up takes seconds on any machine.
    let coarse = "spacing = 1e-3, horizon = 3e-3";
    let plate = plate("1e-5", "").replace(coarse, "spacing = 4e-5, horizon = 1.2e-4");
    assert!(!plate.contains(coarse));
    let deck = folder.write("deck.toml", &plate);
    for ranks in [1, 2] {
        let out = folder.join(format!("out{ranks}"));
        let mut command = run(ranks, &deck, &out, &[]);
        let mut child = command
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        // The folder is locked before the points are created.
        while !out.join(".lock").exists() {
            std::thread::sleep(Duration::from_millis(5));
            assert!(child.try_wait().unwrap().is_none(), "it ended by itself");
        }
        send("-TERM", *rank_processes(&child, ranks).last().unwrap());
        let output = wait(child);
        let printed = text(&output);
        assert_eq!(output.status.code(), Some(STOPPED), "{printed}");
        let told = printed.matches("stopped by a signal before the first step");
        assert_eq!(told.count(), 1, "{printed}");
        assert!(!result(&out).exists());
    }
}

#[test]
fn signals_are_listened_to_before_mpi_has_started() {
    // The rank waits during the start of MPI, because the other process is `sleep`, which never starts MPI.
    let script = "$0 run no_deck.toml & rank=$!
        for k in $(seq 300); do
            caught=$(awk '/^SigCgt/ { print $2 }' /proc/$rank/status)
            if (( 0x$caught & 0x800 )); then
                kill -USR2 $rank; sleep 0.2; kill -0 $rank && echo still there; break
            fi
            sleep 0.01
        done
        kill -KILL $rank";
    let command = fissure(2);
    let arguments: Vec<_> = command.get_args().map(ToOwned::to_owned).collect();
    let (binary, options) = arguments.split_last().unwrap();
    let environment: Vec<_> = (command.get_envs())
        .filter_map(|(name, value)| Some((name.to_owned(), value?.to_owned())))
        .collect();
    let mut command = Command::new(command.get_program());
    let one = options.iter().map(|word| match word.to_str() {
        Some("2") => "1".into(),
        _ => word.clone(),
    });
    command.args(one).args(["bash", "-c", script]).arg(binary);
    command
        .args([":", "-n", "1", "sleep", "5"])
        .envs(environment);
    let printed = text(&finish(&mut command));
    assert!(printed.contains("still there"), "{printed}");
}

#[test]
fn a_checkpoint_is_written_on_request() {
    let folder = Folder::new("request");
    let deck = folder.write("deck.toml", &plate("1e-2", ""));
    let out = folder.join("out");
    let mut child = with_two_outputs(run(2, &deck, &out, &[]), &out);
    assert!(!has_checkpoint(&out));
    send("-USR2", *rank_processes(&child, 2).last().unwrap());
    let before = outputs(&out);
    while !has_checkpoint(&out) || outputs(&out) <= before {
        std::thread::sleep(Duration::from_millis(20));
        assert!(child.try_wait().unwrap().is_none(), "the run goes on");
    }
    let ranks = rank_processes(&child, 2);
    send("-USR1", ranks[0]);
    let output = wait(child);
    assert_eq!(output.status.code(), Some(STOPPED), "{}", text(&output));
}

#[test]
fn the_wall_clock_limit_stops_in_time() {
    let folder = Folder::new("wall");
    let deck = folder.write("deck.toml", &plate("1e-2", ""));
    let out = folder.join("out");
    for extra in [&[][..], &["--restart"]] {
        let begin = Instant::now();
        let output = finish(run(2, &deck, &out, &["--wall-time", "0:00:03"]).args(extra));
        let printed = text(&output);
        assert_eq!(output.status.code(), Some(STOPPED), "{printed}");
        assert!(
            printed.contains("as the wall-clock limit is near"),
            "{printed}"
        );
        // The time limit, with a margin for start and end on a busy machine.
        assert!(begin.elapsed() < Duration::from_secs(12));
    }
}

#[test]
fn a_later_end_and_other_outputs_are_allowed_and_other_physics_is_not() {
    let folder = Folder::new("changed");
    let deck = folder.write("deck.toml", &plate("1e-5", ""));
    let out = folder.join("out");
    succeed(&mut run(2, &deck, &out, &[]));

    let refused = finish(&mut run(
        2,
        &deck,
        &out,
        &["--restart", "--set", "pull=21e6"],
    ));
    let printed = text(&refused);
    assert_eq!(refused.status.code(), Some(2), "{printed}");
    assert!(
        printed.contains("condition.pull.traction[1]: was `pull` = 20000000, is `pull` = 21000000"),
        "{printed}"
    );

    // The run is complete, so a restart changes nothing.
    let before = datasets(&result(&out));
    let printed = succeed(&mut run(1, &deck, &out, &["--restart"]));
    assert!(printed.contains("complete already"), "{printed}");
    assert_eq!(difference(&before, &datasets(&result(&out))), None);

    // The end must be after the step before the checkpoint. The last step of a run may pass the end.
    let earlier = ["--restart", "--set", "end=5e-6"];
    let refused = finish(&mut run(2, &deck, &out, &earlier));
    let printed = text(&refused);
    assert_eq!(refused.status.code(), Some(2), "{printed}");
    let told = [
        "[time] end: must be after the checkpoint ",
        "which is at 1e-5 s, is 5e-6 s",
    ];
    assert!(told.iter().all(|told| printed.contains(told)), "{printed}");
    assert_eq!(difference(&before, &datasets(&result(&out))), None);
    let within = ["--restart", "--set", "end=9.995e-6"];
    let printed = succeed(&mut run(1, &deck, &out, &within));
    assert!(printed.contains("complete already"), "{printed}");

    succeed(&mut run(
        3,
        &deck,
        &out,
        &["--restart", "--set", "end=2e-5"],
    ));
    let whole = folder.join("whole");
    succeed(&mut run(1, &deck, &whole, &["--set", "end=2e-5"]));
    assert_eq!(
        difference(&datasets(&result(&whole)), &datasets(&result(&out))),
        None
    );

    // Other fields need a new file; the file with the first half is kept, also at a second change.
    let other = plate("3e-5", "").replace(
        "output.every_steps = 200",
        "output = { every_steps = 100, fields = ['damage'] }",
    );
    std::fs::write(&deck, other).unwrap();
    let continued = finish(&mut run(2, &deck, &out, &["--restart"]));
    let printed = text(&continued);
    assert!(
        continued.status.success() && printed.contains("result_until_step_2000.vtkhdf"),
        "{printed}"
    );
    let steps = |file: &str| {
        ResultReader::open(&out.join(file))
            .unwrap()
            .steps()
            .unwrap()
    };
    assert_eq!(steps("result_until_step_2000.vtkhdf").last(), Some(&2000));
    assert_eq!(steps("result.vtkhdf")[..3], [2000, 2100, 2200]);
    for (fields, name) in [
        ("velocity", "result_until_step_3000"),
        ("damage", "result_until_step_3000_1"),
    ] {
        let other = plate("3e-5", "").replace(
            "output.every_steps = 200",
            &format!("output = {{ every_steps = 100, fields = ['{fields}'] }}"),
        );
        std::fs::write(&deck, other).unwrap();
        succeed(&mut run(2, &deck, &out, &["--restart"]));
        assert!(!steps(&format!("{name}.vtkhdf")).is_empty());
    }
}

#[test]
fn a_set_whose_file_has_changed_is_rejected() {
    let folder = Folder::new("changed-set");
    let ids = |ids: &str| folder.write("ids.txt", ids);
    let text = plate("1e-5", "set.some.file = 'ids.txt'");
    for (name, text) in [
        (
            "load",
            text.replace("set = 'top', traction", "set = 'some', traction"),
        ),
        (
            "column",
            text.replace("set = 'top', of", "set = 'some', of"),
        ),
    ] {
        ids("3\n90\n4\n700\n");
        let deck = folder.write("deck.toml", &text);
        let out = folder.join(name);
        succeed(&mut run(2, &deck, &out, &[]));
        let before = entries(&out);
        ids("3\n90\n4\n701\n");
        let further = ["--restart", "--set", "end=1.2e-5"];
        let refused = finish(&mut run(2, &deck, &out, &further));
        let printed = self::text(&refused);
        assert_eq!(refused.status.code(), Some(2), "{printed}");
        assert!(
            printed.contains("other points of [set.some]; has a file"),
            "{printed}"
        );
        assert_eq!(entries(&out), before);
        // Another order of the ids is the same set.
        ids("700\n4\n3\n90\n");
        succeed(&mut run(3, &deck, &out, &further));
    }
}

#[test]
fn bonds_broken_since_the_last_output_add_up_to_all_that_broke() {
    let folder = Folder::new("newly-broken");
    let text = plate("1.5e-5", "").replace(
        "output.every_steps = 200",
        "output = { every_steps = 90, fields = ['broken_bonds', 'newly_broken_bonds'] }",
    );
    let (deck, out) = (folder.write("deck.toml", &text), folder.join("out"));
    // Stop between two outputs, and restart.
    succeed(&mut run(1, &deck, &out, &["--set", "end=1.25e-5"]));
    succeed(&mut run(2, &deck, &out, &["--restart"]));
    let reader = ResultReader::open(&result(&out)).unwrap();
    let steps = reader.steps().unwrap();
    assert!(steps.contains(&1170) && steps.contains(&1260), "{steps:?}");
    let mut so_far = vec![0.0; reader.field("broken_bonds", 0).unwrap().len()];
    for step in 0..steps.len() {
        let new = reader.field("newly_broken_bonds", step).unwrap();
        so_far
            .iter_mut()
            .zip(&new)
            .for_each(|(sum, new)| *sum += new);
        assert_eq!(so_far, reader.field("broken_bonds", step).unwrap());
    }
    assert!(so_far.iter().sum::<f64>() > 100.0);
}

#[test]
fn a_damped_state_based_run_goes_on_as_if_it_had_never_stopped() {
    goes_on(
        "damped",
        "ordinary = { density = 2440, youngs_modulus = 72e9, poisson_ratio = 0.2, damping = 1e5 }",
        "auto",
    );
}

#[test]
fn bonds_that_remember_go_on_as_if_they_had_never_stopped() {
    let law =
        "elastic_plastic_pmb = { density = 2440, youngs_modulus = 72e9, yield_stretch = 1e-4 }";
    for (name, family) in [("yielding", "lattice"), ("yielding-listed", "list")] {
        dissipates(&goes_on(name, law, family));
    }
}

#[test]
fn bonds_that_soften_go_on_as_if_they_had_never_stopped() {
    let law = "softening_pmb = { density = 2440, youngs_modulus = 72e9, strength_stretch = 1e-4, critical_stretch = 6e-4 }";
    for (name, family) in [("softening", "lattice"), ("softening-listed", "list")] {
        dissipates(&goes_on(name, law, family));
    }
}

#[test]
fn bonds_that_wear_out_go_on_as_if_they_had_never_stopped() {
    let law = "fatigue_pmb = { density = 2440, youngs_modulus = 72e9, cycles_per_second = 1e6, \
               fatigue_coefficient = 1e6, fatigue_exponent = 2 }";
    for (name, family) in [("worn", "lattice"), ("worn-listed", "list")] {
        let broken = &goes_on(name, law, family)["history broken_bonds"];
        let broken: Vec<f64> = broken.iter().map(|bits| f64::from_bits(*bits)).collect();
        let middle = broken[broken.len() / 2];
        assert!(
            middle > 0.0 && broken[broken.len() - 1] > middle,
            "{broken:?}"
        );
    }
}

#[test]
fn points_that_flow_go_on_as_if_they_had_never_stopped() {
    let law = "correspondence = { density = 2440, youngs_modulus = 72e9, poisson_ratio = 0.2, yield_stress = 10e6, hardening_modulus = 1e9 }";
    dissipates(&goes_on("flowing", law, "auto"));
}

#[test]
fn points_that_harden_by_rate_and_heat_go_on_as_if_they_had_never_stopped() {
    let law = "correspondence = { density = 2440, youngs_modulus = 72e9, poisson_ratio = 0.2, yield_stress = 8e6, hardening_modulus = 50e6, hardening_exponent = 0.4, strain_rate_coefficient = 0.02, reference_strain_rate = 1, thermal_softening_exponent = 1, initial_temperature = 0, melting_temperature = 1, volumetric_heat_capacity = 1e5 }";
    dissipates(&goes_on("hardening", law, "auto"));
}

#[test]
fn a_collision_goes_on_as_if_it_had_never_stopped() {
    collision_goes_on("collision", ["", ""]);
}

#[test]
fn a_collision_of_scattered_bodies_goes_on_as_if_it_had_never_stopped() {
    let scatter = ["jitter = 0.2, seed = 4,", ", weibull_modulus = 8, seed = 5"];
    collision_goes_on("scattered-collision", scatter);
}

/// Stop a collision in the middle and restart it on another number of ranks; the result must equal that of an
/// uninterrupted run.
fn collision_goes_on(name: &str, [jitter, weibull]: [&str; 2]) {
    let folder = Folder::new(name);
    let text = "
        dimension = 'plane-stress'
        grid = { JITTER spacing = 1, horizon = 3 }
        material.rubber.pmb = { density = 2, youngs_modulus = 5 }
        damage.brittle.critical_stretch = { critical_stretch = 0.05 WEIBULL }
        parameters.end = 6
        contact = { friction = 0.3, restitution = 0.5 }
        body.flying = { material = 'rubber', damage = 'brittle', shape.box = { lower = [0, 0], upper = [10, 8] } }
        body.target = { material = 'rubber', damage = 'brittle', shape.box = { lower = [10.5, -4], upper = [16, 12] } }
        rigid.hammer = { shape.box = { lower = [10, 12.5], upper = [15, 14] }, mass = 30, velocity = [-0.1, -0.3], angular_velocity = [0.2], friction = 0.5 }
        initial.throw = { set = 'flying', velocity = [0.4, '0.02*(x - 5)'] }
        time = { end = 'end', step = 0.1 }
        output.every_steps = 10
        ";
    let text = text.replace("JITTER", jitter).replace("WEIBULL", weibull);
    let deck = folder.write("deck.toml", &text);
    let out = folder.join("out");
    succeed(&mut run(2, &deck, &out, &[]));
    let further = ["--restart", "--set", "end=16"];
    succeed(&mut run(3, &deck, &out, &further));
    let whole = folder.join("whole");
    succeed(&mut run(1, &deck, &whole, &["--set", "end=16"]));
    let whole = datasets(&result(&whole));
    assert_eq!(difference(&whole, &datasets(&result(&out))), None);
    let column = |name: &str| {
        let bits = whole[&format!("history {name}")].iter();
        bits.map(|bits| f64::from_bits(*bits)).collect::<Vec<_>>()
    };
    // The bodies touch when the run is stopped, and bonds break before and after.
    let (time, touching, broken) = (
        column("time"),
        column("touching_pairs"),
        column("broken_bonds"),
    );
    let middle = time.iter().position(|time| *time >= 6.0).unwrap();
    assert!(touching[middle] > 0.0 && column("friction_energy")[middle] > 0.0);
    assert!(broken[middle] > 0.0 && *broken.last().unwrap() > broken[middle]);
}

/// Assert that a run dissipates energy before and after its middle.
fn dissipates(result: &BTreeMap<String, Vec<u64>>) {
    let dissipated = result["history dissipated_energy"].iter();
    let dissipated: Vec<f64> = dissipated.map(|bits| f64::from_bits(*bits)).collect();
    let middle = dissipated[dissipated.len() / 2];
    assert!(middle > 0.0 && *dissipated.last().unwrap() > middle);
}

/// Stop a run in the middle and restart it on another number of ranks; the result must equal that of an
/// uninterrupted run. Return the result.
fn goes_on(name: &str, law: &str, family: &str) -> BTreeMap<String, Vec<u64>> {
    let folder = Folder::new(name);
    let text = plate("1e-5", "")
        .replace("pmb = { density = 2440, youngs_modulus = 72e9 }", law)
        .replace(
            "horizon = 3e-3",
            &format!("horizon = 3e-3, family = '{family}'"),
        )
        .replace(
            "output.every_steps = 200",
            "output = { every_steps = 200, times = [3.333e-6, 9.5e-6], fields = ['stress', 'damage'] }",
        );
    let text = if law.starts_with("correspondence") {
        let plain = "critical_stretch = { fracture_energy = 135, alpha = 0.25 }";
        text.replace(
            plain,
            "energy = { fracture_energy = 135, family_correction = 1 }",
        )
    } else if law.starts_with("softening") {
        text.replace("damage = 'brittle', ", "")
    } else {
        text
    };
    let deck = folder.write("deck.toml", &text);
    let out = folder.join("out");
    succeed(&mut run(2, &deck, &out, &[]));
    let further = ["--restart", "--set", "end=2e-5"];
    succeed(&mut run(3, &deck, &out, &further));
    let whole = folder.join("whole");
    succeed(&mut run(1, &deck, &whole, &["--set", "end=2e-5"]));
    let whole = datasets(&result(&whole));
    assert_eq!(difference(&whole, &datasets(&result(&out))), None);
    whole
}

#[test]
fn a_damaged_checkpoint_is_recognised_and_the_other_one_used() {
    let folder = Folder::new("damaged");
    let deck = folder.write("deck.toml", &plate("2e-5", "checkpoint.every_steps = 700"));
    let out = folder.join("out");
    succeed(&mut run(2, &deck, &out, &[]));
    let expected = datasets(&result(&out));
    // Checkpoints are written at the steps 700, 1400 and 2000, so the newest checkpoint is in the first file.
    let newest = out.join("checkpoint_0.h5");
    let sound = std::fs::read(&newest).unwrap();
    let mut flipped = sound.clone();
    let middle = flipped.len() / 2;
    flipped[middle] ^= 4;
    for damaged in [&sound[..sound.len() / 3], &flipped[..], &[]] {
        std::fs::write(&newest, damaged).unwrap();
        let output = finish(&mut run(3, &deck, &out, &["--restart"]));
        let printed = text(&output);
        assert!(output.status.success(), "{printed}");
        assert_eq!(
            printed
                .matches("checkpoint_0.h5 is damaged and not used")
                .count(),
            1,
            "{printed}"
        );
        assert!(printed.contains("continued after step 1400"), "{printed}");
        assert_eq!(difference(&expected, &datasets(&result(&out))), None);
    }
    for name in ["checkpoint_0.h5", "checkpoint_1.h5"] {
        std::fs::write(out.join(name), "damaged").unwrap();
    }
    let output = finish(&mut run(2, &deck, &out, &["--restart"]));
    let printed = text(&output);
    assert_eq!(output.status.code(), Some(2), "{printed}");
    let told = "error: both checkpoints are damaged, ";
    assert!(printed.contains(told), "{printed}");
    assert!(
        printed.contains("; --overwrite starts the run again"),
        "{printed}"
    );
    for name in ["checkpoint_0.h5", "checkpoint_1.h5"] {
        std::fs::remove_file(out.join(name)).unwrap();
    }
    let output = finish(&mut run(2, &deck, &out, &["--restart"]));
    let printed = text(&output);
    assert_eq!(output.status.code(), Some(2), "{printed}");
    assert!(printed.contains("there is no checkpoint in "), "{printed}");
}

#[test]
fn a_full_disc_leaves_the_checkpoint_before() {
    let folder = Folder::new("fullcheck");
    let Some(disc) = SmallDisc::mount(&folder, "20m") else {
        return;
    };
    let deck = folder.write("deck.toml", &plate("3e-5", "checkpoint.every_steps = 1000"));
    let out = disc.join("out");
    let mut command = run(2, &deck, &out, &[]);
    let mut child = command
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    while !has_checkpoint(&out) {
        std::thread::sleep(Duration::from_millis(5));
        assert!(
            child.try_wait().unwrap().is_none(),
            "the run ended by itself"
        );
    }
    // Another file fills the rest of the disc.
    let _ = std::fs::write(disc.join("other"), vec![0; 20 << 20]);
    let is_full = |output: std::process::Output| {
        let printed = text(&output);
        assert_eq!(output.status.code(), Some(1), "{printed}");
        assert_eq!(printed.matches("error:").count(), 1, "{printed}");
        assert!(printed.contains("No space left"), "{printed}");
    };
    is_full(wait(child));
    let rows = std::fs::read_to_string(out.join("history.csv")).unwrap();
    assert!(rows.ends_with('\n'), "{rows}");
    // There is no space for the copy that a later end needs, so the result must remain unchanged.
    let before = entries(&out);
    is_full(finish(&mut run(
        2,
        &deck,
        &out,
        &["--restart", "--set", "end=4e-5"],
    )));
    assert_eq!(entries(&out), before);
    std::fs::remove_file(disc.join("other")).unwrap();
    succeed(&mut run(1, &deck, &out, &["--restart"]));
    let whole = folder.join("whole");
    succeed(&mut run(1, &deck, &whole, &[]));
    assert_eq!(
        difference(&datasets(&result(&whole)), &datasets(&result(&out))),
        None
    );
}

/// Run the plate until 1e-5 s, and restart it with another deck until 1.5e-5 s; return the output of the
/// restart.
fn continued_with(folder: &Folder, name: &str, other: &str) -> String {
    let out = folder.join(name);
    let deck = folder.write("deck.toml", &plate("1e-5", ""));
    succeed(&mut run(2, &deck, &out, &[]));
    let deck = folder.write("other.toml", other);
    let output = finish(&mut run(
        2,
        &deck,
        &out,
        &["--restart", "--set", "end=1.5e-5"],
    ));
    assert!(output.status.success(), "{}", text(&output));
    text(&output)
}

#[test]
fn columns_of_the_history_keep_their_meaning() {
    let folder = Folder::new("columns");
    for (name, from, to, told) in [
        (
            "probe",
            "probe.tip.at = [0.02",
            "probe.tip.at = [0.03",
            "history.probe.tip.at[0]: was 0.02, is 0.03",
        ),
        (
            "threshold",
            "every_steps = 50,",
            "every_steps = 50, damage_threshold = 0.5,",
            "history.damage_threshold: was 0.35, is 0.5",
        ),
        (
            "tip",
            "direction = [1, 0] }",
            "direction = [1, 0], threshold = 0.2 }",
            "history.tip.notch.threshold: was 0.35, is 0.2",
        ),
    ] {
        let deck = plate("1e-5", "");
        assert!(deck.contains(from));
        let printed = continued_with(&folder, name, &deck.replace(from, to));
        let expected = format!("history columns have another definition: {told}");
        assert!(printed.contains(&expected), "{printed}");
        let rows = |file: &str| {
            let reader = ResultReader::open(&folder.join(name).join(file)).unwrap();
            reader.history().unwrap()[1].values.clone()
        };
        // The old result ends at the step at which the new result begins.
        assert_eq!(rows("result_until_step_1000.vtkhdf").last(), Some(&1000.0));
        assert_eq!(rows("result.vtkhdf")[0], 1000.0);
    }
    // Rows at other times do not change the definitions of columns.
    let deck = plate("1e-5", "").replace("every_steps = 50,", "every_steps = 25,");
    let printed = continued_with(&folder, "often", &deck);
    assert!(!printed.contains("starting a new result"), "{printed}");
}

#[test]
fn a_damaged_result_does_not_keep_the_checkpoint_from_going_on() {
    let folder = Folder::new("damaged-result");
    let deck = folder.write("deck.toml", &plate("1e-5", ""));
    let whole = folder.join("whole");
    succeed(&mut run(1, &deck, &whole, &[]));
    let sound = std::fs::read(result(&whole)).unwrap();
    let mut zeroed = sound.clone();
    zeroed[2000..20_000].fill(0);
    let damages: [(&str, Option<&[u8]>, &str); 4] = [
        (
            "cut",
            Some(&sound[..sound.len() / 3]),
            "the result so far is damaged",
        ),
        ("zeroed", Some(&zeroed), "the result so far is damaged"),
        ("empty", Some(&[]), "the result so far is damaged"),
        ("gone", None, "the result file is missing"),
    ];
    for (name, bytes, told) in damages {
        let out = folder.join(name);
        succeed(&mut run(1, &deck, &out, &[]));
        match bytes {
            Some(bytes) => std::fs::write(result(&out), bytes).unwrap(),
            None => std::fs::remove_file(result(&out)).unwrap(),
        }
        let further = ["--restart", "--set", "end=1.5e-5"];
        let output = finish(&mut run(2, &deck, &out, &further));
        let printed = text(&output);
        assert!(output.status.success(), "{name}: {printed}");
        assert_eq!(printed.matches(told).count(), 1, "{name}: {printed}");
        // Every file named in the message exists.
        let names = printed.split("earlier files are kept as ").nth(1).unwrap();
        for path in names.lines().next().unwrap().split(" and ") {
            assert!(Path::new(path).exists(), "{name}: {path}: {printed}");
        }
        assert_eq!(
            bytes.is_some(),
            names.contains("result_until_step_1000.vtkhdf")
        );
        let reader = ResultReader::open(&result(&out)).unwrap();
        assert_eq!(reader.steps().unwrap(), [1000, 1200, 1400, 1500]);
    }
}

#[test]
fn a_result_of_another_run_is_not_continued() {
    let folder = Folder::new("other-run");
    let extra = "output.top = { set = 'top', every_steps = 500 }";
    let deck = folder.write("deck.toml", &plate("1e-5", extra));
    let (out, other) = (folder.join("out"), folder.join("other"));
    succeed(&mut run(1, &deck, &out, &[]));
    succeed(&mut run(1, &deck, &other, &["--set", "pull=21e6"]));
    for name in ["result.vtkhdf", "result_top.vtkhdf"] {
        std::fs::copy(other.join(name), out.join(name)).unwrap();
    }
    let further = ["--restart", "--set", "end=1.5e-5"];
    let output = finish(&mut run(2, &deck, &out, &further));
    let printed = text(&output);
    assert!(output.status.success(), "{printed}");
    let told = "the result so far is of another run (condition.pull.traction[1]: was `pull` = 21000000, \
                is `pull` = 20000000): starting a new result";
    for told in [told.to_owned(), format!("[output.top]: {told}")] {
        assert!(
            printed.contains(&format!("warning: {told}")),
            "{told}: {printed}"
        );
    }
    for (name, steps) in [
        ("result", &[1000, 1200, 1400, 1500][..]),
        ("result_until_step_1000", &[0, 200, 400, 600, 800, 1000]),
        ("result_top", &[1000, 1500]),
        ("result_top_until_step_1000", &[0, 500, 1000]),
    ] {
        let reader = ResultReader::open(&out.join(format!("{name}.vtkhdf"))).unwrap();
        assert_eq!(reader.steps().unwrap(), steps, "{name}");
    }
}

/// Return the names in a folder, each with the inode of the file.
fn entries(folder: &Path) -> Vec<(std::ffi::OsString, u64)> {
    use std::os::unix::fs::DirEntryExt;

    let entries = std::fs::read_dir(folder).unwrap().flatten();
    let mut entries: Vec<_> = entries
        .map(|entry| (entry.file_name(), entry.ino()))
        .collect();
    entries.sort();
    entries
}

#[test]
fn a_file_that_cannot_be_read_is_not_called_damaged() {
    let folder = Folder::new("unreadable");
    let deck = folder.write("deck.toml", &plate("2e-6", ""));
    let (out, file) = (folder.join("out"), |name: &str| {
        folder.join("out").join(name)
    });
    succeed(&mut run(1, &deck, &out, &[]));
    let later = ["--restart", "--set", "end=4e-6"];
    let refused = |ranks: usize, message: &str| {
        let before = entries(&out);
        let output = finish(&mut run(ranks, &deck, &out, &later));
        let printed = text(&output);
        assert_eq!(output.status.code(), Some(1), "{printed}");
        assert_eq!(printed.matches("error:").count(), 1, "{printed}");
        assert_eq!(printed.matches(message).count(), 1, "{printed}");
        assert_eq!(entries(&out), before);
    };

    // A program that writes to the file through HDF5 holds the same lock.
    let writer = std::fs::File::open(result(&out)).unwrap();
    writer.lock().unwrap();
    for ranks in [1, 2] {
        refused(ranks, "result.vtkhdf is locked by another program");
    }
    let output = finish(fissure(1).arg("plot").arg(result(&out)));
    let printed = text(&output);
    assert_eq!(output.status.code(), Some(1), "{printed}");
    assert!(
        printed.contains("is locked by another program"),
        "{printed}"
    );
    drop(writer);

    for (name, message) in [
        ("result.vtkhdf", "result.vtkhdf: cannot read the result"),
        (
            "checkpoint_0.h5",
            "checkpoint_0.h5: the checkpoint cannot be read",
        ),
    ] {
        // Root can read files without permission, so the test replaces the file by a dangling link and by a
        // folder.
        let aside = folder.join("aside");
        std::fs::rename(file(name), &aside).unwrap();
        std::os::unix::fs::symlink("not-mounted/file", file(name)).unwrap();
        refused(1, message);
        std::fs::remove_file(file(name)).unwrap();
        std::fs::create_dir(file(name)).unwrap();
        refused(2, message);
        std::fs::remove_dir(file(name)).unwrap();
        std::fs::rename(&aside, file(name)).unwrap();
    }

    succeed(&mut run(2, &deck, &out, &later));
    let whole = folder.join("whole");
    succeed(&mut run(1, &deck, &whole, &later[1..]));
    assert_eq!(
        difference(&datasets(&result(&whole)), &datasets(&result(&out))),
        None
    );
}

#[test]
fn a_refined_region_is_continued_in_its_result() {
    let folder = Folder::new("region");
    let more = "refinement = { levels = 1, region.mid = { where = 'x > 0.04' } }";
    let refined = plate("1e-6", more).replace("step = 1e-8", "step = 5e-9");
    let deck = folder.write("deck.toml", &refined);
    let (whole, out) = (folder.join("whole"), folder.join("out"));
    let later = ["--restart", "--set", "end=2e-6"];
    succeed(&mut run(1, &deck, &whole, &later[1..]));
    succeed(&mut run(2, &deck, &out, &[]));
    let output = finish(&mut run(3, &deck, &out, &later));
    let printed = text(&output);
    assert!(output.status.success(), "{printed}");
    assert!(!printed.contains("starting a new result"), "{printed}");
    let expected = datasets(&result(&whole));
    assert!(expected.contains_key("level 0"));
    assert_eq!(difference(&expected, &datasets(&result(&out))), None);

    // Results with other points are still detected.
    let some = refined.replace(
        "output.every_steps",
        "output.set = 'top'\noutput.every_steps",
    );
    std::fs::write(&deck, some).unwrap();
    let output = finish(&mut run(
        1,
        &deck,
        &out,
        &["--restart", "--set", "end=3e-6"],
    ));
    let printed = text(&output);
    assert!(
        printed.contains("the deck requests other points"),
        "{printed}"
    );
}

#[test]
fn a_run_goes_on_again_and_again() {
    let folder = Folder::new("again");
    let deck = folder.write("deck.toml", &plate("1e-5", ""));
    let (whole, out) = (folder.join("whole"), folder.join("out"));
    succeed(&mut run(1, &deck, &whole, &["--set", "end=4e-5"]));
    succeed(&mut run(3, &deck, &out, &[]));
    for (ranks, end) in [(2, "end=2e-5"), (2, "end=3e-5"), (2, "end=4e-5")] {
        succeed(&mut run(ranks, &deck, &out, &["--restart", "--set", end]));
    }
    assert_eq!(
        difference(&datasets(&result(&whole)), &datasets(&result(&out))),
        None
    );
}

#[test]
fn a_result_with_room_for_all_outputs_is_gone_on_with_in_place() {
    use std::os::unix::fs::MetadataExt;

    /// Upper bound of the size of new attributes about the start of a run, bytes.
    const ATTRIBUTES: u64 = 65536;

    let folder = Folder::new("in-place");
    let deck = folder.write("deck.toml", &plate("1e-4", ""));
    let (whole, out) = (folder.join("whole"), folder.join("out"));
    succeed(&mut run(1, &deck, &whole, &[]));
    let file = || std::fs::metadata(result(&out)).unwrap();
    let mut first = None;
    for (ranks, extra) in [(3, &[][..]), (2, &["--restart"]), (2, &["--restart"])] {
        let before = rows(&out);
        let mut command = run(ranks, &deck, &out, extra);
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().unwrap();
        // Wait for rows of `history.csv`, because a reader of the result would lock the result.
        while rows(&out) < before + 9 {
            std::thread::sleep(Duration::from_millis(20));
            let ended = child.try_wait().unwrap();
            assert!(ended.is_none(), "the run ended by itself");
        }
        send("-USR1", *rank_processes(&child, ranks).last().unwrap());
        let output = wait(child);
        assert_eq!(output.status.code(), Some(STOPPED), "{}", text(&output));
        // The inode is the same, and the length too, except for attributes: the file has its final size from
        // the start.
        let (place, length) = *first.get_or_insert((file().ino(), file().len()));
        assert_eq!(file().ino(), place);
        assert!(file().len() < length + ATTRIBUTES);
    }
    // While another program reads the result, a restart copies it.
    let copy = folder.join("copy");
    std::fs::create_dir(&copy).unwrap();
    for entry in std::fs::read_dir(&out).unwrap().flatten() {
        std::fs::copy(entry.path(), copy.join(entry.file_name())).unwrap();
    }
    let inode = |out: &Path| std::fs::metadata(result(out)).unwrap().ino();
    let before = inode(&copy);
    let reader = ResultReader::open(&result(&copy)).unwrap();
    succeed(&mut run(1, &deck, &copy, &["--restart"]));
    drop(reader);
    assert_ne!(inode(&copy), before);
    let expected = datasets(&result(&whole));
    assert_eq!(difference(&expected, &datasets(&result(&copy))), None);
    succeed(&mut run(2, &deck, &out, &["--restart"]));
    assert_eq!(inode(&out), first.unwrap().0);
    let length = std::fs::metadata(result(&whole)).unwrap().len();
    assert!(file().len() < length + ATTRIBUTES);
    assert_eq!(
        difference(&datasets(&result(&whole)), &datasets(&result(&out))),
        None
    );
    let csv = |out: &Path| std::fs::read_to_string(out.join("history.csv")).unwrap();
    assert_eq!(csv(&whole), csv(&out));
}

#[test]
fn an_extended_run_keeps_its_step_and_says_so() {
    let folder = Folder::new("kept-step");
    let automatic = plate("1e-5", "").replace(", step = 1e-8", "");
    let deck = folder.write("deck.toml", &automatic);
    let out = folder.join("out");
    succeed(&mut run(1, &deck, &out, &[]));
    let steps = || ResultReader::open(&result(&out)).unwrap().steps().unwrap();
    let step = 1e-5 / *steps().last().unwrap() as f64;
    let output = finish(&mut run(
        2,
        &deck,
        &out,
        &["--restart", "--set", "end=1.77e-5"],
    ));
    let printed = text(&output);
    assert!(output.status.success(), "{printed}");
    let told = format!(
        "the time step stays {step:e} s, as at the start of this run; a new run to t = 1.77e-5 s"
    );
    assert_eq!(printed.matches(&told).count(), 1, "{printed} {told}");
    let times = ResultReader::open(&result(&out)).unwrap().times().unwrap();
    for (number, time) in steps().into_iter().zip(times) {
        assert!(
            (time - number as f64 * step).abs() <= 1e-12 * time,
            "{time}"
        );
    }
    // With the same end, no message is printed.
    let printed = text(&finish(&mut run(
        1,
        &deck,
        &out,
        &["--restart", "--set", "end=1.77e-5"],
    )));
    assert!(!printed.contains("the time step stays"), "{printed}");
}

#[test]
fn the_side_car_is_there_after_a_kill() {
    let folder = Folder::new("side-car");
    let deck = folder.write("deck.toml", &plate("1e-2", ""));
    for ranks in [1, 2] {
        let out = folder.join(format!("out{ranks}"));
        let child = with_two_outputs(run(ranks, &deck, &out, &[]), &out);
        for process in rank_processes(&child, ranks) {
            send("-KILL", process);
        }
        wait(child);
        let text = std::fs::read_to_string(out.join("result.xdmf")).unwrap();
        assert!(
            text.contains("<Time Value=\"0.0\"/>") && text.ends_with("</Xdmf>\n"),
            "{text}"
        );
    }
}
