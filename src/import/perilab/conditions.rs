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
            if is_initial && steps.iter().any(|step| stages[0].step_id != Some(*step)) {
                translation
                    .log
                    .approximated(node, "initial values are those at the start of the run")
            } else {
                translation.log.taken(node, "the stages in which it acts")
            }
        }
        let acting = acting_steps(stages, &steps, translation.start);
        let value = table.get("Value").and_then(Node::text).unwrap_or("");
        if acting.len() > 1 && !is_initial && reads_step_time(value) {
            // The variable `st` starts again in each step, so each step needs a condition of its own.
            for (step, start) in acting {
                translation.step_start = start;
                let given = Given {
                    name: &format!("{name} in step {step}"),
                    node: table,
                    quantity: quantity.clone(),
                    steps: vec![step],
                };
                conditions.add(translation, sets, &given)?;
            }
            continue;
        }
        translation.step_start = acting.first().map_or(0.0, |(_, start)| *start);
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

/// Return the step number and the start time of each step in which a condition acts. The start time is
/// measured from the start of the run. `steps` are the step numbers that the condition gives. If `steps` is
/// empty, the condition acts in all steps.
fn acting_steps(stages: &[solver::Stage], steps: &[u64], run_start: f64) -> Vec<(u64, f64)> {
    let mut acting: Vec<(u64, f64)> = Vec::new();
    let mut start = 0.0;
    for stage in stages {
        if let Some(step) = stage.step_id
            && (steps.is_empty() || steps.contains(&step))
            && acting.iter().all(|(known, _)| *known != step)
        {
            acting.push((step, start));
        }
        start = stage.end - run_start;
    }
    acting
}

/// Test whether an expression contains the variable `st`, the time since the start of a step.
fn reads_step_time(expression: &str) -> bool {
    let mut words = expression.split(|c: char| !c.is_alphanumeric() && c != '_');
    words.any(|word| word == "st")
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
