//! Material and damage models of Peridigm.

use super::points::Influence;
use crate::error::{Result, excerpt};
use crate::import::bodies::{Criterion, DamageModel, Material};
use crate::import::draft::{Section, Value};
use crate::import::elastic::Constants;
use crate::import::log::{Fate, OTHER_INFLUENCE};
use crate::import::translation::Translation;
use crate::import::tree::{Node, is_key};

/// Material models of Peridigm: the name, the law in the new deck, and how this law differs from the model.
const MATERIALS: [(&str, &str, &str); 20] = [
    ("Elastic", "ordinary", ""),
    ("Elastic Bond Based", "pmb", ""),
    ("Elastic Plastic", "ordinary_plastic", ""),
    (
        "Elastic Plastic Hardening",
        "ordinary_plastic",
        "without hardening",
    ),
    (
        "Pressure Dependent Elastic Plastic",
        "ordinary_plastic",
        "without dependence on pressure",
    ),
    ("Viscoelastic", "ordinary_viscoelastic", ""),
    ("Elastic Partial Volume", "ordinary", "points count whole"),
    (
        "Linear LPS Partial Volume",
        "ordinary",
        "points count whole, and rotations are not linearised",
    ),
    ("Pals", "ordinary", ""),
    ("Multiphysics Elastic", "ordinary", "without the fluid"),
    ("Elastic Correspondence", "correspondence", ""),
    (
        "Elastic Correspondence Partial Stress",
        "correspondence",
        "",
    ),
    (
        "Elastic Hypoelastic Correspondence",
        "correspondence",
        "hyperelastic",
    ),
    ("Elastic Plastic Correspondence", "correspondence", ""),
    (
        "Elastic Plastic Hypoelastic Correspondence",
        "correspondence",
        "hyperelastic",
    ),
    ("Isotropic Hardening Correspondence", "correspondence", ""),
    (
        "Isotropic Hardening Hypoelastic Correspondence",
        "correspondence",
        "hyperelastic",
    ),
    (
        "Elastic Bond Associated Correspondence",
        "bond_associated_correspondence",
        "another formulation",
    ),
    (
        "Elastic Plastic Bond Associated Correspondence",
        "bond_associated_correspondence",
        "elastic, another formulation",
    ),
    (
        "Viscoplastic Needleman Correspondence",
        "correspondence",
        "elastic",
    ),
];

/// Key of the thermal expansion in materials and damage models.
const EXPANSION: &str = "Thermal Expansion Coefficient";

/// Laws with a selectable influence function; other laws have ω = 1.
const INFLUENCED: [&str; 2] = ["ordinary", "ordinary_viscoelastic"];

/// Log whether the influence function of the source deck is taken, approximated or left out.
pub(super) fn note_influence(
    translation: &Translation,
    influence: &Influence,
    materials: &[Material],
) {
    let log = &translation.log;
    let node = &influence.node;
    if influence.known == Some("constant") {
        log.taken(node, "influence = \"constant\", the default");
        return;
    }
    let mut constant: Vec<&str> = Vec::new();
    for material in materials {
        if !INFLUENCED.contains(&material.law) && !constant.contains(&material.law) {
            constant.push(material.law);
        }
    }
    let constant_note = format!("{}: always ω = 1", constant.join(", "));
    if materials
        .iter()
        .all(|material| constant.contains(&material.law))
    {
        log.left_out(node, constant_note);
        return;
    }
    let Some(written) = influence.written else {
        log.left_out(node, OTHER_INFLUENCE);
        return;
    };
    log.taken(node, format!("influence = \"{written}\" of the materials"));
    if !influence.difference.is_empty() {
        log.approximated(node, influence.difference);
    }
    if !constant.is_empty() {
        log.approximated(node, constant_note);
    }
}

