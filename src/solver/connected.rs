//! Pieces: sets of points that are connected by chains of intact bonds. A piece can contain points of several
//! ranks.

use crate::comm::total;

use super::Simulation;

impl<const D: usize> Simulation<'_, D> {
    /// In each column, replace the entry of every local point by the smallest entry in the piece of this
    /// point. The piece consists of the point and of all points, on any rank, that chains of intact bonds
    /// connect to it. Collective.
    pub(super) fn spread_least(&mut self, columns: &mut [&mut [f64]]) {
        let mut pieces = Pieces::new(self.model.volume.len());
        self.forces.for_each_intact(|i, j| pieces.join(i, j));
        self.spread_least_over(pieces, columns);
    }

    /// In each column, replace the entry of every local point by the smallest entry in the piece of this
    /// point. `pieces` are the pieces of this rank. Pieces of different ranks count as one piece if they
    /// contain the same point. Collective.
    pub(super) fn spread_least_over(&mut self, mut pieces: Pieces, columns: &mut [&mut [f64]]) {
        let local = self.model.volume.len();
        loop {
            // Exchange the ghost values, then find the minima over the pieces of this rank. Repeat this until
            // no entry changes on any rank.
            self.forces.update_ghosts(self.comm, columns);
            let mut changed = 0;
            for column in columns.iter_mut() {
                for point in 0..local {
                    let root = pieces.root(point);
                    column[root] = column[root].min(column[point]);
                }
                for point in 0..local {
                    let least = column[pieces.root(point)];
                    changed += u64::from(column[point] > least);
                    column[point] = least;
                }
            }
            if total(self.comm, changed) == 0 {
                return;
            }
        }
    }

    /// Return the fragment id of each owned point. The fragment id is the smallest id of the point itself and
    /// of all points that are connected to it by chains of intact bonds. Collective.
    pub fn fragment_ids(&mut self) -> Vec<f64> {
        let mut ids: Vec<f64> = self.model.ids.iter().map(|id| *id as f64).collect();
        self.spread_least(&mut [&mut ids]);
        ids.truncate(self.model.owned());
        ids
    }
}

/// Disjoint sets of connected local points. Entry k is the parent of point k in the tree of the set that
/// contains point k; a root is its own parent.
pub(super) struct Pieces(Vec<usize>);

impl Pieces {
    /// Create pieces of one point each.
    pub fn new(points: usize) -> Self {
        Self((0..points).collect())
    }

    /// Connect the pieces of two points.
    pub fn join(&mut self, i: usize, j: usize) {
        let (i, j) = (self.root(i), self.root(j));
        self.0[i.max(j)] = i.min(j);
    }

    /// Find the root of a point's tree, and shorten the path from the point to the root.
    fn root(&mut self, mut point: usize) -> usize {
        let Self(parents) = self;
        while parents[point] != point {
            parents[point] = parents[parents[point]];
            point = parents[point];
        }
        point
    }
}
