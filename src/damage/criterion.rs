//! When a bond breaks, decided by the same operations from both ends: stretches are compared by x of
//! [`crate::material::bond`], which needs no root, energies by the work of both ends' force states, stresses by their mean.

use super::{StressMeasure, StressRule, ToughnessByDirection};
use crate::lanes::{Lanes, Simd};
use crate::material::bond::{NEAR, Weights, relative_square_extension_of};
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
    Thresholds([f64; 2], Directions),
    /// As [`Self::Stretch`], between points whose critical stretches belong to different horizons; ∞ where a block has none.
    StretchBetween([f64; 2], StretchConversion),
    /// As [`Self::Thresholds`], between points whose critical stretches belong to different horizons.
    ThresholdsBetween([f64; 2], StretchConversion, Directions),
    /// When the work of the acting force states reaches the sum of what each of them takes, J/m⁶.
    Work([f64; 2], WorkRule),
    /// As [`Self::Work`], from the work thresholds of the two points.
    WorkThresholds(HorizonRatios, WorkRule, Directions),
    /// When the mean stress of the acting ends reaches this strength, Pa.
    Stress(f64, StressRule),
    /// As [`Self::Stress`], at the smaller strength of the two points.
    StressThresholds(StressRule),
}

/// The toughness by direction of the bodies of points i and j, unless that of both is the same in all directions. It multiplies
/// the thresholds of these points.
pub type Directions = Option<[ToughnessByDirection; 2]>;

/// Factors that convert the work threshold of a point to the horizon of an end of the bond: entry `[e][k]` takes that of
/// point k to end e; all are 1 between equal horizons.
pub type HorizonRatios = [[f64; 2]; 2];

/// Critical stretch of a bond between points whose own critical stretches belong to different horizons.
///
/// An end e of the bond takes ½ k_e s² |ξ| of its energy, with the stiffness k_e of its point, if it acts there: if the bond
/// is within the horizon of e. A fracture energy lets it take as much as at m_e = min_k t_k √(δ_k/δ_e), with the critical
/// stretch t_k of point k and its horizon δ_k. The bond breaks where its acting ends have taken theirs together:
/// s² = Σ k_e m_e²/Σ k_e.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StretchConversion {
    /// Entry `[e][k]` is √(δ_k/δ_e).
    pub ratios: HorizonRatios,
    /// k_e, in any unit.
    pub stiffness: [f64; 2],
}

impl StretchConversion {
    /// The critical stretch of each bond, from those of points i and j.
    #[inline(always)]
    fn convert<S: Simd>(self, simd: S, [i, j]: [Lanes; 2], acting: [u8; 2]) -> Lanes {
        let [[ii, ij], [ji, jj]] = self.ratios;
        let takes_i = (i * ii).min(j * ij);
        let takes_j = (i * ji).min(j * jj);
        let k_i = simd.keep(Lanes::splat(self.stiffness[0]), acting[0]);
        let k_j = simd.keep(Lanes::splat(self.stiffness[1]), acting[1]);
        ((takes_i * takes_i * k_i + takes_j * takes_j * k_j) / (k_i + k_j)).sqrt()
    }

    /// A stretch below which none of the bonds breaks.
    #[inline(always)]
    fn smallest(self, [i, j]: [f64; 2]) -> f64 {
        let of_end = |[from_i, from_j]: [f64; 2]| (i * from_i).min(j * from_j);
        of_end(self.ratios[0]).min(of_end(self.ratios[1]))
    }
}

/// How the work of bonds is looked at.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WorkRule {
    /// Which bonds break.
    pub sense: Sense,
    /// c from 0 to 1: thresholds are multiplied by 1 + c (f − 1) with the [truncation factor](Law::truncation_factor) f.
    pub family_correction: f64,
    /// Which relative displacement the force states work on.
    pub measure: WorkMeasure,
}

