//! Solvers of Peridigm and PeriLab, which become stages.

use super::draft::{Section, Value};
use super::expression::Dialect;
use super::translation::Translation;
use super::tree::{Node, is_key};
use crate::error::{Result, excerpt};

/// Number of load steps if the deck gives none.
const LOAD_STEPS: u64 = 1;

/// Quasi-static solvers.
const STATIC: [&str; 4] = [
    "QuasiStatic",
    "NOXQuasiStatic",
    "Static",
    "Linear Static Matrix Based",
];

/// Solvers with explicit time integration.
const EXPLICIT: [&str; 2] = ["Verlet", "Verlet Matrix Based"];

/// Solvers with implicit time integration.
const IMPLICIT: [&str; 2] = ["Implicit", "Newmark"];

/// Solution method of a stage.
#[derive(Debug, Clone, PartialEq)]
pub enum Method {
    /// Explicit time integration.
    Explicit {
        /// Fixed step, s.
        step: Option<Value>,
        /// Fraction of the stable step.
        safety: Option<Value>,
    },
    /// Quasi-static solution with this number of load steps.
    Equilibria(u64),
}

/// A stage of the run.
#[derive(Debug, Clone, PartialEq)]
pub struct Stage {
    /// End of the stage in the time of the source deck, s.
    pub end: f64,
    /// Solution method.
    pub method: Method,
    /// Number by which conditions refer to this solver step; `None` if the source deck gives no number.
    pub step_id: Option<u64>,
    /// Damping rate, 1/s: the damping factor of the solver per step, divided by the time step. `None` if
    /// there is no damping or the time step is unknown.
    pub damping: Option<f64>,
    /// Whether damage models are active.
    pub is_damage_enabled: bool,
}

/// Read the time at which the first solver starts.
///
/// # Errors
/// If the time is not a number.
pub fn read_start(translation: &mut Translation, first: &Node) -> Result<()> {
    let Some(initial) = first.get("Initial Time") else {
        return Ok(());
    };
    let start = translation.number(initial, "Initial Time")?;
    if start == 0.0 {
        translation.log.taken(initial, "a run starts at 0");
    } else {
        let note = "a run starts at 0; times are shifted";
        translation.log.approximated(initial, note);
    }
    translation.start = start;
    Ok(())
}

