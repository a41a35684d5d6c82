//! The commands that need no MPI launch, in the order of a first use.

use crate::support::command::{Folder, finish, fissure, succeed, text};
use fissure::output::ResultReader;

#[test]
fn from_an_example_deck_to_pictures() {
    let folder = Folder::new("commands");
    let deck = folder.join("plate.toml");
    let printed = succeed(fissure(1).arg("init").arg(&deck));
    assert!(printed.contains("fissure check"), "{printed}");
    let again = finish(fissure(1).arg("init").arg(&deck));
    assert_eq!(again.status.code(), Some(2), "{}", text(&again));

    let printed = succeed(
        fissure(1)
            .arg("check")
            .arg(&deck)
            .args(["--set", "dx=2e-3"]),
    );
    for line in [
        "points                  1 000",
        "critical stretch",
        "memory of each rank",
        "top",
    ] {
        assert!(printed.contains(line), "{printed}");
    }

    let printed = succeed(fissure(1).arg("explain").arg(&deck));
    assert!(printed.contains("safety = 0.8"), "{printed}");
    let full = folder.write("full.toml", &printed);
    assert_eq!(succeed(fissure(1).arg("explain").arg(&full)), printed);

    let out = folder.join("out");
    let mut command = fissure(1);
    command.arg("run").arg(&deck).arg("--output").arg(&out);
    succeed(command.args(["--set", "dx=2e-3", "--quiet"]));
    let result = out.join("result.vtkhdf");
    let plot = |arguments: &[&str]| finish(fissure(1).arg("plot").arg(&result).args(arguments));
    for arguments in [
        &[][..],
        &["--field", "velocity", "--time", "2e-5", "--deform", "3"],
    ] {
        let output = plot(arguments);
        assert!(output.status.success(), "{}", text(&output));
    }
    for name in ["damage.png", "velocity.png"] {
        assert!(
            std::fs::read(out.join(name))
                .unwrap()
                .starts_with(b"\x89PNG")
        );
    }
    let frames = folder.join("frame.png");
    let output = plot(&["--time", "all", "-o", frames.to_str().unwrap()]);
    assert!(output.status.success(), "{}", text(&output));
    let outputs = ResultReader::open(&result).unwrap().times().unwrap().len();
    let last = folder.join(format!("frame_{:04}.png", outputs - 1));
    assert!(last.exists());
    for (wrong, message) in [
        (
            ["--field", "damge"],
            "has no field `damge`; did you mean `damage`?",
        ),
        (["--time", "soon"], "--time must be"),
        (["--slice", "z=0"], "--slice is for solids"),
        (["--range", "1,0"], "LOW must be below HIGH"),
    ] {
        let output = plot(&wrong);
        assert_eq!(output.status.code(), Some(2), "{}", text(&output));
        assert!(text(&output).contains(message), "{}", text(&output));
    }
}

#[test]
fn any_key_is_set_from_the_command_line() {
    let folder = Folder::new("keys");
    let deck = folder.join("plate.toml");
    succeed(fissure(1).arg("init").arg(&deck));
    let explain = |set: &[&str]| {
        let mut command = fissure(1);
        command.arg("explain").arg(&deck);
        for set in set {
            command.args(["--set", set]);
        }
        finish(&mut command)
    };
    let output = explain(&[
        "time.safety=0.4",
        "parameters.dx=2e-3",
        "damage.brittle.critical_stretch.alpha=0.25",
        "history.every_steps=7",
        "title=Coarse plate",
    ]);
    assert!(output.status.success(), "{}", text(&output));
    for line in [
        "safety = 0.4",
        "dx = 0.002",
        "alpha = 0.25",
        "every_steps = 7",
        "title = \"Coarse plate\"",
    ] {
        assert!(text(&output).contains(line), "{line}: {}", text(&output));
    }
    for (set, message) in [
        (
            "time.safty=0.4",
            "unknown key `safty`; did you mean `safety`?",
        ),
        (
            "time.safty=0.4",
            "note: lines are those of the deck as changed by --with and --set",
        ),
        ("time.safety=high", "safety"),
        ("dimension.x=1", "`dimension` is a value, not a section"),
        ("body.plate=1", "`body.plate` is a section"),
        ("safety=0.4", "[parameters] of "),
    ] {
        let output = explain(&[set]);
        assert_eq!(output.status.code(), Some(2), "{set}: {}", text(&output));
        assert!(
            text(&output).contains(message),
            "{message}: {}",
            text(&output)
        );
    }
}

