//! Check of the names of sections such as `[body.NAME]`. These names appear in column names and messages.

use super::grammar::{Deck, NamedTable};
use super::resolve::Scope;
use crate::deck::spanned::Spanned;
use crate::error::{Result, excerpt};

/// Largest number of characters of a name.
const LONGEST: usize = 64;

/// Check the title and the names of all sections such as `[body.NAME]`.
///
/// # Errors
/// On a title with control characters. On the first name that is empty, has more than 64 characters, or
/// contains quotes, backslashes or control characters.
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
                "[{section}]: the name {} must have 1 to {LONGEST} characters, and must not contain quotes, \
                 backslashes or control characters",
                excerpt(name)
            );
            return Err(scope.error(span, message));
        }
    }
    Ok(())
}

/// Check that a name can be part of a column name; `key` and `place` locate the name for the error.
///
/// # Errors
/// On a name with `/`, `.` or `,`. These characters separate columns, or the parts of a column name.
pub fn suits_a_column<T>(scope: &Scope, key: &str, name: &str, place: &Spanned<T>) -> Result<()> {
    if name.contains(['/', '.', ',']) {
        let message = format!(
            "{key}: the name becomes part of column names, so it must not contain `/`, `.` or `,`"
        );
        return Err(scope.error(place.span(), message));
    }
    Ok(())
}
