//! Callbacks from a run to its caller.

use std::path::PathBuf;

use crate::solver::Stepper;
use crate::solver::observers::{Energies, HistoryRow};
use crate::solver::refinement::Regridded;
use crate::solver::repartition::Repartition;
use crate::survey::Survey;

/// Callbacks from a run. Each is called on all ranks at the same point; the defaults do nothing.
pub trait Observer {
    /// A message of the run.
    fn message(&mut self, _message: &Message) {}

    /// The time loop starts after the given state: step 0, or that of a checkpoint.
    fn begin(&mut self, _now: &mut dyn RunState) {}

    /// A step is complete, and its due output is written.
    fn step(&mut self, _now: &mut dyn RunState) {}

    /// A new row of the history.
    fn row(&mut self, _now: &mut dyn RunState, _row: &Row) {}

    /// The time loop has ended; `complete` at the end of the run.
    fn end(&mut self, _complete: bool) {}
}

/// An observer that does nothing.
pub struct Unobserved;

impl Observer for Unobserved {}

/// A message of a run.
#[derive(Debug, Clone, PartialEq)]
pub enum Message {
    /// The folder is locked; the set-up starts.
    Started,
    /// The set-up of points and bonds is complete.
    SetUp {
        /// The time step, s.
        step: f64,
        /// Stable step × `safety`, s.
        stable_step: f64,
        /// Figures and warnings.
        survey: Survey,
    },
    /// Automatic choices, such as the partition: names and values.
    Decided(Vec<(&'static str, String)>),
    /// The run continues from a checkpoint.
    Continued {
        /// Number of the checkpoint's step.
        number: u64,
        /// Time of the checkpoint, s.
        time: f64,
        /// Whether that was the last step.
        complete: bool,
    },
    /// The existing result cannot be continued, and a new one is created.
    SetAside {
        /// Reason why it cannot be continued.
        reason: String,
        /// New names of the existing files.
        renamed: Vec<PathBuf>,
    },
    /// The grid was refined or coarsened.
    Refined {
        /// Number of the last step before the refinement.
        number: u64,
        /// Number of added and removed points.
        regridded: Regridded,
        /// New number of points.
        points: u64,
    },
    /// The points were rebalanced between the ranks.
    Repartitioned {
        /// Number of the last step before the rebalance.
        number: u64,
        /// Imbalance and migrated points.
        repartition: Repartition,
    },
    /// A warning.
    Warning(String),
}

/// The state of a run between two steps. Points are those owned by this rank; their order may change from
/// step to step, see [`RunState::ids`].
pub trait RunState {
    /// Number of the step reached.
    fn number(&self) -> u64;

    /// Number of the last step.
    fn last(&self) -> u64;

    /// Time reached, s.
    fn time(&self) -> f64;

    /// Length of a step, s.
    fn step(&self) -> f64;

    /// Number of dimensions, which is the number of components.
    fn dimension(&self) -> usize;

    /// Global ids of the points. Ids of level 0 are below the number of level-0 points of all ranks.
    fn ids(&self) -> &[u64];

    /// A component of the reference positions, m.
    fn reference(&self, component: usize) -> &[f64];

    /// A component of the displacements, m.
    fn displacement(&self, component: usize) -> &[f64];

    /// A component of the velocities, m/s. Computed on request: one pass over the points for each step
    /// in which they are read.
    fn velocity(&mut self, component: usize) -> &[f64];
}

impl<const D: usize> RunState for Stepper<'_, D> {
    fn number(&self) -> u64 {
        self.clock().number()
    }

    fn last(&self) -> u64 {
        self.last_step()
    }

    fn time(&self) -> f64 {
        self.clock().time()
    }

    fn step(&self) -> f64 {
        self.clock().step()
    }

    fn dimension(&self) -> usize {
        D
    }

    fn ids(&self) -> &[u64] {
        &self.model().ids[..self.model().owned()]
    }

    fn reference(&self, component: usize) -> &[f64] {
        &self.model().reference[component][..self.model().owned()]
    }

    fn displacement(&self, component: usize) -> &[f64] {
        &Stepper::displacement(self)[component][..self.model().owned()]
    }

    fn velocity(&mut self, component: usize) -> &[f64] {
        &self.at_full_step().fields.velocity[component]
    }
}

/// A row of the history; equal on all ranks.
pub struct Row<'a> {
    /// Name and unit of each column.
    pub columns: &'a [(String, &'static str)],
    pub(super) row: &'a HistoryRow,
}

impl Row<'_> {
    /// The values in the order of the columns.
    pub fn values(&self) -> &[f64] {
        &self.row.values
    }

    /// The value of a column such as `kinetic_energy`.
    pub fn value(&self, column: &str) -> Option<f64> {
        let found = self.columns.iter().position(|(name, _)| name == column);
        found.map(|position| self.row.values[position])
    }

    /// The energies of the whole body, J.
    pub fn energies(&self) -> Energies {
        self.row.energies
    }

    /// Number of bonds broken since the start.
    pub fn broken_bonds(&self) -> u64 {
        self.row.broken
    }
}
