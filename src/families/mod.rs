//! Families: which points are bonded to which.
//!
//! Bonds are kept per ordered pair of blocks, so that one law serves a whole list, and each row is
//! sorted by global id, so that every sum over a family is the same sequence of operations on any
//! number of ranks and threads.

mod list;
mod search;
mod volume;

pub use list::{BondList, Row, Rows};
pub use search::{cutoff, search};
pub use volume::CellShare;
