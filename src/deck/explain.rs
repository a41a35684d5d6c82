//! A deck with every default filled in.

use super::grammar::{
    ConstraintName, Count, DAMPING, Deck, ELASTIC_CONSTANTS, Material, Output, Relaxation, Rule,
    Static, THERMAL_EXPANSION, Table, VolumeCorrection, common_keys,
};
use super::number::{Number, Written, default_number};
use super::resolve::Scope;
use crate::deck::spanned::Spanned;
use crate::dimension::{Constraint, Dimension};
use crate::error::{Error, Result};
use crate::material::{Kind, declarations};
use crate::problem::{self, Body, CheckpointRule, Condition, HorizonRule, Interval, Problem};

/// Return the deck as TOML with every default written out.
///
/// # Errors
/// If the deck cannot be serialized.
pub fn explain(scope: &Scope, deck: &Deck, problem: &Problem) -> Result<String> {
    let mut deck = deck.clone();
    fill(&mut deck, problem);
    // Write out the rows of tables, because the file of a table may change before a restart.
    for (name, table) in &mut deck.table {
        let [times, values] = scope.tables[name].rows();
        *table.get_mut() = Table::of_rows(times, values);
    }
    // Serialize to a `toml::Value` first. The writer of text is then compiled for this one type only, which
    // shortens the compilation.
    toml::Value::try_from(&deck)
        .and_then(|deck| toml::to_string(&deck))
        .map_err(|error| Error::run(format!("cannot write the deck: {error}")))
}

/// Fill in the defaults that depend on other values of the deck.
fn fill(deck: &mut Deck, problem: &Problem) {
    let number = |value| Some(default_number(value));
    match problem.dimension {
        Dimension::Line {
            cross_section,
            constraint,
        } => {
            let name = match constraint {
                Constraint::UniaxialStress => ConstraintName::UniaxialStress,
                Constraint::UniaxialStrain => ConstraintName::UniaxialStrain,
            };
            (deck.constraint).get_or_insert(Spanned::new(0..0, name));
            deck.cross_section = deck.cross_section.take().or(number(cross_section));
        }
        Dimension::PlaneStress { thickness } | Dimension::PlaneStrain { thickness } => {
            deck.thickness = deck.thickness.take().or(number(thickness));
        }
        Dimension::Space => {}
    }
    let grid = deck.grid.get_mut();
    let correction = match problem.volume_correction {
        problem::VolumeCorrection::None => VolumeCorrection::None,
        problem::VolumeCorrection::Linear => VolumeCorrection::Linear,
        problem::VolumeCorrection::LinearInside => VolumeCorrection::LinearInside,
        problem::VolumeCorrection::Exact => VolumeCorrection::Exact,
    };
    grid.volume_correction
        .get_or_insert(Spanned::new(0..0, correction));
    grid.origin = grid.origin.take().or_else(|| {
        let origin = common_origin(problem)?;
        let origin = &origin[..problem.dimension.count()];
        Some(Spanned::new(
            0..0,
            origin.iter().copied().map(default_number).collect(),
        ))
    });
    for body in deck.body.values_mut().map(|body| body.get_mut()) {
        if body.shape.is_some() {
            body.spacing = body.spacing.take().or(grid.spacing.clone());
        }
        body.horizon = body.horizon.take().or(Some(grid.horizon.clone()));
    }
    let pairs = deck
        .interface
        .pair
        .values_mut()
        .zip(&problem.interface.pairs);
    for (pair, resolved) in pairs {
        let rule = match resolved.rule {
            problem::InterfaceRule::None => Rule::None,
            problem::InterfaceRule::Own => Rule::Own,
            problem::InterfaceRule::Average => Rule::Average,
            problem::InterfaceRule::Minimum => Rule::Minimum,
        };
        pair.get_mut().rule.get_or_insert(Spanned::new(0..0, rule));
    }
    if let (Some(table), Some(refinement)) = (&mut deck.refinement, &problem.refinement) {
        let table = table.get_mut();
        let factor = number(refinement.interface_factor);
        table.interface_factor = table.interface_factor.take().or(factor);
        if let HorizonRule::DeltaM(ratios) = &refinement.rule {
            let ratios = ratios.iter().copied().map(default_number).collect();
            table.m.get_or_insert_with(|| Spanned::new(0..0, ratios));
        }
        for region in table.region.values_mut().map(|region| region.get_mut()) {
            let finest = || Spanned::new(0..0, u64::from(refinement.levels));
            region.level.get_or_insert_with(finest);
        }
    }
    for material in deck.material.values_mut() {
        fill_material(material.get_mut(), problem.dimension);
    }
    let conditions = deck.condition.values_mut().zip(&problem.conditions);
    for (table, condition) in conditions {
        table.get_mut().depth = table
            .get_mut()
            .depth
            .take()
            .or_else(|| depth(problem, condition));
    }
    let time = deck.time.get_mut();
    // Newton's method uses the load steps and the tolerance of the relaxation if `[time.static]` lacks these
    // keys, so the table of the relaxation is written too.
    if problem.is_quasi_static() {
        let default = || Spanned::new(0..0, Relaxation::default());
        time.relaxation.get_or_insert_with(default);
    }
    if problem.has_newton() {
        let default = || Spanned::new(0..0, Static::default());
        time.newton.get_or_insert_with(default);
    }
    let outputs = deck.output.get_mut();
    fill_output(&mut outputs.main, &problem.output);
    let further = outputs.further.values_mut().zip(&problem.further_outputs);
    further.for_each(|(table, output)| fill_output(table.get_mut(), output));
    let checkpoint = deck.checkpoint.get_mut();
    if let CheckpointRule::WallClock(seconds) = problem.checkpoint {
        let text = || Spanned::new(0..0, format!("{seconds} s"));
        checkpoint.every.get_or_insert_with(text);
    }
    let history = deck.history.get_mut();
    let rows = problem.row_interval();
    fill_interval(&mut history.every, history.every_steps.is_some(), rows);
    if let Interval::SecondsAtSteps { seconds, steps } = rows {
        history.every.get_or_insert_with(|| default_number(seconds));
        let steps = || Spanned::new(0..0, Count::new(steps));
        history.every_steps.get_or_insert_with(steps);
    }
    history.damage_threshold = history
        .damage_threshold
        .take()
        .or(number(problem.history.damage_threshold));
    for front in history.front.values_mut().map(|table| table.get_mut()) {
        front.radius = front.radius.take().or(Some(grid.horizon.clone()));
    }
    for crack in history.crack.values_mut().map(|table| table.get_mut()) {
        let threshold = history.damage_threshold.clone();
        crack.threshold = crack.threshold.take().or(threshold);
    }
    for tip in history.tip.values_mut().map(|table| table.get_mut()) {
        let threshold = history.damage_threshold.clone();
        tip.threshold = tip.threshold.take().or(threshold);
    }
    for rule in history.j_integral.values_mut().map(|table| table.get_mut()) {
        let along_x = [1.0, 0.0, 0.0].map(default_number);
        let along_x = along_x[..problem.dimension.count()].to_vec();
        (rule.direction).get_or_insert_with(|| Spanned::new(0..0, along_x));
    }
}

