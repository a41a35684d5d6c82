//! Result files and checkpoints in HDF5, written collectively. The only other folder that calls HDF5 is
//! `mesh`, which reads meshes.
//!
//! A result file has the VTKHDF layout and contains a history. An XDMF side-car is written for older viewers.

mod access;
mod attribute;
mod changing;
pub mod checkpoint;
mod collective;
pub mod compare;
mod dataset;
mod failure;
mod field;
mod history;
mod read;
mod reserve;
mod seal;
#[cfg(test)]
mod tests;
mod transfer;
mod vtkhdf;
pub mod xdmf;

pub use access::Creation;
pub use field::{FieldData, FieldDescription, Number};
pub use history::HistoryContents;
pub use read::{ResultReader, StoredColumn, StoredField};
pub use seal::mix;
pub use transfer::initialise;
pub use vtkhdf::{Contents, Piece, ResultFile};
pub use xdmf::SideCar;

/// Return the version of the HDF5 library.
pub fn library() -> String {
    let (major, minor, micro) = hdf5_metno::library_version();
    format!("{major}.{minor}.{micro}")
}
