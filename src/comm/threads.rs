//! Ranks as threads of one process: for one rank without MPI, and for tests with several ranks.

use std::sync::{Arc, Barrier, Mutex};

use super::{Communicator, During, PeerBuffers, RawCommunicator};

/// The state that the ranks share: a barrier, and one message buffer for each pair of sender and receiver. In
/// an all-gather, each rank writes its data to the buffer whose sender and receiver are this rank.
struct Shared {
    barrier: Barrier,
    slots: Vec<Mutex<Vec<u8>>>,
}

/// One rank of a group of ranks that are threads of one process.
pub struct ThreadRank {
    rank: usize,
    size: usize,
    shared: Arc<Shared>,
}

/// A communicator of one rank.
pub fn alone() -> ThreadRank {
    group(1).remove(0)
}

fn group(size: usize) -> Vec<ThreadRank> {
    let shared = Arc::new(Shared {
        barrier: Barrier::new(size),
        slots: (0..size * size).map(|_| Mutex::default()).collect(),
    });
    (0..size)
        .map(|rank| ThreadRank {
            rank,
            size,
            shared: Arc::clone(&shared),
        })
        .collect()
}

/// Run `body` on `size` ranks, each on its own thread. Return their results in rank order.
///
/// # Panics
/// If `body` panics on a rank.
pub fn run<T: Send>(size: usize, body: impl Fn(&dyn Communicator) -> T + Sync) -> Vec<T> {
    std::thread::scope(|scope| {
        let handles: Vec<_> = group(size)
            .into_iter()
            .map(|rank| {
                let body = &body;
                scope.spawn(move || body(&rank))
            })
            .collect();
        handles
            .into_iter()
            .map(|handle| handle.join().expect("a rank panicked"))
            .collect()
    })
}

impl ThreadRank {
    fn slot(&self, from: usize, to: usize) -> std::sync::MutexGuard<'_, Vec<u8>> {
        self.shared.slots[from * self.size + to]
            .lock()
            .expect("no rank panics while it holds a slot")
    }

    /// Gather the values of all ranks, in rank order. All ranks must have the same number of values.
    fn gather<T: bytemuck::Pod>(&self, values: &[T]) -> Vec<Vec<T>> {
        let all = self.all_gather(bytemuck::cast_slice(values));
        let rows = (0..self.size).map(|rank| &all[rank * size_of_val(values)..]);
        rows.map(|row| bytemuck::pod_collect_to_vec(&row[..size_of_val(values)]))
            .collect()
    }
}

impl Communicator for ThreadRank {
    fn rank(&self) -> usize {
        self.rank
    }

    fn size(&self) -> usize {
        self.size
    }

    fn sum(&self, values: &mut [u64]) {
        if self.size == 1 {
            return;
        }
        let all = self.gather(values);
        for (k, value) in values.iter_mut().enumerate() {
            *value = all.iter().fold(0, |sum, row| row[k].wrapping_add(sum));
        }
    }

    fn max(&self, values: &mut [f64]) {
        if self.size == 1 {
            return;
        }
        let all = self.gather(values);
        for (k, value) in values.iter_mut().enumerate() {
            *value = all
                .iter()
                .fold(f64::NEG_INFINITY, |max, row| max.max(row[k]));
        }
    }

    fn broadcast(&self, root: usize, data: &mut Vec<u8>) {
        let outgoing = if self.rank == root {
            vec![data.clone(); self.size]
        } else {
            vec![Vec::new(); self.size]
        };
        *data = self.all_to_all(outgoing).swap_remove(root);
    }

    fn all_to_all(&self, outgoing: Vec<Vec<u8>>) -> Vec<Vec<u8>> {
        for (to, message) in outgoing.into_iter().enumerate() {
            *self.slot(self.rank, to) = message;
        }
        self.shared.barrier.wait();
        let incoming = (0..self.size)
            .map(|from| std::mem::take(&mut *self.slot(from, self.rank)))
            .collect();
        self.shared.barrier.wait();
        incoming
    }

    fn all_gather(&self, own: &[u8]) -> Vec<u8> {
        *self.slot(self.rank, self.rank) = own.to_vec();
        self.shared.barrier.wait();
        let mut all = Vec::new();
        for rank in 0..self.size {
            all.extend_from_slice(&self.slot(rank, rank));
        }
        self.shared.barrier.wait();
        all
    }

    fn exchange(&self, buffers: &mut [PeerBuffers], during: &mut During<'_>) {
        let mut outgoing = vec![Vec::new(); self.size];
        for peer in buffers.iter() {
            outgoing[peer.rank] = bytemuck::cast_slice(&peer.send).to_vec();
        }
        // Messages are delivered only after `during`, so they count as in flight until then.
        let in_flight = !buffers.is_empty();
        during(&mut || in_flight);
        let incoming = self.all_to_all(outgoing);
        for peer in buffers {
            let values: Vec<f64> = bytemuck::pod_collect_to_vec(&incoming[peer.rank]);
            peer.receive.copy_from_slice(&values);
        }
    }

    fn raw(&self) -> Option<RawCommunicator> {
        None
    }
}
