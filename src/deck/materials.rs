//! Materials and damage laws of a deck, validated.

use serde_spanned::Spanned;

use super::grammar;
use super::number::Number;
use super::plan;
use super::resolve::Scope;
use super::sets::find_sets;
use crate::dimension::Dimension;
use crate::elastic::{Constant, Isotropic};
use crate::error::Result;

/// The keys of an elastic constant that are given, with their numbers, in the order of the deck.
fn given(elastic: &grammar::Elastic) -> Vec<(&'static str, Constant, &Number)> {
    let mut given: Vec<_> = [
        ("youngs_modulus", Constant::Young, &elastic.youngs_modulus),
        ("bulk_modulus", Constant::Bulk, &elastic.bulk_modulus),
        ("shear_modulus", Constant::Shear, &elastic.shear_modulus),
        ("lame_lambda", Constant::Lame, &elastic.lame_lambda),
        ("poisson_ratio", Constant::Poisson, &elastic.poisson_ratio),
    ]
    .into_iter()
    .filter_map(|(key, constant, number)| Some((key, constant, number.as_ref()?)))
    .collect();
    given.sort_by_key(|(_, _, number)| number.span().start);
    given
}

/// Validates a material.
///
/// # Errors
/// On wrong constants, too few or too many, or those of a solid that the law cannot be.
pub fn material(
    scope: &Scope,
    dimension: Dimension,
    name: &str,
    table: &Spanned<grammar::Material>,
) -> Result<plan::Material> {
    let grammar::Material::Pmb(spanned) = table.get_ref();
    let elastic = spanned.get_ref();
    let key = format!("[material.{name}.pmb]");
    let density = scope.positive(&elastic.density, &format!("{key} density"))?;
    let own = dimension.bond_based_poisson_ratio();
    let value = |key_name: &str, constant, number: &Number| {
        let key = format!("{key} {key_name}");
        match constant {
            Constant::Poisson => scope.within(number, &key, -1.0..0.5, "between -1 and 0.5"),
            Constant::Lame => scope.number(number, &key),
            Constant::Young | Constant::Bulk | Constant::Shear => scope.positive(number, &key),
        }
    };
    let constants = given(elastic);
    let pair = match constants[..] {
        [(key_name, constant, number)] if constant != Constant::Poisson => [
            (constant, value(key_name, constant, number)?),
            (Constant::Poisson, own),
        ],
        [a, b] => [(a.1, value(a.0, a.1, a.2)?), (b.1, value(b.0, b.1, b.2)?)],
        _ => {
            let message = format!(
                "{key}: give one or two of `youngs_modulus`, `bulk_modulus`, `shear_modulus`, \
                 `lame_lambda` and `poisson_ratio`; with one (not the last), Poisson's ratio is \
                 the law's own"
            );
            let third = constants.get(2).map(|third| third.2.span());
            return Err(scope.error(third.unwrap_or(spanned.span()), message));
        }
    };
    let place = constants
        .last()
        .map_or(spanned.span(), |last| last.2.span());
    let Some(found) = Isotropic::from_two(pair[0], pair[1]) else {
        let names: Vec<&str> = constants.iter().map(|constant| constant.0).collect();
        let message = format!(
            "{key}: no solid has this {}; a stable one has moduli above 0 and a Poisson's ratio \
             between -1 and 0.5",
            names.join(" and ")
        );
        return Err(scope.error(place, message));
    };
    // A ratio given as 0.33 or 0.333 means 1/3.
    if (found.poisson_ratio - own).abs() > 0.005 {
        let message = format!(
            "{key}: Poisson's ratio is {:.4}, but a bond-based law in {} always has {:.4}; leave \
             the second constant out to accept that",
            found.poisson_ratio,
            dimension.name(),
            own,
        );
        return Err(scope.error(place, message));
    }
    Ok(plan::Material {
        law: plan::Law::Pmb,
        density,
        elastic: Isotropic {
            youngs_modulus: found.youngs_modulus,
            poisson_ratio: own,
        },
    })
}

/// Validates a damage law.
///
/// # Errors
/// On a wrong number, an unknown set, or anything but one measure of toughness.
pub fn damage(
    scope: &Scope,
    sets: &[plan::Set],
    name: &str,
    table: &Spanned<grammar::Damage>,
) -> Result<plan::CriticalStretch> {
    let grammar::Damage::CriticalStretch(spanned) = table.get_ref();
    let law = spanned.get_ref();
    let key = format!("[damage.{name}.critical_stretch]");
    type Measure = fn(f64) -> plan::Toughness;
    let measures: [(&str, &Option<Number>, Measure); 3] = [
        (
            "fracture_energy",
            &law.fracture_energy,
            plan::Toughness::FractureEnergy,
        ),
        (
            "fracture_toughness",
            &law.fracture_toughness,
            plan::Toughness::FractureToughness,
        ),
        (
            "critical_stretch",
            &law.critical_stretch,
            plan::Toughness::CriticalStretch,
        ),
    ];
    let given = measures.map(|(name, number, _)| (name, number.as_ref().map(Spanned::span)));
    let (measure, number, toughness) = measures[scope.exactly_one(spanned.span(), &key, &given)?];
    let number = number.as_ref().expect("this measure is given");
    let toughness = toughness(scope.positive(number, &format!("{key} {measure}"))?);
    let alpha_key = format!("{key} alpha");
    Ok(plan::CriticalStretch {
        toughness,
        alpha: scope.within(&law.alpha, &alpha_key, 0.0..1.0, "at least 0 and below 1")?,
        no_failure: find_sets(scope, &law.no_failure, sets, &format!("{key} no_failure"))?,
    })
}
