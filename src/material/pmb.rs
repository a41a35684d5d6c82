//! Prototype microelastic material: f = c s e, w = c s² |ξ| / 2.
//!
//! Silling & Askari 2005; Diehl & Schweitzer 2016, eq. 4–5; Dipasquale et al. 2014, eq. 2 and 6.
//! The micromodulus c follows from equal strain energy under isotropic expansion.

use std::f64::consts::PI;

use super::{Bond, BondLaw, Lanes};
use crate::dimension::Dimension;

/// The law with its only constant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pmb {
    /// c, N/m⁶.
    pub micromodulus: f64,
}

impl Pmb {
    /// From Young's modulus E (Pa) and the horizon δ (m).
    ///
    /// 3-D: 12E/(πδ⁴) = 18K/(πδ⁴). Plane stress, ν = 1/3: 6E/(πδ³(1−ν)h) = 9E/(πδ³h), Dipasquale
    /// et al. eq. 4. Plane strain: 48E/(5πδ³h), Emmrich & Weckner 2006, eq. 10. 1-D: 12E/(5δ²A).
    pub fn new(dimension: Dimension, youngs_modulus: f64, horizon: f64) -> Self {
        let factor = match dimension {
            Dimension::Space => 12.0 / (PI * horizon.powi(4)),
            Dimension::PlaneStress { thickness } => 9.0 / (PI * horizon.powi(3) * thickness),
            Dimension::PlaneStrain { thickness } => 48.0 / (5.0 * PI * horizon.powi(3) * thickness),
            Dimension::Line { cross_section } => 12.0 / (5.0 * horizon.powi(2) * cross_section),
        };
        Self {
            micromodulus: factor * youngs_modulus,
        }
    }
}

impl BondLaw for Pmb {
    #[inline(always)]
    fn force(&self, bond: &Bond) -> Lanes {
        bond.stretch * self.micromodulus
    }

    #[inline(always)]
    fn energy(&self, bond: &Bond) -> Lanes {
        bond.stretch * bond.stretch * bond.length * (0.5 * self.micromodulus)
    }

    #[inline(always)]
    fn stiffness(&self, length: Lanes) -> Lanes {
        Lanes::splat(self.micromodulus) / length
    }

    /// The average: each end exerts half of the force with its own constant.
    fn between(&self, other: &Self) -> Self {
        Self {
            micromodulus: 0.5 * (self.micromodulus + other.micromodulus),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// ½ ∫ w dV over the full horizon at isotropic strain ε: c ε² times ∫ |ξ| dV / 4.
    fn energy_density(dimension: Dimension, horizon: f64, strain: f64) -> f64 {
        let c = Pmb::new(dimension, 1.0, horizon).micromodulus;
        let moment = match dimension {
            Dimension::Space => PI * horizon.powi(4),
            Dimension::PlaneStress { thickness } | Dimension::PlaneStrain { thickness } => {
                2.0 / 3.0 * PI * horizon.powi(3) * thickness
            }
            Dimension::Line { cross_section } => horizon.powi(2) * cross_section,
        };
        c * strain * strain * moment / 4.0
    }

    #[test]
    fn the_classical_energy_under_isotropic_strain() {
        let strain = 1e-3_f64;
        let square = strain * strain;
        // Plane stress E ε²/(1−ν), plane strain E ε²/((1+ν)(1−2ν)), 3-D 9Kε²/2, all with E = 1.
        let cases = [
            (Dimension::PlaneStress { thickness: 0.1 }, 1.5 * square),
            (Dimension::PlaneStrain { thickness: 0.1 }, 1.6 * square),
            (Dimension::Space, 3.0 * square),
            // Uniaxial strain: (λ + 2G) ε²/2 = 1.2 E ε²/2.
            (Dimension::Line { cross_section: 0.2 }, 0.6 * square),
        ];
        for (dimension, expected) in cases {
            let found = energy_density(dimension, 0.03, strain);
            assert!(
                (found / expected - 1.0).abs() < 1e-12,
                "{dimension:?}: {found} {expected}"
            );
        }
    }

    #[test]
    fn the_force_is_the_derivative_of_the_potential() {
        let law = Pmb { micromodulus: 3.0 };
        let at = |deformed: f64| Bond {
            length: Lanes::splat(2.0),
            stretch: Lanes::splat((deformed - 2.0) / 2.0),
        };
        let step = 1e-6;
        let slope =
            (law.energy(&at(2.1 + step)).0[0] - law.energy(&at(2.1 - step)).0[0]) / (2.0 * step);
        assert!((law.force(&at(2.1)).0[0] - slope).abs() < 1e-8);
        let stiffness = law.force(&at(2.0 + step)).0[0] / step;
        assert!((law.stiffness(Lanes::splat(2.0)).0[0] - stiffness).abs() < 1e-8);
    }
}
