//! Pieces of the bodies: sets of points that intact bonds connect.

use std::collections::BTreeMap;

use crate::comm::{Found, least, total};
use crate::solver::Simulation;

/// Data of the piece to which each local point belongs. All points of a piece have the same data.
pub(super) struct Pieces<const D: usize> {
    /// Smallest point id of the piece.
    first: Vec<f64>,
    /// 1 for each component that no support prescribes at any point of the piece, else 0.
    pub is_free: [Vec<f64>; D],
    /// 0 for each component in which a load acts on a point of the piece, else 1.
    pub is_unloaded: [Vec<f64>; D],
}

/// A piece, and the points of this rank that belong to it.
pub(super) struct Piece {
    /// Smallest point id of the piece.
    first: u64,
    /// Local indices of the owned points of the piece, ascending.
    pub points: Vec<usize>,
    /// Number of points of the piece over all ranks.
    pub count: u64,
}

impl<const D: usize> Simulation<'_, D> {
    /// Return one column per component, with one entry per local point. An entry is 0 if the point can move
    /// and this component of its load is not 0, otherwise 1.
    pub(super) fn unloaded_points(&self) -> [Vec<f64>; D] {
        let mut all = std::array::from_fn(|_| vec![1.0; self.model.volume.len()]);
        // A point that has never had an intact bond does not move in load steps, so its loads are ignored.
        let density = self.fields.fictitious_density.as_deref();
        if let (Some(force), Some(density)) = (&self.fields.external_force, density) {
            for (is_unloaded, force) in all.iter_mut().zip(force) {
                for (point, force) in force.iter().enumerate() {
                    if *force != 0.0 && density[point].is_finite() {
                        is_unloaded[point] = 0.0;
                    }
                }
            }
        }
        all
    }

    /// Find the pieces of all bodies. `is_unloaded` contains the columns of [`Self::unloaded_points`] at one
    /// time, or the minima of these columns over several times. The supports of the present stage determine
    /// which components are free. Collective.
    pub(super) fn find_pieces(&mut self, is_unloaded: [Vec<f64>; D]) -> Pieces<D> {
        let (model, local) = (&self.model, self.model.volume.len());
        let mut pieces = Pieces {
            first: model.ids.iter().map(|id| *id as f64).collect(),
            is_free: self.conditions.free_components(local),
            is_unloaded,
        };
        self.spread_least(&mut pieces.columns());
        pieces
    }

    /// Call `visit` with each suspected piece, in the order of the smallest point ids of the pieces, until
    /// `visit` returns a value. Return this value. `is_suspect` is called with the local index of a point.
    /// Its result must be the same for all points of a piece. Collective.
    pub(super) fn first_of_pieces<T>(
        &self,
        pieces: &Pieces<D>,
        is_suspect: impl Fn(usize) -> bool,
        mut visit: impl FnMut(Piece) -> Option<T>,
    ) -> Option<T> {
        let mut suspects: BTreeMap<u64, Vec<usize>> = BTreeMap::new();
        for point in (0..self.model.owned()).filter(|point| is_suspect(*point)) {
            let points = suspects.entry(pieces.first[point] as u64).or_default();
            points.push(point);
        }
        let mut from = 0;
        loop {
            let own = suspects.range(from..).next();
            let own = own.map(|(first, _)| Found {
                key: 0.0,
                ids: [*first],
                payload: (),
            });
            let Found { ids: [first], .. } = least(self.comm, own)?;
            let points = suspects.remove(&first).unwrap_or_default();
            let count = total(self.comm, points.len() as u64);
            let piece = Piece {
                first,
                points,
                count,
            };
            if let Some(result) = visit(piece) {
                return Some(result);
            }
            from = first + 1;
        }
    }

    /// Describe a piece in two texts. The first text is the name of a body to which the piece belongs. The
    /// second text gives the size of the piece and the position of one of its points. Collective.
    pub(super) fn describe_piece(&self, piece: &Piece) -> [String; 2] {
        let ids = &self.model.ids;
        let named = piece.points.iter().find(|k| ids[**k] == piece.first);
        let own = named.map(|point| {
            let [x, y, z] = self.model.position(*point);
            Found {
                key: 0.0,
                ids: [piece.first],
                payload: [f64::from(self.model.block[*point]), x, y, z],
            }
        });
        let Some(Found {
            payload: [block, position @ ..],
            ..
        }) = least(self.comm, own)
        else {
            unreachable!("a rank owns the point with the smallest id");
        };
        let body = self.problem.block(block as usize).body.name.clone();
        let size = format!(
            "The piece has {} points; point {} at {:?} m is one of them",
            piece.count,
            piece.first,
            &position[..D],
        );
        [body, size]
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
