//! Options of a run.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use super::signals::Signals;
use crate::deck::Deck;

/// Options of a run; equal on all ranks, except `signals`.
pub struct Options {
    /// Folder of the result, the history and the checkpoints; it is created if missing.
    pub folder: PathBuf,
    /// Handling of existing files in the folder.
    pub existing: Existing,
    /// Write a checkpoint and stop before this wall-clock time since `started`. The default inside a Slurm
    /// job is the job's limit.
    pub wall_time: Option<Duration>,
    /// Start of the run.
    pub started: Instant,
    /// Signals that stop the run or request a checkpoint.
    pub signals: Option<Signals>,
    /// The deck; `None` for a problem built in Rust. Errors and warnings name places in it, the result contains its text,
    /// and a restart compares it with that of the checkpoint.
    pub deck: Option<Deck>,
    /// Additional attributes of the result: name and text, such as the command line. Those of rank 0 are used.
    pub attributes: Vec<(&'static str, String)>,
}

/// Handling of existing files in the folder.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Existing {
    /// Fail.
    Refuse,
    /// Replace them.
    Replace,
    /// Continue from the newest checkpoint, which may be from other numbers of ranks and threads; fail
    /// without one.
    Continue,
}

impl Options {
    /// A new run that starts now, in a folder without one.
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
