//! Collective transfers of rows. No other file calls HDF5's C interface.
//!
//! The safe wrappers of HDF5 use the default transfer properties. With these properties, the transfers of a
//! parallel file are independent instead of collective.

use crate::comm;
use hdf5_metno as hdf5;
use hdf5_metno::sync::sync;
use hdf5_metno_sys::{h5d, h5i::hid_t, h5p, h5s};
use std::mem::ManuallyDrop;
use std::ptr;
use std::sync::atomic::{AtomicBool, Ordering};

unsafe extern "C" {
    fn H5Pget_mpio_no_collective_cause(list: hid_t, local: *mut u32, global: *mut u32) -> i32;
}

/// True if HDF5 was initialised before MPI.
static BEFORE_MPI: AtomicBool = AtomicBool::new(false);

/// Initialise HDF5. Every program that opens collective files must call this function before MPI starts.
///
/// If MPI is already running, HDF5 registers itself with `MPI_Finalize`. In `MPI_Finalize`, HDF5 then flushes
/// open files. This flush hangs or crashes for a file that was abandoned on a full disk.
pub fn initialise() {
    sync(|| ());
    BEFORE_MPI.fetch_or(!comm::mpi::is_running(), Ordering::Relaxed);
}

/// Test whether [`initialise`] was called before MPI started.
pub(super) fn initialised_before_mpi() -> bool {
    BEFORE_MPI.load(Ordering::Relaxed)
}

/// Transfer properties of HDF5, which select independent or collective transfers.
#[derive(Debug)]
pub(super) struct Transfer {
    list: ManuallyDrop<hdf5::PropertyList>,
    collective: bool,
}

impl Transfer {
    pub(super) fn new(collective: bool) -> hdf5::Result<Self> {
        // SAFETY: the class is a constant of the library, and the new handle has no other owner.
        let list: hdf5::PropertyList = sync(|| unsafe {
            hdf5::from_id(hdf5::h5check(h5p::H5Pcreate(*h5p::H5P_CLS_DATASET_XFER))?)
        })?;
        if collective {
            let mode = h5p::H5FD_mpio_xfer_t::H5FD_MPIO_COLLECTIVE;
            // SAFETY: a call by value, which checks the handle.
            sync(|| hdf5::h5check(unsafe { h5p::H5Pset_dxpl_mpio(list.id(), mode) }))?;
        }
        Ok(Self {
            list: ManuallyDrop::new(list),
            collective,
        })
    }

    /// Write rows from `first_row` on. `values` are whole rows within the dataset and may be empty. Return
    /// the causes of a non-collective transfer; 0 if the transfer was collective.
    pub(super) fn write<T: hdf5::H5Type>(
        &self,
        dataset: &hdf5::Dataset,
        first_row: u64,
        values: &[T],
    ) -> hdf5::Result<u32> {
        let selection = Selection::new(dataset, first_row, values.len())?;
        let number = hdf5::Datatype::from_type::<T>()?;
        sync(|| {
            // SAFETY: all handles are valid, and the selection has no more elements than `values`.
            unsafe {
                hdf5::h5check(h5d::H5Dwrite(
                    dataset.id(),
                    number.id(),
                    selection.memory.id(),
                    selection.file.id(),
                    self.list.id(),
                    values.as_ptr().cast(),
                ))?;
            }
            self.causes()
        })
    }

    /// Read whole rows from `first_row` on into `values`, which may be empty. Return the causes of a
    /// non-collective transfer; 0 if the transfer was collective.
    pub(super) fn read<T: hdf5::H5Type + bytemuck::Pod>(
        &self,
        dataset: &hdf5::Dataset,
        first_row: u64,
        values: &mut [T],
    ) -> hdf5::Result<u32> {
        let selection = Selection::new(dataset, first_row, values.len())?;
        let number = hdf5::Datatype::from_type::<T>()?;
        sync(|| {
            // SAFETY: all handles are valid, the selection has no more elements than `values`, and any
            // bits are valid values of `T`.
            unsafe {
                hdf5::h5check(h5d::H5Dread(
                    dataset.id(),
                    number.id(),
                    selection.memory.id(),
                    selection.file.id(),
                    self.list.id(),
                    values.as_mut_ptr().cast(),
                ))?;
            }
            self.causes()
        })
    }

    /// Return the reasons why the last transfer was not collective, as HDF5's `H5D_MPIO_…` bits. The bits of
    /// all ranks are combined. Return 0 if the transfer was collective, or if the file is serial.
    fn causes(&self) -> hdf5::Result<u32> {
        let (mut local, mut global) = (0, 0);
        if self.collective {
            let list = self.list.id();
            // SAFETY: the handle is checked, and the pointers are to locals.
            hdf5::h5check(unsafe {
                H5Pget_mpio_no_collective_cause(list, &mut local, &mut global)
            })?;
        }
        Ok(local | global)
    }
}

/// Selections of consecutive rows in a dataset (`file`) and of the same number of rows in a buffer
/// (`memory`).
struct Selection {
    memory: hdf5::Dataspace,
    file: hdf5::Dataspace,
}

impl Selection {
    /// Select consecutive rows that have `numbers` values in total, starting with row `first_row`.
    fn new(dataset: &hdf5::Dataset, first_row: u64, numbers: usize) -> hdf5::Result<Self> {
        let mut count: Vec<u64> = dataset.shape().iter().map(|&n| n as u64).collect();
        let mut start = vec![0; count.len()];
        start[0] = first_row;
        count[0] = numbers as u64 / count[1..].iter().product::<u64>();
        let lengths: Vec<usize> = count.iter().map(|&n| n.max(1) as usize).collect();
        let selection = Self {
            memory: hdf5::Dataspace::try_new(lengths)?,
            file: dataset.space()?,
        };
        sync(|| {
            // SAFETY: the handles are valid, and the slices have one entry per dimension.
            unsafe {
                if count[0] == 0 {
                    hdf5::h5check(h5s::H5Sselect_none(selection.memory.id()))?;
                    hdf5::h5check(h5s::H5Sselect_none(selection.file.id()))?;
                } else {
                    hdf5::h5check(h5s::H5Sselect_hyperslab(
                        selection.file.id(),
                        h5s::H5S_seloper_t::H5S_SELECT_SET,
                        start.as_ptr(),
                        ptr::null(),
                        count.as_ptr(),
                        ptr::null(),
                    ))?;
                }
            }
            Ok(selection)
        })
    }
}
