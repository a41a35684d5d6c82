//! Progress of a run in the form that checkpoints store. It does not include point data.

use super::Simulation;
use super::conditions::LoadFactors;
use super::contact::ContactState;
use super::motion::Clock;
use super::motion::adaptive::StepControl;
use super::motion::load_step::LoadStep;
use super::motion::newton::NewtonState;
use super::refinement::Refined;

/// Progress of a run, without point data and clock; the same on all ranks.
#[derive(Debug)]
pub struct Progress {
    /// Index of the present stage.
    pub stage: usize,
    /// State of the adaptive step.
    pub step_control: StepControl,
    /// Totals of the refinements during the run.
    pub refined: Refined,
    /// Kinetic energy added by changes of the density scale between stages, J.
    pub density_scale_energy: f64,
    /// Progress of the load step; `is_settled` is true in explicit stages.
    pub load_step: LoadStep,
    /// State of Newton's method.
    pub newton: NewtonState,
    /// Factors on the loads, which an observer may change.
    pub load_factors: LoadFactors,
}

impl Progress {
    /// Return the progress at the start of a run with this number of conditions.
    pub(super) fn new(conditions: usize) -> Self {
        Self {
            stage: 0,
            step_control: StepControl::default(),
            refined: Refined::default(),
            density_scale_energy: 0.0,
            load_step: LoadStep::default(),
            newton: NewtonState::default(),
            load_factors: LoadFactors::new(conditions),
        }
    }
}

/// Words of the progress that remain to be decoded.
struct Words<'a>(&'a [u64]);

impl<'a> Words<'a> {
    fn next<const N: usize>(&mut self) -> [u64; N] {
        let (words, rest) = self.0.split_first_chunk().expect("enough words");
        self.0 = rest;
        *words
    }

    /// Take the next `count` words.
    fn split(&mut self, count: usize) -> &'a [u64] {
        let (words, rest) = self.0.split_at(count);
        self.0 = rest;
        words
    }
}

impl<const D: usize> Simulation<'_, D> {
    /// Encode the progress of the run as words. The progress does not include point data.
    pub fn progress_words(&self) -> Vec<u64> {
        let mut words = self.progress_without_factors();
        words.extend(self.progress.load_factors.words());
        words
    }

    /// Encode the progress except the load factors, whose number of words depends on their values.
    pub(super) fn progress_without_factors(&self) -> Vec<u64> {
        let mut words = vec![self.progress.stage as u64];
        words.extend(self.clock.words());
        words.extend(self.progress.step_control.words());
        words.extend(self.progress.refined.words());
        if self.problem.changes_density_scale() {
            words.push(self.progress.density_scale_energy.to_bits());
        }
        words.extend(self.progress.load_step.words());
        if self.problem.has_newton() {
            words.extend(self.progress.newton.words());
        }
        if let Some(contact) = &self.contact {
            words.extend(contact.state().words());
        }
        words
    }

    /// Restore the progress from the words of [`Self::progress_words`].
    pub(super) fn continue_from(&mut self, progress: &[u64]) {
        let mut words = Words(progress);
        let [stage] = words.next();
        self.enter(stage as usize);
        self.clock = Clock::of_words(words.next(), self.time_rule().end);
        self.progress.step_control = StepControl::of_words(words.next());
        self.progress.refined = Refined::of_words(words.next());
        if self.problem.changes_density_scale() {
            let [energy] = words.next();
            self.progress.density_scale_energy = f64::from_bits(energy);
        }
        self.progress.load_step = LoadStep::of_words(words.next());
        if self.problem.has_newton() {
            self.progress.newton = NewtonState::of_words(words.next());
        }
        if let Some(contact) = &mut self.contact {
            let count = contact.state().words().len();
            contact.restore(&ContactState::of_words(words.split(count)));
        }
        self.progress.load_factors = LoadFactors::of_words(words.0, self.problem.conditions.len());
    }
}
