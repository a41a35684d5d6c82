//! Values of points in the order of their global ids, dealt out to the ranks in equal blocks.
//!
//! Files hold points in this order, so that they do not depend on the number of ranks.

use bytemuck::Pod;

use super::Communicator;

/// The way between the points that a rank owns and its block of consecutive ids.
pub struct IdOrder {
    first: u64,
    count: usize,
    /// For each rank, which owned points have ids in its block.
    owned: Vec<Vec<u32>>,
    /// For each rank, which rows of this rank's block are points that it owns.
    rows: Vec<Vec<u32>>,
}

impl IdOrder {
    /// For owned points with these ids, of `total` points on all ranks. Collective.
    pub fn new(comm: &dyn Communicator, ids: &[u64], total: u64) -> Self {
        let size = comm.size() as u64;
        let border = |rank: u64| (u128::from(total) * u128::from(rank) / u128::from(size)) as u64;
        // The first guess can be one too low, by the rounding of the borders.
        let home = |id: u64| {
            let guess = (u128::from(id) * u128::from(size) / u128::from(total)) as u64;
            (guess..size)
                .find(|rank| id < border(rank + 1))
                .unwrap_or(guess) as usize
        };
        let rank = comm.rank() as u64;
        let (first, end) = (border(rank), border(rank + 1));
        let mut owned = vec![Vec::new(); comm.size()];
        let mut outgoing = vec![Vec::new(); comm.size()];
        for (index, id) in ids.iter().enumerate() {
            owned[home(*id)].push(index as u32);
            outgoing[home(*id)].extend_from_slice(&id.to_ne_bytes());
        }
        let row = |id: &u64| (id - first) as u32;
        let rows = comm
            .all_to_all(outgoing)
            .iter()
            .map(|bytes| {
                bytemuck::pod_collect_to_vec::<u8, u64>(bytes)
                    .iter()
                    .map(row)
                    .collect()
            })
            .collect();
        Self {
            first,
            count: (end - first) as usize,
            owned,
            rows,
        }
    }

    /// The first id of this rank's block.
    pub fn first(&self) -> u64 {
        self.first
    }

    /// Number of ids in this rank's block.
    pub fn count(&self) -> usize {
        self.count
    }

    /// From values of the owned points, `width` a point, to those of this rank's block of ids.
    /// Collective.
    pub fn collect<T: Pod>(&self, comm: &dyn Communicator, values: &[T], width: usize) -> Vec<T> {
        let size = self.count * width;
        transfer(comm, (&self.owned, values), (&self.rows, size), width)
    }

    /// From values of this rank's block of ids, `width` an id, to those of the owned points.
    /// Collective.
    pub fn spread<T: Pod>(&self, comm: &dyn Communicator, values: &[T], width: usize) -> Vec<T> {
        let size = width * self.owned.iter().map(Vec::len).sum::<usize>();
        transfer(comm, (&self.rows, values), (&self.owned, size), width)
    }
}

/// Sends the listed rows of `from` to each rank, and puts what comes into the listed rows of a new
/// array.
fn transfer<T: Pod>(
    comm: &dyn Communicator,
    from: (&[Vec<u32>], &[T]),
    to: (&[Vec<u32>], usize),
    width: usize,
) -> Vec<T> {
    let place = |row: u32| row as usize * width..(row as usize + 1) * width;
    let pack = |rows: &Vec<u32>| {
        let values = rows.iter().flat_map(|row| &from.1[place(*row)]);
        values
            .flat_map(|value| bytemuck::bytes_of(value).iter().copied())
            .collect()
    };
    let incoming = comm.all_to_all(from.0.iter().map(pack).collect());
    let mut result = vec![T::zeroed(); to.1];
    for (rows, bytes) in to.0.iter().zip(incoming) {
        let values: Vec<T> = bytemuck::pod_collect_to_vec(&bytes);
        for (row, value) in rows.iter().zip(values.chunks_exact(width.max(1))) {
            result[place(*row)].copy_from_slice(value);
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
        fn there_and_back(
            owners in prop::collection::vec(0_usize..4, 1..60),
            ranks in 1_usize..5,
        ) {
            let total = owners.len() as u64;
            let blocks = threads::run(ranks, |comm| {
                let mine = |(id, owner): (u64, &usize)| (owner % ranks == comm.rank()).then_some(id);
                let mut ids: Vec<u64> = (0..).zip(&owners).filter_map(mine).collect();
                ids.reverse();
                let order = IdOrder::new(comm, &ids, total);
                let values: Vec<f64> = ids.iter().flat_map(|id| [*id as f64, -1.0]).collect();
                let block = order.collect(comm, &values, 2);
                assert_eq!(order.spread(comm, &block, 2), values);
                assert_eq!(block.len(), 2 * order.count());
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
