//! Running a kernel over the bonds of two blocks, on all threads.
//!
//! Each task owns the bonds of some points i and the results of these points, so no locks or atomics are
//! needed. The sum of each point is the same sequence of operations for any division into tasks.

use std::ops::Range;

use rustc_hash::FxHashMap;

use crate::families::{BlockBonds, Row, Rows, VectorBonds, Vectors};
#[cfg(target_arch = "x86_64")]
use crate::lanes::simd::{Avx2, Avx512};
use crate::lanes::simd::{Portable, Task};
use crate::lanes::{Column, Instructions, IsaSet, LaneTuple, Lanes, Simd, WIDTH};

use super::breaking::BreakingBonds;
use super::grid_points::{GridPoints, GridValues};
use super::kernel::{Combine, Kernel};
use super::limit_columns::LimitColumns;
use super::list_points::{ListPoints, Node, store_history};

/// Tasks with at most this number of groups of eight bonds are not split further.
const LEAF: usize = 2048;

/// Same as [`LEAF`], for kernels that reuse the sums of a lane group for other lane groups of the task.
const UNDEFORMED_LEAF: usize = 128 * LEAF;

/// Maximum number of cached bit patterns per task. Many patterns at curved surfaces never recur, so a full
/// cache is cleared.
const CACHE_CAPACITY: usize = 256;

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

/// The columns over the points, to which a kernel adds its sums.
type Results<'a, K, const D: usize> = <<K as Kernel<D>>::Sums as LaneTuple>::ColumnsMut<'a>;

/// Sums of a point over those of its bonds that break in a sweep.
#[derive(Debug, Clone, Copy)]
pub struct BrokenSums {
    /// Local index of the point.
    pub point: usize,
    /// The sums of [`BreakingBonds`]; 0 for components beyond the dimension.
    pub sums: [f64; MAX_BROKEN_SUMS],
}

/// Number of sums of [`BreakingBonds`] in three dimensions.
const MAX_BROKEN_SUMS: usize = 6;

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

    /// Run the kernel over a part; `base` is the local index of the point of the first entry of the results.
    /// Return the sums over breaking bonds, by ascending point.
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

/// Run a kernel over the bonds of the owned points in a range of local indices. The results are columns
/// over all owned points.
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

/// Same as [`sweep`], with results that are columns over the owned points from `base` on.
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

/// Same as [`sweep`], for a kernel that breaks bonds. Clear the intact bits of the bonds that break, and
/// return the sums of `breaking` over these bonds, by ascending point.
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

/// Run a kernel that is implemented in `D` dimensions. Kernels that break bonds need the kernel of breaking
/// bonds, too.
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
            let PointData {
                nodes,
                numbers,
                limits,
                is_thermal,
                ..
            } = source;
            let rows = list.rows_below(points.start)..list.rows_below(points.end);
            let leaf = leaf(LEAF, list.groups_a_row());
            let reach = list.reach();
            let points = ListPoints::new(kernel, reach, nodes, numbers, limits, is_thermal);
            let breaking = breaking.map(|kernel| BreakingInRows {
                kernel,
                points: ListPoints::new(kernel, reach, nodes, numbers, limits, is_thermal),
            });
            let runner = OverRows {
                kernel,
                points,
                breaking,
            };
            split(list.rows(rows), base, results, &runner, leaf, instructions)
        }
        BlockBonds::Lattice(lattice) => {
            let vectors = lattice.vectors_below(points.start)..lattice.vectors_below(points.end);
            let whole = if K::READS_BROKEN && kernel.needs_broken() {
                lattice.whole()
            } else {
                Vec::new()
            };
            let volumes = [lattice.own_volume, lattice.volume];
            let values = &source.grids[lattice.index];
            assert!(
                values.is_of(&lattice.grid),
                "the values are those of another grid than the lattice's"
            );
            let points = GridPoints::new(kernel, values, volumes);
            let breaking = breaking.map(|kernel| BreakingInVectors {
                kernel,
                points: GridPoints::new(kernel, values, volumes),
            });
            let runner = OverVectors {
                kernel,
                points,
                breaking,
                whole,
            };
            let most = if kernel.is_undeformed() {
                UNDEFORMED_LEAF
            } else {
                LEAF
            };
            let leaf = leaf(most, lattice.offsets());
            let part = lattice.vectors(vectors);
            split(part, base, results, &runner, leaf, instructions)
        }
    }
}

