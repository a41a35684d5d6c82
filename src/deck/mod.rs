//! Decks: the TOML file that describes a run, from its text to a validated [`Plan`].

mod bodies;
mod conditions;
mod explain;
pub mod expression;
pub mod grammar;
mod materials;
mod number;
mod outputs;
mod parameters;
pub mod plan;
mod resolve;
mod sets;
mod shapes;
pub mod source;
mod toml_error;
mod validate;

use std::path::Path;

pub use explain::explain;
pub use plan::Plan;
pub use source::Source;

use crate::error::Result;

/// The commented deck that `fissure init` writes.
pub const EXAMPLE: &str = include_str!("example.toml");

/// Reads and validates a deck.
///
/// # Errors
/// An input error that names file, line, column and key and says what would be right.
pub fn load(path: &Path) -> Result<Plan> {
    parse(&Source::read(path)?)
}

/// Validates a deck's text.
///
/// # Errors
/// As [`load`].
pub fn parse(source: &Source) -> Result<Plan> {
    validate::validate(source, &grammar(source)?)
}

fn grammar(source: &Source) -> Result<grammar::Deck> {
    toml::from_str(&source.text).map_err(|error| toml_error::toml_error(source, &error))
}
