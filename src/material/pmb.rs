//! Prototype microelastic material. A bond exerts the force density f = c s Y/|Y| on point i, per volume of
//! point j. Here c is the micromodulus, and s is the stretch of the bond. The force state of each end is half
//! of f. The energy of the bond is w = c s² |ξ|/2 (J/m⁶).
//!
//! Silling & Askari 2005; Diehl & Schweitzer 2016, eq. 4–5; Dipasquale et al. 2014, eq. 2 and 6. The
//! micromodulus c gives the body the classical strain energy under isotropic expansion. Without failure, the
//! law is the proportional microelastic material of Emmrich & Weckner 2006, eq. 9.

use std::f64::consts::PI;

use super::bond::Weights;
use super::declaration::bond_based_critical_stretch;
use super::{
    Along, Bond, Built, Declaration, Declared, Described, Given, Key, Kind, Law, Normalised,
    Property, SurfacePmb, Word,
};
use crate::dimension::{Constraint, Dimension};
use crate::lanes::{Lanes, Simd};

/// The prototype microelastic material. Its only constant is the micromodulus.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pmb {
    /// Micromodulus c, N/m⁶.
    pub micromodulus: f64,
}

impl Pmb {
    /// Create the law from Young's modulus E (Pa) and the horizon δ (m). In the table, h is the thickness
    /// (m), and A is the cross-section (m²).
    ///
    /// | dimension | c | source |
    /// |---|---|---|
    /// | 3-D | 12E/(πδ⁴) = 18K/(πδ⁴) | |
    /// | plane stress, ν = 1/3 | 6E/(πδ³(1−ν)h) = 9E/(πδ³h) | Dipasquale et al., eq. 4 |
    /// | plane strain | 48E/(5πδ³h) | Emmrich & Weckner 2006, eq. 10 |
    /// | 1-D, uniaxial stress | 2E/(δ²A) | |
    /// | 1-D, uniaxial strain | 2(λ + 2G)/(δ²A) = 12E/(5δ²A) | |
    pub fn new(dimension: Dimension, youngs_modulus: f64, horizon: f64) -> Self {
        let factor = match dimension {
            Dimension::Space => 12.0 / (PI * horizon.powi(4)),
            Dimension::PlaneStress { thickness } => 9.0 / (PI * horizon.powi(3) * thickness),
            Dimension::PlaneStrain { thickness } => 48.0 / (5.0 * PI * horizon.powi(3) * thickness),
            Dimension::Line {
                cross_section,
                constraint,
            } => match constraint {
                Constraint::UniaxialStress => 2.0 / (horizon.powi(2) * cross_section),
                Constraint::UniaxialStrain => 12.0 / (5.0 * horizon.powi(2) * cross_section),
            },
        };
        Self {
            micromodulus: factor * youngs_modulus,
        }
    }

    /// Create the law of a body.
    pub fn of(given: &Given) -> Self {
        Self::new(given.dimension, given.elastic.youngs_modulus, given.horizon)
    }

    /// Return the classical energy density W₁ (J/m³) at unit isotropic stretch. Poisson's ratio ν is that of
    /// bond-based laws.
    ///
    /// W₁ is 9K/2 = 3E in 3-D, E/(1−ν) in plane stress and E/((1+ν)(1−2ν)) in plane strain. In 1-D, W₁ is E/2
    /// in uniaxial stress and (λ + 2G)/2 in uniaxial strain.
    pub fn isotropic_energy(dimension: Dimension, youngs_modulus: f64) -> f64 {
        youngs_modulus
            * match dimension {
                Dimension::Space => 3.0,
                Dimension::PlaneStress { .. } => 1.5,
                Dimension::PlaneStrain { .. } => 1.6,
                Dimension::Line { constraint, .. } => match constraint {
                    Constraint::UniaxialStress => 0.5,
                    Constraint::UniaxialStrain => 0.6,
                },
            }
    }
}

pub(super) const SURFACE_CORRECTION: Key = Key {
    name: "surface_correction",
    meaning: "surface correction of the micromodulus of each point, from its own family: none, \
              by strain energy, by strain energies along the axes, or by elastic tensor",
    kind: Kind::Word(&[
        Word::new("none"),
        Word::new("energy"),
        Word::new("directional"),
        Word::new("tensor"),
    ]),
};

