//! Results, checkpoints and rebalancing.

use super::allowed::{AT_LEAST_ONE, POSITIVE};
use super::{at_least_one, file_fault, wrong};
use crate::error::Result;
use crate::message::format_number;
use crate::problem::{CheckpointRule, Field, Interval, Output, Problem};

/// Relative round-off by which the time of an output may exceed the end of the run.
const UP_TO_ROUNDING: f64 = 1e-9;

/// Check the results, the checkpoints and the rebalancing.
///
/// # Errors
/// On an interval, time, set, field or name that is not allowed.
pub fn outputs(problem: &Problem) -> Result<()> {
    if problem.output.name.is_some() {
        return Err(wrong("[output]", "the main result has no name"));
    }
    for (number, output) in problem.further_outputs.iter().enumerate() {
        let Some(name) = &output.name else {
            return Err(wrong("[output]", "a further result needs a name"));
        };
        let others = &problem.further_outputs[..number];
        if let Some(fault) = file_fault(name, others.iter().filter_map(|other| other.name.as_ref()))
        {
            return Err(wrong(&output.section(), fault));
        }
    }
    for output in problem.outputs() {
        result(problem, output)?;
    }
    match problem.checkpoint {
        CheckpointRule::WallClock(seconds) => POSITIVE.check("[checkpoint] every", seconds)?,
        CheckpointRule::Simulation(every) => interval("[checkpoint]", every)?,
    }
    if let Some(balance) = problem.balance {
        at_least_one("[balance] every_steps", balance.every_steps)?;
        AT_LEAST_ONE.check("[balance] imbalance", balance.imbalance)?;
    }
    Ok(())
}

fn result(problem: &Problem, output: &Output) -> Result<()> {
    let section = output.section();
    if let Some(every) = output.every {
        interval(&section, every)?;
    }
    let (key, end) = (format!("{section} times"), problem.time.end);
    let range = 0.0..=end * (1.0 + UP_TO_ROUNDING);
    if let Some(time) = output.times.iter().find(|time| !range.contains(time)) {
        let [end, time] = [end, *time].map(format_number);
        let fault = format!("must be between 0 and {end} s (the end of the run), is {time} s");
        return Err(wrong(&key, fault));
    }
    if !output.times.is_sorted_by(|a, b| a < b) {
        return Err(wrong(&key, "must be in ascending order, each time once"));
    }
    fields_are_different(&section, &output.fields)?;
    match &output.set {
        None => Ok(()),
        Some((set, _)) => problem.check_set(&format!("{section} set"), *set),
    }
}

/// Check that a list names no field twice.
pub(super) fn fields_are_different(section: &str, fields: &[Field]) -> Result<()> {
    match (1..fields.len()).find(|k| fields[..*k].contains(&fields[*k])) {
        None => Ok(()),
        Some(twice) => Err(wrong(
            &format!("{section} fields"),
            format!("`{}` is named twice", fields[twice].name()),
        )),
    }
}

/// Check an interval; `section` is the section that contains it.
pub(super) fn interval(section: &str, interval: Interval) -> Result<()> {
    let (seconds, steps) = match interval {
        Interval::Seconds(seconds) => (Some(seconds), None),
        Interval::Steps(steps) => (None, Some(steps)),
        Interval::SecondsAtSteps { seconds, steps } => (Some(seconds), Some(steps)),
    };
    super::optional(&format!("{section} every"), seconds, &POSITIVE)?;
    steps.map_or(Ok(()), |steps| {
        at_least_one(&format!("{section} every_steps"), steps)
    })
}
