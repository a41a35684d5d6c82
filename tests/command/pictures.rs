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

/// Return the pixels of a PNG file.
fn pixels(path: &Path) -> Vec<[u8; 3]> {
    let file = BufReader::new(File::open(path).unwrap());
    let mut reader = png::Decoder::new(file).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut bytes).unwrap();
    let pixels = bytes.chunks_exact(3);
    pixels.map(|pixel| pixel.try_into().unwrap()).collect()
}

/// Return the fraction of the pixels of a PNG file with a property.
fn fraction(path: &Path, has: impl Fn([u8; 3]) -> bool) -> f64 {
    let pixels = pixels(path);
    pixels.iter().filter(|pixel| has(**pixel)).count() as f64 / pixels.len() as f64
}

/// Return the fraction of white pixels of a PNG file.
fn white(path: &Path) -> f64 {
    fraction(path, |pixel| pixel == [255; 3])
}

/// Test whether a pixel is dark: a letter, a line or an arrow.
fn is_dark(pixel: [u8; 3]) -> bool {
    pixel.iter().all(|channel| *channel < 60)
}

/// Test whether a pixel is neither white, grey nor ink.
fn is_coloured([red, green, blue]: [u8; 3]) -> bool {
    red.abs_diff(green).max(green.abs_diff(blue)) > 8
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
        (
            ["--deform", "5"],
            "result.vtkhdf has no field `displacement`; add it to `fields`",
        ),
    ] {
        expect(&plot(&options), 2, &[words]);
    }
    expect(&plot(&["--deform", "0"]), 0, &[]);
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

/// A result, and the path of the picture that each drawing of a test overwrites.
struct Drawings {
    result: PathBuf,
    picture: PathBuf,
}

impl Drawings {
    fn new(folder: &Folder, name: &str, deck: &str) -> Self {
        Self {
            result: run(folder, name, deck, &[]),
            picture: folder.join(format!("{name}.png")),
        }
    }

    /// Draw a picture and return its path.
    #[track_caller]
    fn draw(&self, options: &[&str]) -> &Path {
        let output = ["-o", self.picture.to_str().unwrap()];
        let output = command("plot", &[&self.result], &[options, &output].concat());
        expect(&output, 0, &[" at t = "]);
        &self.picture
    }

    /// Assert that both commands reject these options before they write a file.
    #[track_caller]
    fn reject(&self, options: &[&str], words: &str) {
        let _ = std::fs::remove_file(&self.picture);
        for name in ["plot", "movie"] {
            let output = ["-o", self.picture.to_str().unwrap()];
            let output = command(name, &[&self.result], &[options, &output].concat());
            expect(&output, 2, &[words]);
            assert!(!self.picture.exists(), "{options:?}");
        }
    }
}

