//! Which law and failure rule the bonds of a list have.

use crate::damage::CriticalStretch;
use crate::families::BondList;
use crate::material::{AnyLaw, LinearMicroelastic, Normalised, Ordinary, Pmb};

/// The laws of a list's bonds, at the own and at the far end.
#[derive(Debug, Clone, Copy)]
pub enum ListLaw {
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

impl ListLaw {
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

/// When a list's bonds break.
#[derive(Debug, Clone, Copy)]
pub enum ListFailure {
    /// Never.
    Never,
    /// At this stretch.
    Uniform(f64),
    /// At the smaller of the thresholds of the two points; the critical stretches of their blocks
    /// are the part that a law may scale, 0 where a block has none.
    PerPoint([f64; 2]),
}

/// A list with its law and failure.
pub struct Bonds {
    /// The bonds.
    pub list: BondList,
    /// Their law.
    pub law: ListLaw,
    /// When they break.
    pub failure: ListFailure,
}

/// What a block's points follow.
#[derive(Debug, Clone, Copy)]
pub struct BlockLaws {
    /// The material law.
    pub law: AnyLaw,
    /// The damage law, if bonds can break.
    pub damage: Option<CriticalStretch>,
}

/// Runs code for whichever law a list has; monomorphised for each.
macro_rules! with_laws {
    ($law:expr, $laws:ident => $body:expr) => {
        match $law {
            $crate::solver::laws::ListLaw::Pmb($laws) => $body,
            $crate::solver::laws::ListLaw::Normalised($laws) => $body,
            $crate::solver::laws::ListLaw::LinearMicroelastic($laws) => $body,
            $crate::solver::laws::ListLaw::Ordinary($laws) => $body,
            $crate::solver::laws::ListLaw::Any($laws) => $body,
        }
    };
}
pub(super) use with_laws;
