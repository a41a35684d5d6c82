//! Validation of the history's content and interval.

use super::fields::history_field;
use super::grammar::{self, Deck, Text};
use super::names::suits_a_column;
use super::number::{Number, Vector};
use super::resolve::{Scope, find, resolve_each};
use super::sets::find_set;
use super::shapes::corners_of_box;
use crate::component::{AXES, Component, entries, invariants};
use crate::deck::spanned::Spanned;
use crate::error::Result;
use crate::message::format_number;
use crate::problem::check::LARGEST_COSINE;
use crate::problem::{self, Field, Interval};

/// Validate the content and interval of the history; `horizon` is the horizon of the grid, m.
///
/// # Errors
/// On an unknown set, field or component, or an invalid position, number or name. If the list `of` is empty,
/// or a list names an entry twice. On a missing or surplus `component` or `front`, and on a quantity that
/// does not exist in this dimension.
pub fn history(
    scope: &Scope,
    deck: &Deck,
    sets: &[problem::Set],
    horizon: f64,
) -> Result<problem::History> {
    let history = deck.history.get_ref();
    let damage_threshold = match &history.damage_threshold {
        None => problem::DEFAULT_DAMAGE_THRESHOLD,
        Some(number) => damage(scope, number, "[history] damage_threshold")?,
    };
    for (k, set) in history.reactions.iter().enumerate() {
        if history.reactions[..k]
            .iter()
            .any(|earlier| earlier.get_ref() == set.get_ref())
        {
            let message = format!("[history] reactions: `{}` is named twice", set.get_ref());
            return Err(scope.error(set.span(), message));
        }
        suits_a_column(scope, "[history] reactions", set.get_ref(), set)?;
    }
    let forces = resolve_each(&history.force, |name, table| {
        support_force(scope, name, table, sets)
    })?;
    if *history.angular_momentum.get_ref() && scope.dimension == 1 {
        let message = "[history] angular_momentum: is not available in 1-D, because a bar has no angular momentum";
        return Err(scope.error(history.angular_momentum.span(), message));
    }
    let statistics = resolve_each(&history.field, |name, table| {
        statistics(scope, name, table, sets)
    })?;
    let probes = resolve_each(&history.probe, |name, table| probe(scope, name, table))?;
    let reaction = |name: &Text| {
        Ok(problem::Reaction {
            set: find_set(scope, name, sets, "[history] reactions")?,
            span: name.span(),
        })
    };
    let fronts = resolve_each(&history.front, |name, table| {
        front(scope, name, table, horizon)
    })?;
    let cracks = resolve_each(&history.crack, |name, table| {
        crack(scope, name, table, sets, damage_threshold)
    })?;
    let tips = resolve_each(&history.tip, |name, table| {
        tip(scope, name, table, sets, damage_threshold)
    })?;
    let j_integrals = resolve_each(&history.j_integral, |name, table| {
        j_integral(scope, name, table, horizon)
    })?;
    Ok(problem::History {
        every: rows(scope, history)?,
        reactions: history
            .reactions
            .iter()
            .map(reaction)
            .collect::<Result<_>>()?,
        support_forces: forces.into_values().collect(),
        fragments: history.fragments,
        angular_momentum: *history.angular_momentum.get_ref(),
        damage_threshold,
        statistics: statistics.into_values().collect(),
        probes: probes.into_values().collect(),
        fronts: fronts.into_values().collect(),
        cracks: cracks.into_values().collect(),
        tips: tips.into_values().collect(),
        j_integrals: j_integrals.into_values().collect(),
    })
}

/// Return the interval between rows of the history; `None` if the deck gives no interval.
fn rows(scope: &Scope, history: &grammar::History) -> Result<Option<Interval>> {
    let seconds = |every: &Number| scope.positive(every, "[history] every");
    let steps = history
        .every_steps
        .as_ref()
        .map(|steps| steps.get_ref().get());
    Ok(match (&history.every, steps) {
        (None, None) => None,
        (None, Some(steps)) => Some(Interval::Steps(steps)),
        (Some(every), None) => Some(Interval::Seconds(seconds(every)?)),
        (Some(every), Some(steps)) => Some(Interval::SecondsAtSteps {
            seconds: seconds(every)?,
            steps,
        }),
    })
}

/// Return the header of a table of the history. A name that cannot be part of a column name is an error.
fn table_header<T>(scope: &Scope, kind: &str, name: &str, table: &Spanned<T>) -> Result<String> {
    let key = format!("[history.{kind}.{name}]");
    suits_a_column(scope, &key, name, table)?;
    Ok(key)
}

fn damage(scope: &Scope, number: &Number, key: &str) -> Result<f64> {
    scope.within(number, key, 0.0..1.0, "at least 0 and below 1")
}

fn line(scope: &Scope, key: &str, from: &Vector, direction: &Vector) -> Result<problem::Line> {
    Ok(problem::Line {
        from: scope.vector(from, &format!("{key} from"))?,
        direction: scope.direction(direction, &format!("{key} direction"))?,
    })
}

