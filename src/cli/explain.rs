//! `fissure explain`: a deck with every default filled in.

use fissure::deck;
use fissure::error::Result;

use super::{DeckArguments, each, print};

/// Prints the decks.
///
/// # Errors
/// When a deck is wrong or the output is full.
pub fn explain(arguments: &DeckArguments) -> Result<()> {
    each(&arguments.decks, |deck| {
        print(&deck::read(deck, &arguments.set)?.explain()?)
    })
}
