//! Input scripts of LAMMPS with `atom_style peri`.

use std::collections::HashMap;
use std::f64::consts::PI;

use super::bodies::{self, Body, Criterion, DamageModel, Material};
use super::draft::{Section, Value};
use super::elastic::Constants;
use super::log::Fate;
use super::regions::{Region, others, region};
use super::script::{Command, Script, Variables};
use super::translation::Translation;
use super::tree::{Content, Node};
use crate::error::{Result, excerpt};

/// Commands that concern the way LAMMPS works or what it prints.
const WORKINGS: [&str; 27] = [
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

/// Fields of atoms in a dump, and of computes.
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

/// Atoms that a command creates.
struct Atoms {
    kind: u32,
    region: Region,
    /// Name of their region.
    name: String,
}

/// Coefficients of a pair of types.
struct Coefficients {
    types: [u32; 2],
    values: Vec<f64>,
    node: Node,
}

/// The velocity that a command sets.
struct Velocity {
    /// Node of the command.
    node: usize,
    group: String,
    /// Its components; `None` if neither the command nor an earlier one sets them.
    components: [Option<f64>; 3],
}

/// What a script says of its atoms, gathered before the deck is written.
#[derive(Default)]
struct Model {
    spacing: Option<f64>,
    origin: [f64; 3],
    regions: Vec<(String, Region, Node)>,
    bounds: Option<[[f64; 3]; 2]>,
    types: u32,
    atoms: Vec<Atoms>,
    style: Option<(String, Node)>,
    coefficients: Vec<Coefficients>,
    /// Type, or all, and density.
    densities: Vec<(Option<u32>, f64)>,
    /// Names of groups and their selections.
    groups: Vec<(String, Group, Node)>,
    /// Damping of all atoms, force over velocity.
    drag: Option<f64>,
    /// Velocities of groups in the order of the commands.
    velocities: Vec<Velocity>,
    computes: Vec<(String, String)>,
    fields: Vec<&'static str>,
}

/// What a group selects.
#[derive(Debug, Clone, PartialEq)]
enum Group {
    All,
    Type(u32),
    Region(String),
}

/// The tree of a script, whose keys are the commands.
pub fn tree(script: &Script) -> Node {
    let commands = script.commands.iter();
    let entries = commands.map(|command| (command.name().to_owned(), command.node.clone()));
    Node {
        id: 0,
        line: 1,
        content: Content::Table(entries.collect()),
    }
}

/// Translate a script.
///
/// # Errors
/// If what a run needs is missing or wrong.
pub fn translate(translation: &mut Translation, script: &Script) -> Result<()> {
    let commands = &script.commands;
    let first = commands.iter().position(|command| command.name() == "run");
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
    let bodies = write_bodies(translation, &mut model)?;
    let mut run = Run::default();
    // Fixes and outputs look their variables up when a run starts.
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
        }
    }
    for command in after {
        read(translation, &mut variables, command)?;
        follow(translation, &variables, &mut run, command)?;
    }
    run.write(translation, &model)
}

