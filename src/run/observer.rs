//! Callbacks from a run to its caller.

use std::path::PathBuf;

use crate::problem::Field;
use crate::solver::Stepper;
use crate::solver::observers::{Energies, HistoryRow, Snapshot, state_energies};
use crate::solver::refinement::Regridded;
use crate::solver::repartition::Repartition;
use crate::survey::Survey;

/// Callbacks from a run. Each callback is called on all ranks at the same step. The default implementations
/// do nothing.
pub trait Observer {
    /// Called for each message of the run.
    fn message(&mut self, _message: &Message) {}

    /// Called before the first step, with the state of step 0 or of the checkpoint.
    fn begin(&mut self, _now: &mut dyn RunState) {}

    /// Called after each explicit step and each iteration of a load step, after the scheduled output has been
    /// written.
    fn step(&mut self, _now: &mut dyn RunState) {}

    /// Called after a row of the history has been computed. In a new run, the call for the first row precedes
    /// the call of [`Self::begin`].
    fn row(&mut self, _now: &mut dyn RunState, _row: &Row) {}

    /// Called after the time loop. `complete` is true at the end of the run, false after a stop or a failure.
    fn end(&mut self, _complete: bool) {}
}

/// An observer that does nothing.
pub struct Unobserved;

impl Observer for Unobserved {}

