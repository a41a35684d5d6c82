//! Bounding boxes of shapes, and the test whether a shape contains a position.

use nalgebra::Vector3;

use crate::problem::Shape;

/// Return the lower and the upper corner of a box that contains the shape, m; ±∞ in unbounded directions.
pub fn bounds(shape: &Shape) -> ([f64; 3], [f64; 3]) {
    match shape {
        Shape::Box { lower, upper } => (*lower, *upper),
        Shape::Ball { centre, radius } => (centre.map(|c| c - radius), centre.map(|c| c + radius)),
        Shape::Cylinder { from, to, radius } => (
            std::array::from_fn(|k| from[k].min(to[k]) - radius),
            std::array::from_fn(|k| from[k].max(to[k]) + radius),
        ),
        Shape::Prism { base, bottom, top } => {
            let (lower, upper) = base.bounds();
            ([lower[0], lower[1], *bottom], [upper[0], upper[1], *top])
        }
        Shape::Union(parts) => parts.iter().map(bounds).fold(
            ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]),
            |(lower, upper), (low, high)| {
                (
                    std::array::from_fn(|k| lower[k].min(low[k])),
                    std::array::from_fn(|k| upper[k].max(high[k])),
                )
            },
        ),
        Shape::Difference(parts) => bounds(&parts[0]),
    }
}

/// Test whether a position (m) lies within the shape, or at most `tolerance` (m) outside. With a positive
/// tolerance, positions on the boundary count as inside despite round-off. With a negative tolerance,
/// positions on the boundary count as outside.
pub fn contains(shape: &Shape, position: [f64; 3], tolerance: f64) -> bool {
    match shape {
        Shape::Box { lower, upper } => (0..3).all(|k| {
            // In 1-D and 2-D problems, boxes are flat along the other axes. Along such an axis, a negative
            // tolerance would exclude every position.
            let is_flat = lower[k] == upper[k];
            let tolerance = if is_flat { tolerance.abs() } else { tolerance };
            position[k] >= lower[k] - tolerance && position[k] <= upper[k] + tolerance
        }),
        Shape::Ball { centre, radius } => {
            super::distance_squared(*centre, position) <= (radius + tolerance).powi(2)
        }
        Shape::Cylinder { from, to, radius } => {
            let [from, to, position] = [*from, *to, position].map(Vector3::from);
            let (axis, offset) = (to - from, position - from);
            let length = axis.dot(&axis).sqrt();
            let along = offset.dot(&axis) / length;
            let across = offset.dot(&offset) - along * along;
            along >= -tolerance
                && along <= length + tolerance
                && across <= (radius + tolerance).powi(2)
        }
        Shape::Prism { base, bottom, top } => {
            position[2] >= bottom - tolerance
                && position[2] <= top + tolerance
                && base.contains([position[0], position[1]], tolerance)
        }
        Shape::Union(parts) => parts.iter().any(|part| contains(part, position, tolerance)),
        // A subtracted shape does not contain its boundary, so points on this boundary belong to the
        // difference.
        Shape::Difference(parts) => {
            contains(&parts[0], position, tolerance)
                && !parts[1..]
                    .iter()
                    .any(|part| contains(part, position, -tolerance))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::points::Polygon;

    #[test]
    fn the_boundary_belongs_to_a_shape_and_to_a_difference() {
        let square = Shape::Box {
            lower: [0.0; 3],
            upper: [1.0, 1.0, 0.0],
        };
        let hole = Shape::Ball {
            centre: [0.5, 0.5, 0.0],
            radius: 0.25,
        };
        let plate = Shape::Difference(vec![square, hole.clone()]);
        assert!(contains(&plate, [0.0, 0.0, 0.0], 1e-9));
        assert!(contains(&plate, [0.25, 0.5, 0.0], 1e-9));
        assert!(!contains(&plate, [0.26, 0.5, 0.0], 1e-9));
        assert!(contains(&hole, [0.26, 0.5, 0.0], 1e-9));
        assert_eq!(bounds(&plate), ([0.0; 3], [1.0, 1.0, 0.0]));
    }

    #[test]
    fn a_flat_box_can_be_subtracted() {
        let part = |lower, upper, across| Shape::Box {
            lower: [lower, if across { lower } else { 0.0 }, 0.0],
            upper: [upper, if across { upper } else { 0.0 }, 0.0],
        };
        for is_plate in [false, true] {
            let rest = Shape::Difference(vec![part(0.0, 4.0, is_plate), part(1.0, 3.0, is_plate)]);
            let at = |x: f64| [x, if is_plate { 2.0 } else { 0.0 }, 0.0];
            assert!(contains(&rest, at(0.5), 1e-9));
            assert!(
                contains(&rest, at(1.0), 1e-9),
                "on the boundary of the hole"
            );
            assert!(!contains(&rest, at(2.0), 1e-9));
        }
    }

    #[test]
    fn a_polygon_may_be_concave() {
        let l_shape = Shape::Prism {
            base: Polygon::new(vec![
                [0.0, 0.0],
                [2.0, 0.0],
                [2.0, 1.0],
                [1.0, 1.0],
                [1.0, 2.0],
                [0.0, 2.0],
            ]),
            bottom: 0.0,
            top: 1.0,
        };
        assert!(contains(&l_shape, [0.5, 1.5, 0.5], 1e-9));
        assert!(contains(&l_shape, [1.0, 1.5, 0.5], 1e-9), "on an edge");
        assert!(!contains(&l_shape, [1.5, 1.5, 0.5], 1e-9));
        assert!(!contains(&l_shape, [0.5, 0.5, 1.1], 1e-9));
    }

    #[test]
    fn a_cylinder_is_bounded_by_its_ends_and_radius() {
        let cylinder = Shape::Cylinder {
            from: [0.0; 3],
            to: [0.0, 0.0, 2.0],
            radius: 1.0,
        };
        assert!(contains(&cylinder, [0.6, 0.8, 2.0], 1e-9));
        assert!(!contains(&cylinder, [0.6, 0.8, 2.1], 1e-9));
        assert!(!contains(&cylinder, [0.7, 0.8, 1.0], 1e-9));
    }
}
