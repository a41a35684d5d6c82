//! Number and bounding box of the cracked points: points whose damage exceeds the `damage_threshold` of the
//! history.

use crate::comm::{self, Communicator};
use crate::solver::Simulation;

use super::snapshot::Snapshot;

/// The cracked points of a rank.
pub struct Cracked {
    /// Number of cracked points.
    pub points: u64,
    lower: [f64; 3],
    upper: [f64; 3],
}

impl Cracked {
    /// Find the cracked points of this rank at the time of the snapshot.
    pub fn new<const D: usize>(simulation: &Simulation<'_, D>, snapshot: &Snapshot) -> Self {
        let mut cracked = Self {
            points: 0,
            lower: [f64::MAX; 3],
            upper: [f64::MIN; 3],
        };
        let threshold = simulation.problem.history.damage_threshold;
        for point in 0..simulation.model.owned() {
            if snapshot.damage(&simulation.undeformed.family_volume, point) > threshold {
                let position = simulation.model.position(point);
                cracked.points += 1;
                for d in 0..3 {
                    cracked.lower[d] = cracked.lower[d].min(position[d]);
                    cracked.upper[d] = cracked.upper[d].max(position[d]);
                }
            }
        }
        cracked
    }

    /// Lower and upper corner (m) of the bounding box of all cracked points, over all ranks. The box uses the
    /// reference positions. The corners are NaN if there are no cracked points. Collective.
    pub fn extent(mut self, comm: &dyn Communicator) -> ([f64; 3], [f64; 3]) {
        comm::min(comm, &mut self.lower);
        comm.max(&mut self.upper);
        if self.lower[0] > self.upper[0] {
            return ([f64::NAN; 3], [f64::NAN; 3]);
        }
        (self.lower, self.upper)
    }
}
