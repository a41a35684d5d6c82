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
    pub truncation_factors: bool,
    /// Rotations.
    pub rotations: bool,
}

impl LimitsRead {
    /// By the damage laws of the blocks, in `D` dimensions.
    pub fn by<const D: usize>(blocks: &[BlockLaws]) -> Self {
        let any = |reads: fn(&DamageLaw) -> bool| {
            let mut laws = blocks.iter().filter_map(|block| block.damage.as_ref());
            laws.any(reads)
        };
        Self {
            thresholds: any(|law| law.alpha() > 0.0),
            truncation_factors: any(|law| law.family_correction() > 0.0),
            rotations: any(DamageLaw::is_objective_work)
                && !blocks.iter().all(|block| block.law.counts::<D>().central),
        }
    }
}

/// [`Limits`] by column; one that no criterion reads is empty.
pub struct LimitColumns {
    /// Of the local points, or by place of a grid.
    pub thresholds: Column,
    /// As above.
    pub truncation_factors: Column,
    /// By component; in the plane only the last one is kept.
    pub rotations: [Column; 3],
}

impl LimitColumns {
    /// The columns that are read, for so many points in `D` dimensions; `number` others are read with them.
    pub fn new<const D: usize>(read: LimitsRead, number: usize, count: usize) -> Self {
        let of = |number, read, value| Column::new(number, if read { count } else { 0 }, value);
        let first_rotation = if D < 3 { 2 } else { 0 };
        Self {
            rotations: std::array::from_fn(|k| {
                let is_read = read.rotations && k >= first_rotation;
                of(number + 2 + k, is_read, 0.0)
            }),
            thresholds: of(number, read.thresholds, 0.0),
            truncation_factors: of(number + 1, read.truncation_factors, 1.0),
        }
    }

    /// Those rotations that are kept.
    pub fn kept_rotations(&mut self) -> impl Iterator<Item = &mut Column> {
        let columns = self.rotations.iter_mut();
        columns.filter(|column| !column.is_empty())
    }

    /// BondHistory, bytes.
    pub fn bytes(&self) -> usize {
        let [x, y, z] = &self.rotations;
        let columns = [&self.thresholds, &self.truncation_factors, x, y, z];
        size_of::<f64>() * columns.map(|column| column.len()).iter().sum::<usize>()
    }
}

/// The columns as a kernel with a criterion reads them.
#[derive(Clone, Copy)]
pub struct ReadLimits<'a> {
    thresholds: Option<&'a [f64]>,
    truncation_factors: Option<&'a [f64]>,
    rotations: [Option<&'a [f64]>; 3],
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
        let truncation_factors = read(criterion.reads_overloads(), &columns.truncation_factors);
        let rotations = columns
            .rotations
            .each_ref()
            .map(|column| read(criterion.reads_rotations() && !column.is_empty(), column));
        Self {
            thresholds,
            truncation_factors,
            rotations,
            any: thresholds.is_some()
                || truncation_factors.is_some()
                || rotations.iter().any(Option::is_some),
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
            if let Some(column) = self.truncation_factors {
                limits.truncation_factors = take(column);
            }
            for (rotation, column) in limits.rotations.iter_mut().zip(self.rotations) {
                if let Some(column) = column {
                    *rotation = take(column);
                }
            }
        }
        limits
    }
}
