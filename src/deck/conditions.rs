//! Validation of the initial values, loads and supports of a deck.

use std::ops::Range;

use super::grammar::{self, Deck};
use super::number::{Number, Vector};
use super::resolve::Scope;
use super::sets::find_set;
use super::time::first_method;
use crate::deck::spanned::Spanned;
use crate::error::Result;
use crate::expression::{POSITION, POSITION_AND_TIME};
use crate::points::value_file;
use crate::problem::{self, Action, Depth, Selector};

/// Validate the initial values.
///
/// # Errors
/// - On an unknown set.
/// - On an invalid expression or file.
/// - On a table without values, or with both a file and expressions.
/// - On an initial velocity in a run whose first stage is quasi-static.
pub fn initials(
    scope: &Scope,
    deck: &Deck,
    sets: &[problem::Set],
) -> Result<Vec<problem::Initial>> {
    let first = first_method(deck);
    deck.initial
        .iter()
        .map(|(name, table)| {
            let initial = table.get_ref();
            let key = format!("[initial.{name}]");
            let file = initial.file.as_ref();
            let file = file.map(|file| initial_file(scope, file, &key)).transpose()?;
            if initial.displacement.is_none() && initial.velocity.is_none() && file.is_none() {
                let message = format!("{key}: give `displacement`, `velocity` or both, or a `file`");
                return Err(scope.error(table.span(), message));
            }
            let vector = initial.displacement.as_ref().or(initial.velocity.as_ref());
            if let (Some(file), Some(_)) = (&initial.file, vector) {
                let message =
                    format!("{key} file: the file gives all initial values; remove `displacement` and `velocity`");
                return Err(scope.error(file.span(), message));
            }
            let by_file = file.as_ref().filter(|file| file.columns.has_velocity());
            let velocity = initial.velocity.as_ref().map(|velocity| (velocity.span(), "velocity"));
            let velocity = velocity.or(by_file.map(|file| (file.span.clone(), "file")));
            if let (Some((place, name)), true) = (velocity, first.is_quasi_static()) {
                let message = format!(
                    "{key} {name}: initial velocities have no effect in a run that begins with `method = \"{}\"`; remove them",
                    first.name()
                );
                return Err(scope.error(place, message));
            }
            let values = |vector: &Option<Vector>, name: &str| {
                let resolve = |vector: &Vector| {
                    let key = format!("{key} {name}");
                    let values = scope.expressions(vector, &key, &POSITION)?;
                    Ok((values, vector.span()))
                };
                vector.as_ref().map(resolve).transpose()
            };
            Ok(problem::Initial {
                name: name.clone(),
                set: find_set(scope, &initial.set, sets, &format!("{key} set"))?,
                span: initial.set.span(),
                displacement: values(&initial.displacement, "displacement")?,
                velocity: values(&initial.velocity, "velocity")?,
                file,
            })
        })
        .collect()
}

/// Read the header of a file of initial values to find the columns. The path in the deck is relative to the
/// folder of the deck.
fn initial_file(scope: &Scope, file: &grammar::Text, key: &str) -> Result<problem::InitialFile> {
    let error = |message: String| scope.error(file.span(), format!("{key} file: {message}"));
    let folder = scope.source.path.parent().unwrap_or("".as_ref());
    let path = folder.join(file.get_ref());
    let columns = value_file::columns(&path, scope.dimension).map_err(error)?;
    Ok(problem::InitialFile {
        path,
        span: file.span(),
        columns,
    })
}

/// Validate the loads, supports and temperatures.
///
/// # Errors
/// On an unknown set or an invalid expression. On a table that gives no quantity or more than one quantity.
/// On a `depth` or `normal` that is missing or has no effect.
///
/// In one case, a missing `depth` is not reported here: only some bodies need it, and it is not yet known
/// whether the set has points of these bodies. If the set has such points, the solver reports the missing
/// `depth`.
pub fn conditions(
    scope: &Scope,
    deck: &Deck,
    sets: &[problem::Set],
    bodies: &[problem::Body],
) -> Result<Vec<problem::Condition>> {
    deck.condition
        .iter()
        .map(|(name, table)| {
            let condition = table.get_ref();
            let key = format!("[condition.{name}]");
            let (name_of_quantity, place, quantity) = quantity(scope, table, &key)?;
            let resolved = problem::Condition {
                name: name.clone(),
                set: find_set(scope, &condition.set, sets, &format!("{key} set"))?,
                span: condition.set.span(),
                quantity: name_of_quantity,
                place,
                depth: depth(scope, &key, condition, quantity)?,
                action: action(scope, &key, condition, (name_of_quantity, quantity))?,
            };
            let (set, dimension) = (&sets[resolved.set], scope.dimension);
            let possible = set.possible_bodies(bodies);
            let needs_depth = |body: &&problem::Body| resolved.divisor(body, dimension).is_none();
            let has_points_of_each = matches!(set.selector, Selector::All | Selector::Body(_));
            let without: Vec<_> = possible.iter().filter(needs_depth).collect();
            match without.first() {
                Some(body) if has_points_of_each || without.len() == possible.len() => {
                    Err(scope.source.locate(resolved.no_depth(body)))
                }
                _ => Ok(resolved),
            }
        })
        .collect()
}

