//! Initial values, loads, supports and temperatures.

use super::allowed::POSITIVE;
use super::{expression, finite, wrong};
use crate::error::Result;
use crate::expression::{Expression, POSITION, POSITION_AND_TIME};
use crate::problem::{Action, Condition, Depth, Problem};

/// Check the initial values.
///
/// # Errors
/// On a missing set, a wrong number of components, an invalid expression, or no values. On an initial
/// velocity in a run that begins with load steps.
pub fn initials(problem: &Problem) -> Result<()> {
    let first = problem.stages.first();
    let first = first.map_or(problem.time, |stage| stage.time);
    for initial in &problem.initials {
        let section = format!("[initial.{}]", initial.name);
        problem.check_set(&format!("{section} set"), initial.set)?;
        let (displacement, velocity) = (&initial.displacement, &initial.velocity);
        if initial.file.is_some() == (displacement.is_some() || velocity.is_some()) {
            let fault = "needs displacements or velocities, either as expressions or from a file";
            return Err(wrong(&section, fault));
        }
        for (name, values) in [("displacement", displacement), ("velocity", velocity)] {
            if let Some((values, _)) = values {
                problem.check_expressions(&format!("{section} {name}"), values, &POSITION)?;
            }
        }
        let file = initial.file.as_ref();
        let has_velocity =
            velocity.is_some() || file.is_some_and(|file| file.columns.has_velocity());
        if has_velocity && first.is_quasi_static() {
            let fault = format!(
                "initial velocities have no effect in a run that begins with the method `{}`",
                first.method.name()
            );
            return Err(wrong(&format!("{section} velocity"), fault));
        }
    }
    Ok(())
}

/// Check the loads, supports and temperatures.
///
/// # Errors
/// On a missing set, a wrong number of components, an invalid expression, or a wrong depth.
pub fn conditions(problem: &Problem) -> Result<()> {
    for condition in &problem.conditions {
        let section = format!("[condition.{}]", condition.name);
        problem.check_set(&format!("{section} set"), condition.set)?;
        depth(condition, &section)?;
        let key = format!("{section} {}", condition.quantity);
        match &condition.action {
            Action::Displacement(motion) | Action::Velocity(motion) => {
                support(problem, &key, motion)?;
            }
            Action::BodyForce(forces, factors) => {
                problem.check_expressions(&key, forces, &POSITION_AND_TIME)?;
                let key = format!("{key} factors");
                problem.check_entries(&key, factors.len())?;
                finite(&key, factors)?;
            }
            Action::Force(forces) => problem.check_expressions(&key, forces, &POSITION_AND_TIME)?,
            Action::Temperature(value) => expression(&key, value, &POSITION_AND_TIME)?,
        }
    }
    Ok(())
}

fn support(problem: &Problem, key: &str, motion: &[Option<Expression>]) -> Result<()> {
    problem.check_entries(key, motion.len())?;
    if motion.iter().all(Option::is_none) {
        return Err(wrong(
            key,
            "every component is free, so nothing is prescribed",
        ));
    }
    let mut given = motion.iter().flatten();
    given.try_for_each(|each| expression(key, each, &POSITION_AND_TIME))
}

fn depth(condition: &Condition, section: &str) -> Result<()> {
    let key = format!("{section} depth");
    if condition.depth.is_some() && !matches!(condition.action, Action::BodyForce(..)) {
        return Err(wrong(&key, "only `Action::BodyForce` can have a depth"));
    }
    match condition.depth {
        Some(Depth::Given(depth)) => POSITIVE.check(&key, depth),
        Some(Depth::Spacing) | None => Ok(()),
    }
}
