//! Criteria that break bonds. Both ends of a bond evaluate its criterion with the same operations, so that
//! the results at both ends agree.
//!
//! - Stretch criteria compare the relative square extension x of the bond with its critical value, see
//!   [`crate::material::bond`]. x is computed without a square root.
//! - Energy criteria compare the work of the force states with the critical work. Only the ends that act on
//!   the bond contribute.
//! - Stress criteria compare the mean stress measure with the strength. Only the ends that act on the bond
//!   contribute to the mean.

use super::direction::DirectionFactors;
use super::stress::MeanStress;
use super::{StressMeasure, StressRule, ToughnessByDirection};
use crate::lanes::simd::Task;
use crate::lanes::{Lanes, Simd};
use crate::material::bond::{NEAR, Weights, relative_square_extension_of};
use crate::material::{Bond, ForceState, Law};

/// Criterion for the bonds between two blocks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Criterion {
    /// Bonds never break.
    Never,
    /// Bonds break at this stretch.
    Stretch(f64),
    /// Bonds break at the smaller threshold stretch of points i and j.
    Thresholds(Directions),
    /// Same as [`Self::Stretch`], for separate critical stretches of the blocks of points i and j.
    /// [`StretchConversion`] converts these stretches to the critical stretch of the bond. A block
    /// without critical stretch has the value ∞.
    StretchBetween([f64; 2], StretchConversion),
    /// Same as [`Self::Thresholds`], for ends with different laws, moduli or horizons. [`StretchConversion`]
    /// converts the thresholds of both points to the critical stretch of the bond.
    ThresholdsBetween(StretchConversion, Directions),
    /// Bonds break when their work reaches their critical work. Each end that acts on a bond adds the work of
    /// its force state to the work of the bond. The end also adds its share to the critical work of the bond.
    /// The numbers are the shares of points i and j, J/m⁶.
    Work([f64; 2], WorkRule),
    /// Same as [`Self::Work`], with the shares computed from the work thresholds of points i and j.
    WorkThresholds(EndRatios, WorkRule, Directions),
    /// Bonds break when their stress reaches this strength, Pa. The stress of a bond is the mean of the
    /// stress measures of the ends that act on the bond.
    Stress(f64, StressRule),
    /// Same as [`Self::Stress`], with the smaller stress threshold of points i and j.
    StressThresholds(StressRule),
}

/// Factors w_c/w on the critical work at points i and j, see [`ToughnessByDirection`]. The factors depend on
/// the direction of the bond. `None` if the fracture energy of neither body depends on the direction. The
/// factors multiply work thresholds; their square roots multiply stretch thresholds.
pub type Directions = Option<[ToughnessByDirection; 2]>;

/// Factors that convert work thresholds or stretch thresholds to the ends of a bond. Entry `[e][k]` converts
/// the threshold of point k to end e.
pub type EndRatios = [[f64; 2]; 2];

/// Conversion of the critical stretches of points i and j to the critical stretch of their bond, for ends
/// with different horizons, moduli or damage laws.
///
/// End e contributes ½ k_e w_e s² |ξ| to the energy of an elastic bond. Here s is the stretch of the bond,
/// k_e is the stiffness of this end, and w_e is its weight, see [`Weights`]. The weight is 0 beyond the
/// horizon of the end.
///
/// If only end e acted, the bond would break at the stretch m_e = min_k r_ek t_k. The minimum is over the
/// points k of the bond: k = i and k = j. Here t_k is the critical stretch of point k, and r_ek is the factor
/// in [`Self::ratios`].
///
/// The energy of the bond is Σ ½ k_e w_e s² |ξ|, summed over the two ends. The bond breaks when this energy
/// reaches Σ ½ k_e w_e m_e² |ξ|. The critical stretch s is therefore given by s² = Σ k_e w_e m_e²/Σ k_e w_e.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StretchConversion {
    /// Entry `[e][k]` is r_ek. It is the ratio of two critical stretches, which both follow from the fracture
    /// energy of point k: the first with the law, the modulus and the horizon of end e, the second with those
    /// of point k. There are two exceptions. If t_k is given in the deck, r_ek is 1. If t_k does not limit
    /// m_e, r_ek is ∞.
    pub ratios: EndRatios,
    /// Stiffnesses k_e, in any unit.
    pub stiffness: [f64; 2],
}

