//! The names that a deck gives to its tables: they become those of columns, and stand in messages.

use super::grammar::{Deck, NamedTable};
use super::resolve::Scope;
use crate::deck::spanned::Spanned;
use crate::error::{Result, excerpt};

/// The most characters of a name.
const LONGEST: usize = 64;

/// Looks at all names, and at the title.
///
/// # Errors
/// On the first one that cannot be printed on a line or written to a table.
pub fn names(scope: &Scope, deck: &Deck) -> Result<()> {
    if deck.title.get_ref().contains(char::is_control) {
        let message = "title: must be one line of text, without control characters";
        return Err(scope.error(deck.title.span(), message));
    }
    for NamedTable {
        section,
        name,
        span,
    } in deck.named_tables()
    {
        let wrong = |c: char| c.is_control() || matches!(c, '"' | '\'' | '\\');
        if name.is_empty() || name.contains(wrong) || name.chars().nth(LONGEST).is_some() {
            let message = format!(
                "[{section}]: the name {} must have 1 to {LONGEST} characters, among them no quotes, \
                 backslashes or control characters",
                excerpt(name)
            );
            return Err(scope.error(span, message));
        }
    }
    Ok(())
}

/// An error if a name cannot be part of the name of a column; `key` and `place` say where it stands.
///
/// # Errors
/// On a name with a character that separates parts of such names, or columns.
pub fn suits_a_column<T>(scope: &Scope, key: &str, name: &str, place: &Spanned<T>) -> Result<()> {
    if name.contains(['/', '.', ',']) {
        let message = format!(
            "{key}: the name becomes that of columns, so it must not contain `/`, `.` or `,`"
        );
        return Err(scope.error(place.span(), message));
    }
    Ok(())
}
