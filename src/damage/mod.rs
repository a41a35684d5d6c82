//! Damage laws, one a file: when a bond breaks.

mod bond_energy;
mod criterion;
mod critical_stretch;
mod pull_apart;

pub use bond_energy::{BondEnergy, Calibration};
pub use criterion::{
    Criterion, Ends, HorizonRatios, Limits, Sense, StretchConversion, WorkMeasure, WorkRule,
};
pub use critical_stretch::CriticalStretch;

/// The damage law of a block.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DamageLaw {
    /// By the stretch of bonds.
    CriticalStretch(CriticalStretch),
    /// By the work that bonds have taken.
    BondEnergy(BondEnergy),
}

impl DamageLaw {
    /// The stretch or work (J/m⁶) at which bonds of the undeformed body break.
    pub fn critical(&self) -> f64 {
        match self {
            Self::CriticalStretch(law) => law.critical,
            Self::BondEnergy(law) => law.critical,
        }
    }

    /// α: how much the smallest stretch of a point moves its threshold.
    pub fn alpha(&self) -> f64 {
        match self {
            Self::CriticalStretch(law) => law.alpha,
            Self::BondEnergy(law) => law.alpha,
        }
    }

    /// The share of [`WorkRule::family_correction`].
    pub fn family_correction(&self) -> f64 {
        match self {
            Self::CriticalStretch(_) => 0.0,
            Self::BondEnergy(law) => law.rule.family_correction,
        }
    }

    /// Whether bonds break by the work of their force states on more than the rotation of their points' families.
    pub fn is_objective_work(&self) -> bool {
        match self {
            Self::CriticalStretch(_) => false,
            Self::BondEnergy(law) => law.rule.measure == WorkMeasure::Objective,
        }
    }

    /// The threshold of a point whose intact bonds have this smallest stretch.
    #[inline(always)]
    pub fn threshold(&self, smallest: f64) -> f64 {
        match self {
            Self::CriticalStretch(law) => law.threshold(smallest),
            Self::BondEnergy(law) => law.threshold(smallest),
        }
    }
}
