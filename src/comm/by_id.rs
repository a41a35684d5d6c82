//! Redistribution of point values over the ranks: from the distribution by owner to the distribution by
//! global id, and back. In the distribution by id, each rank has one range of consecutive ids.
//!
//! Files store points by id, so files do not depend on the number of ranks. A point of a refined level has
//! the id m + k n. Here m is the id of a level-0 point, n is the number of level-0 points, and k ≥ 1. In
//! files, such a point follows the level-0 point m.

use std::ops::Range;

use bytemuck::Pod;
use rayon::prelude::*;

use super::Communicator;

/// The exchange plan of a rank. It covers the points that the rank owns and the points in the rank's range of
/// ids.
pub struct IdOrder {
    first: u64,
    count: usize,
    /// For each rank q: the local indices of the points that this rank owns and whose ids are in the range of
    /// q.
    owned: Vec<Vec<u32>>,
    /// For each rank q: row numbers in this rank's range of ids. These are the rows of the points that q
    /// owns, in the order in which `owned` on rank q lists these points.
    rows_in_range: Vec<Vec<u32>>,
}

impl IdOrder {
    /// Create the plan for the ids of the owned points. `coarsest` is the number of level-0 points of all
    /// ranks. Collective.
    pub fn new(comm: &dyn Communicator, ids: &[u64], coarsest: u64) -> Self {
        let size = comm.size() as u64;
        let border =
            |rank: u64| (u128::from(coarsest) * u128::from(rank) / u128::from(size)) as u64;
        // `guess` can be too low, because the limits of the ranges are rounded down.
        let home = |id: u64| {
            let id = id % coarsest;
            let guess = (u128::from(id) * u128::from(size) / u128::from(coarsest)) as u64;
            (guess..size)
                .find(|rank| id < border(rank + 1))
                .unwrap_or(guess) as usize
        };
        let mut owned = vec![Vec::new(); comm.size()];
        let mut outgoing = vec![Vec::new(); comm.size()];
        for (index, id) in ids.iter().enumerate() {
            let home = home(*id);
            owned[home].push(index as u32);
            outgoing[home].extend_from_slice(&id.to_ne_bytes());
        }
        let incoming = comm.all_to_all(outgoing);
        let mut sorted = Vec::new();
        let mut rows_in_range = Vec::with_capacity(incoming.len());
        for (bytes, rank) in incoming.iter().zip(0_u32..) {
            let ids = bytemuck::pod_collect_to_vec::<u8, u64>(bytes);
            let numbered = ids.iter().zip(0_u32..);
            sorted.extend(numbered.map(|(id, k)| (id % coarsest, id / coarsest, rank, k)));
            rows_in_range.push(vec![0; ids.len()]);
        }
        drop(incoming);
        sorted.par_sort_unstable();
        for ((_, _, rank, k), row) in sorted.iter().zip(0..) {
            rows_in_range[*rank as usize][*k as usize] = row;
        }
        let (first, _) = super::scan(comm, sorted.len() as u64);
        Self {
            first,
            count: sorted.len(),
            owned,
            rows_in_range,
        }
    }

    /// Number of points in the ranges of ids of all lower ranks.
    pub fn first(&self) -> u64 {
        self.first
    }

    /// Number of points in this rank's range of ids.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Redistribute values, `width` per point, from the owned points to this rank's range of ids. Collective.
    pub fn collect<T: Pod>(&self, comm: &dyn Communicator, values: &[T], width: usize) -> Vec<T> {
        let row = |row: usize| row * width..(row + 1) * width;
        let from = (&self.owned[..], values, row);
        transfer(
            comm,
            from,
            (&self.rows_in_range[..], self.count * width, row),
        )
    }

    /// Redistribute values, `width` per point, from this rank's range of ids to the owned points. Collective.
    pub fn spread<T: Pod>(&self, comm: &dyn Communicator, values: &[T], width: usize) -> Vec<T> {
        let row = |row: usize| row * width..(row + 1) * width;
        let from = (&self.rows_in_range[..], values, row);
        let owned = self.owned.iter().map(Vec::len).sum::<usize>();
        transfer(comm, from, (&self.owned[..], owned * width, row))
    }

    /// Same as [`Self::collect`], for rows of different lengths. `owned` and `block` are the row lengths of
    /// the owned points and of this rank's range of ids.
    pub fn collect_ragged<T: Pod>(
        &self,
        comm: &dyn Communicator,
        values: &[T],
        owned: &[u32],
        block: &[u32],
    ) -> Vec<T> {
        let (from, to) = (offsets(owned), offsets(block));
        let from_row = |row: usize| from[row]..from[row + 1];
        let to_row = |row: usize| to[row]..to[row + 1];
        let size = to[block.len()];
        transfer(
            comm,
            (&self.owned[..], values, from_row),
            (&self.rows_in_range[..], size, to_row),
        )
    }

