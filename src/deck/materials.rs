//! Validation of the materials of a deck.

use std::ops::Range;

use super::grammar::{
    self, DAMPING, DENSITY, ELASTIC_CONSTANTS, LawTable, REFERENCE_TEMPERATURE, THERMAL_EXPANSION,
    common_keys,
};
use super::number::{Number, Written};
use super::resolve::Scope;
use crate::deck::spanned::Spanned;
use crate::dimension::Dimension;
use crate::elastic::{Constant, Isotropic};
use crate::error::Result;
use crate::expression::Variable;
use crate::material::{Declaration, Key, Kind, Value, declarations};
use crate::message::suggestion;
use crate::problem::{self, check::RATIO_TOLERANCE, law};

/// Validate a material.
///
/// # Errors
/// - If the law or a key is unknown.
/// - If a constant is invalid, missing or surplus.
/// - If the law does not support the elastic constants.
pub fn material(
    scope: &Scope,
    dimension: Dimension,
    name: &str,
    material: &Spanned<grammar::Material>,
) -> Result<problem::Material> {
    let grammar::Material { law, table } = material.get_ref();
    let declaration = law::find(law.get_ref())
        .map_err(|message| scope.error(law.span(), format!("[material.{name}]: {message}")))?;
    let section = Section {
        scope,
        key: format!("[material.{name}.{}]", declaration.name),
        declaration,
        table: table.get_ref(),
        place: table.span(),
    };
    section.keys_are_known()?;
    let Some(density) = section.table.get(DENSITY) else {
        return Err(section.error(None, format!("needs `{DENSITY}`")));
    };
    let law = section.law(dimension)?;
    Ok(problem::Material {
        density: scope.positive(density, &section.key_of(DENSITY))?,
        elastic: section.elastic(&law, dimension)?,
        law,
        damping: match section.table.get(DAMPING) {
            None => 0.0,
            Some(number) => {
                let key = section.key_of(DAMPING);
                scope.within(number, &key, 0.0..f64::INFINITY, "at least 0")?
            }
        },
        expansion: section.expansion()?,
    })
}

/// The table of a law, with the context of its validation.
struct Section<'a> {
    scope: &'a Scope<'a>,
    /// Header of the section, for error messages.
    key: String,
    declaration: &'static Declaration,
    table: &'a LawTable,
    place: Range<usize>,
}