/// Fixes in front of the first run that do not act in it, by their nodes, and why.
fn without_effect(commands: &[Command]) -> HashMap<usize, &'static str> {
    let mut acting: HashMap<&str, usize> = HashMap::new();
    let mut without = HashMap::new();
    for command in commands {
        let Some(id) = command.words.get(1) else {
            continue;
        };
        match command.name() {
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

/// An error about a command.
fn wrong(
    translation: &Translation,
    command: &Command,
    message: impl AsRef<str>,
) -> crate::error::Error {
    let message = format!("{}: {}", command.name(), message.as_ref());
    translation.error(command.node.line, message)
}

/// Read a command that defines atoms or their properties.
fn setup(
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
        "units" => match argument(0)? {
            "si" => log.taken(node, "SI units"),
            _ => log.approximated(node, "numbers stay as they are, in the units of the script"),
        },
        "dimension" => match argument(0)? {
            "3" => log.taken(node, "dimension = \"3d\""),
            _ => log.approximated(node, "the problem becomes one in space"),
        },
        "boundary" => match arguments.iter().any(|word| word.contains('p')) {
            true => log.left_out(
                node,
                "there are no periodic boundaries; the body ends there",
            ),
            false => log.taken(node, "bodies are free"),
        },
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
        "fix" if arguments.get(2) == Some(&"viscous") => {
            let drag = number(3)?;
            match argument(1)? {
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

/// Why a command is left out wherever it stands.
fn ignored(name: &str) -> Option<&'static str> {
    match name {
        "if" | "jump" | "next" | "include" => Some("control flow is not followed"),
        name if WORKINGS.contains(&name) => Some("concerns the way LAMMPS works or what it prints"),
        _ => None,
    }
}

/// Read `set`: densities and volumes.
fn properties(
    translation: &Translation,
    variables: &Variables,
    model: &mut Model,
    command: &Command,
) -> Result<()> {
    let log = &translation.log;
    let node = &command.node;
    let arguments = command.arguments();
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
                match (number / cell - 1.0).abs() < 1e-6 {
                    true => log.taken(node, "the volume of a lattice cell"),
                    false => log.approximated(
                        node,
                        format!("the volume of a point is that of a cell, {cell:e}"),
                    ),
                }
            }
            key => log.left_out(node, format!("{} is no property of points", excerpt(key))),
        }
        rest = others;
    }
    Ok(())
}

/// Read `velocity`.
fn velocity(
    translation: &Translation,
    variables: &Variables,
    model: &mut Model,
    command: &Command,
) -> Result<()> {
    let log = &translation.log;
    let arguments = command.arguments();
    let [group, "set", vx, vy, vz, options @ ..] = &arguments[..] else {
        log.left_out(&command.node, "velocities are set by components only");
        return Ok(());
    };
    let is_box = options.windows(2).any(|pair| pair == ["units", "box"]);
    let unit = match is_box {
        true => 1.0,
        false => model.spacing.unwrap_or(1.0),
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

/// The values of a material's coefficients.
fn coefficients(model: &Model, kind: u32) -> Option<&Coefficients> {
    let fits = |of: u32| of == 0 || of == kind;
    let found = model.coefficients.iter().rev();
    let mut found = found.filter(|c| fits(c.types[0]) && fits(c.types[1]));
    found.next()
}

/// Write materials, damage and bodies; return type, region and name of each body.
fn write_bodies(
    translation: &mut Translation,
    model: &mut Model,
) -> Result<Vec<(u32, String, String)>> {
    translation.draft.top("dimension", Value::text("3d"));
    let Some((style, style_node)) = model.style.clone() else {
        return Err(translation.error(1, "the script has no `pair_style`"));
    };
    let law = match style.as_str() {
        "peri/pmb" => "pmb",
        "peri/lps" => "ordinary",
        "peri/ves" => "ordinary_viscoelastic",
        "peri/eps" => "ordinary_plastic",
        style => {
            let message = format!(
                "pair_style {} is not read; known are peri/pmb, peri/lps, peri/ves and peri/eps",
                excerpt(style)
            );
            return Err(translation.error(style_node.line, message));
        }
    };
    translation.log.taken(&style_node, format!("the law {law}"));
    let Some(spacing) = model.spacing else {
        return Err(translation.error(1, "the script has no `lattice sc`"));
    };
    if model.atoms.is_empty() {
        return Err(translation.error(1, "the script has no `create_atoms` of a region or the box"));
    }
    let grid = translation.draft.section("grid");
    grid.set("spacing", Value::number(spacing));
    let origin = model.origin.map(|fraction| (fraction - 0.5) * spacing);
    grid.set("origin", Value::numbers(&origin));
    grid.comment("LAMMPS tapers volumes from half a spacing below the horizon up to it.");
    grid.set("volume_correction", Value::text("linear-inside"));
    let mut bodies = Vec::new();
    let mut names = Vec::new();
    let mut materials: Vec<(u32, Material, Option<String>, Value)> = Vec::new();
    for atoms in &model.atoms {
        if !materials.iter().any(|(kind, ..)| *kind == atoms.kind) {
            let made = write_material(translation, model, atoms.kind, law, spacing)?;
            materials.push((atoms.kind, made.0, made.1, made.2));
        }
        let made = materials.iter().find(|(kind, ..)| *kind == atoms.kind);
        let (_, material, damage, horizon) = made.expect("it is made");
        let body = translation.new_name("set", &atoms.name);
        let Value::Table(shape) = atoms.region.shape(spacing) else {
            unreachable!("a shape is a table");
        };
        let (kind, value) = shape.into_iter().next().expect("a shape has one key");
        bodies.push(Body {
            name: body.clone(),
            material: material.written.clone(),
            damage: damage.clone(),
            horizon: horizon.clone(),
            points: (format!("shape.{kind}"), value),
        });
        names.push((atoms.kind, atoms.name.clone(), body));
    }
    for coefficients in &model.coefficients {
        let [a, b] = coefficients.types;
        if a != b && a != 0 && b != 0 {
            let note =
                "bonds between bodies have the constants of their ends and the weaker toughness";
            translation.log.left_out(&coefficients.node, note);
        }
    }
    bodies::write(translation, &bodies);
    let contact = translation.draft.section("contact");
    contact.set("model", Value::text("short-range"));
    let note = "[contact] model = \"short-range\": only between points without an intact bond";
    translation.log.approximated(&style_node, note);
    if bodies.len() > 1 {
        translation
            .draft
            .section("interface")
            .set("rule", Value::text("own"));
    }
    Ok(names)
}

/// Write the material and the damage of a type; return them with its horizon.
fn write_material(
    translation: &mut Translation,
    model: &Model,
    kind: u32,
    law: &'static str,
    spacing: f64,
) -> Result<(Material, Option<String>, Value)> {
    let Some(coefficients) = coefficients(model, kind) else {
        let message = format!("there is no `pair_coeff` for type {kind}");
        return Err(translation.error(1, message));
    };
    let node = &coefficients.node;
    let expected = match law {
        "pmb" => "c horizon s00 alpha",
        "ordinary" => "K G horizon s00 alpha",
        "ordinary_viscoelastic" => "K G horizon s00 alpha lambda tau",
        _ => "K G horizon s00 alpha yield_stress",
    };
    let values = &coefficients.values;
    let count = expected.split(' ').count();
    if values.len() != count {
        let message = format!("pair_coeff: needs {count} numbers behind the types: {expected}");
        return Err(translation.error(node.line, message));
    }
    let density = model
        .densities
        .iter()
        .rev()
        .find(|(of, _)| of.is_none_or(|of| of == kind));
    let Some((_, density)) = density else {
        let message = format!("there is no `set … density` for type {kind}");
        return Err(translation.error(1, message));
    };
    let first = if law == "pmb" { 1 } else { 2 };
    let [horizon, stretch, alpha] = [values[first], values[first + 1], values[first + 2]];
    let written = translation.name("material", &format!("type {kind}"));
    let mut section = Section::new(format!("material.{written}.{law}"));
    section.set("density", Value::number(*density));
    let constants = match law {
        "pmb" => {
            // c = 12 E/(π δ⁴) for a Poisson's ratio of 1/4.
            let young = values[0] * PI * horizon.powi(4) / 12.0;
            section.comment(format!(
                "youngs_modulus = c π δ⁴/12 with c = {:e}.",
                values[0]
            ));
            section.set("youngs_modulus", Value::number(young));
            Constants::of(&[("youngs_modulus", young), ("poisson_ratio", 0.25)])
        }
        _ => {
            section.set("bulk_modulus", Value::number(values[0]));
            section.set("shear_modulus", Value::number(values[1]));
            Constants::of(&[("bulk_modulus", values[0]), ("shear_modulus", values[1])])
        }
    };
    match law {
        "ordinary_viscoelastic" => {
            section.set("relaxing_share", Value::number(values[5]));
            section.set("relaxation_time", Value::number(values[6]));
        }
        "ordinary_plastic" => {
            section.set("yield_stress", Value::number(values[5]));
        }
        _ => {}
    }
    if let Some(drag) = model.drag {
        section.set("damping", Value::number(drag / (density * spacing.powi(3))));
    }
    translation.add(section);
    let note = format!("[material.{written}.{law}] and the horizon");
    match law {
        "ordinary_plastic" => {
            let note = note + "; the yield stress has another formula";
            translation.log.approximated(node, note);
        }
        _ => translation.log.taken(node, note),
    }
    let material = Material {
        read: format!("type {kind}"),
        written,
        law,
        constants,
    };
    let damage = DamageModel {
        read: format!("type {kind}"),
        criterion: Criterion::Stretch(Value::number(stretch), stretch),
        node: node.clone(),
    };
    let damage = bodies::damage(translation, &damage, &material, horizon)?;
    if let (Some(damage), true) = (&damage, alpha != 0.0) {
        let kind = if law == "ordinary_plastic" {
            "energy"
        } else {
            "critical_stretch"
        };
        let section = translation
            .draft
            .section(&format!("damage.{damage}.{kind}"));
        section.set("alpha", Value::number(alpha));
    }
    Ok((material, damage, Value::number(horizon)))
}

/// The parts of the runs.
#[derive(Default)]
struct Run {
    /// Steps and time step, s, of the runs; those with the same step are joined.
    runs: Vec<(u64, f64)>,
    /// The number of the step at which the next run starts.
    at: u64,
    output: Option<u64>,
    history: Option<u64>,
}

/// The set of the new deck for a group; `None` if it has none.
fn set(
    translation: &mut Translation,
    model: &Model,
    bodies: &[(u32, String, String)],
    name: &str,
) -> Option<String> {
    let group = match name {
        "all" => Group::All,
        name => {
            let found = model.groups.iter().find(|(other, ..)| other == name);
            found.map(|(_, group, _)| group.clone())?
        }
    };
    match group {
        Group::All => Some("all".to_owned()),
        Group::Type(kind) => {
            let mut of_type = bodies.iter().filter(|(of, ..)| *of == kind);
            match (of_type.next(), of_type.next()) {
                (Some((.., body)), None) => Some(body.clone()),
                _ => None,
            }
        }
        Group::Region(region) => {
            let (_, region, _) = model.regions.iter().find(|(other, ..)| *other == region)?;
            let region = model
                .bounds
                .map_or(region.clone(), |bounds| region.within(bounds));
            let taken = bodies.iter().any(|(.., body)| body == name);
            let wanted = if taken {
                format!("group {name}")
            } else {
                name.to_owned()
            };
            let written = translation.name("set", &wanted);
            if !translation.draft.has(&format!("set.{written}")) {
                let mut section = Section::new(format!("set.{written}"));
                section.set("shape", region.shape(model.spacing?));
                translation.add(section);
            }
            Some(written)
        }
    }
}

/// A number of steps, which is `least` or more.
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
    match (least..1e15).contains(&number) {
        true => Ok(number as u64),
        false => Err(fail(format!("the number of steps must be {least} or more"))),
    }
}

/// Read the number of the step at which the next run starts.
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

/// Read the first run, or a command behind it, of which only those that change the end of the runs count.
fn follow(
    translation: &Translation,
    variables: &Variables,
    run: &mut Run,
    command: &Command,
) -> Result<()> {
    let node = &command.node;
    match command.name() {
        "run" => {
            let fail = |message: &str| wrong(translation, command, message);
            let step = variables.step.filter(|step| *step > 0.0);
            let step = step.ok_or_else(|| fail("there is no `timestep` above 0 before it"))?;
            let is_end = command.arguments().contains(&"upto");
            let least = if is_end { 0.0 } else { 1.0 };
            let given = steps(translation, variables, command, 0, least)?;
            let count = match is_end {
                true => given.checked_sub(run.at).ok_or_else(|| {
                    fail(&format!(
                        "the last step {given} is before the step {}",
                        run.at
                    ))
                })?,
                false => given,
            };
            run.at = run.at.saturating_add(count);
            match run.runs.last_mut() {
                Some((steps, known)) if *known == step => *steps = steps.saturating_add(count),
                _ => run.runs.push((count, step)),
            }
            translation.log.taken(node, "[time] end");
        }
        "timestep" => match run.runs.first() {
            Some((_, first)) if variables.step != Some(*first) => translation.log.approximated(
                node,
                "[time] end counts the steps behind it with this step; [time] step stays that of the first `run`",
            ),
            _ => translation.log.taken(node, "[time] step"),
        },
        "reset_timestep" => reset(translation, variables, run, command)?,
        "variable" => translation.log.taken(node, "its value where it is used"),
        name => {
            let reason = ignored(name);
            let reason = reason.unwrap_or("changes after the first `run` are not followed");
            translation.log.left_out(node, reason);
        }
    }
    Ok(())
}

/// Read a command that acts during the run.
fn simulate(
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
                    let id = arguments.first().copied().unwrap_or("");
                    model.computes.push((id.to_owned(), style.to_owned()));
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
        "velocity" => initial(translation, model, bodies, command),
        "fix" => fix(translation, variables, model, bodies, command)?,
        "unfix" => translation.log.taken(node, "its fix is left out"),
        "uncompute" => translation
            .log
            .left_out(node, "fields that a `compute` adds stay"),
        "minimize" => {
            translation.log.left_out(
                node,
                "there is no minimization; relaxation finds equilibria",
            );
        }
        _ => {}
    }
    Ok(())
}

/// Write the initial velocity of a command.
fn initial(
    translation: &mut Translation,
    model: &Model,
    bodies: &[(u32, String, String)],
    command: &Command,
) {
    let arguments = command.arguments();
    let name = arguments.first().copied().unwrap_or("");
    let mut velocities = model.velocities.iter();
    let Some(at) = velocities.position(|velocity| velocity.node == command.node.id) else {
        return;
    };
    let components = |velocity: &Velocity| velocity.components.map(|v| v.unwrap_or(0.0));
    let is_zero = |velocity: &Velocity| components(velocity) == [0.0; 3];
    if model.velocities[..=at].iter().all(is_zero) {
        translation.log.taken(&command.node, "points start at rest");
        return;
    }
    let Some(set) = set(translation, model, bodies, name) else {
        translation
            .log
            .left_out(&command.node, "its group is no body or region");
        return;
    };
    let written = translation.new_name("initial", &set);
    let components = components(&model.velocities[at]);
    let section = translation.draft.section(&format!("initial.{written}"));
    section
        .set("set", Value::text(set))
        .set("velocity", Value::numbers(&components));
    translation
        .log
        .taken(&command.node, format!("[initial.{written}] velocity"));
}

/// Read a fix.
fn fix(
    translation: &mut Translation,
    variables: &Variables,
    model: &Model,
    bodies: &[(u32, String, String)],
    command: &Command,
) -> Result<()> {
    let node = &command.node;
    let arguments = command.arguments();
    let [id, group, style, rest @ ..] = &arguments[..] else {
        return Err(wrong(
            translation,
            command,
            "needs an id, a group and a style",
        ));
    };
    let spacing = model.spacing.unwrap_or(1.0);
    let is_box = rest.windows(2).any(|pair| pair == ["units", "box"]);
    let unit = if is_box { 1.0 } else { spacing };
    match *style {
        "nve" => {
            translation.log.taken(node, "velocity Verlet");
            return Ok(());
        }
        "viscous" => return Ok(()),
        "indent" => return indent(translation, variables, model, command, unit),
        _ => {}
    }
    let vector = |words: &[&str], factor: f64| -> std::result::Result<Vec<Value>, String> {
        let mut vector = Vec::new();
        for k in 0..3 {
            let word = words.get(k).ok_or("a number is missing")?;
            vector.push(match *word {
                "NULL" => Value::text("free"),
                word => {
                    let text = variables.of_time(word)?;
                    match text.parse::<f64>() {
                        Ok(value) => Value::number(factor * value),
                        Err(_) => Value::text(format!("{factor:?}*({text})")),
                    }
                }
            });
        }
        Ok(vector)
    };
    let volume = spacing.powi(3);
    let made = match (*style, rest.first().copied()) {
        ("setforce", _) => {
            let zero =
                |k: usize| rest.get(k).and_then(|word| variables.number(word).ok()) == Some(0.0);
            let is_null = |k: usize| rest.get(k) == Some(&"NULL");
            if !(0..3).all(|k| zero(k) || is_null(k)) {
                translation
                    .log
                    .left_out(node, "forces are set to 0 only, which keeps velocities");
                return Ok(());
            }
            let velocity = model
                .velocities
                .iter()
                .rev()
                .find(|velocity| velocity.group == *group || velocity.group == "all");
            let velocity = velocity.map_or([None; 3], |velocity| velocity.components);
            let component = |k: usize| match is_null(k) {
                true => Value::text("free"),
                false => Value::number(velocity[k].unwrap_or(0.0)),
            };
            Some((
                "velocity",
                (0..3).map(component).collect(),
                "the velocity that points start with",
            ))
        }
        ("move", Some("linear")) => Some((
            "velocity",
            vector(&rest[1..], unit).map_err(|m| wrong(translation, command, m))?,
            "velocity",
        )),
        ("move", Some("variable")) => {
            let displacement =
                vector(&rest[1..], 1.0).map_err(|m| wrong(translation, command, m))?;
            Some(("displacement", displacement, "displacement"))
        }
        ("move", Some("wiggle")) => {
            let period = rest.get(4).and_then(|word| variables.number(word).ok());
            let amplitudes =
                vector(&rest[1..], unit).map_err(|m| wrong(translation, command, m))?;
            period.map(|period| {
                let wave = |amplitude: Value| match amplitude {
                    Value::Number(text) => Value::text(format!("{text}*sin(2*pi*t/{period:?})")),
                    free => free,
                };
                (
                    "displacement",
                    amplitudes.into_iter().map(wave).collect(),
                    "displacement",
                )
            })
        }
        ("addforce", _) => {
            let force = vector(rest, 1.0 / volume).map_err(|m| wrong(translation, command, m))?;
            let zero = |value: Value| match value == Value::text("free") {
                true => Value::Number("0".to_owned()),
                false => value,
            };
            Some((
                "body_force",
                force.into_iter().map(zero).collect(),
                "body_force: force over the volume of a point",
            ))
        }
        _ => None,
    };
    let Some((key, value, note)) = made else {
        translation
            .log
            .left_out(node, format!("fix {style} has no counterpart"));
        return Ok(());
    };
    let vector: Vec<Value> = value;
    if vector
        .iter()
        .all(|component| *component == Value::text("free"))
    {
        translation.log.left_out(node, "prescribes nothing");
        return Ok(());
    }
    let Some(set) = set(translation, model, bodies, group) else {
        translation
            .log
            .left_out(node, "its group is no body or region");
        return Ok(());
    };
    let written = translation.name("condition", &format!("fix {id}"));
    let mut section = Section::new(format!("condition.{written}"));
    section
        .set("set", Value::text(set))
        .set(key, Value::List(vector));
    translation.add(section);
    translation
        .log
        .taken(node, format!("[condition.{written}] {note}"));
    Ok(())
}

/// Read an indenter, which becomes a rigid body.
fn indent(
    translation: &mut Translation,
    variables: &Variables,
    model: &Model,
    command: &Command,
    unit: f64,
) -> Result<()> {
    let arguments = command.arguments();
    let node = &command.node;
    let words = arguments.get(4..).unwrap_or(&[]);
    let fail = |message: String| wrong(translation, command, message);
    if words.windows(2).any(|pair| pair == ["side", "in"]) {
        translation
            .log
            .left_out(node, "a rigid body acts on what lies outside of it");
        return Ok(());
    }
    // The value at the start, and the motion after it.
    let position = |word: Option<&&str>| -> Result<(f64, Option<String>)> {
        let word = word.ok_or_else(|| fail("a number is missing".to_owned()))?;
        if !word.starts_with("v_") {
            return Ok((unit * variables.number(word).map_err(fail)?, None));
        }
        let text = variables.of_time(word).map_err(fail)?;
        let expression =
            crate::expression::Expression::of(&text).map_err(|error| fail(error.message))?;
        let start = expression.evaluate([0.0; 3], 0.0);
        let moves = expression.as_constant().is_none();
        let motion = match start == 0.0 {
            true => text.clone(),
            false => format!("{text} - ({start:?})"),
        };
        Ok((start, moves.then_some(motion)))
    };
    let mut motion: [Option<String>; 3] = Default::default();
    let (shape, behind) = match words.first().copied() {
        Some("sphere") => {
            let mut centre = [0.0; 3];
            for k in 0..3 {
                (centre[k], motion[k]) = position(words.get(1 + k))?;
            }
            let (radius, grows) = position(words.get(4))?;
            if grows.is_some() {
                translation
                    .log
                    .left_out(node, "a rigid body has a fixed radius");
                return Ok(());
            }
            (Region::Sphere(centre, radius).shape(0.0), &words[5..])
        }
        Some("cylinder") => {
            let axis = ["x", "y", "z"]
                .iter()
                .position(|axis| words.get(1) == Some(axis));
            let axis = axis.ok_or_else(|| fail("the axis must be x, y or z".to_owned()))?;
            let mut centre = [0.0; 2];
            for (k, other) in others(axis).into_iter().enumerate() {
                (centre[k], motion[other]) = position(words.get(2 + k))?;
            }
            let (radius, _) = position(words.get(4))?;
            let bounds = model
                .bounds
                .ok_or_else(|| fail("there is no box".to_owned()))?;
            let [lower, upper] = [bounds[0][axis], bounds[1][axis]];
            let length = upper - lower;
            let ends = [lower - length, upper + length];
            (
                Region::Cylinder(axis, centre, radius, ends).shape(0.0),
                &words[5..],
            )
        }
        Some("plane") => {
            let axis = ["x", "y", "z"]
                .iter()
                .position(|axis| words.get(1) == Some(axis));
            let axis = axis.ok_or_else(|| fail("the direction must be x, y or z".to_owned()))?;
            let (at, moves) = position(words.get(2))?;
            motion[axis] = moves;
            let sign = if words.get(3) == Some(&"lo") {
                1.0
            } else {
                -1.0
            };
            let (mut through, mut normal) = ([0.0; 3], [0.0; 3]);
            through[axis] = at;
            normal[axis] = sign;
            let table = vec![
                ("through".to_owned(), Value::numbers(&through)),
                ("normal".to_owned(), Value::numbers(&normal)),
            ];
            let plane = Value::Table(vec![("half_space".to_owned(), Value::Table(table))]);
            (plane, words.get(4..).unwrap_or(&[]))
        }
        _ => {
            translation
                .log
                .left_out(node, "an indenter is a sphere, a cylinder or a plane");
            return Ok(());
        }
    };
    // An older form gives the velocity of the centre.
    if let Some(at) = behind.iter().position(|word| *word == "vel") {
        for (k, component) in motion.iter_mut().enumerate() {
            let word = behind
                .get(at + 1 + k)
                .ok_or_else(|| fail("a number is missing".to_owned()))?;
            let speed = unit * variables.number(word).map_err(fail)?;
            if speed != 0.0 {
                *component = Some(format!("{speed:?}*t"));
            }
        }
    }
    let written = translation.new_name("rigid", "indenter");
    let mut section = Section::new(format!("rigid.{written}"));
    let Value::Table(entries) = shape else {
        unreachable!("a shape is a table");
    };
    for (kind, value) in entries {
        let key = match kind.as_str() {
            "half_space" => kind,
            kind => format!("shape.{kind}"),
        };
        section.set(key, value);
    }
    if motion.iter().any(Option::is_some) {
        let component = |motion: &Option<String>| match motion {
            Some(text) => Value::text(text.clone()),
            None => Value::Number("0".to_owned()),
        };
        section.set("motion", Value::list(motion.iter().map(component)));
    }
    translation.add(section);
    let note = format!(
        "[rigid.{written}]: a layer of the points' material in place of the force K (r − R)² on each atom"
    );
    translation.log.note(node, Fate::Approximated, note);
    Ok(())
}

impl Run {
    /// Write time and outputs.
    fn write(self, translation: &mut Translation, model: &Model) -> Result<()> {
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
