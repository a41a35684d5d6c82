//! All families of a rank: lattices where two blocks lie on the same grid, lists elsewhere.

use std::sync::Arc;

use crate::error::Result;
use crate::partition::Domain;

use super::{BlockBonds, BondLattice, Grid, GridFrame, search};

/// The families of a domain that has been [arranged](super::arrange) for these grids, for blocks
/// 0 … `blocks` − 1, by blocks; and the layouts of the grids. `cutoffs` has the longest bond (m) of
/// each pair of blocks, row by row, and is symmetric.
///
/// # Errors
/// When two points lie at the same place.
pub fn find(
    domain: &Domain,
    frames: &[GridFrame],
    blocks: usize,
    cutoffs: &[f64],
    dimension: usize,
) -> Result<(Vec<BlockBonds>, Vec<Arc<Grid>>)> {
    let longest = cutoffs.iter().copied().fold(0.0, f64::max);
    let layout = |frame: &GridFrame| Grid::new(frame.clone(), domain, longest).map(Arc::new);
    let grids = frames.iter().map(layout).collect::<Result<Vec<_>>>()?;
    let shared = |pair: usize| {
        let [here, there] = [pair / blocks, pair % blocks];
        frames
            .iter()
            .position(|frame| frame.blocks[here] && frame.blocks[there])
    };
    // No two points are as close as that, but those at the same place are found all the same.
    let listed: Vec<f64> = cutoffs
        .iter()
        .enumerate()
        .map(|(pair, cutoff)| if shared(pair).is_some() { 0.0 } else { *cutoff })
        .collect();
    let mut families = Vec::new();
    if listed.iter().any(|cutoff| *cutoff > 0.0) {
        families.extend(
            search(domain, blocks, &listed)?
                .into_iter()
                .map(BlockBonds::List),
        );
    }
    for (pair, cutoff) in cutoffs.iter().enumerate() {
        if let Some(index) = shared(pair) {
            let ends = [pair / blocks, pair % blocks];
            let grid = grids[index].clone();
            let lattice = BondLattice::new(index, grid, domain, ends, *cutoff, dimension);
            if !lattice.is_empty() {
                families.push(BlockBonds::Lattice(lattice));
            }
        }
    }
    families.sort_by_key(BlockBonds::blocks);
    Ok((families, grids))
}