#[test]
fn all_templates_are_decks() {
    let folder = Folder::new("templates");
    let help = succeed(fissure(1).args(["init", "--help"]));
    let names = [
        "crack-branching",
        "refined-grid",
        "three-point-bending",
        "plate-with-hole",
    ];
    for name in names
        .into_iter()
        .chain(["cantilever", "penny-crack", "impact", "compact-tension"])
        .chain(["points-from-file"])
    {
        assert!(help.contains(&format!("- {name}: ")), "{name}: {help}");
        let deck = folder.join(format!("{name}.toml"));
        succeed(fissure(1).arg("init").arg(&deck).args(["--template", name]));
        succeed(fissure(1).arg("explain").arg(&deck));
    }
    // The file of points exists already, with the same content and with other content.
    let points = ["--template", "points-from-file"];
    succeed(
        fissure(1)
            .arg("init")
            .arg(folder.join("again.toml"))
            .args(points),
    );
    folder.write("disc.csv", "x y volume\n");
    for (name, words) in [
        ("third.toml", "disc.csv exists already with other content"),
        ("disc.csv", "disc.csv exists already; choose another name"),
        (
            "new/disc.csv",
            "the template writes another file of this name",
        ),
    ] {
        std::fs::create_dir_all(folder.join("new")).unwrap();
        let output = finish(fissure(1).arg("init").arg(folder.join(name)).args(points));
        assert_eq!(output.status.code(), Some(2), "{}", text(&output));
        assert!(text(&output).contains(words), "{words}: {}", text(&output));
    }
    assert!(!folder.join("third.toml").exists() && !folder.join("new/disc.csv").exists());
    let deck = folder.join("other.toml");
    let output = finish(
        fissure(1)
            .arg("init")
            .arg(&deck)
            .args(["--template", "bend"]),
    );
    assert_eq!(output.status.code(), Some(2), "{}", text(&output));
    assert!(
        text(&output).contains("three-point-bending"),
        "{}",
        text(&output)
    );
    assert!(!deck.exists());
}

#[test]
fn the_version_says_what_the_program_is_made_of() {
    for ranks in [1, 2] {
        let printed = succeed(fissure(ranks).arg("--version"));
        let lines: Vec<&str> = printed.lines().collect();
        let version = concat!("fissure ", env!("CARGO_PKG_VERSION"));
        assert!(lines[0].starts_with(version), "{printed}");
        for (line, name) in lines[1..].iter().zip(["MPI", "HDF5", "instructions"]) {
            let (found, value) = line.trim().split_once("  ").unwrap();
            assert_eq!(found, name, "{printed}");
            assert!(!value.trim().is_empty(), "{printed}");
        }
        assert_eq!(lines.len(), 4, "{printed}");
    }
}

#[test]
fn a_verbose_run_says_what_it_has_decided() {
    let folder = Folder::new("verbose");
    let deck = folder.join("plate.toml");
    succeed(fissure(1).arg("init").arg(&deck));
    let printed = |ranks, options: &[&str]| {
        let mut command = fissure(ranks);
        command.arg("run").arg(&deck).args(["--set", "dx=2e-3"]);
        command.arg("--overwrite").args(options);
        succeed(command.arg("--output").arg(folder.join("out")))
    };
    let verbose = printed(2, &["-v"]);
    let (_, decided) = verbose.split_once("decided\n").unwrap();
    let (decided, _) = decided.split_once(" to go").unwrap();
    for words in [
        "partition        each rank has ",
        " ghosts of 1 other rank(s)",
        "sent to ghosts   displacements (2); numbers per ghost in each step",
        " as bits of lattices, 0 in lists",
        "instructions     ",
        "s (chosen), 0.80 of the stable one",
        "volume correction none, quadrature midpoint",
    ] {
        assert!(decided.contains(words), "{words}: {verbose}");
    }
    let normal = printed(1, &[]);
    assert!(!normal.contains("partition"), "{normal}");
    assert_eq!(normal.matches(" to go, after ").count(), 1, "{normal}");
}

#[test]
fn no_result_and_no_deck() {
    let folder = Folder::new("nothing");
    let file = folder.write("notes.txt", "no deck and no result");
    let output = finish(fissure(1).arg("plot").arg(&file));
    assert_eq!(output.status.code(), Some(2), "{}", text(&output));
    assert!(
        text(&output).contains("not a readable HDF5 file"),
        "{}",
        text(&output)
    );
    let output = finish(fissure(1).arg("check").arg(&file));
    assert_eq!(output.status.code(), Some(2), "{}", text(&output));
    assert!(text(&output).contains("notes.txt:1:"), "{}", text(&output));
}

#[test]
fn a_point_file_that_is_not_there() {
    let folder = Folder::new("nofile");
    let deck = folder.write(
        "deck.toml",
        "dimension = '1d'\ngrid.horizon = 3\nmaterial.a.pmb = { density = 1, youngs_modulus = 1 }\n\
         body.b = { material = 'a', points.file = 'none.csv' }\ntime.end = 1\n",
    );
    for ranks in [1, 2] {
        let out = folder.join("out");
        let output = finish(
            fissure(ranks)
                .arg("run")
                .arg(&deck)
                .arg("--output")
                .arg(&out),
        );
        assert_eq!(output.status.code(), Some(2), "{}", text(&output));
        assert_eq!(
            text(&output).matches("cannot read the point file").count(),
            1
        );
    }
}

#[test]
fn check_lists_contact_and_rigid_bodies() {
    let deck = "tests/decks/good/pressed.toml";
    let printed = succeed(fissure(1).args(["check", deck]));
    for (heading, line) in [
        ("contact", "penalty, friction 0 (static 0), restitution 0.5"),
        (
            "rigid bodies",
            "half space, at [0.0000e0, 8.0000e0] m, driven, friction 0",
        ),
        ("body upper", "Weibull modulus"),
    ] {
        let section = printed.split(&format!("\n{heading}\n")).nth(1);
        assert!(
            section.is_some_and(|text| text.contains(line)),
            "{heading}: {printed}"
        );
    }
}

