//! HDF5 files written collectively by all ranks.

use super::access::{self, Creation};
use super::attribute::{Attribute, set_attribute};
use super::dataset::{Dataset, Rows};
use super::failure::innermost;
use super::reserve::Reservation;
use super::transfer::{self, Transfer};
use crate::comm::{Communicator, agree, without_fsync};
use crate::error::{Error, Result};
use hdf5_metno as hdf5;
use hdf5_metno::types::VarLenUnicode;
use std::io::ErrorKind;
use std::mem::ManuallyDrop;
use std::path::{Path, PathBuf};

/// Upper bound on the space of a group or dataset in the file, bytes. It includes the attributes, and the
/// entry in the parent group. The rows of datasets and the texts in attributes are counted separately.
const OBJECT_BYTES: u64 = 8192;

/// An HDF5 file written collectively; without MPI, a serial file.
///
/// Every method that returns a `Result` is collective. A method that fails on one rank fails on all ranks
/// with the same message: file, object and HDF5's innermost cause.
///
/// # After a failure
/// The file is abandoned: further calls fail. The handles of the file are leaked on purpose, because closing
/// them makes HDF5 write, which would fail or hang again. The state of the last successful
/// [`flush`](Self::flush) stays readable. The process can continue and call `MPI_Finalize`, provided that
/// [`initialise`](super::transfer::initialise) was called before MPI started.
///
/// # Full disk
/// Rank 0 reserves the space before the ranks write (see [`Reservation`]). Otherwise, if the disk became
/// full during a collective write of three or more ranks, some of the ranks would hang.
///
/// # Kill and loss of power
/// A killed process leaves the file in the state of the last flush, because metadata stays in memory between
/// flushes. A loss of power leaves at least the state of the last [fsync](Self::sync). If the file has
/// grown, a flush includes an fsync. If the file has not grown, a flush only changes values in place.
///
/// Dropping the value closes a serial file, but not a collective file. All ranks must [close](Self::close) a
/// collective file.
pub struct CollectiveFile<'a> {
    inner: ManuallyDrop<hdf5::File>,
    transfer: Transfer,
    path: PathBuf,
    comm: &'a dyn Communicator,
    no_collective_cause: u32,
    usable: bool,
    /// Upper bound on the file's size, bytes. This size is counted here, because HDF5 reports the file's size
    /// only until the first write.
    size: u64,
    /// Value of `size` at the last fsync.
    synced: u64,
    /// Reserved disk space, bytes; rank 0 holds the reservation.
    reserved: u64,
    reservation: Option<Reservation>,
}

impl<'a> CollectiveFile<'a> {
    /// Create a file.
    ///
    /// # Errors
    /// If the file exists and `creation` is exclusive, or the file cannot be created. If the ranks are MPI
    /// processes, and [`initialise`](super::transfer::initialise) was not called before MPI started. If there
    /// are several ranks, and these ranks are threads instead of MPI processes.
    pub fn create(path: &Path, comm: &'a dyn Communicator, creation: Creation) -> Result<Self> {
        let raw = comm.raw();
        if raw.is_some() && !transfer::initialised_before_mpi() {
            return Err(Error::run("HDF5 was not initialised before MPI"));
        }
        if raw.is_none() && comm.size() > 1 {
            return Err(Error::run("ranks that are threads cannot write one file"));
        }
        let prepared = match (comm.rank(), creation) {
            (0, Creation::Exclusive) if path.exists() => {
                let message = format!("{}: the file exists already", path.display());
                Err(Error::input(message))
            }
            // The new file has another inode, so programs that have opened the old file can still read it. If
            // the path is a symbolic link, the link stays.
            (0, Creation::Truncate) => match path.canonicalize().and_then(std::fs::remove_file) {
                Err(error) if error.kind() != ErrorKind::NotFound => {
                    let message = format!("cannot replace {}: {error}", path.display());
                    Err(Error::run(message))
                }
                _ => Ok(()),
            },
            _ => Ok(()),
        };
        agree(comm, prepared)?;
        Self::begin(path, comm, true, || access::create(path, raw, creation))
            .map_err(|error| Error::run(format!("cannot create {error}")))
    }

