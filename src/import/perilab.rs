//! Decks of PeriLab, in YAML.

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
use crate::mesh::Format;

/// Material models: a part of their names, the law, and how the law differs. The first that fits counts.
const MATERIALS: [(&str, &str, &str); 9] = [
    (
        "unified bond-based",
        "ordinary",
        "state-based in place of bonds with two constants",
    ),
    ("1d bond-based", "pmb", ""),
    ("bond-based elastic", "pmb", ""),
    ("pd solid plastic", "ordinary_plastic", ""),
    ("pd solid elastic", "ordinary", ""),
    ("correspondence plastic", "correspondence", ""),
    ("correspondence elastic", "correspondence", ""),
    ("correspondence umat", "", ""),
    ("correspondence vumat", "", ""),
];

/// Constants of an orthotropic solid.
const ORTHOTROPIC: [(&str, &str, bool); 9] = [
    ("Young's Modulus X", "youngs_modulus_x", true),
    ("Young's Modulus Y", "youngs_modulus_y", true),
    ("Young's Modulus Z", "youngs_modulus_z", true),
    ("Poisson's Ratio XY", "poisson_ratio_xy", true),
    ("Poisson's Ratio YZ", "poisson_ratio_yz", true),
    ("Poisson's Ratio XZ", "poisson_ratio_xz", true),
    ("Shear Modulus XY", "shear_modulus_xy", true),
    ("Shear Modulus YZ", "shear_modulus_yz", false),
    ("Shear Modulus XZ", "shear_modulus_xz", false),
];

/// Where the points of the blocks come from.
enum Points {
    File(Value, Option<PointFile>),
    Mesh(Value),
}

/// How a material expands.
#[derive(Debug, Clone, PartialEq)]
struct Expansion {
    /// Name of the thermal model.
    name: String,
    coefficient: Value,
    reference: Option<Value>,
}

/// A material as the deck has it; the density is that of a block.
struct Model<'n> {
    name: &'n str,
    node: &'n Node,
    law: &'static str,
    constants: Constants,
}

/// What the blocks of a deck refer to.
struct Laws<'n> {
    models: Vec<Model<'n>>,
    damages: Vec<DamageModel>,
    expansions: Vec<Expansion>,
}

/// Translate a deck.
///
/// # Errors
/// If what a run needs is missing or wrong.
pub fn translate(translation: &mut Translation, root: &Node) -> Result<()> {
    let root = root.get("PeriLab").unwrap_or(root);
    let discretization = translation.required(root, "Discretization", "the deck")?;
    let models = translation.required(root, "Models", "the deck")?;
    let materials = translation.required(models, "Material Models", "`Models`")?;
    let blocks = translation.required(root, "Blocks", "the deck")?;
    let stages = stages(translation, root)?;
    let points = points(translation, discretization)?;
    let setting = setting(translation, discretization, materials, &points);
    translation.draft.top("dimension", Value::text(setting));
    if translation.dimension == 2 {
        translation
            .draft
            .top("thickness", Value::Number("1".to_owned()));
    }
    if let Some(filters) = discretization.get("Bond Filters") {
        bond_filters(translation, filters)?;
    }
    let read = read_materials(translation, materials)?;
    let breaks = stages.iter().any(|stage| stage.breaks);
    let damages = damages(translation, models, breaks)?;
    let expands = solvers(root).iter().any(|solver| {
        let node = solver.get("Thermal Models");
        node.is_some_and(|node| {
            translation.log.taken(node, "whether materials expand");
            translation.is_true(node)
        })
    });
    let expansions = expansions(translation, models, expands)?;
    let damping = stages.iter().find_map(|stage| stage.damping);
    let laws = Laws {
        models: read,
        damages,
        expansions,
    };
    let bodies = read_blocks(translation, blocks, &points, &laws, damping)?;
    let expands = blocks.tables().any(|(_, block)| {
        let model = block.get("Thermal Model").and_then(Node::text);
        model.is_some_and(|model| {
            laws.expansions
                .iter()
                .any(|known| is_key(&known.name, model))
        })
    });
    let mut sets = Sets::new(matches!(points, Points::Mesh(_)));
    if let Some(node_sets) = discretization.get("Node Sets") {
        for (name, node) in node_sets.entries() {
            sets.define(name, node);
        }
    }
    let has_temperature = conditions(translation, root, &mut sets, &stages, expands)?;
    contact(translation, root, &bodies)?;
    let names: Vec<(String, String)> = bodies
        .iter()
        .map(|body| (body.0.clone(), body.2.clone()))
        .collect();
    let mut outputs = Outputs::new(has_temperature);
    if let Some(computed) = root.get("Compute Class Parameters") {
        outputs.computed(translation, &mut sets, &names, computed)?;
    }
    for (_, output) in root.get("Outputs").into_iter().flat_map(Node::tables) {
        outputs.output(translation, output)?;
    }
    let length = stages.last().map_or(0.0, |stage| stage.end) - translation.start;
    outputs.finish(translation, length);
    sets.finish(translation);
    for name in ["FEM", "Surface Correction"] {
        if let Some(node) = root.get(name).or(discretization.get(name)) {
            translation.log.left_out(node, "has no counterpart");
        }
    }
    Ok(())
}

