//! Contact: forces between points that no intact bond joins.

use super::Body;

/// Contact rules of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Contact {
    /// The rule of pairs without their own rule.
    pub rule: Option<ContactRule>,
    /// Pairs of bodies with their own rule.
    pub pairs: Vec<ContactPair>,
}

/// Two bodies (or one body and itself) with their own rule.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactPair {
    /// Its name in the deck.
    pub name: String,
    /// Names of the bodies.
    pub bodies: [String; 2],
    /// The rule; `None` for no contact.
    pub rule: Option<ContactRule>,
}

/// Contact between points of two bodies, or of one body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactRule {
    /// How the force follows from the overlap.
    pub model: ContactModel,
    /// Modulus of the force, Pa; from the materials if not given.
    pub stiffness: Option<f64>,
    /// Distance at which points begin to touch, m; from their volumes if not given.
    pub radius: Option<f64>,
    /// Coefficient of static friction.
    pub static_friction: f64,
    /// Coefficient of sliding friction.
    pub kinetic_friction: f64,
    /// Relative speed of two points after a collision, divided by the speed before it; above 0, and 1 without damping.
    pub restitution: f64,
}

/// How the force follows from the overlap.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ContactModel {
    /// The stiffness of a material layer between the points, as thick as the horizon.
    Penalty,
    /// Short-range forces (Silling & Askari 2005, §5; Macek & Silling 2007).
    ShortRange,
}

impl Contact {
    /// The rule of contact between points of two bodies, independent of their order; `None` for no contact.
    pub fn between(&self, here: &Body, there: &Body) -> Option<ContactRule> {
        let names = [&here.name, &there.name];
        let own = self.pairs.iter().find(|pair| pair.is_of(names));
        own.map_or(self.rule, |pair| pair.rule)
    }
}

impl ContactPair {
    /// Whether its bodies have these names, in any order.
    pub fn is_of(&self, [first, second]: [&String; 2]) -> bool {
        let [a, b] = &self.bodies;
        [a, b] == [first, second] || [a, b] == [second, first]
    }
}

impl ContactRule {
    /// Contact by a model without friction and damping, with the stiffness of the materials.
    pub fn new(model: ContactModel) -> Self {
        Self {
            model,
            stiffness: None,
            radius: None,
            static_friction: 0.0,
            kinetic_friction: 0.0,
            restitution: 1.0,
        }
    }
}
