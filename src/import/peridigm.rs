//! Decks of Peridigm, in YAML or XML.

use super::bodies::{self, Body, Criterion, DamageModel, Material};
use super::bond_filters::bond_filters;
use super::conditions::{Conditions, Given, Quantity};
use super::draft::{Section, Value};
use super::elastic::Constants;
use super::files::PointFile;
use super::outputs::Outputs;
use super::sets::Sets;
use super::solver;
use super::translation::Translation;
use super::tree::{Node, is_key};
use crate::error::{Result, excerpt};

/// Columns of a text file.
const COLUMNS: [&str; 5] = ["x", "y", "z", "block", "volume"];

/// Material models: their names, the law, and how the law differs.
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
    ("Pals", "ordinary", "without the position-aware weights"),
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

/// The key of the thermal expansion of materials and damage models.
const EXPANSION: &str = "Thermal Expansion Coefficient";

/// The type of a condition that prescribes temperatures.
const PRESCRIBED_TEMPERATURE: &str = "Prescribed Temperature";

/// Where the points of the blocks come from.
enum Points {
    /// A text file, and what is known of it.
    File(Value, Option<PointFile>),
    /// A mesh.
    Mesh(Value),
    /// A box with a spacing.
    Box(Value),
}

/// Translate a deck.
///
/// # Errors
/// If what a run needs is missing or wrong.
pub fn translate(translation: &mut Translation, root: &Node) -> Result<()> {
    let root = root.get("Peridigm").unwrap_or(root);
    let sections = ["Discretization", "Materials", "Blocks"];
    let mut found = Vec::new();
    for name in sections {
        found.push(translation.required(root, name, "the deck")?);
    }
    let [discretization, materials, blocks] = [found[0], found[1], found[2]];
    let setting = setting(translation, materials)?;
    translation.draft.top("dimension", Value::text(setting));
    let solvers: Vec<&Node> = root
        .tables()
        .filter(|(name, _)| name.to_lowercase().starts_with("solver"))
        .map(|(_, node)| node)
        .collect();
    let stages = stages(translation, root, &solvers)?;
    let points = points(translation, discretization)?;
    let influence = influence(translation, discretization)?;
    let (read, expanding) = read_materials(translation, materials, influence)?;
    let damages = damages(translation, root)?;
    let names = read_blocks(translation, blocks, &points, &read, &damages)?;
    let mut sets = Sets::new(matches!(points, Points::Mesh(_)));
    let has_temperature = conditions(translation, root, &mut sets, &stages, &expanding)?;
    contact(translation, root, discretization, &names)?;
    let mut outputs = Outputs::new(has_temperature);
    if let Some(computed) = root.get("Compute Class Parameters") {
        outputs.computed(translation, &mut sets, &names, computed)?;
    }
    for (name, node) in root.tables() {
        if name.to_lowercase().starts_with("output") {
            outputs.output(translation, node)?;
        }
    }
    let length = stages.last().map_or(0.0, |stage| stage.end) - translation.start;
    outputs.finish(translation, length);
    sets.finish(translation);
    Ok(())
}

/// The `dimension` of the new deck: plane if a material says so.
fn setting(translation: &mut Translation, materials: &Node) -> Result<&'static str> {
    let mut setting = "3d";
    for (_, material) in materials.tables() {
        for (key, value) in [
            ("Plane Stress", "plane-stress"),
            ("Plane Strain", "plane-strain"),
            ("Planar Problem", "plane-strain"),
        ] {
            if let Some(node) = material.get(key) {
                if translation.is_true(node) {
                    setting = value;
                }
                let note = format!("dimension = \"{setting}\"");
                match key {
                    "Planar Problem" => translation.log.approximated(node, note),
                    _ => translation.log.taken(node, note),
                }
            }
        }
    }
    if setting == "3d" {
        return Ok(setting);
    }
    translation.dimension = 2;
    for (_, material) in materials.tables() {
        for key in ["Height", "Thickness"] {
            if let Some(node) = material.get(key) {
                translation.log.taken(node, "thickness");
                let thickness = translation.number_value(node, key)?;
                if !translation.draft.has_top("thickness") {
                    translation.draft.top("thickness", thickness);
                }
            }
        }
    }
    Ok(setting)
}

