//! Points binned into boxes for neighbour searches.

use super::distance_squared;

/// Boxes over a cloud of positions, for searches within a radius. The edge of a box is at least half the
/// radius. With boxes as large as the radius, searches would visit more points out of range.
pub struct Bins {
    lower: [f64; 3],
    inverse_edge: f64,
    counts: [usize; 3],
    radius_squared: f64,
    starts: Vec<u32>,
    /// Index and position of each point, sorted by box, then by index.
    entries: Vec<(u32, [f64; 3])>,
}

impl Bins {
    /// Bin positions (m). `radius` (m) is the search radius of [`Self::within`].
    pub fn new(positions: &[[f64; 3]], radius: f64) -> Self {
        let mut lower = [f64::INFINITY; 3];
        let mut upper = [f64::NEG_INFINITY; 3];
        for position in positions {
            for k in 0..3 {
                lower[k] = lower[k].min(position[k]);
                upper[k] = upper[k].max(position[k]);
            }
        }
        let (edge, counts) = boxes(lower, upper, 0.5 * radius, positions.len());
        let mut bins = Self {
            lower,
            inverse_edge: 1.0 / edge,
            counts,
            radius_squared: radius * radius,
            starts: vec![0; counts.iter().product::<usize>() + 1],
            entries: vec![(0, [0.0; 3]); positions.len()],
        };
        for position in positions {
            let index = bins.index(bins.coordinates(*position));
            bins.starts[index + 1] += 1;
        }
        for k in 1..bins.starts.len() {
            bins.starts[k] += bins.starts[k - 1];
        }
        let mut next = bins.starts.clone();
        for (k, position) in positions.iter().enumerate() {
            let slot = &mut next[bins.index(bins.coordinates(*position))];
            bins.entries[*slot as usize] = (k as u32, *position);
            *slot += 1;
        }
        bins
    }

    fn coordinates(&self, position: [f64; 3]) -> [isize; 3] {
        std::array::from_fn(|k| {
            ((position[k] - self.lower[k]) * self.inverse_edge).floor() as isize
        })
    }

    fn index(&self, coordinates: [isize; 3]) -> usize {
        let clamped: [usize; 3] =
            std::array::from_fn(|k| coordinates[k].clamp(0, self.counts[k] as isize - 1) as usize);
        clamped[0] + self.counts[0] * (clamped[1] + self.counts[1] * clamped[2])
    }

    /// Call `visit` with the index and the squared distance (m²) of every point within the radius of a
    /// position, including points at the position itself.
    pub fn within(&self, position: [f64; 3], mut visit: impl FnMut(u32, f64)) {
        let square = self.radius_squared;
        self.for_each_run(position, square, |entries| {
            for (index, other) in entries {
                let squared = distance_squared(position, *other);
                if squared <= square {
                    visit(*index, squared);
                }
            }
        });
    }

    /// Append to `found` the index of every point whose squared distance from `position` is above 0 and at
    /// most `square` (m²). Return the number of points at the position itself.
    pub fn collect(&self, position: [f64; 3], square: f64, found: &mut Vec<u32>) -> usize {
        let mut coincident = 0;
        self.for_each_run(position, square, |entries| {
            let start = found.len();
            found.resize(start + entries.len(), 0);
            let mut end = start;
            // The loop has no branches, because the result of the comparison is hard to predict.
            for (index, other) in entries {
                let squared = distance_squared(position, *other);
                found[end] = *index;
                end += usize::from(squared <= square && squared > 0.0);
                coincident += usize::from(squared == 0.0);
            }
            found.truncate(end);
        });
        coincident
    }

