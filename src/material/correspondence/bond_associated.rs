//! Bond-associated correspondence: a classical stress for each bond, from the bond's own deformation
//! gradient. This law has no zero-energy modes, so it needs no zero-energy control.
//!
//! Breitzman & Dayal 2018. The deformation gradient F_ξ of a bond maps ξ to Y. For vectors v
//! perpendicular to ξ, F_ξ v = F v, with the deformation gradient F of the family.
//! The strain energy density W of a point is the weighted mean of the classical energy densities at F_ξ.
//! [`Correspondence`](super::Correspondence) evaluates the classical energy density once, at F.
//! With F = I + H of [`Correspondence`](super::Correspondence), n = ξ/|ξ| and the classical strain energy
//! density Ψ,
//!
//! F_ξ = F + (Y − F ξ)⊗ξ/|ξ|², W = Σ w Ψ(F_ξ), w = ω Ṽ/Σ ω Ṽ,
//!
//! summed over the intact bonds. Let P_ξ = ∂Ψ/∂F be the stress at F_ξ. The derivative of W with respect to Y,
//! divided by the volume Ṽ, is the force state
//!
//! T⟨ξ⟩ = ω (P_ξ ξ/|ξ|² / Σ ω Ṽ + Z K⁻¹ ξ), Z = Σ w P_ξ (I − n⊗n).
//!
//! Because F_ξ ξ = Y, W is 0 only for motions that keep the length of every bond.
//! F is the deformation gradient of the point's own family. It is not the mean of the deformation gradients
//! at both ends of the bond. Therefore the force state depends on the point's own family only, and
//! Σ T⟨ξ⟩⊗Y Ṽ = Σ w P_ξ F_ξᵀ is symmetric at every point.
//! The gradients of Chen 2018 sum over the neighbours that points i and j share. Such gradients would need
//! enough shared neighbours and a shape tensor per bond, so they are not used.
//!
//! Let H_ξ = F_ξ − I. With the largest modulus c of the solid, W ≤ ½ c Σ w |H_ξ|². Here
//! |H_ξ|² = |H (I − n⊗n)|² + |η|²/|ξ|². With the smallest eigenvalue λ of K, |H|² ≤ Σ ω |η|² Ṽ/λ.
//! Therefore W is at most ½ Σ ω k |η|² Ṽ, with k = c (1/λ + 1/(|ξ|² Σ ω Ṽ)). This sum is the energy of
//! springs with the constant ω k per bond.

use nalgebra::SMatrix;

use super::super::symmetric::{from_entries, to_entries};
use super::super::{
    Bond, Built, Declaration, Declared, Described, Given, Influence, Key, Law, PlasticState,
    Property, Rotation,
};
use super::family::{
    FamilyShare, ShapeTensor, family_rotation, family_share, from_rows, shape_share, to_rows,
};
use super::hooke::{self, Hooke};
use super::stress::{OfBonds, Stress};
use super::tensor::{Tensor, tensor};
use super::{STRESS, of_stress};
use crate::lanes::{IsaSet, LaneTuple, Lanes};

/// The constants of the law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BondAssociated {
    stress: Stress,
    /// Largest modulus of the solid, [`Stress::largest_modulus`], Pa.
    modulus: f64,
    /// Trace of the shape tensor of an untruncated family, m⁵.
    untruncated_trace: f64,
}

const KEYS: &[Key] = hooke::keys_with_hooke![STRESS];

impl Declared for BondAssociated {
    const DECLARATIONS: &'static [Declaration] = &[Declaration {
        keys: KEYS,
        any_poisson_ratio: true,
        no_line: Some("`bond_associated_correspondence` has no 1-D form; use `pmb`"),
        breaks_by_energy: true,
        examples: &[
            "poisson_ratio = 0.4",
            "poisson_ratio = 0.3, stress = 'neo-hooke'",
            "poisson_ratio = 0.2, stress = 'willberg2022'",
        ],
        fault: Some(hooke::fault),
        elastic: Some(hooke::average),
        invariants: of_stress,
        ..Declaration::new(
            "bond_associated_correspondence",
            "from a classical stress, evaluated at a deformation gradient for each bond",
            build,
        )
    }];
}

fn build(given: &Given) -> Built {
    let hooke = Hooke::of(given).expect("the constants have been looked at");
    let stress = Stress::of(given.values.word(STRESS.name), given, hooke);
    Built::plain(BondAssociated {
        stress,
        modulus: stress.largest_modulus(),
        untruncated_trace: Influence::Constant.weighted_volume(given.dimension, given.horizon),
    })
}

