//! Boundary conditions of PeriLab.

use crate::error::{Result, excerpt};
use crate::import::conditions::{Conditions, Given, Quantity};
use crate::import::sets::Sets;
use crate::import::solver;
use crate::import::translation::Translation;
use crate::import::tree::{Node, is_key};

/// Write the initial values, loads, supports and temperatures, then the stages. `has_expansion` says whether
/// any block has a thermal expansion. Return whether temperatures are prescribed.
pub(super) fn conditions(
    translation: &mut Translation,
    root: &Node,
    sets: &mut Sets,
    stages: &[solver::Stage],
    has_expansion: bool,
) -> Result<bool> {
    let mut conditions = Conditions::default();
    for (name, table) in root
        .get("Boundary Conditions")
        .into_iter()
        .flat_map(Node::tables)
    {
        let what = format!("the condition `{name}`");
        let kind = table.get("Type");
        let kind_name = kind.and_then(Node::text).unwrap_or("Dirichlet");
        if kind_name == "Neumann" {
            let note = "PeriLab applies no condition of the type Neumann";
            translation.leave_out_load(table, "condition", name, note);
            continue;
        }
        let is_initial = kind_name == "Initial";
        let variable = translation.required(table, "Variable", &what)?;
        let text = translation.text(variable, "Variable")?;
        let is = |names: &[&str]| names.iter().any(|name| is_key(text, name));
        let quantity = if is(&["Displacements", "Displacement"]) {
            Some(if is_initial {
                Quantity::Initial("displacement")
            } else {
                Quantity::Support("displacement")
            })
        } else if is(&["Velocity", "Velocities"]) {
            Some(if is_initial {
                Quantity::Initial("velocity")
            } else {
                Quantity::Support("velocity")
            })
        } else if is(&["Force Densities", "Force Density"]) {
            Some(Quantity::BodyForce)
        } else if is(&["Forces", "Force"]) {
            Some(Quantity::ForceOfPoint)
        } else if is(&["Temperature"]) && has_expansion && !is_initial {
            Some(Quantity::Temperature(None))
        } else {
            None
        };
        let Some(quantity) = quantity else {
            let note = if !is(&["Temperature"]) {
                format!("{} has no counterpart", excerpt(text))
            } else if has_expansion {
                "temperatures are prescribed only; heat is not conducted".to_owned()
            } else {
                "no material expands, and heat is not conducted".to_owned()
            };
            let section = if is_initial { "initial" } else { "condition" };
            translation.leave_out_load(table, section, name, &note);
            continue;
        };
        translation.log.taken(variable, "the condition's key");
        if let Some(kind) = kind {
            if is_initial || kind_name == "Dirichlet" {
                translation.log.taken(kind, "[initial] or [condition]");
            } else {
                let note = "[condition]: PeriLab reads an unknown type as Dirichlet";
                translation.log.approximated(kind, note);
            }
        }
        let mut steps = Vec::new();
        if let Some(node) = table.get("Step ID") {
            steps = step_ids(translation, node)?;
            translation.log.taken(node, "the stages in which it acts");
        }
        // PeriLab sets initial values only if the time is exactly 0.
        let first = &stages[0];
        let acts = |step| steps.is_empty() || steps.contains(&step);
        if is_initial && !first.step_id.is_none_or(acts) {
            let note = "PeriLab sets initial values at the time 0 only";
            translation.leave_out_load(table, "initial", name, note);
            continue;
        }
        let given = Given {
            name,
            node: table,
            quantity,
            steps,
        };
        conditions.add(translation, sets, stages, &given)?;
    }
    conditions.finish(translation);
    let has_contact = root.get("Contact").is_some();
    solver::write(translation, stages, &conditions.written, has_contact);
    Ok(conditions.has_temperature)
}

/// Read the step numbers, which are separated by commas.
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
