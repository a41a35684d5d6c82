//! Lane groups of a lattice.
//!
//! A lane group is a group of up to eight points of a grid that are adjacent along x. Its points have
//! consecutive slots and consecutive local indices. The bonds of a lane group at one offset are computed
//! together, one point per lane. In the code, a lane group is a `Vector`.

use std::ops::Range;

use crate::lanes::WIDTH;

use super::grid::Grid;
use super::offset::Offset;
use super::store::Groups;

/// A lane group. Slot, local index and line belong to its first point.
#[derive(Debug, Clone, Copy)]
pub(super) struct Vector {
    pub(super) slot: u32,
    pub(super) point: u32,
    pub(super) line: u32,
    /// Mask of the points that have neighbours.
    pub(super) members: u8,
}

/// The bonds of a lane group.
pub struct VectorBonds<'a> {
    /// Slot of the first point.
    pub slot: usize,
    /// Local index of the first point.
    pub point: usize,
    /// Mask of the points that have neighbours.
    pub members: u8,
    /// Index range of this lane group's bytes in the vector that `BondLattice::whole` returns. The vector has
    /// one byte for each lane group and offset.
    pub bits: Range<usize>,
    /// The offsets of the lattice.
    pub offsets: &'a [Offset],
    /// State of the bonds, with one group per offset.
    pub groups: Groups<'a>,
    /// Whether weights may differ from 1, and whether the weights of j may differ from the weights of i.
    pub weighted: [bool; 2],
    shifts: &'a [i32],
}

/// A range of lane groups that can be split between threads.
pub struct Vectors<'a> {
    pub(super) lattice: LatticeTables<'a>,
    pub(super) vectors: &'a [Vector],
    /// Index, in the lattice, of the first lane group of this range.
    pub(super) first: usize,
    pub(super) groups: Groups<'a>,
}

/// The tables of a lattice that all its lane groups share.
#[derive(Clone, Copy)]
pub(super) struct LatticeTables<'a> {
    pub(super) offsets: &'a [Offset],
    pub(super) weighted: [bool; 2],
    pub(super) shifts: &'a [i32],
    /// Number of line offsets: the offsets in y and z of the lines that contain neighbours. `shifts` has this
    /// number of entries for each line of the grid.
    pub(super) lines: usize,
}

/// Create the lane groups of a grid, sorted by local index. Initially, the mask `members` of a lane group
/// contains all points of the lane group.
pub(super) fn vectors(grid: &Grid) -> Vec<Vector> {
    let mut vectors: Vec<Vector> = Vec::new();
    let mut line = 0;
    let mut length = 0;
    for (slot, point) in grid.owned() {
        while slot >= grid.lines[line].start + grid.lines[line].length {
            line += 1;
        }
        match vectors.last_mut() {
            Some(vector)
                if (length as usize) < WIDTH
                    && vector.line as usize == line
                    && vector.slot + length == slot as u32
                    && vector.point + length == point =>
            {
                vector.members |= 1 << length;
                length += 1;
            }
            _ => {
                length = 1;
                vectors.push(Vector {
                    slot: slot as u32,
                    point,
                    line: line as u32,
                    members: 1,
                });
            }
        }
    }
    vectors.sort_unstable_by_key(|vector| vector.point);
    vectors
}

impl<'a> Vectors<'a> {
    /// Number of lane groups in the range.
    pub fn len(&self) -> usize {
        self.vectors.len()
    }

    /// Whether the range has no lane groups.
    pub fn is_empty(&self) -> bool {
        self.vectors.is_empty()
    }

    /// Local index of the first point of a lane group.
    pub fn point(&self, vector: usize) -> usize {
        self.vectors[vector].point as usize
    }

    /// Split the range before the lane group with index `vector`.
    pub fn split_at(self, vector: usize) -> (Self, Self) {
        let bits = vector * self.lattice.offsets.len();
        let (vectors_a, vectors_b) = self.vectors.split_at(vector);
        let [groups_a, groups_b] = self.groups.split_at(bits);
        let first = Self {
            lattice: self.lattice,
            vectors: vectors_a,
            first: self.first,
            groups: groups_a,
        };
        let second = Self {
            lattice: self.lattice,
            vectors: vectors_b,
            first: self.first + vector,
            groups: groups_b,
        };
        (first, second)
    }

    /// Return the bonds of the lane group with index `vector`.
    #[inline(always)]
    pub fn vector(&mut self, vector: usize) -> VectorBonds<'_> {
        let LatticeTables {
            offsets,
            weighted,
            shifts,
            lines,
        } = self.lattice;
        let count = offsets.len();
        let all = (self.first + vector) * count..(self.first + vector + 1) * count;
        let bits = vector * count..(vector + 1) * count;
        let vector = &self.vectors[vector];
        VectorBonds {
            slot: vector.slot as usize,
            point: vector.point as usize,
            members: vector.members,
            bits: all,
            offsets,
            groups: self.groups.range(bits),
            weighted,
            shifts: &shifts[vector.line as usize * lines..(vector.line as usize + 1) * lines],
        }
    }
}

impl VectorBonds<'_> {
    /// The slot of the first of the eight neighbours at an offset. The eight neighbours have consecutive
    /// slots. All eight slots are in bounds even if none of the eight bonds exists.
    ///
    /// # Safety
    /// The offset must be an element of [`Self::offsets`].
    #[inline(always)]
    pub unsafe fn far(&self, offset: &Offset) -> usize {
        debug_assert!((offset.line as usize) < self.shifts.len());
        // SAFETY: `offset.line` is the index of a line offset, and each line offset has a shift.
        let shift = unsafe { *self.shifts.get_unchecked(offset.line as usize) };
        (self.slot as isize + (shift + offset.x) as isize) as usize
    }
}
