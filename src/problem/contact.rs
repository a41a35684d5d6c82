//! Contact settings: forces between points that no intact bond joins.

use super::{Body, Problem, RigidMotion};
use crate::error::{Error, Result};

/// Message for friction in a run with a relaxation, after the section or key of the friction.
pub(crate) const FRICTION_IN_RELAXATION: &str = "friction depends on velocities, and a relaxation has none; leave it out, \
                                                or load slowly with \"explicit\"";

/// Message for a free rigid body in a run with a relaxation, after the section or key of the body.
pub(crate) const FREE_BODY_IN_RELAXATION: &str =
    "a free body is not available in a relaxation; drive it by `motion`, or use \"explicit\"";

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

    fn has_friction(&self) -> bool {
        self.static_friction > 0.0 || self.kinetic_friction > 0.0
    }
}

impl Problem {
    /// Check that the grid and the methods of the run support its contact.
    ///
    /// # Errors
    /// In a run with contact or rigid bodies:
    ///
    /// - If points may be refined during the run.
    /// - If a stage uses Newton's method.
    /// - If a stage is a relaxation, and a rule has friction or a rigid body is free.
    pub fn check_contact(&self) -> Result<()> {
        if !self.has_contact() {
            return Ok(());
        }
        if let Some(trigger) = self.refinement_trigger() {
            let message = "[refinement.trigger]: contact is not available on grids that change during the run; refine \
                           regions from the start, or remove [contact] and [rigid]";
            return Err(Error::input(message).at(&trigger.span));
        }
        if self.has_newton() {
            let section = if self.stages.is_empty() {
                "[time]"
            } else {
                "[time] or [[stage]]"
            };
            let message = format!(
                "{section} method: \"static\" is not available with contact; use \"relaxation\" or \"explicit\", or remove \
                 [contact] and [rigid]"
            );
            return Err(Error::input(message).at(&self.spans.newton));
        }
        if self.has_relaxation() {
            self.check_contact_in_relaxation()
        } else {
            Ok(())
        }
    }

    /// Return an error if a rule has friction or a rigid body is free. A relaxation has no velocities, so it
    /// would ignore friction, and free bodies would not move.
    fn check_contact_in_relaxation(&self) -> Result<()> {
        if let Some(contact) = &self.contact {
            let pairs = contact.pairs.iter();
            let pairs = pairs.map(|pair| (format!("[contact.pair.{}]", pair.name), pair.rule));
            let mut rules = std::iter::once(("[contact]".to_owned(), contact.rule)).chain(pairs);
            let is_rough =
                |rule: &Option<ContactRule>| rule.is_some_and(|rule| rule.has_friction());
            if let Some((section, _)) = rules.find(|(_, rule)| is_rough(rule)) {
                return Err(Error::input(format!("{section}: {FRICTION_IN_RELAXATION}")));
            }
        }
        for rigid in &self.rigid {
            let is_free = matches!(rigid.motion, RigidMotion::Free { .. });
            let faults = [
                (rigid.rule.has_friction(), FRICTION_IN_RELAXATION),
                (is_free, FREE_BODY_IN_RELAXATION),
            ];
            if let Some((_, fault)) = faults.into_iter().find(|(is, _)| *is) {
                let message = format!("[rigid.{}]: {fault}", rigid.name);
                return Err(Error::input(message).at(&rigid.span));
            }
        }
        Ok(())
    }
}
