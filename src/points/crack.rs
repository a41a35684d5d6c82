//! Which bonds cross a pre-crack.

use crate::deck::plan::Crack;

/// Slack at the rim of a crack, as a share of its size, so that a bond through the rim does not
/// depend on rounding: it counts as cut.
const RIM: f64 = 1e-9;

/// Whether the bond between two positions (m) crosses the crack. A point that lies in the crack's
/// plane counts to its positive side. Both ends must ask in the same order (lower id first), so that
/// they come to the same answer to the bit.
pub fn crosses(crack: &Crack, from: [f64; 3], to: [f64; 3]) -> bool {
    match crack {
        Crack::Segment { from: a, to: b } => {
            let edge = difference(*b, *a);
            let normal = [-edge[1], edge[0], 0.0];
            piercing(*a, normal, from, to).is_some_and(|hit| {
                let along = dot(difference(hit, *a), edge) / dot(edge, edge);
                (-RIM..=1.0 + RIM).contains(&along)
            })
        }
        Crack::Rectangle {
            corner,
            edge_a,
            edge_b,
        } => piercing(*corner, cross(*edge_a, *edge_b), from, to).is_some_and(|hit| {
            let offset = difference(hit, *corner);
            let (aa, ab, bb) = (
                dot(*edge_a, *edge_a),
                dot(*edge_a, *edge_b),
                dot(*edge_b, *edge_b),
            );
            let (oa, ob) = (dot(offset, *edge_a), dot(offset, *edge_b));
            let determinant = aa * bb - ab * ab;
            let along_a = (oa * bb - ob * ab) / determinant;
            let along_b = (ob * aa - oa * ab) / determinant;
            let inside = -RIM..=1.0 + RIM;
            inside.contains(&along_a) && inside.contains(&along_b)
        }),
        Crack::Disc {
            centre,
            normal,
            radius,
        } => piercing(*centre, *normal, from, to).is_some_and(|hit| {
            let offset = difference(hit, *centre);
            dot(offset, offset) <= (radius * (1.0 + RIM)).powi(2)
        }),
    }
}

/// Where the segment between two positions goes through a plane, if its ends lie on different sides.
fn piercing(origin: [f64; 3], normal: [f64; 3], from: [f64; 3], to: [f64; 3]) -> Option<[f64; 3]> {
    let height_from = dot(difference(from, origin), normal);
    let height_to = dot(difference(to, origin), normal);
    if (height_from >= 0.0) == (height_to >= 0.0) {
        return None;
    }
    let share = height_from / (height_from - height_to);
    Some(std::array::from_fn(|k| from[k] + share * (to[k] - from[k])))
}

fn difference(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|k| a[k] - b[k])
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
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
