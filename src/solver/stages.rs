//! Stages of a run; each has a method, an end and conditions.

use crate::comm::sum::{ExactSum, reduce};
use crate::problem::Stage;

use super::Simulation;
use super::conditions::Conditions;
use super::motion::Clock;
use super::motion::fields::Fields;
use super::motion::integrator::integrator;
use super::steps::even_clock;

/// Rules of the stages of a run.
pub struct Stages<const D: usize> {
    /// The stages of the run.
    pub all: Vec<Stage>,
    /// Length of the first step of each stage (s), and the number of steps of the stage if no bond breaks.
    pub(super) steps: Vec<(f64, f64)>,
    /// Conditions of the other stages; `None` for the present stage.
    pub(super) waiting: Vec<Option<Conditions<D>>>,
}

/// For each condition, return the time (s) from which it acts without interruption up to this stage. The time
/// is `None` if the condition does not act in this stage.
pub(super) fn begins(stages: &[Stage], stage: usize) -> Vec<Option<f64>> {
    let begin = |condition: usize| {
        let acting = stages[..=stage].iter().rev();
        let count = acting.take_while(|stage| stage.acting[condition]).count();
        let before = (stage + 1 - count).checked_sub(1);
        (count > 0).then(|| before.map_or(0.0, |before| stages[before].time.end))
    };
    (0..stages[stage].acting.len()).map(begin).collect()
}

