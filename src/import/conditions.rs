//! Translation of initial values, loads, supports and temperatures. In the source decks, each condition
//! prescribes one component of a vector, or a temperature.

use super::draft::{Section, Value};
use super::sets::Sets;
use super::translation::Translation;
use super::tree::Node;
use crate::error::{Result, excerpt};

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
    key: &'static str,
    component: usize,
    value: Value,
    /// Node of the value in the source deck, for the log.
    node: Node,
}

/// Writer of conditions; collects initial values until [`Self::finish`] writes them.
#[derive(Default)]
pub struct Conditions {
    initials: Vec<Initial>,
    /// Name of each condition in the new deck, and the numbers of the steps in which it acts. An empty list
    /// means that the condition acts in all steps.
    pub written: Vec<(String, Vec<u64>)>,
    /// Whether at least one condition prescribes temperatures.
    pub has_temperature: bool,
}

/// A condition of the source deck.
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

impl Conditions {
    /// Write a condition.
    ///
    /// # Errors
    /// If a key is missing or not a text, `Coordinate` is not x, y or z, or the node set is unknown.
    pub fn add(
        &mut self,
        translation: &mut Translation,
        sets: &mut Sets,
        given: &Given,
    ) -> Result<()> {
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
        let expression = match translation.expression(&text, !is_initial) {
            Ok(expression) => expression,
            Err(message) => {
                let note = format!("its value cannot be expressed: {message}");
                translation.leave_out_load(node, section, name, &note);
                return Ok(());
            }
        };
        let set_node = translation.required(node, "Node Set", &what)?;
        let set_name = translation.text(set_node, "Node Set")?.to_owned();
        let mut names = set_name.split('+').map(str::trim);
        let (first, others) = (names.next().unwrap_or(""), names.next());
        if others.is_some() {
            let note = "a sum of node sets; write one condition for each";
            translation.leave_out_load(node, section, name, note);
            return Ok(());
        }
        let set = sets.find(translation, set_node, first)?;
        translation.log.taken(set_node, format!("the set `{set}`"));
        if let Some((coordinate, word, _)) = component {
            translation
                .log
                .taken(coordinate, format!("component {word}"));
        }
        let component = component.map_or(0, |(.., index)| index);
        let zero = Value::Number("0".to_owned());
        let free = Value::text("free");
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
                    key,
                    component,
                    value: expression,
                    node: value.clone(),
                });
                return Ok(());
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
                let Some(count) = sets.size(translation, first) else {
                    let note = "a force on each point of a set whose number of points is not known";
                    translation.leave_out_load(node, section, name, note);
                    return Ok(());
                };
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
        let written = translation.name("condition", name);
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
        Ok(())
    }

    /// Write the initial values, one table per set. If a point is in several sets, the last of their tables
    /// applies to the point. If the source deck gives no value for a component of a vector, the table has 0
    /// for this component. Log each initial value that a later table may replace by such a 0.
    pub fn finish(&mut self, translation: &mut Translation) {
        for initial in &self.initials {
            let others = self
                .initials
                .iter()
                .filter(|other| other.key == initial.key);
            let gives = |set: &str, component: usize| {
                let mut all = self.initials.iter();
                all.any(|o| o.key == initial.key && o.set == set && o.component == component)
            };
            // The tables are in the order in which their sets first occur.
            let place = |set: &str| self.initials.iter().position(|other| other.set == set);
            let mut missing = others.filter(|other| {
                place(&other.set) > place(&initial.set) && !gives(&other.set, initial.component)
            });
            if let Some(other) = missing.next() {
                let note = format!("0 in points that are in the set `{}` too", other.set);
                translation.log.approximated(&initial.node, note);
            }
        }
        for initial in std::mem::take(&mut self.initials) {
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
    }
}
