//! Bonds between bodies.

use super::{bodies, wrong};
use crate::error::Result;
use crate::problem::{Body, InterfaceRule, Problem};

/// Check the rules of the bonds between bodies, and the damage laws of pairs.
///
/// # Errors
/// On a pair with unknown or equal bodies, a repeated pair, or an invalid damage law. If the laws of two
/// bonded bodies exert forces in different directions, or do not allow the rule of their bonds.
pub fn bonds(problem: &Problem) -> Result<()> {
    let pairs = &problem.interface.pairs;
    for (number, pair) in pairs.iter().enumerate() {
        let section = format!("[interface.pair.{}]", pair.name);
        are_bodies(problem, &section, &pair.bodies)?;
        let [first, second] = &pair.bodies;
        if first == second {
            let fault = format!("`{first}` is named twice; name two different bodies");
            return Err(wrong(&format!("{section} bodies"), fault));
        }
        let is_same = |bodies: &[String; 2]| bodies.contains(first) && bodies.contains(second);
        if let Some(earlier) = pairs[..number].iter().find(|pair| is_same(&pair.bodies)) {
            let fault = format!(
                "[interface.pair.{}] already describes the bonds between `{first}` and `{second}`",
                earlier.name
            );
            return Err(wrong(&format!("{section} bodies"), fault));
        }
        if let Some(damage) = pair.own_damage() {
            bodies::damage(problem, damage, &section)?;
        }
    }
    for (number, second) in problem.bodies.iter().enumerate() {
        for first in &problem.bodies[..number] {
            let rule = problem.interface.between(first, second);
            if rule == InterfaceRule::None {
                continue;
            }
            if let Some((body, fault)) = direction_fault([first, second]) {
                return Err(wrong(&format!("[body.{}] material", body.name), fault));
            }
            if let Some(fault) = micromodulus_fault(rule, [first, second]) {
                let pair = problem.interface.pair(first, second);
                let section = pair.map_or("[interface]".to_owned(), |pair| {
                    format!("[interface.pair.{}]", pair.name)
                });
                return Err(wrong(&format!("{section} rule"), fault));
            }
        }
    }
    Ok(())
}

/// Check that two names are names of bodies.
pub(super) fn are_bodies(problem: &Problem, section: &str, names: &[String; 2]) -> Result<()> {
    let is_unknown = |name: &&String| problem.bodies.iter().all(|body| body.name != **name);
    match names.iter().find(is_unknown) {
        None => Ok(()),
        Some(name) => {
            let fault = format!("no body has the name `{name}`");
            Err(wrong(&format!("{section} bodies"), fault))
        }
    }
}

/// Return the reason why bonds cannot join two bodies, and the body that it concerns: their laws exert forces
/// in different directions. `None` if bonds can join the bodies.
pub(crate) fn direction_fault(pair: [&Body; 2]) -> Option<(&Body, String)> {
    let law = |body: &Body| body.material.law.declaration;
    let linear = pair.into_iter().find(|body| law(body).linear)?;
    let other = pair.into_iter().find(|body| !law(body).linear)?;
    let fault = format!(
        "bonds cannot join `{nonlinear}` and `{linear}`: the forces of `{linear}` act along the undeformed bond, \
         the forces of `{nonlinear}` do not; give both bodies laws of the same kind, or set `rule = \"none\"` to \
         omit the bonds between the bodies",
        nonlinear = law(other).name,
        linear = law(linear).name,
    );
    Some((other, fault))
}

/// Return the reason why the bonds between two bodies cannot have a rule that needs one micromodulus for both
/// ends of a bond (any rule but `own`). `None` if both bodies have the same bond-based law, and no key of the
/// law is given as a function of the bond length.
pub(crate) fn micromodulus_fault(rule: InterfaceRule, pair: [&Body; 2]) -> Option<String> {
    let [first, second] = pair.map(|body| body.material.law.declaration.name);
    let has_micromodulus = |body: &Body| {
        let law = &body.material.law;
        !law.declaration.any_poisson_ratio && law.key_of_length().is_none()
    };
    if rule == InterfaceRule::Own || first == second && pair.into_iter().all(has_micromodulus) {
        return None;
    }
    let with_key = |body: &Body| {
        let key = body.material.law.key_of_length();
        key.map_or(String::new(), |key| format!(" with a `{key}`"))
    };
    Some(format!(
        "this rule uses one micromodulus for both ends of a bond, so both bodies need the same bond-based law (a \
         state-based law has no micromodulus), but [body.{}] is `{first}`{} and [body.{}] is `{second}`{}; use `own`",
        pair[0].name,
        with_key(pair[0]),
        pair[1].name,
        with_key(pair[1]),
    ))
}
