//! Boundary and initial conditions of Peridigm.

use crate::error::{Result, excerpt};
use crate::import::conditions::{Conditions, Given, Quantity};
use crate::import::draft::Value;
use crate::import::sets::Sets;
use crate::import::solver;
use crate::import::translation::Translation;
use crate::import::tree::{Content, Node, is_key};

/// Type of a condition that prescribes temperatures.
const PRESCRIBED_TEMPERATURE: &str = "Prescribed Temperature";

/// Write the initial values, loads, supports and temperatures, then the stages. `expanding` has the section
/// headers of the materials with thermal expansion. Return whether temperatures are prescribed.
pub(super) fn conditions<'n>(
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
            if !matches!(value.content, Content::Table(_)) {
                let name_of_set = name.to_lowercase().replace('_', " ");
                sets.define(name, value, name_of_set.contains("node set"));
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
                    stages,
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
                let words = kind_name.to_lowercase();
                let section = match words.starts_with("initial") {
                    true => "initial",
                    false => "condition",
                };
                translation.leave_out_load(table, section, name, &note);
                continue;
            };
            translation.log.taken(kind, *known);
            let given = Given {
                name,
                node: table,
                quantity: quantity.clone(),
                steps: Vec::new(),
            };
            conditions.add(translation, sets, stages, &given)?;
        }
    }
    conditions.finish(translation);
    let has_contact = root.get("Contact").is_some();
    solver::write(translation, stages, &conditions.written, has_contact);
    Ok(conditions.has_temperature)
}

/// Return the prescribed temperatures at the time 0, which are the reference for thermal expansion, even if
/// the first solver starts later.
fn starts(translation: &Translation, root: &Node) -> Vec<Value> {
    let tables = root.get("Boundary Conditions").into_iter();
    let tables = tables.flat_map(Node::tables).map(|(_, table)| table);
    let text = |table: &Node, key: &str| Some(table.get(key)?.text()?.to_owned());
    tables
        .filter(|table| {
            text(table, "Type").is_some_and(|kind| is_key(&kind, PRESCRIBED_TEMPERATURE))
        })
        .filter_map(|table| translation.at_time(&text(table, "Value")?, 0.0).ok())
        .collect()
}

/// Write a prescribed temperature.
///
/// Thermal expansion is relative to the temperature at the time 0. If `uniform`, this temperature is the
/// reference temperature of all materials that expand. Otherwise, it is subtracted from the prescribed
/// temperature.
fn temperature<'n>(
    translation: &mut Translation,
    sets: &mut Sets<'n>,
    conditions: &mut Conditions,
    (name, table, kind): (&str, &Node, &Node),
    (uniform, expanding): (bool, &[String]),
    stages: &[solver::Stage],
) -> Result<()> {
    if expanding.is_empty() {
        let note = "no material expands, and heat is not conducted";
        translation.leave_out_load(table, "condition", name, note);
        return Ok(());
    }
    let value = translation.required(table, "Value", &format!("the condition `{name}`"))?;
    let start = translation.at_time(translation.text(value, "Value")?, 0.0);
    let reference = match (uniform, start) {
        (true, _) | (false, Err(_)) => None,
        (false, Ok(start)) => Some(start),
    };
    let note = "temperature; the reference is that at t = 0; heat is not conducted";
    translation.log.taken(kind, note);
    let given = Given {
        name,
        node: table,
        quantity: Quantity::Temperature(reference),
        steps: Vec::new(),
    };
    conditions.add(translation, sets, stages, &given)
}