    /// Open an existing file for reading.
    ///
    /// # Errors
    /// If the file is missing, not an HDF5 file, or not readable.
    pub fn open(path: &Path, comm: &'a dyn Communicator) -> Result<Self> {
        let raw = comm.raw();
        Self::begin(path, comm, false, || access::open(path, raw))
            .map_err(|error| Error::run(format!("cannot open {error}")))
    }

    /// Open an existing file for reading and writing. With several ranks, datasets may grow but not shrink,
    /// because HDF5 1.10 deadlocks if they shrink.
    ///
    /// # Errors
    /// Same as [`open`](Self::open), and also if the file is not writable.
    pub fn open_to_append(path: &Path, comm: &'a dyn Communicator) -> Result<Self> {
        let raw = comm.raw();
        Self::begin(path, comm, true, || access::open_to_append(path, raw))
            .map_err(|error| Error::run(format!("cannot open {error}")))
    }

    fn begin(
        path: &Path,
        comm: &'a dyn Communicator,
        grows: bool,
        open: impl FnOnce() -> hdf5::Result<hdf5::File>,
    ) -> Result<Self> {
        let collective = comm.raw().is_some();
        let opened = open()
            .and_then(|file| Ok((ManuallyDrop::new(file), Transfer::new(collective)?)))
            .map_err(|error| Error::run(format!("{}: {}", path.display(), innermost(&error))));
        let (inner, transfer) = agree(comm, opened)?;
        let reservation = if collective && grows && comm.rank() == 0 {
            Reservation::new(path).map(Some)
        } else {
            Ok(None)
        };
        let reservation = agree(comm, reservation)?;
        let length = std::fs::metadata(path).map_or(0, |metadata| metadata.len());
        Ok(Self {
            inner,
            transfer,
            path: path.to_path_buf(),
            comm,
            no_collective_cause: 0,
            usable: true,
            size: length + OBJECT_BYTES,
            synced: length + OBJECT_BYTES,
            reserved: 0,
            reservation,
        })
    }