/// The solver, or its steps.
fn solvers(root: &Node) -> Vec<&Node> {
    match root.get("Multistep Solver") {
        Some(steps) => steps.tables().map(|(_, node)| node).collect(),
        None => root.get("Solver").into_iter().collect(),
    }
}

/// The stages of the solver or of its steps.
fn stages(translation: &mut Translation, root: &Node) -> Result<Vec<solver::Stage>> {
    let solvers = solvers(root);
    let Some(first) = solvers.first() else {
        return Err(translation.error(root.line, "the deck has no `Solver`"));
    };
    if let Some(initial) = first.get("Initial Time") {
        let start = translation.number(initial, "Initial Time")?;
        match start == 0.0 {
            true => translation.log.taken(initial, "a run starts at 0"),
            false => translation
                .log
                .approximated(initial, "a run starts at 0; times are shifted"),
        }
        translation.start = start;
    }
    let mut stages: Vec<solver::Stage> = Vec::new();
    for node in &solvers {
        let at = stages.last().map_or(translation.start, |stage| stage.end);
        for key in ["Material Models", "Pre Calculation Models"] {
            if let Some(models) = node.get(key) {
                match translation.is_true(models) {
                    true => translation.log.taken(models, "materials always act"),
                    false => translation.log.left_out(models, "materials always act"),
                }
            }
        }
        for key in [
            "Calculate Cauchy",
            "Calculate von Mises stress",
            "Calculate Strain",
        ] {
            if let Some(field) = node.get(key) {
                translation
                    .log
                    .taken(field, "fields are computed where the output has them");
            }
        }
        stages.extend(solver::stage(translation, node, at, false)?);
    }
    let damping_differs = stages
        .iter()
        .any(|stage| stage.damping != stages[0].damping);
    let damage_differs = stages.iter().any(|stage| stage.breaks != stages[0].breaks);
    for node in solvers {
        for (_, solver) in node.tables() {
            if let (Some(damping), true) = (solver.get("Numerical Damping"), damping_differs) {
                let note = "the first damping acts in all stages";
                translation.log.approximated(damping, note);
            }
        }
        if let (Some(damage), true) = (node.get("Damage Models"), damage_differs) {
            let note = "damage acts in all stages";
            translation.log.approximated(damage, note);
        }
    }
    Ok(stages)
}

