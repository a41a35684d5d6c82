//! HDF5 files that all ranks write together.

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
use std::mem::ManuallyDrop;
use std::path::{Path, PathBuf};

/// More than an object, its attributes and its entry in a group take, in bytes.
const OBJECT_BYTES: u64 = 8192;

/// An HDF5 file that all ranks write together; where one rank runs without MPI, an ordinary file.
///
/// Every method that returns a `Result` is collective: all ranks call it alike and in the same
/// order, and where it fails on one rank, it fails on all with that rank's message, which names
/// the file, the object and HDF5's innermost cause.
///
/// # After a failure
/// The file is abandoned: it refuses further work and its handles are leaked on purpose, since the
/// library cannot drop a file without writing, which would fail or hang again. What the last
/// successful [`flush`](Self::flush) wrote stays readable. The process can go on and leave through
/// `MPI_Finalize`, provided that [`initialise`](super::transfer::initialise) came before MPI.
///
/// A full disc is found by rank 0 alone, which reserves the space that the file is going to take
/// before the ranks write into it (see [`Reservation`]); met inside a collective write of three
/// ranks or more it would leave some of them waiting for ever.
///
/// A process that is killed leaves the file as the last flush did: metadata is held in memory
/// until then. A machine that loses its power leaves at least what was written until the file was last
/// [confirmed](Self::confirm): after that only numbers change in it, in their places, until it grows, and what
/// makes it grow is confirmed at once.
///
/// Dropping a serial file closes it; a collective one must be [closed](Self::close) by all ranks.
pub struct CollectiveFile<'a> {
    inner: ManuallyDrop<hdf5::File>,
    transfer: Transfer,
    path: PathBuf,
    comm: &'a dyn Communicator,
    no_collective_cause: u32,
    usable: bool,
    /// An upper bound of the file's size in bytes, as the library knows its own only until the
    /// first write.
    size: u64,
    /// The same when the disc last confirmed it.
    confirmed: u64,
    /// What has been reserved on the disc, in bytes; rank 0 holds the reservation.
    reserved: u64,
    reservation: Option<Reservation>,
}

impl<'a> CollectiveFile<'a> {
    /// Creates a file together with the other ranks.
    ///
    /// # Errors
    /// The file exists and shall not be replaced, or it cannot be created; or [`initialise`](super::transfer::initialise) was
    /// not called in time.
    pub fn create(path: &Path, comm: &'a dyn Communicator, creation: Creation) -> Result<Self> {
        let raw = comm.raw();
        if raw.is_some() && !transfer::initialised_before_mpi() {
            return Err(Error::run("HDF5 was not initialised before MPI"));
        }
        if raw.is_none() && comm.size() > 1 {
            return Err(Error::run("ranks that are threads cannot write one file"));
        }
        let exists = creation == Creation::Exclusive && comm.rank() == 0 && path.exists();
        let text = || Error::input(format!("{}: the file exists already", path.display()));
        agree(comm, if exists { Err(text()) } else { Ok(()) })?;
        Self::begin(path, comm, true, || access::create(path, raw, creation))
            .map_err(|error| Error::run(format!("cannot create {error}")))
    }

    /// Opens a file that exists, together with the other ranks, to read it.
    ///
    /// # Errors
    /// There is no such file, it is no HDF5 file, or it may not be read.
    pub fn open(path: &Path, comm: &'a dyn Communicator) -> Result<Self> {
        let raw = comm.raw();
        Self::begin(path, comm, false, || access::open(path, raw))
            .map_err(|error| Error::run(format!("cannot open {error}")))
    }

