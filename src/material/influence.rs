//! Influence functions ω(|ξ|): the weight of a bond as a function of its length.
//!
//! The forms are in common use (Silling et al. 2007; Peridigm; Peridynamics.jl).

use std::f64::consts::PI;

use crate::dimension::Dimension;

/// An influence function of |ξ|/δ.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Influence {
    /// ω = 1.
    Constant,
    /// ω = 1 − |ξ|/δ.
    Linear,
    /// ω = exp(−(2|ξ|/δ)²).
    Gaussian,
    /// ω = δ/|ξ|.
    Inverse,
}

impl Influence {
    /// Return the weighted volume ∫ ω |ξ|² dV (m⁵) of an untruncated family with this horizon (m).
    pub fn weighted_volume(self, dimension: Dimension, horizon: f64) -> f64 {
        match dimension {
            Dimension::Space => 4.0 * PI * horizon.powi(5) * self.moment(4),
            Dimension::PlaneStress { thickness } | Dimension::PlaneStrain { thickness } => {
                2.0 * PI * thickness * horizon.powi(4) * self.moment(3)
            }
            Dimension::Line { cross_section, .. } => {
                2.0 * cross_section * horizon.powi(3) * self.moment(2)
            }
        }
    }

    /// Return ω for a length and a horizon, both in m; never negative.
    pub fn at(self, length: f64, horizon: f64) -> f64 {
        let ratio = length / horizon;
        match self {
            Self::Constant => 1.0,
            Self::Linear => (1.0 - ratio).max(0.0),
            Self::Gaussian => libm::exp(-4.0 * ratio * ratio),
            Self::Inverse => 1.0 / ratio,
        }
    }

    /// Return ∫₀¹ ω(r) rⁿ dr for a horizon of 1, with n = `power`. Simpson's rule on 2000 cells has an error
    /// below 10⁻¹² for n ≥ 2.
    pub fn moment(self, power: i32) -> f64 {
        let cells = 2000;
        let at = |k: i32| match f64::from(k) / f64::from(cells) {
            // The integrand is 0 at r = 0, also for `Inverse`, because n ≥ 2.
            0.0 => 0.0,
            r => self.at(r, 1.0) * r.powi(power),
        };
        let weight = |k: i32| match k {
            0 => 1.0,
            k if k == cells => 1.0,
            k if k % 2 == 1 => 4.0,
            _ => 2.0,
        };
        (0..=cells).map(|k| weight(k) * at(k)).sum::<f64>() / (3.0 * f64::from(cells))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dimension::Constraint;

    #[test]
    fn moments_in_closed_form() {
        let cases = [
            (Influence::Constant, 4, 1.0 / 5.0),
            (Influence::Linear, 4, 1.0 / 30.0),
            (Influence::Inverse, 5, 1.0 / 5.0),
            // ∫ r³ exp(−4r²) dr = (1 − 5 e⁻⁴)/32.
            (
                Influence::Gaussian,
                3,
                (1.0 - 5.0 * libm::exp(-4.0_f64)) / 32.0,
            ),
        ];
        for (influence, power, expected) in cases {
            let found = influence.moment(power);
            assert!(
                (found - expected).abs() < 1e-11,
                "{influence:?} {found} {expected}"
            );
        }
    }

    #[test]
    fn weighted_volumes_in_closed_form() {
        let (horizon, thickness) = (3e-3_f64, 0.01);
        for (influence, dimension, expected) in [
            (
                Influence::Constant,
                Dimension::Space,
                0.8 * PI * horizon.powi(5),
            ),
            (
                Influence::Linear,
                Dimension::PlaneStress { thickness },
                0.1 * PI * thickness * horizon.powi(4),
            ),
            (
                Influence::Inverse,
                Dimension::Line {
                    cross_section: 2e-4,
                    constraint: Constraint::UniaxialStress,
                },
                2e-4 * horizon.powi(3),
            ),
        ] {
            let found = influence.weighted_volume(dimension, horizon);
            assert!(
                (found / expected - 1.0).abs() < 1e-11,
                "{influence:?}: {found} {expected}"
            );
        }
    }
}
