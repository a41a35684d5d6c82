//! Families: which points are bonded to which.
//!
//! Bonds are kept per ordered pair of blocks, so that one law serves all of a family. The sum over a
//! point's bonds is the same sequence of operations on any number of ranks: a list is sorted by
//! global id, a lattice by offset.

mod arrange;
mod fault;
mod find;
mod grid;
mod lattice;
mod list;
mod neighbours;
mod offset;
mod search;
mod store;
mod vectors;
mod volume;

use std::ops::Range;

pub use arrange::arrange;
pub use fault::{Fault, MOST_NEIGHBOURS};
pub use find::find;
pub use grid::{Grid, GridFrame, Which};
pub use lattice::BondLattice;
pub use list::{BondList, Row, Rows};
pub use offset::{Offset, most_neighbours};
pub use search::cutoff;
use search::search;
pub use store::{Groups, Store};
pub use vectors::{VectorBonds, Vectors};
pub use volume::CellShare;

/// The bonds from points of one block to points of one block.
#[derive(Debug, Clone)]
pub enum BlockBonds {
    /// Of any cloud of points.
    List(BondList),
    /// Of points on a regular grid.
    Lattice(BondLattice),
}

/// Runs code for whichever storage bonds have.
macro_rules! with {
    ($all:expr, $bonds:ident => $body:expr) => {
        match $all {
            BlockBonds::List($bonds) => $body,
            BlockBonds::Lattice($bonds) => $body,
        }
    };
}

impl BlockBonds {
    /// The blocks of the points that sum over these bonds, and of their neighbours.
    pub fn blocks(&self) -> [usize; 2] {
        with!(self, bonds => [bonds.here, bonds.there])
    }

    /// All bonds, each counted from its end here, broken ones included.
    pub fn bonds(&self) -> u64 {
        with!(self, bonds => bonds.bonds())
    }

    /// Memory, bytes.
    pub fn bytes(&self) -> usize {
        with!(self, bonds => bonds.bytes())
    }

    /// Makes the bonds unbreakable that have an end for which `protected` (by local index) holds.
    pub fn protect(&mut self, protected: impl Fn(usize) -> bool) {
        with!(self, bonds => bonds.protect(protected));
    }

    /// Breaks the bonds for which `cut` (of the two local indices) holds, of those points (by local index) that
    /// are concerned.
    pub fn cut(&mut self, concerned: impl Fn(usize) -> bool, cut: impl Fn(usize, usize) -> bool) {
        with!(self, bonds => bonds.cut(concerned, cut));
    }

    /// Calls `found` with the local indices of both ends of every intact bond.
    pub fn for_each_intact(&self, found: &mut impl FnMut(usize, usize)) {
        with!(self, bonds => bonds.for_each_intact(found));
    }

    /// Calls `found` with the local index of the far end of every intact bond of an owned point.
    pub fn for_each_neighbour(&self, point: usize, found: &mut impl FnMut(usize)) {
        with!(self, bonds => bonds.for_each_neighbour(point, found));
    }

    /// The owned points, one after the other, whose bonds here are worked on together with those of a
    /// point.
    pub fn lane_group(&self, point: usize) -> Range<usize> {
        match self {
            Self::List(_) => point..point + 1,
            Self::Lattice(lattice) => lattice.lane_group(point),
        }
    }

    /// Calls `found` with the local indices of both ends of every broken bond.
    pub fn for_each_broken(&self, found: &mut impl FnMut(usize, usize)) {
        with!(self, bonds => bonds.for_each_broken(found));
    }

    /// Gives every bond so many numbers, which are 0.
    pub fn allocate_history(&mut self, numbers: usize) {
        with!(self, bonds => bonds.store.allocate_history(numbers));
    }

    /// What is kept of the bonds.
    pub fn store(&self) -> &Store {
        with!(self, bonds => &bonds.store)
    }

    /// What is kept of the bonds.
    pub fn store_mut(&mut self) -> &mut Store {
        with!(self, bonds => &mut bonds.store)
    }

    /// Calls `found` with each point that has bonds here and the number of bytes of a checkpoint that
    /// they take. These bytes are the same on any number of ranks.
    pub fn row_lengths(&self, mut found: impl FnMut(usize, usize)) {
        match self {
            Self::List(list) => list.for_each_row(|_, point, length| found(point, length)),
            Self::Lattice(lattice) => {
                let length = lattice.row_length();
                lattice.for_each_point(|point, _, _| found(point, length));
            }
        }
    }

    /// Copies each point's bytes to where `next` says, and moves `next` on.
    pub fn save(&self, next: &mut [usize], bytes: &mut [u8]) {
        match self {
            Self::List(list) => list.for_each_row(|row, point, length| {
                list.save_row(row, &mut bytes[next[point]..next[point] + length]);
                next[point] += length;
            }),
            Self::Lattice(lattice) => {
                let length = lattice.row_length();
                lattice.for_each_point(|point, vector, lane| {
                    let place = next[point]..next[point] + length;
                    lattice.save_row(vector, lane, &mut bytes[place]);
                    next[point] += length;
                });
            }
        }
    }

    /// Puts back what [`Self::save`] gave.
    pub fn restore(&mut self, next: &mut [usize], bytes: &[u8]) {
        match self {
            Self::List(list) => {
                let mut rows = Vec::new();
                list.for_each_row(|row, point, length| rows.push((row, point, length)));
                for (row, point, length) in rows {
                    list.restore_row(row, &bytes[next[point]..next[point] + length]);
                    next[point] += length;
                }
            }
            Self::Lattice(lattice) => {
                let length = lattice.row_length();
                let mut points = Vec::new();
                lattice.for_each_point(|point, vector, lane| points.push((point, vector, lane)));
                for (point, vector, lane) in points {
                    let place = next[point]..next[point] + length;
                    lattice.restore_row(vector, lane, &bytes[place]);
                    next[point] += length;
                }
            }
        }
    }
}
