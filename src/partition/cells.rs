//! The cells that are dealt out to ranks: boxes of an edge of one horizon or some.

use crate::comm::{self, Communicator};
use crate::points::Point;
use crate::points::bins::boxes;

/// Up to so many cells need no thought.
const FEW: usize = 100_000;

/// More cells for each rank make its border no smoother.
const ENOUGH_A_RANK: usize = 2000;

/// Every rank knows the owner of every cell, and one rank deals them out alone: from this many cells
/// on, ranks get fewer.
const MANY: usize = 4_000_000;

/// The fewest cells of a rank that still can be dealt out evenly.
const FEWEST_A_RANK: usize = 64;

/// The largest number of cells for so many ranks.
pub fn most_cells(ranks: usize) -> usize {
    FEW.max(ENOUGH_A_RANK * ranks)
        .min(MANY.max(FEWEST_A_RANK * ranks))
}

/// A grid of cells over all points, the same on all ranks. Points within the cut-off of one another
/// lie in the same cell or in adjacent ones.
#[derive(Debug, Clone)]
pub struct Cells {
    lower: [f64; 3],
    upper: [f64; 3],
    /// Edge of a box, about the cut-off, m.
    edge: f64,
    /// Number of boxes along the edge of a cell.
    boxes: usize,
    counts: [usize; 3],
}

/// What cells are before they are dealt out anew.
pub struct Present {
    /// Time that their points take, ns.
    pub costs: Vec<u64>,
    /// A rank that has points of each, −1 where there are none.
    pub ranks: Vec<f64>,
}

impl Cells {
    /// The grid for all points of all ranks and a cut-off in m, with so many cells at `most`.
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

    /// How far the points are apart at most, by direction, m.
    pub fn extent(&self) -> [f64; 3] {
        std::array::from_fn(|k| (self.upper[k] - self.lower[k]).max(0.0))
    }

    /// Number of cells.
    pub fn count(&self) -> usize {
        self.counts.iter().product()
    }

    /// The box of a position (m) by direction, within the cells.
    fn place(&self, position: [f64; 3]) -> [usize; 3] {
        std::array::from_fn(|k| {
            let offset = ((position[k] - self.lower[k]) / self.edge) as usize;
            offset.min(self.counts[k] * self.boxes - 1)
        })
    }

    /// The cell that holds a position (m).
    pub fn of(&self, position: [f64; 3]) -> usize {
        let [x, y, z] = self.place(position).map(|at| at / self.boxes);
        x + self.counts[0] * (y + self.counts[1] * z)
    }

    /// A number that puts positions (m) in the order of cells, and those of a cell in that of its
    /// boxes, so that what is near lies near in memory.
    pub fn order(&self, position: [f64; 3]) -> u64 {
        let [x, y, z] = self.place(position).map(|at| at % self.boxes);
        let within = x + self.boxes * (y + self.boxes * z);
        (self.of(position) * self.boxes.pow(3) + within) as u64
    }

    /// The adjacent cells, across corners and edges too, with whether each is displaced in each
    /// direction.
    pub fn adjacent(&self, cell: usize) -> impl Iterator<Item = (usize, [bool; 3])> + '_ {
        let [nx, ny, nz] = self.counts;
        let here = [cell % nx, cell / nx % ny, cell / nx / ny];
        let counts = [nx, ny, nz];
        (0..27).filter_map(move |code| {
            let offset = [code % 3, code / 3 % 3, code / 9];
            let displaced = offset.map(|steps| steps != 1);
            let mut there = [0; 3];
            for k in 0..3 {
                // Offsets 0, 1, 2 mean −1, 0, +1.
                there[k] = (here[k] + offset[k]).checked_sub(1)?;
                if there[k] >= counts[k] {
                    return None;
                }
            }
            let index = there[0] + nx * (there[1] + ny * there[2]);
            displaced.contains(&true).then_some((index, displaced))
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

    /// Costs of the cells and where they are now, from this rank's points and what each of them costs.
    /// Collective.
    pub fn present(&self, comm: &dyn Communicator, points: &[Point], each: u64) -> Present {
        let mut costs = vec![0; self.count()];
        let mut ranks = vec![-1.0; self.count()];
        for point in points {
            let cell = self.of(point.position);
            costs[cell] += each;
            ranks[cell] = comm.rank() as f64;
        }
        comm.sum(&mut costs);
        comm.max(&mut ranks);
        Present { costs, ranks }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_for_few_and_for_many_ranks() {
        assert_eq!(most_cells(1), 100_000);
        assert_eq!(most_cells(1000), 2_000_000);
        assert_eq!(most_cells(20_000), 4_000_000);
        assert_eq!(most_cells(100_000), 6_400_000);
    }
}
