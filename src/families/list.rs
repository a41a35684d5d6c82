//! The list family: for each point the indices of its neighbours, in groups of eight, and one bit a
//! bond that says whether it is intact. Serves any cloud of points.

use crate::material::Lanes;
use crate::material::lanes::WIDTH;

/// The bonds from points of one block to points of one block.
#[derive(Debug, Clone, Default)]
pub struct BondList {
    /// Block of the points that sum over these bonds.
    pub here: usize,
    /// Block of their neighbours.
    pub there: usize,
    /// Local index of each row's point, ascending.
    pub(super) points: Vec<u32>,
    /// First group of each row, and the number of groups.
    pub(super) starts: Vec<usize>,
    /// Local indices of the neighbours, row by row sorted by global id; the last group of a row is
    /// filled up with the row's own point.
    pub(super) neighbours: Vec<[u32; WIDTH]>,
    /// One bit a bond, clear where it is broken or only fills up a group.
    pub(super) intact: Vec<u8>,
    /// One bit a bond, clear where it can never break; all can break if there is none.
    pub(super) breakable: Option<Vec<u8>>,
    /// What volumes are multiplied by in the sums of the own and of the far end, 0 where a bond only
    /// fills up a group; 1 if there are none, the own end's if the far end has none.
    pub(super) weights: [Option<Vec<Lanes>>; 2],
    /// One more than the largest local index in the list.
    pub(super) reach: usize,
}

/// The bonds of one point in a list.
pub struct Row<'a> {
    /// Local index of the point.
    pub point: usize,
    /// Local indices of the neighbours.
    pub neighbours: &'a [[u32; WIDTH]],
    /// Which of them are still bonded.
    pub intact: &'a mut [u8],
    /// Which bonds can break.
    pub breakable: Option<&'a [u8]>,
    /// What volumes are multiplied by in the sums of the own and of the far end; 1 if there are
    /// none, the own end's if the far end has none.
    pub weights: [Option<&'a [Lanes]>; 2],
}

/// A range of rows that can be split between threads.
pub struct Rows<'a> {
    points: &'a [u32],
    starts: &'a [usize],
    neighbours: &'a [[u32; WIDTH]],
    intact: &'a mut [u8],
    breakable: Option<&'a [u8]>,
    weights: [Option<&'a [Lanes]>; 2],
}

impl BondList {
    /// All bonds, broken ones included.
    pub fn bonds(&self) -> u64 {
        let filled = |row: usize| {
            let groups = &self.neighbours[self.starts[row]..self.starts[row + 1]];
            let own = self.points[row];
            groups
                .iter()
                .flatten()
                .filter(|there| **there != own)
                .count() as u64
        };
        (0..self.points.len()).map(filled).sum()
    }

    /// Number of rows, those whose point has a local index below `limit`.
    pub fn rows_below(&self, limit: usize) -> usize {
        self.points
            .partition_point(|point| (*point as usize) < limit)
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Groups of a row, on average.
    pub fn groups_a_row(&self) -> usize {
        self.neighbours.len().div_ceil(self.points.len().max(1))
    }

    /// Whether there is no bond.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// One more than the largest local index that the list names.
    pub fn reach(&self) -> usize {
        self.reach
    }

    /// The rows of a range.
    pub fn rows(&mut self, range: std::ops::Range<usize>) -> Rows<'_> {
        let groups = self.starts[range.start]..self.starts[range.end];
        Rows {
            points: &self.points[range.clone()],
            starts: &self.starts[range.start..=range.end],
            neighbours: &self.neighbours[groups.clone()],
            breakable: self.breakable.as_ref().map(|bits| &bits[groups.clone()]),
            weights: self
                .weights
                .each_ref()
                .map(|weights| weights.as_ref().map(|weights| &weights[groups.clone()])),
            intact: &mut self.intact[groups],
        }
    }

    /// Sets what volumes are multiplied by in the sums of one end, 0 the own, 1 the far one: `weight`
    /// of the two local indices.
    pub fn weigh(&mut self, end: usize, weight: impl Fn(usize, usize) -> f64) {
        let mut weights = vec![Lanes::splat(0.0); self.neighbours.len()];
        for row in 0..self.points.len() {
            let own = self.points[row];
            for group in self.starts[row]..self.starts[row + 1] {
                for (k, there) in self.neighbours[group].iter().enumerate() {
                    if *there != own {
                        weights[group].0[k] = weight(own as usize, *there as usize);
                    }
                }
            }
        }
        self.weights[end] = Some(weights);
    }

