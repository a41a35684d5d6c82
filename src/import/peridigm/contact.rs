//! Contact of Peridigm.

use crate::error::{Result, excerpt};
use crate::import::draft::{Section, Value};
use crate::import::log::OMITTED_BONDS;
use crate::import::translation::Translation;
use crate::import::tree::{Node, is_key};

/// Write the contact sections of the new deck, and the key `[interface] rule` for the bonds between blocks.
pub(super) fn contact(
    translation: &mut Translation,
    root: &Node,
    discretization: &Node,
    blocks: &[(String, String)],
) -> Result<()> {
    let omits_all = omits_all(translation, discretization, blocks.len());
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
    // Bodies that have a rule for self-contact.
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
    // In Peridigm, general contact acts between different blocks only. Each body therefore needs a separate
    // rule for contact with itself.
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

/// Test whether the deck omits all bonds between blocks. Peridigm allows the values `All` and `None` for the
/// key `Omit Bonds Between Blocks`.
fn omits_all(translation: &Translation, discretization: &Node, blocks: usize) -> bool {
    let Some(node) = discretization.get(OMITTED_BONDS) else {
        return false;
    };
    let text = node.text().unwrap_or("");
    let log = &translation.log;
    if is_key(text, "All") {
        let note = match blocks {
            0 | 1 => "there is one block",
            _ => "[interface] rule = \"none\"",
        };
        log.taken(node, note);
        return true;
    }
    if is_key(text, "None") {
        log.taken(node, "blocks are bonded");
    } else {
        let note = format!(
            "the value {} is not known (All, None); the blocks stay bonded",
            excerpt(text)
        );
        log.left_out(node, note);
    }
    false
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
    if is_key(kind_name, "Short Range Force") {
        translation.log.taken(kind, "model = \"short-range\"")
    } else {
        translation
            .log
            .approximated(kind, "model = \"short-range\", constant in time")
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
