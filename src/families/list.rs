//! The list family: for each point the indices of its neighbours, in groups of eight, and one bit a
//! bond that says whether it is intact. Serves any cloud of points.

use rayon::prelude::*;

use super::neighbours::{NeighbourGroups, Neighbours};
use super::store::{Groups, Store};
use crate::lanes::{Lanes, WIDTH};

/// Rows handled by one task.
const CHUNK: usize = 512;

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
    pub(super) neighbours: Neighbours,
    /// What is kept of the bonds; bits are clear where a bond only fills up a group.
    pub(super) store: Store,
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
    pub neighbours: NeighbourGroups<'a>,
    /// What is kept of the bonds.
    pub groups: Groups<'a>,
    /// What volumes are multiplied by in the sums of the own and of the far end; 1 if there are
    /// none, the own end's if the far end has none.
    pub weights: [Option<&'a [Lanes]>; 2],
}

/// A range of rows that can be split between threads.
pub struct Rows<'a> {
    points: &'a [u32],
    starts: &'a [usize],
    neighbours: NeighbourGroups<'a>,
    groups: Groups<'a>,
    weights: [Option<&'a [Lanes]>; 2],
}

impl BondList {
    /// All bonds, broken ones included.
    pub fn bonds(&self) -> u64 {
        let filled = |row: usize| {
            let groups = self.starts[row]..self.starts[row + 1];
            let own = self.points[row];
            groups
                .flat_map(|group| self.neighbours.indices(group))
                .filter(|there| *there != own)
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
            neighbours: self.neighbours.groups(groups.clone()),
            weights: self
                .weights
                .each_ref()
                .map(|weights| weights.as_ref().map(|weights| &weights[groups.clone()])),
            groups: self.store.groups(groups),
        }
    }

    /// Sets what volumes are multiplied by in the sums of the first `ends` ends, 0 the own, 1 the far one: `weight`
    /// of an end and of ξ (m), which `offset` has of the two local indices.
    pub fn weigh(
        &mut self,
        ends: usize,
        offset: impl Fn(usize, usize) -> [f64; 3] + Sync,
        weight: impl Fn(usize, [f64; 3]) -> f64 + Sync,
    ) {
        let none =
            |end| vec![Lanes::splat(0.0); if end < ends { self.neighbours.len() } else { 0 }];
        let mut all = [none(0), none(1)];
        let mut rest = all.each_mut().map(Vec::as_mut_slice);
        let mut tasks = Vec::new();
        for first in (0..self.points.len()).step_by(CHUNK) {
            let rows = first..(first + CHUNK).min(self.points.len());
            let groups = self.starts[rows.end] - self.starts[rows.start];
            let own = rest.each_mut().map(|rest| {
                let groups = groups.min(rest.len());
                rest.split_off_mut(..groups).unwrap_or_default()
            });
            tasks.push((rows, own));
        }
        tasks.into_par_iter().for_each(|(rows, mut weights)| {
            let first = self.starts[rows.start];
            for row in rows {
                let own = self.points[row];
                for group in self.starts[row]..self.starts[row + 1] {
                    let neighbours = self.neighbours.indices(group);
                    for (lane, there) in neighbours.iter().enumerate() {
                        if *there == own {
                            continue;
                        }
                        let offset = offset(own as usize, *there as usize);
                        for (end, weights) in weights.iter_mut().enumerate().take(ends) {
                            weights[group - first].0[lane] = weight(end, offset);
                        }
                    }
                }
            }
        });
        for (kept, weights) in self.weights.iter_mut().zip(all).take(ends) {
            *kept = Some(weights);
        }
    }

    /// Bytes that [`Self::weigh`] takes for so many ends.
    pub fn weight_bytes(&self, ends: usize) -> u64 {
        (ends * self.neighbours.len() * size_of::<Lanes>()) as u64
    }

    /// Makes the bonds unbreakable that have an end for which `protected` (by local index) holds.
    pub fn protect(&mut self, protected: impl Fn(usize) -> bool) {
        let mut breakable = vec![u8::MAX; self.neighbours.len()];
        for row in 0..self.points.len() {
            let own = protected(self.points[row] as usize);
            for group in self.starts[row]..self.starts[row + 1] {
                for (k, there) in self.neighbours.indices(group).iter().enumerate() {
                    if own || protected(*there as usize) {
                        breakable[group] &= !(1 << k);
                    }
                }
            }
        }
        self.store.breakable = Some(breakable);
    }

    /// See [`super::BlockBonds::cut`].
    pub fn cut(&mut self, concerned: impl Fn(usize) -> bool, cut: impl Fn(usize, usize) -> bool) {
        for row in 0..self.points.len() {
            let own = self.points[row];
            if !concerned(own as usize) {
                continue;
            }
            for group in self.starts[row]..self.starts[row + 1] {
                for (k, there) in self.neighbours.indices(group).iter().enumerate() {
                    if *there != own && cut(own as usize, *there as usize) {
                        self.store.intact[group] &= !(1 << k);
                    }
                }
            }
        }
    }

