//! Validation of the contact of a deck.

use super::grammar::{self, ContactName, Deck};
use super::number::Number;
use super::resolve::{Scope, find};
use super::time::methods;
use crate::deck::spanned::Spanned;
use crate::error::Result;
use crate::problem::check::RESTITUTION;
use crate::problem::{self, ContactModel, ContactRule, FRICTION_IN_RELAXATION};

/// Keys of a contact rule: the rule of `[contact]`, of a pair of bodies or of a rigid body.
#[derive(Clone, Copy)]
pub(super) struct Keys<'a> {
    pub model: ContactName,
    pub stiffness: Option<&'a Number>,
    pub radius: Option<&'a Number>,
    pub friction: Option<&'a Number>,
    pub static_friction: Option<&'a Number>,
    pub restitution: Option<&'a Number>,
}

/// Validate `[contact]`. Return `None` for a deck without this section.
///
/// # Errors
/// On numbers out of range, and on invalid or repeated pairs. On friction in a relaxation. On a pair that has
/// another model than `[contact]` but inherits the stiffness of `[contact]`. Such a pair is allowed if its
/// model is `"none"`. Methods and grids that do not support contact are rejected later, by
/// [`Problem::check_contact`](problem::Problem::check_contact).
pub fn contact(
    scope: &Scope,
    deck: &Deck,
    bodies: &[problem::Body],
) -> Result<Option<problem::Contact>> {
    let Some(table) = &deck.contact else {
        return Ok(None);
    };
    let table = table.get_ref();
    let all = Keys {
        model: *table.model.get_ref(),
        stiffness: table.stiffness.as_ref(),
        radius: table.radius.as_ref(),
        friction: table.friction.as_ref(),
        static_friction: table.static_friction.as_ref(),
        restitution: table.restitution.as_ref(),
    };
    let mut contact = problem::Contact {
        rule: rule(scope, "[contact]", all, has_relaxation(deck))?,
        pairs: Vec::new(),
    };
    for (name, table) in &table.pair {
        let key = format!("[contact.pair.{name}]");
        let table = table.get_ref();
        let other_model = table
            .model
            .as_ref()
            .filter(|model| *model.get_ref() != all.model);
        let inherits = table.stiffness.is_none() && all.stiffness.is_some();
        if let Some(model) =
            other_model.filter(|model| inherits && *model.get_ref() != ContactName::None)
        {
            let message = format!(
                "{key} model: differs from the `model` of [contact], so the `stiffness` of [contact] has another meaning; give the pair its own `stiffness`"
            );
            return Err(scope.error(model.span(), message));
        }
        let own = Keys {
            model: table
                .model
                .as_ref()
                .map_or(all.model, |model| *model.get_ref()),
            stiffness: table.stiffness.as_ref().or(all.stiffness),
            radius: table.radius.as_ref().or(all.radius),
            friction: table.friction.as_ref().or(all.friction),
            static_friction: (table.static_friction.as_ref().or(table.friction.as_ref()))
                .or(all.static_friction),
            restitution: table.restitution.as_ref().or(all.restitution),
        };
        let names = pair(scope, &format!("{key} bodies"), &table.bodies, bodies)?;
        if let Some(earlier) = contact
            .pairs
            .iter()
            .find(|pair| pair.is_of(names.each_ref()))
        {
            let message = format!(
                "{key} bodies: [contact.pair.{}] already describes the contact of `{}` and `{}`",
                earlier.name, names[0], names[1]
            );
            return Err(scope.error(table.bodies.span(), message));
        }
        contact.pairs.push(problem::ContactPair {
            name: name.clone(),
            bodies: names,
            rule: rule(scope, &key, own, has_relaxation(deck))?,
        });
    }
    Ok(Some(contact))
}

/// Return whether any stage of the run is a relaxation.
pub(super) fn has_relaxation(deck: &Deck) -> bool {
    let mut all = methods(deck).into_iter();
    all.any(|(_, method)| *method.get_ref() == grammar::Method::Relaxation)
}

/// Validate a contact rule; `has_relaxation` is true if any stage of the run is a relaxation. Return `None`
/// for the model `"none"`.
pub(super) fn rule(
    scope: &Scope,
    section: &str,
    keys: Keys<'_>,
    has_relaxation: bool,
) -> Result<Option<ContactRule>> {
    let positive = |number: Option<&Number>, key: &str| {
        let number = number.map(|number| scope.positive(number, &format!("{section} {key}")));
        number.transpose()
    };
    let coefficient = |number: Option<&Number>, key: &str| {
        let key = format!("{section} {key}");
        let number =
            number.map(|number| scope.within(number, &key, 0.0..f64::INFINITY, "0 or more"));
        number.transpose()
    };
    let radius = keys
        .radius
        .map(|radius| scope.length(radius, &format!("{section} radius")));
    let radius = radius.transpose()?;
    let stiffness = positive(keys.stiffness, "stiffness")?;
    let kinetic_friction = coefficient(keys.friction, "friction")?.unwrap_or(0.0);
    let static_friction =
        coefficient(keys.static_friction, "static_friction")?.unwrap_or(kinetic_friction);
    if let Some(number) = keys
        .static_friction
        .filter(|_| static_friction < kinetic_friction)
    {
        let message = format!(
            "{section} static_friction: must be at least `friction`, {kinetic_friction}, is {static_friction}"
        );
        return Err(scope.error(number.span(), message));
    }
    let frictions = [
        ("friction", keys.friction, kinetic_friction),
        ("static_friction", keys.static_friction, static_friction),
    ];
    for (key, number, value) in frictions {
        if let (Some(number), true) = (number, has_relaxation && value > 0.0) {
            let message = format!("{section} {key}: {FRICTION_IN_RELAXATION}");
            return Err(scope.error(number.span(), message));
        }
    }
    let restitution = match keys.restitution {
        Some(number) => {
            let key = format!("{section} restitution");
            scope.allowed(number, &key, &RESTITUTION)?
        }
        None => 1.0,
    };
    let model = match keys.model {
        ContactName::None => return Ok(None),
        ContactName::Penalty => ContactModel::Penalty,
        ContactName::ShortRange => ContactModel::ShortRange,
    };
    Ok(Some(ContactRule {
        model,
        stiffness,
        radius,
        static_friction,
        kinetic_friction,
        restitution,
    }))
}

/// Return the names of the two bodies of a pair. Return an error if a body is unknown, or if the pair does
/// not have exactly two names.
fn pair(
    scope: &Scope,
    key: &str,
    written: &Spanned<Vec<grammar::Text>>,
    bodies: &[problem::Body],
) -> Result<[String; 2]> {
    let [first, second] = &written.get_ref()[..] else {
        let count = written.get_ref().len();
        let message = format!("{key}: must name two bodies, names {count}");
        return Err(scope.error(written.span(), message));
    };
    let name = |text| {
        let names = bodies.iter().map(|body| body.name.as_str());
        find(scope.source, text, names, key).map(|index| bodies[index].name.clone())
    };
    Ok([name(first)?, name(second)?])
}
