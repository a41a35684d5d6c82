//! Finer grids in parts of the bodies.

use std::ops::Range;

use crate::expression::Expression;

use super::{InterfaceRule, Problem};

/// Refinement of the grid (Dipasquale et al. 2014, §2).
#[derive(Debug, Clone)]
pub struct Refinement {
    /// Its span in the deck.
    pub span: Range<usize>,
    /// The finest level; its spacing is the spacing of the grid divided by 2^levels.
    pub levels: u32,
    /// The horizons of the levels.
    pub rule: HorizonRule,
    /// Factor on the horizon of points with a coarser level inside their horizon.
    pub interface_factor: f64,
    /// Horizon of bonds between points of one body with different horizons: each end uses its own, or both use the
    /// mean.
    pub bonds: InterfaceRule,
    /// Regions that are refined from the start.
    pub regions: Vec<RefinedRegion>,
    /// Criteria of refinement during the run, if there are any.
    pub trigger: Option<Trigger>,
}

/// Criteria that make a point a trigger; one is enough. All points within the horizon of a trigger are refined, one
/// level at a time.
#[derive(Debug, Clone)]
pub struct Trigger {
    /// Its span in the deck.
    pub span: Range<usize>,
    /// Steps between evaluations of the criteria.
    pub every_steps: u64,
    /// Smallest strain energy density of a trigger, as a fraction of the maximum over all points.
    pub energy: Option<f64>,
    /// Smallest damage of a trigger.
    pub damage: Option<f64>,
    /// A condition on reference position and time.
    pub condition: Option<Expression>,
    /// A condition on reference position and time that every trigger must fulfil.
    pub only: Option<Expression>,
    /// Time (s) after which points become coarser again if no trigger and no point with broken bonds is in reach; never
    /// if not given.
    pub coarsen_after: Option<f64>,
}

/// How the horizon depends on the spacing of a level.
#[derive(Debug, Clone, PartialEq)]
pub enum HorizonRule {
    /// δ convergence: m = δ/dx is the same on all levels.
    Delta,
    /// δm convergence: m of each level from 1 on.
    DeltaM(Vec<f64>),
}

/// Points that are refined from the start.
#[derive(Debug, Clone)]
pub struct RefinedRegion {
    /// Its name.
    pub name: String,
    /// Its span in the deck.
    pub span: Range<usize>,
    /// Points of lower levels are refined until they have this level.
    pub level: u32,
    /// Condition on the reference position that selects the points.
    pub condition: Expression,
}

impl Problem {
    /// Criteria of refinement during the run, if there are any.
    pub fn refinement_trigger(&self) -> Option<&Trigger> {
        let refinement = self.refinement.as_ref();
        refinement.and_then(|refinement| refinement.trigger.as_ref())
    }

    /// Whether grids are coarsened again during the run.
    pub fn may_coarsen(&self) -> bool {
        let trigger = self.refinement_trigger();
        trigger.is_some_and(|trigger| trigger.coarsen_after.is_some())
    }
}