    /// Calls `found` with the local indices of both ends of every intact bond.
    pub fn for_each_intact(&self, found: &mut impl FnMut(usize, usize)) {
        for row in 0..self.points.len() {
            for group in self.starts[row]..self.starts[row + 1] {
                for (k, there) in self.neighbours.indices(group).iter().enumerate() {
                    if self.store.intact[group] >> k & 1 == 1 {
                        found(self.points[row] as usize, *there as usize);
                    }
                }
            }
        }
    }

    /// Calls `found` with the local index of the far end of every intact bond of a point.
    pub fn for_each_neighbour(&self, point: usize, found: &mut impl FnMut(usize)) {
        let Ok(row) = self.points.binary_search(&(point as u32)) else {
            return;
        };
        for group in self.starts[row]..self.starts[row + 1] {
            for (k, there) in self.neighbours.indices(group).iter().enumerate() {
                if self.store.intact[group] >> k & 1 == 1 {
                    found(*there as usize);
                }
            }
        }
    }

    /// Calls `found` with the local indices of both ends of every broken bond.
    pub fn for_each_broken(&self, found: &mut impl FnMut(usize, usize)) {
        for row in 0..self.points.len() {
            let own = self.points[row];
            let groups = self.starts[row]..self.starts[row + 1];
            for group in groups.filter(|group| self.store.intact[*group] != u8::MAX) {
                for (k, there) in self.neighbours.indices(group).iter().enumerate() {
                    if *there != own && self.store.intact[group] >> k & 1 == 0 {
                        found(own as usize, *there as usize);
                    }
                }
            }
        }
    }

    /// Calls `found` with the number of each row, its point and the bytes of a checkpoint that its
    /// bonds take, which are the same on any number of ranks.
    pub fn for_each_row(&self, mut found: impl FnMut(usize, usize, usize)) {
        let bytes = 1 + WIDTH * self.store.number_bytes();
        for (row, point) in self.points.iter().enumerate() {
            let groups = self.starts[row + 1] - self.starts[row];
            found(row, *point as usize, groups * bytes);
        }
    }

    /// Copies what is kept of a row's bonds to bytes: for each group the bits, then the numbers.
    pub fn save_row(&self, row: usize, bytes: &mut [u8]) {
        let width = self.store.number_bytes();
        let groups = self.starts[row]..self.starts[row + 1];
        for (group, bytes) in groups.zip(bytes.chunks_exact_mut(1 + WIDTH * width)) {
            bytes[0] = self.store.intact[group];
            for lane in 0..WIDTH {
                let place = 1 + lane * width..1 + (lane + 1) * width;
                self.store.save_numbers(group, lane, &mut bytes[place]);
            }
        }
    }

    /// Puts back what [`Self::save_row`] gave.
    pub fn restore_row(&mut self, row: usize, bytes: &[u8]) {
        let width = self.store.number_bytes();
        let groups = self.starts[row]..self.starts[row + 1];
        for (group, bytes) in groups.zip(bytes.chunks_exact(1 + WIDTH * width)) {
            self.store.intact[group] = bytes[0];
            for lane in 0..WIDTH {
                let place = 1 + lane * width..1 + (lane + 1) * width;
                self.store.restore_numbers(group, lane, &bytes[place]);
            }
        }
    }

    /// Memory that the list takes, bytes.
    pub fn bytes(&self) -> usize {
        let groups = self.neighbours.len();
        4 * self.points.len()
            + 8 * self.starts.len()
            + self.neighbours.bytes()
            + self.store.bytes()
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
        let [neighbours_a, neighbours_b] = self.neighbours.split_at(group);
        let [groups_a, groups_b] = self.groups.split_at(group);
        let weights_a = self.weights.map(|all| all.map(|weights| &weights[..group]));
        let weights_b = self.weights.map(|all| all.map(|weights| &weights[group..]));
        let first = Self {
            points: points_a,
            starts: &self.starts[..=row],
            neighbours: neighbours_a,
            groups: groups_a,
            weights: weights_a,
        };
        let second = Self {
            points: points_b,
            starts: &self.starts[row..],
            neighbours: neighbours_b,
            groups: groups_b,
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
            neighbours: self.neighbours.range(groups.clone()),
            weights: self
                .weights
                .map(|all| all.map(|weights| &weights[groups.clone()])),
            groups: self.groups.range(groups),
        }
    }
}

impl Row<'_> {
    /// A bit for each bond of a group, broken or not, clear where it only fills up the group.
    #[inline(always)]
    pub fn whole(&self, group: usize) -> u8 {
        let mut bits = 0;
        for (k, there) in self.neighbours.group(group).indices().iter().enumerate() {
            bits |= u8::from(*there as usize != self.point) << k;
        }
        bits
    }
}
