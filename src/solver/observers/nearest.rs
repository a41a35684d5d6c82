//! The point nearest to a place.

use crate::comm;
use crate::points::distance_squared;
use crate::solver::Simulation;

/// The point of all ranks that is nearest to a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nearest {
    /// Global id.
    pub id: u64,
    /// Reference position, m.
    pub position: [f64; 3],
    /// Distance from the place, m.
    pub distance: f64,
    /// Local index, on the rank that owns it.
    pub own: Option<usize>,
}

/// The point nearest to a place (m); of several, the one with the smallest id. Collective.
pub fn nearest<const D: usize>(simulation: &Simulation<'_, D>, place: [f64; 3]) -> Nearest {
    let (model, comm) = (&simulation.model, simulation.comm);
    let own = (0..model.owned())
        .map(|point| {
            (
                distance_squared(place, model.position(point)),
                model.ids[point],
                point,
            )
        })
        .min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    let mut square = [own.map_or(f64::MAX, |own| own.0)];
    comm::min(comm, &mut square);
    let own = own.filter(|own| own.0 == square[0]);
    let mut id = [own.map_or(f64::MAX, |own| own.1 as f64)];
    comm::min(comm, &mut id);
    let own = own.filter(|own| own.1 as f64 == id[0]).map(|own| own.2);
    let mut position = own.map_or([f64::MIN; 3], |point| model.position(point));
    comm.max(&mut position);
    Nearest {
        id: id[0] as u64,
        position,
        distance: square[0].sqrt(),
        own,
    }
}
