//! The bonds between two blocks with the laws that they follow.

use crate::damage::{Criterion, DamageLaw};
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
    /// Whether the weights of the bonds are their influence, and not shares of volume.
    pub influence: bool,
}

/// What the points of a block follow.
#[derive(Debug, Clone, Copy)]
pub struct BlockLaws {
    /// The material law.
    pub law: AnyLaw,
    /// The damage law, if bonds can break.
    pub damage: Option<DamageLaw>,
}
