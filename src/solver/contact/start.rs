//! Checks of contact at the start of a run.

use crate::comm::{Communicator, Found, least, total};
use crate::error::{Error, Result};
use crate::problem::{self, Problem};
use crate::solver::model::Model;

use super::Contact;
use super::rigid::RigidBody;

/// Return an error if a point starts in a rigid body or on its surface. Collective.
pub(super) fn check_outside<const D: usize>(
    problem: &Problem,
    comm: &dyn Communicator,
    model: &Model<D>,
    rigid: &[RigidBody],
) -> Result<()> {
    for rigid in rigid {
        let depth = |point: usize| rigid.start_distance(model.position(point));
        let inside = (0..model.owned()).filter(|point| depth(*point) <= 0.0);
        let first = inside.min_by_key(|point| model.ids[*point]);
        let own = first.map(|point| Found {
            key: 0.0,
            ids: [model.ids[point]],
            payload: [f64::from(model.block[point]), depth(point)],
        });
        if let Some(Found {
            ids: [id],
            payload: [block, depth],
            ..
        }) = least(comm, own)
        {
            let body = &problem.block(block as usize).body.name;
            let problem::Rigid { name, span, .. } = rigid.problem();
            let place = if depth < 0.0 {
                format!("{:.3e} m within it", -depth)
            } else {
                "on its surface".to_owned()
            };
            let message =
                format!("[rigid.{name}]: point {id} of [body.{body}] begins {place}; move it away");
            return Err(Error::input(message).at(span));
        }
    }
    Ok(())
}

/// Pairs of points of different bodies that start at the same position. Their contact distance is 0, so they
/// never touch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Coincident {
    /// Number of pairs of points over all ranks.
    pub pairs: u64,
    /// Ids of the first pair, the smaller one first.
    pub ids: [u64; 2],
    /// Blocks of these points.
    pub blocks: [usize; 2],
}

impl<const D: usize> Contact<D> {
    /// Find the pairs of points of different bodies that start at the same position; `None` if there are
    /// none. The result is the same on all ranks. Call before the first step. Collective.
    pub fn coincident(
        &self,
        problem: &Problem,
        comm: &dyn Communicator,
        model: &Model<D>,
    ) -> Option<Coincident> {
        let mut pairs = 0;
        let mut first: Option<Found<[f64; 2], 2>> = None;
        for point in self.open.iter().map(|point| *point as usize) {
            for other in self.rows.touching(point) {
                let (id, block, position) = match other.checked_sub(model.owned()) {
                    None => (
                        model.ids[other],
                        model.block[other].into(),
                        model.position(other),
                    ),
                    Some(ghost) => {
                        let ghost = &self.ghosts.points[ghost];
                        (ghost.id, ghost.block as usize, ghost.reference)
                    }
                };
                let own = usize::from(model.block[point]);
                let coincide = position == model.position(point)
                    && problem.body_of(own) != problem.body_of(block);
                // Count each pair once.
                if !coincide || id < model.ids[point] {
                    continue;
                }
                pairs += 1;
                let ids = [model.ids[point], id];
                if first.as_ref().is_none_or(|found| ids < found.ids) {
                    first = Some(Found {
                        key: 0.0,
                        ids,
                        payload: [own as f64, block as f64],
                    });
                }
            }
        }
        let pairs = total(comm, pairs);
        let Found { ids, payload, .. } = least(comm, first)?;
        Some(Coincident {
            pairs,
            ids,
            blocks: payload.map(|block| block as usize),
        })
    }
}
