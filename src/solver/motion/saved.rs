//! The state of a run in the layout of checkpoints: points are ordered by global id.
//!
//! The state consists of the fields that are declared as state, the bond state, and the progress of the run.

use crate::comm::{IdOrder, agree};
use crate::error::{Error, Result};
use crate::solver::Simulation;

use super::fields::{Description, NEWLY_BROKEN_OF_FURTHER};

/// The state of the points in this rank's range of ids.
#[derive(Debug, Clone, PartialEq)]
pub struct Saved {
    /// Columns of all fields of the state, one per component.
    pub columns: Vec<SavedColumn>,
    /// State of the bonds.
    pub bonds: SavedBonds,
    /// Progress of the run, without point data; the same on all ranks.
    pub progress: Vec<u64>,
}

/// Column of one component of a field.
#[derive(Debug, Clone, PartialEq)]
pub struct SavedColumn {
    /// Name of the field, `_`, and index of the component. A column that counts newly broken bonds for a
    /// further result is named `newly_broken_of_` followed by the name of this result.
    pub name: String,
    /// Values of the points, ordered by id.
    pub values: Vec<f64>,
}

/// Bond state of the points in this rank's range of ids.
#[derive(Debug, Clone, PartialEq)]
pub struct SavedBonds {
    /// Number of bytes for each point.
    pub lengths: Vec<u32>,
    /// Bytes of all points, ordered by id.
    pub bytes: Vec<u8>,
}

/// Prefix of the names of columns that count newly broken bonds for a further result. Such columns may be
/// missing in a checkpoint, because a restart may change the further results.
const NEWLY_BROKEN_OF: &str = "newly_broken_of_";

impl<const D: usize> Simulation<'_, D> {
    /// Name of a column of the state in checkpoints.
    fn column_name(&self, field: Description, component: usize) -> String {
        if field.name == NEWLY_BROKEN_OF_FURTHER {
            let output = self.problem.further_counts().nth(component);
            let name = output.and_then(|output| output.name.as_deref());
            return format!("{NEWLY_BROKEN_OF}{}", name.unwrap_or_default());
        }
        format!("{}_{component}", field.name)
    }

    /// Names of the columns of the state; the same on all ranks.
    pub fn saved_names(&self) -> Vec<String> {
        let state = self.fields.state();
        let names = state.map(|(field, component, _)| self.column_name(field, component));
        names.collect()
    }

    /// Collect the present state, with points distributed to ranks by id. Collective.
    pub fn save(&self, order: &IdOrder) -> Saved {
        Saved {
            columns: self.saved_columns(order).collect(),
            bonds: self.saved_bonds(order),
            progress: self.progress_words(),
        }
    }

    /// Iterate over the columns of the state. Each column is distributed to ranks by id when it is requested.
    /// Collective.
    pub fn saved_columns(&self, order: &IdOrder) -> impl Iterator<Item = SavedColumn> {
        let owned = self.model.owned();
        let state = self.fields.state();
        state.map(move |(field, component, values)| SavedColumn {
            name: self.column_name(field, component),
            values: order.collect(self.comm, &values[..owned], 1),
        })
    }

    /// Collect the bond state, distributed to ranks by id. Collective.
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
    /// If the bonds or fields of the saved state differ from those of this run, or if [`Saved::progress`]
    /// does not have the expected length. The error is the same on all ranks.
    pub fn restore(&mut self, order: &IdOrder, saved: &Saved) -> Result<()> {
        let names = self.saved_names();
        let lengths = self.forces.saved_lengths(self.model.owned());
        let expected = order.collect(self.comm, &lengths, 1);
        let outcome = self.check_matches(&names, &expected, saved);
        agree(self.comm, outcome)?;
        let SavedBonds {
            lengths: all,
            bytes,
        } = &saved.bonds;
        let bonds = order.spread_ragged(self.comm, bytes, &lengths, all);
        self.forces.restore(&lengths, &bonds);
        for (column, name) in self.fields.state_mut().zip(&names) {
            let mut columns = saved.columns.iter();
            let Some(saved) = columns.find(|saved| saved.name == *name) else {
                // The checkpoint has no count for a further result that the restart adds.
                column.fill(0.0);
                continue;
            };
            let values = order.spread(self.comm, &saved.values, 1);
            column[..values.len()].copy_from_slice(&values);
        }
        self.continue_from(&saved.progress);
        self.recompute_derived();
        Ok(())
    }

    /// Check that a saved state fits this run. `names` are the expected names of the columns. `lengths` are
    /// the expected lengths of the bond states (bytes per point). Also check the length of the saved
    /// progress.
    fn check_matches(&self, names: &[String], lengths: &[u32], saved: &Saved) -> Result<()> {
        let error = |what: String| Err(Error::run(format!("the checkpoint {what}")));
        let saved_names: Vec<&str> = (saved.columns.iter())
            .map(|column| &column.name[..])
            .collect();
        let names: Vec<&str> = names.iter().map(|name| &name[..]).collect();
        let missing = |names: &[&str], in_all: &[&str]| {
            let mut names = names.iter();
            let found =
                names.find(|name| !name.starts_with(NEWLY_BROKEN_OF) && !in_all.contains(*name));
            found.map(|name| (*name).to_owned())
        };
        if let Some(name) = missing(&names, &saved_names) {
            return error(format!("has no field `{name}`"));
        }
        if let Some(name) = missing(&saved_names, &names) {
            return error(format!(
                "has the field `{name}`, which is not part of this run"
            ));
        }
        if saved.bonds.lengths != lengths {
            return error("is that of other bonds".to_owned());
        }
        let expected = self.progress_without_factors().len();
        let factors = saved.progress.len().checked_sub(expected);
        if factors != Some(0) && factors != Some(self.progress.load_factors.word_count()) {
            return error("has another number of words for the progress of the run".to_owned());
        }
        Ok(())
    }
}
