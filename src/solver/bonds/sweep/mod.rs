//! Sweeps: a kernel runs over the bonds between two blocks, on all threads.
//!
//! Each task owns the bonds of some points i and the results of these points, so no locks or atomics are
//! needed. The sum of each point is computed with the same sequence of operations for any division of the
//! points into tasks.

use std::ops::Range;

use crate::families::BlockBonds;
use crate::lanes::simd::Portable;
#[cfg(target_arch = "x86_64")]
use crate::lanes::simd::{Avx2, Avx512};
use crate::lanes::{Column, Instructions, IsaSet, LaneTuple, Simd};

use super::breaking::{BreakingBonds, BrokenSums};
use super::grid_points::GridValues;
use super::kernel::Kernel;
use super::limit_columns::LimitColumns;
use super::list_points::Node;
use lattice::OverVectors;
use list::OverRows;

mod lattice;
mod list;

/// Tasks with at most this number of groups of eight bonds are not split further.
const LEAF: usize = 2048;

/// Same as [`LEAF`], for kernels that reuse the sums of a lane group for other lane groups of the task.
const UNDEFORMED_LEAF: usize = 128 * LEAF;

/// Point data that kernels read.
#[derive(Clone, Copy)]
pub struct PointData<'a, const D: usize> {
    /// Packed positions, displacements, volumes and thermal stretches for lists; empty without lists.
    pub nodes: &'a [Node],
    /// Point numbers by column, for lists.
    pub numbers: &'a [Column],
    /// Thresholds, truncation factors, rotations and stress measures, for lists.
    pub limits: &'a LimitColumns,
    /// Point data for lattices (displacements, thermal stretches, point numbers and limits), by grid.
    pub grids: &'a [GridValues<D>],
    /// Whether points have thermal stretches.
    pub is_thermal: bool,
    /// Instruction set with which the kernels run.
    pub instructions: Instructions,
}

/// Columns with one entry per point. A kernel adds its sums to these columns.
type Results<'a, K, const D: usize> = <<K as Kernel<D>>::Sums as LaneTuple>::ColumnsMut<'a>;

/// A part of the bonds of two blocks.
trait Part: Sized + Send {
    /// Number of rows (lists) or lane groups (lattices).
    fn len(&self) -> usize;

    /// Local index of the first point of the row or lane group `k`.
    fn point(&self, k: usize) -> usize;

    /// Split before the row or lane group `k`.
    fn split_at(self, k: usize) -> (Self, Self);
}

/// A kernel with its input data, for one kind of storage.
trait Runner<P: Part>: Sync {
    type Sums: LaneTuple;

    /// Run the kernel over a part. The first entry of the results belongs to the point with the local index
    /// `base`. Return the sums over breaking bonds, in ascending order of the points.
    fn run<S: Simd>(
        &self,
        simd: S,
        part: P,
        base: usize,
        results: <Self::Sums as LaneTuple>::ColumnsMut<'_>,
    ) -> Vec<BrokenSums>;

    /// Instruction sets for which the runner is compiled.
    const ISA_SET: IsaSet;
}

/// Run a kernel over the bonds of the owned points in a range of local indices. The results are columns over
/// all owned points.
///
/// # Panics
/// If an array that the kernel reads is too short for the bonds, if the point data of a lattice belong to
/// another grid, or if the kernel is not implemented in `D` dimensions.
pub fn sweep<K: Kernel<D>, const D: usize>(
    bonds: &mut BlockBonds,
    points: Range<usize>,
    results: Results<'_, K, D>,
    kernel: &K,
    source: PointData<'_, D>,
) {
    sweep_from(bonds, points, 0, results, kernel, source);
}

/// Same as [`sweep`], but the first entry of each result column belongs to the point with the local index
/// `base`.
pub fn sweep_from<K: Kernel<D>, const D: usize>(
    bonds: &mut BlockBonds,
    points: Range<usize>,
    base: usize,
    results: Results<'_, K, D>,
    kernel: &K,
    source: PointData<'_, D>,
) {
    const { assert!(!K::BREAKS) };
    sweep_if_exists(bonds, points, base, results, (kernel, None), source);
}

/// Same as [`sweep`], for a kernel that breaks bonds. Clear the intact bits of the bonds that break. Return
/// the sums that the kernel `breaking` computes over these bonds, in ascending order of the points.
pub fn sweep_and_break<K: Kernel<D>, const D: usize>(
    bonds: &mut BlockBonds,
    points: Range<usize>,
    results: Results<'_, K, D>,
    kernel: &K,
    breaking: &BreakingBonds,
    source: PointData<'_, D>,
) -> Vec<BrokenSums> {
    sweep_if_exists(bonds, points, 0, results, (kernel, Some(breaking)), source)
}

/// Run a kernel, which must be implemented in `D` dimensions. `kernels` are this kernel and the kernel that
/// sums over breaking bonds. The latter is `None` if this kernel breaks no bonds.
fn sweep_if_exists<K: Kernel<D>, const D: usize>(
    bonds: &mut BlockBonds,
    points: Range<usize>,
    base: usize,
    results: Results<'_, K, D>,
    kernels: (&K, Option<&BreakingBonds>),
    source: PointData<'_, D>,
) -> Vec<BrokenSums> {
    if const { K::EXISTS } {
        sweep_blocks(bonds, points, base, results, kernels, source)
    } else {
        unreachable!("the kernel is not implemented in {D} dimensions")
    }
}

