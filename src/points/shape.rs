//! Which positions lie within a shape.

use nalgebra::{Vector2, Vector3};

use crate::deck::plan::Shape;

/// A box that holds the shape: its lower and upper corner, m. Unbounded directions give ±∞.
pub fn bounds(shape: &Shape) -> ([f64; 3], [f64; 3]) {
    match shape {
        Shape::Box { lower, upper } => (*lower, *upper),
        Shape::Ball { centre, radius } => (centre.map(|c| c - radius), centre.map(|c| c + radius)),
        Shape::Cylinder { from, to, radius } => (
            std::array::from_fn(|k| from[k].min(to[k]) - radius),
            std::array::from_fn(|k| from[k].max(to[k]) + radius),
        ),
        Shape::Prism {
            vertices,
            bottom,
            top,
        } => {
            let extreme = |k: usize, pick: fn(f64, f64) -> f64| {
                vertices
                    .iter()
                    .map(|vertex| vertex[k])
                    .reduce(pick)
                    .unwrap_or(0.0)
            };
            (
                [extreme(0, f64::min), extreme(1, f64::min), *bottom],
                [extreme(0, f64::max), extreme(1, f64::max), *top],
            )
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

/// Whether a position lies within the shape or less than `tolerance` (m) outside; the tolerance
/// keeps points on the border from depending on rounding.
pub fn contains(shape: &Shape, position: [f64; 3], tolerance: f64) -> bool {
    match shape {
        Shape::Box { lower, upper } => (0..3)
            .all(|k| position[k] >= lower[k] - tolerance && position[k] <= upper[k] + tolerance),
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
        Shape::Prism {
            vertices,
            bottom,
            top,
        } => {
            position[2] >= bottom - tolerance
                && position[2] <= top + tolerance
                && in_polygon(vertices, [position[0], position[1]], tolerance)
        }
        Shape::Union(parts) => parts.iter().any(|part| contains(part, position, tolerance)),
        // What is cut away is cut without its border, so that the rest keeps points on the border.
        Shape::Difference(parts) => {
            contains(&parts[0], position, tolerance)
                && !parts[1..]
                    .iter()
                    .any(|part| contains(part, position, -tolerance))
        }
    }
}

/// Even-odd rule; positions closer to an edge than |tolerance| are in for a positive tolerance and
/// out for a negative one.
fn in_polygon(vertices: &[[f64; 2]], position: [f64; 2], tolerance: f64) -> bool {
    let edges = || {
        let next = vertices.iter().cycle().skip(1);
        vertices.iter().zip(next)
    };
    if edges().any(|(a, b)| distance_to_segment(*a, *b, position) <= tolerance.abs()) {
        return tolerance > 0.0;
    }
    edges()
        .filter(|(a, b)| {
            let spans = (a[1] > position[1]) != (b[1] > position[1]);
            spans && position[0] < a[0] + (position[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0])
        })
        .count()
        % 2
        == 1
}

fn distance_to_segment(a: [f64; 2], b: [f64; 2], p: [f64; 2]) -> f64 {
    let [a, b, p] = [a, b, p].map(Vector2::from);
    let (edge, offset) = (b - a, p - a);
    let along = edge.dot(&offset) / edge.dot(&edge);
    // A repeated corner has no length: its distance is that to the corner.
    let along = if along.is_nan() {
        0.0
    } else {
        along.clamp(0.0, 1.0)
    };
    let across = offset - along * edge;
    libm::hypot(across.x, across.y)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn borders_belong_to_a_shape_and_to_what_remains_of_it() {
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
    fn a_polygon_may_be_concave() {
        let l_shape = Shape::Prism {
            vertices: vec![
                [0.0, 0.0],
                [2.0, 0.0],
                [2.0, 1.0],
                [1.0, 1.0],
                [1.0, 2.0],
                [0.0, 2.0],
            ],
            bottom: 0.0,
            top: 1.0,
        };
        assert!(contains(&l_shape, [0.5, 1.5, 0.5], 1e-9));
        assert!(contains(&l_shape, [1.0, 1.5, 0.5], 1e-9), "on an edge");
        assert!(!contains(&l_shape, [1.5, 1.5, 0.5], 1e-9));
        assert!(!contains(&l_shape, [0.5, 0.5, 1.1], 1e-9));
    }

    #[test]
    fn a_cylinder_ends_at_its_ends() {
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
