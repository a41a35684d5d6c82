//! Initial velocities of LAMMPS.

use super::groups::{NO_SET, atoms_in, region_of, set};
use super::{Model, wrong};
use crate::error::Result;
use crate::import::draft::Value;
use crate::import::regions::Region;
use crate::import::script::{Command, Variables};
use crate::import::translation::Translation;

/// Command `velocity … set`.
pub(super) struct Velocity {
    /// Node id of the command.
    node: usize,
    group: String,
    /// Components that the command sets or adds; `None` for `NULL`.
    values: [Option<f64>; 3],
    /// Whether the command adds its values (`sum yes`).
    adds: bool,
    /// Velocity of the group after the command.
    after: [f64; 3],
}

impl Velocity {
    /// Return the velocity of an atom after the command. `before` is its velocity before the command.
    fn apply(&self, before: [f64; 3]) -> [f64; 3] {
        std::array::from_fn(|k| match self.values[k] {
            Some(value) if self.adds => before[k] + value,
            Some(value) => value,
            None => before[k],
        })
    }
}

/// Read `velocity … set`. Other styles of `velocity` are not read.
pub(super) fn read(
    translation: &Translation,
    variables: &Variables,
    model: &mut Model,
    command: &Command,
) -> Result<()> {
    let arguments = command.arguments();
    let [group, "set", vx, vy, vz, options @ ..] = &arguments[..] else {
        return Ok(());
    };
    let has = |option: [&str; 2]| options.windows(2).any(|pair| pair == option);
    let is_box = has(["units", "box"]);
    let mut values = [None; 3];
    for (value, word) in values.iter_mut().zip([vx, vy, vz]) {
        if *word != "NULL" {
            let number = variables.number(word);
            let number = number.map_err(|message| wrong(translation, command, message))?;
            // LAMMPS scales numbers by the lattice constant, but not the values of variables.
            let unit = match model.spacing {
                Some(spacing) if !is_box && !word.starts_with("v_") => spacing,
                _ => 1.0,
            };
            *value = Some(unit * number);
        }
    }
    let mut velocity = Velocity {
        node: command.node.id,
        group: (*group).to_owned(),
        values,
        adds: has(["sum", "yes"]),
        after: [0.0; 3],
    };
    let is_absolute = !velocity.adds && values.iter().all(Option::is_some);
    let mut before = [0.0; 3];
    if !is_absolute {
        let found = velocities(model, group, None).unwrap_or([None; 3]);
        if (0..3).any(|k| found[k].is_none() && (velocity.adds || values[k].is_none())) {
            let note = "the velocity before the command is that of the same group or of all, not that of other groups";
            translation.log.approximated(&command.node, note);
        }
        let same = model
            .velocities
            .iter()
            .filter(|earlier| is_of(earlier, group));
        let of_group = same.fold([0.0; 3], |before, earlier| earlier.apply(before));
        before = std::array::from_fn(|k| found[k].unwrap_or(of_group[k]));
    }
    velocity.after = velocity.apply(before);
    model.velocities.push(velocity);
    Ok(())
}

/// Test whether a command applies to all atoms of a group: it names this group or `all`.
fn is_of(velocity: &Velocity, group: &str) -> bool {
    velocity.group == group || velocity.group == "all"
}

/// Return the velocity of the atoms of a group after the `velocity … set` commands read so far. A component
/// is `None` if it differs between the atoms. With `region`, only atoms of the group that are in this region
/// are used.
///
/// # Errors
/// If the atoms of this group, or of the group of a command, cannot be found, or if there are no atoms. `Err`
/// holds the reason.
pub(super) fn velocities(
    model: &Model,
    group: &str,
    region: Option<&Region>,
) -> std::result::Result<[Option<f64>; 3], &'static str> {
    let commands = &model.velocities;
    if commands.iter().all(|velocity| is_of(velocity, group)) {
        let velocity = commands
            .iter()
            .fold([0.0; 3], |v, command| command.apply(v));
        return Ok(velocity.map(Some));
    }
    let of_group = region_of(model, group).ok_or(NO_SET)?;
    let fixed = match region {
        Some(region) => of_group.intersection(region.clone()),
        None => of_group,
    };
    let mut regions = Vec::new();
    for velocity in commands {
        regions.push(if is_of(velocity, group) {
            None
        } else {
            let region = region_of(model, &velocity.group);
            Some(region.ok_or("a `velocity` command has a group without a region")?)
        });
    }
    let spacing = model.spacing.unwrap_or(1.0);
    let start = |atom: [f64; 3]| {
        let acting = commands.iter().zip(&regions).filter(|(_, region)| {
            let mut region = region.iter();
            region.all(|region| region.contains(atom, spacing))
        });
        acting.fold([0.0; 3], |v, (command, _)| command.apply(v))
    };
    let (atoms, is_complete) = atoms_in(model, &fixed);
    if !is_complete {
        return Err("the lattice is too large to find the velocities of its points");
    }
    let mut all: Option<[Option<f64>; 3]> = None;
    for velocity in atoms.map(start) {
        let known = all.get_or_insert(velocity.map(Some));
        for (known, own) in known.iter_mut().zip(velocity) {
            *known = known.filter(|known| *known == own);
        }
    }
    all.ok_or("no atom is in its group")
}

/// Write the initial velocity that a command sets.
pub(super) fn write(
    translation: &mut Translation,
    model: &Model,
    bodies: &[(u32, String, String)],
    command: &Command,
) {
    let arguments = command.arguments();
    let name = arguments.first().copied().unwrap_or("");
    let mut velocities = model.velocities.iter();
    let Some(at) = velocities.position(|velocity| velocity.node == command.node.id) else {
        let note = "velocities are set by components only";
        translation.leave_out_load(&command.node, "initial", "velocity", note);
        return;
    };
    let is_zero = |velocity: &Velocity| velocity.after == [0.0; 3];
    if model.velocities[..=at].iter().all(is_zero) {
        translation.log.taken(&command.node, "points start at rest");
        return;
    }
    let Some(set) = set(translation, model, bodies, name) else {
        translation.leave_out_load(&command.node, "initial", "velocity", NO_SET);
        return;
    };
    let written = translation.new_name("initial", &set);
    let section = translation.draft.section(&format!("initial.{written}"));
    section
        .set("set", Value::text(set))
        .set("velocity", Value::numbers(&model.velocities[at].after));
    translation
        .log
        .taken(&command.node, format!("[initial.{written}] velocity"));
}