impl StretchConversion {
    /// Return the critical stretch of each bond, from the critical stretches of points i and j.
    #[inline(always)]
    fn convert(self, [i, j]: [Lanes; 2], weights: Weights) -> Lanes {
        let [[ii, ij], [ji, jj]] = self.ratios;
        let critical_i = (i * ii).min(j * ij);
        let critical_j = (i * ji).min(j * jj);
        let k_i = weights.at_i() * self.stiffness[0];
        let k_j = weights.at_j() * self.stiffness[1];
        ((critical_i * critical_i * k_i + critical_j * critical_j * k_j) / (k_i + k_j)).sqrt()
    }

    /// Return a lower bound on the critical stretch of a bond, from the critical stretches of points i and j.
    /// The bound is valid for any combination of ends that act on the bond.
    #[inline(always)]
    fn smallest(self, [i, j]: [f64; 2]) -> f64 {
        let of_end = |[from_i, from_j]: [f64; 2]| (i * from_i).min(j * from_j);
        of_end(self.ratios[0]).min(of_end(self.ratios[1]))
    }
}

/// Rule for bonds that break when the work done on them reaches a critical value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WorkRule {
    /// Bonds that can break: stretched bonds only, or compressed bonds too.
    pub breakable: BreakableBonds,
    /// Factor c from 0 to 1: work thresholds are multiplied by 1 + c (f − 1), with the
    /// [truncation factor](Law::truncation_factor) f.
    pub family_correction: f64,
    /// Relative displacement on which the force states do work.
    pub measure: WorkMeasure,
}

/// Relative displacement on which the force state of a point does work. For force states along the bond, both
/// variants use the extension of the bond instead.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WorkMeasure {
    /// Y − R ξ with the rotation R of the point's family; rigid rotation does no work.
    Objective,
    /// η = Y − ξ, for small rotations (Willberg et al. 2022, eq. 16).
    Displacement,
}

/// Bonds that the energy and stress criteria can break.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BreakableBonds {
    /// Only bonds that are longer than in the undeformed body.
    Stretched,
    /// Stretched bonds and compressed bonds.
    Any,
}

impl BreakableBonds {
    /// Combine the settings of two blocks for the bonds between them. Compressed bonds break only if both
    /// settings allow it.
    pub fn of_both(self, other: Self) -> Self {
        match self {
            Self::Any => other,
            Self::Stretched => self,
        }
    }

    /// Return `bits` after clearing the bits of all bonds that cannot break with this setting.
    #[inline(always)]
    fn select<const D: usize>(self, bits: u8, bond: &Bond<D>) -> u8 {
        match self {
            Self::Stretched => bits & bond.relative_square_extension.above(0.0),
            Self::Any => bits,
        }
    }
}

/// Data that criteria read at both ends of eight bonds. The laws and the point numbers ([`Law::Point`]),
/// which criteria also read, are not part of this struct.
#[derive(Clone, Copy)]
pub struct Ends<'a> {
    /// Data of points i and j.
    pub limits: [&'a Limits; 2],
    /// Influence function times volume correction of the bonds.
    pub weights: Weights,
}

/// Data at one end of eight bonds. Only criteria read these data.
#[derive(Debug, Clone, Copy)]
pub struct Limits {
    /// Stretches, works (J/m⁶) or stresses (Pa) at which the bonds of the points break.
    pub thresholds: Lanes,
    /// [`Law::truncation_factor`] of the points.
    pub truncation_factors: Lanes,
    /// Stress measure that the criterion reads, Pa; −∞ for points that carry no stress.
    pub stresses: Lanes,
}

