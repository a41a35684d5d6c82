//! Commands that come before the first run and define atoms and their properties.

use super::fixes::without_suffix;
use super::groups::{Group, find, region_of};
use super::materials::Coefficients;
use super::run::WORKINGS;
use super::types::retype;
use super::{Atoms, Model, velocities, wrong};
use crate::error::{Result, excerpt};
use crate::import::log::{NO_CONTROL_FLOW, NO_PERIODICITY, OTHER_MODEL};
use crate::import::regions::{Region, region};
use crate::import::script::{Command, Variables};
use crate::import::translation::Translation;

/// Reason for rejecting the units `lj`, and what to do.
pub(super) const UNITS_LJ: &str = "the scale of a lattice is a density in the units `lj`; convert the script to si, cgs, \
                                   micro or nano";

/// Keys of `set` that move atoms or set their velocity.
const INITIAL_VALUES: [&str; 6] = ["x", "y", "z", "vx", "vy", "vz"];

/// Commands that change atoms, materials or bonds. The import reads some of them, but none after the first
/// `run`.
pub(super) const CHANGES: [&str; 10] = [
    "change_box",
    "create_atoms",
    "create_bonds",
    "delete_atoms",
    "delete_bonds",
    "displace_box",
    "pair_coeff",
    "pair_style",
    "replicate",
    "set",
];

