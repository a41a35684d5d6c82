//! Check that the laws and the damage of all bodies are compatible with each other and with the other
//! settings of the problem.

use super::{Breaks, breaks, build, constants, given};
use crate::error::{Error, Result};
use crate::problem::{
    self, Block, Body, DamageRule, InterfaceDamage, InterfacePair, InterfaceRule, Problem,
    Toughness, VolumeCorrection,
};

/// Check the laws, the damage, the thermal expansion and the horizons of all bodies, and the damage of pairs
/// of bodies.
///
/// # Errors
/// - If the law of a body does not support the dimension of the problem.
/// - If the law does not support the damage, the thermal expansion or a horizon of the body.
/// - If the damage of a body is incompatible with another setting.
/// - If bonds may join two bodies, and the damage of one is incompatible with the damage of the other.
/// - If the bonds of a pair of bodies cannot have the damage of the pair.
///
/// Most of these errors are found earlier, when the deck is read.
pub fn laws_are_possible(problem: &Problem) -> Result<()> {
    for body in &problem.bodies {
        let law = &body.material.law;
        let fault = law.fault(problem.dimension).map(|fault| fault.message);
        let damage = body.damage.as_ref();
        let fault = fault.or_else(|| damage.and_then(|damage| law.damage_fault(damage)));
        if let Some(fault) = fault {
            let name = law.declaration.name;
            return Err(Error::input(format!(
                "[body.{}] law `{name}`: {fault}",
                body.name
            )));
        }
        damage_is_possible(problem, body)?;
        expansion_is_possible(problem, body)?;
    }
    for pair in &problem.interface.pairs {
        if let Some(damage) = pair.own_damage() {
            pair_damage_is_possible(problem, pair, damage)?;
        }
        if pair.damage == InterfaceDamage::Unbreakable {
            softening_can_break(problem, pair)?;
        }
    }
    horizons_are_possible(problem)
}

/// Check a pair of bodies with unbreakable bonds: return an error if the law of one of the bodies breaks
/// bonds itself. Unbreakable bonds of such a law would soften and never break.
fn softening_can_break(problem: &Problem, pair: &InterfacePair) -> Result<()> {
    let softens = |body: &&Body| pair.has(body) && body.material.law.declaration.breaks_by_itself();
    let Some(body) = problem.bodies.iter().find(softens) else {
        return Ok(());
    };
    let message = format!(
        "[interface.pair.{}] damage: bonds of `{}` break by their own law; remove `damage`",
        pair.name, body.material.law.declaration.name
    );
    Err(Error::input(message).at(&pair.span))
}

/// Return an error if the bonds between two bodies cannot have a separate damage law.
fn pair_damage_is_possible(
    problem: &Problem,
    pair: &InterfacePair,
    damage: &problem::Damage,
) -> Result<()> {
    let error = |message: String| {
        let message = format!("[interface.pair.{}] damage: {message}", pair.name);
        Err(Error::input(message).at(&pair.span))
    };
    let of_points = [
        (damage.alpha > 0.0, "alpha"),
        (damage.weibull.is_some(), "weibull_modulus"),
        (damage.direction.is_some(), "direction"),
    ];
    if let Some((_, key)) = of_points.into_iter().find(|(is, _)| *is) {
        return error(format!(
            "`{key}` belongs to the points of a body and not to the bonds of a pair; give the pair a damage without `{key}`"
        ));
    }
    if damage.rule.is_unmeasured() {
        let message =
            "`calibration = \"opening\"` is not available for a pair of bodies; use \"energy\"";
        return error(message.to_owned());
    }
    let bodies = problem.bodies.iter().filter(|body| pair.has(body));
    for body in bodies.clone() {
        let fault = body.material.law.damage_fault(damage);
        let fault = fault.or_else(|| damage_fault(problem, body, damage));
        if let Some(fault) = fault {
            return error(format!("[body.{}]: {fault}", body.name));
        }
    }
    let mut by_work = bodies.map(|body| (breaks(body, damage) == Breaks::Work, &body.name));
    if let (Some((first, a)), Some((second, b))) = (by_work.next(), by_work.next())
        && first != second
    {
        let [work, stretch] = if first { [a, b] } else { [b, a] };
        return error(format!(
            "with this damage, bonds break by their work in `{work}`, but by their stretch in `{stretch}`, whose law is \
             bond-based; use `critical_stretch` damage, two bond-based laws, or two laws that are not bond-based"
        ));
    }
    Ok(())
}

