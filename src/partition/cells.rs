//! The cells that are dealt out to ranks: boxes of edge about one horizon.

use crate::comm::{self, Communicator};
use crate::points::Point;
use crate::points::bins::boxes;

/// A grid of cells over all points, the same on all ranks. Points within the cut-off of one another
/// lie in the same cell or in adjacent ones.
#[derive(Debug, Clone)]
pub struct Cells {
    lower: [f64; 3],
    edge: f64,
    counts: [usize; 3],
}

impl Cells {
    /// The grid for all points of all ranks and a cut-off in m.
    pub fn new(comm: &dyn Communicator, points: &[Point], total: u64, cutoff: f64) -> Self {
        let mut lower = [f64::MAX; 3];
        let mut upper = [f64::MIN; 3];
        for point in points {
            for k in 0..3 {
                lower[k] = lower[k].min(point.position[k]);
                upper[k] = upper[k].max(point.position[k]);
            }
        }
        comm::min(comm, &mut lower);
        comm.max(&mut upper);
        let (edge, counts) = boxes(lower, upper, cutoff, total as usize);
        Self {
            lower,
            edge,
            counts,
        }
    }

    /// Number of cells.
    pub fn count(&self) -> usize {
        self.counts.iter().product()
    }

    /// The cell that holds a position (m).
    pub fn of(&self, position: [f64; 3]) -> usize {
        let coordinate = |k: usize| {
            let offset = ((position[k] - self.lower[k]) / self.edge) as usize;
            offset.min(self.counts[k] - 1)
        };
        coordinate(0) + self.counts[0] * (coordinate(1) + self.counts[1] * coordinate(2))
    }

    /// The adjacent cells, across corners and edges too, with the number of directions (1 to 3) in
    /// which each is displaced.
    pub fn adjacent(&self, cell: usize) -> impl Iterator<Item = (usize, u32)> + '_ {
        let [nx, ny, nz] = self.counts;
        let here = [cell % nx, cell / nx % ny, cell / nx / ny];
        let counts = [nx, ny, nz];
        (0..27).filter_map(move |code| {
            let offset = [code % 3, code / 3 % 3, code / 9];
            let displaced = offset.iter().filter(|o| **o != 1).count() as u32;
            let mut there = [0; 3];
            for k in 0..3 {
                // Offsets 0, 1, 2 mean −1, 0, +1.
                there[k] = (here[k] + offset[k]).checked_sub(1)?;
                if there[k] >= counts[k] {
                    return None;
                }
            }
            let index = there[0] + nx * (there[1] + ny * there[2]);
            (displaced > 0).then_some((index, displaced))
        })
    }

    /// Number of points in each cell, over all ranks.
    pub fn occupation(&self, comm: &dyn Communicator, points: &[Point]) -> Vec<u64> {
        let mut occupation = vec![0; self.count()];
        for point in points {
            occupation[self.of(point.position)] += 1;
        }
        comm.sum(&mut occupation);
        occupation
    }
}
