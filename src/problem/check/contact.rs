//! Contact and rigid bodies.

use super::allowed::{LENGTH, NOT_NEGATIVE, POSITIVE, RESTITUTION};
use super::bonds::are_bodies;
use super::{expression, finite, optional, unit_vector, wrong};
use crate::error::Result;
use crate::expression::{Expression, Variable};
use crate::problem::{ContactModel, ContactRule, Problem, Rigid, RigidMotion, RigidShape};

/// Check the contact rules and the rigid bodies.
///
/// # Errors
/// On a number that is not allowed, a pair with unknown bodies, or a repeated pair.
pub fn contact(problem: &Problem) -> Result<()> {
    if let Some(contact) = &problem.contact {
        if let Some(all) = &contact.rule {
            rule("[contact]", all)?;
        }
        for (number, pair) in contact.pairs.iter().enumerate() {
            let section = format!("[contact.pair.{}]", pair.name);
            are_bodies(problem, &section, &pair.bodies)?;
            let mut earlier = contact.pairs[..number].iter();
            if let Some(earlier) = earlier.find(|earlier| earlier.is_of(pair.bodies.each_ref())) {
                let [first, second] = &pair.bodies;
                let fault = format!(
                    "[contact.pair.{}] already describes the contact of `{first}` and `{second}`",
                    earlier.name
                );
                return Err(wrong(&format!("{section} bodies"), fault));
            }
            if let Some(own) = &pair.rule {
                rule(&section, own)?;
            }
        }
    }
    let mut rigid = problem.rigid.iter();
    rigid.try_for_each(|body| self::rigid(problem, body))
}

fn rule(section: &str, rule: &ContactRule) -> Result<()> {
    let key = |name: &str| format!("{section} {name}");
    optional(&key("stiffness"), rule.stiffness, &POSITIVE)?;
    optional(&key("radius"), rule.radius, &LENGTH)?;
    NOT_NEGATIVE.check(&key("friction"), rule.kinetic_friction)?;
    NOT_NEGATIVE.check(&key("static_friction"), rule.static_friction)?;
    if rule.static_friction < rule.kinetic_friction {
        let fault = format!(
            "must be at least `friction`, {}, is {}",
            rule.kinetic_friction, rule.static_friction
        );
        return Err(wrong(&key("static_friction"), fault));
    }
    RESTITUTION.check(&key("restitution"), rule.restitution)
}

fn rigid(problem: &Problem, rigid: &Rigid) -> Result<()> {
    let section = format!("[rigid.{}]", rigid.name);
    let key = |name: &str| format!("{section} {name}");
    let dimension = problem.dimension.count();
    finite(&key("centre"), &rigid.centre)?;
    match rigid.shape {
        RigidShape::Ball { radius } => POSITIVE.check(&key("radius"), radius)?,
        RigidShape::Cylinder {
            axis,
            half_length,
            radius,
        } => {
            if dimension != 3 {
                return Err(wrong(&key("shape"), "a cylinder is for 3-D problems"));
            }
            unit_vector(&key("axis"), axis)?;
            POSITIVE.check(&key("half_length"), half_length)?;
            POSITIVE.check(&key("radius"), radius)?;
        }
        RigidShape::Box { half } => {
            let mut edges = half[..dimension].iter();
            edges.try_for_each(|half| POSITIVE.check(&key("half"), *half))?;
        }
        RigidShape::HalfSpace { normal } => unit_vector(&key("normal"), normal)?,
    }
    rule(&section, &rigid.rule)?;
    if rigid.rule.model != ContactModel::Penalty {
        return Err(wrong(
            &key("rule"),
            "the model must be `ContactModel::Penalty`",
        ));
    }
    match &rigid.motion {
        RigidMotion::Driven(motion) => of_time(problem, &key("motion"), motion),
        RigidMotion::Free { .. } if matches!(rigid.shape, RigidShape::HalfSpace { .. }) => {
            let fault = "a half space is driven; use `RigidMotion::Driven`";
            Err(wrong(&key("motion"), fault))
        }
        RigidMotion::Free {
            mass,
            velocity,
            angular_velocity,
            force,
        } => {
            POSITIVE.check(&key("mass"), *mass)?;
            finite(&key("velocity"), velocity)?;
            finite(&key("angular_velocity"), angular_velocity)?;
            // Axes of rotation: none in 1-D, z in the plane, all in 3-D.
            let fixed = [0..3, 0..2, 0..0][dimension - 1].clone();
            if angular_velocity[fixed]
                .iter()
                .any(|component| *component != 0.0)
            {
                let fault = "a bar has no rotation, and a plane body rotates about z only";
                return Err(wrong(&key("angular_velocity"), fault));
            }
            of_time(problem, &key("force"), force)
        }
    }
}

/// Check expressions of time, one per dimension; an empty list is allowed.
fn of_time(problem: &Problem, key: &str, expressions: &[Expression]) -> Result<()> {
    if expressions.is_empty() {
        return Ok(());
    }
    problem.check_entries(key, expressions.len())?;
    let mut expressions = expressions.iter();
    expressions.try_for_each(|each| expression(key, each, &[Variable::T]))
}
