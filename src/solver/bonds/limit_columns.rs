//! What criteria alone read of the points, by column.

use crate::damage::{Criterion, Limits};
use crate::lanes::{Column, Lanes};

/// [`Limits`] by column; one that no criterion reads is empty.
pub struct LimitColumns {
    /// Of the local points, or by place of a grid.
    pub thresholds: Column,
    /// As above.
    pub overloads: Column,
}

impl LimitColumns {
    /// For so many points, with the columns that are read; `number` others are read with them.
    pub fn new(number: usize, count: usize, thresholds: bool, overloads: bool) -> Self {
        let of = |number, read, value| Column::new(number, if read { count } else { 0 }, value);
        Self {
            thresholds: of(number, thresholds, 0.0),
            overloads: of(number + 1, overloads, 1.0),
        }
    }

    /// The same columns for another number of points, with so many others.
    pub fn alike(&self, number: usize, count: usize) -> Self {
        let [thresholds, overloads] = [&self.thresholds, &self.overloads].map(|c| !c.is_empty());
        Self::new(number, count, thresholds, overloads)
    }

    /// Memory, bytes.
    pub fn bytes(&self) -> usize {
        size_of::<f64>() * (self.thresholds.len() + self.overloads.len())
    }
}

/// The columns as a kernel with a criterion reads them.
#[derive(Clone, Copy)]
pub struct ReadLimits<'a> {
    thresholds: Option<&'a [f64]>,
    overloads: Option<&'a [f64]>,
    /// Whether any is read: what loops ask first.
    any: bool,
}

impl<'a> ReadLimits<'a> {
    /// For a criterion.
    ///
    /// # Panics
    /// When a column that it reads has fewer entries than `reach`.
    pub fn new(criterion: Criterion, columns: &'a LimitColumns, reach: usize) -> Self {
        let read = |reads: bool, column: &'a Column| {
            assert!(
                !reads || column.len() >= reach,
                "a column of limits is too short"
            );
            reads.then_some(&column[..])
        };
        let thresholds = read(criterion.reads_thresholds(), &columns.thresholds);
        let overloads = read(criterion.reads_overloads(), &columns.overloads);
        Self {
            thresholds,
            overloads,
            any: thresholds.is_some() || overloads.is_some(),
        }
    }

    /// Eight points, by how they are taken from a column.
    #[inline(always)]
    pub fn eight(&self, take: impl Fn(&[f64]) -> Lanes) -> Limits {
        let mut limits = Limits::unread();
        if self.any {
            if let Some(column) = self.thresholds {
                limits.thresholds = take(column);
            }
            if let Some(column) = self.overloads {
                limits.overloads = take(column);
            }
        }
        limits
    }
}
