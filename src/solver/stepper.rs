//! Steps one after the other, each of which leaves its second half kick to whoever asks for the state.

use crate::comm::Communicator;
use crate::error::Result;
use crate::problem::Time;

use super::Simulation;
use super::model::Model;
use super::motion::Clock;
use super::motion::relaxation::LoadStep;
use super::simulation::Times;

/// Makes the steps of a simulation.
///
/// Velocities live at half steps, as in the leapfrog form of Verlet: a step ends with forces at the new place, and the
/// kicks before and after it are made together by the next one, which so goes over the points once. Meanwhile
/// velocities, reactions, external forces, damping and the energies of these are not those of a full step. So there is
/// no way to the simulation but [`Self::at_full_step`], which makes the half kick that is missing. The bits are the same
/// whether it is asked or not, and on how many ranks.
pub struct Stepper<'a, const D: usize> {
    simulation: Simulation<'a, D>,
    /// Whether the second half kick of the last step is still to be made.
    kick_is_due: bool,
}

impl<'a, const D: usize> Stepper<'a, D> {
    /// For the steps after the present one.
    pub fn new(simulation: Simulation<'a, D>) -> Self {
        Self {
            simulation,
            kick_is_due: false,
        }
    }

    /// Makes one step, or one iteration of a load step. Collective.
    pub fn advance(&mut self) {
        if self.simulation.next_stage().is_some() {
            self.at_full_step();
        }
        self.kick_is_due = self.simulation.leap(self.kick_is_due);
    }

    /// The simulation with everything at the full step. Makes the second half kick on this rank, if it is due.
    pub fn at_full_step(&mut self) -> &mut Simulation<'a, D> {
        if std::mem::take(&mut self.kick_is_due) {
            self.simulation.kick();
        }
        &mut self.simulation
    }

    /// The other ranks.
    pub fn comm(&self) -> &'a dyn Communicator {
        self.simulation.comm
    }

    /// Time and step.
    pub fn clock(&self) -> &Clock {
        &self.simulation.clock
    }

    /// As [`Simulation::last_step`].
    pub fn last_step(&self) -> u64 {
        self.simulation.last_step()
    }

    /// As [`Simulation::is_over`].
    pub fn is_over(&self) -> bool {
        self.simulation.is_over()
    }

    /// As [`Simulation::is_refinement_due`].
    pub fn is_refinement_due(&self) -> bool {
        self.simulation.is_refinement_due()
    }

    /// As [`Simulation::time_rule`].
    pub fn time_rule(&self) -> Time {
        self.simulation.time_rule()
    }

    /// How far the load step has come.
    pub fn load_step(&self) -> &LoadStep {
        &self.simulation.load_step
    }

    /// Where the time went.
    pub fn times(&self) -> &Times {
        &self.simulation.times
    }

    /// The points.
    pub fn model(&self) -> &Model<D> {
        &self.simulation.model
    }

    /// u, m; owned points, then ghosts.
    pub fn displacement(&self) -> &[Vec<f64>; D] {
        &self.simulation.fields.displacement
    }

    /// As [`Simulation::check`], of all values but those that a kick which is due changes. Collective.
    ///
    /// # Errors
    /// As those of [`Simulation::check`].
    pub fn check(&mut self) -> Result<()> {
        self.simulation.check()
    }
}
