//! The halo plan: the owned points sent to each rank, and the ghosts received from each rank.
//!
//! The local indices of the ghosts follow those of the owned points. The ghosts are grouped by owner and, in
//! each group, sorted by id. Therefore the ghosts of one owner are one contiguous range.

use std::ops::Range;
use std::time::{Duration, Instant};

use super::{Communicator, During, PeerBuffers};

/// The exchange with one other rank.
#[derive(Debug, Clone, PartialEq)]
pub struct Neighbour {
    /// The other rank.
    pub rank: usize,
    /// Local indices of owned points that are ghosts on the other rank, in the order of these ghosts.
    pub send: Vec<u32>,
    /// Local indices of the ghosts that the other rank owns.
    pub receive: Range<usize>,
}

/// Accumulated message traffic of a rank.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Traffic {
    /// Number of messages sent.
    pub messages: u64,
    /// Number of bytes sent.
    pub bytes: u64,
    /// Communication time: the time of sending, of the calls that advance the messages, and of waiting. Work
    /// that overlaps with the messages is not included.
    pub time: Duration,
}

/// The halo plan with its buffers, which all exchanges reuse.
#[derive(Debug, Default)]
pub struct Halo {
    neighbours: Vec<Neighbour>,
    buffers: Vec<PeerBuffers>,
    /// Accumulated traffic of [`Self::exchange`].
    pub sent: Traffic,
}

impl Halo {
    /// Allocate buffers for `width` values per point. An exchange of more values enlarges the buffers.
    pub fn new(neighbours: Vec<Neighbour>, width: usize) -> Self {
        let buffers = neighbours
            .iter()
            .map(|neighbour| PeerBuffers {
                rank: neighbour.rank,
                send: Vec::with_capacity(width * neighbour.send.len()),
                receive: Vec::with_capacity(width * neighbour.receive.len()),
            })
            .collect();
        Self {
            neighbours,
            buffers,
            sent: Traffic::default(),
        }
    }

    /// Number of neighbouring ranks.
    pub fn neighbours(&self) -> usize {
        self.neighbours.len()
    }

    /// Renumber the owned points. `new_index` maps old local indices to new ones.
    pub fn renumber(&mut self, new_index: &[u32]) {
        for neighbour in &mut self.neighbours {
            for index in &mut neighbour.send {
                *index = new_index[*index as usize];
            }
        }
    }

    /// Update the ghost entries of `components`, which are arrays over the local points. Collective.
    pub fn update_ghosts(&mut self, comm: &dyn Communicator, components: &mut [&mut [f64]]) {
        self.pack(components.iter().map(|component| &**component));
        self.exchange(comm, &mut |_| {});
        self.unpack(components.iter_mut().map(|component| &mut **component));
    }

    /// Copy values of owned points into the send buffers; `components` are arrays over the local points.
    pub fn pack<'a>(&mut self, components: impl ExactSizeIterator<Item = &'a [f64]> + Clone) {
        for (neighbour, buffers) in self.neighbours.iter().zip(&mut self.buffers) {
            buffers.send.clear();
            let count = components.len();
            for component in components.clone() {
                let values = neighbour.send.iter().map(|i| component[*i as usize]);
                buffers.send.extend(values);
            }
            buffers.receive.resize(count * neighbour.receive.len(), 0.0);
        }
    }

    /// Send the packed values. `during` is called while the messages are in flight; see
    /// [`Communicator::exchange`]. Collective.
    pub fn exchange(&mut self, comm: &dyn Communicator, during: &mut During<'_>) {
        let start = Instant::now();
        let mut working = Duration::ZERO;
        self.sent.messages += self.buffers.len() as u64;
        for buffers in &self.buffers {
            self.sent.bytes += size_of_val(&buffers.send[..]) as u64;
        }
        comm.exchange(&mut self.buffers, &mut |progress| {
            let start = Instant::now();
            let mut progressing = Duration::ZERO;
            during(&mut || {
                let start = Instant::now();
                let in_flight = progress();
                progressing += start.elapsed();
                in_flight
            });
            working += start.elapsed() - progressing;
        });
        self.sent.time += start.elapsed() - working;
    }

    /// Copy the received values to the ghost entries of `components`. The arrays must be in the same order as
    /// in [`Self::pack`].
    pub fn unpack<'a>(&self, components: impl Iterator<Item = &'a mut [f64]>) {
        for (k, component) in components.enumerate() {
            for (neighbour, buffers) in self.neighbours.iter().zip(&self.buffers) {
                let count = neighbour.receive.len();
                component[neighbour.receive.clone()]
                    .copy_from_slice(&buffers.receive[k * count..(k + 1) * count]);
            }
        }
    }
}