/// Where the points come from.
fn points(translation: &mut Translation, node: &Node) -> Result<Points> {
    let file = translation.required(node, "Input Mesh File", "the discretization")?;
    let path = translation.text(file, "Input Mesh File")?.to_owned();
    let name = match node.get("Type") {
        None => "Text File",
        Some(kind) => {
            translation.log.taken(kind, "points of the bodies");
            translation.text(kind, "Type")?
        }
    };
    let grid = translation.draft.section("grid");
    grid.set("volume_correction", Value::text("none"));
    let value = translation.file(&path);
    if is_key(name, "Text File") {
        let known = PointFile::read(&translation.path(&path), &[]);
        let note = match known {
            Some(_) => "points.file of the bodies, with the columns of its header",
            None => "points.file of the bodies; it cannot be read yet",
        };
        translation.log.taken(file, note);
        return Ok(Points::File(value, known));
    }
    if ["Exodus", "Abaqus", "Gmsh"]
        .iter()
        .any(|known| is_key(name, known))
    {
        match Format::of(path.as_ref()) {
            Some(_) => translation.log.taken(file, "points.mesh of the bodies"),
            None => {
                let note = format!(
                    "points.mesh of the bodies; its name must end with one of {}",
                    Format::endings()
                );
                translation.log.approximated(file, note);
            }
        }
        return Ok(Points::Mesh(value));
    }
    let message = format!(
        "the discretization {} is not read; known are Text File, Exodus, Abaqus and Gmsh",
        excerpt(name)
    );
    Err(translation.error(node.line, message))
}

/// The `dimension` of the new deck: by the header of the point file, else by the symmetry of the materials.
fn setting(
    translation: &mut Translation,
    discretization: &Node,
    materials: &Node,
    points: &Points,
) -> &'static str {
    let dimension = match points {
        Points::File(_, Some(file)) => file.dimension(),
        _ => None,
    };
    let mut plane = None;
    for (_, material) in materials.tables() {
        let Some(symmetry) = material.get("Symmetry") else {
            continue;
        };
        let text = symmetry.text().unwrap_or("").to_lowercase();
        let of_text = ["plane stress", "plane strain"]
            .iter()
            .position(|name| text.contains(name));
        plane = plane.or(of_text);
        let known = ["isotropic", "orthotropic", "3d"]
            .iter()
            .any(|name| text.contains(name));
        if !known && of_text.is_none() {
            translation
                .log
                .left_out(symmetry, "unknown, or without a counterpart");
        }
    }
    let filters = discretization.get("Bond Filters");
    let has_z = filters.is_some_and(|filters| {
        filters
            .tables()
            .any(|(_, filter)| filter.get("Side Length").is_some())
    });
    let setting = match (dimension, plane) {
        (Some(3), _) => "3d",
        (Some(1), _) => "1d",
        (Some(_), Some(1)) => "plane-strain",
        (Some(_), _) => "plane-stress",
        (None, Some(0)) => "plane-stress",
        (None, Some(_)) => "plane-strain",
        (None, None) => "3d",
    };
    translation.dimension = match setting {
        "3d" => 3,
        "1d" => 1,
        _ => 2,
    };
    for (_, material) in materials.tables() {
        let Some(symmetry) = material.get("Symmetry") else {
            continue;
        };
        let text = symmetry.text().unwrap_or("").to_lowercase();
        let agrees = match setting {
            "plane-stress" => text.contains("plane stress"),
            "plane-strain" => text.contains("plane strain"),
            _ => !text.contains("plane"),
        };
        let note = format!("dimension = \"{setting}\"");
        match agrees || (has_z && setting == "3d" && !text.contains("plane")) {
            true => translation.log.taken(symmetry, note),
            false => translation
                .log
                .approximated(symmetry, note + ": the points have that many coordinates"),
        }
    }
    setting
}

