//! Settings of history columns: sums, means and extremes of a field over a set of points.

use std::ops::Range;

use super::Field;
use crate::component::Component;

/// Settings of sums and extremes of a field over a set.
#[derive(Debug, Clone, PartialEq)]
pub struct FieldStatistics {
    /// Name of the statistics in the deck.
    pub name: String,
    /// Span in the deck.
    pub span: Range<usize>,
    /// Index of the set.
    pub set: usize,
    /// Field whose values are summed or compared.
    pub field: Field,
    /// Component or invariant of the field.
    pub component: Component,
    /// The recorded quantities; one column for each.
    pub of: Vec<Statistic>,
}

/// A number computed from the values a and volumes V of the points of a set.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Statistic {
    /// Σ a.
    Sum,
    /// Σ a V.
    Integral,
    /// Σ a V / Σ V.
    Mean,
    /// The smallest a.
    Minimum,
    /// The largest a.
    Maximum,
}

impl Statistic {
    /// Return the name in decks and columns.
    pub fn name(self) -> &'static str {
        match self {
            Self::Sum => "sum",
            Self::Integral => "integral",
            Self::Mean => "mean",
            Self::Minimum => "minimum",
            Self::Maximum => "maximum",
        }
    }

    /// Return the SI unit of this statistic of a field.
    pub fn unit(self, field: Field) -> &'static str {
        match self {
            Self::Sum | Self::Mean | Self::Minimum | Self::Maximum => field.unit(),
            Self::Integral => match field.unit() {
                "m" => "m^4",
                "m/s" => "m^4/s",
                "m/s^2" => "m^4/s^2",
                "m^5" => "m^8",
                "N/m^3" => "N",
                "Pa" => "Pa m^3",
                "J/m^3" => "J",
                "K" => "K m^3",
                // The field is dimensionless.
                _ => "m^3",
            },
        }
    }
}
