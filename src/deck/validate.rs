//! From the grammar to the plan: every value checked, every name resolved.

use std::ops::Range;

use indexmap::IndexMap;
use serde_spanned::Spanned;

use super::grammar::{self, Deck, DimensionName, Tables, Text};
use super::number::Number;
use super::plan::{self, Plan};
use super::resolve::{POSITION, Scope, find};
use super::source::Source;
use super::{conditions, shapes};
use crate::dimension::Dimension;
use crate::elastic::{Constant, Isotropic};
use crate::error::Result;

/// Validates a parsed deck.
///
/// # Errors
/// The first mistake, with its place in the deck, the key and what would be right.
pub fn validate(source: &Source, deck: &Deck) -> Result<Plan> {
    let count = match deck.dimension.get_ref() {
        DimensionName::Line => 1,
        DimensionName::PlaneStress | DimensionName::PlaneStrain => 2,
        DimensionName::Space => 3,
    };
    let scope = Scope::new(source, count, &deck.parameters)?;
    let dimension = dimension(&scope, deck)?;
    let horizon = scope.positive(&deck.grid.get_ref().horizon, "[grid] horizon")?;
    let spacing = spacing(&scope, deck, horizon)?;
    let sets = sets(&scope, deck)?;
    let materials = resolve_each(&deck.material, |name, table| {
        material(&scope, dimension, name, table)
    })?;
    let damages = resolve_each(&deck.damage, |name, table| {
        damage(&scope, &sets, name, table)
    })?;
    let bodies = bodies(&scope, deck, spacing, &materials, &damages)?;
    let cracks = resolve_each(&deck.crack, |name, table| {
        shapes::crack(&scope, name, table)
    })?;
    let time = time(&scope, deck)?;
    Ok(Plan {
        source: source.clone(),
        title: deck.title.clone(),
        dimension,
        horizon,
        bodies,
        cracks: cracks.into_values().collect(),
        initials: conditions::initials(&scope, deck, &sets)?,
        conditions: conditions::conditions(&scope, deck, &sets, spacing)?,
        output: output(&scope, deck, time.end)?,
        history: history(&scope, deck, &sets, time.end)?,
        sets,
        time,
    })
}

fn resolve_each<T, U>(
    tables: &Tables<T>,
    resolve: impl Fn(&str, &Spanned<T>) -> Result<U>,
) -> Result<IndexMap<String, U>> {
    tables
        .iter()
        .map(|(name, table)| Ok((name.clone(), resolve(name, table)?)))
        .collect()
}

fn dimension(scope: &Scope, deck: &Deck) -> Result<Dimension> {
    let name = *deck.dimension.get_ref();
    let plane = matches!(
        name,
        DimensionName::PlaneStress | DimensionName::PlaneStrain
    );
    if let (Some(thickness), false) = (&deck.thickness, plane) {
        let message = "thickness: only plane-stress and plane-strain have a thickness";
        return Err(scope.error(thickness.span(), message));
    }
    if let (Some(section), false) = (&deck.cross_section, name == DimensionName::Line) {
        let message = "cross_section: only 1d has a cross-section";
        return Err(scope.error(section.span(), message));
    }
    let positive_or_one = |number: &Option<Number>, key| match number {
        Some(number) => scope.positive(number, key),
        None => Ok(1.0),
    };
    let thickness = positive_or_one(&deck.thickness, "thickness")?;
    Ok(match name {
        DimensionName::Line => Dimension::Line {
            cross_section: positive_or_one(&deck.cross_section, "cross_section")?,
        },
        DimensionName::PlaneStress => Dimension::PlaneStress { thickness },
        DimensionName::PlaneStrain => Dimension::PlaneStrain { thickness },
        DimensionName::Space => Dimension::Space,
    })
}

fn spacing(scope: &Scope, deck: &Deck, horizon: f64) -> Result<Option<f64>> {
    let Some(number) = &deck.grid.get_ref().spacing else {
        return Ok(None);
    };
    checked_spacing(scope, number, "[grid] spacing", horizon).map(Some)
}

