//! Polygons whose edges are indexed by strips, so that a containment test reads few edges.

use std::ops::RangeInclusive;

use nalgebra::Vector2;

/// Upper limit on the number of strip boundaries that an edge crosses, as a mean over all edges.
const MOST_ENTRIES: f64 = 8.0;

/// Round-off of the distance to an edge, as a fraction of the polygon's extent.
const SLACK: f64 = 1e-12;

/// A closed polygon in the plane; lengths in m. It may be concave and may intersect itself.
#[derive(Debug, Clone, PartialEq)]
pub struct Polygon {
    vertices: Vec<[f64; 2]>,
    lower: [f64; 2],
    upper: [f64; 2],
    /// The axis that is divided into strips.
    axis: usize,
    /// Strips per m.
    strips_per_length: f64,
    /// For each strip, the index of its first entry in `edges`. The last element is the length of `edges`.
    starts: Vec<u32>,
    /// The edges that touch each strip; edge k starts at vertex k.
    edges: Vec<u32>,
}

impl Polygon {
    /// Create a polygon from its vertices in order. The last vertex is joined to the first.
    pub fn new(vertices: Vec<[f64; 2]>) -> Self {
        let extreme = |k: usize, select: fn(f64, f64) -> f64| {
            let entries = vertices.iter().map(|vertex| vertex[k]);
            entries.reduce(select).unwrap_or(0.0)
        };
        let [lower, upper] = [f64::min as fn(f64, f64) -> f64, f64::max]
            .map(|select| [extreme(0, select), extreme(1, select)]);
        let mut polygon = Self {
            vertices,
            lower,
            upper,
            axis: 1,
            strips_per_length: 0.0,
            starts: Vec::new(),
            edges: Vec::new(),
        };
        polygon.index_edges();
        polygon
    }

    /// For each axis, divide the sum of the extents of all edges along the axis by the extent of the polygon
    /// along the axis. Build the index along the axis with the smaller ratio.
    fn index_edges(&mut self) {
        let count = self.vertices.len();
        // For each axis, the sum of the extents of all edges along the axis, divided by the extent of the
        // polygon along the axis.
        let turns = [0, 1].map(|k| {
            let all: f64 = (0..count)
                .map(|edge| {
                    let [a, b] = self.edge(edge);
                    (b[k] - a[k]).abs()
                })
                .sum();
            // `max` also replaces the NaN of a polygon without extent along an axis.
            (all / (self.upper[k] - self.lower[k])).max(1.0)
        });
        self.axis = usize::from(turns[1] <= turns[0]);
        let most = MOST_ENTRIES * count as f64 / turns[self.axis];
        let strips = most.clamp(1.0, count.max(1) as f64).floor();
        self.strips_per_length = strips / (self.upper[self.axis] - self.lower[self.axis]);
        self.starts = vec![0; strips as usize + 1];
        for edge in 0..count {
            for strip in self.strips_of(edge) {
                self.starts[strip + 1] += 1;
            }
        }
        for strip in 1..self.starts.len() {
            self.starts[strip] += self.starts[strip - 1];
        }
        let mut next = self.starts.clone();
        self.edges = vec![0; self.starts[strips as usize] as usize];
        for edge in 0..count {
            for strip in self.strips_of(edge) {
                self.edges[next[strip] as usize] = edge as u32;
                next[strip] += 1;
            }
        }
    }

    /// Return the vertices in order, m.
    pub fn vertices(&self) -> &[[f64; 2]] {
        &self.vertices
    }

    /// Return the lower and the upper corner of the box around the polygon, m.
    pub fn bounds(&self) -> ([f64; 2], [f64; 2]) {
        (self.lower, self.upper)
    }

    /// Test by the even-odd rule whether a position is inside. The rule is not used for a position at most
    /// |tolerance| (m) away from an edge. Such a position is inside if the tolerance is positive, and outside
    /// if the tolerance is 0 or negative.
    pub fn contains(&self, position: [f64; 2], tolerance: f64) -> bool {
        let (along, across) = (self.axis, 1 - self.axis);
        let at = position[along];
        let extent = (self.upper[0] - self.lower[0]).max(self.upper[1] - self.lower[1]);
        let reach = tolerance.abs() + SLACK * extent;
        let is_near = |edge: &u32| {
            let [a, b] = self.edge(*edge as usize);
            distance_to_segment(a, b, position) <= tolerance.abs()
        };
        let mut near = self.strip(at - reach)..=self.strip(at + reach);
        if near.any(|strip| self.edges_of(strip).iter().any(is_near)) {
            return tolerance > 0.0;
        }
        // The strip of the horizontal or vertical line through the position contains every edge that crosses
        // this line.
        let crossings = self.edges_of(self.strip(at)).iter().filter(|edge| {
            let [a, b] = self.edge(**edge as usize);
            let spans = (a[along] > at) != (b[along] > at);
            let fraction = (at - a[along]) / (b[along] - a[along]);
            spans && position[across] < a[across] + fraction * (b[across] - a[across])
        });
        crossings.count() % 2 == 1
    }

