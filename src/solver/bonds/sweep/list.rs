//! The loop of a sweep over bonds in lists.

use crate::families::{Row, Rows};
use crate::lanes::simd::Task;
use crate::lanes::{IsaSet, LaneTuple, Lanes, Simd};

use super::super::breaking::{
    BreakingBits, BreakingBonds, BrokenSums, MAX_BROKEN_SUMS, note_group, padded,
};
use super::super::kernel::{Combine, Kernel};
use super::super::list_points::{ListPoints, store_history};
use super::{Part, PointData, Results, Runner};

impl Part for Rows<'_> {
    fn len(&self) -> usize {
        self.len()
    }

    fn point(&self, k: usize) -> usize {
        self.point(k)
    }

    fn split_at(self, k: usize) -> (Self, Self) {
        self.split_at(k)
    }
}

/// Runs a kernel over rows of a list.
pub(super) struct OverRows<'a, K: Kernel<D>, const D: usize> {
    kernel: &'a K,
    points: ListPoints<'a, K, D>,
    /// `None` for kernels that break no bonds.
    breaking: Option<BreakingInRows<'a, D>>,
}

impl<'a, K: Kernel<D>, const D: usize> OverRows<'a, K, D> {
    /// Prepare the loop over a list whose local indices are below `reach`. `breaking` is `None` for kernels
    /// that break no bonds.
    pub(super) fn new(
        kernel: &'a K,
        breaking: Option<&'a BreakingBonds>,
        reach: usize,
        source: PointData<'a, D>,
    ) -> Self {
        let PointData {
            nodes,
            numbers,
            limits,
            is_thermal,
            ..
        } = source;
        Self {
            kernel,
            points: ListPoints::new(kernel, reach, nodes, numbers, limits, is_thermal),
            breaking: breaking.map(|kernel| BreakingInRows {
                kernel,
                points: ListPoints::new(kernel, reach, nodes, numbers, limits, is_thermal),
            }),
        }
    }
}

impl<'b, K: Kernel<D>, const D: usize> Runner<Rows<'b>> for OverRows<'_, K, D> {
    type Sums = K::Sums;
    const ISA_SET: IsaSet = K::ISA_SET;

    #[inline(always)]
    fn run<S: Simd>(
        &self,
        simd: S,
        mut rows: Rows<'b>,
        base: usize,
        mut results: Results<'_, K, D>,
    ) -> Vec<BrokenSums> {
        let mut broken_sums = Vec::new();
        let mut noted = BreakingBits::new();
        let (kernel, points) = (*self.kernel, self.points);
        for k in 0..rows.len() {
            let mut row: Row<'_> = rows.row(k);
            let mut sums = kernel.start();
            // SAFETY: the rows belong to the list for whose reach `points` was made.
            let own = unsafe { points.load_point_i(row.point) };
            for group in 0..row.neighbours.len() {
                // SAFETY: as above.
                let mut bonds = unsafe { points.load(simd, &own, &mut row, group) };
                let before = bonds.intact;
                kernel.add(simd, &mut bonds, &mut sums);
                if K::BREAKS && before != bonds.intact {
                    note_group(&mut noted, group, before ^ bonds.intact);
                }
                if K::BondHistory::COUNT > 0 && kernel.stores_history() {
                    store_history(row.groups.history(group), &bonds.history, before);
                }
            }
            for quantity in 0..K::Sums::COUNT {
                let lanes = sums.get(quantity);
                let value = match K::COMBINE {
                    Combine::Add => lanes.sum(),
                    Combine::Smallest => lanes.smallest(),
                };
                let column = K::Sums::column_mut(&mut results, quantity);
                K::COMBINE.apply(&mut column[row.point - base], value);
            }
            if K::BREAKS && !noted.is_empty() {
                let broken = simd.aside(BrokenOfRow {
                    breaking: (self.breaking.as_ref()).expect("a kernel that breaks bonds"),
                    row: &mut row,
                    noted: &noted,
                });
                note_point(&mut broken_sums, row.point, &broken);
                noted.clear();
            }
        }
        broken_sums
    }
}

/// The kernel [`BreakingBonds`], and the points of a list in the form that this kernel reads.
struct BreakingInRows<'a, const D: usize> {
    kernel: &'a BreakingBonds,
    points: ListPoints<'a, BreakingBonds, D>,
}

/// Task that sums over the breaking bonds of a row and clears their intact bits.
struct BrokenOfRow<'t, 'r, 'p, const D: usize> {
    breaking: &'t BreakingInRows<'p, D>,
    row: &'t mut Row<'r>,
    /// The breaking bonds that `OverRows::run` noted.
    noted: &'t BreakingBits,
}

impl<const D: usize> Task for BrokenOfRow<'_, '_, '_, D> {
    type Output = [Lanes; MAX_BROKEN_SUMS];

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Self::Output {
        let BreakingInRows { kernel, points } = *self.breaking;
        let row = self.row;
        let mut sums = kernel.start();
        // SAFETY: the row belongs to the list for whose reach `points` was made.
        let own = unsafe { points.load_point_i(row.point) };
        for (group, bits) in self.noted {
            // SAFETY: as above.
            let mut bonds = unsafe { points.load(simd, &own, row, *group) };
            bonds.intact = *bits;
            kernel.add(simd, &mut bonds, &mut sums);
            row.groups.intact[*group] &= !bits;
        }
        padded::<D>(&sums)
    }
}

/// Record the sums over breaking bonds of a point.
#[cold]
#[inline(never)]
fn note_point(broken_sums: &mut Vec<BrokenSums>, point: usize, broken: &[Lanes; MAX_BROKEN_SUMS]) {
    let sums = broken.map(Lanes::sum);
    broken_sums.push(BrokenSums { point, sums });
}
