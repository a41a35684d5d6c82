//! The cells that are partitioned between ranks. Their edges are at least as long as the longest bond.

use crate::comm::{self, Communicator};
use crate::points::Point;
use crate::points::bins::boxes;

/// This number of cells is allowed on any number of ranks.
const ALWAYS_ALLOWED: usize = 100_000;

/// Sufficient number of cells per rank: with more cells, the borders between ranks do not get smoother.
const SUFFICIENT_PER_RANK: usize = 2000;

/// Above this total number of cells, the number of cells per rank is reduced. The reason: one rank partitions
/// all cells, and every rank stores the owners of all cells.
const LARGE_TOTAL: usize = 4_000_000;

/// Minimum number of cells per rank for a balanced partition.
const MIN_PER_RANK: usize = 64;

/// The maximum number of cells for a number of ranks.
pub fn max_cells(ranks: usize) -> usize {
    ALWAYS_ALLOWED
        .max(SUFFICIENT_PER_RANK * ranks)
        .min(LARGE_TOTAL.max(MIN_PER_RANK * ranks))
}

/// A grid of cells over the points of all ranks. Every rank has the same grid. Points closer than the cutoff
/// lie in the same cell or in adjacent cells. A cell consists of equal boxes.
#[derive(Debug, Clone)]
pub struct Cells {
    lower: [f64; 3],
    upper: [f64; 3],
    /// Edge of a box, at least the cutoff, m.
    edge: f64,
    /// Number of boxes per cell edge.
    boxes: usize,
    /// Number of cells per direction.
    counts: [usize; 3],
}

/// State before a rebalance: the computing time of each rank, and the owner of each cell.
pub struct Loads {
    /// Measured computing time of each rank, ns.
    pub times: Vec<u64>,
    /// For each cell, the highest rank that owns points in the cell; −1 if the cell has no points.
    pub owners: Vec<f64>,
}

impl Cells {
    /// Build the grid for the points of all ranks and a cutoff (m), with at most `most` cells. `points` are
    /// this rank's points, and `total` is the number of points of all ranks. Collective.
    pub fn new(
        comm: &dyn Communicator,
        points: &[Point],
        total: u64,
        cutoff: f64,
        most: usize,
    ) -> Self {
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
        let cells = |boxes: usize| counts.map(|count| count.div_ceil(boxes));
        let boxes = (1..).find(|boxes| cells(*boxes).iter().product::<usize>() <= most);
        let boxes = boxes.expect("one cell is few enough");
        Self {
            lower,
            upper,
            edge,
            boxes,
            counts: cells(boxes),
        }
    }

    /// Extent of the points per direction, m.
    pub fn extent(&self) -> [f64; 3] {
        std::array::from_fn(|k| (self.upper[k] - self.lower[k]).max(0.0))
    }

    /// Number of cells.
    pub fn count(&self) -> usize {
        self.counts.iter().product()
    }

    /// The box of a position (m), clamped to the grid.
    fn box_of(&self, position: [f64; 3]) -> [usize; 3] {
        std::array::from_fn(|k| {
            let offset = ((position[k] - self.lower[k]) / self.edge) as usize;
            offset.min(self.counts[k] * self.boxes - 1)
        })
    }

    /// The cell that contains a position (m).
    pub fn of(&self, position: [f64; 3]) -> usize {
        let [x, y, z] = self.box_of(position).map(|at| at / self.boxes);
        x + self.counts[0] * (y + self.counts[1] * z)
    }

    /// Sort key of a position (m): cell first, then box. After points are sorted by this key, points that are
    /// close in space are close in memory.
    pub fn order(&self, position: [f64; 3]) -> u64 {
        let [x, y, z] = self.box_of(position).map(|at| at % self.boxes);
        let within = x + self.boxes * (y + self.boxes * z);
        (self.of(position) * self.boxes.pow(3) + within) as u64
    }

    /// The cells that share a face, an edge or a corner with `cell`. Each item is the index of such a cell
    /// and three flags, one for each of the directions x, y and z. A flag is true if the cell with this index
    /// is displaced from `cell` along the direction.
    pub fn adjacent(&self, cell: usize) -> impl Iterator<Item = (usize, [bool; 3])> + '_ {
        let [nx, ny, nz] = self.counts;
        let position = [cell % nx, cell / nx % ny, cell / nx / ny];
        let counts = [nx, ny, nz];
        (0..27).filter_map(move |code| {
            let offset = [code % 3, code / 3 % 3, code / 9];
            let displaced = offset.map(|steps| steps != 1);
            let mut other = [0; 3];
            for k in 0..3 {
                // The offsets 0, 1, 2 stand for −1, 0, +1.
                other[k] = (position[k] + offset[k]).checked_sub(1)?;
                if other[k] >= counts[k] {
                    return None;
                }
            }
            let index = other[0] + nx * (other[1] + ny * other[2]);
            displaced.contains(&true).then_some((index, displaced))
        })
    }

    /// Number of points of all ranks in each cell. Collective.
    pub fn occupation(&self, comm: &dyn Communicator, points: &[Point]) -> Vec<u64> {
        let mut occupation = vec![0; self.count()];
        for point in points {
            occupation[self.of(point.position)] += 1;
        }
        comm.sum(&mut occupation);
        occupation
    }

    /// The computing time of each rank, and the present owner of each cell. `time` is the computing time of
    /// this rank, ns. Collective.
    pub fn loads(&self, comm: &dyn Communicator, points: &[Point], time: u64) -> Loads {
        let mut owners = vec![-1.0; self.count()];
        for point in points {
            owners[self.of(point.position)] = comm.rank() as f64;
        }
        comm.max(&mut owners);
        Loads {
            times: comm::all_gather(comm, time),
            owners,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_number_of_cells() {
        assert_eq!(max_cells(1), 100_000);
        assert_eq!(max_cells(1000), 2_000_000);
        assert_eq!(max_cells(20_000), 4_000_000);
        assert_eq!(max_cells(100_000), 6_400_000);
    }
}
