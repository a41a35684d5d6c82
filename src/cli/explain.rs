//! `fissure explain`: a deck with every default filled in.

use fissure::deck;
use fissure::error::Result;

use super::{DeckArguments, print};

/// Prints the deck.
///
/// # Errors
/// When the deck is wrong or the output is full.
pub fn explain(arguments: &DeckArguments) -> Result<()> {
    print(&deck::read(&arguments.deck, &arguments.set)?.explain()?)
}
