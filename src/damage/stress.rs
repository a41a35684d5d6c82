//! A bond breaks for good when the stress of its points reaches a strength.
//!
//! The stress is a measure of the Cauchy stress of a point, σ = P Fᵀ/det F, with the deformation gradient F of its family
//! and the stress across plane bodies. A bond compares the mean over its ends with the strength. The energy that a crack
//! takes then follows from strength and horizon.

use nalgebra::Matrix3;

use super::Sense;
use crate::component::Component;
use crate::material::eigenvalues;

/// Scalar measure of a Cauchy stress.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StressMeasure {
    /// √(3/2 s:s) of the deviator s.
    VonMises,
    /// The largest principal stress, positive in tension.
    Principal,
}

impl StressMeasure {
    /// All measures, in the order of [`Self::index`].
    pub const ALL: [Self; 2] = [Self::VonMises, Self::Principal];

    /// Its index in [`Self::ALL`].
    pub fn index(self) -> usize {
        match self {
            Self::VonMises => 0,
            Self::Principal => 1,
        }
    }

    /// Its name in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::VonMises => "von Mises stress",
            Self::Principal => "largest principal stress",
        }
    }

    /// The measure of a symmetric stress, in the unit of the stress.
    pub fn of(self, stress: &Matrix3<f64>) -> f64 {
        match self {
            Self::VonMises => {
                let entry = |(a, b)| stress[(a, b)];
                let entries = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)].map(entry);
                Component::VonMises.of(&entries)
            }
            Self::Principal => eigenvalues(stress).max(),
        }
    }
}

/// How the stress of points breaks bonds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StressRule {
    /// The measure that is compared with the strength.
    pub measure: StressMeasure,
    /// Which bonds break.
    pub sense: Sense,
}

impl StressRule {
    /// The rule of bonds between points with this and another rule of the same measure: a pressed bond breaks where both
    /// say so.
    pub fn of_both(self, other: Self) -> Self {
        Self {
            sense: self.sense.of_both(other.sense),
            ..self
        }
    }
}

/// The law with its constants.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StressLimit {
    /// The stress at which bonds break, Pa.
    pub strength: f64,
    /// How the stress is compared with it.
    pub rule: StressRule,
}

#[cfg(test)]
mod tests {
    use nalgebra::{Rotation3, Vector3};

    use super::*;

    fn measures(stress: &Matrix3<f64>) -> [f64; 2] {
        StressMeasure::ALL.map(|measure| measure.of(stress))
    }

    #[test]
    fn measures_of_known_states_do_not_change_under_rotation() {
        let tension = Matrix3::from_diagonal(&Vector3::new(0.0, 5.0, 0.0));
        let pressure = Matrix3::from_diagonal_element(-3.0);
        let mut shear = Matrix3::zeros();
        shear[(0, 1)] = 2.0;
        shear[(1, 0)] = 2.0;
        let turn = Rotation3::from_euler_angles(0.4, -1.1, 2.7).into_inner();
        for (stress, wanted) in [
            (tension, [5.0, 5.0]),
            (pressure, [0.0, -3.0]),
            (shear, [12_f64.sqrt(), 2.0]),
        ] {
            for stress in [stress, turn * stress * turn.transpose()] {
                for (found, wanted) in measures(&stress).into_iter().zip(wanted) {
                    assert!((found - wanted).abs() < 1e-14 * 5.0, "{found} {wanted}");
                }
            }
        }
        for (k, measure) in StressMeasure::ALL.into_iter().enumerate() {
            assert_eq!(measure.index(), k);
        }
    }
}
