//! Contact between points that no bond joins.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Tables, Text};
use crate::deck::number::Number;
use crate::deck::spanned::Spanned;

/// Contact between points that no bond joins, in different bodies or in the same body (such as the faces of a
/// crack). With this section, bodies are bonded to one another only if `[interface]` requests it.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Contact {
    /// `"penalty"` (the default): the stiffness is that of a material layer as thick as the horizon.
    /// `"short-range"`: short-range forces of Silling & Askari (2005), as in Peridigm and LAMMPS. `"none"`:
    /// no contact between points, except in pairs of bodies for which a table `[contact.pair.NAME]` gives
    /// another `model`.
    #[serde(default = "penalty")]
    pub model: Spanned<ContactName>,
    /// With `"penalty"`, two points repel one another as if a layer of material lay between them; `stiffness`
    /// is Young's modulus of this layer in Pa. The default is 2E₁E₂/(E₁ + E₂), where E₁ and E₂ are Young's
    /// moduli of the two materials. This is the modulus of two equally thick layers of these materials in
    /// series. With `"short-range"`, the spring constant in Pa. The default is 15 times the smaller bulk
    /// modulus of the two materials.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stiffness: Option<Number>,
    /// Distance in m between two points at which contact begins. The default is the mean of the lengths that
    /// the two points cover, or 1.35 times this mean with `"short-range"`. Most points cover the edge of
    /// their cell. Contact never begins at more than the initial distance of the two points, even if `radius`
    /// is larger. With `"short-range"`, this limit is 0.9 times the initial distance.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radius: Option<Number>,
    /// Coefficient of friction; 0 if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub friction: Option<Number>,
    /// Coefficient of static friction; `friction` if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub static_friction: Option<Number>,
    /// Relative speed of two points after a collision, divided by the speed before the collision; from 0.01
    /// to 1. The default is 1 (no damping).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub restitution: Option<Number>,
    /// Pairs of bodies with their own contact model or constants; each pair has a freely chosen name.
    #[serde(default)]
    pub pair: Tables<ContactPair>,
}

/// Contact between two bodies, or of a body with itself.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ContactPair {
    /// Names of the two bodies; the same name twice for contact of a body with itself. The order matters only
    /// for the sign of the contact force in the history.
    pub bodies: Spanned<Vec<Text>>,
    /// Defined as in `[contact]`. The default is the value of this key in `[contact]`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub model: Option<Spanned<ContactName>>,
    /// Defined as in `[contact]`. The default is the value of this key in `[contact]`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stiffness: Option<Number>,
    /// Defined as in `[contact]`. The default is the value of this key in `[contact]`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radius: Option<Number>,
    /// Defined as in `[contact]`. The default is the value of this key in `[contact]`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub friction: Option<Number>,
    /// Coefficient of static friction. The default is `friction` of this pair. If the pair has no `friction`
    /// either, the default is the coefficient of static friction of `[contact]`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub static_friction: Option<Number>,
    /// Defined as in `[contact]`. The default is the value of this key in `[contact]`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub restitution: Option<Number>,
}

/// A model of contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ContactName {
    /// No contact.
    None,
    /// Penalty contact: the force has the stiffness of a layer of material between the points.
    Penalty,
    /// Short-range forces.
    ShortRange,
}

fn penalty() -> Spanned<ContactName> {
    Spanned::new(0..0, ContactName::Penalty)
}