#[test]
fn the_benchmark_counts_what_it_does() {
    let figure = |json: &str, name: &str| -> f64 {
        let figures: serde_json::Value = serde_json::from_str(json).unwrap();
        figures[name].as_f64().unwrap()
    };
    // In a 5 × 4 × 4 block, every offset (x, y, z) within 3.015 has (5 − |x|)(4 − |y|)(4 − |z|) bonds.
    let mut bonds = 0;
    for x in -3_i32..=3 {
        for y in -3_i32..=3 {
            for z in -3_i32..=3 {
                if (1..=9).contains(&(x * x + y * y + z * z)) {
                    bonds += (5 - x.abs()) * (4 - y.abs()) * (4 - z.abs());
                }
            }
        }
    }
    let options = [
        "bench",
        "--points",
        "5,4,4",
        "--steps",
        "7",
        "--threads",
        "1",
        "--json",
    ];
    for ranks in [1, 2] {
        for law in [
            &["--law", "pmb"][..],
            &["--law", "lps", "--no-failure"],
            &["--law", "pmb", "--family", "list"],
        ] {
            let mut command = fissure(ranks);
            let json = succeed(command.args(options).args(law).arg("--no-limits"));
            assert_eq!(figure(&json, "points"), 80.0, "{json}");
            assert_eq!(figure(&json, "directed_bonds"), f64::from(bonds), "{json}");
            let rate = figure(&json, "updates_per_second");
            let rate = rate * figure(&json, "loop_seconds_slowest");
            assert!((rate / f64::from(7 * bonds) - 1.0).abs() < 1e-9, "{json}");
            // Each step sends three numbers per ghost; `lps` sends a fourth.
            let numbers = if law[1] == "lps" { 4.0 } else { 3.0 };
            let sent = figure(&json, "halo_bytes_per_step");
            assert_eq!(sent, 8.0 * numbers * figure(&json, "ghosts"), "{json}");
            assert_eq!(sent > 0.0, ranks == 2);
            let alone = figure(&json, "halo_seconds_per_step_alone");
            assert_eq!(alone > 0.0, ranks == 2, "{json}");
            if ranks == 2 {
                assert!((0.0..=1.0).contains(&figure(&json, "halo_hidden")));
            }
        }
    }
    // Two surface layers of 4 × 4 points touch, out of 8 layers.
    let mut command = fissure(1);
    command.args(["bench", "--points", "8,4,4", "--steps", "3", "--json"]);
    let json = succeed(command.args(["--no-limits", "--contact", "0.25"]));
    assert_eq!(figure(&json, "touching_share"), 0.25, "{json}");
    let ratio = figure(&json, "contact_seconds") / figure(&json, "bonds_seconds");
    assert!(ratio > 0.0);
    // Printed times are read back within a few units in the last place.
    let printed = figure(&json, "contact_over_bonds");
    assert!((printed / ratio - 1.0).abs() < 1e-14, "{json}");
    let wrong = finish(fissure(1).args(["bench", "--contact", "0.9"]));
    assert_eq!(wrong.status.code(), Some(2));
    let wrong = finish(fissure(1).args(["bench", "--points", "5,4"]));
    assert_eq!(wrong.status.code(), Some(2));
    assert!(text(&wrong).contains("edges such as"), "{}", text(&wrong));
}

#[test]
fn an_output_that_is_full_is_an_error() {
    let folder = Folder::new("full");
    let deck = folder.join("plate.toml");
    succeed(fissure(1).arg("init").arg(&deck));
    for command in ["check", "explain"] {
        let run = |output: &str| {
            let output = std::fs::File::options().write(true).open(output).unwrap();
            let mut command = fissure(1)
                .arg(command)
                .arg(&deck)
                .stdout(output)
                .spawn()
                .unwrap();
            command.wait().unwrap().code()
        };
        assert_eq!(run("/dev/full"), Some(1), "{command}");
        assert_eq!(run("/dev/null"), Some(0), "{command}");
    }
    // A reader that closes the pipe early is not an error.
    let (reader, writer) = std::io::pipe().unwrap();
    drop(reader);
    let mut command = fissure(1)
        .arg("explain")
        .arg(&deck)
        .stdout(writer)
        .spawn()
        .unwrap();
    assert_eq!(command.wait().unwrap().code(), Some(0));
}

