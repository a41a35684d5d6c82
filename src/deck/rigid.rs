//! Validation of the rigid bodies of a deck.

use super::contact::{self, Keys};
use super::grammar::{self, ContactName, Deck};
use super::number::Vector;
use super::resolve::Scope;
use super::shapes;
use crate::deck::spanned::Spanned;
use crate::error::Result;
use crate::expression::{Expression, Variable};
use crate::problem::{self, FREE_BODY_IN_RELAXATION, RigidMotion, RigidShape, Shape};

/// Validate rigid bodies.
///
/// # Errors
/// On a missing or surplus shape, and on a shape that cannot be rigid. If a driven body has a key that is
/// only for free bodies, or a free body has the key `motion`. If a half space is a free body. If a run with a
/// relaxation has a free body or friction. If a number is out of range.
pub fn rigid(scope: &Scope, deck: &Deck) -> Result<Vec<problem::Rigid>> {
    let bodies = deck.rigid.iter();
    bodies
        .map(|(name, table)| body(scope, name, table, contact::has_relaxation(deck)))
        .collect()
}

fn body(
    scope: &Scope,
    name: &str,
    table: &Spanned<grammar::Rigid>,
    has_relaxation: bool,
) -> Result<problem::Rigid> {
    let key = format!("[rigid.{name}]");
    let (span, table) = (table.span(), table.get_ref());
    let given = [
        ("shape", table.shape.as_ref().map(Spanned::span)),
        ("half_space", table.half_space.as_ref().map(Spanned::span)),
    ];
    scope.exactly_one(span.clone(), &key, &given)?;
    let (shape, centre) = match (&table.shape, &table.half_space) {
        (Some(written), _) => solid(scope, &key, written)?,
        (None, Some(half_space)) => {
            let half_space = half_space.get_ref();
            let normal =
                scope.direction(&half_space.normal, &format!("{key} half_space normal"))?;
            let through =
                scope.vector(&half_space.through, &format!("{key} half_space through"))?;
            (RigidShape::HalfSpace { normal }, through)
        }
        (None, None) => unreachable!("one of them is given"),
    };
    let keys = Keys {
        model: ContactName::Penalty,
        stiffness: table.stiffness.as_ref(),
        radius: None,
        friction: table.friction.as_ref(),
        static_friction: table.static_friction.as_ref(),
        restitution: table.restitution.as_ref(),
    };
    let rule = contact::rule(scope, &key, keys, has_relaxation)?;
    if let (Some(mass), true) = (&table.mass, has_relaxation) {
        let message = format!("{key} mass: {FREE_BODY_IN_RELAXATION}");
        return Err(scope.error(mass.span(), message));
    }
    Ok(problem::Rigid {
        name: name.to_owned(),
        span,
        motion: motion(scope, &key, table, &shape)?,
        shape,
        centre,
        rule: rule.expect("penalty is a rule"),
    })
}

/// Return the shape of a rigid body relative to its centre, and the position of the centre (m).
fn solid(
    scope: &Scope,
    key: &str,
    written: &Spanned<grammar::Shape>,
) -> Result<(RigidShape, [f64; 3])> {
    let key = format!("{key} shape");
    match shapes::shape(scope, &key, written)? {
        Shape::Ball { centre, radius } => Ok((RigidShape::Ball { radius }, centre)),
        Shape::Box { lower, upper } => {
            let half = std::array::from_fn(|d| 0.5 * (upper[d] - lower[d]));
            let centre = std::array::from_fn(|d| 0.5 * (lower[d] + upper[d]));
            Ok((RigidShape::Box { half }, centre))
        }
        Shape::Cylinder { from, to, radius } => {
            let along: [f64; 3] = std::array::from_fn(|d| to[d] - from[d]);
            let length = along.iter().map(|x| x * x).sum::<f64>().sqrt();
            let cylinder = RigidShape::Cylinder {
                axis: along.map(|component| component / length),
                half_length: 0.5 * length,
                radius,
            };
            Ok((cylinder, std::array::from_fn(|d| 0.5 * (from[d] + to[d]))))
        }
        Shape::Prism { .. } | Shape::Union(_) | Shape::Difference(_) => {
            let message = format!(
                "{key}: a rigid body is a box, a sphere, a cylinder, a disc in the plane, or a `half_space`"
            );
            Err(scope.error(written.span(), message))
        }
    }
}

fn motion(
    scope: &Scope,
    key: &str,
    table: &grammar::Rigid,
    shape: &RigidShape,
) -> Result<RigidMotion> {
    let of_time = |vector: &Vector, name: &str| -> Result<Vec<Expression>> {
        scope.expressions(vector, &format!("{key} {name}"), &[Variable::T])
    };
    let Some(mass) = &table.mass else {
        let spans = [
            ("velocity", table.velocity.as_ref().map(Spanned::span)),
            (
                "angular_velocity",
                table.angular_velocity.as_ref().map(Spanned::span),
            ),
            ("force", table.force.as_ref().map(Spanned::span)),
        ];
        if let Some((name, span)) = spans
            .into_iter()
            .find_map(|(name, span)| Some((name, span?)))
        {
            let message = format!("{key} {name}: is for a free body; give its `mass` as well");
            return Err(scope.error(span, message));
        }
        let motion = table
            .motion
            .as_ref()
            .map(|motion| of_time(motion, "motion"));
        return Ok(RigidMotion::Driven(motion.transpose()?.unwrap_or_default()));
    };
    if let Some(motion) = &table.motion {
        let message = format!(
            "{key} motion: a body with a `mass` moves freely; give either `motion` or `mass`"
        );
        return Err(scope.error(motion.span(), message));
    }
    if matches!(shape, RigidShape::HalfSpace { .. }) {
        let message = format!("{key} mass: a half space is fixed or driven by `motion`");
        return Err(scope.error(mass.span(), message));
    }
    let vector = |vector: &Option<Vector>, name: &str| {
        let vector = vector
            .as_ref()
            .map(|vector| scope.vector(vector, &format!("{key} {name}")));
        Ok::<_, crate::error::Error>(vector.transpose()?.unwrap_or([0.0; 3]))
    };
    let force = table.force.as_ref().map(|force| of_time(force, "force"));
    Ok(RigidMotion::Free {
        mass: scope.positive(mass, &format!("{key} mass"))?,
        velocity: vector(&table.velocity, "velocity")?,
        angular_velocity: angular_velocity(scope, key, table)?,
        force: force.transpose()?.unwrap_or_default(),
    })
}

fn angular_velocity(scope: &Scope, key: &str, table: &grammar::Rigid) -> Result<[f64; 3]> {
    let mut velocity = [0.0; 3];
    let Some(written) = &table.angular_velocity else {
        return Ok(velocity);
    };
    let key = format!("{key} angular_velocity");
    // Axes of rotation: none in 1-D, z in the plane, all in 3-D.
    let axes = [0..0, 2..3, 0..3][scope.dimension - 1].clone();
    let numbers = written.get_ref();
    if numbers.len() != axes.len() {
        let message = format!(
            "{key}: must have {} component(s) in {} dimensions, has {}",
            axes.len(),
            scope.dimension,
            numbers.len()
        );
        return Err(scope.error(written.span(), message));
    }
    for (axis, number) in axes.zip(numbers) {
        velocity[axis] = scope.number(number, &key)?;
    }
    Ok(velocity)
}