/// Return the common grid origin of all lattice bodies, m. Return `None` if their origins differ. Return the
/// zero vector if there are no lattice bodies.
///
/// Without `origin`, the origin is chosen for each spacing, so bodies of different spacings may have
/// different origins. The single key `origin` cannot express different origins.
fn common_origin(problem: &Problem) -> Option<[f64; 3]> {
    let mut origins = problem.bodies.iter().filter_map(|body| match &body.points {
        problem::PointSource::Lattice { origin, .. } => Some(*origin),
        problem::PointSource::File { .. } | problem::PointSource::Mesh { .. } => None,
    });
    let first = origins.next().unwrap_or_default();
    origins.all(|origin| origin == first).then_some(first)
}

/// Put the keys of a law in the order of the grammar, and add missing keys with their defaults.
fn fill_material(material: &mut Material, dimension: Dimension) {
    let Some(law) = declarations().find(|law| law.name == material.law.get_ref()) else {
        return;
    };
    let table = material.table.get_mut();
    let has_ratio = law.any_poisson_ratio || {
        let constants = ELASTIC_CONSTANTS.iter();
        constants
            .filter(|(name, _)| table.contains_key(*name))
            .count()
            > 1
    };
    let default = |name: &str| match name {
        "poisson_ratio" if !has_ratio => Some(default_number(dimension.bond_based_poisson_ratio())),
        DAMPING | THERMAL_EXPANSION => Some(default_number(0.0)),
        _ => match &law.key(name)?.kind {
            Kind::Number { default, .. } => default.map(default_number),
            Kind::Word(words) => {
                let word = Written::Text(words.first()?.word.to_owned());
                Some(Spanned::new(0..0, word))
            }
            Kind::Optional { .. } | Kind::OfLength => None,
        },
    };
    let names = common_keys().chain(law.keys.iter().map(|key| key.name));
    let filled = names.filter_map(|name| {
        let value = table.get(name).cloned().or_else(|| default(name))?;
        Some((Spanned::new(0..0, name.to_owned()), value))
    });
    *table = filled.collect();
}

/// Return the depth of a traction or pressure, m; `None` for a condition without a depth. If the deck gives
/// no depth, the depth at a point is the spacing of the point's body. In this case, return the common
/// [single spacing](Body::single_spacing) of all bodies that may have points in the set of the condition.
/// Return `None` if one of these bodies has no single spacing, or if their spacings differ.
fn depth(problem: &Problem, condition: &Condition) -> Option<Number> {
    condition.depth?;
    let bodies = problem.sets[condition.set].possible_bodies(&problem.bodies);
    let dimension = problem.dimension.count();
    let is_known = |body: &Body| condition.divisor(body, dimension).is_some();
    match condition.divisors(bodies, dimension)[..] {
        [depth] if bodies.iter().all(is_known) => Some(default_number(depth)),
        _ => None,
    }
}

fn fill_output(table: &mut Output, output: &problem::Output) {
    if let Some(interval) = output.every {
        fill_interval(&mut table.every, table.every_steps.is_some(), interval);
    }
    table.fields.get_or_insert_with(|| {
        let names = output.fields.iter().map(|field| field.name());
        names
            .map(|name| Spanned::new(0..0, name.to_owned()))
            .collect()
    });
}

fn fill_interval(every: &mut Option<Number>, in_steps: bool, interval: Interval) {
    if let (Interval::Seconds(seconds), false) = (interval, in_steps) {
        every.get_or_insert_with(|| default_number(seconds));
    }
}
