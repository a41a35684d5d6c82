//! Ranges of numbers. The deck uses some of these ranges, too.

use std::ops::RangeInclusive;

use super::wrong;
use crate::error::Result;
use crate::message::format_number;

/// Smallest number above 0.
const LEAST: f64 = f64::from_bits(1);

/// A range of allowed numbers. No range contains NaN or infinity.
pub(crate) struct Allowed {
    /// The range.
    pub range: RangeInclusive<f64>,
    /// Description of the range in messages, after "must be".
    pub words: &'static str,
}

impl Allowed {
    const fn new(range: RangeInclusive<f64>, words: &'static str) -> Self {
        Self { range, words }
    }

    /// Check a number; `key` is its section and key.
    ///
    /// # Errors
    /// If the number is outside the range.
    pub fn check(&self, key: &str, value: f64) -> Result<()> {
        if self.range.contains(&value) {
            return Ok(());
        }
        let is_infinite = value == f64::INFINITY && *self.range.end() == f64::MAX;
        let finite = if is_infinite { " and finite" } else { "" };
        let words = self.words;
        Err(wrong(
            key,
            format!("must be {words}{finite}, is {}", format_number(value)),
        ))
    }
}

/// Numbers above 0.
pub(crate) const POSITIVE: Allowed = Allowed::new(LEAST..=f64::MAX, "above 0");

/// Numbers that are not negative.
pub(super) const NOT_NEGATIVE: Allowed = Allowed::new(0.0..=f64::MAX, "at least 0");

/// Lengths, m. Squares and volumes of these lengths do not overflow or underflow.
pub(crate) const LENGTH: Allowed = Allowed::new(1e-30..=1e30, "between 1e-30 and 1e30 m");

/// Numbers that are at least 1.
pub(super) const AT_LEAST_ONE: Allowed = Allowed::new(1.0..=f64::MAX, "1 or more");

/// Numbers between 0 and 1, with 0.
pub(super) const FRACTION: Allowed = Allowed::new(0.0..=BELOW_ONE, "at least 0 and below 1");

/// Numbers between 0 and 1, with 1.
pub(super) const SHARE: Allowed = Allowed::new(LEAST..=1.0, "above 0 and at most 1");

/// Numbers between 0 and 1, without both.
pub(super) const PROPER_FRACTION: Allowed = Allowed::new(LEAST..=BELOW_ONE, "above 0 and below 1");

/// Numbers above 1.
pub(super) const ABOVE_ONE: Allowed = Allowed::new(1.0_f64.next_up()..=f64::MAX, "above 1");

/// Numbers between 0 and 1, with both.
pub(super) const FROM_0_TO_1: Allowed = Allowed::new(0.0..=1.0, "0 to 1");

/// Random displacements as a fraction of a cell. Below 0.5, the points of adjacent cells cannot coincide.
pub(super) const JITTER: Allowed =
    Allowed::new(0.0..=0.5_f64.next_down(), "at least 0 and below 0.5");

/// Poisson's ratios of a stable solid.
pub(super) const POISSON_RATIO: Allowed = Allowed::new(
    (-1.0_f64).next_up()..=0.5_f64.next_down(),
    "above -1 and below 0.5",
);

/// Coefficients of restitution. With a smaller coefficient, the contact damping would require very short
/// time steps.
pub(crate) const RESTITUTION: Allowed = Allowed::new(0.01..=1.0, "between 0.01 and 1");

/// Factors on the horizon of points near a coarser level.
pub(super) const INTERFACE_FACTOR: Allowed = Allowed::new(1.0..=4.0, "1 to 4");

/// Largest number of times that a load step is halved; 20 halvings divide a load step into about a million
/// parts.
pub(crate) const MOST_HALVINGS: u64 = 20;

/// Largest number below 1.
const BELOW_ONE: f64 = 1.0_f64.next_down();
