//! Blocks of Peridigm, which become bodies.

use super::points::{Points, block_number, source};
use crate::error::{Result, excerpt};
use crate::import::bodies::{self, Body, DamageModel, Material};
use crate::import::translation::Translation;
use crate::import::tree::{Node, is_key};

/// Write the bodies. Return the name of each block with the name of its body.
pub(super) fn read_blocks(
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
                    damage = bodies::damage(translation, model, material, horizon);
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
        let message = match points {
            Points::File(_, Some(file)) => file.no_block_message(),
            _ => "there is no block".to_owned(),
        };
        return Err(translation.error(node.line, message));
    }
    bodies::write(translation, &bodies);
    Ok(pairs)
}
