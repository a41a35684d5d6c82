//! Restart from a checkpoint.

use std::time::Instant;

use crate::comm::{Communicator, agree};
use crate::error::{Error, Result};
use crate::message::{FOLDER, format_number};
use crate::output::checkpoint::{Checkpoints, Fingerprint, Header, read_header, read_saved};
use crate::solver::Simulation;
use crate::solver::simulation::Times;

use super::checkpoints::{CheckpointWriter, fingerprint};
use super::files::Files;
use super::observer::{Message, Observer};
use super::restart_compatibility;

/// Data that a restart returns in addition to the restored simulation.
pub struct Restart {
    /// Writer of the next checkpoints.
    pub checkpoints: CheckpointWriter,
    /// The checkpoint's header.
    pub header: Header,
}

/// Restore a simulation from the newest intact checkpoint. Collective.
///
/// # Errors
/// - If there is no intact checkpoint.
/// - If the checkpoint was written for a deck or problem with other physics. The message lists the
///   differences.
/// - If the points, or the points of a set, differ from those for which the checkpoint was written.
/// - If the end time of the run is not after the start of the last step before the checkpoint.
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
            "the {} differs in its physics from that of {}, so the run cannot be continued:\n  {}",
            restart_compatibility::subject(&physics),
            path.display(),
            lines.join("\n  ")
        )));
    }
    simulation.refine_to(&header.grids)?;
    let fingerprint = fingerprint(simulation);
    if header.points != simulation.model.total || header.fingerprint.points != fingerprint.points {
        let message = "was written for other points; has a point file changed?";
        return Err(Error::input(format!("{} {message}", path.display())));
    }
    let changed = changed_sets(&header.fingerprint, &fingerprint);
    if !changed.is_empty() {
        return Err(Error::input(format!(
            "{} was written for other points of {}; has a file or mesh of a set changed?",
            path.display(),
            changed.join(", ")
        )));
    }
    let order = simulation.id_order();
    let saved = read_saved(comm, &path, &order)?;
    simulation.restore(&order, &saved)?;
    let (clock, end) = (&simulation.clock, &simulation.problem.time.end);
    // The last step of a run may pass its end, so the time of the checkpoint may be after the end.
    if *end <= clock.time_before() {
        let message = format!(
            "[time] end: must be after the checkpoint {}, which is at {} s, is {} s; give a later end, or start a \
             new run in another folder with {FOLDER}",
            path.display(),
            format_number(clock.time()),
            format_number(*end)
        );
        return Err(Error::input(message).at(&simulation.problem.spans.end));
    }
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

/// Compare the sets that both fingerprints contain. For each set whose points differ, return the name of its
/// section in the deck.
fn changed_sets(old: &Fingerprint, new: &Fingerprint) -> Vec<String> {
    let has_changed = |(name, hash): &&(String, u64)| {
        let mut known = old.sets.iter();
        known.any(|(old, old_hash)| old == name && old_hash != hash)
    };
    let changed = new.sets.iter().filter(has_changed);
    changed.map(|(name, _)| format!("[set.{name}]")).collect()
}
