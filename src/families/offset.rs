//! The offsets from a lattice point to its neighbours.

use crate::points::distance_squared;

/// An offset of a lattice. Every point with a complete family has one bond with this offset as its reference
/// vector.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Offset {
    /// ξ, m.
    pub reference: [f64; 3],
    /// |ξ|, m.
    pub length: f64,
    /// |ξ|², m².
    pub square: f64,
    /// 1/|ξ|, 1/m.
    pub inverse: f64,
    /// 1/|ξ|², 1/m².
    pub inverse_square: f64,
    /// [Weights](crate::material::bond::Weights) of the ends i and j.
    pub weights: [f64; 2],
    /// Number of steps of the offset along x.
    pub(super) x: i32,
    /// Index in the list of line offsets that `offsets` returns. The entry of the list contains the steps of
    /// this offset along y and z.
    pub(super) line: u32,
}

/// Number of steps of length `spacing` (m) within a length `cutoff` (m), limited by the extent of the points
/// (m).
pub(super) fn steps(cutoff: f64, spacing: f64, extent: f64) -> i64 {
    let limit = (extent / spacing).ceil();
    (cutoff / spacing).floor().min(limit) as i64
}

/// Estimate the largest number of neighbours within `cutoff` (m) on a lattice. `spacing` are the edges of the
/// cells (m), and `cells` is the number of cells per direction.
pub fn most_neighbours(spacing: [f64; 3], cutoff: f64, cells: [f64; 3], dimension: usize) -> f64 {
    use std::f64::consts::PI;
    let reach = |k: usize| cutoff / spacing[k];
    let directions = 0..dimension;
    let ball = [2.0, PI, 4.0 / 3.0 * PI][dimension - 1];
    let within = ball * directions.clone().map(reach).product::<f64>();
    let widths = directions.map(|k| (2.0 * reach(k) + 1.0).min(cells[k]));
    within.min(widths.product())
}

/// Return the offsets up to the length `cutoff` (m), sorted by z, y and x. Also return the line offsets: the
/// pairs of steps along y and z that occur in these offsets, without repeats. `extent` is the extent of the
/// points per direction, m.
pub(super) fn offsets(
    spacing: [f64; 3],
    cutoff: f64,
    extent: [f64; 3],
    dimension: usize,
) -> (Vec<Offset>, Vec<[i64; 2]>) {
    let range = |k: usize| {
        if k < dimension {
            let reach = steps(cutoff, spacing[k], extent[k]);
            -reach..=reach
        } else {
            0..=0
        }
    };
    let (mut offsets, mut line_offsets) = (Vec::new(), Vec::new());
    for z in range(2) {
        for y in range(1) {
            let mut used = false;
            for x in range(0) {
                let steps = [x, y, z];
                let reference: [f64; 3] = std::array::from_fn(|k| steps[k] as f64 * spacing[k]);
                let square = distance_squared([0.0; 3], reference);
                let length = square.sqrt();
                if square == 0.0 || length > cutoff {
                    continue;
                }
                used = true;
                offsets.push(Offset {
                    reference,
                    length,
                    square,
                    inverse: 1.0 / length,
                    inverse_square: 1.0 / square,
                    weights: [1.0; 2],
                    x: x as i32,
                    line: line_offsets.len() as u32,
                });
            }
            if used {
                line_offsets.push([y, z]);
            }
        }
    }
    (offsets, line_offsets)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn offsets_of_known_horizons() {
        let count = |cutoff, dimension| offsets([1.0; 3], cutoff, [9.0; 3], dimension).0.len();
        assert_eq!(count(3.015, 3), 122);
        assert_eq!(count(2.52, 3), 80);
        assert_eq!(count(3.0, 2), 28);
        assert_eq!(count(3.0, 1), 6);
    }

    #[test]
    fn both_ends_of_a_bond_have_the_same_length() {
        let (offsets, _) = offsets([0.1, 0.2, 0.1], 0.35, [9.0; 3], 3);
        for offset in &offsets {
            let opposite = offset.reference.map(|x| -x);
            let other = offsets.iter().find(|other| other.reference == opposite);
            assert_eq!(other.unwrap().length, offset.length);
        }
    }

    #[test]
    fn offsets_stay_within_the_extent_of_the_points() {
        let count = |extent, dimension| offsets([0.1; 3], 300.0, extent, dimension).0.len();
        assert_eq!(count([0.2, 0.2, 0.0], 2), 5 * 5 - 1);
        assert_eq!(count([0.2, 0.1, 0.0], 3), 5 * 3 - 1);
        assert_eq!(count([0.0; 3], 1), 0);
        assert_eq!(steps(1e308, 1e-3, 5e-3), 5);
    }

    #[test]
    fn estimated_neighbours_are_near_the_counted_ones() {
        let cells = [30.0, 60.0, 30.0];
        assert_eq!(most_neighbours([1e-3; 3], 3.0, cells, 3), 54_000.0);
        for (cutoff, dimension) in [(9.5, 1), (9.5, 2), (9.5, 3), (3.015, 3)] {
            let counted = offsets([1.0; 3], cutoff, [99.0; 3], dimension).0.len() as f64;
            let found = most_neighbours([1.0; 3], cutoff, [99.0; 3], dimension);
            assert!((found / counted - 1.0).abs() < 0.1, "{found} {counted}");
        }
    }
}
