//! Up to eight adjacent points of a lattice, which are worked on together, and ranges of them.

use std::ops::Range;

use crate::lanes::WIDTH;

use super::grid::Grid;
use super::offset::Offset;
use super::store::Groups;

/// Up to eight adjacent points: the first one's place and local index; the others follow.
#[derive(Debug, Clone, Copy)]
pub(super) struct Vector {
    pub(super) place: u32,
    pub(super) point: u32,
    pub(super) line: u32,
    /// A bit for each of the points that has a neighbour.
    pub(super) members: u8,
}

/// The bonds of up to eight adjacent points.
pub struct VectorBonds<'a> {
    /// The first point's place on the grid.
    pub place: usize,
    /// Its local index.
    pub point: usize,
    /// A bit for each of the points that has a neighbour.
    pub members: u8,
    /// Where its bits stand among those of all vectors.
    pub bits: Range<usize>,
    /// The offsets.
    pub offsets: &'a [Offset],
    /// What is kept of the bonds; a group for each offset.
    pub groups: Groups<'a>,
    /// Whether any weight is not 1, and whether those of the ends differ.
    pub weighted: [bool; 2],
    shifts: &'a [i32],
}

/// A range of vectors that can be split between threads.
pub struct Vectors<'a> {
    pub(super) lattice: Shared<'a>,
    pub(super) vectors: &'a [Vector],
    /// Number of the first one.
    pub(super) first: usize,
    pub(super) groups: Groups<'a>,
}

/// What all vectors of a lattice share.
#[derive(Clone, Copy)]
pub(super) struct Shared<'a> {
    pub(super) offsets: &'a [Offset],
    pub(super) weighted: [bool; 2],
    pub(super) shifts: &'a [i32],
    pub(super) around: usize,
}

/// The vectors of a grid by local index; all their points are members.
pub(super) fn vectors(grid: &Grid) -> Vec<Vector> {
    let mut vectors: Vec<Vector> = Vec::new();
    let mut line = 0;
    let mut length = 0;
    for (place, point) in grid.owned() {
        while place >= grid.lines[line].start + grid.lines[line].length {
            line += 1;
        }
        match vectors.last_mut() {
            Some(vector)
                if (length as usize) < WIDTH
                    && vector.line as usize == line
                    && vector.place + length == place as u32
                    && vector.point + length == point =>
            {
                vector.members |= 1 << length;
                length += 1;
            }
            _ => {
                length = 1;
                vectors.push(Vector {
                    place: place as u32,
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
    /// Number of vectors.
    pub fn len(&self) -> usize {
        self.vectors.len()
    }

    /// Whether there is no vector.
    pub fn is_empty(&self) -> bool {
        self.vectors.is_empty()
    }

    /// The local index of a vector's first point.
    pub fn point(&self, vector: usize) -> usize {
        self.vectors[vector].point as usize
    }

    /// The vectors before `vector` and those from it on.
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

    /// The bonds of one vector.
    #[inline(always)]
    pub fn vector(&mut self, vector: usize) -> VectorBonds<'_> {
        let Shared {
            offsets,
            weighted,
            shifts,
            around,
        } = self.lattice;
        let count = offsets.len();
        let all = (self.first + vector) * count..(self.first + vector + 1) * count;
        let bits = vector * count..(vector + 1) * count;
        let vector = &self.vectors[vector];
        VectorBonds {
            place: vector.place as usize,
            point: vector.point as usize,
            members: vector.members,
            bits: all,
            offsets,
            groups: self.groups.range(bits),
            weighted,
            shifts: &shifts[vector.line as usize * around..(vector.line as usize + 1) * around],
        }
    }
}

impl VectorBonds<'_> {
    /// The place of the first of the eight far ends at an offset, with seven more after it. Where
    /// none of the bonds exists it is meaningless, but still a place.
    ///
    /// # Safety
    /// The offset must be one of [`Self::offsets`].
    #[inline(always)]
    pub unsafe fn far(&self, offset: &Offset) -> usize {
        debug_assert!((offset.line as usize) < self.shifts.len());
        // SAFETY: the lines of own offsets are numbered from 0, and there is a shift for each.
        let shift = unsafe { *self.shifts.get_unchecked(offset.line as usize) };
        (self.place as isize + (shift + offset.x) as isize) as usize
    }
}
