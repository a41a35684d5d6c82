//! The local points of a rank (owned points first, then ghosts) and the halo plan.

use crate::comm::Halo;
use crate::points::Point;

/// The local points of a rank, in the order of local indices:
///
/// 1. interior points, which have no bonds to ghosts, sorted by partition cell, by box in the cell, and by
///    id;
/// 2. border points, sorted in the same way;
/// 3. ghosts, grouped by owner and sorted by id.
///
/// [`Domain::reorder`] changes the order of the owned points.
#[derive(Debug, Default)]
pub struct Domain {
    /// The local points: owned points, then ghosts.
    pub points: Vec<Point>,
    /// Number of interior points.
    pub interior: usize,
    /// Number of owned points.
    pub owned: usize,
    /// Number of points over all ranks.
    pub total: u64,
    /// Extent of the points of all ranks per direction, m.
    pub extent: [f64; 3],
    /// Plan of the exchange between ghosts and their owners.
    pub halo: Halo,
}

impl Domain {
    /// Permute the owned points. `order[new]` is the old local index of the point with local index `new`.
    /// After this, the first `interior` points are interior points.
    pub fn reorder(&mut self, order: &[u32], interior: usize) {
        let mut new_index = vec![0; order.len()];
        for (new, old) in (0..).zip(order) {
            new_index[*old as usize] = new;
        }
        self.halo.renumber(&new_index);
        // The permutation is applied in place, because a copy of all points would raise the peak memory.
        for k in 0..new_index.len() {
            while new_index[k] as usize != k {
                let other = new_index[k] as usize;
                self.points.swap(k, other);
                new_index.swap(k, other);
            }
        }
        self.interior = interior;
    }
}
