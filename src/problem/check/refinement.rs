//! Refinement of grids.

use super::allowed::{AT_LEAST_ONE, INTERFACE_FACTOR, POSITIVE, SHARE};
use super::{at_least_one, expression, optional, wrong};
use crate::error::Result;
use crate::expression::{POSITION, POSITION_AND_TIME};
use crate::problem::{HorizonRule, InterfaceRule, PointSource, Problem, Trigger};

/// Largest refinement level; its spacing is 1/64 of the spacing of the grid.
pub(crate) const FINEST: u64 = 6;

/// Check the refinement.
///
/// # Errors
/// If no body is on a lattice with one point per cell. If a level, ratio, factor, region or trigger is not
/// allowed.
pub fn refinement(problem: &Problem) -> Result<()> {
    let Some(refinement) = &problem.refinement else {
        return Ok(());
    };
    let section = "[refinement]";
    if problem.bodies.iter().any(|body| body.has_gauss_points()) {
        return Err(wrong(
            section,
            "needs one point per cell, but a body has Gauss points",
        ));
    }
    if problem.jitter.is_some() {
        return Err(wrong(section, "is not available with `jitter`"));
    }
    let mut bodies = problem.bodies.iter();
    if !bodies.any(|body| matches!(body.points, PointSource::Lattice { .. })) {
        return Err(wrong(
            section,
            "only lattice bodies are refined, and there is none",
        ));
    }
    let levels = refinement.levels;
    if !(1..=FINEST).contains(&u64::from(levels)) {
        let fault = format!("must be 1 to {FINEST}, is {levels}");
        return Err(wrong("[refinement] levels", fault));
    }
    if let HorizonRule::DeltaM(ratios) = &refinement.rule {
        let key = "[refinement] m";
        if ratios.len() != levels as usize {
            let fault = format!(
                "must have {levels} entries, one for each level from 1 to {levels}, has {}",
                ratios.len()
            );
            return Err(wrong(key, fault));
        }
        let mut ratios = ratios.iter();
        ratios.try_for_each(|ratio| AT_LEAST_ONE.check(key, *ratio))?;
    }
    let factor = refinement.interface_factor;
    INTERFACE_FACTOR.check("[refinement] interface_factor", factor)?;
    if !matches!(
        refinement.bonds,
        InterfaceRule::Own | InterfaceRule::Average
    ) {
        let fault = "must be `InterfaceRule::Own` or `InterfaceRule::Average`";
        return Err(wrong("[refinement] bonds", fault));
    }
    for region in &refinement.regions {
        let section = format!("[refinement.region.{}]", region.name);
        if !(1..=levels).contains(&region.level) {
            let fault = format!(
                "must be 1 to `levels`, which is {levels}, is {}",
                region.level
            );
            return Err(wrong(&format!("{section} level"), fault));
        }
        expression(&format!("{section} where"), &region.condition, &POSITION)?;
    }
    let trigger = refinement.trigger.as_ref();
    trigger.map_or(Ok(()), |trigger| self::trigger(problem, trigger))
}

fn trigger(problem: &Problem, trigger: &Trigger) -> Result<()> {
    let section = "[refinement.trigger]";
    let key = |name: &str| format!("{section} {name}");
    if trigger.energy.is_none() && trigger.damage.is_none() && trigger.condition.is_none() {
        let fault = "needs at least one of `energy`, `damage` and `condition`";
        return Err(wrong(section, fault));
    }
    at_least_one(&key("every_steps"), trigger.every_steps)?;
    optional(&key("energy"), trigger.energy, &SHARE)?;
    optional(&key("damage"), trigger.damage, &SHARE)?;
    optional(&key("coarsen_after"), trigger.coarsen_after, &POSITIVE)?;
    for (name, condition) in [("where", &trigger.condition), ("only", &trigger.only)] {
        if let Some(condition) = condition {
            expression(&key(name), condition, &POSITION_AND_TIME)?;
        }
    }
    let dimension = problem.dimension.count();
    let mut bodies = problem.bodies.iter();
    match bodies.find_map(|body| Some((body, body.diagonal_above_horizon(dimension)?))) {
        None => Ok(()),
        Some((body, diagonal)) => {
            let fault = format!(
                "the horizon of [body.{}] must be at least the diagonal of a cell, {diagonal} m",
                body.name
            );
            Err(wrong(section, fault))
        }
    }
}
