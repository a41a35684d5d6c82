//! Horizons as multiples of the mean spacing of points, such as `"3.015 * spacing"`.

use super::bodies;
use super::grammar::Deck;
use super::number::{Number, Written};
use super::resolve::Scope;
use super::validate;
use crate::comm::Communicator;
use crate::deck::spanned::Spanned;
use crate::error::Result;
use crate::expression::Expression;
use crate::points::mean_spacing::mean_spacings;

/// Name of the mean spacing in the expression of a horizon.
const SPACING: &str = "spacing";

/// Evaluate the horizons whose expressions contain the mean spacing. The `horizon` of a body is evaluated
/// with the mean spacing of the body's points. The `horizon` of the grid is evaluated for each body without
/// its own horizon. Each result becomes the horizon of its body. The largest result becomes the horizon of
/// the grid. Meshes and point files are read if horizons depend on their points.
///
/// Return a copy of the deck with these horizons; `None` if no expression of a horizon contains the mean
/// spacing. If the deck has a parameter or table with the name `spacing`, this name means the parameter or
/// table, not the mean spacing. Collective.
///
/// # Errors
/// If the horizon of the grid contains the mean spacing, although all bodies have their own horizon. On an
/// invalid dimension, spacing, horizon, source of points, mesh or point file. The error is the same on all
/// ranks.
pub fn resolve(scope: &mut Scope, deck: &Deck, comm: &dyn Communicator) -> Result<Option<Deck>> {
    let in_grid = &deck.grid.get_ref().horizon;
    let of_grid = contains_spacing(scope, in_grid);
    let bodies = || deck.body.values().map(Spanned::get_ref);
    let wanted: Vec<bool> = bodies()
        .map(|body| match &body.horizon {
            None => of_grid,
            Some(own) => contains_spacing(scope, own),
        })
        .collect();
    if !of_grid && !wanted.contains(&true) {
        return Ok(None);
    }
    let dimension = validate::dimension(scope, deck)?;
    let spacing = match &deck.grid.get_ref().spacing {
        None => None,
        Some(edges) => {
            let edges = validate::spacing(scope, edges, "[grid] spacing", f64::INFINITY)?;
            Some(edges)
        }
    };
    let sources = bodies::point_sources(scope, deck, spacing)?;
    if of_grid && bodies().all(|body| body.horizon.is_some()) {
        let message = "[grid] horizon: `spacing` in this expression is the mean spacing of the bodies that have no `horizon`, \
                       but every body has one; write this horizon without `spacing`";
        return Err(scope.error(in_grid.span(), message));
    }
    let sources = bodies::of_sources(deck, &sources);
    let spacings = mean_spacings(&sources, dimension, &wanted, comm)
        .map_err(|error| scope.source.locate(error))?;
    let mut resolved = deck.clone();
    let mut largest = 0.0_f64;
    for ((name, body), spacing) in resolved.body.iter_mut().zip(spacings) {
        let Some(spacing) = spacing else { continue };
        let own = &mut body.get_mut().horizon;
        let key = match own {
            None => "[grid] horizon".to_owned(),
            Some(_) => format!("[body.{name}] horizon"),
        };
        let written = own.as_ref().unwrap_or(in_grid);
        let value = scope.with_parameter(SPACING, spacing, |scope| scope.length(written, &key))?;
        if own.is_none() {
            largest = largest.max(value);
        }
        *own = Some(Spanned::new(written.span(), Written::Value(value)));
    }
    if of_grid {
        let value = Written::Value(largest);
        resolved.grid.get_mut().horizon = Spanned::new(in_grid.span(), value);
    }
    Ok(Some(resolved))
}

/// Test whether the value of a number depends on the mean spacing.
fn contains_spacing(scope: &Scope, number: &Number) -> bool {
    let Written::Text(text) = number.get_ref() else {
        return false;
    };
    let is_defined = scope.parameters.contains_key(SPACING) || scope.tables.contains_key(SPACING);
    let names = Expression::names(text).unwrap_or_default();
    !is_defined && names.iter().any(|name| name == SPACING)
}
