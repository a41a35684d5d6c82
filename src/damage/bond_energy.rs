//! Energy criterion: a bond breaks irreversibly when the work of its force states reaches the critical work
//! w_c. By default only stretched bonds break.
//!
//! Foster, Silling & Chen 2011; Willberg, Hesse & Heinecke 2022, eq. 16–18. For force states that are linear
//! in η, the work is w = ½ (T_i⟨ξ⟩ − T_j⟨−ξ⟩)·η. Breaking all bonds across a unit area dissipates G0. In the
//! plane, with the thickness h, G0 = 2h ∫₀^δ ∫_z^δ ∫₀^{acos(z/ξ)} w_c ξ dφ dξ dz = (2/3) h δ³ w_c. In this
//! integral, z is the distance of point i from the crack, ξ is the length of the bond, and φ is the angle
//! between the bond and the normal of the crack.

use std::f64::consts::PI;

use super::WorkRule;
use crate::dimension::Dimension;

/// Formula for w_c from the fracture energy.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Calibration {
    /// Breaking all bonds across a unit area dissipates the fracture energy.
    Energy,
    /// Opening a crack dissipates the fracture energy. w_c is computed as for [`Self::Energy`], and then
    /// divided by the separation energy ratio. [`crate::solver::calibration::calibrated`] computes this ratio
    /// before a run; `None` until then.
    Opening(Option<f64>),
    /// Willberg et al. 2022, eq. 16 and 18, as printed: w has no factor ½, and in the plane w_c is
    /// 3G0/(πδ³h). This w is the work on η, and a rigid rotation changes η. Therefore the criterion holds for
    /// small rotations only.
    Willberg2022,
    /// PeriLab's formula: a bond breaks when ¼ |(T_i − T_j)·η| is 3G0/(πδ³h) in the plane, or 4G0/(πδ⁴) in
    /// space.
    PeriLab,
    /// Peridigm's formula of 2021 for the plane: a bond breaks when ¼ (|T_i·η| + |T_j·η|) is 3G0/(δ³h). This
    /// value lacks the factor 1/π of PeriLab's value.
    Peridigm2021,
}

/// The constants of the criterion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BondEnergy {
    /// Critical work w_c, J/m⁶.
    pub critical: f64,
    /// Factor α in the threshold of a point, see [`Self::threshold`]. α multiplies the smallest stretch s_min
    /// of the point's intact bonds.
    pub alpha: f64,
    /// Critical stretch s0 for the same fracture energy as w_c; the threshold depends on α s_min/s0.
    pub stretch: f64,
    /// Rule for breaking bonds by their work.
    pub rule: WorkRule,
}

impl Calibration {
    /// Whether this formula is defined in `dimension` dimensions.
    pub fn is_for(self, dimension: usize) -> bool {
        match self {
            Self::Energy | Self::Opening(_) | Self::Willberg2022 => true,
            Self::PeriLab => dimension > 1,
            Self::Peridigm2021 => dimension == 2,
        }
    }

    /// Return the energy dissipated by breaking all bonds across a unit area, divided by the fracture energy.
    pub fn energy_ratio(self, dimension: Dimension) -> f64 {
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
    /// Return w_c (J/m⁶) from the energy per area G0 (J/m²) and the horizon δ (m). w_c is 4G0/(πδ⁴) in 3-D,
    /// 3G0/(2δ³h) in the plane, and 2G0/(δ²A) in 1-D, with the thickness h (m) and the cross-section A (m²).
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

    /// Return the threshold (J/m⁶) of a point, from its strength factor f and the smallest stretch s_min of
    /// its intact bonds. The threshold is w_c ((f s0 − α s_min)/s0)², or 0 if f s0 < α s_min. Without scatter
    /// f = 1.
    #[inline(always)]
    pub fn threshold(&self, strength_factor: f64, smallest: f64) -> f64 {
        let share = (strength_factor - self.alpha * smallest / self.stretch).max(0.0);
        self.critical * share * share
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::damage::{BreakableBonds, WorkMeasure};
    use crate::dimension::Constraint;

    /// Return the energy of breaking all bonds across a unit area, divided by the fracture energy. The energy
    /// is integrated by the midpoint rule.
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
                    // Solid angle of the directions that cross the plane, times r².
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
        // Eq. 18, 3G0/(πδ³h), belongs to the work of eq. 16, which has no factor ½.
        let (energy, horizon, thickness) = (135.0, 3e-3, 0.01);
        let printed = 3.0 * energy / (PI * horizon * horizon * horizon * thickness);
        let plane = Dimension::PlaneStress { thickness };
        let ratio = Calibration::Willberg2022.energy_ratio(plane);
        let critical = BondEnergy::from_energy(plane, ratio * energy, horizon);
        assert!((critical / (0.5 * printed) - 1.0).abs() < 1e-15);
    }

    #[test]
    fn alpha_acts_as_on_the_critical_stretch() {
        let law = BondEnergy {
            critical: 4.0,
            alpha: 0.5,
            stretch: 0.02,
            rule: WorkRule {
                breakable: BreakableBonds::Stretched,
                family_correction: 0.0,
                measure: WorkMeasure::Objective,
            },
        };
        // s0 − α s_min = 0.03 is 1.5 s0.
        assert!((law.threshold(1.0, -0.02) - 9.0).abs() < 1e-12);
        // The threshold is proportional to the square of the strength.
        assert!((law.threshold(0.5, 0.0) - 0.25 * law.critical).abs() < 1e-12);
    }
}
