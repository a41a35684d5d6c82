//! Space on the disc, asked for before it is needed.
//!
//! When a disc fills up inside a collective write, most of Open MPI's writers (of version 4.1:
//! `vulcan`, the default, `dynamic_gen2`, `two_phase`, ROMIO) leave some ranks waiting for ever.
//! A single rank that asks for the space beforehand gets an ordinary error.

use crate::error::{Error, Result};
use std::fs::{File, OpenOptions};
use std::io;
use std::os::fd::AsRawFd as _;
use std::path::{Path, PathBuf};

/// The space that a growing file has been promised.
#[derive(Debug)]
pub struct Reservation {
    file: File,
    path: PathBuf,
    bytes: u64,
}

impl Reservation {
    /// Prepares to reserve space for a file that exists.
    ///
    /// # Errors
    /// The file cannot be opened for writing.
    pub fn new(path: &Path) -> Result<Self> {
        let file = OpenOptions::new().write(true).open(path);
        Ok(Self {
            file: file.map_err(|error| failure(path, 0, &error))?,
            path: path.to_path_buf(),
            bytes: 0,
        })
    }

    /// Makes sure that the file can grow to `bytes`; its length stays as it is.
    ///
    /// Where the file system cannot promise space, the free space is compared instead; others may
    /// still take it, and quotas go unseen.
    ///
    /// # Errors
    /// The disc or the quota is full.
    pub fn grow(&mut self, bytes: u64) -> Result<()> {
        let additional = bytes.saturating_sub(self.bytes);
        if additional == 0 {
            return Ok(());
        }
        let reserved = match allocate(&self.file, self.bytes, additional) {
            Err(error) if error.raw_os_error() == Some(libc::EOPNOTSUPP) => {
                let taken = self.file.metadata().map_or(0, |metadata| metadata.len());
                compare(&self.file, bytes.saturating_sub(taken.max(self.bytes)))
            }
            other => other,
        };
        reserved.map_err(|error| failure(&self.path, additional, &error))?;
        self.bytes = bytes;
        Ok(())
    }

    /// Takes note that the file was cut to its present length, which gives back what lies beyond.
    pub fn cut(&mut self) {
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

/// Elsewhere no call promises space and leaves the length as it is.
#[cfg(not(target_os = "linux"))]
fn allocate(_: &File, _: u64, _: u64) -> io::Result<()> {
    Err(io::Error::from_raw_os_error(libc::EOPNOTSUPP))
}

#[allow(
    clippy::unnecessary_cast,
    reason = "the numbers are narrower on other systems"
)]
fn compare(file: &File, additional: u64) -> io::Result<()> {
    // SAFETY: the structure is plain numbers, for which zeros are valid.
    let mut disc: libc::statvfs = unsafe { std::mem::zeroed() };
    // SAFETY: the descriptor is open, and the structure lives through the call.
    if unsafe { libc::fstatvfs(file.as_raw_fd(), &mut disc) } != 0 {
        return Err(io::Error::last_os_error());
    }
    if (disc.f_bavail as u64).saturating_mul(disc.f_frsize as u64) < additional {
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
    fn what_no_disc_can_hold_is_refused_and_the_length_stays() {
        let path = std::env::temp_dir().join(format!("fissure-reserve-{}", std::process::id()));
        std::fs::write(&path, "abc").unwrap();
        let mut reservation = Reservation::new(&path).unwrap();
        reservation.grow(100_000).unwrap();
        assert_eq!(std::fs::metadata(&path).unwrap().len(), 3);
        assert!(compare(&reservation.file, u64::MAX).is_err());
        let error = reservation.grow(1 << 60).unwrap_err();
        assert!(
            error.message.contains("bytes more on the disc"),
            "{}",
            error.message
        );
        std::fs::remove_file(&path).unwrap();
    }
}