/// Read the material models.
fn read_materials<'n>(translation: &mut Translation, node: &'n Node) -> Result<Vec<Model<'n>>> {
    let mut materials = Vec::new();
    for (name, table) in node.tables() {
        let model =
            translation.required(table, "Material Model", &format!("the material `{name}`"))?;
        let text = translation.text(model, "Material Model")?;
        let lower = text.to_lowercase();
        let known = MATERIALS.iter().find(|(part, ..)| lower.contains(part));
        let Some((_, law, difference)) = known.filter(|(_, law, _)| !law.is_empty()) else {
            let note = format!("{} has no counterpart", excerpt(text));
            translation.log.left_out(table, note);
            continue;
        };
        let associated = table.get("Bond Associated");
        let law = match associated {
            Some(node) if *law == "correspondence" && translation.is_true(node) => {
                translation
                    .log
                    .approximated(node, "another bond-associated formulation");
                "bond_associated_correspondence"
            }
            Some(node) => {
                translation
                    .log
                    .taken(node, "the law is not bond-associated");
                law
            }
            None => law,
        };
        match difference.is_empty() {
            true => translation.log.taken(model, format!("the law {law}")),
            false => translation
                .log
                .approximated(model, format!("the law {law}: {difference}")),
        }
        let constants = Constants::read(translation, table)?;
        materials.push(Model {
            name,
            node: table,
            law,
            constants,
        });
    }
    Ok(materials)
}

/// Write a material with the density of a block.
fn write_material(
    translation: &mut Translation,
    model: &Model,
    written: &str,
    density: Value,
    damping: Option<f64>,
    angle: Option<Value>,
    expansion: Option<&Expansion>,
) -> Result<()> {
    let mut section = Section::new(format!("material.{written}.{}", model.law));
    section.set("density", density);
    let table = model.node;
    let is_correspondence = model.law.contains("correspondence");
    let anisotropic = anisotropic(translation, table, is_correspondence, &mut section)?;
    let enough = match model.law {
        "pmb" => {
            if let (Some(node), true) = (table.get("Poisson's Ratio"), model.constants.count() > 1)
            {
                translation
                    .log
                    .approximated(node, "the law has the Poisson's ratio of bonds");
            }
            model.constants.write_one(&mut section, None)
        }
        _ if anisotropic => true,
        _ => {
            model.constants.write_two(&mut section);
            model.constants.count() >= 2
        }
    };
    if !enough {
        let message = format!(
            "the material `{}` has too few elastic constants",
            model.name
        );
        return Err(translation.error(table.line, message));
    }
    if let Some(damping) = damping {
        section.set("damping", Value::number(damping));
    }
    if let (Some(angle), true) = (angle, anisotropic) {
        section.set("angle_1", angle);
    }
    if let Some(expansion) = expansion {
        section.set("thermal_expansion", expansion.coefficient.clone());
        if let Some(reference) = &expansion.reference {
            section.set("reference_temperature", reference.clone());
        }
    }
    let control = table.get("Zero Energy Control");
    if model.law == "correspondence" {
        match control {
            Some(node) => {
                translation.log.taken(node, "zero_energy = \"wan2019\"");
                section.set("zero_energy", Value::text("wan2019"));
            }
            None => {
                section.set("zero_energy", Value::text("none"));
            }
        }
    } else if let Some(node) = control {
        translation
            .log
            .taken(node, "this law has no modes of zero energy");
    }
    let yields = model.law == "ordinary_plastic" || (model.law == "correspondence" && !anisotropic);
    if let (Some(node), true) = (table.get("Yield Stress"), yields) {
        translation.log.taken(node, "yield_stress of the material");
        section.set(
            "yield_stress",
            translation.number_value(node, "Yield Stress")?,
        );
    }
    if model.law == "ordinary_plastic" {
        section.set("calibration", Value::text("continuum"));
    }
    if let Some(node) = table.get("Density") {
        translation
            .log
            .left_out(node, "the density of the block counts");
    }
    translation.add(section);
    Ok(())
}

