//! Pieces: sets of points that intact bonds connect, and the check that supports hold the loaded pieces.

use std::collections::BTreeMap;

use crate::comm::sum::{ExactSum, reduce};
use crate::comm::{Found, agree, least, total};
use crate::error::{Error, Result};
use crate::solver::Simulation;

/// Names of the components.
const AXES: [&str; 3] = ["x", "y", "z"];

/// A sum of loads below this fraction of the sum of their magnitudes is round-off.
const ROUND_OFF: f64 = 1e-9;

/// Columns with one entry per local point; all points of a piece have the same entries.
struct Pieces<const D: usize> {
    /// Smallest point id of the piece.
    first: Vec<f64>,
    /// 1 for each component that no support prescribes at any point of the piece, else 0.
    is_free: [Vec<f64>; D],
    /// 0 for each component in which a load acts on a point of the piece, else 1.
    is_unloaded: [Vec<f64>; D],
}

impl<const D: usize> Simulation<'_, D> {
    /// Return an error if a piece has a load along an axis along which no support holds it. Collective.
    ///
    /// # Errors
    /// The message names the piece with the smallest point id.
    pub(in crate::solver) fn check_pieces_are_held(&mut self, failure: &str) -> Result<()> {
        let pieces = self.find_pieces();
        let mut suspects: BTreeMap<u64, Vec<usize>> = BTreeMap::new();
        for point in 0..self.model.owned() {
            let suspect =
                |d: usize| pieces.is_free[d][point] == 1.0 && pieces.is_unloaded[d][point] == 0.0;
            if (0..D).any(suspect) {
                let points = suspects.entry(pieces.first[point] as u64).or_default();
                points.push(point);
            }
        }
        let mut from = 0;
        loop {
            let own = suspects.range(from..).next();
            let own = own.map(|(first, _)| Found {
                key: 0.0,
                ids: [*first],
                payload: (),
            });
            let Some(Found { ids: [first], .. }) = least(self.comm, own) else {
                return Ok(());
            };
            let points = suspects.get(&first).map_or(&[][..], |points| &points[..]);
            let count = total(self.comm, points.len() as u64);
            if let Some((component, force)) = self.unbalanced_load(&pieces, points) {
                let named = points.iter().find(|point| self.model.ids[**point] == first);
                let named = named.map(|point| {
                    let axis = AXES[component];
                    let block = usize::from(self.model.block[*point]);
                    Error::run(format!(
                        "{failure}: loads of {force:.3e} N act along {axis} on a piece of body `{}` that no \
                         support holds along {axis}. The piece has {count} points; point {first} at {:?} m is \
                         one of them. Prescribe its displacement along {axis} at some points, or remove its \
                         loads",
                        self.problem.block(block).body.name,
                        &self.model.position(*point)[..D],
                    ))
                });
                agree(self.comm, named.map_or(Ok(()), Err))?;
            }
            from = first + 1;
        }
    }

    /// Return the first free component in which the loads on a piece do not cancel, and the sum of these
    /// loads (N). Collective.
    fn unbalanced_load(&self, pieces: &Pieces<D>, points: &[usize]) -> Option<(usize, f64)> {
        let mut is_held = [0.0; D];
        let mut sums = [const { ExactSum::ZERO }; 6];
        for point in points {
            for d in 0..D {
                let force = self.fields.external_force.as_ref();
                let force = force.map_or(0.0, |force| force[d][*point]);
                let force = force * self.model.volume[*point];
                sums[d].add(force);
                sums[3 + d].add(force.abs());
                is_held[d] = 1.0 - pieces.is_free[d][*point];
            }
        }
        self.comm.max(&mut is_held);
        let sums = reduce(self.comm, &mut sums);
        let unbalanced = |d: &usize| is_held[*d] == 0.0 && sums[*d].abs() > ROUND_OFF * sums[3 + d];
        (0..D).find(unbalanced).map(|d| (d, sums[d]))
    }

    /// Find the piece of each local point. Collective.
    fn find_pieces(&mut self) -> Pieces<D> {
        let (model, local) = (&self.model, self.model.volume.len());
        let mut pieces = Pieces {
            first: model.ids.iter().map(|id| *id as f64).collect(),
            is_free: self.conditions.free_components(local),
            is_unloaded: std::array::from_fn(|_| vec![1.0; local]),
        };
        // A point without bonds in its reference family does not move in a relaxation, so its loads do not
        // count.
        let density = self.fields.fictitious_density.as_deref();
        if let (Some(force), Some(density)) = (&self.fields.external_force, density) {
            for (is_unloaded, force) in pieces.is_unloaded.iter_mut().zip(force) {
                for (point, force) in force.iter().enumerate() {
                    if *force != 0.0 && density[point].is_finite() {
                        is_unloaded[point] = 0.0;
                    }
                }
            }
        }
        self.spread_least(&mut pieces.columns());
        pieces
    }
}

impl<const D: usize> Pieces<D> {
    fn columns(&mut self) -> Vec<&mut [f64]> {
        let Self {
            first,
            is_free,
            is_unloaded,
        } = self;
        let flags = is_free.iter_mut().chain(is_unloaded);
        [first]
            .into_iter()
            .chain(flags)
            .map(|column| &mut column[..])
            .collect()
    }
}
