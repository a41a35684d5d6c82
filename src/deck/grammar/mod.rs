//! Grammar of the deck: the keys and values of each section of the TOML file.
//!
//! Any number except counts, levels, ids and seeds may be a string with an expression of the `[parameters]`.
//! All values are in SI units. Unknown keys are errors. A choice, such as the law of a material, is a table
//! with the name of the chosen variant (`[material.glass.pmb]`). The variant is not given as the value of a
//! key, such as `law = "pmb"`, because the deserializer would then lose the locations of the values. Error
//! messages need these locations.

mod bodies;
mod conditions;
mod contact;
mod count;
mod grid;
mod material;
mod outputs;
mod refinement;
mod rigid;
mod sections;
mod table;
mod time;

use indexmap::IndexMap;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::deck::number::Number;
use crate::deck::spanned::Spanned;
pub use bodies::*;
pub use conditions::*;
pub use contact::*;
pub use count::Count;
pub use grid::*;
pub use material::*;
pub use outputs::*;
pub use refinement::*;
pub use rigid::*;
pub use sections::*;
pub use table::Table;
pub use time::*;

/// A string with its byte range in the deck.
pub type Text = Spanned<String>;

/// Named tables in the order of the deck.
pub type Tables<T> = IndexMap<String, Spanned<T>>;

/// A whole deck.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Deck {
    /// Title: one line of text that appears in summaries and pictures.
    #[serde(default)]
    pub title: Text,
    /// `"1d"`, `"plane-stress"`, `"plane-strain"` or `"3d"`.
    pub dimension: Spanned<DimensionName>,
    /// Thickness of a plane body in m; 1 if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub thickness: Option<Number>,
    /// Cross-section of a 1-D body in m²; 1 if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cross_section: Option<Number>,
    /// Lateral condition of a 1-D body: no lateral stress (`"uniaxial-stress"`, the default) or no lateral
    /// strain (`"uniaxial-strain"`).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub constraint: Option<Spanned<ConstraintName>>,
    /// Named numbers for use in expressions; a parameter may refer to other parameters.
    #[serde(default)]
    pub parameters: IndexMap<Text, Number>,
    /// Tables of values over time, by name, for use in expressions of `t`.
    #[serde(default)]
    pub table: Tables<Table>,
    /// Spacing and horizon.
    pub grid: Spanned<Grid>,
    /// Bonds between bodies.
    #[serde(default)]
    pub interface: Interface,
    /// Contact between points that no bond joins; none if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub contact: Option<Spanned<Contact>>,
    /// Rigid bodies by name.
    #[serde(default)]
    pub rigid: Tables<Rigid>,
    /// Finer grids in parts of the bodies.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub refinement: Option<Spanned<Refinement>>,
    /// Materials by name: `[material.NAME.LAW]`.
    pub material: Tables<Material>,
    /// Damage laws by name.
    #[serde(default)]
    pub damage: Tables<Damage>,
    /// Bodies by name; each body names its material and its damage law.
    pub body: Tables<Body>,
    /// Sets of points by name. `all` and the names of the bodies are names of sets too.
    #[serde(default)]
    pub set: Tables<Set>,
    /// Pre-cracks by name; bonds that cross a pre-crack start broken.
    #[serde(default)]
    pub crack: Tables<Crack>,
    /// Initial displacements and velocities by name.
    #[serde(default)]
    pub initial: Tables<Initial>,
    /// Loads, supports and temperatures by name.
    #[serde(default)]
    pub condition: Tables<Condition>,
    /// End time and time step.
    pub time: Spanned<Time>,
    /// The stages of the run in their order; if none is given, `[time]` is the only stage.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub stage: Vec<Spanned<Stage>>,
    /// Content of the result files, and interval of outputs.
    #[serde(default)]
    pub output: Spanned<Outputs>,
    /// Content of the history, and interval of its rows.
    #[serde(default)]
    pub history: Spanned<History>,
    /// Interval of checkpoints.
    #[serde(default)]
    pub checkpoint: Spanned<Checkpoint>,
    /// Rebalancing of points between ranks; none if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub balance: Option<Spanned<Balance>>,
}

/// Dimension of the problem. For plane problems, also which quantity is 0: the out-of-plane stress or the
/// out-of-plane strain.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
pub enum DimensionName {
    /// A bar.
    #[serde(rename = "1d")]
    Line,
    /// A thin plate without stress across its thickness.
    #[serde(rename = "plane-stress")]
    PlaneStress,
    /// A slice of a long body, without strain along the body.
    #[serde(rename = "plane-strain")]
    PlaneStrain,
    /// A solid.
    #[serde(rename = "3d")]
    Space,
}

/// Lateral condition of a bar (1-D): no lateral stress or no lateral strain.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
pub enum ConstraintName {
    /// No lateral stress: the sides of the bar are free.
    #[serde(rename = "uniaxial-stress")]
    UniaxialStress,
    /// No lateral strain: the sides of the bar cannot move.
    #[serde(rename = "uniaxial-strain")]
    UniaxialStrain,
}

fn all_points() -> Text {
    Spanned::new(0..0, "all".to_owned())
}
