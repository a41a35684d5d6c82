//! Access properties of files: driver, metadata cache and metadata operations.

use crate::comm::RawCommunicator;
use hdf5_metno as hdf5;
use hdf5_metno::file::{CacheDecreaseMode, CacheIncreaseMode, FileCloseDegree, FlashIncreaseMode};
use std::path::Path;

/// Limit of the dirty (not yet written) metadata in the cache, bytes: the largest limit that HDF5 allows.
const HELD_METADATA_BYTES: usize = 32 << 20;

/// Handling of an existing file.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Creation {
    /// Return an error.
    Exclusive,
    /// Replace the existing file.
    Truncate,
}

/// Open an existing file for reading. With a raw communicator, the call is collective.
pub(super) fn open(path: &Path, raw: Option<RawCommunicator>) -> hdf5::Result<hdf5::File> {
    // No collective metadata reads: HDF5 1.10.8 deadlocks in such a read if the ranks have read different
    // rows before, because the metadata caches of the ranks then differ. Such reads are safe only for a new
    // file, whose metadata is all in memory.
    options(raw, false)?.open(path)
}

/// Open an existing file for reading and writing. With a raw communicator, the call is collective.
pub(super) fn open_to_append(
    path: &Path,
    raw: Option<RawCommunicator>,
) -> hdf5::Result<hdf5::File> {
    options(raw, false)?.open_rw(path)
}

/// Create a file. With a raw communicator, the call is collective.
pub(super) fn create(
    path: &Path,
    raw: Option<RawCommunicator>,
    creation: Creation,
) -> hdf5::Result<hdf5::File> {
    let builder = options(raw, true)?;
    match creation {
        Creation::Exclusive => builder.create_excl(path),
        Creation::Truncate => builder.create(path),
    }
}

fn options(
    raw: Option<RawCommunicator>,
    collective_reads: bool,
) -> hdf5::Result<hdf5::FileBuilder> {
    let mut builder = hdf5::File::with_options();
    let access = builder.fapl();
    access.fclose_degree(FileCloseDegree::Strong);
    // Metadata is written at flushes only, so a killed process leaves the file in the state of the last
    // flush.
    let mut cache = hdf5::plist::FileAccess::try_new()?.mdc_config();
    cache.evictions_enabled = false;
    cache.incr_mode = CacheIncreaseMode::Off;
    cache.flash_incr_mode = FlashIncreaseMode::Off;
    cache.decr_mode = CacheDecreaseMode::Off;
    cache.dirty_bytes_threshold = HELD_METADATA_BYTES;
    access.mdc_config(&cache);
    if let Some(raw) = raw {
        access
            .mpio(raw, None)
            .coll_metadata_write(true)
            .all_coll_metadata_ops(collective_reads);
    }
    Ok(builder)
}