/// A message of a run.
#[derive(Debug, Clone, PartialEq)]
pub enum Message {
    /// The run has locked its folder and starts the set-up.
    Started,
    /// The set-up of points and bonds is complete.
    SetUp {
        /// Time step of the first stage, s.
        step: f64,
        /// Stable step of the first stage (s), computed with the scaled density of this stage.
        stable_step: f64,
        /// Figures and warnings.
        survey: Survey,
    },
    /// Names and values of automatic choices, such as the partition.
    Decided(Vec<(&'static str, String)>),
    /// The run continues from a checkpoint.
    Continued {
        /// Number of the checkpoint's step.
        number: u64,
        /// Time of the checkpoint, s.
        time: f64,
        /// Whether the run was already complete at the checkpoint.
        complete: bool,
    },
    /// An existing result cannot be continued. The existing result is renamed, and a new result is created.
    SetAside {
        /// Reason why the result cannot be continued.
        reason: String,
        /// New names of the existing files.
        renamed: Vec<PathBuf>,
    },
    /// Paths of removed files: further results with their side-cars, and tables of cracks. An earlier run has
    /// written these files, and this run does not replace them.
    Removed(Vec<PathBuf>),
    /// The grid was refined or coarsened.
    Refined {
        /// Number of the last step before the refinement.
        number: u64,
        /// Number of created points, and number of removed points.
        regridded: Regridded,
        /// New number of points.
        points: u64,
    },
    /// The points were rebalanced between the ranks.
    Repartitioned {
        /// Number of the last step before the rebalance.
        number: u64,
        /// Imbalance before the rebalance, number of migrated points, and time of the rebalance.
        repartition: Repartition,
    },
    /// A warning.
    Warning(String),
}

/// The state of a run between two steps. All point data belong to the points that this rank owns. The order
/// of the points may change from step to step, see [`RunState::ids`].
///
/// An observer may [stop](RunState::stop) the run and [change a load](RunState::set_load_factor):
///
/// ```no_run
/// use fissure::comm::threads;
/// use fissure::error::Result;
/// use fissure::problem::{Field, Problem};
/// use fissure::run::{Observer, Options, Row, RunState};
///
/// /// Halves the load `pull` when the first bonds break, and stops when a point is cracked.
/// struct Control;
///
/// impl Observer for Control {
///     fn row(&mut self, now: &mut dyn RunState, row: &Row) {
///         if row.broken_bonds() > 0 {
///             now.set_load_factor("pull", 0.5);
///         }
///         // Only the points of this rank are checked. A stop on one rank stops all ranks.
///         if now.field(Field::Damage).iter().any(|damage| *damage > 0.4) {
///             now.stop();
///         }
///     }
/// }
///
/// # fn run(problem: &Problem) -> Result<()> {
/// fissure::run(problem, &threads::alone(), Options::new("out/plate"), &mut Control)?;
/// # Ok(())
/// # }
/// ```
pub trait RunState {
    /// Return the number of the step reached.
    fn number(&self) -> u64;

    /// Return the expected number of the last step of the whole run. The present time step is assumed to stay
    /// the same until the end of the stage.
    fn last(&self) -> u64;

    /// Return the time reached, s.
    fn time(&self) -> f64;

    /// Return the present time step, s.
    fn step(&self) -> f64;

    /// Return the dimension of the problem, which is the number of components of vectors.
    fn dimension(&self) -> usize;

    /// Return the global ids of the points. The ids of level-0 points are smaller than the number of level-0
    /// points over all ranks.
    fn ids(&self) -> &[u64];

    /// Return a component of the reference positions, m.
    ///
    /// # Panics
    /// If `component` is not below [`Self::dimension`].
    fn reference(&self, component: usize) -> &[f64];

    /// Return a component of the displacements at the reached time, m.
    ///
    /// # Panics
    /// If `component` is not below [`Self::dimension`].
    fn displacement(&self, component: usize) -> &[f64];

    /// Return a component of the velocities, m/s. The first request in a step needs one loop over the points.
    ///
    /// # Panics
    /// If `component` is not below [`Self::dimension`].
    fn velocity(&mut self, component: usize) -> &[f64];

    /// Return the values of an output field such as [`Field::Damage`] or [`Field::ForceDensity`], in the unit
    /// of [`Field::unit`]. The values are ordered by point, with [`Field::components`] values per point. A
    /// request needs one or several passes over the bonds. Collective: all ranks must request the same field.
    fn field(&mut self, field: Field) -> Vec<f64>;

    /// Return the energies, summed over the points of all ranks, J. A request needs one or two passes over
    /// the bonds. Collective.
    fn energies(&mut self) -> StateEnergies;

    /// Write a checkpoint and stop the run before its end. A request by one rank stops all ranks. If the
    /// request is made in [`Observer::row`], the run stops at the step of this row. Otherwise, the run stops
    /// later: after at most ten explicit steps, or after at most ten iterations of load steps. The row of
    /// step 0 is an exception: the run stops after one explicit step, or after one iteration of a load step.
    fn stop(&mut self);

    /// Return the factor of a load in the next step; 1 unless an observer has set the factor. `None` if no
    /// load has this name.
    fn load_factor(&self, name: &str) -> Option<f64>;

    /// Multiply a load by a factor. A load is a condition with `force`, `body_force`, `traction` or
    /// `pressure`. In an explicit stage, the factor acts from the end of the next step. In a quasi-static
    /// stage, it acts from the next load step. It acts until another factor is set. The work of the load
    /// counts as external work. Checkpoints contain the factor. All ranks must set the same factor at the
    /// same step.
    ///
    /// The run ends with an error if no load has this name, if the factor is not finite, or if the ranks set
    /// different factors. It ends at the step at which [`Self::stop`] would stop the run.
    fn set_load_factor(&mut self, name: &str, factor: f64);
}

/// Energies of all points, J; equal on all ranks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StateEnergies {
    /// Kinetic energy.
    pub kinetic: f64,
    /// Strain energy of the intact bonds.
    pub strain: f64,
    /// Energy that broken bonds have released.
    pub fracture: f64,
    /// Work of loads and supports.
    pub work: f64,
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

    fn field(&mut self, field: Field) -> Vec<f64> {
        let simulation = self.at_full_step();
        Snapshot::for_fields(simulation, [field]).field(simulation, field)
    }

    fn energies(&mut self) -> StateEnergies {
        let [kinetic, strain, fracture, work] = state_energies(self.at_full_step());
        StateEnergies {
            kinetic,
            strain,
            fracture,
            work,
        }
    }

    fn stop(&mut self) {
        self.request_stop();
    }

    fn load_factor(&self, name: &str) -> Option<f64> {
        let load = self.load(name).ok()?;
        Some(self.load_factors().get(load))
    }

    fn set_load_factor(&mut self, name: &str, factor: f64) {
        Stepper::set_load_factor(self, name, factor);
    }
}

/// A row of the history; equal on all ranks.
pub struct Row<'a> {
    /// Name and unit of each column.
    pub columns: &'a [(String, &'static str)],
    pub(super) row: &'a HistoryRow,
}

impl Row<'_> {
    /// Return the values in the order of the columns.
    pub fn values(&self) -> &[f64] {
        &self.row.values
    }

    /// Return the value of the column with this name, such as `kinetic_energy`; `None` if there is no such
    /// column.
    pub fn value(&self, column: &str) -> Option<f64> {
        let found = self.columns.iter().position(|(name, _)| name == column);
        found.map(|position| self.row.values[position])
    }

    /// Return the energies (J), each summed over all bodies.
    pub fn energies(&self) -> Energies {
        self.row.energies
    }

    /// Return the number of bonds broken since the start.
    pub fn broken_bonds(&self) -> u64 {
        self.row.broken
    }
}
