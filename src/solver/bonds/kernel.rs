//! Sums over the bonds of points: forces, point numbers, energies.
//!
//! A kernel adds eight bonds at a time to eight lanes of each sum. The same kernel is used for bonds in lists
//! and for bonds in lattices. In a list, the eight bonds belong to one point; in a lattice, to eight points.

use crate::damage::{Criterion, Ends, Limits};
use crate::lanes::{IsaSet, LaneTuple, Lanes, Simd};
use crate::material::bond::{Wanted, Weights};
use crate::material::{Bond, ForceState, Law};

/// Eight bonds ij with their history and the data of both points.
pub struct Group<'a, K: Kernel<D>, const D: usize> {
    /// Geometry of the bonds in the form that laws read.
    pub bond: Bond<D>,
    /// Volumes of points i, m³.
    pub volume_i: Lanes,
    /// Volumes of points j, m³.
    pub volume_j: Lanes,
    /// Factor from force states to the force density: V_j/(1 + a), m³, where a is the thermal stretch of the
    /// bond.
    pub force_volume: Lanes,
    /// Weights of the bonds at each end: influence function times volume correction.
    pub weights: Weights,
    /// Point numbers of points i.
    pub numbers_i: &'a K::Point,
    /// Point numbers of points j.
    pub numbers_j: K::PointJ,
    /// Thresholds, truncation factors and stress measures of points i.
    pub limits_i: &'a Limits,
    /// Thresholds, truncation factors and stress measures of points j.
    pub limits_j: Limits,
    /// Rotations of the families of points i.
    pub rotation_i: &'a K::Rotation,
    /// Rotations of the families of points j.
    pub rotation_j: K::Rotation,
    /// Bond history for point i and for point j.
    pub history: [K::BondHistory; 2],
    /// One bit per bond, set if the bond is intact; for `BreakingBonds`, set if the bond breaks.
    pub intact: u8,
    /// One bit per lane, set if the lane has a bond, intact or broken. Without [`Kernel::READS_BROKEN`], all
    /// bits are 0.
    pub whole: u8,
    /// One bit per bond, set if the bond can break.
    pub breakable: u8,
}

impl<K, const D: usize> Group<'_, K, D>
where
    K: Kernel<D, PointJ = <K as Kernel<D>>::Point>,
{
    /// Point numbers of points i and j.
    #[inline(always)]
    pub fn points(&self) -> [&K::Point; 2] {
        [self.numbers_i, &self.numbers_j]
    }
}

impl<K: Kernel<D>, const D: usize> Group<'_, K, D> {
    /// Weights of the force states in the work of a bond: the influence function, without volume correction.
    /// `no_volume_correction` is true if [`Self::weights`] contain no volume correction. The result is then
    /// [`Self::weights`]. Otherwise, the result is 1 at the ends whose force states act on the bond, and 0 at
    /// the other ends. In this second case, criteria that use the work require a constant influence function.
    #[inline(always)]
    pub fn weights_of_work<S: Simd>(&self, simd: S, no_volume_correction: bool) -> Weights {
        if no_volume_correction {
            self.weights
        } else {
            self.weights.uncorrected(simd)
        }
    }

    /// Return the work of the force states of both ends, J/m⁶. The work [`Law::end_work`] of each end is
    /// multiplied by the weight of this end in `weights`, and the two products are added.
    #[inline(always)]
    pub fn work_of_ends<S: Simd, L: Law<D>>(
        &self,
        simd: S,
        laws: &[L; 2],
        weights: Weights,
    ) -> Lanes
    where
        K: Kernel<
                D,
                Point = L::Point,
                PointJ = L::Point,
                BondHistory = L::BondHistory,
                Rotation = <L::Force as ForceState<D>>::Rotation,
            >,
    {
        let ([law_i, law_j], [history_i, history_j]) = (laws, &self.history);
        let i = law_i.end_work(simd, &self.bond, self.numbers_i, history_i, self.rotation_i);
        let j = law_j.end_work(
            simd,
            &self.bond,
            &self.numbers_j,
            history_j,
            &self.rotation_j,
        );
        weights.sum(i, j)
    }

    /// The data of both ends that the criterion reads.
    #[inline(always)]
    pub fn ends(&self) -> Ends<'_> {
        Ends {
            limits: [self.limits_i, &self.limits_j],
            weights: self.weights,
        }
    }

    /// Bits of the intact bonds within the horizon of point i.
    #[inline(always)]
    pub fn family(&self) -> u8 {
        match self.weights {
            Weights::One => self.intact,
            weights => self.intact & weights.at_i().above(0.0),
        }
    }

    /// Multiply a quantity of each bond by V_j and by the weight at point i.
    #[inline(always)]
    pub fn weighted_by_volume(&self, share: Lanes) -> Lanes {
        let share = share * self.volume_j;
        match self.weights {
            Weights::One => share,
            weights => share * weights.at_i(),
        }
    }
}

/// Operation that combines two values of a quantity: two lanes of a sum, or a sum and the value that the
/// column already contains for the point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Combine {
    /// Sum.
    Add,
    /// Minimum.
    Smallest,
}

