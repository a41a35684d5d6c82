//! Validation of a deck: conversion of the parsed deck to a problem, with a check of every value and name.

use super::grammar::{ConstraintName, Deck, DimensionName, Family, Method, VolumeCorrection};
use super::number::{Edges, Number};
use super::resolve::{Scope, resolve_each};
use super::{
    bodies, conditions, contact, damage, history, interface, materials, outputs, refinement, rigid,
    sets, shapes, tables, time,
};
use crate::deck::spanned::Spanned;
use crate::dimension::{Constraint, Dimension};
use crate::error::Result;
use crate::message::format_number;
use crate::problem::{self, Problem};

/// Validate a parsed deck; `scope` contains the evaluated parameters and the tables of the deck.
///
/// # Errors
/// On the first mistake. The message has the location in the deck, the key and the allowed values.
pub fn validate(scope: &Scope, deck: &Deck) -> Result<Problem> {
    let dimension = dimension(scope, deck)?;
    let horizon = scope.length(&deck.grid.get_ref().horizon, "[grid] horizon")?;
    let spacing = match &deck.grid.get_ref().spacing {
        None => None,
        Some(edges) => Some(spacing(scope, edges, "[grid] spacing", horizon)?),
    };
    let sets = sets::sets(scope, deck)?;
    let materials = resolve_each(&deck.material, |name, table| {
        materials::material(scope, dimension, name, table)
    })?;
    let damages = resolve_each(&deck.damage, |name, table| {
        damage::damage(scope, &sets, name, table)
    })?;
    let bodies = bodies::bodies(scope, deck, spacing, &materials, &damages)?;
    let volume_correction = volume_correction(scope, deck, &bodies)?;
    let jitter = jitter(scope, deck, &bodies)?;
    let family = family(scope, deck, &bodies)?;
    let interface = interface::interface(scope, deck, dimension, &bodies, &damages)?;
    let contact = contact::contact(scope, deck, &bodies)?;
    let refinement = refinement::refinement(scope, deck, &bodies)?;
    let cracks = resolve_each(&deck.crack, |name, table| shapes::crack(scope, name, table))?;
    let time = time::time(scope, deck)?;
    let stages = time::stages(scope, deck, &time)?;
    let conditions = conditions::conditions(scope, deck, &sets, &bodies)?;
    conditions::temperatures_act(scope, &conditions, bodies.iter().map(|body| &body.material))?;
    let problem = Problem {
        warnings: Vec::new(),
        title: deck.title.get_ref().clone(),
        spans: spans(deck),
        dimension,
        horizon,
        volume_correction,
        jitter,
        family,
        interface,
        contact,
        rigid: rigid::rigid(scope, deck)?,
        bodies,
        refinement,
        cracks: cracks.into_values().collect(),
        initials: conditions::initials(scope, deck, &sets)?,
        conditions,
        stages,
        output: outputs::output(scope, deck, &sets, time.end)?,
        further_outputs: outputs::further_outputs(scope, deck, &sets, time.end)?,
        history: history::history(scope, deck, &sets, horizon)?,
        checkpoint: outputs::checkpoint(scope, deck)?,
        balance: outputs::balance(scope, deck)?,
        sets,
        time,
    };
    (problem.check_contact()).map_err(|error| scope.source.locate(error))?;
    tables::cover_the_run(scope, &problem)?;
    Ok(problem)
}

fn spans(deck: &Deck) -> problem::Spans {
    let time = deck.time.get_ref();
    let of_stages = deck.stage.iter().map(|stage| &stage.get_ref().adaptive);
    let mut adaptive = std::iter::once(&time.adaptive).chain(of_stages).flatten();
    let mut methods = time::methods(deck).into_iter().map(|(_, method)| method);
    let newton = methods.find(|method| *method.get_ref() == Method::Static);
    problem::Spans {
        horizon: deck.grid.get_ref().horizon.span(),
        end: time.end.span(),
        step: time.step.as_ref().unwrap_or(&time.end).span(),
        adaptive: adaptive.next().map_or(time.end.span(), Spanned::span),
        newton: newton.map_or(time.end.span(), Spanned::span),
    }
}

/// Return the dimension of the problem, with the thickness (2-D) or with cross-section and constraint (1-D).
///
/// # Errors
/// On a key that belongs to another dimension, and on an invalid number.
pub fn dimension(scope: &Scope, deck: &Deck) -> Result<Dimension> {
    let name = *deck.dimension.get_ref();
    let plane = matches!(
        name,
        DimensionName::PlaneStress | DimensionName::PlaneStrain
    );
    if let (Some(thickness), false) = (&deck.thickness, plane) {
        let message = "thickness: only plane-stress and plane-strain have a thickness";
        return Err(scope.error(thickness.span(), message));
    }
    if let (Some(section), false) = (&deck.cross_section, name == DimensionName::Line) {
        let message = "cross_section: only 1d has a cross-section";
        return Err(scope.error(section.span(), message));
    }
    if let (Some(constraint), false) = (&deck.constraint, name == DimensionName::Line) {
        let message = "constraint: is only for the dimension \"1d\"; in plane problems, use the dimension \
                       \"plane-stress\" or \"plane-strain\"";
        return Err(scope.error(constraint.span(), message));
    }
    let positive_or_one = |number: &Option<Number>, key| match number {
        Some(number) => scope.positive(number, key),
        None => Ok(1.0),
    };
    let thickness = positive_or_one(&deck.thickness, "thickness")?;
    Ok(match name {
        DimensionName::Line => Dimension::Line {
            cross_section: positive_or_one(&deck.cross_section, "cross_section")?,
            constraint: match deck.constraint.as_ref().map(|name| *name.get_ref()) {
                Some(ConstraintName::UniaxialStrain) => Constraint::UniaxialStrain,
                Some(ConstraintName::UniaxialStress) | None => Constraint::UniaxialStress,
            },
        },
        DimensionName::PlaneStress => Dimension::PlaneStress { thickness },
        DimensionName::PlaneStrain => Dimension::PlaneStrain { thickness },
        DimensionName::Space => Dimension::Space,
    })
}

