//! A seal: a checksum appended to a file, to detect truncation and corruption.
//!
//! HDF5 ignores the bytes of the seal, because they follow the last object of the file. To compute the
//! checksum, each rank reads a share of the file. Each 8-byte word is mixed with its index in the file, and
//! the checksum is the sum of the mixed words. Therefore the checksum does not depend on how the file is
//! divided into shares.

use std::fs::{File, OpenOptions};
use std::io::{Read, Seek, SeekFrom, Write};
use std::path::Path;

use crate::comm::{Communicator, agree};
use crate::error::{Error, Result};

/// First word of a seal, which distinguishes a seal from other bytes at the end of a file.
const MAGIC: u64 = u64::from_le_bytes(*b"FISSSEAL");

/// Size of a seal, bytes. A seal has four words: magic, number of sealed bytes, checksum, and a number given
/// by the caller.
const SEAL_BYTES: u64 = 32;

/// Size of the read buffer, bytes.
const BUFFER: usize = 1 << 20;

/// Append a seal with the caller's number to a closed file, and fsync the file. Collective.
///
/// # Errors
/// If the file cannot be read or written.
pub fn seal(comm: &dyn Communicator, path: &Path, number: u64) -> Result<()> {
    let length = from_root(comm, path, || Ok([length(path)?]))?[0];
    let sum = checksum(comm, path, length)?;
    let append = || -> std::io::Result<()> {
        let mut file = OpenOptions::new().append(true).open(path)?;
        let words = [MAGIC, length, sum ^ mix(number), number];
        file.write_all(&words.map(u64::to_le_bytes).concat())?;
        file.sync_all()
    };
    let appended = match comm.rank() {
        0 => append().map_err(|error| failure(path, &error)),
        _ => Ok(()),
    };
    agree(comm, appended)
}

/// Return the number that the caller of [`seal`] stored in the seal of a file. Return `None` if the file has
/// no seal. The sealed bytes are not checked.
///
/// # Errors
/// If the file cannot be read.
pub fn number(path: &Path) -> Result<Option<u64>> {
    let seal = read_seal(path).map_err(|error| failure(path, &error))?;
    Ok(seal.map(|seal| seal.number))
}

/// Check the bytes of a file against its seal. Return false if the file has no seal. Collective.
///
/// # Errors
/// If the file cannot be read.
pub fn is_intact(comm: &dyn Communicator, path: &Path) -> Result<bool> {
    let words = from_root(comm, path, || {
        let seal = read_seal(path)?;
        Ok(seal.map_or([0; 4], |seal| [1, seal.length, seal.sum, seal.number]))
    })?;
    let [1, length, sum, number] = words else {
        return Ok(false);
    };
    Ok(checksum(comm, path, length)? ^ mix(number) == sum)
}

/// The contents of a seal after the magic.
struct Seal {
    /// Number of sealed bytes.
    length: u64,
    /// Checksum of the sealed bytes, mixed with the caller's number.
    sum: u64,
    number: u64,
}

/// Read the seal at the end of a file. Return `None` if the file has no seal.
fn read_seal(path: &Path) -> std::io::Result<Option<Seal>> {
    let mut file = File::open(path)?;
    let Some(sealed) = length(path)?.checked_sub(SEAL_BYTES) else {
        return Ok(None);
    };
    file.seek(SeekFrom::Start(sealed))?;
    let mut bytes = [0; SEAL_BYTES as usize];
    file.read_exact(&mut bytes)?;
    let [magic, length, sum, number]: [u64; 4] = bytemuck::cast(bytes);
    let [magic, length, sum, number] = [magic, length, sum, number].map(u64::from_le);
    let seal = Seal {
        length,
        sum,
        number,
    };
    Ok((magic == MAGIC && length == sealed).then_some(seal))
}

/// Call `read` on rank 0 and broadcast the returned words. The other ranks do not read, because their view of
/// the file system may be out of date. Collective.
fn from_root<const N: usize>(
    comm: &dyn Communicator,
    path: &Path,
    read: impl FnOnce() -> std::io::Result<[u64; N]>,
) -> Result<[u64; N]> {
    let words = match comm.rank() {
        0 => read().map_err(|error| failure(path, &error)),
        _ => Ok([0; N]),
    };
    // The other ranks contribute zeros, so the sum is a broadcast.
    let mut words = agree(comm, words)?;
    comm.sum(&mut words);
    Ok(words)
}

