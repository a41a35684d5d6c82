//! Content and interval of the history.

use super::allowed::{FRACTION, NOT_NEGATIVE, POSITIVE};
use super::outputs::{fields_are_different, interval};
use super::{column_fault, finite, shapes, unit_vector, wrong};
use crate::component::{AXES, Component, entries, invariants};
use crate::error::Result;
use crate::problem::{Field, JIntegral, Line, Problem, Reaction};

/// Largest |cos φ| that counts as perpendicular; φ is the angle between the crack front and the direction
/// of growth.
pub(crate) const LARGEST_COSINE: f64 = 1e-6;

/// Check the content and the interval of the history.
///
/// # Errors
/// On an interval, set, field, component, position, direction or threshold that is not allowed.
pub fn history(problem: &Problem) -> Result<()> {
    let history = &problem.history;
    let dimension = problem.dimension.count();
    if let Some(every) = history.every {
        interval("[history]", every)?;
    }
    FRACTION.check("[history] damage_threshold", history.damage_threshold)?;
    if history.angular_momentum && dimension == 1 {
        let fault = "is not available in 1-D, because a bar has no angular momentum";
        return Err(wrong("[history] angular_momentum", fault));
    }
    reactions(problem, &history.reactions)?;
    for force in &history.support_forces {
        let section = format!("[history.force.{}]", force.name);
        problem.check_set(&format!("{section} set"), force.set)?;
        unit_vector(&format!("{section} direction"), force.direction)?;
    }
    for statistics in &history.statistics {
        let section = format!("[history.field.{}]", statistics.name);
        problem.check_set(&format!("{section} set"), statistics.set)?;
        component(problem, &section, (statistics.field, statistics.component))?;
        let of = &statistics.of;
        if of.is_empty() || (1..of.len()).any(|k| of[..k].contains(&of[k])) {
            let fault = "must name at least one statistic, each once";
            return Err(wrong(&format!("{section} of"), fault));
        }
    }
    for probe in &history.probes {
        let section = format!("[history.probe.{}]", probe.name);
        finite(&format!("{section} at"), &probe.at)?;
        fields_are_different(&section, &probe.fields)?;
        for field in &probe.fields {
            is_measurable(&format!("{section} fields"), *field)?;
            if matches!(field, Field::Displacement | Field::Velocity) {
                let fault = format!("`{}` is always recorded", field.name());
                return Err(wrong(&format!("{section} fields"), fault));
            }
        }
    }
    for front in &history.fronts {
        let section = format!("[history.front.{}]", front.name);
        line(&section, &front.line)?;
        if front.length != f64::INFINITY {
            POSITIVE.check(&format!("{section} length"), front.length)?;
        }
        POSITIVE.check(&format!("{section} radius"), front.radius)?;
        component(problem, &section, (front.field, front.component))?;
        NOT_NEGATIVE.check(&format!("{section} threshold"), front.threshold)?;
    }
    for crack in &history.cracks {
        let section = format!("[history.crack.{}]", crack.name);
        if dimension == 1 {
            return Err(wrong(&section, "a bar has no crack path; use a tip"));
        }
        problem.check_set(&format!("{section} set"), crack.set)?;
        finite(&format!("{section} from"), &crack.from)?;
        FRACTION.check(&format!("{section} threshold"), crack.threshold)?;
    }
    for tip in &history.tips {
        let section = format!("[history.tip.{}]", tip.name);
        problem.check_set(&format!("{section} set"), tip.set)?;
        line(&section, &tip.line)?;
        FRACTION.check(&format!("{section} threshold"), tip.threshold)?;
    }
    let mut integrals = history.j_integrals.iter();
    integrals.try_for_each(|integral| j_integral(dimension, integral))
}

fn reactions(problem: &Problem, reactions: &[Reaction]) -> Result<()> {
    let key = "[history] reactions";
    for (k, reaction) in reactions.iter().enumerate() {
        problem.check_set(key, reaction.set)?;
        let name = &problem.sets[reaction.set].name;
        if reactions[..k]
            .iter()
            .any(|earlier| earlier.set == reaction.set)
        {
            return Err(wrong(key, format!("`{name}` is named twice")));
        }
        if let Some(fault) = column_fault(name) {
            return Err(wrong(key, format!("`{name}`: {fault}")));
        }
    }
    Ok(())
}

fn line(section: &str, line: &Line) -> Result<()> {
    finite(&format!("{section} from"), &line.from)?;
    unit_vector(&format!("{section} direction"), line.direction)
}

/// Check that a field is a physical quantity. Ranks and fragments are labels.
fn is_measurable(key: &str, field: Field) -> Result<()> {
    match field {
        Field::Rank | Field::Fragment => {
            let fault = format!("`{}` is a label and not a physical quantity", field.name());
            Err(wrong(key, fault))
        }
        _ => Ok(()),
    }
}

/// Check that a field has a component or invariant in this problem.
fn component(
    problem: &Problem,
    section: &str,
    (field, component): (Field, Component),
) -> Result<()> {
    is_measurable(&format!("{section} field"), field)?;
    let components = field.components();
    let known = entries(components, problem.dimension.count());
    let mut known = known.map(|(entry, _)| Component::Entry(entry));
    let mut invariants = invariants(components).iter();
    if known.any(|known| known == component) || invariants.any(|(_, known)| *known == component) {
        return Ok(());
    }
    let fault = format!(
        "`{}` has no component `{component:?}` in {}",
        field.name(),
        problem.dimension.name()
    );
    Err(wrong(&format!("{section} component"), fault))
}

fn j_integral(dimension: usize, integral: &JIntegral) -> Result<()> {
    let section = format!("[history.j_integral.{}]", integral.name);
    if dimension == 1 {
        let fault = "is for plane and 3-D problems, this one is 1-D";
        return Err(wrong(&section, fault));
    }
    let (lower, upper) = (&integral.lower, &integral.upper);
    shapes::corners(dimension, &section, (lower, upper))?;
    POSITIVE.check(&format!("{section} layer"), integral.layer)?;
    if let Some(k) = (0..dimension).find(|k| upper[*k] - lower[*k] <= 2.0 * integral.layer) {
        let fault = format!(
            "each edge of the box must be longer than two layers, {} m, but the edge along {} is {} m long",
            2.0 * integral.layer,
            AXES[k],
            upper[k] - lower[k]
        );
        return Err(wrong(&section, fault));
    }
    unit_vector(&format!("{section} direction"), integral.direction)?;
    let key = format!("{section} front");
    match integral.front {
        None if dimension == 3 => Err(wrong(&key, "is required in 3-D")),
        Some(_) if dimension == 2 => Err(wrong(&key, "is for 3-D problems")),
        None => Ok(()),
        Some(front) => {
            unit_vector(&key, front)?;
            let products = front.iter().zip(integral.direction).map(|(a, b)| a * b);
            if products.sum::<f64>().abs() > LARGEST_COSINE {
                return Err(wrong(&key, "must be perpendicular to `direction`"));
            }
            Ok(())
        }
    }
}