    /// Return the communicator of the ranks that write the file.
    pub fn communicator(&self) -> &'a dyn Communicator {
        self.comm
    }

    /// Return the path of the file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Rename the open file to `path`; an existing file at this path is replaced.
    ///
    /// # Errors
    /// If the file cannot be renamed.
    pub fn rename(&mut self, path: &Path) -> Result<()> {
        let renamed = match self.comm.rank() {
            0 => std::fs::rename(&self.path, path)
                .map_err(|error| Error::run(format!("{}: {error}", path.display()))),
            _ => Ok(()),
        };
        agree(self.comm, renamed)?;
        self.path = path.to_path_buf();
        Ok(())
    }

    /// Return the causes of non-collective writes, as HDF5's `H5D_MPIO_…` bits, combined over all ranks and
    /// writes. 0 means that all writes were collective or the file is serial.
    pub fn no_collective_cause(&self) -> u32 {
        self.no_collective_cause
    }

    /// Create a group; its parent must exist.
    ///
    /// # Errors
    /// If an object with this path exists, or the parent does not exist.
    pub fn create_group(&mut self, path: &str) -> Result<()> {
        self.size += OBJECT_BYTES;
        self.collectively(&format!("cannot create the group {path}"), |file| {
            file.inner.create_group(path).map(|_| ())
        })
    }

    /// Set an attribute of a group (`/` for the root); an existing attribute must have the same type and
    /// length.
    ///
    /// # Errors
    /// If the group is missing or the attribute cannot be written.
    pub fn set_attribute(&mut self, group: &str, name: &str, value: Attribute) -> Result<()> {
        self.size += value.text_length();
        let doing = format!("cannot write the attribute {name} of {group}");
        self.collectively(&doing, |file| {
            set_attribute(&*file.inner.group(group)?, name, value)
        })
    }

    /// Set an attribute of a dataset, see [`set_attribute`](Self::set_attribute).
    ///
    /// # Errors
    /// If the attribute cannot be written.
    pub fn set_dataset_attribute(
        &mut self,
        dataset: &Dataset,
        name: &str,
        value: Attribute,
    ) -> Result<()> {
        self.size += value.text_length();
        let doing = format!("cannot write the attribute {name} of {}", dataset.path);
        self.collectively(&doing, |_| set_attribute(&dataset.inner, name, value))
    }

    /// Create a dataset of shape `[rows]` or `[rows, columns]`. Unwritten values are arbitrary.
    ///
    /// # Errors
    /// If an object with this path exists, or the parent group does not exist.
    pub fn create_dataset<T: hdf5::H5Type>(
        &mut self,
        path: &str,
        rows: Rows,
        columns: Option<usize>,
    ) -> Result<Dataset> {
        let dataset = self.collectively(&format!("cannot create the dataset {path}"), |file| {
            Dataset::create::<T>(&file.inner, path, rows, columns)
        })?;
        self.size += OBJECT_BYTES + dataset.bytes(dataset.rows);
        Ok(dataset)
    }

    /// Open an existing dataset.
    ///
    /// # Errors
    /// If the dataset is missing.
    pub fn open_dataset(&mut self, path: &str) -> Result<Dataset> {
        self.collectively(&format!("cannot open the dataset {path}"), |file| {
            Dataset::open(&file.inner, path)
        })
    }

    /// Append `additional` rows to an extensible dataset; all ranks pass the same number.
    ///
    /// # Errors
    /// If the dataset is not extensible, or a write fails, for example because the disk is full.
    pub fn extend(&mut self, dataset: &mut Dataset, additional: u64) -> Result<()> {
        self.resize(dataset, dataset.rows + additional)
    }

    /// Resize an extensible dataset; all ranks pass the same number of rows. Values of new rows are
    /// arbitrary.
    ///
    /// # Errors
    /// If the dataset is not extensible, or a write fails, for example because the disk is full.
    pub fn resize(&mut self, dataset: &mut Dataset, rows: u64) -> Result<()> {
        let shape = dataset.shape(rows).iter().map(|&n| n as usize).collect();
        self.collectively(&format!("cannot resize {}", dataset.path), |_| {
            dataset.inner.resize::<Vec<usize>>(shape)
        })?;
        self.size += dataset
            .bytes(rows)
            .saturating_sub(dataset.bytes(dataset.rows));
        dataset.rows = rows;
        Ok(())
    }

    /// Read this rank's `count` rows from `first_row` on, in one collective transfer.
    ///
    /// # Errors
    /// If the rows are out of range, the stored numbers cannot be converted to `T`, or the dataset cannot be
    /// read.
    pub fn read_rows<T: hdf5::H5Type + bytemuck::Pod>(
        &mut self,
        dataset: &Dataset,
        first_row: u64,
        count: usize,
    ) -> Result<Vec<T>> {
        self.collectively(&format!("cannot read {}", dataset.path), |file| {
            if first_row + count as u64 > dataset.rows {
                return Err("it has too few rows".into());
            }
            let mut values = vec![T::zeroed(); count * dataset.columns.unwrap_or(1)];
            file.transfer.read(&dataset.inner, first_row, &mut values)?;
            Ok(values)
        })
    }

    /// Read a text attribute of a group (`/` for the root).
    ///
    /// # Errors
    /// If the attribute is missing or not a text.
    pub fn text_attribute(&mut self, group: &str, name: &str) -> Result<String> {
        self.collectively(
            &format!("cannot read the attribute {name} of {group}"),
            |file| {
                let attribute = file.inner.group(group)?.attr(name)?;
                Ok(attribute.read_scalar::<VarLenUnicode>()?.to_string())
            },
        )
    }

    /// Read an attribute of a group (`/` for the root) as a list of integers.
    ///
    /// # Errors
    /// If the attribute is missing or cannot be converted to integers.
    pub fn integers_attribute(&mut self, group: &str, name: &str) -> Result<Vec<i64>> {
        self.collectively(
            &format!("cannot read the attribute {name} of {group}"),
            |file| file.inner.group(group)?.attr(name)?.read_raw::<i64>(),
        )
    }

    /// Write this rank's rows from `first_row` on, in one collective transfer. `values` is row-major and may
    /// be empty.
    ///
    /// # Errors
    /// If the values are not whole rows within the dataset, or a write fails, for example because the disk is
    /// full.
    pub fn write_rows<T: hdf5::H5Type>(
        &mut self,
        dataset: &Dataset,
        first_row: u64,
        values: &[T],
    ) -> Result<()> {
        self.reserve()?;
        let columns = dataset.columns.unwrap_or(1);
        let rows = (values.len() / columns) as u64;
        let causes = self.collectively(&format!("cannot write {}", dataset.path), |file| {
            if !values.len().is_multiple_of(columns) || first_row + rows > dataset.rows {
                let (length, path) = (values.len(), &dataset.path);
                let rows = dataset.rows;
                let text =
                    format!("{length} values at row {first_row} do not fit {path} of {rows} rows");
                return Err(text.into());
            }
            file.transfer.write(&dataset.inner, first_row, values)
        })?;
        self.no_collective_cause |= causes;
        Ok(())
    }

    /// Flush to the file system, so the file survives a kill of the process.
    ///
    /// If the file has grown since the last fsync, the flush includes an fsync. Without an fsync, a loss of
    /// power could leave the metadata partly written, which could destroy the file.
    ///
    /// # Errors
    /// If a write fails, for example because the disk is full.
    pub fn flush(&mut self) -> Result<()> {
        if self.size > self.synced {
            return self.sync();
        }
        without_fsync(|| self.flush_all())
    }

    /// [Flush](Self::flush) and fsync, so the file survives a loss of power.
    ///
    /// # Errors
    /// If a write or the fsync fails, for example because the disk is full.
    pub fn sync(&mut self) -> Result<()> {
        // With MPI, HDF5's flush calls MPI_File_sync, which includes the fsync.
        self.flush_all()?;
        if self.comm.raw().is_none() {
            let file = std::fs::File::open(&self.path);
            let synced = file.and_then(|file| file.sync_all());
            self.usable &= synced.is_ok();
            synced.map_err(|error| Error::run(format!("{}: {error}", self.path.display())))?;
        }
        self.synced = self.size;
        Ok(())
    }

    fn flush_all(&mut self) -> Result<()> {
        self.reserve()?;
        self.collectively("cannot write out the file", |file| file.inner.flush())?;
        // HDF5's flush truncates the file to its length, so the reserved space behind the end is freed.
        self.reserved = 0;
        if let Some(reservation) = &mut self.reservation {
            reservation.truncated();
        }
        Ok(())
    }

    /// Fsync and close the file.
    ///
    /// # Errors
    /// If this or an earlier operation fails, for example because the disk is full.
    pub fn close(mut self) -> Result<()> {
        self.sync()?;
        self.collectively("cannot close the file", |file| {
            // SAFETY: the handle is not used again, as the file is no longer usable.
            let inner = unsafe { ManuallyDrop::take(&mut file.inner) };
            file.usable = false;
            inner.close()
        })
    }

    /// Reserve disk space for all created and extended objects. This function is called before each write of
    /// rows and before each flush.
    fn reserve(&mut self) -> Result<()> {
        if self.comm.raw().is_none() || !self.usable || self.size <= self.reserved {
            return Ok(());
        }
        let size = self.size;
        let grown = match &mut self.reservation {
            Some(reservation) => reservation.grow(size),
            None => Ok(()),
        };
        let agreed = agree(self.comm, grown);
        self.usable &= agreed.is_ok();
        self.reserved = size;
        agreed
    }

    /// Run one operation on every rank, and agree on success or the error.
    fn collectively<T>(
        &mut self,
        doing: &str,
        work: impl FnOnce(&mut Self) -> hdf5::Result<T>,
    ) -> Result<T> {
        if !self.usable {
            let text = "was abandoned after an error";
            return Err(Error::run(format!(
                "{}: {doing}: the file {text}",
                self.path.display()
            )));
        }
        let result = work(self).map_err(|error| failure(&self.path, doing, &error));
        let result = agree(self.comm, result);
        self.usable &= result.is_ok();
        result
    }
}

impl Drop for CollectiveFile<'_> {
    fn drop(&mut self) {
        // Closing a collective file here would deadlock unless all ranks drop it.
        if self.usable && self.comm.raw().is_none() {
            // SAFETY: the handle is not used again.
            drop(unsafe { ManuallyDrop::take(&mut self.inner) });
        }
    }
}

fn failure(path: &Path, doing: &str, error: &hdf5::Error) -> Error {
    Error::run(format!("{}: {doing}: {}", path.display(), innermost(error)))
}
