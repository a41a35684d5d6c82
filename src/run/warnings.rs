//! What a run warns of while it goes on.

use super::Job;
use super::observer::Message;
use super::recorder::Recorder;
use crate::error::Result;
use crate::message::format_number;
use crate::solver::observers::Contact;
use crate::solver::steps::choose_steps;
use crate::solver::{Simulation, Stepper};

/// Kinetic energy as a share of the strain energy above which loading is not slow.
const INERTIA_SHARE: f64 = 0.05;

/// The share of the fracture energy above which bonds have broken late.
const OVERSHOOT_SHARE: f64 = 0.1;

/// The share of a run at its start in which little strain energy is there to compare with.
const START_SHARE: f64 = 0.1;

impl<'a> Job<'a> {
    /// Says that bodies go through one another.
    pub(super) fn warn_of_contact(&mut self, contact: &Contact, time: f64) {
        let [a, b] = contact.bodies.map(|body| &self.problem.bodies[body].name);
        let place = &contact.place[..self.problem.dimension.count()];
        let place: Vec<String> = place.iter().map(|x| format!("{x:.4e}")).collect();
        let text = format!(
            "at t = {time:.4e} s points of `{a}` and `{b}` have come nearer than their spacing, at ({}) m; \
             there is no contact between bodies: where no bond joins them they go through one another",
            place.join(", ")
        );
        self.observer.message(&Message::Warning(text));
    }

    /// Says of a step (s) that was stable until points were born that it no longer is. Returns the step that
    /// is known to be stable now, s.
    pub(super) fn warn_of_step<const D: usize>(
        &mut self,
        simulation: &Simulation<'a, D>,
        before: f64,
    ) -> f64 {
        let (step, stable) = (simulation.clock.step(), simulation.scaled_stable_step());
        if step > stable && step <= before {
            let text = format!(
                "[time] step: {step:.4e} s is larger than the stable one, {stable:.4e} s, since the grid has \
                 been refined after step {}; an automatic step follows the grid",
                simulation.clock.number()
            );
            self.observer.message(&Message::Warning(text));
        }
        stable
    }

    /// Says, of a run with another density, that it is not slow; returns whether it was said.
    pub(super) fn warn_of_inertia<const D: usize>(
        &mut self,
        stepper: &Stepper<'a, D>,
        recorder: &Recorder<'a>,
    ) -> bool {
        let (time, end) = (stepper.clock().time(), self.problem.time.end);
        let scaled = stepper.time_rule().density_scale != 1.0;
        let Some(row) = recorder.last_row.as_ref().filter(|_| scaled) else {
            return false;
        };
        let (kinetic, strain) = (row.energies.kinetic, row.energies.strain);
        if time < START_SHARE * end || kinetic <= INERTIA_SHARE * strain {
            return false;
        }
        let text = format!(
            "at t = {time:.4e} s the kinetic energy is {:.1} % of the strain energy, above {} %: with \
             this density_scale the loading is not slow",
            100.0 * kinetic / strain,
            100.0 * INERTIA_SHARE
        );
        self.observer.message(&Message::Warning(text));
        true
    }

    /// Says of a run whose steps are those of the equation of motion that they were long for bonds that break.
    pub(super) fn warn_of_overshoot(&mut self, recorder: &Recorder<'a>) {
        let Some(row) = recorder.last_row.as_ref() else {
            return;
        };
        let (overshoot, fracture) = (row.energies.overshoot, row.energies.fracture);
        if self.problem.relaxes() || fracture <= 0.0 || overshoot <= OVERSHOOT_SHARE * fracture {
            return;
        }
        let text = format!(
            "when they were seen to break, bonds held {overshoot:.3e} J above their criterion, {:.0} % of the fracture \
             energy and more than {:.0} %: the steps are long for them; a smaller `safety` or \
             [time.adaptive] shortens them",
            100.0 * overshoot / fracture,
            100.0 * OVERSHOOT_SHARE
        );
        self.observer.message(&Message::Warning(text));
    }

    /// Says so if the steps keep the size of the first ones, where a new run to the same end would have
    /// others.
    pub(super) fn tell_kept_step<const D: usize>(
        &mut self,
        simulation: &Simulation<'a, D>,
    ) -> Result<()> {
        let (clock, problem) = (&simulation.clock, self.problem);
        let steps = choose_steps(problem, simulation.stable_step)?;
        let &[(fresh, _)] = &steps[..] else {
            return Ok(());
        };
        if clock.step() != fresh && !clock.is_over() {
            let text = format!(
                "the steps stay at {:e} s, as the run began; a new run until t = {} s would take {fresh:e} s \
                 and end with other last digits",
                clock.step(),
                format_number(problem.time.end),
            );
            self.observer.message(&Message::Warning(text));
        }
        Ok(())
    }
}