/// Read a solver that starts at the time `start` (s), and return its stages. `damage_by_default` says whether
/// damage models are active if the deck does not switch damage models on or off.
///
/// # Errors
/// - If `node` has no solver that this module reads.
/// - If the end is missing or is not after the start.
/// - If a value is not a number.
/// - If the numbers of `Time Steps` do not rise.
pub fn stage(
    translation: &Translation,
    node: &Node,
    start: f64,
    damage_by_default: bool,
) -> Result<Vec<Stage>> {
    let log = &translation.log;
    let step_id = match node.get("Step ID") {
        None => None,
        Some(id) => {
            log.taken(id, "the number of a stage");
            Some(translation.count(id, "Step ID")?)
        }
    };
    let damage_models = node.get("Damage Models");
    let is_damage_enabled = damage_models.map_or(damage_by_default, |damage_models| {
        log.taken(damage_models, "whether bodies have damage");
        translation.is_true(damage_models)
    });
    let mut solver = None;
    for (name, table) in node.entries() {
        let is = |names: &[&str]| names.iter().any(|known| is_key(name, known));
        if is(&STATIC) || is(&EXPLICIT) || is(&IMPLICIT) {
            if solver.is_some() {
                log.left_out(table, "only the first solver counts");
                continue;
            }
            solver = Some((name, table));
        }
    }
    let Some((name, solver)) = solver else {
        let message = "the solver is none of Verlet, QuasiStatic, NOXQuasiStatic, Implicit, Static, Newmark and \
                       the matrix-based ones";
        return Err(translation.error(node.line, message));
    };
    let is = |names: &[&str]| names.iter().any(|known| is_key(name, known));
    let end = |steps: &[f64]| -> Result<f64> {
        if let Some(last) = steps.last() {
            return Ok(*last);
        }
        if let Some(additional) = node.get("Additional Time")
            && node.get("Final Time").is_none()
        {
            log.taken(additional, "end of a stage");
            return Ok(start + translation.number(additional, "Additional Time")?);
        }
        let end = translation.required(node, "Final Time", "the solver")?;
        log.taken(end, "[time] end");
        translation.number(end, "Final Time")
    };
    let later = |end: f64, line: usize| {
        if end > start {
            Ok(end)
        } else {
            let message = format!("the end {end} must be later than the start {start}");
            Err(translation.error(line, message))
        }
    };
    let new = |end: f64, method: Method| Stage {
        end,
        method,
        step_id,
        damping: None,
        is_damage_enabled,
    };
    if is(&STATIC) {
        if let Some(times) = solver.get("Time Steps") {
            let text = translation.text(times, "Time Steps")?;
            let times_read: Option<Vec<f64>> =
                text.split_whitespace().map(|t| t.parse().ok()).collect();
            let is_rising =
                |times: &Vec<f64>| times.len() > 1 && times.windows(2).all(|w| w[0] < w[1]);
            let Some(list) = times_read.filter(is_rising) else {
                let message = format!("`Time Steps` must be rising numbers, is {}", excerpt(text));
                return Err(translation.error(times.line, message));
            };
            log.taken(times, "one stage for each load step");
            if let Some(end) = node.get("Final Time") {
                log.taken(end, "the last of the time steps");
            }
            let after = list.iter().filter(|end| **end > start);
            let stages: Vec<Stage> = after.map(|end| new(*end, Method::Equilibria(1))).collect();
            later(*list.last().expect("two at least"), times.line)?;
            note_unread_keys(translation, solver);
            return Ok(stages);
        }
        let end = later(end(&[])?, node.line)?;
        let is_perilab = translation.dialect == Dialect::PeriLab;
        // PeriLab reads the number of steps from the table of the step, Peridigm from that of the solver.
        let given = ["Number of Load Steps", "Number of Steps"]
            .iter()
            .find_map(|key| {
                let of_step = node.get(key);
                let of_solver = solver.get(key);
                Some((
                    *key,
                    if is_perilab {
                        of_step.or(of_solver)
                    } else {
                        of_solver.or(of_step)
                    }?,
                ))
            });
        let mut load_steps = LOAD_STEPS;
        let fixed = solver.get("Fixed dt");
        // Only PeriLab's `Static` reads `Fixed dt`. A value of 0 or less counts as missing.
        let fixed = fixed.filter(|_| is_perilab && is(&["Static"]));
        let step = fixed.map(|fixed| translation.number(fixed, "Fixed dt"));
        let step = step.transpose()?.filter(|step| *step > 0.0);
        if let (Some(fixed), Some(step)) = (fixed, step) {
            let count = ((end - start) / step).round();
            if count >= 1e15 {
                let message = format!("`Fixed dt` is too short: {step}");
                return Err(translation.error(fixed.line, message));
            }
            log.taken(fixed, "load_steps: the duration divided by this step");
            load_steps = (count as u64).max(1);
            if let Some((_, steps)) = given {
                log.left_out(steps, "PeriLab uses `Fixed dt` instead");
            }
        } else if let Some((key, steps)) = given {
            log.taken(steps, "load_steps");
            load_steps = translation.count(steps, key)?.max(1);
        }
        note_unread_keys(translation, solver);
        return Ok(vec![new(end, Method::Equilibria(load_steps))]);
    }
    let fixed = solver.get("Fixed dt");
    let mut step = None;
    let mut safety = None;
    if is(&IMPLICIT) {
        let note = "implicit steps become explicit ones of the stable size";
        log.approximated(solver, note);
        if let Some(fixed) = fixed {
            log.left_out(fixed, note);
        }
        safety = Some(Value::Number("0.8".to_owned()));
    } else if let Some(fixed) =
        fixed.filter(|dt| translation.number(dt, "Fixed dt").is_ok_and(|dt| dt > 0.0))
    {
        log.taken(fixed, "[time] step");
        step = Some(translation.number_value(fixed, "Fixed dt")?);
        if let Some(factor) = solver.get("Safety Factor") {
            log.left_out(factor, "the step is fixed");
        }
    } else {
        if let Some(fixed) = fixed {
            translation.number(fixed, "Fixed dt")?;
        }
        safety = match solver.get("Safety Factor") {
            None => Some(Value::Number("1.0".to_owned())),
            Some(factor) => {
                let value = translation.number(factor, "Safety Factor")?;
                if value > 0.0 && value <= 1.0 {
                    let note = "[time] safety, of another estimate of the stable step";
                    log.approximated(factor, note);
                    Some(translation.number_value(factor, "Safety Factor")?)
                } else {
                    log.approximated(factor, "[time] safety is at most 1");
                    Some(Value::Number("1.0".to_owned()))
                }
            }
        };
        if is_key(name, EXPLICIT[1]) {
            log.approximated(solver, "explicit steps without a matrix");
        }
    }
    let mut stage = new(
        later(end(&[])?, node.line)?,
        Method::Explicit { step, safety },
    );
    if let Some(damping) = solver.get("Numerical Damping") {
        let per_step = translation.number(damping, "Numerical Damping")?;
        match fixed.map(|dt| translation.number(dt, "Fixed dt")).transpose()? {
            Some(dt) if per_step > 0.0 && dt > 0.0 => {
                log.taken(damping, "damping of the materials: the factor over the step");
                stage.damping = Some(per_step / dt);
            }
            _ if per_step == 0.0 => log.taken(damping, "no damping"),
            _ => log.left_out(
                damping,
                "damps each step by this factor; the damping of a material is this over the step, which is not \
                 fixed here",
            ),
        }
    }
    Ok(vec![stage])
}

