//! Communication between ranks. No other folder calls MPI.
//!
//! All other code uses [`Communicator`]: a few collective operations, and a halo exchange that overlaps with
//! computation. [`Communicator`] has two implementations: [`mpi::World`] and [`threads`]. [`threads`] is for
//! one rank without MPI, and for tests with several ranks in one process.

mod by_id;
mod equality;
mod file_sync;
pub mod halo;
pub mod mpi;
pub mod rounded_sum;
pub mod sum;
pub mod threads;

pub use by_id::IdOrder;
pub use equality::check_equal;
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
    /// Received values. The length of this vector is the expected number of values.
    pub receive: Vec<f64>,
}

/// Work that overlaps with an exchange; see [`Communicator::exchange`].
pub type During<'a> = dyn FnMut(&mut dyn FnMut() -> bool) + 'a;

/// A group of ranks. All methods except [`Self::rank`], [`Self::size`] and [`Self::raw`] are collective.
pub trait Communicator {
    /// This rank's number, from 0.
    fn rank(&self) -> usize;

    /// The number of ranks.
    fn size(&self) -> usize;

    /// Element-wise sum over the ranks, in place. An overflow wraps around.
    fn sum(&self, values: &mut [u64]);

    /// Element-wise maximum over the ranks, in place. Values must not be NaN.
    fn max(&self, values: &mut [f64]);

    /// Replace `data` on every rank by the data of rank `root`.
    fn broadcast(&self, root: usize, data: &mut Vec<u8>);

    /// Send `outgoing[q]` to rank q. Return the received buffers by rank.
    fn all_to_all(&self, outgoing: Vec<Vec<u8>>) -> Vec<Vec<u8>>;

    /// Gather the bytes of all ranks, concatenated in rank order. Ranks may have different numbers of bytes.
    fn all_gather(&self, own: &[u8]) -> Vec<u8>;

    /// Send and receive all buffers, and call `during` while messages are in flight.
    ///
    /// Large messages progress only inside MPI calls. Therefore `during` should call its argument from time
    /// to time. Each such call advances the messages, and returns true while any message is in flight.
    fn exchange(&self, buffers: &mut [PeerBuffers], during: &mut During<'_>);

    /// The raw MPI handle; `None` without MPI.
    fn raw(&self) -> Option<RawCommunicator>;
}

/// Sum of one value over the ranks. Collective.
pub fn total(comm: &dyn Communicator, value: u64) -> u64 {
    let mut values = [value];
    comm.sum(&mut values);
    values[0]
}

/// Element-wise minimum over the ranks, in place. Values must not be NaN. Collective.
pub fn min(comm: &dyn Communicator, values: &mut [f64]) {
    values.iter_mut().for_each(|value| *value = -*value);
    comm.max(values);
    values.iter_mut().for_each(|value| *value = -*value);
}

/// The value of every rank, in rank order. Collective.
pub fn all_gather(comm: &dyn Communicator, value: u64) -> Vec<u64> {
    let mut values = vec![0; comm.size()];
    values[comm.rank()] = value;
    comm.sum(&mut values);
    values
}

/// Gather the values of all ranks, concatenated in rank order. Ranks may have different numbers of values.
/// Collective.
pub fn all_gather_many<T: bytemuck::Pod>(comm: &dyn Communicator, own: &[T]) -> Vec<T> {
    bytemuck::pod_collect_to_vec(&comm.all_gather(bytemuck::cast_slice(own)))
}

/// A candidate for the result of [`least`]; each rank has at most one.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Found<T, const N: usize = 1> {
    /// Key that is compared first.
    pub key: f64,
    /// Ids that are compared if keys are equal, such as the id of a point.
    pub ids: [u64; N],
    /// Data of the candidate.
    pub payload: T,
}

