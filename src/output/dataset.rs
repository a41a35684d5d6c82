//! Datasets of numbers in rows, and their size on disk.

#[cfg(doc)]
use super::collective::CollectiveFile;
use hdf5_metno as hdf5;
use hdf5_metno::plist::dataset_create::{AllocTime, FillTime};
use std::mem::ManuallyDrop;

/// Maximum chunk size of an extensible dataset, bytes.
const CHUNK_BYTES: u64 = 4 << 20;

/// Upper bound on the size of the index entry of a chunk, bytes.
const CHUNK_ENTRY_BYTES: u64 = 128;

/// The number of rows of a dataset.
#[derive(Debug, Clone, Copy)]
pub enum Rows {
    /// A fixed number of rows.
    Fixed(u64),
    /// No rows at first; [`CollectiveFile::extend`] appends rows.
    Extensible {
        /// Usual number of rows per append; sets the chunk size.
        per_append: u64,
    },
}

/// A dataset of a [`CollectiveFile`], open until the file is closed.
#[derive(Debug)]
pub struct Dataset {
    // Not dropped: closing a dataset can write, which is not allowed after a failure.
    pub(super) inner: ManuallyDrop<hdf5::Dataset>,
    pub(super) path: String,
    pub(super) columns: Option<usize>,
    pub(super) rows: u64,
    row_bytes: u64,
    /// Rows per chunk; 0 if not extensible.
    rows_per_chunk: u64,
}

impl Dataset {
    /// Return the current number of rows.
    pub fn rows(&self) -> u64 {
        self.rows
    }

    /// Return the path of the dataset in the file.
    pub fn path(&self) -> &str {
        &self.path
    }

    /// Test whether truncation to `rows` rows frees a chunk.
    pub fn frees_a_chunk(&self, rows: u64) -> bool {
        let chunk = self.rows_per_chunk.max(1);
        rows.div_ceil(chunk) < self.rows.div_ceil(chunk)
    }

    /// Return the number of columns.
    pub fn columns(&self) -> usize {
        self.columns.unwrap_or(1)
    }

    pub(super) fn shape(&self, rows: u64) -> Vec<u64> {
        let columns = self.columns.map(|columns| columns as u64);
        std::iter::once(rows).chain(columns).collect()
    }

    pub(super) fn create<T: hdf5::H5Type>(
        file: &hdf5::File,
        path: &str,
        rows: Rows,
        columns: Option<usize>,
    ) -> hdf5::Result<Self> {
        let row_bytes = (columns.unwrap_or(1) * size_of::<T>()) as u64;
        let (count, rows_per_chunk) = match rows {
            Rows::Fixed(rows) => (rows, 0),
            Rows::Extensible { per_append } => (0, chunk_rows(per_append, row_bytes)),
        };
        // Allocate early, so that the file size is known before the first write.
        let mut builder = file
            .new_dataset_builder()
            .alloc_time(Some(AllocTime::Early));
        builder = builder.fill_time(FillTime::Never);
        let mut first = hdf5::Extent::fixed(count as usize);
        if rows_per_chunk > 0 {
            let chunk = std::iter::once(rows_per_chunk as usize).chain(columns);
            builder = builder.chunk(chunk.collect::<Vec<_>>());
            first = hdf5::Extent::resizable(0);
        }
        let second = columns.map(hdf5::Extent::fixed);
        let extents: Vec<_> = std::iter::once(first).chain(second).collect();
        let builder = builder.empty::<T>();
        let dataset = builder
            .shape(hdf5::SimpleExtents::from_vec(extents))
            .create(path)?;
        Ok(Self {
            inner: ManuallyDrop::new(dataset),
            path: path.to_owned(),
            columns,
            rows: count,
            row_bytes,
            rows_per_chunk,
        })
    }

    /// Open an existing dataset.
    pub(super) fn open(file: &hdf5::File, path: &str) -> hdf5::Result<Self> {
        let inner = file.dataset(path)?;
        let shape = inner.shape();
        let columns = shape.get(1).copied();
        let number = inner.dtype()?.size();
        Ok(Self {
            rows_per_chunk: inner.chunk().map_or(0, |chunk| chunk[0] as u64),
            row_bytes: (columns.unwrap_or(1) * number) as u64,
            rows: shape.first().map_or(0, |rows| *rows as u64),
            inner: ManuallyDrop::new(inner),
            path: path.to_owned(),
            columns,
        })
    }

    /// Return the size of `rows` rows on disk, bytes.
    pub(super) fn bytes(&self, rows: u64) -> u64 {
        match self.rows_per_chunk {
            0 => rows * self.row_bytes,
            chunk => rows.div_ceil(chunk) * (chunk * self.row_bytes + CHUNK_ENTRY_BYTES),
        }
    }
}

/// Return the number of rows per chunk. A chunk has about 4 KiB to 4 MiB. It holds the rows of one append.
/// However, a long append is divided evenly into several chunks, and several short appends share a chunk.
fn chunk_rows(per_append: u64, row_bytes: u64) -> u64 {
    let (min, max) = ((4096 / row_bytes).max(1), (CHUNK_BYTES / row_bytes).max(1));
    let parts = per_append.div_ceil(max).max(1);
    per_append.div_ceil(parts).max(min)
}
