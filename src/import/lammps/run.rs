//! Runs of LAMMPS: their time steps, outputs and initial velocities.

use super::fixes::{fix, is_load, without_suffix};
use super::setup::{CHANGES, ignored, initial_value};
use super::{Model, NO_STEP, makes_no_step, velocities, wrong};
use crate::error::Result;
use crate::import::draft::Value;
use crate::import::log::OTHER_MODEL;
use crate::import::script::{Command, Variables};
use crate::import::translation::Translation;

/// Commands that only concern the operation of LAMMPS or its messages.
pub(super) const WORKINGS: [&str; 27] = [
    "atom_modify",
    "neighbor",
    "neigh_modify",
    "newton",
    "processors",
    "comm_modify",
    "comm_style",
    "communicate",
    "suffix",
    "package",
    "special_bonds",
    "thermo_style",
    "thermo_modify",
    "dump_modify",
    "run_style",
    "restart",
    "write_restart",
    "write_data",
    "log",
    "echo",
    "print",
    "info",
    "shell",
    "timer",
    "label",
    "balance",
    "undump",
];

/// Atom fields in dumps and computes of LAMMPS, and the corresponding fields of Fissure.
const FIELDS: [(&str, &str); 21] = [
    ("x", "displacement"),
    ("y", "displacement"),
    ("z", "displacement"),
    ("xu", "displacement"),
    ("yu", "displacement"),
    ("zu", "displacement"),
    ("xs", "displacement"),
    ("ys", "displacement"),
    ("zs", "displacement"),
    ("vx", "velocity"),
    ("vy", "velocity"),
    ("vz", "velocity"),
    ("fx", "force_density"),
    ("fy", "force_density"),
    ("fz", "force_density"),
    ("damage/atom", "damage"),
    ("dilatation/atom", "dilatation"),
    ("plasticity/atom", "plastic_strain_equivalent"),
    ("pe/atom", "strain_energy_density"),
    ("stress/atom", "stress"),
    ("displace/atom", "displacement"),
];

/// The runs and outputs of a script.
#[derive(Default)]
pub(super) struct Run {
    /// Number of steps and time step (s) of each run; consecutive runs with the same time step are merged.
    runs: Vec<(u64, f64)>,
    /// Step number at the start of the next run.
    at: u64,
    output: Option<u64>,
    history: Option<u64>,
}

/// Read a number of steps from the argument with the index `k`. The number must be at least `least`.
fn steps(
    translation: &Translation,
    variables: &Variables,
    command: &Command,
    k: usize,
    least: f64,
) -> Result<u64> {
    let fail = |message: String| wrong(translation, command, message);
    let word = command.words.get(1 + k).map_or("", String::as_str);
    let number = variables.number(word).map_err(fail)?;
    if (least..1e15).contains(&number) {
        Ok(number as u64)
    } else {
        Err(fail(format!("the number of steps must be {least} or more")))
    }
}

/// Read `reset_timestep`: the step number at the start of the next run.
fn reset(
    translation: &Translation,
    variables: &Variables,
    run: &mut Run,
    command: &Command,
) -> Result<()> {
    run.at = steps(translation, variables, command, 0, 0.0)?;
    let note = "the step from which `run … upto` counts";
    translation.log.taken(&command.node, note);
    Ok(())
}

