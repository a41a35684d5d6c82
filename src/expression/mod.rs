//! The expression language of decks: formulas of position, time and named parameters.
//!
//! # Language
//!
//! Every value is a 64-bit float. A condition is true if its value is not 0, and neither true nor false if
//! its value is NaN. Comparisons give 1 or 0; with NaN, all comparisons except `!=` give 0. The following
//! table lists the operators in the order of their precedence, the highest first:
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
//! The value of `!NaN` is NaN. The value of `a && b` is 0 if a or b is 0, and that of `a || b` is 1 if a or b
//! is true. Otherwise, both are NaN if a or b is NaN.
//!
//! `and`, `or` and `not` are synonyms of `&&`, `||` and `!`. `not x < 1` reads like `not (x < 1)` but would
//! mean `(not x) < 1`. Therefore a comparison that starts with `!` or `not` is an error: write `!(x < 1)`
//! or `(!x) < 1` instead.
//!
//! The variables are `x`, `y`, `z` and `t`, where the deck allows these. The only constant is `pi`. These
//! names hide parameters of the same name. Names of functions do not hide parameters. In keys that are
//! functions of the length of a bond, `r` is the only variable. Elsewhere, `r` can be a parameter. The name
//! of a [table](Table) stands for the value of the table at the time `t`, and is allowed where `t` is
//! allowed. The functions are:
//!
//! - `sin`, `cos`, `tan`, `asin`, `acos`, `atan`, `atan2(y, x)`, with angles in radians;
//! - `sinh`, `cosh`, `tanh`;
//! - `exp`, `log` (natural), `log10`, `sqrt`, `abs`, `floor`, `ceil`, `hypot(a, b)`;
//! - `sign(a)`: -1, 0 or 1;
//! - `min(a, b, …)`, `max(a, b, …)`: NaN if any argument is NaN;
//! - `clamp(a, low, high)`: the same as `min(max(a, low), high)`;
//! - `step(a)`: 0 if `a < 0`, 1 if `a >= 0`;
//! - `ramp(a, start, end)`: 0 up to `start`, then linear to 1 at `end`, and 1 after `end`; if `end` is not
//!   after `start`, the value jumps from 0 to 1 at `end`. A constant `end` before a constant `start` is an
//!   error;
//! - `if(condition, a, b)`: `a` if the condition is true, `b` if it is 0, and NaN if it is NaN. The argument
//!   that is not returned has no effect, even if it is infinite or NaN.
//!
//! # Powers
//!
//! If the exponent is an integer from -16 to 16, `a ^ b` is computed by multiplication (`f64::powi`), so that
//! `x^2` is exactly `x * x`. All other powers use `libm::pow`. The choice depends only on the exponent's
//! value, not on its notation.

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
pub(crate) use token::number_length;

/// A variable of expressions, as opposed to a named parameter.
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
    /// `r`, a length. Pass its value to [`Expression::evaluate`] as the first coordinate of the position.
    R,
}

/// The variables of position and time.
pub const POSITION_AND_TIME: [Variable; 4] = [Variable::X, Variable::Y, Variable::Z, Variable::T];

/// The variables of position.
pub const POSITION: [Variable; 3] = [Variable::X, Variable::Y, Variable::Z];

impl Variable {
    /// All variables.
    pub(crate) const ALL: [Self; 5] = [Self::X, Self::Y, Self::Z, Self::T, Self::R];

    fn from_name(name: &str) -> Option<Self> {
        Self::ALL
            .into_iter()
            .find(|variable| variable.name() == name)
    }

    /// Return the name in expressions.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::X => "x",
            Self::Y => "y",
            Self::Z => "z",
            Self::T => "t",
            Self::R => "r",
        }
    }

    /// Return the index of the variable among x, y, z, t. `r` has the index of x.
    fn slot(self) -> usize {
        match self {
            Self::X | Self::R => 0,
            Self::Y => 1,
            Self::Z => 2,
            Self::T => 3,
        }
    }
}

/// An error with its byte range in the text of the expression.
#[derive(Debug, Clone, PartialEq)]
pub struct ExpressionError {
    /// Index of the first byte of the range.
    pub start: usize,
    /// Index after the last byte; equal to `start` for an error at the end of the text.
    pub end: usize,
    /// Message: what is wrong, and what is allowed.
    pub message: String,
}

