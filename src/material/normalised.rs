//! Prototype microelastic material with a micromodulus for each point, from its own neighbours.
//!
//! Ganzenmüller, Hiermaier & May 2014; Diehl & Schweitzer 2016, §3. A point's constant makes the sum
//! over its own discrete family hold the classical energy density W₁ at unit isotropic stretch:
//! w = c_i s²|ξ|/2 gives ½ Σ w Ṽ = W₁ for c_i = 4 W₁ / Σ |ξ| Ṽ, so that stiffness is right at
//! surfaces and on any lattice. A bond has the mean of its ends', c_ij = (c_i + c_j)/2, and the
//! critical stretch s_c √(c/c_ij), which keeps the energy that it takes to break it.
//!
//! With the influence 1/|ξ| it is Diehl & Schweitzer's eq. 15: w = c̄_i s²/2, c̄_i = 4 W₁ / Σ Ṽ.

use super::{Bond, End, Lanes, Law};

/// The law with its constants.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Normalised {
    /// Classical energy density at unit isotropic stretch W₁, J/m³.
    pub energy: f64,
    /// The micromodulus that the damage law's critical stretch belongs to, N/m⁶; `None` if that
    /// stretch holds for all bonds.
    pub reference: Option<f64>,
}

impl Law for Normalised {
    const CONSTANT: bool = true;
    const SCALED: bool = true;

    #[inline(always)]
    fn constant_share(&self, length: Lanes) -> Lanes {
        length
    }

    /// 1 / Σ |ξ| Ṽ, 1/m⁴.
    #[inline(always)]
    fn constant(&self, sum: f64) -> f64 {
        if sum > 0.0 { 1.0 / sum } else { 0.0 }
    }

    #[inline(always)]
    fn force(&self, bond: &Bond, end: &End) -> Lanes {
        bond.stretch * end.constant * (2.0 * self.energy)
    }

    #[inline(always)]
    fn bond_energy(&self, bond: &Bond, end: &End) -> Lanes {
        bond.stretch * bond.stretch * bond.length * end.constant * self.energy
    }

    #[inline(always)]
    fn stiffness(&self, length: Lanes, end: &End) -> Lanes {
        end.constant * (2.0 * self.energy) / length
    }

    #[inline(always)]
    fn toughness_scale(&self, here: &End, other: &Self, there: &End) -> Lanes {
        let (Some(reference), Some(other_reference)) = (self.reference, other.reference) else {
            return Lanes::splat(1.0);
        };
        let micromodulus =
            here.constant * (2.0 * self.energy) + there.constant * (2.0 * other.energy);
        (Lanes::splat(0.5 * (reference + other_reference)) / micromodulus).sqrt()
    }
}
