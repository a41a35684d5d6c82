//! The sums over bonds that the numbers of points follow from.

use crate::damage::Criterion;
use crate::lanes::{Lanes, Numbers, Simd};
use crate::material::Law;
use crate::material::bond::Wanted;

use super::force::break_bonds;
use super::kernel::{Combine, Group, Kernel};

/// Neither stretches nor forces.
const fn growth_only(linear: bool) -> Wanted {
    Wanted {
        linear,
        stretch: false,
        shortening: false,
    }
}

/// Sums stage `N` of a law over the intact bonds, of which some may break before: the sums over those
/// left, the sums over those that break, and the energy (J) that the points' shares of these set free.
#[derive(Clone, Copy)]
pub struct StageSum<L, const N: usize> {
    /// Laws of the own and of the far end.
    pub laws: [L; 2],
    /// When bonds break here.
    pub criterion: Criterion,
}

impl<L: Law<D>, const N: usize, const D: usize> Kernel<D> for StageSum<L, N> {
    type Sums = L::Sum;
    type Rare = (L::Sum, [Lanes; 1]);
    type Point = L::Point;
    type Memory = L::Memory;
    const HOT: bool = L::HOT;
    // Only a criterion that laws scale looks at both ends.
    const READS_FAR: bool = L::SCALED;
    const WANTED: Wanted = Wanted {
        linear: L::LINEAR,
        stretch: true,
        shortening: false,
    };

    #[inline(always)]
    fn criterion(&self) -> Criterion {
        self.criterion
    }

    #[inline(always)]
    fn add<S: Simd>(
        &self,
        simd: S,
        group: &mut Group<Self, D>,
        left: &mut L::Sum,
        (lost, [freed]): &mut Self::Rare,
    ) {
        let share = self.laws[0].share::<N>(&group.bond, &group.points[0]);
        let share = L::Sum::each(|k| group.own_share(share.get(k)));
        let broken = break_bonds::<S, L, Self, D>(simd, &self.laws, self.criterion, group, freed);
        if broken != 0 {
            // Kept apart, so that `left` is the same sum as if the bonds had been broken before.
            simd.aside(move || {
                for k in 0..L::Sum::COUNT {
                    *lost.get_mut(k) += simd.keep(share.get(k), broken);
                }
            });
        }
        for k in 0..L::Sum::COUNT {
            *left.get_mut(k) += simd.keep(share.get(k), group.intact);
        }
    }
}

/// Sums over the whole family, broken bonds included, what gives a point's constants.
#[derive(Clone, Copy)]
pub struct WholeSum<L> {
    /// The law of the own end.
    pub law: L,
}

impl<L: Law<D>, const D: usize> Kernel<D> for WholeSum<L> {
    type Sums = L::WholeSum;
    type Rare = [Lanes; 0];
    type Point = [Lanes; 0];
    type Memory = [Lanes; 0];
    const WHOLE: bool = true;
    const WANTED: Wanted = growth_only(L::LINEAR);

    #[inline(always)]
    fn add<S: Simd>(
        &self,
        simd: S,
        group: &mut Group<Self, D>,
        sums: &mut L::WholeSum,
        _: &mut [Lanes; 0],
    ) {
        let share = self.law.whole_share(group.bond.length);
        for k in 0..L::WholeSum::COUNT {
            let share = share.get(k) * group.volume * group.weights.own();
            *sums.get_mut(k) += simd.keep(share, group.whole);
        }
    }
}

/// The smallest stretch s_min of the intact bonds of each point's own family, as x of
/// [`crate::material::bond`]; +∞ where there is none.
#[derive(Clone, Copy)]
pub struct SmallestStretch;

impl<const D: usize> Kernel<D> for SmallestStretch {
    type Sums = [Lanes; 1];
    type Rare = [Lanes; 0];
    type Point = [Lanes; 0];
    type Memory = [Lanes; 0];
    const COMBINE: Combine = Combine::Smallest;
    const HOT: bool = true;
    const WANTED: Wanted = growth_only(false);

    #[inline(always)]
    fn start(&self) -> [Lanes; 1] {
        [Lanes::splat(f64::INFINITY)]
    }

    #[inline(always)]
    fn add<S: Simd>(
        &self,
        simd: S,
        group: &mut Group<Self, D>,
        [smallest]: &mut [Lanes; 1],
        _: &mut [Lanes; 0],
    ) {
        let none = Lanes::splat(f64::INFINITY);
        let growth = simd.select(group.bond.growth, group.family(), none);
        *smallest = growth.min(*smallest);
    }
}
