//! Sums over the bonds of points: forces, numbers of points, energies.
//!
//! A kernel adds eight bonds at a time to eight lanes of each sum. It is written once for all dimensions, laws and
//! storages: the eight bonds are those of one point (lists) or of eight points (lattices).

use crate::damage::{Criterion, Limits};
use crate::lanes::{IsaSet, LaneTuple, Lanes, Simd};
use crate::material::Bond;
use crate::material::bond::{Wanted, Weights};

/// Eight bonds ij with the data of both points and their history.
pub struct Group<'a, K: Kernel<D>, const D: usize> {
    /// Geometry, as laws read it.
    pub bond: Bond<D>,
    /// Volumes of points i, m³.
    pub own_volume: Lanes,
    /// Volumes of points j, m³.
    pub volume: Lanes,
    /// By what force states are multiplied in the force density: the volume of points j, m³, over 1 + a of a bond with the
    /// thermal stretch a.
    pub force_volume: Lanes,
    /// Influence or volume share of the bonds at each end.
    pub weights: Weights,
    /// Numbers of points i.
    pub own: &'a K::Point,
    /// Numbers of points j.
    pub far: K::Point,
    /// Thresholds and truncation factors of points i.
    pub limits_i: &'a Limits,
    /// Thresholds and truncation factors of points j.
    pub limits_j: Limits,
    /// Rotations of the families of points i.
    pub rotation_i: &'a K::Rotation,
    /// Rotations of the families of points j.
    pub rotation_j: K::Rotation,
    /// Bond history for point i and for point j.
    pub history: [K::BondHistory; 2],
    /// A bit for each bond that is intact.
    pub intact: u8,
    /// A bit for each bond, broken or not; only with [`Kernel::READS_BROKEN`].
    pub whole: u8,
    /// A bit for each bond that can break.
    pub breakable: u8,
}

impl<K: Kernel<D>, const D: usize> Group<'_, K, D> {
    /// Numbers of points i and j.
    #[inline(always)]
    pub fn points(&self) -> [&K::Point; 2] {
        [self.own, &self.far]
    }

    /// A bit for each intact bond within the horizon of point i.
    #[inline(always)]
    pub fn family(&self) -> u8 {
        match self.weights {
            Weights::One => self.intact,
            weights => self.intact & weights.own().above(0.0),
        }
    }

    /// Multiply by V_j and the weight of point i.
    #[inline(always)]
    pub fn weighted_by_volume(&self, share: Lanes) -> Lanes {
        let share = share * self.volume;
        match self.weights {
            Weights::One => share,
            weights => share * weights.own(),
        }
    }
}

/// Reduction of the lanes of a sum to the number of a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Combine {
    /// Sum.
    Add,
    /// Minimum.
    Smallest,
}

/// A sum over the bonds of points.
pub trait Kernel<const D: usize>: Copy + Sync {
    /// Sums, eight lanes per quantity. Each quantity is added to one column of the points.
    type Sums: LaneTuple;

    /// Sums over the bonds that break in this sweep, eight lanes per quantity. They are returned per point, only for points
    /// with such bonds.
    type Broken: LaneTuple;

    /// Numbers of points i and j that it reads.
    type Point: LaneTuple;

    /// Bond history that it reads.
    type BondHistory: LaneTuple;

    /// Rotations of points i and j, if its criterion can read them.
    type Rotation: LaneTuple;

    /// Implemented in `D` dimensions; otherwise no loops are compiled.
    const EXISTS: bool = true;

    /// Reduction of its sums.
    const COMBINE: Combine = Combine::Add;

    /// Instruction sets for which its loops are compiled. For outputs one is enough.
    const ISA_SET: IsaSet = IsaSet::One;

    /// Compile a second loop for vectors whose bonds all stay within the series limit.
    const HAS_FAST_PATH: bool = false;

    /// Load the bits of all bonds, broken ones included.
    const READS_BROKEN: bool = false;

    /// Load the numbers of points j; otherwise they are 0.
    const READS_FAR: bool = true;

    /// Quantities of the deformed bonds to compute.
    const WANTED: Wanted;

    /// The law, and so whether bonds are linear, is known at run time only.
    const ANY_LAW: bool = false;

    /// Whether bonds are those of a linear law, see [`Bond`].
    #[inline(always)]
    fn is_linear(&self) -> bool {
        Self::WANTED.linear
    }

    /// [`Self::WANTED`] for bonds that are linear or not.
    #[inline(always)]
    fn wanted(is_linear: bool) -> Wanted {
        let mut wanted = Self::WANTED;
        if Self::ANY_LAW {
            wanted.linear = is_linear;
        }
        wanted
    }

    /// Sums depend on reference positions and intact bits alone. A lattice then caches them per bit pattern. Such a kernel
    /// must not break or change bonds.
    #[inline(always)]
    fn is_undeformed(&self) -> bool {
        false
    }

    /// Bonds are given to the law without their thermal stretch.
    #[inline(always)]
    fn is_elastic(&self) -> bool {
        true
    }

    /// The bits of broken bonds are needed; asked only with [`Self::READS_BROKEN`].
    #[inline(always)]
    fn needs_broken(&self) -> bool {
        Self::READS_BROKEN
    }

    /// Failure criterion. The sweep loads only the columns it reads.
    #[inline(always)]
    fn criterion(&self) -> Criterion {
        Criterion::Never
    }

    /// The bond history is written back.
    #[inline(always)]
    fn stores_history(&self) -> bool {
        false
    }

    /// Initial value of the sums.
    #[inline(always)]
    fn start(&self) -> Self::Sums {
        Self::Sums::splat(0.0)
    }

    /// Add eight bonds, except those that break: their intact bits are cleared. May change the bond history.
    fn add<S: Simd>(&self, simd: S, group: &mut Group<'_, Self, D>, sums: &mut Self::Sums);

    /// Bonds within the series limit can neither break nor change their history, so [`Self::add_fast`] may skip the
    /// criterion.
    #[inline(always)]
    fn may_skip_criterion(&self) -> bool {
        true
    }

    /// Add eight bonds that are all within the series limit, if [`Self::may_skip_criterion`].
    #[inline(always)]
    fn add_fast<S: Simd>(&self, simd: S, group: &mut Group<'_, Self, D>, sums: &mut Self::Sums) {
        self.add(simd, group, sums);
    }

    /// Clear the intact bits of breaking bonds and add these bonds to `broken`. A second loop over the bonds of a point or
    /// vector calls it if [`Self::add`] broke one; out of line to save registers. The bits that [`Self::add`] cleared
    /// are a copy.
    fn add_broken<S: Simd>(
        &self,
        _simd: S,
        _group: &mut Group<'_, Self, D>,
        _broken: &mut Self::Broken,
    ) {
    }
}
