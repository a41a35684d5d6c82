//! The halo plan: which owned points go to which rank, and where the ghosts that come back lie.
//!
//! Ghosts follow the owned points, grouped by owner and sorted by id, so that what one rank sends is
//! one contiguous range here.

use std::ops::Range;
use std::time::{Duration, Instant};

use super::{Communicator, During, Message};

/// What is exchanged with one other rank.
#[derive(Debug, Clone, PartialEq)]
pub struct Neighbour {
    /// The other rank.
    pub rank: usize,
    /// Local indices of owned points that are ghosts there, in the order of that rank's ghosts.
    pub send: Vec<u32>,
    /// Local indices of the ghosts that this rank owns.
    pub receive: Range<usize>,
}

/// What a rank has sent so far.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Traffic {
    /// Messages.
    pub messages: u64,
    /// Bytes in them.
    pub bytes: u64,
    /// Time that they took of the rank: sending, driving them on and waiting, without the work that
    /// was done meanwhile.
    pub time: Duration,
}

/// The problem with its message buffers, all allocated once.
#[derive(Debug, Default)]
pub struct Halo {
    neighbours: Vec<Neighbour>,
    messages: Vec<Message>,
    /// What has been sent by [`Self::exchange`].
    pub sent: Traffic,
}

impl Halo {
    /// Prepares messages of up to `width` numbers a point.
    pub fn new(neighbours: Vec<Neighbour>, width: usize) -> Self {
        let messages = neighbours
            .iter()
            .map(|neighbour| Message {
                rank: neighbour.rank,
                send: Vec::with_capacity(width * neighbour.send.len()),
                receive: Vec::with_capacity(width * neighbour.receive.len()),
            })
            .collect();
        Self {
            neighbours,
            messages,
            sent: Traffic::default(),
        }
    }

    /// Number of ranks that it exchanges with.
    pub fn neighbours(&self) -> usize {
        self.neighbours.len()
    }

    /// Follows the owned points to another order; `place` has the new local index of each.
    pub fn renumber(&mut self, place: &[u32]) {
        for neighbour in &mut self.neighbours {
            for index in &mut neighbour.send {
                *index = place[*index as usize];
            }
        }
    }

    /// Brings the entries of ghosts from their owners: `components` are arrays over the local points. Collective.
    pub fn bring(&mut self, comm: &dyn Communicator, components: &mut [&mut [f64]]) {
        self.pack(components.iter().map(|component| &**component));
        self.exchange(comm, &mut |_| {});
        self.unpack(components.iter_mut().map(|component| &mut **component));
    }

    /// Copies the values that other ranks need into the messages: `components` are arrays over the
    /// local points, each sent for every point.
    pub fn pack<'a>(&mut self, components: impl ExactSizeIterator<Item = &'a [f64]> + Clone) {
        for (neighbour, message) in self.neighbours.iter().zip(&mut self.messages) {
            message.send.clear();
            let count = components.len();
            for component in components.clone() {
                let values = neighbour.send.iter().map(|i| component[*i as usize]);
                message.send.extend(values);
            }
            message.receive.resize(count * neighbour.receive.len(), 0.0);
        }
    }

    /// Sends what was packed, and calls `during` while the messages are in flight; see
    /// [`Communicator::exchange`].
    pub fn exchange(&mut self, comm: &dyn Communicator, during: &mut During<'_>) {
        let start = Instant::now();
        let mut working = Duration::ZERO;
        self.sent.messages += self.messages.len() as u64;
        for message in &self.messages {
            self.sent.bytes += size_of_val(&message.send[..]) as u64;
        }
        comm.exchange(&mut self.messages, &mut |progress| {
            let start = Instant::now();
            let mut driving = Duration::ZERO;
            during(&mut || {
                let start = Instant::now();
                let under_way = progress();
                driving += start.elapsed();
                under_way
            });
            working += start.elapsed() - driving;
        });
        self.sent.time += start.elapsed() - working;
    }

    /// Copies what was received to the ghosts: the same arrays, in the same order, as in `pack`.
    pub fn unpack<'a>(&self, components: impl Iterator<Item = &'a mut [f64]>) {
        for (k, component) in components.enumerate() {
            for (neighbour, message) in self.neighbours.iter().zip(&self.messages) {
                let count = neighbour.receive.len();
                component[neighbour.receive.clone()]
                    .copy_from_slice(&message.receive[k * count..(k + 1) * count]);
            }
        }
    }
}
