//! Fixes of LAMMPS: loads, supports, damping, indenters.

use super::groups::{NO_SET, named_region, set, set_in_region};
use super::velocities::velocities;
use super::{Model, wrong};
use crate::error::{Result, excerpt};
use crate::import::draft::{Section, Value};
use crate::import::log::Fate;
use crate::import::regions::{Region, others};
use crate::import::script::{Command, Variables};
use crate::import::translation::Translation;

/// Name of the rigid body of an indenter.
const INDENTER: &str = "indenter";

/// Fix styles that are loads or supports, or change velocities. An entry is the part of a style before the
/// first `/`. For example, `wall` stands for `wall/reflect`.
const LOADS: [&str; 28] = [
    "addforce",
    "addtorque",
    "aveforce",
    "deform",
    "drag",
    "efield",
    "enforce2d",
    "freeze",
    "gravity",
    "indent",
    "langevin",
    "lineforce",
    "momentum",
    "move",
    "nph",
    "npt",
    "nvk",
    "nvt",
    "planeforce",
    "press",
    "recenter",
    "rigid",
    "setforce",
    "smd",
    "spring",
    "temp",
    "viscous",
    "wall",
];

/// Test whether a fix style is a load or a support.
pub(super) fn is_load(style: &str) -> bool {
    style == "nve/noforce" || LOADS.contains(&style.split('/').next().unwrap_or(""))
}

/// Return a fix style without the suffix of an accelerated variant.
pub(super) fn without_suffix(style: &str) -> &str {
    let suffixes = ["/gpu", "/intel", "/kk", "/omp", "/opt"];
    let mut plain = suffixes
        .iter()
        .filter_map(|suffix| style.strip_suffix(suffix));
    plain.next().unwrap_or(style)
}

/// Keyword of a fix, and its values.
type Setting<'w> = (&'w str, &'w [&'w str]);

/// Split the words after the arguments of a fix into keywords and their values. `known` has the keywords,
/// each with the number of its values. `Err` holds the first word that is unknown or has too few values.
fn settings<'w>(
    words: &'w [&'w str],
    known: &[(&str, usize)],
) -> std::result::Result<Vec<Setting<'w>>, &'w str> {
    let mut found = Vec::new();
    let mut rest = words;
    while let [word, after @ ..] = rest {
        let keyword = known.iter().find(|(keyword, _)| keyword == word);
        let values = keyword.and_then(|(_, count)| after.get(..*count));
        let values = values.ok_or(*word)?;
        found.push((*word, values));
        rest = &after[values.len()..];
    }
    Ok(found)
}

/// Return the number of arguments of a fix before its keywords, and the keywords that the import reads.
/// Return `None` for a fix without a counterpart.
fn form(style: &str, first: Option<&str>) -> Option<(usize, &'static [(&'static str, usize)])> {
    let of_load: &[_] = &[("region", 1), ("every", 1), ("energy", 1)];
    let of_support: &[_] = &[("region", 1)];
    let of_motion: &[_] = &[("units", 1)];
    match (style, first) {
        ("addforce", _) => Some((3, of_load)),
        ("setforce", _) => Some((3, of_support)),
        ("move", Some("linear")) => Some((4, of_motion)),
        ("move", Some("wiggle")) => Some((5, of_motion)),
        ("move", Some("variable")) => Some((7, of_motion)),
        _ => None,
    }
}

