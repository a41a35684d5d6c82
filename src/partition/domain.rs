//! The points of one rank: owned ones first, then the ghosts, and the halo plan between ranks.

use crate::comm::Halo;
use crate::points::Point;

/// The points that a rank works with. Local index order: interior points (no bond leads to a ghost),
/// border points, then ghosts grouped by owner and sorted by id. Both kinds of owned points are
/// sorted by cell, then id.
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
    /// The halo plan.
    pub halo: Halo,
}
