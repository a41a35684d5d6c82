//! Lattice families: on a regular grid, all points have neighbours at the same offsets. A bond is stored as
//! one bit, without a neighbour index. Up to eight points adjacent along x form a lane group.

use std::ops::Range;
use std::sync::Arc;

use rayon::prelude::*;

use crate::lanes::WIDTH;
use crate::memory::check_room;
use crate::partition::Domain;

use super::fault::Fault;
use super::grid::Grid;
use super::offset::{Offset, offsets};
use super::store::{Store, bit_bytes};
use super::vectors::{LatticeTables, Vector, Vectors, vectors};

/// Number of lane groups that one task sets up.
const CHUNK: usize = 256;

/// The bonds from the points i of a block to the points j of the same block or of another block. All these
/// points are on the same grid.
#[derive(Debug, Clone)]
pub struct BondLattice {
    /// Block of the points i, whose sums run over these bonds.
    pub block_i: usize,
    /// Block of the neighbours j.
    pub block_j: usize,
    /// Index of the grid among all grids.
    pub index: usize,
    /// The layout of the grid.
    pub grid: Arc<Grid>,
    /// Volume of each point j, m³.
    pub volume: f64,
    /// Volume of each point i, m³.
    pub own_volume: f64,
    offsets: Vec<Offset>,
    /// Whether weights may differ from 1, and whether the weights of j may differ from the weights of i.
    weighted: [bool; 2],
    /// The lane groups, sorted by local index.
    vectors: Vec<Vector>,
    /// Offsets from the line of a point to the lines that contain its neighbours, in y and z, in steps.
    line_offsets: Vec<[i64; 2]>,
    /// Shift for each line of the grid and each line offset. The offset leads from this line to another line.
    /// The slot of a point in this line, plus the shift, is the slot at the same x in the other line.
    shifts: Vec<i32>,
    /// State of the bonds: a group of eight bonds for each lane group and offset.
    pub(super) store: Store,
    bonds: u64,
}

impl BondLattice {
    /// Build the bonds, up to a length `cutoff` (m), between two blocks on a grid.
    ///
    /// # Errors
    /// If memory is insufficient.
    pub fn new(
        index: usize,
        grid: Arc<Grid>,
        domain: &Domain,
        blocks: [usize; 2],
        cutoff: f64,
        dimension: usize,
    ) -> Result<Self, Fault> {
        let (offsets, line_offsets) = offsets(grid.frame.spacing, cutoff, domain.extent, dimension);
        // If the cutoff is below the spacing, there are no offsets.
        let none = offsets.is_empty();
        let vectors = if none { Vec::new() } else { vectors(&grid) };
        let shift_bytes = size_of::<i32>() * grid.lines.len() * line_offsets.len();
        let bytes = shift_bytes as u64 + vectors.len() as u64 * offsets.len() as u64;
        check_room(bytes).map_err(|shortage| Fault::TooLittleMemory { blocks, shortage })?;
        let mut shifts = vec![0; grid.lines.len() * line_offsets.len()];
        let origin = |line: &super::grid::Line| line.start as i64 - line.first;
        let of_lines = shifts.chunks_mut(line_offsets.len().max(1));
        for (index, (line, shifts)) in grid.lines.iter().zip(of_lines).enumerate() {
            for (offset, shift) in line_offsets.iter().zip(shifts) {
                // If there is no line at the offset, no bond uses the shift.
                if let Some(other) = grid.line_beside(index, *offset) {
                    *shift = (origin(other) - origin(line)) as i32;
                }
            }
        }
        let volume = |block: usize| {
            let of_block = |point: &&crate::points::Point| point.block as usize == block;
            let point = domain.points.iter().find(of_block);
            point.map_or(0.0, |point| point.volume)
        };
        let [block_i, block_j] = blocks;
        let mut lattice = Self {
            block_i,
            block_j,
            index,
            volume: volume(block_j),
            own_volume: volume(block_i),
            offsets,
            weighted: [false; 2],
            vectors,
            line_offsets,
            shifts,
            store: Store::default(),
            bonds: 0,
            grid,
        };
        lattice.find_bonds();
        Ok(lattice)
    }

