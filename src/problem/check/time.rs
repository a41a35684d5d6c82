//! Time settings and stages.

use super::allowed::{ABOVE_ONE, MOST_HALVINGS, POSITIVE, PROPER_FRACTION, SHARE as SAFETY};
use super::{at_least_one, optional, wrong};
use crate::error::Result;
use crate::message::format_number;
use crate::problem::{Adaptive, Method, Problem, StepRule, Time};

/// Relative tolerance for comparisons of times. Times that are equal in exact arithmetic can differ by
/// round-off.
const UP_TO_ROUNDING: f64 = 1e-9;

/// Check the time settings of the run and of its stages.
///
/// # Errors
/// On a number that is not allowed, on ends of stages that do not grow, and on a stage that does not say for
/// each condition whether it acts.
pub fn time(problem: &Problem) -> Result<()> {
    let whole = problem.time.end;
    POSITIVE.check("[time] end", whole)?;
    let mut start = 0.0;
    for (number, stage) in problem.all_stages().iter().enumerate() {
        let section = match problem.stages.len() {
            0 => "[time]".to_owned(),
            _ => format!("[[stage]] {}", number + 1),
        };
        let end = stage.time.end;
        POSITIVE.check(&format!("{section} end"), end)?;
        if end - start <= UP_TO_ROUNDING * whole {
            let fault = format!(
                "must be above {} s (the start of the stage) by more than round-off, is {} s",
                format_number(start),
                format_number(end)
            );
            return Err(wrong(&format!("{section} end"), fault));
        }
        let (found, wanted) = (stage.acting.len(), problem.conditions.len());
        if found != wanted {
            let fault = format!("must have {wanted} entries, one per condition, has {found}");
            return Err(wrong(&format!("{section} acting"), fault));
        }
        segment(&section, &stage.time, end - start)?;
        start = end;
    }
    Ok(())
}

/// Check the time settings of a stage with a length in s.
fn segment(section: &str, time: &Time, length: f64) -> Result<()> {
    let key = |name: &str| format!("{section} {name}");
    match time.step {
        StepRule::Automatic(safety) => SAFETY.check(&key("safety"), safety)?,
        StepRule::Fixed(step) => {
            POSITIVE.check(&key("step"), step)?;
            if !time.is_quasi_static() && step > length * (1.0 + UP_TO_ROUNDING) {
                let (step, length) = (format_number(step), format_number(length));
                let fault = format!("{step} s is longer than the run or stage, {length} s");
                return Err(wrong(&key("step"), fault));
            }
        }
    }
    POSITIVE.check(&key("density_scale"), time.density_scale)?;
    match time.method {
        Method::Explicit => {}
        Method::Relaxation(rule) => {
            at_least_one(&key("relaxation load_steps"), rule.load_steps)?;
            PROPER_FRACTION.check(&key("relaxation tolerance"), rule.tolerance)?;
            at_least_one(&key("relaxation iterations"), rule.iterations)?;
        }
        Method::Static(rule) => {
            at_least_one(&key("static load_steps"), rule.load_steps)?;
            PROPER_FRACTION.check(&key("static tolerance"), rule.tolerance)?;
            at_least_one(&key("static max_iterations"), rule.max_iterations)?;
            if rule.max_halvings > MOST_HALVINGS {
                let found = rule.max_halvings;
                let fault = format!("must be at most {MOST_HALVINGS}, is {found}");
                return Err(wrong(&key("static max_halvings"), fault));
            }
        }
    }
    match &time.adaptive {
        None => Ok(()),
        Some(_) if time.is_quasi_static() => {
            let method = time.method.name();
            let fault =
                format!("is not available with the method `{method}`, which has no time steps");
            Err(wrong(&key("adaptive"), fault))
        }
        Some(rule) => adaptive(&key("adaptive"), rule),
    }
}

fn adaptive(section: &str, rule: &Adaptive) -> Result<()> {
    let key = |name: &str| format!("{section} {name}");
    at_least_one(&key("most_broken"), rule.most_broken)?;
    at_least_one(&key("steps"), rule.steps)?;
    if rule.stable_broken > rule.most_broken {
        let fault = format!(
            "must be at most `most_broken`, {}, is {}",
            rule.most_broken, rule.stable_broken
        );
        return Err(wrong(&key("stable_broken"), fault));
    }
    PROPER_FRACTION.check(&key("reduce"), rule.reduce)?;
    ABOVE_ONE.check(&key("raise"), rule.raise)?;
    optional(&key("smallest"), rule.smallest, &POSITIVE)?;
    optional(&key("largest"), rule.largest, &POSITIVE)?;
    match (rule.smallest, rule.largest) {
        (Some(low), Some(high)) if low > high * (1.0 + UP_TO_ROUNDING) => {
            let (low, high) = (format_number(low), format_number(high));
            let fault = format!("{low} s is more than `largest`, {high} s");
            Err(wrong(&key("smallest"), fault))
        }
        _ => Ok(()),
    }
}
