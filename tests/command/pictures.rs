//! `fissure plot` and `fissure movie` on small results.

use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};
use std::process::Output;

use crate::support::command::{Folder, finish, fissure, succeed, text};

/// A vibrating plate without damage.
const PLATE: &str = "
dimension = 'plane-stress'
parameters = { pull = 1 }
grid = { spacing = 1e-3, horizon = 2e-3 }
material.glass.pmb = { density = 2440, youngs_modulus = 72e9 }
body.plate = { material = 'glass', shape.box = { lower = [0, 0], upper = [0.02, 0.01] } }
initial.push.velocity = ['pull*x', 'pull*y*x']
time = { end = 2e-6, step = 1e-8 }
output = { every_steps = 50, fields = ['stress', 'velocity'] }
history.every_steps = 20
";

/// A small block.
const BLOCK: &str = "
dimension = '3d'
grid = { spacing = 1e-3, horizon = 2e-3 }
material.glass.pmb = { density = 2440, youngs_modulus = 72e9 }
body.block = { material = 'glass', shape.box = { lower = [0, 0, 0], upper = [0.006, 0.004, 0.003] } }
initial.push.velocity = ['x', 0, 'z']
time = { end = 2e-7, step = 1e-8 }
output = { every_steps = 10 }
";

fn run(folder: &Folder, name: &str, deck: &str, options: &[&str]) -> PathBuf {
    let deck = folder.write(&format!("{name}.toml"), deck);
    let out = folder.join(name);
    let mut command = fissure(1);
    command
        .arg("run")
        .arg(&deck)
        .args(["--quiet", "--threads", "1"]);
    succeed(command.args(options).arg("--output").arg(&out));
    out
}

fn command(name: &str, results: &[&Path], options: &[&str]) -> Output {
    let mut command = fissure(1);
    finish(command.arg(name).args(results).args(options))
}

#[track_caller]
fn expect(output: &Output, code: i32, words: &[&str]) {
    assert_eq!(output.status.code(), Some(code), "{}", text(output));
    for words in words {
        assert!(text(output).contains(words), "{words}: {}", text(output));
    }
}

/// Return the fraction of white pixels of a PNG file.
fn white(path: &Path) -> f64 {
    let file = BufReader::new(File::open(path).unwrap());
    let mut reader = png::Decoder::new(file).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut bytes).unwrap();
    let pixels = bytes.chunks_exact(3);
    let all = pixels.len() as f64;
    pixels.filter(|pixel| *pixel == [255; 3]).count() as f64 / all
}

/// Return width, height and number of frames of a PNG file; 0 frames for a still picture.
fn png(path: &Path) -> (u32, u32, u32) {
    let file = BufReader::new(File::open(path).unwrap());
    let mut reader = png::Decoder::new(file).read_info().unwrap();
    let frames = reader
        .info()
        .animation_control()
        .map_or(0, |control| control.num_frames);
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    let mut last = None;
    for _ in 0..frames.max(1) {
        last = Some(reader.next_frame(&mut bytes).unwrap());
    }
    let last = last.unwrap();
    (last.width, last.height, frames)
}

#[test]
fn components_are_drawn_and_wrong_inputs_say_what_is_there() {
    let folder = Folder::new("pictures");
    let out = run(&folder, "plate", PLATE, &[]);
    let plot = |options: &[&str]| command("plot", &[&out], options);
    // The result has no field `damage`, so the stress is drawn.
    expect(
        &plot(&[]),
        0,
        &["stress.png: stress, von_mises at t = 2.000 µs"],
    );
    let wanted = ["--field", "stress", "--component", "xy", "--time", "6e-7"];
    expect(
        &plot(&wanted),
        0,
        &["stress_xy.png: stress xy at t = 500.0 ns"],
    );
    expect(
        &plot(&["--field", "velocity", "--width", "401"]),
        0,
        &["velocity, magnitude"],
    );
    assert_eq!(png(&out.join("velocity.png")).0, 401);
    // Each point is drawn as its cell, so that the plate has no gaps.
    assert!(white(&out.join("stress.png")) < 0.6);
    for (options, words) in [
        (
            ["--time", "25"],
            "--time 25: the outputs are between 0e0 and 2e-6 s",
        ),
        (["--time", "-1"], "--time -1: the outputs are between 0e0"),
        (["--time", "2.9e-6"], "the nearest one is at --time 2e-6"),
        (
            ["-o", "movie.gif"],
            "-o movie.gif: the file must end in .png; `--y` draws curves",
        ),
        (["-o", "movie"], "the file must end in .png"),
        (["--field", "damage"], "has no field `damage` (known: "),
        (["--component", "von_misses"], "did you mean `von_mises`?"),
        (["--range", "5%,4%"], "LOW must be below HIGH"),
        (["--x", "time"], "--x is for curves"),
    ] {
        expect(&plot(&options), 2, &[words]);
    }
    let block = run(&folder, "block", BLOCK, &[]);
    let plot = |options: &[&str]| command("plot", &[&block], options);
    expect(&plot(&["--deform", "-1"]), 0, &["damage at t = "]);
    expect(&plot(&["--slice", "x=0.0031"]), 0, &["damage at t = "]);
    let outside = "--slice x=1: no points are drawn there; they are between x = 5.0000e-4 and 5.5";
    expect(
        &plot(&["--slice", "x=1", "--deform", "0"]),
        2,
        &[outside, "the nearest ones are at --slice x=5.5"],
    );
}

