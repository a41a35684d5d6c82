//! The bonds between two blocks, and their laws.

use crate::damage::{Criterion, DamageLaw, StressMeasure, ToughnessByDirection};
use crate::dimension::Dimension;
use crate::elastic::Isotropic;
use crate::families::BlockBonds;
use crate::material::{AnyLaw, PairLaw};
use crate::scatter::Weibull;

/// The bonds between two blocks, their laws, and their failure criterion.
pub struct Interaction {
    /// The bonds from points of one block to points of the same or another block.
    pub bonds: BlockBonds,
    /// The laws of both ends.
    pub laws: PairLaw,
    /// Failure criterion of the bonds.
    pub criterion: Criterion,
    /// Whether the weights of the bonds contain only the influence function, without volume correction.
    pub no_volume_correction: bool,
}

/// Laws of the points of a block.
#[derive(Debug, Clone, Copy)]
pub struct BlockLaws {
    /// Material law of the block.
    pub law: AnyLaw,
    /// Damage law of the block; `None` for a block without damage.
    pub damage: Option<DamageLaw>,
    /// Whether the material law breaks bonds because of their history.
    pub wears_out: bool,
    /// Scatter of the strength of the points, if there is any.
    pub weibull: Option<Weibull>,
    /// Factor on the critical work, as a function of the direction of a bond; `None` if the factor is 1 in
    /// all directions.
    pub direction: Option<ToughnessByDirection>,
    /// Which data of the block's points the failure criteria of bonds to other bodies read. Only pairs of
    /// bodies with a separate damage law count.
    pub pairs: PairReads,
    /// Dimension of the problem, on which the stress perpendicular to the plane depends.
    pub dimension: Dimension,
    /// Elastic constants; for anisotropic bodies, averages over all directions.
    pub elastic: Isotropic,
}

/// Point data that are read by the failure criteria of bonds between two bodies. Pairs of bodies without a
/// separate damage law are ignored.
#[derive(Debug, Clone, Copy, Default)]
pub struct PairReads {
    /// Whether some of these bonds can break.
    pub breaks: bool,
    /// Whether these criteria read truncation factors.
    pub truncation_factors: bool,
    /// Whether these criteria read rotations.
    pub rotations: bool,
    /// For each stress measure, in the order of [`StressMeasure::ALL`], whether these criteria read it.
    pub stresses: [bool; StressMeasure::ALL.len()],
}

impl PairReads {
    /// Mark the data that a damage law reads, in addition to the data marked before.
    pub fn add(&mut self, law: &DamageLaw) {
        self.breaks = true;
        self.truncation_factors |= law.family_correction() > 0.0;
        self.rotations |= law.is_objective_work();
        if let Some(measure) = law.stress_measure() {
            self.stresses[measure.index()] = true;
        }
    }
}

impl BlockLaws {
    /// Whether bonds of the block's points can break: by the damage law of the block, by the damage law of a
    /// pair of bodies, or because of the bond history.
    pub fn has_breakable_bonds(&self) -> bool {
        self.damage.is_some() || self.pairs.breaks || self.wears_out
    }

    /// Whether thresholds are stored per point. This is the case if they depend on scatter, on the direction
    /// of bonds or on the smallest stretch.
    pub fn has_thresholds(&self) -> bool {
        self.weibull.is_some() || self.direction.is_some() || self.follows_smallest_stretch()
    }

    /// Whether the thresholds of the points change with the smallest stretches of their families.
    pub fn follows_smallest_stretch(&self) -> bool {
        self.damage.is_some_and(|law| law.alpha() > 0.0)
    }
}
