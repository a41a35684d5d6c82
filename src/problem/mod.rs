//! The description of a run, with resolved names. A deck produces a problem with valid values;
//! [`Problem::check`] checks the values of a problem that is built or changed in Rust.
//!
//! Spans are byte ranges of the deck from which a problem was read. They are used only in errors and
//! warnings.
//!
//! Positions and vectors have three components; those beyond the dimension are 0.

mod blocks;
mod bodies;
mod build;
pub(crate) mod check;
mod conditions;
mod contact;
pub mod law;
mod outputs;
mod refinement;
mod rigid;
pub mod single_body;
mod statistics;
mod thermal;
mod time;

use std::ops::Range;

use crate::dimension::Dimension;
use crate::error::Warning;

pub use crate::damage::{
    BreakableBonds, Calibration, StressMeasure, StressRule, ToughnessByDirection, WorkMeasure,
    WorkRule,
};
pub use blocks::{Block, Kind};
pub use bodies::*;
pub use conditions::*;
pub use contact::*;
pub use law::Law;
pub use outputs::*;
pub use refinement::*;
pub use rigid::*;
pub use statistics::*;
pub use thermal::ThermalExpansion;
pub use time::*;

/// All settings of a run.
#[derive(Debug, Clone)]
pub struct Problem {
    /// Warnings: allowed settings of the deck that are probably mistakes.
    pub warnings: Vec<Warning>,
    /// Title, one line.
    pub title: String,
    /// Spans of values in the deck, for errors.
    pub spans: Spans,
    /// Dimension and out-of-plane condition.
    pub dimension: Dimension,
    /// Horizon δ of the grid, m; bodies may have other horizons.
    pub horizon: f64,
    /// Volume correction of points near the edge of a family.
    pub volume_correction: VolumeCorrection,
    /// Random displacement of lattice points; `None` without it.
    pub jitter: Option<Jitter>,
    /// Storage of bonds.
    pub family: FamilyRule,
    /// Rules for the bonds between bodies.
    pub interface: Interface,
    /// Contact between points that no intact bond joins; `None` without contact.
    pub contact: Option<Contact>,
    /// Rigid bodies that points can touch.
    pub rigid: Vec<Rigid>,
    /// Bodies in the order of the deck.
    pub bodies: Vec<Body>,
    /// Settings of finer grids in parts of the bodies; `None` without refinement.
    pub refinement: Option<Refinement>,
    /// Sets: `all`, then one per body, then the sets of the deck.
    pub sets: Vec<Set>,
    /// Pre-cracks: bonds that cross their surfaces start broken.
    pub cracks: Vec<PreCrack>,
    /// Initial values. If several entries give a displacement or a velocity for a point, the last entry
    /// counts.
    pub initials: Vec<Initial>,
    /// Loads, supports and temperatures. If several supports or temperatures apply to a point, the last one
    /// counts.
    pub conditions: Vec<Condition>,
    /// End, time step and solution method of the run.
    pub time: Time,
    /// Stages of the run in order. If empty, the run is a single stage with [`Self::time`] in which all
    /// conditions act. Otherwise, only the end of [`Self::time`] is used: the last stage ends at this time.
    pub stages: Vec<Stage>,
    /// The main result file.
    pub output: Output,
    /// Further result files, with separate fields and times.
    pub further_outputs: Vec<Output>,
    /// Content of the history, and interval of its rows.
    pub history: History,
    /// Schedule of checkpoints.
    pub checkpoint: CheckpointRule,
    /// Schedule and threshold of rebalancing; `None` for no rebalancing.
    pub balance: Option<Balance>,
}

/// Byte ranges of values in the deck, for the messages of errors that are found after the deck has been read.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Spans {
    /// Span of the horizon of the grid.
    pub horizon: Range<usize>,
    /// Span of the end time.
    pub end: Range<usize>,
    /// Span of the time step; the span of the end time if the step is automatic.
    pub step: Range<usize>,
    /// Span of the first table `adaptive` of the run or of its stages; the span of the end time if there is
    /// no such table.
    pub adaptive: Range<usize>,
    /// Span of the first method `"static"` of the run or of its stages; the span of the end time if no stage
    /// uses Newton's method.
    pub newton: Range<usize>,
}
