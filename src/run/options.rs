//! How a problem is run: what does not belong to the problem itself.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use super::signals::Signals;
use crate::deck::Deck;

/// How a problem is run. Must be the same on all ranks, but for `signals`.
pub struct Options {
    /// Folder of the result, the history and the checkpoints; it is made if it is not there.
    pub folder: PathBuf,
    /// What happens to a run that is in the folder already.
    pub existing: Existing,
    /// Stop, with a checkpoint, before so much time has gone by since `started`. Without it, the end of
    /// the Slurm job that this process is part of, if any, counts.
    pub wall_time: Option<Duration>,
    /// When the run began.
    pub started: Instant,
    /// Signals of this process that stop the run or ask for a checkpoint.
    pub signals: Option<Signals>,
    /// The problem's deck; `None` for a problem that was built in Rust. Errors and warnings name places in it, the result
    /// holds its text, and a restart compares it with that of the checkpoint.
    pub deck: Option<Deck>,
    /// More attributes of the result: name and text, such as the command line. Rank 0's texts count.
    pub attributes: Vec<(&'static str, String)>,
}

/// What happens to a run that is in the folder already.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Existing {
    /// It is an error that there is one.
    Refuse,
    /// It is replaced.
    Replace,
    /// It goes on from its newest checkpoint, which may have been written on other numbers of ranks
    /// and threads; it is an error that there is none.
    Continue,
}

impl Options {
    /// A run that starts now in a folder that must not hold one.
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
