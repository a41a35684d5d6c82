//! Reservation of disk space before collective writes.
//!
//! Open MPI 4.1 has several components for collective writes. If the disk fills up during the write, most
//! of these components hang on some ranks: `vulcan` (the default), `dynamic_gen2`, `two_phase` and ROMIO. If
//! one rank reserves the space before the write, a full disk causes an ordinary error instead.

use crate::error::{Error, Result};
use std::fs::{File, OpenOptions};
use std::io;
use std::os::fd::AsRawFd as _;
use std::path::{Path, PathBuf};

/// The disk space reserved for a growing file.
#[derive(Debug)]
pub struct Reservation {
    file: File,
    path: PathBuf,
    bytes: u64,
}

impl Reservation {
    /// Open an existing file for reservations.
    ///
    /// # Errors
    /// If the file cannot be opened for writing.
    pub fn new(path: &Path) -> Result<Self> {
        let file = OpenOptions::new().write(true).open(path);
        Ok(Self {
            file: file.map_err(|error| failure(path, 0, &error))?,
            path: path.to_path_buf(),
            bytes: 0,
        })
    }

    /// Reserve disk space for the first `bytes` bytes of the file, without a change of its length.
    ///
    /// On file systems without preallocation, only the free space is checked. Other processes can still take
    /// this space, and quotas are ignored.
    ///
    /// # Errors
    /// If the disk or the quota is full.
    pub fn grow(&mut self, bytes: u64) -> Result<()> {
        let additional = bytes.saturating_sub(self.bytes);
        if additional == 0 {
            return Ok(());
        }
        let reserved = match allocate(&self.file, self.bytes, additional) {
            Err(error) if error.raw_os_error() == Some(libc::EOPNOTSUPP) => {
                let taken = self.file.metadata().map_or(0, |metadata| metadata.len());
                check_free_space(&self.file, bytes.saturating_sub(taken.max(self.bytes)))
            }
            other => other,
        };
        reserved.map_err(|error| failure(&self.path, additional, &error))?;
        self.bytes = bytes;
        Ok(())
    }

    /// Update the reservation after HDF5 has truncated the file. The truncation frees the reserved space
    /// behind the end of the file.
    pub fn truncated(&mut self) {
        let length = self.file.metadata().map_or(0, |metadata| metadata.len());
        self.bytes = self.bytes.min(length);
    }
}

#[cfg(target_os = "linux")]
fn allocate(file: &File, from: u64, length: u64) -> io::Result<()> {
    let (from, length) = (from as libc::off_t, length as libc::off_t);
    loop {
        // SAFETY: the descriptor is open; no memory is passed.
        let failed =
            unsafe { libc::fallocate(file.as_raw_fd(), libc::FALLOC_FL_KEEP_SIZE, from, length) };
        let error = io::Error::last_os_error();
        if failed == 0 {
            return Ok(());
        } else if error.kind() != io::ErrorKind::Interrupted {
            return Err(error);
        }
    }
}

/// Return an error: systems other than Linux have no preallocation that keeps the file's length.
#[cfg(not(target_os = "linux"))]
fn allocate(_: &File, _: u64, _: u64) -> io::Result<()> {
    Err(io::Error::from_raw_os_error(libc::EOPNOTSUPP))
}

#[allow(
    clippy::unnecessary_cast,
    reason = "the fields are narrower on other systems"
)]
fn check_free_space(file: &File, additional: u64) -> io::Result<()> {
    // SAFETY: the structure is plain numbers, for which zeros are valid.
    let mut disk: libc::statvfs = unsafe { std::mem::zeroed() };
    // SAFETY: the descriptor is open, and the structure lives through the call.
    if unsafe { libc::fstatvfs(file.as_raw_fd(), &mut disk) } != 0 {
        return Err(io::Error::last_os_error());
    }
    if (disk.f_bavail as u64).saturating_mul(disk.f_frsize as u64) < additional {
        return Err(io::Error::from_raw_os_error(libc::ENOSPC));
    }
    Ok(())
}

fn failure(path: &Path, bytes: u64, error: &io::Error) -> Error {
    let path = path.display();
    Error::run(format!(
        "{path}: cannot get {bytes} bytes more on the disc: {error}"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_excessive_reservation_fails_and_keeps_the_length() {
        let path = std::env::temp_dir().join(format!("fissure-reserve-{}", std::process::id()));
        std::fs::write(&path, "abc").unwrap();
        let mut reservation = Reservation::new(&path).unwrap();
        reservation.grow(100_000).unwrap();
        assert_eq!(std::fs::metadata(&path).unwrap().len(), 3);
        assert!(check_free_space(&reservation.file, u64::MAX).is_err());
        let error = reservation.grow(1 << 60).unwrap_err();
        assert!(
            error.message.contains("bytes more on the disc"),
            "{}",
            error.message
        );
        std::fs::remove_file(&path).unwrap();
    }
}
