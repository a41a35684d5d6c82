//! Dynamic dispatch over all laws: for computations per point, for set-up and outputs, for breaking bonds,
//! and for bonds between different laws.

use nalgebra::SMatrix;

use super::{
    AnyLaw, Bond, COUNTS, Described, FamilyStress, ForceState, Law, PairLaw, PlasticState,
    Property, Rotation, with_law, with_pair,
};
use crate::lanes::{IsaSet, LaneTuple, Lanes, Simd, UpTo};

/// Sizes of the point data, bond data and sums of a law, the number of its passes, and whether its force
/// state is central.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Counts {
    /// Count of the constants of a point, [`Law::CONSTANTS`].
    pub constants: usize,
    /// Count of the numbers of a point, [`Law::Point`].
    pub point: usize,
    /// Count of the own numbers of a point, [`Law::OWN_NUMBERS`]. The loops over bonds do not read these
    /// numbers.
    pub own: usize,
    /// Count of the passes, [`Law::PASSES`].
    pub passes: usize,
    /// Count of the sums over the initial family, [`Law::ReferenceSum`].
    pub reference_sum: usize,
    /// Count of the sums of a pass, [`Law::Sum`].
    pub sum: usize,
    /// Count of the numbers in the history of one end of a bond, [`Law::BondHistory`].
    pub bond_history: usize,
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
            reference_sum: L::ReferenceSum::COUNT,
            sum: L::Sum::COUNT,
            bond_history: L::BondHistory::COUNT,
            central: L::Force::CENTRAL,
        }
    }

    /// For each count, return the larger of the values in `self` and `other`. `central` is true only if it is
    /// true in both.
    const fn or_more(self, other: Self) -> Self {
        const fn more(a: usize, b: usize) -> usize {
            if a > b { a } else { b }
        }
        Self {
            constants: more(self.constants, other.constants),
            point: more(self.point, other.point),
            own: more(self.own, other.own),
            passes: more(self.passes, other.passes),
            reference_sum: more(self.reference_sum, other.reference_sum),
            sum: more(self.sum, other.sum),
            bond_history: more(self.bond_history, other.bond_history),
            central: self.central && other.central,
        }
    }
}

/// The largest value of each count over all laws, in 3-D. `central` is true only if it is true for every law.
pub const MOST: Counts = {
    let mut most = COUNTS[0];
    let mut k = 1;
    while k < COUNTS.len() {
        most = most.or_more(COUNTS[k]);
        k += 1;
    }
    most
};

/// The numbers of a point, with room for any law.
pub type AnyPoint = UpTo<{ MOST.point }>;

/// The bond history of one end of a bond, with room for any law.
pub type AnyHistory = UpTo<{ MOST.bond_history }>;

/// Return the first `B::COUNT` entries of a longer tuple.
#[inline(always)]
fn first<A: LaneTuple, B: LaneTuple>(all: &A) -> B {
    B::each(|k| all.get(k))
}

/// Return the entries of a shorter tuple, padded with zeros to `B::COUNT` entries.
#[inline(always)]
fn padded<A: LaneTuple, B: LaneTuple>(some: A) -> B {
    B::each(|k| {
        if k < A::COUNT {
            some.get(k)
        } else {
            Lanes::splat(0.0)
        }
    })
}

impl AnyLaw {
    /// Call [`Described::described`] of the law in this enum.
    pub fn described(&self) -> Vec<(&'static str, Property)> {
        with_law!(self, law => law.described())
    }

    /// Test whether the law is [linear](Law::LINEAR).
    pub fn is_linear<const D: usize>(&self) -> bool {
        fn of<L: Law<D>, const D: usize>(_: &L) -> bool {
            L::LINEAR
        }
        with_law!(self, law => of::<_, D>(law))
    }

    /// Test whether the law defines [`Law::out_of_plane_bond_stress`].
    pub fn has_out_of_plane_bond_stress<const D: usize>(&self) -> bool {
        fn of<L: Law<D>, const D: usize>(_: &L) -> bool {
            L::HAS_OUT_OF_PLANE_BOND_STRESS
        }
        with_law!(self, law => of::<_, D>(law))
    }