#[test]
fn several_times_and_results_are_drawn_side_by_side() {
    let folder = Folder::new("panels");
    let [slow, fast, block] =
        [("slow", PLATE), ("fast", PLATE), ("block", BLOCK)].map(|(name, deck)| {
            let pull = if name == "fast" { "pull=3" } else { "pull=1" };
            let options = if name == "block" {
                &[][..]
            } else {
                &["--set", pull][..]
            };
            run(&folder, name, deck, options)
        });
    let panels = |results: &[&Path], options: &[&str]| {
        let path = folder.join("panels.png");
        let mut all = vec![
            "--field",
            "velocity",
            "--width",
            "800",
            "-o",
            path.to_str().unwrap(),
        ];
        all.extend(options);
        command("plot", results, &all)
    };
    let alone = |result: &Path| {
        let path = folder.join("alone.png");
        let options = [
            "--field",
            "velocity",
            "--width",
            "400",
            "-o",
            path.to_str().unwrap(),
        ];
        expect(&command("plot", &[result], &options), 0, &[]);
        png(&path)
    };
    let height = alone(&slow).1;
    expect(
        &panels(&[&slow], &["--time", "0,last"]),
        0,
        &["2 pictures of velocity"],
    );
    assert_eq!(png(&folder.join("panels.png")), (800, height, 0));
    // With a common range, the slow plate has only the darker colours of the map.
    expect(
        &panels(&[&slow, &fast], &[]),
        0,
        &["2 pictures of velocity"],
    );
    let (width, _, _) = png(&folder.join("panels.png"));
    let pixels = pixels(&folder.join("panels.png"));
    let yellow = |[red, green, blue]: [u8; 3]| red > 200 && green > 200 && blue < 100;
    // The left three quarters of a panel contain the plate; the rest is the colour bar.
    let count = |first: u32| {
        let plate = first..first + 300;
        let inside = (0..)
            .zip(&pixels)
            .filter(|(k, _)| plate.contains(&(k % width)));
        inside.filter(|(_, pixel)| yellow(**pixel)).count()
    };
    assert_eq!(count(0), 0);
    assert!(count(400) > 0);
    let beside = slow.join("velocity_panels.png");
    let options = ["--field", "velocity", "--time", "0,last"];
    expect(
        &command("plot", &[&slow], &options),
        0,
        &["velocity_panels.png"],
    );
    assert!(beside.exists());
    for (results, options, words) in [
        (
            vec![&slow, &fast],
            vec!["--time", "all"],
            "--time all: writes a picture of each output of one result",
        ),
        (
            vec![&slow, &fast],
            vec!["--time", "25"],
            "--time 25: the outputs are between",
        ),
        (
            vec![&slow],
            vec!["--time", "0,x"],
            "`all`, or times in s and `last`, is `x`",
        ),
        (
            vec![&slow; 5],
            vec![],
            "--width: must be at least 1000 for 5 pictures side by side",
        ),
        (
            vec![&slow, &block],
            vec![],
            "pictures side by side need results of the same dimension",
        ),
    ] {
        let results: Vec<&Path> = results.into_iter().map(|path| path.as_path()).collect();
        expect(&panels(&results, &options), 2, &[words]);
    }
}

#[test]
fn the_difference_of_two_results_is_drawn() {
    let folder = Folder::new("difference");
    let [slow, fast] = [("slow", "pull=1"), ("fast", "pull=3")]
        .map(|(name, pull)| run(&folder, name, PLATE, &["--set", pull]));
    let other = run(&folder, "other", PLATE, &["--set", "time.end=1e-6"]);
    let coarse = PLATE.replace("spacing = 1e-3", "spacing = 2e-3");
    let coarse = run(
        &folder,
        "coarse",
        &coarse.replace("horizon = 2e-3", "horizon = 4e-3"),
        &[],
    );
    let minus = |subtrahend: &Path, options: &[&str]| {
        let all = [
            "--field",
            "velocity",
            "--minus",
            subtrahend.to_str().unwrap(),
        ];
        command("plot", &[&slow], &[&all[..], options].concat())
    };
    expect(
        &minus(&fast, &["--component", "x"]),
        0,
        &["velocity_x_difference.png: difference of velocity x"],
    );
    // All points are faster in the other result, so all are blue.
    let picture = slow.join("velocity_x_difference.png");
    let is_blue = |[red, _, blue]: [u8; 3]| blue > red.saturating_add(40);
    let is_red = |[red, _, blue]: [u8; 3]| red > blue.saturating_add(40);
    assert!(fraction(&picture, is_blue) > 3.0 * fraction(&picture, is_red));
    // A result minus itself is 0.
    expect(&minus(&slow, &["--component", "y"]), 0, &[]);
    let picture = slow.join("velocity_y_difference.png");
    let is_end = |[red, green, blue]: [u8; 3]| red.abs_diff(blue) > 120 && green < 100;
    assert!(fraction(&picture, is_end) < 0.02);
    // The same holds for damage, whose range starts at 0 in other pictures.
    let block = Drawings::new(&folder, "block", BLOCK);
    let path = block.result.to_str().unwrap();
    for times in [&[][..], &["--time", "0,last"]] {
        let output = ["--minus", path, "-o", block.picture.to_str().unwrap()];
        let output = command("plot", &[&block.result], &[&output[..], times].concat());
        expect(&output, 0, &["difference of damage"]);
        assert!(fraction(&block.picture, is_end) < 0.02, "{times:?}");
    }
    for (subtrahend, options, words) in [
        (&other, &[][..], "has no output at t = 2e-6 s"),
        (&coarse, &[], "has other points at t = 2e-6 s"),
        (&fast, &["--log"], "cannot be used with"),
        (&folder.join("none"), &[], "none"),
    ] {
        expect(&minus(subtrahend, options), 2, &[words]);
    }
}

