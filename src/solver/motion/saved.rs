//! The state of a run, ordered by global ids, as a checkpoint stores it.
//!
//! It consists of the fields that are declared as state, and the bond state.

use crate::comm::{IdOrder, agree};
use crate::error::{Error, Result};
use crate::solver::Simulation;
use crate::solver::conditions::LoadFactors;
use crate::solver::contact::ContactState;
use crate::solver::refinement::Refined;

use super::Clock;
use super::adaptive::StepControl;
use super::load_step::LoadStep;
use super::newton::NewtonState;

/// The state of the points in this rank's range of ids.
#[derive(Debug, Clone, PartialEq)]
pub struct Saved {
    /// The components of all fields that are state.
    pub columns: Vec<Vec<f64>>,
    /// State of the bonds.
    pub bonds: SavedBonds,
    /// Progress of the run, without point data; the same on all ranks.
    pub progress: Vec<u64>,
}

/// Bond state of the points in this rank's range of ids.
#[derive(Debug, Clone, PartialEq)]
pub struct SavedBonds {
    /// Number of bytes of each point.
    pub lengths: Vec<u32>,
    /// Bytes of the points in order.
    pub bytes: Vec<u8>,
}

/// Number of words of the clock in the progress.
const CLOCK: usize = 5;

/// Number of words of the state of an adaptive step.
const STEP_CONTROL: usize = 6;

/// Number of words of a load step.
const LOAD_STEP: usize = 8;

/// Number of words of the state of Newton's method.
const NEWTON: usize = 5;

/// Number of words of the counters of refinement.
const REFINED: usize = 2;

impl<const D: usize> Simulation<'_, D> {
    /// Encode the progress of the run, without point data.
    pub fn progress(&self) -> Vec<u64> {
        let mut progress = self.progress_without_factors();
        progress.extend(self.load_factors.words());
        progress
    }

    fn progress_without_factors(&self) -> Vec<u64> {
        let clock = self.clock.words().into_iter();
        let stage = [self.stage as u64].into_iter();
        let steps = self.step_control.words().into_iter();
        let times = stage.chain(clock).chain(steps);
        let refined = self.refined.words().into_iter();
        let changes = self.problem.changes_density_scale();
        let scaled = changes.then(|| self.density_scale_energy.to_bits());
        let refined = refined.chain(scaled);
        let contact = self.contact.iter();
        let contact = contact.flat_map(|contact| contact.state().words());
        let newton = self.problem.has_newton().then(|| self.newton.words());
        let progress = times.chain(refined).chain(self.load_step.words());
        let progress = progress.chain(newton.into_iter().flatten());
        progress.chain(contact).collect()
    }

    /// Restore the progress from [`Self::progress`].
    pub(in crate::solver) fn continue_from(&mut self, progress: &[u64]) {
        let (stage, rest) = progress.split_at(1);
        let (clock, rest) = rest.split_at(CLOCK);
        let (steps, rest) = rest.split_at(STEP_CONTROL);
        let (refined, rest) = rest.split_at(REFINED);
        let (scaled, rest) = rest.split_at(usize::from(self.problem.changes_density_scale()));
        let (load_step, rest) = rest.split_at(LOAD_STEP);
        let has_newton = self.problem.has_newton();
        let (newton, rest) = rest.split_at(if has_newton { NEWTON } else { 0 });
        let contact = self.contact.as_ref();
        let contact_count = contact.map_or(0, |contact| contact.state().words().len());
        let (contact_words, factors) = rest.split_at(contact_count);
        self.load_factors = LoadFactors::of_words(factors, self.problem.conditions.len());
        self.enter(stage[0] as usize);
        let clock = std::array::from_fn(|k| clock[k]);
        self.clock = Clock::of_words(clock, self.time_rule().end);
        self.step_control = StepControl::of_words(std::array::from_fn(|k| steps[k]));
        self.refined = Refined::of_words(std::array::from_fn(|k| refined[k]));
        self.density_scale_energy = scaled.first().copied().map_or(0.0, f64::from_bits);
        self.load_step = LoadStep::of_words(std::array::from_fn(|k| load_step[k]));
        if has_newton {
            self.newton = NewtonState::of_words(std::array::from_fn(|k| newton[k]));
        }
        if let Some(contact) = &mut self.contact {
            contact.restore(&ContactState::of_words(contact_words));
        }
    }

    /// The columns of the state.
    fn state(&self) -> impl Iterator<Item = &Vec<f64>> {
        let fields = self.fields.each().filter(|(field, _)| field.state);
        fields.flat_map(|(_, columns)| columns)
    }

    /// Number of saved values per point; the same on all ranks.
    pub fn saved_width(&self) -> usize {
        self.state().count()
    }

    /// The present state, distributed to ranks by id. Collective.
    pub fn save(&self, order: &IdOrder) -> Saved {
        Saved {
            columns: self.saved_columns(order).collect(),
            bonds: self.saved_bonds(order),
            progress: self.progress(),
        }
    }

    /// The columns of the state one by one. Each is distributed by id when it is requested. Collective.
    pub fn saved_columns(&self, order: &IdOrder) -> impl Iterator<Item = Vec<f64>> {
        let owned = self.model.owned();
        self.state()
            .map(move |column| order.collect(self.comm, &column[..owned], 1))
    }

    /// The bond state, distributed by id. Collective.
    pub fn saved_bonds(&self, order: &IdOrder) -> SavedBonds {
        let own = self.forces.saved_lengths(self.model.owned());
        let bytes = self.forces.saved(&own);
        let lengths = order.collect(self.comm, &own, 1);
        let bytes = order.collect_ragged(self.comm, &bytes, &own, &lengths);
        SavedBonds { lengths, bytes }
    }

    /// Restore a saved state. Collective.
    ///
    /// # Errors
    /// If the state belongs to other points or bonds; the error is the same on all ranks.
    pub fn restore(&mut self, order: &IdOrder, saved: &Saved) -> Result<()> {
        let lengths = self.forces.saved_lengths(self.model.owned());
        let expected = order.collect(self.comm, &lengths, 1);
        let others = self.progress_without_factors().len();
        let factors = saved.progress.len().checked_sub(others);
        let progress =
            matches!(factors, Some(0)) || factors == Some(self.load_factors.word_count());
        let columns = saved.columns.len() == self.saved_width();
        let fits = columns && saved.bonds.lengths == expected && progress;
        let fits = if fits {
            Ok(())
        } else {
            Err(Error::run("the checkpoint is that of other bonds"))
        };
        agree(self.comm, fits)?;
        let SavedBonds {
            lengths: all,
            bytes,
        } = &saved.bonds;
        let bonds = order.spread_ragged(self.comm, bytes, &lengths, all);
        self.forces.restore(&lengths, &bonds);
        let fields = self.fields.each_mut().filter(|(field, _)| field.state);
        let columns = fields.flat_map(|(_, columns)| columns);
        for (column, saved) in columns.zip(&saved.columns) {
            let values = order.spread(self.comm, saved, 1);
            column[..values.len()].copy_from_slice(&values);
        }
        self.continue_from(&saved.progress);
        self.recompute_derived();
        Ok(())
    }
}
