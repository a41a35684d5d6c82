//! The sum of the bond forces, and the breaking of bonds where it needs no force states.

use crate::damage::{Criterion, Ends};
use crate::lanes::{Lanes, Numbers, Simd};
use crate::material::bond::Wanted;
use crate::material::{ForceState, Law};

use super::kernel::{Group, Kernel};

/// What happens to bonds while forces are evaluated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Evolution {
    /// Bonds break and remember, as at the end of a step.
    Step,
    /// Nothing: forces are only looked at.
    None,
}

/// Breaks the intact bonds that must, and adds their energy at the own end (J); returns which.
#[inline(always)]
pub fn break_bonds<S: Simd, L: Law<D>, K, const D: usize>(
    simd: S,
    laws: &[L; 2],
    criterion: Criterion,
    group: &mut Group<K, D>,
    freed: &mut Lanes,
) -> u8
where
    K: Kernel<D, Point = L::Point, Memory = L::Memory>,
{
    let ends = Ends {
        laws,
        points: &group.points,
        thresholds: &group.thresholds,
    };
    let broken = group.intact & criterion.met::<S, L, D>(simd, &group.bond, ends);
    if broken == 0 {
        return 0;
    }
    let broken = broken & group.breakable;
    group.intact &= !broken;
    // Copies, so that a loop need not keep them where they can be pointed to.
    let (bond, own, memory) = (group.bond, group.points[0], group.memory[0]);
    let (volume, share) = (group.volume, group.weights.own() * group.own_volume);
    let law = laws[0];
    simd.aside(move || {
        let bond = bond.with_stretch(L::LINEAR);
        let energy = law.bond_energy(&bond, &own, &memory) * volume;
        *freed += simd.keep(energy * share, broken);
    });
    broken
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
    type Sums = [Lanes; D];
    type Rare = [Lanes; 1];
    type Point = L::Point;
    type Memory = L::Memory;
    const HOT: bool = L::HOT;
    const WANTED: Wanted = Wanted {
        linear: L::LINEAR,
        stretch: L::FORCE_READS_STRETCH,
        shortening: true,
    };

    #[inline(always)]
    fn criterion(&self) -> Criterion {
        self.criterion
    }

    #[inline(always)]
    fn remembers(&self) -> bool {
        self.evolution == Evolution::Step
    }

    #[inline(always)]
    fn add<S: Simd>(
        &self,
        simd: S,
        group: &mut Group<Self, D>,
        force: &mut [Lanes; D],
        [freed]: &mut [Lanes; 1],
    ) {
        break_bonds::<S, L, Self, D>(simd, &self.laws, self.criterion, group, freed);
        let [own, far] = &self.laws;
        let [here, there] = &group.points;
        if L::Memory::COUNT > 0 {
            group.memory = [
                own.memory(&group.bond, here, &group.memory[0]),
                far.memory(&group.bond, there, &group.memory[1]),
            ];
        }
        let (bond, weights) = (&group.bond, group.weights);
        let total = L::bond_force(
            simd,
            &self.laws,
            bond,
            &group.points,
            &group.memory,
            weights,
        );
        total.add(simd, bond, group.volume, group.intact, force);
    }
}
