//! Restart from a checkpoint.

use std::time::Instant;

use crate::comm::{Communicator, agree};
use crate::error::{Error, Result};
use crate::output::checkpoint::{Checkpoints, Header, read_header, read_saved};
use crate::solver::Simulation;
use crate::solver::simulation::Times;

use super::checkpoints::{CheckpointWriter, fingerprint};
use super::files::Files;
use super::observer::{Message, Observer};
use super::restart_compatibility;

/// Result of a restart, in addition to the restored simulation.
pub struct Restart {
    /// Writer of the next checkpoints.
    pub checkpoints: CheckpointWriter,
    /// The checkpoint's header.
    pub header: Header,
}

/// Restore a simulation from the newest intact checkpoint. Collective.
///
/// # Errors
/// If there is no intact checkpoint, or if the checkpoint belongs to another deck or to other points. For
/// another deck, the message lists the differences.
pub fn restart<const D: usize>(
    simulation: &mut Simulation<'_, D>,
    files: &Files,
    physics: String,
    observer: &mut dyn Observer,
) -> Result<Restart> {
    let start = Instant::now();
    let comm: &dyn Communicator = simulation.comm;
    let mut warn = |message| observer.message(&Message::Warning(message));
    let (checkpoints, path) = Checkpoints::open(comm, &files.folder, &mut warn)?;
    let header = read_header(comm, &path)?;
    let lines = agree(
        comm,
        restart_compatibility::differences(&header.deck, &physics),
    )?;
    if !lines.is_empty() {
        return Err(Error::input(format!(
            "the deck differs in its physics from that of {}, so the run cannot be continued:\n  {}",
            path.display(),
            lines.join("\n  ")
        )));
    }
    simulation.refine_to(&header.grids)?;
    let fingerprint = fingerprint(simulation);
    if header.points != simulation.model.total || header.fingerprint != fingerprint {
        let message = "was written for other points; has a point file changed?";
        return Err(Error::input(format!("{} {message}", path.display())));
    }
    let order = simulation.id_order();
    let saved = read_saved(comm, &path, &order)?;
    simulation.restore(&order, &saved)?;
    // Restoring belongs to the set-up; the times of the time loop start from 0.
    simulation.times = Times {
        set_up: simulation.times.set_up + start.elapsed(),
        ..Times::default()
    };
    Ok(Restart {
        checkpoints: CheckpointWriter::after(checkpoints, physics, fingerprint),
        header,
    })
}