fn checked_spacing(scope: &Scope, number: &Number, key: &str, horizon: f64) -> Result<f64> {
    let spacing = scope.positive(number, key)?;
    if spacing > horizon {
        let message = format!(
            "{key}: {spacing} m is larger than the horizon {horizon} m, so no point would have a \
             neighbour; the horizon is usually 3 to 6 spacings"
        );
        return Err(scope.error(number.span(), message));
    }
    Ok(spacing)
}

fn sets(scope: &Scope, deck: &Deck) -> Result<Vec<plan::Set>> {
    let mut sets = vec![plan::Set {
        name: "all".to_owned(),
        span: 0..0,
        selector: plan::Selector::All,
    }];
    for (index, (name, body)) in deck.body.iter().enumerate() {
        if name == "all" {
            let message = "[body.all]: `all` is the set of all points; choose another name";
            return Err(scope.error(body.span(), message));
        }
        sets.push(plan::Set {
            name: name.clone(),
            span: body.span(),
            selector: plan::Selector::Body(index),
        });
    }
    for (name, table) in &deck.set {
        if sets.iter().any(|set| set.name == *name) {
            let message = format!(
                "[set.{name}]: this name is taken; `all` and the names of the bodies are sets \
                 already"
            );
            return Err(scope.error(table.span(), message));
        }
        sets.push(plan::Set {
            name: name.clone(),
            span: table.span(),
            selector: selector(scope, name, table)?,
        });
    }
    Ok(sets)
}

fn selector(scope: &Scope, name: &str, table: &Spanned<grammar::Set>) -> Result<plan::Selector> {
    let key = format!("[set.{name}]");
    let set = table.get_ref();
    match (&set.condition, &set.shape, &set.ids) {
        (Some(condition), None, None) => scope
            .expression(condition, &format!("{key} where"), &POSITION)
            .map(plan::Selector::Where),
        (None, Some(shape), None) => {
            shapes::shape(scope, &format!("{key} shape"), shape).map(plan::Selector::Within)
        }
        (None, None, Some(ids)) => {
            let mut ids = ids.get_ref().clone();
            ids.sort_unstable();
            ids.dedup();
            Ok(plan::Selector::Ids(ids))
        }
        _ => Err(scope.error(
            table.span(),
            format!("{key}: give exactly one of `where`, `shape` and `ids`"),
        )),
    }
}

/// The keys of an elastic constant that are given, with their numbers.
fn given(elastic: &grammar::Elastic) -> Vec<(&'static str, Constant, &Number)> {
    [
        ("youngs_modulus", Constant::Young, &elastic.youngs_modulus),
        ("bulk_modulus", Constant::Bulk, &elastic.bulk_modulus),
        ("shear_modulus", Constant::Shear, &elastic.shear_modulus),
        ("lame_lambda", Constant::Lame, &elastic.lame_lambda),
        ("poisson_ratio", Constant::Poisson, &elastic.poisson_ratio),
    ]
    .into_iter()
    .filter_map(|(key, constant, number)| Some((key, constant, number.as_ref()?)))
    .collect()
}

