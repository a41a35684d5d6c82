//! Whether the energy of a run grows by more than is done on it: then the steps are not stable.

use crate::comm::Communicator;
use crate::comm::ExactSum;
use crate::comm::sum::reduce;
use crate::error::{Error, Result};
use crate::solver::Simulation;
use crate::solver::motion::Clock;
use crate::solver::observers::HistoryRow;

/// A gain of so many times the energy that was put in is told. Stable steps gain and lose less: near the
/// largest stable one the energy of the shortest waves, found at full steps, goes up and down several
/// times over.
const TOLD: f64 = 1.0;

/// A gain of so many times the energy that was put in ends the run, if it is seen twice in a row.
const FATAL: f64 = 100.0;

/// A gain that is seen once and ends the run.
const BEYOND_DOUBT: f64 = 1e9;

/// The share of the energy put in that breaking bonds may add without a warning.
const ADDED_SHARE: f64 = 0.01;

/// The strain below which an energy may be rounding: with it, solids in bulk are at rest.
const STRAIN_AT_REST: f64 = 1e-9;

/// Compares the energy of a run with what was put in.
pub struct EnergyWatch {
    /// What rounding may come to, J.
    floor: f64,
    /// The most that has been put in so far, at the start and by loads and supports, J.
    put_in: f64,
    told: bool,
    /// The largest energy that breaking bonds had freed at any row, J.
    most_freed: f64,
    /// Whether it was said that breaking bonds add energy.
    told_of_breaking: bool,
    /// Whether the gain was fatal when it was last looked at.
    suspected: bool,
    steps: String,
}

impl EnergyWatch {
    /// For a run that stands before a step. Collective.
    pub fn new<const D: usize>(simulation: &Simulation<'_, D>) -> Self {
        let (problem, model) = (simulation.problem, &simulation.model);
        let comm: &dyn Communicator = simulation.comm;
        let mut stiffness = [ExactSum::ZERO];
        for (volume, block) in model.volume.iter().zip(&model.block) {
            let material = &problem.block(usize::from(*block)).body.material;
            stiffness[0].add(material.elastic.youngs_modulus * volume);
        }
        let (step, stable) = (simulation.clock.step(), simulation.stable_step);
        Self {
            floor: STRAIN_AT_REST * STRAIN_AT_REST * reduce(comm, &mut stiffness)[0],
            put_in: 0.0,
            told: false,
            most_freed: 0.0,
            told_of_breaking: false,
            suspected: false,
            steps: format!("time step {step:.3e} s, stable {stable:.3e} s"),
        }
    }

    /// Looks at a row of the history of the present step; returns a warning the first time that the energy has
    /// grown. The same on all ranks, as rows are.
    ///
    /// # Errors
    /// When the energy has grown beyond doubt, or is not finite.
    pub fn look(&mut self, row: &HistoryRow, clock: &Clock) -> Result<Option<String>> {
        let (start, work) = (row.first_energy, row.energies.work);
        // Bonds that were seen to give energy by breaking hide what has been gained.
        let gain = row.energies.error - row.energies.fracture.min(0.0);
        let put_in = start.abs() + work.abs() + row.step_energy;
        self.put_in = self.put_in.max(put_in);
        let share = gain / self.put_in.max(self.floor);
        let text = || {
            format!(
                "step {} (t = {:.6e} s): the energy has grown by {gain:.3e} J beyond the {:.3e} J that were \
                 put in at the start, by loads and by supports",
                clock.number(),
                clock.time(),
                self.put_in,
            )
        };
        let fatal = share > FATAL;
        let sure = share.is_nan() || share > BEYOND_DOUBT;
        if sure || (fatal && (self.suspected || clock.is_over())) {
            let message = format!("{}; are the steps too large? ({})", text(), self.steps);
            return Err(Error::run(message));
        }
        self.suspected = fatal;
        if share <= TOLD || self.told {
            return Ok(None);
        }
        self.told = true;
        Ok(Some(format!("{} ({})", text(), self.steps)))
    }

    /// Looks at a row of the history; returns a warning the first time that breaking bonds have added more than a share
    /// of the energy put in. A point whose law depends on the mean motion of its family can store more with fewer bonds.
    pub fn look_at_breaking(&mut self, row: &HistoryRow, clock: &Clock) -> Option<String> {
        let freed = row.energies.fracture;
        self.most_freed = self.most_freed.max(freed);
        let added = self.most_freed - freed;
        if self.told_of_breaking || added <= ADDED_SHARE * self.put_in {
            return None;
        }
        self.told_of_breaking = true;
        Some(format!(
            "t = {:.4e} s: breaking bonds have added {added:.3e} J to the body, {:.0} % of the energy put in. Families of \
             correspondence laws can store more with fewer bonds; compare with a smaller step, a finer grid, or `ordinary`",
            clock.time(),
            100.0 * added / self.put_in,
        ))
    }
}
