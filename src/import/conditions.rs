//! Translation of initial values, loads, supports and temperatures. In the source decks, each condition
//! prescribes one component of a vector, or a temperature.

use std::collections::{BTreeMap, BTreeSet};

use super::draft::{Section, Value};
use super::expression::Dialect;
use super::log::{ADDED_LOADS, UNORDERED_INITIALS};
use super::sets::{Members, Sets};
use super::solver::Stage;
use super::translation::Translation;
use super::tree::Node;
use crate::error::{Result, excerpt};
use crate::expression::Expression;

/// Quantity that a condition prescribes.
#[derive(Debug, Clone, PartialEq)]
pub enum Quantity {
    /// Initial displacement or velocity; the text is the key of `[initial.NAME]`.
    Initial(&'static str),
    /// Displacement or velocity of a support; the text is the key of `[condition.NAME]`.
    Support(&'static str),
    /// Force density.
    BodyForce,
    /// Force on each point of the set, N.
    ForceOfPoint,
    /// Temperature; if there is a reference temperature, it is subtracted from the prescribed value.
    Temperature(Option<Value>),
}

/// An initial value of one component.
struct Initial {
    set: String,
    /// Points of the set, if known.
    members: Option<Members>,
    key: &'static str,
    component: usize,
    value: Value,
    /// Node of the value in the source deck, for the log.
    node: Node,
}

/// A load that the source code does not add to other loads of its kind.
struct Load {
    quantity: Quantity,
    set: String,
    /// Points of the set, if known.
    members: Option<Members>,
    component: usize,
    /// Numbers of the steps in which the load acts; empty for all steps.
    steps: Vec<u64>,
    /// Node of the value in the source deck, for the log.
    node: Node,
}

/// Writer of conditions; collects initial values until [`Self::finish`] writes them.
#[derive(Default)]
pub struct Conditions {
    initials: Vec<Initial>,
    loads: Vec<Load>,
    /// Name of each condition in the new deck, and the numbers of the steps in which it acts. An empty list
    /// means that the condition acts in all steps.
    pub written: Vec<(String, Vec<u64>)>,
    /// Whether at least one condition prescribes temperatures.
    pub has_temperature: bool,
}

/// A condition of the source deck.
#[derive(Clone)]
pub struct Given<'n> {
    /// Name of the condition.
    pub name: &'n str,
    /// Table of the condition.
    pub node: &'n Node,
    /// Quantity that the condition prescribes.
    pub quantity: Quantity,
    /// Numbers of the steps in which the condition acts; empty for all steps.
    pub steps: Vec<u64>,
}

/// A set of the new deck on which a condition acts.
struct Target {
    set: String,
    /// Points of the set, if known.
    members: Option<Members>,
    /// Name of the node set if the condition acts on a sum of several targets.
    part: Option<String>,
}

/// Return the component of a condition: the node of the key `Coordinate`, the name x, y or z, and the index
/// 0, 1 or 2.
fn component<'n>(
    translation: &Translation,
    node: &'n Node,
    what: &str,
) -> Result<(&'n Node, &'static str, usize)> {
    let coordinate = translation.required(node, "Coordinate", what)?;
    let word = translation.text(coordinate, "Coordinate")?.to_lowercase();
    let axes = ["x", "y", "z"];
    match axes.iter().position(|axis| *axis == word) {
        Some(index) => Ok((coordinate, axes[index], index)),
        None => {
            let message = format!("`Coordinate` must be x, y or z, is {}", excerpt(&word));
            Err(translation.error(coordinate.line, message))
        }
    }
}

/// Return the first stage of each solver step in which a condition acts. `steps` are the step numbers that
/// the condition gives; empty for all steps.
fn acting<'s>(stages: &'s [Stage], steps: &[u64]) -> Vec<(u64, &'s Stage)> {
    let mut acting: Vec<(u64, &Stage)> = Vec::new();
    for stage in stages {
        if let Some(step) = stage.step_id
            && (steps.is_empty() || steps.contains(&step))
            && acting.iter().all(|(known, _)| *known != step)
        {
            acting.push((step, stage));
        }
    }
    acting
}

/// Test whether an expression contains a name.
fn reads(expression: &str, name: &str) -> bool {
    let mut words = expression.split(|c: char| !c.is_alphanumeric() && c != '_');
    words.any(|word| word == name)
}