impl Section<'_> {
    /// Format the section header and a key for error messages: `[material.glass.pmb] density`.
    fn key_of(&self, name: &str) -> String {
        format!("{} {name}", self.key)
    }

    /// Return an error at the value of the key `name`. If `name` is `None` or the deck lacks the key, the
    /// error is at the table.
    fn error(&self, name: Option<&str>, message: impl AsRef<str>) -> crate::error::Error {
        let number = name.and_then(|name| self.table.get(name));
        let place = number.map_or(self.place.clone(), Spanned::span);
        let key = name.map_or(self.key.clone(), |name| self.key_of(name));
        let message = message.as_ref();
        self.scope.error(place, format!("{key}: {message}"))
    }

    fn keys_are_known(&self) -> Result<()> {
        let own = self.declaration.keys.iter().map(|key| key.name);
        let known = common_keys().chain(own);
        let unknown = |key: &&grammar::Text| known.clone().all(|known| known != key.get_ref());
        let Some(key) = self.table.keys().find(unknown) else {
            return Ok(());
        };
        let name = key.get_ref().as_str();
        let have = || declarations().filter(|law| law.key(name).is_some());
        let message = match have().count() {
            0 => {
                let message = format!("unknown key `{name}`{}", suggestion(name, known));
                let message = format!("{}: {message}", self.key);
                return Err(self.scope.error(key.span(), message));
            }
            1 => format!("only {} has this key", law::names(have(), "and")),
            _ => format!("only {} have this key", law::names(have(), "and")),
        };
        Err(self.error(Some(name), message))
    }

    fn expansion(&self) -> Result<problem::ThermalExpansion> {
        let value = |name: &str| {
            let number = self.table.get(name);
            number.map(|number| self.scope.number(number, &self.key_of(name)))
        };
        let coefficient = value(THERMAL_EXPANSION).transpose()?;
        let reference_temperature = value(REFERENCE_TEMPERATURE).transpose()?;
        if coefficient.is_none() && reference_temperature.is_some() {
            let message = format!("needs `{THERMAL_EXPANSION}`");
            return Err(self.error(Some(REFERENCE_TEMPERATURE), message));
        }
        Ok(problem::ThermalExpansion {
            coefficient: coefficient.unwrap_or(0.0),
            reference_temperature: reference_temperature.unwrap_or(0.0),
        })
    }

    /// Return the law with the values of its declared keys.
    fn law(&self, dimension: Dimension) -> Result<problem::Law> {
        let mut law = problem::Law::of(self.declaration);
        for key in self.declaration.keys {
            if let Some(written) = self.table.get(key.name) {
                law.values.set(key.name, self.value(key, written)?);
            }
        }
        match law.fault(dimension) {
            None => Ok(law),
            Some(fault) => Err(self.error(fault.key, fault.message)),
        }
    }

    fn value(&self, key: &Key, written: &Number) -> Result<Value> {
        let value = match (&key.kind, written.get_ref()) {
            (Kind::Word(_), Written::Text(word)) => word.as_str().into(),
            (Kind::Word(_) | Kind::Number { .. } | Kind::Optional { .. }, _) => {
                self.scope.number(written, &self.key_of(key.name))?.into()
            }
            (Kind::OfLength, _) => {
                let name = self.key_of(key.name);
                self.scope
                    .expression(written, &name, &[Variable::R])?
                    .into()
            }
        };
        law::check(key, &value).map_err(|message| self.error(Some(key.name), message))?;
        Ok(value)
    }

    /// Return the elastic constants of the material. A bond-based law fixes Poisson's ratio, except for a bar
    /// under uniaxial stress. Some laws compute the elastic constants from their own keys.
    fn elastic(&self, law: &problem::Law, dimension: Dimension) -> Result<Isotropic> {
        let own = (self.declaration.elastic).and_then(|own| own(&law.values, dimension));
        if let Some(own) = own {
            return match self.elastic_constants().first() {
                None => Ok(own),
                Some((name, _)) => Err(self.error(
                    Some(name),
                    "the material already has the constants of an anisotropic solid; remove this key",
                )),
            };
        }
        let bond_based = !self.declaration.any_poisson_ratio;
        let own = dimension.bond_based_poisson_ratio();
        let given = self.elastic_constants();
        let value = |(name, constant): (&str, Constant)| {
            let (key, number) = (self.key_of(name), &self.table[name]);
            let value = match constant {
                Constant::Poisson => {
                    self.scope
                        .within(number, &key, -1.0..0.5, "above -1 and below 0.5")
                }
                Constant::Lame => self.scope.number(number, &key),
                Constant::Young | Constant::Bulk | Constant::Shear => {
                    self.scope.positive(number, &key)
                }
            };
            Ok((constant, value?))
        };
        let pair = match given[..] {
            [only] if only.1 != Constant::Poisson && bond_based => {
                [value(only)?, (Constant::Poisson, own)]
            }
            [first, second] => [value(first)?, value(second)?],
            _ => return Err(self.wrong_number_of_constants(&given)),
        };
        let last = given.last().map(|(name, _)| *name);
        // If the combination of two constants is invalid, the error is at the second constant.
        let error = |message: String| {
            let place = last.map_or(self.place.clone(), |name| self.table[name].span());
            self.scope.error(place, format!("{}: {message}", self.key))
        };
        let Some(found) = Isotropic::from_two(pair[0], pair[1]) else {
            let names: Vec<&str> = given.iter().map(|(name, _)| *name).collect();
            return Err(error(format!(
                "{} must give moduli above 0 and a Poisson's ratio between -1 and 0.5",
                names.join(" and ")
            )));
        };
        if !bond_based || dimension.allows_any_poisson_ratio() {
            return Ok(found);
        }
        if (found.poisson_ratio - own).abs() > RATIO_TOLERANCE {
            let others =
                declarations().filter(|law| law.any_poisson_ratio && law.is_for(dimension));
            let other = match others.clone().count() {
                0 => String::new(),
                _ => format!(
                    ", or use the law {}, which allows any Poisson's ratio",
                    law::names(others, "or")
                ),
            };
            return Err(error(format!(
                "Poisson's ratio is {:.4}, but a bond-based law in {} always has {:.4}; remove the \
                 second constant to accept the ratio of the bond-based law{other}",
                found.poisson_ratio,
                dimension.name(),
                own,
            )));
        }
        Ok(Isotropic {
            youngs_modulus: found.youngs_modulus,
            poisson_ratio: own,
        })
    }

    /// Return key and kind of the given elastic constants, in the order of the deck.
    fn elastic_constants(&self) -> Vec<(&'static str, Constant)> {
        let mut given: Vec<_> = ELASTIC_CONSTANTS
            .into_iter()
            .filter(|(name, _)| self.table.contains_key(*name))
            .collect();
        given.sort_by_key(|(name, _)| self.table[*name].span().start);
        given
    }

    fn wrong_number_of_constants(&self, given: &[(&str, Constant)]) -> crate::error::Error {
        let names = "`youngs_modulus`, `bulk_modulus`, `shear_modulus`, `lame_lambda` and \
                     `poisson_ratio`";
        let message = if self.declaration.any_poisson_ratio {
            format!("{}: give two of {names}", self.key)
        } else {
            format!(
                "{}: give one or two of {names}; if you give only one (not `poisson_ratio`), the law \
                 determines Poisson's ratio",
                self.key
            )
        };
        let third = given.get(2).map(|(name, _)| self.table[*name].span());
        self.scope
            .error(third.unwrap_or(self.place.clone()), message)
    }
}
