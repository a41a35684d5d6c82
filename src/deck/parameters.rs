//! The named numbers of a deck, which may refer to each other in any order.

use indexmap::IndexMap;

use super::grammar::Text;
use super::number::{Number, Written};
use super::resolve::Scope;
use super::source::Source;
use crate::deck::spanned::Spanned;
use crate::error::{Error, Result};
use crate::expression::Expression;
use crate::message::suggestion;

/// Reserved names: words that have a meaning in expressions, and `free`. In place of an expression, `free`
/// leaves a component of displacement or velocity unprescribed.
const RESERVED: [&str; 9] = ["x", "y", "z", "t", "pi", "and", "or", "not", "free"];

/// Evaluate the parameters, and store their values in the scope.
///
/// # Errors
/// - If expressions cannot use the name of a parameter, see [`name_fault`].
/// - If an expression or value is invalid.
/// - If an expression contains an unknown name.
/// - If the definition of a parameter is circular.
pub fn evaluate(scope: &mut Scope, written: &IndexMap<Text, Number>) -> Result<()> {
    for name in written.keys() {
        let text = name.get_ref();
        if let Some(fault) = name_fault(text) {
            let message = format!("[parameters] {text}: not a name for a parameter; {fault}");
            return Err(scope.error(name.span(), message));
        }
    }
    // Each round evaluates the parameters that depend only on parameters that are already evaluated.
    while scope.parameters.len() < written.len() {
        let before = scope.parameters.len();
        for (name, number) in written {
            let resolved = scope.parameters.contains_key(name.get_ref());
            if !resolved && awaited(scope, written, number).is_none() {
                let value = scope.number(number, &format!("[parameters] {}", name.get_ref()))?;
                scope.parameters.insert(name.get_ref().clone(), value);
            }
        }
        if scope.parameters.len() == before {
            return Err(circle(scope, written));
        }
    }
    Ok(())
}

/// Return the reason why expressions cannot use a name; `None` for a valid name.
pub fn name_fault(name: &str) -> Option<String> {
    let is_identifier = name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
        && !name.is_empty()
        && !name.starts_with(|c: char| c.is_ascii_digit());
    let is_possible = is_identifier && !RESERVED.contains(&name);
    (!is_possible).then(|| {
        format!(
            "it must consist of letters, digits and `_`, must not start with a digit, and must not be one of {}",
            RESERVED.join(", ")
        )
    })
}

/// Replace the value or expression of a parameter.
///
/// # Errors
/// If the deck has no such parameter, or the value is not an expression.
pub fn set(
    source: &Source,
    parameters: &mut IndexMap<Text, Number>,
    name: &str,
    value: &str,
) -> Result<()> {
    let known: Vec<String> = parameters
        .keys()
        .map(|name| name.get_ref().clone())
        .collect();
    let found = parameters
        .iter_mut()
        .find(|(known, _)| known.get_ref() == name);
    let Some((_, number)) = found else {
        let names = known.iter().map(String::as_str);
        return Err(Error::input(format!(
            "--set {name}={value}: [parameters] of {} has no `{name}`{}",
            source.path.display(),
            suggestion(name, names)
        )));
    };
    let written = match value.parse::<f64>() {
        Ok(value) => Written::Value(value),
        Err(_) => Written::Text(value.to_owned()),
    };
    if let Written::Text(text) = &written {
        Expression::names(text)
            .map_err(|error| Error::input(format!("--set {name}={value}: {}", error.message)))?;
    }
    *number = Spanned::new(number.span(), written);
    Ok(())
}

/// Return the index of the first parameter that a number needs and that is not evaluated yet.
fn awaited(scope: &Scope, written: &IndexMap<Text, Number>, number: &Number) -> Option<usize> {
    let Written::Text(text) = number.get_ref() else {
        return None;
    };
    let needs = Expression::names(text).unwrap_or_default();
    needs
        .iter()
        .filter(|need| !scope.parameters.contains_key(*need))
        .find_map(|need| written.get_index_of(need.as_str()))
}

/// Return the error about parameters with a circular definition.
fn circle(scope: &Scope, written: &IndexMap<Text, Number>) -> Error {
    let mut way: Vec<usize> = Vec::new();
    let mut next = written
        .values()
        .find_map(|number| awaited(scope, written, number));
    // Every unevaluated parameter leads to a circle, but need not be part of the circle.
    while let Some(index) = next.filter(|index| !way.contains(index)) {
        way.push(index);
        next = awaited(scope, written, &written[index]);
    }
    let start = way.iter().position(|index| Some(*index) == next);
    let circle = &mut way[start.unwrap_or(0)..];
    let first = (0..circle.len()).min_by_key(|k| circle[*k]).unwrap_or(0);
    circle.rotate_left(first);
    let name = |index: usize| {
        written
            .get_index(index)
            .map_or("", |(name, _)| name.get_ref())
    };
    let names: Vec<&str> = circle
        .iter()
        .chain([&circle[0]])
        .map(|k| name(*k))
        .collect();
    let message = format!(
        "[parameters] {}: depends on itself: {}",
        names[0],
        names.join(" → ")
    );
    scope.error(written[circle[0]].span(), message)
}
