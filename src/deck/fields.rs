//! Search for output fields by name.

use super::grammar::Text;
use super::resolve::{Scope, find};
use crate::error::Result;
use crate::problem::Field;

/// Find a field for the list `fields` of a result.
///
/// # Errors
/// On an unknown name, and on the name of a field that results contain without request.
pub fn output_field(scope: &Scope, name: &Text, key: &str) -> Result<Field> {
    find_field(scope, name, &Field::ALL, key)
}

/// Find a field for the history. Ranks and fragments are excluded, because they are labels and not physical
/// quantities.
///
/// # Errors
/// On an unknown name, on the name of a label, and on the name of a field that results contain without
/// request.
pub fn history_field(scope: &Scope, name: &Text, key: &str) -> Result<Field> {
    let is_label = |field: &Field| matches!(field, Field::Rank | Field::Fragment);
    let (labels, quantities): (Vec<Field>, Vec<Field>) = Field::ALL.into_iter().partition(is_label);
    if labels.iter().any(|label| label.name() == name.get_ref()) {
        return unsuitable(
            scope,
            name,
            &quantities,
            key,
            "is a label of points, not a quantity",
        );
    }
    find_field(scope, name, &quantities, key)
}

/// Find a field among `fields` by name.
fn find_field(scope: &Scope, name: &Text, fields: &[Field], key: &str) -> Result<Field> {
    let reason = match name.get_ref().as_str() {
        "id" | "block" | "volume" => "is written to results without request and cannot be chosen",
        "level" => "is written to results of runs with `[refinement]` and cannot be chosen",
        _ => {
            let names = fields.iter().map(|field| field.name());
            return Ok(fields[find(scope.source, name, names, key)?]);
        }
    };
    unsuitable(scope, name, fields, key, reason)
}

/// Return an error for the name of a field that this key does not allow.
fn unsuitable(
    scope: &Scope,
    name: &Text,
    allowed: &[Field],
    key: &str,
    reason: &str,
) -> Result<Field> {
    let names: Vec<&str> = allowed.iter().map(|field| field.name()).collect();
    let message = format!(
        "{key}: `{}` {reason} (allowed: {})",
        name.get_ref(),
        names.join(", ")
    );
    Err(scope.error(name.span(), message))
}
