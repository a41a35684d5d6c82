//! Rigid bodies that points can touch.

use std::ops::Range;

use super::{ContactRule, Problem};
use crate::expression::Expression;

/// A rigid body.
#[derive(Debug, Clone)]
pub struct Rigid {
    /// Name in the deck.
    pub name: String,
    /// Span in the deck.
    pub span: Range<usize>,
    /// Shape relative to the centre.
    pub shape: RigidShape,
    /// Initial position of the centre, m; for a half space, a point on its surface.
    pub centre: [f64; 3],
    /// Prescribed or free motion.
    pub motion: RigidMotion,
    /// Rule for contact with points. The model of this rule is [`Penalty`](super::ContactModel::Penalty).
    pub rule: ContactRule,
}

/// The shape of a rigid body relative to its centre; lengths are in m.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum RigidShape {
    /// A ball, or a disc in 2-D.
    Ball {
        /// Radius, m.
        radius: f64,
    },
    /// A cylinder.
    Cylinder {
        /// Direction of the axis, a unit vector.
        axis: [f64; 3],
        /// Half of the length, m.
        half_length: f64,
        /// Radius, m.
        radius: f64,
    },
    /// A box with edges along the axes.
    Box {
        /// Half of the edge along x, y and z, m.
        half: [f64; 3],
    },
    /// The half space on one side of a plane.
    HalfSpace {
        /// Outward unit normal of the half space.
        normal: [f64; 3],
    },
}

/// Motion of a rigid body.
#[derive(Debug, Clone)]
pub enum RigidMotion {
    /// Prescribed displacement (m) without rotation, as an expression of t for each component.
    Driven(Vec<Expression>),
    /// Motion under the forces on the body.
    Free {
        /// Mass, kg.
        mass: f64,
        /// Initial velocity of the centre, m/s.
        velocity: [f64; 3],
        /// Initial angular velocity, 1/s.
        angular_velocity: [f64; 3],
        /// Force at the centre, N, as an expression of t for each component; empty without such a force.
        force: Vec<Expression>,
    },
}

impl Problem {
    /// Test whether the problem has contact between points or with rigid bodies.
    pub fn has_contact(&self) -> bool {
        self.contact.is_some() || !self.rigid.is_empty()
    }
}