/// Test whether a value is the number 0, or an expression of the position that is 0 at sample points.
fn is_zero(value: &Value) -> bool {
    let Ok(expression) = Expression::of(&value.plain()) else {
        return false;
    };
    let magnitudes = (-4..=4).flat_map(|exponent| {
        [1.0, 1.5, 3.0, 6.0].map(|factor: f64| factor * 10_f64.powi(exponent))
    });
    let samples: Vec<f64> = magnitudes
        .flat_map(|magnitude| [-magnitude, magnitude])
        .chain([0.0])
        .collect();
    let is_zero_at = |x: f64, y: f64, z: f64| expression.evaluate([x, y, z], 0.0) == 0.0;
    let pairs = || {
        samples
            .iter()
            .flat_map(|x| samples.iter().map(move |y| (*x, *y)))
    };
    pairs().all(|(x, y)| samples.iter().all(|z| is_zero_at(x, y, *z)))
}

/// Return the terms that Peridigm adds to the value of a prescribed displacement in a stage, such as
/// ` - (0.1)`. Return `None` if they are 0. `Err` holds a message.
///
/// Peridigm adds the increment f(t₂) − f(t₁) of the value f in each time step from t₁ to t₂. At the time t of
/// a solver that starts at s, the displacement is f(t) − f(s) plus the increments of the solvers before.
fn added_terms(
    translation: &Translation,
    text: &str,
    stages: &[Stage],
    stage: &Stage,
) -> std::result::Result<Option<String>, String> {
    if translation.dialect != Dialect::Peridigm || !reads(text, "t") {
        return Ok(None);
    }
    let before = stages.iter().take_while(|other| *other != stage);
    let mut times: Vec<(char, f64)> = before
        .flat_map(|stage| [('-', stage.start), ('+', stage.end)])
        .collect();
    times.push(('-', stage.start));
    // The end of a stage and the start of the next one cancel if they are equal.
    let mut at = 0;
    while at + 1 < times.len() {
        let ((sign, time), (next_sign, next_time)) = (times[at], times[at + 1]);
        if sign != next_sign && time == next_time {
            times.drain(at..at + 2);
        } else {
            at += 1;
        }
    }
    let mut terms = String::new();
    for (sign, time) in times {
        let value = translation.at_time(text, time)?;
        if !is_zero(&value) {
            terms += &format!(" {sign} ({})", value.plain());
        }
    }
    let sum = Value::text(format!("0{terms}"));
    Ok((!is_zero(&sum)).then_some(terms))
}

impl Conditions {
    /// Write a condition. If the time in its value runs differently in the steps in which it acts, write one
    /// condition for each of these steps.
    ///
    /// # Errors
    /// If a key is missing or not a text, `Coordinate` is not x, y or z, or the node set is unknown.
    pub fn add(
        &mut self,
        translation: &mut Translation,
        sets: &mut Sets,
        stages: &[Stage],
        given: &Given,
    ) -> Result<()> {
        let acting = acting(stages, &given.steps);
        let value = given.node.get("Value").and_then(Node::text).unwrap_or("");
        let has_shifts = acting
            .iter()
            .any(|(_, stage)| stage.shift != acting[0].1.shift);
        let reads_step_time = translation.dialect == Dialect::PeriLab && reads(value, "st");
        // The variable `st` starts again in each step.
        let is_split = acting.len() > 1 && reads_step_time || has_shifts && reads(value, "t");
        if !is_split || matches!(given.quantity, Quantity::Initial(_)) {
            let stage = acting.first().map_or(&stages[0], |(_, stage)| *stage);
            return self.add_from(translation, sets, (stages, stage), given);
        }
        for (step, stage) in acting {
            let given = Given {
                name: &format!("{} in step {step}", given.name),
                steps: vec![step],
                ..given.clone()
            };
            self.add_from(translation, sets, (stages, stage), &given)?;
        }
        Ok(())
    }