impl Combine {
    /// Combine a value with an earlier result.
    #[inline(always)]
    pub fn apply(self, result: &mut f64, value: f64) {
        match self {
            Self::Add => *result += value,
            Self::Smallest => *result = result.min(value),
        }
    }
}

/// A sum over the bonds of points.
pub trait Kernel<const D: usize>: Copy + Sync {
    /// Sums, eight lanes per quantity. Each quantity has a column with one entry per point. [`Self::COMBINE`]
    /// combines each sum with the column of its quantity.
    type Sums: LaneTuple;

    /// Point numbers that the kernel reads for points i.
    type Point: LaneTuple;

    /// Point numbers that the kernel reads for points j: none, or the first numbers of [`Self::Point`].
    type PointJ: LaneTuple;

    /// Bond history that the kernel reads.
    type BondHistory: LaneTuple;

    /// Rotations of the families of points i and j, as quaternions; empty if the kernel's criterion cannot
    /// read rotations.
    type Rotation: LaneTuple;

    /// Whether the kernel is implemented in `D` dimensions; otherwise no loops are compiled.
    const EXISTS: bool = true;

    /// Whether [`Self::add`] can break bonds. If so, [`sweep_and_break`](super::sweep::sweep_and_break) runs
    /// the kernel.
    const BREAKS: bool = false;

    /// Operation that combines the sum of a quantity at a point with the entry of this point in the column of
    /// the quantity. If the lanes of a sum belong to one point, the operation first combines these lanes.
    const COMBINE: Combine = Combine::Add;

    /// Instruction sets for which the kernel's loops are compiled. The default, one version, is enough for
    /// most kernels that compute outputs.
    const ISA_SET: IsaSet = IsaSet::One;

    /// Whether to compile a second loop for lane groups whose bonds are all within the series limit, |x| ≤
    /// [`Criterion::limit`]. x is defined in [`crate::material::bond`].
    const HAS_FAST_PATH: bool = false;

    /// Whether to load [`Group::whole`]. Its bits are set for all bonds, intact or broken.
    const READS_BROKEN: bool = false;

    /// Whether the kernel's criterion can read stresses of points i and j.
    const READS_STRESSES: bool = false;

    /// Quantities that are computed for the deformed bonds.
    const WANTED: Wanted;

    /// Whether the law is known only at run time. The compiler then does not know whether the law is linear.
    const ANY_LAW: bool = false;

    /// Whether the bonds have a linear law, see [`Bond`].
    #[inline(always)]
    fn is_linear(&self) -> bool {
        Self::WANTED.linear
    }

    /// Return [`Self::WANTED`]. With [`Self::ANY_LAW`], `is_linear` says whether the law of the bonds is
    /// linear.
    #[inline(always)]
    fn wanted(is_linear: bool) -> Wanted {
        let mut wanted = Self::WANTED;
        if Self::ANY_LAW {
            wanted.linear = is_linear;
        }
        wanted
    }

    /// Whether sums depend only on reference positions and intact bits. If true, the sums over the bonds of a
    /// lattice are cached for each pattern of intact bits, and the kernel must not break or change bonds.
    #[inline(always)]
    fn is_undeformed(&self) -> bool {
        false
    }

    /// Whether the thermal stretch is removed from the bonds before the law reads them.
    #[inline(always)]
    fn is_elastic(&self) -> bool {
        true
    }

    /// Whether the kernel needs [`Group::whole`], whose bits are also set for broken bonds. Called only if
    /// [`Self::READS_BROKEN`] is true.
    #[inline(always)]
    fn needs_broken(&self) -> bool {
        Self::READS_BROKEN
    }

    /// Failure criterion. The sweep loads only the columns that the criterion reads.
    #[inline(always)]
    fn criterion(&self) -> Criterion {
        Criterion::Never
    }

    /// Whether the bond history is written back.
    #[inline(always)]
    fn stores_history(&self) -> bool {
        false
    }

    /// Initial value of the sums.
    #[inline(always)]
    fn start(&self) -> Self::Sums {
        Self::Sums::splat(0.0)
    }

    /// Add the bonds in [`Group::intact`] to the sums. A kernel with [`Self::BREAKS`] omits the bonds that
    /// break, and clears their bits in [`Group::intact`]. May change the bond history.
    fn add<S: Simd>(&self, simd: S, group: &mut Group<'_, Self, D>, sums: &mut Self::Sums);

    /// Whether bonds within the series limit (see [`Self::HAS_FAST_PATH`]) can neither break nor change their
    /// history. [`Self::add_fast`] may then skip the criterion.
    #[inline(always)]
    fn may_skip_criterion(&self) -> bool {
        true
    }

    /// Add eight bonds that are all within the series limit. Called only if [`Self::may_skip_criterion`] is
    /// true.
    #[inline(always)]
    fn add_fast<S: Simd>(&self, simd: S, group: &mut Group<'_, Self, D>, sums: &mut Self::Sums) {
        self.add(simd, group, sums);
    }
}
