//! What is summed over a family in every step: bond forces, states, energies, the smallest stretch.
//!
//! A kernel sees eight bonds at a time and adds to eight sums. It is written once for any dimension,
//! law, failure rule and family: the bonds may be those of one point or those of eight.

use crate::material::{Arithmetic, Lanes, Law};

use super::failure::{Ends, Failure};
use super::geometry::{Loaded, Weights};

/// What of eight sums belongs to a point.
pub trait Pick {
    /// The sum.
    fn sum(&self, lanes: Lanes) -> f64;

    /// The smallest value.
    fn smallest(&self, lanes: Lanes) -> f64;
}

/// Something that is summed over the bonds of points.
pub trait Kernel<const D: usize>: Copy + Sync {
    /// Eight sums of each quantity.
    type Sums: Copy;

    /// What is summed for each point.
    type Output: Send;

    /// Whether it is worth a version for each set of vector instructions.
    const HOT: bool = false;

    /// Whether it reads the constants of the ends.
    const CONSTANT: bool = false;

    /// Whether it reads the states of the ends.
    const STATE: bool = false;

    /// Whether it reads the thresholds of the ends.
    const THRESHOLD: bool = false;

    /// Whether it wants to know of broken bonds.
    const FILLED: bool = false;

    /// Whether it takes what is linear in η.
    fn linear(&self) -> bool;

    /// The sums over no bond.
    fn start(&self) -> Self::Sums;

    /// Adds eight bonds; returns which are still intact.
    fn add<A: Arithmetic>(&self, bonds: &Loaded<D>, sums: &mut Self::Sums) -> u8;

    /// Adds a point's part of the sums to its output.
    fn finish(&self, sums: &Self::Sums, pick: &impl Pick, output: &mut Self::Output);
}

/// The intact bonds that must break, and their energy at the own end (J).
#[inline(always)]
fn failing<A: Arithmetic, L: Law, F: Failure, const D: usize>(
    laws: &[L; 2],
    failure: F,
    bonds: &Loaded<D>,
) -> (u8, Lanes) {
    let ends = Ends {
        laws,
        ends: &bonds.ends,
        thresholds: &bonds.thresholds,
    };
    let broken = bonds.intact & failure.breaks::<A, L>(bonds.bond.stretch, ends);
    if broken == 0 {
        return (0, Lanes::splat(0.0));
    }
    let broken = broken & bonds.breakable;
    let energy = laws[0].bond_energy(&bonds.bond, &bonds.ends[0]) * bonds.volume;
    let energy = energy * bonds.weights.own() * bonds.own_volume;
    (broken, A::select(energy, broken, 0.0))
}

/// A share in the sums of the own end, by volume.
#[inline(always)]
fn own_share<const D: usize>(share: Lanes, bonds: &Loaded<D>) -> Lanes {
    let share = share * bonds.volume;
    match bonds.weights {
        Weights::One => share,
        weights => share * weights.own(),
    }
}

/// What the bonds of a point do to it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Response<const D: usize> {
    /// Force density by component, N/m³.
    pub force: [f64; D],
    /// Energy that the point's share of bonds has set free by breaking so far, J.
    pub set_free: f64,
}

impl<const D: usize> Default for Response<D> {
    fn default() -> Self {
        Self {
            force: [0.0; D],
            set_free: 0.0,
        }
    }
}

/// Breaks bonds, unless that has been done, and sums their forces.
#[derive(Clone, Copy)]
pub struct Force<L, F> {
    /// Laws of the own and of the far end.
    pub laws: [L; 2],
    /// The failure rule; none where bonds have been broken already.
    pub failure: Option<F>,
}

/// Sums of [`Force`].
#[derive(Clone, Copy)]
pub struct ForceSums<const D: usize> {
    force: [Lanes; D],
    set_free: Lanes,
}

impl<L: Law, F: Failure, const D: usize> Kernel<D> for Force<L, F> {
    type Sums = ForceSums<D>;
    type Output = Response<D>;
    const HOT: bool = true;
    const CONSTANT: bool = L::CONSTANT;
    const STATE: bool = L::STATE;
    const THRESHOLD: bool = F::PER_POINT;

    fn linear(&self) -> bool {
        L::LINEAR
    }

    #[inline(always)]
    fn start(&self) -> ForceSums<D> {
        ForceSums {
            force: [Lanes::splat(0.0); D],
            set_free: Lanes::splat(0.0),
        }
    }

    #[inline(always)]
    fn add<A: Arithmetic>(&self, bonds: &Loaded<D>, sums: &mut ForceSums<D>) -> u8 {
        let mut bits = bonds.intact;
        if let Some(failure) = self.failure {
            let (broken, energy) = failing::<A, L, F, D>(&self.laws, failure, bonds);
            if broken != 0 {
                bits &= !broken;
                sums.set_free += energy;
            }
        }
        let [here, there] = &bonds.ends;
        let pull = self.laws[0].force(&bonds.bond, here);
        let push = self.laws[1].force(&bonds.bond, there);
        let strength = match bonds.weights {
            Weights::One => pull + push,
            Weights::Same(weight) => (pull + push) * weight,
            Weights::Each([own, far]) => pull * own + push * far,
        };
        let strength = A::select(strength * bonds.volume * bonds.inverse_length, bits, 0.0);
        for d in 0..D {
            sums.force[d] = A::multiply_add(strength, bonds.along[d], sums.force[d]);
        }
        bits
    }

