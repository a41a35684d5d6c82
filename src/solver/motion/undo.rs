//! Rollback of a step: restore the state of the run before the step.

use crate::solver::Simulation;
use crate::solver::bonds::KeptBonds;
use crate::solver::contact::{Contact, ContactState};

use super::Clock;

/// Copy of the state of a run at the end of a step; empty in runs without rollbacks.
#[derive(Debug, Default)]
pub struct Kept {
    clock: Option<Clock>,
    fields: Vec<Vec<f64>>,
    bonds: KeptBonds,
    contact: Option<ContactState>,
    /// Factors of the loads at the time of the copy.
    load_factors: Vec<f64>,
}

impl<const D: usize> Simulation<'_, D> {
    /// Copy the present state into `kept`, whose memory is reused.
    pub fn keep(&self, kept: &mut Kept) {
        kept.clock = Some(self.clock);
        let columns = self.fields.each().filter(|(field, _)| field.undone);
        let columns = columns.flat_map(|(_, columns)| columns);
        let mut places = std::mem::take(&mut kept.fields).into_iter();
        kept.fields = columns
            .map(|column| {
                let mut place = places.next().unwrap_or_default();
                place.clone_from(column);
                place
            })
            .collect();
        self.forces.keep(&mut kept.bonds);
        kept.load_factors.clear();
        kept.load_factors
            .extend_from_slice(self.progress.load_factors.present());
        kept.contact = self.contact.as_ref().map(Contact::state);
    }

    /// Restore the state from `kept`; do nothing if `kept` is empty. If the same steps are then repeated,
    /// their results are bitwise the same.
    pub fn undo(&mut self, kept: &Kept) {
        let Some(clock) = kept.clock else { return };
        self.clock = clock;
        let columns = self.fields.each_mut().filter(|(field, _)| field.undone);
        let columns = columns.flat_map(|(_, columns)| columns);
        for (column, kept) in columns.zip(&kept.fields) {
            column.copy_from_slice(kept);
        }
        self.forces.undo(&kept.bonds);
        if let (Some(contact), Some(state)) = (&mut self.contact, &kept.contact) {
            contact.undo(state, &self.model, &self.forces);
        }
        self.progress.load_factors.undo(&kept.load_factors);
        // External forces are not part of the copy, so evaluate them at the restored time.
        self.apply_loads(clock.time(), true);
    }
}
