//! Prototype microelastic material with one micromodulus per point, computed from the point's own family.
//!
//! Ganzenmüller, Hiermaier & May 2014; Diehl & Schweitzer 2016, §3. The micromodulus c_i is chosen such that,
//! at unit isotropic stretch, the energy of the discrete family is the classical energy density W₁. With the
//! bond energy w = c_i s²|ξ|/2, the condition ½ Σ w Ṽ = W₁ gives c_i = 4 W₁ / Σ |ξ| Ṽ. The energy of an
//! isotropic stretch is therefore correct at surfaces and on any lattice. A bond has the mean of the
//! micromoduli of points i and j, c_ij = (c_i + c_j)/2. A critical stretch s_c that follows from a fracture
//! energy is scaled to s_c √(c/c_ij), with the micromodulus c of an untruncated family. Breaking the bond
//! then takes the same energy as in an untruncated family.
//!
//! With the influence function δ/|ξ|, the bond energy is w = c̄_i s²/2 with c̄_i = c_i δ = 4 W₁/Σ Ṽ. This is
//! eq. 15 of Diehl & Schweitzer, except that they use W₁ = 9K/4 instead of the classical W₁.

use std::f64::consts::PI;

use super::declaration::bond_based_critical_stretch;
use super::{
    Along, Bond, Built, Declaration, Declared, Described, Given, Influence, Key, Kind, Law, Pmb,
    Property, Word,
};
use crate::dimension::Dimension;
use crate::lanes::Lanes;

/// The constants of the law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Normalised {
    /// Energy density W₁ at unit isotropic stretch, J/m³: the classical value, or 9K/4 for
    /// `form = "diehl2016"`.
    pub energy: f64,
    /// Micromodulus c of an untruncated family, N/m⁶, if the critical stretch follows from a fracture energy.
    /// `None` if the bonds have no damage, or if the deck gives a critical stretch, which then holds for all
    /// bonds.
    pub reference: Option<f64>,
}

const FORM: Key = Key {
    name: "form",
    meaning: "bond energy w whose sum over the family is normalised: c s²|ξ|/2, or c s²/2 as printed by Diehl & \
              Schweitzer (2016)",
    kind: Kind::Word(&[
        Word::new("energy"),
        Word {
            word: "diehl2016",
            no_line: Some("Diehl & Schweitzer (2016) give no constant for 1-D; use \"energy\""),
        },
    ]),
};

impl Declared for Normalised {
    const DECLARATIONS: &'static [Declaration] = &[Declaration {
        keys: &[FORM],
        breaks_by_energy: true,
        critical_stretch: Some(critical_stretch),
        examples: &["", "form = 'diehl2016'"],
        ..Declaration::new(
            "normalised_pmb",
            "a micromodulus for each point, from its own neighbours",
            build,
        )
    }];
}

fn build(given: &Given) -> Built {
    if as_printed(given) {
        let law = Normalised {
            energy: 2.25 * given.elastic.bulk_modulus(),
            reference: given
                .from_fracture_energy
                .then(|| printed_micromodulus(given)),
        };
        let horizon = given.horizon;
        Built::with_influence(law, move |length| Influence::Inverse.at(length, horizon))
    } else {
        Built::plain(Normalised::classical(given))
    }
}

fn as_printed(given: &Given) -> bool {
    given.values.word(FORM.name) == "diehl2016"
}

/// Return the micromodulus (N/m⁶) of Diehl & Schweitzer 2016, eq. 15, for an untruncated family: 9K/(δ Σ V).
/// The division by δ compensates the factor δ in the influence function δ/|ξ|.
fn printed_micromodulus(given: &Given) -> f64 {
    let volume = match given.dimension {
        Dimension::Space => 4.0 / 3.0 * PI * given.horizon.powi(3),
        _ => PI * given.horizon.powi(2) * given.dimension.out_of_plane_measure(),
    };
    9.0 * given.elastic.bulk_modulus() / (volume * given.horizon)
}

/// Return the critical stretch for a fracture energy (J/m²). For `form = "diehl2016"` in 2-D, the critical
/// stretch follows from eq. 16–17 of Diehl & Schweitzer 2016. For this form in 3-D, it follows from the
/// energy of all bonds across a plane. For `form = "energy"`, the result is the critical stretch of `pmb`.
fn critical_stretch(given: &Given, energy: f64) -> f64 {
    if !as_printed(given) {
        return bond_based_critical_stretch(given, energy);
    }
    let horizon = given.horizon;
    let c = printed_micromodulus(given) * horizon;
    match given.dimension {
        Dimension::Space => (8.0 * energy / (PI * c * horizon.powi(4))).sqrt(),
        dimension => {
            (1.5 * energy / (c * dimension.out_of_plane_measure() * horizon.powi(3))).sqrt()
        }
    }
}

impl Normalised {
    /// Create the law with the classical energy density W₁. W₁ is computed for the Poisson ratio of
    /// bond-based laws.
    pub(super) fn classical(given: &Given) -> Self {
        Self {
            energy: Pmb::isotropic_energy(given.dimension, given.elastic.youngs_modulus),
            reference: given
                .from_fracture_energy
                .then(|| Pmb::of(given).micromodulus),
        }
    }
}

impl Described for Normalised {
    fn described(&self) -> Vec<(&'static str, Property)> {
        vec![("micromodulus", Property::Text("of each point's own family"))]
    }
}

impl<const D: usize> Law<D> for Normalised {
    /// The number of a point is 1/Σ ω|ξ| Ṽ (1/m⁴). The influence function ω is 1 for `form = "energy"`.
    type Point = [Lanes; 1];
    type BondHistory = [Lanes; 0];
    /// Σ ω|ξ| Ṽ, m⁴.
    type ReferenceSum = [Lanes; 1];
    type Sum = [Lanes; 0];
    type Force = Along;
    const CONSTANTS: usize = 1;
    const SCALED: bool = true;

    #[inline(always)]
    fn reference_contribution(&self, bond: &Bond<D>) -> [Lanes; 1] {
        [bond.length]
    }

    fn constants(&self, sums: &[f64], numbers: &mut [f64]) {
        numbers[0] = if sums[0] > 0.0 { 1.0 / sums[0] } else { 0.0 };
    }

    #[inline(always)]
    fn force_state(&self, bond: &Bond<D>, [inverse]: &[Lanes; 1], _: &[Lanes; 0]) -> Along {
        Along(bond.extension_over_deformed * *inverse * (bond.inverse * (2.0 * self.energy)))
    }

    #[inline(always)]
    fn bond_energy(&self, bond: &Bond<D>, [inverse]: &[Lanes; 1], _: &[Lanes; 0]) -> Lanes {
        bond.stretch * bond.stretch * bond.length * *inverse * self.energy
    }

    #[inline(always)]
    fn stiffness(&self, bond: &Bond<D>, [inverse]: &[Lanes; 1]) -> Lanes {
        *inverse * (2.0 * self.energy) / bond.length
    }

    #[inline(always)]
    fn toughness_scale(&self, _: &Bond<D>, [here, there]: [&[Lanes; 1]; 2], other: &Self) -> Lanes {
        let (Some(reference), Some(other_reference)) = (self.reference, other.reference) else {
            return Lanes::splat(1.0);
        };
        let micromodulus = here[0] * (2.0 * self.energy) + there[0] * (2.0 * other.energy);
        (Lanes::splat(0.5 * (reference + other_reference)) / micromodulus).sqrt()
    }
}