fn sweep_blocks<K: Kernel<D>, const D: usize>(
    bonds: &mut BlockBonds,
    points: Range<usize>,
    base: usize,
    results: Results<'_, K, D>,
    (kernel, breaking): (&K, Option<&BreakingBonds>),
    source: PointData<'_, D>,
) -> Vec<BrokenSums> {
    let instructions = source.instructions;
    let several = rayon::current_num_threads() > 1;
    let leaf = |most: usize, groups: usize| {
        if several {
            (most / groups.max(1)).max(1)
        } else {
            usize::MAX
        }
    };
    match bonds {
        BlockBonds::List(list) => {
            let rows = list.rows_below(points.start)..list.rows_below(points.end);
            let leaf = leaf(LEAF, list.groups_a_row());
            let runner = OverRows::new(kernel, breaking, list.reach(), source);
            split(list.rows(rows), base, results, &runner, leaf, instructions)
        }
        BlockBonds::Lattice(lattice) => {
            let vectors = lattice.vectors_below(points.start)..lattice.vectors_below(points.end);
            let most = if kernel.is_undeformed() {
                UNDEFORMED_LEAF
            } else {
                LEAF
            };
            let leaf = leaf(most, lattice.offsets());
            let runner = OverVectors::new(kernel, breaking, lattice, source);
            split(
                lattice.vectors(vectors),
                base,
                results,
                &runner,
                leaf,
                instructions,
            )
        }
    }
}

/// Halve a part repeatedly until each task has at most `leaf` rows or lane groups, and run the tasks.
fn split<P: Part, R: Runner<P>>(
    part: P,
    base: usize,
    results: <R::Sums as LaneTuple>::ColumnsMut<'_>,
    runner: &R,
    leaf: usize,
    instructions: Instructions,
) -> Vec<BrokenSums> {
    if part.len() <= leaf {
        return run(part, base, results, runner, instructions);
    }
    let half = part.len() / 2;
    let border = part.point(half);
    let (part_a, part_b) = part.split_at(half);
    let [results_a, results_b] = R::Sums::split_at(results, border - base);
    let half = |part, base, results| {
        let mut work = Some((part, results));
        move |broken_sums: &mut Vec<BrokenSums>| {
            if let Some((part, results)) = work.take() {
                *broken_sums = split(part, base, results, runner, leaf, instructions);
            }
        }
    };
    let [mut all, mut rest] = both([
        &mut half(part_a, base, results_a),
        &mut half(part_b, border, results_b),
    ]);
    all.append(&mut rest);
    all
}

/// A closure that runs half of a task.
type Half<'a> = &'a mut (dyn FnMut(&mut Vec<BrokenSums>) + Send);

/// Run both halves, in parallel if a thread is free. This function is compiled once for all kernels.
fn both([first, second]: [Half<'_>; 2]) -> [Vec<BrokenSums>; 2] {
    let mut broken_sums = [Vec::new(), Vec::new()];
    let [of_first, of_second] = &mut broken_sums;
    rayon::join(|| first(of_first), || second(of_second));
    broken_sums
}

fn run<P: Part, R: Runner<P>>(
    part: P,
    base: usize,
    results: <R::Sums as LaneTuple>::ColumnsMut<'_>,
    runner: &R,
    instructions: Instructions,
) -> Vec<BrokenSums> {
    if const { R::ISA_SET.is_one() } {
        return runner.run(Portable::<false>, part, base, results);
    }
    match instructions {
        #[cfg(target_arch = "x86_64")]
        Instructions::Avx512(simd) => {
            if const { R::ISA_SET.is_each() } {
                // SAFETY: `simd` proves that the CPU has these instructions.
                unsafe { run_avx512(simd, part, base, results, runner) }
            } else {
                // SAFETY: `simd` proves that the CPU has these instructions; AVX-512 includes AVX2.
                unsafe { run_avx2(simd.avx2(), part, base, results, runner) }
            }
        }
        // SAFETY: `simd` proves that the CPU has these instructions.
        #[cfg(target_arch = "x86_64")]
        Instructions::Avx2(simd) => unsafe { run_avx2(simd, part, base, results, runner) },
        #[cfg(not(target_arch = "x86_64"))]
        Instructions::Portable => runner.run(Portable::<true>, part, base, results),
    }
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512dq,avx512vl,avx512bw,avx2,bmi2,fma")]
fn run_avx512<P: Part, R: Runner<P>>(
    simd: Avx512,
    part: P,
    base: usize,
    results: <R::Sums as LaneTuple>::ColumnsMut<'_>,
    runner: &R,
) -> Vec<BrokenSums> {
    runner.run(simd, part, base, results)
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,bmi2,fma")]
fn run_avx2<P: Part, R: Runner<P>>(
    simd: Avx2,
    part: P,
    base: usize,
    results: <R::Sums as LaneTuple>::ColumnsMut<'_>,
    runner: &R,
) -> Vec<BrokenSums> {
    runner.run(simd, part, base, results)
}
