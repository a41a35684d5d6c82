//! Decks of PeriLab, in YAML.

mod angles;
mod blocks;
mod conditions;
mod contact;
mod materials;
mod points;

use crate::error::Result;
use crate::import::bodies::note_unused_damages;
use crate::import::bond_filters::bond_filters;
use crate::import::draft::Value;
use crate::import::log::{OTHER_INFLUENCE, UNCORRECTED_SURFACE, UNSCALED_FAMILIES};
use crate::import::outputs::Outputs;
use crate::import::sets::Sets;
use crate::import::solver;
use crate::import::translation::Translation;
use crate::import::tree::{Node, is_key};
use blocks::read_blocks;
use conditions::conditions;
use contact::contact;
use materials::{Laws, damages, expansions, read_materials};
use points::{MeshBlocks, Points, points, sets_with_all_nodes, setting};

/// Translate a deck.
///
/// # Errors
/// If data that a run needs is missing or wrong.
pub fn translate(translation: &mut Translation, root: &Node) -> Result<()> {
    let root = root.get("PeriLab").unwrap_or(root);
    let discretization = translation.required(root, "Discretization", "the deck")?;
    let models = translation.required(root, "Models", "the deck")?;
    let materials = translation.required(models, "Material Models", "`Models`")?;
    let blocks = translation.required(root, "Blocks", "the deck")?;
    let stages = stages(translation, root)?;
    let points = points(translation, discretization, root.get("Boundary Conditions"))?;
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
    note_influence(translation, discretization, materials)?;
    note_scaling(translation, discretization)?;
    let read = read_materials(translation, materials)?;
    let is_damage_enabled = stages.iter().any(|stage| stage.is_damage_enabled);
    let damages = damages(translation, models, is_damage_enabled)?;
    let is_thermal_enabled = solvers(translation, root)?.iter().any(|solver| {
        let node = solver.get("Thermal Models");
        node.is_some_and(|node| {
            translation.log.taken(node, "whether materials expand");
            translation.is_true(node)
        })
    });
    let expansions = expansions(translation, models, is_thermal_enabled)?;
    let has_matrix = solvers(translation, root)?.iter().any(|solver| {
        let mut tables = solver.tables();
        tables.any(|(name, _)| {
            is_key(name, "Newmark") || name.to_lowercase().contains("matrix based")
        })
    });
    let damping = stages.iter().find_map(|stage| stage.damping);
    let laws = Laws {
        models: read,
        damages,
        expansions,
        has_matrix,
    };
    let bodies = read_blocks(translation, blocks, &points, &laws, damping)?;
    if let (Some(models), true) = (models.get("Damage Models"), is_damage_enabled) {
        note_unused_damages(translation, models, blocks);
    }
    let has_expansion = blocks.tables().any(|(_, block)| {
        let model = block.get("Thermal Model").and_then(Node::text);
        model.is_some_and(|model| {
            laws.expansions
                .iter()
                .any(|known| is_key(&known.name, model))
        })
    });
    let mut sets = match &points {
        Points::Mesh(_, groups) => {
            let mut sets = Sets::new(Some(groups.prefix_of_sets()));
            if matches!(groups, MeshBlocks::Numbers) {
                sets.set_ids_by_name(sets_with_all_nodes(translation, discretization, blocks)?);
            }
            sets
        }
        Points::File(_, file) => {
            let mut sets = Sets::new(None);
            if let Some(file) = file {
                sets.set_last_number(file.rows);
            }
            sets
        }
    };
    if let Some(node_sets) = discretization.get("Node Sets") {
        for (name, node) in node_sets.entries() {
            sets.define(name, node, true);
        }
    }
    let has_temperature = conditions(translation, root, &mut sets, &stages, has_expansion)?;
    contact(translation, root, &bodies, &points, setting)?;
    let names: Vec<(String, String)> = bodies
        .iter()
        .map(|block| (block.name.clone(), block.body.clone()))
        .collect();
    let mut outputs = Outputs::new(has_temperature);
    if let Some(computed) = root.get("Compute Class Parameters") {
        outputs.computed(translation, &mut sets, &names, computed)?;
    }
    for (_, output) in root.get("Outputs").into_iter().flat_map(Node::tables) {
        outputs.output(translation, output)?;
    }
    outputs.finish(translation, solver::duration(&stages));
    sets.finish(translation);
    for (name, note) in [
        ("FEM", "has no counterpart"),
        ("Surface Correction", UNCORRECTED_SURFACE),
    ] {
        if let Some(node) = root.get(name).or(discretization.get(name)) {
            translation.log.left_out(node, note);
        }
    }
    Ok(())
}

