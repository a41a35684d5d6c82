//! The loop of a sweep over bonds in lattices.

use rustc_hash::FxHashMap;

use crate::families::{BondLattice, VectorBonds, Vectors};
use crate::lanes::simd::Task;
use crate::lanes::{IsaSet, LaneTuple, Lanes, Simd, WIDTH};

use super::super::breaking::{
    BreakingBits, BreakingBonds, BrokenSums, MAX_BROKEN_SUMS, note_group, padded,
};
use super::super::grid_points::GridPoints;
use super::super::kernel::Kernel;
use super::super::list_points::store_history;
use super::{Part, PointData, Results, Runner};

/// Maximum number of cached bit patterns per task. When the cache is full, all patterns are removed. At
/// curved surfaces, many patterns never recur, and would otherwise stay in the cache.
const CACHE_CAPACITY: usize = 256;

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

/// Runs a kernel over lane groups of a lattice.
pub(super) struct OverVectors<'a, K: Kernel<D>, const D: usize> {
    kernel: &'a K,
    points: GridPoints<'a, K, D>,
    /// `None` for kernels that break no bonds.
    breaking: Option<BreakingInVectors<'a, D>>,
    /// One byte for each lane group and offset. Bit k of a byte is set if lane k has a bond, intact or
    /// broken. The vector is empty if the kernel does not need these bits.
    whole: Vec<u8>,
}

impl<'a, K: Kernel<D>, const D: usize> OverVectors<'a, K, D> {
    /// Prepare the loop over a lattice. `breaking` is `None` for kernels that break no bonds.
    ///
    /// # Panics
    /// If the point data belong to another grid.
    pub(super) fn new(
        kernel: &'a K,
        breaking: Option<&'a BreakingBonds>,
        lattice: &BondLattice,
        source: PointData<'a, D>,
    ) -> Self {
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
        Self {
            kernel,
            points: GridPoints::new(kernel, values, volumes),
            breaking: breaking.map(|kernel| BreakingInVectors {
                kernel,
                points: GridPoints::new(kernel, values, volumes),
            }),
            whole,
        }
    }
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
                        K::COMBINE.apply(&mut column[first + lane], lanes.0[lane]);
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

/// Number of lane groups that skip the fast path after a failed attempt. The fast path is a loop without
/// failure criterion. An attempt fails if |x| of a bond (see [`crate::material::bond`]) exceeds
/// [`Criterion::limit`](crate::damage::Criterion::limit). Large |x| occur in clusters, so further attempts
/// would probably fail.
const FAST_PATH_BACKOFF: usize = 7;

/// Choice between the fast path and the full loop for the next lane group. Lists have no fast path, because
/// their loops spend most of the time on loading points j.
struct FastPathGate {
    /// Whether the fast path is allowed. It is allowed if the kernel may skip its criterion, and if no
    /// thermal stretches have to be removed from the bonds.
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

/// Sum over the bonds of a lane group; `None` if |x| of a bond (see [`crate::material::bond`]) exceeds the
/// limit of the kernel's criterion. `kernel` and `points` are passed by value so that they stay in registers.
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
    /// Points of the grid that contains the lane group.
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

/// The kernel [`BreakingBonds`], and the points of a grid.
struct BreakingInVectors<'a, const D: usize> {
    kernel: &'a BreakingBonds,
    points: GridPoints<'a, BreakingBonds, D>,
}

/// Task that sums over the breaking bonds of a lane group and clears their intact bits.
struct BrokenOfVector<'t, 'v, 'p, const D: usize> {
    breaking: &'t BreakingInVectors<'p, D>,
    vector: &'t mut VectorBonds<'v>,
    /// The breaking bonds that [`WholeVector`] noted.
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
        padded::<D>(&sums)
    }
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
