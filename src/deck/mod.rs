//! Decks: the TOML file that describes a run, from its text to a validated [`Plan`].

mod blocks;
mod bodies;
mod build;
mod conditions;
mod damage;
mod difference;
mod doubts;
mod explain;
pub mod expression;
pub mod grammar;
mod history;
mod interface;
mod law;
mod materials;
mod names;
mod number;
mod outputs;
mod parameters;
pub mod plan;
mod refinement;
mod resolve;
mod sets;
mod shapes;
pub mod source;
mod time;
mod toml_error;
mod validate;

use std::path::Path;

pub use difference::{differences, history_differences};
pub use number::shown;
pub use plan::Plan;
pub use source::Source;

use crate::error::Result;
use resolve::Scope;

/// The commented deck that `fissure init` writes.
pub const EXAMPLE: &str = include_str!("example.toml");

/// A deck whose text follows the grammar, not yet validated.
pub struct Deck {
    source: Source,
    grammar: grammar::Deck,
}

/// Reads a deck; `set` gives parameters, by name, other values or expressions.
///
/// # Errors
/// An input error that names file, line, column and key and says what would be right.
pub fn read(path: &Path, set: &[(String, String)]) -> Result<Deck> {
    let mut deck = Deck::new(Source::read(path)?)?;
    for (name, value) in set {
        parameters::set(&deck.source, &mut deck.grammar.parameters, name, value)?;
    }
    Ok(deck)
}

impl Deck {
    /// From a text.
    ///
    /// # Errors
    /// As [`read`].
    pub fn new(source: Source) -> Result<Self> {
        let grammar = toml::from_str(&source.text)
            .map_err(|error| toml_error::toml_error(&source, &error))?;
        Ok(Self { source, grammar })
    }

    /// The validated deck.
    ///
    /// # Errors
    /// As [`read`].
    pub fn plan(&self) -> Result<Plan> {
        let scope = Scope::of(&self.source, &self.grammar)?;
        let mut plan = validate::validate(&scope, &self.grammar)?;
        plan.warnings = doubts::doubts(&scope, &self.grammar, &plan)?;
        Ok(plan)
    }

    /// The deck as TOML with every default written out.
    ///
    /// # Errors
    /// As [`read`].
    pub fn explain(&self) -> Result<String> {
        explain::explain(&self.grammar, &self.plan()?)
    }
}

/// Validates a deck's text.
///
/// # Errors
/// As [`read`].
pub fn parse(source: &Source) -> Result<Plan> {
    Deck::new(source.clone())?.plan()
}

/// A deck's text with every default written out.
///
/// # Errors
/// As [`read`].
pub fn explain(source: &Source) -> Result<String> {
    Deck::new(source.clone())?.explain()
}
