//! The lattice family: points of a regular grid, whose neighbours lie at fixed offsets. No list of
//! neighbours is kept: a bond is one bit, and eight adjacent points along x are worked on together.

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
use super::vectors::{Shared, Vector, Vectors, vectors};

/// Vectors set up by one task.
const CHUNK: usize = 256;

/// The bonds from points of one block to points of one block on the same grid.
#[derive(Debug, Clone)]
pub struct BondLattice {
    /// Block of the points that sum over these bonds.
    pub here: usize,
    /// Block of their neighbours.
    pub there: usize,
    /// Which of the rank's grids they lie on.
    pub index: usize,
    /// That grid.
    pub grid: Arc<Grid>,
    /// Volume of each neighbour, m³.
    pub volume: f64,
    /// Volume of each point itself, m³.
    pub own_volume: f64,
    offsets: Vec<Offset>,
    /// Whether any weight of an offset is not 1, and whether those of the ends differ.
    weighted: [bool; 2],
    /// By local index.
    vectors: Vec<Vector>,
    /// y and z of the lines around, in steps.
    around: Vec<[i64; 2]>,
    /// For each line of the grid: how far from a place the place with the same x lies on each of the
    /// lines around.
    shifts: Vec<i32>,
    /// For each vector and offset what is kept of the bonds of the vector's points.
    pub(super) store: Store,
    bonds: u64,
}

impl BondLattice {
    /// The bonds between two blocks on a grid of `dimension` dimensions; `cutoff` (m) is the longest.
    ///
    /// # Errors
    /// When there is not enough memory for them.
    pub fn new(
        index: usize,
        grid: Arc<Grid>,
        domain: &Domain,
        blocks: [usize; 2],
        cutoff: f64,
        dimension: usize,
    ) -> Result<Self, Fault> {
        let (offsets, around) = offsets(grid.frame.spacing, cutoff, domain.extent, dimension);
        // A body whose points are farther apart than its bonds reach has none.
        let none = offsets.is_empty();
        let vectors = if none { Vec::new() } else { vectors(&grid) };
        let shift_bytes = size_of::<i32>() * grid.lines.len() * around.len();
        let bytes = shift_bytes as u64 + vectors.len() as u64 * offsets.len() as u64;
        check_room(bytes).map_err(|shortage| Fault::TooLittleMemory { blocks, shortage })?;
        let mut shifts = vec![0; grid.lines.len() * around.len()];
        let origin = |line: &super::grid::Line| line.start as i64 - line.first;
        for (line, shifts) in grid
            .lines
            .iter()
            .zip(shifts.chunks_mut(around.len().max(1)))
        {
            for ([y, z], shift) in around.iter().zip(shifts) {
                // Where there is no line there is no bond either, so any place will do.
                if let Some(other) = grid.line([line.at[0], line.at[1] + y, line.at[2] + z]) {
                    *shift = (origin(other) - origin(line)) as i32;
                }
            }
        }
        let volume = |block: usize| {
            let of_block = |point: &&crate::points::Point| point.block as usize == block;
            let point = domain.points.iter().find(of_block);
            point.map_or(0.0, |point| point.volume)
        };
        let [here, there] = blocks;
        let mut lattice = Self {
            here,
            there,
            index,
            volume: volume(there),
            own_volume: volume(here),
            offsets,
            weighted: [false; 2],
            vectors,
            around,
            shifts,
            store: Store::default(),
            bonds: 0,
            grid,
        };
        lattice.find_bonds();
        Ok(lattice)
    }

