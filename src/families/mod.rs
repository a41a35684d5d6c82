//! Families: the bonds between points.
//!
//! Bonds are stored per ordered pair of blocks. Therefore each [`BlockBonds`] has one law for all points i
//! and one law for all points j. In lists, the bonds of a point are sorted by the global id of the neighbour;
//! in lattices, they are sorted by offset. Therefore the sum over the bonds of a point has the same order of
//! operations on any number of ranks.

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
pub use volume::VolumeFactors;

/// The bonds from the points i of a block to the points j of the same block or of another block.
#[derive(Debug, Clone)]
pub enum BlockBonds {
    /// Neighbour lists, for any cloud of points.
    List(BondList),
    /// Bit masks by lattice offset, for points on a regular grid.
    Lattice(BondLattice),
}

/// Evaluate the same expression for both types of bond storage.
macro_rules! with {
    ($all:expr, $bonds:ident => $body:expr) => {
        match $all {
            BlockBonds::List($bonds) => $body,
            BlockBonds::Lattice($bonds) => $body,
        }
    };
}

impl BlockBonds {
    /// Indices of two blocks: the block of the points i, whose sums run over these bonds, and the block of
    /// the points j.
    pub fn blocks(&self) -> [usize; 2] {
        with!(self, bonds => [bonds.block_i, bonds.block_j])
    }

    /// Number of bonds ij, intact or broken. A bond between two owned points of one block counts twice, as ij
    /// and as ji.
    pub fn bonds(&self) -> u64 {
        with!(self, bonds => bonds.bonds())
    }

    /// Memory, bytes.
    pub fn bytes(&self) -> usize {
        with!(self, bonds => bonds.bytes())
    }

    /// Make a bond unbreakable if `protected` is true for the local index of one of its ends.
    pub fn protect(&mut self, protected: impl Fn(usize) -> bool) {
        with!(self, bonds => bonds.protect(protected));
    }

    /// Break the bonds ij for which `selected(i)` and `cut(i, j)` are true; i and j are local indices.
    pub fn cut(&mut self, selected: impl Fn(usize) -> bool, cut: impl Fn(usize, usize) -> bool) {
        with!(self, bonds => bonds.cut(selected, cut));
    }

    /// Call `visit(i, j)` for every intact bond ij of each point i; i and j are local indices. A bond between
    /// two owned points of the same block is visited twice, as (i, j) and (j, i).
    pub fn for_each_intact(&self, visit: &mut impl FnMut(usize, usize)) {
        with!(self, bonds => bonds.for_each_intact(visit));
    }

    /// For each intact bond of an owned point, call `visit(j)` with the local index of the neighbour j.
    pub fn for_each_neighbour(&self, point: usize, visit: &mut impl FnMut(usize)) {
        with!(self, bonds => bonds.for_each_neighbour(point, visit));
    }

    /// The range of owned points whose bonds are computed together with the bonds of a point. In a lattice,
    /// the range contains the points of this point's lane group, up to the last point with bonds. In a list,
    /// or for a point without bonds, the range contains this point only.
    pub fn lane_group(&self, point: usize) -> Range<usize> {
        match self {
            Self::List(_) => point..point + 1,
            Self::Lattice(lattice) => lattice.lane_group(point),
        }
    }

    /// Call `visit(i, j)` for every broken bond ij of each point i; i and j are local indices. A bond between
    /// two owned points of the same block is visited twice, as (i, j) and (j, i).
    pub fn for_each_broken(&self, visit: &mut impl FnMut(usize, usize)) {
        with!(self, bonds => bonds.for_each_broken(visit));
    }

    /// Allocate `width` history values per bond, set to 0.
    pub fn allocate_history(&mut self, width: usize) {
        with!(self, bonds => bonds.store.allocate_history(width));
    }

    /// The state of the bonds.
    pub fn store(&self) -> &Store {
        with!(self, bonds => &bonds.store)
    }

    /// The state of the bonds.
    pub fn store_mut(&mut self) -> &mut Store {
        with!(self, bonds => &mut bonds.store)
    }

    /// Call `visit(i, bytes)` for each point with bonds. `i` is the local index of the point, and `bytes` is
    /// the length of its checkpoint row. The rows do not depend on the number of ranks.
    pub fn row_lengths(&self, mut visit: impl FnMut(usize, usize)) {
        match self {
            Self::List(list) => list.for_each_row(|_, point, length| visit(point, length)),
            Self::Lattice(lattice) => {
                let length = lattice.row_length();
                lattice.for_each_point(|point, _, _| visit(point, length));
            }
        }
    }

    /// For each point with bonds, write the checkpoint row at `bytes[next[point]..]`, and advance
    /// `next[point]` by the length of the row. `point` is the local index of the point.
    pub fn save(&self, next: &mut [usize], bytes: &mut [u8]) {
        match self {
            Self::List(list) => list.for_each_row(|row, point, length| {
                list.save_row(row, &mut bytes[next[point]..next[point] + length]);
                next[point] += length;
            }),
            Self::Lattice(lattice) => {
                let length = lattice.row_length();
                lattice.for_each_point(|point, vector, lane| {
                    let range = next[point]..next[point] + length;
                    lattice.save_row(vector, lane, &mut bytes[range]);
                    next[point] += length;
                });
            }
        }
    }

    /// Restore the rows that [`Self::save`] wrote, and advance `next` as [`Self::save`] does.
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
                    let range = next[point]..next[point] + length;
                    lattice.restore_row(vector, lane, &bytes[range]);
                    next[point] += length;
                }
            }
        }
    }
}
