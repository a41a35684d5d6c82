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
            // SAFETY: the list is alive.
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
        let mut count: Vec<u64> = dataset.shape().iter().map(|&n| n as u64).collect();
        let mut start = vec![0; count.len()];
        start[0] = first_row;
        count[0] = values.len() as u64 / count[1..].iter().product::<u64>();
        let rows = count[0];
        let lengths: Vec<usize> = count.iter().map(|&n| n.max(1) as usize).collect();
        let memory = hdf5::Dataspace::try_new(lengths)?;
        let file = dataset.space()?;
        let number = hdf5::Datatype::from_type::<T>()?;
        let (mut local, mut global) = (0, 0);
        sync(|| {
            // SAFETY: all handles are alive, the slices as long as the spaces have dimensions, and
            // the selection has as many elements as `values`.
            unsafe {
                if rows == 0 {
                    hdf5::h5check(h5s::H5Sselect_none(memory.id()))?;
                    hdf5::h5check(h5s::H5Sselect_none(file.id()))?;
                } else {
                    hdf5::h5check(h5s::H5Sselect_hyperslab(
                        file.id(),
                        h5s::H5S_seloper_t::H5S_SELECT_SET,
                        start.as_ptr(),
                        ptr::null(),
                        count.as_ptr(),
                        ptr::null(),
                    ))?;
                }
                hdf5::h5check(h5d::H5Dwrite(
                    dataset.id(),
                    number.id(),
                    memory.id(),
                    file.id(),
                    self.list.id(),
                    values.as_ptr().cast(),
                ))?;
                if self.collective {
                    let list = self.list.id();
                    hdf5::h5check(H5Pget_mpio_no_collective_cause(
                        list,
                        &mut local,
                        &mut global,
                    ))?;
                }
            }
            Ok(local | global)
        })
    }
}
