//! Which points belong to a named set.

use crate::problem::{Selector, Set};

use super::shape;

/// The share of the horizon by which a point may lie outside a set's shape and still belong to it.
const TOLERANCE: f64 = 1e-9;

/// Whether a point with this id, reference position (m) and body, by index, belongs to the set.
pub fn contains(set: &Set, horizon: f64, id: u64, position: [f64; 3], body: usize) -> bool {
    match &set.selector {
        Selector::All => true,
        Selector::Body(chosen) => body == *chosen,
        Selector::Where(condition) => condition.is_true(position, 0.0),
        Selector::Within(region) => shape::contains(region, position, TOLERANCE * horizon),
        Selector::Ids { ids, .. } => ids.binary_search(&id).is_ok(),
    }
}