/// The stages of all solvers.
fn stages(
    translation: &mut Translation,
    root: &Node,
    solvers: &[&Node],
) -> Result<Vec<solver::Stage>> {
    let Some(first) = solvers.first() else {
        return Err(translation.error(root.line, "the deck has no `Solver`"));
    };
    let mut start = 0.0;
    if let Some(initial) = first.get("Initial Time") {
        start = translation.number(initial, "Initial Time")?;
        match start == 0.0 {
            true => translation.log.taken(initial, "a run starts at 0"),
            false => translation
                .log
                .approximated(initial, "a run starts at 0; times are shifted"),
        }
    }
    translation.start = start;
    let mut stages: Vec<solver::Stage> = Vec::new();
    for (index, node) in solvers.iter().enumerate() {
        let at = stages.last().map_or(start, |stage| stage.end);
        if let (Some(initial), true) = (node.get("Initial Time"), index > 0) {
            let begins = translation.number(initial, "Initial Time")?;
            match begins == at {
                true => translation
                    .log
                    .taken(initial, "the end of the stage before"),
                false => translation
                    .log
                    .approximated(initial, "the end of the stage before"),
            }
        }
        stages.extend(solver::stage(translation, node, at, true)?);
    }
    Ok(stages)
}

/// Where the points come from, and the bonds that a discretization omits.
fn points(translation: &mut Translation, node: &Node) -> Result<Points> {
    let kind = translation.required(node, "Type", "the discretization")?;
    let name = translation.text(kind, "Type")?.to_owned();
    translation.log.taken(kind, "points of the bodies");
    if let Some(filters) = node.get("Bond Filters") {
        bond_filters(translation, filters)?;
    }
    if let Some(neighbourhood) = node.get("NeighborhoodType") {
        match neighbourhood
            .text()
            .is_some_and(|text| is_key(text, "Spherical"))
        {
            true => translation.log.taken(neighbourhood, "families are spheres"),
            false => translation
                .log
                .approximated(neighbourhood, "families are spheres"),
        }
    }
    if is_key(&name, "PdQuickGrid") {
        return quick_grid(translation, node);
    }
    let is_text = is_key(&name, "Text File");
    if !is_text && !is_key(&name, "Exodus") {
        let message = format!(
            "the discretization {} is not read; known are Text File, Exodus and PdQuickGrid",
            excerpt(&name)
        );
        return Err(translation.error(kind.line, message));
    }
    let file = translation.required(node, "Input Mesh File", "the discretization")?;
    let path = translation.text(file, "Input Mesh File")?.to_owned();
    let value = translation.file(&path);
    let grid = translation.draft.section("grid");
    grid.set("volume_correction", Value::text("none"));
    if is_text {
        let known = PointFile::read(&translation.path(&path), &COLUMNS);
        let note = match known {
            Some(_) => "points.file of the bodies",
            None => "points.file of the bodies; it cannot be read yet",
        };
        translation.log.taken(file, note);
        return Ok(Points::File(value, known));
    }
    let note = "points.mesh of the bodies; sphere elements are not read";
    translation.log.taken(file, note);
    Ok(Points::Mesh(value))
}