    /// Set the bits of all bonds, and remove lane groups without bonds.
    fn find_bonds(&mut self) {
        let count = self.offsets.len().max(1);
        let mut intact = vec![0; self.vectors.len() * count];
        intact
            .par_chunks_mut(CHUNK * count)
            .zip(self.vectors.par_chunks(CHUNK))
            .for_each(|(bits, vectors)| {
                for (bits, vector) in bits.chunks_mut(count).zip(vectors) {
                    self.family(vector, bits);
                }
            });
        self.bonds = intact.iter().map(|bits| u64::from(bits.count_ones())).sum();
        let mut used = 0;
        for k in 0..self.vectors.len() {
            let bits = k * count..(k + 1) * count;
            let members = intact[bits.clone()].iter().fold(0, |all, bits| all | bits);
            if members != 0 {
                intact.copy_within(bits, used * count);
                self.vectors[used] = Vector {
                    members,
                    ..self.vectors[k]
                };
                used += 1;
            }
        }
        self.vectors.truncate(used);
        self.vectors.shrink_to_fit();
        intact.truncate(used * count);
        intact.shrink_to_fit();
        self.store.intact = intact;
    }

    /// Compute the bits of all bonds of a lane group; broken bonds are included.
    fn family(&self, vector: &Vector, bits: &mut [u8]) {
        let grid = &*self.grid;
        let line = &grid.lines[vector.line as usize];
        let x = line.first + vector.slot as i64 - line.start as i64;
        let mask_i = vector.members & mask(grid, vector.slot as usize, self.block_i);
        if mask_i == 0 {
            bits.fill(0);
            return;
        }
        let mut current = usize::MAX;
        let mut target = None;
        for (offset, bits) in self.offsets.iter().zip(bits) {
            if offset.line as usize != current {
                current = offset.line as usize;
                target = grid.line_beside(vector.line as usize, self.line_offsets[current]);
            }
            *bits = 0;
            let Some(target) = target else { continue };
            let first = x + i64::from(offset.x) - target.first;
            if first <= -(WIDTH as i64) || first >= target.length as i64 {
                continue;
            }
            let within = |k: i64| (0..target.length as i64).contains(&(first + k));
            let bit = |k: usize| u8::from(within(k as i64)) << k;
            let inside = if within(0) && within(WIDTH as i64 - 1) {
                u8::MAX
            } else {
                (0..WIDTH).fold(0, |all, k| all | bit(k))
            };
            let slot = (target.start as i64 + first) as usize;
            *bits = mask_i & inside & mask(grid, slot, self.block_j);
        }
    }

    /// Number of bonds, intact or broken.
    pub fn bonds(&self) -> u64 {
        self.bonds
    }

    /// Number of lane groups.
    pub fn len(&self) -> usize {
        self.vectors.len()
    }

    /// Whether the lattice has no bonds.
    pub fn is_empty(&self) -> bool {
        self.vectors.is_empty()
    }

    /// Number of bonds of a point whose family is complete.
    pub fn offsets(&self) -> usize {
        self.offsets.len()
    }

    /// Number of lane groups whose first points have local indices below `limit`.
    pub fn vectors_below(&self, limit: usize) -> usize {
        self.vectors
            .partition_point(|vector| (vector.point as usize) < limit)
    }

