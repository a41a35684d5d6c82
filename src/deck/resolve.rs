//! Numbers, vectors and expressions of a deck, evaluated against its parameters.

use std::ops::Range;

use indexmap::IndexMap;

use super::expression::{Expression, Variable};
use super::number::{Number, Vector, Written};
use super::source::{Source, suggestion};
use crate::error::{Error, Result};

/// The deck's text, its parameters and its dimension: what values are resolved against.
pub struct Scope<'a> {
    /// For errors.
    pub source: &'a Source,
    /// Named numbers.
    pub parameters: IndexMap<String, f64>,
    /// Number of components of a vector.
    pub dimension: usize,
}

impl<'a> Scope<'a> {
    /// Evaluates the parameters, which may build on one another in any order.
    ///
    /// # Errors
    /// On a name that hides a variable, on an unknown name and on a circle.
    pub fn new(
        source: &'a Source,
        dimension: usize,
        written: &IndexMap<String, Number>,
    ) -> Result<Self> {
        let mut scope = Self {
            source,
            parameters: IndexMap::new(),
            dimension,
        };
        for (name, number) in written {
            let identifier = name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
                && !name.starts_with(|c: char| c.is_ascii_digit());
            if !identifier || RESERVED.contains(&name.as_str()) {
                let message = format!(
                    "[parameters] {name}: not a name that an expression can use; letters, digits \
                     and `_`, but none of {}",
                    RESERVED.join(", ")
                );
                return Err(source.error(number.span(), message));
            }
        }
        // Each round resolves whatever depends on resolved names only.
        while scope.parameters.len() < written.len() {
            let before = scope.parameters.len();
            for (name, number) in written {
                if scope.parameters.contains_key(name) {
                    continue;
                }
                let needs = match number.get_ref() {
                    Written::Value(_) => Vec::new(),
                    Written::Text(text) => Expression::names(text).unwrap_or_default(),
                };
                let waits = |need: &String| {
                    written.contains_key(need) && !scope.parameters.contains_key(need)
                };
                if !needs.iter().any(waits) {
                    let value = scope.number(number, &format!("[parameters] {name}"))?;
                    scope.parameters.insert(name.clone(), value);
                }
            }
            if scope.parameters.len() == before {
                let circle = written
                    .iter()
                    .find(|(name, _)| !scope.parameters.contains_key(*name));
                let (name, number) = circle.expect("some parameter is not resolved");
                let message = format!("[parameters] {name}: depends on itself");
                return Err(source.error(number.span(), message));
            }
        }
        Ok(scope)
    }

    /// An error at a place of the deck.
    pub fn error(&self, span: Range<usize>, message: impl AsRef<str>) -> Error {
        self.source.error(span, message)
    }

    /// A finite number.
    pub fn number(&self, number: &Number, key: &str) -> Result<f64> {
        let value = self
            .expression(number, key, &[])?
            .as_constant()
            .expect("an expression without variables is a constant");
        if value.is_finite() {
            Ok(value)
        } else {
            Err(self.error(number.span(), format!("{key}: must be finite, is {value}")))
        }
    }

    /// A number above 0.
    pub fn positive(&self, number: &Number, key: &str) -> Result<f64> {
        self.within(number, key, f64::MIN_POSITIVE..f64::INFINITY, "above 0")
    }

    /// A number within a range, which `words` describes.
    pub fn within(
        &self,
        number: &Number,
        key: &str,
        range: Range<f64>,
        words: &str,
    ) -> Result<f64> {
        let value = self.number(number, key)?;
        if range.contains(&value) {
            Ok(value)
        } else {
            Err(self.error(number.span(), format!("{key}: must be {words}, is {value}")))
        }
    }

