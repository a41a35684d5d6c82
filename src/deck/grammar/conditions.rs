//! Initial values, loads and supports.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Text;
use crate::deck::number::{Number, Vector};

/// Initial values of a set: an expression of x, y and z for each component, or a file.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Initial {
    /// Name of the set; all points if not given.
    #[serde(default = "super::all_points")]
    pub set: Text,
    /// Displacement in m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub displacement: Option<Vector>,
    /// Velocity in m/s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub velocity: Option<Vector>,
    /// Path, relative to the deck, of a text file with a row of values for each point. With `file`, the keys
    /// `displacement` and `velocity` are not allowed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub file: Option<Text>,
}

/// A condition on a set: a load, support or temperature. Each condition gives exactly one quantity, such as
/// `displacement` or `pressure`, as an expression of x, y, z and t for each component. The string `"free"`
/// leaves a component of displacement or velocity unprescribed.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Condition {
    /// Name of the set that the condition acts on.
    pub set: Text,
    /// Prescribed displacement in m.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub displacement: Option<Vector>,
    /// Prescribed velocity in m/s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub velocity: Option<Vector>,
    /// Body force density in N/m³.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub body_force: Option<Vector>,
    /// Traction in Pa on a surface layer of thickness `depth`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub traction: Option<Vector>,
    /// Pressure in Pa against the outward `normal` of a surface layer of thickness `depth`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pressure: Option<Number>,
    /// Total force in N, spread over the set in proportion to volume.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub force: Option<Vector>,
    /// Prescribed temperature, in the unit of the materials' `reference_temperature`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub temperature: Option<Number>,
    /// Thickness in m of the layer that carries a traction or pressure. If not given, the thickness is the
    /// spacing of the body to which a point belongs. Required for points from a file or mesh, and for cells
    /// with edges of different lengths.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub depth: Option<Number>,
    /// Outward normal for a pressure; a vector of any length.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub normal: Option<Vector>,
}