/// Read a command that defines atoms or their properties.
pub(super) fn setup(
    translation: &mut Translation,
    variables: &Variables,
    model: &mut Model,
    command: &Command,
) -> Result<()> {
    let log = &translation.log;
    let node = &command.node;
    let arguments = command.arguments();
    let fail = |message: String| wrong(translation, command, message);
    let argument = |k: usize| {
        let missing = || fail(format!("argument {} is missing", k + 1));
        arguments.get(k).copied().ok_or_else(missing)
    };
    let number = |k: usize| variables.number(argument(k)?).map_err(fail);
    let lose_model = |reason: String| {
        log.left_out(node, reason);
        log.left_out(node, OTHER_MODEL);
    };
    match command.name() {
        "units" => {
            match argument(0)? {
                "si" => log.taken(node, "SI units"),
                "cgs" | "micro" | "nano" => {
                    log.approximated(node, "numbers stay as they are, in the units of the script")
                }
                "lj" => return Err(fail(UNITS_LJ.to_owned())),
                name => {
                    let message = format!(
                        "the units {} are no consistent system; convert the script to si, cgs, micro or nano",
                        excerpt(name)
                    );
                    return Err(fail(message));
                }
            }
            model.has_units = true;
        }
        "dimension" => match argument(0)? {
            "3" => log.taken(node, "dimension = \"3d\""),
            _ => log.approximated(node, "the problem becomes one in space"),
        },
        "boundary" => {
            let words = [argument(0)?, argument(1)?, argument(2)?];
            if words.iter().any(|word| word.contains('p')) {
                log.left_out(node, NO_PERIODICITY)
            } else {
                log.taken(node, "bodies are free")
            }
            // A word has one letter for both faces, or one letter for the lower and one for the upper face.
            model.has_upper_face = Some(words.map(|word| word.ends_with('s')));
        }
        "atom_style" => log.taken(node, "points with volume and density"),
        "lattice" => {
            if argument(0)? != "sc" {
                return Err(fail(
                    "points need a simple cubic lattice, `lattice sc`".to_owned(),
                ));
            }
            let spacing = number(1)?;
            if spacing <= 0.0 {
                return Err(fail(format!("the spacing must be above 0, is {spacing}")));
            }
            model.spacing = Some(spacing);
            match arguments.get(2).copied() {
                None => {}
                Some("origin") => {
                    for k in 0..3 {
                        model.origin[k] = number(3 + k)?;
                    }
                }
                Some(option) => {
                    return Err(fail(format!("the option {} is not read", excerpt(option))));
                }
            }
            log.taken(node, "[grid] spacing and origin");
        }
        "region" => {
            let name = argument(0)?;
            let known = |name: &str| {
                let mut regions = model.regions.iter();
                regions
                    .find(|(other, ..)| other == name)
                    .map(|(_, region, _)| region.clone())
            };
            let spacing = model.spacing.unwrap_or(1.0);
            match region(variables, &arguments[1..], spacing, &known) {
                Ok(region) => {
                    log.taken(node, "the shape of what uses it");
                    model.regions.push((name.to_owned(), region, node.clone()));
                }
                Err(message) => log.left_out(node, message),
            }
        }
        "create_box" => {
            model.types = number(0)? as u32;
            let found = model
                .regions
                .iter()
                .find(|(name, ..)| arguments.get(1) == Some(&name.as_str()));
            model.bounds = found.map(|(_, region, _)| region.bounds());
            log.taken(node, "bounds of regions without end");
            if model.has_upper_face.is_none() {
                let note = "the script has no `boundary`, so LAMMPS uses the default `p p p`";
                log.approximated(node, note);
                log.approximated(node, NO_PERIODICITY);
            }
        }
        "create_atoms" => {
            let kind = number(0)? as u32;
            let region = match argument(1)? {
                "region" => {
                    let name = argument(2)?;
                    let found = model.regions.iter().find(|(other, ..)| other == name);
                    let found = found.map(|(name, region, _)| (name.clone(), region.clone()));
                    found
                        .ok_or_else(|| fail(format!("the region {} has no shape", excerpt(name))))?
                }
                "box" => {
                    let bounds = model
                        .bounds
                        .ok_or_else(|| fail("there is no box".to_owned()))?;
                    ("box".to_owned(), Region::Block(bounds[0], bounds[1]))
                }
                style => {
                    lose_model(format!("atoms of style {} are not created", excerpt(style)));
                    return Ok(());
                }
            };
            let (name, region) = region;
            let region = model.bounds.map_or(region.clone(), |bounds| {
                let has_face = model.has_upper_face.unwrap_or([false; 3]);
                let [lower, mut upper] = bounds;
                for (upper, has_face) in upper.iter_mut().zip(has_face) {
                    if !has_face {
                        *upper = Region::below(*upper, model.spacing.unwrap_or(1.0));
                    }
                }
                region.within(bounds).clipped([lower, upper])
            });
            if !region.is_finite() {
                return Err(fail("the region has no end".to_owned()));
            }
            model.atoms.push(Atoms { kind, region, name });
            log.taken(node, "a body");
        }
        "delete_atoms" => {
            let region = match (argument(0)?, argument(1)?) {
                ("region", name) => {
                    let mut regions = model.regions.iter();
                    let found = regions.find(|(other, ..)| other == name);
                    found.map(|(_, region, _)| region.clone())
                }
                ("group", name) => {
                    if let Some(Group::Type(kind)) = find(model, name) {
                        model.atoms.retain(|atoms| atoms.kind != kind);
                        log.taken(node, "its atoms are in no body");
                        return Ok(());
                    }
                    region_of(model, name)
                }
                _ => None,
            };
            let Some(region) = region else {
                lose_model("only atoms of a region or type can be left out of a body".to_owned());
                return Ok(());
            };
            for atoms in &mut model.atoms {
                let parts = vec![atoms.region.clone(), region.within(atoms.region.bounds())];
                atoms.region = Region::Difference(parts);
            }
            log.taken(node, "shape.difference of the bodies");
        }
        "pair_style" => {
            let style = argument(0)?;
            let style = style.strip_suffix("/omp").unwrap_or(style);
            model.style = Some((style.to_owned(), node.clone()));
        }
        "pair_coeff" => {
            let kind = |word: &str| match word {
                "*" => Ok(0),
                word => word.parse::<u32>().map_err(|_| {
                    fail(format!(
                        "the type must be a number or *, is {}",
                        excerpt(word)
                    ))
                }),
            };
            let types = [kind(argument(0)?)?, kind(argument(1)?)?];
            let values = arguments[2..]
                .iter()
                .map(|word| variables.number(word).map_err(fail));
            let values = values.collect::<Result<Vec<_>>>()?;
            model.coefficients.push(Coefficients {
                types,
                values,
                node: node.clone(),
            });
        }
        "set" => properties(translation, variables, model, command)?,
        "group" => {
            let name = argument(0)?;
            let mut groups = model.groups.iter_mut();
            if let Some((_, group, _)) = groups.find(|(other, ..)| other == name) {
                *group = Group::Other;
                log.left_out(node, "a group must have one definition");
                return Ok(());
            }
            let group = match arguments.get(1).copied() {
                Some("type") if arguments.len() == 3 => Group::Type(number(2)? as u32),
                Some("region") if arguments.len() == 3 => Group::Region(arguments[2].to_owned()),
                _ => Group::Other,
            };
            if group == Group::Other {
                log.left_out(node, "a group must be that of one type or region");
            } else {
                log.taken(node, "the set of what uses it");
            }
            model.groups.push((name.to_owned(), group, node.clone()));
        }
        "velocity" => velocities::read(translation, variables, model, command)?,
        "variable" => log.taken(node, "its value where it is used"),
        "fix" if arguments.get(2).map(|style| without_suffix(style)) == Some("viscous") => {
            let drag = number(3)?;
            let reason = match argument(1)? {
                "all" if arguments.len() > 4 => "damping is equal for all types of atoms",
                "all" => {
                    model.drag = Some(drag);
                    let note = "damping of the materials: force density over velocity and density";
                    log.taken(node, note);
                    return Ok(());
                }
                _ => "damping acts on all points of a material",
            };
            let name = format!("fix {}", argument(0)?);
            translation.leave_out_load(node, "condition", &name, reason);
        }
        "read_data" | "read_restart" => {
            let message =
                "atoms of a file are not read; write them as a point file, and their deck by hand";
            return Err(fail(message.to_owned()));
        }
        "include" => log.taken(node, "its commands are read"),
        name => {
            if let Some(reason) = ignored(command) {
                log.left_out(node, reason);
            } else if CHANGES.contains(&name) {
                lose_model(format!("{name} has no counterpart"));
            }
        }
    }
    Ok(())
}

