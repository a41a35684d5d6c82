//! The sums over bonds that the numbers of points follow from.

use crate::damage::Criterion;
use crate::lanes::{Arithmetic, Lanes, Numbers};
use crate::material::Law;

use super::force::break_bonds;
use super::kernel::{Combine, Group, Kernel};

/// Sums stage `S` of a law over the intact bonds, of which some may break before: the sums over those
/// left, the sums over those that break, and the energy (J) that the points' shares of these set free.
#[derive(Clone, Copy)]
pub struct StageSum<L, const S: usize> {
    /// Laws of the own and of the far end.
    pub laws: [L; 2],
    /// When bonds break here.
    pub criterion: Criterion,
}

impl<L: Law<D>, const S: usize, const D: usize> Kernel<D> for StageSum<L, S> {
    type Sums = ((L::Sum, L::Sum), [Lanes; 1]);
    type Point = L::Point;
    type Memory = L::Memory;
    const HOT: bool = L::HOT;
    const LINEAR: bool = L::LINEAR;

    #[inline(always)]
    fn reads_thresholds(&self) -> bool {
        self.criterion.reads_thresholds()
    }

    #[inline(always)]
    fn add<A: Arithmetic>(&self, group: &mut Group<Self, D>, sums: &mut Self::Sums) {
        let ((left, lost), [freed]) = sums;
        let share = self.laws[0].share::<S>(&group.bond, &group.points[0]);
        let share = L::Sum::each(|k| group.own_share(share.get(k)));
        let (broken, energy) = break_bonds::<A, L, Self, D>(&self.laws, self.criterion, group);
        if broken != 0 {
            // Kept apart, so that `left` is the same sum as if the bonds had been broken before.
            for k in 0..L::Sum::COUNT {
                *lost.get_mut(k) += A::select(share.get(k), broken, 0.0);
            }
            *freed += energy;
        }
        for k in 0..L::Sum::COUNT {
            *left.get_mut(k) += A::select(share.get(k), group.intact, 0.0);
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
    type Point = [Lanes; 0];
    type Memory = [Lanes; 0];
    const WHOLE: bool = true;
    const LINEAR: bool = L::LINEAR;

    #[inline(always)]
    fn add<A: Arithmetic>(&self, group: &mut Group<Self, D>, sums: &mut L::WholeSum) {
        let share = self.law.whole_share(group.bond.length);
        for k in 0..L::WholeSum::COUNT {
            let share = share.get(k) * group.volume * group.weights.own();
            *sums.get_mut(k) += A::select(share, group.whole, 0.0);
        }
    }
}

/// The smallest stretch s_min of the intact bonds of each point's own family; +∞ where there is none.
#[derive(Clone, Copy)]
pub struct SmallestStretch;

impl<const D: usize> Kernel<D> for SmallestStretch {
    type Sums = [Lanes; 1];
    type Point = [Lanes; 0];
    type Memory = [Lanes; 0];
    const COMBINE: Combine = Combine::Smallest;
    const HOT: bool = true;
    const LINEAR: bool = false;

    #[inline(always)]
    fn start(&self) -> [Lanes; 1] {
        [Lanes::splat(f64::INFINITY)]
    }

    #[inline(always)]
    fn add<A: Arithmetic>(&self, group: &mut Group<Self, D>, [smallest]: &mut [Lanes; 1]) {
        let stretch = A::select(group.bond.stretch, group.family(), f64::INFINITY);
        *smallest = stretch.min(*smallest);
    }
}
