//! Validation of the settings for results (content and interval), checkpoints and rebalancing.

use super::fields::output_field;
use super::grammar::{self, Balance, Deck};
use super::resolve::Scope;
use super::sets::find_set;
use crate::deck::spanned::Spanned;
use crate::error::Result;
use crate::message::format_number;
use crate::problem::{self, check::file_fault};

/// Validate the main result; `end` is the end of the run, s.
///
/// # Errors
/// On an unknown field or set, a field that is named twice, and an invalid interval or time.
pub fn output(
    scope: &Scope,
    deck: &Deck,
    sets: &[problem::Set],
    end: f64,
) -> Result<problem::Output> {
    of_table(scope, (None, &deck.output.get_ref().main), sets, end)
}

/// Validate the further results; `end` is the end of the run, s.
///
/// # Errors
/// The errors of [`output`]. There is also an error if a name cannot be part of a file name, contains
/// `until_step_`, or differs from another name only in upper and lower case.
pub fn further_outputs(
    scope: &Scope,
    deck: &Deck,
    sets: &[problem::Set],
    end: f64,
) -> Result<Vec<problem::Output>> {
    let tables = &deck.output.get_ref().further;
    let mut found: Vec<problem::Output> = Vec::new();
    for (name, table) in tables {
        let others = found.iter().filter_map(|output| output.name.as_ref());
        if let Some(fault) = file_fault(name, others) {
            return Err(scope.error(table.span(), format!("[output.{name}]: {fault}")));
        }
        found.push(of_table(scope, (Some(name), table.get_ref()), sets, end)?);
    }
    Ok(found)
}

/// Validate the main result (no name) or a further result (with a name).
fn of_table(
    scope: &Scope,
    (name, output): (Option<&String>, &grammar::Output),
    sets: &[problem::Set],
    end: f64,
) -> Result<problem::Output> {
    let section = name.map_or("[output]".to_owned(), |name| format!("[output.{name}]"));
    let fields = match &output.fields {
        None => problem::DEFAULT_FIELDS.to_vec(),
        Some(fields) => fields
            .iter()
            .map(|field| output_field(scope, field, &format!("{section} fields")))
            .collect::<Result<Vec<_>>>()?,
    };
    if let Some(twice) = (1..fields.len()).find(|k| fields[..*k].contains(&fields[*k])) {
        let place = output
            .fields
            .as_ref()
            .map_or(0..0, |fields| fields[twice].span());
        let message = format!(
            "{section} fields: `{}` is named twice",
            fields[twice].name()
        );
        return Err(scope.error(place, message));
    }
    Ok(problem::Output {
        name: name.cloned(),
        every: every(scope, &section, output, end)?,
        times: times(scope, &section, output, end)?,
        fields,
        single: output.precision == grammar::Precision::Single,
        set: match &output.set {
            None => None,
            Some(name) => {
                let key = format!("{section} set");
                Some((find_set(scope, name, sets, &key)?, name.span()))
            }
        },
    })
}

/// Return the interval of outputs; `None` if only `times` are given.
fn every(
    scope: &Scope,
    section: &str,
    output: &grammar::Output,
    end: f64,
) -> Result<Option<problem::Interval>> {
    let default = problem::Interval::Seconds(end / problem::OUTPUTS);
    match (&output.every, &output.every_steps) {
        (None, None) => Ok(output.times.is_none().then_some(default)),
        (Some(every), None) => {
            let seconds = scope.positive(every, &format!("{section} every"))?;
            Ok(Some(problem::Interval::Seconds(seconds)))
        }
        (None, Some(steps)) => Ok(Some(problem::Interval::Steps(steps.get_ref().get()))),
        (Some(_), Some(steps)) => {
            let message = format!("{section} every_steps: give either `every` or `every_steps`");
            Err(scope.error(steps.span(), message))
        }
    }
}

/// Return the given times of outputs in ascending order and without duplicates, s.
fn times(scope: &Scope, section: &str, output: &grammar::Output, end: f64) -> Result<Vec<f64>> {
    let Some(written) = &output.times else {
        return Ok(Vec::new());
    };
    let key = &format!("{section} times");
    if written.get_ref().is_empty() {
        let message = format!("{key}: must have at least one time; leave it out for the default");
        return Err(scope.error(written.span(), message));
    }
    // A time may exceed the end by round-off.
    let range = 0.0..end * (1.0 + 1e-9);
    let words = format!(
        "between 0 and {} s (the end of the run)",
        format_number(end)
    );
    let time = |time| scope.within(time, key, range.clone(), &words);
    let mut times = written
        .get_ref()
        .iter()
        .map(time)
        .collect::<Result<Vec<_>>>()?;
    times.sort_by(f64::total_cmp);
    times.dedup();
    Ok(times)
}

/// Validate the settings of the rebalancing. Return `None` for a deck without `[balance]`.
///
/// # Errors
/// If `imbalance` is below 1. Points are rebalanced when the time of the slowest rank, divided by the mean
/// time of all ranks, exceeds `imbalance`; this ratio is never below 1.
pub fn balance(scope: &Scope, deck: &Deck) -> Result<Option<problem::Balance>> {
    let rule = |table: &Spanned<Balance>| {
        let table = table.get_ref();
        let key = "[balance] imbalance";
        Ok(problem::Balance {
            every_steps: table.every_steps.get_ref().get(),
            imbalance: scope.within(&table.imbalance, key, 1.0..f64::INFINITY, "1 or more")?,
        })
    };
    deck.balance.as_ref().map(rule).transpose()
}

/// Validate the interval of checkpoints.
///
/// # Errors
/// On an invalid interval, or on more than one interval.
pub fn checkpoint(scope: &Scope, deck: &Deck) -> Result<problem::CheckpointRule> {
    use problem::{CheckpointRule, Interval};
    let table = deck.checkpoint.get_ref();
    match (&table.every, &table.every_steps, &table.every_time) {
        (None, None, None) => Ok(CheckpointRule::default()),
        (Some(every), None, None) => match duration(every.get_ref()) {
            Some(seconds) => Ok(CheckpointRule::WallClock(seconds)),
            None => {
                let message = format!(
                    "[checkpoint] every: must be a wall-clock time such as \"10 min\", \"90 s\" or \
                     \"2 h\", is \"{}\"",
                    every.get_ref()
                );
                Err(scope.error(every.span(), message))
            }
        },
        (None, Some(steps), None) => {
            let interval = Interval::Steps(steps.get_ref().get());
            Ok(CheckpointRule::Simulation(interval))
        }
        (None, None, Some(time)) => {
            let seconds = scope.positive(time, "[checkpoint] every_time")?;
            Ok(CheckpointRule::Simulation(Interval::Seconds(seconds)))
        }
        _ => {
            let message = "[checkpoint]: give only one of `every`, `every_steps` and `every_time`";
            Err(scope.error(deck.checkpoint.span(), message))
        }
    }
}

/// Parse a number with the unit s, min or h, and return seconds; `None` for any other text, and for a number
/// that is not above 0.
fn duration(text: &str) -> Option<f64> {
    let units = [("min", 60.0), ("s", 1.0), ("h", 3600.0)];
    let (number, factor) = units
        .into_iter()
        .find_map(|(unit, factor)| Some((text.trim().strip_suffix(unit)?, factor)))?;
    let seconds = factor * number.trim().parse::<f64>().ok()?;
    (seconds > 0.0 && seconds.is_finite()).then_some(seconds)
}
