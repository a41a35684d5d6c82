//! Force states T⟨ξ⟩ of eight bonds: vectors in general, a number for laws whose forces act along the
//! bond.

use super::Bond;
use crate::lanes::{Arithmetic, Lanes};

/// The force state of one end of eight bonds, N/m⁶.
pub trait ForceState<const D: usize>: Copy {
    /// Times a number for each bond.
    fn times(self, factor: Lanes) -> Self;

    /// The sum with that of the other end, −T_j⟨−ξ⟩.
    fn plus(self, other: Self) -> Self;

    /// Adds the force density (N/m³) of the bonds whose bit is set to the sums.
    fn add<A: Arithmetic>(self, bond: &Bond<D>, volume: Lanes, bits: u8, sums: &mut [Lanes; D]);

    /// A component of T⊗Y, of the part that does not turn the bond.
    fn dyad(self, bond: &Bond<D>, a: usize, b: usize) -> Lanes;

    /// By component.
    fn vector(self, bond: &Bond<D>) -> [Lanes; D];
}

/// Along Y, or along ξ for linear laws; positive pulls the ends together.
#[derive(Debug, Clone, Copy)]
pub struct Along(pub Lanes);

impl<const D: usize> ForceState<D> for Along {
    #[inline(always)]
    fn times(self, factor: Lanes) -> Self {
        Self(self.0 * factor)
    }

    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        Self(self.0 + other.0)
    }

    #[inline(always)]
    fn add<A: Arithmetic>(self, bond: &Bond<D>, volume: Lanes, bits: u8, sums: &mut [Lanes; D]) {
        let strength = A::select(self.0 * volume * bond.inverse_length, bits, 0.0);
        for d in 0..D {
            sums[d] = A::multiply_add(strength, bond.along[d], sums[d]);
        }
    }

    #[inline(always)]
    fn dyad(self, bond: &Bond<D>, a: usize, b: usize) -> Lanes {
        self.0 * bond.inverse_length * bond.along[a] * bond.along[b]
    }

    #[inline(always)]
    fn vector(self, bond: &Bond<D>) -> [Lanes; D] {
        let strength = self.0 * bond.inverse_length;
        std::array::from_fn(|d| strength * bond.along[d])
    }
}

/// In any direction.
impl<const D: usize> ForceState<D> for [Lanes; D] {
    #[inline(always)]
    fn times(self, factor: Lanes) -> Self {
        self.map(|component| component * factor)
    }

    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        std::array::from_fn(|d| self[d] + other[d])
    }

    #[inline(always)]
    fn add<A: Arithmetic>(self, _: &Bond<D>, volume: Lanes, bits: u8, sums: &mut [Lanes; D]) {
        for d in 0..D {
            sums[d] += A::select(self[d] * volume, bits, 0.0);
        }
    }

    #[inline(always)]
    fn dyad(self, bond: &Bond<D>, a: usize, b: usize) -> Lanes {
        (self[a] * bond.along[b] + self[b] * bond.along[a]) * 0.5
    }

    #[inline(always)]
    fn vector(self, _: &Bond<D>) -> [Lanes; D] {
        self
    }
}
