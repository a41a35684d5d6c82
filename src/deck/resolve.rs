//! Evaluation of the numbers, vectors and expressions of a deck.

use std::cell::RefCell;
use std::ops::Range;
use std::sync::Arc;

use indexmap::{IndexMap, IndexSet};
use nalgebra::Vector3;

use super::grammar::{Deck, DimensionName, Tables, Text};
use super::number::{Number, Vector, Written};
use super::source::Source;
use super::{names, parameters, tables};
use crate::deck::spanned::Spanned;
use crate::error::{Error, Result};
use crate::expression::{Expression, POSITION_AND_TIME, Table, Variable};
use crate::message::format_number;
use crate::message::suggestion;
use crate::problem::check::{Allowed, LENGTH};

/// Context for the evaluation of values: text, parameters, tables and dimension of the deck. In the methods,
/// `key` is the section and key in error messages, such as `[time] end`.
pub struct Scope<'a> {
    /// Text of the deck, for error messages.
    pub source: &'a Source,
    /// Values of the parameters by name.
    pub parameters: IndexMap<String, f64>,
    /// Tables by name.
    pub tables: IndexMap<String, Arc<Table>>,
    /// Number of components of a vector.
    pub dimension: usize,
    /// Section and name of each table that [`Self::find_used`] has looked up or that an expression uses.
    pub used: RefCell<IndexSet<(&'static str, String)>>,
}

impl<'a> Scope<'a> {
    /// Evaluate the parameters, which may refer to each other in any order, and read the tables.
    ///
    /// # Errors
    /// - If the title or a name is invalid.
    /// - If a parameter has an invalid expression, an unknown name or a circular definition.
    /// - If a table is invalid.
    pub fn of(source: &'a Source, deck: &Deck) -> Result<Self> {
        let mut scope = Self {
            source,
            parameters: IndexMap::new(),
            tables: IndexMap::new(),
            dimension: match deck.dimension.get_ref() {
                DimensionName::Line => 1,
                DimensionName::PlaneStress | DimensionName::PlaneStrain => 2,
                DimensionName::Space => 3,
            },
            used: RefCell::default(),
        };
        parameters::evaluate(&mut scope, &deck.parameters)?;
        names::names(&scope, deck)?;
        tables::read(&mut scope, deck)?;
        Ok(scope)
    }

    /// Add a parameter to the scope, call a function with this scope, and remove the parameter.
    pub fn with_parameter<T>(
        &mut self,
        name: &str,
        value: f64,
        evaluate: impl FnOnce(&Self) -> T,
    ) -> T {
        self.parameters.insert(name.to_owned(), value);
        let result = evaluate(self);
        self.parameters.shift_remove(name);
        result
    }

    /// Return an error at a byte range of the deck.
    pub fn error(&self, span: Range<usize>, message: impl AsRef<str>) -> Error {
        self.source.error(span, message)
    }

