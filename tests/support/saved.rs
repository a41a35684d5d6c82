//! Saved states of a run, joined over its ranks.

use fissure::comm::IdOrder;
use fissure::solver::Simulation;
use fissure::solver::motion::Saved;

/// Return the order of the ids, and the saved state of this rank's part of the points in this order.
pub fn state<const D: usize>(simulation: &Simulation<D>) -> (IdOrder, Saved) {
    let owned = simulation.model.owned();
    let (ids, total) = (&simulation.model.ids[..owned], simulation.model.total);
    let order = IdOrder::new(simulation.comm, ids, total);
    let saved = simulation.save(&order);
    (order, saved)
}

/// Join the parts of all ranks to bits of values, bytes of bonds, and progress counters.
pub fn whole(parts: Vec<Saved>) -> (Vec<u64>, Vec<u8>, Vec<u64>) {
    let column = |k: usize| parts.iter().flat_map(move |part| &part.columns[k].values);
    let values = (0..parts[0].columns.len()).flat_map(column);
    let values = values.map(|value| value.to_bits()).collect();
    let bonds = parts
        .iter()
        .flat_map(|part| part.bonds.bytes.clone())
        .collect();
    (values, bonds, parts[0].progress.clone())
}
