//! A bond breaks for good when the work of its force states reaches w_c, by default only when it is pulled.
//!
//! Foster, Silling & Chen 2011; Willberg, Hesse & Heinecke 2022, eq. 16–18. The work that a linear bond
//! has taken is w = ½ (T_i⟨ξ⟩ − T_j⟨−ξ⟩)·η. All bonds across a unit area take G0 together: in the plane
//! 2h ∫₀^δ ∫_z^δ ∫₀^{acos(z/ξ)} w_c ξ dφ dξ dz = (2/3) h δ³ w_c.

use std::f64::consts::PI;

use super::WorkRule;
use crate::dimension::Dimension;

/// How w_c follows from the fracture energy.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Calibration {
    /// So that all bonds across a unit area take it.
    Energy,
    /// So that opening a crack costs it: as [`Self::Energy`], over the share of the fracture energy that opening costs
    /// then. It is measured before a run, by [`crate::solver::calibration::calibrated`].
    Opening(Option<f64>),
    /// As Willberg et al. 2022 print it in eq. 16 and 18: their w has no ½, and in the plane their w_c
    /// is 3G0/(πδ³h). Their w is the work on η, so that it holds for small rotations only.
    Willberg2022,
    /// As PeriLab computes it: a bond breaks at ¼ |(T_i − T_j)·η| = 3G0/(πδ³h) in the plane and 4G0/(πδ⁴) in space.
    PeriLab,
    /// As Peridigm computed it in the plane in 2021, before π was in: ¼ (|T_i·η| + |T_j·η|) = 3G0/(δ³h).
    Peridigm2021,
}

/// The law with its constants.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BondEnergy {
    /// w_c, J/m⁶.
    pub critical: f64,
    /// α.
    pub alpha: f64,
    /// The critical stretch s0 that belongs to the same fracture energy, which α acts on.
    pub stretch: f64,
    /// How the work of bonds is looked at.
    pub rule: WorkRule,
}

impl Calibration {
    /// Whether the formula of the source exists in this dimension.
    pub fn is_for(self, dimension: usize) -> bool {
        match self {
            Self::Energy | Self::Opening(_) | Self::Willberg2022 => true,
            Self::PeriLab => dimension > 1,
            Self::Peridigm2021 => dimension == 2,
        }
    }

    /// The share of the fracture energy that a unit area costs.
    pub fn share(self, dimension: Dimension) -> f64 {
        use Dimension::{Line, PlaneStrain, PlaneStress, Space};
        match (self, dimension) {
            (Self::Energy | Self::Opening(None), _) => 1.0,
            (Self::Opening(Some(cost)), _) => 1.0 / cost,
            (Self::Willberg2022, PlaneStress { .. } | PlaneStrain { .. }) => 1.0 / PI,
            (Self::Willberg2022, Space | Line { .. }) => 0.5,
            (Self::PeriLab, PlaneStress { .. } | PlaneStrain { .. }) => 4.0 / PI,
            (Self::PeriLab, Space | Line { .. }) => 2.0,
            (Self::Peridigm2021, _) => 4.0,
        }
    }
}

impl BondEnergy {
    /// w_c (J/m⁶) from what a unit area costs, G0 (J/m²), and the horizon δ (m): 3-D 4G0/(πδ⁴), in the
    /// plane 3G0/(2δ³h), 1-D 2G0/(δ²A).
    pub fn from_energy(dimension: Dimension, energy: f64, horizon: f64) -> f64 {
        use Dimension::{Line, PlaneStrain, PlaneStress, Space};
        energy
            * match dimension {
                Space => 4.0 / (PI * horizon.powi(4)),
                PlaneStress { thickness } | PlaneStrain { thickness } => {
                    1.5 / (horizon.powi(3) * thickness)
                }
                Line { cross_section, .. } => 2.0 / (horizon.powi(2) * cross_section),
            }
    }

    /// The threshold (J/m⁶) of a point with this strength f, 1 without scatter, whose intact bonds have this smallest
    /// stretch: that of a stretch f s0 − α s_min in place of s0.
    #[inline(always)]
    pub fn threshold(&self, strength: f64, smallest: f64) -> f64 {
        let share = (strength - self.alpha * smallest / self.stretch).max(0.0);
        self.critical * share * share
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::damage::{Sense, WorkMeasure};
    use crate::dimension::Constraint;

    /// All bonds across a unit area, by the midpoint rule, over the fracture energy.
    fn taken(dimension: Dimension) -> f64 {
        let (horizon, energy, cells) = (3e-3, 135.0, 1500_u32);
        let critical = BondEnergy::from_energy(dimension, energy, horizon);
        let step = horizon / f64::from(cells);
        let middle = |k: u32| (f64::from(k) + 0.5) * step;
        let mut sum = 0.0;
        for i in 0..cells {
            let z = middle(i);
            for j in i + 1..cells {
                let r = middle(j);
                sum += match dimension {
                    // The cap of directions that cross.
                    Dimension::Space => 2.0 * PI * (1.0 - z / r) * r * r,
                    Dimension::PlaneStress { thickness } | Dimension::PlaneStrain { thickness } => {
                        2.0 * libm::acos(z / r) * r * thickness
                    }
                    Dimension::Line { cross_section, .. } => cross_section,
                };
            }
        }
        sum * critical * step * step / energy
    }

    #[test]
    fn all_bonds_across_an_area_take_the_fracture_energy() {
        for dimension in [
            Dimension::Space,
            Dimension::PlaneStress { thickness: 0.01 },
            Dimension::PlaneStrain { thickness: 0.2 },
            Dimension::Line {
                cross_section: 0.3,
                constraint: Constraint::UniaxialStress,
            },
        ] {
            let taken = taken(dimension);
            assert!((taken - 1.0).abs() < 2e-3, "{dimension:?}: {taken}");
        }
    }

    #[test]
    fn as_printed_bonds_are_weaker() {
        // Eq. 18, 3G0/(πδ³h), of a work without the ½ of eq. 16.
        let (energy, horizon, thickness) = (135.0, 3e-3, 0.01);
        let printed = 3.0 * energy / (PI * horizon * horizon * horizon * thickness);
        let plane = Dimension::PlaneStress { thickness };
        let share = Calibration::Willberg2022.share(plane);
        let critical = BondEnergy::from_energy(plane, share * energy, horizon);
        assert!((critical / (0.5 * printed) - 1.0).abs() < 1e-15);
    }

    #[test]
    fn alpha_acts_as_on_the_critical_stretch() {
        let law = BondEnergy {
            critical: 4.0,
            alpha: 0.5,
            stretch: 0.02,
            rule: WorkRule {
                sense: Sense::Pulled,
                family_correction: 0.0,
                measure: WorkMeasure::Objective,
            },
        };
        // s0 − α s_min = 0.03 is 1.5 s0.
        assert!((law.threshold(1.0, -0.02) - 9.0).abs() < 1e-12);
        // The work grows with the square of the strength.
        assert!((law.threshold(0.5, 0.0) - 0.25 * law.critical).abs() < 1e-12);
    }
}
