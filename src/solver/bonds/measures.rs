//! Kernels for set-up and output: volume, energy, stiffness, stress and dilatation.

use crate::lanes::{IsaSet, LaneTuple, Lanes, Simd};
use crate::material::bond::Wanted;
use crate::material::{AnyHistory, AnyLaw, AnyPoint, FamilyShare, Law, family_share};

use super::kernel::{Group, Kernel};

/// Request every bond quantity. Unused quantities cost little, because most kernels of this file run only for
/// set-up and outputs.
pub(super) const fn wanted(linear: bool) -> Wanted {
    Wanted {
        linear,
        stretch: true,
        extension_over_deformed: true,
    }
}

/// Kernel that computes the sums of each point, by index:
///
/// 0. strain energy density of the intact bonds within the horizon of the point, J/m³;
/// 1. volume of the intact neighbours within the horizon of the point, m³;
/// 2. number of intact bonds, including bonds longer than the horizon of the point;
/// 3. energy density that all bonds have dissipated without breaking, J/m³.
#[derive(Clone, Copy)]
pub struct EnergiesAndFamilies {
    /// The law of point i.
    pub law: AnyLaw,
    /// Whether bonds have a history.
    pub keeps_history: bool,
}

impl<const D: usize> Kernel<D> for EnergiesAndFamilies {
    type Sums = [Lanes; 4];
    type Point = AnyPoint;
    type PointJ = [Lanes; 0];
    type BondHistory = AnyHistory;
    type Rotation = [Lanes; 0];
    const READS_BROKEN: bool = true;
    const ISA_SET: IsaSet = IsaSet::Avx2;
    const ANY_LAW: bool = true;
    const WANTED: Wanted = Wanted {
        extension_over_deformed: false,
        ..wanted(false)
    };

    fn is_linear(&self) -> bool {
        self.law.is_linear::<D>()
    }

    fn needs_broken(&self) -> bool {
        self.keeps_history
    }

    #[inline(always)]
    fn add<S: Simd>(&self, simd: S, group: &mut Group<'_, Self, D>, sums: &mut [Lanes; 4]) {
        let (family, own) = (group.family(), group.numbers_i);
        let energy = self.law.bond_energy(&group.bond, own, &group.history[0]);
        let energy = simd.opaque(group.weighted_by_volume(energy));
        sums[0] += simd.keep(energy, family);
        sums[1] += simd.keep(group.volume_j, family);
        sums[2] += simd.keep(Lanes::splat(1.0), group.intact);
        if self.keeps_history {
            let dissipated = Law::<D>::dissipated(&self.law, group.bond.length, &group.history[0]);
            sums[3] += simd.keep(group.weighted_by_volume(dissipated), group.whole);
        }
    }
}

/// Kernel that computes two of the sums of [`EnergiesAndFamilies`], by index:
///
/// 0. volume of the intact neighbours within the horizon of the point, m³;
/// 1. number of intact bonds, including bonds longer than the horizon of the point.
#[derive(Clone, Copy)]
pub struct IntactFamilies;

impl<const D: usize> Kernel<D> for IntactFamilies {
    type Sums = [Lanes; 2];
    type Point = [Lanes; 0];
    type PointJ = [Lanes; 0];
    type BondHistory = [Lanes; 0];
    type Rotation = [Lanes; 0];
    // AVX2 is enough: this kernel runs only at set-up, after refinements and rebalances, and for outputs.
    const ISA_SET: IsaSet = IsaSet::Avx2;
    const WANTED: Wanted = wanted(true);

    fn is_undeformed(&self) -> bool {
        true
    }

    #[inline(always)]
    fn add<S: Simd>(&self, simd: S, group: &mut Group<'_, Self, D>, sums: &mut [Lanes; 2]) {
        sums[0] += simd.keep(group.volume_j, group.family());
        sums[1] += simd.keep(Lanes::splat(1.0), group.intact);
    }
}

/// Kernel that sums d_ij V_j over neighbours j, m³. d_ij is the fraction of the stiffness that bond ij has
/// lost. The sum is over the intact bonds within the horizon of point i.
#[derive(Clone, Copy)]
pub struct Softened {
    /// The law of point i.
    pub law: AnyLaw,
}

impl<const D: usize> Kernel<D> for Softened {
    type Sums = [Lanes; 1];
    type Point = [Lanes; 0];
    type PointJ = [Lanes; 0];
    type BondHistory = AnyHistory;
    type Rotation = [Lanes; 0];
    const ISA_SET: IsaSet = IsaSet::Avx2;
    const WANTED: Wanted = wanted(true);

    #[inline(always)]
    fn add<S: Simd>(&self, simd: S, group: &mut Group<'_, Self, D>, sums: &mut [Lanes; 1]) {
        let lost = Law::<D>::lost_stiffness(&self.law, &group.history[0]);
        sums[0] += simd.keep(lost * group.volume_j, group.family());
    }
}

/// Index pairs of the entries of a symmetric tensor: xx, yy, zz, xy, yz, xz.
pub(super) const PAIRS: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)];