/// The relative displacement that the force state of a point works on. Forces along the bond always work on its
/// extension.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WorkMeasure {
    /// Y − R ξ with the rotation R of the point's family: rigid rotation does no work.
    Objective,
    /// η = Y − ξ, for small rotations (Willberg et al. 2022, eq. 16).
    Displacement,
}

/// Which bonds break by their work or by stress.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sense {
    /// Those that are longer than in the undeformed body.
    Pulled,
    /// Pressed ones as well.
    Either,
}

impl Sense {
    /// The sense of bonds between points with this and another one: a pressed bond breaks where both say so.
    pub fn of_both(self, other: Self) -> Self {
        match self {
            Self::Either => other,
            Self::Pulled => self,
        }
    }
}

/// The own and the far ends of eight bonds: their laws and what they know.
#[derive(Clone, Copy)]
pub struct Ends<'a, L, P> {
    /// The laws.
    pub laws: &'a [L; 2],
    /// The numbers of the points.
    pub points: [&'a P; 2],
    /// What criteria alone read of them.
    pub limits: [&'a Limits; 2],
    /// Influence and volume share of the bonds.
    pub weights: Weights,
}

/// What criteria read of eight points, where they read it.
#[derive(Debug, Clone, Copy)]
pub struct Limits {
    /// The stretches, works (J/m⁶) or stresses (Pa) at which their bonds break.
    pub thresholds: Lanes,
    /// Their [`Law::truncation_factor`].
    pub truncation_factors: Lanes,
    /// The measure of their stress that the criterion reads, Pa; −∞ for points that carry no stress.
    pub stresses: Lanes,
}

impl Limits {
    /// Where no criterion reads them.
    #[inline(always)]
    pub fn unread() -> Self {
        Self {
            thresholds: Lanes::splat(0.0),
            truncation_factors: Lanes::splat(1.0),
            stresses: Lanes::splat(f64::NEG_INFINITY),
        }
    }
}

impl Criterion {
    /// Whether it depends on the thresholds of the ends.
    #[inline(always)]
    pub fn reads_thresholds(self) -> bool {
        matches!(
            self,
            Self::Thresholds(..)
                | Self::ThresholdsBetween(..)
                | Self::WorkThresholds(..)
                | Self::StressThresholds(_)
        )
    }

    /// It reads the truncation factors of the points.
    #[inline(always)]
    pub fn reads_truncation_factors(self) -> bool {
        match self {
            Self::Work(_, rule) | Self::WorkThresholds(_, rule, _) => rule.corrects(),
            _ => false,
        }
    }

    /// Whether it depends on the rotations of the ends.
    #[inline(always)]
    pub fn reads_rotations(self) -> bool {
        match self {
            Self::Work(_, rule) | Self::WorkThresholds(_, rule, _) => {
                rule.measure == WorkMeasure::Objective
            }
            _ => false,
        }
    }

    /// The measure of the stress of points that it reads, if it reads one.
    #[inline(always)]
    pub fn stress_measure(self) -> Option<StressMeasure> {
        match self {
            Self::Stress(_, rule) | Self::StressThresholds(rule) => Some(rule.measure),
            _ => None,
        }
    }

    /// Whether it asks for the work of the force states.
    #[inline(always)]
    pub fn reads_work(self) -> bool {
        matches!(self, Self::Work(..) | Self::WorkThresholds(..))
    }

    /// The |x| of [`crate::material::bond`] from which bonds count as beyond the series. Below it none breaks by its stretch.
    #[inline(always)]
    pub fn limit(self) -> f64 {
        match self {
            // What equals the limit is not beyond it.
            Self::Stretch(critical) => NEAR.min(relative_square_extension_of(critical).next_down()),
            // The bound is rounded otherwise than the threshold of a bond.
            Self::StretchBetween(critical, conversion) => {
                let smallest = conversion.smallest(critical) * (1.0 - 1e-12);
                NEAR.min(relative_square_extension_of(smallest))
            }
            _ => NEAR,
        }
    }

    /// All bonds that break are beyond the series; `scaled` for laws that scale thresholds.
    #[inline(always)]
    pub fn marks_all(self, scaled: bool) -> bool {
        match self {
            Self::Never => true,
            Self::Stretch(_) | Self::StretchBetween(..) => !scaled,
            _ => false,
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
            // A bond that breaks is beyond the series.
            Self::Stretch(_) if !L::SCALED && bond.beyond_series == 0 => 0,
            Self::Stretch(critical) if !L::SCALED => simd.at_least(
                bond.relative_square_extension,
                Lanes::splat(relative_square_extension_of(critical)),
            ),
            Self::Work(_, rule) | Self::WorkThresholds(_, rule, _) => {
                let [i, j] = ends.weights.acting();
                let spent = simd.at_least(work, self.threshold(simd, bond, ends)) & (i | j);
                match rule.sense {
                    Sense::Pulled => spent & bond.relative_square_extension.above(0.0),
                    Sense::Either => spent,
                }
            }
            Self::Stress(_, rule) | Self::StressThresholds(rule) => {
                let (stress, acting) = mean_stress(simd, ends);
                let reached = simd.at_least(stress, self.threshold(simd, bond, ends)) & acting;
                match rule.sense {
                    Sense::Pulled => reached & bond.relative_square_extension.above(0.0),
                    Sense::Either => reached,
                }
            }
            Self::StretchBetween(..) if !L::SCALED && bond.beyond_series == 0 => 0,
            Self::Stretch(_)
            | Self::Thresholds(..)
            | Self::StretchBetween(..)
            | Self::ThresholdsBetween(..) => {
                let threshold = self.threshold(simd, bond, ends);
                let threshold = threshold * (Lanes::splat(2.0) + threshold);
                simd.at_least(bond.relative_square_extension, threshold)
            }
        }
    }

    /// The stretch, work or stress at which each bond breaks.
    #[inline(always)]
    fn threshold<S: Simd, L: Law<D>, const D: usize>(
        self,
        simd: S,
        bond: &Bond<D>,
        ends: Ends<'_, L, L::Point>,
    ) -> Lanes {
        let scale = || ends.laws[0].toughness_scale(bond, ends.points, &ends.laws[1]);
        match self {
            Self::Never => Lanes::splat(f64::INFINITY),
            Self::Stretch(critical) if L::SCALED => Lanes::splat(critical) * scale(),
            Self::Stretch(critical) | Self::Stress(critical, _) => Lanes::splat(critical),
            Self::StressThresholds(_) => (ends.limits[0].thresholds).min(ends.limits[1].thresholds),
            Self::Work([i, j], rule) => {
                rule.sum_of_acting(simd, [Lanes::splat(i), Lanes::splat(j)], ends)
            }
            Self::StretchBetween(critical, conversion) => {
                let both = [Lanes::splat(critical[0]), Lanes::splat(critical[1])];
                let threshold = conversion.convert(simd, both, ends.weights.acting());
                if L::SCALED {
                    threshold * scale()
                } else {
                    threshold
                }
            }
            Self::Thresholds(critical, directions)
            | Self::ThresholdsBetween(critical, _, directions) => {
                let (mut here, mut there) = (ends.limits[0].thresholds, ends.limits[1].thresholds);
                if L::SCALED {
                    let growth = scale() - Lanes::splat(1.0);
                    here += growth * critical[0];
                    there += growth * critical[1];
                }
                if let Some(directions) = directions {
                    here = here * directions[0].factor(simd, bond).sqrt();
                    there = there * directions[1].factor(simd, bond).sqrt();
                }
                match self {
                    Self::ThresholdsBetween(_, conversion, _) => {
                        conversion.convert(simd, [here, there], ends.weights.acting())
                    }
                    _ => here.min(there),
                }
            }
            Self::WorkThresholds([[ii, ij], [ji, jj]], rule, directions) => {
                let (mut i, mut j) = (ends.limits[0].thresholds, ends.limits[1].thresholds);
                if let Some(directions) = directions {
                    i = i * directions[0].factor(simd, bond);
                    j = j * directions[1].factor(simd, bond);
                }
                let takes_i = (i * ii).min(j * ij) * 0.5;
                let takes_j = (i * ji).min(j * jj) * 0.5;
                rule.sum_of_acting(simd, [takes_i, takes_j], ends)
            }
        }
    }

    /// The share of the energy of each broken bond that it held above its criterion, because it was
    /// seen late: 1 − (s_c/s)², 1 − w_c/w or 1 − (σ_c/σ)². The bond must know its stretch.
    #[inline(always)]
    pub fn overshoot<S: Simd, L: Law<D>, const D: usize>(
        self,
        simd: S,
        bond: &Bond<D>,
        ends: Ends<'_, L, L::Point>,
        work: Lanes,
    ) -> Lanes {
        let threshold = self.threshold(simd, bond, ends);
        let ratio = if self.reads_work() {
            threshold / work
        } else {
            let reached = match self {
                Self::Stress(..) | Self::StressThresholds(_) => mean_stress(simd, ends).0,
                _ => bond.stretch,
            };
            let ratio = threshold / reached;
            ratio * ratio
        };
        (Lanes::splat(1.0) - ratio).max(Lanes::splat(0.0))
    }
}

/// The mean stress (Pa) of the ends of each bond, and a bit for each bond that has one. An end takes part if the bond is
/// within its horizon and its point carries stress. Both ends compute the same bits.
#[inline(always)]
fn mean_stress<S: Simd, L, P>(simd: S, ends: Ends<'_, L, P>) -> (Lanes, u8) {
    let [i, j] = ends.limits.map(|end| end.stresses);
    let [acts_i, acts_j] = ends.weights.acting();
    let acts_i = acts_i & i.above(f64::NEG_INFINITY);
    let acts_j = acts_j & j.above(f64::NEG_INFINITY);
    let sum = simd.keep(i, acts_i) + simd.keep(j, acts_j);
    (
        simd.select(sum * 0.5, acts_i & acts_j, sum),
        acts_i | acts_j,
    )
}

impl WorkRule {
    /// That of bonds between points with this and another one: a pressed bond breaks where both say so, the smaller
    /// correction counts, and work is objective where either is.
    pub fn of_both(self, other: Self) -> Self {
        Self {
            sense: self.sense.of_both(other.sense),
            family_correction: self.family_correction.min(other.family_correction),
            measure: if self.measure == WorkMeasure::Objective {
                self.measure
            } else {
                other.measure
            },
        }
    }

    #[inline(always)]
    fn corrects(self) -> bool {
        self.family_correction > 0.0
    }

    /// What the acting force states of bonds take together, by what each takes in a whole family. Written out: array
    /// methods are not always inlined, and the compiler would keep all of a bond in memory for them.
    #[inline(always)]
    fn sum_of_acting<S: Simd, L, P>(
        self,
        simd: S,
        [i, j]: [Lanes; 2],
        ends: Ends<'_, L, P>,
    ) -> Lanes {
        let [acts_i, acts_j] = ends.weights.acting();
        let takes_i = simd.keep(self.corrected(i, ends.limits[0]), acts_i);
        let takes_j = simd.keep(self.corrected(j, ends.limits[1]), acts_j);
        takes_i + takes_j
    }

    /// What the force state of an end takes, by what it takes in a whole family.
    #[inline(always)]
    fn corrected(self, takes: Lanes, end: &Limits) -> Lanes {
        if !self.corrects() {
            return takes;
        }
        let share = self.family_correction;
        takes * (end.truncation_factors * share + Lanes::splat(1.0 - share))
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
            measure: WorkMeasure::Objective,
        };
        let both = rule(Sense::Either, 1.0).of_both(rule(Sense::Pulled, 0.5));
        assert_eq!(both, rule(Sense::Pulled, 0.5));
        let both = rule(Sense::Either, 0.0).of_both(rule(Sense::Either, 1.0));
        assert_eq!(both, rule(Sense::Either, 0.0));
    }
}
