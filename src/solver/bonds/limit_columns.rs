//! What criteria alone read of the points, by column.

use crate::damage::{Criterion, DamageLaw, Limits};
use crate::lanes::{Column, Lanes};

use super::interaction::BlockLaws;

/// Which of the [`Limits`] the criteria of a run read; the same on all ranks.
#[derive(Debug, Clone, Copy)]
pub struct LimitsRead {
    /// Thresholds.
    pub thresholds: bool,
    /// Overloads.
    pub overloads: bool,
}

impl LimitsRead {
    /// By the damage laws of the blocks.
    pub fn by(blocks: &[BlockLaws]) -> Self {
        let any = |reads: fn(&DamageLaw) -> bool| {
            let mut laws = blocks.iter().filter_map(|block| block.damage.as_ref());
            laws.any(reads)
        };
        Self {
            thresholds: any(|law| law.alpha() > 0.0),
            overloads: any(|law| law.family_correction() > 0.0),
        }
    }
}

/// [`Limits`] by column; one that no criterion reads is empty.
pub struct LimitColumns {
    /// Of the local points, or by place of a grid.
    pub thresholds: Column,
    /// As above.
    pub overloads: Column,
}

impl LimitColumns {
    /// The columns that are read, for so many points; `number` others are read with them.
    pub fn new(read: LimitsRead, number: usize, count: usize) -> Self {
        let of = |number, read, value| Column::new(number, if read { count } else { 0 }, value);
        Self {
            thresholds: of(number, read.thresholds, 0.0),
            overloads: of(number + 1, read.overloads, 1.0),
        }
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

    /// Eight points, by how they are taken from a column; `take` only gets columns that reach as far as was asked for.
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