/// Return an error if the law of a body does not support the horizon of some bonds of this body.
fn horizons_are_possible(problem: &Problem) -> Result<()> {
    for here in problem.blocks() {
        let law = &here.body.material.law;
        let Some(fault) = law.declaration.horizon_fault else {
            continue;
        };
        let mut all = Vec::new();
        for there in problem.blocks() {
            let constants = constants(problem, &here, &there);
            if !all.contains(&constants) {
                all.push(constants);
            }
        }
        let of_bonds = |constants| fault(&given(problem, here.body, None, constants));
        if let Some(fault) = all.into_iter().find_map(of_bonds) {
            let name = law.declaration.name;
            let message = format!("[body.{}] law `{name}`: {fault}", here.body.name);
            return Err(Error::input(message).at(&here.body.horizon_span));
        }
    }
    Ok(())
}

/// Return an error if three conditions are met:
///
/// - the material has thermal expansion;
/// - the law of the material has no potential (as with plasticity or softening);
/// - the strain perpendicular to the plane or bar is 0.
///
/// The inelastic strain then depends on the stress perpendicular to the plane or bar. The law does not
/// compute this stress.
fn expansion_is_possible(problem: &Problem, body: &Body) -> Result<()> {
    let (material, dimension) = (&body.material, problem.dimension);
    let law = &material.law;
    let is_conservative = (law.declaration.invariants)(&law.values).conservative;
    if is_conservative || !dimension.is_confined() || material.expansion.coefficient == 0.0 {
        return Ok(());
    }
    let message = format!(
        "[body.{}] material: `{}` with these keys cannot have `thermal_expansion` in {}, because the law does \
         not compute the thermal stress perpendicular to the {}; use plane stress, uniaxial stress or 3-D, or \
         an elastic law (not `stress = \"willberg2022\"`)",
        body.name,
        law.declaration.name,
        dimension.name(),
        if dimension.count() == 1 {
            "bar"
        } else {
            "plane"
        },
    );
    Err(Error::input(message).at(&body.span))
}

/// Return an error if the damage of a body is incompatible with another setting of the problem. Also return
/// an error if bonds may join this body to another body whose bonds break by a different quantity (stretch,
/// work or stress).
fn damage_is_possible(problem: &Problem, body: &Body) -> Result<()> {
    let Some(damage) = &body.damage else {
        return Ok(());
    };
    let own = breaks(body, damage);
    let error = |message: String| {
        let message = format!("[body.{}] damage: {message}", body.name);
        Err(Error::input(message).at(&body.span))
    };
    let meets = |other: &Body| {
        let interface = &problem.interface;
        interface.between(body, other) != InterfaceRule::None
            && *interface.damage_between(body, other) == InterfaceDamage::OfBodies
    };
    let of_other = |other: &Body| match &other.damage {
        Some(damage) => Some(breaks(other, damage)),
        None if other.material.law.declaration.breaks_by_itself() => Some(Breaks::Stretch),
        None => None,
    };
    let mut others = problem.bodies.iter();
    let of_other_kind = others.find_map(|other| {
        let quantity = of_other(other).filter(|quantity| *quantity != own && meets(other))?;
        Some((other, quantity))
    });
    if let Some((other, quantity)) = of_other_kind {
        return error(format!(
            "the bonds of this body break by their {own}, the bonds of body `{}` by their {quantity}, and bonds may join the two \
             bodies; give both bodies damage by the same quantity, or set `[interface] rule = \"none\"`",
            other.name
        ));
    }
    damage_fault(problem, body, damage).map_or(Ok(()), error)
}

/// Return the reason why `damage` cannot break the bonds of a body in this problem; `None` if it can break
/// the bonds.
fn damage_fault(problem: &Problem, body: &Body, damage: &problem::Damage) -> Option<String> {
    if let DamageRule::Energy { calibration, .. } = damage.rule
        && !calibration.is_for(problem.dimension.count())
    {
        return Some(format!(
            "the calibration {calibration:?} has no formula in this dimension"
        ));
    }
    if damage.rule.is_unmeasured() {
        let message = "the energy of opening a crack is not known: use the problem that \
                       `solver::calibration::calibrated` returns";
        return Some(message.to_owned());
    }
    let by_stress = matches!(damage.rule, DamageRule::Stress(_));
    if by_stress != matches!(damage.toughness, Toughness::Strength(_)) {
        return Some("a strength is for damage by stress, and for this only".to_owned());
    }
    let by_energy = matches!(damage.rule, DamageRule::Energy { .. });
    if by_energy && matches!(damage.toughness, Toughness::CriticalStretch(_)) {
        return Some("a critical stretch is no measure of energy".to_owned());
    }
    if breaks(body, damage) != Breaks::Work || problem.volume_correction == VolumeCorrection::None {
        return None;
    }
    let block = Block::unrefined(body);
    let constants = constants(problem, &block, &block);
    let influence = build(problem, body, Some(damage), constants).influence;
    influence.is_some().then(|| {
        "energy damage needs a constant influence, or `[grid] volume_correction = \"none\"`"
            .to_owned()
    })
}
