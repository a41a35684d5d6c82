//! Damage whose critical work is to follow from what opening a body costs.

mod separation;

use std::borrow::Cow;

use crate::error::{Error, Result};
use crate::problem::{Calibration, DamageRule, Problem};

pub use separation::separation_energy_ratio;

/// The problem with what opening its bodies costs, where their damage is calibrated by it.
///
/// # Errors
/// When that of a body cannot be measured.
pub fn calibrated(problem: &Problem) -> Result<Cow<'_, Problem>> {
    let mut found = Cow::Borrowed(problem);
    for (index, body) in problem.bodies.iter().enumerate() {
        let rule = body.damage.as_ref().map(|damage| damage.rule);
        if !rule.is_some_and(DamageRule::is_unmeasured) {
            continue;
        }
        set_cost(found.to_mut(), index, 1.0);
        let Some(cost) = separation_energy_ratio(&found, index, 0.0).filter(|cost| *cost > 0.0)
        else {
            let message = format!(
                "[body.{}] damage: what opening this body costs cannot be measured: `calibration = \"opening\"` is for \
                 bodies on a lattice with horizons of at most 3 spacings in space and 10 in the plane; take \"energy\"",
                body.name
            );
            return Err(Error::input(message).at(&body.span));
        };
        set_cost(found.to_mut(), index, cost);
    }
    Ok(found)
}

fn set_cost(problem: &mut Problem, body: usize, cost: f64) {
    let damage = problem.bodies[body].damage.as_mut();
    if let Some(DamageRule::Energy { calibration, .. }) = damage.map(|damage| &mut damage.rule) {
        *calibration = Calibration::Opening(Some(cost));
    }
}
