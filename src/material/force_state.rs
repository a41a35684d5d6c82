//! Force states T⟨ξ⟩ of eight bonds. In general, a force state is a vector. A force along the bond needs only
//! one number per bond.

use super::{Bond, rotation};
use crate::lanes::{LaneTuple, Lanes, Simd};

/// The force state of one end of eight bonds.
pub trait ForceState<const D: usize>: Copy {
    /// Whether the force always acts along the bond.
    const CENTRAL: bool;

    /// Type of the family's [`Rotation`](super::Rotation), which [`Self::work`] reads; empty for central
    /// forces.
    type Rotation: LaneTuple;

    /// Multiply by one factor per bond.
    fn times(self, factor: Lanes) -> Self;

    /// Add `other`, which is −T_j⟨−ξ⟩ of neighbour j.
    fn plus(self, other: Self) -> Self;

    /// Add to `sums` the force density (N/m³) of the bonds whose bit in `bits` is set: the force state times
    /// `volume`, Ṽ_j (m³).
    fn add<S: Simd>(self, simd: S, bond: &Bond<D>, volume: Lanes, bits: u8, sums: &mut [Lanes; D]);

    /// Return the component ab of the symmetric part of T⊗Y, J/m⁶.
    fn dyad(self, bond: &Bond<D>, a: usize, b: usize) -> Lanes;

    /// Return the work ½ T·(Y − R ξ) of the force on the bond, J/m⁶, with the rotation R of the family. The
    /// result has the same bits if i and j are exchanged. A central force does work only on the extension, so
    /// R does not matter.
    fn work<S: Simd>(
        self,
        simd: S,
        bond: &Bond<D>,
        linear: bool,
        rotation: &Self::Rotation,
    ) -> Lanes;

    /// Return the force state by component, N/m⁶.
    fn vector(self, bond: &Bond<D>) -> [Lanes; D];
}

/// Force state along the bond: T = t Y with t in N/m⁷, or t ξ for linear laws. Positive t pulls the ends
/// towards each other.
#[derive(Debug, Clone, Copy)]
pub struct Along(pub Lanes);

impl<const D: usize> ForceState<D> for Along {
    const CENTRAL: bool = true;
    type Rotation = [Lanes; 0];

    #[inline(always)]
    fn times(self, factor: Lanes) -> Self {
        Self(self.0 * factor)
    }

    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        Self(self.0 + other.0)
    }

    #[inline(always)]
    fn add<S: Simd>(self, simd: S, bond: &Bond<D>, volume: Lanes, bits: u8, sums: &mut [Lanes; D]) {
        let strength = simd.keep(self.0 * volume, bits);
        for d in 0..D {
            sums[d] = simd.multiply_add(strength, bond.deformed[d], sums[d]);
        }
    }

    #[inline(always)]
    fn dyad(self, bond: &Bond<D>, a: usize, b: usize) -> Lanes {
        self.0 * bond.deformed[a] * bond.deformed[b]
    }

    /// Return ½ t |Y| (|Y| − |ξ|). With x and P = P(x) of `bond.rs`, |Y| (|Y| − |ξ|) = |ξ|² P (1 + x). For
    /// linear laws, return ½ t ξ·η.
    #[inline(always)]
    fn work<S: Simd>(self, _: S, bond: &Bond<D>, linear: bool, _: &[Lanes; 0]) -> Lanes {
        let share = if linear {
            bond.relative_square_extension
        } else {
            bond.extension_over_deformed * (Lanes::splat(1.0) + bond.relative_square_extension)
        };
        self.0 * (bond.length * bond.length * share) * 0.5
    }

    #[inline(always)]
    fn vector(self, bond: &Bond<D>) -> [Lanes; D] {
        LaneTuple::each(|d| self.0 * bond.deformed[d])
    }
}

/// Force state in any direction, by component, N/m⁶.
impl<const D: usize> ForceState<D> for [Lanes; D] {
    const CENTRAL: bool = false;
    type Rotation = [Lanes; 4];

    #[inline(always)]
    fn times(self, factor: Lanes) -> Self {
        LaneTuple::each(|d| self[d] * factor)
    }

    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        LaneTuple::each(|d| self[d] + other[d])
    }

    #[inline(always)]
    fn add<S: Simd>(self, simd: S, _: &Bond<D>, volume: Lanes, bits: u8, sums: &mut [Lanes; D]) {
        for d in 0..D {
            sums[d] = simd.multiply_add(simd.keep(self[d], bits), volume, sums[d]);
        }
    }

    #[inline(always)]
    fn dyad(self, bond: &Bond<D>, a: usize, b: usize) -> Lanes {
        (self[a] * bond.deformed[b] + self[b] * bond.deformed[a]) * 0.5
    }

    #[inline(always)]
    fn work<S: Simd>(self, simd: S, bond: &Bond<D>, _: bool, rotation: &[Lanes; 4]) -> Lanes {
        let turned = rotation::displacement(simd, &bond.reference, rotation);
        let mut sum = self[0] * (bond.eta[0] - turned[0]);
        if D > 1 {
            sum = simd.multiply_add(self[1], bond.eta[1] - turned[1], sum);
        }
        if D > 2 {
            sum = simd.multiply_add(self[2], bond.eta[2] - turned[2], sum);
        }
        sum * 0.5
    }

    #[inline(always)]
    fn vector(self, _: &Bond<D>) -> [Lanes; D] {
        self
    }
}
