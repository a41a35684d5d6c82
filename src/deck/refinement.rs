//! Validation of the refinement of a deck.

use super::grammar::{self, Deck, HorizonRule, LevelBonds};
use super::number::Number;
use super::resolve::Scope;
use crate::deck::spanned::Spanned;
use crate::error::Result;
use crate::expression::{POSITION, POSITION_AND_TIME};
use crate::message::format_number;
use crate::problem::check::FINEST;
use crate::problem::{self, InterfaceRule, PointSource};

/// Allowed values of the triggers `energy` and `damage`: above 0, up to 1.
const SHARE: std::ops::Range<f64> = f64::MIN_POSITIVE..1.0 + f64::EPSILON;

/// Default increase of m = δ/dx per level (Dipasquale et al. 2014, table 2).
const RISE: f64 = 1.0;

/// Validate the refinement. Return `None` for a deck without `[refinement]`.
///
/// # Errors
/// If no body is given as a shape, or a body has Gauss points. If a level, ratio m, factor, region or trigger
/// is invalid.
pub fn refinement(
    scope: &Scope,
    deck: &Deck,
    bodies: &[problem::Body],
) -> Result<Option<problem::Refinement>> {
    let Some(table) = &deck.refinement else {
        return Ok(None);
    };
    let refinement = table.get_ref();
    if bodies.iter().any(problem::Body::has_gauss_points) {
        let message = "[refinement]: needs `quadrature = \"midpoint\"`, one point per cell";
        return Err(scope.error(table.span(), message));
    }
    let lattice = |body: &&problem::Body| matches!(body.points, PointSource::Lattice { .. });
    let Some(first) = bodies.iter().find(lattice) else {
        let message =
            "[refinement]: only bodies given as shapes are refined, but the deck has no such body";
        return Err(scope.error(table.span(), message));
    };
    let levels = *refinement.levels.get_ref();
    if !(1..=FINEST).contains(&levels) {
        let message = format!("[refinement] levels: must be 1 to {FINEST}, is {levels}");
        return Err(scope.error(refinement.levels.span(), message));
    }
    let finest = levels as u32;
    let rule = rule(scope, refinement, first, finest)?;
    let interface_factor = match (&refinement.interface_factor, &rule) {
        (Some(factor), _) => {
            let range = 1.0..4.0_f64.next_up();
            scope.within(factor, "[refinement] interface_factor", range, "1 to 4")?
        }
        (None, problem::HorizonRule::Delta) => std::f64::consts::SQRT_2,
        (None, problem::HorizonRule::DeltaM(_)) => 1.0,
    };
    let regions = refinement.region.iter().map(|(name, table)| {
        let key = format!("[refinement.region.{name}]");
        let region = table.get_ref();
        let level = match &region.level {
            None => finest,
            Some(level) if (1..=levels).contains(level.get_ref()) => *level.get_ref() as u32,
            Some(level) => {
                let message = format!(
                    "{key} level: must be 1 to `levels`, which is {levels}, is {}",
                    level.get_ref()
                );
                return Err(scope.error(level.span(), message));
            }
        };
        Ok(problem::RefinedRegion {
            name: name.clone(),
            span: table.span(),
            level,
            condition: scope.expression(&region.condition, &format!("{key} where"), &POSITION)?,
        })
    });
    Ok(Some(problem::Refinement {
        span: table.span(),
        levels: finest,
        rule,
        interface_factor,
        bonds: match refinement.bonds {
            LevelBonds::Own => InterfaceRule::Own,
            LevelBonds::Average => InterfaceRule::Average,
        },
        regions: regions.collect::<Result<_>>()?,
        trigger: trigger(scope, refinement, bodies)?,
    }))
}

fn trigger(
    scope: &Scope,
    refinement: &grammar::Refinement,
    bodies: &[problem::Body],
) -> Result<Option<problem::Trigger>> {
    let Some(table) = &refinement.trigger else {
        return Ok(None);
    };
    let (key, trigger) = ("[refinement.trigger]", table.get_ref());
    if trigger.energy.is_none() && trigger.damage.is_none() && trigger.condition.is_none() {
        let message = format!("{key}: give at least one of `energy`, `damage` and `where`");
        return Err(scope.error(table.span(), message));
    }
    for body in bodies {
        if let Some(diagonal) = body.diagonal_above_horizon(scope.dimension) {
            let message = format!(
                "{key}: the horizon of [body.{}] must be at least the diagonal of a cell, {} m",
                body.name,
                format_number(diagonal)
            );
            return Err(scope.error(table.span(), message));
        }
    }
    let share = |number: &Option<Number>, name: &str| {
        let within = |number| {
            scope.within(
                number,
                &format!("{key} {name}"),
                SHARE,
                "above 0 and at most 1",
            )
        };
        number.as_ref().map(within).transpose()
    };
    let parse = |number: &Option<Number>, name: &str| {
        let parse = |number| scope.expression(number, &format!("{key} {name}"), &POSITION_AND_TIME);
        number.as_ref().map(parse).transpose()
    };
    let coarsen_after = trigger
        .coarsen_after
        .as_ref()
        .map(|number| scope.positive(number, &format!("{key} coarsen_after")));
    Ok(Some(problem::Trigger {
        span: table.span(),
        every_steps: trigger.every_steps.get_ref().get(),
        energy: share(&trigger.energy, "energy")?,
        damage: share(&trigger.damage, "damage")?,
        condition: parse(&trigger.condition, "where")?,
        only: parse(&trigger.only, "only")?,
        coarsen_after: coarsen_after.transpose()?,
    }))
}

fn rule(
    scope: &Scope,
    refinement: &grammar::Refinement,
    body: &problem::Body,
    finest: u32,
) -> Result<problem::HorizonRule> {
    let key = "[refinement] m";
    match (refinement.rule, &refinement.m) {
        (HorizonRule::Delta, None) => Ok(problem::HorizonRule::Delta),
        (HorizonRule::Delta, Some(ratios)) => {
            let message = format!(
                "{key}: is only for `rule = \"delta-m\"`; with \"delta\", m is the same on all levels"
            );
            Err(scope.error(ratios.span(), message))
        }
        (HorizonRule::DeltaM, None) => {
            let PointSource::Lattice { spacing, .. } = body.points else {
                unreachable!("the body is given as a shape")
            };
            let coarsest = body.horizon / spacing[0];
            let ratio = |level: u32| coarsest + RISE * f64::from(level);
            Ok(problem::HorizonRule::DeltaM(
                (1..=finest).map(ratio).collect(),
            ))
        }
        (HorizonRule::DeltaM, Some(ratios)) => {
            let given: &[Number] = ratios.get_ref();
            if given.len() != finest as usize {
                let message = format!(
                    "{key}: must have {finest} entries, one for each level from 1 to {finest}, has {}",
                    given.len()
                );
                return Err(scope.error(ratios.span(), message));
            }
            let ratio = |number: &Spanned<_>| {
                scope.within(number, key, 1.0..100.0_f64.next_up(), "1 to 100")
            };
            let ratios = given.iter().map(ratio).collect::<Result<_>>()?;
            Ok(problem::HorizonRule::DeltaM(ratios))
        }
    }
}
