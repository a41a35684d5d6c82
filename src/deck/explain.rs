//! A deck with every default filled in.

use super::grammar::{Deck, Grid};
use super::number::{Edges, Number, default_number};
use super::plan::{CheckpointRule, Interval, Plan};
use crate::dimension::Dimension;
use crate::error::{Error, Result};
use serde_spanned::Spanned;

/// The deck as TOML with every default written out.
///
/// # Errors
/// When it cannot be written.
pub fn explain(deck: &Deck, plan: &Plan) -> Result<String> {
    let mut deck = deck.clone();
    fill(&mut deck, plan);
    toml::to_string(&deck).map_err(|error| Error::run(format!("cannot write the deck: {error}")))
}

/// Writes into the deck whatever it leaves to a default that depends on other values.
fn fill(deck: &mut Deck, plan: &Plan) {
    let number = |value| Some(default_number(value));
    match plan.dimension {
        Dimension::Line { cross_section } => {
            deck.cross_section = deck.cross_section.take().or(number(cross_section));
        }
        Dimension::PlaneStress { thickness } | Dimension::PlaneStrain { thickness } => {
            deck.thickness = deck.thickness.take().or(number(thickness));
        }
        Dimension::Space => {}
    }
    let grid = deck.grid.get_mut();
    let zeros = vec![default_number(0.0); plan.dimension.count()];
    grid.origin = grid.origin.take().or(Some(Spanned::new(0..0, zeros)));
    for body in deck.body.values_mut().map(|body| body.get_mut()) {
        if body.shape.is_some() {
            body.spacing = body.spacing.take().or(grid.spacing.clone());
        }
        body.horizon = body.horizon.take().or(Some(grid.horizon.clone()));
    }
    for material in deck.material.values_mut() {
        use super::grammar::{Form, Influence, Material, SurfaceCorrection};
        let any_ratio = matches!(material.get_ref(), Material::Ordinary(_));
        let corrected = matches!(
            material.get_ref(),
            Material::Pmb(_) | Material::Proportional(_) | Material::LinearMicroelastic(_)
        );
        let normalised = matches!(material.get_ref(), Material::NormalisedPmb(_));
        let elastic = material.get_mut().elastic_mut();
        elastic.damping = elastic.damping.take().or(number(0.0));
        fn unless_given<T>(key: &mut Option<Spanned<T>>, value: T) {
            key.get_or_insert_with(|| Spanned::new(0..0, value));
        }
        if corrected {
            unless_given(&mut elastic.surface_correction, SurfaceCorrection::None);
        }
        if normalised {
            unless_given(&mut elastic.form, Form::Energy);
        }
        if any_ratio {
            unless_given(&mut elastic.influence, Influence::Constant);
        }
        let own = plan.dimension.bond_based_poisson_ratio();
        let without_ratio = [
            &elastic.youngs_modulus,
            &elastic.bulk_modulus,
            &elastic.shear_modulus,
            &elastic.lame_lambda,
        ];
        if without_ratio
            .iter()
            .filter(|constant| constant.is_some())
            .count()
            == 1
            && !any_ratio
        {
            elastic.poisson_ratio = elastic.poisson_ratio.take().or(number(own));
        }
    }
    for condition in deck.condition.values_mut().map(|table| table.get_mut()) {
        if condition.traction.is_some() || condition.pressure.is_some() {
            condition.depth = condition.depth.take().or_else(|| edge(grid));
        }
    }
    let output = deck.output.get_mut();
    fill_interval(
        &mut output.every,
        output.every_steps.is_some(),
        plan.output.every,
    );
    output.fields.get_or_insert_with(|| {
        let names = plan.output.fields.iter().map(|field| field.name());
        names
            .map(|name| Spanned::new(0..0, name.to_owned()))
            .collect()
    });
    let checkpoint = deck.checkpoint.get_mut();
    if let CheckpointRule::WallClock(seconds) = plan.checkpoint {
        let text = || Spanned::new(0..0, format!("{seconds} s"));
        checkpoint.every.get_or_insert_with(text);
    }
    let history = deck.history.get_mut();
    fill_interval(
        &mut history.every,
        history.every_steps.is_some(),
        plan.history.every,
    );
    history.damage_threshold = history
        .damage_threshold
        .take()
        .or(number(plan.history.damage_threshold));
    for front in history.front.values_mut().map(|table| table.get_mut()) {
        front.radius = front.radius.take().or(Some(grid.horizon.clone()));
    }
    for tip in history.tip.values_mut().map(|table| table.get_mut()) {
        let threshold = history.damage_threshold.clone();
        tip.threshold = tip.threshold.take().or(threshold);
    }
}

/// The grid's spacing, if one number holds for all directions.
fn edge(grid: &Grid) -> Option<Number> {
    let spacing = grid.spacing.as_ref()?;
    match spacing.get_ref() {
        Edges::Same(edge) => Some(Spanned::new(spacing.span(), edge.clone())),
        Edges::Each(_) => None,
    }
}

fn fill_interval(every: &mut Option<Number>, in_steps: bool, interval: Interval) {
    if let (Interval::Seconds(seconds), false) = (interval, in_steps) {
        every.get_or_insert_with(|| default_number(seconds));
    }
}
