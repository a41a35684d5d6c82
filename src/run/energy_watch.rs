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

/// The strain below which an energy may be rounding: with it, solids in bulk are at rest.
const STRAIN_AT_REST: f64 = 1e-9;

/// Compares the energy of a run with what was put in.
pub struct EnergyWatch {
    /// What rounding may come to, J.
    floor: f64,
    /// The most that has been put in so far, at the start and by loads and supports, J.
    put_in: f64,
    told: bool,
    /// Whether the gain was fatal when it was last looked at.
    suspected: bool,
    steps: String,
}

impl EnergyWatch {
    /// For a run that stands before a step. Collective.
    pub fn new<const D: usize>(simulation: &Simulation<'_, D>) -> Self {
        let (plan, model) = (simulation.plan, &simulation.model);
        let comm: &dyn Communicator = simulation.comm;
        let mut stiffness = [ExactSum::ZERO];
        for (volume, block) in model.volume.iter().zip(&model.block) {
            let material = &plan.block(usize::from(*block)).body.material;
            stiffness[0].add(material.elastic.youngs_modulus * volume);
        }
        let (step, stable) = (simulation.clock.step(), simulation.stable_step);
        Self {
            floor: STRAIN_AT_REST * STRAIN_AT_REST * reduce(comm, &mut stiffness)[0],
            put_in: 0.0,
            told: false,
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
}
