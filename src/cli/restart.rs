//! Checkpoints of a run, and going on from one.

use crate::cli::tell;
use std::time::{Duration, Instant};

use fissure::comm::{Communicator, IdOrder, agree};
use fissure::deck::{self, Source};
use fissure::error::{Error, Result};
use fissure::output::checkpoint::{Checkpoints, Header, read_header, read_saved};
use fissure::output::mix;
use fissure::solver::Simulation;

use super::files::Files;
use super::recorder::{Recorder, id_order};

/// Writes checkpoints and keeps account of them.
pub struct Keeper {
    checkpoints: Checkpoints,
    deck: String,
    fingerprint: u64,
    /// Number of checkpoints written.
    pub written: u64,
    /// Time spent on them.
    pub spent: Duration,
}

/// What a restart begins with.
pub struct Restart {
    /// The keeper that goes on with the same files.
    pub keeper: Keeper,
    /// The checkpoint's header.
    pub header: Header,
}

impl Keeper {
    /// For a run that starts anew; earlier checkpoints in the folder are removed. Collective.
    ///
    /// # Errors
    /// When one cannot be removed.
    pub fn new<const D: usize>(
        simulation: &Simulation<'_, D>,
        files: &Files,
        deck: String,
    ) -> Result<Self> {
        let checkpoints = Checkpoints::new(&files.folder);
        let removed = match simulation.comm.rank() {
            0 => checkpoints.remove(),
            _ => Ok(()),
        };
        agree(simulation.comm, removed)?;
        Ok(Self {
            checkpoints,
            deck,
            fingerprint: fingerprint(simulation),
            written: 0,
            spent: Duration::ZERO,
        })
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
        recorder.flush()?;
        let header = Header {
            number: simulation.number,
            step: simulation.step,
            points: simulation.model.total,
            fingerprint: self.fingerprint,
            outputs: recorder.file.steps(),
            rows: recorder.file.history_rows(),
            start: recorder.observer.start().unwrap_or_default(),
            deck: self.deck.clone(),
            instructions: simulation.forces.instructions().name().to_owned(),
        };
        let saved = simulation.save(&recorder.order);
        self.checkpoints
            .write(simulation.comm, &recorder.order, &header, &saved)?;
        self.written += 1;
        let cost = begin.elapsed();
        self.spent += cost;
        Ok(cost)
    }
}

/// Takes a simulation back to the newest intact checkpoint. Collective.
///
/// # Errors
/// When there is none, or it belongs to another deck or other points; the differences are listed.
pub fn restart<const D: usize>(
    simulation: &mut Simulation<'_, D>,
    files: &Files,
    deck: String,
) -> Result<Restart> {
    let comm: &dyn Communicator = simulation.comm;
    let warn = |message: String| {
        if comm.rank() == 0 {
            tell!("warning: {message}");
        }
    };
    let (checkpoints, path) = Checkpoints::open(comm, &files.folder, &warn)?;
    let header = read_header(comm, &path)?;
    let source = |name: &str, text: &str| Source {
        path: name.into(),
        text: text.to_owned(),
    };
    let (old, new) = (
        source("the checkpoint", &header.deck),
        source("the deck", &deck),
    );
    let lines = agree(comm, deck::differences(&old, &new))?;
    if !lines.is_empty() {
        return Err(Error::input(format!(
            "the deck differs in its physics from that of {}, so the run cannot be continued:\n  {}",
            path.display(),
            lines.join("\n  ")
        )));
    }
    let instructions = simulation.forces.instructions().name();
    if header.instructions != instructions {
        warn(format!(
            "the run used {} instructions until now, and goes on with {instructions}: it will end \
             with other last digits than without the stop; see FISSURE_INSTRUCTIONS",
            header.instructions
        ));
    }
    let fingerprint = fingerprint(simulation);
    if header.points != simulation.model.total || header.fingerprint != fingerprint {
        let message = "was written for other points; has a point file changed?";
        return Err(Error::input(format!("{} {message}", path.display())));
    }
    let order: IdOrder = id_order(simulation);
    let saved = read_saved(comm, &path, &order)?;
    simulation.restore(&order, &saved, header.number, header.step)?;
    let keeper = Keeper {
        checkpoints,
        deck,
        fingerprint,
        written: 0,
        spent: Duration::ZERO,
    };
    Ok(Restart { keeper, header })
}

/// A sum over all points that changes with any id, place, volume or block. Collective.
fn fingerprint<const D: usize>(simulation: &Simulation<'_, D>) -> u64 {
    let model = &simulation.model;
    let own = (0..model.owned()).fold(0_u64, |sum, point| {
        let place = model.position(point).map(f64::to_bits);
        let others = [model.volume[point].to_bits(), u64::from(model.block[point])];
        let words = place.into_iter().chain(others);
        sum.wrapping_add(words.fold(mix(model.ids[point]), |hash, word| mix(hash ^ word)))
    });
    fissure::comm::total(simulation.comm, own)
}