/// Write the entries of Hooke's matrix or the constants of an orthotropic solid, if the material has them.
fn anisotropic(
    translation: &Translation,
    table: &Node,
    is_correspondence: bool,
    section: &mut Section,
) -> Result<bool> {
    let mut found = false;
    let in_plane = translation.dimension == 2;
    for i in 1..=6 {
        for j in i..=6 {
            let name = format!("C{i}{j}");
            let Some(node) = table.get(&name) else {
                continue;
            };
            let of_plane = [1, 2, 6].contains(&i) && [1, 2, 6].contains(&j);
            if !is_correspondence {
                translation.log.left_out(node, "this law is isotropic");
            } else if in_plane && !of_plane {
                translation.log.left_out(node, "the problem has no z");
            } else {
                let key = name.to_lowercase();
                section.set(key.clone(), translation.number_value(node, &name)?);
                translation
                    .log
                    .taken(node, format!("{key} of the material"));
                found = true;
            }
        }
    }
    for (name, key, of_plane) in ORTHOTROPIC {
        let Some(node) = table.get(name) else {
            continue;
        };
        if !is_correspondence {
            translation.log.left_out(node, "this law is isotropic");
        } else if in_plane && !of_plane {
            translation.log.left_out(node, "the problem has no z");
        } else {
            section.set(key, translation.number_value(node, name)?);
            translation
                .log
                .taken(node, format!("{key} of the material"));
            found = true;
        }
    }
    Ok(found)
}

/// Read the thermal models with expansion; `acts` if the solver switches them on.
fn expansions(translation: &Translation, models: &Node, acts: bool) -> Result<Vec<Expansion>> {
    let mut expansions = Vec::new();
    let Some(node) = models.get("Thermal Models") else {
        return Ok(expansions);
    };
    if !acts {
        let note = "the solver has no `Thermal Models: true`, so nothing expands";
        translation.log.left_out(node, note);
        return Ok(expansions);
    }
    for (name, table) in node.tables() {
        let kind = translation.required(
            table,
            "Thermal Model",
            &format!("the thermal model `{name}`"),
        )?;
        let kind_name = translation.text(kind, "Thermal Model")?.to_lowercase();
        if !kind_name.contains("thermal expansion") {
            translation.log.left_out(table, "heat is not conducted");
            continue;
        }
        match kind_name.trim() {
            "thermal expansion" => translation.log.taken(kind, "thermal_expansion"),
            _ => translation
                .log
                .approximated(kind, "thermal_expansion; heat is not conducted"),
        }
        let key = "Thermal Expansion Coefficient";
        let coefficient = translation.required(table, key, "the thermal model")?;
        let value = translation.number_value(coefficient, key)?;
        translation
            .log
            .taken(coefficient, "thermal_expansion of the material");
        let mut reference = None;
        let key = "Reference Temperature";
        if let Some(node) = table.get(key) {
            reference = Some(translation.number_value(node, key)?);
            translation
                .log
                .taken(node, "reference_temperature of the material");
        }
        expansions.push(Expansion {
            name: name.to_owned(),
            coefficient: value,
            reference,
        });
    }
    Ok(expansions)
}

/// Read the damage models; `breaks` if the solver switches them on.
fn damages(translation: &mut Translation, models: &Node, breaks: bool) -> Result<Vec<DamageModel>> {
    let mut damages = Vec::new();
    let Some(node) = models.get("Damage Models") else {
        return Ok(damages);
    };
    if !breaks {
        let note = "the solver has no `Damage Models: true`, so nothing breaks";
        translation.log.left_out(node, note);
        return Ok(damages);
    }
    for (name, table) in node.tables() {
        let what = format!("the damage model `{name}`");
        let model = translation.required(table, "Damage Model", &what)?;
        let kind = translation.text(model, "Damage Model")?;
        let is_stretch = is_key(kind, "Critical Stretch");
        if !is_stretch && !is_key(kind, "Critical Energy") {
            let note = format!(
                "{} has no counterpart; bodies with it never break",
                excerpt(kind)
            );
            translation.log.left_out(table, note);
            continue;
        }
        let node = translation.required(table, "Critical Value", &what)?;
        let number = translation.number(node, "Critical Value")?;
        let value = translation.number_value(node, "Critical Value")?;
        let tension = table.get("Only Tension");
        let tension_only = tension.is_none_or(|node| translation.is_true(node));
        if let Some(node) = tension {
            match is_stretch && !tension_only {
                true => translation
                    .log
                    .left_out(node, "bonds break in tension only"),
                false => translation.log.taken(node, "tension_only of the damage"),
            }
        }
        if let Some(node) = table.get("Interblock Damage") {
            translation.log.left_out(
                node,
                "bonds between bodies take the weaker toughness of both",
            );
        }
        translation.log.taken(
            model,
            if is_stretch {
                "critical_stretch"
            } else {
                "energy"
            },
        );
        damages.push(DamageModel {
            read: name.to_owned(),
            criterion: match is_stretch {
                true => Criterion::Stretch(value, number),
                false => Criterion::Energy {
                    energy: value,
                    tension_only,
                },
            },
            node: node.clone(),
        });
    }
    Ok(damages)
}

