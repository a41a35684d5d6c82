//! When a bond breaks, decided by the same operations from both ends: stretches are compared by x of
//! [`crate::material::bond`], which needs no root.

use crate::lanes::{Lanes, Simd};
use crate::material::bond::{NEAR, growth_of};
use crate::material::{Bond, Law};

/// When the bonds between two blocks break.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Criterion {
    /// Never.
    Never,
    /// At this stretch.
    Stretch(f64),
    /// At the smaller of the thresholds of the two points; the critical stretches of their blocks are
    /// the part of it that a law may scale, 0 where a block has none.
    Thresholds([f64; 2]),
}

/// The own and the far ends of eight bonds: their laws and what they know.
#[derive(Clone, Copy)]
pub struct Ends<'a, L, P> {
    /// The laws.
    pub laws: &'a [L; 2],
    /// The numbers of the points.
    pub points: &'a [P; 2],
    /// The ends' thresholds.
    pub thresholds: &'a [Lanes; 2],
}

impl Criterion {
    /// Whether it depends on the thresholds of the ends.
    #[inline(always)]
    pub fn reads_thresholds(self) -> bool {
        matches!(self, Self::Thresholds(_))
    }

    /// The |x| of [`crate::material::bond`] beyond which bonds must be marked; none below breaks.
    #[inline(always)]
    pub fn limit(self) -> f64 {
        match self {
            // What equals the limit is not beyond it.
            Self::Stretch(critical) => NEAR.min(growth_of(critical).next_down()),
            Self::Never | Self::Thresholds(_) => NEAR,
        }
    }

    /// A bit for each bond that breaks.
    #[inline(always)]
    pub fn met<S: Simd, L: Law<D>, const D: usize>(
        self,
        simd: S,
        bond: &Bond<D>,
        ends: Ends<'_, L, L::Point>,
    ) -> u8 {
        let scale = || {
            let [here, there] = ends.points;
            ends.laws[0].toughness_scale(here, &ends.laws[1], there)
        };
        let threshold = match self {
            Self::Never => return 0,
            // A bond that breaks is marked.
            Self::Stretch(_) if !L::SCALED && bond.marked == 0 => return 0,
            Self::Stretch(critical) if L::SCALED => Lanes::splat(critical) * scale(),
            Self::Stretch(critical) => {
                return simd.at_least(bond.growth, Lanes::splat(growth_of(critical)));
            }
            Self::Thresholds(critical) => {
                let [mut here, mut there] = *ends.thresholds;
                if L::SCALED {
                    let growth = scale() - Lanes::splat(1.0);
                    here += growth * critical[0];
                    there += growth * critical[1];
                }
                here.min(there)
            }
        };
        let threshold = threshold * (Lanes::splat(2.0) + threshold);
        simd.at_least(bond.growth, threshold)
    }
}