/// Add the tensor entries of the intact bonds to a symmetric tensor. `entry` returns an entry, given its
/// index in [`PAIRS`] and its row and column.
#[inline(always)]
fn add_tensor<S: Simd, const D: usize>(
    simd: S,
    sums: &mut [Lanes; 6],
    intact: u8,
    entry: impl Fn(usize, usize, usize) -> Lanes,
) {
    for (k, (a, b)) in PAIRS.into_iter().enumerate() {
        if a < D && b < D {
            sums[k] += simd.keep(entry(k, a, b), intact);
        }
    }
}

/// Kernel that sums the tensor D = Σ V_j C n⊗n (N/m⁴) over the intact bonds in the reference configuration.
/// The sums are xx, yy, zz, xy, yz, xz. n is ξ/|ξ|. C is a sum over both ends: each end contributes its
/// [`Law::stiffness`] times its weight. The contribution of an end to C is multiplied by the identity I
/// instead of n⊗n if the law of the end [resists displacements across](Law::resists_across) the bonds.
#[derive(Clone, Copy)]
pub struct Stiffness {
    /// Laws of points i and j.
    pub laws: [AnyLaw; 2],
}

impl<const D: usize> Kernel<D> for Stiffness {
    type Sums = [Lanes; 6];
    type Point = AnyPoint;
    type PointJ = AnyPoint;
    type BondHistory = [Lanes; 0];
    type Rotation = [Lanes; 0];
    // AVX2 is enough: this kernel runs only at set-up, and after refinements and rebalances.
    const ISA_SET: IsaSet = IsaSet::Avx2;
    const ANY_LAW: bool = true;
    const WANTED: Wanted = wanted(false);

    fn is_linear(&self) -> bool {
        self.laws[0].is_linear::<D>()
    }

    fn is_undeformed(&self) -> bool {
        self.laws.iter().all(|law| law.counts::<D>().point == 0)
    }

    #[inline(always)]
    fn add<S: Simd>(&self, simd: S, group: &mut Group<'_, Self, D>, sums: &mut [Lanes; 6]) {
        let length = group.bond.length;
        let xi = &group.bond.reference;
        let bond = &group.bond;
        let own = Law::<D>::stiffness(&self.laws[0], bond, group.numbers_i) * group.weights.at_i();
        let far = Law::<D>::stiffness(&self.laws[1], bond, &group.numbers_j) * group.weights.at_j();
        // A law with `resists_across` has bond stiffness k I; any other law has k n⊗n.
        let [own_across, far_across] = self.laws.map(|law| Law::<D>::resists_across(&law));
        let none = Lanes::splat(0.0);
        let sum = |across: bool| {
            let share = |end, is| if is == across { end } else { none };
            (share(own, own_across) + share(far, far_across)) * group.volume_j
        };
        let weight = sum(false) / (length * length);
        add_tensor::<S, D>(simd, sums, group.intact, |_, a, b| weight * xi[a] * xi[b]);
        if own_across || far_across {
            for sum_across in &mut sums[..D] {
                *sum_across += simd.keep(sum(true), group.intact);
            }
        }
    }
}

/// Kernel that computes the Kirchhoff stress Σ T⊗Y Ṽ, Pa. The sum is over the intact bonds. The components
/// are in the order xx, yy, zz, xy, yz, xz. T is the force state of point i, and Y = ξ + η.
///
/// Silling & Lehoucq 2008 give the first Piola–Kirchhoff stress of a homogeneous motion as Σ T⊗ξ Ṽ. Its
/// product with Fᵀ is the Kirchhoff stress Σ T⊗Y Ṽ, which is symmetric and rotates with the body. Linear laws
/// use ξ in place of Y.
#[derive(Clone, Copy)]
pub struct Stress {
    /// Law of point i.
    pub law: AnyLaw,
}

impl<const D: usize> Kernel<D> for Stress {
    type Sums = [Lanes; 6];
    type Point = AnyPoint;
    type PointJ = [Lanes; 0];
    type BondHistory = AnyHistory;
    type Rotation = [Lanes; 0];
    const ANY_LAW: bool = true;
    const WANTED: Wanted = wanted(false);

    fn is_linear(&self) -> bool {
        self.law.is_linear::<D>()
    }

    #[inline(always)]
    fn add<S: Simd>(&self, simd: S, group: &mut Group<'_, Self, D>, sums: &mut [Lanes; 6]) {
        let numbers = (group.numbers_i, &group.history[0]);
        let factors = [group.weights.at_i(), group.volume_j];
        let stress = (self.law).stress_contribution(&group.bond, numbers, factors, PAIRS);
        add_tensor::<S, D>(simd, sums, group.intact, |k, _, _| stress[k]);
    }
}

/// Kernel that sums [`Law::out_of_plane_bond_stress`] times ω Ṽ over the intact bonds, Pa.
#[derive(Clone, Copy)]
pub struct OutOfPlaneStress {
    /// Law of point i.
    pub law: AnyLaw,
}

impl<const D: usize> Kernel<D> for OutOfPlaneStress {
    type Sums = [Lanes; 1];
    type Point = AnyPoint;
    type PointJ = [Lanes; 0];
    type BondHistory = [Lanes; 0];
    type Rotation = [Lanes; 0];
    const EXISTS: bool = D == 2;
    const ANY_LAW: bool = true;
    const WANTED: Wanted = wanted(false);