impl Described for BondAssociated {
    fn described(&self) -> Vec<(&'static str, Property)> {
        vec![("stress of each bond", Property::Text(self.stress.name()))]
    }
}

/// Point numbers: the constants c/λ (N/m⁷) and c/Σ ω Ṽ (N/m⁵) of the stiffness; then 1/Σ ω Ṽ of the intact
/// bonds (m⁻³), H, and Z K⁻¹ (N/m⁷).
type Point<const D: usize> = ([Lanes; 3], (Tensor<Lanes, D>, Tensor<Lanes, D>));

/// Indices of the numbers of a point. The order is: the numbers of [`Point`], the entries of K⁻¹, and the
/// flag of [`Self::singular`].
struct Places;

impl Places {
    const WEIGHT: usize = 2;
    const GRADIENT: usize = 3;

    const fn direct<const D: usize>() -> usize {
        Self::GRADIENT + D * D
    }

    /// Return the index at which the diagonal and mixed entries of K⁻¹ begin.
    const fn inverse<const D: usize>() -> usize {
        Self::direct::<D>() + D * D
    }

    /// Return the index of the flag for a point without force: K is nearly singular, the intact part of the
    /// family is too stiff, or the stress of a bond does not exist.
    const fn singular<const D: usize>() -> usize {
        Self::inverse::<D>() + 2 * D
    }
}

impl BondAssociated {
    /// Compute the stress of each bond from the displacement gradient H_ξ of the bond. `gradient` is the
    /// displacement gradient H of the point.
    #[inline(always)]
    fn stresses<const D: usize>(&self, bond: &Bond<D>, gradient: &Tensor<Lanes, D>) -> OfBonds<D> {
        self.stress.of_bonds(&own_gradient(bond, gradient))
    }
}

/// Return H_ξ of the bonds, from H of the point.
#[inline(always)]
fn own_gradient<const D: usize>(bond: &Bond<D>, gradient: &Tensor<Lanes, D>) -> Tensor<Lanes, D> {
    let xi = &bond.reference;
    let share = bond.inverse * bond.inverse;
    let rest: [Lanes; D] = LaneTuple::each(|a| {
        let mut seen = gradient[a][0] * xi[0];
        for b in 1..D {
            seen += gradient[a][b] * xi[b];
        }
        (bond.eta[a] - seen) * share
    });
    tensor(|a, b| gradient[a][b] + rest[a] * xi[b])
}

impl<const D: usize> Law<D> for BondAssociated {
    type Point = Point<D>;
    type BondHistory = [Lanes; 0];
    /// Diagonal and mixed entries of K (m⁵), and Σ ω Ṽ (m³).
    type ReferenceSum = (([Lanes; D], [Lanes; D]), [Lanes; 1]);
    /// Sums over the intact bonds. Pass 0: K (m⁵), Σ ω η⊗ξ Ṽ (m⁵), and Σ ω Ṽ (m³). Pass 1: Z Σ ω Ṽ (N m), and
    /// Σ ω Ṽ of the bonds at which the stress does not exist (m³).
    type Sum = (FamilyShare<D>, [Lanes; 1]);
    type Force = [Lanes; D];
    const CONSTANTS: usize = 2;
    const PASSES: usize = 2;
    const OWN_NUMBERS: usize = 2 * D + 1;
    const LEAST_DIMENSION: usize = 2;
    const SUM_READS_STRETCH: bool = false;
    const SUM_READS_DIRECTION: bool = true;
    const FORCE_READS_EXTENSION: bool = false;
    const HAS_OUT_OF_PLANE_BOND_STRESS: bool = true;
    // An AVX-512 version would gain little: most of the time goes into the stresses. `Stress::of_bonds`
    // computes the stresses, and is not compiled for AVX-512, because it is not inlined into the loop.
    const ISA_SET: IsaSet = IsaSet::Avx2;

    #[inline(always)]
    fn reference_contribution(&self, bond: &Bond<D>) -> Self::ReferenceSum {
        (shape_share(&bond.reference), [Lanes::splat(1.0)])
    }

    fn constants(&self, sums: &[f64], numbers: &mut [f64]) {
        let shape = ShapeTensor::<D>::new(sums);
        if shape.inverse().is_some() {
            numbers[0] = self.modulus / shape.smallest();
            numbers[1] = self.modulus / sums[2 * D];
        }
    }

    /// Return the trace of the shape tensor of an untruncated family, divided by the trace of K of the point;
    /// 1 if K is nearly singular.
    fn truncation_factor(&self, sums: &[f64]) -> f64 {
        let shape = ShapeTensor::<D>::new(sums);
        if shape.inverse().is_some() {
            self.untruncated_trace / shape.trace()
        } else {
            1.0
        }
    }