#[test]
fn far_more_threads_than_cores() {
    let folder = Folder::new("threads");
    let deck = folder.join("plate.toml");
    succeed(fissure(1).arg("init").arg(&deck));
    let mut command = fissure(1);
    command
        .arg("run")
        .arg(&deck)
        .args(["-t", "65535", "--output"]);
    let output = finish(command.arg(folder.join("out")));
    assert_eq!(output.status.code(), Some(2), "{}", text(&output));
    assert!(
        text(&output).contains("--threads 65535: this host has"),
        "{}",
        text(&output)
    );
    let mut command = fissure(1);
    command.arg("run").arg(&deck).arg("--output");
    command
        .arg(folder.join("out"))
        .env("SLURM_CPUS_PER_TASK", "65535");
    let output = finish(&mut command);
    assert_eq!(output.status.code(), Some(2), "{}", text(&output));
    assert!(
        text(&output).contains("SLURM_CPUS_PER_TASK=65535 in the environment: this host has"),
        "{}",
        text(&output)
    );
    assert!(!folder.join("out/result.vtkhdf").exists());
}

#[test]
fn slurm_without_a_number_of_cores() {
    let folder = Folder::new("no-cores");
    let deck = folder.join("plate.toml");
    succeed(fissure(1).arg("init").arg(&deck));
    let threads = |cores: Option<&str>| {
        let mut command = fissure(1);
        command.args(["run", "--overwrite", "--set", "time.end=1e-9"]);
        command.arg(&deck).arg("--output").arg(folder.join("out"));
        command.env_remove("SLURM_CPUS_PER_TASK");
        if let Some(cores) = cores {
            command.env("SLURM_CPUS_PER_TASK", cores);
        }
        let printed = succeed(&mut command);
        let line = printed.lines().find(|line| line.contains(" threads on "));
        line.unwrap().to_owned()
    };
    assert_eq!(threads(Some("0")), threads(None));
    assert!(threads(Some("1")).contains("1 ranks × 1 threads"));
}

#[test]
fn too_many_points_to_make_are_counted_by_formula() {
    let folder = Folder::new("large");
    let deck = folder.write(
        "cube.toml",
        "dimension = '3d'
        grid = { volume_correction = 'none', spacing = 5e-4, horizon = 1.5e-3 }
        material.glass.pmb = { density = 2440, youngs_modulus = 72e9 }
        body.cube = { material = 'glass', shape.box = { lower = [0, 0, 0], upper = [1, 1, 1] } }
        time.end = 1e-4
        ",
    );
    let start = std::time::Instant::now();
    let output = finish(fissure(1).arg("check").arg(&deck).args(["--ranks", "1000"]));
    assert!(output.status.success(), "{}", text(&output));
    assert!(start.elapsed().as_secs() < 30);
    for words in [
        "points                  8.000e9",
        "bonds                   4.8",
        "memory of each rank",
        "steps                   908",
        "stable step",
        "bulk modulus inside",
    ] {
        assert!(text(&output).contains(words), "{words}\n{}", text(&output));
    }
    // One rank cannot hold so many points.
    let output = finish(fissure(1).arg("check").arg(&deck));
    assert_eq!(output.status.code(), Some(2));
    assert!(
        text(&output).contains("are too many for 1 rank(s)"),
        "{}",
        text(&output)
    );
}

#[test]
fn check_and_run_warn_of_the_same() {
    let folder = Folder::new("warnings");
    let deck = folder.write(
        "plate.toml",
        "dimension = 'plane-stress'
parameters.unused = 1
grid = { volume_correction = 'none', spacing = 1, horizon = 3 }
material.glass.pmb = { density = 2, youngs_modulus = 5 }
body.plate = { material = 'glass', shape.box = { lower = [0, 0], upper = [12, 8] } }
body.ball = { material = 'glass', shape.disc = { centre = [16, 4], radius = 3 } }
set.low.where = 'y'
condition.hold = { set = 'low', displacement = [0, 'free'] }
history.probe.far.at = [0, 20]
time.end = 1
",
    );
    let check = succeed(fissure(1).arg("check").arg(&deck));
    assert!(check.contains("plate and ball"), "{check}");
    let warnings = |printed: &str| -> Vec<String> {
        let lines = printed.lines().filter(|line| line.starts_with("warning: "));
        lines.map(str::to_owned).collect()
    };
    let expected = warnings(&check);
    for (part, line) in [
        ("[parameters] unused: no expression uses it", 2),
        ("[set.low] where: is a number, not a condition", 7),
        ("[history.probe.far] at: the nearest point is", 9),
    ] {
        let place = format!("plate.toml:{line}: {part}");
        assert!(expected.iter().any(|line| line.contains(&place)), "{check}");
    }
    for ranks in [1, 2] {
        let mut command = fissure(ranks);
        command.arg("run").arg(&deck).arg("--output");
        let output = finish(command.arg(folder.join(format!("out{ranks}"))));
        assert!(output.status.success(), "{}", text(&output));
        assert_eq!(warnings(&text(&output)), expected);
        assert!(
            text(&output).contains("bonds join plate and ball"),
            "{}",
            text(&output)
        );
    }
}

