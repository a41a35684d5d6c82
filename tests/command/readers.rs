//! Results in other programs: the reader of VTK and h5py return the same values.

use std::process::Command;

use crate::support::command::{Folder, finish, fissure, skip, succeed, text};
use fissure::output::ResultReader;

#[test]
fn vtk_and_h5py_agree() {
    let Ok(python) = std::env::var("FISSURE_PYTHON") else {
        skip("FISSURE_PYTHON does not name a Python with vtk, h5py and numpy");
        return;
    };
    let folder = Folder::new("readers");
    let growing = "refinement = { levels = 1, trigger = { where = 'x < 2 + t', every_steps = 4 } }";
    let decks = [
        ("1d", "[0]", "[40]", "['0.01*x']", ""),
        (
            "plane-stress",
            "[0, 0]",
            "[20, 9]",
            "['0.01*x', '-0.01*y']",
            "",
        ),
        (
            "plane-strain",
            "[0, 0]",
            "[20, 9]",
            "['0.01*x', '-0.01*y']",
            growing,
        ),
        (
            "3d",
            "[0, 0, 0]",
            "[9, 8, 7]",
            "['0.01*x', 0, '0.02*sin(z)']",
            "",
        ),
    ];
    for (dimension, lower, upper, displacement, more) in decks {
        let deck = folder.write(
            "deck.toml",
            &format!(
                "dimension = '{dimension}'
                grid = {{ volume_correction = 'none', spacing = 1, horizon = 3 }}
                material.rubber.pmb = {{ density = 2, youngs_modulus = 5 }}
                body.block = {{ material = 'rubber', shape.box = {{ lower = {lower}, upper = {upper} }} }}
                initial.pull.displacement = {displacement}
                output.every_steps = 3
                output.fields = ['displacement', 'velocity', 'damage', 'neighbours']
                time.end = 6
                {more}
                "
            ),
        );
        for ranks in [1, 3] {
            let out = folder.join(format!("{dimension}-{ranks}"));
            let mut command = fissure(ranks);
            succeed(command.arg("run").arg(&deck).arg("--output").arg(&out));
            let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/scripts/check_result.py");
            let mut check = Command::new(&python);
            let output = finish(check.arg(script).arg(out.join("result.vtkhdf")));
            assert!(output.status.success(), "{}", text(&output));
        }
    }
}

#[test]
fn a_result_of_some_points_in_single_precision() {
    let folder = Folder::new("subset");
    let deck = |output: &str| {
        format!(
            "dimension = 'plane-stress'
            grid = {{ spacing = 1, horizon = 3 }}
            material.rubber.pmb = {{ density = 2, youngs_modulus = 5 }}
            body.plate = {{ material = 'rubber', shape.box = {{ lower = [0, 0], upper = [12, 9] }} }}
            set.strip.where = 'x > 3 && x < 7.2'
            initial.swing.displacement = ['0.001*x*y', 0]
            time = {{ end = 4, step = 0.1 }}
            output = {{ every_steps = 10, fields = ['velocity', 'stress']{output} }}
            "
        )
    };
    let run = |name: &str, text: &str, ranks: usize, more: &[&str]| {
        let deck = folder.write("deck.toml", text);
        let out = folder.join(name);
        let mut command = fissure(ranks);
        command
            .arg("run")
            .arg(&deck)
            .arg("--output")
            .arg(&out)
            .args(more);
        succeed(&mut command);
        out.join("result.vtkhdf")
    };
    let whole = ResultReader::open(&run("whole", &deck(""), 1, &[])).unwrap();
    let small = deck(", precision = 'single', set = 'strip'");
    for ranks in [1, 3] {
        let name = format!("small{ranks}");
        let shorter = small.replace("end = 4", "end = 2");
        run(&name, &shorter, ranks, &[]);
        let path = run(&name, &small, 4 - ranks, &["--restart"]);
        let reader = ResultReader::open(&path).unwrap();
        let ids = reader.ids(0).unwrap();
        let expected = whole.ids(0).unwrap();
        let positions = whole.positions(0).unwrap();
        let is_in = |id: &u64| (3.0..7.2).contains(&positions[*id as usize][0]);
        let expected: Vec<u64> = expected.into_iter().filter(is_in).collect();
        assert_eq!(ids, expected);
        assert_eq!(reader.times().unwrap(), whole.times().unwrap());
        for (field, width) in [("velocity", 3), ("stress", 6)] {
            let found = reader.field(field, 4).unwrap();
            let all = whole.field(field, 4).unwrap();
            for (row, id) in ids.iter().enumerate() {
                for k in 0..width {
                    let expected = f64::from(all[*id as usize * width + k] as f32);
                    assert_eq!(found[row * width + k], expected, "{field} of {id}");
                }
            }
        }
        let side_car = std::fs::read_to_string(path.with_extension("xdmf")).unwrap();
        assert!(side_car.contains(r#"NumberType="Float" Precision="4""#));
        assert_eq!(side_car.matches("<Time").count(), 5);
    }
    // Other points or another precision are not appended to an existing file.
    for (other, told) in [("", "points"), (", set = 'strip'", "another precision")] {
        let deck = folder.write("deck.toml", &deck(other).replace("end = 4", "end = 5"));
        let mut command = fissure(1);
        command
            .arg("run")
            .arg(&deck)
            .arg("--output")
            .arg(folder.join("small3"))
            .arg("--restart");
        let output = finish(&mut command);
        let printed = text(&output);
        assert!(
            printed.contains(told) && printed.contains("starting a new result"),
            "{printed}"
        );
        run("small3", &small, 1, &["--overwrite"]);
    }
}
