//! Search for the point nearest to a position.

use crate::comm::{Found, least};
use crate::points::distance_squared;
use crate::solver::Simulation;

/// The point nearest to a position, over all ranks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nearest {
    /// Global id.
    pub id: u64,
    /// Reference position, m.
    pub position: [f64; 3],
    /// Distance from the given position, m.
    pub distance: f64,
    /// Local index on the rank that owns the point; `None` on other ranks.
    pub own: Option<usize>,
}

/// Find the point nearest to a position (m); among equally near points, the one with the smallest id.
/// Collective.
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
    let found = own.map(|(square, id, point)| Found {
        key: square,
        ids: [id],
        payload: model.position(point),
    });
    let Found {
        key: square,
        ids: [id],
        payload: position,
    } = least(comm, found).expect("a run has points");
    Nearest {
        id,
        position,
        distance: square.sqrt(),
        own: own.filter(|own| own.1 == id).map(|own| own.2),
    }
}
