//! Finer grids in parts of the bodies.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Count, Tables};
use crate::deck::number::Number;
use crate::deck::spanned::Spanned;

/// Refinement of bodies given as shapes: around selected points, new points are inserted at half the spacing,
/// level by level. Neighbours differ by at most one level.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Refinement {
    /// The finest level; its spacing is the spacing of level 0 divided by 2^levels.
    pub levels: Spanned<u64>,
    /// How the horizon depends on the spacing: with `"delta"`, m = δ/dx is constant; with `"delta-m"`, m
    /// rises with the level.
    #[serde(default)]
    pub rule: HorizonRule,
    /// With `"delta-m"`: m = δ/dx of each level, from level 1 on. If not given, m rises by 1 from level to
    /// level.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub m: Option<Spanned<Vec<Number>>>,
    /// Factor on the horizon of points that have points of a coarser level inside their horizon. Without this
    /// factor, these points may have too few neighbours. The default is √2 with `rule = "delta"`, and 1
    /// with `rule = "delta-m"`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub interface_factor: Option<Number>,
    /// Horizon in the force of a bond between two levels. With `"own"`, each end uses its own horizon for its
    /// half of the force. With `"average"`, both ends use the mean of the two horizons.
    #[serde(default)]
    pub bonds: LevelBonds,
    /// Regions that are refined from the start; each region has a freely chosen name.
    #[serde(default)]
    pub region: Tables<RefinedRegion>,
    /// Criteria of refinement during the run; no refinement during the run if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub trigger: Option<Spanned<Trigger>>,
}

/// Triggers of refinement: all points within the horizon of a trigger point are refined, one level at a time.
/// A point is a trigger if the point fulfils `energy`, `damage` or `where`. At least one of these keys must
/// be given.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Trigger {
    /// Steps between evaluations of the criteria; 20 if not given.
    #[serde(default = "default_interval")]
    pub every_steps: Spanned<Count>,
    /// Smallest strain energy density at which a point is a trigger, as a fraction of the current maximum
    /// over all points.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub energy: Option<Number>,
    /// Smallest damage at which a point is a trigger.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub damage: Option<Number>,
    /// A condition on the reference position and t; a point that fulfils the condition is a trigger.
    #[serde(rename = "where", skip_serializing_if = "Option::is_none")]
    pub condition: Option<Number>,
    /// A condition on the reference position and t that every trigger must fulfil.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub only: Option<Number>,
    /// Time in s after which refined points are coarsened. A point is coarsened if, for this time, it has
    /// been outside the horizons of all triggers and of all points with broken bonds. Each evaluation of the
    /// criteria coarsens these points by one level. If not given, points are never coarsened.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub coarsen_after: Option<Number>,
}

fn default_interval() -> Spanned<Count> {
    Spanned::new(0..0, Count::new(20))
}

/// How the horizon depends on the spacing of a level.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum HorizonRule {
    /// δ/dx is the same on all levels.
    #[default]
    Delta,
    /// δ/dx rises with the level.
    DeltaM,
}

/// Horizons of the bonds between levels.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum LevelBonds {
    /// Each end uses its own horizon.
    #[default]
    Own,
    /// Both ends use the mean of their two horizons.
    Average,
}

/// Points that are refined from the start.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RefinedRegion {
    /// A condition on the reference position that selects the points.
    #[serde(rename = "where")]
    pub condition: Number,
    /// Lowest level of points in this region; the finest level if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub level: Option<Spanned<u64>>,
}
