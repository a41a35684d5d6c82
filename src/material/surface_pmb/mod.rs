//! Prototype microelastic material with a surface correction: the micromodulus of each point depends on the
//! direction of the bond, and is fitted to the point's own family.
//!
//! The micromodulus of an end is c h(n), with the micromodulus c of an untruncated family and the direction n
//! of the bond. A [`Form`] defines the function h, and fits the elastic tensor of the family to that of the
//! solid. The elastic tensor of a family is ½ Σ c |ξ| h(n) n⊗n⊗n⊗n Ṽ. The elastic tensor of a bond-based
//! solid is μ (δ_ab δ_cd + δ_ac δ_bd + δ_ad δ_bc). Here μ = 2 W₁/(d (d + 2)), with the number of dimensions d
//! and the energy density W₁ at unit isotropic stretch.
//!
//! Bonds of a point to another block can have another c and another μ. For example, c and μ can be computed
//! with the mean horizon and the mean modulus of the two blocks. The fit therefore uses the quotient c/μ of
//! each bond. This quotient depends on the horizon only. If all bonds of a point have the same μ, the elastic
//! tensor is fitted to that of the solid with this μ.
//!
//! The micromodulus c_ij(n) of a bond is the mean of the micromoduli of points i and j. A critical stretch
//! s_c that follows from a fracture energy is scaled to s_c √(c/c_ij). Breaking the bond then takes the same
//! energy as in an untruncated family. Le & Bobaru (2018) compare other corrections.
//!
//! In 1-D, where all bonds have the same direction, [`Normalised`](super::Normalised) replaces this law.

mod directional;
mod tensor;

use nalgebra::SMatrix;

use super::monomials::write_monomials;
use super::pmb::SURFACE_CORRECTION;
use super::symmetric::{Symmetric, quadratic_form, to_entries};
use super::{Along, Bond, Declaration, Declared, Described, Given, Law, Pmb, Property, ellipsoid};
use crate::lanes::Lanes;

/// Number of monomials of degree 6 in three variables.
const MONOMIALS: usize = 28;

/// Form of the function h. The form is a field of the law, not a type parameter. Selecting it at run time
/// costs up to 5 % of the speed. With a type parameter, each form would have its own copy of all loops, which
/// would increase the build time.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Form {
    /// The function of [`tensor`]; `surface_correction = "tensor"`.
    Tensor,
    /// The function of [`directional`]; `surface_correction = "directional"`.
    Directional,
}

impl Form {
    /// Return the tensor that determines ½ h of a point. `sums` are the sums of |ξ| Ṽ c/μ times the monomials
    /// of degree 6 of n.
    fn fit<const D: usize>(self, sums: &[f64]) -> SMatrix<f64, D, D> {
        match self {
            Self::Tensor => tensor::fit(sums),
            Self::Directional => directional::fit(sums),
        }
    }

    /// Return ½ h of eight bonds.
    #[inline(always)]
    fn half<const D: usize>(self, bond: &Bond<D>, tensor: &Symmetric<D>) -> Lanes {
        match self {
            Self::Tensor => quadratic_form(bond, tensor),
            Self::Directional => ellipsoid::radius(bond, tensor),
        }
    }
}

/// The constants of the law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfacePmb {
    /// Micromodulus c of an untruncated family, N/m⁶.
    micromodulus: f64,
    /// c/μ with the shear modulus μ of the solid, 1/m⁴.
    micromodulus_over_shear: f64,
    /// Whether the critical stretch follows from a fracture energy, and is therefore scaled with the
    /// micromodulus.
    is_scaled: bool,
    form: Form,
}

impl SurfacePmb {
    /// Create the law of a 2-D or 3-D body with a surface correction.
    pub(super) fn of(given: &Given) -> Self {
        let energy = Pmb::isotropic_energy(given.dimension, given.elastic.youngs_modulus);
        let d = given.dimension.count() as f64;
        let micromodulus = Pmb::of(given).micromodulus;
        let is_tensor = given.values.word(SURFACE_CORRECTION.name) == "tensor";
        Self {
            micromodulus,
            micromodulus_over_shear: micromodulus * d * (d + 2.0) / (2.0 * energy),
            is_scaled: given.from_fracture_energy,
            form: if is_tensor {
                Form::Tensor
            } else {
                Form::Directional
            },
        }
    }
}

/// The law has no name of its own in decks. Decks select it with `pmb` or `proportional` and a
/// `surface_correction`.
impl Declared for SurfacePmb {
    const DECLARATIONS: &'static [Declaration] = &[];
}

impl Described for SurfacePmb {
    fn described(&self) -> Vec<(&'static str, Property)> {
        vec![
            (
                "micromodulus inside",
                Property::Number(self.micromodulus, "N/m⁶"),
            ),
            ("at surfaces", Property::Text("by direction")),
        ]
    }
}

impl<const D: usize> Law<D> for SurfacePmb {
    /// The tensor that determines ½ h.
    type Point = Symmetric<D>;
    type BondHistory = [Lanes; 0];
    /// Sums of |ξ| Ṽ c/μ times the monomials of degree 6 in the components of n.
    type ReferenceSum = [Lanes; MONOMIALS];
    type Sum = [Lanes; 0];
    type Force = Along;
    const CONSTANTS: usize = 2 * D;
    const LEAST_DIMENSION: usize = 2;
    const SCALED: bool = true;

    #[inline(always)]
    fn reference_contribution(&self, bond: &Bond<D>) -> [Lanes; MONOMIALS] {
        let mut sums = [Lanes::splat(0.0); MONOMIALS];
        let directions = bond.reference.map(|xi| xi * bond.inverse);
        let factor = bond.length * self.micromodulus_over_shear;
        write_monomials(6, directions, factor, &mut sums);
        sums
    }

    fn constants(&self, sums: &[f64], numbers: &mut [f64]) {
        to_entries(&self.form.fit::<D>(sums), numbers);
    }

    #[inline(always)]
    fn force_state(&self, bond: &Bond<D>, end: &Symmetric<D>, _: &[Lanes; 0]) -> Along {
        let micromodulus = self.form.half(bond, end) * self.micromodulus;
        Along(bond.extension_over_deformed * (bond.inverse * micromodulus))
    }

    #[inline(always)]
    fn bond_energy(&self, bond: &Bond<D>, end: &Symmetric<D>, _: &[Lanes; 0]) -> Lanes {
        bond.stretch
            * bond.stretch
            * bond.length
            * self.form.half(bond, end)
            * (0.5 * self.micromodulus)
    }

    #[inline(always)]
    fn stiffness(&self, bond: &Bond<D>, end: &Symmetric<D>) -> Lanes {
        self.form.half(bond, end) * self.micromodulus / bond.length
    }

    #[inline(always)]
    fn toughness_scale(
        &self,
        bond: &Bond<D>,
        [here, there]: [&Symmetric<D>; 2],
        other: &Self,
    ) -> Lanes {
        if !self.is_scaled || !other.is_scaled {
            return Lanes::splat(1.0);
        }
        let micromodulus = self.form.half(bond, here) * self.micromodulus
            + other.form.half(bond, there) * other.micromodulus;
        let untruncated = 0.5 * (self.micromodulus + other.micromodulus);
        (Lanes::splat(untruncated) / micromodulus).sqrt()
    }
}