    /// Same as [`Self::spread`], for rows of different lengths; see [`Self::collect_ragged`].
    pub fn spread_ragged<T: Pod>(
        &self,
        comm: &dyn Communicator,
        values: &[T],
        owned: &[u32],
        block: &[u32],
    ) -> Vec<T> {
        let (from, to) = (offsets(block), offsets(owned));
        let from_row = |row: usize| from[row]..from[row + 1];
        let to_row = |row: usize| to[row]..to[row + 1];
        let size = to[owned.len()];
        transfer(
            comm,
            (&self.rows_in_range[..], values, from_row),
            (&self.owned[..], size, to_row),
        )
    }
}

/// The offset of each row, followed by the end of the last row.
fn offsets(lengths: &[u32]) -> Vec<usize> {
    let ends = lengths.iter().scan(0, |end, length| {
        *end += *length as usize;
        Some(*end)
    });
    std::iter::once(0).chain(ends).collect()
}

/// Send rows of `values` to the other ranks, and write the received rows to a new array of length `size`.
/// Rows that stay on this rank are copied. Collective.
///
/// For each rank q, `from_rows` lists the rows of `values` to send to q. `to_rows` lists the rows of the
/// result that come from q, in the order in which q sends them. `from` returns the range of indices that
/// a row has in `values`. `to` returns the range of indices that a row has in the result.
fn transfer<T: Pod>(
    comm: &dyn Communicator,
    (from_rows, values, from): (&[Vec<u32>], &[T], impl Fn(usize) -> Range<usize>),
    (to_rows, size, to): (&[Vec<u32>], usize, impl Fn(usize) -> Range<usize>),
) -> Vec<T> {
    let this_rank = comm.rank();
    let pack = |(rank, rows): (usize, &Vec<u32>)| {
        // Rows that stay on this rank are copied below without a message.
        let rows = if rank == this_rank { &[] } else { &rows[..] };
        let lengths = rows.iter().map(|row| from(*row as usize).len());
        let mut bytes = Vec::with_capacity(size_of::<T>() * lengths.sum::<usize>());
        for row in rows {
            bytes.extend_from_slice(bytemuck::cast_slice(&values[from(*row as usize)]));
        }
        bytes
    };
    let incoming = comm.all_to_all(from_rows.iter().enumerate().map(pack).collect());
    let mut result = vec![T::zeroed(); size];
    for (source, target) in from_rows[this_rank].iter().zip(&to_rows[this_rank]) {
        result[to(*target as usize)].copy_from_slice(&values[from(*source as usize)]);
    }
    for (rank, (rows, bytes)) in to_rows.iter().zip(incoming).enumerate() {
        if rank == this_rank {
            continue;
        }
        let mut rest = &bytes[..];
        for row in rows {
            let target: &mut [u8] = bytemuck::cast_slice_mut(&mut result[to(*row as usize)]);
            let (source, remaining) = rest.split_at(target.len());
            target.copy_from_slice(source);
            rest = remaining;
        }
    }
    result
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comm::threads;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn spread_inverts_collect(
            owners in prop::collection::vec(0_usize..4, 1..60),
            ranks in 1_usize..5,
        ) {
            let total = owners.len() as u64;
            let blocks = threads::run(ranks, |comm| {
                let owned_id = |(id, owner): (u64, &usize)| (owner % ranks == comm.rank()).then_some(id);
                let mut ids: Vec<u64> = (0..).zip(&owners).filter_map(owned_id).collect();
                ids.reverse();
                let order = IdOrder::new(comm, &ids, total);
                let values: Vec<f64> = ids.iter().flat_map(|id| [*id as f64, -1.0]).collect();
                let block = order.collect(comm, &values, 2);
                assert_eq!(order.spread(comm, &block, 2), values);
                assert_eq!(block.len(), 2 * order.count());
                // The row of a point has id mod 3 entries.
                let length = |id: u64| (id % 3) as u32;
                let lengths: Vec<u32> = ids.iter().map(|id| length(*id)).collect();
                let block_ids = order.first()..order.first() + order.count() as u64;
                let block_lengths: Vec<u32> = block_ids.clone().map(length).collect();
                let row = |id: u64| vec![id as u8; length(id) as usize];
                let ragged: Vec<u8> = ids.iter().flat_map(|id| row(*id)).collect();
                let by_id = order.collect_ragged(comm, &ragged, &lengths, &block_lengths);
                assert_eq!(by_id, block_ids.flat_map(row).collect::<Vec<u8>>());
                let back = order.spread_ragged(comm, &by_id, &lengths, &block_lengths);
                assert_eq!(back, ragged);
                (order.first(), block)
            });
            let expected: Vec<f64> = (0..total).flat_map(|id| [id as f64, -1.0]).collect();
            let mut start = 0;
            for (first, block) in &blocks {
                prop_assert_eq!(*first, start);
                start += block.len() as u64 / 2;
            }
            prop_assert_eq!(blocks.into_iter().flat_map(|(_, block)| block).collect::<Vec<_>>(), expected);
        }
    }
}