#[test]
fn colour_maps_and_logarithmic_scales() {
    let folder = Folder::new("colours");
    let plate = Drawings::new(&folder, "plate", PLATE);
    let velocity = ["--field", "velocity"];
    let with = |options: &[&'static str]| [&velocity[..], options].concat();
    assert!(fraction(plate.draw(&velocity), is_coloured) > 0.4);
    let viridis = pixels(&plate.picture);
    assert_eq!(pixels(plate.draw(&with(&["--colors", "viridis"]))), viridis);
    assert_eq!(
        fraction(plate.draw(&with(&["--colors", "grey"])), is_coloured),
        0.0
    );
    let is_red = |[red, green, blue]: [u8; 3]| red > 150 && green < 100 && blue < 100;
    assert_eq!(viridis.iter().filter(|pixel| is_red(**pixel)).count(), 0);
    assert!(fraction(plate.draw(&with(&["--colors", "coolwarm"])), is_red) > 0.01);
    // The stress is 0 or less at many points, which are grey on a logarithmic scale.
    let grey = |pixel| pixel == [140, 142, 146];
    let component = ["--field", "stress", "--component", "xy"];
    let logarithmic = [&component[..], &["--log"]].concat();
    assert!(fraction(plate.draw(&logarithmic), grey) > 0.1);
    assert_eq!(fraction(plate.draw(&component), grey), 0.0);
    let unknown = "--colors jet: there is no such colour map (known: viridis, ";
    plate.reject(&["--colors", "jet"], unknown);
    plate.reject(
        &["--log", "--range", "0,1"],
        "--range: with --log, LOW must be above 0, is 0",
    );
    let block = Drawings::new(&folder, "block", BLOCK);
    block.reject(&["--log"], "--log: no drawn value of damage is above 0");
}

#[test]
fn lines_end_at_the_frame() {
    let folder = Folder::new("lines");
    let plate = Drawings::new(&folder, "plate", PLATE);
    let path = folder.write("path.csv", "x,y\n0.01,0.003\n0.5,0.007\n");
    let without = pixels(plate.draw(&[]));
    let with = pixels(plate.draw(&["--path", path.to_str().unwrap()]));
    assert_ne!(with, without);
    // The frame ends before the last eighth of the columns, which contains the colour bar.
    let (width, _, _) = png(&plate.picture);
    let is_beside = |pixel: usize| pixel as u32 % width >= 7 * width / 8;
    let mut beside = (0..with.len()).filter(|pixel| is_beside(*pixel));
    assert!(beside.all(|pixel| with[pixel] == without[pixel]));
}

#[test]
fn thresholds_and_half_spaces_leave_points_out() {
    let folder = Folder::new("filters");
    let plate = Drawings::new(&folder, "plate", PLATE);
    let velocity = ["--field", "velocity", "--component", "x"];
    let with = |options: &[&'static str]| [&velocity[..], options].concat();
    let start = |options: &[&'static str]| [&with(options)[..], &["--time", "0"]].concat();
    let all = pixels(plate.draw(&start(&[])));
    assert_eq!(pixels(plate.draw(&start(&["--threshold", ":1e9"]))), all);
    // v_x grows with x, so the threshold and the half space leave the same points.
    plate.draw(&start(&["--clip", "x>0.01"]));
    let half = pixels(&plate.picture);
    assert_ne!(half, all);
    let field = ["--threshold", "0.01:", "--threshold-field"];
    let field = [&field[..], &["velocity:x"]].concat();
    assert_eq!(pixels(plate.draw(&start(&field))), half);
    let unit = "their values of velocity x are between ";
    plate.reject(&with(&["--threshold", "1e9:"]), unit);
    plate.reject(
        &with(&["--threshold", "1e9"]),
        "--threshold must be LOW:HIGH",
    );
    plate.reject(&["--threshold-field", "velocity"], "--threshold <LOW:HIGH>");
    plate.reject(
        &["--threshold", "1:", "--threshold-field", "speed"],
        "has no field `speed`",
    );
    plate.reject(
        &["--clip", "z<0"],
        "this result is 2-D and has no coordinate z",
    );
    plate.reject(
        &["--clip", "x<-1", "--deform", "0"],
        "--clip x<-1: no points are drawn there; they are between x = 5.0000e-4 and 1.95",
    );
    let block = Drawings::new(&folder, "block", BLOCK);
    let whole = white(block.draw(&["--camera", "-90,0"]));
    let words = "--slice z=0.0005: no points are drawn there";
    block.reject(
        &["--slice", "z=0.0005", "--clip", "z>0.001", "--deform", "0"],
        words,
    );
    // The two lower layers of three are as wide, but less high.
    let (width, high, _) = png(block.draw(&["--camera", "-90,0"]));
    let low = png(block.draw(&["--camera", "-90,0", "--clip", "z<0.002"]));
    assert!(low.0 == width && low.1 < high && white(&block.picture) > whole);
}

#[test]
fn cameras_look_at_solids_from_any_side() {
    let folder = Folder::new("cameras");
    let block = Drawings::new(&folder, "block", BLOCK);
    let height = |camera| png(block.draw(&["--camera", camera, "--deform", "0"])).1;
    let isometric = pixels(block.draw(&["--deform", "0"]));
    height("-45,35.264389682754654");
    assert_eq!(pixels(&block.picture), isometric);
    // The block has edges of 6, 4 and 3 mm. The widths are equal, so the heights are 4/6, 3/6 and 3/4 of the
    // width.
    let [above, front, side] = ["-90,90", "-90,0", "0,0"].map(height);
    assert!(front < above && above < side, "{front} {above} {side}");
    block.reject(
        &["--camera", "10"],
        "--camera must be AZIMUTH,ELEVATION in degrees",
    );
    block.reject(
        &["--camera", "10,95"],
        "ELEVATION must be from -90 to 90 degrees",
    );
    block.reject(
        &["--camera", "0,0", "--slice", "z=0.001"],
        "cannot be used with",
    );
    let plate = Drawings::new(&folder, "plate", PLATE);
    plate.reject(&["--camera", "0,0"], "--camera is for solids");
}

#[test]
fn contours_and_vectors_are_drawn_over_plane_pictures() {
    let folder = Folder::new("overlays");
    let plate = Drawings::new(&folder, "plate", PLATE);
    let bright = [
        "--field",
        "velocity",
        "--component",
        "x",
        "--colors",
        "turbo",
        "--range",
        "-1,0.05",
    ];
    let with = |options: &[&'static str]| [&bright[..], options].concat();
    let bare = fraction(plate.draw(&bright), is_dark);
    let (width, height, _) = png(&plate.picture);
    let few = fraction(plate.draw(&with(&["--contours", "0.01"])), is_dark);
    let many = fraction(
        plate.draw(&with(&["--contours", "0.006,0.009,0.012,0.015"])),
        is_dark,
    );
    assert!(bare < few && few < many, "{bare} {few} {many}");
    plate.draw(&["--field", "velocity", "--log", "--contours", "5"]);
    let arrows = fraction(plate.draw(&with(&["--vectors", "velocity"])), is_dark);
    assert!(arrows > bare + 1e-3, "{arrows} {bare}");
    // The legend of the arrows is below the picture.
    let legend = png(&plate.picture);
    assert!(legend.0 == width && legend.1 > height);
    plate.reject(
        &["--contours", "0"],
        "a number of lines must be from 1 to 100",
    );
    plate.reject(
        &["--contours", "-1.5,2", "--log"],
        "with --log, values must be above 0, one is -1.5",
    );
    plate.reject(
        &["--vectors", "stress"],
        "--vectors stress: must be a field with 3 components, has 6 (vector fields: ",
    );
    plate.reject(&["--vectors", "speed"], "has no field `speed`");
    let block = Drawings::new(&folder, "block", BLOCK);
    block.reject(
        &["--contours", "5"],
        "--contours is for plane problems, and for slices",
    );
    block.draw(&["--vectors", "displacement"]);
    let slice = [
        "--slice",
        "z=0.0015",
        "--contours",
        "5",
        "--vectors",
        "displacement",
    ];
    block.draw(&slice);
    // A film with all of these options has frames of equal size.
    let film = folder.join("film.png");
    let options = [
        "--field",
        "velocity",
        "--colors",
        "coolwarm",
        "--log",
        "--threshold",
        "1e-6:",
        "--clip",
        "x<0.015",
        "--contours",
        "5",
        "--vectors",
        "velocity",
        "--width",
        "300",
        "-o",
        film.to_str().unwrap(),
    ];
    expect(
        &command("movie", &[&plate.result], &options),
        0,
        &["frames of velocity"],
    );
    assert_eq!(png(&film).2, 5);
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
    // The first argument is a folder, the second the path of a result. Both contain a history.
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

    // A killed run or a full disk may leave an incomplete last row, which is ignored with a warning.
    let pictures = ["", "2", "2,3.1"].map(|last| {
        let cut = folder.write("cut.csv", &format!("time [s],a\n0,1\n1,2\n{last}"));
        let picture = folder.join("cut.svg");
        let options = ["--y", "a", "-o", picture.to_str().unwrap()];
        let output = command("plot", &[&cut], &options);
        expect(&output, 0, &["1 curve"]);
        let warning = "cut.csv:4: the last line is ignored";
        assert_eq!(text(&output).contains(warning), !last.is_empty());
        std::fs::read_to_string(&picture).unwrap()
    });
    assert!(pictures.iter().all(|picture| *picture == pictures[0]));
    let header = folder.write("header.csv", "time [s],a");
    let nothing = folder.write("nothing.csv", "");
    let empty = folder.write("empty.csv", "time [s],a\n0,NaN\n1,inf\n");
    let broken = folder.write("broken.csv", "time [s],a\n0,1\n1\n");
    let part = PLATE.replace(
        "every_steps = 50,",
        "every_steps = 50, part = { every_steps = 50 },",
    );
    let part = run(&folder, "part", &part, &[]).join("result_part.vtkhdf");
    for (result, options, words) in [
        (
            &history,
            &["--y", "kinetic"][..],
            "no column `kinetic`; did you mean `kinetic_energy`?",
        ),
        (&history, &["--y", "step", "--x", "t"], "--x t: "),
        (
            &part,
            &["--y", "step"],
            "result_part.vtkhdf: this result has no history; curves need `result.vtkhdf`",
        ),
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
        (
            &header,
            &["--y", "a"],
            "header.csv:1: the line with the names of the columns is incomplete",
        ),
        (
            &nothing,
            &["--y", "a"],
            "nothing.csv: must have a line with the names of the columns",
        ),
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