    /// Call `run` with slices of `entries`. The slices together include all points whose squared distance
    /// from a position is at most `square` (m²), and may include other points.
    fn for_each_run(
        &self,
        position: [f64; 3],
        square: f64,
        mut run: impl FnMut(&[(u32, [f64; 3])]),
    ) {
        if self.entries.is_empty() {
            return;
        }
        // Lengths are in box edges. With the tolerance, points exactly at the radius are found despite
        // round-off.
        let radius_squared = square * (self.inverse_edge * self.inverse_edge);
        let radius_squared = radius_squared * (1.0 + 1e-6);
        let centre: [f64; 3] =
            std::array::from_fn(|k| (position[k] - self.lower[k]) * self.inverse_edge);
        // Squared radius that is left for the other directions, after the square of the gap to a layer of
        // boxes is subtracted.
        let remaining = |radius_squared: f64, k: usize, layer: isize| {
            let [below, above] = [layer as f64 - centre[k], centre[k] - (layer + 1) as f64];
            let gap = below.max(above).max(0.0);
            radius_squared - gap * gap
        };
        let range = |radius_squared: f64, k: usize| {
            let radius = radius_squared.max(0.0).sqrt();
            let last = self.counts[k] as isize - 1;
            let [first, end] = [centre[k] - radius, centre[k] + radius].map(|x| x.floor() as isize);
            first.max(0)..=end.min(last)
        };
        for z in range(radius_squared, 2) {
            let in_layer = remaining(radius_squared, 2, z);
            for y in range(in_layer, 1) {
                let xs = range(remaining(in_layer, 1, y), 0);
                if xs.is_empty() {
                    continue;
                }
                // Boxes along x are adjacent in memory.
                let first = self.starts[self.index([*xs.start(), y, z])] as usize;
                let last = self.starts[self.index([*xs.end(), y, z]) + 1] as usize;
                run(&self.entries[first..last]);
            }
        }
    }
}

/// Return the edge (m) of boxes, and the number of boxes per direction. The edge is at least `min_edge` (m).
/// The total number of boxes is at most twice the number of points (`points`), plus 64.
///
/// # Panics
/// If the edge is not above 0 or a corner is not finite. The search for the edge would not end.
pub fn boxes(lower: [f64; 3], upper: [f64; 3], min_edge: f64, points: usize) -> (f64, [usize; 3]) {
    let extents: [f64; 3] = std::array::from_fn(|k| (upper[k] - lower[k]).max(0.0));
    let is_finite = extents.iter().all(|extent| extent.is_finite());
    assert!(
        min_edge > 0.0 && is_finite,
        "boxes with the edge {min_edge} m over the extents {extents:?} m"
    );
    let mut edge = min_edge * (1.0 + 1e-6);
    loop {
        let counts = extents.map(|extent| (extent / edge).floor() + 1.0);
        if counts.iter().product::<f64>() <= 2.0 * points as f64 + 64.0 {
            return (edge, counts.map(|count| count as usize));
        }
        edge *= 1.5;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn finds_what_comparing_all_pairs_finds(
            flat in prop::collection::vec(prop::array::uniform3(-1.0..1.0_f64), 0..80),
            stretch in 0.0..50.0_f64,
            radius in 0.01..2.0_f64,
        ) {
            let positions: Vec<[f64; 3]> =
                flat.iter().map(|p| [p[0] * stretch, p[1], p[2]]).collect();
            let bins = Bins::new(&positions, radius);
            for centre in &positions {
                let mut found = Vec::new();
                bins.within(*centre, |index, _| found.push(index as usize));
                found.sort_unstable();
                let expected: Vec<usize> = (0..positions.len())
                    .filter(|k| distance_squared(*centre, positions[*k]) <= radius * radius)
                    .collect();
                prop_assert_eq!(&found, &expected);
                // Search with a smaller radius; the point at the position itself is counted, but is not in
                // `found`.
                let square = (0.3 * radius).powi(2);
                let mut found = Vec::new();
                let at_position = bins.collect(*centre, square, &mut found);
                found.sort_unstable();
                let near = |k: &u32| distance_squared(*centre, positions[*k as usize]);
                let all = 0..positions.len() as u32;
                let expected: Vec<u32> =
                    all.clone().filter(|k| near(k) > 0.0 && near(k) <= square).collect();
                prop_assert_eq!(&found, &expected);
                prop_assert_eq!(at_position, all.filter(|k| near(k) == 0.0).count());
            }
        }
    }
}