/// Find the candidate with the smallest key over all ranks. Among candidates with equal keys, the one
/// with the lexicographically smallest ids is chosen. `own` is the candidate of this rank. Return `None` if
/// no rank has a candidate. The result is the same on all ranks. Collective.
pub fn least<T: bytemuck::Pod, const N: usize>(
    comm: &dyn Communicator,
    own: Option<Found<T, N>>,
) -> Option<Found<T, N>>
where
    [u64; N]: bytemuck::Pod,
{
    let mut packed = Vec::new();
    if let Some(Found { key, ids, payload }) = own {
        packed.extend_from_slice(bytemuck::bytes_of(&key));
        packed.extend_from_slice(bytemuck::bytes_of(&ids));
        packed.extend_from_slice(bytemuck::bytes_of(&payload));
    }
    let (key, ids) = (size_of::<f64>(), size_of::<[u64; N]>());
    let all = comm.all_gather(&packed);
    let found = all.chunks_exact(key + ids + size_of::<T>()).map(|bytes| {
        let (first, payload) = bytes.split_at(key + ids);
        Found {
            key: bytemuck::pod_read_unaligned(&first[..key]),
            ids: bytemuck::pod_read_unaligned(&first[key..]),
            payload: bytemuck::pod_read_unaligned(payload),
        }
    });
    found.min_by(|a: &Found<T, N>, b| a.key.total_cmp(&b.key).then(a.ids.cmp(&b.ids)))
}

/// The sum of `value` over the lower ranks, and the sum over all ranks. Collective.
pub fn scan(comm: &dyn Communicator, value: u64) -> (u64, u64) {
    let values = all_gather(comm, value);
    let before = values[..comm.rank()].iter().sum();
    (before, values.iter().sum())
}

/// Return an error on all ranks if any rank failed: the error of the lowest failed rank. Otherwise, each rank
/// returns its own result. Collective.
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
    let mut packed = result.err().map_or(Vec::new(), |error| pack(&error));
    comm.broadcast(first[0] as usize, &mut packed);
    Err(unpack(&packed))
}

/// Value that is packed in place of the span if an error has no span.
const NO_SPAN: [u64; 2] = [u64::MAX; 2];

/// Length (bytes) of the header of a packed error. The header contains the exit code, and the start and end
/// of the span. The message follows the header.
const HEADER: usize = 1 + size_of::<[u64; 2]>();

/// Serialize an error.
fn pack(error: &Error) -> Vec<u8> {
    let span = error.span.as_ref();
    let span = span.map_or(NO_SPAN, |span| [span.start as u64, span.end as u64]);
    let code = [error.exit_code()];
    [&code, bytemuck::bytes_of(&span), error.message.as_bytes()].concat()
}

fn unpack(packed: &[u8]) -> Error {
    let (header, message) = packed.split_at(HEADER);
    let span: [u64; 2] = bytemuck::pod_read_unaligned(&header[1..]);
    Error {
        kind: match header[0] {
            2 => ErrorKind::Input,
            75 => ErrorKind::Stopped,
            _ => ErrorKind::Run,
        },
        message: String::from_utf8_lossy(message).into_owned(),
        span: (span != NO_SPAN).then(|| span[0] as usize..span[1] as usize),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_ranks_return_the_error_of_the_lowest_failed_rank() {
        for span in [None, Some(3..5), Some(0..0)] {
            let errors = threads::run(4, |comm| {
                let rank = comm.rank();
                let error = Error {
                    span: span.clone(),
                    ..Error::input(format!("rank {rank} failed"))
                };
                agree(comm, if rank >= 2 { Err(error) } else { Ok(()) }).unwrap_err()
            });
            for error in errors {
                assert_eq!(error.message, "rank 2 failed");
                assert_eq!(error.kind, ErrorKind::Input);
                assert_eq!(error.span, span);
            }
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
    fn the_least_key_and_then_the_least_id_count() {
        let of = |key: f64, id: u64, payload: u32| Found {
            key,
            ids: [id],
            payload,
        };
        let found = threads::run(4, |comm| match comm.rank() {
            0 => least(comm, Some(of(2.0, 0, 5))),
            1 => least(comm, Some(of(-1.0, 1 << 60, 6))),
            2 => least(comm, Some(of(-1.0, (1 << 60) - 1, 7))),
            _ => least(comm, None),
        });
        assert_eq!(found, [Some(of(-1.0, (1 << 60) - 1, 7)); 4]);
        let none = threads::run(2, |comm| least::<(), 1>(comm, None));
        assert_eq!(none, [None; 2]);
    }

    #[test]
    fn scan_returns_the_exclusive_prefix_sum_and_the_total() {
        let scans = threads::run(3, |comm| scan(comm, 10 * (comm.rank() as u64 + 1)));
        assert_eq!(scans, [(0, 60), (10, 60), (30, 60)]);
    }
}