/// Check that a prescribed temperature has an effect.
///
/// # Errors
/// If a temperature is prescribed, but no material has a coefficient of thermal expansion. The error is
/// located at the first prescribed temperature.
pub fn temperatures_act<'m>(
    scope: &Scope,
    conditions: &[problem::Condition],
    mut materials: impl Iterator<Item = &'m problem::Material>,
) -> Result<()> {
    let is_temperature =
        |condition: &&problem::Condition| matches!(condition.action, Action::Temperature(_));
    let Some(condition) = conditions.iter().find(is_temperature) else {
        return Ok(());
    };
    if materials.any(|material| material.expansion.coefficient != 0.0) {
        return Ok(());
    }
    let message = format!(
        "[condition.{}] temperature: no material has `thermal_expansion`, so the temperature does nothing; give it in \
         [material.NAME.LAW]",
        condition.name
    );
    Err(scope.error(condition.place.clone(), message))
}

/// The quantity that a condition prescribes, with its value in the deck.
#[derive(Clone, Copy)]
enum Quantity<'d> {
    Displacement(&'d Vector),
    Velocity(&'d Vector),
    BodyForce(&'d Vector),
    Traction(&'d Vector),
    Pressure(&'d Number),
    Force(&'d Vector),
    Temperature(&'d Number),
}

impl Quantity<'_> {
    /// Return whether the quantity acts on a surface layer.
    fn is_on_a_layer(self) -> bool {
        matches!(self, Self::Traction(_) | Self::Pressure(_))
    }
}

/// Return the quantity of a condition, with its key and the byte range of its value. It is an error if the
/// condition gives no quantity or several quantities.
fn quantity<'d>(
    scope: &Scope,
    table: &'d Spanned<grammar::Condition>,
    key: &str,
) -> Result<(&'static str, Range<usize>, Quantity<'d>)> {
    let condition = table.get_ref();
    let vector = |vector: &'d Option<Vector>, quantity: fn(&'d Vector) -> Quantity<'d>| {
        let vector = vector.as_ref();
        vector.map(|vector| (vector.span(), quantity(vector)))
    };
    let number = |number: &'d Option<Number>, quantity: fn(&'d Number) -> Quantity<'d>| {
        let number = number.as_ref();
        number.map(|number| (number.span(), quantity(number)))
    };
    let all = [
        (
            "displacement",
            vector(&condition.displacement, Quantity::Displacement),
        ),
        ("velocity", vector(&condition.velocity, Quantity::Velocity)),
        (
            "body_force",
            vector(&condition.body_force, Quantity::BodyForce),
        ),
        ("traction", vector(&condition.traction, Quantity::Traction)),
        ("pressure", number(&condition.pressure, Quantity::Pressure)),
        ("force", vector(&condition.force, Quantity::Force)),
        (
            "temperature",
            number(&condition.temperature, Quantity::Temperature),
        ),
    ];
    let spans = all.each_ref().map(|(name, given)| {
        let span = given.as_ref().map(|(span, _)| span.clone());
        (*name, span)
    });
    let (name, given) = &all[scope.exactly_one(table.span(), key, &spans)?];
    let (span, quantity) = given.clone().expect("this quantity is given");
    Ok((name, span, quantity))
}

/// Return the thickness of the layer on which a condition acts; `None` for a condition without a layer. The
/// key `depth` of a condition without a layer is an error.
fn depth(
    scope: &Scope,
    key: &str,
    condition: &grammar::Condition,
    quantity: Quantity<'_>,
) -> Result<Option<Depth>> {
    match &condition.depth {
        Some(depth) if quantity.is_on_a_layer() => {
            let depth = scope.positive(depth, &format!("{key} depth"))?;
            Ok(Some(Depth::Given(depth)))
        }
        Some(depth) => {
            let message = format!("{key} depth: only a traction or a pressure has a depth");
            Err(scope.error(depth.span(), message))
        }
        None => Ok(quantity.is_on_a_layer().then_some(Depth::Spacing)),
    }
}

fn action(
    scope: &Scope,
    key: &str,
    condition: &grammar::Condition,
    (name, quantity): (&str, Quantity<'_>),
) -> Result<Action> {
    if let (Some(normal), None) = (&condition.normal, &condition.pressure) {
        let message = format!("{key} normal: only a pressure has a normal");
        return Err(scope.error(normal.span(), message));
    }
    let key_of_quantity = format!("{key} {name}");
    let expressions = |vector| scope.expressions(vector, &key_of_quantity, &POSITION_AND_TIME);
    let expression = |number| scope.expression(number, &key_of_quantity, &POSITION_AND_TIME);
    let motion = |vector| scope.motion(vector, &key_of_quantity);
    match quantity {
        Quantity::Displacement(vector) => motion(vector).map(Action::Displacement),
        Quantity::Velocity(vector) => motion(vector).map(Action::Velocity),
        Quantity::BodyForce(vector) | Quantity::Traction(vector) => Ok(Action::BodyForce(
            expressions(vector)?,
            vec![1.0; scope.dimension],
        )),
        Quantity::Force(vector) => expressions(vector).map(Action::Force),
        Quantity::Temperature(number) => expression(number).map(Action::Temperature),
        Quantity::Pressure(number) => {
            let Some(normal) = &condition.normal else {
                let message =
                    format!("{key_of_quantity}: needs `normal`, the outward normal of the surface");
                return Err(scope.error(number.span(), message));
            };
            let direction = scope.direction(normal, &format!("{key} normal"))?;
            let factors = direction[..scope.dimension].iter().map(|n| -n);
            Ok(Action::BodyForce(
                vec![expression(number)?; scope.dimension],
                factors.collect(),
            ))
        }
    }
}
