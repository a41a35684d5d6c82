//! Decks of Peridigm, in YAML or XML.

mod blocks;
mod conditions;
mod contact;
mod materials;
mod points;

use crate::error::Result;
use crate::import::bodies::note_unused_damages;
use crate::import::draft::Value;
use crate::import::log::Fate;
use crate::import::outputs::Outputs;
use crate::import::sets::Sets;
use crate::import::solver;
use crate::import::translation::Translation;
use crate::import::tree::Node;
use blocks::read_blocks;
use conditions::conditions;
use contact::contact;
use materials::{damages, note_influence, read_materials};
use points::{Points, influence, points};

/// Translate a deck.
///
/// # Errors
/// If data that a run needs is missing or wrong.
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
    let function = influence.as_ref().and_then(|influence| influence.written);
    let (read, expanding) = read_materials(translation, materials, function)?;
    let damages = damages(translation, root)?;
    if let Some(influence) = &influence {
        note_influence(translation, influence, &read);
    }
    let names = read_blocks(translation, blocks, &points, &read, &damages)?;
    if let Some(models) = root.get("Damage Models") {
        note_unused_damages(translation, models, blocks);
    }
    if let Some(restart) = root.get("Restart") {
        let note = "checkpoints are written by default; `fissure run --restart` continues a run";
        translation
            .log
            .note_whole_table(restart, Fate::Approximated, note);
    }
    let mut sets = Sets::new(matches!(points, Points::Mesh(_)).then_some(""));
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
    outputs.finish(translation, solver::duration(&stages));
    sets.finish(translation);
    Ok(())
}

/// Return the `dimension` of the new deck: `"3d"`, or plane stress or plane strain if a material requires one
/// of these. For a plane problem, also write the thickness.
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

/// Read the stages of all solvers. All stages of the first solver have the step number 1, all stages of the
/// second solver have the step number 2, and so on.
fn stages(translation: &Translation, root: &Node, solvers: &[&Node]) -> Result<Vec<solver::Stage>> {
    if solvers.is_empty() {
        return Err(translation.error(root.line, "the deck has no `Solver`"));
    }
    let mut stages: Vec<solver::Stage> = Vec::new();
    for (step, node) in (1..).zip(solvers) {
        for stage in solver::stage(translation, node, &stages, true)? {
            stages.push(solver::Stage {
                step_id: Some(step),
                ..stage
            });
        }
    }
    Ok(stages)
}
