//! The history of a simulation that a test makes step by step.

use fissure::solver::Simulation;
use fissure::solver::observers::{HistoryObserver, HistoryRow, Snapshot};

/// The present row of the history. Collective.
pub fn row<const D: usize>(
    observer: &mut HistoryObserver,
    simulation: &mut Simulation<D>,
) -> HistoryRow {
    let snapshot = Snapshot::new(simulation);
    observer.row(simulation, &snapshot)
}

/// The rows from the present state to the end, one after every step. Collective.
pub fn rows_to_the_end<const D: usize>(
    observer: &mut HistoryObserver,
    simulation: &mut Simulation<D>,
) -> Vec<Vec<f64>> {
    let mut rows = vec![row(observer, simulation).values];
    while !simulation.is_over() {
        simulation.advance();
        rows.push(row(observer, simulation).values);
    }
    rows
}

/// The index of the values of a column in a row.
pub fn column(observer: &HistoryObserver, name: &str) -> usize {
    let mut columns = observer.columns().iter();
    let found = columns.position(|(known, _)| known == name);
    found.unwrap_or_else(|| panic!("no column `{name}` in {:?}", observer.columns()))
}
