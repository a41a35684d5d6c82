//! Thermal expansion of a material.

use super::{Action, Problem};
use crate::dimension::{Constraint, Dimension};
use crate::expression::Variable;

/// Thermal expansion of a material: the free stretch α (T − T₀) in all directions of space.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ThermalExpansion {
    /// Coefficient of thermal expansion α, 1/K.
    pub coefficient: f64,
    /// Reference temperature T₀, at which the undeformed material is free of stress, in the unit of
    /// prescribed temperatures.
    pub reference_temperature: f64,
}

impl ThermalExpansion {
    /// Return the free stretch per kelvin in the plane or along the bar, 1/K, for Poisson's ratio ν.
    ///
    /// If the strain perpendicular to the plane or bar is 0, the stress in this direction adds to the
    /// stretch. The free stretch per kelvin is then (1 + ν) α in plane strain, and (1 + ν)/(1 − ν) α under
    /// uniaxial strain. Otherwise, the free stretch per kelvin is α.
    pub fn free_stretch_per_kelvin(self, dimension: Dimension, poisson_ratio: f64) -> f64 {
        let factor = match dimension {
            Dimension::PlaneStrain { .. } => 1.0 + poisson_ratio,
            Dimension::Line {
                constraint: Constraint::UniaxialStrain,
                ..
            } => (1.0 + poisson_ratio) / (1.0 - poisson_ratio),
            Dimension::PlaneStress { .. } | Dimension::Line { .. } | Dimension::Space => 1.0,
        };
        self.coefficient * factor
    }
}

impl Problem {
    /// Test whether any condition prescribes temperatures.
    pub fn has_temperature(&self) -> bool {
        let mut actions = self.conditions.iter().map(|condition| &condition.action);
        actions.any(|action| matches!(action, Action::Temperature(_)))
    }

    /// Test whether prescribed temperatures change during a run. The energy balance does not contain the work
    /// of such changes.
    pub fn temperature_changes(&self) -> bool {
        let stages = self.all_stages();
        let acts_always = |index: usize| stages.iter().all(|stage| stage.acting[index]);
        let mut conditions = self.conditions.iter().enumerate();
        conditions.any(|(index, condition)| match &condition.action {
            Action::Temperature(value) => value.uses(Variable::T) || !acts_always(index),
            _ => false,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// With the free stretch, Hooke's law σ = λ tr ε I + 2G ε − 3K α ΔT I must give zero stress in the plane
    /// or along the bar. The strain perpendicular to the plane or bar is 0.
    #[test]
    fn the_stress_in_the_setting_is_zero() {
        let (lambda, shear) = (3.0, 2.0);
        let (poisson_ratio, bulk) = (
            lambda / (2.0 * (lambda + shear)),
            lambda + 2.0 / 3.0 * shear,
        );
        let expansion = ThermalExpansion {
            coefficient: 1e-5,
            reference_temperature: 20.0,
        };
        let plane = Dimension::PlaneStrain { thickness: 1.0 };
        let line = Dimension::Line {
            cross_section: 1.0,
            constraint: Constraint::UniaxialStrain,
        };
        for (dimension, directions) in [(plane, 2.0), (line, 1.0), (Dimension::Space, 3.0)] {
            let stretch = expansion.free_stretch_per_kelvin(dimension, poisson_ratio);
            let stress = (directions * lambda + 2.0 * shear) * stretch - 3.0 * bulk * 1e-5;
            assert!(stress.abs() < 1e-18, "{dimension:?}: {stress}");
        }
    }
}