fn length(path: &Path) -> std::io::Result<u64> {
    Ok(std::fs::metadata(path)?.len())
}

/// Compute the checksum of the first `length` bytes of a file. Collective.
fn checksum(comm: &dyn Communicator, path: &Path, length: u64) -> Result<u64> {
    let words = length.div_ceil(8);
    let (rank, size) = (comm.rank() as u64, comm.size() as u64);
    let start = |rank: u64| (u128::from(words) * u128::from(rank) / u128::from(size)) as u64;
    let own = sum_words(path, start(rank), start(rank + 1), length);
    let own = agree(comm, own.map_err(|error| failure(path, &error)))?;
    Ok(crate::comm::total(comm, own))
}

/// Sum the 8-byte words `first` to `end` − 1 of a file. Before the sum, each word is mixed with its index.
/// Only the first `length` bytes of the file are read; an incomplete last word is padded with zeros.
fn sum_words(path: &Path, first: u64, end: u64, length: u64) -> std::io::Result<u64> {
    let mut file = File::open(path)?;
    file.seek(SeekFrom::Start(8 * first))?;
    let mut remaining = (8 * end).min(length).saturating_sub(8 * first);
    let mut buffer = vec![0; BUFFER];
    let (mut sum, mut index) = (0_u64, first);
    while remaining > 0 {
        let take = (remaining as usize).min(BUFFER);
        file.read_exact(&mut buffer[..take])?;
        buffer[take..take.next_multiple_of(8)].fill(0);
        for word in buffer[..take.next_multiple_of(8)].chunks_exact(8) {
            let word = u64::from_le_bytes(word.try_into().expect("a chunk has 8 bytes"));
            sum = sum.wrapping_add(mix(word ^ mix(index)));
            index += 1;
        }
        remaining -= take as u64;
    }
    Ok(sum)
}

/// Hash a word (the finaliser of SplitMix64).
pub fn mix(word: u64) -> u64 {
    let word = word.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let word = (word ^ word >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let word = (word ^ word >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    word ^ word >> 31
}

fn failure(path: &Path, error: &std::io::Error) -> Error {
    Error::run(format!(
        "{}: the checkpoint cannot be read or written: {error}",
        path.display()
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comm::threads;

    #[test]
    fn flipped_bits_and_truncation_are_detected() {
        let path = std::env::temp_dir().join(format!("fissure-seal-{}", std::process::id()));
        let bytes: Vec<u8> = (0..1003).map(|k| (k * 7) as u8).collect();
        std::fs::write(&path, &bytes).unwrap();
        threads::run(3, |comm| seal(comm, &path, 42).unwrap());
        assert_eq!(number(&path).unwrap(), Some(42));
        let intact = |ranks| threads::run(ranks, |comm| is_intact(comm, &path).unwrap());
        assert_eq!(intact(2), [true, true]);
        let sealed = std::fs::read(&path).unwrap();
        for bit in (0..8 * sealed.len()).step_by(61) {
            let mut flipped = sealed.clone();
            flipped[bit / 8] ^= 1 << (bit % 8);
            std::fs::write(&path, &flipped).unwrap();
            assert_eq!(intact(1), [false], "bit {bit}");
        }
        for length in [0, 10, 500, sealed.len() - 1] {
            std::fs::write(&path, &sealed[..length]).unwrap();
            assert_eq!(intact(1), [false], "cut to {length}");
        }
        // An unreadable file (a link to itself) is an error, not a damaged file.
        std::fs::remove_file(&path).unwrap();
        std::os::unix::fs::symlink(&path, &path).unwrap();
        assert!(number(&path).is_err());
        for checked in threads::run(2, |comm| is_intact(comm, &path)) {
            assert!(checked.is_err());
        }
        std::fs::remove_file(&path).unwrap();
    }
}
