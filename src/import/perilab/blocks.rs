//! Blocks of PeriLab, which become bodies.

use super::angles::angles;
use super::materials::{Laws, write_material};
use super::points::{MeshBlocks, Points};
use crate::error::{Result, excerpt};
use crate::import::bodies::{self, Body, Material};
use crate::import::draft::Value;
use crate::import::translation::Translation;
use crate::import::tree::{Node, is_key};

/// A block of the source deck that became a body.
pub(super) struct Block {
    /// Name in the source deck.
    pub(super) name: String,
    /// `Block ID`.
    pub(super) id: u64,
    /// Name of the body in the new deck.
    pub(super) body: String,
    /// Horizon, m.
    pub(super) horizon: f64,
}

/// Return the value of the key `points.block` for the body of a block. Return `None` if this body has all
/// elements of the mesh. `id` is the number of the block. `is_only` says whether the deck has no other block.
fn block_of_points(
    translation: &Translation,
    points: &Points,
    id_node: &Node,
    id: u64,
    is_only: bool,
) -> Option<Value> {
    let number = Value::Number(id.to_string());
    let Points::Mesh(_, blocks) = points else {
        translation.log.taken(id_node, "block of the points");
        return Some(number);
    };
    if is_only && id == 1 && !matches!(blocks, MeshBlocks::Numbers) {
        match blocks {
            MeshBlocks::Sets(Some(sets)) if sets.len() < 2 => {
                let note = "the only block has all elements of the mesh";
                translation.log.taken(id_node, note);
            }
            _ => {
                let note = "the only block of the deck has all elements of the mesh, also those of other groups";
                translation.log.approximated(id_node, note);
            }
        }
        return None;
    }
    let MeshBlocks::Sets(sets) = blocks else {
        translation.log.taken(id_node, "block of the points");
        return Some(number);
    };
    let Some(sets) = sets else {
        let note = "the mesh cannot be read yet; name the element sets";
        translation.log.approximated(id_node, note);
        return Some(number);
    };
    let Some(set) = sets.get((id as usize).wrapping_sub(1)) else {
        let note = format!(
            "the number of element sets of the mesh that are blocks is {}; name the element set",
            sets.len()
        );
        translation.log.approximated(id_node, note);
        return Some(number);
    };
    let note = format!(
        "block of the points: the element set {}; PeriLab numbers the sets in no fixed order",
        excerpt(set)
    );
    translation.log.approximated(id_node, note);
    Some(Value::text(set))
}

/// Read the blocks, and write the materials and bodies of the new deck.
pub(super) fn read_blocks(
    translation: &mut Translation,
    node: &Node,
    points: &Points,
    laws: &Laws,
    damping: Option<f64>,
) -> Result<Vec<Block>> {
    let (mut bodies, mut blocks) = (Vec::new(), Vec::new());
    let mut written: Vec<(String, String, String)> = Vec::new();
    for (name, table) in node.tables() {
        let what = format!("the block `{name}`");
        let id_node = translation.required(table, "Block ID", &what)?;
        let id = translation.count(id_node, "Block ID")?;
        let block = block_of_points(translation, points, id_node, id, node.tables().count() == 1);
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
        let angles = angles(translation, table, model, laws.has_matrix)?;
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
        // In the new deck, density, angles and expansion belong to the material, so each combination is a
        // separate material.
        let variant = format!("{density:?} {angles:?} {expansion:?}");
        let known = written
            .iter()
            .find(|(read, of, _)| read == model.name && *of == variant);
        let material_written = match known {
            Some((.., written)) => written.clone(),
            None => {
                let is_first = !written.iter().any(|(read, ..)| read == model.name);
                let read = if is_first {
                    model.name.to_owned()
                } else {
                    format!("{} {name}", model.name)
                };
                let new = translation.name("material", &read);
                write_material(
                    translation,
                    model,
                    &new,
                    density,
                    damping,
                    angles,
                    expansion,
                )?;
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
                    damage = bodies::damage(translation, model, &material, horizon);
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
            Points::Mesh(file, _) => ("mesh", file),
        };
        let mut source = vec![(points.0.to_owned(), points.1.clone())];
        source.extend(block.map(|block| ("block".to_owned(), block)));
        blocks.push(Block {
            name: name.to_owned(),
            id,
            body: body.clone(),
            horizon,
        });
        bodies.push(Body {
            name: body,
            material: material_written,
            damage,
            horizon: horizon_value,
            points: ("points".to_owned(), Value::Table(source)),
        });
    }
    if bodies.is_empty() {
        let message = match points {
            Points::File(_, Some(file)) => file.no_block_message(),
            _ => "there is no block".to_owned(),
        };
        return Err(translation.error(node.line, message));
    }
    bodies::write(translation, &bodies);
    Ok(blocks)
}