#[test]
fn several_decks_are_looked_at_one_after_the_other() {
    let folder = Folder::new("several");
    let right = folder.write("right.toml", fissure::deck::EXAMPLE);
    let wrong = |name: &str, horizon: &str| {
        let deck = fissure::deck::EXAMPLE.replace("\"m*dx\"", horizon);
        folder.write(name, &deck)
    };
    let (first, second) = (wrong("first.toml", "-1"), wrong("second.toml", "'none'"));
    for command in ["check", "explain"] {
        let decks = [&first, &right, &second, &right];
        let output = finish(fissure(1).arg(command).arg("-q").args(decks));
        assert_eq!(output.status.code(), Some(2));
        let printed = String::from_utf8_lossy(&output.stderr);
        assert_eq!(printed.matches("error: ").count(), 2, "{printed}");
        for name in ["first.toml:", "second.toml:"] {
            assert_eq!(printed.matches(name).count(), 1, "{printed}");
        }
        let titles = text(&output).matches("\"Crack branching").count();
        assert_eq!(titles, if command == "explain" { 2 } else { 0 });
        let output = finish(fissure(1).arg(command).args([&right, &right]));
        assert!(output.status.success());
    }
}

#[test]
fn stages_are_reported_one_by_one() {
    let folder = Folder::new("stages");
    let deck = folder.write(
        "bar.toml",
        "dimension = '1d'
        grid = { spacing = 1, horizon = 3 }
        material.m.pmb = { density = 1, youngs_modulus = 1 }
        body.bar = { material = 'm', shape.box = { lower = [0], upper = [20] } }
        time = { end = 30, step = 0.1 }
        [[stage]]
        end = 10
        method = 'relaxation'
        relaxation.load_steps = 7
        [[stage]]
        end = 20
        [[stage]]
        adaptive.largest = 0.05
        ",
    );
    let printed = succeed(fissure(1).arg("check").arg(&deck));
    for line in [
        "  stage 1                 7 load steps\n",
        "  stage 2                 100 steps of 100.0 ms\n",
        "  stage 3                 200 steps of 50.00 ms, more if bonds break\n",
        " for the steps, ",
        " history row(s), ",
        " for an iteration, ",
    ] {
        assert!(printed.contains(line), "{line}{printed}");
    }
    assert!(!printed.contains("time step"), "{printed}");
}

#[test]
fn a_path_need_not_be_utf_8() {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt;

    let folder = Folder::new("latin");
    let name = |bytes| folder.join(OsStr::from_bytes(bytes));
    let deck = name(b"b\xe4r.toml");
    let text_of_deck = "dimension = '1d'
        grid = { spacing = 1, horizon = 3 }
        material.m.pmb = { density = 1, youngs_modulus = 1 }
        body.bar = { material = 'm', shape.box = { lower = [0], upper = [20] } }
        time = { end = 0.5, step = 0.1 }
        ";
    std::fs::write(&deck, text_of_deck).unwrap();
    for command in ["check", "explain"] {
        succeed(fissure(1).arg(command).arg(&deck));
    }
    let run = |output: &std::path::Path| {
        let mut command = fissure(1);
        command.arg("run").arg(&deck).arg("--output").arg(output);
        command
    };
    let out = folder.join("out");
    succeed(&mut run(&out));
    let result = out.join("result.vtkhdf");
    assert!(ResultReader::open(&result).is_ok());
    // The HDF5 library accepts only UTF-8 paths.
    let moved = name(b"re\xdfult.vtkhdf");
    let refused = |command: &mut std::process::Command, words: &str| {
        let output = finish(command);
        assert_eq!(output.status.code(), Some(2), "{}", text(&output));
        assert!(text(&output).contains(words), "{}", text(&output));
    };
    let words = "the path of the output folder must be UTF-8; --output DIR writes elsewhere";
    refused(&mut run(&name(b"\xff")), words);
    std::fs::rename(&result, &moved).unwrap();
    let words = "the path of a result file must be UTF-8; rename the file or its folder";
    refused(fissure(1).arg("plot").arg(&moved), words);
    let set = OsStr::from_bytes(b"a=\xff");
    refused(run(&out).arg("--set").arg(set), "invalid UTF-8");
}

#[test]
fn a_point_file_without_line_ends_is_not_read_into_memory() {
    let folder = Folder::new("endless");
    let points = std::fs::File::create(folder.join("huge.txt")).unwrap();
    points.set_len(5 << 30).unwrap();
    let deck = folder.write(
        "cloud.toml",
        "dimension = '3d'
        grid.horizon = 1.6
        material.foam.pmb = { density = 30, youngs_modulus = 1e6 }
        body.cloud = { material = 'foam', points.file = 'huge.txt' }
        time.end = 0.1
        ",
    );
    for command in ["check", "run"] {
        let mut limited = std::process::Command::new("sh");
        limited.args(["-c", "ulimit -v 4000000; exec \"$@\"", "sh"]);
        limited
            .arg(fissure(1).get_program())
            .arg(command)
            .arg(&deck);
        if command == "run" {
            limited.arg("--output").arg(folder.join("out"));
        }
        let output = finish(&mut limited);
        assert_eq!(output.status.code(), Some(2), "{}", text(&output));
        let words =
            "huge.txt:1: is longer than 65536 bytes; is this a file with one row per point?";
        assert!(text(&output).contains(words), "{}", text(&output));
    }
}