fn material(
    scope: &Scope,
    dimension: Dimension,
    name: &str,
    table: &Spanned<grammar::Material>,
) -> Result<plan::Material> {
    let grammar::Material::Pmb(elastic) = table.get_ref();
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
                "{key}: give one or two of youngs_modulus, bulk_modulus, shear_modulus, \
                 lame_lambda, poisson_ratio; with one of them (not the last), Poisson's ratio is \
                 the law's own"
            );
            return Err(scope.error(table.span(), message));
        }
    };
    let place = constants.last().map_or(table.span(), |last| last.2.span());
    let Some(found) = Isotropic::from_two(pair[0], pair[1]) else {
        let message = format!("{key}: no solid has these two constants");
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

fn damage(
    scope: &Scope,
    sets: &[plan::Set],
    name: &str,
    table: &Spanned<grammar::Damage>,
) -> Result<plan::CriticalStretch> {
    let grammar::Damage::CriticalStretch(law) = table.get_ref();
    let key = format!("[damage.{name}.critical_stretch]");
    let positive = |number: &Number, name: &str| scope.positive(number, &format!("{key} {name}"));
    let toughness = match (
        &law.fracture_energy,
        &law.fracture_toughness,
        &law.critical_stretch,
    ) {
        (Some(energy), None, None) => {
            plan::Toughness::FractureEnergy(positive(energy, "fracture_energy")?)
        }
        (None, Some(toughness), None) => {
            plan::Toughness::FractureToughness(positive(toughness, "fracture_toughness")?)
        }
        (None, None, Some(stretch)) => {
            plan::Toughness::CriticalStretch(positive(stretch, "critical_stretch")?)
        }
        _ => {
            let message = format!(
                "{key}: give exactly one of `fracture_energy`, `fracture_toughness` and \
                 `critical_stretch`"
            );
            return Err(scope.error(table.span(), message));
        }
    };
    let alpha_key = format!("{key} alpha");
    Ok(plan::CriticalStretch {
        toughness,
        alpha: scope.within(&law.alpha, &alpha_key, 0.0..1.0, "at least 0 and below 1")?,
        no_failure: find_sets(scope, &law.no_failure, sets, &format!("{key} no_failure"))?,
    })
}

/// The index of a set.
pub(super) fn find_set(scope: &Scope, name: &Text, sets: &[plan::Set], key: &str) -> Result<usize> {
    find(
        scope.source,
        name,
        sets.iter().map(|set| set.name.as_str()),
        key,
    )
}

fn find_sets(scope: &Scope, names: &[Text], sets: &[plan::Set], key: &str) -> Result<Vec<usize>> {
    names
        .iter()
        .map(|name| find_set(scope, name, sets, key))
        .collect()
}

fn bodies(
    scope: &Scope,
    deck: &Deck,
    spacing: Option<f64>,
    materials: &IndexMap<String, plan::Material>,
    damages: &IndexMap<String, plan::CriticalStretch>,
) -> Result<Vec<plan::Body>> {
    if deck.body.is_empty() {
        return Err(scope.error(0..0, "[body]: the deck has no body"));
    }
    resolve_each(&deck.body, |name, table| {
        let body = table.get_ref();
        let key = format!("[body.{name}]");
        let names = materials.keys().map(String::as_str);
        let material = find(
            scope.source,
            &body.material,
            names,
            &format!("{key} material"),
        )?;
        let damage = body
            .damage
            .as_ref()
            .map(|damage| {
                let names = damages.keys().map(String::as_str);
                let index = find(scope.source, damage, names, &format!("{key} damage"))?;
                Ok(damages[index].clone())
            })
            .transpose()?;
        Ok(plan::Body {
            name: name.to_owned(),
            span: table.span(),
            material_name: body.material.get_ref().clone(),
            material: materials[material],
            damage,
            points: point_source(scope, deck, &key, table.span(), body, spacing)?,
        })
    })
    .map(|bodies| bodies.into_values().collect())
}

fn point_source(
    scope: &Scope,
    deck: &Deck,
    key: &str,
    span: Range<usize>,
    body: &grammar::Body,
    grid_spacing: Option<f64>,
) -> Result<plan::PointSource> {
    match (&body.shape, &body.points) {
        (Some(shape), None) => {
            let grid = deck.grid.get_ref();
            let horizon = scope.number(&grid.horizon, "[grid] horizon")?;
            let own = body
                .spacing
                .as_ref()
                .map(|number| checked_spacing(scope, number, &format!("{key} spacing"), horizon))
                .transpose()?;
            let Some(spacing) = own.or(grid_spacing) else {
                let message = "[grid]: a body given as a shape needs `spacing` here or in the body";
                return Err(scope.error(deck.grid.span(), message));
            };
            let origin = match &grid.origin {
                Some(origin) => scope.vector(origin, "[grid] origin")?,
                None => [0.0; 3],
            };
            Ok(plan::PointSource::Lattice {
                shape: shapes::shape(scope, &format!("{key} shape"), shape)?,
                spacing,
                origin,
            })
        }
        (None, Some(points)) => {
            if let Some(spacing) = &body.spacing {
                let message = format!("{key} spacing: points from a file have no spacing");
                return Err(scope.error(spacing.span(), message));
            }
            let folder = scope.source.path.parent().unwrap_or("".as_ref());
            Ok(plan::PointSource::File {
                path: folder.join(points.file.get_ref()),
                block: points.block.as_ref().map(|block| *block.get_ref()),
                span: points.file.span(),
            })
        }
        _ => Err(scope.error(
            span,
            format!("{key}: give exactly one of `shape` and `points`"),
        )),
    }
}

fn time(scope: &Scope, deck: &Deck) -> Result<plan::Time> {
    let time = deck.time.get_ref();
    let end = scope.positive(&time.end, "[time] end")?;
    let safety = scope.within(
        &time.safety,
        "[time] safety",
        f64::MIN_POSITIVE..1.0 + f64::EPSILON,
        "above 0 and at most 1",
    )?;
    let step = match &time.step {
        None => plan::StepRule::Automatic(safety),
        Some(number) => {
            let step = scope.positive(number, "[time] step")?;
            if step > end {
                let message = format!("[time] step: {step} s is longer than the run, {end} s");
                return Err(scope.error(number.span(), message));
            }
            plan::StepRule::Fixed(step)
        }
    };
    Ok(plan::Time { end, step })
}

fn interval(
    scope: &Scope,
    key: &str,
    every: &Option<Number>,
    every_steps: &Option<Spanned<u64>>,
    default: f64,
) -> Result<plan::Interval> {
    match (every, every_steps) {
        (None, None) => Ok(plan::Interval::Seconds(default)),
        (Some(every), None) => scope
            .positive(every, &format!("{key} every"))
            .map(plan::Interval::Seconds),
        (None, Some(steps)) if *steps.get_ref() > 0 => Ok(plan::Interval::Steps(*steps.get_ref())),
        (None, Some(steps)) => Err(scope.error(
            steps.span(),
            format!("{key} every_steps: must be at least 1"),
        )),
        (Some(_), Some(steps)) => Err(scope.error(
            steps.span(),
            format!("{key} every_steps: give either `every` or `every_steps`"),
        )),
    }
}

fn output(scope: &Scope, deck: &Deck, end: f64) -> Result<plan::Output> {
    let output = deck.output.get_ref();
    let names = plan::Field::ALL.map(plan::Field::name);
    let fields = match &output.fields {
        None => DEFAULT_FIELDS.to_vec(),
        Some(fields) => fields
            .iter()
            .map(|field| {
                let index = find(scope.source, field, names.into_iter(), "[output] fields")?;
                Ok(plan::Field::ALL[index])
            })
            .collect::<Result<Vec<_>>>()?,
    };
    if let Some(twice) = (1..fields.len()).find(|k| fields[..*k].contains(&fields[*k])) {
        let place = output
            .fields
            .as_ref()
            .map_or(0..0, |fields| fields[twice].span());
        let message = format!("[output] fields: `{}` is named twice", fields[twice].name());
        return Err(scope.error(place, message));
    }
    Ok(plan::Output {
        every: interval(
            scope,
            "[output]",
            &output.every,
            &output.every_steps,
            end / 50.0,
        )?,
        fields,
    })
}

/// The fields of a result whose deck names none.
pub const DEFAULT_FIELDS: [plan::Field; 4] = [
    plan::Field::Displacement,
    plan::Field::Velocity,
    plan::Field::Damage,
    plan::Field::StrainEnergyDensity,
];

/// Damage above which a point counts as cracked if the deck does not say.
pub const DEFAULT_DAMAGE_THRESHOLD: f64 = 0.35;

fn history(scope: &Scope, deck: &Deck, sets: &[plan::Set], end: f64) -> Result<plan::History> {
    let history = deck.history.get_ref();
    let damage_threshold = match &history.damage_threshold {
        None => DEFAULT_DAMAGE_THRESHOLD,
        Some(number) => {
            let key = "[history] damage_threshold";
            scope.within(number, key, 0.0..1.0, "at least 0 and below 1")?
        }
    };
    let probes = resolve_each(&history.probe, |name, probe| {
        scope.vector(&probe.get_ref().at, &format!("[history.probe.{name}] at"))
    })?;
    Ok(plan::History {
        every: interval(
            scope,
            "[history]",
            &history.every,
            &history.every_steps,
            end / 500.0,
        )?,
        reactions: find_sets(scope, &history.reactions, sets, "[history] reactions")?,
        damage_threshold,
        probes: probes.into_iter().collect(),
    })
}
