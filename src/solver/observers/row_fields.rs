//! Cache of the fields for a row of the history.

use crate::problem::Field;
use crate::solver::Simulation;

use super::snapshot::Snapshot;

/// Fields at the time of a snapshot; each is computed only once.
pub struct RowFields<'s> {
    snapshot: &'s Snapshot,
    computed: Vec<(Field, Vec<f64>)>,
}

impl<'s> RowFields<'s> {
    /// Create an empty cache.
    pub fn new(snapshot: &'s Snapshot) -> Self {
        Self {
            snapshot,
            computed: Vec::new(),
        }
    }

    /// Return a field over the owned points in the layout of [`Snapshot::field`], and compute it at the first
    /// request.
    pub fn get<const D: usize>(
        &mut self,
        simulation: &mut Simulation<'_, D>,
        field: Field,
    ) -> &[f64] {
        let known = self.computed.iter().position(|(known, _)| *known == field);
        let index = known.unwrap_or_else(|| {
            let values = self.snapshot.field(simulation, field);
            self.computed.push((field, values));
            self.computed.len() - 1
        });
        &self.computed[index].1
    }
}