/// Write the materials. Return the materials, and the section headers of the materials with thermal
/// expansion.
pub(super) fn read_materials(
    translation: &mut Translation,
    node: &Node,
    influence: Option<&'static str>,
) -> Result<(Vec<Material>, Vec<String>)> {
    let (mut materials, mut expanding) = (Vec::new(), Vec::new());
    for (name, table) in node.tables() {
        let what = format!("the material `{name}`");
        let model = translation.required(table, "Material Model", &what)?;
        let model_name = translation.text(model, "Material Model")?;
        let known = MATERIALS
            .iter()
            .find(|(known, ..)| is_key(model_name, known));
        let Some((_, law, difference)) = known else {
            let note = format!("{} has no counterpart", excerpt(model_name));
            translation.log.left_out(table, note);
            continue;
        };
        let (mut law, mut difference) = (law, difference);
        // Peridigm's other models do not read this key.
        if let Some(node) = table.get("Disable Plasticity")
            && (is_key(model_name, "Elastic Plastic")
                || is_key(model_name, "Elastic Plastic Hardening"))
        {
            translation.log.taken(node, "whether the material yields");
            if translation.is_true(node) {
                (law, difference) = (&"ordinary", &"");
                for key in ["Yield Stress", "Hardening Modulus"] {
                    if let Some(node) = table.get(key) {
                        translation.log.taken(node, "the material does not yield");
                    }
                }
            }
        }
        let written = translation.name("material", name);
        let header = format!("[material.{written}.{law}]");
        if difference.is_empty() {
            translation.log.taken(model, &header)
        } else {
            translation
                .log
                .approximated(model, format!("{header}: {difference}"))
        }
        let mut section = Section::new(format!("material.{written}.{law}"));
        let density = translation.required(table, "Density", &what)?;
        translation.log.taken(density, format!("{header} density"));
        section.set("density", translation.number_value(density, "Density")?);
        let constants = Constants::read(translation, table)?;
        let enough = match *law {
            "pmb" => {
                // In 2-D, Peridigm's bulk modulus k is that of the plane. In plane stress, k = E/(2(1 − ν))
                // with ν = 1/3. In plane strain, k = E/(2(1 + ν)(1 − 2ν)) with ν = 1/4.
                let factor = if table
                    .get("Plane Stress")
                    .is_some_and(|node| translation.is_true(node))
                {
                    4.0 / 3.0
                } else {
                    1.25
                };
                let factor = (translation.dimension == 2).then_some(factor);
                let used = constants.write_one(&mut section, factor);
                for key in constants.keys() {
                    let node = Constants::node(table, key);
                    if let (Some(node), Some(used)) = (node, used)
                        && !used.contains(&key)
                    {
                        let note =
                            "the other constants determine the stiffness of a bond-based material";
                        translation.log.replace(node, Fate::LeftOut, note);
                    }
                }
                used.is_some()
            }
            _ => {
                constants.write_two(&mut section);
                constants.count() >= 2
            }
        };
        if !enough {
            let message = format!("{what} has too few elastic constants");
            return Err(translation.error(table.line, message));
        }
        law_keys(translation, table, law, &mut section)?;
        if let Some(node) = table.get(EXPANSION) {
            section.set(
                "thermal_expansion",
                translation.number_value(node, EXPANSION)?,
            );
            translation
                .log
                .taken(node, "thermal_expansion of the material");
            expanding.push(section.header().to_owned());
        }
        if let Some(influence) = influence
            && INFLUENCED.contains(law)
        {
            section.set("influence", Value::text(influence));
        }
        translation.add(section);
        materials.push(Material {
            read: name.to_owned(),
            written,
            law,
            constants,
        });
    }
    Ok((materials, expanding))
}

