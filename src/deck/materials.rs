//! Materials and damage laws of a deck, validated.

use serde_spanned::Spanned;

use super::expression::Variable;
use super::grammar;
use super::number::Number;
use super::plan;
use super::resolve::Scope;
use super::sets::find_sets;
use crate::dimension::Dimension;
use crate::elastic::{Constant, Isotropic};
use crate::error::Result;
use crate::material::Influence;

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

/// The table of a material, and the name of its law.
fn table(material: &grammar::Material) -> (&Spanned<grammar::Elastic>, &'static str) {
    match material {
        grammar::Material::Pmb(table) => (table, "pmb"),
        grammar::Material::Proportional(table) => (table, "proportional"),
        grammar::Material::NormalisedPmb(table) => (table, "normalised_pmb"),
        grammar::Material::LinearMicroelastic(table) => (table, "linear_microelastic"),
        grammar::Material::Ordinary(table) => (table, "ordinary"),
    }
}

/// Validates a material.
///
/// # Errors
/// On wrong constants, too few or too many, those of a solid that the law cannot be, and on keys that
/// belong to another law.
pub fn material(
    scope: &Scope,
    dimension: Dimension,
    name: &str,
    material: &Spanned<grammar::Material>,
) -> Result<plan::Material> {
    let (spanned, law_name) = table(material.get_ref());
    let table = spanned.get_ref();
    let key = format!("[material.{name}.{law_name}]");
    let law = law(scope, dimension, material, &key)?;
    Ok(plan::Material {
        density: scope.positive(&table.density, &format!("{key} density"))?,
        elastic: elastic(scope, dimension, spanned, &law, &key)?,
        damping: match &table.damping {
            None => 0.0,
            Some(number) => {
                let key = format!("{key} damping");
                scope.within(number, &key, 0.0..f64::INFINITY, "at least 0")?
            }
        },
        law,
    })
}

/// The law, with the keys that only it has.
fn law(
    scope: &Scope,
    dimension: Dimension,
    material: &Spanned<grammar::Material>,
    key: &str,
) -> Result<plan::Law> {
    let (spanned, law_name) = table(material.get_ref());
    let table = spanned.get_ref();
    let plain = ["pmb", "proportional", "linear_microelastic"];
    let correction = table.surface_correction.as_ref();
    let own_keys: [(&str, Option<_>, &[&str]); 4] = [
        ("surface_correction", correction.map(Spanned::span), &plain),
        (
            "form",
            table.form.as_ref().map(Spanned::span),
            &["normalised_pmb"],
        ),
        (
            "influence",
            table.influence.as_ref().map(Spanned::span),
            &["ordinary"],
        ),
        (
            "lambda",
            table.lambda.as_ref().map(Spanned::span),
            &["linear_microelastic"],
        ),
    ];
    for (name, place, laws) in own_keys {
        if let (Some(place), false) = (place, laws.contains(&law_name)) {
            let message = format!("{key} {name}: only `{}` has this key", laws.join("` and `"));
            return Err(scope.error(place, message));
        }
    }
    let corrected = correction
        .is_some_and(|correction| *correction.get_ref() == grammar::SurfaceCorrection::Energy);
    let line = matches!(dimension, Dimension::Line { .. });
    Ok(match material.get_ref() {
        grammar::Material::Pmb(_) => plan::Law::Pmb { corrected },
        grammar::Material::Proportional(_) => plan::Law::Proportional { corrected },
        grammar::Material::NormalisedPmb(_) => {
            let Some(form) = &table.form else {
                return Ok(plan::Law::NormalisedPmb(plan::NormalisedForm::Energy));
            };
            plan::Law::NormalisedPmb(match form.get_ref() {
                grammar::Form::Energy => plan::NormalisedForm::Energy,
                grammar::Form::Diehl2016 if line => {
                    let message = format!(
                        "{key} form: the paper has no constant for 1-D; `energy` serves there"
                    );
                    return Err(scope.error(form.span(), message));
                }
                grammar::Form::Diehl2016 => plan::NormalisedForm::Diehl2016,
            })
        }
        grammar::Material::LinearMicroelastic(_) => {
            let parse = |number| scope.expression(number, &format!("{key} lambda"), &[Variable::R]);
            plan::Law::LinearMicroelastic {
                lambda: table.lambda.as_ref().map(parse).transpose()?,
                corrected,
            }
        }
        grammar::Material::Ordinary(_) if line => {
            let message =
                format!("{key}: `ordinary` has no 1-D form; `pmb` is the same there for ν = 0.25");
            return Err(scope.error(spanned.span(), message));
        }
        grammar::Material::Ordinary(_) => {
            let influence = table
                .influence
                .as_ref()
                .map(|influence| *influence.get_ref());
            plan::Law::Ordinary(match influence {
                None | Some(grammar::Influence::Constant) => Influence::Constant,
                Some(grammar::Influence::Linear) => Influence::Linear,
                Some(grammar::Influence::Gaussian) => Influence::Gaussian,
                Some(grammar::Influence::Inverse) => Influence::Inverse,
            })
        }
    })
}

/// The elastic constants; those of a bond-based law have its own Poisson ratio.
fn elastic(
    scope: &Scope,
    dimension: Dimension,
    spanned: &Spanned<grammar::Elastic>,
    law: &plan::Law,
    key: &str,
) -> Result<Isotropic> {
    let bond_based = !matches!(law, plan::Law::Ordinary(_));
    let own = dimension.bond_based_poisson_ratio();
    let value = |key_name: &str, constant, number: &Number| {
        let key = format!("{key} {key_name}");
        match constant {
            Constant::Poisson => scope.within(number, &key, -1.0..0.5, "between -1 and 0.5"),
            Constant::Lame => scope.number(number, &key),
            Constant::Young | Constant::Bulk | Constant::Shear => scope.positive(number, &key),
        }
    };
    let constants = given(spanned.get_ref());
    let pair = match constants[..] {
        [(key_name, constant, number)] if constant != Constant::Poisson && bond_based => [
            (constant, value(key_name, constant, number)?),
            (Constant::Poisson, own),
        ],
        [a, b] => [(a.1, value(a.0, a.1, a.2)?), (b.1, value(b.0, b.1, b.2)?)],
        _ => {
            let names = "`youngs_modulus`, `bulk_modulus`, `shear_modulus`, `lame_lambda` and \
                         `poisson_ratio`";
            let message = match bond_based {
                true => format!(
                    "{key}: give one or two of {names}; with one (not the last), Poisson's ratio \
                     is the law's own"
                ),
                false => format!("{key}: give two of {names}"),
            };
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
    if !bond_based {
        return Ok(found);
    }
    // A ratio given as 0.33 or 0.333 means 1/3.
    if (found.poisson_ratio - own).abs() > 0.005 {
        let other = match dimension {
            Dimension::Line { .. } => "",
            _ => ", or take the law `ordinary`, which has any",
        };
        let message = format!(
            "{key}: Poisson's ratio is {:.4}, but a bond-based law in {} always has {:.4}; leave \
             the second constant out to accept that{other}",
            found.poisson_ratio,
            dimension.name(),
            own,
        );
        return Err(scope.error(place, message));
    }
    Ok(Isotropic {
        youngs_modulus: found.youngs_modulus,
        poisson_ratio: own,
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
