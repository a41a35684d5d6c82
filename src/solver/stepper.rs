//! The leapfrog driver: it defers the second half kick of a step until the next step, or until a caller
//! requests the state.

use crate::comm::Communicator;
use crate::error::{Error, Result};
use crate::message::suggestion;
use crate::problem::{Condition, Time};

use super::Simulation;
use super::conditions::LoadFactors;
use super::contact::Contact;
use super::model::Model;
use super::motion::Clock;
use super::motion::load_step::LoadStep;
use super::simulation::Times;

/// Driver that makes the steps of a simulation.
///
/// Velocities are defined at half steps, as in the leapfrog form of Verlet. Each step evaluates the forces at
/// the new positions before the second half kick. This half kick is applied together with the first half kick
/// of the next step, in one loop over the points. Until then, the velocities, reactions and external forces
/// do not yet have their values at the full step. The same holds for the external work, and for the power and
/// energy of damping. Therefore a caller gets the [`Simulation`] only from [`Self::at_full_step`], which
/// applies the pending half kick first. The results do not depend on how often this function is called.
pub struct Stepper<'a, const D: usize> {
    simulation: Simulation<'a, D>,
    /// Whether the second half kick of the last step must still be applied.
    half_kick_pending: bool,
    requests: Requests,
}

/// Requests of an observer on this rank.
#[derive(Default)]
struct Requests {
    stop: bool,
    /// Error of an invalid request; `None` if all requests are valid.
    error: Option<Error>,
}

impl<'a, const D: usize> Stepper<'a, D> {
    /// Create a stepper that starts at the present step.
    pub fn new(simulation: Simulation<'a, D>) -> Self {
        Self {
            simulation,
            half_kick_pending: false,
            requests: Requests::default(),
        }
    }

    /// Make one step, or one iteration of a load step. Collective.
    pub fn advance(&mut self) {
        let simulation = &self.simulation;
        if simulation.next_stage().is_some() || simulation.step_for_contact().is_some() {
            self.at_full_step();
        }
        self.half_kick_pending = self.simulation.leap(self.half_kick_pending);
    }

    /// Apply the second half kick if it is pending, and return the simulation at the full step. Not
    /// collective.
    pub fn at_full_step(&mut self) -> &mut Simulation<'a, D> {
        if std::mem::take(&mut self.half_kick_pending) {
            self.simulation.kick();
        }
        &mut self.simulation
    }

    /// Communication with the other ranks.
    pub fn comm(&self) -> &'a dyn Communicator {
        self.simulation.comm
    }

    /// Time and step.
    pub fn clock(&self) -> &Clock {
        &self.simulation.clock
    }

    /// Same as [`Simulation::last_step`].
    pub fn last_step(&self) -> u64 {
        self.simulation.last_step()
    }

    /// Same as [`Simulation::is_over`].
    pub fn is_over(&self) -> bool {
        self.simulation.is_over()
    }

    /// Same as [`Simulation::is_refinement_due`].
    pub fn is_refinement_due(&self) -> bool {
        self.simulation.is_refinement_due()
    }

    /// Same as [`Simulation::time_rule`].
    pub fn time_rule(&self) -> Time {
        self.simulation.time_rule()
    }

    /// Same as [`Simulation::step_for_contact`].
    pub fn step_for_contact(&self) -> Option<f64> {
        self.simulation.step_for_contact()
    }

    /// Largest overlap of two points in contact at the end of the last step, as a fraction of their contact
    /// distance; 0 without contact.
    pub fn deepest_contact(&self) -> f64 {
        (self.simulation.contact.as_ref()).map_or(0.0, Contact::deepest)
    }

    /// Progress of the load step.
    pub fn load_step(&self) -> &LoadStep {
        &self.simulation.progress.load_step
    }

    /// Wall-clock time by phase.
    pub fn times(&self) -> &Times {
        &self.simulation.times
    }

    /// Request that the run stops.
    pub fn request_stop(&mut self) {
        self.requests.stop = true;
    }

    /// Whether an observer has requested a stop on this rank.
    pub fn is_stop_requested(&self) -> bool {
        self.requests.stop
    }

    /// The error of an invalid request on this rank, if there is one.
    pub fn wrong_request(&self) -> Option<&Error> {
        self.requests.error.as_ref()
    }

    /// The factors on the loads.
    pub fn load_factors(&self) -> &LoadFactors {
        &self.simulation.progress.load_factors
    }

    /// Return the index of the load `name` in the list of all conditions of the problem.
    ///
    /// # Errors
    /// If no condition has this name, or if the condition is not a load.
    pub fn load(&self, name: &str) -> Result<usize> {
        let conditions = &self.simulation.problem.conditions;
        let is_load = |condition: &Condition| condition.action.is_load();
        let found = conditions
            .iter()
            .position(|condition| condition.name == name);
        if let Some(found) = found.filter(|found| is_load(&conditions[*found])) {
            return Ok(found);
        }
        let loads = conditions.iter().filter(|condition| is_load(condition));
        let loads = loads.map(|condition| condition.name.as_str());
        Err(Error::input(format!(
            "there is no load `{name}`{}",
            suggestion(name, loads)
        )))
    }

    /// Set the factor on a load. The factor acts from the next step or load step on. All ranks must pass the
    /// same factor. If the load is unknown or the factor is not finite, the factor does not change, and
    /// [`Self::wrong_request`] returns the error.
    pub fn set_load_factor(&mut self, name: &str, factor: f64) {
        let checked = self.load(name).and_then(|load| {
            if factor.is_finite() {
                return Ok(load);
            }
            let message = format!("the factor of the load `{name}` must be finite, is {factor}");
            Err(Error::input(message))
        });
        match checked {
            Ok(load) => self.simulation.progress.load_factors.set(load, factor),
            Err(error) => self.requests.error = Some(error),
        }
    }

    /// The points, and the properties of their blocks.
    pub fn model(&self) -> &Model<D> {
        &self.simulation.model
    }

    /// Displacement u by component, m; owned points, then ghosts.
    pub fn displacement(&self) -> &[Vec<f64>; D] {
        &self.simulation.fields.displacement
    }

    /// Same as [`Simulation::check`], without the check of values that a pending half kick changes.
    /// Collective.
    ///
    /// # Errors
    /// Same as for [`Simulation::check`].
    pub fn check(&mut self) -> Result<()> {
        self.simulation.check()
    }
}
