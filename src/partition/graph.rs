//! Dealing out cells to ranks with METIS. The only file that names `metis`.

use std::collections::HashMap;

use crate::error::{Error, Result};

use super::cells::{Cells, Present};

/// METIS adds up weights in 32 bits.
const LARGEST_TOTAL: f64 = (1_i64 << 30) as f64;

/// What cutting bonds along x counts more than cutting others: points that are adjacent along x are
/// worked on together.
const ALONG_X: f64 = 1.5;

/// The rank of cells without points.
pub const NOBODY: u32 = u32::MAX;

/// Below this many cells a part recursive bisection is used: the k-way method leaves parts empty.
const FEW_CELLS_PER_PART: usize = 30;

/// The rank of each cell, [`NOBODY`] where there is no point, given the number of points in each. A cell's
/// weight is the bonds of its points, an edge's weight the bonds across. Where it is known what the cells
/// cost, their weights are corrected by that, and parts are numbered so that most points stay on their
/// ranks.
///
/// # Errors
/// When METIS fails.
pub fn partition(
    cells: &Cells,
    occupation: &[u64],
    present: Option<&Present>,
    ranks: usize,
) -> Result<Vec<u32>> {
    let occupied: Vec<usize> = (0..cells.count())
        .filter(|cell| occupation[*cell] > 0)
        .collect();
    let mut owner = vec![NOBODY; cells.count()];
    if occupied.len() <= ranks {
        for (rank, cell) in occupied.iter().enumerate() {
            owner[*cell] = rank as u32;
        }
        return Ok(owner);
    }
    let mut vertex = vec![u32::MAX; cells.count()];
    for (k, cell) in occupied.iter().enumerate() {
        vertex[*cell] = k as u32;
    }
    let mut starts = vec![0];
    let mut neighbours = Vec::new();
    let mut bonds_across = Vec::new();
    let mut bonds = Vec::with_capacity(occupied.len());
    for cell in &occupied {
        let here = occupation[*cell] as f64;
        let mut sum = here * here;
        for (other, displaced) in cells.adjacent(*cell) {
            if occupation[other] == 0 {
                continue;
            }
            // A random pair of points in adjacent cells is bonded the more rarely, the more
            // directions lie between them.
            let directions = displaced.iter().filter(|displaced| **displaced).count();
            let across = here * occupation[other] as f64 * 0.4_f64.powi(directions as i32);
            sum += across;
            neighbours.push(vertex[other] as metis::Idx);
            bonds_across.push(across * if displaced[0] { ALONG_X } else { 1.0 });
        }
        let cost = present.map_or(1.0, |known| known.costs[*cell] as f64 / here);
        bonds.push(sum * cost);
        starts.push(neighbours.len() as metis::Idx);
    }
    let vertex_weights = to_integers(&bonds);
    let edge_weights = to_integers(&bonds_across);
    let mut part = vec![0; occupied.len()];
    let failed = |error: &dyn std::fmt::Display| Error::run(format!("METIS failed: {error}"));
    let graph = metis::Graph::new(1, ranks as metis::Idx, &starts, &neighbours)
        .map_err(|error| failed(&error))?
        .set_vwgt(&vertex_weights)
        .set_adjwgt(&edge_weights)
        .set_option(metis::option::Seed(1));
    let cut = if occupied.len() < FEW_CELLS_PER_PART * ranks {
        graph.part_recursive(&mut part)
    } else {
        graph.part_kway(&mut part)
    };
    cut.map_err(|error| failed(&error))?;
    fill_empty_parts(&mut part, ranks);
    if let Some(present) = present {
        let now = |k: usize| (present.ranks[occupied[k]] as usize, occupation[occupied[k]]);
        renumber(&mut part, ranks, now);
    }
    for (cell, rank) in occupied.iter().zip(part) {
        owner[*cell] = rank as u32;
    }
    Ok(owner)
}

/// LaneTuple parts so that much stays where it is: `now` has the rank and the number of points of each cell.
fn renumber(part: &mut [metis::Idx], ranks: usize, now: impl Fn(usize) -> (usize, u64)) {
    let mut shared: HashMap<(usize, usize), u64> = HashMap::new();
    for (k, part) in part.iter().enumerate() {
        let (rank, points) = now(k);
        *shared.entry((*part as usize, rank)).or_default() += points;
    }
    let mut largest: Vec<(u64, usize, usize)> = shared
        .into_iter()
        .map(|((part, rank), points)| (points, part, rank))
        .collect();
    largest.sort_unstable_by(|a, b| b.cmp(a));
    let (mut number, mut taken) = (vec![None; ranks], vec![false; ranks]);
    for (_, part, rank) in largest {
        if number[part].is_none() && !taken[rank] {
            number[part] = Some(rank);
            taken[rank] = true;
        }
    }
    let mut free = (0..ranks).filter(|rank| !taken[*rank]);
    let number: Vec<usize> = number
        .into_iter()
        .map(|number| {
            number
                .or_else(|| free.next())
                .expect("as many ranks as parts")
        })
        .collect();
    for part in part {
        *part = number[*part as usize] as metis::Idx;
    }
}