/// The box of a generated grid.
fn quick_grid(translation: &mut Translation, node: &Node) -> Result<Points> {
    let Some(generator) = node.get("TensorProduct3DMeshGenerator") else {
        let message = "PdQuickGrid needs a TensorProduct3DMeshGenerator; cylinders are not read";
        return Err(translation.error(node.line, message));
    };
    if let Some(kind) = generator.get("Type") {
        translation.log.taken(kind, "points of the bodies");
    }
    let (mut lower, mut upper, mut spacing) = (Vec::new(), Vec::new(), Vec::new());
    for axis in ["X", "Y", "Z"] {
        let number = |key: &str| {
            let node = translation.required(generator, key, "the generator")?;
            translation
                .log
                .taken(node, "the box of the body, and [grid] spacing and origin");
            translation.number(node, key)
        };
        let origin = number(&format!("{axis} Origin"))?;
        let length = number(&format!("{axis} Length"))?;
        let key = format!("Number Points {axis}");
        let count = number(&key)?;
        if count < 1.0 || length <= 0.0 {
            let message = format!("`{key}` must be 1 or more, and `{axis} Length` above 0");
            return Err(translation.error(generator.line, message));
        }
        lower.push(origin);
        upper.push(origin + length);
        spacing.push(length / count);
    }
    let dimension = translation.dimension;
    let grid = translation.draft.section("grid");
    let is_cube = spacing[..dimension].iter().all(|edge| *edge == spacing[0]);
    grid.set(
        "spacing",
        match is_cube {
            true => Value::number(spacing[0]),
            false => Value::numbers(&spacing[..dimension]),
        },
    );
    grid.set("origin", Value::numbers(&lower[..dimension]));
    grid.set("volume_correction", Value::text("none"));
    Ok(Points::Box(Value::Table(vec![
        ("lower".to_owned(), Value::numbers(&lower[..dimension])),
        ("upper".to_owned(), Value::numbers(&upper[..dimension])),
    ])))
}

/// The influence function of all materials.
fn influence(translation: &mut Translation, node: &Node) -> Result<Option<&'static str>> {
    let Some(function) = node.get("Influence Function") else {
        return Ok(None);
    };
    let text = translation.text(function, "Influence Function")?;
    let bare: String = text.chars().filter(|c| !c.is_whitespace()).collect();
    let bare = bare.trim_end_matches(';').trim_start_matches("value=");
    let note = |name: &str| format!("influence = \"{name}\" of the materials");
    Ok(match bare {
        "One" => {
            translation.log.taken(function, note("constant"));
            None
        }
        "1.0/zeta" | "1/zeta" | "horizon/zeta" => {
            translation.log.taken(function, note("inverse"));
            Some("inverse")
        }
        "1.0-zeta/horizon" | "1-zeta/horizon" => {
            translation.log.taken(function, note("linear"));
            Some("linear")
        }
        "Gaussian" => {
            let note = note("gaussian") + ": exp(−4ξ²/δ²) in place of exp(−6.25ξ²/δ²)";
            translation.log.approximated(function, note);
            Some("gaussian")
        }
        "ParabolicDecay" | "Parabolic_Decay" => {
            translation.log.approximated(function, note("linear"));
            Some("linear")
        }
        _ => {
            let note =
                "influence is one of constant, linear, gaussian and inverse; constant is used";
            translation.log.left_out(function, note);
            None
        }
    })
}