    fn is_linear(&self) -> bool {
        self.law.is_linear::<D>()
    }

    #[inline(always)]
    fn add<S: Simd>(&self, simd: S, group: &mut Group<'_, Self, D>, sums: &mut [Lanes; 1]) {
        let stress = self
            .law
            .out_of_plane_bond_stress(&group.bond, group.numbers_i);
        sums[0] += simd.keep(group.weighted_by_volume(stress), group.intact);
    }
}

/// Kernel that sums two tensors over the intact bonds of a point, m⁵:
///
/// - the shape tensor Σ ω ξ⊗ξ Ṽ: the diagonal entries, then the mixed entries;
/// - Σ ω η⊗ξ Ṽ, row by row.
#[derive(Clone, Copy)]
pub struct FamilyTensors {
    /// Exclude thermal stretches.
    pub is_elastic: bool,
}

impl<const D: usize> Kernel<D> for FamilyTensors {
    type Sums = FamilyShare<D>;
    type Point = [Lanes; 0];
    type PointJ = [Lanes; 0];
    type BondHistory = [Lanes; 0];
    type Rotation = [Lanes; 0];
    const WANTED: Wanted = wanted(true);

    fn is_elastic(&self) -> bool {
        self.is_elastic
    }

    #[inline(always)]
    fn add<S: Simd>(&self, simd: S, group: &mut Group<'_, Self, D>, sums: &mut Self::Sums) {
        let weight = simd.keep(group.weighted_by_volume(Lanes::splat(1.0)), group.intact);
        let share = family_share(&group.bond);
        for k in 0..FamilyShare::<D>::COUNT {
            let sum = sums.get_mut(k);
            *sum = simd.multiply_add(share.get(k), weight, *sum);
        }
    }
}

/// Kernel that sums Σ T·(v_j − v_i) Ṽ over the intact bonds. This is the rate of change of the strain energy
/// density if every point moves with its rate v. The kernel reads v from the columns of point numbers: the
/// first D columns are the components of v, and the point numbers of the law follow. The unit of the sum is
/// J/m⁴ times the unit of v.
#[derive(Clone, Copy)]
pub struct EnergyRate {
    /// Law of point i.
    pub law: AnyLaw,
}

impl<const D: usize> Kernel<D> for EnergyRate {
    type Sums = [Lanes; 1];
    type Point = ([Lanes; D], AnyPoint);
    type PointJ = [Lanes; D];
    type BondHistory = AnyHistory;
    type Rotation = [Lanes; 0];
    const ANY_LAW: bool = true;
    const WANTED: Wanted = wanted(false);

    fn is_linear(&self) -> bool {
        self.law.is_linear::<D>()
    }

    #[inline(always)]
    fn add<S: Simd>(&self, simd: S, group: &mut Group<'_, Self, D>, sums: &mut [Lanes; 1]) {
        let ((rate_i, numbers), rate_j) = (group.numbers_i, &group.numbers_j);
        let force: [Lanes; D] = self
            .law
            .force_state(&group.bond, numbers, &group.history[0]);
        let mut power = Lanes::splat(0.0);
        for d in 0..D {
            power += force[d] * (rate_j[d] - rate_i[d]);
        }
        let share = power * group.weights.at_i() * group.force_volume;
        sums[0] += simd.keep(share, group.intact);
    }
}

/// Kernel with the sums for the dilatation θ = (d/m) Σ ω|ξ|eṼ in d dimensions. e is the extension of the
/// bond, or ξ·η/|ξ| for linear laws. The sums, in m⁵, are:
///
/// 0. the weighted volume m = Σ ω|ξ|²Ṽ of the whole family;
/// 1. Σ ω|ξ|²Ṽ over the intact bonds;
/// 2. Σ ω|ξ|eṼ over the intact bonds.
#[derive(Clone, Copy)]
pub struct Dilatation {
    /// Whether e is linear in η.
    pub is_linear: bool,
}

impl<const D: usize> Kernel<D> for Dilatation {
    type Sums = [Lanes; 3];
    type Point = [Lanes; 0];
    type PointJ = [Lanes; 0];
    type BondHistory = [Lanes; 0];
    type Rotation = [Lanes; 0];
    const READS_BROKEN: bool = true;
    const ANY_LAW: bool = true;
    const WANTED: Wanted = wanted(false);

    fn is_linear(&self) -> bool {
        self.is_linear
    }

    fn is_elastic(&self) -> bool {
        false
    }

    #[inline(always)]
    fn add<S: Simd>(&self, simd: S, group: &mut Group<'_, Self, D>, sums: &mut [Lanes; 3]) {
        let length = group.bond.length;
        let weight = length * length * group.volume_j * group.weights.at_i();
        let growth = weight * group.bond.stretch;
        sums[0] += simd.keep(weight, group.whole);
        sums[1] += simd.keep(weight, group.intact);
        sums[2] += simd.keep(growth, group.intact);
    }
}
