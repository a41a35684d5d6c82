//! Points in lattice cells, made in pieces: one at the centre of each, or at the places of the Gauss
//! rule, ±√3/3 of half the edge by direction (Emmrich & Weckner 2006, §4).

use crate::comm::{Communicator, agree};
use crate::deck::plan::{Plan, PointSource, Quadrature, Shape};
use crate::error::{Error, Result};

use super::{Point, shape};

/// The share of a cell's edge by which a point may lie outside a shape and still count as within.
const TOLERANCE: f64 = 1e-9;

/// Binary logarithm of the cells that one rank goes through; some minutes' worth.
const CELLS_A_RANK: u32 = 33;

/// The cells that a shape can touch: the first cell's index and the number of cells, by direction.
struct Range {
    first: [i64; 3],
    counts: [u64; 3],
}

impl Range {
    fn new(shape: &Shape, spacing: [f64; 3], origin: [f64; 3], dimension: usize) -> Option<Self> {
        let (lower, upper) = shape::bounds(shape);
        let mut range = Self {
            first: [0; 3],
            counts: [1; 3],
        };
        for k in 0..dimension {
            let low = ((lower[k] - origin[k]) / spacing[k] - TOLERANCE).floor();
            let high = ((upper[k] - origin[k]) / spacing[k] + TOLERANCE).ceil();
            if low.abs().max(high.abs()) > 1e15 {
                return None;
            }
            range.first[k] = low as i64;
            range.counts[k] = (high - low).max(0.0) as u64;
        }
        Some(range)
    }

    fn total(&self) -> Option<u64> {
        let [nx, ny, nz] = self.counts;
        nx.checked_mul(ny)?.checked_mul(nz)
    }

    fn cell(&self, index: u64) -> [i64; 3] {
        let [nx, ny, _] = self.counts;
        let offset = [index % nx, index / nx % ny, index / nx / ny];
        std::array::from_fn(|k| self.first[k] + offset[k] as i64)
    }
}

/// This rank's piece of a body's points; ids count from 0 within the piece. Cells are numbered with
/// x fastest, and ranks take consecutive ranges of them. A cell belongs to a body if its centre does;
/// one that also lies in a later lattice body is left to that one.
///
/// # Errors
/// When the lattice has more cells than the ranks can go through.
pub(super) fn piece(plan: &Plan, body: usize, comm: &dyn Communicator) -> Result<Vec<Point>> {
    let PointSource::Lattice {
        shape: region,
        spacing,
        origin,
    } = &plan.bodies[body].points
    else {
        unreachable!("only called for lattice bodies");
    };
    let dimension = plan.dimension.count();
    let cells = Range::new(region, *spacing, *origin, dimension);
    let most = (comm.size() as u64) << CELLS_A_RANK;
    let (Some(cells), Some(total)) = (&cells, cells.as_ref().and_then(Range::total)) else {
        return agree(comm, Err(too_many(plan, body)));
    };
    if total > most {
        return agree(comm, Err(too_many(plan, body)));
    }
    let later: Vec<&Shape> = plan.bodies[body + 1..]
        .iter()
        .filter_map(|body| match &body.points {
            PointSource::Lattice { shape, .. } => Some(shape),
            PointSource::File { .. } => None,
        })
        .collect();
    let edges = &spacing[..dimension];
    let tolerance = TOLERANCE * edges.iter().copied().fold(f64::INFINITY, f64::min);
    let volume = edges.iter().product::<f64>() * plan.dimension.section();
    let (rank, size) = (comm.rank() as u64, comm.size() as u64);
    let share = |rank: u64| (u128::from(total) * u128::from(rank) / u128::from(size)) as u64;
    let mut points = Vec::new();
    for index in share(rank)..share(rank + 1) {
        let cell = cells.cell(index);
        let mut position = [0.0; 3];
        for k in 0..dimension {
            position[k] = origin[k] + (cell[k] as f64 + 0.5) * spacing[k];
        }
        let taken = later
            .iter()
            .any(|shape| shape::contains(shape, position, tolerance));
        if !shape::contains(region, position, tolerance) || taken {
            continue;
        }
        match plan.quadrature {
            Quadrature::Midpoint => points.push(Point::new(0, position, volume, body)),
            Quadrature::Gauss => {
                let count = 1 << dimension;
                for corner in 0..count {
                    let mut place = position;
                    for k in 0..dimension {
                        let shift = spacing[k] / 12.0_f64.sqrt();
                        place[k] += if corner >> k & 1 == 1 { shift } else { -shift };
                    }
                    points.push(Point::new(0, place, volume / f64::from(count), body));
                }
            }
        }
    }
    Ok(points)
}

fn too_many(plan: &Plan, body: usize) -> Error {
    let body = &plan.bodies[body];
    let message = format!(
        "[body.{}]: its lattice has too many cells; is the spacing in m?",
        body.name
    );
    plan.source.error(body.span.clone(), message)
}
