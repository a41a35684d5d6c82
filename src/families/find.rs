//! The families of a rank: lattices for pairs of blocks on the same grid, lists for all other pairs.

use std::sync::Arc;

use crate::partition::Domain;

use super::fault::{Fault, MOST_NEIGHBOURS};
use super::offset::most_neighbours;
use super::{BlockBonds, BondLattice, Grid, GridFrame, search};

/// Build the families of a domain, sorted by pair of blocks, and the layouts of the grids.
///
/// The domain must have been [arranged](super::arrange()) for these grids. `cutoffs` is a symmetric
/// `blocks` × `blocks` matrix. An entry is the maximum bond length of a pair of blocks, m; 0 for a pair
/// without bonds.
///
/// # Errors
/// - If two points coincide.
/// - If a point would have too many neighbours.
/// - If a grid layout has too many holes.
/// - If memory is insufficient.
pub fn find(
    domain: &Domain,
    frames: &[GridFrame],
    blocks: usize,
    cutoffs: &[f64],
    dimension: usize,
) -> Result<(Vec<BlockBonds>, Vec<Arc<Grid>>), Fault> {
    let longest = cutoffs.iter().copied().fold(0.0, f64::max);
    let common_frame = |pair: usize| {
        let [block_i, block_j] = [pair / blocks, pair % blocks];
        frames
            .iter()
            .position(|frame| frame.blocks[block_i] && frame.blocks[block_j])
    };
    for (pair, cutoff) in cutoffs.iter().enumerate() {
        let Some(frame) = common_frame(pair).map(|index| &frames[index]) else {
            continue;
        };
        let cells = std::array::from_fn(|k| domain.extent[k] / frame.spacing[k] + 1.0);
        let neighbours = most_neighbours(frame.spacing, *cutoff, cells, dimension);
        if neighbours.min(domain.total as f64) > MOST_NEIGHBOURS {
            return Err(Fault::TooManyNeighbours {
                blocks: [pair / blocks, pair % blocks],
                neighbours: Some(neighbours),
                spacings: Some(cutoff / frame.spacing[0]),
            });
        }
    }
    let layout = |frame: &GridFrame| Grid::new(frame.clone(), domain, longest).map(Arc::new);
    let grids = frames
        .iter()
        .map(layout)
        .collect::<Result<Vec<_>, Fault>>()?;
    // `Grid::new` has checked that points of the same grid do not coincide. The list search checks the points
    // of all other pairs of blocks with bonds.
    let listed: Vec<f64> = cutoffs
        .iter()
        .enumerate()
        .map(|(pair, cutoff)| {
            if common_frame(pair).is_some() {
                0.0
            } else {
                *cutoff
            }
        })
        .collect();
    let mut families = Vec::new();
    if listed.iter().any(|cutoff| *cutoff > 0.0) {
        families.extend(
            search(domain, blocks, &listed)?
                .into_iter()
                .map(BlockBonds::List),
        );
    }
    let mut present = vec![[false; 2]; blocks];
    for (k, point) in domain.points.iter().enumerate() {
        let [owned, local] = &mut present[point.block as usize];
        *owned |= k < domain.owned;
        *local = true;
    }
    for (pair, cutoff) in cutoffs.iter().enumerate() {
        let ends = [pair / blocks, pair % blocks];
        if !present[ends[0]][0] || !present[ends[1]][1] {
            continue;
        }
        if let Some(index) = common_frame(pair) {
            let grid = grids[index].clone();
            let lattice = BondLattice::new(index, grid, domain, ends, *cutoff, dimension)?;
            if !lattice.is_empty() {
                families.push(BlockBonds::Lattice(lattice));
            }
        }
    }
    families.sort_by_key(BlockBonds::blocks);
    Ok((families, grids))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comm::threads;
    use crate::partition::distribute;
    use crate::points::Point;

    fn cube(edge: u64) -> (Domain, GridFrame) {
        let position =
            |k: u64| [k % edge, k / edge % edge, k / edge / edge].map(|x| 1e-3 * x as f64);
        let points = (0..edge.pow(3)).map(|k| Point::new(k, position(k), 1e-9, 0));
        let domain = distribute(&threads::alone(), points.collect(), edge.pow(3), 3.0).unwrap();
        let frame = GridFrame {
            origin: [0.0; 3],
            spacing: [1e-3; 3],
            blocks: vec![true],
        };
        (domain, frame)
    }

    #[test]
    fn a_horizon_far_beyond_a_body_bonds_all_its_points() {
        let (domain, frame) = cube(3);
        for cutoff in [3.0, 1e30] {
            let (families, _) =
                find(&domain, std::slice::from_ref(&frame), 1, &[cutoff], 3).unwrap();
            let bonds: u64 = families.iter().map(BlockBonds::bonds).sum();
            assert_eq!(bonds, 27 * 26);
            assert!(families[0].bytes() < 10_000, "{}", families[0].bytes());
        }
    }

    #[test]
    fn a_horizon_that_holds_too_many_points_is_an_error() {
        let (domain, frame) = cube(28);
        let fault = find(&domain, &[frame], 1, &[3.0], 3).unwrap_err();
        let Fault::TooManyNeighbours { neighbours, .. } = fault else {
            panic!("{fault:?}");
        };
        assert!((neighbours.unwrap() / 28_f64.powi(3) - 1.0).abs() < 1e-9);
    }
}