impl ExpressionError {
    /// Create an error for a byte range.
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

/// A parsed expression: parameters are replaced by their values, and constant parts are evaluated.
#[derive(Debug, Clone, PartialEq)]
pub struct Expression {
    /// Postfix code; never empty.
    code: Vec<Instruction>,
    /// Largest stack size that the code needs, in values.
    stack_size: usize,
    /// Tables that the code reads, in the order of their first use.
    tables: Vec<Arc<Table>>,
}

impl Expression {
    /// Parse an expression of position and time, without parameters.
    ///
    /// # Errors
    /// If the text is not a valid expression.
    pub fn of(text: &str) -> error::Result<Self> {
        Self::with(text, &POSITION_AND_TIME)
    }

    /// Parse an expression without parameters. The only variable is `r`, a length in m.
    ///
    /// # Errors
    /// If the text is not a valid expression.
    pub fn of_length(text: &str) -> error::Result<Self> {
        Self::with(text, &[Variable::R])
    }

    fn with(text: &str, variables: &[Variable]) -> error::Result<Self> {
        let parsed = Self::parse(text, &|_| None, &[], variables);
        parsed.map_err(|error| Error::input(format!("`{text}`: {error}")))
    }

    /// Parse an expression.
    ///
    /// `parameters` returns the value of a named parameter. `known_names` are the names that error messages
    /// suggest for an unknown name. `variables` are the allowed variables.
    ///
    /// # Errors
    ///
    /// If the text is not a valid expression, or uses a name without a value.
    pub fn parse(
        text: &str,
        parameters: &dyn Fn(&str) -> Option<f64>,
        known_names: &[&str],
        variables: &[Variable],
    ) -> Result<Self, ExpressionError> {
        Self::parse_with_tables(text, parameters, known_names, variables, &[])
    }

    /// Same as [`Self::parse`], with named tables.
    ///
    /// # Errors
    ///
    /// Same as [`Self::parse`], and also if the text uses a table although `variables` does not contain `t`.
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
        // Drop unused tables, so that equality of expressions does not depend on unused tables.
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

    /// Create an expression of time from a table. The first and the last segment extend beyond the rows of
    /// the table.
    pub fn of_table(table: Table) -> Self {
        Self {
            code: vec![Instruction::Table(0)],
            stack_size: 1,
            tables: vec![Arc::new(table)],
        }
    }

    /// Return the tables that the expression reads.
    pub fn tables(&self) -> &[Arc<Table>] {
        &self.tables
    }

    /// Test whether this expression extends `other`: both have the same code, and each table of this
    /// expression starts with all rows of the corresponding table of `other`.
    pub fn extends(&self, other: &Self) -> bool {
        let mut tables = self.tables.iter().zip(&other.tables);
        self.code == other.code
            && self.tables.len() == other.tables.len()
            && tables.all(|(own, other)| own.extends(other))
    }

    /// Test whether a function of this name exists.
    pub fn is_function(name: &str) -> bool {
        names::is_function(name)
    }

    /// Create an expression with the same value at all positions and times.
    pub fn constant(value: f64) -> Self {
        Self {
            code: vec![Instruction::Constant(value)],
            stack_size: 1,
            tables: Vec::new(),
        }
    }

    /// Evaluate the expression at a position and a time.
    pub fn evaluate(&self, position: [f64; 3], time: f64) -> f64 {
        let [x, y, z] = position;
        evaluate::evaluate(&self.code, &self.tables, self.stack_size, [x, y, z, time])
    }

    /// Compute the change of the value from `time` to `time + step`; `step` may be negative. For most
    /// operations, round-off is relative to the change, not to the value.
    pub fn increment(&self, position: [f64; 3], time: f64, step: f64) -> f64 {
        let [x, y, z] = position;
        increment::increment(&self.code, &self.tables, [x, y, z, time], step)
    }

    /// Test whether the value is neither 0 nor NaN.
    pub fn is_true(&self, position: [f64; 3], time: f64) -> bool {
        evaluate::is_true(self.evaluate(position, time))
    }

    /// Return true if the operations of the expression show that its value is always 0, 1 or NaN, as for a
    /// comparison. For other expressions whose value is always 0 or 1, such as `0*x`, return false.
    pub fn is_condition(&self) -> bool {
        evaluate::is_truth(&self.code)
    }

    /// Test whether the expression contains this variable. An expression with a table counts as containing
    /// `t`, because the value of a table depends on the time.
    pub fn uses(&self, variable: Variable) -> bool {
        self.code.contains(&Instruction::Variable(variable))
            || variable == Variable::T && !self.tables.is_empty()
    }

    /// Return the value of an expression without variables and tables; `None` for other expressions.
    pub fn as_constant(&self) -> Option<f64> {
        match self.code[..] {
            [Instruction::Constant(value)] => Some(value),
            _ => None,
        }
    }

    /// Return the names in the text that are neither functions nor constants, in the order of their first
    /// use. Variables are included. A name counts as a function if `(` follows. The text need not be a valid
    /// expression.
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