impl<const D: usize> Simulation<'_, D> {
    /// Whether the present stage has reached its end.
    pub fn is_stage_over(&self) -> bool {
        self.clock.is_over() && self.progress.load_step.is_settled
    }

    /// Whether the run has reached its end.
    pub fn is_over(&self) -> bool {
        self.is_stage_over() && self.progress.stage + 1 == self.stages.all.len()
    }

    /// Index of the stage that begins with the next step; `None` if the present stage continues.
    pub(super) fn next_stage(&self) -> Option<usize> {
        let next = self.progress.stage + 1;
        (self.is_stage_over() && next < self.stages.all.len()).then_some(next)
    }

    /// Return the expected number of the last step of the run. The present step length is assumed to stay the
    /// same up to the end of the stage. Each later stage is assumed to take its expected number of steps.
    pub fn last_step(&self) -> u64 {
        let later = self.stages.steps[self.progress.stage + 1..].iter();
        self.clock.last() + later.map(|(_, steps)| *steps as u64).sum::<u64>()
    }

    /// Clock of the whole run, with the number of steps that is expected if no bond breaks.
    pub fn expected_clock(&self) -> Clock {
        match &self.stages.all[..] {
            [stage] if stage.time.adaptive.is_none() => self.clock,
            _ => even_clock(self.problem, &self.stages.steps),
        }
    }

    /// Stable step with the scaled density of the present stage, s.
    pub fn scaled_stable_step(&self) -> f64 {
        self.undeformed.stable_step * self.time_rule().density_scale.sqrt()
    }

    /// Begin another stage at the present positions. Velocities are set to 0 if this stage or the previous
    /// stage consists of load steps. Collective.
    pub(super) fn begin_stage(&mut self, stage: usize) {
        let (was_static, scale) = (self.is_quasi_static(), self.time_rule().density_scale);
        self.enter(stage);
        let (step, _) = self.stages.steps[stage];
        self.clock.set_stage(step, self.time_rule().end);
        self.begin_adapting();
        if was_static || self.is_quasi_static() {
            let Fields { velocity, .. } = &mut self.fields;
            velocity
                .iter_mut()
                .for_each(|component| component.fill(0.0));
            self.fields.clear_dissipative_contact();
        }
        let forces = [&mut self.fields.external_force, &mut self.fields.reaction];
        let components = forces.into_iter().flatten().flatten();
        components.for_each(|component| component.fill(0.0));
        let clock = self.clock;
        self.apply_loads(clock.time(), true);
        let factor = self.time_rule().density_scale / scale;
        let keeps_momentum = factor != 1.0 && !was_static && !self.is_quasi_static();
        let mut finite = self.begin_supports(if keeps_momentum { factor } else { 1.0 });
        if let Some(contact) = &mut self.contact {
            contact.scale_density(factor);
        }
        if keeps_momentum {
            finite &= self.keep_momentum(factor);
        }
        if !finite {
            self.note_bad(&clock);
        }
    }

    /// Set the velocities of supported points at the start of a stage. A support that changes the velocity of
    /// a point exerts an impulse. The work of this impulse equals the change of kinetic energy and is added
    /// to the external work. The density at the impulse is the present density divided by `density_ratio`.
    /// Returns whether the velocities and reactions of supported points are finite.
    fn begin_supports(&mut self, density_ratio: f64) -> bool {
        let squares = |velocity: &[Vec<f64>; D], point: usize| -> f64 {
            velocity.iter().map(|column| column[point].powi(2)).sum()
        };
        if self.is_quasi_static() {
            return self.apply_velocities();
        }
        let before = self.fields.velocity.clone();
        let finite = self.apply_velocities();
        let (model, fields) = (&self.model, &mut self.fields);
        if let Some(work) = &mut fields.external_work {
            for (point, work) in work.iter_mut().enumerate() {
                let mass = model.density_of(point) / density_ratio * model.volume[point];
                let change = squares(&fields.velocity, point) - squares(&before, point);
                *work += 0.5 * mass * change;
            }
        }
        finite
    }

    /// Conserve the momentum of the points after their densities were multiplied by a factor. Components with
    /// prescribed motion keep their velocity. Record the change of kinetic energy. Returns whether the
    /// velocities and reactions of supported points are finite. Collective.
    ///
    /// If momentum is conserved, the change of density exerts no force. To conserve the velocities instead,
    /// an impulse would be needed. To conserve the kinetic energy instead, an impulse would be needed that
    /// depends on the frame of reference.
    fn keep_momentum(&mut self, factor: f64) -> bool {
        let before = self.kinetic_energy() / factor;
        let components = self.fields.velocity.iter_mut();
        components
            .flatten()
            .for_each(|velocity| *velocity /= factor);
        let finite = self.apply_velocities();
        self.update_damping_power();
        self.progress.density_scale_energy += self.kinetic_energy() - before;
        finite
    }

    /// Kinetic energy of the points of all ranks, J. Collective.
    fn kinetic_energy(&self) -> f64 {
        let model = &self.model;
        let mut sum = [ExactSum::ZERO];
        for point in 0..model.owned() {
            let mass = model.density_of(point) * model.volume[point];
            let velocity = self.fields.velocity.iter().map(|column| column[point]);
            let square: f64 = velocity.map(|component| component * component).sum();
            sum[0].add(0.5 * mass * square);
        }
        reduce(self.comm, &mut sum)[0]
    }

    /// Activate the conditions, the integrator and the density of a stage.
    pub(super) fn enter(&mut self, stage: usize) {
        if stage != self.progress.stage
            && let Some(conditions) = self.stages.waiting[stage].take()
        {
            let others = std::mem::replace(&mut self.conditions, conditions);
            self.stages.waiting[self.progress.stage] = Some(others);
            self.conditions.reset_temperatures();
        }
        self.progress.stage = stage;
        self.integrator = Some(integrator(&self.time_rule()));
        self.scale_density();
    }

    /// If the present stage has an adaptive step, start the adaptive rule with the step of the clock.
    pub(super) fn begin_adapting(&mut self) {
        if let Some(rule) = self.time_rule().adaptive {
            self.progress.step_control.begin(&rule, self.clock.step());
        }
    }

    pub(super) fn scale_density(&mut self) {
        let scale = self.time_rule().density_scale;
        for (density, block) in self.model.density.iter_mut().zip(self.problem.blocks()) {
            *density = scale * block.body.material.density;
        }
    }

    /// Whether the present stage consists of load steps.
    pub fn is_quasi_static(&self) -> bool {
        self.time_rule().is_quasi_static()
    }
}
