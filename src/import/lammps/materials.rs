//! Bodies and materials, from the coefficients of the pair style.

use super::Model;
use crate::error::{Result, excerpt};
use crate::import::bodies::{self, Body, Criterion, DamageModel, Material};
use crate::import::draft::{Section, Value};
use crate::import::elastic::Constants;
use crate::import::log::{Fate, OTHER_MODEL};
use crate::import::translation::Translation;
use crate::import::tree::Node;
use std::f64::consts::PI;

/// Coefficients of a pair of atom types; the type 0 stands for all types.
pub(super) struct Coefficients {
    pub(super) types: [u32; 2],
    pub(super) values: Vec<f64>,
    pub(super) node: Node,
}

/// Return the last coefficients that the script gives for bonds between atoms of the types `a` and `b`.
fn coefficients(model: &Model, a: u32, b: u32) -> Option<&Coefficients> {
    let fits = |of: u32, kind: u32| of == 0 || of == kind;
    let mut found = model.coefficients.iter().rev();
    found.find(|Coefficients { types: [i, j], .. }| {
        (fits(*i, a) && fits(*j, b)) || (fits(*i, b) && fits(*j, a))
    })
}

/// Return the index of the horizon in the coefficients of a law; the moduli come before it.
fn horizon_index(law: &str) -> usize {
    if law == "pmb" { 1 } else { 2 }
}

/// Log each `pair_coeff` for bonds between atoms of two different types. In the new deck, such a bond has the
/// mean of the moduli of both types, and the smaller of both critical stretches. If the `pair_coeff` gives
/// other values, a warning is printed.
fn note_joints(translation: &Translation, model: &Model, kinds: &[u32], law: &str) {
    let first = horizon_index(law);
    let pairs = kinds
        .iter()
        .flat_map(|a| kinds.iter().map(move |b| (*a, *b)));
    for (a, b) in pairs.filter(|(a, b)| a < b) {
        let of = |a, b| coefficients(model, a, b);
        let (Some(joint), Some(one), Some(other)) = (of(a, b), of(a, a), of(b, b)) else {
            continue;
        };
        if joint.node.id == one.node.id && one.node.id == other.node.id {
            continue;
        }
        let expected = |k: usize| {
            let [x, y] = [one.values[k], other.values[k]];
            match k {
                k if k < first => f64::midpoint(x, y),
                k if k == first + 1 => x.min(y),
                _ => x,
            }
        };
        let is_equal = |k: usize| {
            let tolerance = 1e-6 * expected(k).abs();
            (joint.values[k] - expected(k)).abs() <= tolerance
        };
        let is_same = joint.values.len() == one.values.len()
            && (0..one.values.len()).all(is_equal)
            && (first..one.values.len())
                .all(|k| k == first + 1 || one.values[k] == other.values[k]);
        let log = &translation.log;
        let note = "bonds between bodies have the mean moduli of their ends and the smaller critical stretch";
        if is_same {
            log.taken(&joint.node, note);
        } else {
            let fate = if joint.types[0] == joint.types[1] {
                Fate::Approximated
            } else {
                Fate::LeftOut
            };
            log.note(&joint.node, fate, note);
            log.note(&joint.node, fate, OTHER_MODEL);
        }
    }
}

/// Write materials, damage and bodies. Return for each body its atom type, the name of its region and its
/// name in the new deck.
pub(super) fn write_bodies(
    translation: &mut Translation,
    model: &mut Model,
) -> Result<Vec<(u32, String, String)>> {
    translation.draft.top("dimension", Value::text("3d"));
    let Some((style, style_node)) = model.style.clone() else {
        return Err(translation.error(1, "the script has no `pair_style`"));
    };
    let law = match style.as_str() {
        "peri/pmb" => "pmb",
        "peri/lps" => "ordinary",
        "peri/ves" => "ordinary_viscoelastic",
        "peri/eps" => "ordinary_plastic",
        style => {
            let message = format!(
                "pair_style {} is not read; known are peri/pmb, peri/lps, peri/ves and peri/eps",
                excerpt(style)
            );
            return Err(translation.error(style_node.line, message));
        }
    };
    translation.log.taken(&style_node, format!("the law {law}"));
    let Some(spacing) = model.spacing else {
        return Err(translation.error(1, "the script has no `lattice sc`"));
    };
    if model.atoms.is_empty() {
        return Err(translation.error(1, "the script has no `create_atoms` of a region or the box"));
    }
    let grid = translation.draft.section("grid");
    grid.set("spacing", Value::number(spacing));
    let origin = model.origin.map(|fraction| (fraction - 0.5) * spacing);
    grid.set("origin", Value::numbers(&origin));
    grid.comment("LAMMPS tapers volumes from half a spacing below the horizon up to it.");
    grid.set("volume_correction", Value::text("linear-inside"));
    let mut bodies = Vec::new();
    let mut names = Vec::new();
    let mut materials: Vec<(u32, Material, Option<String>, Value)> = Vec::new();
    for atoms in &model.atoms {
        if !materials.iter().any(|(kind, ..)| *kind == atoms.kind) {
            let made = write_material(translation, model, atoms.kind, law)?;
            materials.push((atoms.kind, made.0, made.1, made.2));
        }
        let made = materials.iter().find(|(kind, ..)| *kind == atoms.kind);
        let (_, material, damage, horizon) = made.expect("it is made");
        let body = translation.new_name("set", &atoms.name);
        let Value::Table(shape) = atoms.region.shape(spacing) else {
            unreachable!("a shape is a table");
        };
        let (kind, value) = shape.into_iter().next().expect("a shape has one key");
        bodies.push(Body {
            name: body.clone(),
            material: material.written.clone(),
            damage: damage.clone(),
            horizon: horizon.clone(),
            points: (format!("shape.{kind}"), value),
        });
        names.push((atoms.kind, atoms.name.clone(), body));
    }
    let kinds: Vec<u32> = materials.iter().map(|(kind, ..)| *kind).collect();
    note_joints(translation, model, &kinds, law);
    bodies::write(translation, &bodies);
    let contact = translation.draft.section("contact");
    contact.set("model", Value::text("short-range"));
    let note = "[contact] model = \"short-range\": only between points without an intact bond";
    translation.log.approximated(&style_node, note);
    if bodies.len() > 1 {
        translation
            .draft
            .section("interface")
            .set("rule", Value::text("own"));
    }
    Ok(names)
}

