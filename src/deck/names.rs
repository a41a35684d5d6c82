//! Check of the names of sections such as `[body.NAME]`. These names appear in column names and messages.

use super::grammar::{Deck, NamedTable};
use super::resolve::Scope;
use crate::deck::spanned::Spanned;
use crate::error::Result;
use crate::problem::check::{column_fault, name_fault};

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
        if let Some(fault) = name_fault(name) {
            return Err(scope.error(span, format!("[{section}]: {fault}")));
        }
    }
    Ok(())
}

/// Check that a name can be part of a column name; `key` and `place` locate the name for the error.
///
/// # Errors
/// On a name with `/`, `.` or `,`. These characters separate columns, or the parts of a column name.
pub fn suits_a_column<T>(scope: &Scope, key: &str, name: &str, place: &Spanned<T>) -> Result<()> {
    match column_fault(name) {
        None => Ok(()),
        Some(fault) => Err(scope.error(place.span(), format!("{key}: {fault}"))),
    }
}
