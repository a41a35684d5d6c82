//! The bonds between two blocks with the laws that they follow.

use crate::damage::{Criterion, DamageLaw};
use crate::families::BlockBonds;
use crate::material::{AnyLaw, PairLaw};
use crate::scatter::Weibull;

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
    /// Scatter of the strength of the points, if there is any.
    pub weibull: Option<Weibull>,
    /// What bonds to other bodies read that have damage of their own.
    pub pairs: PairReads,
}

/// What the criteria of bonds read that have the damage of a pair of bodies.
#[derive(Debug, Clone, Copy, Default)]
pub struct PairReads {
    /// Some of the bonds can break.
    pub breaks: bool,
    /// Truncation factors are read.
    pub truncation_factors: bool,
    /// Rotations are read.
    pub rotations: bool,
}

impl PairReads {
    /// Add what a damage law reads.
    pub fn add(&mut self, law: &DamageLaw) {
        self.breaks = true;
        self.truncation_factors |= law.family_correction() > 0.0;
        self.rotations |= law.is_objective_work();
    }
}

impl BlockLaws {
    /// Whether any bonds of the points can break.
    pub fn has_breakable_bonds(&self) -> bool {
        self.damage.is_some() || self.pairs.breaks
    }

    /// Whether the points have thresholds of their own.
    pub fn has_thresholds(&self) -> bool {
        self.weibull.is_some() || self.follows_smallest_stretch()
    }

    /// Whether the thresholds of the points change with the smallest stretches of their families.
    pub fn follows_smallest_stretch(&self) -> bool {
        self.damage.is_some_and(|law| law.alpha() > 0.0)
    }
}
