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
mod offset;
mod search;
mod vectors;
mod volume;

pub use arrange::arrange;
pub use fault::{Fault, MOST_NEIGHBOURS};
pub use find::find;
pub use grid::{Grid, GridFrame, Which};
pub use lattice::BondLattice;
pub use list::{BondList, Row, Rows};
pub use offset::{Offset, most_neighbours};
pub use search::cutoff;
use search::search;
pub use vectors::{Adjacent, Vectors};
pub use volume::CellShare;

/// The bonds from points of one block to points of one block.
#[derive(Debug, Clone)]
pub enum Family {
    /// Of any cloud of points.
    List(BondList),
    /// Of points on a regular grid.
    Lattice(BondLattice),
}

/// Runs code for whichever storage a family has.
macro_rules! with {
    ($family:expr, $bonds:ident => $body:expr) => {
        match $family {
            Family::List($bonds) => $body,
            Family::Lattice($bonds) => $body,
        }
    };
}

impl Family {
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

    /// Breaks the bonds for which `cut` (of the two local indices) holds.
    pub fn cut(&mut self, cut: impl Fn(usize, usize) -> bool) {
        with!(self, bonds => bonds.cut(cut));
    }

    /// Calls `found` with the local indices of both ends of every intact bond.
    pub fn for_each_intact(&self, found: &mut impl FnMut(usize, usize)) {
        with!(self, bonds => bonds.for_each_intact(found));
    }

    /// Calls `found` with each point that has bonds here and the number of bytes that say which are
    /// intact. These bytes are the same on any number of ranks.
    pub fn row_lengths(&self, mut found: impl FnMut(usize, usize)) {
        match self {
            Self::List(list) => list
                .intact_rows()
                .for_each(|(point, row)| found(point, row.len())),
            Self::Lattice(lattice) => {
                let length = lattice.row_length();
                lattice.for_each_point(|point, _, _| found(point, length));
            }
        }
    }

    /// Copies each point's bytes to where `next` says, and moves `next` on.
    pub fn save(&self, next: &mut [usize], bytes: &mut [u8]) {
        match self {
            Self::List(list) => {
                for (point, row) in list.intact_rows() {
                    bytes[next[point]..next[point] + row.len()].copy_from_slice(row);
                    next[point] += row.len();
                }
            }
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
                for (point, row) in list.intact_rows_mut() {
                    row.copy_from_slice(&bytes[next[point]..next[point] + row.len()]);
                    next[point] += row.len();
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