/// Write the materials and bodies; return the name, the number and the body of each block.
fn read_blocks(
    translation: &mut Translation,
    node: &Node,
    points: &Points,
    laws: &Laws,
    damping: Option<f64>,
) -> Result<Vec<(String, u64, String)>> {
    let (mut bodies, mut blocks) = (Vec::new(), Vec::new());
    let mut written: Vec<(String, String, String)> = Vec::new();
    for (name, table) in node.tables() {
        let what = format!("the block `{name}`");
        let id_node = translation.required(table, "Block ID", &what)?;
        let id = translation.count(id_node, "Block ID")?;
        translation.log.taken(id_node, "block of the points");
        if let Points::File(_, Some(file)) = points
            && !file.blocks.iter().any(|block| u64::from(*block) == id)
        {
            translation
                .log
                .left_out(table, "no row of the point file belongs to it");
            continue;
        }
        let material_node = translation.required(table, "Material Model", &what)?;
        let material_name = translation.text(material_node, "Material Model")?;
        let Some(model) = laws
            .models
            .iter()
            .find(|model| is_key(model.name, material_name))
        else {
            let message = format!(
                "the material {} is not defined, or has no counterpart",
                excerpt(material_name)
            );
            return Err(translation.error(material_node.line, message));
        };
        let density_node = translation.required(table, "Density", &what)?;
        let density = translation.number_value(density_node, "Density")?;
        let mut angle = None;
        for key in ["Angle X", "Angle Y", "Angle Z"] {
            let Some(node) = table.get(key) else {
                continue;
            };
            let value = translation.number(node, key)?;
            if value == 0.0 {
                translation.log.taken(node, "the axes are not turned");
            } else if key == "Angle Z" {
                translation
                    .log
                    .approximated(node, "angle_1 of the material, if it is anisotropic");
                angle = Some(translation.number_value(node, key)?);
            } else {
                translation
                    .log
                    .left_out(node, "the order of the rotations is another one");
            }
        }
        let mut expansion = None;
        if let Some(node) = table.get("Thermal Model") {
            let model_name = translation.text(node, "Thermal Model")?;
            expansion = laws
                .expansions
                .iter()
                .find(|known| is_key(&known.name, model_name));
            match expansion {
                Some(_) => translation
                    .log
                    .taken(node, "thermal_expansion of the material"),
                None => translation
                    .log
                    .left_out(node, "this thermal model is left out"),
            }
        }
        // A material has one density, one angle and one expansion here.
        let variant = format!("{density:?} {angle:?} {expansion:?}");
        let known = written
            .iter()
            .find(|(read, of, _)| read == model.name && *of == variant);
        let material_written = match known {
            Some((.., written)) => written.clone(),
            None => {
                let is_first = !written.iter().any(|(read, ..)| read == model.name);
                let read = match is_first {
                    true => model.name.to_owned(),
                    false => format!("{} {name}", model.name),
                };
                let new = translation.name("material", &read);
                write_material(translation, model, &new, density, damping, angle, expansion)?;
                written.push((model.name.to_owned(), variant, new.clone()));
                new
            }
        };
        translation
            .log
            .taken(material_node, format!("material `{material_written}`"));
        translation.log.taken(
            density_node,
            format!("density of the material `{material_written}`"),
        );
        let horizon_node = translation.required(table, "Horizon", &what)?;
        let horizon = translation.number(horizon_node, "Horizon")?;
        let horizon_value = translation.number_value(horizon_node, "Horizon")?;
        translation.log.taken(horizon_node, "horizon");
        let material = Material {
            read: model.name.to_owned(),
            written: material_written.clone(),
            law: model.law,
            constants: model.constants.clone(),
        };
        let mut damage = None;
        if let Some(damage_node) = table.get("Damage Model") {
            let model_name = translation.text(damage_node, "Damage Model")?;
            match laws
                .damages
                .iter()
                .find(|model| is_key(&model.read, model_name))
            {
                Some(model) => {
                    damage = bodies::damage(translation, model, &material, horizon)?;
                    translation.log.taken(damage_node, "damage of the body");
                }
                None => translation
                    .log
                    .left_out(damage_node, "this damage model is left out"),
            }
        }
        for key in [
            "Additive Model",
            "Degradation Model",
            "Pre Calculation Model",
        ] {
            if let Some(node) = table.get(key) {
                translation.log.left_out(node, "has no counterpart");
            }
        }
        let body = translation.new_name("set", name);
        let points = match points {
            Points::File(file, _) => ("file", file),
            Points::Mesh(file) => ("mesh", file),
        };
        let source = vec![
            (points.0.to_owned(), points.1.clone()),
            ("block".to_owned(), Value::Number(id.to_string())),
        ];
        blocks.push((name.to_owned(), id, body.clone()));
        bodies.push(Body {
            name: body,
            material: material_written,
            damage,
            horizon: horizon_value,
            points: ("points".to_owned(), Value::Table(source)),
        });
    }
    if bodies.is_empty() {
        return Err(translation.error(node.line, "there is no block"));
    }
    bodies::write(translation, &bodies);
    Ok(blocks)
}