    /// Makes the bonds unbreakable that have an end for which `protected` (by local index) holds.
    pub fn protect(&mut self, protected: impl Fn(usize) -> bool) {
        let mut breakable = vec![u8::MAX; self.neighbours.len()];
        for row in 0..self.points.len() {
            let own = protected(self.points[row] as usize);
            for group in self.starts[row]..self.starts[row + 1] {
                for (k, there) in self.neighbours[group].iter().enumerate() {
                    if own || protected(*there as usize) {
                        breakable[group] &= !(1 << k);
                    }
                }
            }
        }
        self.breakable = Some(breakable);
    }

    /// Breaks the bonds for which `cut` (of the two local indices) holds.
    pub fn cut(&mut self, cut: impl Fn(usize, usize) -> bool) {
        for row in 0..self.points.len() {
            let own = self.points[row];
            for group in self.starts[row]..self.starts[row + 1] {
                for (k, there) in self.neighbours[group].iter().enumerate() {
                    if *there != own && cut(own as usize, *there as usize) {
                        self.intact[group] &= !(1 << k);
                    }
                }
            }
        }
    }

    /// Calls `found` with the local indices of both ends of every intact bond.
    pub fn for_each_intact(&self, found: &mut impl FnMut(usize, usize)) {
        for row in 0..self.points.len() {
            for group in self.starts[row]..self.starts[row + 1] {
                for (k, there) in self.neighbours[group].iter().enumerate() {
                    if self.intact[group] >> k & 1 == 1 {
                        found(self.points[row] as usize, *there as usize);
                    }
                }
            }
        }
    }

    /// Each row's point with the bits of its bonds, which are the same on any number of ranks.
    pub fn intact_rows(&self) -> impl Iterator<Item = (usize, &[u8])> {
        let row = |row: usize| &self.intact[self.starts[row]..self.starts[row + 1]];
        (0..self.points.len()).map(move |k| (self.points[k] as usize, row(k)))
    }

    /// As [`Self::intact_rows`], to put back what was stored.
    pub fn intact_rows_mut(&mut self) -> impl Iterator<Item = (usize, &mut [u8])> {
        let mut rest = &mut self.intact[..];
        let lengths = self.starts.windows(2).map(|pair| pair[1] - pair[0]);
        self.points.iter().zip(lengths).map(move |(point, length)| {
            let (row, more) = std::mem::take(&mut rest).split_at_mut(length);
            rest = more;
            (*point as usize, row)
        })
    }

    /// Memory that the list takes, bytes.
    pub fn bytes(&self) -> usize {
        let groups = self.neighbours.len();
        4 * self.points.len()
            + 8 * self.starts.len()
            + groups * (4 * WIDTH + 1 + usize::from(self.breakable.is_some()))
            + groups * 8 * WIDTH * self.weights.iter().flatten().count()
    }
}

impl<'a> Rows<'a> {
    /// Number of rows.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Whether there is no row.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// The local index of a row's point.
    pub fn point(&self, row: usize) -> usize {
        self.points[row] as usize
    }

    /// The rows before `row` and those from it on.
    pub fn split_at(self, row: usize) -> (Self, Self) {
        let (points_a, points_b) = self.points.split_at(row);
        let group = self.starts[row] - self.starts[0];
        let (neighbours_a, neighbours_b) = self.neighbours.split_at(group);
        let (intact_a, intact_b) = self.intact.split_at_mut(group);
        let (breakable_a, breakable_b) = match self.breakable {
            Some(bits) => {
                let (a, b) = bits.split_at(group);
                (Some(a), Some(b))
            }
            None => (None, None),
        };
        let weights_a = self.weights.map(|all| all.map(|weights| &weights[..group]));
        let weights_b = self.weights.map(|all| all.map(|weights| &weights[group..]));
        let first = Self {
            points: points_a,
            starts: &self.starts[..=row],
            neighbours: neighbours_a,
            intact: intact_a,
            breakable: breakable_a,
            weights: weights_a,
        };
        let second = Self {
            points: points_b,
            starts: &self.starts[row..],
            neighbours: neighbours_b,
            intact: intact_b,
            breakable: breakable_b,
            weights: weights_b,
        };
        (first, second)
    }

    /// One row.
    #[inline(always)]
    pub fn row(&mut self, row: usize) -> Row<'_> {
        let groups = self.starts[row] - self.starts[0]..self.starts[row + 1] - self.starts[0];
        Row {
            point: self.points[row] as usize,
            neighbours: &self.neighbours[groups.clone()],
            breakable: self.breakable.map(|bits| &bits[groups.clone()]),
            weights: self
                .weights
                .map(|all| all.map(|weights| &weights[groups.clone()])),
            intact: &mut self.intact[groups],
        }
    }
}

impl Row<'_> {
    /// A bit for each bond of a group, broken or not, clear where it only fills up the group.
    #[inline(always)]
    pub fn filled(&self, group: usize) -> u8 {
        let mut bits = 0;
        for (k, there) in self.neighbours[group].iter().enumerate() {
            bits |= u8::from(*there as usize != self.point) << k;
        }
        bits
    }
}
