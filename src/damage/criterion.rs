//! When a bond breaks, decided by the same operations from both ends: stretches are compared by x of
//! [`crate::material::bond`], which needs no root, energies by the work of both ends' force states.

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
    /// At the smaller of the threshold stretches of the two points; the critical stretches of their
    /// blocks are the part of it that a law may scale, 0 where a block has none.
    Thresholds([f64; 2]),
    /// When the work of the force states reaches this much, J/m⁶.
    Work(f64, WorkRule),
    /// When the work of the force states reaches the smaller of the thresholds of the two points, J/m⁶.
    WorkThresholds(WorkRule),
}

/// How the work of bonds is looked at.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WorkRule {
    /// Which bonds break.
    pub sense: Sense,
    /// The share, from 0 to 1, of what bonds hold [more](Law::overload) where families are not whole that their
    /// threshold grows by.
    pub family_correction: f64,
}

/// Which bonds break by their work.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sense {
    /// Those that are longer than in the undeformed body.
    Pulled,
    /// Pressed ones as well.
    Either,
}

/// The own and the far ends of eight bonds: their laws and what they know.
#[derive(Clone, Copy)]
pub struct Ends<'a, L, P> {
    /// The laws.
    pub laws: &'a [L; 2],
    /// The numbers of the points.
    pub points: [&'a P; 2],
    /// What criteria alone read of them.
    pub limits: &'a [Limits; 2],
}

/// What criteria read of eight points, where they read it.
#[derive(Debug, Clone, Copy)]
pub struct Limits {
    /// The stretches or works (J/m⁶) at which their bonds break.
    pub thresholds: Lanes,
    /// Their [`Law::overload`].
    pub overloads: Lanes,
}

impl Limits {
    /// Where no criterion reads them.
    #[inline(always)]
    pub fn unread() -> Self {
        Self {
            thresholds: Lanes::splat(0.0),
            overloads: Lanes::splat(1.0),
        }
    }
}

impl Criterion {
    /// Whether it depends on the thresholds of the ends.
    #[inline(always)]
    pub fn reads_thresholds(self) -> bool {
        matches!(self, Self::Thresholds(_) | Self::WorkThresholds(_))
    }

    /// Whether it depends on the overloads of the ends.
    #[inline(always)]
    pub fn reads_overloads(self) -> bool {
        match self {
            Self::Work(_, rule) | Self::WorkThresholds(rule) => rule.corrects(),
            Self::Never | Self::Stretch(_) | Self::Thresholds(_) => false,
        }
    }

    /// Whether it asks for the work of the force states.
    #[inline(always)]
    pub fn reads_work(self) -> bool {
        matches!(self, Self::Work(..) | Self::WorkThresholds(_))
    }

    /// The |x| of [`crate::material::bond`] beyond which bonds must be marked; none below breaks by
    /// its stretch.
    #[inline(always)]
    pub fn limit(self) -> f64 {
        match self {
            // What equals the limit is not beyond it.
            Self::Stretch(critical) => NEAR.min(growth_of(critical).next_down()),
            _ => NEAR,
        }
    }

    /// Whether all bonds that break are marked, of laws that may scale thresholds.
    #[inline(always)]
    pub fn marks_all(self, scaled: bool) -> bool {
        match self {
            Self::Never => true,
            Self::Stretch(_) => !scaled,
            Self::Thresholds(_) | Self::Work(..) | Self::WorkThresholds(_) => false,
        }
    }

