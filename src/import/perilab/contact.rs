//! Contact of PeriLab.

use crate::error::Result;
use crate::import::draft::{Section, Value};
use crate::import::translation::Translation;
use crate::import::tree::Node;

/// Write contact.
pub(super) fn contact(
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
