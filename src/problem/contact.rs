//! Contact settings: forces between points that no intact bond joins.

use super::Body;

/// Contact rules of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Contact {
    /// Default for pairs of bodies that are not in `pairs`; `None` for no contact.
    pub rule: Option<ContactRule>,
    /// Pairs of bodies with separate rules.
    pub pairs: Vec<ContactPair>,
}

/// Separate contact rule for two bodies, or for the points of one body.
#[derive(Debug, Clone, PartialEq)]
pub struct ContactPair {
    /// Name in the deck.
    pub name: String,
    /// Names of the two bodies. If the rule is for the points of one body, both names are the name of this
    /// body.
    pub bodies: [String; 2],
    /// The rule; `None` for no contact.
    pub rule: Option<ContactRule>,
}

/// Contact rule for the points of two bodies, or of one body.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactRule {
    /// Model of the repulsive force.
    pub model: ContactModel,
    /// Modulus of the repulsion, Pa; `None` for the moduli of the materials.
    pub stiffness: Option<f64>,
    /// Contact distance, m; `None` if it follows from the volumes of the points.
    pub radius: Option<f64>,
    /// Coefficient of static friction.
    pub static_friction: f64,
    /// Coefficient of sliding friction.
    pub kinetic_friction: f64,
    /// Coefficient of restitution: relative speed of two points after a collision, divided by their relative
    /// speed before the collision. The coefficient is above 0; 1 means no damping.
    pub restitution: f64,
}

/// Model of the repulsive force as a function of the overlap.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ContactModel {
    /// The force has the stiffness of a layer of material between the points. The layer is one horizon thick.
    Penalty,
    /// Short-range forces (Silling & Askari 2005, §5; Macek & Silling 2007).
    ShortRange,
}

impl Contact {
    /// Return the contact rule for points of two bodies; `None` for no contact. The rule does not depend on
    /// the order of the bodies.
    pub fn between(&self, here: &Body, there: &Body) -> Option<ContactRule> {
        let names = [&here.name, &there.name];
        let own = self.pairs.iter().find(|pair| pair.is_of(names));
        own.map_or(self.rule, |pair| pair.rule)
    }
}

impl ContactPair {
    /// Test whether the pair consists of bodies with these names, in any order.
    pub fn is_of(&self, [first, second]: [&String; 2]) -> bool {
        let [a, b] = &self.bodies;
        [a, b] == [first, second] || [a, b] == [second, first]
    }
}

impl ContactRule {
    /// Create a rule without friction and damping, with the stiffness of the materials.
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
