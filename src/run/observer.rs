//! What the caller of a run gets to see of it.

use std::path::PathBuf;

use crate::solver::Stepper;
use crate::solver::observers::{Energies, HistoryRow};
use crate::solver::refinement::Regridded;
use crate::solver::repartition::Repartition;
use crate::survey::Survey;

/// Looks on while a run goes on. Its methods are called on all ranks alike; each does nothing unless
/// it is given something to do.
pub trait Observer {
    /// The run has something to tell.
    fn message(&mut self, _message: &Message) {}

    /// The steps begin after the one that is shown: 0, or that of a checkpoint.
    fn begin(&mut self, _now: &mut dyn View) {}

    /// A step has been made, and what was due after it has been written.
    fn step(&mut self, _now: &mut dyn View) {}

    /// A row of the history has been found.
    fn row(&mut self, _now: &mut dyn View, _row: &Row) {}

    /// The steps are over, at the end of the run or, if not `complete`, before it.
    fn end(&mut self, _complete: bool) {}
}

/// An observer that does nothing.
pub struct Unobserved;

impl Observer for Unobserved {}

/// What a run tells, most of it before its first step.
#[derive(Debug, Clone, PartialEq)]
pub enum Message {
    /// The folder is taken, and points and bonds are about to be made.
    Started,
    /// Points and bonds are made.
    SetUp {
        /// The time step, s.
        step: f64,
        /// The largest step that is known to be stable, s.
        stable_step: f64,
        /// What there is, and what is most likely not meant.
        survey: Survey,
    },
    /// What the run has decided by itself, such as the partition: names and what was decided.
    Decided(Vec<(&'static str, String)>),
    /// The run goes on from a checkpoint.
    Continued {
        /// Number of the step that it was written after.
        number: u64,
        /// Its time, s.
        time: f64,
        /// Whether that was the last step, so that nothing is left to do.
        complete: bool,
    },
    /// The result so far does not fit what is to be written now, and a new one begins.
    SetAside {
        /// What does not fit.
        why: String,
        /// What there is of the result so far, under its new names.
        kept: Vec<PathBuf>,
    },
    /// The grid has been refined, or made coarser.
    Refined {
        /// Number of the step after which.
        number: u64,
        /// Points that came and went.
        regridded: Regridded,
        /// Number of points that there are now.
        points: u64,
    },
    /// The points have been dealt out anew among the ranks.
    Repartitioned {
        /// Number of the step after which.
        number: u64,
        /// What was found and done.
        what: Repartition,
    },
    /// Something that may not be as the user thinks.
    Warning(String),
}

/// A run between two steps, in one, two or three dimensions. Points are those that this rank owns, in
/// an order of its own, which may change from step to step; see [`View::ids`].
pub trait View {
    /// Number of steps made.
    fn number(&self) -> u64;

    /// Number of the last step.
    fn last(&self) -> u64;

    /// Time reached, s.
    fn time(&self) -> f64;

    /// Length of a step, s.
    fn step(&self) -> f64;

    /// Number of dimensions: components are numbered from 0 up to it.
    fn dimension(&self) -> usize;

    /// Global ids of the points: 0 up to the number of points of level 0 over all ranks, and more with
    /// refinement.
    fn ids(&self) -> &[u64];

    /// A component of the reference positions, m.
    fn reference(&self, component: usize) -> &[f64];

    /// A component of the displacements, m.
    fn displacement(&self, component: usize) -> &[f64];

    /// A component of the velocities, m/s. They are computed if nobody has asked for them after this step; that goes
    /// over the points once, so ask only where you need them.
    fn velocity(&mut self, component: usize) -> &[f64];
}

impl<const D: usize> View for Stepper<'_, D> {
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

/// A row of the history; the same on all ranks.
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

    /// Number of bonds that have broken since the start.
    pub fn broken_bonds(&self) -> u64 {
        self.row.broken
    }
}
