//! Tables of values by time.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Text;
use crate::deck::number::{Number, default_number};
use crate::deck::spanned::Spanned;

/// A value by time, linear between rows: expressions of `t` may use its name. The rows are columns of a file or stand here.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Table {
    /// Text file whose first row names its columns, relative to the deck.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<Text>,
    /// Name of the column of values; the other one if there are two and this is not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub column: Option<Text>,
    /// Name of the column of times in s; if not given, `t` or `time`, or else the first.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time: Option<Text>,
    /// Times in s, each above the one before, in place of a file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub times: Option<Spanned<Vec<Number>>>,
    /// As many values.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub values: Option<Spanned<Vec<Number>>>,
}

impl Table {
    /// A table with these rows.
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