impl Declared for Pmb {
    const DECLARATIONS: &'static [Declaration] = &[
        Declaration {
            keys: &[SURFACE_CORRECTION],
            breaks_by_energy: true,
            critical_stretch: Some(bond_based_critical_stretch),
            examples: &[
                "",
                "surface_correction = 'energy'",
                "surface_correction = 'directional'",
                "surface_correction = 'tensor'",
            ],
            ..Declaration::new("pmb", "prototype microelastic, f = c s e", build)
        },
        Declaration {
            keys: &[SURFACE_CORRECTION],
            ..Declaration::new("proportional", "as `pmb`", build)
        },
    ];
}

fn build(given: &Given) -> Built {
    match given.values.word(SURFACE_CORRECTION.name) {
        "none" => Built::plain(Pmb::of(given)),
        "energy" => Built::plain(Normalised::classical(given)),
        // In 1-D all bonds have the same direction. The other corrections would then equal `energy`, except
        // for their limits.
        _ if given.dimension.count() == 1 => Built::plain(Normalised::classical(given)),
        _ => Built::plain(SurfacePmb::of(given)),
    }
}

impl Described for Pmb {
    fn described(&self) -> Vec<(&'static str, Property)> {
        vec![("micromodulus", Property::Number(self.micromodulus, "N/m⁶"))]
    }
}

impl<const D: usize> Law<D> for Pmb {
    type Point = [Lanes; 0];
    type BondHistory = [Lanes; 0];
    type ReferenceSum = [Lanes; 0];
    type Sum = [Lanes; 0];
    type Force = Along;

    #[inline(always)]
    fn force_state(&self, bond: &Bond<D>, _: &[Lanes; 0], _: &[Lanes; 0]) -> Along {
        Along(bond.extension_over_deformed * (bond.inverse * (0.5 * self.micromodulus)))
    }

    #[inline(always)]
    fn bond_force<S: Simd>(
        _: S,
        laws: &[Self; 2],
        bond: &Bond<D>,
        _: [&[Lanes; 0]; 2],
        _: &[[Lanes; 0]; 2],
        weights: Weights,
    ) -> Along {
        let half = |end: usize| Lanes::splat(0.5 * laws[end].micromodulus);
        Along(bond.extension_over_deformed * (bond.inverse * weights.sum(half(0), half(1))))
    }

    #[inline(always)]
    fn bond_energy(&self, bond: &Bond<D>, _: &[Lanes; 0], _: &[Lanes; 0]) -> Lanes {
        bond.stretch * bond.stretch * bond.length * (0.25 * self.micromodulus)
    }

    #[inline(always)]
    fn stiffness(&self, bond: &Bond<D>, _: &[Lanes; 0]) -> Lanes {
        Lanes::splat(0.5 * self.micromodulus) / bond.length
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Return the energy density ½ ∫ w dV of an untruncated family at isotropic strain ε. It is equal to
    /// ¼ c ε² ∫ |ξ| dV.
    fn energy_density(dimension: Dimension, horizon: f64, strain: f64) -> f64 {
        let c = Pmb::new(dimension, 1.0, horizon).micromodulus;
        let moment = match dimension {
            Dimension::Space => PI * horizon.powi(4),
            Dimension::PlaneStress { thickness } | Dimension::PlaneStrain { thickness } => {
                2.0 / 3.0 * PI * horizon.powi(3) * thickness
            }
            Dimension::Line { cross_section, .. } => horizon.powi(2) * cross_section,
        };
        c * strain * strain * moment / 4.0
    }

    #[test]
    fn the_classical_energy_under_isotropic_strain() {
        let strain = 1e-3_f64;
        for dimension in [
            Dimension::PlaneStress { thickness: 0.1 },
            Dimension::PlaneStrain { thickness: 0.1 },
            Dimension::Space,
            Dimension::Line {
                cross_section: 0.2,
                constraint: Constraint::UniaxialStress,
            },
            Dimension::Line {
                cross_section: 0.2,
                constraint: Constraint::UniaxialStrain,
            },
        ] {
            let expected = Pmb::isotropic_energy(dimension, 1.0) * strain * strain;
            let found = energy_density(dimension, 0.03, strain);
            assert!(
                (found / expected - 1.0).abs() < 1e-12,
                "{dimension:?}: {found} {expected}"
            );
        }
    }
}