/// Write the materials; return them and the headers of those that expand.
fn read_materials(
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
        let written = translation.name("material", name);
        let header = format!("[material.{written}.{law}]");
        match difference.is_empty() {
            true => translation.log.taken(model, &header),
            false => translation
                .log
                .approximated(model, format!("{header}: {difference}")),
        }
        let mut section = Section::new(format!("material.{written}.{law}"));
        let density = translation.required(table, "Density", &what)?;
        translation.log.taken(density, format!("{header} density"));
        section.set("density", translation.number_value(density, "Density")?);
        let constants = Constants::read(translation, table)?;
        let enough = match *law {
            "pmb" => {
                // In the plane, Peridigm's bulk modulus is that of the plane: k = E/(2(1 − ν)), with ν = 1/3 in plane
                // stress, and E/(2(1 + ν)(1 − 2ν)) with ν = 1/4 in plane strain.
                let factor = match table
                    .get("Plane Stress")
                    .is_some_and(|node| translation.is_true(node))
                {
                    true => 4.0 / 3.0,
                    false => 1.25,
                };
                constants.write_one(&mut section, (translation.dimension == 2).then_some(factor))
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
        if let (Some(influence), "ordinary" | "ordinary_viscoelastic") = (influence, *law) {
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

/// Write the keys that only some laws have.
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
    match law {
        "ordinary_plastic" => {
            take(section, "Yield Stress", "yield_stress")?;
            section.set("calibration", Value::text("continuum"));
        }
        "ordinary_viscoelastic" => {
            take(section, "lambda_i", "relaxing_share")?;
            take(section, "tau b", "relaxation_time")?;
        }
        "correspondence" => {
            let model = table
                .get("Material Model")
                .and_then(Node::text)
                .unwrap_or("");
            if model.contains("Plastic") && !model.contains("Visco") || model.contains("Hardening")
            {
                let disabled = table.get("Disable Plasticity");
                let disabled = disabled.is_some_and(|node| {
                    log.taken(node, "whether the material yields");
                    translation.is_true(node)
                });
                if !disabled {
                    take(section, "Yield Stress", "yield_stress")?;
                    take(section, "Hardening Modulus", "hardening_modulus")?;
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
        match translation.is_true(node) {
            true => log.left_out(node, "ordinary laws have no surface correction"),
            false => log.taken(node, "no surface correction"),
        }
    }
    Ok(())
}

/// Read the damage models.
fn damages(translation: &mut Translation, root: &Node) -> Result<Vec<DamageModel>> {
    let mut damages = Vec::new();
    let tables = root.get("Damage Models").into_iter().flat_map(Node::tables);
    for (name, table) in tables {
        let what = format!("the damage model `{name}`");
        let model = translation.required(table, "Damage Model", &what)?;
        let kind = translation.text(model, "Damage Model")?;
        let is = |known: &str| is_key(kind, known);
        if is("Critical Stretch") || is("Interface Aware") {
            let stretch = translation.required(table, "Critical Stretch", &what)?;
            match is("Critical Stretch") {
                true => translation.log.taken(model, "critical_stretch"),
                false => {
                    let note = "critical_stretch, also of bonds that Interface Aware would keep";
                    translation.log.approximated(model, note);
                }
            }
            let value = translation.number_value(stretch, "Critical Stretch")?;
            let number = translation.number(stretch, "Critical Stretch")?;
            if let Some(node) = table.get(EXPANSION) {
                let note = "bonds break by their elastic part, with the expansion of the material";
                translation.log.taken(node, note);
            }
            damages.push(DamageModel {
                read: name.to_owned(),
                criterion: Criterion::Stretch(value, number),
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

/// Write the bodies; return the names of the blocks and of their bodies.
fn read_blocks(
    translation: &mut Translation,
    node: &Node,
    points: &Points,
    materials: &[Material],
    damages: &[DamageModel],
) -> Result<Vec<(String, String)>> {
    let mut groups = Vec::new();
    let mut named = Vec::new();
    for (name, table) in node.tables() {
        let what = format!("the block group `{name}`");
        let blocks = translation.required(table, "Block Names", &what)?;
        let text = translation.text(blocks, "Block Names")?;
        translation.log.taken(blocks, "one body for each block");
        let names: Vec<String> = text.split_whitespace().map(str::to_owned).collect();
        named.extend(
            names
                .iter()
                .filter(|name| !is_key(name, "default"))
                .cloned(),
        );
        groups.push((name, table, names, blocks));
    }
    let (mut bodies, mut pairs) = (Vec::new(), Vec::new());
    for (name, table, names, block_names) in groups {
        let line = block_names.line;
        let what = format!("the block group `{name}`");
        let material_node = translation.required(table, "Material", &what)?;
        let material_name = translation.text(material_node, "Material")?;
        let material = materials
            .iter()
            .find(|material| is_key(&material.read, material_name));
        let Some(material) = material else {
            let message = format!(
                "the material {} is not defined, or has no counterpart",
                excerpt(material_name)
            );
            return Err(translation.error(material_node.line, message));
        };
        translation
            .log
            .taken(material_node, format!("material `{}`", material.written));
        let horizon_node = translation.required(table, "Horizon", &what)?;
        let horizon = translation.number(horizon_node, "Horizon")?;
        let horizon_value = translation.number_value(horizon_node, "Horizon")?;
        translation.log.taken(horizon_node, "horizon");
        let mut damage = None;
        if let Some(damage_node) = table.get("Damage Model") {
            let model_name = translation.text(damage_node, "Damage Model")?;
            match damages.iter().find(|model| is_key(&model.read, model_name)) {
                Some(model) => {
                    damage = bodies::damage(translation, model, material, horizon)?;
                    translation.log.taken(damage_node, "damage of the bodies");
                }
                None => translation
                    .log
                    .left_out(damage_node, "this damage model is left out"),
            }
        }
        let mut blocks = Vec::new();
        for name in names {
            if !is_key(&name, "default") {
                blocks.push(name);
                continue;
            }
            match points {
                Points::File(_, Some(file)) => {
                    let others = file.blocks.iter().map(|block| format!("block_{block}"));
                    blocks.extend(others.filter(|block| !named.contains(block)));
                }
                Points::Box(_) if named.is_empty() => blocks.push("block_1".to_owned()),
                Points::Mesh(_) => blocks.push("default".to_owned()),
                _ => {
                    let message =
                        "the default blocks are those of the mesh file, which cannot be read";
                    return Err(translation.error(line, message));
                }
            }
        }
        for block in blocks {
            if let Points::File(_, Some(file)) = points
                && block_number(&block).is_some_and(|number| !file.blocks.contains(&number))
            {
                let note = format!("no row of the point file belongs to {block}");
                translation.log.approximated(block_names, note);
                continue;
            }
            let body = translation.new_name("set", &block);
            let source = source(translation, points, &block, line)?;
            pairs.push((block, body.clone()));
            bodies.push(Body {
                name: body,
                material: material.written.clone(),
                damage: damage.clone(),
                horizon: horizon_value.clone(),
                points: source,
            });
        }
    }
    if bodies.is_empty() {
        return Err(translation.error(node.line, "there is no block"));
    }
    bodies::write(translation, &bodies);
    Ok(pairs)
}

/// The number of a block of a text file, `block_NUMBER`.
fn block_number(block: &str) -> Option<u32> {
    block.rsplit('_').next()?.parse().ok()
}

/// The points of a block: key and value.
fn source(
    translation: &Translation,
    points: &Points,
    block: &str,
    line: usize,
) -> Result<(String, Value)> {
    match points {
        Points::Box(shape) => Ok(("shape.box".to_owned(), shape.clone())),
        Points::Mesh(file) => {
            let mut table = vec![("mesh".to_owned(), file.clone())];
            if block != "default" {
                table.push(("block".to_owned(), Value::text(block)));
            }
            Ok(("points".to_owned(), Value::Table(table)))
        }
        Points::File(file, known) => {
            let Some(number) = block_number(block) else {
                let message = format!(
                    "the block {} of a text file must be block_NUMBER",
                    excerpt(block)
                );
                return Err(translation.error(line, message));
            };
            let mut table = vec![
                ("file".to_owned(), file.clone()),
                ("block".to_owned(), Value::Number(number.to_string())),
            ];
            if known.as_ref().is_none_or(|file| file.names.is_none()) {
                let columns = COLUMNS.iter().map(|name| Value::text(*name));
                table.push(("columns".to_owned(), Value::list(columns)));
            }
            Ok(("points".to_owned(), Value::Table(table)))
        }
    }
}

/// Write the initial values, loads and supports, then the stages; return whether temperatures are among them.
fn conditions<'n>(
    translation: &mut Translation,
    root: &'n Node,
    sets: &mut Sets<'n>,
    stages: &[solver::Stage],
    expanding: &[String],
) -> Result<bool> {
    let mut conditions = Conditions::default();
    let starts = starts(translation, root);
    let uniform = match &starts[..] {
        [first @ Value::Number(_), others @ ..] if others.iter().all(|start| start == first) => {
            Some(first)
        }
        _ => None,
    };
    if let Some(reference) = uniform {
        for header in expanding {
            let section = translation.draft.section(header);
            section.set("reference_temperature", reference.clone());
        }
    }
    if let Some(node) = root.get("Boundary Conditions") {
        for (name, value) in node.entries() {
            if value.text().is_some() && name.to_lowercase().replace('_', " ").contains("node set")
            {
                sets.define(name, value);
            }
        }
        for (name, table) in node.tables() {
            let kind = translation.required(table, "Type", &format!("the condition `{name}`"))?;
            let kind_name = translation.text(kind, "Type")?;
            if is_key(kind_name, PRESCRIBED_TEMPERATURE) {
                temperature(
                    translation,
                    sets,
                    &mut conditions,
                    (name, table, kind),
                    (uniform.is_some(), expanding),
                )?;
                continue;
            }
            let quantity = [
                ("Initial Displacement", Quantity::Initial("displacement")),
                ("Initial Velocity", Quantity::Initial("velocity")),
                ("Prescribed Displacement", Quantity::Support("displacement")),
                ("Body Force", Quantity::BodyForce),
            ];
            let known = quantity.iter().find(|(known, _)| is_key(kind_name, known));
            let Some((known, quantity)) = known else {
                let note = format!("{} has no counterpart", excerpt(kind_name));
                translation.log.left_out(table, note);
                continue;
            };
            translation.log.taken(kind, *known);
            let given = Given {
                name,
                node: table,
                quantity: quantity.clone(),
                steps: Vec::new(),
            };
            conditions.add(translation, sets, &given)?;
        }
    }
    conditions.finish(translation);
    let has_contact = root.get("Contact").is_some();
    solver::write(translation, stages, &conditions.written, has_contact);
    Ok(conditions.has_temperature)
}

/// The prescribed temperatures at the start of the run, from which materials expand.
fn starts(translation: &Translation, root: &Node) -> Vec<Value> {
    let tables = root.get("Boundary Conditions").into_iter();
    let tables = tables.flat_map(Node::tables).map(|(_, table)| table);
    let text = |table: &Node, key: &str| Some(table.get(key)?.text()?.to_owned());
    tables
        .filter(|table| {
            text(table, "Type").is_some_and(|kind| is_key(&kind, PRESCRIBED_TEMPERATURE))
        })
        .filter_map(|table| translation.at_start(&text(table, "Value")?).ok())
        .collect()
}

/// Write a prescribed temperature. Materials expand from the temperature at the start, which is the reference
/// temperature of all materials if it is `uniform`, and subtracted otherwise.
fn temperature<'n>(
    translation: &mut Translation,
    sets: &mut Sets<'n>,
    conditions: &mut Conditions,
    (name, table, kind): (&str, &Node, &Node),
    (uniform, expanding): (bool, &[String]),
) -> Result<()> {
    if expanding.is_empty() {
        let note = "no material expands, and heat is not conducted";
        translation.log.left_out(table, note);
        return Ok(());
    }
    let value = translation.required(table, "Value", &format!("the condition `{name}`"))?;
    let start = translation.at_start(translation.text(value, "Value")?);
    let reference = match (uniform, start) {
        (true, _) | (false, Err(_)) => None,
        (false, Ok(start)) => Some(start),
    };
    let note = "temperature; the reference is that at the start; heat is not conducted";
    translation.log.taken(kind, note);
    let given = Given {
        name,
        node: table,
        quantity: Quantity::Temperature(reference),
        steps: Vec::new(),
    };
    conditions.add(translation, sets, &given)
}

/// Write contact, and the bonds between blocks.
fn contact(
    translation: &mut Translation,
    root: &Node,
    discretization: &Node,
    blocks: &[(String, String)],
) -> Result<()> {
    let omits = discretization.get("Omit Bonds Between Blocks");
    let omits_all = omits
        .and_then(Node::text)
        .is_some_and(|text| is_key(text, "All"));
    if let Some(node) = omits {
        match omits_all {
            true => translation.log.taken(node, "[interface] rule = \"none\""),
            false => translation.log.left_out(
                node,
                "bonds are omitted between all blocks, or pairs of bodies",
            ),
        }
    }
    let node = root.get("Contact");
    if blocks.len() > 1 && (omits_all || node.is_some()) {
        let rule = if omits_all { "none" } else { "own" };
        let interface = translation.draft.section("interface");
        interface.set("rule", Value::text(rule));
    }
    let Some(node) = node else {
        return Ok(());
    };
    for key in ["Search Radius", "Search Frequency"] {
        if let Some(node) = node.get(key) {
            translation
                .log
                .left_out(node, "contact is searched where points need it");
        }
    }
    let models = translation.required(node, "Models", "Contact")?;
    let interactions = translation.required(node, "Interactions", "Contact")?;
    let general = interactions.get("General Contact");
    let self_contact = interactions.get("Self Contact");
    let mut section = Section::new("contact");
    match general {
        Some(general) => model(translation, models, general, &mut section)?,
        None => {
            section.set("model", Value::text("none"));
        }
    }
    translation.add(section);
    // Bodies with a rule for contact with themselves.
    let mut with_rule = Vec::new();
    for (name, interaction) in interactions.tables() {
        if is_key(name, "General Contact") || is_key(name, "Self Contact") {
            continue;
        }
        let mut bodies = Vec::new();
        for key in ["First Block", "Second Block"] {
            let node =
                translation.required(interaction, key, &format!("the interaction `{name}`"))?;
            let block = translation.text(node, key)?;
            let Some((_, body)) = blocks.iter().find(|(read, _)| is_key(read, block)) else {
                let message = format!("the block {} is not defined", excerpt(block));
                return Err(translation.error(node.line, message));
            };
            translation.log.taken(node, format!("body `{body}`"));
            bodies.push(Value::text(body.clone()));
        }
        let written = translation.new_name("contact", name);
        let mut section = Section::new(format!("contact.pair.{written}"));
        if bodies[0] == bodies[1] {
            with_rule.push(bodies[0].clone());
        }
        section.set("bodies", Value::List(bodies));
        model(translation, models, interaction, &mut section)?;
        translation.add(section);
    }
    // General contact acts between different blocks only.
    if general.is_none() && self_contact.is_none() {
        return Ok(());
    }
    for (_, body) in blocks {
        let name = Value::text(body.clone());
        if with_rule.contains(&name) {
            continue;
        }
        let written = translation.new_name("contact", &format!("self {body}"));
        let mut section = Section::new(format!("contact.pair.{written}"));
        section.set("bodies", Value::list([name.clone(), name]));
        match self_contact {
            Some(node) => model(translation, models, node, &mut section)?,
            None => {
                section.set("model", Value::text("none"));
            }
        }
        translation.add(section);
    }
    Ok(())
}

/// Write the contact model of an interaction.
fn model(
    translation: &Translation,
    models: &Node,
    interaction: &Node,
    section: &mut Section,
) -> Result<()> {
    let name = translation.required(interaction, "Contact Model", "the interaction")?;
    let text = translation.text(name, "Contact Model")?;
    let Some(model) = models.get(text) else {
        let message = format!("the contact model {} is not defined", excerpt(text));
        return Err(translation.error(name.line, message));
    };
    translation.log.taken(name, "model of the contact");
    let kind = translation.required(model, "Contact Model", "the contact model")?;
    let kind_name = translation.text(kind, "Contact Model")?;
    match is_key(kind_name, "Short Range Force") {
        true => translation.log.taken(kind, "model = \"short-range\""),
        false => translation
            .log
            .approximated(kind, "model = \"short-range\", constant in time"),
    }
    section.set("model", Value::text("short-range"));
    for (name, key) in [
        ("Contact Radius", "radius"),
        ("Spring Constant", "stiffness"),
        ("Friction Coefficient", "friction"),
    ] {
        let Some(node) = model.get(name) else {
            continue;
        };
        if key == "friction" && node.text().is_some_and(|text| text.parse::<f64>().is_err()) {
            translation.log.left_out(node, "friction is a number");
            continue;
        }
        section.set(key, translation.number_value(node, name)?);
        let note = match key {
            "radius" => "radius, at most 0.9 of the distance at the start",
            key => key,
        };
        match key {
            "radius" => translation.log.approximated(node, note),
            _ => translation.log.taken(node, note),
        }
    }
    Ok(())
}
