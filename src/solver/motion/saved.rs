//! The state of a run in the order of global ids: what a checkpoint holds.
//!
//! It is the fields that are declared as state, and what is kept of the bonds.

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

/// The state of the points of this rank's block of ids.
#[derive(Debug, Clone, PartialEq)]
pub struct Saved {
    /// The components of all fields that are state.
    pub columns: Vec<Vec<f64>>,
    /// What is kept of the bonds.
    pub bonds: SavedBonds,
    /// What the run has come to, but for its points: the same on all ranks.
    pub progress: Vec<u64>,
}

/// What is kept of the bonds of the points of this rank's block of ids.
#[derive(Debug, Clone, PartialEq)]
pub struct SavedBonds {
    /// Bytes of each point.
    pub lengths: Vec<u32>,
    /// Those of the points, one after the other.
    pub bytes: Vec<u8>,
}

/// Words of the clock among those of the progress.
const CLOCK: usize = 5;

/// Words of what an adaptive step follows.
const STEP_CONTROL: usize = 6;

/// Words of a load step.
const LOAD_STEP: usize = 8;

/// Words of what Newton's method remembers.
const NEWTON: usize = 5;

/// Words of what refinements have done.
const REFINED: usize = 2;

impl<const D: usize> Simulation<'_, D> {
    /// What the run has come to, but for its points: factors of loads come last, if they are not 1.
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

    /// Goes back to what [`Self::progress`] gave.
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

    /// Numbers that are saved a point; the same on all ranks.
    pub fn saved_width(&self) -> usize {
        self.state().count()
    }

    /// The present state, dealt out by id. Collective.
    pub fn save(&self, order: &IdOrder) -> Saved {
        Saved {
            columns: self.saved_columns(order).collect(),
            bonds: self.saved_bonds(order),
            progress: self.progress(),
        }
    }

    /// The columns of the state one by one, each dealt out by id when it is asked for. Collective.
    pub fn saved_columns(&self, order: &IdOrder) -> impl Iterator<Item = Vec<f64>> {
        let owned = self.model.owned();
        self.state()
            .map(move |column| order.collect(self.comm, &column[..owned], 1))
    }

    /// What is kept of the bonds, dealt out by id. Collective.
    pub fn saved_bonds(&self, order: &IdOrder) -> SavedBonds {
        let own = self.forces.saved_lengths(self.model.owned());
        let bytes = self.forces.saved(&own);
        let lengths = order.collect(self.comm, &own, 1);
        let bytes = order.collect_ragged(self.comm, &bytes, &own, &lengths);
        SavedBonds { lengths, bytes }
    }

    /// Goes back to a saved state. Collective.
    ///
    /// # Errors
    /// When the state is that of other points or bonds; the same on all ranks.
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
