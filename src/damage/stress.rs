//! Stress criterion: a bond breaks irreversibly when the mean of the stress measures at its ends reaches a
//! strength.
//!
//! The criterion reads a scalar measure of the Cauchy stress σ = P Fᵀ/det F of a point. P is the first
//! Piola–Kirchhoff stress of the point, and F is the deformation gradient of its family. In plane problems, σ
//! and det F include the direction perpendicular to the plane. The strength is compared with the mean of the
//! measures at the ends that act on the bond. Strength and horizon determine the energy per area that a
//! growing crack dissipates.

use nalgebra::Matrix3;

use super::BreakableBonds;
use crate::component::Component;
use crate::lanes::simd::Task;
use crate::lanes::{Lanes, Simd};
use crate::material::eigenvalues;

/// Scalar measure of a Cauchy stress.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StressMeasure {
    /// Von Mises stress √(3/2 s:s), with the deviator s.
    VonMises,
    /// Largest principal stress, positive in tension.
    Principal,
}

impl StressMeasure {
    /// All measures, in the order of [`Self::index`].
    pub const ALL: [Self; 2] = [Self::VonMises, Self::Principal];

    /// Index of the measure in [`Self::ALL`].
    pub fn index(self) -> usize {
        match self {
            Self::VonMises => 0,
            Self::Principal => 1,
        }
    }

    /// Name of the measure in reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::VonMises => "von Mises stress",
            Self::Principal => "largest principal stress",
        }
    }

    /// Compute the measure of a symmetric stress tensor, in the unit of the tensor.
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

/// Rule for bonds that break by the stress of their points.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StressRule {
    /// Measure of the stress that is compared with the strength.
    pub measure: StressMeasure,
    /// Bonds that can break: stretched bonds only, or compressed bonds too.
    pub breakable: BreakableBonds,
}

impl StressRule {
    /// Return the rule for the bonds between two blocks, from the rules of both blocks. Both rules must have
    /// the same measure. Compressed bonds break only if both rules allow it.
    pub fn of_both(self, other: Self) -> Self {
        Self {
            breakable: self.breakable.of_both(other.breakable),
            ..self
        }
    }
}

/// The constants of the criterion.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StressLimit {
    /// Strength: stress at which bonds break, Pa.
    pub strength: f64,
    /// Stress measure that is compared with the strength, and kinds of bonds that can break.
    pub rule: StressRule,
}

/// Computation of the mean stress measure of each bond, Pa. An end counts in the mean if its point carries
/// stress and the bond is within the horizon of this point. The result also has one bit per bond, set if at
/// least one end counts. The result does not change if points i and j are exchanged.
pub(super) struct MeanStress {
    stresses: [Lanes; 2],
    acting: [u8; 2],
}

impl MeanStress {
    /// Copy the stress measures of points i and j (Pa), and two masks of bonds: the bonds within the horizon
    /// of point i, and the bonds within the horizon of point j.
    #[inline(always)]
    pub(super) fn new<S: Simd>(simd: S, [i, j]: [Lanes; 2], acting: [u8; 2]) -> Self {
        Self {
            stresses: [simd.opaque(i), simd.opaque(j)],
            acting,
        }
    }
}

impl Task for MeanStress {
    type Output = (Lanes, u8);

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> (Lanes, u8) {
        let [i, j] = self.stresses;
        let acts_i = self.acting[0] & i.above(f64::NEG_INFINITY);
        let acts_j = self.acting[1] & j.above(f64::NEG_INFINITY);
        let sum = simd.keep(i, acts_i) + simd.keep(j, acts_j);
        let mean = simd.select(sum * 0.5, acts_i & acts_j, sum);
        (mean, acts_i | acts_j)
    }
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
