//! Intersection of bonds with pre-cracks.

use std::array;

use nalgebra::Vector3;

use crate::problem::Crack;

type Vector = Vector3<f64>;

/// Relative tolerance at the rim of a crack: a bond through the rim is cut in spite of round-off.
const RIM: f64 = 1e-9;

/// Test whether the bond between two positions (m) crosses the crack.
///
/// - If an end of a bond lies in the plane of a crack without width, this end is treated as if it lay on the
///   side to which the normal points.
/// - A bond crosses a slot if the bond touches the volume between the faces of the slot.
/// - Pass the end with the lower id first, so that both ends of a bond get the same result.
pub fn crosses(crack: &Crack, from: [f64; 3], to: [f64; 3]) -> bool {
    let bond = [from, to].map(Vector::from);
    match crack {
        Crack::Segment { from, to, width } => {
            let start = Vector::from(*from);
            let edge = Vector::from(*to) - start;
            let normal = Vector::new(-edge.y, edge.x, 0.0);
            let along = |x: Vector| (x - start).dot(&edge) / edge.dot(&edge);
            let part = between_faces(start, normal, *width, bond);
            part.and_then(|part| within(part, along, [0.0, 1.0]))
                .is_some()
        }
        Crack::Rectangle {
            corner,
            edge_a,
            edge_b,
            width,
        } => {
            let [corner, a, b] = [*corner, *edge_a, *edge_b].map(Vector::from);
            let (aa, ab, bb) = (a.dot(&a), a.dot(&b), b.dot(&b));
            let determinant = aa * bb - ab * ab;
            let products = |x: Vector| ((x - corner).dot(&a), (x - corner).dot(&b));
            let along_a = |x: Vector| {
                let (oa, ob) = products(x);
                (oa * bb - ob * ab) / determinant
            };
            let along_b = |x: Vector| {
                let (oa, ob) = products(x);
                (ob * aa - oa * ab) / determinant
            };
            let part = between_faces(corner, a.cross(&b), *width, bond);
            part.and_then(|part| within(part, along_a, [0.0, 1.0]))
                .and_then(|part| within(part, along_b, [0.0, 1.0]))
                .is_some()
        }
        Crack::Disc {
            centre,
            normal,
            radius,
            width,
        } => {
            let (centre, normal) = (Vector::from(*centre), Vector::from(*normal));
            between_faces(centre, normal, *width, bond).is_some_and(|part| {
                let [from, to] = part.map(|x| {
                    let offset = x - centre;
                    offset - offset.dot(&normal) * normal
                });
                let nearest = nearest_to_origin(from, to);
                nearest.dot(&nearest) <= (radius * (1.0 + RIM)).powi(2)
            })
        }
    }
}

/// Test with bounding boxes whether a bond can cross the crack. The bond starts at `position` (m) and is at
/// most `length` (m) long. The result may also be true for a bond that does not cross the crack.
pub fn is_in_reach(crack: &Crack, position: [f64; 3], length: f64) -> bool {
    let (corners, width) = match crack {
        Crack::Segment { from, to, width } => ([*from, *to, *from, *to], width),
        Crack::Rectangle {
            corner,
            edge_a,
            edge_b,
            width,
        } => {
            let at = |a: f64, b: f64| array::from_fn(|k| corner[k] + a * edge_a[k] + b * edge_b[k]);
            let corners = [at(0.0, 0.0), at(1.0, 0.0), at(0.0, 1.0), at(1.0, 1.0)];
            (corners, width)
        }
        Crack::Disc {
            centre,
            radius,
            width,
            ..
        } => {
            let [lower, upper] = [-radius, *radius].map(|radius| centre.map(|x| x + radius));
            ([lower, upper, lower, upper], width)
        }
    };
    (0..3).all(|k| {
        let lower = corners.iter().map(|c| c[k]).fold(f64::MAX, f64::min);
        let upper = corners.iter().map(|c| c[k]).fold(f64::MIN, f64::max);
        let slack = length + width + 1e-6 * (length + width + upper - lower);
        (lower - slack..=upper + slack).contains(&position[k])
    })
}

/// Return the part of a bond that lies between the faces of a crack; `None` if there is no such part. The
/// mid-plane of the crack contains `origin`. For a crack without width, both ends of the part are the point
/// where the bond crosses the plane.
fn between_faces(
    origin: Vector,
    normal: Vector,
    width: f64,
    bond: [Vector; 2],
) -> Option<[Vector; 2]> {
    if width == 0.0 {
        return plane_crossing(origin, normal, bond).map(|x| [x, x]);
    }
    let scale = 1.0 / (width * normal.norm());
    let height = |x: Vector| scale * (x - origin).dot(&normal);
    within(bond, height, [-0.5, 0.5])
}