/// Halve a part repeatedly until the tasks are small, and run the tasks.
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

impl Part for Vectors<'_> {
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

#[inline(always)]
fn combine(combine: Combine, result: &mut f64, value: f64) {
    match combine {
        Combine::Add => *result += value,
        Combine::Smallest => *result = result.min(value),
    }
}

/// For each group of a row or lane group with breaking bonds: its index, and the bits of these bonds.
type BreakingBits = Vec<(usize, u8)>;

/// Note the breaking bonds of a group. Out of line to save registers.
#[cold]
#[inline(never)]
fn note_group(noted: &mut BreakingBits, group: usize, bits: u8) {
    noted.push((group, bits));
}

/// Return the sums over breaking bonds; components beyond the dimension are 0.
#[inline(always)]
fn all_broken<N: LaneTuple>(broken: &N) -> [Lanes; MAX_BROKEN_SUMS] {
    LaneTuple::each(|k| {
        if k < N::COUNT {
            broken.get(k)
        } else {
            Lanes::splat(0.0)
        }
    })
}

/// Record the sums over breaking bonds of a point.
#[cold]
#[inline(never)]
fn note_point(broken_sums: &mut Vec<BrokenSums>, point: usize, broken: &[Lanes; MAX_BROKEN_SUMS]) {
    let sums = broken.map(Lanes::sum);
    broken_sums.push(BrokenSums { point, sums });
}

/// Record the sums over breaking bonds of eight adjacent points.
#[cold]
#[inline(never)]
fn note_vector(broken_sums: &mut Vec<BrokenSums>, first: usize, broken: &[Lanes; MAX_BROKEN_SUMS]) {
    for lane in 0..WIDTH {
        let sums = broken.map(|lanes| lanes.0[lane]);
        if sums[0] > 0.0 {
            let point = first + lane;
            broken_sums.push(BrokenSums { point, sums });
        }
    }
}

/// Number of lane groups that skip the fast path after a failed attempt. The fast path is a loop without
/// failure criterion. An attempt fails if |x| of a bond, with x of [`crate::material::bond`], exceeds
/// [`Criterion::limit`](crate::damage::Criterion::limit). Large |x| occur in clusters, so further attempts
/// would probably fail.
const FAST_PATH_BACKOFF: usize = 7;

/// Choice of the loop for the next lane group. Lists have no fast path, because loading points j takes most
/// of the time.
struct FastPathGate {
    /// Whether the kernel may skip its criterion, and does not remove thermal stretches.
    is_allowed: bool,
    /// Number of lane groups that must still skip the fast path.
    skipped: usize,
}

impl FastPathGate {
    fn new<K: Kernel<D>, const D: usize>(kernel: &K, points: &GridPoints<'_, K, D>) -> Self {
        Self {
            is_allowed: kernel.may_skip_criterion() && !points.is_thermal(),
            skipped: 0,
        }
    }

    /// Sum over the bonds of a lane group, without the bonds that break.
    #[inline(always)]
    fn sum<K: Kernel<D>, S: Simd, const D: usize>(
        &mut self,
        simd: S,
        task: WholeVector<'_, '_, '_, K, D>,
    ) -> K::Sums {
        if const { !K::HAS_FAST_PATH } {
            return task.run(simd);
        }
        if self.is_allowed && self.skipped == 0 {
            // SAFETY: the points of a task belong to the grid of its lane group.
            let sums = unsafe { fast_vector(simd, task.kernel, task.points, task.vector) };
            if let Some(sums) = sums {
                return sums;
            }
            self.skipped = FAST_PATH_BACKOFF;
        } else {
            self.skipped = self.skipped.saturating_sub(1);
        }
        simd.aside(task)
    }
}

/// Cache of the sums over the bonds of lane groups, for [undeformed](Kernel::is_undeformed) kernels. The key
/// is the intact bits of a lane group.
struct Known<N>(FxHashMap<Box<[u8]>, N>);

impl<N: LaneTuple> Known<N> {
    /// Store the sums of a lane group.
    fn insert(&mut self, vector: &VectorBonds<'_>, sums: N) {
        if self.0.len() == CACHE_CAPACITY {
            self.0.clear();
        }
        self.0.insert(Box::from(&*vector.groups.intact), sums);
    }
}

