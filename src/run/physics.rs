//! What must be the same for a run to be continued.

use crate::deck::plan::{Interval, Output, Plan};
use crate::deck::{self, Source};
use crate::error::Result;

/// The first line of the physics of a plan without a deck.
const WITHOUT_DECK: &str = "# a plan without a deck\n";

/// The longest part of a line that a message shows.
const SHOWN: usize = 100;

/// The physics of a run as text: its deck with every default filled in, or else a listing of the plan.
pub fn describe(plan: &Plan, deck: Option<&str>) -> String {
    if let Some(deck) = deck {
        return deck.to_owned();
    }
    let mut plan = plan.clone();
    // What may change between the parts of a run.
    plan.source = Source::default();
    plan.warnings.clear();
    plan.title.clear();
    plan.time.end = 0.0;
    plan.output = Output {
        every: Interval::Steps(1),
        fields: Vec::new(),
    };
    plan.history.every = Interval::Steps(1);
    plan.history.reactions.clear();
    plan.history.damage_threshold = 0.0;
    plan.history.probes.clear();
    plan.history.fronts.clear();
    plan.history.tips.clear();
    plan.checkpoint = Default::default();
    plan.balance = None;
    format!("{WITHOUT_DECK}{plan:#?}\n")
}

/// What differs, a line each.
///
/// # Errors
/// When a deck cannot be parsed.
pub fn differences(old: &str, new: &str) -> Result<Vec<String>> {
    let [old_listed, new_listed] = [old, new].map(|text| text.starts_with(WITHOUT_DECK));
    if old_listed != new_listed {
        let line = "the one is a deck, the other a plan without a deck";
        return Ok(vec![line.to_owned()]);
    }
    if old_listed {
        return Ok(listed_differences(old, new));
    }
    let source = |name: &str, text: &str| Source {
        path: name.into(),
        text: text.to_owned(),
    };
    deck::differences(&source("the checkpoint", old), &source("the deck", new))
}

/// The first line that differs, if any.
fn listed_differences(old: &str, new: &str) -> Vec<String> {
    let short = |line: &str| line.trim().chars().take(SHOWN).collect::<String>();
    let mut lines = old.lines().zip(new.lines());
    let differs = lines.find(|(old, new)| old != new);
    match differs {
        Some((old, new)) => vec![format!("was `{}`, is `{}`", short(old), short(new))],
        None if old.len() != new.len() => vec!["one says more than the other".to_owned()],
        None => Vec::new(),
    }
}