/// Write the initial values, loads and supports, then the stages; return whether temperatures are among them.
fn conditions(
    translation: &mut Translation,
    root: &Node,
    sets: &mut Sets,
    stages: &[solver::Stage],
    expands: bool,
) -> Result<bool> {
    let mut conditions = Conditions::default();
    for (name, table) in root
        .get("Boundary Conditions")
        .into_iter()
        .flat_map(Node::tables)
    {
        let what = format!("the condition `{name}`");
        let variable = translation.required(table, "Variable", &what)?;
        let text = translation.text(variable, "Variable")?;
        let kind = table.get("Type");
        let kind_name = kind.and_then(Node::text).unwrap_or("Dirichlet");
        let is_initial = is_key(kind_name, "Initial");
        let is = |names: &[&str]| names.iter().any(|name| is_key(text, name));
        let quantity = if is(&["Displacements", "Displacement"]) {
            Some(match is_initial {
                true => Quantity::Initial("displacement"),
                false => Quantity::Support("displacement"),
            })
        } else if is(&["Velocity", "Velocities"]) {
            Some(match is_initial {
                true => Quantity::Initial("velocity"),
                false => Quantity::Support("velocity"),
            })
        } else if is(&["Force Densities", "Force Density"]) {
            Some(Quantity::BodyForce)
        } else if is(&["Forces", "Force"]) {
            Some(Quantity::ForceOfPoint)
        } else if is(&["Temperature"]) && expands && !is_initial {
            Some(Quantity::Temperature(None))
        } else {
            None
        };
        let Some(quantity) = quantity else {
            let note = match is(&["Temperature"]) {
                true if !expands => "no material expands, and heat is not conducted".to_owned(),
                true => "temperatures are prescribed only; heat is not conducted".to_owned(),
                false => format!("{} has no counterpart", excerpt(text)),
            };
            translation.log.left_out(table, note);
            continue;
        };
        translation.log.taken(variable, "the condition's key");
        if let Some(kind) = kind {
            translation.log.taken(kind, "[initial] or [condition]");
        }
        let mut steps = Vec::new();
        if let Some(node) = table.get("Step ID") {
            steps = step_ids(translation, node)?;
            match is_initial && steps.iter().any(|step| stages[0].step_id != Some(*step)) {
                true => translation
                    .log
                    .approximated(node, "initial values are those at the start of the run"),
                false => translation.log.taken(node, "the stages in which it acts"),
            }
        }
        let before = stages
            .iter()
            .position(|stage| stage.step_id.is_some_and(|step| steps.contains(&step)));
        let before = before.and_then(|index| stages.get(index.checked_sub(1)?));
        translation.step_start = before.map_or(0.0, |stage| stage.end - translation.start);
        let given = Given {
            name,
            node: table,
            quantity,
            steps,
        };
        conditions.add(translation, sets, &given)?;
    }
    conditions.finish(translation);
    let has_contact = root.get("Contact").is_some();
    solver::write(translation, stages, &conditions.written, has_contact);
    Ok(conditions.has_temperature)
}

