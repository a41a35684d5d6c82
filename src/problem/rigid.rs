//! Rigid bodies that points can touch.

use std::ops::Range;

use super::{ContactRule, Problem};
use crate::expression::Expression;

/// A rigid body.
#[derive(Debug, Clone)]
pub struct Rigid {
    /// Its name.
    pub name: String,
    /// Its span in the deck.
    pub span: Range<usize>,
    /// Its shape.
    pub shape: RigidShape,
    /// Its initial centre, m; for a half space, a point on its surface.
    pub centre: [f64; 3],
    /// How it moves.
    pub motion: RigidMotion,
    /// Contact with points; its model is [`Penalty`](super::ContactModel::Penalty).
    pub rule: ContactRule,
}

/// The shape of a rigid body about its centre, lengths in m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RigidShape {
    /// A ball; a disc in the plane.
    Ball {
        /// Its radius.
        radius: f64,
    },
    /// A cylinder.
    Cylinder {
        /// Its direction, a unit vector.
        axis: [f64; 3],
        /// Half its length.
        half_length: f64,
        /// Its radius.
        radius: f64,
    },
    /// A box along the axes.
    Box {
        /// Half its edges.
        half: [f64; 3],
    },
    /// The half space behind a plane.
    HalfSpace {
        /// Outward unit normal of the half space.
        normal: [f64; 3],
    },
}

/// How a rigid body moves.
#[derive(Debug, Clone)]
pub enum RigidMotion {
    /// By a prescribed displacement (m), one expression of t for each component, without rotation.
    Driven(Vec<Expression>),
    /// Freely, by the forces on it.
    Free {
        /// Its mass, kg.
        mass: f64,
        /// Velocity of its centre at the start, m/s.
        velocity: [f64; 3],
        /// Angular velocity at the start, 1/s.
        angular_velocity: [f64; 3],
        /// Force at its centre, N: an expression of t for each component; may be empty.
        force: Vec<Expression>,
    },
}

impl Problem {
    /// Whether the problem has any contact, between points or with a rigid body.
    pub fn has_contact(&self) -> bool {
        self.contact.is_some() || !self.rigid.is_empty()
    }
}