    /// Test whether the law defines [`Law::lost_stiffness`].
    pub fn softens<const D: usize>(&self) -> bool {
        fn of<L: Law<D>, const D: usize>(_: &L) -> bool {
            L::SOFTENS
        }
        with_law!(self, law => of::<_, D>(law))
    }

    /// Return the given entries of T⊗Y of eight bonds (see [`ForceState::dyad`]), multiplied by both
    /// `factors`. Entries beyond `D` dimensions are 0.
    #[inline(never)]
    pub fn stress_contribution<const D: usize>(
        &self,
        bond: &Bond<D>,
        (end, history): (&AnyPoint, &AnyHistory),
        factors: [Lanes; 2],
        entries: [(usize, usize); 6],
    ) -> [Lanes; 6] {
        fn of<F: ForceState<D>, const D: usize>(
            force: F,
            bond: &Bond<D>,
            [weight, volume]: [Lanes; 2],
            entries: [(usize, usize); 6],
        ) -> [Lanes; 6] {
            let force = force.times(weight).times(volume);
            entries.map(|(a, b)| {
                if a < D && b < D {
                    force.dyad(bond, a, b)
                } else {
                    Lanes::splat(0.0)
                }
            })
        }
        with_law!(self, law => {
            of::<_, D>(law.force_state(bond, &first(end), &first(history)), bond, factors, entries)
        })
    }

    /// Return [`Law::counts`] in `D` dimensions.
    pub fn counts<const D: usize>(&self) -> Counts {
        with_law!(self, law => Law::<D>::counts(law))
    }
}

impl PairLaw {
    /// Return [`Law::toughness_scale`] of eight bonds. `points` has the point numbers of i and j. Return
    /// `None` if the law does not define this factor, or if the laws of points i and j differ.
    #[inline(never)]
    pub fn toughness_scale<const D: usize>(
        &self,
        bond: &Bond<D>,
        points: [&AnyPoint; 2],
    ) -> Option<Lanes> {
        fn of<L: Law<D>, const D: usize>(
            laws: &[L; 2],
            bond: &Bond<D>,
            [i, j]: [&AnyPoint; 2],
        ) -> Option<Lanes> {
            (L::SCALED).then(|| laws[0].toughness_scale(bond, [&first(i), &first(j)], &laws[1]))
        }
        with_pair!(self, laws => of(laws, bond, points))
    }
}

/// This implementation has two uses: bonds between points with different laws, and the kernel
/// `BreakingBonds`, which all laws share. The forces of bonds between points with different laws are never
/// [linear](Law::LINEAR), because a linear law is paired only with itself. Functions that are called per bond
/// are not inlined. Otherwise, every loop would contain the code of all laws.
impl<const D: usize> Law<D> for AnyLaw {
    type Point = AnyPoint;
    type BondHistory = AnyHistory;
    type ReferenceSum = [Lanes; MOST.reference_sum];
    // Passes call the concrete law of point i, not this implementation.
    type Sum = [Lanes; 0];
    type Force = [Lanes; D];
    const ISA_SET: IsaSet = IsaSet::Avx2;
    const FORCE_READS_STRETCH: bool = true;
    const WEARS_OUT: bool = true;

    #[inline(never)]
    fn reference_contribution(&self, bond: &Bond<D>) -> Self::ReferenceSum {
        with_law!(self, law => padded(law.reference_contribution(bond)))
    }

    fn constants(&self, sums: &[f64], numbers: &mut [f64]) {
        with_law!(self, law => Law::<D>::constants(law, sums, numbers));
    }

    #[inline(never)]
    fn update_point(
        &self,
        pass: usize,
        sums: &[f64],
        numbers: &mut [f64],
        plastic: &mut PlasticState,
        step: f64,
    ) {
        with_law!(self, law => Law::<D>::update_point(law, pass, sums, numbers, plastic, step));
    }

    fn counts(&self) -> Counts {
        with_law!(self, law => Law::<D>::counts(law))
    }

    fn has_plasticity(&self) -> bool {
        with_law!(self, law => Law::<D>::has_plasticity(law))
    }

    fn correct_mean(&self, plastic: &mut PlasticState) {
        with_law!(self, law => Law::<D>::correct_mean(law, plastic));
    }

