//! Rotation of the axes of anisotropic materials.

use std::f64::consts::PI;

use nalgebra::{Matrix3, Rotation3, Vector3};

use super::materials::Model;
use crate::error::Result;
use crate::import::translation::Translation;
use crate::import::tree::Node;

/// Keys of a block: angles about x, y and z, degrees.
const KEYS: [&str; 3] = ["Angle X", "Angle Y", "Angle Z"];

/// Read the angles of a block. Return `angle_1`, `angle_2` and `angle_3` of the new deck, degrees; 0 for
/// isotropic materials.
///
/// PeriLab rotates a block only if the block has `Angle X`. In plane problems, this is the angle about z, and
/// the other angles are not read. In 3-D, the rotation is R = R_x R_y R_z. The solvers with a stiffness
/// matrix rotate the axes of the material by R. The other solvers rotate the strain by R, compute the stress,
/// and rotate it back, so the axes are rotated by the inverse of R.
///
/// # Errors
/// If an angle is not a number.
pub(super) fn angles(
    translation: &Translation,
    block: &Node,
    model: &Model,
    has_matrix: bool,
) -> Result<[f64; 3]> {
    let log = &translation.log;
    let in_plane = translation.dimension == 2;
    let has_first = block.get(KEYS[0]).is_some();
    let mut read = [0.0; 3];
    let mut nodes = Vec::new();
    for (key, angle) in KEYS.into_iter().zip(&mut read) {
        let Some(node) = block.get(key) else {
            continue;
        };
        let value = translation.number(node, key)?;
        if !model.has_axes() {
            log.taken(node, "an isotropic material has no axes");
        } else if in_plane && key != KEYS[0] {
            log.left_out(node, "in plane problems, PeriLab reads `Angle X` only");
        } else if !has_first {
            log.left_out(node, "PeriLab reads it only together with `Angle X`");
        } else if value == 0.0 {
            log.taken(node, "the axes are not turned");
        } else {
            *angle = value;
            nodes.push(node);
        }
    }
    let [x, y, z] = read.map(f64::to_radians);
    let about = |axis, angle| Rotation3::from_axis_angle(&axis, angle);
    let rotation = if in_plane {
        about(Vector3::z_axis(), x)
    } else {
        about(Vector3::x_axis(), x) * about(Vector3::y_axis(), y) * about(Vector3::z_axis(), z)
    };
    let (rotation, note) = if has_matrix {
        (rotation, "the rotation of this solver of PeriLab")
    } else {
        let note = "PeriLab rotates the axes by the inverse rotation";
        (rotation.inverse(), note)
    };
    for node in &nodes {
        log.approximated(
            node,
            format!("angle_1, angle_2 and angle_3 of the material: {note}"),
        );
    }
    Ok(if nodes.is_empty() {
        [0.0; 3]
    } else {
        bunge(rotation.matrix())
    })
}

/// Return Bunge's angles of a rotation, degrees: about z, then x, then z.
fn bunge(rotation: &Matrix3<f64>) -> [f64; 3] {
    let at = |row: usize, column: usize| rotation[(row, column)];
    let second = libm::acos(at(2, 2).clamp(-1.0, 1.0));
    let [first, second, third] = if libm::sin(second).abs() < 1e-12 {
        // The first and the third angle are about the same axis.
        let second = if at(2, 2) > 0.0 { 0.0 } else { PI };
        [libm::atan2(at(1, 0), at(0, 0)), second, 0.0]
    } else {
        let first = libm::atan2(at(0, 2), -at(1, 2));
        [first, second, libm::atan2(at(2, 0), at(2, 1))]
    };
    [first, second, third].map(|angle| angle.to_degrees())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angles_of_bunge_give_the_rotation() {
        let about = |axis, angle: f64| Rotation3::from_axis_angle(&axis, angle.to_radians());
        let (x, y, z) = (Vector3::x_axis(), Vector3::y_axis(), Vector3::z_axis());
        for rotation in [
            about(z, 30.0),
            about(x, -20.0),
            about(y, 90.0),
            about(x, 180.0) * about(z, 40.0),
            about(x, 10.0) * about(y, -50.0) * about(z, 130.0),
        ] {
            let [first, second, third] = bunge(rotation.matrix());
            let found = about(z, first) * about(x, second) * about(z, third);
            let difference = (found.matrix() - rotation.matrix()).norm();
            assert!(difference < 1e-12, "{rotation} {difference}");
        }
    }
}
