//! Refinement of a deck, validated.

use serde_spanned::Spanned;

use super::grammar::{self, Deck, HorizonRule};
use super::number::Number;
use super::plan::{self, PointSource};
use super::resolve::{POSITION, Scope};
use crate::error::Result;

/// The finest level; there the spacing is a 64th.
const FINEST: u64 = 6;

/// By how much m = δ/dx grows from level to level if nothing is said (Dipasquale et al. 2014, table 2).
const RISE: f64 = 1.0;

/// Validates the refinement.
///
/// # Errors
/// On bodies that cannot be refined, and on levels and ratios that do not fit.
pub fn refinement(
    scope: &Scope,
    deck: &Deck,
    bodies: &[plan::Body],
) -> Result<Option<plan::Refinement>> {
    let Some(table) = &deck.refinement else {
        return Ok(None);
    };
    let refinement = table.get_ref();
    if deck.grid.get_ref().quadrature == grammar::Quadrature::Gauss {
        let message = "[refinement]: needs `quadrature = \"midpoint\"`, one point a cell";
        return Err(scope.error(table.span(), message));
    }
    let lattice = |body: &&plan::Body| matches!(body.points, PointSource::Lattice { .. });
    let Some(first) = bodies.iter().find(lattice) else {
        let message = "[refinement]: only bodies given as shapes are refined, and there is none";
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
            let range = 1.0..4.0;
            scope.within(factor, "[refinement] interface_factor", range, "1 to 4")?
        }
        (None, plan::HorizonRule::Delta) => std::f64::consts::SQRT_2,
        (None, plan::HorizonRule::DeltaM(_)) => 1.0,
    };
    let regions = refinement.region.iter().map(|(name, table)| {
        let key = format!("[refinement.region.{name}]");
        let region = table.get_ref();
        let level = match &region.level {
            None => finest,
            Some(level) if (1..=levels).contains(level.get_ref()) => *level.get_ref() as u32,
            Some(level) => {
                let message = format!("{key} level: must be 1 to {levels}, the `levels`");
                return Err(scope.error(level.span(), message));
            }
        };
        Ok(plan::RefinedRegion {
            name: name.clone(),
            span: table.span(),
            level,
            condition: scope.expression(&region.condition, &format!("{key} where"), &POSITION)?,
        })
    });
    Ok(Some(plan::Refinement {
        span: table.span(),
        levels: finest,
        rule,
        interface_factor,
        regions: regions.collect::<Result<_>>()?,
    }))
}

fn rule(
    scope: &Scope,
    refinement: &grammar::Refinement,
    body: &plan::Body,
    finest: u32,
) -> Result<plan::HorizonRule> {
    let key = "[refinement] m";
    match (refinement.rule, &refinement.m) {
        (HorizonRule::Delta, None) => Ok(plan::HorizonRule::Delta),
        (HorizonRule::Delta, Some(ratios)) => {
            let message = format!("{key}: goes with `rule = \"delta-m\"`; \"delta\" keeps m");
            Err(scope.error(ratios.span(), message))
        }
        (HorizonRule::DeltaM, None) => {
            let PointSource::Lattice { spacing, .. } = body.points else {
                unreachable!("the body is given as a shape")
            };
            let coarsest = body.horizon / spacing[0];
            let ratio = |level: u32| coarsest + RISE * f64::from(level);
            Ok(plan::HorizonRule::DeltaM((1..=finest).map(ratio).collect()))
        }
        (HorizonRule::DeltaM, Some(ratios)) => {
            let given: &[Number] = ratios.get_ref();
            if given.len() != finest as usize {
                let message = format!(
                    "{key}: must have {finest} entries, one a level from 1 on, has {}",
                    given.len()
                );
                return Err(scope.error(ratios.span(), message));
            }
            let ratio = |number: &Spanned<_>| scope.within(number, key, 1.0..100.0, "1 to 100");
            let ratios = given.iter().map(ratio).collect::<Result<_>>()?;
            Ok(plan::HorizonRule::DeltaM(ratios))
        }
    }
}
