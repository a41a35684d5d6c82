//! Check that a run is small enough, before its points are created.

use crate::error::Result;
use crate::families::{Fault, MOST_NEIGHBOURS, most_neighbours};
use crate::points::{lattice, shape};
use crate::problem::{PointSource, Problem};

/// Return an error if a point would have too many neighbours, or if a rank would have too many points. The
/// numbers are estimated from the shapes of the problem. `cutoffs` contains the length (m) of the longest
/// bond of each pair of blocks, row-major; `ranks` is the number of ranks.
///
/// # Errors
/// If one of the numbers is too large, or if cells of a lattice are too far from the origin to be numbered.
/// The message names the horizon or the body; the error is the same on all ranks.
pub fn is_feasible(problem: &Problem, cutoffs: &[f64], ranks: usize) -> Result<()> {
    let blocks = problem.block_count();
    (0..problem.bodies.len()).try_for_each(|body| lattice::is_feasible(problem, body, ranks))?;
    // Check bonds within each block first, so that the message names the body of this block.
    let alone = (0..blocks).map(|block| [block, block]);
    let pairs = (0..blocks * blocks).map(|pair| [pair / blocks, pair % blocks]);
    for [here, there] in alone.chain(pairs) {
        not_too_many_neighbours(problem, [here, there], cutoffs[here * blocks + there])?;
    }
    Ok(())
}

fn not_too_many_neighbours(
    problem: &Problem,
    [here, there]: [usize; 2],
    cutoff: f64,
) -> Result<()> {
    let [near, far] = [here, there].map(|block| problem.block(block));
    let (PointSource::Lattice { shape, .. }, Some(spacing)) = (&far.body.points, far.spacing())
    else {
        return Ok(());
    };
    let dimension = problem.dimension.count();
    let (lower, upper) = shape::bounds(shape);
    if let PointSource::Lattice { shape: own, .. } = &near.body.points {
        let (own_lower, own_upper) = shape::bounds(own);
        let apart = |k: usize| (own_lower[k] - upper[k]).max(lower[k] - own_upper[k]);
        if (0..dimension).any(|k| apart(k) > cutoff) {
            return Ok(());
        }
    }
    let cells =
        std::array::from_fn(|k| ((upper[k] - lower[k]) / spacing[k] - 1e-9).ceil().max(1.0));
    let points = f64::from(far.body.quadrature().points(dimension));
    let neighbours = points * most_neighbours(spacing, cutoff, cells, dimension);
    if neighbours <= MOST_NEIGHBOURS {
        return Ok(());
    }
    let fault = Fault::TooManyNeighbours {
        blocks: [here, there],
        neighbours: Some(neighbours),
        spacings: Some(cutoff / spacing[0]),
    };
    Err(fault.error(problem))
}