/// Return the part of a segment on which `coordinate` lies in an interval; `None` if there is no such part.
/// `coordinate` is a linear function of the position. The interval extends from low − [`RIM`] to
/// high + [`RIM`]. The difference high − low is 1.
fn within(
    [from, to]: [Vector; 2],
    coordinate: impl Fn(Vector) -> f64,
    [low, high]: [f64; 2],
) -> Option<[Vector; 2]> {
    let [first, last] = [coordinate(from), coordinate(to)];
    let (mut start, mut end) = (0.0_f64, 1.0_f64);
    let above_low = [first - (low - RIM), last - (low - RIM)];
    let below_high = [high + RIM - first, high + RIM - last];
    for [first, last] in [above_low, below_high] {
        if first < 0.0 && last < 0.0 {
            return None;
        }
        if first < 0.0 {
            start = start.max(first / (first - last));
        } else if last < 0.0 {
            end = end.min(first / (first - last));
        }
    }
    let at = |fraction: f64| from + fraction * (to - from);
    (start <= end).then(|| [at(start), at(end)])
}

/// Return the point of a segment nearest to the origin.
fn nearest_to_origin(from: Vector, to: Vector) -> Vector {
    let edge = to - from;
    let square = edge.dot(&edge);
    if square == 0.0 {
        return from;
    }
    from + (-from.dot(&edge) / square).clamp(0.0, 1.0) * edge
}

