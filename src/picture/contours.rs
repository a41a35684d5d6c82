//! Contour lines of values at points in the plane.

use delaunator::{Point, triangulate};
use rustc_hash::FxHashMap;

/// Maximum ratio of the length of a triangle's edge to the mean cell edge of the two points at its ends.
/// Values are interpolated only in triangles whose edges are within this limit. In a square lattice, this
/// ratio is at most 1.41. Edges longer than the limit lie across holes, notches and open cracks.
const LONGEST_EDGE: f64 = 2.2;

/// A point in the plane with a value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sample {
    /// Position in the plane.
    pub position: [f64; 2],
    /// Edge length of the cell, in the unit of the position.
    pub size: f64,
    /// The value; triangles with a value that is not finite have no lines.
    pub value: f64,
}

/// Return the samples that are not covered. A sample is covered if its distance to a later, uncovered sample
/// is less than half the cell edge of that later sample. Covered samples occur because a slice between two
/// layers of points shows both layers. Later samples are nearer to the plane of the slice.
pub fn uncovered(samples: &[Sample]) -> Vec<Sample> {
    let largest = samples
        .iter()
        .fold(0.0, |size: f64, sample| size.max(sample.size));
    let cell = |position: [f64; 2]| position.map(|x| (x / largest).floor() as i64);
    let mut kept: FxHashMap<[i64; 2], Vec<Sample>> = FxHashMap::default();
    for sample in samples.iter().rev() {
        let [column, row] = cell(sample.position);
        let is_covering = |later: &Sample| {
            let [x, y] = [0, 1].map(|k| later.position[k] - sample.position[k]);
            x.hypot(y) < later.size / 2.0
        };
        let mut neighbours = (0..9).map(|k| [column + k % 3 - 1, row + k / 3 - 1]);
        let is_covered = neighbours.any(|neighbour| {
            let later = kept.get(&neighbour);
            later.is_some_and(|later| later.iter().any(is_covering))
        });
        if !is_covered {
            kept.entry([column, row]).or_default().push(*sample);
        }
    }
    kept.into_values().flatten().collect()
}

/// Return the line segments on which the interpolated value equals one of the levels. Values are interpolated
/// linearly in the triangles of the Delaunay triangulation.
pub fn segments(samples: &[Sample], levels: &[f64]) -> Vec<[[f64; 2]; 2]> {
    let points = samples.iter().map(|sample| {
        let [x, y] = sample.position;
        Point { x, y }
    });
    let triangles = triangulate(&points.collect::<Vec<_>>()).triangles;
    let mut found = Vec::new();
    for triangle in triangles.chunks_exact(3) {
        let corners = [0, 1, 2].map(|k| samples[triangle[k]]);
        let sides = [(0, 1), (1, 2), (2, 0)].map(|(one, other)| [corners[one], corners[other]]);
        let is_long = |[one, other]: &[Sample; 2]| {
            let [x, y] = [0, 1].map(|k| one.position[k] - other.position[k]);
            x.hypot(y) > LONGEST_EDGE * (one.size + other.size) / 2.0
        };
        if sides.iter().any(is_long) || corners.iter().any(|corner| !corner.value.is_finite()) {
            continue;
        }
        for level in levels {
            let mut crossings = sides.iter().filter_map(|side| crossing(side, *level));
            // A line crosses a side if exactly one end of the side is below the level. The line therefore
            // crosses no side or two sides of a triangle.
            if let (Some(from), Some(to)) = (crossings.next(), crossings.next()) {
                found.push([from, to]);
            }
        }
    }
    found
}

/// Return the position at which the interpolated value along a side of a triangle equals the level; `None` if
/// there is no such position.
fn crossing([one, other]: &[Sample; 2], level: f64) -> Option<[f64; 2]> {
    if (one.value < level) == (other.value < level) {
        return None;
    }
    let part = (level - one.value) / (other.value - one.value);
    Some([0, 1].map(|k| one.position[k] + part * (other.position[k] - one.position[k])))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Return samples of a function on a lattice of 41 by 41 points in the unit square.
    fn lattice(value: impl Fn(f64, f64) -> f64) -> Vec<Sample> {
        let place = |k: usize| k as f64 / 40.0;
        let sample = |k: usize| {
            let [x, y] = [place(k % 41), place(k / 41)];
            Sample {
                position: [x, y],
                size: 1.0 / 40.0,
                value: value(x, y),
            }
        };
        (0..41 * 41).map(sample).collect()
    }

    fn length(segments: &[[[f64; 2]; 2]]) -> f64 {
        let length = |[from, to]: &[[f64; 2]; 2]| (from[0] - to[0]).hypot(from[1] - to[1]);
        segments.iter().map(length).sum()
    }

    #[test]
    fn contours_of_a_cone_are_circles() {
        let cone = lattice(|x, y| (x - 0.5).hypot(y - 0.5));
        let lines = segments(&cone, &[0.2, 0.4]);
        let radius = |[x, y]: [f64; 2]| (x - 0.5).hypot(y - 0.5);
        for end in lines.iter().flatten() {
            let radius = radius(*end);
            assert!(
                (radius - 0.2).abs() < 1e-3 || (radius - 0.4).abs() < 1e-3,
                "{radius}"
            );
        }
        let circles = 2.0 * std::f64::consts::PI * (0.2 + 0.4);
        assert!(
            (length(&lines) / circles - 1.0).abs() < 5e-3,
            "{}",
            length(&lines)
        );
        assert!(segments(&cone, &[7.0]).is_empty());
    }

    #[test]
    fn layers_behind_have_no_lines() {
        let behind = lattice(|x, _| x);
        // The layer in front is shifted by 0.1 spacings.
        let mut layers = behind.clone();
        layers.extend(lattice(|_, y| y).into_iter().map(|mut sample| {
            sample.position[0] += 0.1 / 40.0;
            sample
        }));
        let shown = uncovered(&layers);
        assert_eq!(shown.len(), behind.len());
        let lines = segments(&shown, &[0.51]);
        assert!((length(&lines) - 1.0).abs() < 1e-9, "{}", length(&lines));
        assert!(
            lines
                .iter()
                .flatten()
                .all(|end| (end[1] - 0.51).abs() < 1e-9)
        );
        assert_eq!(uncovered(&behind).len(), behind.len());
    }

    #[test]
    fn contours_end_at_gaps_and_missing_values() {
        let mut slope = lattice(|_, y| y);
        slope.retain(|sample| !(0.4..0.6).contains(&sample.position[0]));
        let lines = segments(&slope, &[0.51]);
        // The line has a gap between x = 0.375 and x = 0.6.
        assert!((length(&lines) - 0.775).abs() < 1e-9, "{}", length(&lines));
        for sample in &mut slope {
            if sample.position[0] > 0.5 {
                sample.value = f64::NAN;
            }
        }
        assert!((length(&segments(&slope, &[0.51])) - 0.375).abs() < 1e-9);
        assert!(segments(&slope[..2], &[0.0]).is_empty());
    }
}
