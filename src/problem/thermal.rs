//! Thermal expansion of a material.

use super::{Action, Problem};
use crate::dimension::{Constraint, Dimension};
use crate::expression::Variable;

/// Free expansion of a material: the stretch α (T − T₀) in all directions of space.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ThermalExpansion {
    /// α, 1/K.
    pub coefficient: f64,
    /// T₀, at which the material is free of stress.
    pub reference_temperature: f64,
}

impl ThermalExpansion {
    /// Free stretch per kelvin in the directions of a setting, 1/K, for Poisson's ratio ν.
    ///
    /// Where strain is 0 across these directions, the stress there adds to the free stretch: (1 + ν) α in plane strain,
    /// (1 + ν)/(1 − ν) α under uniaxial strain. Otherwise it is α.
    pub fn in_setting(self, dimension: Dimension, poisson_ratio: f64) -> f64 {
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
    /// Whether points have temperatures.
    pub fn has_temperature(&self) -> bool {
        let mut actions = self.conditions.iter().map(|condition| &condition.action);
        actions.any(|action| matches!(action, Action::Temperature(_)))
    }

    /// Whether temperatures change during a run. Their work is missing from the energy balance.
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

    /// Hooke's law: σ = λ tr ε I + 2G ε − 3K α ΔT I, without stress in the directions of the setting and without strain across.
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
            let stretch = expansion.in_setting(dimension, poisson_ratio);
            let stress = (directions * lambda + 2.0 * shear) * stretch - 3.0 * bulk * 1e-5;
            assert!(stress.abs() < 1e-18, "{dimension:?}: {stress}");
        }
    }
}
