//! Adjustment of the time step to contact: shorter before stiff contact, longer again afterwards.

use crate::error::{Error, Result};
use crate::problem::{Rigid, StepRule};
use crate::solver::Simulation;
use crate::solver::contact::Contact;

/// The step that contact allows is multiplied by this factor, because the contact stiffness usually increases
/// further.
const CONTACT_RESERVE: f64 = 0.95;

/// Largest ratio of a time step to the time step before it, when the step grows again after contact. If the
/// step grew to its full length at once, a vibrating surface could reverse its motion and touch again within
/// the first long step.
const GROWTH: f64 = 2.0;

/// Number of consecutive adaptive steps. If contact has not limited this number of steps, the next step may
/// grow by any factor.
const LONG_CALM: u64 = 400;

/// A step counts as not limited by contact if it is below this fraction of the step that contact allows.
const CALM_SHARE: f64 = 0.8;

impl<const D: usize> Simulation<'_, D> {
    /// Return a new step (s); `None` if the step does not change. The step changes in two cases:
    ///
    /// - The present step exceeds the step that contact allows. The new step is shorter.
    /// - The present step is shorter than the step of the stage, and [`Contact::is_calm`] is true. The new
    ///   step is longer if contact allows this.
    ///
    /// The new step divides the rest of the stage evenly. At the end of the stage, the result is `None`. In a
    /// stage with an adaptive step, only the first case applies, and the new step is the step that contact
    /// allows. The result is always `None` in a quasi-static stage and in runs without contact.
    pub fn step_for_contact(&self) -> Option<f64> {
        if self.is_quasi_static() {
            return None;
        }
        let (contact, limit) = (self.contact.as_ref()?, self.contact_limit()?);
        let step = self.clock.step();
        if self.time_rule().adaptive.is_some() {
            return (contact.is_felt() && step > limit).then_some(limit);
        }
        let of_stage = self.stages.steps[self.progress.stage].0;
        let most = of_stage.min(CONTACT_RESERVE * limit).min(GROWTH * step);
        let is_too_long = contact.is_felt() && step > limit;
        let is_too_short = contact.is_calm() && step < most;
        if self.is_stage_over() || !(is_too_long || is_too_short) {
            return None;
        }
        let left = self.clock.end() - self.clock.time();
        Some(left / (left / most).ceil())
    }

    /// Largest length of the next step (s), without limits from contact. In an adaptive stage, it is
    /// the step that the rule requests. In any other stage, it is the longer of two steps: the step of the
    /// present stage and the step of the next stage. The result is at least the present step.
    pub(in crate::solver) fn longest_next_step(&self) -> f64 {
        let stages = self.stages.steps.iter().skip(self.progress.stage).take(2);
        let of_stages = stages.map(|(step, _)| *step).fold(0.0, f64::max);
        let step = match self.time_rule().adaptive {
            Some(_) => self.progress.step_control.step(),
            None => of_stages,
        };
        step.max(self.clock.step())
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

    /// Change the step. If the new step is longer, reset the counter of consecutive steps that contact did
    /// not limit.
    pub(in crate::solver) fn set_step_for_contact(&mut self, step: f64) {
        if let Some(contact) = &mut self.contact
            && step > self.clock.step()
        {
            contact.count_calm(false);
        }
        self.clock.set_step(step);
    }

    /// Count the consecutive steps that contact does not limit: steps without contact, and steps clearly
    /// shorter than contact allows.
    pub(in crate::solver) fn count_calm_steps(&mut self) {
        let Some(limit) = self.contact_limit() else {
            return;
        };
        let step = self.clock.step();
        if let Some(contact) = &mut self.contact {
            contact.count_calm(!contact.is_felt() || step < CALM_SHARE * limit);
        }
    }

    /// Upper bound of the next adaptive step, s. The bound depends on the number n of consecutive steps that
    /// contact did not limit. For n < 100, the step does not grow. For n from 100 to 399, it at most doubles.
    /// For n ≥ 400, it may grow by any factor. If [`Contact::is_felt`] is true, the step is also at most
    /// `CONTACT_RESERVE` times the step that contact allows.
    pub(in crate::solver) fn adaptive_limit(&self) -> f64 {
        let Some(contact) = &self.contact else {
            return f64::INFINITY;
        };
        let felt = self.contact_limit().filter(|_| contact.is_felt());
        let felt = felt.map_or(f64::INFINITY, |limit| CONTACT_RESERVE * limit);
        let growth = match contact.calm() {
            LONG_CALM.. => f64::INFINITY,
            _ if contact.is_calm() => GROWTH,
            _ => 1.0,
        };
        felt.min(growth * self.clock.step())
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