    /// Write a condition whose value has the time of one of the stages.
    fn add_from(
        &mut self,
        translation: &mut Translation,
        sets: &mut Sets,
        (stages, stage): (&[Stage], &Stage),
        given: &Given,
    ) -> Result<()> {
        translation.shift = stage.shift;
        translation.step_start = stage.start_in_run();
        let (name, node) = (given.name, given.node);
        let what = format!("the condition `{name}`");
        let is_initial = matches!(given.quantity, Quantity::Initial(_));
        let section = if is_initial { "initial" } else { "condition" };
        let component = match given.quantity {
            Quantity::Temperature(_) => None,
            _ => Some(component(translation, node, &what)?),
        };
        if let Some((_, word, index)) = component
            && index >= translation.dimension
        {
            let value = node
                .get("Value")
                .map(|value| translation.number(value, "Value"));
            let note = format!("the problem has no {word}");
            if matches!(value, Some(Ok(0.0))) {
                for (_, key) in node.entries() {
                    translation.log.taken(key, note.clone());
                }
            } else {
                translation.leave_out_load(node, section, name, &note);
            }
            return Ok(());
        }
        let value = translation.required(node, "Value", &what)?;
        let text = translation.text(value, "Value")?.to_owned();
        let terms = match given.quantity {
            Quantity::Support("displacement") => added_terms(translation, &text, stages, stage),
            _ => Ok(None),
        };
        let expression = translation.expression(&text, !is_initial);
        let expression = match expression.and_then(|expression| Ok((expression, terms?))) {
            Ok((expression, None)) => expression,
            Ok((expression, Some(terms))) => {
                let note = "Peridigm adds up the increments of this displacement from the start";
                translation.log.approximated(value, note);
                Value::text(format!("({}){terms}", expression.plain()))
            }
            Err(message) => {
                let note = format!("its value cannot be expressed: {message}");
                translation.leave_out_load(node, section, name, &note);
                return Ok(());
            }
        };
        let set_node = translation.required(node, "Node Set", &what)?;
        let targets = targets(translation, sets, set_node)?;
        if let Some((coordinate, word, _)) = component {
            translation
                .log
                .taken(coordinate, format!("component {word}"));
        }
        let component = component.map_or(0, |(.., index)| index);
        for target in targets {
            self.add_to(translation, given, target, (component, &expression, value));
        }
        Ok(())
    }

    /// Write a condition on one set. `value` is the node of the value, `expression` its translation.
    fn add_to(
        &mut self,
        translation: &mut Translation,
        given: &Given,
        target: Target,
        (component, expression, value): (usize, &Value, &Node),
    ) {
        let Target { set, members, part } = target;
        let zero = Value::Number("0".to_owned());
        let free = Value::text("free");
        let expression = expression.clone();
        let adds_load = match given.quantity {
            Quantity::BodyForce => true,
            // A force on each point of other sets is left out.
            Quantity::ForceOfPoint => matches!(members, Some(Members::Ids(_))),
            _ => false,
        };
        if adds_load {
            self.loads.push(Load {
                quantity: given.quantity.clone(),
                set: set.clone(),
                members: members.clone(),
                component,
                steps: given.steps.clone(),
                node: value.clone(),
            });
        }
        let (key, vector, factor) = match &given.quantity {
            Quantity::Temperature(reference) => {
                let difference = match reference {
                    None => expression,
                    Some(reference) => Value::text(format!(
                        "({}) - ({})",
                        expression.plain(),
                        reference.plain()
                    )),
                };
                self.has_temperature = true;
                ("temperature", difference, None)
            }
            Quantity::Initial(key) => {
                translation
                    .log
                    .taken(value, format!("[initial.{set}] {key}"));
                self.initials.push(Initial {
                    set,
                    members,
                    key,
                    component,
                    value: expression,
                    node: value.clone(),
                });
                return;
            }
            Quantity::Support(key) => (
                *key,
                translation.component(component, expression, &free),
                None,
            ),
            Quantity::BodyForce => (
                "body_force",
                translation.component(component, expression, &zero),
                None,
            ),
            Quantity::ForceOfPoint => {
                let Some(Members::Ids(ids)) = members else {
                    let note = "a force on each point of a set whose number of points is not known";
                    translation.leave_out_load(given.node, "condition", given.name, note);
                    return;
                };
                let count = ids.len();
                let total = match &expression {
                    Value::Number(number) => match number.parse::<f64>() {
                        Ok(number) => Value::number(count as f64 * number),
                        Err(_) => expression.clone(),
                    },
                    Value::Text(text) => Value::text(format!("{count}*({text})")),
                    other => other.clone(),
                };
                (
                    "force",
                    translation.component(component, total, &zero),
                    Some(count),
                )
            }
        };
        let read = match part {
            None => given.name.to_owned(),
            Some(part) => format!("{} on {part}", given.name),
        };
        let written = translation.name("condition", &read);
        let mut section = Section::new(format!("condition.{written}"));
        section.set("set", Value::text(set)).set(key, vector);
        translation.add(section);
        match factor {
            None => translation
                .log
                .taken(value, format!("[condition.{written}] {key}")),
            Some(count) => {
                let note = format!(
                    "[condition.{written}] force: the total of {count} points, spread by volume"
                );
                translation.log.approximated(value, note);
            }
        }
        self.written.push((written, given.steps.clone()));
    }

