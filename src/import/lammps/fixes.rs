//! Fixes of LAMMPS: loads, supports, damping, indenters.

use super::run::set;
use super::{Model, wrong};
use crate::error::Result;
use crate::import::draft::{Section, Value};
use crate::import::log::{Fate, LOADS_OF_SCRIPTS};
use crate::import::regions::{Region, others};
use crate::import::script::{Command, Variables};
use crate::import::translation::Translation;

/// Name of the rigid body of an indenter.
const INDENTER: &str = "indenter";

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
    let name = format!("fix {id}");
    let made = match (*style, rest.first().copied()) {
        ("setforce", _) => {
            let zero =
                |k: usize| rest.get(k).and_then(|word| variables.number(word).ok()) == Some(0.0);
            let is_null = |k: usize| rest.get(k) == Some(&"NULL");
            if !(0..3).all(|k| zero(k) || is_null(k)) {
                let note = "forces are set to 0 only, which keeps velocities";
                translation.leave_out_load(node, "condition", &name, note);
                return Ok(());
            }
            let velocity = model
                .velocities
                .iter()
                .rev()
                .find(|velocity| velocity.group == *group || velocity.group == "all");
            let velocity = velocity.map_or([None; 3], |velocity| velocity.components);
            let component = |k: usize| {
                if is_null(k) {
                    Value::text("free")
                } else {
                    Value::number(velocity[k].unwrap_or(0.0))
                }
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
                "body_force: force over the volume of a point",
            ))
        }
        _ => None,
    };
    let Some((key, value, note)) = made else {
        let note = format!("fix {style} has no counterpart");
        if LOADS_OF_SCRIPTS.contains(style) {
            translation.leave_out_load(node, "condition", &name, &note);
        } else {
            translation.log.left_out(node, note);
        }
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
        let note = "its group is no body or region";
        translation.leave_out_load(node, "condition", &name, note);
        return Ok(());
    };
    let written = translation.name("condition", &name);
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
        "[rigid.{written}]: a layer of the points' material in place of the force K (r − R)² on each atom"
    );
    translation.log.note(node, Fate::Approximated, note);
    Ok(())
}
