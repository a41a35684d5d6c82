//! The points of one rank: owned ones first, then the ghosts, and the halo plan between ranks.

use crate::comm::Halo;
use crate::points::Point;

/// The points that a rank works with. Local index order: interior points (no bond leads to a ghost),
/// border points, then ghosts grouped by owner and sorted by id. Both kinds of owned points are
/// sorted by cell, by box within it, then by id.
#[derive(Debug, Default)]
pub struct Domain {
    /// All local points.
    pub points: Vec<Point>,
    /// Number of interior points.
    pub interior: usize,
    /// Number of owned points.
    pub owned: usize,
    /// Number of points over all ranks.
    pub total: u64,
    /// How far the points of all ranks are apart at most, by direction, m.
    pub extent: [f64; 3],
    /// The halo plan.
    pub halo: Halo,
}

impl Domain {
    /// Puts the owned points into another order, of which the first `interior` are interior points;
    /// `order` has the present local index of each.
    pub fn reorder(&mut self, order: &[u32], interior: usize) {
        let mut place = vec![0; order.len()];
        for (new, old) in (0..).zip(order) {
            place[*old as usize] = new;
        }
        self.halo.renumber(&place);
        // In place: a copy of all points would be the most that is ever alive.
        for k in 0..place.len() {
            while place[k] as usize != k {
                let other = place[k] as usize;
                self.points.swap(k, other);
                place.swap(k, other);
            }
        }
        self.interior = interior;
    }
}
