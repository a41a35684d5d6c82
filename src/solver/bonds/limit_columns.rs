//! Point data that only failure criteria read, by column.

use crate::damage::{Criterion, DamageLaw, Limits, StressMeasure};
use crate::lanes::{Column, LaneTuple, Lanes};
use crate::material::rotation::IDENTITY;

use super::interaction::BlockLaws;

/// Selection of the point data ([`Limits`] and rotations) that the criteria of a run read; the same on all
/// ranks.
#[derive(Debug, Clone, Copy)]
pub struct LimitsRead {
    /// Whether thresholds are read.
    pub thresholds: bool,
    /// Whether truncation factors are read.
    pub truncation_factors: bool,
    /// Whether rotations are read.
    pub rotations: bool,
    /// Whether each stress measure is read, in the order of [`StressMeasure::ALL`].
    pub stresses: [bool; StressMeasure::ALL.len()],
}

impl LimitsRead {
    /// Select the data that are read by the damage laws of the blocks and by the damage laws of pairs of
    /// bodies. `D` is the dimension of the problem.
    pub fn by<const D: usize>(blocks: &[BlockLaws]) -> Self {
        let any = |reads: fn(&DamageLaw) -> bool| {
            let mut laws = blocks.iter().filter_map(|block| block.damage.as_ref());
            laws.any(reads)
        };
        Self {
            thresholds: blocks.iter().any(BlockLaws::has_thresholds),
            truncation_factors: any(|law| law.family_correction() > 0.0)
                || blocks.iter().any(|block| block.pairs.truncation_factors),
            rotations: (any(DamageLaw::is_objective_work)
                || blocks.iter().any(|block| block.pairs.rotations))
                && !blocks.iter().all(|block| block.law.counts::<D>().central),
            stresses: StressMeasure::ALL.map(|measure| {
                let reads = |block: &BlockLaws| {
                    let own = block.damage.and_then(|law| law.stress_measure());
                    own == Some(measure) || block.pairs.stresses[measure.index()]
                };
                blocks.iter().any(reads)
            }),
        }
    }
}

/// [`Limits`] and rotations of the points, stored in columns. A column that no criterion reads is empty.
pub struct LimitColumns {
    /// Failure thresholds, indexed by local point (lists) or grid slot (lattices).
    pub thresholds: Column,
    /// Truncation factors, indexed like the thresholds.
    pub truncation_factors: Column,
    /// Rotations as quaternions, in the order q_x, q_y, q_z, q₀. In 2-D, only q_z and q₀ are stored.
    pub rotations: [Column; 4],
    /// Stress measures, Pa, in the order of [`StressMeasure::ALL`]; −∞ for points that carry no stress.
    pub stresses: [Column; StressMeasure::ALL.len()],
}

impl LimitColumns {
    /// Allocate the columns that `read` selects, with `count` entries each. `number` is the index of the
    /// column [`Self::thresholds`] among all columns that a loop reads, see [`Column`].
    pub fn new<const D: usize>(read: LimitsRead, number: usize, count: usize) -> Self {
        let of = |number, read, value| Column::new(number, if read { count } else { 0 }, value);
        Self {
            rotations: std::array::from_fn(|k| {
                let is_read = read.rotations && k >= first_component::<D>();
                of(number + 2 + k, is_read, IDENTITY[k])
            }),
            stresses: std::array::from_fn(|k| {
                of(number + 6 + k, read.stresses[k], f64::NEG_INFINITY)
            }),
            thresholds: of(number, read.thresholds, 0.0),
            truncation_factors: of(number + 1, read.truncation_factors, 1.0),
        }
    }

    /// Iterate over the stored columns of rotations and stress measures.
    pub fn kept_changing(&mut self) -> impl Iterator<Item = &mut Column> {
        let columns = self.rotations.iter_mut().chain(&mut self.stresses);
        columns.filter(|column| !column.is_empty())
    }

    /// Memory, bytes.
    pub fn bytes(&self) -> usize {
        let columns = [&self.thresholds, &self.truncation_factors].into_iter();
        let columns = columns.chain(&self.rotations).chain(&self.stresses);
        size_of::<f64>() * columns.map(|column| column.len()).sum::<usize>()
    }
}

