//! Commands that come before the first run and define atoms and their properties.

use super::fixes::without_suffix;
use super::groups::Group;
use super::materials::Coefficients;
use super::run::WORKINGS;
use super::{Atoms, Model, Velocity, wrong};
use crate::error::{Result, excerpt};
use crate::import::regions::{Region, region};
use crate::import::script::{Command, Variables};
use crate::import::translation::Translation;

/// Reason for rejecting the units `lj`, and what to do.
pub(super) const UNITS_LJ: &str = "the scale of a lattice is a density in the units `lj`; convert the script to si, cgs, \
                                   micro or nano";

/// Keys of `set` that move atoms or set their velocity.
const INITIAL_VALUES: [&str; 6] = ["x", "y", "z", "vx", "vy", "vz"];

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
            if arguments.iter().any(|word| word.contains('p')) {
                log.left_out(
                    node,
                    "there are no periodic boundaries; the body ends there",
                )
            } else {
                log.taken(node, "bodies are free")
            }
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
                    log.left_out(node, format!("atoms of style {style} are not created"));
                    return Ok(());
                }
            };
            let (name, region) = region;
            let region = model
                .bounds
                .map_or(region.clone(), |bounds| region.within(bounds));
            if !region.is_finite() {
                return Err(fail("the region has no end".to_owned()));
            }
            model.atoms.push(Atoms { kind, region, name });
            log.taken(node, "a body");
        }
        "delete_atoms" => {
            let region = match (argument(0)?, argument(1)?) {
                ("region", name) => model.regions.iter().find(|(other, ..)| other == name),
                _ => None,
            };
            let Some((_, region, _)) = region else {
                log.left_out(node, "only atoms of a region can be left out of a body");
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
            let group = match arguments.get(1).copied() {
                Some("type") if arguments.len() == 3 => Group::Type(number(2)? as u32),
                Some("region") if arguments.len() == 3 => Group::Region(arguments[2].to_owned()),
                _ => {
                    log.left_out(node, "a group must be that of one type or region");
                    return Ok(());
                }
            };
            log.taken(node, "the set of what uses it");
            model.groups.push((name.to_owned(), group, node.clone()));
        }
        "velocity" => velocity(translation, variables, model, command)?,
        "variable" => log.taken(node, "its value where it is used"),
        "fix" if arguments.get(2).map(|style| without_suffix(style)) == Some("viscous") => {
            let drag = number(3)?;
            match argument(1)? {
                "all" if arguments.len() > 4 => {
                    log.left_out(node, "damping is equal for all types of atoms")
                }
                "all" => {
                    model.drag = Some(drag);
                    log.taken(
                        node,
                        "damping of the materials: force over velocity, density and volume",
                    );
                }
                _ => log.left_out(node, "damping acts on all points of a material"),
            }
        }
        "read_data" | "read_restart" => {
            let message =
                "atoms of a file are not read; write them as a point file, and their deck by hand";
            return Err(fail(message.to_owned()));
        }
        name => {
            if let Some(reason) = ignored(name) {
                log.left_out(node, reason);
            }
        }
    }
    Ok(())
}

/// Return the reason why a command is left out, if it is left out both before and after the first `run`.
/// Return `None` for other commands.
pub(super) fn ignored(name: &str) -> Option<&'static str> {
    match name {
        "if" | "jump" | "next" | "include" => Some("control flow is not followed"),
        name if WORKINGS.contains(&name) => Some("concerns the way LAMMPS works or what it prints"),
        _ => None,
    }
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
    let kind = match arguments[..] {
        ["group", "all", ..] => None,
        ["type", kind, ..] => match kind.parse::<u32>() {
            Ok(kind) => Some(kind),
            Err(_) => {
                log.left_out(node, "properties are those of all atoms or of one type");
                return Ok(());
            }
        },
        ["group", name, ..] => {
            let group = model.groups.iter().find(|(other, ..)| other == name);
            match group {
                Some((_, Group::Type(kind), _)) => Some(*kind),
                _ => {
                    log.left_out(node, "properties are those of all atoms or of one type");
                    return Ok(());
                }
            }
        }
        _ => {
            log.left_out(node, "properties are those of all atoms or of one type");
            return Ok(());
        }
    };
    let mut rest = &arguments[2..];
    while let [key, value, others @ ..] = rest {
        let number = variables
            .number(value)
            .map_err(|message| wrong(translation, command, message))?;
        match *key {
            "density" => {
                model.densities.push((kind, number));
                log.taken(node, "density of the material");
            }
            "volume" => {
                let cell = model.spacing.map_or(f64::NAN, |spacing| spacing.powi(3));
                if (number / cell - 1.0).abs() < 1e-6 {
                    log.taken(node, "the volume of a lattice cell")
                } else {
                    log.approximated(
                        node,
                        format!("the volume of a point is that of a cell, {cell:e}"),
                    )
                }
            }
            key if INITIAL_VALUES.contains(&key) => {}
            key => log.left_out(node, format!("{} is no property of points", excerpt(key))),
        }
        rest = others;
    }
    Ok(())
}

/// Read `velocity … set`. Other styles of `velocity` are not read.
fn velocity(
    translation: &Translation,
    variables: &Variables,
    model: &mut Model,
    command: &Command,
) -> Result<()> {
    let log = &translation.log;
    let arguments = command.arguments();
    let [group, "set", vx, vy, vz, options @ ..] = &arguments[..] else {
        return Ok(());
    };
    let is_box = options.windows(2).any(|pair| pair == ["units", "box"]);
    let unit = if is_box {
        1.0
    } else {
        model.spacing.unwrap_or(1.0)
    };
    let is_earlier = |earlier: &Velocity| earlier.group == *group || earlier.group == "all";
    let found = model.velocities.iter().rposition(is_earlier);
    let mut components = found.map_or([None; 3], |at| model.velocities[at].components);
    let others = &model.velocities[found.map_or(0, |at| at + 1)..];
    if [vx, vy, vz].contains(&&"NULL") && !others.is_empty() {
        log.approximated(
            &command.node,
            "NULL keeps the velocity of the same group or of all, not that of a group in between",
        );
    }
    for (component, word) in components.iter_mut().zip([vx, vy, vz]) {
        if *word != "NULL" {
            let value = variables
                .number(word)
                .map_err(|message| wrong(translation, command, message))?;
            *component = Some(unit * value);
        }
    }
    if options.contains(&"sum") && options.windows(2).any(|pair| pair == ["sum", "yes"]) {
        log.approximated(&command.node, "velocities replace earlier ones");
    }
    model.velocities.push(Velocity {
        node: command.node.id,
        group: (*group).to_owned(),
        components,
    });
    Ok(())
}
