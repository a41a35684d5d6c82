//! The sum of the bond forces, and the breaking of bonds where it needs no force states.

use crate::damage::{Criterion, Ends};
use crate::lanes::{Arithmetic, Lanes, Numbers};
use crate::material::{ForceState, Law};

use super::kernel::{Group, Kernel, Weights};

/// What happens to bonds while forces are evaluated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Evolution {
    /// Bonds break and remember, as at the end of a step.
    Step,
    /// Nothing: forces are only looked at.
    None,
}

/// Breaks the intact bonds that must; returns which, and their energy at the own end (J).
#[inline(always)]
pub fn break_bonds<A: Arithmetic, L: Law<D>, K, const D: usize>(
    laws: &[L; 2],
    criterion: Criterion,
    group: &mut Group<K, D>,
) -> (u8, Lanes)
where
    K: Kernel<D, Point = L::Point, Memory = L::Memory>,
{
    let ends = Ends {
        laws,
        points: &group.points,
        thresholds: &group.thresholds,
    };
    let broken = group.intact & criterion.met::<A, L, D>(&group.bond, ends);
    if broken == 0 {
        return (0, Lanes::splat(0.0));
    }
    let broken = broken & group.breakable;
    group.intact &= !broken;
    let energy = laws[0].bond_energy(&group.bond, &group.points[0], &group.memory[0]);
    let energy = energy * group.volume;
    let energy = energy * group.weights.own() * group.own_volume;
    (broken, A::select(energy, broken, 0.0))
}

/// Sums the forces of bonds, of which some may break before: force density by component (N/m³), then
/// the energy (J) that the points' shares of the bonds set free.
#[derive(Clone, Copy)]
pub struct Force<L> {
    /// Laws of the own and of the far end.
    pub laws: [L; 2],
    /// When bonds break here.
    pub criterion: Criterion,
    /// Whether bonds remember.
    pub evolution: Evolution,
}

impl<L: Law<D>, const D: usize> Kernel<D> for Force<L> {
    type Sums = ([Lanes; D], [Lanes; 1]);
    type Point = L::Point;
    type Memory = L::Memory;
    const HOT: bool = L::HOT;
    const LINEAR: bool = L::LINEAR;

    #[inline(always)]
    fn reads_thresholds(&self) -> bool {
        self.criterion.reads_thresholds()
    }

    #[inline(always)]
    fn remembers(&self) -> bool {
        self.evolution == Evolution::Step
    }

    #[inline(always)]
    fn add<A: Arithmetic>(&self, group: &mut Group<Self, D>, sums: &mut Self::Sums) {
        let (force, [freed]) = sums;
        let (broken, energy) = break_bonds::<A, L, Self, D>(&self.laws, self.criterion, group);
        if broken != 0 {
            *freed += energy;
        }
        let [own, far] = &self.laws;
        let [here, there] = &group.points;
        if L::Memory::COUNT > 0 {
            group.memory = [
                own.memory(&group.bond, here, &group.memory[0]),
                far.memory(&group.bond, there, &group.memory[1]),
            ];
        }
        let pull = own.force(&group.bond, here, &group.memory[0]);
        let push = far.force(&group.bond, there, &group.memory[1]);
        let total = match group.weights {
            Weights::One => pull.plus(push),
            Weights::Same(weight) => pull.plus(push).times(weight),
            Weights::Each([own, far]) => pull.times(own).plus(push.times(far)),
        };
        total.add::<A>(&group.bond, group.volume, group.intact, force);
    }
}
