//! How files are created: which driver, and when metadata is written.

use crate::comm::RawCommunicator;
use hdf5_metno as hdf5;
use hdf5_metno::file::{CacheDecreaseMode, CacheIncreaseMode, FileCloseDegree, FlashIncreaseMode};
use std::path::Path;

/// How much changed metadata the library may hold back before it writes some, in bytes: the most
/// that it allows.
const HELD_METADATA_BYTES: usize = 32 << 20;

/// What to do where the file to create is there already.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Creation {
    /// Fail.
    Exclusive,
    /// Replace it.
    Truncate,
}

/// Opens a file that exists, to read it.
pub(super) fn open(path: &Path, raw: Option<RawCommunicator>) -> hdf5::Result<hdf5::File> {
    // Ranks whose caches differ, as they do after reading different rows, wait for one another in
    // vain when they read metadata together (HDF5 1.10.8). A file that is being created has all of it
    // in memory, one that is read, or appended to, is read by each rank for itself.
    options(raw, false)?.open(path)
}

/// Opens a file that exists, to read it and to write to it.
pub(super) fn open_to_append(
    path: &Path,
    raw: Option<RawCommunicator>,
) -> hdf5::Result<hdf5::File> {
    options(raw, false)?.open_rw(path)
}

/// Creates a file for one process or, with a communicator, for all ranks together.
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
    // Metadata goes out when the file is flushed and at no other time; so whenever the process is
    // killed, the file is as the last flush left it.
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
