//! Initial displacements and velocities.

use crate::comm::Communicator;
use crate::error::Result;
use crate::problem::Problem;
use crate::solver::model::Model;
use crate::solver::motion::Fields;

use super::{members, not_empty};

/// Set the initial displacements and velocities.
///
/// # Errors
/// If a set is empty; the error is the same on all ranks.
pub fn apply_initials<const D: usize>(
    problem: &Problem,
    comm: &dyn Communicator,
    model: &Model<D>,
    fields: &mut Fields<D>,
) -> Result<()> {
    for initial in &problem.initials {
        let points = members(problem, model, initial.set);
        let key = format!("[initial.{}] set", initial.name);
        not_empty(
            problem,
            comm,
            initial.set,
            &points,
            (&key, initial.span.clone()),
        )?;
        for point in points {
            let position = model.position(point as usize);
            for d in 0..D {
                if let Some((values, _)) = &initial.displacement {
                    fields.displacement[d][point as usize] = values[d].evaluate(position, 0.0);
                }
                if let Some((values, _)) = &initial.velocity {
                    fields.velocity[d][point as usize] = values[d].evaluate(position, 0.0);
                }
            }
        }
    }
    Ok(())
}
