//! The bonds between the bodies of a deck, validated.

use super::grammar::{self, Deck, Rule};
use super::resolve::{Scope, find};
use crate::deck::spanned::Spanned;
use crate::error::Result;
use crate::problem;

/// Validates the rules of the bonds between bodies.
///
/// # Errors
/// On bodies whose laws no bond can have, a rule that the laws of a pair do not allow, and on pairs that
/// are none or are given twice.
pub fn interface(
    scope: &Scope,
    deck: &Deck,
    bodies: &[problem::Body],
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
        let table = table.get_ref();
        let pair = pair(scope, &key, table, bodies)?;
        if let Some((earlier, ..)) = pairs.iter().find(|(_, other, _)| *other == pair) {
            let [a, b] = pair.map(|body| &bodies[body].name);
            let message =
                format!("{key} bodies: {earlier} has the bonds between `{a}` and `{b}` already");
            return Err(scope.error(table.bodies.span(), message));
        }
        let names = pair.map(|body| bodies[body].name.clone());
        interface.pairs.push((names, rule(&table.rule)));
        pairs.push((key, pair, &table.rule));
    }
    for second in 1..bodies.len() {
        for first in 0..second {
            let pair = [first, second];
            let own = pairs.iter().find(|(_, other, _)| *other == pair);
            let (key, rule) =
                own.map_or(("[interface]", all), |(key, _, rule)| (key.as_str(), *rule));
            if *rule.get_ref() != Rule::None {
                let pair = pair.map(|body| &bodies[body]);
                one_direction(scope, pair)?;
                one_micromodulus(scope, &format!("{key} rule"), rule, pair)?;
            }
        }
    }
    Ok(interface)
}

fn rule(rule: &Spanned<Rule>) -> problem::InterfaceRule {
    match rule.get_ref() {
        Rule::None => problem::InterfaceRule::None,
        Rule::Own => problem::InterfaceRule::Own,
        Rule::Average => problem::InterfaceRule::Average,
        Rule::Minimum => problem::InterfaceRule::Minimum,
    }
}

/// The indices of two different bodies, the lower one first.
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
            "{key}: `{}` is named twice; bonds within a body have its own constants",
            bodies[a].name
        );
        return Err(scope.error(second.span(), message));
    }
    Ok([a.min(b), a.max(b)])
}

/// An error if the laws of two bodies exert forces in different directions on their bonds.
fn one_direction(scope: &Scope, pair: [&problem::Body; 2]) -> Result<()> {
    let law = |body: &problem::Body| body.material.law.declaration;
    let linear = pair.into_iter().find(|body| law(body).linear);
    let other = pair.into_iter().find(|body| !law(body).linear);
    let (Some(linear), Some(other)) = (linear, other) else {
        return Ok(());
    };
    let message = format!(
        "[body.{}] material: the forces of `{}` and `{}` have different directions; \
         `rule = \"none\"` keeps the bodies apart",
        other.name,
        law(other).name,
        law(linear).name,
    );
    Err(scope.error(other.span.clone(), message))
}

/// An error if a rule needs one micromodulus for both ends and the laws of two bodies cannot have it.
fn one_micromodulus(
    scope: &Scope,
    key: &str,
    rule: &Spanned<Rule>,
    pair: [&problem::Body; 2],
) -> Result<()> {
    let [first, second] = pair.map(|body| body.material.law.declaration.name);
    let has_micromodulus = |body: &problem::Body| {
        let law = &body.material.law;
        !law.declaration.any_poisson_ratio && law.key_of_length().is_none()
    };
    if *rule.get_ref() == Rule::Own || first == second && pair.into_iter().all(has_micromodulus) {
        return Ok(());
    }
    let with_key = |body: &problem::Body| {
        let key = body.material.law.key_of_length();
        key.map_or(String::new(), |key| format!(" with a `{key}`"))
    };
    let message = format!(
        "{key}: one micromodulus for both ends needs the same bond-based law in both bodies (a state-based law has none), but \
         [body.{}] is `{first}`{} and [body.{}] is `{second}`{}; take `own`",
        pair[0].name,
        with_key(pair[0]),
        pair[1].name,
        with_key(pair[1]),
    );
    Err(scope.error(rule.span(), message))
}
