//! Contact between points that no bond joins.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Tables, Text};
use crate::deck::number::Number;
use crate::deck::spanned::Spanned;

/// Contact between points that no bond joins: of different bodies, and of one body, such as the faces of a crack. Bodies do
/// not bond to one another then, unless `[interface]` says so.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Contact {
    /// `"penalty"` (if not given): as a layer of material between the points, as thick as the horizon. `"short-range"`: short-range forces, as Silling
    /// & Askari (2005), Peridigm and LAMMPS have them. `"none"`: only pairs with a rule of their own touch.
    #[serde(default = "penalty")]
    pub model: Spanned<ContactName>,
    /// Pa: Young's modulus of that layer, by default of both materials in series; or the spring constant of short-range
    /// forces, by default 15 times the smaller bulk modulus.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stiffness: Option<Number>,
    /// Distance at which points begin to touch, m: by default the mean edge of their cells, 1.35 times that for short-range
    /// forces. Points that begin nearer touch below their first distance (0.9 of it with short-range forces).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radius: Option<Number>,
    /// Coefficient of friction; 0 if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub friction: Option<Number>,
    /// Coefficient of friction of points that stick; `friction` if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub static_friction: Option<Number>,
    /// Speed of two points after their collision as a share of that before, from 0.01 to 1; 1 (no damping) if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub restitution: Option<Number>,
    /// Pairs of bodies with a rule of their own, by any name.
    #[serde(default)]
    pub pair: Tables<ContactPair>,
}

/// Contact between two bodies, or of a body with itself.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ContactPair {
    /// Names of the two bodies, in any order; the same one twice for a body with itself.
    pub bodies: Spanned<Vec<Text>>,
    /// As in `[contact]`, whose value holds if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub model: Option<Spanned<ContactName>>,
    /// As in `[contact]`, whose value holds if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stiffness: Option<Number>,
    /// As in `[contact]`, whose value holds if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radius: Option<Number>,
    /// As in `[contact]`, whose value holds if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub friction: Option<Number>,
    /// As in `[contact]`, whose value holds if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub static_friction: Option<Number>,
    /// As in `[contact]`, whose value holds if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub restitution: Option<Number>,
}

/// A model of contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ContactName {
    /// No contact.
    None,
    /// A layer of material.
    Penalty,
    /// Short-range forces.
    ShortRange,
}

fn penalty() -> Spanned<ContactName> {
    Spanned::new(0..0, ContactName::Penalty)
}
