//! The numbers of points that laws declare: how they follow from sums over bonds.

use crate::material::{AnyLaw, Counts, Law, MOST};
use crate::solver::model::Model;

use super::interaction::BlockLaws;

/// Points handled by one task.
const CHUNK: usize = 4096;

/// Numbers of a point, at most.
pub const NUMBERS: usize = MOST.point + MOST.own;

/// Columns that a stage works on, at most: numbers, sums over the bonds left, sums over those that
/// broke, energy set free.
const COLUMNS: usize = NUMBERS + 2 * MOST.sum + 1;

/// The numbers of the local points by column: those that bonds read (of ghosts too), then those of a
/// law alone (of owned points).
pub struct PointNumbers {
    /// By column; a law with fewer leaves the others at 0.
    pub columns: Vec<Vec<f64>>,
    /// How many columns bonds read.
    pub read: usize,
    /// The first column that is found anew before each sum of forces.
    pub first_changing: usize,
    /// How many sums come before that of the forces.
    pub stages: usize,
    /// Whether any law has constants.
    pub with_constants: bool,
    /// Sums of a stage over the bonds left and over those that broke, by column.
    pub sums: Vec<Vec<f64>>,
}

impl PointNumbers {
    /// For the laws of a deck, the same on all ranks; all numbers are 0. `mixed` says whether bonds
    /// join blocks of different laws, which read the numbers of all laws.
    pub fn new<const D: usize>(blocks: &[BlockLaws], mixed: bool, model: &Model<D>) -> Self {
        let counts: Vec<Counts> = blocks.iter().map(|b| b.law.counts::<D>()).collect();
        let most = |of: fn(&Counts) -> usize| counts.iter().map(of).max().unwrap_or(0);
        let read = if mixed { MOST.point } else { most(|c| c.point) };
        let all = read.max(most(|c| c.point + c.own));
        let (owned, local) = (model.owned(), model.volume.len());
        let length = |column: usize| if column < read { local } else { owned };
        let changing = counts.iter().filter(|c| c.stages > 0);
        Self {
            columns: (0..all).map(|k| vec![0.0; length(k)]).collect(),
            read,
            first_changing: changing.map(|c| c.constants).min().unwrap_or(read),
            stages: most(|c| c.stages),
            with_constants: most(|c| c.constants) > 0,
            sums: vec![vec![0.0; owned]; 2 * if mixed { MOST.sum } else { most(|c| c.sum) }],
        }
    }

    /// Finds the constants of the owned points from sums over their whole families, by column.
    pub fn set_constants<const D: usize>(
        &mut self,
        model: &Model<D>,
        blocks: &[BlockLaws],
        sums: &[Vec<f64>],
    ) {
        for point in 0..model.owned() {
            let law = blocks[usize::from(model.block[point])].law;
            let count = law.counts::<D>();
            let mut own = [0.0; MOST.whole_sum];
            for (own, column) in own.iter_mut().zip(sums) {
                *own = column[point];
            }
            let mut numbers = [0.0; NUMBERS];
            Law::<D>::constants(&law, &own[..count.whole_sum], &mut numbers);
            for (column, number) in self.columns.iter_mut().zip(numbers).take(count.constants) {
                column[point] = number;
            }
        }
    }

    /// Finds the numbers that follow from the sums of a stage, and adds the energy (J) that points have
    /// lost because bonds broke.
    pub fn finish<const D: usize>(
        &mut self,
        stage: usize,
        model: &Model<D>,
        blocks: &[BlockLaws],
        freed: &mut [f64],
    ) {
        let owned = model.owned();
        let sums = self.sums.len() / 2;
        let mut columns: [&mut [f64]; COLUMNS] = std::array::from_fn(|_| &mut [][..]);
        for (place, column) in self.columns.iter_mut().enumerate() {
            columns[place] = &mut column[..owned];
        }
        let (left, lost) = self.sums.split_at_mut(sums);
        for (k, (left, lost)) in left.iter_mut().zip(lost).enumerate() {
            columns[NUMBERS + k] = left;
            columns[NUMBERS + MOST.sum + k] = lost;
        }
        columns[COLUMNS - 1] = freed;
        over_points(0..owned, columns, &|first, columns| {
            for k in 0..columns[COLUMNS - 1].len() {
                let point = first + k;
                let law = blocks[usize::from(model.block[point])].law;
                let counts = law.counts::<D>();
                if stage >= counts.stages {
                    continue;
                }
                let get = |column: usize| columns[column].get(k).copied().unwrap_or(0.0);
                let mut numbers: [f64; NUMBERS] = std::array::from_fn(get);
                let left: [f64; MOST.sum] = std::array::from_fn(|s| get(NUMBERS + s));
                let lost: [f64; MOST.sum] = std::array::from_fn(|s| get(NUMBERS + MOST.sum + s));
                let mut change = 0.0;
                if lost.iter().any(|sum| *sum != 0.0) {
                    let before: [f64; MOST.sum] = std::array::from_fn(|s| lost[s] + left[s]);
                    change += energy_at::<D>(&law, stage, &before, numbers)
                        - energy_at::<D>(&law, stage, &left, numbers);
                }
                Law::<D>::point(&law, stage, &left[..counts.sum], &mut numbers);
                for (column, number) in columns
                    .iter_mut()
                    .zip(numbers)
                    .take(counts.point + counts.own)
                {
                    column[k] = number;
                }
                columns[COLUMNS - 1][k] += model.volume[point] * change;
            }
        });
    }
}

/// The energy density of a point (J/m³) whose stage has these sums.
fn energy_at<const D: usize>(
    law: &AnyLaw,
    stage: usize,
    sums: &[f64],
    mut numbers: [f64; NUMBERS],
) -> f64 {
    Law::<D>::point(law, stage, &sums[..law.counts::<D>().sum], &mut numbers);
    Law::<D>::point_energy(law, &numbers)
}

/// Calls `work` with parts of the columns, on all threads, and the index of the first entry; columns
/// may be empty.
fn over_points<const N: usize>(
    range: std::ops::Range<usize>,
    mut columns: [&mut [f64]; N],
    work: &(impl Fn(usize, &mut [&mut [f64]; N]) + Sync),
) {
    if range.len() <= CHUNK {
        return work(range.start, &mut columns);
    }
    let half = range.len() / 2;
    let middle = range.start + half;
    let second = columns.each_mut().map(|column| {
        let whole = std::mem::take(column);
        let (first, second) = whole.split_at_mut(half.min(whole.len()));
        *column = first;
        second
    });
    rayon::join(
        || over_points(range.start..middle, columns, work),
        || over_points(middle..range.end, second, work),
    );
}
