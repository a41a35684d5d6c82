//! Laws that are one of several: for what is done once a point, and for the bonds between blocks of
//! different laws.

use nalgebra::SMatrix;

use super::{AnyLaw, Bond, COUNTS, Described, ForceState, Law, PlasticState, Rotation, with_law};
use crate::lanes::{Lanes, Numbers, Simd, Versions};

/// How many numbers of each kind the points and bonds of a law have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Counts {
    /// [`Law::CONSTANTS`].
    pub constants: usize,
    /// [`Law::Point`].
    pub point: usize,
    /// [`Law::OWN_NUMBERS`].
    pub own: usize,
    /// [`Law::PASSES`].
    pub passes: usize,
    /// [`Law::WholeSum`].
    pub whole_sum: usize,
    /// [`Law::Sum`].
    pub sum: usize,
    /// [`Law::Memory`].
    pub memory: usize,
    /// [`ForceState::CENTRAL`] of [`Law::Force`].
    pub central: bool,
}

impl Counts {
    pub(super) const fn of<L: Law<D>, const D: usize>() -> Self {
        Self {
            constants: L::CONSTANTS,
            point: L::Point::COUNT,
            own: L::OWN_NUMBERS,
            passes: L::PASSES,
            whole_sum: L::WholeSum::COUNT,
            sum: L::Sum::COUNT,
            memory: L::Memory::COUNT,
            central: L::Force::CENTRAL,
        }
    }

    /// The larger of each.
    const fn or_more(self, other: Self) -> Self {
        const fn more(a: usize, b: usize) -> usize {
            if a > b { a } else { b }
        }
        Self {
            constants: more(self.constants, other.constants),
            point: more(self.point, other.point),
            own: more(self.own, other.own),
            passes: more(self.passes, other.passes),
            whole_sum: more(self.whole_sum, other.whole_sum),
            sum: more(self.sum, other.sum),
            memory: more(self.memory, other.memory),
            central: self.central && other.central,
        }
    }
}

/// The most that any law has: in three dimensions.
pub const MOST: Counts = {
    let mut most = COUNTS[0];
    let mut k = 1;
    while k < COUNTS.len() {
        most = most.or_more(COUNTS[k]);
        k += 1;
    }
    most
};

/// The first of some numbers.
#[inline(always)]
fn first<A: Numbers, B: Numbers>(all: &A) -> B {
    B::each(|k| all.get(k))
}

/// Some numbers, and zeros after them.
#[inline(always)]
fn filled_up<A: Numbers, B: Numbers>(some: A) -> B {
    B::each(|k| {
        if k < A::COUNT {
            some.get(k)
        } else {
            Lanes::splat(0.0)
        }
    })
}

impl AnyLaw {
    /// [`Described::described`] of the law that it is.
    pub fn described(&self) -> Vec<(&'static str, String)> {
        with_law!(self, law => law.described())
    }

    /// How many numbers the law has in `D` dimensions.
    pub fn counts<const D: usize>(&self) -> Counts {
        fn of<L: Law<D>, const D: usize>(_: &L) -> Counts {
            Counts::of::<L, D>()
        }
        with_law!(self, law => of::<_, D>(law))
    }
}

/// Bonds of linear laws meet no others, so these are bonds of the deformed body. Nothing is inlined: every
/// loop over such bonds would be compiled with all laws in it.
impl<const D: usize> Law<D> for AnyLaw {
    type Point = [Lanes; MOST.point];
    type Memory = [Lanes; MOST.memory];
    type WholeSum = [Lanes; MOST.whole_sum];
    type Sum = [Lanes; MOST.sum];
    type Force = [Lanes; D];
    const VERSIONS: Versions = Versions::Avx2;
    const PASSES: usize = MOST.passes;
    const OWN_NUMBERS: usize = MOST.own;
    const FORCE_READS_STRETCH: bool = true;
    const HAS_BOND_STRESS_ACROSS: bool = true;

    #[inline(never)]
    fn whole_share(&self, bond: &Bond<D>) -> Self::WholeSum {
        with_law!(self, law => filled_up(law.whole_share(bond)))
    }