/// Return the point where a segment crosses a plane; `None` if both ends of the segment lie on the same side.
fn plane_crossing(origin: Vector, normal: Vector, [from, to]: [Vector; 2]) -> Option<Vector> {
    let height_from = (from - origin).dot(&normal);
    let height_to = (to - origin).dot(&normal);
    if (height_from >= 0.0) == (height_to >= 0.0) {
        return None;
    }
    let fraction = height_from / (height_from - height_to);
    Some(from + fraction * (to - from))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::{array, prelude::*};

    #[test]
    fn a_segment_cuts_the_bonds_that_cross_it_only() {
        let notch = Crack::Segment {
            from: [0.0; 3],
            to: [1.0, 0.0, 0.0],
            width: 0.0,
        };
        assert!(crosses(&notch, [0.5, -1.0, 0.0], [0.5, 1.0, 0.0]));
        assert!(
            crosses(&notch, [0.9, -0.1, 0.0], [1.1, 0.1, 0.0]),
            "through its end"
        );
        assert!(!crosses(&notch, [1.1, -0.1, 0.0], [1.1, 0.1, 0.0]));
        assert!(!crosses(&notch, [0.2, 0.1, 0.0], [0.8, 0.1, 0.0]));
        assert!(
            crosses(&notch, [0.5, 0.0, 0.0], [0.5, -1.0, 0.0]),
            "on it: positive side"
        );
        assert!(!crosses(&notch, [0.5, 0.0, 0.0], [0.5, 1.0, 0.0]));
    }

    #[test]
    fn a_rectangle_and_a_disc_end_at_their_rims() {
        let rectangle = Crack::Rectangle {
            corner: [0.0; 3],
            edge_a: [2.0, 0.0, 0.0],
            edge_b: [1.0, 1.0, 0.0],
            width: 0.0,
        };
        let up = |x: f64, y: f64| ([x, y, -0.5], [x, y, 0.5]);
        let cut = |crack: &Crack, x, y| crosses(crack, up(x, y).0, up(x, y).1);
        assert!(cut(&rectangle, 1.5, 0.5));
        assert!(!cut(&rectangle, 0.2, 0.5));
        let disc = Crack::Disc {
            centre: [0.0; 3],
            normal: [0.0, 0.0, 1.0],
            radius: 1.0,
            width: 0.0,
        };
        assert!(cut(&disc, 0.6, 0.7));
        assert!(!cut(&disc, 0.8, 0.7));
    }

    #[test]
    fn a_slot_cuts_every_bond_that_touches_it() {
        // A segment from (1, 1) towards (4, 5), 5 m long and 0.8 m wide.
        let band = Crack::Segment {
            from: [1.0, 1.0, 0.0],
            to: [4.0, 5.0, 0.0],
            width: 0.8,
        };
        let position = |along: f64, beside: f64| {
            let [x, y] = [0.6 * along - 0.8 * beside, 0.8 * along + 0.6 * beside];
            [1.0 + x, 1.0 + y, 0.0]
        };
        let cut = |from: (f64, f64), to: (f64, f64)| {
            let [a, b] = [position(from.0, from.1), position(to.0, to.1)];
            assert_eq!(crosses(&band, a, b), crosses(&band, b, a));
            crosses(&band, a, b)
        };
        assert!(cut((2.0, -1.0), (2.5, 1.0)), "through both faces");
        assert!(cut((2.0, 0.1), (2.5, 0.2)), "within");
        assert!(cut((2.0, 0.1), (2.0, 2.0)), "out of it");
        assert!(cut((-1.0, 0.0), (6.0, 0.1)), "along it");
        assert!(cut((1.0, 1.0), (2.0, 0.4)), "on its face");
        assert!(!cut((1.0, 1.0), (2.0, 0.41)), "beside it");
        assert!(!cut((5.1, -1.0), (5.1, 1.0)), "before its end");
        assert!(cut((5.5, 0.0), (4.5, 0.5)), "through its end and a face");
        assert!(!cut((5.5, 0.0), (4.5, 1.0)), "past its corner");
        assert!(!cut((5.05, 0.0), (6.0, 0.0)), "ahead of its end");
    }

    #[test]
    fn slabs_end_at_their_rims() {
        let rectangle = Crack::Rectangle {
            corner: [0.0; 3],
            edge_a: [2.0, 0.0, 0.0],
            edge_b: [1.0, 1.0, 0.0],
            width: 0.6,
        };
        assert!(crosses(&rectangle, [1.5, 0.5, 0.2], [1.6, 0.5, 0.25]));
        assert!(crosses(&rectangle, [1.5, 0.5, 0.2], [1.6, 0.5, 2.0]));
        assert!(!crosses(&rectangle, [1.5, 0.5, 0.31], [1.6, 0.5, 2.0]));
        // Bonds that pass the slanted edge x = y, inside or outside.
        assert!(crosses(&rectangle, [0.2, 0.5, 0.1], [0.9, 0.5, 0.1]));
        assert!(!crosses(&rectangle, [0.2, 0.5, 0.1], [0.45, 0.5, 0.1]));
        let disc = Crack::Disc {
            centre: [0.0; 3],
            normal: [0.0, 0.0, 1.0],
            radius: 1.0,
            width: 0.6,
        };
        assert!(crosses(&disc, [0.6, 0.7, 0.2], [0.6, 0.7, 0.25]));
        assert!(!crosses(&disc, [0.8, 0.7, 0.2], [0.8, 0.7, 0.25]));
        // A bond with ends outside and its middle inside, and a bond that passes over the rim.
        assert!(crosses(&disc, [-1.2, 0.3, 0.1], [1.2, 0.3, 0.1]));
        assert!(!crosses(&disc, [-1.2, 0.3, 0.31], [1.2, 0.3, 0.31]));
        assert!(!crosses(&disc, [1.5, 0.0, 0.3], [0.9, 0.0, 0.9]));
    }

    proptest! {
        #[test]
        fn bonds_that_cross_come_from_points_in_reach(
            [corner, edge_a, edge_b, from, to] in
                array::uniform5(array::uniform3(-1.0..1.0_f64)),
            width in prop_oneof![Just(0.0), 0.0..0.5_f64],
        ) {
            let flat = |[x, y, _]: [f64; 3]| [x, y, 0.0];
            let normal: [f64; 3] = Vector::from(edge_a).normalize().into();
            let cracks = [
                Crack::Segment { from: flat(corner), to: flat(edge_a), width },
                Crack::Rectangle { corner, edge_a, edge_b, width },
                Crack::Disc { centre: corner, normal, radius: edge_b[0].abs(), width },
            ];
            for crack in &cracks {
                let is_flat = matches!(crack, Crack::Segment { .. });
                let ends = if is_flat { [flat(from), flat(to)] } else { [from, to] };
                let length = (Vector::from(ends[0]) - Vector::from(ends[1])).norm();
                let in_reach = ends.map(|end| is_in_reach(crack, end, length));
                prop_assert!(in_reach == [true; 2] || !crosses(crack, ends[0], ends[1]));
                prop_assert!(!is_in_reach(crack, [9.0, 0.0, 0.0], length.min(4.0)));
            }
        }
    }
}
