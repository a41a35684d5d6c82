//! Flushing of files that are written through MPI to disk (fsync). HDF5 asks for it at every flush; a thread can leave it
//! out.

use std::cell::Cell;
use std::os::raw::c_int;

thread_local! {
    static LEFT_OUT: Cell<bool> = const { Cell::new(false) };
}

/// Runs `work`, which writes files through MPI, without flushing them to disk (fsync).
pub fn without_confirmation<T>(work: impl FnOnce() -> T) -> T {
    /// Restores what was set before, also when `work` panics.
    struct Restore(bool);

    impl Drop for Restore {
        fn drop(&mut self) {
            LEFT_OUT.set(self.0);
        }
    }

    let _restore = Restore(LEFT_OUT.replace(true));
    work()
}

/// MPI's call, by way of its profiling interface: a program's own definition is found before the library's.
///
/// # Safety
/// As the library's: `file` must be open.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn MPI_File_sync(file: mpi_sys::MPI_File) -> c_int {
    if LEFT_OUT.get() {
        return mpi_sys::MPI_SUCCESS as c_int;
    }
    // SAFETY: passed on to the caller.
    unsafe { mpi_sys::PMPI_File_sync(file) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_flushed_again_after_a_panic() {
        let caught = std::panic::catch_unwind(|| without_confirmation(|| panic!("while writing")));
        assert!(caught.is_err() && !LEFT_OUT.get());
        without_confirmation(|| {
            without_confirmation(|| ());
            assert!(LEFT_OUT.get());
        });
        assert!(!LEFT_OUT.get());
    }
}
