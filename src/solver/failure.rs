//! When a bond breaks, decided by the same operations from both ends.

use crate::material::lanes::WIDTH;
use crate::material::{End, Lanes, Law};

/// The two ends of eight bonds: their laws and what they know.
#[derive(Clone, Copy)]
pub struct Ends<'a, L> {
    /// Law of the own end.
    pub here_law: &'a L,
    /// Law of the far end.
    pub there_law: &'a L,
    /// What the own end knows.
    pub here: &'a End,
    /// What the far ends know.
    pub there: &'a End,
}

/// When a bond breaks.
pub trait Failure: Copy + Sync {
    /// A bit for each bond that breaks at this stretch.
    fn breaks<L: Law>(
        &self,
        point: usize,
        neighbours: &[u32; WIDTH],
        stretch: Lanes,
        ends: Ends<'_, L>,
    ) -> u8;
}

/// One critical stretch for all bonds, infinite if they never break.
#[derive(Clone, Copy)]
pub struct Uniform(pub f64);

/// A threshold for each local point; a bond takes the smaller of its ends'.
#[derive(Clone, Copy)]
pub struct PerPoint<'a> {
    /// Threshold of each local point.
    pub thresholds: &'a [f64],
    /// The part of it that the law may scale, of the own and the far block.
    pub critical: [f64; 2],
}

impl<L: Law> Ends<'_, L> {
    #[inline(always)]
    fn scale(&self) -> Lanes {
        self.here_law
            .toughness_scale(self.here, self.there_law, self.there)
    }
}

impl Failure for Uniform {
    #[inline(always)]
    fn breaks<L: Law>(&self, _: usize, _: &[u32; WIDTH], stretch: Lanes, ends: Ends<'_, L>) -> u8 {
        let mut threshold = Lanes::splat(self.0);
        if L::SCALED {
            threshold = threshold * ends.scale();
        }
        stretch.at_least(threshold)
    }
}

impl Failure for PerPoint<'_> {
    #[inline(always)]
    fn breaks<L: Law>(
        &self,
        point: usize,
        neighbours: &[u32; WIDTH],
        stretch: Lanes,
        ends: Ends<'_, L>,
    ) -> u8 {
        let mut here = Lanes::splat(self.thresholds[point]);
        let mut there = here;
        for (value, index) in there.0.iter_mut().zip(neighbours) {
            *value = self.thresholds[*index as usize];
        }
        if L::SCALED {
            let growth = ends.scale() - Lanes::splat(1.0);
            here += growth * self.critical[0];
            there += growth * self.critical[1];
        }
        stretch.at_least(here.min(there))
    }
}
