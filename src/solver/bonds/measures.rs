//! What is summed over bonds at set-up and for output: volume, energy, stiffness, stress, dilatation.

use crate::lanes::{IsaSet, LaneTuple, Lanes, Simd};
use crate::material::bond::Wanted;
use crate::material::{FamilyShare, ForceState, Law, family_share};

use super::kernel::{Group, Kernel};

/// All of the bonds: these loops are not those of every step.
const fn wanted(linear: bool) -> Wanted {
    Wanted {
        linear,
        stretch: true,
        extension_over_deformed: true,
    }
}

/// Sums what the intact bonds of a point hold: strain energy density (J/m³) that belongs to single
/// bonds, volume of the neighbours in the point's own family (m³), and the number of neighbours,
/// those included that have the point in their family only; then what all bonds have dissipated
/// without breaking (J/m³).
#[derive(Clone, Copy)]
pub struct Stored<L> {
    /// Law of the own end.
    pub law: L,
}

impl<L: Law<D>, const D: usize> Kernel<D> for Stored<L> {
    type Sums = [Lanes; 4];
    type Broken = [Lanes; 0];
    type Point = L::Point;
    type BondHistory = L::BondHistory;
    const EXISTS: bool = D >= L::LEAST_DIMENSION;
    const WHOLE: bool = L::BondHistory::COUNT > 0;
    const ISA_SET: IsaSet = IsaSet::Avx2;
    const NEAR: bool = L::ISA_SET.is_each() && !L::LINEAR && L::BondHistory::COUNT == 0;
    const WANTED: Wanted = Wanted {
        extension_over_deformed: false,
        ..wanted(L::LINEAR)
    };

    #[inline(always)]
    fn add<S: Simd>(&self, simd: S, group: &mut Group<'_, Self, D>, sums: &mut [Lanes; 4]) {
        let (family, own) = (group.family(), group.own);
        let energy = self.law.bond_energy(&group.bond, own, &group.history[0]);
        let energy = simd.whole(group.own_share(energy));
        sums[0] += simd.keep(energy, family);
        sums[1] += simd.keep(group.volume, family);
        sums[2] += simd.keep(Lanes::splat(1.0), group.intact);
        if L::BondHistory::COUNT > 0 {
            let dissipated = self.law.dissipated(group.bond.length, &group.history[0]);
            sums[3] += simd.keep(group.own_share(dissipated), group.whole);
        }
    }
}

/// Sums the volume of the intact neighbours in each point's own family (m³), and their number as
/// [`Stored`] does.
#[derive(Clone, Copy)]
pub struct IntactFamilies;

impl<const D: usize> Kernel<D> for IntactFamilies {
    type Sums = [Lanes; 2];
    type Broken = [Lanes; 0];
    type Point = [Lanes; 0];
    type BondHistory = [Lanes; 0];
    // At every set-up, after every refinement, and for outputs.
    const ISA_SET: IsaSet = IsaSet::Avx2;
    const UNDEFORMED: bool = true;
    const WANTED: Wanted = wanted(true);

    #[inline(always)]
    fn add<S: Simd>(&self, simd: S, group: &mut Group<'_, Self, D>, sums: &mut [Lanes; 2]) {
        sums[0] += simd.keep(group.volume, group.family());
        sums[1] += simd.keep(Lanes::splat(1.0), group.intact);
    }
}

/// Entries of a symmetric tensor in the order xx, yy, zz, xy, yz, xz.
const PAIRS: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)];

/// Adds the entries of a symmetric tensor of the intact bonds.
#[inline(always)]
fn add_tensor<S: Simd, const D: usize>(
    simd: S,
    sums: &mut [Lanes; 6],
    intact: u8,
    entry: impl Fn(usize, usize) -> Lanes,
) {
    for (sum, (a, b)) in sums.iter_mut().zip(PAIRS) {
        if a < D && b < D {
            *sum += simd.keep(entry(a, b), intact);
        }
    }
}

/// Sums D = Σ V C n⊗n over the intact bonds, undeformed (N/m⁴), as xx, yy, zz, xy, yz, xz; C adds up
/// [`Law::stiffness`] of both ends.
#[derive(Clone, Copy)]
pub struct Stiffness<L> {
    /// Laws of the own and of the far end.
    pub laws: [L; 2],
}

impl<L: Law<D>, const D: usize> Kernel<D> for Stiffness<L> {
    type Sums = [Lanes; 6];
    type Broken = [Lanes; 0];
    type Point = L::Point;
    type BondHistory = [Lanes; 0];
    const EXISTS: bool = D >= L::LEAST_DIMENSION;
    // At every set-up and after every refinement.
    const ISA_SET: IsaSet = IsaSet::Avx2;
    const UNDEFORMED: bool = L::Point::COUNT == 0;
    const WANTED: Wanted = wanted(L::LINEAR);

