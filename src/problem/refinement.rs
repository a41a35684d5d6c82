//! Finer grids in parts of the bodies.

use std::ops::Range;

use crate::expression::Expression;

use super::InterfaceRule;

/// Refinement of the grid (Dipasquale et al. 2014, §2).
#[derive(Debug, Clone)]
pub struct Refinement {
    /// Where it stands in the deck.
    pub span: Range<usize>,
    /// The finest level: the spacing there is that of the grid divided by 2^levels.
    pub levels: u32,
    /// The horizons of the levels.
    pub rule: HorizonRule,
    /// What the horizon of points is multiplied by that have a coarser level within it.
    pub interface_factor: f64,
    /// Which horizons the bonds between points of one body with different ones have: each end its own, or both the
    /// mean.
    pub bonds: InterfaceRule,
    /// What is refined from the start.
    pub regions: Vec<RefinedRegion>,
    /// What is refined during the run, if anything.
    pub trigger: Option<Trigger>,
}

/// What makes the points within the horizon of a point be refined, one level at a time; any of them.
#[derive(Debug, Clone)]
pub struct Trigger {
    /// Where it stands in the deck.
    pub span: Range<usize>,
    /// Steps between looks.
    pub every_steps: u64,
    /// Least strain energy density, as a share of the largest of all points.
    pub energy: Option<f64>,
    /// Least damage.
    pub damage: Option<f64>,
    /// A condition on reference position and time.
    pub condition: Option<Expression>,
    /// Which points can be triggers at all, by reference position and time.
    pub only: Option<Expression>,
    /// Time (s) out of reach of triggers, and of points that miss bonds, after which points become coarser again;
    /// never if not given.
    pub coarsen_after: Option<f64>,
}

/// How the horizon goes with the spacing from level to level.
#[derive(Debug, Clone, PartialEq)]
pub enum HorizonRule {
    /// δ convergence: m = δ/dx is the same.
    Delta,
    /// δm convergence: m of each level from 1 on.
    DeltaM(Vec<f64>),
}

/// Points that are refined from the start.
#[derive(Debug, Clone)]
pub struct RefinedRegion {
    /// Its name.
    pub name: String,
    /// Where it stands in the deck.
    pub span: Range<usize>,
    /// Points of lower levels are refined until they have this level.
    pub level: u32,
    /// Which points, by reference position.
    pub condition: Expression,
}
