//! Point numbers: values of a point, such as the dilatation. The law of the point declares its point numbers,
//! and computes them from sums over the bonds of the point.

use std::ops::Range;

use rayon::prelude::*;

use crate::lanes::Column;
use crate::material::{Counts, Law, MOST, PlasticState};
use crate::solver::model::Model;

use super::force::BondUpdate;
use super::interaction::BlockLaws;

/// Number of points that one task processes.
const CHUNK: usize = 4096;

/// Maximum count of point numbers per point.
pub const NUMBERS: usize = MOST.point + MOST.own;

/// Index of the first column of the plastic state among the columns of a pass.
const PLASTIC: usize = NUMBERS + MOST.sum;

/// Maximum number of columns of a pass: point numbers, sums and plastic state.
const COLUMNS: usize = PLASTIC + PlasticState::COUNT;

/// Plastic states of the owned points by column; empty if no law has a plastic state.
pub type PlasticColumns<'a> = [&'a mut [f64]; PlasticState::COUNT];

/// Point numbers, one column per number. The first columns contain owned points and ghosts, because bonds
/// read these columns. The other columns contain owned points only, because bonds do not read them. Laws read
/// them per point.
pub struct PointNumbers {
    /// The point numbers, one column per number. An entry is 0 if the law of the point does not have the
    /// number of the column.
    pub columns: Vec<Column>,
    /// Number of columns that bonds read.
    pub read: usize,
    /// Index of the first column that is recomputed before each force sum.
    pub first_changing: usize,
    /// Number of passes over the bonds before the force sum: the largest [`Law::PASSES`] of all laws.
    pub passes: usize,
    /// Whether any law has constants, which are point numbers that do not change; see [`Law::CONSTANTS`].
    pub with_constants: bool,
    /// Sums of a pass over the bonds, by column.
    pub sums: Vec<Column>,
}

impl PointNumbers {
    /// Allocate the point numbers that the laws of the blocks declare. Their initial value is 0. The blocks
    /// and laws are the same on all ranks.
    pub fn new<const D: usize>(blocks: &[BlockLaws], model: &Model<D>) -> Self {
        let counts: Vec<Counts> = blocks.iter().map(|b| b.law.counts::<D>()).collect();
        let most = |of: fn(&Counts) -> usize| counts.iter().map(of).max().unwrap_or(0);
        let read = most(|c| c.point);
        let all = read.max(most(|c| c.point + c.own));
        let (owned, local) = (model.owned(), model.volume.len());
        let length = |column: usize| if column < read { local } else { owned };
        let sums = most(|c| c.sum);
        let changing = counts.iter().filter(|c| c.passes > 0);
        Self {
            columns: (0..all).map(|k| Column::new(k, length(k), 0.0)).collect(),
            read,
            first_changing: changing.map(|c| c.constants).min().unwrap_or(read),
            passes: most(|c| c.passes),
            with_constants: most(|c| c.constants) > 0,
            sums: (all..all + sums)
                .map(|k| Column::new(k, owned, 0.0))
                .collect(),
        }
    }

    /// Compute the constants of a range of owned points. `sums` contains the columns of sums over the initial
    /// families of these points. Also compute the [truncation factors](Law::truncation_factor) of the points,
    /// unless `truncation_factors` is empty.
    pub fn set_constants<const D: usize>(
        &mut self,
        points: Range<usize>,
        model: &Model<D>,
        blocks: &[BlockLaws],
        sums: &[Vec<f64>],
        truncation_factors: &mut [f64],
    ) {
        let first = points.start;
        let of_family = |block: u16, sums: &[f64; MOST.reference_sum]| {
            let law = blocks[usize::from(block)].law;
            let sums = &sums[..law.counts::<D>().reference_sum];
            let mut numbers = [0.0; NUMBERS];
            Law::<D>::constants(&law, sums, &mut numbers);
            (numbers, Law::<D>::truncation_factor(&law, sums))
        };
        // Consecutive points of a lattice usually have equal families, so each thread reuses the constants of
        // the last point.
        let found = points.clone().into_par_iter().with_min_len(CHUNK);
        let found = found.map_init(
            || None,
            |last, point| {
                let family = (model.block[point], {
                    let mut own = [0.0; MOST.reference_sum];
                    for (own, column) in own.iter_mut().zip(sums) {
                        *own = column[point - first];
                    }
                    own
                });
                match last {
                    Some((known, constants)) if *known == family => *constants,
                    _ => last.insert((family, of_family(family.0, &family.1))).1,
                }
            },
        );
        let found: Vec<_> = found.collect();
        for (point, (numbers, truncation_factor)) in points.zip(found) {
            if let Some(entry) = truncation_factors.get_mut(point) {
                *entry = truncation_factor;
            }
            let law = &blocks[usize::from(model.block[point])].law;
            let constants = law.counts::<D>().constants;
            for (column, number) in self.columns.iter_mut().zip(numbers).take(constants) {
                column[point] = number;
            }
        }
    }

