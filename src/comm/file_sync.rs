//! Switch for the fsync of files that are written through MPI. HDF5 calls `MPI_File_sync` at every flush,
//! even if no fsync is needed.

use std::cell::Cell;
use std::os::raw::c_int;

thread_local! {
    static SKIP_FSYNC: Cell<bool> = const { Cell::new(false) };
}

/// Run `work` with fsync disabled on this thread.
pub fn without_fsync<T>(work: impl FnOnce() -> T) -> T {
    /// Guard whose drop restores the previous value of `SKIP_FSYNC`, even if `work` panics.
    struct Restore(bool);

    impl Drop for Restore {
        fn drop(&mut self) {
            SKIP_FSYNC.set(self.0);
        }
    }

    let _restore = Restore(SKIP_FSYNC.replace(true));
    work()
}

/// Override of `MPI_File_sync`, as MPI's profiling interface permits. The linker uses this function instead
/// of the function in the MPI library. The override skips the fsync while this thread is in a call of
/// [`without_fsync`].
///
/// # Safety
/// `file` must be open.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn MPI_File_sync(file: mpi_sys::MPI_File) -> c_int {
    if SKIP_FSYNC.get() {
        return mpi_sys::MPI_SUCCESS as c_int;
    }
    // SAFETY: the caller's contract is the same.
    unsafe { mpi_sys::PMPI_File_sync(file) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_flushed_again_after_a_panic() {
        let caught = std::panic::catch_unwind(|| without_fsync(|| panic!("while writing")));
        assert!(caught.is_err() && !SKIP_FSYNC.get());
        without_fsync(|| {
            without_fsync(|| ());
            assert!(SKIP_FSYNC.get());
        });
        assert!(!SKIP_FSYNC.get());
    }
}