    #[inline(always)]
    fn pass_contribution<const S: usize>(
        &self,
        bond: &Bond<D>,
        (_, (gradient, _)): &Point<D>,
        _: &[Lanes; 0],
    ) -> Self::Sum {
        if S == 0 {
            return (family_share(bond), [Lanes::splat(1.0)]);
        }
        let OfBonds { piola, missing, .. } = self.stresses(bond, gradient);
        let n: [Lanes; D] = LaneTuple::each(|d| bond.reference[d] * bond.inverse);
        let mut sum = Self::Sum::splat(0.0);
        for a in 0..D {
            let mut along = piola[a][0] * n[0];
            for b in 1..D {
                along += piola[a][b] * n[b];
            }
            for b in 0..D {
                *sum.get_mut(D * a + b) = piola[a][b] - along * n[b];
            }
        }
        *sum.get_mut(D * D) = missing;
        sum
    }

    fn update_point(
        &self,
        pass: usize,
        sums: &[f64],
        numbers: &mut [f64],
        _: &mut PlasticState,
        _: f64,
    ) {
        let (direct, inverse) = (Places::direct::<D>(), Places::inverse::<D>());
        let singular = Places::singular::<D>();
        if pass == 0 {
            numbers[Places::WEIGHT..=singular].fill(0.0);
            let shape = ShapeTensor::<D>::new(sums);
            let Some(inverse_shape) = shape.inverse_of_rest(self.modulus, numbers[0]) else {
                numbers[singular] = 1.0;
                return;
            };
            numbers[Places::WEIGHT] = 1.0 / sums[2 * D + D * D];
            let gradient = from_rows::<D>(&sums[2 * D..]) * inverse_shape;
            to_rows(&gradient, &mut numbers[Places::GRADIENT..]);
            to_entries(&inverse_shape, &mut numbers[inverse..]);
            return;
        }
        if sums[D * D] > 0.0 {
            numbers[Places::WEIGHT..singular].fill(0.0);
            numbers[singular] = 1.0;
        }
        let weight = numbers[Places::WEIGHT];
        let inverse_shape = from_entries::<D>(&numbers[inverse..]);
        let product = from_rows::<D>(sums) * inverse_shape * weight;
        to_rows(&product, &mut numbers[direct..]);
    }

    #[inline(always)]
    fn force_state(
        &self,
        bond: &Bond<D>,
        ([.., weight], (gradient, direct)): &Point<D>,
        _: &[Lanes; 0],
    ) -> [Lanes; D] {
        let stress = self.stresses(bond, gradient).piola;
        let share = bond.inverse * bond.inverse * *weight;
        LaneTuple::each(|a| {
            let mut sum = (stress[a][0] * share + direct[a][0]) * bond.reference[0];
            for b in 1..D {
                sum += (stress[a][b] * share + direct[a][b]) * bond.reference[b];
            }
            sum
        })
    }

    fn rotation(&self, sums: &[f64]) -> Rotation {
        family_rotation::<D>(sums)
    }

    #[inline(always)]
    fn bond_energy(
        &self,
        bond: &Bond<D>,
        ([.., weight], (gradient, _)): &Point<D>,
        _: &[Lanes; 0],
    ) -> Lanes {
        self.stresses(bond, gradient).energy * *weight
    }

    fn out_of_plane_stress(&self, gradient: &SMatrix<f64, D, D>, _: &PlasticState) -> Option<f64> {
        self.stress.out_of_plane_stress(gradient)
    }

    #[inline(always)]
    fn out_of_plane_bond_stress(
        &self,
        bond: &Bond<D>,
        ([.., weight], (gradient, _)): &Point<D>,
    ) -> Lanes {
        self.stress
            .out_of_plane_stress_of_bonds(&own_gradient(bond, gradient))
            * *weight
    }

    fn out_of_plane_stretch(&self, gradient: &SMatrix<f64, D, D>, _: &PlasticState) -> Option<f64> {
        self.stress.out_of_plane_stretch(gradient)
    }

    fn needs_shape(&self) -> bool {
        true
    }

    fn is_singular(&self, numbers: &[f64]) -> bool {
        numbers[Places::singular::<D>()] > 0.0
    }

    #[inline(always)]
    fn stiffness(&self, bond: &Bond<D>, ([constant, along, ..], _): &Point<D>) -> Lanes {
        *constant + *along / (bond.length * bond.length)
    }

    fn resists_across(&self) -> bool {
        true
    }
}