/// The tensile test of Peridigm's examples, with a smaller bar: E = 9 k G/(3 k + G) = 180 GPa, in cgs units.
const TENSILE_TEST: &str = r#"
Peridigm:
  Discretization:
    Type: "Text File"
    Input Mesh File: "bar.txt"
  Materials:
    Steel:
      Material Model: "Elastic Correspondence"
      Density: 8.0
      Bulk Modulus: 1.5e12
      Shear Modulus: 6.923e11
      Hourglass Coefficient: 0.02
  Blocks:
    All Blocks:
      Block Names: "block_1 block_2 block_3"
      Material: "Steel"
      Horizon: 1.5
  Boundary Conditions:
    Node Set Ends: "ends.txt"
    Pull:
      Type: "Prescribed Displacement"
      Node Set: "Node Set Ends"
      Coordinate: "y"
      Value: "0.001*y*t"
  Solver:
    Final Time: 1.0
    QuasiStatic:
      Number of Load Steps: 1
      Absolute Tolerance: 1.0
  Compute Class Parameters:
    Top:
      Compute Class: "Block_Data"
      Calculation Type: "Sum"
      Block: "block_3"
      Variable: "Force"
      Output Label: "Top_Reaction_Force"
    Lower Gage:
      Compute Class: "Nearest_Point_Data"
      X: 1.0
      Y: 4.0
      Z: 1.0
      Variable: "Displacement"
    Upper Gage:
      Compute Class: "Nearest_Point_Data"
      X: 1.0
      Y: 11.0
      Z: 1.0
      Variable: "Displacement"
  Output:
    Output Frequency: 1
    Output Variables:
      Displacement: true
      Top_Reaction_Force: true
"#;