impl Limits {
    /// Placeholder for criteria that read no limits.
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
    /// Whether the criterion reads the thresholds of both points.
    #[inline(always)]
    pub fn reads_thresholds(&self) -> bool {
        matches!(
            *self,
            Self::Thresholds(..)
                | Self::ThresholdsBetween(..)
                | Self::WorkThresholds(..)
                | Self::StressThresholds(_)
        )
    }

    /// Whether the criterion reads the truncation factors of the points.
    #[inline(always)]
    pub fn reads_truncation_factors(&self) -> bool {
        match *self {
            Self::Work(_, rule) | Self::WorkThresholds(_, rule, _) => rule.corrects(),
            _ => false,
        }
    }

    /// Whether the criterion reads the rotations of the families of points i and j.
    #[inline(always)]
    pub fn reads_rotations(&self) -> bool {
        match *self {
            Self::Work(_, rule) | Self::WorkThresholds(_, rule, _) => {
                rule.measure == WorkMeasure::Objective
            }
            _ => false,
        }
    }

    /// Stress measure that the criterion reads, if any.
    #[inline(always)]
    pub fn stress_measure(&self) -> Option<StressMeasure> {
        match *self {
            Self::Stress(_, rule) | Self::StressThresholds(rule) => Some(rule.measure),
            _ => None,
        }
    }

    /// Whether the criterion reads the work of the force states.
    #[inline(always)]
    pub fn reads_work(&self) -> bool {
        matches!(*self, Self::Work(..) | Self::WorkThresholds(..))
    }

    /// Limit of |x|: bonds above this limit are marked in [`Bond::beyond_series`]. x is the relative square
    /// extension, see [`crate::material::bond`]. If [`Self::marks_all`] is true, only marked bonds break.
    #[inline(always)]
    pub fn limit(&self) -> f64 {
        match *self {
            // `next_down` lowers the limit to the next smaller number: only bonds above the limit are tested,
            // and a bond at exactly the critical stretch must break.
            Self::Stretch(critical) => NEAR.min(relative_square_extension_of(critical).next_down()),
            // The margin of 1e-12 covers the round-off by which this bound and the threshold of a bond
            // differ.
            Self::StretchBetween(critical, conversion) => {
                let smallest = conversion.smallest(critical) * (1.0 - 1e-12);
                NEAR.min(relative_square_extension_of(smallest))
            }
            _ => NEAR,
        }
    }

    /// Test whether only bonds with |x| above [`Self::limit`] break. x is the relative square extension.
    /// `scaled` is true for laws that scale thresholds.
    #[inline(always)]
    pub fn marks_all(&self, scaled: bool) -> bool {
        match *self {
            Self::Never => true,
            Self::Stretch(_) | Self::StretchBetween(..) => !scaled,
            _ => false,
        }
    }

