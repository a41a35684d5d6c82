//! Comparison of the physics of a run with the physics of its checkpoint.

use crate::deck::{self, Source};
use crate::error::Result;
use crate::problem::{Body, Calibration, DamageRule, History, Output, Problem};

/// First line of the description of a problem without a deck.
const WITHOUT_DECK: &str = "# a problem without a deck\n";

/// Separator between the physics and the history definitions, in the description of a problem without a
/// deck.
const HISTORY: &str = "# its history\n";

/// Maximum length of a line in a message, in characters.
const MAX_LINE: usize = 100;

/// Maximum number of differences in a message.
const MAX_DIFFERENCES: usize = 5;

/// Describe the physics of a run: the deck of the run with all defaults filled in, if it is given as `deck`,
/// or else a listing of the problem.
pub fn describe(problem: &Problem, deck: Option<&str>) -> String {
    if let Some(deck) = deck {
        return deck.to_owned();
    }
    let mut problem = problem.clone();
    // Clear all settings that may change at a restart.
    problem.warnings.clear();
    problem.title.clear();
    if let Some(last) = problem.stages.last_mut() {
        last.time.end = 0.0;
    }
    problem.time.end = 0.0;
    problem.further_outputs.clear();
    problem.output = Output::default();
    // A restart may change the interval of history rows without starting a new result file.
    let history = History {
        every: None,
        ..std::mem::take(&mut problem.history)
    };
    problem.checkpoint = Default::default();
    problem.balance = None;
    format!("{WITHOUT_DECK}{problem:#?}\n{HISTORY}{history:#?}\n")
}

/// Return the name of the attribute of a result that contains a description by [`describe`].
pub fn attribute(physics: &str) -> &'static str {
    if physics.starts_with(WITHOUT_DECK) {
        "problem"
    } else {
        "deck_in_full"
    }
}

/// Return the name for the settings that a run compares with those of its checkpoint: `deck` or `problem`.
/// `described` is the description of the run.
pub fn subject(described: &str) -> &'static str {
    if described.starts_with(WITHOUT_DECK) {
        "problem"
    } else {
        "deck"
    }
}

/// Return the first difference between a problem and the problem of its deck, except in settings that a
/// restart may change; `None` without a difference.
pub fn difference_from_deck(problem: &Problem, of_deck: &Problem) -> Option<String> {
    let [own, of_deck] = [problem, of_deck].map(|problem| {
        let mut problem = problem.clone();
        problem.bodies.iter_mut().for_each(forget_calibration);
        describe(&problem, None)
    });
    listed_differences(&of_deck, &own).pop()
}

/// Remove the separation energy ratio of a body: a deck has none, but a caller may pass a calibrated problem.
fn forget_calibration(body: &mut Body) {
    let rule = body.damage.as_mut().map(|damage| &mut damage.rule);
    if let Some(DamageRule::Energy {
        calibration: Calibration::Opening(ratio),
        ..
    }) = rule
    {
        *ratio = None;
    }
}

/// Return the differences in the definitions of the history's columns, in one line; `None` if the definitions
/// are equal.
///
/// # Errors
/// If a deck cannot be parsed.
pub fn history_differences(old: &str, new: &str) -> Result<Option<String>> {
    let lines = if old.starts_with(WITHOUT_DECK) {
        let [old, new] = [old, new].map(|text| text.split_once(HISTORY).unwrap_or_default().1);
        listed_differences(old, new)
    } else {
        deck::history_differences(&source("the checkpoint", old), &source("the deck", new))?
    };
    Ok(in_one_line(&lines))
}

/// Join the first differences to one line; `None` if there are none.
pub fn in_one_line(differences: &[String]) -> Option<String> {
    let short = |line: &String| line.chars().take(MAX_LINE).collect::<String>();
    let shown = differences.iter().take(MAX_DIFFERENCES).map(short);
    let shown: Vec<String> = shown.collect();
    (!shown.is_empty()).then(|| shown.join("; "))
}

fn source(name: &str, text: &str) -> Source {
    Source::new(name, text)
}

/// Return the differences in the physics, one per entry; empty if there are none.
///
/// # Errors
/// If a deck cannot be parsed.
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

/// Return the first line that differs in two listings, or a note that one listing has more lines; empty if
/// the listings are equal.
fn listed_differences(old: &str, new: &str) -> Vec<String> {
    let short = |line: &str| line.trim().chars().take(MAX_LINE).collect::<String>();
    let mut lines = old.lines().zip(new.lines());
    let differs = lines.find(|(old, new)| old != new);
    match differs {
        Some((old, new)) => vec![format!("was `{}`, is `{}`", short(old), short(new))],
        None if old.len() != new.len() => vec!["one says more than the other".to_owned()],
        None => Vec::new(),
    }
}
