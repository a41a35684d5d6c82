//! Options of a run.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use super::signals::Signals;
use crate::deck::Deck;

/// Options of a run; equal on all ranks, except `signals`, `started` and `attributes`.
pub struct Options {
    /// Folder of the result, the history and the checkpoints; it is created if missing. An empty path is an
    /// error.
    pub folder: PathBuf,
    /// Handling of existing files in the folder.
    pub existing: Existing,
    /// Wall-clock limit, measured from `started`. Before the limit, the run writes a checkpoint and stops.
    /// The default inside a Slurm job is the limit of the job.
    pub wall_time: Option<Duration>,
    /// Start of the run.
    pub started: Instant,
    /// Signals that stop the run or request a checkpoint.
    pub signals: Option<Signals>,
    /// The deck; `None` for a problem that was built in Rust. Errors and warnings refer to lines of the deck.
    /// The result contains the text of the deck. A restart compares the deck with the deck of the checkpoint.
    /// If the program has changed the physics of the deck's problem, this must be `None`.
    pub deck: Option<Deck>,
    /// Additional attributes of the result: name and text, such as the command line. The attributes of rank 0
    /// are used.
    pub attributes: Vec<(&'static str, String)>,
}

/// Handling of existing files in the folder.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Existing {
    /// Stop with an error.
    Refuse,
    /// Replace the existing files.
    Replace,
    /// Continue from the newest checkpoint. The number of ranks and threads may have changed. It is an error
    /// if no checkpoint exists.
    Continue,
}

impl Options {
    /// Create the options of a new run that starts now, in a folder without results.
    pub fn new(folder: impl Into<PathBuf>) -> Self {
        Self {
            folder: folder.into(),
            existing: Existing::Refuse,
            wall_time: None,
            started: Instant::now(),
            signals: None,
            deck: None,
            attributes: Vec::new(),
        }
    }
}