fn front(
    scope: &Scope,
    name: &str,
    table: &Spanned<grammar::Front>,
    horizon: f64,
) -> Result<problem::Front> {
    let key = table_header(scope, "front", name, table)?;
    let front = table.get_ref();
    let length_or = |number: &Option<Number>, name, default| match number {
        None => Ok(default),
        Some(number) => scope.positive(number, &format!("{key} {name}")),
    };
    let field = history_field(scope, &front.field, &format!("{key} field"))?;
    Ok(problem::Front {
        name: name.to_owned(),
        span: table.span(),
        line: line(scope, &key, &front.from, &front.direction)?,
        length: length_or(&front.length, "length", f64::INFINITY)?,
        radius: length_or(&front.radius, "radius", horizon)?,
        field,
        component: component(scope, &key, field, &front.field, &front.component)?,
        threshold: scope.within(
            &front.threshold,
            &format!("{key} threshold"),
            0.0..f64::INFINITY,
            "at least 0",
        )?,
    })
}

/// Return the component or invariant that a table requests. For a scalar field, the default is its only
/// component. For a vector field, the default is the magnitude. For a tensor field, a table without
/// `component` is an error.
fn component(
    scope: &Scope,
    key: &str,
    field: Field,
    place: &Text,
    component: &Option<Text>,
) -> Result<Component> {
    let components = field.components();
    let entries = entries(components, scope.dimension);
    let entries = entries.map(|(entry, name)| (name, Component::Entry(entry)));
    let known: Vec<_> = entries
        .chain(invariants(components).iter().copied())
        .collect();
    let names = known.iter().map(|(name, _)| *name);
    match component {
        None if components == 1 => Ok(Component::Entry(0)),
        None if components == 3 => Ok(Component::Magnitude),
        None => {
            let message = format!(
                "{key} field: `{}` needs a `component`, one of {}",
                field.name(),
                names.collect::<Vec<_>>().join(", ")
            );
            Err(scope.error(place.span(), message))
        }
        Some(component) if components == 1 => {
            let message = format!(
                "{key} component: `{}` is a single number and has no components",
                field.name()
            );
            Err(scope.error(component.span(), message))
        }
        Some(component) => {
            let key = format!("{key} component");
            Ok(known[find(scope.source, component, names, &key)?].1)
        }
    }
}

fn probe(scope: &Scope, name: &str, table: &Spanned<grammar::Probe>) -> Result<problem::Probe> {
    let key = table_header(scope, "probe", name, table)?;
    let probe = table.get_ref();
    let at = scope.vector(&probe.at, &format!("{key} at"))?;
    let key = format!("{key} fields");
    let mut fields = Vec::new();
    for name in &probe.fields {
        let field = history_field(scope, name, &key)?;
        let wrong = if matches!(field, Field::Displacement | Field::Velocity) {
            "is always recorded"
        } else if fields.contains(&field) {
            "is named twice"
        } else {
            fields.push(field);
            continue;
        };
        let message = format!("{key}: `{}` {wrong}", field.name());
        return Err(scope.error(name.span(), message));
    }
    Ok(problem::Probe {
        name: name.to_owned(),
        span: table.span(),
        at,
        fields,
    })
}

fn statistics(
    scope: &Scope,
    name: &str,
    table: &Spanned<grammar::FieldStatistics>,
    sets: &[problem::Set],
) -> Result<problem::FieldStatistics> {
    let key = table_header(scope, "field", name, table)?;
    let rule = table.get_ref();
    let field = history_field(scope, &rule.field, &format!("{key} field"))?;
    let given = rule.of.get_ref();
    if given.is_empty() {
        let message = format!("{key} of: must name at least one of {STATISTICS}");
        return Err(scope.error(rule.of.span(), message));
    }
    for (k, statistic) in given.iter().enumerate() {
        let value = statistic.get_ref();
        if given[..k].iter().any(|earlier| earlier.get_ref() == value) {
            let message = format!("{key} of: `{}` is named twice", of(*value).name());
            return Err(scope.error(statistic.span(), message));
        }
    }
    Ok(problem::FieldStatistics {
        name: name.to_owned(),
        span: table.span(),
        set: find_set(scope, &rule.set, sets, &format!("{key} set"))?,
        field,
        component: component(scope, &key, field, &rule.field, &rule.component)?,
        of: given
            .iter()
            .map(|statistic| of(*statistic.get_ref()))
            .collect(),
    })
}

/// Names of the statistics, for messages.
const STATISTICS: &str = "sum, integral, mean, minimum, maximum";

fn of(statistic: grammar::Statistic) -> problem::Statistic {
    use problem::Statistic;
    match statistic {
        grammar::Statistic::Sum => Statistic::Sum,
        grammar::Statistic::Integral => Statistic::Integral,
        grammar::Statistic::Mean => Statistic::Mean,
        grammar::Statistic::Minimum => Statistic::Minimum,
        grammar::Statistic::Maximum => Statistic::Maximum,
    }
}

