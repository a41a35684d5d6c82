//! Connected components of points over intact bonds, across ranks.

use crate::comm::total;

use super::Simulation;

impl<const D: usize> Simulation<'_, D> {
    /// Set each column over the local points to its minimum over the points that intact bonds connect.
    /// Collective.
    pub(super) fn spread_least(&mut self, columns: &mut [&mut [f64]]) {
        let local = self.model.volume.len();
        let mut roots: Vec<usize> = (0..local).collect();
        self.forces.for_each_intact(|i, j| {
            let (i, j) = (root(&mut roots, i), root(&mut roots, j));
            roots[i.max(j)] = i.min(j);
        });
        loop {
            // First find the minimum over the points of a piece on this rank, then include those of the
            // other ranks.
            self.forces.bring_all(self.comm, columns);
            let mut changed = 0;
            for column in columns.iter_mut() {
                for point in 0..local {
                    let root = root(&mut roots, point);
                    column[root] = column[root].min(column[point]);
                }
                for point in 0..local {
                    let least = column[root(&mut roots, point)];
                    changed += u64::from(column[point] > least);
                    column[point] = least;
                }
            }
            if total(self.comm, changed) == 0 {
                return;
            }
        }
    }

    /// For each owned point, the smallest id of the points that intact bonds connect to it, including its
    /// own. Collective.
    pub fn fragment_ids(&mut self) -> Vec<f64> {
        let mut ids: Vec<f64> = self.model.ids.iter().map(|id| *id as f64).collect();
        self.spread_least(&mut [&mut ids]);
        ids.truncate(self.model.owned());
        ids
    }
}

/// Find the root of a point's tree, and shorten the path to it.
fn root(parents: &mut [usize], mut point: usize) -> usize {
    while parents[point] != point {
        parents[point] = parents[parents[point]];
        point = parents[point];
    }
    point
}
