//! Graph partitioning of the cells with METIS. No other file uses `metis`.

use std::collections::HashMap;

use crate::error::{Error, Result};

use super::cells::{Cells, Loads};

/// Upper limit of the total weight. METIS sums weights in 32-bit integers.
const LARGEST_TOTAL: f64 = (1_i64 << 30) as f64;

/// Additional factor on the weight of graph edges between cells at different x positions. Cuts between such
/// cells are costly, because they cut lane groups, which lie along x.
const ALONG_X: f64 = 1.5;

/// Owner of cells without points.
pub const NO_OWNER: u32 = u32::MAX;

/// Number of cells per part below which recursive bisection is used. With so few cells, the k-way method
/// would leave parts empty.
const FEW_CELLS_PER_PART: usize = 30;

/// Partition the cells. Return the rank of each cell, or [`NO_OWNER`] for cells without points. If the number
/// of cells with points is at most the number of ranks, each of these cells gets its own rank.
///
/// - `occupation` is the number of points in each cell.
/// - The weight of a cell is proportional to the estimated number of bonds of its points. The weight of a
///   graph edge is proportional to the estimated number of bonds between its two cells. If these cells have
///   different x positions, the weight of the edge is multiplied by `ALONG_X`.
/// - With measured loads, the weight of a cell is multiplied by the time per bond of the present owner of the
///   cell. The time per bond is the measured time of the owner, divided by the estimated number of its bonds.
///   Parts are numbered so that few points migrate.
///
/// # Errors
/// If METIS fails.
pub fn partition(
    cells: &Cells,
    occupation: &[u64],
    loads: Option<&Loads>,
    ranks: usize,
) -> Result<Vec<u32>> {
    let occupied: Vec<usize> = (0..cells.count())
        .filter(|cell| occupation[*cell] > 0)
        .collect();
    let mut owner = vec![NO_OWNER; cells.count()];
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
        let count = occupation[*cell] as f64;
        let mut sum = count * count;
        for (other, displaced) in cells.adjacent(*cell) {
            if occupation[other] == 0 {
                continue;
            }
            // The fraction of point pairs with bonds is smaller for cells that are displaced in several
            // directions.
            let directions = displaced.iter().filter(|displaced| **displaced).count();
            let across = count * occupation[other] as f64 * 0.4_f64.powi(directions as i32);
            sum += across;
            neighbours.push(vertex[other] as metis::Idx);
            bonds_across.push(across * if displaced[0] { ALONG_X } else { 1.0 });
        }
        bonds.push(sum);
        starts.push(neighbours.len() as metis::Idx);
    }
    if let Some(loads) = loads {
        weight_by_time(&mut bonds, &occupied, loads);
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
    if let Some(loads) = loads {
        let current = |k: usize| (loads.owners[occupied[k]] as usize, occupation[occupied[k]]);
        renumber(&mut part, ranks, current);
    }
    for (cell, rank) in occupied.iter().zip(part) {
        owner[*cell] = rank as u32;
    }
    Ok(owner)
}

/// Multiply the estimated number of bonds of each occupied cell by a relative time per bond. The time per
/// bond of a rank is the measured time of the rank, divided by its estimated number of bonds. The relative
/// time is the time per bond of the present owner of the cell, divided by the mean time per bond.
fn weight_by_time(bonds: &mut [f64], occupied: &[usize], loads: &Loads) {
    let rank_of = |cell: usize| loads.owners[cell] as usize;
    let mut sums = vec![0.0; loads.times.len()];
    for (bonds, cell) in bonds.iter().zip(occupied) {
        sums[rank_of(*cell)] += bonds;
    }
    // A time of 0 would give weights of 0.
    let time = |rank: usize| loads.times[rank].max(1) as f64;
    let mean = (0..sums.len()).map(time).sum::<f64>() / sums.iter().sum::<f64>();
    for (bonds, cell) in bonds.iter_mut().zip(occupied) {
        let rank = rank_of(*cell);
        *bonds *= time(rank) / sums[rank] / mean;
    }
}

/// Renumber parts so that few points migrate. `current(k)` returns the present rank and the number of points
/// of the cell with index k in `part`.
fn renumber(part: &mut [metis::Idx], ranks: usize, current: impl Fn(usize) -> (usize, u64)) {
    let mut shared: HashMap<(usize, usize), u64> = HashMap::new();
    for (k, part) in part.iter().enumerate() {
        let (rank, points) = current(k);
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

/// Convert weights to positive integers whose sum is at most [`LARGEST_TOTAL`].
fn to_integers(weights: &[f64]) -> Vec<metis::Idx> {
    let total: f64 = weights.iter().sum();
    let room = LARGEST_TOTAL - weights.len() as f64;
    let scale = (room / total).min(1.0);
    weights
        .iter()
        .map(|weight| (weight * scale).max(1.0) as metis::Idx)
        .collect()
}

/// For each empty part, move one cell from the largest part to the empty part.
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

    /// 100 × 40 points on one rank, and their cells.
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

        fn partition(&self, loads: Option<&Loads>, ranks: usize) -> Vec<u32> {
            partition(&self.cells, &self.occupation, loads, ranks).unwrap()
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
            let sizes = plate.sizes(&plate.partition(None, ranks), ranks);
            let largest = *sizes.iter().max().unwrap() as usize;
            assert!(sizes.iter().all(|size| *size > 0), "{ranks}: {sizes:?}");
            assert!(largest <= 3 * 4000 / ranks / 2 + 20, "{ranks}: {sizes:?}");
        }
    }

    #[test]
    fn a_rank_with_costly_cells_gets_fewer_and_few_cells_move() {
        let plate = Plate::new();
        let first = plate.partition(None, 2);
        let mut loads = Loads {
            times: vec![1000; 2],
            // Swap the owners.
            owners: first.iter().map(|rank| f64::from(1 - *rank)).collect(),
        };
        let same = plate.partition(Some(&loads), 2);
        let pairs = first.iter().zip(&same);
        let moved = pairs.filter(|(a, b)| **a != 1 - **b).count();
        let all = plate.cells.count();
        assert!(moved < all / 5, "{moved} of {all} cells");
        loads.times[0] *= 3;
        let sizes = plate.sizes(&plate.partition(Some(&loads), 2), 2);
        let ratio = f64::from(sizes[1]) / f64::from(sizes[0]);
        assert!((1.5..3.5).contains(&ratio), "{sizes:?}");
    }

    /// Points in a dense region have more bonds, and therefore take more time. The weights must not count
    /// the density twice: once in the number of bonds, and again in the time. In this test, both ranks take
    /// the same time, so few cells must move.
    #[test]
    fn dense_regions_count_once() {
        let mut plate = Plate::new();
        let dense = plate.points.clone().into_iter();
        let dense = dense.filter(|point| point.position[0] < 50.0);
        for (k, mut point) in dense.enumerate() {
            point.id = 4000 + k as u64;
            point.position[1] += 0.5;
            plate.points.push(point);
        }
        plate.occupation = plate.cells.occupation(&threads::alone(), &plate.points);
        let first = plate.partition(None, 2);
        let sizes = plate.sizes(&first, 2);
        assert!(sizes[0].abs_diff(sizes[1]) > 500, "{sizes:?}");
        let loads = Loads {
            times: vec![1000; 2],
            owners: first.iter().map(|rank| f64::from(*rank)).collect(),
        };
        let second = plate.partition(Some(&loads), 2);
        let moved = first.iter().zip(&second).filter(|(a, b)| a != b).count();
        assert!(moved < first.len() / 20, "{moved} of {} cells", first.len());
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
