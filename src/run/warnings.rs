//! Warnings during a run.

use super::Job;
use super::energy_watch::StepKinds;
use super::observer::Message;
use super::recorder::Recorder;
use crate::error::Result;
use crate::message::format_number;
use crate::solver::motion::Clock;
use crate::solver::observers::Interpenetration;
use crate::solver::steps::choose_steps;
use crate::solver::{Simulation, Stepper};

/// Ratio of kinetic to strain energy above which loading does not count as quasi-static, and a warning is
/// printed.
const MAX_INERTIA: f64 = 0.05;

/// Ratio of overshoot to fracture energy above which a run with time steps prints a warning. For comparison:
/// a run with a branching crack at `safety = 0.8` has a ratio of 0.4. With a quarter of the time step, the
/// fracture energy of this run changes by 1 %.
const MAX_OVERSHOOT: f64 = 0.5;

/// Ratio of overshoot to fracture energy above which a warning is printed, in a run with load steps only. In
/// most runs with a single crack that grows through equilibria, the ratio is 0.05 to 0.2. A larger ratio has
/// two possible causes. A load step breaks bonds that earlier breaks would have unloaded if the load steps
/// were shorter, or a crack grows unstably within a load step.
const MAX_OVERSHOOT_OF_LOAD_STEPS: f64 = 0.25;

/// Overlap of two points, as a fraction of their contact distance, above which a warning is printed. At 1,
/// the points would be at the same place. Points that have passed each other are pressed farther apart.
pub(super) const MAX_DEPTH: f64 = 0.9;

/// Fraction of the simulated time before which inertia is not checked, because the strain energy is still
/// small.
const UNCHECKED_FRACTION: f64 = 0.1;

impl<'a> Job<'a> {
    /// Warn of bodies whose points have moved into each other.
    pub(super) fn warn_of_interpenetration(&mut self, found: &Interpenetration, time: f64) {
        let [a, b] = found.bodies.map(|body| &self.problem.bodies[body].name);
        let position = &found.place[..self.problem.dimension.count()];
        let position: Vec<String> = position.iter().map(|x| format!("{x:.4e}")).collect();
        let (closer, which) = if found.were_bonded {
            ("half their spacing", "bodies whose bonds have broken")
        } else {
            ("their spacing", "bodies without bonds between them")
        };
        let text = format!(
            "at t = {time:.4e} s points of `{a}` and `{b}` are closer than {closer}, at ({}) m; without \
             `[contact]`, {which} pass through each other",
            position.join(", ")
        );
        self.observer.message(&Message::Warning(text));
    }

    /// Report that contact shortens the time step to `step`, s.
    pub(super) fn warn_of_stiff_contact(&mut self, clock: &Clock, step: f64) {
        let text = format!(
            "after step {} (t = {:.4e} s) contact is too stiff for a time step of {:.4e} s; the step is now \
             {step:.4e} s and follows the contact",
            clock.number(),
            clock.time(),
            clock.step(),
        );
        self.observer.message(&Message::Warning(text));
    }

    /// Warn of points that are about to pass each other.
    pub(super) fn warn_of_deep_contact(&mut self, clock: &Clock) {
        let text = format!(
            "after step {} (t = {:.4e} s) points in contact overlap by more than {} % of their contact distance, \
             and may pass through each other; increase `stiffness` in [contact], or choose model = \
             \"short-range\"",
            clock.number(),
            clock.time(),
            100.0 * MAX_DEPTH,
        );
        self.observer.message(&Message::Warning(text));
    }

    /// Warn of a fixed step that refinement has made unstable. `before` is the smallest stable step before
    /// the present refinement (s). Return the present stable step, s.
    pub(super) fn warn_of_step<const D: usize>(
        &mut self,
        simulation: &Simulation<'a, D>,
        before: f64,
    ) -> f64 {
        let (step, stable) = (simulation.clock.step(), simulation.scaled_stable_step());
        if step > stable && step <= before {
            let text = format!(
                "[time] step: {step:.4e} s is larger than the stable step, {stable:.4e} s, since the grid has \
                 been refined after step {}; an automatic step follows the grid",
                simulation.clock.number()
            );
            self.observer.message(&Message::Warning(text));
        }
        stable
    }

    /// Warn if the inertia of a run with scaled density is not negligible. Return true if a warning was sent.
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
        if time < UNCHECKED_FRACTION * end || strain == 0.0 || kinetic <= MAX_INERTIA * strain {
            return false;
        }
        let text = format!(
            "at t = {time:.4e} s the kinetic energy is {:.1} % of the strain energy, above {} %: the loading is not \
             quasi-static at this density_scale",
            100.0 * kinetic / strain,
            100.0 * MAX_INERTIA
        );
        self.observer.message(&Message::Warning(text));
        true
    }

    /// Warn if bonds broke far above their criterion because time steps or load steps were too long.
    pub(super) fn warn_of_overshoot(&mut self, recorder: &Recorder<'a>) {
        let Some(row) = recorder.last_row.as_ref() else {
            return;
        };
        let (overshoot, fracture) = (row.energies.overshoot, row.energies.fracture);
        let (limit, share, step, advice) = match StepKinds::of(self.problem) {
            StepKinds::Time => (MAX_OVERSHOOT, "half", "step", "half the time step and"),
            StepKinds::Load => (
                MAX_OVERSHOOT_OF_LOAD_STEPS,
                "a quarter",
                "load step",
                "twice the `load_steps` and",
            ),
            StepKinds::Both => (
                MAX_OVERSHOOT,
                "half",
                "step",
                "half the time step and twice the `load_steps`, and",
            ),
        };
        if overshoot <= limit * fracture.abs() {
            return;
        }
        if fracture < 0.0 {
            let text = format!(
                "within one step, bonds went from no load to beyond their criterion; the fracture energy, \
                 {fracture:.3e} J, is therefore wrong; check the units of the toughness and of the \
                 velocities, and repeat with a shorter time step",
            );
            self.observer.message(&Message::Warning(text));
            return;
        }
        let text = format!(
            "bonds broke up to one {step} late: their energy above the criterion is {overshoot:.3e} J, more than \
             {share} of the fracture energy of {fracture:.3e} J; repeat with {advice} compare",
        );
        self.observer.message(&Message::Warning(text));
    }

    /// Warn if the time step of a restarted run differs from the time step that a new run with the same end
    /// time would use. Only runs with one stage are checked.
    pub(super) fn warn_of_resumed_step<const D: usize>(
        &mut self,
        simulation: &Simulation<'a, D>,
    ) -> Result<()> {
        let (clock, problem) = (&simulation.clock, self.problem);
        let steps = choose_steps(problem, simulation.undeformed.stable_step)?;
        let &[(fresh, _)] = &steps[..] else {
            return Ok(());
        };
        if clock.step() != fresh && !clock.is_over() {
            let text = format!(
                "the time step stays {:e} s, as at the start of this run; a new run to t = {} s would use {fresh:e} s \
                 and differ in the last digits",
                clock.step(),
                format_number(problem.time.end),
            );
            self.observer.message(&Message::Warning(text));
        }
        Ok(())
    }
}
