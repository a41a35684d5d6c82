//! Rigid bodies that points can touch.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Shape;
use crate::deck::number::{Number, Vector};
use crate::deck::spanned::Spanned;

/// A rigid body: driven by its `motion`, free with its `mass`, or fixed. Points touch it where half the edge of their cell
/// reaches its surface, or as near as they began.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Rigid {
    /// `box`, `sphere`, `cylinder`, or `disc` in the plane; or a `half_space`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shape: Option<Spanned<Shape>>,
    /// All that lies behind a plane, or a line.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub half_space: Option<Spanned<HalfSpace>>,
    /// Displacement in m, an expression of t a component.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub motion: Option<Vector>,
    /// Mass in kg, in the plane that of the whole thickness: the body is free then.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mass: Option<Number>,
    /// Velocity of a free body at the start, m/s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub velocity: Option<Vector>,
    /// Angular velocity of a free body at the start, 1/s: a vector, in the plane one number.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub angular_velocity: Option<Spanned<Vec<Number>>>,
    /// Force at the centre of a free body in N, an expression of t a component.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub force: Option<Vector>,
    /// Young's modulus, Pa, of the layer between points and surface, half a horizon thick; that of the points' material if
    /// not given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stiffness: Option<Number>,
    /// As in `[contact]`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub friction: Option<Number>,
    /// As in `[contact]`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub static_friction: Option<Number>,
    /// As in `[contact]`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub restitution: Option<Number>,
}

/// The half space behind a plane; in plane problems, behind a line.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct HalfSpace {
    /// A point of its surface, m.
    pub through: Vector,
    /// Out of the half space, of any length.
    pub normal: Vector,
}
