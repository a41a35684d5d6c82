//! Communication between ranks. No other folder calls MPI.
//!
//! All other code uses [`Communicator`]: a few collective operations and one halo exchange that
//! overlaps with computation. It has two implementations: [`mpi::World`], and [`threads`] for one rank
//! without MPI and for tests with several ranks in one process.

mod by_id;
mod file_sync;
pub mod halo;
pub mod mpi;
pub mod sum;
pub mod threads;

pub use by_id::IdOrder;
pub use file_sync::without_fsync;
pub use halo::Halo;
pub use sum::ExactSum;

use crate::error::{Error, ErrorKind, Result};

/// The raw MPI handle; parallel HDF5 needs it.
pub type RawCommunicator = mpi_sys::MPI_Comm;

/// The send and receive buffers of one pair of ranks.
#[derive(Debug, Default)]
pub struct PeerBuffers {
    /// The other rank.
    pub rank: usize,
    /// Values to send.
    pub send: Vec<f64>,
    /// Received values; its length is the expected message length.
    pub receive: Vec<f64>,
}

/// Work that overlaps with an exchange; see [`Communicator::exchange`].
pub type During<'a> = dyn FnMut(&mut dyn FnMut() -> bool) + 'a;

/// A group of ranks. All methods but [`Self::rank`], [`Self::size`], [`Self::abort`] and [`Self::raw`] are collective.
pub trait Communicator {
    /// This rank's number, from 0.
    fn rank(&self) -> usize;

    /// The number of ranks.
    fn size(&self) -> usize;

    /// Element-wise sum over the ranks (wrapping), in place.
    fn sum(&self, values: &mut [u64]);

    /// Element-wise maximum over the ranks, in place. Values must not be NaN.
    fn max(&self, values: &mut [f64]);

    /// Replace `data` on every rank by that of rank `root`.
    fn broadcast(&self, root: usize, data: &mut Vec<u8>);

    /// Send `outgoing[q]` to rank q; return the received buffers by rank.
    fn all_to_all(&self, outgoing: Vec<Vec<u8>>) -> Vec<Vec<u8>>;

    /// Send and receive all buffers, and call `during` while messages are in flight.
    ///
    /// Large messages progress only inside MPI calls. So `during` should call its argument from time to
    /// time: it drives progress and returns true while any message is in flight.
    fn exchange(&self, buffers: &mut [PeerBuffers], during: &mut During<'_>);

    /// Abort all ranks, for errors on which they can no longer agree.
    fn abort(&self, code: i32) -> !;

    /// The raw MPI handle; `None` without MPI.
    fn raw(&self) -> Option<RawCommunicator>;
}

/// Sum of one value over the ranks.
pub fn total(comm: &dyn Communicator, value: u64) -> u64 {
    let mut values = [value];
    comm.sum(&mut values);
    values[0]
}

/// Element-wise minimum over the ranks, in place. Values must not be NaN.
pub fn min(comm: &dyn Communicator, values: &mut [f64]) {
    values.iter_mut().for_each(|value| *value = -*value);
    comm.max(values);
    values.iter_mut().for_each(|value| *value = -*value);
}

/// The value of every rank, in rank order.
pub fn all_gather(comm: &dyn Communicator, value: u64) -> Vec<u64> {
    let mut values = vec![0; comm.size()];
    values[comm.rank()] = value;
    comm.sum(&mut values);
    values
}

/// The values of all ranks, concatenated in rank order; ranks may have different counts.
pub fn all_gather_many<T: bytemuck::Pod>(comm: &dyn Communicator, own: &[T]) -> Vec<T> {
    let bytes: &[u8] = bytemuck::cast_slice(own);
    let all = comm.all_to_all(vec![bytes.to_vec(); comm.size()]).concat();
    bytemuck::pod_collect_to_vec(&all)
}

/// The sum of `value` over the ranks before this one, and over all.
pub fn scan(comm: &dyn Communicator, value: u64) -> (u64, u64) {
    let values = all_gather(comm, value);
    let before = values[..comm.rank()].iter().sum();
    (before, values.iter().sum())
}

/// Make a result equal on all ranks: if any rank failed, all return the error of the lowest failed rank.
pub fn agree<T>(comm: &dyn Communicator, result: Result<T>) -> Result<T> {
    let none = comm.size() as f64;
    let mut first = [if result.is_err() {
        comm.rank() as f64
    } else {
        none
    }];
    min(comm, &mut first);
    if first[0] == none {
        return result;
    }
    let mut packed = match &result {
        Err(error) => {
            let mut bytes = vec![error.exit_code()];
            bytes.extend_from_slice(error.message.as_bytes());
            bytes
        }
        Ok(_) => Vec::new(),
    };
    comm.broadcast(first[0] as usize, &mut packed);
    let kind = match packed[0] {
        2 => ErrorKind::Input,
        75 => ErrorKind::Stopped,
        _ => ErrorKind::Run,
    };
    Err(Error {
        kind,
        message: String::from_utf8_lossy(&packed[1..]).into_owned(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_ranks_return_the_error_of_the_lowest_failed_rank() {
        let messages = threads::run(4, |comm| {
            let result = if comm.rank() >= 2 {
                Err(Error::input(format!("rank {} failed", comm.rank())))
            } else {
                Ok(())
            };
            agree(comm, result).unwrap_err()
        });
        for error in messages {
            assert_eq!(error.message, "rank 2 failed");
            assert_eq!(error.kind, ErrorKind::Input);
        }
    }

    #[test]
    fn gathered_values_are_in_rank_order() {
        let gathered = threads::run(3, |comm| {
            let own = vec![[comm.rank() as f64, 0.5]; comm.rank()];
            all_gather_many(comm, &own)
        });
        for all in gathered {
            assert_eq!(all, [[1.0, 0.5], [2.0, 0.5], [2.0, 0.5]]);
        }
    }

    #[test]
    fn scan_returns_the_exclusive_prefix_sum_and_the_total() {
        let scans = threads::run(3, |comm| scan(comm, 10 * (comm.rank() as u64 + 1)));
        assert_eq!(scans, [(0, 60), (10, 60), (30, 60)]);
    }
}
