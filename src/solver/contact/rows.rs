//! The pairs of points that may touch before the next search.

use rayon::prelude::*;

/// Number of points that one task processes.
const CHUNK: usize = 1024;

/// The points that may touch each owned point: one row per owned point. The points in a row are in
/// ascending order of ids.
#[derive(Debug, Default)]
pub(super) struct Rows {
    /// Index of the first pair of each owned point; the last element is the number of pairs.
    starts: Vec<usize>,
    /// Index of the other point of each pair. Ghosts are numbered after the owned points.
    others: Vec<u32>,
    /// Id of the other point of each pair.
    ids: Vec<u64>,
    /// Whether an intact bond joins the two points of each pair. A pair with such a bond has no contact.
    is_bonded: Vec<bool>,
}

/// A pair found by the contact search.
pub(super) struct FoundPair {
    /// Id of the other point.
    pub id: u64,
    /// Index of the other point. Ghosts are numbered after the owned points.
    pub other: u32,
}

impl Rows {
    /// Create the rows of the first `points` local points. `find` appends the pairs of a point to a row. All
    /// pairs start unbonded.
    pub fn new(points: usize, find: impl Fn(usize, &mut Vec<FoundPair>) + Sync) -> Self {
        let chunks = points.div_ceil(CHUNK);
        let chunks: Vec<(Vec<usize>, Vec<FoundPair>)> = (0..chunks)
            .into_par_iter()
            .map(|chunk| {
                let (mut lengths, mut all, mut row) = (Vec::new(), Vec::new(), Vec::new());
                for point in chunk * CHUNK..((chunk + 1) * CHUNK).min(points) {
                    find(point, &mut row);
                    row.sort_unstable_by_key(|found| found.id);
                    lengths.push(row.len());
                    all.append(&mut row);
                }
                (lengths, all)
            })
            .collect();
        let pairs = chunks.iter().map(|(_, all)| all.len()).sum();
        let mut rows = Self {
            starts: Vec::with_capacity(points + 1),
            others: Vec::with_capacity(pairs),
            ids: Vec::with_capacity(pairs),
            is_bonded: vec![false; pairs],
        };
        rows.starts.push(0);
        for (lengths, all) in chunks {
            for length in lengths {
                rows.starts
                    .push(rows.starts[rows.starts.len() - 1] + length);
            }
            rows.others.extend(all.iter().map(|found| found.other));
            rows.ids.extend(all.iter().map(|found| found.id));
        }
        rows
    }

    /// Indices of the points that may touch an owned point and have no intact bond to it.
    pub fn touching(&self, point: usize) -> impl Iterator<Item = usize> {
        let row = self.starts[point]..self.starts[point + 1];
        row.filter(|pair| !self.is_bonded[*pair])
            .map(|pair| self.others[pair] as usize)
    }

    /// Whether [`Self::touching`] returns any index for an owned point.
    pub fn is_open(&self, point: usize) -> bool {
        let row = self.starts[point]..self.starts[point + 1];
        self.is_bonded[row].contains(&false)
    }

    /// Whether there are no rows, as in runs in which points only touch rigid bodies.
    pub fn is_unused(&self) -> bool {
        self.starts.is_empty()
    }

    /// Whether the row of an owned point is empty.
    pub fn is_empty(&self, point: usize) -> bool {
        self.starts[point] == self.starts[point + 1]
    }

    /// Mark the pair of an owned point and the point with this id as bonded.
    pub fn set_bonded(&mut self, point: usize, id: u64) {
        let row = self.starts[point]..self.starts[point + 1];
        if let Ok(place) = self.ids[row.clone()].binary_search(&id) {
            self.is_bonded[row.start + place] = true;
        }
    }

    /// Mark all pairs of an owned point as unbonded.
    pub fn set_unbonded(&mut self, point: usize) {
        self.is_bonded[self.starts[point]..self.starts[point + 1]].fill(false);
    }

    /// Copy the bonded flag of each pair from `earlier`, if the pair is also in `earlier`. `earlier` contains
    /// the earlier rows of the same points. Return the points that have a pair which is not in `earlier`.
    pub fn inherit(&mut self, earlier: &Self) -> Vec<usize> {
        let mut new = Vec::new();
        for point in 0..self.starts.len() - 1 {
            let row = self.starts[point]..self.starts[point + 1];
            let before = earlier.starts[point]..earlier.starts[point + 1];
            let mut is_new = false;
            for pair in row {
                match earlier.ids[before.clone()].binary_search(&self.ids[pair]) {
                    Ok(place) => self.is_bonded[pair] = earlier.is_bonded[before.start + place],
                    Err(_) => is_new = true,
                }
            }
            if is_new {
                new.push(point);
            }
        }
        new
    }
}
