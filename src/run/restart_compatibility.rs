//! What must be the same for a run to be continued.

use crate::deck::{self, Source};
use crate::error::Result;
use crate::problem::{Interval, Output, Problem};

/// The first line of the physics of a problem without a deck.
const WITHOUT_DECK: &str = "# a problem without a deck\n";

/// What parts the physics of such a problem from the definitions of its history.
const HISTORY: &str = "# its history\n";

/// The longest part of a line that a message shows.
const SHOWN: usize = 100;

/// How many of the differences a message shows.
const MOST_SHOWN: usize = 5;

/// The physics of a run as text: its deck with every default filled in, or else a listing of the problem.
pub fn describe(problem: &Problem, deck: Option<&str>) -> String {
    if let Some(deck) = deck {
        return deck.to_owned();
    }
    let mut problem = problem.clone();
    // What may change between the parts of a run.
    problem.warnings.clear();
    problem.title.clear();
    if let Some(last) = problem.stages.last_mut() {
        last.time.end = 0.0;
    }
    problem.time.end = 0.0;
    problem.output = Output {
        every: Interval::Steps(1),
        fields: Vec::new(),
        single: false,
        set: None,
    };
    problem.history.every = Some(Interval::Steps(1));
    let history = problem.history.clone();
    problem.history.reactions.clear();
    problem.history.support_forces.clear();
    problem.history.damage_threshold = 0.0;
    problem.history.probes.clear();
    problem.history.fronts.clear();
    problem.history.cracks.clear();
    problem.history.tips.clear();
    problem.checkpoint = Default::default();
    problem.balance = None;
    format!("{WITHOUT_DECK}{problem:#?}\n{HISTORY}{history:#?}\n")
}

/// What differs in the meaning of the history's columns, in one line; nothing if it is the same.
///
/// # Errors
/// When a deck cannot be parsed.
pub fn history_differences(old: &str, new: &str) -> Result<Option<String>> {
    let lines = if old.starts_with(WITHOUT_DECK) {
        let [old, new] = [old, new].map(|text| text.split_once(HISTORY).unwrap_or_default().1);
        listed_differences(old, new)
    } else {
        deck::history_differences(&source("the checkpoint", old), &source("the deck", new))?
    };
    let short = |line: &String| line.chars().take(SHOWN).collect::<String>();
    let shown: Vec<String> = lines.iter().take(MOST_SHOWN).map(short).collect();
    Ok((!shown.is_empty()).then(|| shown.join("; ")))
}

fn source(name: &str, text: &str) -> Source {
    Source {
        path: name.into(),
        text: text.to_owned(),
    }
}

/// What differs, a line each.
///
/// # Errors
/// When a deck cannot be parsed.
pub fn differences(old: &str, new: &str) -> Result<Vec<String>> {
    let [old_listed, new_listed] = [old, new].map(|text| text.starts_with(WITHOUT_DECK));
    if old_listed != new_listed {
        let line = "the one is a deck, the other a problem without a deck";
        return Ok(vec![line.to_owned()]);
    }
    if old_listed {
        let physics = |text: &'_ str| text.split(HISTORY).next().unwrap_or_default().to_owned();
        return Ok(listed_differences(&physics(old), &physics(new)));
    }
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
