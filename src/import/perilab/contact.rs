//! Contact of PeriLab.

use std::f64::consts::PI;

use super::blocks::Block;
use super::points::Points;
use crate::dimension::{Constraint, Dimension};
use crate::error::Result;
use crate::import::draft::{Section, Value};
use crate::import::log::SHORT_CONTACT;
use crate::import::translation::Translation;
use crate::import::tree::Node;
use crate::points::bins::Bins;
use crate::solver::contact::short_range_spring;

/// PeriLab's `Contact Stiffness` if the deck gives none.
const DEFAULT_STIFFNESS: f64 = 1e8;

/// Write contact. `setting` is the `dimension` of the new deck.
pub(super) fn contact(
    translation: &mut Translation,
    root: &Node,
    blocks: &[Block],
    points: &Points,
    setting: &str,
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
            let pair = [
                block(translation, group, group_name, "Master Block ID", blocks)?,
                block(translation, group, group_name, "Slave Block ID", blocks)?,
            ];
            let written = translation.new_name("contact", &format!("{name} {group_name}"));
            let mut section = Section::new(format!("contact.pair.{written}"));
            let bodies = pair.map(|block| Value::text(block.body.clone()));
            section
                .set("bodies", Value::list(bodies))
                .set("model", Value::text("short-range"));
            radius(translation, model, pair, points, &mut section)?;
            stiffness(translation, model, pair, setting, &mut section)?;
            let key = "Friction Coefficient";
            if let Some(node) = model.get(key) {
                section.set("friction", translation.number_value(node, key)?);
                translation.log.approximated(node, "friction");
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

/// Return the block to which a key of a contact group refers.
fn block<'b>(
    translation: &Translation,
    group: &Node,
    group_name: &str,
    key: &str,
    blocks: &'b [Block],
) -> Result<&'b Block> {
    let node = translation.required(group, key, &format!("the group `{group_name}`"))?;
    let id = translation.count(node, key)?;
    let Some(block) = blocks.iter().find(|block| block.id == id) else {
        return Err(translation.error(node.line, format!("there is no block {id}")));
    };
    let note = format!("body `{}`", block.body);
    translation.log.taken(node, note);
    Ok(block)
}

/// Write the contact radius. Add a log note if two points of the blocks may start so close to each other that
/// Fissure shortens their contact distance.
fn radius(
    translation: &Translation,
    model: &Node,
    pair: [&Block; 2],
    points: &Points,
    section: &mut Section,
) -> Result<()> {
    let key = "Contact Radius";
    let Some(node) = model.get(key) else {
        return Ok(());
    };
    section.set("radius", translation.number_value(node, key)?);
    let note = "radius, at most 0.9 of the distance at the start";
    translation.log.approximated(node, note);
    let radius = translation.number(node, key)?;
    if may_start_within(points, pair, radius / 0.9) {
        translation.log.approximated(node, SHORT_CONTACT);
    }
    Ok(())
}

/// Test whether a point of one block may start within a distance (m) of a point of the other block. Return
/// true if the import cannot read the points.
fn may_start_within(points: &Points, pair: [&Block; 2], distance: f64) -> bool {
    let Points::File(_, Some(file)) = points else {
        return true;
    };
    let Some([first, second]) = file.positions(pair.map(|block| block.id)) else {
        return true;
    };
    if first.is_empty() || distance <= 0.0 {
        return false;
    }
    let bins = Bins::new(&first, distance);
    second.iter().any(|position| {
        let mut is_close = false;
        bins.within(*position, |_, _| is_close = true);
        is_close
    })
}

/// Write the contact stiffness, converted such that the spring constant of two points is that of PeriLab.
///
/// The spring constant of both codes is proportional to the product of the volumes. PeriLab applies one force
/// per pair; its formula contains the horizon of the slave block.
fn stiffness(
    translation: &Translation,
    model: &Node,
    [master, slave]: [&Block; 2],
    setting: &str,
    section: &mut Section,
) -> Result<()> {
    let mut given = DEFAULT_STIFFNESS;
    let key = "Contact Stiffness";
    match model.get(key) {
        Some(node) => {
            given = translation.number(node, key)?;
            let note = "stiffness, converted such that the spring constant is that of PeriLab";
            translation.log.taken(node, note);
        }
        None => {
            section.comment("stiffness: from PeriLab's default `Contact Stiffness`, 1e8");
        }
    }
    let symmetry = model.get("Symmetry");
    if let Some(node) = symmetry {
        let note = "formula of PeriLab's spring constant, which `stiffness` contains";
        translation.log.taken(node, note);
    }
    let symmetry = symmetry.and_then(Node::text).unwrap_or("3D");
    let spring = given * perilab_spring(symmetry, slave.horizon);
    let horizon = master.horizon.min(slave.horizon);
    let unit_spring = short_range_spring(dimension(setting), 1.0, horizon);
    section.set("stiffness", Value::number(spring / unit_spring));
    Ok(())
}

/// Return PeriLab's spring constant for `Contact Stiffness: 1` and two points with the volume 1.
fn perilab_spring(symmetry: &str, horizon: f64) -> f64 {
    match symmetry {
        "plane stress" => 9.0 / (PI * horizon.powi(3)),
        "plane strain" => 48.0 / (5.0 * PI * horizon.powi(3)),
        _ => 9.0 / (PI * horizon.powi(5)),
    }
}

/// Return the dimension of the new deck. In a plane problem, its thickness is 1.
fn dimension(setting: &str) -> Dimension {
    match setting {
        "plane-stress" => Dimension::PlaneStress { thickness: 1.0 },
        "plane-strain" => Dimension::PlaneStrain { thickness: 1.0 },
        "1d" => Dimension::Line {
            cross_section: 1.0,
            constraint: Constraint::UniaxialStress,
        },
        _ => Dimension::Space,
    }
}
