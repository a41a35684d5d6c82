//! Adjustment of the time step to contact: shorter before stiff contact, longer again afterwards.

use crate::error::{Error, Result};
use crate::problem::{Rigid, StepRule};
use crate::solver::Simulation;
use crate::solver::contact::Contact;

/// Factor on the step that contact allows, because the contact stiffness usually increases further.
const CONTACT_RESERVE: f64 = 0.95;

/// A step could have been longer if it is below this fraction of the step that the stage and contact allow.
const CALM_SHARE: f64 = 0.8;

impl<const D: usize> Simulation<'_, D> {
    /// Return a new step (s) if contact is too stiff for the present step, or if enough consecutive steps
    /// could have been longer. The new step divides the rest of the stage evenly. Otherwise return `None`,
    /// which means that the step does not change. The result is always `None` at the end of a stage, in a
    /// quasi-static stage, and in runs without contact.
    pub fn step_for_contact(&self) -> Option<f64> {
        if self.is_quasi_static() {
            return None;
        }
        let (contact, limit) = (self.contact.as_ref()?, self.contact_limit()?);
        let most = self.stages.steps[self.progress.stage]
            .0
            .min(CONTACT_RESERVE * limit);
        let step = self.clock.step();
        let is_too_long = contact.is_felt() && step > limit;
        let is_too_short = contact.is_calm() && step < most;
        if self.is_stage_over() || !(is_too_long || is_too_short) {
            return None;
        }
        let left = self.clock.end() - self.clock.time();
        Some(left / (left / most).ceil())
    }

    /// The largest step that contact allows (s): the stable step with contact, times `safety` for automatic
    /// steps. `None` in runs without contact.
    pub(in crate::solver) fn contact_limit(&self) -> Option<f64> {
        let contact = self.contact.as_ref()?;
        let safety = match self.time_rule().step {
            StepRule::Automatic(safety) => safety,
            StepRule::Fixed(_) => 1.0,
        };
        Some(safety * contact.stable_step(self.scaled_stable_step()))
    }

    /// Count the consecutive steps that could have been longer in spite of contact.
    pub(in crate::solver) fn count_calm_steps(&mut self) {
        let Some(limit) = self.contact_limit() else {
            return;
        };
        let could_be_longer =
            self.clock.step() < CALM_SHARE * limit.min(self.stages.steps[self.progress.stage].0);
        if let Some(contact) = &mut self.contact {
            contact.count_calm(could_be_longer);
        }
    }

    /// Return an error if the motion of a rigid body is not finite; the error is the same on all ranks.
    pub(in crate::solver) fn check_rigid(&self) -> Result<()> {
        let lost = self.contact.as_ref().and_then(Contact::lost_rigid);
        lost.map_or(Ok(()), |lost| {
            let Rigid { name, span, .. } = &self.problem.rigid[lost];
            let message = format!(
                "[rigid.{name}]: its motion is not finite at t = {:.6e} s; look at `motion` or `force`",
                self.clock.time()
            );
            Err(Error::run(message).at(span))
        })
    }
}
