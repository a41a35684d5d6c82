//! What must hold of contact at the start.

use crate::comm::{Communicator, Found, least};
use crate::error::{Error, Result};
use crate::problem::{self, Problem};
use crate::solver::model::Model;

use super::rigid::RigidBody;

/// An error if a point begins in a rigid body. Collective.
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
            let message = format!(
                "[rigid.{name}]: point {id} of [body.{body}] begins {:.3e} m within it; move it away",
                -depth
            );
            return Err(Error::input(message).at(span));
        }
    }
    Ok(())
}
