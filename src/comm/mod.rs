//! Talking between ranks. The only folder that names MPI.
//!
//! The rest of the code sees [`Communicator`]: a handful of collective operations and one
//! nearest-neighbour exchange that runs work while messages are in flight. Two things implement it:
//! [`mpi::World`] for real runs and [`threads`] for one rank without MPI and for ranks that are
//! threads of one process, in tests.

mod by_id;
mod file_sync;
pub mod halo;
pub mod mpi;
pub mod sum;
pub mod threads;

pub use by_id::IdOrder;
pub use file_sync::without_confirmation;
pub use halo::Halo;
pub use sum::ExactSum;

use crate::error::{Error, ErrorKind, Result};

/// The raw MPI handle that the parallel file layer needs.
pub type RawCommunicator = mpi_sys::MPI_Comm;

/// One message each way between this rank and another.
#[derive(Debug, Default)]
pub struct Message {
    /// The other rank.
    pub rank: usize,
    /// What goes there.
    pub send: Vec<f64>,
    /// Where its message lands; the length is what is expected.
    pub receive: Vec<f64>,
}

/// Work that is done while messages are in flight; see [`Communicator::exchange`].
pub type During<'a> = dyn FnMut(&mut dyn FnMut() -> bool) + 'a;

/// What a rank can ask of the others. Every method is collective: all ranks call it alike.
pub trait Communicator {
    /// This rank's number, from 0.
    fn rank(&self) -> usize;

    /// The number of ranks.
    fn size(&self) -> usize;

    /// Element-wise sum over the ranks (wrapping), in place.
    fn sum(&self, values: &mut [u64]);

    /// Element-wise maximum over the ranks, in place. Values must not be NaN.
    fn max(&self, values: &mut [f64]);

    /// Replaces `data` on every rank by that of `root`.
    fn broadcast(&self, root: usize, data: &mut Vec<u8>);

    /// Sends `outgoing[q]` to rank q; returns what each rank sent here, by rank.
    fn all_to_all(&self, outgoing: Vec<Vec<u8>>) -> Vec<Vec<u8>>;

    /// The bytes of all ranks, one after the other in rank order; ranks may have different numbers of them.
    fn all_gather(&self, own: &[u8]) -> Vec<u8>;

    /// Sends and receives all messages, and calls `during` while they are in flight.
    ///
    /// Large messages move only while MPI is called: `during` should call its argument now and then,
    /// which drives them on and returns whether any is still under way.
    fn exchange(&self, messages: &mut [Message], during: &mut During<'_>);

    /// Ends all ranks at once, for when agreement is no longer possible.
    fn abort(&self, code: i32) -> !;

    /// The raw MPI handle, where there is one.
    fn raw(&self) -> Option<RawCommunicator>;
}

/// Sum of one count over the ranks.
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

/// The values of all ranks, one after the other in rank order; ranks may have different numbers of them.
pub fn all_gather_many<T: bytemuck::Pod>(comm: &dyn Communicator, own: &[T]) -> Vec<T> {
    bytemuck::pod_collect_to_vec(&comm.all_gather(bytemuck::cast_slice(own)))
}

/// What a rank has found, to be compared with what others have; see [`least`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Found<T, const N: usize = 1> {
    /// What is compared first.
    pub key: f64,
    /// What is compared where keys are equal, such as the id of a point.
    pub ids: [u64; N],
    /// What comes with it.
    pub payload: T,
}

/// What the ranks have found with the least key and, of these, the least ids; none if no rank has found anything. The
/// same on all ranks. Collective.
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

/// The sum of `value` over the ranks before this one, and over all.
pub fn scan(comm: &dyn Communicator, value: u64) -> (u64, u64) {
    let values = all_gather(comm, value);
    let before = values[..comm.rank()].iter().sum();
    (before, values.iter().sum())
}

/// Turns a result that can differ between ranks into one that does not: where any rank failed, all
/// get the error of the lowest rank that did.
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
    fn all_ranks_leave_with_the_lowest_failing_ranks_message() {
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
    fn scan_gives_what_came_before_and_the_total() {
        let scans = threads::run(3, |comm| scan(comm, 10 * (comm.rank() as u64 + 1)));
        assert_eq!(scans, [(0, 60), (10, 60), (30, 60)]);
    }
}