fn support_force(
    scope: &Scope,
    name: &str,
    table: &Spanned<grammar::SupportForce>,
    sets: &[problem::Set],
) -> Result<problem::SupportForce> {
    let key = table_header(scope, "force", name, table)?;
    let force = table.get_ref();
    Ok(problem::SupportForce {
        name: name.to_owned(),
        span: table.span(),
        set: find_set(scope, &force.set, sets, &format!("{key} set"))?,
        direction: scope.direction(&force.direction, &format!("{key} direction"))?,
    })
}

fn crack(
    scope: &Scope,
    name: &str,
    table: &Spanned<grammar::CrackPath>,
    sets: &[problem::Set],
    damage_threshold: f64,
) -> Result<problem::CrackPath> {
    let key = table_header(scope, "crack", name, table)?;
    if scope.dimension == 1 {
        let message = format!(
            "{key}: a bar has no crack path; use `[history.tip.{name}]` with `from` and `direction`"
        );
        return Err(scope.error(table.span(), message));
    }
    let crack = table.get_ref();
    Ok(problem::CrackPath {
        name: name.to_owned(),
        span: table.span(),
        from: scope.vector(&crack.from, &format!("{key} from"))?,
        set: find_set(scope, &crack.set, sets, &format!("{key} set"))?,
        threshold: match &crack.threshold {
            None => damage_threshold,
            Some(number) => damage(scope, number, &format!("{key} threshold"))?,
        },
    })
}

fn tip(
    scope: &Scope,
    name: &str,
    table: &Spanned<grammar::Tip>,
    sets: &[problem::Set],
    damage_threshold: f64,
) -> Result<problem::Tip> {
    let key = table_header(scope, "tip", name, table)?;
    let tip = table.get_ref();
    Ok(problem::Tip {
        name: name.to_owned(),
        span: table.span(),
        line: line(scope, &key, &tip.from, &tip.direction)?,
        set: find_set(scope, &tip.set, sets, &format!("{key} set"))?,
        threshold: match &tip.threshold {
            None => damage_threshold,
            Some(number) => damage(scope, number, &format!("{key} threshold"))?,
        },
    })
}

/// Width of the layers of a J integral, in horizons. A layer lies along the inner side of each face of the
/// box.
const LAYER: f64 = 1.0;

fn j_integral(
    scope: &Scope,
    name: &str,
    table: &Spanned<grammar::JIntegral>,
    horizon: f64,
) -> Result<problem::JIntegral> {
    let key = table_header(scope, "j_integral", name, table)?;
    if scope.dimension == 1 {
        let message = format!("{key}: is for plane and 3-D problems, this one is 1-D");
        return Err(scope.error(table.span(), message));
    }
    let rule = table.get_ref();
    let [lower, upper] = corners_of_box(scope, &key, &rule.lower, &rule.upper)?;
    let layer = LAYER * horizon;
    if let Some(k) = (0..scope.dimension).find(|k| upper[*k] - lower[*k] <= 2.0 * layer) {
        let message = format!(
            "{key}: each edge of the box must be longer than {} m, which is {} horizons, but the edge along {} is {} m \
             long",
            format_number(2.0 * layer),
            2.0 * LAYER,
            AXES[k],
            format_number(upper[k] - lower[k])
        );
        return Err(scope.error(rule.upper.get_ref()[k].span(), message));
    }
    let direction = match &rule.direction {
        None => [1.0, 0.0, 0.0],
        Some(direction) => scope.direction(direction, &format!("{key} direction"))?,
    };
    Ok(problem::JIntegral {
        name: name.to_owned(),
        span: table.span(),
        lower,
        upper,
        direction,
        front: crack_front(scope, &key, table, direction)?,
        layer,
    })
}

/// Return the direction of the crack front for a J integral in 3-D, `None` in plane problems.
fn crack_front(
    scope: &Scope,
    key: &str,
    table: &Spanned<grammar::JIntegral>,
    direction: [f64; 3],
) -> Result<Option<[f64; 3]>> {
    let Some(front) = &table.get_ref().front else {
        if scope.dimension == 2 {
            return Ok(None);
        }
        let message =
            format!("{key}: `front`, the direction of the crack front, is required in 3-D");
        return Err(scope.error(table.span(), message));
    };
    let key = format!("{key} front");
    if scope.dimension == 2 {
        let message =
            format!("{key}: is for 3-D problems; a plane problem has a crack tip and no front");
        return Err(scope.error(front.span(), message));
    }
    let unit = scope.direction(front, &key)?;
    let cosine: f64 = unit.iter().zip(direction).map(|(a, b)| a * b).sum();
    if cosine.abs() > LARGEST_COSINE {
        let message =
            format!("{key}: must be perpendicular to `direction`, which is along x by default");
        return Err(scope.error(front.span(), message));
    }
    Ok(Some(unit))
}