/// Return the reason why a command is left out, if it is left out both before and after the first `run`.
/// Return `None` for other commands.
pub(super) fn ignored(command: &Command) -> Option<&'static str> {
    match command.name() {
        "jump" => Some(NO_CONTROL_FLOW),
        "if" if has_effect(command) => Some(NO_CONTROL_FLOW),
        "if" | "next" => Some("control flow is not followed"),
        name if WORKINGS.contains(&name) => Some("concerns the way LAMMPS works or what it prints"),
        _ => None,
    }
}

/// Test whether an `if` may run a command that affects the results.
fn has_effect(command: &Command) -> bool {
    let arguments = command.arguments();
    let mut words = arguments.iter().skip_while(|word| **word != "then");
    while let Some(word) = words.next() {
        match *word {
            "then" | "else" => {}
            "elif" => {
                words.next();
            }
            word => {
                let name = word.split_whitespace().next().unwrap_or("");
                if name != "quit" && !WORKINGS.contains(&name) {
                    return true;
                }
            }
        }
    }
    false
}

/// Return the first key of `set` that moves atoms or sets their velocity.
pub(super) fn initial_value(command: &Command) -> Option<&str> {
    let arguments = command.arguments();
    let mut keys = arguments.into_iter().skip(2).step_by(2);
    keys.find(|key| INITIAL_VALUES.contains(key))
}

/// Read the densities and volumes of a `set` command.
fn properties(
    translation: &mut Translation,
    variables: &Variables,
    model: &mut Model,
    command: &Command,
) -> Result<()> {
    let node = &command.node;
    let arguments = command.arguments();
    if let Some(key) = initial_value(command) {
        let note = format!(
            "{} is not set; points start on the lattice, with the velocities of `velocity`",
            excerpt(key)
        );
        translation.leave_out_load(node, "initial", "set", &note);
    }
    let log = &translation.log;
    let lose = |reason: &str| {
        log.left_out(node, reason);
        log.left_out(node, OTHER_MODEL);
    };
    let pairs: Vec<(&str, &str)> = arguments[arguments.len().min(2)..]
        .chunks_exact(2)
        .map(|pair| (pair[0], pair[1]))
        .collect();
    let number = |value: &str| {
        let number = variables.number(value);
        number.map_err(|message| wrong(translation, command, message))
    };
    for (_, value) in pairs.iter().filter(|(key, _)| *key == "type") {
        let kind = number(value)? as u32;
        match retype(model, &arguments, kind) {
            Ok(()) => log.taken(node, "the type of atoms"),
            Err(reason) => lose(reason),
        }
    }
    let is_other = |(key, _): &&(&str, &str)| *key != "type" && !INITIAL_VALUES.contains(key);
    let pairs: Vec<_> = pairs.iter().filter(is_other).collect();
    if pairs.is_empty() {
        return Ok(());
    }
    let kind = match arguments[..] {
        ["group", name, ..] => match find(model, name) {
            Some(Group::All) => Some(None),
            Some(Group::Type(kind)) => Some(Some(kind)),
            _ => None,
        },
        ["type", kind, ..] => kind.parse::<u32>().ok().map(Some),
        _ => None,
    };
    let Some(kind) = kind else {
        lose("properties are those of all atoms or of one type");
        return Ok(());
    };
    for (key, value) in pairs {
        match *key {
            "density" => {
                model.densities.push((kind, number(value)?));
                log.taken(node, "density of the material");
            }
            "volume" => {
                let cell = model.spacing.map_or(f64::NAN, |spacing| spacing.powi(3));
                if (number(value)? / cell - 1.0).abs() < 1e-6 {
                    log.taken(node, "the volume of a lattice cell")
                } else {
                    let note = format!("the volume of a point is that of a cell, {cell:e}");
                    log.approximated(node, note);
                    log.approximated(node, OTHER_MODEL);
                }
            }
            key => log.left_out(node, format!("{} is no property of points", excerpt(key))),
        }
    }
    Ok(())
}
