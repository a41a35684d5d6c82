//! Which law and failure rule the bonds of a family have.

use crate::damage::CriticalStretch;
use crate::families::Family;
use crate::material::{AnyLaw, LinearMicroelastic, Normalised, Ordinary, Pmb};

/// The laws of a family's bonds, at the own and at the far end.
#[derive(Debug, Clone, Copy)]
pub enum FamilyLaw {
    /// Prototype or proportional microelastic.
    Pmb([Pmb; 2]),
    /// With a micromodulus for each point.
    Normalised([Normalised; 2]),
    /// Linear microelastic.
    LinearMicroelastic([LinearMicroelastic; 2]),
    /// Ordinary state-based.
    Ordinary([Ordinary; 2]),
    /// Different laws at the two ends.
    Any([AnyLaw; 2]),
}

impl FamilyLaw {
    /// From the laws of the own and the far end. Where any block has states, laws without are taken
    /// as [`AnyLaw`], so that fewer versions of the loops suffice.
    pub fn new(here: AnyLaw, there: AnyLaw, with_states: bool) -> Self {
        match (here, there) {
            (AnyLaw::Ordinary(here), AnyLaw::Ordinary(there)) => Self::Ordinary([here, there]),
            _ if with_states => Self::Any([here, there]),
            (AnyLaw::Pmb(here), AnyLaw::Pmb(there)) => Self::Pmb([here, there]),
            (AnyLaw::Normalised(here), AnyLaw::Normalised(there)) => {
                Self::Normalised([here, there])
            }
            (AnyLaw::LinearMicroelastic(here), AnyLaw::LinearMicroelastic(there)) => {
                Self::LinearMicroelastic([here, there])
            }
            _ => Self::Any([here, there]),
        }
    }
}

/// When a family's bonds break.
#[derive(Debug, Clone, Copy)]
pub enum FamilyFailure {
    /// Never.
    Never,
    /// At this stretch.
    Uniform(f64),
    /// At the smaller of the thresholds of the two points; the critical stretches of their blocks
    /// are the part that a law may scale, 0 where a block has none.
    PerPoint([f64; 2]),
}

/// A family with its law and failure.
pub struct Bonds {
    /// The bonds.
    pub family: Family,
    /// Their law.
    pub law: FamilyLaw,
    /// When they break.
    pub failure: FamilyFailure,
}

/// What a block's points follow.
#[derive(Debug, Clone, Copy)]
pub struct BlockLaws {
    /// The material law.
    pub law: AnyLaw,
    /// The damage law, if bonds can break.
    pub damage: Option<CriticalStretch>,
}

/// Runs code for whichever law a family has; monomorphised for each.
macro_rules! with_laws {
    ($law:expr, $laws:ident => $body:expr) => {
        match $law {
            $crate::solver::laws::FamilyLaw::Pmb($laws) => $body,
            $crate::solver::laws::FamilyLaw::Normalised($laws) => $body,
            $crate::solver::laws::FamilyLaw::LinearMicroelastic($laws) => $body,
            $crate::solver::laws::FamilyLaw::Ordinary($laws) => $body,
            $crate::solver::laws::FamilyLaw::Any($laws) => $body,
        }
    };
}
pub(super) use with_laws;