    /// Return one bit per bond, set if the bond meets the criterion. `laws` are the laws of points i and j.
    /// `points` are the point numbers ([`Law::Point`]) of points i and j. `work` (J/m⁶) is read only if
    /// [`Self::reads_work`] is true.
    #[inline(always)]
    pub fn breaking<S: Simd, L: Law<D>, const D: usize>(
        &self,
        simd: S,
        bond: &Bond<D>,
        (laws, points): (&[L; 2], [&L::Point; 2]),
        ends: Ends<'_>,
        work: Lanes,
    ) -> u8 {
        match *self {
            Self::Never => 0,
            // Only bonds with |x| above the limit break, and none of these eight bonds has such an |x|.
            Self::Stretch(_) if !L::SCALED && bond.beyond_series == 0 => 0,
            Self::Stretch(critical) if !L::SCALED => simd.at_least(
                bond.relative_square_extension,
                Lanes::splat(relative_square_extension_of(critical)),
            ),
            Self::Work(_, rule) | Self::WorkThresholds(_, rule, _) => {
                let [i, j] = ends.weights.acting();
                let spent = simd.at_least(work, self.threshold(simd, bond, ends, None)) & (i | j);
                rule.breakable.select(spent, bond)
            }
            // The points of laws with forces along the bonds have no stress.
            Self::Stress(..) | Self::StressThresholds(_) if L::Force::CENTRAL => 0,
            Self::Stress(_, rule) | Self::StressThresholds(rule) => {
                let [i, j] = ends.limits;
                let (stress, acting) = simd.aside(MeanStress::new(
                    simd,
                    [i.stresses, j.stresses],
                    ends.weights.acting(),
                ));
                let reached =
                    simd.at_least(stress, self.threshold(simd, bond, ends, None)) & acting;
                rule.breakable.select(reached, bond)
            }
            Self::StretchBetween(..) if !L::SCALED && bond.beyond_series == 0 => 0,
            Self::Stretch(_)
            | Self::Thresholds(..)
            | Self::StretchBetween(..)
            | Self::ThresholdsBetween(..) => {
                let scale = if L::SCALED {
                    Some(laws[0].toughness_scale(bond, points, &laws[1]))
                } else {
                    None
                };
                let threshold = self.threshold(simd, bond, ends, scale);
                let threshold = threshold * (Lanes::splat(2.0) + threshold);
                simd.at_least(bond.relative_square_extension, threshold)
            }
        }
    }

    /// Return the stretch, work or stress at which each bond breaks. `scale` is the factor
    /// [`Law::toughness_scale`] on stretch thresholds; `None` for laws that do not scale them.
    #[inline(always)]
    fn threshold<S: Simd, const D: usize>(
        &self,
        simd: S,
        bond: &Bond<D>,
        ends: Ends<'_>,
        scale: Option<Lanes>,
    ) -> Lanes {
        match *self {
            Self::Never => Lanes::splat(f64::INFINITY),
            Self::Stretch(critical) => match scale {
                Some(scale) => Lanes::splat(critical) * scale,
                None => Lanes::splat(critical),
            },
            Self::Stress(critical, _) => Lanes::splat(critical),
            Self::StressThresholds(_) => (ends.limits[0].thresholds).min(ends.limits[1].thresholds),
            Self::Work([i, j], rule) => {
                rule.sum_of_acting(simd, [Lanes::splat(i), Lanes::splat(j)], ends)
            }
            Self::StretchBetween(critical, conversion) => {
                let both = [Lanes::splat(critical[0]), Lanes::splat(critical[1])];
                let threshold = conversion.convert(both, ends.weights);
                match scale {
                    Some(scale) => threshold * scale,
                    None => threshold,
                }
            }
            Self::Thresholds(ref directions) | Self::ThresholdsBetween(_, ref directions) => {
                let (mut threshold_i, mut threshold_j) =
                    (ends.limits[0].thresholds, ends.limits[1].thresholds);
                if let Some(scale) = scale {
                    threshold_i = threshold_i * scale;
                    threshold_j = threshold_j * scale;
                }
                if let Some(directions) = directions {
                    let [factor_i, factor_j] =
                        simd.aside(DirectionFactors::new(simd, directions, bond));
                    threshold_i = threshold_i * factor_i.sqrt();
                    threshold_j = threshold_j * factor_j.sqrt();
                }
                match *self {
                    Self::ThresholdsBetween(conversion, _) => {
                        conversion.convert([threshold_i, threshold_j], ends.weights)
                    }
                    _ => threshold_i.min(threshold_j),
                }
            }
            Self::WorkThresholds([[ii, ij], [ji, jj]], rule, ref directions) => {
                let (mut i, mut j) = (ends.limits[0].thresholds, ends.limits[1].thresholds);
                if let Some(directions) = directions {
                    let [factor_i, factor_j] =
                        simd.aside(DirectionFactors::new(simd, directions, bond));
                    i = i * factor_i;
                    j = j * factor_j;
                }
                let critical_i = (i * ii).min(j * ij) * 0.5;
                let critical_j = (i * ji).min(j * jj) * 0.5;
                rule.sum_of_acting(simd, [critical_i, critical_j], ends)
            }
        }
    }