    fn constants(&self, sums: &[f64], numbers: &mut [f64]) {
        with_law!(self, law => Law::<D>::constants(law, sums, numbers));
    }

    #[inline(never)]
    fn share<const S: usize>(
        &self,
        bond: &Bond<D>,
        own: &Self::Point,
        memory: &Self::Memory,
    ) -> Self::Sum {
        with_law!(self, law => filled_up(law.share::<S>(bond, &first(own), &first(memory))))
    }

    #[inline(never)]
    fn point(&self, pass: usize, sums: &[f64], numbers: &mut [f64], plastic: &mut PlasticState) {
        with_law!(self, law => Law::<D>::point(law, pass, sums, numbers, plastic));
    }

    fn flows(&self) -> bool {
        with_law!(self, law => Law::<D>::flows(law))
    }

    #[inline(never)]
    fn memory(
        &self,
        bond: &Bond<D>,
        end: &Self::Point,
        before: &Self::Memory,
        step: f64,
    ) -> Self::Memory {
        with_law!(self, law => filled_up(law.memory(bond, &first(end), &first(before), step)))
    }

    #[inline(never)]
    fn force(&self, bond: &Bond<D>, end: &Self::Point, memory: &Self::Memory) -> [Lanes; D] {
        with_law!(self, law => law.force(bond, &first(end), &first(memory)).vector(bond))
    }

    #[inline(never)]
    fn end_work<S: Simd>(
        &self,
        simd: S,
        bond: &Bond<D>,
        end: &Self::Point,
        memory: &Self::Memory,
        rotation: &[Lanes; 3],
    ) -> Lanes {
        with_law!(self, law => law.end_work(simd, bond, &first(end), &first(memory), rotation))
    }

    fn reads_advanced_history(&self, pass: usize) -> bool {
        with_law!(self, law => Law::<D>::reads_advanced_history(law, pass))
    }

    fn rotation(&self, sums: &[f64]) -> Rotation {
        with_law!(self, law => Law::<D>::rotation(law, sums))
    }

    #[inline(never)]
    fn bond_energy(&self, bond: &Bond<D>, end: &Self::Point, memory: &Self::Memory) -> Lanes {
        with_law!(self, law => law.bond_energy(bond, &first(end), &first(memory)))
    }

    fn point_energy(&self, numbers: &[f64]) -> f64 {
        with_law!(self, law => Law::<D>::point_energy(law, numbers))
    }

    fn weighted_volume(&self, numbers: &[f64]) -> Option<f64> {
        with_law!(self, law => Law::<D>::weighted_volume(law, numbers))
    }

    fn stress_across(&self, gradient: &SMatrix<f64, D, D>, plastic: &PlasticState) -> Option<f64> {
        with_law!(self, law => Law::<D>::stress_across(law, gradient, plastic))
    }

    #[inline(never)]
    fn bond_stress_across(&self, bond: &Bond<D>, end: &Self::Point) -> Lanes {
        with_law!(self, law => law.bond_stress_across(bond, &first(end)))
    }

    fn stretch_across(&self, gradient: &SMatrix<f64, D, D>, plastic: &PlasticState) -> Option<f64> {
        with_law!(self, law => Law::<D>::stretch_across(law, gradient, plastic))
    }

    fn needs_shape(&self) -> bool {
        with_law!(self, law => Law::<D>::needs_shape(law))
    }

    fn is_singular(&self, numbers: &[f64]) -> bool {
        with_law!(self, law => Law::<D>::is_singular(law, numbers))
    }

    #[inline(never)]
    fn dissipated(&self, length: Lanes, memory: &Self::Memory) -> Lanes {
        with_law!(self, law => Law::<D>::dissipated(law, length, &first(memory)))
    }

    #[inline(never)]
    fn stiffness(&self, length: Lanes, end: &Self::Point) -> Lanes {
        with_law!(self, law => Law::<D>::stiffness(law, length, &first(end)))
    }

    fn overload(&self, sums: &[f64]) -> f64 {
        with_law!(self, law => Law::<D>::overload(law, sums))
    }

    fn resists_across(&self) -> bool {
        with_law!(self, law => Law::<D>::resists_across(law))
    }
}
