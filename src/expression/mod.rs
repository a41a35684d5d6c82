//! The expression language of decks: formulas of position, time and named parameters.
//!
//! # Language
//!
//! Every value is a 64-bit float; a condition is true if it is not 0, and comparisons give 1 or 0.
//! From the tightest to the loosest, the operators are:
//!
//! | operators | |
//! |---|---|
//! | `a ^ b` | from the right: `2^3^2` is `2^(3^2)` |
//! | `-a` `+a` `!a` | `-x^2` is `-(x^2)`; also in an exponent: `2^-1` |
//! | `a * b` `a / b` | from the left |
//! | `a + b` `a - b` | from the left |
//! | `a < b` `<=` `>` `>=` `==` `!=` | not chained: `a < b < c` is an error |
//! | `a && b` | from the left |
//! | `a \|\| b` | from the left |
//!
//! `and`, `or` and `not` are other names of `&&`, `||` and `!`. As `not x < 1` reads like
//! `not (x < 1)` but would be `(not x) < 1`, a `!` at the start of a comparison has to be put in
//! parentheses one way or the other.
//!
//! The variables are `x`, `y`, `z` and `t`, as far as they are allowed where the expression stands;
//! the only constant is `pi`. These names, and not those of functions, hide parameters of the same
//! name. Names of [tables](Table) are values by time, and may be used where `t` may be. The functions are:
//!
//! - `sin` `cos` `tan` `asin` `acos` `atan` `atan2(y, x)` `sinh` `cosh` `tanh`, in radians;
//! - `exp`, `log` (natural), `log10`, `sqrt`, `abs`, `floor`, `ceil`, `hypot(a, b)`;
//! - `sign(a)`: -1, 0 or 1;
//! - `min(a, b, …)`, `max(a, b, …)`: NaN if any argument is;
//! - `clamp(a, low, high)`: the same as `min(max(a, low), high)`;
//! - `step(a)`: 0 if `a < 0`, otherwise 1;
//! - `ramp(a, start, end)`: 0 up to `start`, then linear to 1 at `end`, and 1 from there on; if
//!   `end` is not after `start`, it jumps at `end`;
//! - `if(condition, a, b)`: `a` if the condition is true, otherwise `b`. What is not chosen does
//!   not matter, even if it is infinite or NaN.
//!
//! # Powers
//!
//! If the exponent is an integer from -16 to 16, `a ^ b` is evaluated by multiplication
//! (`f64::powi`), so that `x^2` is exactly `x * x`; all other powers are `f64::powf`. This depends
//! only on the exponent's value, not on whether it was written as a number.

mod evaluate;
mod increment;
mod names;
mod parse;
mod table;
mod token;

use std::fmt;
use std::sync::Arc;

use crate::error::{self, Error};
use evaluate::Instruction;
pub use table::Table;

/// A variable that an expression may use at evaluation time, in addition to named parameters.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Variable {
    /// `x`, the first coordinate.
    X,
    /// `y`, the second coordinate.
    Y,
    /// `z`, the third coordinate.
    Z,
    /// `t`, the time.
    T,
    /// `r`, a length; the value of the first coordinate.
    R,
}

/// Position and time.
pub const POSITION_AND_TIME: [Variable; 4] = [Variable::X, Variable::Y, Variable::Z, Variable::T];

/// Position only.
pub const POSITION: [Variable; 3] = [Variable::X, Variable::Y, Variable::Z];

impl Variable {
    /// The variable of that name.
    fn from_name(name: &str) -> Option<Self> {
        [Self::X, Self::Y, Self::Z, Self::T, Self::R]
            .into_iter()
            .find(|variable| variable.name() == name)
    }

    /// The variable's name.
    fn name(self) -> &'static str {
        match self {
            Self::X => "x",
            Self::Y => "y",
            Self::Z => "z",
            Self::T => "t",
            Self::R => "r",
        }
    }

    /// Its index among x, y, z, t.
    fn slot(self) -> usize {
        match self {
            Self::X | Self::R => 0,
            Self::Y => 1,
            Self::Z => 2,
            Self::T => 3,
        }
    }
}

/// An error with the byte range that it has in the expression's text.
#[derive(Debug, Clone, PartialEq)]
pub struct ExpressionError {
    /// The first byte.
    pub start: usize,
    /// The byte after the last; the same as `start` at the end of the text.
    pub end: usize,
    /// Message: what is wrong, and what is allowed.
    pub message: String,
}

impl ExpressionError {
    /// An error about a byte range.
    fn new(start: usize, end: usize, message: impl Into<String>) -> Self {
        Self {
            start,
            end,
            message: message.into(),
        }
    }
}

impl fmt::Display for ExpressionError {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.message)
    }
}

impl std::error::Error for ExpressionError {}

/// An expression whose parameters have been replaced by their values and whose constant parts have
/// been evaluated.
#[derive(Debug, Clone, PartialEq)]
pub struct Expression {
    /// Postfix code, which is never empty.
    code: Vec<Instruction>,
    /// Largest stack size of the code, in values.
    stack_size: usize,
    /// Tables that the code reads, by number, in the order of their first use.
    tables: Vec<Arc<Table>>,
}