    /// An expression of the given variables (z and y only where the dimension has them).
    pub fn expression(
        &self,
        number: &Number,
        key: &str,
        variables: &[Variable],
    ) -> Result<Expression> {
        let text = match number.get_ref() {
            Written::Value(value) => return Ok(Expression::constant(*value)),
            Written::Text(text) => text,
        };
        let allowed: Vec<Variable> = variables
            .iter()
            .copied()
            .filter(|variable| match variable {
                Variable::Y => self.dimension > 1,
                Variable::Z => self.dimension > 2,
                Variable::X | Variable::T => true,
            })
            .collect();
        let names: Vec<&str> = self.parameters.keys().map(String::as_str).collect();
        let lookup = |name: &str| self.parameters.get(name).copied();
        Expression::parse(text, &lookup, &names, &allowed).map_err(|error| {
            let span = number.span();
            // Offsets in the text are offsets in the file where the string has plain quotes and no
            // escapes; elsewhere the whole string is marked.
            let inner = span.start + 1..span.end.saturating_sub(1);
            let marked = if self.source.text.get(inner.clone()) == Some(text.as_str()) {
                let end = (inner.start + error.end).max(inner.start + error.start + 1);
                inner.start + error.start..end
            } else {
                span
            };
            self.error(marked, format!("{key}: {}", error.message))
        })
    }

    fn entries<'v>(&self, vector: &'v Vector, key: &str) -> Result<&'v [Number]> {
        let entries = vector.get_ref();
        if entries.len() == self.dimension {
            return Ok(entries);
        }
        let message = format!(
            "{key}: must have {} entries, one a dimension, has {}",
            self.dimension,
            entries.len()
        );
        Err(self.error(vector.span(), message))
    }

    /// A vector of numbers; components beyond the dimension are 0.
    pub fn vector(&self, vector: &Vector, key: &str) -> Result<[f64; 3]> {
        let mut values = [0.0; 3];
        for (value, entry) in values.iter_mut().zip(self.entries(vector, key)?) {
            *value = self.number(entry, key)?;
        }
        Ok(values)
    }

    /// A vector of unit length.
    pub fn direction(&self, vector: &Vector, key: &str) -> Result<[f64; 3]> {
        let values = self.vector(vector, key)?;
        let length = values.iter().map(|value| value * value).sum::<f64>().sqrt();
        if length > 0.0 {
            Ok(values.map(|value| value / length))
        } else {
            Err(self.error(vector.span(), format!("{key}: must not be zero")))
        }
    }

    /// One expression a component.
    pub fn expressions(
        &self,
        vector: &Vector,
        key: &str,
        variables: &[Variable],
    ) -> Result<Vec<Expression>> {
        self.entries(vector, key)?
            .iter()
            .map(|entry| self.expression(entry, key, variables))
            .collect()
    }

    /// One expression a component, or none where the deck says `"free"`.
    pub fn motion(&self, vector: &Vector, key: &str) -> Result<Vec<Option<Expression>>> {
        let free = Written::Text("free".to_owned());
        let motion = self
            .entries(vector, key)?
            .iter()
            .map(|entry| {
                let bound = *entry.get_ref() != free;
                let parse = || self.expression(entry, key, &ALL_VARIABLES);
                bound.then(parse).transpose()
            })
            .collect::<Result<Vec<_>>>()?;
        if motion.iter().all(Option::is_none) {
            let message = format!("{key}: every component is free, so this does nothing");
            return Err(self.error(vector.span(), message));
        }
        Ok(motion)
    }
}

/// Words that mean something else in an expression.
const RESERVED: [&str; 8] = ["x", "y", "z", "t", "pi", "and", "or", "not"];

/// Position and time.
pub const ALL_VARIABLES: [Variable; 4] = [Variable::X, Variable::Y, Variable::Z, Variable::T];

/// Position only.
pub const POSITION: [Variable; 3] = [Variable::X, Variable::Y, Variable::Z];

/// The index of `name` in `names`, or an error that names the nearest.
pub fn find<'n>(
    source: &Source,
    name: &super::grammar::Text,
    names: impl Iterator<Item = &'n str> + Clone,
    key: &str,
) -> Result<usize> {
    let wanted = name.get_ref().as_str();
    names
        .clone()
        .position(|known| known == wanted)
        .ok_or_else(|| {
            let message = format!(
                "{key}: no such name `{wanted}`{}",
                suggestion(wanted, names)
            );
            source.error(name.span(), message)
        })
}
