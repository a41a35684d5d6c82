//! Linear microelastic material: the force density of a bond, per volume of point j, is f = C η with
//! C = λ(|ξ|) ξ⊗ξ.
//!
//! Emmrich & Weckner 2006, eq. 5–8. The default λ = c/|ξ|³ is the linearisation of the prototype microelastic
//! material with the micromodulus c.
//! The law with any other λ(|ξ|) equals the default law with c = 1 and the influence function λ |ξ|³. Forces
//! act along ξ, also after large motions. A rigid rotation causes forces, because f is linear in η.

use std::sync::Arc;

use super::{
    Along, Bond, Built, Declaration, Declared, Described, Given, Key, Kind, Law, Pmb, Property,
    Word,
};
use crate::lanes::{IsaSet, Lanes};

/// The constants of the law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinearMicroelastic {
    /// Micromodulus c, N/m⁶; 1 if the deck gives λ(|ξ|).
    pub micromodulus: f64,
    /// Classical energy density W₁ at unit isotropic stretch, J/m³. The surface correction scales the energy
    /// density of each point to W₁. `None` without surface correction.
    pub corrected_to: Option<f64>,
}

const LAMBDA: Key = Key {
    name: "lambda",
    meaning: "stiffness λ in N/m⁹, an expression of the bond's length `r` in m; c/r³ if not \
              given",
    kind: Kind::OfLength,
};

const SURFACE_CORRECTION: Key = Key {
    name: "surface_correction",
    meaning: "surface correction of the micromodulus of each point, from its own family: none or \
              by strain energy",
    kind: Kind::Word(&[Word::new("none"), Word::new("energy")]),
};

impl Declared for LinearMicroelastic {
    const DECLARATIONS: &'static [Declaration] = &[Declaration {
        keys: &[LAMBDA, SURFACE_CORRECTION],
        linear: true,
        examples: &[
            "",
            "lambda = '0.01*exp(-r)'",
            "surface_correction = 'energy'",
        ],
        ..Declaration::new("linear_microelastic", "f = λ(r) ξ⊗ξ η", build)
    }];
}

fn build(given: &Given) -> Built {
    let lambda = given.values.of_length(LAMBDA.name);
    let plain = Pmb::of(given).micromodulus;
    let energy = Pmb::isotropic_energy(given.dimension, given.elastic.youngs_modulus);
    let corrected = given.values.word(SURFACE_CORRECTION.name) == "energy";
    let law = LinearMicroelastic {
        micromodulus: lambda.map_or(plain, |_| 1.0),
        corrected_to: corrected.then_some(energy),
    };
    match lambda.map(Arc::clone) {
        None => Built::plain(law),
        Some(lambda) => {
            Built::with_influence(law, move |length| lambda.at(length) * length.powi(3))
        }
    }
}

impl Described for LinearMicroelastic {
    fn described(&self) -> Vec<(&'static str, Property)> {
        vec![("micromodulus", Property::Number(self.micromodulus, "N/m⁶"))]
    }
}

impl<const D: usize> Law<D> for LinearMicroelastic {
    /// Factor on the micromodulus.
    type Point = [Lanes; 1];
    type BondHistory = [Lanes; 0];
    /// With surface correction, Σ c ω|ξ| Ṽ/(4 W₁). Bonds to other blocks can have another c and another W₁.
    type ReferenceSum = [Lanes; 1];
    type Sum = [Lanes; 0];
    type Force = Along;
    const ISA_SET: IsaSet = IsaSet::Avx2;
    const CONSTANTS: usize = 1;
    const FORCE_READS_STRETCH: bool = true;
    const LINEAR: bool = true;

    #[inline(always)]
    fn reference_contribution(&self, bond: &Bond<D>) -> [Lanes; 1] {
        let factor = match self.corrected_to {
            Some(energy) => self.micromodulus / (4.0 * energy),
            None => 0.0,
        };
        [bond.length * factor]
    }

    /// Set the factor on the micromodulus. With surface correction, the factor is the inverse of the sum in
    /// `sums`. Without surface correction, or if the sum is not positive, the factor is 1.
    fn constants(&self, sums: &[f64], numbers: &mut [f64]) {
        numbers[0] = match self.corrected_to {
            Some(_) if sums[0] > 0.0 => 1.0 / sums[0],
            _ => 1.0,
        };
    }

    #[inline(always)]
    fn force_state(&self, bond: &Bond<D>, [factor]: &[Lanes; 1], _: &[Lanes; 0]) -> Along {
        Along(bond.stretch * *factor * (bond.inverse * (0.5 * self.micromodulus)))
    }

    #[inline(always)]
    fn bond_energy(&self, bond: &Bond<D>, [factor]: &[Lanes; 1], _: &[Lanes; 0]) -> Lanes {
        bond.stretch * bond.stretch * bond.length * *factor * (0.25 * self.micromodulus)
    }

    #[inline(always)]
    fn stiffness(&self, bond: &Bond<D>, [factor]: &[Lanes; 1]) -> Lanes {
        *factor * (0.5 * self.micromodulus) / bond.length
    }
}