    fn edge(&self, index: usize) -> [[f64; 2]; 2] {
        let next = if index + 1 == self.vertices.len() {
            0
        } else {
            index + 1
        };
        [self.vertices[index], self.vertices[next]]
    }

    /// Return the index of the strip at a coordinate (m) along the axis, clamped to the first and last strip.
    fn strip(&self, coordinate: f64) -> usize {
        let strip = (coordinate - self.lower[self.axis]) * self.strips_per_length;
        (strip as usize).min(self.starts.len() - 2)
    }

    fn strips_of(&self, edge: usize) -> RangeInclusive<usize> {
        let [a, b] = self.edge(edge).map(|end| end[self.axis]);
        self.strip(a.min(b))..=self.strip(a.max(b))
    }

    fn edges_of(&self, strip: usize) -> &[u32] {
        &self.edges[self.starts[strip] as usize..self.starts[strip + 1] as usize]
    }
}

fn distance_to_segment(a: [f64; 2], b: [f64; 2], p: [f64; 2]) -> f64 {
    let [a, b, p] = [a, b, p].map(Vector2::from);
    let (edge, offset) = (b - a, p - a);
    let along = edge.dot(&offset) / edge.dot(&edge);
    // A repeated vertex creates an edge of length 0. The distance to the edge is then the distance to the
    // vertex.
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
    use proptest::prelude::*;

    /// Same as [`Polygon::contains`], with a loop over all edges instead of the index.
    fn by_all_edges(vertices: &[[f64; 2]], position: [f64; 2], tolerance: f64) -> bool {
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

    /// Assert that [`Polygon::contains`], which uses the index of the edges, agrees with [`by_all_edges`].
    /// The tested positions form a grid with the spacing 0.5. They include vertices and positions on edges.
    #[track_caller]
    fn assert_same(vertices: &[[f64; 2]], tolerance: f64) {
        let polygon = Polygon::new(vertices.to_vec());
        for [x, y] in (-2..=26).flat_map(|x| (-2..=26).map(move |y| [x, y])) {
            let position = [0.5 * f64::from(x), 0.5 * f64::from(y)];
            assert_eq!(
                polygon.contains(position, tolerance),
                by_all_edges(vertices, position, tolerance),
                "{vertices:?} {position:?}"
            );
        }
    }

    proptest! {
        #[test]
        fn the_index_does_not_change_the_result(
            corners in prop::collection::vec(prop::array::uniform2(0..=12_i32), 3..40),
            tolerance in prop::sample::select(&[1e-9, -1e-9, 0.3, -0.3, 1.2][..]),
        ) {
            let vertices: Vec<[f64; 2]> =
                corners.iter().map(|corner| corner.map(f64::from)).collect();
            assert_same(&vertices, tolerance);
        }
    }

    #[test]
    fn polygons_without_width_or_with_repeated_corners() {
        let line = [[1.0, 3.0], [5.0, 3.0], [9.0, 3.0]];
        assert_same(&line, 1e-9);
        assert_same(&line.map(|[x, y]| [y, x]), 1e-9);
        assert_same(&[[4.0, 4.0]; 3], 1e-9);
        assert_same(
            &[[2.0, 2.0], [2.0, 2.0], [8.0, 2.0], [8.0, 8.0], [8.0, 8.0]],
            -1e-9,
        );
    }

    /// Return the largest number of edges in a strip.
    fn most_read(polygon: &Polygon) -> usize {
        let strips = 0..polygon.starts.len() - 1;
        strips
            .map(|strip| polygon.edges_of(strip).len())
            .max()
            .unwrap()
    }

    #[test]
    fn few_edges_are_read_for_a_position() {
        let count = 20_000;
        let circle = |k: u32| {
            let angle = f64::from(k) * std::f64::consts::TAU / f64::from(count);
            [libm::cos(angle), libm::sin(angle)]
        };
        // A comb with teeth along y, and the same comb with teeth along x.
        let tooth = |k: u32| [f64::from(k), if k % 4 < 2 { 0.0 } else { 1e4 }];
        let back = [[f64::from(count), -1.0], [0.0, -1.0]];
        let comb: Vec<[f64; 2]> = (0..count).map(tooth).chain(back).collect();
        let turned: Vec<[f64; 2]> = comb.iter().map(|[x, y]| [*y, *x]).collect();
        for (vertices, within) in [
            ((0..count).map(circle).collect(), [0.3, -0.4]),
            (comb, [7.0, 5e3]),
            (turned, [5e3, 7.0]),
        ] {
            let polygon = Polygon::new(vertices);
            assert!(polygon.contains(within, 1e-9));
            assert!(!polygon.contains(within.map(|x| -3.0 - x), 1e-9));
            assert!(polygon.edges.len() <= 10 * count as usize);
            // The strips at the two ends of a circle contain the most edges.
            assert!(most_read(&polygon) < 400, "{}", most_read(&polygon));
        }
    }
}