/// Log the tolerances of a static solver, and its keys that have not been read.
fn note_unread_keys(translation: &Translation, solver: &Node) {
    for (name, node) in solver.entries() {
        let is = |known: &[&str]| known.iter().any(|known| is_key(name, known));
        if is(&[
            "Absolute Tolerance",
            "Relative Tolerance",
            "Residual tolerance",
            "Solution tolerance",
        ]) {
            let note = "the tolerance is the default, unbalanced force over loads and reactions";
            translation.log.approximated(node, note);
        } else if !translation.log.is_noted(node) {
            let note = "concerns the solver of that code";
            translation.log.left_out(node, note);
        }
    }
}

/// Write the stages of a run.
///
/// `conditions` holds the name of each condition and the numbers of the solver steps in which it acts. A
/// condition without numbers acts in all steps. Equilibria are found by Newton's method in runs without
/// contact, and by relaxation in runs with contact.
pub fn write(
    translation: &mut Translation,
    stages: &[Stage],
    conditions: &[(String, Vec<u64>)],
    has_contact: bool,
) {
    let start = translation.start;
    let Some(last) = stages.last() else {
        return;
    };
    let mut time = Section::new("time");
    time.set("end", Value::number(last.end - start));
    if let [only] = stages {
        method(&mut time, &only.method, has_contact);
        translation.add(time);
        return;
    }
    translation.add(time);
    for (index, stage) in stages.iter().enumerate() {
        let mut section = Section::new("stage");
        if index + 1 < stages.len() {
            section.set("end", Value::number(stage.end - start));
        }
        method(&mut section, &stage.method, has_contact);
        let acts = |steps: &[u64]| {
            steps.is_empty() || stage.step_id.is_some_and(|step| steps.contains(&step))
        };
        let rests = conditions.iter().filter(|(_, steps)| !acts(steps));
        let off: Vec<Value> = rests.map(|(name, _)| Value::text(name.clone())).collect();
        if !off.is_empty() {
            section.set("off", Value::List(off));
        }
        translation.add(section);
    }
}

fn method(section: &mut Section, method: &Method, has_contact: bool) {
    match method {
        Method::Explicit { step, safety } => {
            if let Some(step) = step {
                section.set("step", step.clone());
            }
            if let Some(safety) = safety {
                section.set("safety", safety.clone());
            }
        }
        Method::Equilibria(steps) => {
            let steps = Value::Number(steps.to_string());
            let name = if has_contact { "relaxation" } else { "static" };
            section
                .set("method", Value::text(name))
                .set(name, Value::Table(vec![("load_steps".to_owned(), steps)]));
        }
    }
}