/// Read the first `run` command, or a command after it. Commands after the first `run` matter only if they
/// change the end of the run. `loads` are the ids of the loads and supports in the first run.
pub(super) fn follow(
    translation: &mut Translation,
    variables: &Variables,
    run: &mut Run,
    loads: &[&str],
    command: &Command,
) -> Result<()> {
    let node = &command.node;
    match command.name() {
        "run" if makes_no_step(command) => translation.log.left_out(node, NO_STEP),
        "run" => {
            let fail = |message: &str| wrong(translation, command, message);
            let step = variables.step;
            if step <= 0.0 {
                return Err(fail("there is no `timestep` above 0 before it"));
            }
            let is_end = command.arguments().contains(&"upto");
            let least = if is_end { 0.0 } else { 1.0 };
            let given = steps(translation, variables, command, 0, least)?;
            let count = if is_end { given.checked_sub(run.at).ok_or_else(|| {
                    fail(&format!(
                        "the last step {given} is before the step {}",
                        run.at
                    ))
                })? } else { given };
            run.at = run.at.saturating_add(count);
            match run.runs.last_mut() {
                Some((steps, known)) if *known == step => *steps = steps.saturating_add(count),
                _ => run.runs.push((count, step)),
            }
            translation.log.taken(node, "[time] end");
            if !variables.has_step {
                let note = format!(
                    "without `timestep`, the time step is the default of the units, {step:?}"
                );
                translation.log.taken(node, note);
            }
        }
        "timestep" => match run.runs.first() {
            Some((_, first)) if variables.step != *first => translation.log.approximated(
                node,
                "each later `run` adds its number of steps times this step to [time] end; [time] step is that of the first `run`",
            ),
            _ => translation.log.taken(node, "[time] step"),
        },
        "reset_timestep" => reset(translation, variables, run, command)?,
        "variable" => translation.log.taken(node, "its value where it is used"),
        "include" => translation.log.taken(node, "its commands are read"),
        name => {
            let reason = ignored(command);
            let reason = reason.unwrap_or("changes after the first `run` are not followed");
            let arguments = command.arguments();
            let style = arguments.get(2).map_or("", |style| without_suffix(style));
            match name {
                "fix" if is_load(style) => {
                    let name = format!("fix {}", arguments[0]);
                    translation.leave_out_load(node, "condition", &name, reason);
                }
                "unfix" if arguments.first().is_some_and(|id| loads.contains(id)) => {
                    translation.leave_out_load(node, "condition", name, reason);
                }
                "velocity" | "displace_atoms" | "minimize" => {
                    translation.leave_out_load(node, "initial", name, reason);
                }
                "set" if initial_value(command).is_some() => {
                    translation.leave_out_load(node, "initial", name, reason);
                }
                name if CHANGES.contains(&name) => {
                    translation.log.left_out(node, reason);
                    translation.log.left_out(node, OTHER_MODEL);
                }
                _ => translation.log.left_out(node, reason),
            }
        }
    }
    Ok(())
}

/// Translate a command that acts during the run.
pub(super) fn simulate(
    translation: &mut Translation,
    variables: &Variables,
    model: &mut Model,
    bodies: &[(u32, String, String)],
    run: &mut Run,
    command: &Command,
) -> Result<()> {
    let node = &command.node;
    let arguments = command.arguments();
    let count =
        |translation: &Translation, k: usize| steps(translation, variables, command, k, 1.0);
    match command.name() {
        "timestep" => translation.log.taken(node, "[time] step"),
        "reset_timestep" => reset(translation, variables, run, command)?,
        "thermo" => {
            run.history = Some(count(translation, 0)?);
            translation.log.taken(node, "[history] every_steps");
        }
        "compute" => {
            let style = arguments.get(2).copied().unwrap_or("");
            match FIELDS.iter().find(|(known, _)| *known == style) {
                Some((_, field)) => {
                    translation.log.taken(node, format!("field {field}"));
                    if !model.fields.contains(field) {
                        model.fields.push(field);
                    }
                }
                None => translation.log.left_out(node, "there is no such field"),
            }
        }
        "dump" => {
            run.output = Some(count(translation, 3)?);
            translation
                .log
                .approximated(node, "[output] every_steps; the result is one HDF5 file");
            for word in arguments.iter().skip(5) {
                let known = FIELDS.iter().find(|(known, _)| known == word);
                if let Some((_, field)) = known
                    && !model.fields.contains(field)
                {
                    model.fields.push(field);
                }
            }
        }
        "velocity" => velocities::write(translation, model, bodies, command),
        "displace_atoms" => {
            let note = "points start on the lattice";
            translation.leave_out_load(node, "initial", "displace_atoms", note);
        }
        "fix" => fix(translation, variables, model, bodies, command)?,
        "unfix" => translation.log.taken(node, "its fix is left out"),
        "uncompute" => translation
            .log
            .left_out(node, "fields that a `compute` adds stay"),
        "minimize" => {
            let note = "there is no minimization; relaxation finds equilibria";
            translation.leave_out_load(node, "initial", "minimize", note);
        }
        _ => {}
    }
    Ok(())
}

impl Run {
    /// Write the time settings and outputs.
    pub(super) fn write(self, translation: &mut Translation, model: &Model) -> Result<()> {
        let Some((_, step)) = self.runs.first() else {
            return Err(translation.error(1, "the script has no `run`"));
        };
        let ends = self.runs.iter().map(|(steps, step)| *steps as f64 * step);
        let time = translation.draft.section("time");
        time.set("end", Value::number(ends.sum()));
        time.set("step", Value::number(*step));
        let output = translation.draft.section("output");
        if let Some(steps) = self.output {
            output.set("every_steps", Value::Number(steps.to_string()));
        }
        if !model.fields.is_empty() {
            let mut fields = model.fields.clone();
            for always in ["displacement", "velocity"] {
                if !fields.contains(&always) {
                    fields.push(always);
                }
            }
            output.set("fields", Value::list(fields.into_iter().map(Value::text)));
        }
        if let Some(steps) = self.history {
            let history = translation.draft.section("history");
            history.set("every_steps", Value::Number(steps.to_string()));
        }
        Ok(())
    }
}