    /// Return the overshoot energy of each broken bond, as a fraction of the energy of the bond. The
    /// overshoot energy is the part of the energy above the threshold. The fraction is 1 − (s_c/s)²,
    /// 1 − w_c/w or 1 − (σ_c/σ)², at least 0. s, w and σ are the stretch, work and stress of the bond, and
    /// s_c, w_c and σ_c are their thresholds. Bonds exceed the threshold because the criterion is checked
    /// only once per step. Criteria of stretch read [`Bond::stretch`] and `scale`. `scale` is the factor
    /// [`Law::toughness_scale`] on stretch thresholds; `None` for laws that do not scale them.
    #[inline(always)]
    pub fn overshoot<S: Simd, const D: usize>(
        &self,
        simd: S,
        bond: &Bond<D>,
        ends: Ends<'_>,
        scale: Option<Lanes>,
        work: Lanes,
    ) -> Lanes {
        let threshold = self.threshold(simd, bond, ends, scale);
        let ratio = if self.reads_work() {
            threshold / work
        } else {
            let reached = match *self {
                Self::Stress(..) | Self::StressThresholds(_) => {
                    let [i, j] = ends.limits;
                    MeanStress::new(simd, [i.stresses, j.stresses], ends.weights.acting())
                        .run(simd)
                        .0
                }
                _ => bond.stretch,
            };
            let ratio = threshold / reached;
            ratio * ratio
        };
        (Lanes::splat(1.0) - ratio).max(Lanes::splat(0.0))
    }
}

impl WorkRule {
    /// Combine the rules of two blocks for the bonds between them. Compressed bonds break only if both rules
    /// allow it. [`Self::family_correction`] of the combined rule is the smaller of the two factors. The work
    /// is objective if at least one rule requires objective work.
    pub fn of_both(self, other: Self) -> Self {
        Self {
            breakable: self.breakable.of_both(other.breakable),
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

    /// Return the critical work of bonds (J/m⁶): the sum of the [corrected](Self::corrected) shares of the
    /// acting ends. `i` and `j` are the uncorrected shares of points i and j. The sum is written out, because
    /// array methods are not always inlined. Without inlining, all data of a bond stay in memory instead of
    /// registers.
    #[inline(always)]
    fn sum_of_acting<S: Simd>(self, simd: S, [i, j]: [Lanes; 2], ends: Ends<'_>) -> Lanes {
        let [acts_i, acts_j] = ends.weights.acting();
        let critical_i = simd.keep(self.corrected(i, ends.limits[0]), acts_i);
        let critical_j = simd.keep(self.corrected(j, ends.limits[1]), acts_j);
        critical_i + critical_j
    }

    /// Return the share of an end in the critical work (J/m⁶), corrected by [`Self::family_correction`].
    /// `critical` is the share without this correction.
    #[inline(always)]
    fn corrected(self, critical: Lanes, end: &Limits) -> Lanes {
        if !self.corrects() {
            return critical;
        }
        let share = self.family_correction;
        critical * (end.truncation_factors * share + Lanes::splat(1.0 - share))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn between_two_bodies_the_smaller_correction_counts() {
        let rule = |breakable, family_correction| WorkRule {
            breakable,
            family_correction,
            measure: WorkMeasure::Objective,
        };
        let both = rule(BreakableBonds::Any, 1.0).of_both(rule(BreakableBonds::Stretched, 0.5));
        assert_eq!(both, rule(BreakableBonds::Stretched, 0.5));
        let both = rule(BreakableBonds::Any, 0.0).of_both(rule(BreakableBonds::Any, 1.0));
        assert_eq!(both, rule(BreakableBonds::Any, 0.0));
    }
}
