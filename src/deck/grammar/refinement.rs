//! Finer grids in parts of the bodies.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Count, Tables};
use crate::deck::number::Number;
use crate::deck::spanned::Spanned;

/// Refinement: points of bodies given as shapes get new ones around them at half the spacing, level by
/// level; neighbours differ by one level at most.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Refinement {
    /// The finest level: the spacing there is that of the grid divided by 2^levels.
    pub levels: Spanned<u64>,
    /// How horizons go with the spacing: `"delta"`, m = δ/dx stays, or `"delta-m"`, m rises.
    #[serde(default)]
    pub rule: HorizonRule,
    /// With `"delta-m"`: m of the levels from 1 on; by 1 more from level to level if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub m: Option<Spanned<Vec<Number>>>,
    /// What the horizon of points is multiplied by that have a coarser level within it, so that their
    /// families do not lose volume; √2 with `"delta"` and 1 with `"delta-m"` if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub interface_factor: Option<Number>,
    /// The bonds between levels: `"own"`, each end exerts its half with its own horizon, or `"average"`, both have
    /// the mean of the horizons.
    #[serde(default)]
    pub bonds: LevelBonds,
    /// What is refined from the start, by any name.
    #[serde(default)]
    pub region: Tables<RefinedRegion>,
    /// What is refined during the run; nothing if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub trigger: Option<Spanned<Trigger>>,
}

/// Points that make all within their horizon be refined, one level at a time; at least one of `energy`,
/// `damage` and `where`, any of which is enough.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Trigger {
    /// Steps between looks; 20 if not given.
    #[serde(default = "default_look")]
    pub every_steps: Spanned<Count>,
    /// The strain energy density, as a share of the largest of all points at that moment.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub energy: Option<Number>,
    /// The damage.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub damage: Option<Number>,
    /// A condition on the reference position and t.
    #[serde(rename = "where", skip_serializing_if = "Option::is_none")]
    pub condition: Option<Number>,
    /// A condition on the reference position and t without which a point is no trigger.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub only: Option<Number>,
    /// Time (s) out of reach of triggers, and of points that miss bonds, after which points become coarser again, by
    /// one level at a look; never if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub coarsen_after: Option<Number>,
}

fn default_look() -> Spanned<Count> {
    Spanned::new(0..0, Count::new(20))
}

/// How the horizon goes with the spacing from level to level.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum HorizonRule {
    /// δ/dx stays.
    #[default]
    Delta,
    /// δ/dx rises with the level.
    DeltaM,
}

/// Which horizons the bonds between levels have.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum LevelBonds {
    /// Each end its own.
    #[default]
    Own,
    /// Both ends the mean.
    Average,
}

/// Points that are refined from the start.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RefinedRegion {
    /// A condition on the reference position.
    #[serde(rename = "where")]
    pub condition: Number,
    /// The level that points there get at least; the finest if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub level: Option<Spanned<u64>>,
}