    #[inline(always)]
    fn add<S: Simd>(&self, simd: S, group: &mut Group<'_, Self, D>, sums: &mut [Lanes; 6]) {
        let length = group.bond.length;
        let xi = &group.bond.reference;
        let own = self.laws[0].stiffness(length, group.own) * group.weights.own();
        let far = self.laws[1].stiffness(length, &group.far) * group.weights.far();
        // Either all of a spring or the share along the bond.
        let [own_across, far_across] = self.laws.map(|law| law.resists_across());
        let none = Lanes::splat(0.0);
        let sum = |across: bool| {
            let share = |end, is| if is == across { end } else { none };
            (share(own, own_across) + share(far, far_across)) * group.volume
        };
        let weight = sum(false) / (length * length);
        add_tensor::<S, D>(simd, sums, group.intact, |a, b| weight * xi[a] * xi[b]);
        if own_across || far_across {
            for sum_across in &mut sums[..D] {
                *sum_across += simd.keep(sum(true), group.intact);
            }
        }
    }
}

/// Sums the stress Σ T⊗Y Ṽ over the intact bonds (Pa) as xx, yy, zz, xy, yz, xz.
///
/// Silling & Lehoucq 2008 give the first Piola–Kirchhoff stress of a homogeneous motion as
/// Σ T⊗ξ Ṽ; times Fᵀ it is this, the Kirchhoff stress, symmetric and turning with the body. Linear
/// laws have ξ in place of Y.
#[derive(Clone, Copy)]
pub struct Stress<L> {
    /// Law of the own end.
    pub law: L,
}

impl<L: Law<D>, const D: usize> Kernel<D> for Stress<L> {
    type Sums = [Lanes; 6];
    type Broken = [Lanes; 0];
    type Point = L::Point;
    type BondHistory = L::BondHistory;
    const EXISTS: bool = D >= L::LEAST_DIMENSION;
    const WANTED: Wanted = wanted(L::LINEAR);

    #[inline(always)]
    fn add<S: Simd>(&self, simd: S, group: &mut Group<'_, Self, D>, sums: &mut [Lanes; 6]) {
        let own = group.own;
        let force = self.law.force(&group.bond, own, &group.history[0]);
        let force = force.times(group.weights.own()).times(group.volume);
        add_tensor::<S, D>(simd, sums, group.intact, |a, b| {
            force.dyad(&group.bond, a, b)
        });
    }
}

/// Sum of [`Law::bond_stress_across`] over the intact bonds, Pa.
#[derive(Clone, Copy)]
pub struct StressAcross<L> {
    /// Law of the own end.
    pub law: L,
}

impl<L: Law<D>, const D: usize> Kernel<D> for StressAcross<L> {
    type Sums = [Lanes; 1];
    type Broken = [Lanes; 0];
    type Point = L::Point;
    type BondHistory = [Lanes; 0];
    const EXISTS: bool = D == 2 && L::HAS_BOND_STRESS_ACROSS;
    const WANTED: Wanted = wanted(L::LINEAR);

    #[inline(always)]
    fn add<S: Simd>(&self, simd: S, group: &mut Group<'_, Self, D>, sums: &mut [Lanes; 1]) {
        let stress = self.law.bond_stress_across(&group.bond, group.own);
        sums[0] += simd.keep(group.own_share(stress), group.intact);
    }
}

/// Sums the tensors of the intact bonds of a point: the shape tensor Σ ω ξ⊗ξ Ṽ by diagonal and mixed
/// entries, and Σ ω η⊗ξ Ṽ row by row, m⁵.
#[derive(Clone, Copy)]
pub struct FamilyTensors;

impl<const D: usize> Kernel<D> for FamilyTensors {
    type Sums = FamilyShare<D>;
    type Broken = [Lanes; 0];
    type Point = [Lanes; 0];
    type BondHistory = [Lanes; 0];
    const WANTED: Wanted = wanted(true);

    #[inline(always)]
    fn add<S: Simd>(&self, simd: S, group: &mut Group<'_, Self, D>, sums: &mut Self::Sums) {
        let weight = simd.keep(group.own_share(Lanes::splat(1.0)), group.intact);
        let share = family_share(&group.bond);
        for k in 0..FamilyShare::<D>::COUNT {
            let sum = sums.get_mut(k);
            *sum = simd.multiply_add(share.get(k), weight, *sum);
        }
    }
}

/// Sums what gives the dilatation θ = (d/m) Σ ω|ξ|εṼ: the weighted volume m = Σ ω|ξ|²Ṽ of the whole
/// family (m⁵), then Σ ω|ξ|εṼ over the intact bonds (m⁵), with ε linear in η if so wanted.
#[derive(Clone, Copy)]
pub struct Dilatation<const LINEAR: bool>;

impl<const LINEAR: bool, const D: usize> Kernel<D> for Dilatation<LINEAR> {
    type Sums = [Lanes; 2];
    type Broken = [Lanes; 0];
    type Point = [Lanes; 0];
    type BondHistory = [Lanes; 0];
    const WHOLE: bool = true;
    const WANTED: Wanted = wanted(LINEAR);

    #[inline(always)]
    fn add<S: Simd>(&self, simd: S, group: &mut Group<'_, Self, D>, sums: &mut [Lanes; 2]) {
        let length = group.bond.length;
        let weight = length * length * group.volume * group.weights.own();
        let growth = weight * group.bond.stretch;
        sums[0] += simd.keep(weight, group.whole);
        sums[1] += simd.keep(growth, group.intact);
    }
}