/// Sum over the bonds of a lane group; `None` if |x| of a bond, with x of [`crate::material::bond`],
/// exceeds the limit of the kernel's criterion.
/// The arguments are copied so that they stay in registers.
///
/// # Safety
/// The lane group must belong to the grid of `points`.
#[inline(always)]
unsafe fn fast_vector<K: Kernel<D>, S: Simd, const D: usize>(
    simd: S,
    kernel: K,
    points: GridPoints<'_, K, D>,
    vector: &mut VectorBonds<'_>,
) -> Option<K::Sums> {
    let mut sums = kernel.start();
    // SAFETY: the caller guarantees that the lane group belongs to the grid.
    let own = unsafe { points.load_point_i(vector.slot) };
    for o in 0..vector.offsets.len() {
        // SAFETY: as above.
        let mut bonds = unsafe { points.load::<S, true>(simd, &own, vector, o) };
        if bonds.bond.beyond_series != 0 {
            return None;
        }
        kernel.add_fast(simd, &mut bonds, &mut sums);
    }
    Some(sums)
}

/// Task that sums over the bonds of a lane group. Bonds that break are left out.
struct WholeVector<'t, 'v, 'p, K: Kernel<D>, const D: usize> {
    kernel: K,
    /// Points of the grid of the lane group.
    points: GridPoints<'p, K, D>,
    /// The bits of all bonds, including broken bonds; `None` if the kernel does not read these bits.
    whole: Option<&'t [u8]>,
    vector: &'t mut VectorBonds<'v>,
    /// Receives the breaking bonds.
    noted: &'t mut BreakingBits,
}

impl<K: Kernel<D>, const D: usize> Task for WholeVector<'_, '_, '_, K, D> {
    type Output = K::Sums;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> K::Sums {
        let (kernel, points, vector) = (self.kernel, self.points, self.vector);
        let mut sums = kernel.start();
        // SAFETY: `points` belongs to the grid of the lane group.
        let own = unsafe { points.load_point_i(vector.slot) };
        for o in 0..vector.offsets.len() {
            // SAFETY: as above.
            let mut bonds = unsafe { points.load::<S, false>(simd, &own, vector, o) };
            if K::READS_BROKEN {
                bonds.whole = self.whole.map_or(0, |bits| bits[o]);
            }
            let before = bonds.intact;
            kernel.add(simd, &mut bonds, &mut sums);
            if K::BREAKS && before != bonds.intact {
                note_group(self.noted, o, before ^ bonds.intact);
            }
            if K::BondHistory::COUNT > 0 && kernel.stores_history() {
                store_history(vector.groups.history(o), &bonds.history, before);
            }
        }
        sums
    }
}

/// The kernel of breaking bonds and the points of a grid.
struct BreakingInVectors<'a, const D: usize> {
    kernel: &'a BreakingBonds,
    points: GridPoints<'a, BreakingBonds, D>,
}

/// Task that sums over the breaking bonds of a lane group and clears their intact bits.
struct BrokenOfVector<'t, 'v, 'p, const D: usize> {
    breaking: &'t BreakingInVectors<'p, D>,
    vector: &'t mut VectorBonds<'v>,
    /// The breaking bonds that the first loop noted.
    noted: &'t BreakingBits,
}

impl<const D: usize> Task for BrokenOfVector<'_, '_, '_, D> {
    type Output = [Lanes; MAX_BROKEN_SUMS];

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Self::Output {
        let BreakingInVectors { kernel, points } = *self.breaking;
        let vector = self.vector;
        let mut sums = kernel.start();
        // SAFETY: the points of a task belong to the grid of its lane group.
        let own = unsafe { points.load_point_i(vector.slot) };
        for (o, bits) in self.noted {
            // SAFETY: as above.
            let mut bonds = unsafe { points.load::<S, false>(simd, &own, vector, *o) };
            bonds.intact = *bits;
            kernel.add(simd, &mut bonds, &mut sums);
            vector.groups.intact[*o] &= !bits;
        }
        all_broken(&sums)
    }
}

/// The kernel of breaking bonds and the points of a list.
struct BreakingInRows<'a, const D: usize> {
    kernel: &'a BreakingBonds,
    points: ListPoints<'a, BreakingBonds, D>,
}

