//! What works against motions that the deformation gradient does not see.

use nalgebra::SMatrix;

use super::super::{Given, Key, Kind, Pmb, Word};
use super::hooke::Hooke;
use crate::dimension::Dimension;
use std::f64::consts::PI;

/// The matrix B of the force state ω B z.
#[derive(Debug, Clone, Copy, PartialEq)]
#[expect(
    clippy::large_enum_variant,
    reason = "there is one a law, not one a point"
)]
pub enum Control {
    /// B = 0.
    None,
    /// B = C : K⁻¹, B_ik = C_ijkl K⁻¹_jl (Wan, Chen, Chu & Chen 2019): of the same stiffness as the solid,
    /// without a coefficient, and as anisotropic as it.
    Wan2019(Hooke),
    /// B = G (c/δ) (V_δ/ω₀) I with the micromodulus c of a bond-based solid, the volume V_δ within a
    /// horizon and ω₀ = Σ ω Ṽ (Silling 2017).
    Silling2017 {
        /// G.
        coefficient: f64,
        /// G c V_δ/δ, N/m⁴.
        strength: f64,
    },
}

pub const KIND: Key = Key {
    name: "zero_energy",
    meaning: "what works against motions that leave the deformation gradient as it is",
    kind: Kind::Word(&[
        Word::new("wan2019"),
        Word::new("silling2017"),
        Word::new("none"),
    ]),
};

pub const COEFFICIENT: Key = Key {
    name: "zero_energy_coefficient",
    meaning: "G of \"silling2017\": the force against such a motion over that of a bond-based solid",
    kind: Kind::Number {
        range: f64::MIN_POSITIVE..f64::INFINITY,
        words: "above 0",
        default: Some(1.0),
    },
};

impl Control {
    /// That of a law.
    pub fn of(given: &Given, hooke: Hooke) -> Self {
        match given.values.word(KIND.name) {
            "none" => Self::None,
            "wan2019" => Self::Wan2019(hooke),
            _ => {
                let coefficient = given.values.number(COEFFICIENT.name);
                let horizon = given.horizon;
                let ball = match given.dimension {
                    Dimension::Space => 4.0 / 3.0 * PI * horizon.powi(3),
                    Dimension::PlaneStress { thickness } | Dimension::PlaneStrain { thickness } => {
                        PI * horizon.powi(2) * thickness
                    }
                    Dimension::Line { cross_section, .. } => 2.0 * horizon * cross_section,
                };
                Self::Silling2017 {
                    coefficient,
                    strength: coefficient * Pmb::of(given).micromodulus * ball / horizon,
                }
            }
        }
    }

    /// What a point whose whole family has this weight ω₀ (m³) keeps for [`Self::matrix`], N/m⁷.
    pub fn constant(&self, weight: f64) -> f64 {
        match self {
            Self::Silling2017 { strength, .. } if weight > 0.0 => strength / weight,
            _ => 0.0,
        }
    }

    /// B (N/m⁷) of a point with this K⁻¹ (m⁻⁵) and constant.
    pub fn matrix<const D: usize>(
        &self,
        inverse: &SMatrix<f64, D, D>,
        constant: f64,
    ) -> SMatrix<f64, D, D> {
        match self {
            Self::None => SMatrix::zeros(),
            Self::Wan2019(hooke) => hooke.contracted(inverse),
            Self::Silling2017 { .. } => SMatrix::from_diagonal_element(constant),
        }
    }

    /// For people to read.
    pub fn described(&self) -> String {
        match self {
            Self::None => "none".to_owned(),
            Self::Wan2019(_) => "as stiff as the solid (Wan et al. 2019)".to_owned(),
            Self::Silling2017 { coefficient, .. } => {
                format!("coefficient {coefficient} (Silling 2017)")
            }
        }
    }
}
