//! Kernels of sums over bonds. Point numbers and thresholds are computed from these sums.

use crate::lanes::{IsaSet, LaneTuple, Lanes, Simd};
use crate::material::bond::Wanted;
use crate::material::{AnyLaw, Law};

use super::force::BondUpdate;
use super::kernel::{Combine, Group, Kernel};

/// Request only x (`relative_square_extension`) of the bonds, see [`crate::material::bond`]. The stretch
/// and the extension over the deformed length are not requested.
const fn extension_only(linear: bool) -> Wanted {
    Wanted {
        linear,
        stretch: false,
        extension_over_deformed: false,
    }
}

/// Kernel of a point sum: it sums the contributions of the intact bonds to pass `N` of a law.
#[derive(Clone, Copy)]
pub struct PassSum<L, const N: usize> {
    /// The law of point i.
    pub law: L,
    /// Bond update of the force sum that follows. If this update advances the bond history, and if
    /// [`Law::reads_advanced_history`] is true for pass `N`, the point sum reads the advanced history.
    pub bond_update: BondUpdate,
}

impl<L: Law<D>, const N: usize, const D: usize> Kernel<D> for PassSum<L, N> {
    type Sums = L::Sum;
    type Point = L::Point;
    type PointJ = [Lanes; 0];
    type BondHistory = L::BondHistory;
    type Rotation = [Lanes; 0];
    const EXISTS: bool = D >= L::LEAST_DIMENSION;
    const ISA_SET: IsaSet = L::ISA_SET;
    const HAS_FAST_PATH: bool =
        L::ISA_SET.is_each() && !L::LINEAR && L::BondHistory::COUNT == 0 && L::SUM_READS_STRETCH;
    const WANTED: Wanted = Wanted {
        linear: L::LINEAR,
        stretch: L::SUM_READS_STRETCH,
        extension_over_deformed: false,
    };

    #[inline(always)]
    fn add<S: Simd>(&self, simd: S, group: &mut Group<'_, Self, D>, sums: &mut L::Sum) {
        let mut history = group.history[0];
        if L::BondHistory::COUNT > 0
            && self.law.reads_advanced_history(N)
            && let Some(step) = self.bond_update.history_step()
        {
            history = (self.law).bond_history(&group.bond, group.numbers_i, &history, step);
        }
        let share = self
            .law
            .pass_contribution::<N>(&group.bond, group.numbers_i, &history);
        let weight = simd.keep(group.weighted_by_volume(Lanes::splat(1.0)), group.intact);
        for k in 0..L::Sum::COUNT {
            // Lanes without a bond have no valid length, stretch or direction.
            let share = if L::SUM_READS_STRETCH || L::SUM_READS_DIRECTION {
                simd.keep(share.get(k), group.intact)
            } else {
                share.get(k)
            };
            let sum = sums.get_mut(k);
            *sum = simd.multiply_add(share, weight, *sum);
        }
    }
}

/// Kernel that sums over the undeformed family of a point. The constants of the point are computed from the
/// sum. For laws without a shape tensor, the sum contains only the intact bonds, so it omits the bonds that
/// pre-cracks cut. For laws with a shape tensor, the sum contains the cut bonds, too, because such laws
/// compare the intact family with the whole family.
#[derive(Clone, Copy)]
pub struct FamilySum<const D: usize> {
    /// The law of point i.
    pub law: AnyLaw,
    /// Number of sums.
    pub count: usize,
}

impl<const D: usize> Kernel<D> for FamilySum<D> {
    type Sums = <AnyLaw as Law<D>>::ReferenceSum;
    type Point = [Lanes; 0];
    type PointJ = [Lanes; 0];
    type BondHistory = [Lanes; 0];
    type Rotation = [Lanes; 0];
    const READS_BROKEN: bool = true;
    const ISA_SET: IsaSet = IsaSet::Avx2;
    const ANY_LAW: bool = true;
    const WANTED: Wanted = extension_only(false);

    fn is_linear(&self) -> bool {
        self.law.is_linear::<D>()
    }

    fn is_undeformed(&self) -> bool {
        !self.needs_broken()
    }

    fn needs_broken(&self) -> bool {
        Law::<D>::needs_shape(&self.law)
    }

    #[inline(always)]
    fn add<S: Simd>(&self, simd: S, group: &mut Group<'_, Self, D>, sums: &mut Self::Sums) {
        let counted = if Law::<D>::needs_shape(&self.law) {
            group.whole
        } else {
            group.intact
        };
        let share = self.law.reference_contribution(&group.bond);
        for k in 0..self.count {
            let share = share.get(k) * group.volume_j * group.weights.at_i();
            *sums.get_mut(k) += simd.keep(share, counted);
        }
    }
}

/// Kernel that finds, for each point, the smallest stretch s_min of the intact bonds within the horizon. The
/// stretch is stored as x of [`crate::material::bond`]; +∞ if no such bond exists.
#[derive(Clone, Copy)]
pub struct SmallestStretch;

impl<const D: usize> Kernel<D> for SmallestStretch {
    type Sums = [Lanes; 1];
    type Point = [Lanes; 0];
    type PointJ = [Lanes; 0];
    type BondHistory = [Lanes; 0];
    type Rotation = [Lanes; 0];
    const COMBINE: Combine = Combine::Smallest;
    const ISA_SET: IsaSet = IsaSet::Each;
    const WANTED: Wanted = extension_only(false);

    #[inline(always)]
    fn start(&self) -> [Lanes; 1] {
        [Lanes::splat(f64::INFINITY)]
    }

    #[inline(always)]
    fn add<S: Simd>(&self, simd: S, group: &mut Group<'_, Self, D>, [smallest]: &mut [Lanes; 1]) {
        let none = Lanes::splat(f64::INFINITY);
        let growth = simd.select(group.bond.relative_square_extension, group.family(), none);
        *smallest = growth.min(*smallest);
    }
}
