//! Input scripts of LAMMPS with `atom_style peri`.

mod fixes;
mod groups;
mod integration;
mod materials;
mod run;
mod setup;
mod types;
mod velocities;

use crate::error::Result;
use crate::import::regions::Region;
use crate::import::script::{Command, Script, Variables};
use crate::import::translation::Translation;
use crate::import::tree::{Content, Node};
use fixes::{is_load, without_suffix};
use groups::Group;
use integration::hold;
use materials::{Coefficients, write_bodies};
use run::{Run, follow, simulate};
use setup::{UNITS_LJ, setup};
use std::collections::HashMap;
use velocities::Velocity;

/// Atoms that one command creates.
struct Atoms {
    kind: u32,
    region: Region,
    /// Name of the region.
    name: String,
}

/// Data of the atoms, collected from the script before the new deck is written.
#[derive(Default)]
struct Model {
    /// Whether the script has a `units` command.
    has_units: bool,
    spacing: Option<f64>,
    origin: [f64; 3],
    regions: Vec<(String, Region, Node)>,
    /// For each direction, whether atoms are created on the upper face of the box; `None` without `boundary`.
    has_upper_face: Option<[bool; 3]>,
    bounds: Option<[[f64; 3]; 2]>,
    types: u32,
    atoms: Vec<Atoms>,
    style: Option<(String, Node)>,
    coefficients: Vec<Coefficients>,
    /// Atom type (`None` for all types) and density.
    densities: Vec<(Option<u32>, f64)>,
    /// Groups: name, selection and node.
    groups: Vec<(String, Group, Node)>,
    /// Damping of all atoms: force density divided by velocity, N s/m⁴.
    drag: Option<f64>,
    /// Commands `velocity … set` in their order.
    velocities: Vec<Velocity>,
    fields: Vec<&'static str>,
}

/// Return the tree of a script. The key of each command in the tree is its [`Command::key`].
pub fn tree(script: &Script) -> Node {
    let commands = script.commands.iter();
    let entries = commands.map(|command| (command.key(), command.node.clone()));
    Node {
        id: 0,
        line: 1,
        content: Content::Table(entries.collect()),
    }
}

/// Translate a script.
///
/// # Errors
/// If data that a run needs is missing or wrong.
pub fn translate(translation: &mut Translation, script: &Script) -> Result<()> {
    let commands = &script.commands;
    let first = commands
        .iter()
        .position(|command| command.name() == "run" && !makes_no_step(command));
    let (before, after) = commands.split_at(first.unwrap_or(commands.len()));
    let without = without_effect(before);
    let mut model = Model::default();
    let mut variables = Variables::default();
    let read = |translation: &Translation, variables: &mut Variables, command: &Command| {
        let read = variables.read(command);
        read.map_err(|message| wrong(translation, command, message))
    };
    for command in before {
        read(translation, &mut variables, command)?;
        match without.get(&command.node.id) {
            Some(reason) => translation.log.left_out(&command.node, *reason),
            None => setup(translation, &variables, &mut model, command)?,
        }
    }
    if !model.has_units {
        let message =
            format!("the script has no `units`, so LAMMPS uses the default `lj`: {UNITS_LJ}");
        return Err(translation.error(1, message));
    }
    let bodies = write_bodies(translation, &mut model)?;
    let mut run = Run::default();
    // LAMMPS evaluates the variables of fixes and outputs at the start of a run, so fixes and outputs are
    // translated after all definitions.
    let mut fixes = Vec::new();
    for command in before {
        if !without.contains_key(&command.node.id) {
            simulate(
                translation,
                &variables,
                &mut model,
                &bodies,
                &mut run,
                command,
            )?;
            if command.name() == "fix" {
                fixes.push(command);
            }
        }
    }
    hold(translation, &model, &fixes, after.first());
    let loads: Vec<&str> = fixes.iter().filter_map(|fix| load_id(fix)).collect();
    for command in after {
        read(translation, &mut variables, command)?;
        follow(translation, &variables, &mut run, &loads, command)?;
    }
    run.write(translation, &model)
}

/// Return the id of a fix that is a load or a support; `None` for other fixes.
fn load_id(fix: &Command) -> Option<&str> {
    match &fix.arguments()[..] {
        [id, _, style, ..] if is_load(without_suffix(style)) => Some(*id),
        _ => None,
    }
}

/// Return the node ids of the commands that have no effect in the first run, with the reason. `commands` are
/// the commands before this run.
fn without_effect(commands: &[Command]) -> HashMap<usize, &'static str> {
    let mut acting: HashMap<&str, usize> = HashMap::new();
    let mut without = HashMap::new();
    for command in commands {
        let Some(id) = command.words.get(1) else {
            continue;
        };
        match command.name() {
            "run" => {
                without.insert(command.node.id, NO_STEP);
            }
            "fix" => {
                if let Some(earlier) = acting.insert(id, command.node.id) {
                    without.insert(earlier, "a later `fix` of the same id replaces it");
                }
            }
            "unfix" => {
                if let Some(removed) = acting.remove(id.as_str()) {
                    without.insert(removed, "`unfix` removes it before the first `run`");
                }
            }
            _ => {}
        }
    }
    without
}

/// Reason why `run 0` is left out.
const NO_STEP: &str = "it makes no step";

/// Test whether a command is `run 0`, with or without keywords. Scripts of `peri/lps` and similar styles need
/// this command before the first step.
fn makes_no_step(command: &Command) -> bool {
    command.name() == "run" && command.arguments().first() == Some(&"0")
}

/// Create an error for a command.
fn wrong(
    translation: &Translation,
    command: &Command,
    message: impl AsRef<str>,
) -> crate::error::Error {
    let message = format!("{}: {}", command.key(), message.as_ref());
    translation.error(command.node.line, message)
}
