//! List families, for any cloud of points: the neighbour indices of each point, in groups of eight, and one
//! intact bit per bond.

use rayon::prelude::*;

use super::neighbours::{NeighbourGroups, Neighbours};
use super::store::{Groups, Store};
use crate::lanes::{Lanes, WIDTH};

/// Number of rows that one task processes.
const CHUNK: usize = 512;

/// The bonds from points i of one block to points j of one block.
#[derive(Debug, Clone, Default)]
pub struct BondList {
    /// Block of the points i, whose sums run over these bonds.
    pub block_i: usize,
    /// Block of the neighbours j.
    pub block_j: usize,
    /// Local index of each row's point, ascending.
    pub(super) points: Vec<u32>,
    /// Index of the first group of each row, followed by the total number of groups.
    pub(super) starts: Vec<usize>,
    /// Local indices of the neighbours, sorted by global id in each row. The last group of a row is padded
    /// with the local index of the row's point.
    pub(super) neighbours: Neighbours,
    /// State of the bonds. In padding, the bits of `Store::intact` are clear.
    pub(super) store: Store,
    /// [Weights](crate::material::bond::Weights) of the ends i and j, 0 for padding. If the weights of i are
    /// `None`, all weights are 1. If only the weights of j are `None`, the weights of i apply to both ends.
    pub(super) weights: [Option<Vec<Lanes>>; 2],
    /// The largest local index in the list, plus one.
    pub(super) reach: usize,
}

