//! Checkpoints of a run.

use std::time::{Duration, Instant};

use crate::comm::{self, agree};
use crate::error::Result;
use crate::output::checkpoint::{Checkpoints, Header};
use crate::output::mix;
use crate::solver::Simulation;

use super::files::Files;
use super::recorder::Recorder;

/// Writes checkpoints and keeps account of them.
pub struct CheckpointWriter {
    checkpoints: Checkpoints,
    /// What tells the physics of this run from that of another.
    physics: String,
    fingerprint: u64,
    /// Number of checkpoints written.
    pub written: u64,
    /// Time spent on them.
    pub spent: Duration,
}

impl CheckpointWriter {
    /// For a run that starts anew; earlier checkpoints in the folder are removed. Collective.
    ///
    /// # Errors
    /// When one cannot be removed.
    pub fn new<const D: usize>(
        simulation: &Simulation<'_, D>,
        files: &Files,
        physics: String,
    ) -> Result<Self> {
        let checkpoints = Checkpoints::new(&files.folder);
        let removed = match simulation.comm.rank() {
            0 => checkpoints.remove(),
            _ => Ok(()),
        };
        agree(simulation.comm, removed)?;
        Ok(Self::after(checkpoints, physics, fingerprint(simulation)))
    }

    /// For a run that goes on with the checkpoints of a folder.
    pub fn after(checkpoints: Checkpoints, physics: String, fingerprint: u64) -> Self {
        Self {
            checkpoints,
            physics,
            fingerprint,
            written: 0,
            spent: Duration::ZERO,
        }
    }

    /// Makes the recorded safe and writes a checkpoint; returns what that cost. Collective.
    ///
    /// # Errors
    /// When the disc is full; the checkpoints that were there stay.
    pub fn write<const D: usize>(
        &mut self,
        simulation: &Simulation<'_, D>,
        recorder: &mut Recorder<'_>,
    ) -> Result<Duration> {
        let begin = Instant::now();
        recorder.sync()?;
        let header = Header {
            number: simulation.clock.number(),
            step: simulation.clock.step(),
            grids: simulation.grids.state(),
            points: simulation.model.total,
            fingerprint: if simulation.may_refine() {
                fingerprint(simulation)
            } else {
                self.fingerprint
            },
            outputs: recorder.file.steps(),
            rows: recorder.file.history_rows(),
            start: recorder.observer.start().unwrap_or_default(),
            deck: self.physics.clone(),
        };
        self.checkpoints
            .write(simulation, &recorder.order, &header)?;
        self.written += 1;
        let cost = begin.elapsed();
        self.spent += cost;
        Ok(cost)
    }
}

/// A sum over all points that changes with any id, place, volume or block. Collective.
pub fn fingerprint<const D: usize>(simulation: &Simulation<'_, D>) -> u64 {
    let model = &simulation.model;
    let own = (0..model.owned()).fold(0_u64, |sum, point| {
        let place = model.position(point).map(f64::to_bits);
        let others = [model.volume[point].to_bits(), u64::from(model.block[point])];
        let words = place.into_iter().chain(others);
        sum.wrapping_add(words.fold(mix(model.ids[point]), |hash, word| mix(hash ^ word)))
    });
    comm::total(simulation.comm, own)
}