/// Task that sums over the breaking bonds of a row and clears their intact bits.
struct BrokenOfRow<'t, 'r, 'p, const D: usize> {
    breaking: &'t BreakingInRows<'p, D>,
    row: &'t mut Row<'r>,
    /// The breaking bonds that the first loop noted.
    noted: &'t BreakingBits,
}

impl<const D: usize> Task for BrokenOfRow<'_, '_, '_, D> {
    type Output = [Lanes; MAX_BROKEN_SUMS];

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Self::Output {
        let BreakingInRows { kernel, points } = *self.breaking;
        let row = self.row;
        let mut sums = kernel.start();
        // SAFETY: the points of a task belong to the list of its row.
        let own = unsafe { points.load_point_i(row.point) };
        for (group, bits) in self.noted {
            // SAFETY: as above.
            let mut bonds = unsafe { points.load(simd, &own, row, *group) };
            bonds.intact = *bits;
            kernel.add(simd, &mut bonds, &mut sums);
            row.groups.intact[*group] &= !bits;
        }
        all_broken(&sums)
    }
}

struct OverRows<'a, K: Kernel<D>, const D: usize> {
    kernel: &'a K,
    points: ListPoints<'a, K, D>,
    /// `None` for kernels that break no bonds.
    breaking: Option<BreakingInRows<'a, D>>,
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
            let here = unsafe { points.load_point_i(row.point) };
            for group in 0..row.neighbours.len() {
                // SAFETY: as above.
                let mut bonds = unsafe { points.load(simd, &here, &mut row, group) };
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
                combine(K::COMBINE, &mut column[row.point - base], value);
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

struct OverVectors<'a, K: Kernel<D>, const D: usize> {
    kernel: &'a K,
    points: GridPoints<'a, K, D>,
    /// `None` for kernels that break no bonds.
    breaking: Option<BreakingInVectors<'a, D>>,
    /// The bits of all bonds of all lane groups, including broken bonds; empty if the kernel does not need
    /// these bits.
    whole: Vec<u8>,
}

impl<'b, K: Kernel<D>, const D: usize> Runner<Vectors<'b>> for OverVectors<'_, K, D> {
    type Sums = K::Sums;
    const ISA_SET: IsaSet = K::ISA_SET;

    #[inline(always)]
    fn run<S: Simd>(
        &self,
        simd: S,
        mut vectors: Vectors<'b>,
        base: usize,
        mut results: Results<'_, K, D>,
    ) -> Vec<BrokenSums> {
        let mut broken_sums = Vec::new();
        // The loop can keep these copies in registers.
        let (kernel, points, whole) = (*self.kernel, self.points, &self.whole);
        let mut gate = FastPathGate::new(&kernel, &points);
        let is_undeformed = kernel.is_undeformed();
        let mut known = Known(FxHashMap::default());
        let mut noted = BreakingBits::new();
        for k in 0..vectors.len() {
            let mut vector: VectorBonds<'_> = vectors.vector(k);
            let whole = whole.get(vector.bits.clone());
            let known_sums = if is_undeformed {
                known.0.get(&*vector.groups.intact).copied()
            } else {
                None
            };
            let sums = match known_sums {
                Some(sums) => sums,
                None => {
                    let task = WholeVector {
                        kernel,
                        points,
                        whole,
                        vector: &mut vector,
                        noted: &mut noted,
                    };
                    let found = gate.sum(simd, task);
                    if is_undeformed {
                        known.insert(&vector, found);
                    }
                    found
                }
            };
            let first = vector.point - base;
            for quantity in 0..K::Sums::COUNT {
                let column = K::Sums::column_mut(&mut results, quantity);
                let lanes: Lanes = sums.get(quantity);
                for lane in 0..WIDTH {
                    if vector.members >> lane & 1 == 1 {
                        combine(K::COMBINE, &mut column[first + lane], lanes.0[lane]);
                    }
                }
            }
            if K::BREAKS && !noted.is_empty() {
                let broken = simd.aside(BrokenOfVector {
                    breaking: (self.breaking.as_ref()).expect("a kernel that breaks bonds"),
                    vector: &mut vector,
                    noted: &noted,
                });
                note_vector(&mut broken_sums, vector.point, &broken);
                noted.clear();
            }
        }
        broken_sums
    }
}