/// Thresholds, truncation factors and stress measures, prepared for a kernel with a certain criterion.
#[derive(Clone, Copy)]
pub struct ReadLimits<'a> {
    thresholds: Option<&'a [f64]>,
    truncation_factors: Option<&'a [f64]>,
    /// Stress measure that the criterion reads, Pa; `None` if the criterion reads no stress.
    stresses: Option<&'a [f64]>,
    /// Whether the criterion reads thresholds, truncation factors or stress measures. If false,
    /// [`Self::eight`] checks only this flag and skips all columns.
    any: bool,
}

impl<'a> ReadLimits<'a> {
    /// Prepare the columns for a criterion. Only entries with an index below `reach` are read.
    ///
    /// # Panics
    /// If a column that the criterion reads has fewer entries than `reach`.
    pub fn new(criterion: Criterion, columns: &'a LimitColumns, reach: usize) -> Self {
        let read = |reads: bool, column: &'a Column| {
            assert!(
                !reads || column.len() >= reach,
                "a column of limits is too short"
            );
            reads.then_some(&column[..])
        };
        let thresholds = read(criterion.reads_thresholds(), &columns.thresholds);
        let truncation_factors = read(
            criterion.reads_truncation_factors(),
            &columns.truncation_factors,
        );
        let measure = criterion.stress_measure();
        let stresses = measure.and_then(|measure| read(true, &columns.stresses[measure.index()]));
        Self {
            thresholds,
            truncation_factors,
            stresses,
            any: thresholds.is_some() || truncation_factors.is_some() || stresses.is_some(),
        }
    }

    /// Load the limits of eight points. `take` loads the entries of these points from one column. It is
    /// called only for columns whose length [`Self::new`] has checked. Stresses are loaded only if
    /// `may_read_stresses` is true. This argument is a constant, so the compiler removes the branch.
    #[inline(always)]
    pub fn eight(&self, may_read_stresses: bool, take: impl Fn(&[f64]) -> Lanes) -> Limits {
        let mut limits = Limits::unread();
        if self.any {
            if let Some(column) = self.thresholds {
                limits.thresholds = take(column);
            }
            if let Some(column) = self.truncation_factors {
                limits.truncation_factors = take(column);
            }
            if may_read_stresses && let Some(column) = self.stresses {
                limits.stresses = take(column);
            }
        }
        limits
    }
}

/// Rotations, prepared for a kernel with a certain criterion. `R` has four components, or none for laws whose
/// forces act along the bonds.
#[derive(Clone, Copy)]
pub struct ReadRotations<'a, R: LaneTuple> {
    columns: R::Columns<'a>,
    is_read: bool,
}

impl<'a, R: LaneTuple> ReadRotations<'a, R> {
    /// Prepare the rotations for a criterion, in `D` dimensions. Only entries with an index below `reach` are
    /// read.
    ///
    /// # Panics
    /// If a column that the criterion reads has fewer entries than `reach`.
    pub fn new<const D: usize>(
        criterion: Criterion,
        columns: &'a LimitColumns,
        reach: usize,
    ) -> Self {
        // Rotations are not stored if the forces of all laws act along the bonds. The criterion between two
        // different laws of this kind still requests rotations.
        let is_stored = !columns.rotations[3].is_empty();
        let is_read = R::COUNT > 0 && criterion.reads_rotations() && is_stored;
        let columns = R::columns(&columns.rotations);
        let components = first_component::<D>()..R::COUNT;
        assert!(
            !is_read
                || components
                    .into_iter()
                    .all(|k| R::column(&columns, k).len() >= reach),
            "a column of rotations is too short"
        );
        Self { columns, is_read }
    }

    /// Load the rotations of eight points. `take` loads the entries of these points from a column. It is
    /// called only for columns whose length [`Self::new`] has checked.
    #[inline(always)]
    pub fn eight<const D: usize>(&self, take: impl Fn(&[f64]) -> Lanes) -> R {
        if !self.is_read {
            return R::splat(0.0);
        }
        R::each(|k| {
            if k < first_component::<D>() {
                Lanes::splat(0.0)
            } else {
                take(R::column(&self.columns, k))
            }
        })
    }
}

/// Index of the first stored component of rotations: in 2-D, q_x and q_y are 0 and not stored.
const fn first_component<const D: usize>() -> usize {
    if D < 3 { 2 } else { 0 }
}