/// Write the keys that only some laws have, and log the parameters that the law does not use.
fn law_keys(
    translation: &Translation,
    table: &Node,
    law: &str,
    section: &mut Section,
) -> Result<()> {
    let log = &translation.log;
    let take = |section: &mut Section, name: &str, key: &str| -> Result<()> {
        if let Some(node) = table.get(name) {
            section.set(key, translation.number_value(node, name)?);
            log.taken(node, format!("{key} of the material"));
        }
        Ok(())
    };
    let model = table.get("Material Model").and_then(Node::text);
    match law {
        "ordinary" if model.is_some_and(|model| is_key(model, "Pals")) => {
            section.set("surface_correction", Value::text("pals"));
        }
        "ordinary_plastic" => {
            take(section, "Yield Stress", "yield_stress")?;
            section.set("calibration", Value::text("continuum"));
        }
        "ordinary_viscoelastic" => {
            take(section, "lambda_i", "relaxing_share")?;
            take(section, "tau b", "relaxation_time")?;
        }
        "correspondence" => {
            let model = model.unwrap_or("");
            if model.contains("Plastic") && !model.contains("Visco") || model.contains("Hardening")
            {
                take(section, "Yield Stress", "yield_stress")?;
                take(section, "Hardening Modulus", "hardening_modulus")?;
                if let Some(node) = table.get("Disable Plasticity") {
                    log.left_out(node, "Peridigm's correspondence models do not read it");
                }
            }
            let coefficient = table.get("Hourglass Coefficient");
            match coefficient {
                Some(node) if translation.number(node, "Hourglass Coefficient")? > 0.0 => {
                    section.set("zero_energy", Value::text("silling2017")).set(
                        "zero_energy_coefficient",
                        translation.number_value(node, "Hourglass Coefficient")?,
                    );
                    log.approximated(node, "zero_energy = \"silling2017\" with this coefficient");
                }
                Some(node) => {
                    section.set("zero_energy", Value::text("none"));
                    log.taken(node, "zero_energy = \"none\"");
                }
                None => {
                    section.set("zero_energy", Value::text("none"));
                }
            }
        }
        _ => {}
    }
    for (name, reason) in [
        (
            "Apply Automatic Differentiation Jacobian",
            "concerns a solver of linear systems",
        ),
        ("Hourglass Coefficient", "concerns correspondence laws only"),
    ] {
        if let Some(node) = table.get(name)
            && !(law == "correspondence" && name.starts_with("Hourglass"))
        {
            log.left_out(node, reason);
        }
    }
    if let Some(node) = table.get("Apply Shear Correction Factor") {
        if translation.is_true(node) {
            log.left_out(node, "has no counterpart; `surface_correction = \"pals\"` of `ordinary` is another correction")
        } else {
            log.taken(node, "no surface correction")
        }
    }
    Ok(())
}

/// Read the damage models.
pub(super) fn damages(translation: &mut Translation, root: &Node) -> Result<Vec<DamageModel>> {
    let mut damages = Vec::new();
    let tables = root.get("Damage Models").into_iter().flat_map(Node::tables);
    for (name, table) in tables {
        let what = format!("the damage model `{name}`");
        let model = translation.required(table, "Damage Model", &what)?;
        let kind = translation.text(model, "Damage Model")?;
        let is = |known: &str| is_key(kind, known);
        if is("Critical Stretch") || is("Interface Aware") {
            let stretch = translation.required(table, "Critical Stretch", &what)?;
            if is("Critical Stretch") {
                translation.log.taken(model, "critical_stretch")
            } else {
                let note = "critical_stretch, also of bonds that Interface Aware would keep";
                translation.log.approximated(model, note);
            }
            let value = translation.number_value(stretch, "Critical Stretch")?;
            let number = translation.number(stretch, "Critical Stretch")?;
            if let Some(node) = table.get(EXPANSION) {
                let note = "bonds break by their elastic part, with the expansion of the material";
                translation.log.taken(node, note);
            }
            damages.push(DamageModel {
                read: name.to_owned(),
                criterion: Criterion::Stretch {
                    value,
                    stretch: number,
                    tension_only: true,
                },
                node: stretch.clone(),
            });
        } else {
            let note = format!(
                "{} has no counterpart; bodies with it never break",
                excerpt(kind)
            );
            translation.log.left_out(table, note);
        }
    }
    Ok(damages)
}