/// Translate a fix.
pub(super) fn fix(
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
    let style = without_suffix(style);
    match style {
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
                        Err(_) if factor == 1.0 => Value::text(text),
                        Err(_) => Value::text(format!("{factor:?}*({text})")),
                    }
                }
            });
        }
        Ok(vector)
    };
    let name = format!("fix {id}");
    let Some((count, keywords)) = form(style, rest.first().copied()) else {
        let note = format!("fix {style} has no counterpart");
        if is_load(style) {
            translation.leave_out_load(node, "condition", &name, &note);
        } else {
            translation.log.left_out(node, note);
        }
        return Ok(());
    };
    let settings = match settings(rest.get(count..).unwrap_or(&[]), keywords) {
        Ok(settings) => settings,
        Err(word) => {
            let note = format!("the word {} is not read", excerpt(word));
            translation.leave_out_load(node, "condition", &name, &note);
            return Ok(());
        }
    };
    let setting = |keyword: &str| {
        let found = settings.iter().find(|(known, _)| *known == keyword);
        found.map(|(_, values)| values[0])
    };
    if let Some(steps) = setting("every")
        && variables.number(steps) != Ok(1.0)
    {
        let note = "the force does not act in every step";
        translation.leave_out_load(node, "condition", &name, note);
        return Ok(());
    }
    let made = match (style, rest.first().copied()) {
        ("setforce", _) => {
            let zero =
                |k: usize| rest.get(k).and_then(|word| variables.number(word).ok()) == Some(0.0);
            let is_null = |k: usize| rest.get(k) == Some(&"NULL");
            if !(0..3).all(|k| zero(k) || is_null(k)) {
                let note = "forces are set to 0 only, which keeps velocities";
                translation.leave_out_load(node, "condition", &name, note);
                return Ok(());
            }
            let region = setting("region").and_then(|region| named_region(model, region));
            let found = velocities(model, group, region.as_ref());
            let component = |k: usize| match found {
                _ if is_null(k) => Ok(Value::text("free")),
                Ok(velocity) => velocity[k]
                    .map(Value::number)
                    .ok_or("its points start with different velocities"),
                Err(note) => Err(note),
            };
            let components: std::result::Result<Vec<Value>, &str> = (0..3).map(component).collect();
            match components {
                Ok(components) => Some((
                    "velocity",
                    components,
                    "the velocity that points start with",
                )),
                Err(note) => {
                    translation.leave_out_load(node, "condition", &name, note);
                    return Ok(());
                }
            }
        }
        ("move", Some("linear")) => Some((
            "velocity",
            vector(&rest[1..], unit).map_err(|m| wrong(translation, command, m))?,
            "velocity",
        )),
        ("move", Some("variable")) => {
            // Three displacements, then three velocities. A velocity matters only if the displacement of its
            // component is NULL.
            let is_null = |k: usize| rest.get(k) == Some(&"NULL");
            let (key, first) = if (0..3).all(|k| !is_null(1 + k) || is_null(4 + k)) {
                ("displacement", 1)
            } else if (0..3).all(|k| is_null(1 + k)) {
                ("velocity", 4)
            } else {
                let note = "a component has only a velocity, and another one has a displacement";
                translation.leave_out_load(node, "condition", &name, note);
                return Ok(());
            };
            let components = vector(rest.get(first..).unwrap_or(&[]), 1.0);
            let components = components.map_err(|m| wrong(translation, command, m))?;
            Some((key, components, key))
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
            // With `atom_style peri`, LAMMPS divides the force of an atom by the density, so this force is a
            // force density.
            let force = vector(rest, 1.0).map_err(|m| wrong(translation, command, m))?;
            let zero = |value: Value| {
                if value == Value::text("free") {
                    Value::Number("0".to_owned())
                } else {
                    value
                }
            };
            Some((
                "body_force",
                force.into_iter().map(zero).collect(),
                "body_force",
            ))
        }
        _ => None,
    };
    let Some((key, value, note)) = made else {
        let note = "its period is not a number";
        translation.leave_out_load(node, "condition", &name, note);
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
    let region = setting("region");
    let set = match region {
        None => set(translation, model, bodies, group).ok_or(NO_SET),
        Some(region) => set_in_region(translation, model, group, region),
    };
    let set = match set {
        Ok(set) => set,
        Err(note) => {
            translation.leave_out_load(node, "condition", &name, note);
            return Ok(());
        }
    };
    let written = translation.name("condition", &name);
    let mut section = Section::new(format!("condition.{written}"));
    section
        .set("set", Value::text(set))
        .set(key, Value::List(vector));
    translation.add(section);
    let note = format!("[condition.{written}] {note}");
    match region {
        None => translation.log.taken(node, note),
        Some(_) => {
            let note = note + "; on the points that are in the region at the start";
            translation.log.approximated(node, note);
        }
    }
    Ok(())
}

/// Translate an indenter, which becomes a rigid body.
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
        let note = "a rigid body acts on what lies outside of it";
        translation.leave_out_load(node, "rigid", INDENTER, note);
        return Ok(());
    }
    // Position at the start, and the expression of the motion if there is one.
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
        let motion = if start == 0.0 {
            text.clone()
        } else {
            format!("{text} - ({start:?})")
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
                let note = "a rigid body has a fixed radius";
                translation.leave_out_load(node, "rigid", INDENTER, note);
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
            let note = "an indenter is a sphere, a cylinder or a plane";
            translation.leave_out_load(node, "rigid", INDENTER, note);
            return Ok(());
        }
    };
    if let Err(word) = settings(behind, &[("side", 1), ("units", 1), ("vel", 3)]) {
        let note = format!("the word {} is not read", excerpt(word));
        translation.leave_out_load(node, "rigid", INDENTER, &note);
        return Ok(());
    }
    // An older form of the command gives the velocity of the centre.
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
    let written = translation.new_name("rigid", INDENTER);
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
        "[rigid.{written}]: a layer of the points' material in place of the force density K (r − R)² at each atom"
    );
    translation.log.note(node, Fate::Approximated, note);
    if arguments[1] != "all" {
        translation
            .log
            .approximated(node, "it acts on all points, not only on its group");
    }
    Ok(())
}