    /// Write the initial values, and log the conditions that act differently at points of several sets.
    pub fn finish(&mut self, translation: &mut Translation) {
        self.note_added_loads(translation);
        let initials = std::mem::take(&mut self.initials);
        let overlaps = overlaps(translation, &initials);
        for initial in initials {
            let header = format!("initial.{}", initial.set);
            let is_new = !translation.draft.has(&header);
            let dimension = translation.dimension;
            let section = translation.draft.section(&header);
            if is_new {
                section.set("set", Value::text(initial.set.clone()));
            }
            let known = section.get(initial.key).cloned();
            let mut components = match known {
                Some(Value::List(values)) => values,
                _ => vec![Value::Number("0".to_owned()); dimension],
            };
            components[initial.component] = initial.value;
            section.set(initial.key, Value::List(components));
        }
        for overlap in overlaps {
            let written = translation.new_name("set", "overlap");
            let mut section = Section::new(format!("set.{written}"));
            section.set("ids", Value::Ids(overlap.ids));
            translation.add(section);
            let mut section = Section::new(format!("initial.{written}"));
            section.set("set", Value::text(written));
            section.set(overlap.key, Value::List(overlap.values));
            translation.add(section);
        }
    }

    /// Log the loads on points with another load of the same kind: one of these loads acts in the source
    /// code, but all of them act in the new deck.
    fn note_added_loads(&self, translation: &Translation) {
        for (index, load) in self.loads.iter().enumerate() {
            let others = self.loads[..index].iter().filter(|other| {
                other.quantity == load.quantity
                    && other.component == load.component
                    && (other.steps.is_empty()
                        || load.steps.is_empty()
                        || other.steps.iter().any(|step| load.steps.contains(step)))
            });
            for other in others {
                let overlap = match (&load.members, &other.members) {
                    _ if load.set == other.set => Some(true),
                    (Some(one), Some(other)) => Some(one.overlap(other)),
                    _ => None,
                };
                let note = match overlap {
                    Some(true) => ADDED_LOADS.to_owned(),
                    Some(false) => continue,
                    None => format!(
                        "adds to the load on points that are in the set `{}` too",
                        other.set
                    ),
                };
                translation.log.approximated(&load.node, note);
            }
        }
    }
}

/// Return the sets on which a condition acts. In PeriLab, `A + B` is the sum of two node sets.
///
/// # Errors
/// If a node set is unknown or invalid.
fn targets(translation: &mut Translation, sets: &mut Sets, node: &Node) -> Result<Vec<Target>> {
    let text = translation.text(node, "Node Set")?.to_owned();
    let names: Vec<&str> = match translation.dialect {
        Dialect::PeriLab => text.split('+').map(str::trim).collect(),
        _ => vec![text.trim()],
    };
    let whole = if let [name] = names[..] {
        let set = sets.find(translation, node, name)?;
        translation.log.taken(node, format!("the set `{set}`"));
        Some(set)
    } else {
        sets.find_sum(translation, node, &names)
    };
    if let Some(set) = whole {
        let members = sets.members(translation, &names);
        return Ok(vec![Target {
            set,
            members,
            part: None,
        }]);
    }
    let mut targets = Vec::new();
    for name in names {
        let set = sets.find(translation, node, name)?;
        translation.log.taken(node, format!("the set `{set}`"));
        targets.push(Target {
            set,
            members: sets.members(translation, &[name]),
            part: Some(name.to_owned()),
        });
    }
    Ok(targets)
}