    /// Opens a file that exists, together with the other ranks, to read it and to write to it. Where there
    /// are several ranks, datasets may become longer and not shorter: HDF5 1.10's come apart when they
    /// do, and wait for one another for ever.
    ///
    /// # Errors
    /// As [`open`](Self::open), and where it may not be written.
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
            confirmed: length + OBJECT_BYTES,
            reserved: 0,
            reservation,
        })
    }

    /// The ranks that write the file.
    pub fn communicator(&self) -> &'a dyn Communicator {
        self.comm
    }

    /// Where the file is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Gives the open file another name, in the place of any that has it. Collective.
    ///
    /// # Errors
    /// When it cannot be renamed.
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

    /// Why writes so far were not collective: bits of HDF5's `H5D_MPIO_…` causes of any rank and
    /// any write, 0 when all were collective. Always 0 for a serial file.
    pub fn no_collective_cause(&self) -> u32 {
        self.no_collective_cause
    }

    /// Creates a group, given its path; its parent must exist.
    ///
    /// # Errors
    /// There is such an object already, or no parent.
    pub fn create_group(&mut self, path: &str) -> Result<()> {
        self.size += OBJECT_BYTES;
        self.together(&format!("cannot create the group {path}"), |file| {
            file.inner.create_group(path).map(|_| ())
        })
    }

    /// Sets an attribute of a group (`/` for the file's root); one that exists must have the same
    /// type and length as the new value.
    ///
    /// # Errors
    /// There is no such group, or the attribute cannot be written.
    pub fn set_attribute(&mut self, group: &str, name: &str, value: Attribute) -> Result<()> {
        if let Attribute::Text(text) = value {
            self.size += text.len() as u64;
        }
        let doing = format!("cannot write the attribute {name} of {group}");
        self.together(&doing, |file| {
            set_attribute(&*file.inner.group(group)?, name, value)
        })
    }

    /// Sets an attribute of a dataset, as [`set_attribute`](Self::set_attribute) does of a group.
    ///
    /// # Errors
    /// The attribute cannot be written.
    pub fn set_dataset_attribute(
        &mut self,
        dataset: &Dataset,
        name: &str,
        value: Attribute,
    ) -> Result<()> {
        let doing = format!("cannot write the attribute {name} of {}", dataset.path);
        self.together(&doing, |_| set_attribute(&dataset.inner, name, value))
    }

    /// Creates a dataset of shape `[rows]`, or `[rows, columns]` where `columns` is given. What is
    /// never written holds arbitrary values.
    ///
    /// # Errors
    /// There is such an object already, or no parent group.
    pub fn create_dataset<T: hdf5::H5Type>(
        &mut self,
        path: &str,
        rows: Rows,
        columns: Option<usize>,
    ) -> Result<Dataset> {
        let dataset = self.together(&format!("cannot create the dataset {path}"), |file| {
            Dataset::create::<T>(&file.inner, path, rows, columns)
        })?;
        self.size += OBJECT_BYTES + dataset.bytes(dataset.rows);
        Ok(dataset)
    }

    /// Opens a dataset that exists.
    ///
    /// # Errors
    /// There is no such dataset.
    pub fn open_dataset(&mut self, path: &str) -> Result<Dataset> {
        self.together(&format!("cannot open the dataset {path}"), |file| {
            Dataset::open(&file.inner, path)
        })
    }

    /// Adds rows at the end of an extensible dataset, the same number on every rank.
    ///
    /// # Errors
    /// The dataset is not extensible or the disc is full.
    pub fn extend(&mut self, dataset: &mut Dataset, additional: u64) -> Result<()> {
        self.resize(dataset, dataset.rows + additional)
    }

    /// Gives an extensible dataset so many rows, the same number on every rank; rows that are added
    /// hold arbitrary values.
    ///
    /// # Errors
    /// The dataset is not extensible or the disc is full.
    pub fn resize(&mut self, dataset: &mut Dataset, rows: u64) -> Result<()> {
        let shape = dataset.shape(rows).iter().map(|&n| n as usize).collect();
        self.together(&format!("cannot resize {}", dataset.path), |_| {
            dataset.inner.resize::<Vec<usize>>(shape)
        })?;
        self.size += dataset
            .bytes(rows)
            .saturating_sub(dataset.bytes(dataset.rows));
        dataset.rows = rows;
        Ok(())
    }

    /// Reads rows of a dataset, `count` from `first_row` on on this rank, in one collective transfer.
    ///
    /// # Errors
    /// The dataset has no such rows or numbers of another type, or it cannot be read.
    pub fn read_rows<T: hdf5::H5Type + bytemuck::Pod>(
        &mut self,
        dataset: &Dataset,
        first_row: u64,
        count: usize,
    ) -> Result<Vec<T>> {
        self.together(&format!("cannot read {}", dataset.path), |file| {
            if first_row + count as u64 > dataset.rows {
                return Err("it has too few rows".into());
            }
            let mut values = vec![T::zeroed(); count * dataset.columns.unwrap_or(1)];
            file.transfer.read(&dataset.inner, first_row, &mut values)?;
            Ok(values)
        })
    }

    /// The text of an attribute of a group (`/` for the file's root).
    ///
    /// # Errors
    /// There is no such text.
    pub fn text_attribute(&mut self, group: &str, name: &str) -> Result<String> {
        self.together(
            &format!("cannot read the attribute {name} of {group}"),
            |file| {
                let attribute = file.inner.group(group)?.attr(name)?;
                Ok(attribute.read_scalar::<VarLenUnicode>()?.to_string())
            },
        )
    }

    /// The integers of an attribute of a group (`/` for the file's root).
    ///
    /// # Errors
    /// There are no such integers.
    pub fn integers_attribute(&mut self, group: &str, name: &str) -> Result<Vec<i64>> {
        self.together(
            &format!("cannot read the attribute {name} of {group}"),
            |file| file.inner.group(group)?.attr(name)?.read_raw::<i64>(),
        )
    }

    /// Writes this rank's rows from `first_row` on, in one collective transfer; `values` is
    /// row-major and may be empty.
    ///
    /// # Errors
    /// The values are no whole rows within the dataset, or the disc is full.
    pub fn write_rows<T: hdf5::H5Type>(
        &mut self,
        dataset: &Dataset,
        first_row: u64,
        values: &[T],
    ) -> Result<()> {
        self.reserve()?;
        let columns = dataset.columns.unwrap_or(1);
        let rows = (values.len() / columns) as u64;
        let causes = self.together(&format!("cannot write {}", dataset.path), |file| {
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

    /// Hands everything written so far to the file system, so that the file survives the end of
    /// the process as it is now. Where it has grown, this confirms it: were only a part of what says where
    /// things are on the disc when the power goes, all of the file could be lost.
    ///
    /// # Errors
    /// The disc is full.
    pub fn flush(&mut self) -> Result<()> {
        if self.size > self.confirmed {
            return self.confirm();
        }
        without_fsync(|| self.write_out())
    }

    /// As [`flush`](Self::flush), and waits for the disc to confirm it, so that the file survives a loss of power
    /// as well.
    ///
    /// # Errors
    /// The disc is full or cannot be written.
    pub fn confirm(&mut self) -> Result<()> {
        // MPI's ranks ask for the confirmation within.
        self.write_out()?;
        if self.comm.raw().is_none() {
            let file = std::fs::File::open(&self.path);
            let confirmed = file.and_then(|file| file.sync_all());
            self.usable &= confirmed.is_ok();
            confirmed.map_err(|error| Error::run(format!("{}: {error}", self.path.display())))?;
        }
        self.confirmed = self.size;
        Ok(())
    }

    fn write_out(&mut self) -> Result<()> {
        self.reserve()?;
        self.together("cannot write out the file", |file| file.inner.flush())?;
        // The library cuts the file to its length here, and thereby gives space back.
        self.reserved = 0;
        if let Some(reservation) = &mut self.reservation {
            reservation.cut();
        }
        Ok(())
    }

    /// Confirms the file and closes it.
    ///
    /// # Errors
    /// The disc is full, or an earlier operation failed.
    pub fn close(mut self) -> Result<()> {
        self.confirm()?;
        self.together("cannot close the file", |file| {
            // SAFETY: the handle is not used again, as the file is no longer usable.
            let inner = unsafe { ManuallyDrop::take(&mut file.inner) };
            file.usable = false;
            inner.close()
        })
    }

    /// Gets space for all that has been created and extended, before the ranks write there.
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

    /// Does one operation on every rank and agrees on its outcome.
    fn together<T>(
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
        // The other ranks of a collective file could not know that they have to close it too.
        if self.usable && self.comm.raw().is_none() {
            // SAFETY: the handle is not used again.
            drop(unsafe { ManuallyDrop::take(&mut self.inner) });
        }
    }
}

fn failure(path: &Path, doing: &str, error: &hdf5::Error) -> Error {
    Error::run(format!("{}: {doing}: {}", path.display(), innermost(error)))
}