#[test]
fn curves_of_histories() {
    let folder = Folder::new("curves");
    let one = run(&folder, "one", PLATE, &[]);
    let two = run(&folder, "two", PLATE, &["--set", "pull=2"]);
    let history = one.join("history.csv");
    let energies = folder.join("energies.svg");
    let options = [
        "--y",
        "kinetic_energy,strain_energy",
        "-o",
        energies.to_str().unwrap(),
    ];
    expect(&command("plot", &[&history], &options), 0, &["2 curves"]);
    let svg = std::fs::read_to_string(&energies).unwrap();
    for words in [
        ">time (µs)<",
        ">µJ<",
        ">kinetic_energy<",
        ">strain_energy<",
        ">one<",
    ] {
        assert!(svg.contains(words), "{words}: {svg}");
    }
    let runs = folder.join("runs.svg");
    let options = [
        "--x",
        "strain_energy",
        "--y",
        "momentum_x",
        "-o",
        runs.to_str().unwrap(),
    ];
    // A folder, and the path of a result, which also contains the history.
    let second = two.join("result.vtkhdf");
    expect(
        &command("plot", &[&one, &second], &options),
        0,
        &["2 curves"],
    );
    let svg = std::fs::read_to_string(&runs).unwrap();
    for words in [">one<", ">two<", ">momentum_x (", ">strain_energy ("] {
        assert!(svg.contains(words), "{words}: {svg}");
    }
    expect(
        &command("plot", &[&one], &["--y", "kinetic_energy"]),
        0,
        &["kinetic_energy.png"],
    );
    assert_eq!(png(&one.join("kinetic_energy.png")), (1200, 744, 0));
    let all = "kinetic_energy,strain_energy,momentum_x,momentum_y";
    expect(
        &command("plot", &[&one], &["--y", all]),
        0,
        &["kinetic_energy_strain_energy_momentum_x.png: 4 curves"],
    );

    let empty = folder.write("empty.csv", "time [s],a\n0,NaN\n1,inf\n");
    let broken = folder.write("broken.csv", "time [s],a\n0,1\n1\n");
    for (result, options, words) in [
        (
            &history,
            &["--y", "kinetic"][..],
            "no column `kinetic`; did you mean `kinetic_energy`?",
        ),
        (&history, &["--y", "step", "--x", "t"], "--x t: "),
        (
            &history,
            &[],
            "--y is missing; name the columns to draw with --y COLUMN,COLUMN; ",
        ),
        (
            &history,
            &["--y", "step", "-o", "a.pdf"],
            "must end in .png or .svg",
        ),
        (
            &broken,
            &["--y", "a"],
            "broken.csv:3: has 1 values for 2 columns",
        ),
        (&folder.join("none.csv"), &["--y", "a"], "cannot read"),
        (&empty, &["--y", "a"], "--y a: no finite values to draw"),
        (
            &history,
            &["--y", "step", "--slice", "z=0"],
            "cannot be used with",
        ),
        (
            &history,
            &["--y", "step", "--time", "last"],
            "cannot be used with",
        ),
    ] {
        expect(&command("plot", &[result], options), 2, &[words]);
    }
    expect(
        &command("plot", &[&one, &two], &[]),
        2,
        &["2 results are given"],
    );
}