    #[inline(always)]
    fn finish(&self, sums: &ForceSums<D>, pick: &impl Pick, output: &mut Response<D>) {
        for d in 0..D {
            output.force[d] += pick.sum(sums.force[d]);
        }
        output.set_free += pick.sum(sums.set_free);
    }
}

/// The sums that give a point's state, and what breaking changes in them.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct StateSums {
    /// Over the bonds that were intact.
    pub before: f64,
    /// Over those that still are.
    pub after: f64,
    /// Energy that the point's share of bonds sets free by breaking, J.
    pub set_free: f64,
}

/// Breaks bonds and sums the states of points.
#[derive(Clone, Copy)]
pub struct State<L, F> {
    /// Laws of the own and of the far end.
    pub laws: [L; 2],
    /// The failure rule.
    pub failure: F,
}

/// Before, after, set free.
pub type StateLanes = [Lanes; 3];

impl<L: Law, F: Failure, const D: usize> Kernel<D> for State<L, F> {
    type Sums = StateLanes;
    type Output = StateSums;
    const HOT: bool = true;
    const CONSTANT: bool = L::CONSTANT;
    const THRESHOLD: bool = F::PER_POINT;

    fn linear(&self) -> bool {
        L::LINEAR
    }

    #[inline(always)]
    fn start(&self) -> StateLanes {
        [Lanes::splat(0.0); 3]
    }

    #[inline(always)]
    fn add<A: Arithmetic>(&self, bonds: &Loaded<D>, sums: &mut StateLanes) -> u8 {
        let [before, after, set_free] = sums;
        let share = own_share(self.laws[0].state_share(&bonds.bond), bonds);
        let (broken, energy) = failing::<A, L, F, D>(&self.laws, self.failure, bonds);
        let bits = bonds.intact & !broken;
        if broken != 0 {
            // Kept apart, so that `after` is the same sum as if the bonds had been broken before.
            *before += A::select(share, broken, 0.0);
            *set_free += energy;
        }
        *after += A::select(share, bits, 0.0);
        bits
    }

    #[inline(always)]
    fn finish(&self, sums: &StateLanes, pick: &impl Pick, output: &mut StateSums) {
        let [broken, after, set_free] = sums.map(|lanes| pick.sum(lanes));
        output.before += broken + after;
        output.after += after;
        output.set_free += set_free;
    }
}

/// The smallest stretch s_min of the intact bonds of each point's own family; outputs start at +∞.
#[derive(Clone, Copy)]
pub struct SmallestStretch;

impl<const D: usize> Kernel<D> for SmallestStretch {
    type Sums = Lanes;
    type Output = f64;
    const HOT: bool = true;

    fn linear(&self) -> bool {
        false
    }

    #[inline(always)]
    fn start(&self) -> Lanes {
        Lanes::splat(f64::INFINITY)
    }

    #[inline(always)]
    fn add<A: Arithmetic>(&self, bonds: &Loaded<D>, smallest: &mut Lanes) -> u8 {
        let stretch = A::select(bonds.bond.stretch, bonds.family(), f64::INFINITY);
        *smallest = stretch.min(*smallest);
        bonds.intact
    }

    #[inline(always)]
    fn finish(&self, smallest: &Lanes, pick: &impl Pick, output: &mut f64) {
        *output = output.min(pick.smallest(*smallest));
    }
}

/// What the intact bonds of a point hold.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Stored {
    /// Strain energy density W, J/m³.
    pub energy: f64,
    /// The sum that gives the point's state.
    pub state_sum: f64,
    /// Volume of the neighbours in the point's own family, m³.
    pub volume: f64,
    /// Number of neighbours, those included that have the point in their family only.
    pub neighbours: u32,
}

/// Sums up what the intact bonds hold.
#[derive(Clone, Copy)]
pub struct Energy<L> {
    /// Law of the own end.
    pub law: L,
}

/// Energy, state, volume, number.
pub type StoredLanes = [Lanes; 4];

impl<L: Law, const D: usize> Kernel<D> for Energy<L> {
    type Sums = StoredLanes;
    type Output = Stored;
    const HOT: bool = true;
    const CONSTANT: bool = L::CONSTANT;

    fn linear(&self) -> bool {
        L::LINEAR
    }

    #[inline(always)]
    fn start(&self) -> StoredLanes {
        [Lanes::splat(0.0); 4]
    }

    #[inline(always)]
    fn add<A: Arithmetic>(&self, bonds: &Loaded<D>, sums: &mut StoredLanes) -> u8 {
        let family = bonds.family();
        let energy = own_share(self.law.bond_energy(&bonds.bond, &bonds.ends[0]), bonds);
        let state = own_share(self.law.state_share(&bonds.bond), bonds);
        sums[0] += A::select(energy, family, 0.0);
        sums[1] += A::select(state, family, 0.0);
        sums[2] += A::select(bonds.volume, family, 0.0);
        sums[3] += A::select(Lanes::splat(1.0), bonds.intact, 0.0);
        bonds.intact
    }

    #[inline(always)]
    fn finish(&self, sums: &StoredLanes, pick: &impl Pick, output: &mut Stored) {
        let [energy, state, volume, neighbours] = sums.map(|lanes| pick.sum(lanes));
        output.energy += energy;
        output.state_sum += state;
        output.volume += volume;
        output.neighbours += neighbours as u32;
    }
}
