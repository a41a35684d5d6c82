//! Stretch criterion: a bond breaks irreversibly when its stretch reaches f s0 − α s_min.
//!
//! Silling & Askari 2005; Diehl & Schweitzer 2016, eq. 5. s0 is the critical stretch. s_min is the smallest
//! stretch of the intact bonds of a point. f is the strength factor of the point, 1 without scatter. If
//! points i and j of a bond have the same law, modulus and horizon, or if the deck gives both critical
//! stretches, the smaller of the two thresholds holds for the bond. Both ends then use the same threshold.
//! Otherwise,
//! [`StretchConversion`](crate::damage::StretchConversion) computes the threshold of the bond from the two
//! thresholds. With α = 0, the criterion is the plain critical stretch of Dipasquale et al. 2014, eq. 6.
//! [`Criterion::breaking`](crate::damage::Criterion::breaking) tests the criterion.

use std::f64::consts::PI;

use crate::dimension::{Constraint, Dimension};
use crate::elastic::Isotropic;
use crate::material::{Influence, Ordinary};

use super::pull_apart::pull_apart;

/// The constants of the criterion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CriticalStretch {
    /// Critical stretch s0.
    pub critical: f64,
    /// Factor α of s_min in the threshold f s0 − α s_min of a point.
    pub alpha: f64,
}

impl CriticalStretch {
    /// Return s0 from the fracture energy G0 (J/m²) and the horizon δ (m). The formulas hold for the Poisson
    /// ratio of bond-based laws. In the table, K is the bulk modulus (Pa), E is Young's modulus (Pa), c is
    /// the micromodulus of `pmb`, and A is the cross-section (m²).
    ///
    /// | dimension | s0 | source |
    /// |---|---|---|
    /// | 3-D | √(5G0/(9Kδ)) | |
    /// | plane stress | √(4πG0/(9Eδ)) | Dipasquale et al., eq. 5 |
    /// | plane strain | √(5πG0/(12Eδ)) | |
    /// | 1-D, uniaxial stress | √(3G0/(Eδ)) | G0 = A ∫₀^δ ∫_z^δ ½ c s0² r dr dz = c A s0² δ³/6 |
    /// | 1-D, uniaxial strain | √(5G0/(2Eδ)) | same |
    pub fn from_energy(dimension: Dimension, elastic: Isotropic, energy: f64, horizon: f64) -> f64 {
        let factor = match dimension {
            Dimension::Space => 5.0 / (9.0 * elastic.bulk_modulus()),
            Dimension::PlaneStress { .. } => 4.0 * PI / (9.0 * elastic.youngs_modulus),
            Dimension::PlaneStrain { .. } => 5.0 * PI / (12.0 * elastic.youngs_modulus),
            Dimension::Line { constraint, .. } => match constraint {
                Constraint::UniaxialStress => 3.0 / elastic.youngs_modulus,
                Constraint::UniaxialStrain => 5.0 / (2.0 * elastic.youngs_modulus),
            },
        };
        (factor * energy / horizon).sqrt()
    }

    /// Return s0 of an ordinary state-based law from the fracture energy G0 (J/m²) and the horizon δ (m).
    /// If the bonds of a body break at this stretch, pulling the body apart dissipates G0 per area.
    pub fn from_energy_ordinary(
        law: &Ordinary,
        influence: Influence,
        energy: f64,
        horizon: f64,
    ) -> f64 {
        let dimension = law.dimension() as i32;
        let [bonds, points] = pull_apart(dimension, influence);
        let cost = law.extensional() * bonds + law.volumetric() * points;
        (energy / (cost * horizon)).sqrt()
    }

    /// Return the fracture energy G0 = K_Ic²/E′ (J/m²) for a fracture toughness K_Ic (Pa·√m) (Irwin). E′ is E
    /// in plane stress and uniaxial stress, and E/(1−ν²) otherwise.
    pub fn energy_from_toughness(dimension: Dimension, elastic: Isotropic, toughness: f64) -> f64 {
        let effective = match dimension {
            Dimension::PlaneStress { .. }
            | Dimension::Line {
                constraint: Constraint::UniaxialStress,
                ..
            } => elastic.youngs_modulus,
            _ => elastic.youngs_modulus / (1.0 - elastic.poisson_ratio.powi(2)),
        };
        toughness * toughness / effective
    }

