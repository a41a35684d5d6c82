//! Writing of checkpoints.

use std::time::{Duration, Instant};

use crate::comm::{self, agree};
use crate::error::Result;
use crate::output::checkpoint::{Checkpoints, Fingerprint, Header};
use crate::output::mix;
use crate::problem::{Selector, Set};
use crate::solver::Simulation;
use crate::solver::conditions::members;

use super::files::Files;
use super::recorder::Recorder;

/// Writer of checkpoints, with the number of written checkpoints and the time spent on writing.
pub struct CheckpointWriter {
    checkpoints: Checkpoints,
    /// Description of the physics, which each checkpoint contains. A restart compares the description in the
    /// checkpoint with the description of the restarted run.
    physics: String,
    fingerprint: Fingerprint,
    /// Number of checkpoints written.
    pub written: u64,
    /// Time spent on writing checkpoints.
    pub spent: Duration,
}

impl CheckpointWriter {
    /// Create the writer for a new run, and remove existing checkpoints from the folder. Collective.
    ///
    /// # Errors
    /// If a checkpoint cannot be removed.
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

    /// Create the writer for a restarted run, which continues with the existing checkpoints of the folder.
    pub fn after(checkpoints: Checkpoints, physics: String, fingerprint: Fingerprint) -> Self {
        Self {
            checkpoints,
            physics,
            fingerprint,
            written: 0,
            spent: Duration::ZERO,
        }
    }

    /// Write the buffered history rows, fsync the results, and write a checkpoint. Return the time spent.
    /// Collective.
    ///
    /// # Errors
    /// If a write fails, for example because the disk is full. The existing checkpoints are kept.
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
                self.fingerprint.clone()
            },
            outputs: recorder.main().steps(),
            further: recorder.further(simulation),
            rows: recorder.main().history_rows(),
            start: recorder.observer.start().unwrap_or_default(),
            energy_watch: recorder.energy.words(),
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

/// Compute the hashes of all points, and of the sets that come from files. Collective.
pub fn fingerprint<const D: usize>(simulation: &Simulation<'_, D>) -> Fingerprint {
    let (problem, model) = (simulation.problem, &simulation.model);
    let own = (0..model.owned()).fold(0_u64, |sum, point| {
        let position = model.position(point).map(f64::to_bits);
        let others = [model.volume[point].to_bits(), u64::from(model.block[point])];
        let words = position.into_iter().chain(others);
        sum.wrapping_add(words.fold(mix(model.ids[point]), |hash, word| mix(hash ^ word)))
    });
    let hash_of_set = |set: usize| {
        let points = members(problem, model, set).into_iter();
        let ids = points.map(|point| model.ids[point as usize]);
        comm::total(simulation.comm, ids.map(mix).fold(0, u64::wrapping_add))
    };
    // The points of all other sets follow from the deck and from the hash of the points.
    let is_read = |set: &Set| {
        let selector = &set.selector;
        matches!(
            selector,
            Selector::Ids { file: Some(_), .. } | Selector::Mesh(_)
        )
    };
    let sets = problem.sets.iter().enumerate();
    let sets = sets.filter(|(_, set)| is_read(set));
    Fingerprint {
        points: comm::total(simulation.comm, own),
        sets: sets
            .map(|(index, set)| (set.name.clone(), hash_of_set(index)))
            .collect(),
    }
}