    #[inline(never)]
    fn bond_history(
        &self,
        bond: &Bond<D>,
        end: &Self::Point,
        before: &Self::BondHistory,
        step: f64,
    ) -> Self::BondHistory {
        with_law!(self, law => padded(law.bond_history(bond, &first(end), &first(before), step)))
    }

    #[inline(never)]
    fn force_state(
        &self,
        bond: &Bond<D>,
        end: &Self::Point,
        history: &Self::BondHistory,
    ) -> [Lanes; D] {
        with_law!(self, law => law.force_state(bond, &first(end), &first(history)).vector(bond))
    }

    #[inline(never)]
    fn end_work<S: Simd>(
        &self,
        simd: S,
        bond: &Bond<D>,
        end: &Self::Point,
        history: &Self::BondHistory,
        rotation: &<Self::Force as ForceState<D>>::Rotation,
    ) -> Lanes {
        with_law!(self, law => law.end_work(simd, bond, &first(end), &first(history), &first(rotation)))
    }

    fn rotation(&self, sums: &[f64]) -> Rotation {
        with_law!(self, law => Law::<D>::rotation(law, sums))
    }

    fn family_stress(
        &self,
        sums: &[f64],
        numbers: &[f64],
        state: &PlasticState,
    ) -> Option<FamilyStress<D>> {
        with_law!(self, law => Law::<D>::family_stress(law, sums, numbers, state))
    }

    #[inline(never)]
    fn bond_energy(&self, bond: &Bond<D>, end: &Self::Point, history: &Self::BondHistory) -> Lanes {
        with_law!(self, law => law.bond_energy(bond, &first(end), &first(history)))
    }

    fn point_energy(&self, numbers: &[f64]) -> f64 {
        with_law!(self, law => Law::<D>::point_energy(law, numbers))
    }

    fn weighted_volume(&self, numbers: &[f64]) -> Option<f64> {
        with_law!(self, law => Law::<D>::weighted_volume(law, numbers))
    }

    fn dilatation(&self, numbers: &[f64]) -> Option<f64> {
        with_law!(self, law => Law::<D>::dilatation(law, numbers))
    }

    fn out_of_plane_stress(
        &self,
        gradient: &SMatrix<f64, D, D>,
        plastic: &PlasticState,
    ) -> Option<f64> {
        with_law!(self, law => Law::<D>::out_of_plane_stress(law, gradient, plastic))
    }

    #[inline(never)]
    fn out_of_plane_bond_stress(&self, bond: &Bond<D>, end: &Self::Point) -> Lanes {
        with_law!(self, law => law.out_of_plane_bond_stress(bond, &first(end)))
    }

    fn out_of_plane_stretch(
        &self,
        gradient: &SMatrix<f64, D, D>,
        plastic: &PlasticState,
    ) -> Option<f64> {
        with_law!(self, law => Law::<D>::out_of_plane_stretch(law, gradient, plastic))
    }

    fn needs_shape(&self) -> bool {
        with_law!(self, law => Law::<D>::needs_shape(law))
    }

    fn is_singular(&self, numbers: &[f64]) -> bool {
        with_law!(self, law => Law::<D>::is_singular(law, numbers))
    }

    #[inline(never)]
    fn dissipated(&self, length: Lanes, history: &Self::BondHistory) -> Lanes {
        with_law!(self, law => Law::<D>::dissipated(law, length, &first(history)))
    }

    #[inline(never)]
    fn lost_stiffness(&self, history: &Self::BondHistory) -> Lanes {
        with_law!(self, law => Law::<D>::lost_stiffness(law, &first(history)))
    }

    #[inline(never)]
    fn is_worn_out<S: Simd>(&self, simd: S, history: &Self::BondHistory) -> u8 {
        with_law!(self, law => Law::<D>::is_worn_out(law, simd, &first(history)))
    }

    #[inline(never)]
    fn stiffness(&self, bond: &Bond<D>, end: &Self::Point) -> Lanes {
        with_law!(self, law => Law::<D>::stiffness(law, bond, &first(end)))
    }

    fn truncation_factor(&self, sums: &[f64]) -> f64 {
        with_law!(self, law => Law::<D>::truncation_factor(law, sums))
    }

    fn resists_across(&self) -> bool {
        with_law!(self, law => Law::<D>::resists_across(law))
    }
}
