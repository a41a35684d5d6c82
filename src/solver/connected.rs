//! Connected components of points over intact bonds, across ranks.

use crate::comm::total;

use super::Simulation;

impl<const D: usize> Simulation<'_, D> {
    /// Replace each entry of columns over the local points by the minimum over all points that intact bonds
    /// connect to its point. Collective.
    pub(super) fn spread_least(&mut self, columns: &mut [&mut [f64]]) {
        let local = self.model.volume.len();
        let mut roots: Vec<usize> = (0..local).collect();
        self.forces.for_each_intact(|i, j| {
            let (i, j) = (root(&mut roots, i), root(&mut roots, j));
            roots[i.max(j)] = i.min(j);
        });
        loop {
            // First find the minimum over connected points on this rank, then include the points of other
            // ranks.
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

    /// Return the fragment id of each owned point: the smallest id among this point and all points that
    /// intact bonds connect to it. Collective.
    pub fn fragment_ids(&mut self) -> Vec<f64> {
        let mut ids: Vec<f64> = self.model.ids.iter().map(|id| *id as f64).collect();
        self.spread_least(&mut [&mut ids]);
        ids.truncate(self.model.owned());
        ids
    }
}

/// Find the root of a point's tree, and shorten the path to the root.
fn root(parents: &mut [usize], mut point: usize) -> usize {
    while parents[point] != point {
        parents[point] = parents[parents[point]];
        point = parents[point];
    }
    point
}