    /// A bit for each bond that breaks; `work` is in J/m⁶, and read only if it is asked for.
    #[inline(always)]
    pub fn breaking<S: Simd, L: Law<D>, const D: usize>(
        self,
        simd: S,
        bond: &Bond<D>,
        ends: Ends<'_, L, L::Point>,
        work: Lanes,
    ) -> u8 {
        match self {
            Self::Never => 0,
            // A bond that breaks is marked.
            Self::Stretch(_) if !L::SCALED && bond.marked == 0 => 0,
            Self::Stretch(critical) if !L::SCALED => {
                simd.at_least(bond.growth, Lanes::splat(growth_of(critical)))
            }
            Self::Work(_, rule) | Self::WorkThresholds(rule) => {
                let spent = simd.at_least(work, self.threshold(ends));
                match rule.sense {
                    Sense::Pulled => spent & bond.growth.above(0.0),
                    Sense::Either => spent,
                }
            }
            Self::Stretch(_) | Self::Thresholds(_) => {
                let threshold = self.threshold(ends);
                let threshold = threshold * (Lanes::splat(2.0) + threshold);
                simd.at_least(bond.growth, threshold)
            }
        }
    }

    /// The stretch or work at which each bond breaks.
    #[inline(always)]
    fn threshold<L: Law<D>, const D: usize>(self, ends: Ends<'_, L, L::Point>) -> Lanes {
        let scale = || {
            let [here, there] = ends.points;
            ends.laws[0].toughness_scale(here, &ends.laws[1], there)
        };
        match self {
            Self::Never => Lanes::splat(f64::INFINITY),
            Self::Stretch(critical) if L::SCALED => Lanes::splat(critical) * scale(),
            Self::Stretch(critical) => Lanes::splat(critical),
            Self::Work(critical, rule) => rule.corrected(Lanes::splat(critical), ends.limits),
            Self::Thresholds(critical) => {
                let [mut here, mut there] = ends.limits.map(|limits| limits.thresholds);
                if L::SCALED {
                    let growth = scale() - Lanes::splat(1.0);
                    here += growth * critical[0];
                    there += growth * critical[1];
                }
                here.min(there)
            }
            Self::WorkThresholds(rule) => {
                let [here, there] = ends.limits;
                rule.corrected(here.thresholds.min(there.thresholds), ends.limits)
            }
        }
    }

    /// The share of the energy of each broken bond that it held above its criterion, because it was
    /// seen late: 1 − (s_c/s)² or 1 − w_c/w. The bond must know its stretch.
    #[inline(always)]
    pub fn overshoot<L: Law<D>, const D: usize>(
        self,
        bond: &Bond<D>,
        ends: Ends<'_, L, L::Point>,
        work: Lanes,
    ) -> Lanes {
        let threshold = self.threshold(ends);
        let ratio = if self.reads_work() {
            threshold / work
        } else {
            let ratio = threshold / bond.stretch;
            ratio * ratio
        };
        (Lanes::splat(1.0) - ratio).max(Lanes::splat(0.0))
    }
}

impl WorkRule {
    /// That of bonds between points with this and another one: a pressed bond breaks where both say so, and the smaller
    /// correction counts.
    pub fn of_both(self, other: Self) -> Self {
        Self {
            sense: if self.sense == Sense::Either {
                other.sense
            } else {
                Sense::Pulled
            },
            family_correction: self.family_correction.min(other.family_correction),
        }
    }

    #[inline(always)]
    fn corrects(self) -> bool {
        self.family_correction > 0.0
    }

    /// The threshold of bonds by that of whole families: half of the work is each end's.
    #[inline(always)]
    fn corrected(self, threshold: Lanes, [here, there]: &[Limits; 2]) -> Lanes {
        if !self.corrects() {
            return threshold;
        }
        let share = self.family_correction;
        let mean = (here.overloads + there.overloads) * 0.5;
        threshold * (mean * share + Lanes::splat(1.0 - share))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn between_two_bodies_the_smaller_correction_counts() {
        let rule = |sense, family_correction| WorkRule {
            sense,
            family_correction,
        };
        let both = rule(Sense::Either, 1.0).of_both(rule(Sense::Pulled, 0.5));
        assert_eq!(both, rule(Sense::Pulled, 0.5));
        let both = rule(Sense::Either, 0.0).of_both(rule(Sense::Either, 1.0));
        assert_eq!(both, rule(Sense::Either, 0.0));
    }
}