/// Write the material and the damage law of an atom type. Return the material, the name of the damage law and
/// the horizon.
fn write_material(
    translation: &mut Translation,
    model: &Model,
    kind: u32,
    law: &'static str,
) -> Result<(Material, Option<String>, Value)> {
    let Some(coefficients) = coefficients(model, kind, kind) else {
        let message = format!("there is no `pair_coeff` for type {kind}");
        return Err(translation.error(1, message));
    };
    let node = &coefficients.node;
    let expected = match law {
        "pmb" => "c horizon s00 alpha",
        "ordinary" => "K G horizon s00 alpha",
        "ordinary_viscoelastic" => "K G horizon s00 alpha lambda tau",
        _ => "K G horizon s00 alpha yield_stress",
    };
    let values = &coefficients.values;
    let count = expected.split(' ').count();
    if values.len() != count {
        let message = format!("pair_coeff: needs {count} numbers behind the types: {expected}");
        return Err(translation.error(node.line, message));
    }
    let density = model
        .densities
        .iter()
        .rev()
        .find(|(of, _)| of.is_none_or(|of| of == kind));
    let Some((_, density)) = density else {
        let message = format!("there is no `set … density` for type {kind}");
        return Err(translation.error(1, message));
    };
    let first = horizon_index(law);
    let [horizon, stretch, alpha] = [values[first], values[first + 1], values[first + 2]];
    let written = translation.name("material", &format!("type {kind}"));
    let mut section = Section::new(format!("material.{written}.{law}"));
    section.set("density", Value::number(*density));
    let constants = match law {
        "pmb" => {
            // c = 12 E/(π δ⁴) for a Poisson ratio of 1/4.
            let young = values[0] * PI * horizon.powi(4) / 12.0;
            section.comment(format!(
                "youngs_modulus = c π δ⁴/12 with c = {:e}.",
                values[0]
            ));
            section.set("youngs_modulus", Value::number(young));
            Constants::of(&[("youngs_modulus", young), ("poisson_ratio", 0.25)])
        }
        _ => {
            section.set("bulk_modulus", Value::number(values[0]));
            section.set("shear_modulus", Value::number(values[1]));
            if law != "ordinary_plastic" {
                section.comment("Bonds of LAMMPS have the influence function 1/|ξ|.");
                section.set("influence", Value::text("inverse"));
            }
            Constants::of(&[("bulk_modulus", values[0]), ("shear_modulus", values[1])])
        }
    };
    match law {
        "ordinary_viscoelastic" => {
            section.set("relaxing_share", Value::number(values[5]));
            section.set("relaxation_time", Value::number(values[6]));
        }
        "ordinary_plastic" => {
            section.set("yield_stress", Value::number(values[5]));
        }
        _ => {}
    }
    if let Some(drag) = model.drag {
        section.set("damping", Value::number(drag / density));
    }
    translation.add(section);
    let note = format!("[material.{written}.{law}] and the horizon");
    match law {
        "ordinary_plastic" => {
            let note = note
                + "; the yield stress has another formula, and the influence function is 1 in place of 1/|ξ|";
            translation.log.approximated(node, note);
        }
        _ => translation.log.taken(node, note),
    }
    let material = Material {
        read: format!("type {kind}"),
        written,
        law,
        constants,
    };
    let damage = DamageModel {
        read: format!("type {kind}"),
        criterion: Criterion::Stretch {
            value: Value::number(stretch),
            stretch,
            tension_only: true,
        },
        node: node.clone(),
    };
    let damage = bodies::damage(translation, &damage, &material, horizon);
    if let (Some(damage), true) = (&damage, alpha != 0.0) {
        let kind = if law == "ordinary_plastic" {
            "energy"
        } else {
            "critical_stretch"
        };
        let section = translation
            .draft
            .section(&format!("damage.{damage}.{kind}"));
        section.set("alpha", Value::number(alpha));
    }
    Ok((material, damage, Value::number(horizon)))
}
