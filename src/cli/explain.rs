//! `fissure explain`: a deck with every default filled in.

use fissure::deck::{self, Source};
use fissure::error::Result;

use super::DeckArguments;

/// Prints the deck.
///
/// # Errors
/// When the deck is wrong.
pub fn explain(arguments: &DeckArguments) -> Result<()> {
    print!("{}", deck::explain(&Source::read(&arguments.deck)?)?);
    Ok(())
}