/// Points in several sets, at which the tables of these sets would not give the initial values of the source
/// deck.
struct Overlap {
    ids: Vec<u64>,
    key: &'static str,
    /// Initial displacement or velocity of these points.
    values: Vec<Value>,
}

/// Compare the initial values of the source deck with those of the new deck, which has one table per set.
///
/// In the source code, each initial value replaces earlier values of the same component. In the new deck, a
/// point gets all components from the last table whose set contains it. Return the points at which the
/// initial values of the two decks differ. Log the initial values that may differ at points that are not
/// known.
fn overlaps(translation: &Translation, initials: &[Initial]) -> Vec<Overlap> {
    let mut overlaps = Vec::new();
    // The tables are in the order in which their sets first occur.
    let place = |set: &str| initials.iter().position(|other| other.set == set);
    for key in ["displacement", "velocity"] {
        let of_key: Vec<&Initial> = initials.iter().filter(|other| other.key == key).collect();
        note_unordered(translation, &of_key);
        let members: Option<Vec<&Members>> = of_key.iter().map(|o| o.members.as_ref()).collect();
        let Some(members) = members else {
            note_unknown_overlaps(translation, &of_key, &place);
            continue;
        };
        let ids: BTreeSet<u64> = members
            .iter()
            .filter_map(|members| match members {
                Members::Ids(ids) => Some(ids),
                Members::All => None,
            })
            .flatten()
            .copied()
            .collect();
        let mut groups: BTreeMap<Vec<Option<usize>>, Vec<u64>> = BTreeMap::new();
        for id in ids {
            let here = (0..of_key.len()).filter(|index| members[*index].contains(id));
            let here: Vec<usize> = here.collect();
            let last_table = here.iter().max_by_key(|index| place(&of_key[**index].set));
            let last_of = |component: usize, set: Option<&str>| {
                let mut all = here.iter().rev().copied();
                all.find(|index| {
                    let initial = of_key[*index];
                    initial.component == component && set.is_none_or(|set| initial.set == set)
                })
            };
            let components = 0..translation.dimension;
            let expected: Vec<_> = components.clone().map(|k| last_of(k, None)).collect();
            let table = last_table.map(|index| of_key[*index].set.as_str());
            if components
                .map(|k| last_of(k, table))
                .ne(expected.iter().copied())
            {
                groups.entry(expected).or_default().push(id);
            }
        }
        for (expected, ids) in groups {
            let values = expected.into_iter().map(|index| match index {
                Some(index) => of_key[index].value.clone(),
                None => Value::Number("0".to_owned()),
            });
            let values = values.collect();
            overlaps.push(Overlap { ids, key, values });
        }
    }
    overlaps
}

/// Log the initial values of PeriLab at points with several values of the same component. PeriLab applies
/// them in no fixed order.
fn note_unordered(translation: &Translation, initials: &[&Initial]) {
    if translation.dialect != Dialect::PeriLab {
        return;
    }
    for (index, initial) in initials.iter().enumerate() {
        let overlaps = initials[..index].iter().any(|other| {
            other.component == initial.component
                && other.value != initial.value
                && match (&initial.members, &other.members) {
                    (Some(one), Some(other)) => one.overlap(other),
                    _ => initial.set == other.set,
                }
        });
        if overlaps {
            translation
                .log
                .approximated(&initial.node, UNORDERED_INITIALS);
        }
    }
}

/// Log the initial values that a table of another set may replace. `place` returns the position of the table
/// of a set.
fn note_unknown_overlaps(
    translation: &Translation,
    initials: &[&Initial],
    place: &dyn Fn(&str) -> Option<usize>,
) {
    for (index, initial) in initials.iter().enumerate() {
        let later = |other: &&&Initial| place(&other.set) > place(&initial.set);
        for other in initials.iter().filter(later) {
            let mut given = initials.iter().enumerate().filter(|(_, given)| {
                given.set == other.set && given.component == initial.component
            });
            let note = match given.next_back() {
                None => format!("0 in points that are in the set `{}` too", other.set),
                Some((replacing, _)) if replacing < index => {
                    format!(
                        "points that are in the set `{}` too get the value of that set",
                        other.set
                    )
                }
                Some(_) => continue,
            };
            translation.log.approximated(&initial.node, note);
            break;
        }
    }
}