    /// Return the critical stretch of bonds between two bodies whose interface opens at a normal stress σ
    /// (Pa).
    ///
    /// Under a tension σ normal to the interface, each body has the normal strain σ/E′, with the modulus E′
    /// below. The result is the mean of the strains of the two bodies. At this tension, a bond along the
    /// normal has this stretch if half of the bond lies in each body.
    ///
    /// E′ is:
    ///
    /// - E in 3-D, in plane stress and under uniaxial stress;
    /// - E/(1−ν²) in plane strain;
    /// - E(1−ν)/((1+ν)(1−2ν)) under uniaxial strain.
    pub fn from_strength(dimension: Dimension, bodies: [Isotropic; 2], strength: f64) -> f64 {
        let [a, b] = bodies.map(|elastic| strength / Self::tensile_modulus(dimension, elastic));
        0.5 * (a + b)
    }

    /// Return the ratio of stress to strain in tension along one direction, Pa. The transverse stresses are
    /// 0, except in directions without strain (plane strain and uniaxial strain).
    pub fn tensile_modulus(dimension: Dimension, elastic: Isotropic) -> f64 {
        let (modulus, nu) = (elastic.youngs_modulus, elastic.poisson_ratio);
        match dimension {
            Dimension::Space
            | Dimension::PlaneStress { .. }
            | Dimension::Line {
                constraint: Constraint::UniaxialStress,
                ..
            } => modulus,
            Dimension::PlaneStrain { .. } => modulus / (1.0 - nu * nu),
            Dimension::Line {
                constraint: Constraint::UniaxialStrain,
                ..
            } => modulus * (1.0 - nu) / ((1.0 + nu) * (1.0 - 2.0 * nu)),
        }
    }

    /// Return the threshold f s0 − α s_min of a point, from its strength factor f and the smallest stretch
    /// s_min of its intact bonds. Without scatter f = 1.
    #[inline(always)]
    pub fn threshold(&self, strength_factor: f64, smallest: f64) -> f64 {
        strength_factor * self.critical - self.alpha * smallest
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn toughness_and_energy_agree_in_three_dimensions() {
        // Diehl & Schweitzer's formula: s0 = (5√2/12) K_Ic / (K √δ).
        let alon = Isotropic {
            youngs_modulus: 1.5 * 210e9,
            poisson_ratio: 0.25,
        };
        let (toughness, horizon) = (2e6, 1.5e-3_f64);
        let energy = CriticalStretch::energy_from_toughness(Dimension::Space, alon, toughness);
        let found = CriticalStretch::from_energy(Dimension::Space, alon, energy, horizon);
        let expected = 5.0 * 2_f64.sqrt() / 12.0 * toughness / (210e9 * horizon.sqrt());
        assert!((found / expected - 1.0).abs() < 1e-12);
    }

    #[test]
    fn the_ordinary_law_has_the_stretch_of_the_bond_based_one() {
        for dimension in [
            Dimension::Space,
            Dimension::PlaneStress { thickness: 0.1 },
            Dimension::PlaneStrain { thickness: 0.1 },
        ] {
            let elastic = Isotropic {
                youngs_modulus: 3e9,
                poisson_ratio: dimension.bond_based_poisson_ratio(),
            };
            let expected = CriticalStretch::from_energy(dimension, elastic, 50.0, 0.002);
            let law = Ordinary::new(dimension, elastic, 1.0).unwrap();
            let influence = Influence::Inverse;
            let found = CriticalStretch::from_energy_ordinary(&law, influence, 50.0, 0.002);
            assert!((found / expected - 1.0).abs() < 1e-9, "{dimension:?}");
        }
    }

    #[test]
    fn all_bonds_across_a_line_cost_the_fracture_energy() {
        // Plane stress with the thickness h = 1, per area of the crack: 2h ∫₀^δ ∫_z^δ ∫₀^{acos(z/ξ)} w ξ dφ
        // dξ dz with w = c s0² ξ / 2, by the midpoint rule.
        let glass = Isotropic {
            youngs_modulus: 72e9,
            poisson_ratio: 1.0 / 3.0,
        };
        let (energy, horizon, cells) = (135.0, 3e-3, 1000);
        let dimension = Dimension::PlaneStress { thickness: 1.0 };
        let critical = CriticalStretch::from_energy(dimension, glass, energy, horizon);
        let c = crate::material::Pmb::new(dimension, 72e9, horizon).micromodulus;
        let step = horizon / f64::from(cells);
        let mut sum = 0.0;
        for i in 0..cells {
            let z = (f64::from(i) + 0.5) * step;
            for j in i + 1..cells {
                let xi = (f64::from(j) + 0.5) * step;
                sum += 0.5 * c * critical.powi(2) * xi * xi * libm::acos(z / xi) * step * step;
            }
        }
        assert!(
            (2.0 * sum / energy - 1.0).abs() < 2e-3,
            "{}",
            2.0 * sum / energy
        );
    }
}