/// Weights as positive integers whose sum METIS can hold.
fn to_integers(weights: &[f64]) -> Vec<metis::Idx> {
    let total: f64 = weights.iter().sum();
    let room = LARGEST_TOTAL - weights.len() as f64;
    let scale = (room / total).min(1.0);
    weights
        .iter()
        .map(|weight| (weight * scale).max(1.0) as metis::Idx)
        .collect()
}

/// Gives each empty part a cell of the part that has most.
fn fill_empty_parts(part: &mut [metis::Idx], ranks: usize) {
    let mut sizes = vec![0_usize; ranks];
    for rank in part.iter() {
        sizes[*rank as usize] += 1;
    }
    for empty in 0..ranks {
        if sizes[empty] > 0 {
            continue;
        }
        let largest = (0..ranks).max_by_key(|rank| sizes[*rank]).unwrap_or(0);
        if sizes[largest] < 2 {
            return;
        }
        let cell = part.iter().rposition(|rank| *rank as usize == largest);
        part[cell.expect("the largest part has cells")] = empty as metis::Idx;
        sizes[largest] -= 1;
        sizes[empty] += 1;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comm::threads;
    use crate::points::Point;

    /// 100 × 40 points and their cells, of one rank.
    struct Plate {
        points: Vec<Point>,
        cells: Cells,
        occupation: Vec<u64>,
    }

    impl Plate {
        fn new() -> Self {
            let points: Vec<Point> = (0..4000)
                .map(|k| Point::new(k, [(k % 100) as f64, (k / 100) as f64, 0.0], 1.0, 0))
                .collect();
            let comm = threads::alone();
            let cells = Cells::new(&comm, &points, 4000, 3.0, 4000);
            Self {
                occupation: cells.occupation(&comm, &points),
                points,
                cells,
            }
        }

        fn deal(&self, present: Option<&Present>, ranks: usize) -> Vec<u32> {
            partition(&self.cells, &self.occupation, present, ranks).unwrap()
        }

        /// Number of points by rank.
        fn sizes(&self, owner: &[u32], ranks: usize) -> Vec<u32> {
            let mut sizes = vec![0; ranks];
            for point in &self.points {
                sizes[owner[self.cells.of(point.position)] as usize] += 1;
            }
            sizes
        }
    }

    #[test]
    fn parts_are_balanced_and_none_is_empty() {
        let plate = Plate::new();
        for ranks in [2, 3, 4, 7, 64] {
            let sizes = plate.sizes(&plate.deal(None, ranks), ranks);
            let largest = *sizes.iter().max().unwrap() as usize;
            assert!(sizes.iter().all(|size| *size > 0), "{ranks}: {sizes:?}");
            assert!(largest <= 3 * 4000 / ranks / 2 + 20, "{ranks}: {sizes:?}");
        }
    }

    #[test]
    fn cells_that_cost_more_are_fewer_and_most_stay() {
        let plate = Plate::new();
        let mut present = plate.cells.present(&threads::alone(), &plate.points, 10);
        let first = plate.deal(None, 2);
        for (rank, owner) in present.ranks.iter_mut().zip(&first) {
            // Those of the other part.
            *rank = f64::from(1 - *owner);
        }
        let same = plate.deal(Some(&present), 2);
        let pairs = first.iter().zip(&same);
        let moved = pairs.filter(|(a, b)| **a != 1 - **b).count();
        let all = plate.cells.count();
        assert!(moved < all / 5, "{moved} of {all} cells");
        for (cost, rank) in present.costs.iter_mut().zip(&present.ranks) {
            *cost *= if *rank == 0.0 { 3 } else { 1 };
        }
        let sizes = plate.sizes(&plate.deal(Some(&present), 2), 2);
        let ratio = f64::from(sizes[1]) / f64::from(sizes[0]);
        assert!((1.5..3.5).contains(&ratio), "{sizes:?}");
    }

    #[test]
    fn fewer_cells_than_ranks_leave_ranks_empty() {
        let points = [
            Point::new(0, [0.0; 3], 1.0, 0),
            Point::new(1, [9.0, 0.0, 0.0], 1.0, 0),
        ];
        let comm = threads::alone();
        let cells = Cells::new(&comm, &points, 2, 1.0, 100);
        let occupation = cells.occupation(&comm, &points);
        let owner = partition(&cells, &occupation, None, 4).unwrap();
        assert_ne!(owner[cells.of([0.0; 3])], owner[cells.of([9.0, 0.0, 0.0])]);
    }
}