/// The numbers of steps, with commas between them.
fn step_ids(translation: &Translation, node: &Node) -> Result<Vec<u64>> {
    let text = translation.text(node, "Step ID")?;
    let ids = text.split(',').map(|word| word.trim().parse::<u64>().ok());
    let ids: Option<Vec<u64>> = ids.collect();
    ids.ok_or_else(|| {
        let message = format!(
            "`Step ID` must be whole numbers with commas between them, is {}",
            excerpt(text)
        );
        translation.error(node.line, message)
    })
}

/// Write contact.
fn contact(
    translation: &mut Translation,
    root: &Node,
    blocks: &[(String, u64, String)],
) -> Result<()> {
    let Some(node) = root.get("Contact") else {
        return Ok(());
    };
    let interface = translation.draft.section("interface");
    interface.set("rule", Value::text("own"));
    let section = translation.draft.section("contact");
    section.set("model", Value::text("none"));
    for (name, model) in node.tables() {
        let Some(groups) = model.get("Contact Groups") else {
            translation
                .log
                .left_out(model, "contact is searched where points need it");
            continue;
        };
        for (group_name, group) in groups.tables() {
            let mut bodies = Vec::new();
            for key in ["Master Block ID", "Slave Block ID"] {
                let id_node =
                    translation.required(group, key, &format!("the group `{group_name}`"))?;
                let id = translation.count(id_node, key)?;
                let Some((.., body)) = blocks.iter().find(|(_, block, _)| *block == id) else {
                    let message = format!("there is no block {id}");
                    return Err(translation.error(id_node.line, message));
                };
                translation.log.taken(id_node, format!("body `{body}`"));
                bodies.push(Value::text(body.clone()));
            }
            let written = translation.new_name("contact", &format!("{name} {group_name}"));
            let mut section = Section::new(format!("contact.pair.{written}"));
            section
                .set("bodies", Value::List(bodies))
                .set("model", Value::text("short-range"));
            for (name, key) in [
                ("Contact Radius", "radius"),
                ("Contact Stiffness", "stiffness"),
                ("Friction Coefficient", "friction"),
            ] {
                if let Some(node) = model.get(name) {
                    section.set(key, translation.number_value(node, name)?);
                    let note = match key {
                        "radius" => "radius, at most 0.9 of the distance at the start",
                        "stiffness" => "stiffness of a short-range force",
                        _ => "friction",
                    };
                    translation.log.approximated(node, note);
                }
            }
            if let Some(kind) = model.get("Type") {
                translation
                    .log
                    .approximated(kind, "model = \"short-range\"");
            }
            translation.add(section);
        }
    }
    Ok(())
}