/// Log the outcome of the key `Influence Function`. Its value in PeriLab is an expression.
fn note_influence(
    translation: &Translation,
    discretization: &Node,
    materials: &Node,
) -> Result<()> {
    let Some(node) = discretization.get("Influence Function") else {
        return Ok(());
    };
    let text = translation.text(node, "Influence Function")?;
    let of_bonds = |(_, material): (&str, &Node)| {
        let model = material.get("Material Model").and_then(Node::text);
        model.is_some_and(|model| model.to_lowercase().contains("bond-based"))
    };
    if text.parse() == Ok(1.0) {
        let note = "influence = \"constant\", the default";
        translation.log.taken(node, note);
    } else if materials.tables().all(of_bonds) {
        let note = "bond-based materials have no influence function";
        translation.log.left_out(node, note);
    } else {
        translation.log.left_out(node, OTHER_INFLUENCE);
    }
    Ok(())
}

/// Log the outcome of the keys that scale the coordinates in PeriLab's neighbour search.
fn note_scaling(translation: &Translation, discretization: &Node) -> Result<()> {
    for axis in ["X", "Y", "Z"] {
        let key = format!("Horizon Mesh Scaling {axis}");
        let Some(node) = discretization.get(&key) else {
            continue;
        };
        if translation.number(node, &key)? == 1.0 {
            translation.log.taken(node, "families are not scaled");
        } else {
            translation.log.left_out(node, UNSCALED_FAMILIES);
        }
    }
    Ok(())
}

/// Return the solver. In a deck with several steps, return the solvers of all steps, sorted by `Step ID` as
/// in PeriLab.
///
/// # Errors
/// If the `Step ID` of a step is missing or is not a whole number.
fn solvers<'n>(translation: &Translation, root: &'n Node) -> Result<Vec<&'n Node>> {
    let Some(steps) = root.get("Multistep Solver") else {
        return Ok(root.get("Solver").into_iter().collect());
    };
    let mut solvers = Vec::new();
    for (name, node) in steps.tables() {
        let id = translation.required(node, "Step ID", &format!("the step `{name}`"))?;
        solvers.push((translation.count(id, "Step ID")?, node));
    }
    solvers.sort_by_key(|(id, _)| *id);
    Ok(solvers.into_iter().map(|(_, node)| node).collect())
}

/// Read the stages of all solvers.
fn stages(translation: &Translation, root: &Node) -> Result<Vec<solver::Stage>> {
    let solvers = solvers(translation, root)?;
    if solvers.is_empty() {
        return Err(translation.error(root.line, "the deck has no `Solver`"));
    }
    let mut stages: Vec<solver::Stage> = Vec::new();
    for node in &solvers {
        for key in ["Material Models", "Pre Calculation Models"] {
            if let Some(models) = node.get(key) {
                if translation.is_true(models) {
                    translation.log.taken(models, "materials always act")
                } else {
                    translation.log.left_out(models, "materials always act")
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
        stages.extend(solver::stage(translation, node, &stages, false)?);
    }
    if stages.is_empty() {
        let message = "PeriLab runs no step: the first step must contain the time 0, and each other step the \
                       end of the step before";
        return Err(translation.error(root.line, message));
    }
    let damping_differs = stages
        .iter()
        .any(|stage| stage.damping != stages[0].damping);
    let damage_differs = stages
        .iter()
        .any(|stage| stage.is_damage_enabled != stages[0].is_damage_enabled);
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
