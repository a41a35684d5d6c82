//! Rigid bodies that points can touch.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Shape;
use crate::deck::number::{Number, Vector};
use crate::deck::spanned::Spanned;

/// A rigid body. With `motion` it is driven, with `mass` it is free, and without these keys it is fixed.
/// Contact begins when the distance of a point from the surface is half the edge of the point's cell. If the
/// initial distance of the point is smaller, contact begins at the initial distance.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Rigid {
    /// A `box`, `sphere` or `cylinder`, or a `disc` in plane problems; not together with `half_space`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shape: Option<Spanned<Shape>>,
    /// The half space behind a plane, or behind a line in plane problems.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub half_space: Option<Spanned<HalfSpace>>,
    /// Displacement in m: an expression of t for each component.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub motion: Option<Vector>,
    /// Mass in kg; in plane problems, the mass of the whole thickness. A body with a mass is free.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mass: Option<Number>,
    /// Velocity of a free body at the start, m/s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub velocity: Option<Vector>,
    /// Initial angular velocity of a free body, 1/s: a vector, or one number in plane problems.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub angular_velocity: Option<Spanned<Vec<Number>>>,
    /// Force in N at the centre of a free body: an expression of t for each component.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub force: Option<Vector>,
    /// Young's modulus in Pa of the layer between points and surface; the modulus of the points' material if
    /// not given. The layer is half a horizon thick.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stiffness: Option<Number>,
    /// Coefficient of friction, defined as in `[contact]`. The default is 0, even if `[contact]` has
    /// this key.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub friction: Option<Number>,
    /// Coefficient of static friction, as in `[contact]`; `friction` of this body if not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub static_friction: Option<Number>,
    /// Coefficient of restitution, defined as in `[contact]`. The default is 1, even if `[contact]` has
    /// this key.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub restitution: Option<Number>,
}

/// The half space behind a plane; in plane problems, behind a line.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HalfSpace {
    /// A point on the surface of the half space, m.
    pub through: Vector,
    /// Outward normal of the half space; a vector of any length.
    pub normal: Vector,
}
