//! The result as other programs see it: VTK's own reader and h5py find the same numbers.

use std::process::Command;

use crate::support::command::{Folder, finish, fissure, succeed, text};

#[test]
fn vtk_and_h5py_agree() {
    let Ok(python) = std::env::var("FISSURE_PYTHON") else {
        eprintln!("skipped: FISSURE_PYTHON does not name a Python with vtk, h5py and numpy");
        return;
    };
    let folder = Folder::new("readers");
    let decks = [
        ("1d", "[0]", "[40]", "['0.01*x']"),
        ("plane-stress", "[0, 0]", "[20, 9]", "['0.01*x', '-0.01*y']"),
        (
            "3d",
            "[0, 0, 0]",
            "[9, 8, 7]",
            "['0.01*x', 0, '0.02*sin(z)']",
        ),
    ];
    for (dimension, lower, upper, displacement) in decks {
        let deck = folder.write(
            "deck.toml",
            &format!(
                "dimension = '{dimension}'
                grid = {{ spacing = 1, horizon = 3 }}
                material.rubber.pmb = {{ density = 2, youngs_modulus = 5 }}
                body.block = {{ material = 'rubber', shape.box = {{ lower = {lower}, upper = {upper} }} }}
                initial.pull.displacement = {displacement}
                output.every_steps = 3
                output.fields = ['displacement', 'velocity', 'damage', 'neighbours']
                time.end = 6
                "
            ),
        );
        for ranks in [1, 3] {
            let out = folder.join(format!("{dimension}-{ranks}"));
            let mut command = fissure(ranks);
            succeed(command.arg("run").arg(&deck).arg("--output").arg(&out));
            let script = concat!(env!("CARGO_MANIFEST_DIR"), "/scripts/check_result.py");
            let mut check = Command::new(&python);
            let output = finish(check.arg(script).arg(out.join("result.vtkhdf")));
            assert!(output.status.success(), "{}", text(&output));
        }
    }
}
