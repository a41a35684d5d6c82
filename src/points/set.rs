//! Membership of points in named sets.

use crate::problem::{Selector, Set};

use super::shape;

/// Tolerance of membership in a shape, as a fraction of the horizon.
const TOLERANCE: f64 = 1e-9;

/// Test whether a point belongs to a set. The point has the given id, reference position (m) and body index.
/// `horizon` is the horizon of the grid, m. The tolerance of membership in a shape is `TOLERANCE` ×
/// `horizon`.
pub fn contains(set: &Set, horizon: f64, id: u64, position: [f64; 3], body: usize) -> bool {
    match &set.selector {
        Selector::All => true,
        Selector::Body(chosen) => body == *chosen,
        Selector::Where(condition) => condition.is_true(position, 0.0),
        Selector::Within(region) => shape::contains(region, position, TOLERANCE * horizon),
        Selector::Ids { ids, .. } => ids.binary_search(&id).is_ok(),
        Selector::Mesh(set) => set.contains(id),
    }
}
