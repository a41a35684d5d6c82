//! History of a simulation that a test advances step by step.

use fissure::solver::Simulation;
use fissure::solver::observers::{HistoryObserver, HistoryRow, Snapshot};

/// Return the current row of the history. Collective.
pub fn row<const D: usize>(
    observer: &mut HistoryObserver,
    simulation: &mut Simulation<D>,
) -> HistoryRow {
    let snapshot = Snapshot::new(simulation);
    observer.row(simulation, &snapshot)
}

/// Advance to the end, and return the row of the current state and of each step. Collective.
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

/// Return the index of a column in the rows.
pub fn column(observer: &HistoryObserver, name: &str) -> usize {
    let mut columns = observer.columns().iter();
    let found = columns.position(|(known, _)| known == name);
    found.unwrap_or_else(|| panic!("no column `{name}` in {:?}", observer.columns()))
}
