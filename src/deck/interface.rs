//! Validation of the bonds between the bodies of a deck.

use indexmap::IndexMap;

use super::grammar::{self, Deck, Rule};
use super::number::Number;
use super::resolve::{Scope, find};
use crate::damage::CriticalStretch;
use crate::deck::spanned::Spanned;
use crate::dimension::Dimension;
use crate::error::Result;
use crate::message::format_number;
use crate::problem::check::{direction_fault, micromodulus_fault};
use crate::problem::{self, DamageRule, InterfaceDamage, InterfacePair, InterfaceRule, Toughness};

/// Value of `damage` for a pair whose bonds never break.
const UNBREAKABLE: &str = "none";

/// Largest allowed ratio of the tensile moduli of two bodies whose interface has a strength.
const MAX_STIFFNESS_RATIO: f64 = 10.0;

/// Validate the rules of the bonds between bodies, and the damage laws of pairs.
///
/// # Errors
/// - If the laws of bonded bodies exert forces in different directions.
/// - If a pair is invalid or repeated.
/// - If the material laws of a pair do not allow its rule or strength.
///
/// This function does not check whether the material laws allow the damage law of a pair; the solver checks
/// this.
pub fn interface(
    scope: &Scope,
    deck: &Deck,
    dimension: Dimension,
    bodies: &[problem::Body],
    damages: &IndexMap<String, problem::Damage>,
) -> Result<problem::Interface> {
    let mut pairs: Vec<(String, [usize; 2], &Spanned<Rule>)> = Vec::new();
    let default = Spanned::new(
        0..0,
        match deck.contact {
            Some(_) => Rule::None,
            None => Rule::Own,
        },
    );
    let all = deck.interface.rule.as_ref().unwrap_or(&default);
    let mut interface = problem::Interface {
        rule: rule(all),
        pairs: Vec::new(),
    };
    for (name, table) in &deck.interface.pair {
        let key = format!("[interface.pair.{name}]");
        let place = table.span();
        let table = table.get_ref();
        if table.rule.is_none() && table.damage.is_none() && table.strength.is_none() {
            let message = format!("{key}: give `rule`, `damage` or `strength`");
            return Err(scope.error(place, message));
        }
        let pair = pair(scope, &key, table, bodies)?;
        if let Some((earlier, ..)) = pairs.iter().find(|(_, other, _)| *other == pair) {
            let [a, b] = pair.map(|body| &bodies[body].name);
            let message = format!(
                "{key} bodies: {earlier} already describes the bonds between `{a}` and `{b}`"
            );
            return Err(scope.error(table.bodies.span(), message));
        }
        let own_rule = table.rule.as_ref().unwrap_or(all);
        let of_pair = PairContext {
            scope,
            key: &key,
            dimension,
            bodies: pair.map(|body| &bodies[body]),
            has_bonds: rule(own_rule) != InterfaceRule::None,
        };
        let (damage, span) = of_pair.damage(table, damages)?;
        interface.pairs.push(InterfacePair {
            name: name.clone(),
            bodies: pair.map(|body| bodies[body].name.clone()),
            rule: rule(own_rule),
            damage,
            span,
        });
        pairs.push((key, pair, own_rule));
    }
    for second in 1..bodies.len() {
        for first in 0..second {
            let pair = [first, second];
            let own = pairs.iter().find(|(_, other, _)| *other == pair);
            let (key, rule) =
                own.map_or(("[interface]", all), |(key, _, rule)| (key.as_str(), *rule));
            if *rule.get_ref() != Rule::None {
                let pair = pair.map(|body| &bodies[body]);
                if let Some((body, fault)) = direction_fault(pair) {
                    let message = format!("[body.{}] material: {fault}", body.name);
                    return Err(scope.error(body.span.clone(), message));
                }
                if let Some(fault) = micromodulus_fault(self::rule(rule), pair) {
                    return Err(scope.error(rule.span(), format!("{key} rule: {fault}")));
                }
            }
        }
    }
    Ok(interface)
}

/// Context for the validation of `damage` and `strength` of a pair of bodies.
struct PairContext<'a> {
    scope: &'a Scope<'a>,
    key: &'a str,
    dimension: Dimension,
    bodies: [&'a problem::Body; 2],
    has_bonds: bool,
}