#[test]
fn films_have_all_outputs_in_frames_of_one_even_size() {
    let folder = Folder::new("films");
    let out = run(&folder, "plate", PLATE, &[]);
    let movie = |options: &[&str]| command("movie", &[&out], options);
    expect(
        &movie(&["--width", "301"]),
        0,
        &["5 frames of stress, von_mises, 10 a second"],
    );
    let (width, height, frames) = png(&out.join("stress_movie.png"));
    assert_eq!((width, height % 2, frames), (302, 0, 5));
    let frames = folder.join("frames");
    let options = [
        "--frames",
        frames.to_str().unwrap(),
        "--every",
        "2",
        "--width",
        "301",
    ];
    expect(&movie(&options), 0, &["wrote 3 frames"]);
    for number in 0..3 {
        let path = frames.join(format!("frame_{number:04}.png"));
        assert_eq!(png(&path), (width, height, 0));
    }
    for (options, words) in [
        (
            &["-o", "film.gif"][..],
            "-o film.gif: the file must end in .png or .apng",
        ),
        (
            &["--frames", frames.to_str().unwrap()],
            "the folder is not empty",
        ),
        (&["--every", "0"], "--every"),
        (&["--field", "speed"], "has no field `speed`"),
    ] {
        expect(&movie(options), 2, &[words]);
    }
}

#[test]
fn scattered_points_are_cells_without_gaps_and_holes_stay_open() {
    let folder = Folder::new("cells");
    let share = |name: &str, old: &str, new: &str| {
        let deck = PLATE.replace("upper = [0.02, 0.01] }", "upper = [0.04, 0.03] }");
        assert!(deck.contains(old));
        let out = run(&folder, name, &deck.replace(old, new), &[]);
        let picture = folder.join(format!("{name}.png"));
        let options = ["--field", "velocity", "--deform", "0", "-o"];
        let path = picture.to_str().unwrap();
        expect(
            &command("plot", &[&out], &[&options[..], &[path]].concat()),
            0,
            &[],
        );
        white(&picture)
    };
    let lattice = share("lattice", "horizon = 2e-3", "horizon = 2e-3");
    let scattered = share(
        "scattered",
        "horizon = 2e-3",
        "horizon = 2e-3, jitter = 0.3",
    );
    assert!((scattered - lattice).abs() < 0.03, "{scattered} {lattice}");
    let hole = "shape.difference = [{ box = { lower = [0, 0], upper = [0.04, 0.03] } }, { disc = { centre = [0.02, 0.015], radius = 0.008 } }]";
    let scattered_grid = "horizon = 2e-3, jitter = 0.3 }\nmaterial";
    let with_hole = {
        let deck = PLATE.replace("shape.box = { lower = [0, 0], upper = [0.02, 0.01] }", hole);
        let deck = deck.replace("horizon = 2e-3 }\nmaterial", scattered_grid);
        let out = run(&folder, "hole", &deck, &[]);
        let picture = folder.join("hole.png");
        let options = [
            "--field",
            "velocity",
            "--deform",
            "0",
            "-o",
            picture.to_str().unwrap(),
        ];
        expect(&command("plot", &[&out], &options), 0, &[]);
        white(&picture)
    };
    // The hole is a sixth of the plate, and the plate takes about half of the picture.
    assert!(with_hole - scattered > 0.05, "{with_hole} {scattered}");
}

/// A stretched plate in equilibrium.
const RESTING: &str = "
dimension = 'plane-stress'
grid = { spacing = 1e-3, horizon = 2e-3 }
material.glass.pmb = { density = 2440, youngs_modulus = 72e9 }
body.plate = { material = 'glass', shape.box = { lower = [0, 0], upper = [0.02, 0.01] } }
set.ends.where = 'x < 2e-3 || x > 18e-3'
condition.pull = { set = 'ends', displacement = ['1e-3*x*t', 0] }
time = { end = 2e-6, method = 'static', static.load_steps = 1 }
output = { every_steps = 1, fields = ['displacement', 'velocity'] }
";

/// Equilibria have no velocity, so the default picture of an equilibrium shows the displacement. The default
/// for moving points is the velocity.
#[test]
fn equilibria_show_their_displacement() {
    let folder = Folder::new("equilibria");
    let moving = PLATE.replace("'stress'", "'displacement'");
    for (name, deck, field) in [
        ("moving", moving.as_str(), "velocity"),
        ("resting", RESTING, "displacement"),
    ] {
        let out = run(&folder, name, deck, &[]);
        let words = format!("{field}.png: {field}, magnitude at t = 2.000 µs");
        expect(&command("plot", &[&out], &[]), 0, &[&words]);
    }
}
