//! Distances to rigid shapes, and their inertia.

use nalgebra::{Matrix3, Vector3};

use crate::problem::RigidShape;

/// Return the distance (m) of a position from the surface of a shape, negative inside, and the outward unit
/// normal of the surface. The position is relative to the centre of the shape, in the axes of the shape.
pub(super) fn distance(
    shape: &RigidShape,
    position: Vector3<f64>,
    dimension: usize,
) -> (f64, Vector3<f64>) {
    match shape {
        RigidShape::Ball { radius } => {
            let length = position.norm();
            (length - radius, direction(position, length))
        }
        RigidShape::Cylinder {
            axis,
            half_length,
            radius,
        } => {
            let axis = Vector3::from(*axis);
            let along = position.dot(&axis);
            let across = position - along * axis;
            let length = across.norm();
            // The distance is computed as for a box, in the plane through the axis of the cylinder and the
            // position.
            let beyond = [along.abs() - half_length, length - radius];
            let normals = [along.signum() * axis, direction(across, length)];
            outside(&beyond, &normals)
        }
        RigidShape::Box { half } => {
            let beyond: [f64; 3] = std::array::from_fn(|d| position[d].abs() - half[d]);
            let normals: [Vector3<f64>; 3] =
                std::array::from_fn(|d| position[d].signum() * Vector3::ith(d, 1.0));
            outside(&beyond[..dimension], &normals[..dimension])
        }
        RigidShape::HalfSpace { normal } => {
            let normal = Vector3::from(*normal);
            (position.dot(&normal), normal)
        }
    }
}

/// Return the results of [`distance`] for a shape with mutually perpendicular faces. `beyond` are the signed
/// distances (m) of the position from these faces, and `normals` are the outward normals of the faces.
fn outside(beyond: &[f64], normals: &[Vector3<f64>]) -> (f64, Vector3<f64>) {
    let faces = beyond.iter().zip(normals);
    let outer: Vector3<f64> = faces
        .clone()
        .filter(|(beyond, _)| **beyond > 0.0)
        .map(|(beyond, normal)| *beyond * normal)
        .sum();
    let length = outer.norm();
    if length > 0.0 {
        return (length, outer / length);
    }
    let nearest = faces.max_by(|a, b| a.0.total_cmp(b.0));
    let (beyond, normal) = nearest.expect("a shape has faces");
    (*beyond, *normal)
}

/// Unit vector along `vector`, whose length is `length`; the x axis if the length is 0.
fn direction(vector: Vector3<f64>, length: f64) -> Vector3<f64> {
    if length > 0.0 {
        vector / length
    } else {
        Vector3::x()
    }
}

/// Inertia tensor of a shape, divided by the mass, m². In 2-D, only the moment about z is used.
pub(super) fn inertia(shape: &RigidShape, dimension: usize) -> Matrix3<f64> {
    match shape {
        RigidShape::Ball { radius } => {
            let share = if dimension == 3 { 0.4 } else { 0.5 };
            Matrix3::from_diagonal_element(share * radius * radius)
        }
        RigidShape::Cylinder {
            axis,
            half_length,
            radius,
        } => {
            let axis = Vector3::from(*axis);
            let along = 0.5 * radius * radius;
            let across = 0.25 * radius * radius + half_length * half_length / 3.0;
            Matrix3::from_diagonal_element(across) + (along - across) * axis * axis.transpose()
        }
        RigidShape::Box { half } => {
            let square = |d: usize| {
                if d < dimension {
                    half[d] * half[d] / 3.0
                } else {
                    0.0
                }
            };
            let moments = Vector3::new(
                square(1) + square(2),
                square(0) + square(2),
                square(0) + square(1),
            );
            // The moment about an axis is 0 if the box has no extent across this axis. Such a moment is
            // replaced by 1, so the tensor is invertible.
            Matrix3::from_diagonal(&moments.map(|moment| if moment > 0.0 { moment } else { 1.0 }))
        }
        RigidShape::HalfSpace { .. } => Matrix3::identity(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_and_normals_are_those_of_the_nearest_point() {
        let axis = [0.0, 0.6, 0.8];
        let shapes = [
            RigidShape::Ball { radius: 0.7 },
            RigidShape::Cylinder {
                axis,
                half_length: 0.9,
                radius: 0.4,
            },
            RigidShape::Box {
                half: [0.3, 0.5, 0.8],
            },
            RigidShape::HalfSpace { normal: axis },
        ];
        for shape in &shapes {
            for k in 0..200 {
                let k = f64::from(k);
                let position = Vector3::new(
                    (0.71 * k) % 3.0 - 1.5,
                    (1.13 * k) % 3.0 - 1.5,
                    (1.79 * k) % 3.0 - 1.5,
                );
                let (apart, normal) = distance(shape, position, 3);
                assert!((normal.norm() - 1.0).abs() < 1e-12);
                // `surface` lies on the surface of the shape, and a move along the normal changes the
                // distance by the length of the move.
                let surface = position - apart * normal;
                assert!(
                    distance(shape, surface, 3).0.abs() < 1e-12,
                    "{shape:?} {position}"
                );
                let nearer = distance(shape, position - 0.1 * apart * normal, 3).0;
                assert!((nearer - 0.9 * apart).abs() < 1e-12, "{shape:?} {position}");
            }
        }
    }

    #[test]
    fn a_flat_cylinder_and_a_flat_box_have_the_inertia_of_a_disc_and_a_rectangle() {
        let cylinder = RigidShape::Cylinder {
            axis: [0.0, 0.0, 1.0],
            half_length: 0.0,
            radius: 2.0,
        };
        let disc = inertia(&RigidShape::Ball { radius: 2.0 }, 2);
        assert!((inertia(&cylinder, 3)[(2, 2)] - disc[(2, 2)]).abs() < 1e-15);
        let flat = RigidShape::Box {
            half: [1.0, 2.0, 0.0],
        };
        assert_eq!(inertia(&flat, 3)[(2, 2)], inertia(&flat, 2)[(2, 2)]);
        assert_eq!(inertia(&flat, 3)[(0, 0)], 4.0 / 3.0);
    }
}
