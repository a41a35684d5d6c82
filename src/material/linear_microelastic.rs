//! Linear microelastic material: f = C η with C = λ(|ξ|) ξ⊗ξ.
//!
//! Emmrich & Weckner 2006, eq. 5–8. The default λ = c/|ξ|³ has the micromodulus c of the proportional
//! material, to which it is the linearisation. Any other λ(|ξ|) is the default for c = 1 with the
//! influence λ |ξ|³. Forces act along ξ, also after large motions, so a rotated body is not free of
//! forces.

use super::{Bond, End, Lanes, Law};

/// The law with its constants.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinearMicroelastic {
    /// c, N/m⁶.
    pub micromodulus: f64,
    /// Classical energy density at unit isotropic stretch W₁ (J/m³) that the sum over each point's
    /// own family is scaled to; `None` to scale nothing.
    pub corrected_to: Option<f64>,
}

impl Law for LinearMicroelastic {
    const CONSTANT: bool = true;
    const LINEAR: bool = true;

    #[inline(always)]
    fn constant_share(&self, length: Lanes) -> Lanes {
        length
    }

    /// What the micromodulus is multiplied by: 1, or the surface correction 4 W₁ / (c Σ |ξ| Ṽ).
    #[inline(always)]
    fn constant(&self, sum: f64) -> f64 {
        match self.corrected_to {
            Some(energy) if sum > 0.0 => 4.0 * energy / (self.micromodulus * sum),
            _ => 1.0,
        }
    }

    #[inline(always)]
    fn force(&self, bond: &Bond, end: &End) -> Lanes {
        bond.stretch * end.constant * (0.5 * self.micromodulus)
    }

    #[inline(always)]
    fn bond_energy(&self, bond: &Bond, end: &End) -> Lanes {
        bond.stretch * bond.stretch * bond.length * end.constant * (0.25 * self.micromodulus)
    }

    #[inline(always)]
    fn stiffness(&self, length: Lanes, end: &End) -> Lanes {
        end.constant * (0.5 * self.micromodulus) / length
    }
}