    /// Return the index of the table `name` in `names`, and mark the table as used. `names` are the known
    /// names of `section`.
    ///
    /// # Errors
    /// On an unknown name.
    pub fn find_used<'n>(
        &self,
        section: &'static str,
        name: &Text,
        names: impl Iterator<Item = &'n str> + Clone,
        key: &str,
    ) -> Result<usize> {
        let index = find(self.source, name, names, key)?;
        self.used
            .borrow_mut()
            .insert((section, name.get_ref().clone()));
        Ok(index)
    }

    /// Evaluate a number; a value that is not finite is an error.
    pub fn number(&self, number: &Number, key: &str) -> Result<f64> {
        let value = self.expression(number, key, &[])?.as_constant();
        Ok(value.expect("an expression without variables is a constant"))
    }

    /// Return a whole number. A number of 2⁶³ or more is an error, because it exceeds the limit of TOML
    /// integers.
    pub fn whole(&self, number: &Spanned<u64>, key: &str) -> Result<u64> {
        let (value, most) = (*number.get_ref(), i64::MAX);
        if value <= most as u64 {
            return Ok(value);
        }
        let message = format!("{key}: must be at most {most}, is {value}");
        Err(self.error(number.span(), message))
    }

    /// Evaluate a number above 0.
    pub fn positive(&self, number: &Number, key: &str) -> Result<f64> {
        self.within(number, key, f64::MIN_POSITIVE..f64::INFINITY, "above 0")
    }

    /// Evaluate a length in m.
    pub fn length(&self, number: &Number, key: &str) -> Result<f64> {
        self.positive(number, key)?;
        self.allowed(number, key, &LENGTH)
    }

    /// Evaluate a number that must be allowed.
    pub(crate) fn allowed(&self, number: &Number, key: &str, allowed: &Allowed) -> Result<f64> {
        let value = self.number(number, key)?;
        let checked = allowed.check(key, value);
        checked.map_err(|error| self.error(number.span(), error.message))?;
        Ok(value)
    }

    /// Evaluate a number. Return an error if the value is outside `range`; `words` describes the range in the
    /// error message.
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
            Err(self.error(
                number.span(),
                format!("{key}: must be {words}, is {}", format_number(value)),
            ))
        }
    }

    /// Parse an expression of the given variables. y is allowed in 2-D and 3-D only, and z in 3-D only.
    pub fn expression(
        &self,
        number: &Number,
        key: &str,
        variables: &[Variable],
    ) -> Result<Expression> {
        let text = match number.get_ref() {
            Written::Value(value) => {
                return self.finite(Expression::constant(*value), number, key);
            }
            Written::Text(text) => text,
        };
        let allowed: Vec<Variable> = variables
            .iter()
            .copied()
            .filter(|variable| match variable {
                Variable::Y => self.dimension > 1,
                Variable::Z => self.dimension > 2,
                Variable::X | Variable::T | Variable::R => true,
            })
            .collect();
        let names = self.parameters.keys().chain(self.tables.keys());
        let names: Vec<&str> = names.map(String::as_str).collect();
        let lookup = |name: &str| self.parameters.get(name).copied();
        let tables = self.tables.iter();
        let tables: Vec<_> = tables.map(|(name, table)| (name.as_str(), table)).collect();
        let parsed = Expression::parse_with_tables(text, &lookup, &names, &allowed, &tables);
        let parsed = parsed.map_err(|error| {
            let span = number.span();
            // If the string has escapes, the whole string is marked.
            let raw = self.source.text.get(span.clone()).unwrap_or_default();
            let marked = match raw.find(text) {
                Some(offset) if !text.is_empty() => {
                    let first = span.start + offset;
                    let end = error.end.max(error.start + 1);
                    first + error.start..first + end
                }
                _ => span,
            };
            self.error(marked, format!("{key}: {}", error.message))
        })?;
        for table in parsed.tables() {
            self.use_table(table);
        }
        self.finite(parsed, number, key)
    }

    /// Return the name of a table; empty for a table of another deck.
    pub fn table_name(&self, table: &Arc<Table>) -> &str {
        let mut tables = self.tables.iter();
        let found = tables.find(|(_, known)| Arc::ptr_eq(known, table));
        found.map_or("", |(name, _)| name)
    }

    /// Mark a table as used.
    fn use_table(&self, table: &Arc<Table>) {
        let name = self.table_name(table).to_owned();
        self.used.borrow_mut().insert(("table", name));
    }

    /// Return the expression, or an error if the expression is a constant that is not finite.
    fn finite(&self, expression: Expression, number: &Number, key: &str) -> Result<Expression> {
        match expression.as_constant() {
            Some(value) if !value.is_finite() => {
                Err(self.error(number.span(), format!("{key}: must be finite, is {value}")))
            }
            _ => Ok(expression),
        }
    }

    /// Return the entries of a vector.
    ///
    /// # Errors
    /// If the number of entries differs from the dimension.
    pub fn entries<'v>(&self, vector: &'v Vector, key: &str) -> Result<&'v [Number]> {
        let entries = vector.get_ref();
        if entries.len() == self.dimension {
            return Ok(entries);
        }
        let message = format!(
            "{key}: must have {} entries, one per dimension, has {}",
            self.dimension,
            entries.len()
        );
        Err(self.error(vector.span(), message))
    }

    /// Evaluate a vector; components beyond the dimension are 0.
    pub fn vector(&self, vector: &Vector, key: &str) -> Result<[f64; 3]> {
        let mut values = [0.0; 3];
        for (value, entry) in values.iter_mut().zip(self.entries(vector, key)?) {
            *value = self.number(entry, key)?;
        }
        Ok(values)
    }

    /// Evaluate a vector, and scale it to unit length. A zero vector is an error.
    pub fn direction(&self, vector: &Vector, key: &str) -> Result<[f64; 3]> {
        let values = Vector3::from(self.vector(vector, key)?);
        let largest = values.amax();
        if largest == 0.0 {
            return Err(self.error(vector.span(), format!("{key}: must not be zero")));
        }
        // The squares of very large and very small components are not representable, so scale the vector
        // first. The scale is a power of two, which does not change the digits.
        let (_, exponent) = libm::frexp(largest);
        let scaled = values.map(|value| libm::scalbn(value, -exponent));
        Ok((scaled / scaled.dot(&scaled).sqrt()).into())
    }

    /// Return the index of the key that is given, among mutually exclusive keys. It is an error if none or
    /// several of the keys are given. `place` is the byte range of the table with these keys.
    pub fn exactly_one(
        &self,
        place: Range<usize>,
        key: &str,
        keys: &[(&str, Option<Range<usize>>)],
    ) -> Result<usize> {
        let names: Vec<String> = keys.iter().map(|(name, _)| format!("`{name}`")).collect();
        let (last, others) = names.split_last().expect("there are several keys");
        let others = others.join(", ");
        let mut given: Vec<(usize, usize)> = keys
            .iter()
            .enumerate()
            .filter_map(|(index, (_, span))| Some((span.as_ref()?.start, index)))
            .collect();
        given.sort_unstable();
        match given[..] {
            [(_, index)] => Ok(index),
            [] => {
                let message = format!("{key}: give one of {others} and {last}");
                Err(self.error(place, message))
            }
            [(_, first), (_, second), ..] => {
                let (name, span) = &keys[second];
                let message = format!(
                    "{key} {name}: {} is given already; give one of {others} and {last}",
                    names[first]
                );
                Err(self.error(span.clone().unwrap_or(place), message))
            }
        }
    }

    /// Parse one expression per component. It is an error if a component is `"free"`.
    pub fn expressions(
        &self,
        vector: &Vector,
        key: &str,
        variables: &[Variable],
    ) -> Result<Vec<Expression>> {
        self.entries(vector, key)?
            .iter()
            .map(|entry| {
                if is_free(entry) {
                    let message = format!(
                        "{key}: only a component of a prescribed motion can be `free`; write 0"
                    );
                    return Err(self.error(entry.span(), message));
                }
                self.expression(entry, key, variables)
            })
            .collect()
    }

    /// Parse one expression per component of a prescribed motion; `None` for a component with `"free"`. It
    /// is an error if all components are `"free"`.
    pub fn motion(&self, vector: &Vector, key: &str) -> Result<Vec<Option<Expression>>> {
        let motion = self
            .entries(vector, key)?
            .iter()
            .map(|entry| {
                let parse = || self.expression(entry, key, &POSITION_AND_TIME);
                (!is_free(entry)).then(parse).transpose()
            })
            .collect::<Result<Vec<_>>>()?;
        if motion.iter().all(Option::is_none) {
            let message = format!("{key}: every component is `free`, so nothing is prescribed");
            return Err(self.error(vector.span(), message));
        }
        Ok(motion)
    }
}

/// Return whether an entry is `"free"`, which means that the component is not prescribed.
fn is_free(entry: &Number) -> bool {
    matches!(entry.get_ref(), Written::Text(text) if text == "free")
}

/// Return the index of `name` in `names`. If `names` does not contain `name`, the error suggests the most
/// similar name.
pub fn find<'n>(
    source: &Source,
    name: &Text,
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

/// Resolve every table; the results keep the names of the tables.
pub fn resolve_each<T, U>(
    tables: &Tables<T>,
    resolve: impl Fn(&str, &Spanned<T>) -> Result<U>,
) -> Result<IndexMap<String, U>> {
    tables
        .iter()
        .map(|(name, table)| Ok((name.clone(), resolve(name, table)?)))
        .collect()
}