    /// Sets all bits of bonds and keeps the vectors that have any.
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
        let mut kept = 0;
        for k in 0..self.vectors.len() {
            let bits = k * count..(k + 1) * count;
            let members = intact[bits.clone()].iter().fold(0, |all, bits| all | bits);
            if members != 0 {
                intact.copy_within(bits, kept * count);
                self.vectors[kept] = Vector {
                    members,
                    ..self.vectors[k]
                };
                kept += 1;
            }
        }
        self.vectors.truncate(kept);
        self.vectors.shrink_to_fit();
        intact.truncate(kept * count);
        intact.shrink_to_fit();
        self.store.intact = intact;
    }

    /// The bits of a vector's bonds, broken ones included.
    fn family(&self, vector: &Vector, bits: &mut [u8]) {
        let grid = &*self.grid;
        let line = &grid.lines[vector.line as usize];
        let x = line.first + vector.place as i64 - line.start as i64;
        let own = vector.members & mask(grid, vector.place as usize, self.here);
        if own == 0 {
            bits.fill(0);
            return;
        }
        let mut around = usize::MAX;
        let mut target = None;
        for (offset, bits) in self.offsets.iter().zip(bits) {
            if offset.line as usize != around {
                around = offset.line as usize;
                let [y, z] = self.around[around];
                target = grid.line([line.at[0], line.at[1] + y, line.at[2] + z]);
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
            let place = (target.start as i64 + first) as usize;
            *bits = own & inside & mask(grid, place, self.there);
        }
    }

    /// All bonds, broken ones included.
    pub fn bonds(&self) -> u64 {
        self.bonds
    }

    /// Number of vectors.
    pub fn len(&self) -> usize {
        self.vectors.len()
    }

    /// Whether there is no bond.
    pub fn is_empty(&self) -> bool {
        self.vectors.is_empty()
    }

    /// Number of bonds of a point with a whole family.
    pub fn offsets(&self) -> usize {
        self.offsets.len()
    }

    /// Number of vectors whose points have local indices below `limit`.
    pub fn vectors_below(&self, limit: usize) -> usize {
        self.vectors
            .partition_point(|vector| (vector.point as usize) < limit)
    }

    /// The vectors of a range.
    pub fn vectors(&mut self, range: Range<usize>) -> Vectors<'_> {
        let count = self.offsets.len();
        let bits = range.start * count..range.end * count;
        Vectors {
            lattice: Shared {
                offsets: &self.offsets,
                weighted: self.weighted,
                shifts: &self.shifts,
                around: self.around.len(),
            },
            first: range.start,
            vectors: &self.vectors[range],
            groups: self.store.groups(bits),
        }
    }

    /// Sets what volumes are multiplied by in the sums of one end, 0 the own, 1 the far one: `weight` of an
    /// offset ξ (m).
    pub fn weigh(&mut self, end: usize, weight: impl Fn([f64; 3]) -> f64) {
        for offset in &mut self.offsets {
            offset.weights[end] = weight(offset.reference);
            if end == 0 {
                offset.weights[1] = offset.weights[0];
            }
        }
        self.weighted[end] = true;
    }

    /// Calls `found` with the index of the byte and the bit of each intact bond, and the local indices
    /// of both ends.
    fn for_each(&self, mut found: impl FnMut(usize, usize, [usize; 2])) {
        for k in 0..self.vectors.len() {
            self.for_each_of(self.intact(k), k, &mut found);
        }
    }

    /// The bits of a vector's intact bonds.
    fn intact(&self, vector: usize) -> &[u8] {
        let count = self.offsets.len();
        &self.store.intact[vector * count..(vector + 1) * count]
    }

    /// As [`Self::for_each`], of the bonds of one vector whose bits are given.
    fn for_each_of(
        &self,
        bits: &[u8],
        vector: usize,
        found: &mut impl FnMut(usize, usize, [usize; 2]),
    ) {
        let first = vector * self.offsets.len();
        let vector = &self.vectors[vector];
        let shifts = &self.shifts[vector.line as usize * self.around.len()..];
        let mut lookup = self.grid.lookup();
        for (o, (offset, bits)) in self.offsets.iter().zip(bits).enumerate() {
            let mut bits = *bits;
            while bits != 0 {
                let lane = bits.trailing_zeros() as usize;
                bits &= bits - 1;
                let shift = shifts[offset.line as usize] + offset.x;
                let place = vector.place as i64 + i64::from(shift) + lane as i64;
                let there = lookup.point(place as usize);
                found(first + o, lane, [vector.point as usize + lane, there]);
            }
        }
    }

    /// The vector that a point is one of, if it has bonds here.
    fn vector_of(&self, point: usize) -> Option<usize> {
        let k = self.vectors_below(point + 1).checked_sub(1)?;
        (point < self.points_of(k).end).then_some(k)
    }

    /// The points from the first of a vector to the last one that has bonds here.
    fn points_of(&self, vector: usize) -> Range<usize> {
        let vector = &self.vectors[vector];
        let first = vector.point as usize;
        first..first + WIDTH - vector.members.leading_zeros() as usize
    }

    /// See [`super::BlockBonds::together`].
    pub fn lane_group(&self, point: usize) -> Range<usize> {
        self.vector_of(point)
            .map_or(point..point + 1, |vector| self.points_of(vector))
    }

    /// See [`super::BlockBonds::for_each_neighbour`].
    pub fn for_each_neighbour(&self, point: usize, found: &mut impl FnMut(usize)) {
        if let Some(vector) = self.vector_of(point) {
            self.for_each_of(self.intact(vector), vector, &mut |_, _, [here, there]| {
                if here == point {
                    found(there);
                }
            });
        }
    }

    /// Makes the bonds unbreakable that have an end for which `protected` (by local index) holds.
    pub fn protect(&mut self, protected: impl Fn(usize) -> bool) {
        let mut breakable = vec![u8::MAX; self.store.intact.len()];
        self.for_each(|byte, lane, ends| {
            if ends.into_iter().any(&protected) {
                breakable[byte] &= !(1 << lane);
            }
        });
        self.store.breakable = Some(breakable);
    }

    /// See [`super::BlockBonds::cut`].
    pub fn cut(&mut self, concerned: impl Fn(usize) -> bool, cut: impl Fn(usize, usize) -> bool) {
        let mut gone = Vec::new();
        for k in 0..self.vectors.len() {
            if self.points_of(k).any(&concerned) {
                self.for_each_of(self.intact(k), k, &mut |byte, lane, [here, there]| {
                    if concerned(here) && cut(here, there) {
                        gone.push((byte, lane));
                    }
                });
            }
        }
        for (byte, lane) in gone {
            self.store.intact[byte] &= !(1 << lane);
        }
    }

    /// Calls `found` with the local indices of both ends of every intact bond.
    pub fn for_each_intact(&self, found: &mut impl FnMut(usize, usize)) {
        self.for_each(|_, _, [here, there]| found(here, there));
    }

    /// Calls `found` with the local indices of both ends of every broken bond.
    pub fn for_each_broken(&self, found: &mut impl FnMut(usize, usize)) {
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
            self.for_each_of(&broken, k, &mut |_, _, [here, there]| found(here, there));
        }
    }

    /// Bytes of a checkpoint that the bonds of a point take.
    pub fn row_length(&self) -> usize {
        bit_bytes(self.offsets.len()) + self.offsets.len() * self.store.number_bytes()
    }

    /// Calls `row` with the local index of each point and the number of the vector and lane that it
    /// is.
    pub fn for_each_point(&self, mut row: impl FnMut(usize, usize, usize)) {
        for (k, vector) in self.vectors.iter().enumerate() {
            for lane in (0..WIDTH).filter(|lane| vector.members >> lane & 1 == 1) {
                row(vector.point as usize + lane, k, lane);
            }
        }
    }

    /// Copies what is kept of a point's bonds to bytes: first all bits, then the numbers.
    pub fn save_row(&self, vector: usize, lane: usize, row: &mut [u8]) {
        let count = self.offsets.len();
        let (bits, numbers) = row.split_at_mut(bit_bytes(count));
        bits.fill(0);
        let width = self.store.number_bytes();
        for o in 0..count {
            let group = vector * count + o;
            bits[o / 8] |= (self.store.intact[group] >> lane & 1) << (o % 8);
            let place = o * width..(o + 1) * width;
            self.store.save_numbers(group, lane, &mut numbers[place]);
        }
    }

    /// Puts back what [`Self::save_row`] gave.
    pub fn restore_row(&mut self, vector: usize, lane: usize, row: &[u8]) {
        let count = self.offsets.len();
        let (bits, numbers) = row.split_at(bit_bytes(count));
        let width = self.store.number_bytes();
        for o in 0..count {
            let group = vector * count + o;
            let bit = bits[o / 8] >> (o % 8) & 1;
            let intact = &mut self.store.intact[group];
            *intact = *intact & !(1 << lane) | bit << lane;
            let place = o * width..(o + 1) * width;
            self.store.restore_numbers(group, lane, &numbers[place]);
        }
    }

    /// A byte for each vector and offset with a bit for each bond, broken or not.
    pub fn whole(&self) -> Vec<u8> {
        let count = self.offsets.len();
        let mut filled = vec![0; self.store.intact.len()];
        for (bits, vector) in filled.chunks_mut(count).zip(&self.vectors) {
            self.family(vector, bits);
        }
        filled
    }

    /// Memory that the lattice takes beside its grid, bytes.
    pub fn bytes(&self) -> usize {
        self.store.bytes() + size_of_val(&self.vectors[..]) + size_of_val(&self.shifts[..])
    }
}

/// A bit for each of eight places with a point of a block.
fn mask(grid: &Grid, place: usize, block: usize) -> u8 {
    let blocks = &grid.blocks[place..place + WIDTH];
    let bit = |k: usize| u8::from(blocks[k] as usize == block) << k;
    (0..WIDTH).fold(0, |all, k| all | bit(k))
}