/// Return the edges of a lattice cell, m; edges in directions beyond the dimension are 1. An edge longer than
/// the horizon (m) is an error.
pub fn spacing(scope: &Scope, edges: &Spanned<Edges>, key: &str, horizon: f64) -> Result<[f64; 3]> {
    let written = match edges.get_ref() {
        Edges::Same(edge) => vec![Spanned::new(edges.span(), edge.clone()); scope.dimension],
        Edges::Each(each) => each.clone(),
    };
    let written = Spanned::new(edges.span(), written);
    let mut spacing = [1.0; 3];
    for (edge, number) in spacing.iter_mut().zip(scope.entries(&written, key)?) {
        *edge = scope.length(number, key)?;
        if *edge > horizon {
            let message = format!(
                "{key}: {} m is larger than the horizon {} m, so no point would have a neighbour; \
                 the horizon is usually 3 to 6 spacings",
                format_number(*edge),
                format_number(horizon)
            );
            return Err(scope.error(number.span(), message));
        }
    }
    Ok(spacing)
}

fn volume_correction(
    scope: &Scope,
    deck: &Deck,
    bodies: &[problem::Body],
) -> Result<problem::VolumeCorrection> {
    let grid = deck.grid.get_ref();
    let given = grid.volume_correction.as_ref();
    let correction = match given.map(|given| given.get_ref()) {
        Some(VolumeCorrection::None) => return Ok(problem::VolumeCorrection::None),
        Some(VolumeCorrection::Linear) => problem::VolumeCorrection::Linear,
        Some(VolumeCorrection::LinearInside) => problem::VolumeCorrection::LinearInside,
        Some(VolumeCorrection::Exact) | None => problem::VolumeCorrection::Exact,
    };
    let is_jittered = grid.jitter.is_some();
    let reason = bodies.iter().find_map(|body| {
        Some((
            &body.name,
            body.no_cell_volume(is_jittered, scope.dimension)?,
        ))
    });
    let Some((name, reason)) = reason else {
        return Ok(correction);
    };
    let Some(given) = given else {
        return Ok(problem::VolumeCorrection::None);
    };
    let message = format!(
        "[grid] volume_correction: is for points at the centres of square or cubic lattice cells, but [body.{name}] \
         {reason}"
    );
    Err(scope.error(given.span(), message))
}

/// Validate the random displacement of points.
fn jitter(scope: &Scope, deck: &Deck, bodies: &[problem::Body]) -> Result<Option<problem::Jitter>> {
    let grid = deck.grid.get_ref();
    let Some(largest_shift) = &grid.jitter else {
        return match &grid.seed {
            None => Ok(None),
            Some(seed) => Err(scope.error(seed.span(), "[grid] seed: `seed` needs `jitter`")),
        };
    };
    let error =
        |message: &str| Err(scope.error(largest_shift.span(), format!("[grid] jitter: {message}")));
    if bodies.iter().any(problem::Body::has_gauss_points) {
        return error("needs `quadrature = \"midpoint\"`, one point per cell");
    }
    if deck.refinement.is_some() {
        return error("is not available with [refinement], whose points lie on grids");
    }
    // Below 0.5, the points of adjacent cells cannot coincide.
    let words = "at least 0 and below 0.5";
    Ok(Some(problem::Jitter {
        largest_shift: scope.within(largest_shift, "[grid] jitter", 0.0..0.5, words)?,
        seed: match &grid.seed {
            Some(seed) => scope.whole(seed, "[grid] seed")?,
            None => 0,
        },
    }))
}

fn family(scope: &Scope, deck: &Deck, bodies: &[problem::Body]) -> Result<problem::FamilyRule> {
    let grid = deck.grid.get_ref();
    match grid.family.get_ref() {
        Family::Auto => Ok(problem::FamilyRule::Auto),
        Family::List => Ok(problem::FamilyRule::List),
        Family::Lattice if grid.jitter.is_some() => {
            let message = "[grid] family: points that `jitter` moves do not lie on a lattice; take \"auto\" or \"list\"";
            Err(scope.error(grid.family.span(), message))
        }
        Family::Lattice if bodies.iter().any(problem::Body::has_gauss_points) => {
            let message =
                "[grid] family: Gauss points do not form a lattice; take \"auto\" or \"list\"";
            Err(scope.error(grid.family.span(), message))
        }
        Family::Lattice => Ok(problem::FamilyRule::Lattice),
    }
}