impl PairContext<'_> {
    /// Return how the bonds break, and the byte range of the value of `damage` or `strength`; the byte
    /// range is `0..0` if the pair gives neither.
    fn damage(
        &self,
        table: &grammar::Pair,
        damages: &IndexMap<String, problem::Damage>,
    ) -> Result<(InterfaceDamage, std::ops::Range<usize>)> {
        let (scope, key) = (self.scope, self.key);
        let name = table.damage.as_ref();
        let (what, span) = match (name, &table.strength) {
            (None, None) => return Ok((InterfaceDamage::OfBodies, 0..0)),
            (Some(_), Some(strength)) => {
                let message = format!(
                    "{key} strength: `damage` is given already; give one of `damage` and `strength`"
                );
                return Err(scope.error(strength.span(), message));
            }
            (Some(name), None) => ("damage", name.span()),
            (None, Some(strength)) => ("strength", strength.span()),
        };
        if !self.has_bonds {
            let message = format!(
                "{key} {what}: `rule = \"none\"` makes no bonds between these bodies; give the pair another `rule`"
            );
            return Err(scope.error(span, message));
        }
        if let Some(strength) = &table.strength {
            let damage = self.of_strength(strength)?;
            return Ok((InterfaceDamage::Own(damage), span));
        }
        let name = name.expect("damage is given");
        if name.get_ref() == UNBREAKABLE {
            if damages.contains_key(UNBREAKABLE) {
                let message = format!(
                    "{key} damage: `{UNBREAKABLE}` means bonds that never break; give [damage.{UNBREAKABLE}] another name"
                );
                return Err(scope.error(span, message));
            }
            return Ok((InterfaceDamage::Unbreakable, span));
        }
        let names = damages.keys().map(String::as_str);
        let index = scope.find_used("damage", name, names, &format!("{key} damage"))?;
        Ok((InterfaceDamage::Own(damages[index].clone()), span))
    }

    /// Return the damage law whose critical stretch follows from a strength. Return an error if the material
    /// law of a body does not allow a strength, or if the stiffnesses of the bodies differ too much.
    fn of_strength(&self, strength: &Number) -> Result<problem::Damage> {
        let key = format!("{} strength", self.key);
        let stress = self.scope.positive(strength, &key)?;
        let error = |message: String| {
            let message = format!("{key}: {message}");
            Err(self.scope.error(strength.span(), message))
        };
        for body in self.bodies {
            let law = &body.material.law;
            let declaration = law.declaration;
            if declaration.breaks_by_itself() {
                return error(format!(
                    "bonds of `{}` soften by their own law; remove `strength`",
                    declaration.name
                ));
            }
            if declaration.critical_stretch.is_none() {
                return error(format!(
                    "bonds of `{}` break by work, so `strength` does not define when they break; give `damage`",
                    declaration.name
                ));
            }
            if !(declaration.invariants)(&law.values).conservative {
                return error(format!(
                    "the stress in `{}` does not follow from the stretch alone; give `damage`",
                    declaration.name
                ));
            }
        }
        let elastic = self.bodies.map(|body| body.material.elastic);
        let [a, b] =
            elastic.map(|elastic| CriticalStretch::tensile_modulus(self.dimension, elastic));
        let ratio = (a / b).max(b / a);
        if ratio > MAX_STIFFNESS_RATIO {
            return error(format!(
                "is for bodies whose stiffnesses differ by a factor of at most {MAX_STIFFNESS_RATIO}, but the stiffnesses of these bodies \
                 differ by a factor of {}; give `damage` with a `critical_stretch`",
                format_number((10.0 * ratio).round() / 10.0)
            ));
        }
        let critical = CriticalStretch::from_strength(self.dimension, elastic, stress);
        Ok(problem::Damage::new(
            DamageRule::CriticalStretch,
            Toughness::CriticalStretch(critical),
        ))
    }
}

fn rule(rule: &Spanned<Rule>) -> problem::InterfaceRule {
    match rule.get_ref() {
        Rule::None => problem::InterfaceRule::None,
        Rule::Own => problem::InterfaceRule::Own,
        Rule::Average => problem::InterfaceRule::Average,
        Rule::Minimum => problem::InterfaceRule::Minimum,
    }
}

/// Return the indices of two different bodies, the lower index first.
fn pair(
    scope: &Scope,
    key: &str,
    table: &grammar::Pair,
    bodies: &[problem::Body],
) -> Result<[usize; 2]> {
    let key = format!("{key} bodies");
    let [first, second] = &table.bodies.get_ref()[..] else {
        let count = table.bodies.get_ref().len();
        let message = format!("{key}: must name two bodies, names {count}");
        return Err(scope.error(table.bodies.span(), message));
    };
    let names = bodies.iter().map(|body| body.name.as_str());
    let a = find(scope.source, first, names.clone(), &key)?;
    let b = find(scope.source, second, names, &key)?;
    if a == b {
        let message = format!(
            "{key}: `{}` is named twice; name two different bodies, because bonds within a body have the constants of \
             this body",
            bodies[a].name
        );
        return Err(scope.error(second.span(), message));
    }
    Ok([a.min(b), a.max(b)])
}
