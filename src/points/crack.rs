//! Which bonds cross a pre-crack.

use nalgebra::Vector3;

use crate::deck::plan::Crack;

type Vector = Vector3<f64>;

/// Slack at the rim of a crack, as a share of its size, so that a bond through the rim does not
/// depend on rounding: it counts as cut.
const RIM: f64 = 1e-9;

/// Whether the bond between two positions (m) crosses the crack. A point that lies in the crack's
/// plane counts to its positive side. Both ends must ask in the same order (lower id first), so that
/// they come to the same answer to the bit.
pub fn crosses(crack: &Crack, from: [f64; 3], to: [f64; 3]) -> bool {
    let bond = [from, to].map(Vector::from);
    let inside = -RIM..=1.0 + RIM;
    match crack {
        Crack::Segment { from, to } => {
            let start = Vector::from(*from);
            let edge = Vector::from(*to) - start;
            let normal = Vector::new(-edge.y, edge.x, 0.0);
            piercing(start, normal, bond).is_some_and(|hit| {
                let along = (hit - start).dot(&edge) / edge.dot(&edge);
                inside.contains(&along)
            })
        }
        Crack::Rectangle {
            corner,
            edge_a,
            edge_b,
        } => {
            let [corner, a, b] = [*corner, *edge_a, *edge_b].map(Vector::from);
            piercing(corner, a.cross(&b), bond).is_some_and(|hit| {
                let offset = hit - corner;
                let (aa, ab, bb) = (a.dot(&a), a.dot(&b), b.dot(&b));
                let (oa, ob) = (offset.dot(&a), offset.dot(&b));
                let determinant = aa * bb - ab * ab;
                let along_a = (oa * bb - ob * ab) / determinant;
                let along_b = (ob * aa - oa * ab) / determinant;
                inside.contains(&along_a) && inside.contains(&along_b)
            })
        }
        Crack::Disc {
            centre,
            normal,
            radius,
        } => {
            let centre = Vector::from(*centre);
            piercing(centre, Vector::from(*normal), bond).is_some_and(|hit| {
                let offset = hit - centre;
                offset.dot(&offset) <= (radius * (1.0 + RIM)).powi(2)
            })
        }
    }
}

/// Where the segment between two positions goes through a plane, if its ends lie on different sides.
fn piercing(origin: Vector, normal: Vector, [from, to]: [Vector; 2]) -> Option<Vector> {
    let height_from = (from - origin).dot(&normal);
    let height_to = (to - origin).dot(&normal);
    if (height_from >= 0.0) == (height_to >= 0.0) {
        return None;
    }
    let share = height_from / (height_from - height_to);
    Some(from + share * (to - from))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_segment_cuts_what_crosses_it_and_no_more() {
        let notch = Crack::Segment {
            from: [0.0; 3],
            to: [1.0, 0.0, 0.0],
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
        };
        let up = |x: f64, y: f64| ([x, y, -0.5], [x, y, 0.5]);
        let cut = |crack: &Crack, x, y| crosses(crack, up(x, y).0, up(x, y).1);
        assert!(cut(&rectangle, 1.5, 0.5));
        assert!(!cut(&rectangle, 0.2, 0.5));
        let disc = Crack::Disc {
            centre: [0.0; 3],
            normal: [0.0, 0.0, 1.0],
            radius: 1.0,
        };
        assert!(cut(&disc, 0.6, 0.7));
        assert!(!cut(&disc, 0.8, 0.7));
    }
}
