//! What a deck writes to the result and the history, and how often; validated.

use std::num::NonZeroU64;

use serde_spanned::Spanned;

use super::grammar::Deck;
use super::number::Number;
use super::plan;
use super::resolve::{Scope, find, resolve_each};
use super::sets::find_sets;
use crate::error::Result;

fn interval(
    scope: &Scope,
    key: &str,
    every: &Option<Number>,
    every_steps: &Option<Spanned<NonZeroU64>>,
    default: f64,
) -> Result<plan::Interval> {
    match (every, every_steps) {
        (None, None) => Ok(plan::Interval::Seconds(default)),
        (Some(every), None) => scope
            .positive(every, &format!("{key} every"))
            .map(plan::Interval::Seconds),
        (None, Some(steps)) => Ok(plan::Interval::Steps(steps.get_ref().get())),
        (Some(_), Some(steps)) => Err(scope.error(
            steps.span(),
            format!("{key} every_steps: give either `every` or `every_steps`"),
        )),
    }
}

/// Validates what is written to the result; `end` (s) is the end of the run.
///
/// # Errors
/// On an unknown field and on a wrong interval.
pub fn output(scope: &Scope, deck: &Deck, end: f64) -> Result<plan::Output> {
    let output = deck.output.get_ref();
    let names = plan::Field::ALL.map(plan::Field::name);
    let fields = match &output.fields {
        None => DEFAULT_FIELDS.to_vec(),
        Some(fields) => fields
            .iter()
            .map(|field| {
                let index = find(scope.source, field, names.into_iter(), "[output] fields")?;
                Ok(plan::Field::ALL[index])
            })
            .collect::<Result<Vec<_>>>()?,
    };
    if let Some(twice) = (1..fields.len()).find(|k| fields[..*k].contains(&fields[*k])) {
        let place = output
            .fields
            .as_ref()
            .map_or(0..0, |fields| fields[twice].span());
        let message = format!("[output] fields: `{}` is named twice", fields[twice].name());
        return Err(scope.error(place, message));
    }
    Ok(plan::Output {
        every: interval(
            scope,
            "[output]",
            &output.every,
            &output.every_steps,
            end / 50.0,
        )?,
        fields,
    })
}

/// The fields of a result whose deck names none.
pub const DEFAULT_FIELDS: [plan::Field; 4] = [
    plan::Field::Displacement,
    plan::Field::Velocity,
    plan::Field::Damage,
    plan::Field::StrainEnergyDensity,
];

/// Damage above which a point counts as cracked if the deck does not say.
pub const DEFAULT_DAMAGE_THRESHOLD: f64 = 0.35;

/// Validates what is written to the history; `end` (s) is the end of the run.
///
/// # Errors
/// On an unknown set, a wrong place or number.
pub fn history(scope: &Scope, deck: &Deck, sets: &[plan::Set], end: f64) -> Result<plan::History> {
    let history = deck.history.get_ref();
    let damage_threshold = match &history.damage_threshold {
        None => DEFAULT_DAMAGE_THRESHOLD,
        Some(number) => {
            let key = "[history] damage_threshold";
            scope.within(number, key, 0.0..1.0, "at least 0 and below 1")?
        }
    };
    let probes = resolve_each(&history.probe, |name, probe| {
        scope.vector(&probe.get_ref().at, &format!("[history.probe.{name}] at"))
    })?;
    Ok(plan::History {
        every: interval(
            scope,
            "[history]",
            &history.every,
            &history.every_steps,
            end / 500.0,
        )?,
        reactions: find_sets(scope, &history.reactions, sets, "[history] reactions")?,
        damage_threshold,
        probes: probes.into_iter().collect(),
    })
}
