//! Damage laws: criteria that break bonds.

mod bond_energy;
mod criterion;
mod critical_stretch;
mod direction;
mod pull_apart;
mod stress;

pub use bond_energy::{BondEnergy, Calibration};
pub use criterion::{
    BreakableBonds, Criterion, Directions, EndRatios, Ends, Limits, StretchConversion, WorkMeasure,
    WorkRule,
};
pub use critical_stretch::CriticalStretch;
pub use direction::ToughnessByDirection;
pub use stress::{StressLimit, StressMeasure, StressRule};

/// The damage law of a block.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DamageLaw {
    /// Bonds break by their stretch.
    CriticalStretch(CriticalStretch),
    /// Bonds break by the work of their force states.
    BondEnergy(BondEnergy),
    /// Bonds break by the stress of their points.
    Stress(StressLimit),
}

impl DamageLaw {
    /// Return the critical stretch, the critical work (J/m⁶) or the strength (Pa), without the effects of
    /// [α](Self::alpha) and of scatter.
    pub fn critical(&self) -> f64 {
        match self {
            Self::CriticalStretch(law) => law.critical,
            Self::BondEnergy(law) => law.critical,
            Self::Stress(law) => law.strength,
        }
    }

    /// Factor α in the threshold of a point; 0 for the stress criterion. α multiplies the smallest stretch of
    /// the point's intact bonds. See [`CriticalStretch::threshold`] and [`BondEnergy::threshold`].
    pub fn alpha(&self) -> f64 {
        match self {
            Self::CriticalStretch(law) => law.alpha,
            Self::BondEnergy(law) => law.alpha,
            Self::Stress(_) => 0.0,
        }
    }

    /// The factor [`WorkRule::family_correction`]; 0 for the stretch criterion and the stress criterion.
    pub fn family_correction(&self) -> f64 {
        match self {
            Self::CriticalStretch(_) | Self::Stress(_) => 0.0,
            Self::BondEnergy(law) => law.rule.family_correction,
        }
    }

    /// Whether bonds break at a critical work that is measured such that rigid rotation does no work
    /// ([`WorkMeasure::Objective`]).
    pub fn is_objective_work(&self) -> bool {
        match self {
            Self::CriticalStretch(_) | Self::Stress(_) => false,
            Self::BondEnergy(law) => law.rule.measure == WorkMeasure::Objective,
        }
    }

    /// Stress measure that breaks bonds; `None` for the other criteria.
    pub fn stress_measure(&self) -> Option<StressMeasure> {
        match self {
            Self::Stress(law) => Some(law.rule.measure),
            Self::CriticalStretch(_) | Self::BondEnergy(_) => None,
        }
    }

    /// Return the threshold of a point: a stretch, a work (J/m⁶) or a stress (Pa). `strength_factor` is the
    /// random factor of the point, 1 without scatter, and `smallest` is the smallest stretch of its intact
    /// bonds.
    #[inline(always)]
    pub fn threshold(&self, strength_factor: f64, smallest: f64) -> f64 {
        match self {
            Self::CriticalStretch(law) => law.threshold(strength_factor, smallest),
            Self::BondEnergy(law) => law.threshold(strength_factor, smallest),
            Self::Stress(law) => strength_factor * law.strength,
        }
    }
}