    /// Return the point numbers of an owned point; entries without a column are 0.
    pub fn of(&self, point: usize) -> [f64; NUMBERS] {
        let get = |k: usize| self.columns.get(k).and_then(|column| column.get(point));
        std::array::from_fn(|k| get(k).copied().unwrap_or(0.0))
    }

    /// Compute the rotations of a range of owned points from the sums of the law's first pass. Each column of
    /// `rotations` holds one component. Components with empty columns are skipped.
    pub fn find_rotations<const D: usize>(
        &self,
        points: Range<usize>,
        model: &Model<D>,
        blocks: &[BlockLaws],
        rotations: &mut [Column; 4],
    ) {
        let columns = rotations.each_mut().map(|column| {
            let own = column.get_mut(points.clone());
            own.unwrap_or_default()
        });
        if columns.iter().all(|column| column.is_empty()) {
            return;
        }
        over_points(points, columns, &|points, columns| {
            for (k, point) in points.enumerate() {
                let law = &blocks[usize::from(model.block[point])].law;
                let mut sums = [0.0; MOST.sum];
                for (sum, column) in sums.iter_mut().zip(&self.sums) {
                    *sum = column[point];
                }
                let rotation = Law::<D>::rotation(law, &sums);
                for (column, component) in columns.iter_mut().zip(rotation) {
                    if let Some(entry) = column.get_mut(k) {
                        *entry = component;
                    }
                }
            }
        });
    }

    /// Compute the point numbers of a range of owned points from the sums of a pass. If `bond_update` is
    /// [`BondUpdate::Step`], store the plastic states after flow in `plastic`.
    pub fn finish<const D: usize>(
        &mut self,
        pass: usize,
        points: Range<usize>,
        model: &Model<D>,
        blocks: &[BlockLaws],
        plastic: &mut PlasticColumns<'_>,
        bond_update: BondUpdate,
    ) {
        let step = bond_update.history_step().unwrap_or(0.0);
        let mut columns: [&mut [f64]; COLUMNS] = std::array::from_fn(|_| &mut [][..]);
        for (place, column) in self.columns.iter_mut().enumerate() {
            columns[place] = &mut column[points.clone()];
        }
        for (place, column) in self.sums.iter_mut().enumerate() {
            columns[NUMBERS + place] = &mut column[points.clone()];
        }
        for (place, column) in plastic.iter_mut().enumerate() {
            columns[PLASTIC + place] = column.get_mut(points.clone()).unwrap_or_default();
        }
        over_points(points, columns, &|points, columns| {
            for (k, point) in points.enumerate() {
                let law = &blocks[usize::from(model.block[point])].law;
                let counts = law.counts::<D>();
                if pass >= counts.passes {
                    continue;
                }
                let get = |column: usize| columns[column].get(k).copied().unwrap_or(0.0);
                let found = counts.point + counts.own;
                let mut numbers = [0.0; NUMBERS];
                for (column, number) in numbers[..found].iter_mut().enumerate() {
                    *number = get(column);
                }
                let mut sums = [0.0; MOST.sum];
                for (column, sum) in sums[..counts.sum].iter_mut().enumerate() {
                    *sum = get(NUMBERS + column);
                }
                let before = PlasticState::of(std::array::from_fn(|p| get(PLASTIC + p)));
                let mut after = before;
                let sums = &sums[..counts.sum];
                Law::<D>::update_point(law, pass, sums, &mut numbers, &mut after, step);
                for (column, number) in columns.iter_mut().zip(numbers).take(found) {
                    column[k] = number;
                }
                if bond_update.is_stored() && after != before {
                    for (column, number) in columns[PLASTIC..].iter_mut().zip(after.numbers()) {
                        column[k] = number;
                    }
                }
            }
        });
    }
}

/// Split the points and their columns recursively into pieces. Call `work` for each piece, in parallel.
/// Columns may be empty.
pub(super) fn over_points<const N: usize>(
    points: Range<usize>,
    mut columns: [&mut [f64]; N],
    work: &(impl Fn(Range<usize>, &mut [&mut [f64]; N]) + Sync),
) {
    if points.len() <= CHUNK {
        return work(points, &mut columns);
    }
    let half = points.len() / 2;
    let middle = points.start + half;
    let second = columns.each_mut().map(|column| {
        let whole = std::mem::take(column);
        let (first, second) = whole.split_at_mut(half.min(whole.len()));
        *column = first;
        second
    });
    rayon::join(
        || over_points(points.start..middle, columns, work),
        || over_points(middle..points.end, second, work),
    );
}
