//! Calibration of damage by the computed separation energy of a body.

mod separation;

use std::borrow::Cow;

use crate::error::{Error, Result};
use crate::problem::{Calibration, DamageRule, Problem};

pub use separation::separation_energy_ratio;

/// Compute the separation energy ratio of each body with `calibration = "opening"`. Return the problem with
/// these ratios.
///
/// # Errors
/// If a value of the problem is not allowed ([`Problem::check`]). If the ratio of a body cannot be computed
/// or is not above 0.
pub fn calibrated(problem: &Problem) -> Result<Cow<'_, Problem>> {
    problem.check()?;
    let mut calibrated = Cow::Borrowed(problem);
    for (index, body) in problem.bodies.iter().enumerate() {
        let rule = body.damage.as_ref().map(|damage| damage.rule);
        if !rule.is_some_and(DamageRule::is_unmeasured) {
            continue;
        }
        set_ratio(calibrated.to_mut(), index, 1.0);
        let ratio = separation_energy_ratio(&calibrated, index, 0.0);
        let Some(ratio) = ratio.filter(|ratio| *ratio > 0.0) else {
            let message = format!(
                "[body.{}] damage: `calibration = \"opening\"` needs a body on a lattice with a horizon of at most 3 \
                 spacings in 3-D and 10 in 2-D, and a yield stress at which the body breaks; use \"energy\"",
                body.name
            );
            return Err(Error::input(message).at(&body.span));
        };
        set_ratio(calibrated.to_mut(), index, ratio);
    }
    Ok(calibrated)
}

fn set_ratio(problem: &mut Problem, body: usize, ratio: f64) {
    let damage = problem.bodies[body].damage.as_mut();
    if let Some(DamageRule::Energy { calibration, .. }) = damage.map(|damage| &mut damage.rule) {
        *calibration = Calibration::Opening(Some(ratio));
    }
}
