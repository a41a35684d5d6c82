//! `fissure explain`: a deck with every default written out.

use fissure::deck;
use fissure::error::Result;

use super::{DeckArguments, each, print};

/// Print the decks with all defaults.
///
/// # Errors
/// If a deck is invalid or the output cannot be written.
pub fn explain(arguments: &DeckArguments) -> Result<()> {
    each(&arguments.decks, |deck| {
        print(&deck::read_with(deck, &arguments.with, &arguments.set)?.explain()?)
    })
}
