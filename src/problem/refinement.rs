//! Settings of finer grids in parts of the bodies.

use std::ops::Range;

use crate::expression::Expression;

use super::{InterfaceRule, Problem};

/// Settings of refinement (Dipasquale et al. 2014, §2).
#[derive(Debug, Clone)]
pub struct Refinement {
    /// Span in the deck.
    pub span: Range<usize>,
    /// The finest level. Its spacing is the spacing of the grid divided by 2^`levels`.
    pub levels: u32,
    /// Rule for the horizons of the levels.
    pub rule: HorizonRule,
    /// Factor on the horizon of each point that has points of a coarser level inside its horizon.
    pub interface_factor: f64,
    /// Rule for bonds between two points of one body, if the two points have different horizons: each end
    /// uses its own horizon, or both ends use the mean of the two horizons.
    pub bonds: InterfaceRule,
    /// Regions that are refined from the start.
    pub regions: Vec<RefinedRegion>,
    /// Criteria of refinement during the run; `None` without them.
    pub trigger: Option<Trigger>,
}

/// Criteria of refinement during the run. A point triggers refinement if it fulfils [`Self::only`] and at
/// least one of [`Self::energy`], [`Self::damage`] and [`Self::condition`]. All points within the horizon of
/// this point are then refined, one level at a time. Criteria that are `None` are not used.
#[derive(Debug, Clone)]
pub struct Trigger {
    /// Span in the deck.
    pub span: Range<usize>,
    /// Steps between evaluations of the criteria.
    pub every_steps: u64,
    /// Smallest strain energy density that fulfils this criterion, as a fraction of the maximum over all
    /// points.
    pub energy: Option<f64>,
    /// Smallest damage that fulfils this criterion.
    pub damage: Option<f64>,
    /// A condition on reference position and time. A point that fulfils this condition triggers refinement.
    pub condition: Option<Expression>,
    /// A condition on reference position and time that every triggering point must fulfil.
    pub only: Option<Expression>,
    /// Time (s) after which the grid is coarsened at a refined point. During this time, the point must lie
    /// outside the horizons of triggering points and of points with broken bonds. `None` for no coarsening.
    pub coarsen_after: Option<f64>,
}

/// Rule for the horizons of the levels.
#[derive(Debug, Clone, PartialEq)]
pub enum HorizonRule {
    /// δ convergence: the ratio m = δ/dx is the same on all levels.
    Delta,
    /// δm convergence: the ratio m of each level, from level 1 on.
    DeltaM(Vec<f64>),
}

/// A region whose points are refined from the start.
#[derive(Debug, Clone)]
pub struct RefinedRegion {
    /// Name in the deck.
    pub name: String,
    /// Span in the deck.
    pub span: Range<usize>,
    /// Level to which points of lower levels are refined.
    pub level: u32,
    /// Condition on the reference position that selects the points.
    pub condition: Expression,
}

impl Problem {
    /// Return the criteria of refinement during the run; `None` without them.
    pub fn refinement_trigger(&self) -> Option<&Trigger> {
        let refinement = self.refinement.as_ref();
        refinement.and_then(|refinement| refinement.trigger.as_ref())
    }

    /// Test whether grids are coarsened again during the run.
    pub fn may_coarsen(&self) -> bool {
        let trigger = self.refinement_trigger();
        trigger.is_some_and(|trigger| trigger.coarsen_after.is_some())
    }
}
