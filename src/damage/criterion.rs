//! When a bond breaks, decided by the same operations from both ends.

use crate::lanes::{Arithmetic, Lanes};
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

    /// A bit for each bond that breaks.
    #[inline(always)]
    pub fn met<A: Arithmetic, L: Law<D>, const D: usize>(
        self,
        bond: &Bond<D>,
        ends: Ends<'_, L, L::Point>,
    ) -> u8 {
        let scale = || {
            let [here, there] = ends.points;
            ends.laws[0].toughness_scale(here, &ends.laws[1], there)
        };
        let threshold = match self {
            Self::Never => return 0,
            Self::Stretch(critical) if L::SCALED => Lanes::splat(critical) * scale(),
            Self::Stretch(critical) => Lanes::splat(critical),
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
        A::at_least(bond.stretch, threshold)
    }
}