/// The bonds of one point in a list.
pub struct Row<'a> {
    /// Local index of the point.
    pub point: usize,
    /// Local indices of the neighbours.
    pub neighbours: NeighbourGroups<'a>,
    /// State of the bonds.
    pub groups: Groups<'a>,
    /// [Weights](crate::material::bond::Weights) of the ends i and j. If the weights of i are `None`, all
    /// weights are 1. If only the weights of j are `None`, the weights of i apply to both ends.
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
    /// Number of bonds, intact or broken.
    pub fn bonds(&self) -> u64 {
        let filled = |row: usize| {
            let groups = self.starts[row]..self.starts[row + 1];
            let i = self.points[row];
            groups
                .flat_map(|group| self.neighbours.indices(group))
                .filter(|j| *j != i)
                .count() as u64
        };
        (0..self.points.len()).map(filled).sum()
    }

    /// Number of rows whose point has a local index below `limit`.
    pub fn rows_below(&self, limit: usize) -> usize {
        self.points
            .partition_point(|point| (*point as usize) < limit)
    }

    /// Number of rows.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// Mean number of groups per row, rounded up.
    pub fn groups_a_row(&self) -> usize {
        self.neighbours.len().div_ceil(self.points.len().max(1))
    }

    /// Whether the list has no bonds.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// The largest local index in the list, plus one.
    pub fn reach(&self) -> usize {
        self.reach
    }

    /// The rows whose indices are in `range`.
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

    /// Set the weights of the bonds to `weight(end, ξ)`, with ξ = `offset(i, j)` in m. With `ends` = 1, the
    /// weight of end 0 (point i) applies to both ends; with `ends` = 2, each end has its own weight.
    pub fn weigh(
        &mut self,
        ends: usize,
        offset: impl Fn(usize, usize) -> [f64; 3] + Sync,
        weight: impl Fn(usize, [f64; 3]) -> f64 + Sync,
    ) {
        let zeros =
            |end| vec![Lanes::splat(0.0); if end < ends { self.neighbours.len() } else { 0 }];
        let mut all = [zeros(0), zeros(1)];
        let mut rest = all.each_mut().map(Vec::as_mut_slice);
        let mut tasks = Vec::new();
        for first in (0..self.points.len()).step_by(CHUNK) {
            let rows = first..(first + CHUNK).min(self.points.len());
            let groups = self.starts[rows.end] - self.starts[rows.start];
            let weights = rest.each_mut().map(|rest| {
                let groups = groups.min(rest.len());
                rest.split_off_mut(..groups).unwrap_or_default()
            });
            tasks.push((rows, weights));
        }
        tasks.into_par_iter().for_each(|(rows, mut weights)| {
            let first = self.starts[rows.start];
            for row in rows {
                let i = self.points[row];
                for group in self.starts[row]..self.starts[row + 1] {
                    let neighbours = self.neighbours.indices(group);
                    for (lane, j) in neighbours.iter().enumerate() {
                        if *j == i {
                            continue;
                        }
                        let offset = offset(i as usize, *j as usize);
                        for (end, weights) in weights.iter_mut().enumerate().take(ends) {
                            weights[group - first].0[lane] = weight(end, offset);
                        }
                    }
                }
            }
        });
        for (target, weights) in self.weights.iter_mut().zip(all).take(ends) {
            *target = Some(weights);
        }
    }

    /// Memory of the weights, bytes. `ends` is the number of ends whose weights are stored: 1 if both ends
    /// use the same stored weights, otherwise 2.
    pub fn weight_bytes(&self, ends: usize) -> u64 {
        (ends * self.neighbours.len() * size_of::<Lanes>()) as u64
    }

    /// Make a bond unbreakable if `protected` is true for the local index of one of its ends.
    pub fn protect(&mut self, protected: impl Fn(usize) -> bool) {
        let all = || vec![u8::MAX; self.neighbours.len()];
        let mut breakable = self.store.breakable.take().unwrap_or_else(all);
        for row in 0..self.points.len() {
            let protected_i = protected(self.points[row] as usize);
            for group in self.starts[row]..self.starts[row + 1] {
                for (k, j) in self.neighbours.indices(group).iter().enumerate() {
                    if protected_i || protected(*j as usize) {
                        breakable[group] &= !(1 << k);
                    }
                }
            }
        }
        self.store.breakable = Some(breakable);
    }

    /// See [`super::BlockBonds::cut`].
    pub fn cut(&mut self, selected: impl Fn(usize) -> bool, cut: impl Fn(usize, usize) -> bool) {
        for row in 0..self.points.len() {
            let i = self.points[row];
            if !selected(i as usize) {
                continue;
            }
            for group in self.starts[row]..self.starts[row + 1] {
                for (k, j) in self.neighbours.indices(group).iter().enumerate() {
                    if *j != i && cut(i as usize, *j as usize) {
                        self.store.intact[group] &= !(1 << k);
                    }
                }
            }
        }
    }

    /// See [`super::BlockBonds::for_each_intact`].
    pub fn for_each_intact(&self, visit: &mut impl FnMut(usize, usize)) {
        for row in 0..self.points.len() {
            for group in self.starts[row]..self.starts[row + 1] {
                for (k, j) in self.neighbours.indices(group).iter().enumerate() {
                    if self.store.intact[group] >> k & 1 == 1 {
                        visit(self.points[row] as usize, *j as usize);
                    }
                }
            }
        }
    }

    /// See [`super::BlockBonds::for_each_neighbour`].
    pub fn for_each_neighbour(&self, point: usize, visit: &mut impl FnMut(usize)) {
        let Ok(row) = self.points.binary_search(&(point as u32)) else {
            return;
        };
        for group in self.starts[row]..self.starts[row + 1] {
            for (k, j) in self.neighbours.indices(group).iter().enumerate() {
                if self.store.intact[group] >> k & 1 == 1 {
                    visit(*j as usize);
                }
            }
        }
    }

    /// See [`super::BlockBonds::for_each_broken`].
    pub fn for_each_broken(&self, visit: &mut impl FnMut(usize, usize)) {
        for row in 0..self.points.len() {
            let i = self.points[row];
            let groups = self.starts[row]..self.starts[row + 1];
            for group in groups.filter(|group| self.store.intact[*group] != u8::MAX) {
                for (k, j) in self.neighbours.indices(group).iter().enumerate() {
                    if *j != i && self.store.intact[group] >> k & 1 == 0 {
                        visit(i as usize, *j as usize);
                    }
                }
            }
        }
    }

    /// Call `visit(row, point, bytes)` for each row. The arguments are the index of the row, the local index
    /// of its point, and the number of bytes that [`Self::save_row`] writes for the row.
    pub fn for_each_row(&self, mut visit: impl FnMut(usize, usize, usize)) {
        let bytes = 1 + WIDTH * self.store.history_bytes_per_bond();
        for (row, point) in self.points.iter().enumerate() {
            let groups = self.starts[row + 1] - self.starts[row];
            visit(row, *point as usize, groups * bytes);
        }
    }

    /// Write the checkpoint data of a row to `bytes`. For each group of bonds, the intact bits come first,
    /// then the history of each bond.
    pub fn save_row(&self, row: usize, bytes: &mut [u8]) {
        let width = self.store.history_bytes_per_bond();
        let groups = self.starts[row]..self.starts[row + 1];
        for (group, bytes) in groups.zip(bytes.chunks_exact_mut(1 + WIDTH * width)) {
            bytes[0] = self.store.intact[group];
            for lane in 0..WIDTH {
                let range = 1 + lane * width..1 + (lane + 1) * width;
                self.store.save_history(group, lane, &mut bytes[range]);
            }
        }
    }

    /// Restore the row that [`Self::save_row`] wrote.
    pub fn restore_row(&mut self, row: usize, bytes: &[u8]) {
        let width = self.store.history_bytes_per_bond();
        let groups = self.starts[row]..self.starts[row + 1];
        for (group, bytes) in groups.zip(bytes.chunks_exact(1 + WIDTH * width)) {
            self.store.intact[group] = bytes[0];
            for lane in 0..WIDTH {
                let range = 1 + lane * width..1 + (lane + 1) * width;
                self.store.restore_history(group, lane, &bytes[range]);
            }
        }
    }

    /// Memory, bytes.
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

    /// Whether the range has no rows.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// The local index of a row's point.
    pub fn point(&self, row: usize) -> usize {
        self.points[row] as usize
    }

    /// Split before `row`.
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

    /// Return the row with index `row`.
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
    /// Return one byte for a group. Bit k is set if lane k has a bond, intact or broken, and clear if lane k
    /// is padding.
    #[inline(always)]
    pub fn whole(&self, group: usize) -> u8 {
        let mut bits = 0;
        for (k, j) in self.neighbours.group(group).indices().iter().enumerate() {
            bits |= u8::from(*j as usize != self.point) << k;
        }
        bits
    }
}