    /// Return a range of lane groups.
    pub fn vectors(&mut self, range: Range<usize>) -> Vectors<'_> {
        let count = self.offsets.len();
        let bits = range.start * count..range.end * count;
        Vectors {
            lattice: LatticeTables {
                offsets: &self.offsets,
                weighted: self.weighted,
                shifts: &self.shifts,
                lines: self.line_offsets.len(),
            },
            first: range.start,
            vectors: &self.vectors[range],
            groups: self.store.groups(bits),
        }
    }

    /// Set the weights of both ends (`end` = 0) or only of j (`end` = 1) to `weight(ξ)`, ξ in m.
    pub fn weigh(&mut self, end: usize, weight: impl Fn([f64; 3]) -> f64) {
        for offset in &mut self.offsets {
            offset.weights[end] = weight(offset.reference);
            if end == 0 {
                offset.weights[1] = offset.weights[0];
            }
        }
        self.weighted[end] = true;
    }

    /// Call `visit(group, lane, [i, j])` for each intact bond, with its group and lane in the store and the
    /// local indices i and j.
    fn for_each(&self, mut visit: impl FnMut(usize, usize, [usize; 2])) {
        for k in 0..self.vectors.len() {
            self.for_each_of(self.intact(k).iter().copied(), k, &mut visit);
        }
    }

    /// Return the bits that mark the intact bonds of the lane group with index `vector`: one byte per offset.
    fn intact(&self, vector: usize) -> &[u8] {
        let count = self.offsets.len();
        &self.store.intact[vector * count..(vector + 1) * count]
    }

    /// Call `visit(group, lane, [i, j])` as [`Self::for_each`] does, for each set bit of `bits`. `bits` has
    /// one byte per offset. Bit k of a byte stands for the bond in lane k of the lane group with index
    /// `vector`.
    fn for_each_of(
        &self,
        bits: impl Iterator<Item = u8>,
        vector: usize,
        visit: &mut impl FnMut(usize, usize, [usize; 2]),
    ) {
        let first = vector * self.offsets.len();
        let vector = &self.vectors[vector];
        let shifts = &self.shifts[vector.line as usize * self.line_offsets.len()..];
        let mut lookup = self.grid.lookup();
        for (o, (offset, mut bits)) in self.offsets.iter().zip(bits).enumerate() {
            while bits != 0 {
                let lane = bits.trailing_zeros() as usize;
                bits &= bits - 1;
                let shift = shifts[offset.line as usize] + offset.x;
                let slot = vector.slot as i64 + i64::from(shift) + lane as i64;
                let j = lookup.point(slot as usize);
                visit(first + o, lane, [vector.point as usize + lane, j]);
            }
        }
    }

    /// Index of the lane group whose range [`Self::points_of`] contains a point; `None` if no such range
    /// contains the point.
    fn vector_of(&self, point: usize) -> Option<usize> {
        let k = self.vectors_below(point + 1).checked_sub(1)?;
        (point < self.points_of(k).end).then_some(k)
    }

    /// Local indices of the points of a lane group, up to the last point with bonds.
    fn points_of(&self, vector: usize) -> Range<usize> {
        let vector = &self.vectors[vector];
        let first = vector.point as usize;
        first..first + WIDTH - vector.members.leading_zeros() as usize
    }

    /// See [`super::BlockBonds::lane_group`].
    pub fn lane_group(&self, point: usize) -> Range<usize> {
        self.vector_of(point)
            .map_or(point..point + 1, |vector| self.points_of(vector))
    }

    /// See [`super::BlockBonds::for_each_neighbour`].
    pub fn for_each_neighbour(&self, point: usize, visit: &mut impl FnMut(usize)) {
        if let Some(vector) = self.vector_of(point) {
            let lane = 1 << (point - self.vectors[vector].point as usize);
            let own = self.intact(vector).iter().map(|bits| bits & lane);
            self.for_each_of(own, vector, &mut |_, _, [_, j]| visit(j));
        }
    }

    /// Make a bond unbreakable if `protected` is true for the local index of one of its ends.
    pub fn protect(&mut self, protected: impl Fn(usize) -> bool) {
        let all = || vec![u8::MAX; self.store.intact.len()];
        let mut breakable = self.store.breakable.take().unwrap_or_else(all);
        self.for_each(|byte, lane, ends| {
            if ends.into_iter().any(&protected) {
                breakable[byte] &= !(1 << lane);
            }
        });
        self.store.breakable = Some(breakable);
    }

    /// See [`super::BlockBonds::cut`].
    pub fn cut(&mut self, selected: impl Fn(usize) -> bool, cut: impl Fn(usize, usize) -> bool) {
        let mut broken = Vec::new();
        for k in 0..self.vectors.len() {
            if self.points_of(k).any(&selected) {
                self.for_each_of(
                    self.intact(k).iter().copied(),
                    k,
                    &mut |byte, lane, [i, j]| {
                        if selected(i) && cut(i, j) {
                            broken.push((byte, lane));
                        }
                    },
                );
            }
        }
        for (byte, lane) in broken {
            self.store.intact[byte] &= !(1 << lane);
        }
    }

    /// See [`super::BlockBonds::for_each_intact`].
    pub fn for_each_intact(&self, visit: &mut impl FnMut(usize, usize)) {
        self.for_each(|_, _, [i, j]| visit(i, j));
    }

    /// See [`super::BlockBonds::for_each_broken`].
    pub fn for_each_broken(&self, visit: &mut impl FnMut(usize, usize)) {
        let mut broken = vec![0; self.offsets.len()];
        for (k, vector) in self.vectors.iter().enumerate() {
            let intact = self.intact(k);
            if intact.iter().all(|bits| *bits == u8::MAX) {
                continue;
            }
            self.family(vector, &mut broken);
            for (bits, intact) in broken.iter_mut().zip(intact) {
                *bits &= !intact;
            }
            self.for_each_of(broken.iter().copied(), k, &mut |_, _, [i, j]| visit(i, j));
        }
    }

    /// Length of the checkpoint row of a point, bytes.
    pub fn row_length(&self) -> usize {
        bit_bytes(self.offsets.len()) + self.offsets.len() * self.store.history_bytes_per_bond()
    }

    /// Call `visit(point, vector, lane)` for each point with bonds. The arguments are the local index of the
    /// point, the index of its lane group, and its lane.
    pub fn for_each_point(&self, mut visit: impl FnMut(usize, usize, usize)) {
        for (k, vector) in self.vectors.iter().enumerate() {
            for lane in (0..WIDTH).filter(|lane| vector.members >> lane & 1 == 1) {
                visit(vector.point as usize + lane, k, lane);
            }
        }
    }

    /// Write the checkpoint row of a point: the intact bits, then the history.
    pub fn save_row(&self, vector: usize, lane: usize, row: &mut [u8]) {
        let count = self.offsets.len();
        let (bits, numbers) = row.split_at_mut(bit_bytes(count));
        bits.fill(0);
        let width = self.store.history_bytes_per_bond();
        for o in 0..count {
            let group = vector * count + o;
            bits[o / 8] |= (self.store.intact[group] >> lane & 1) << (o % 8);
            let range = o * width..(o + 1) * width;
            self.store.save_history(group, lane, &mut numbers[range]);
        }
    }

    /// Restore the row that [`Self::save_row`] wrote.
    pub fn restore_row(&mut self, vector: usize, lane: usize, row: &[u8]) {
        let count = self.offsets.len();
        let (bits, numbers) = row.split_at(bit_bytes(count));
        let width = self.store.history_bytes_per_bond();
        for o in 0..count {
            let group = vector * count + o;
            let bit = bits[o / 8] >> (o % 8) & 1;
            let intact = &mut self.store.intact[group];
            *intact = *intact & !(1 << lane) | bit << lane;
            let range = o * width..(o + 1) * width;
            self.store.restore_history(group, lane, &numbers[range]);
        }
    }

    /// Compute one byte for each lane group and offset. Bit k of a byte is set if lane k has a bond, intact
    /// or broken.
    pub fn whole(&self) -> Vec<u8> {
        let count = self.offsets.len();
        let mut filled = vec![0; self.store.intact.len()];
        for (bits, vector) in filled.chunks_mut(count).zip(&self.vectors) {
            self.family(vector, bits);
        }
        filled
    }

    /// Memory of the lattice family without the memory of its grid, bytes.
    pub fn bytes(&self) -> usize {
        self.store.bytes() + size_of_val(&self.vectors[..]) + size_of_val(&self.shifts[..])
    }
}

/// Return one bit for each of the eight slots from `slot` on. A bit is 1 if its slot contains a point of the
/// block with the index `block`.
fn mask(grid: &Grid, slot: usize, block: usize) -> u8 {
    let blocks = &grid.blocks[slot..slot + WIDTH];
    let bit = |k: usize| u8::from(blocks[k] as usize == block) << k;
    (0..WIDTH).fold(0, |all, k| all | bit(k))
}
