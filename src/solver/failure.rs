//! When a bond breaks, decided by the same operations from both ends.

use crate::material::{Arithmetic, End, Lanes, Law};

/// The own and the far ends of eight bonds: their laws and what they know.
#[derive(Clone, Copy)]
pub struct Ends<'a, L> {
    /// The laws.
    pub laws: &'a [L; 2],
    /// What the ends know of their families.
    pub ends: &'a [End; 2],
    /// The ends' thresholds.
    pub thresholds: &'a [Lanes; 2],
}

/// When a bond breaks.
pub trait Failure: Copy + Sync {
    /// Whether it depends on the thresholds of the ends.
    const PER_POINT: bool;

    /// A bit for each bond that breaks at this stretch.
    fn breaks<A: Arithmetic, L: Law>(&self, stretch: Lanes, ends: Ends<'_, L>) -> u8;
}

/// One critical stretch for all bonds, infinite if they never break.
#[derive(Clone, Copy)]
pub struct Uniform(pub f64);

/// A threshold for each local point; a bond takes the smaller of its ends'.
#[derive(Clone, Copy)]
pub struct PerPoint {
    /// The part of it that the law may scale, of the own and the far block.
    pub critical: [f64; 2],
}

impl<L: Law> Ends<'_, L> {
    #[inline(always)]
    fn scale(&self) -> Lanes {
        self.laws[0].toughness_scale(&self.ends[0], &self.laws[1], &self.ends[1])
    }
}

impl Failure for Uniform {
    const PER_POINT: bool = false;

    #[inline(always)]
    fn breaks<A: Arithmetic, L: Law>(&self, stretch: Lanes, ends: Ends<'_, L>) -> u8 {
        let mut threshold = Lanes::splat(self.0);
        if L::SCALED {
            threshold = threshold * ends.scale();
        }
        A::at_least(stretch, threshold)
    }
}

impl Failure for PerPoint {
    const PER_POINT: bool = true;

    #[inline(always)]
    fn breaks<A: Arithmetic, L: Law>(&self, stretch: Lanes, ends: Ends<'_, L>) -> u8 {
        let [mut here, mut there] = *ends.thresholds;
        if L::SCALED {
            let growth = ends.scale() - Lanes::splat(1.0);
            here += growth * self.critical[0];
            there += growth * self.critical[1];
        }
        A::at_least(stretch, here.min(there))
    }
}
