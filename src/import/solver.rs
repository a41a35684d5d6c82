//! Solvers of Peridigm and PeriLab, which become stages.

use super::draft::{Section, Value};
use super::expression::Dialect;
use super::translation::Translation;
use super::tree::{Node, is_key};
use crate::error::{Result, excerpt};

/// Number of load steps if the deck gives none.
const LOAD_STEPS: u64 = 1;

/// Relative tolerance for the comparison of times.
const ROUND_OFF: f64 = 1e-9;

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

/// Log note for solvers of PeriLab with a stiffness matrix.
const LINEAR: &str =
    "the forces are linear in the displacements in PeriLab, but not in the new deck";

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
    /// Start of the stage in the time of the source deck, s.
    pub start: f64,
    /// End of the stage in the time of the source deck, s.
    pub end: f64,
    /// Time of the source deck minus the time of the run, s.
    pub shift: f64,
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

impl Stage {
    /// Return the start of the stage in the time of the run, s.
    pub fn start_in_run(&self) -> f64 {
        self.start - self.shift
    }

    /// Return the end of the stage in the time of the run, s.
    pub fn end_in_run(&self) -> f64 {
        self.end - self.shift
    }
}

/// Return the duration of a run with these stages, s.
pub fn duration(stages: &[Stage]) -> f64 {
    stages.last().map_or(0.0, Stage::end_in_run)
}

/// Return the time of the source deck at which a solver starts, s. `previous` is the end of the solver before
/// (s); `None` for the first solver.
fn start(translation: &Translation, node: &Node, previous: Option<f64>) -> Result<f64> {
    let initial = node.get("Initial Time");
    let given = initial
        .map(|initial| translation.number(initial, "Initial Time"))
        .transpose()?;
    let end_before = previous.unwrap_or(0.0);
    let start = match translation.dialect {
        Dialect::PeriLab => end_before,
        _ => given.unwrap_or(0.0),
    };
    let Some(initial) = initial else {
        return Ok(start);
    };
    let log = &translation.log;
    let note = |first: &'static str, later: &'static str| match previous {
        None => first,
        Some(_) => later,
    };
    if given != Some(start) {
        let later = "PeriLab starts at the end of the step before instead";
        log.taken(initial, note("PeriLab starts at 0 instead", later));
    } else if start == end_before {
        log.taken(
            initial,
            note("a run starts at 0", "the end of the stage before"),
        );
    } else {
        let later = "a stage starts at the end of the one before; times are shifted";
        log.approximated(initial, note("a run starts at 0; times are shifted", later));
    }
    Ok(start)
}

/// Read the key `Time Steps` of a static solver: the start of the solver and the end of each load step, s.
/// Return `None` if the deck does not give this key, or if Peridigm ignores it.
fn time_steps(translation: &Translation, node: &Node, solver: &Node) -> Result<Option<Vec<f64>>> {
    let log = &translation.log;
    let Some(steps) = solver.get("Time Steps") else {
        return Ok(None);
    };
    if node.get("Final Time").is_some() && solver.get("Number of Load Steps").is_some() {
        log.left_out(steps, "Peridigm uses `Number of Load Steps` instead");
        return Ok(None);
    }
    let text = translation.text(steps, "Time Steps")?;
    let times: Option<Vec<f64>> = text.split_whitespace().map(|t| t.parse().ok()).collect();
    let is_rising = |times: &Vec<f64>| {
        times.len() > 1
            && times.windows(2).all(|w| w[0] < w[1])
            && times.iter().all(|time| time.is_finite())
    };
    let Some(times) = times.filter(is_rising) else {
        let message = format!("`Time Steps` must be rising numbers, is {}", excerpt(text));
        return Err(translation.error(steps.line, message));
    };
    log.taken(steps, "one stage for each load step");
    if let Some(initial) = node.get("Initial Time") {
        log.taken(initial, "the first of the time steps counts instead");
    }
    if let Some(end) = node.get("Final Time") {
        log.taken(end, "the last of the time steps counts instead");
    }
    Ok(Some(times))
}

/// Test whether PeriLab skips a step. It runs a step only if the end of the step before is not before the
/// `Initial Time` of the step and is before its `Final Time`. The first step is compared with the time 0.
fn is_skipped(translation: &Translation, node: &Node, before: &[Stage]) -> Result<bool> {
    let now = before.last().map_or(0.0, |stage| stage.end);
    let given = |key: &str| -> Result<Option<f64>> {
        let node = node.get(key);
        node.map(|node| translation.number(node, key)).transpose()
    };
    let is_early = given("Initial Time")?.is_some_and(|initial| now < initial * (1.0 - ROUND_OFF));
    let is_late = given("Final Time")?.is_some_and(|end| now >= end);
    Ok(is_early || is_late)
}

/// Read a solver that follows the given stages, and return its stages; none if the source code skips the
/// solver. `damage_by_default` says whether
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
    before: &[Stage],
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
    if translation.dialect == Dialect::PeriLab && is_skipped(translation, node, before)? {
        log.left_out(
            node,
            "PeriLab skips this step: it does not contain the end of the step before",
        );
        return Ok(Vec::new());
    }
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
    let times = if is(&STATIC) {
        time_steps(translation, node, solver)?
    } else {
        None
    };
    let end_before = before.last().map(|stage| stage.end);
    let start = match &times {
        Some(times) => times[0],
        None => start(translation, node, end_before)?,
    };
    let end_before = end_before.unwrap_or(0.0);
    let shift = before.last().map_or(0.0, |stage| stage.shift) + (start - end_before);
    let end = || -> Result<f64> {
        if let Some(additional) = node.get("Additional Time")
            && node.get("Final Time").is_none()
        {
            log.taken(additional, "end of a stage");
            return Ok(end_before + translation.number(additional, "Additional Time")?);
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
        start,
        end,
        shift,
        method,
        step_id,
        damping: None,
        is_damage_enabled,
    };
    if is(&[STATIC[3], EXPLICIT[1], IMPLICIT[1]]) {
        log.approximated(solver, LINEAR);
    }
    if is(&STATIC) {
        if let Some(times) = times {
            let spans = times.windows(2).map(|span| Stage {
                start: span[0],
                ..new(span[1], Method::Equilibria(1))
            });
            note_unread_keys(translation, solver);
            return Ok(spans.collect());
        }
        let end = later(end()?, node.line)?;
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
    let mut stage = new(later(end()?, node.line)?, Method::Explicit { step, safety });
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
    if stages.is_empty() {
        return;
    }
    let mut time = Section::new("time");
    time.set("end", Value::number(duration(stages)));
    if let [only] = stages {
        method(&mut time, &only.method, has_contact);
        translation.add(time);
        return;
    }
    translation.add(time);
    for (index, stage) in stages.iter().enumerate() {
        let mut section = Section::new("stage");
        if index + 1 < stages.len() {
            section.set("end", Value::number(stage.end_in_run()));
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
