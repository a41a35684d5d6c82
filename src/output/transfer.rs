//! Collective transfers of rows: the only file that calls HDF5's C interface.
//!
//! The safe wrappers write with default transfer properties, which on a parallel file means each
//! rank for itself; and so the rows of datasets are written by hand here.

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

/// Whether the library was initialised before MPI.
static BEFORE_MPI: AtomicBool = AtomicBool::new(false);

/// Initialises the HDF5 library; to be called before MPI is initialised, by every program that
/// opens collective files.
///
/// A library that finds MPI running hooks itself into `MPI_Finalize`, where it flushes and closes
/// whatever is still open: for a file that was abandoned on a full disc that hangs or crashes.
pub fn initialise() {
    sync(|| ());
    BEFORE_MPI.fetch_or(!comm::mpi::is_running(), Ordering::Relaxed);
}

/// Whether [`initialise`] was called before MPI was initialised.
pub(super) fn initialised_before_mpi() -> bool {
    BEFORE_MPI.load(Ordering::Relaxed)
}

/// How rows get into a file: each process for itself or all ranks together.
#[derive(Debug)]
pub(super) struct Transfer {
    list: ManuallyDrop<hdf5::PropertyList>,
    collective: bool,
}

impl Transfer {
    pub(super) fn new(collective: bool) -> hdf5::Result<Self> {
        // SAFETY: the class is one of the library's own, and the new handle is owned here alone.
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

    /// Writes the rows from `first_row` on, none where there are no values; `values` are whole rows
    /// within the dataset. Returns the causes that kept the transfer from being collective.
    pub(super) fn write<T: hdf5::H5Type>(
        &self,
        dataset: &hdf5::Dataset,
        first_row: u64,
        values: &[T],
    ) -> hdf5::Result<u32> {
        let selection = Selection::new(dataset, first_row, values.len())?;
        let number = hdf5::Datatype::from_type::<T>()?;
        sync(|| {
            // SAFETY: all handles are alive, and the selection has no more elements than `values`.
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

    /// Reads whole rows from `first_row` on into `values`, none where that is empty. Returns the
    /// causes that kept the transfer from being collective.
    pub(super) fn read<T: hdf5::H5Type + bytemuck::Pod>(
        &self,
        dataset: &hdf5::Dataset,
        first_row: u64,
        values: &mut [T],
    ) -> hdf5::Result<u32> {
        let selection = Selection::new(dataset, first_row, values.len())?;
        let number = hdf5::Datatype::from_type::<T>()?;
        sync(|| {
            // SAFETY: all handles are alive, the selection has no more elements than `values`, and
            // these may hold any bits.
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

    /// Why the last transfer was not collective, on any rank; 0 if it was.
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

/// Consecutive rows of a dataset, and their place in memory.
struct Selection {
    memory: hdf5::Dataspace,
    file: hdf5::Dataspace,
}

impl Selection {
    /// The rows from `first_row` on that hold `numbers` numbers; nothing if that is 0.
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
            // SAFETY: the handles are alive, the slices as long as the spaces have dimensions.
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
