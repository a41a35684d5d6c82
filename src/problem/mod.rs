//! The validated description of a run: every number known, every name resolved.
//!
//! Spans are byte ranges of the deck that a problem was made from. They are only used in errors and warnings.
//!
//! Positions and vectors have three components; those beyond the dimension are 0.

mod blocks;
mod bodies;
mod build;
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
    Calibration, Sense, StressMeasure, StressRule, ToughnessByDirection, WorkMeasure, WorkRule,
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

/// Everything that a run needs to know.
#[derive(Debug, Clone)]
pub struct Problem {
    /// Warnings: allowed settings of the deck that are probably mistakes.
    pub warnings: Vec<Warning>,
    /// Title, one line.
    pub title: String,
    /// Spans of some values in the deck.
    pub places: Places,
    /// The setting.
    pub dimension: Dimension,
    /// Horizon δ of the grid, m; bodies may have their own.
    pub horizon: f64,
    /// Volume correction of points near the edge of a family.
    pub volume_correction: VolumeCorrection,
    /// Random displacement of the points of shapes, if there is any.
    pub jitter: Option<Jitter>,
    /// How bonds are stored.
    pub family: FamilyRule,
    /// The bonds between blocks.
    pub interface: Interface,
    /// Contact between points that no bond joins.
    pub contact: Option<Contact>,
    /// Rigid bodies that points can touch.
    pub rigid: Vec<Rigid>,
    /// Bodies in the order of the deck.
    pub bodies: Vec<Body>,
    /// Finer grids in parts of the bodies.
    pub refinement: Option<Refinement>,
    /// Sets: `all`, then the bodies, then those of the deck.
    pub sets: Vec<Set>,
    /// Pre-cracks.
    pub cracks: Vec<PreCrack>,
    /// Initial values, applied in order.
    pub initials: Vec<Initial>,
    /// Loads and supports, applied in order.
    pub conditions: Vec<Condition>,
    /// The time axis.
    pub time: Time,
    /// The stages of the run in their order. Without stages, the run is a single stage in which all conditions act.
    /// With stages, the last one ends with [`Self::time`], and only the end of `time` is used.
    pub stages: Vec<Stage>,
    /// The result file.
    pub output: Output,
    /// Further result files with their own fields and times.
    pub further_outputs: Vec<Output>,
    /// The history.
    pub history: History,
    /// When checkpoints are written.
    pub checkpoint: CheckpointRule,
    /// When points are rebalanced between ranks.
    pub balance: Option<Balance>,
}

/// Spans of values whose errors are only detected after the points are generated.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Places {
    /// The horizon of the grid.
    pub horizon: Range<usize>,
    /// The end time.
    pub end: Range<usize>,
    /// The time step; the end time if the step is automatic.
    pub step: Range<usize>,
    /// The first rule of an adaptive step; the end time if there is none.
    pub adaptive: Range<usize>,
}
