//! The bonds between two blocks with the laws that they follow.

use crate::damage::{Criterion, CriticalStretch};
use crate::families::BlockBonds;
use crate::material::{AnyLaw, PairLaw};

/// The bonds between two blocks, their laws, and when they break.
pub struct Interaction {
    /// The bonds.
    pub bonds: BlockBonds,
    /// The laws of both ends.
    pub laws: PairLaw,
    /// When bonds break.
    pub criterion: Criterion,
}

/// What the points of a block follow.
#[derive(Debug, Clone, Copy)]
pub struct BlockLaws {
    /// The material law.
    pub law: AnyLaw,
    /// The damage law, if bonds can break.
    pub damage: Option<CriticalStretch>,
}