#[test]
fn an_imported_tensile_test_has_youngs_modulus() {
    let folder = Folder::new("import");
    let (mut points, mut ends) = (String::new(), String::new());
    for index in 0..4 * 16 * 4_u32 {
        let (x, y, z) = (index % 4, index / 4 % 16, index / 64);
        let block = match y {
            0..2 => 1,
            2..14 => 2,
            _ => 3,
        };
        points += &format!("{x} {y} {z} {block} 1.0\n");
        if block != 2 {
            ends += &format!("{}\n", index + 1);
        }
    }
    folder.write("bar.txt", &points);
    folder.write("ends.txt", &ends);
    let deck = folder.write("tensile.yaml", TENSILE_TEST);
    let import = |arguments: &[&str]| finish(fissure(1).arg("import").arg(&deck).args(arguments));

    let output = import(&[]);
    let printed = text(&output);
    assert!(output.status.success(), "{printed}");
    for line in [
        "taken         Peridigm > Compute Class Parameters > Top -> [history] field.top_reaction_force_x",
        "22 keys taken, 2 approximated, 0 left out",
    ] {
        assert!(printed.contains(line), "{printed}");
    }
    // The list is printed to standard output, so that it can be piped.
    let listed = String::from_utf8_lossy(&output.stdout);
    assert!(listed.contains("what became of the keys"), "{listed}");
    let new = folder.join("tensile.toml");
    let output = import(&[]);
    assert_eq!(output.status.code(), Some(2));
    assert!(
        text(&output).contains("tensile.toml exists already"),
        "{}",
        text(&output)
    );
    assert!(import(&["--overwrite", "--quiet"]).status.success());
    let before = std::fs::read(&deck).unwrap();
    let output = finish(
        fissure(1)
            .args(["import", "--overwrite", "-o"])
            .arg(&deck)
            .arg(&deck),
    );
    assert_eq!(output.status.code(), Some(2));
    assert!(
        text(&output).contains("is the deck to import"),
        "{}",
        text(&output)
    );
    assert_eq!(std::fs::read(&deck).unwrap(), before);
    let output = import(&["--from", "perilab", "--overwrite"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(text(&output).contains("tensile.yaml:"), "{}", text(&output));

    succeed(fissure(1).arg("check").arg(&new).arg("--quiet"));
    let out = folder.join("out");
    succeed(
        fissure(1)
            .arg("run")
            .arg(&new)
            .arg("-o")
            .arg(&out)
            .arg("--quiet"),
    );
    let history = std::fs::read_to_string(out.join("history.csv")).unwrap();
    let value = |name: &str| -> f64 {
        let mut names = history.lines().next().unwrap().split(',');
        let column = names.position(|column| column.starts_with(name)).unwrap();
        history
            .lines()
            .last()
            .unwrap()
            .split(',')
            .nth(column)
            .unwrap()
            .parse()
            .unwrap()
    };
    let gage = |name: &str| value(&format!("probe_{name}_gage_displacement_y"));
    // Supports balance the internal forces of points at rest.
    let [reaction, force] =
        ["reaction_block_3_y", "field_top_reaction_force_y_integral"].map(value);
    assert!(
        (force / reaction + 1.0).abs() < 1e-9,
        "{force:e} {reaction:e}"
    );
    let strain = (gage("upper") - gage("lower")) / 7.0;
    // At a strain of 0.1 %, terms of second order in the strain are visible.
    let modulus = value("reaction_block_3_y") / 16.0 / strain;
    let expected = 9.0 * 1.5e12 * 6.923e11 / (3.0 * 1.5e12 + 6.923e11);
    assert!(
        (modulus / expected - 1.0).abs() < 3e-3,
        "{modulus:e} {expected:e}"
    );
}

/// Write the deck of `fissure init` into a folder, and return its path.
fn example(folder: &Folder) -> std::path::PathBuf {
    let deck = folder.join("plate.toml");
    succeed(fissure(1).arg("init").arg(&deck));
    deck
}

const OVERLAY: &str = "\
title = 'Slow'  # other than the deck's
[parameters]
tension = 5e6
dx = 4e-3
[material.glass.ordinary]
density = 2440
youngs_modulus = 72e9
poisson_ratio = 0.2
[time]
end = 5e-6
[history.probe.behind]
at = [0.02, 'dx/2']
";

#[test]
fn an_overlay_goes_over_the_deck() {
    let folder = Folder::new("overlay");
    let deck = example(&folder);
    let overlay = folder.write("slow.toml", OVERLAY);
    let later = folder.write(
        "later.toml",
        "parameters.tension = 6e6\noutput.every = 2e-6\n",
    );
    let explain = |options: &[&str]| {
        let mut command = fissure(1);
        command.arg("explain").arg(&deck).args(options);
        succeed(command.current_dir(&folder.0))
    };
    let explained = explain(&["--with", "slow.toml"]);
    for line in [
        "title = \"Slow\"",
        "tension = 5000000.0",
        "length = 0.1",
        "[material.glass.ordinary]",
        "end = 0.000005",
        "[history.probe.ahead]",
        "[history.probe.behind]",
    ] {
        assert!(explained.contains(line), "{line}: {explained}");
    }
    assert!(!explained.contains("pmb"), "{explained}");
    // Later overlays override earlier overlays; --set overrides all.
    let explained = explain(&[
        "--with",
        "slow.toml",
        "--with",
        "later.toml",
        "--set",
        "time.end=4e-6",
        "--set",
        "dx=5e-3",
    ]);
    for line in [
        "tension = 6000000.0",
        "every = 0.000002",
        "end = 0.000004",
        "dx = 0.005",
    ] {
        assert!(explained.contains(line), "{line}: {explained}");
    }

    // The result contains the merged deck, and this deck alone gives the same run.
    let out = folder.join("out");
    let run = |deck: &std::path::Path, out: &std::path::Path, options: &[&str]| {
        let mut command = fissure(1);
        command.arg("run").arg(deck).arg("--output").arg(out);
        finish(command.args(options).current_dir(&folder.0))
    };
    let output = run(&deck, &out, &["--with", "slow.toml"]);
    assert!(output.status.success(), "{}", text(&output));
    let result = out.join("result.vtkhdf");
    let attributes = ResultReader::open(&result).unwrap().attributes().unwrap();
    let merged = attributes.iter().find(|(name, _)| name == "deck");
    let merged = folder.write("merged.toml", &merged.unwrap().1);
    let alone = folder.join("alone");
    let output = run(&merged, &alone, &[]);
    assert!(output.status.success(), "{}", text(&output));
    let same = fissure(1)
        .arg("compare")
        .args([&out, &alone])
        .output()
        .unwrap();
    assert!(same.status.success(), "{}", text(&same));

    // A restart needs the overlay as well.
    let further = ["--restart", "--set", "time.end=6e-6"];
    let output = run(&deck, &out, &further);
    assert_eq!(output.status.code(), Some(2), "{}", text(&output));
    assert!(
        text(&output).contains("differs in its physics"),
        "{}",
        text(&output)
    );
    let output = run(
        &deck,
        &out,
        &[&further[..], &["--with", "slow.toml"]].concat(),
    );
    assert!(output.status.success(), "{}", text(&output));
    let printed = succeed(
        fissure(1)
            .arg("check")
            .arg(&deck)
            .arg("--with")
            .arg(&overlay),
    );
    assert!(printed.contains("Slow"), "{printed}");
    let mut sweep = fissure(1);
    sweep.arg("sweep").arg(&deck).arg("--with").arg(&later);
    sweep.args([
        "--set",
        "dx=5e-3,4e-3",
        "--set",
        "time.end=2e-6",
        "--output",
    ]);
    succeed(sweep.arg(folder.join("sweep")));
    let log = std::fs::read_to_string(folder.join("sweep/dx=4e-3/history.csv"));
    assert!(log.is_ok(), "{log:?}");
}

#[test]
fn errors_in_an_overlay_name_its_line() {
    let folder = Folder::new("wrong-overlay");
    let deck = example(&folder);
    let check = |deck: &std::path::Path, overlay: &str, set: &[&str]| {
        folder.write("over.toml", overlay);
        let mut command = fissure(1);
        command.arg("check").arg(deck).args(["--with", "over.toml"]);
        for set in set {
            command.args(["--set", set]);
        }
        let output = finish(command.current_dir(&folder.0));
        assert_eq!(
            output.status.code(),
            Some(2),
            "{overlay}: {}",
            text(&output)
        );
        text(&output)
    };
    for (overlay, message) in [
        (
            "[time]\nsafty = 1",
            "over.toml:2:1: [time]: unknown key `safty`; did you mean `safety`?",
        ),
        (
            "# A comment.\n[grid]\n\nhorizon = '3*dxx'",
            "over.toml:4:14: [grid] horizon: unknown name `dxx`",
        ),
        (
            "grid = { spacing = -1 }",
            "over.toml:1:20: [grid] spacing: must be above 0, is -1",
        ),
        ("\n[time]\nend = []", "over.toml:3:7: [time] end: must be "),
        ("\ntime = 5", "over.toml:2:8: [time]: must be a table, is 5"),
        (
            "[history.front.wave]\nfrom = [0, 0]",
            "over.toml:1:1: [history.front.wave]: needs `direction`",
        ),
        (
            "[set]\ntop.where = 'x > 9*dz'",
            "over.toml:2:20: [set.top] where: unknown name `dz`",
        ),
        (
            "[time]\nend = 1\nend = 2",
            "over.toml:3:1: `end` is given twice",
        ),
        ("[time\nend = 1", "over.toml:1:"),
    ] {
        let printed = check(&deck, overlay, &[]);
        assert!(
            printed.contains(&format!("error: {message}")),
            "{message}: {printed}"
        );
        assert!(!printed.contains("note: "), "{printed}");
    }
    // Errors in the deck name lines of the deck, even if an overlay adds lines before them.
    let whole = std::fs::read_to_string(&deck).unwrap();
    let wrong = whole.replace("at = [0.06, \"dx/2\"]", "at = [0.06, \"dy/2\"]");
    assert_ne!(whole, wrong);
    let line = wrong
        .lines()
        .position(|line| line.contains("dy/2"))
        .unwrap()
        + 1;
    folder.write("wrong.toml", &wrong);
    let overlay = "thickness = 1\ncondition.new = { set = 'top', force = [1, 0] }\n[time]\nend = 1e-6\nsafety = 0.5\n";
    let printed = check("wrong.toml".as_ref(), overlay, &["time.safety=0.4"]);
    assert!(
        printed.contains(&format!(
            "error: wrong.toml:{line}:14: [history.probe.ahead] at: "
        )),
        "{printed}"
    );
    assert!(!printed.contains("note: "), "{printed}");
    // A value of --set is in no file.
    let printed = check(&deck, overlay, &["time.safety=4"]);
    let note = "note: lines are those of the deck as changed by --with and --set";
    assert!(
        printed.contains("[time] safety: ") && printed.contains(note),
        "{printed}"
    );
    let printed = finish(
        fissure(1)
            .arg("check")
            .arg(&deck)
            .args(["--with", "none.toml"]),
    );
    assert_eq!(printed.status.code(), Some(2));
    assert!(
        text(&printed).contains("cannot read the deck none.toml"),
        "{}",
        text(&printed)
    );
}

#[test]
fn check_reports_properties_of_laws_as_numbers_and_damage_of_pairs() {
    let folder = Folder::new("check-laws");
    let deck = folder.write(
        "deck.toml",
        "dimension = 'plane-strain'
        grid = { spacing = 1, horizon = 3 }
        material.glass.pmb = { density = 2, youngs_modulus = 5 }
        material.concrete.softening_pmb = { density = 2, youngs_modulus = 5, tensile_strength = 0.05, fracture_energy = 0.1 }
        damage.brittle.critical_stretch = { critical_stretch = 0.1, alpha = 0.25 }
        damage.glue.critical_stretch = { critical_stretch = 0.05 }
        body.left = { material = 'glass', shape.box = { lower = [0, 0], upper = [8, 8] } }
        body.middle = { material = 'glass', damage = 'brittle', shape.box = { lower = [8, 0], upper = [16, 8] } }
        body.right = { material = 'concrete', shape.box = { lower = [16, 0], upper = [24, 8] } }
        body.far = { material = 'glass', shape.box = { lower = [40, 0], upper = [44, 8] } }
        interface.pair.glue = { bodies = ['left', 'middle'], damage = 'glue' }
        time.end = 1
        ",
    );
    let json = succeed(fissure(1).arg("check").arg(&deck).arg("--json"));
    let report: serde_json::Value = serde_json::from_str(&json).unwrap();
    let body = |k: usize| &report["bodies"][k];
    let horizon = 3.0_f64;
    let micromodulus = 48.0 * 5.0 / (5.0 * std::f64::consts::PI * horizon.powi(3));
    let found = body(0)["law"]["micromodulus"].as_f64().unwrap();
    assert!((found / micromodulus - 1.0).abs() < 1e-9, "{json}");
    let damage = [0, 1, 2, 3].map(|k| body(k)["has_damage"].as_bool().unwrap());
    assert_eq!(damage, [true, true, true, false], "{json}");
    assert!(
        body(2)["law"]["strength_stretch"].as_f64().unwrap() > 0.0,
        "{json}"
    );
    let printed = succeed(fissure(1).arg("check").arg(&deck));
    let alphas = printed
        .lines()
        .filter(|line| line.trim_start().starts_with("alpha "));
    let alphas: Vec<&str> = alphas
        .filter_map(|line| line.split_whitespace().last())
        .collect();
    assert_eq!(alphas, ["0.25"], "{printed}");
}