impl Expression {
    /// An expression of position and time, without parameters.
    ///
    /// # Errors
    /// When the text is none.
    pub fn of(text: &str) -> error::Result<Self> {
        Self::with(text, &POSITION_AND_TIME)
    }

    /// An expression of a length `r` (m), without parameters.
    ///
    /// # Errors
    /// When the text is none.
    pub fn of_length(text: &str) -> error::Result<Self> {
        Self::with(text, &[Variable::R])
    }

    fn with(text: &str, variables: &[Variable]) -> error::Result<Self> {
        let parsed = Self::parse(text, &|_| None, &[], variables);
        parsed.map_err(|error| Error::input(format!("`{text}`: {error}")))
    }

    /// Parses the text, where `parameters` gives the value of a named parameter, `known_names` are
    /// the names that an error about an unknown one may offer, and `variables` are the variables
    /// that may be used.
    ///
    /// # Errors
    ///
    /// If the text is not an expression, or uses a name that has no value here.
    pub fn parse(
        text: &str,
        parameters: &dyn Fn(&str) -> Option<f64>,
        known_names: &[&str],
        variables: &[Variable],
    ) -> Result<Self, ExpressionError> {
        Self::parse_with_tables(text, parameters, known_names, variables, &[])
    }

    /// As [`Self::parse`], with the names of these tables.
    ///
    /// # Errors
    ///
    /// As [`Self::parse`], and if a table is named where `t` may not be used.
    pub fn parse_with_tables(
        text: &str,
        parameters: &dyn Fn(&str) -> Option<f64>,
        known_names: &[&str],
        variables: &[Variable],
        tables: &[(&str, &Arc<Table>)],
    ) -> Result<Self, ExpressionError> {
        let scope = names::Scope {
            parameters,
            known_names,
            variables,
            tables,
        };
        let mut code = parse::parse(text, &scope)?;
        // Expressions with the same tables are equal whatever other tables there are.
        let mut used: Vec<usize> = Vec::new();
        for instruction in &mut code {
            if let Instruction::Table(number) = instruction {
                let known = used.iter().position(|known| known == number);
                let own = known.unwrap_or_else(|| {
                    used.push(*number);
                    used.len() - 1
                });
                *number = own;
            }
        }
        Ok(Self {
            stack_size: evaluate::stack_size(&code),
            code,
            tables: used
                .iter()
                .map(|number| tables[*number].1.clone())
                .collect(),
        })
    }

    /// The value of a table as an expression of time; its first and last segment extend beyond its rows.
    pub fn of_table(table: Table) -> Self {
        Self {
            code: vec![Instruction::Table(0)],
            stack_size: 1,
            tables: vec![Arc::new(table)],
        }
    }

    /// The tables that the expression reads.
    pub fn tables(&self) -> &[Arc<Table>] {
        &self.tables
    }

    /// Whether the expression is the same as another one up to the end of the tables of that one.
    pub fn extends(&self, other: &Self) -> bool {
        let mut tables = self.tables.iter().zip(&other.tables);
        self.code == other.code
            && self.tables.len() == other.tables.len()
            && tables.all(|(own, other)| own.extends(other))
    }

    /// Whether a name is the name of a function.
    pub fn is_function(name: &str) -> bool {
        names::is_function(name)
    }

    /// The expression that has the same value everywhere and always.
    pub fn constant(value: f64) -> Self {
        Self {
            code: vec![Instruction::Constant(value)],
            stack_size: 1,
            tables: Vec::new(),
        }
    }

    /// The value at a position and a time.
    pub fn evaluate(&self, position: [f64; 3], time: f64) -> f64 {
        let [x, y, z] = position;
        evaluate::evaluate(&self.code, &self.tables, self.stack_size, [x, y, z, time])
    }

    /// Change of the value from a time over a step, which may be negative. The round-off is relative to the change, not
    /// to the value.
    pub fn increment(&self, position: [f64; 3], time: f64, step: f64) -> f64 {
        let [x, y, z] = position;
        increment::increment(&self.code, &self.tables, [x, y, z, time], step)
    }

    /// Whether the value is not 0.
    pub fn is_true(&self, position: [f64; 3], time: f64) -> bool {
        self.evaluate(position, time) != 0.0
    }

    /// Whether the form of the expression guarantees a value of 0 or 1, as for a comparison.
    pub fn is_condition(&self) -> bool {
        evaluate::is_truth(&self.code)
    }

    /// Whether the value depends on the variable; tables depend on `t`.
    pub fn uses(&self, variable: Variable) -> bool {
        self.code.contains(&Instruction::Variable(variable))
            || variable == Variable::T && !self.tables.is_empty()
    }

    /// The value, if no variable occurs in the expression.
    pub fn as_constant(&self) -> Option<f64> {
        match self.code[..] {
            [Instruction::Constant(value)] => Some(value),
            _ => None,
        }
    }

    /// The names in the text that are neither functions nor constants, each once, in the order in
    /// which they first occur. Variables are among them. The text may be wrong in ways that only
    /// [`Expression::parse`] sees.
    ///
    /// # Errors
    ///
    /// If the text cannot be split into names, numbers and symbols.
    pub fn names(text: &str) -> Result<Vec<String>, ExpressionError> {
        parse::names(text)
    }
}

#[cfg(test)]
mod tests;
