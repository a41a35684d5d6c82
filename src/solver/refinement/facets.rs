//! Facets: faces between lattice points that a crack separates.

use crate::comm::all_gather_many;
use crate::points::bins::Bins;
use crate::solver::Simulation;
use crate::solver::assign::cutoffs;

/// Ratio of the side of a facet to the side of a cell. The ratio is above 1, so round-off opens no gap
/// between facets.
const OVERLAP: f64 = 1.0 + 1e-6;

/// The facets of all ranks. A facet lies between two adjacent points whose bond is broken. A facet also lies
/// between two points that were adjacent in a coarser grid, if their bond had already broken before the grid
/// between them was refined.
pub struct Facets {
    all: Vec<Facet>,
    bins: Bins,
}

impl Facets {
    /// Find the facets of the broken bonds and of the suppressed nodes. Collective.
    pub fn new<const D: usize>(simulation: &mut Simulation<'_, D>) -> Self {
        let (problem, comm) = (simulation.problem, simulation.comm);
        let model = &simulation.model;
        let mut blocks: Vec<f64> = model.block.iter().map(|block| f64::from(*block)).collect();
        blocks.resize(model.volume.len(), 0.0);
        simulation.forces.update_ghosts(comm, &mut [&mut blocks]);
        let mut own: Vec<Facet> = Vec::new();
        simulation.forces.for_each_broken(|here, there| {
            if model.ids[here] > model.ids[there] {
                return;
            }
            let [a, b] = [here, there].map(|point| model.position(point));
            let edges = [here, there].map(|point| problem.block(blocks[point] as usize).spacing());
            let [Some(first), Some(second)] = edges else {
                return;
            };
            let edges: [f64; 3] = std::array::from_fn(|k| first[k].min(second[k]));
            let apart = |k: usize| (b[k] - a[k]).abs() > 1e-3 * edges[k];
            let next = |k: usize| (b[k] - a[k]).abs() < (1.0 + 1e-3) * edges[k];
            let mut along = (0..D).filter(|k| apart(*k));
            if let (Some(axis), None) = (along.next(), along.next())
                && next(axis)
            {
                own.push(Facet {
                    centre: std::array::from_fn(|k| 0.5 * (a[k] + b[k])),
                    edges,
                    axis: axis as u64,
                });
            }
        });
        let mut all = all_gather_many(comm, &own);
        // The search above finds a facet only between points one spacing apart. Bonds on a refined grid can
        // be too short to join such points of a coarser grid. Facets of the coarser grid are therefore taken
        // from the suppressed nodes, which the grids store.
        let faces = simulation.grids.suppressed_faces().into_iter();
        all.extend(faces.map(|(centre, edges, axis)| Facet {
            centre,
            edges,
            axis: axis as u64,
        }));
        let longest = cutoffs(problem).into_iter().fold(0.0, f64::max);
        let centres: Vec<[f64; 3]> = all.iter().map(|facet| facet.centre).collect();
        let widest = all.iter().flat_map(|facet| facet.edges[..D].iter());
        let widest = widest.copied().fold(0.0, f64::max);
        Self {
            bins: Bins::new(&centres, longest + widest),
            all,
        }
    }

    /// Whether no facet exists; the same on all ranks.
    pub fn are_none(&self) -> bool {
        self.all.is_empty()
    }

    /// Indices of the facets that a bond of a point at a position (m) may cross.
    pub fn near(&self, position: [f64; 3]) -> Vec<u32> {
        let mut near = Vec::new();
        self.bins.within(position, |facet, _| near.push(facet));
        near
    }

    /// Whether a bond of a point at a position (m) may cross any facet.
    pub fn are_near(&self, position: [f64; 3]) -> bool {
        let mut any = false;
        self.bins.within(position, |_, _| any = true);
        any
    }

    /// Whether the line segment between two positions (m) crosses a facet of `near`. For a bond, `near` must
    /// be the result of [`Self::near`] for one of its ends.
    pub fn lie_between(&self, near: &[u32], from: [f64; 3], to: [f64; 3]) -> bool {
        let mut facets = near.iter().map(|facet| &self.all[*facet as usize]);
        facets.any(|facet| facet.is_crossed(from, to))
    }
}

/// A face between two adjacent points, perpendicular to an axis.
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
struct Facet {
    centre: [f64; 3],
    edges: [f64; 3],
    axis: u64,
}

impl Facet {
    /// Whether the line segment between two positions (m) crosses the facet. Facets are enlarged by the
    /// factor `OVERLAP`, so no segment passes between adjacent facets.
    fn is_crossed(&self, from: [f64; 3], to: [f64; 3]) -> bool {
        let axis = self.axis as usize;
        let [before, after] = [from, to].map(|place| place[axis] - self.centre[axis]);
        if before * after >= 0.0 {
            return false;
        }
        let share = before / (before - after);
        (0..3).filter(|k| *k != axis).all(|k| {
            let place = from[k] + share * (to[k] - from[k]);
            (place - self.centre[k]).abs() <= 0.5 * OVERLAP * self.edges[k]
        })
    }
}
