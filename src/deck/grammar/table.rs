//! Tables of values over time.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Text;
use crate::deck::number::{Number, default_number};
use crate::deck::spanned::Spanned;

/// A value over time, linear between rows. Expressions of `t` may use the name of the table. The rows come
/// from a file, or from the keys `times` and `values`.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Table {
    /// Path, relative to the deck, of a text file whose first row names the columns.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<Text>,
    /// Name of the column of values. May be left out if the file has only two columns, times and values.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub column: Option<Text>,
    /// Name of the column of times in s. The default is the column `t` or `time`, or the first column if the
    /// file has neither.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time: Option<Text>,
    /// Strictly increasing times in s, for a table without `file`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub times: Option<Spanned<Vec<Number>>>,
    /// Values at `times`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub values: Option<Spanned<Vec<Number>>>,
}

impl Table {
    /// Create a table from the times and values of its rows.
    pub fn of_rows(times: &[f64], values: &[f64]) -> Self {
        let list = |numbers: &[f64]| {
            let numbers = numbers.iter().copied().map(default_number).collect();
            Some(Spanned::new(0..0, numbers))
        };
        Self {
            file: None,
            column: None,
            time: None,
            times: list(times),
            values: list(values),
        }
    }
}
