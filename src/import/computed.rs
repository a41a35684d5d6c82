//! Computed quantities of Peridigm and PeriLab, which become columns of the history.

use super::draft::Value;
use super::log::Fate;
use super::outputs::{FieldOf, NO_TEMPERATURE, field_of};
use super::sets::Sets;
use super::translation::Translation;
use super::tree::{Node, is_key};
use crate::component::entries;
use crate::error::{Result, excerpt};
use crate::problem::Field;

/// Log note for the angular momentum.
pub(super) const ANGULAR_MOMENTUM: &str = "[history] angular_momentum: about the origin";

/// Value of `FieldOf::difference` for variables that are a field times the volume of a point.
const TIMES_VOLUME: &str = "times the volume";

/// A computed quantity of the source deck.
pub(super) struct Quantity<'n> {
    label: &'n str,
    table: &'n Node,
    class: &'n str,
    variable: &'n str,
}

/// Outcome of the translation of a computed quantity.
pub(super) struct Written {
    pub(super) fate: Fate,
    pub(super) note: String,
    /// Set whose reaction is added to the history.
    pub(super) reaction: Option<String>,
    /// Whether the angular momentum is added to the history.
    pub(super) angular_momentum: bool,
}

impl Written {
    fn new(fate: Fate, note: impl Into<String>) -> Self {
        Self {
            fate,
            note: note.into(),
            reaction: None,
            angular_momentum: false,
        }
    }

    fn left_out(note: impl Into<String>) -> Result<Self> {
        Ok(Self::new(Fate::LeftOut, note))
    }
}

impl<'n> Quantity<'n> {
    /// Create the quantity that a table of the source deck describes.
    pub(super) fn new(label: &'n str, table: &'n Node) -> Self {
        let word = |key: &str| table.get(key).and_then(Node::text).unwrap_or("");
        Self {
            label,
            table,
            class: word("Compute Class"),
            variable: word("Variable"),
        }
    }

    /// Write the quantity to the new deck. Each pair in `bodies` is the name of a block and the name of its
    /// body. `has_temperature` says whether points have temperatures.
    ///
    /// # Errors
    /// If a position is missing or not a number, or a set is unknown.
    pub(super) fn write(
        &self,
        translation: &mut Translation,
        sets: &mut Sets,
        bodies: &[(String, String)],
        has_temperature: bool,
    ) -> Result<Written> {
        let is = |names: &[&str]| names.iter().any(|name| is_key(self.class, name));
        if is_key(self.variable, "Temperature") && !has_temperature {
            return Written::left_out(NO_TEMPERATURE);
        }
        if is(&["Nearest Point Data"]) {
            return self.probe(translation);
        }
        if is(&["Block Data"]) {
            let block = self.table.get("Block").and_then(Node::text).unwrap_or("");
            let body = bodies.iter().find(|(read, _)| is_key(read, block));
            return match body {
                Some((_, body)) => self.statistics(translation, body.clone()),
                None => Written::left_out(format!("the block {} is no body", excerpt(block))),
            };
        }
        if is(&["Node Set Data"]) {
            let name = self.table.get("Node Set").and_then(Node::text);
            let set = sets.find(translation, self.table, name.unwrap_or(""))?;
            return self.statistics(translation, set);
        }
        let energies = [
            "Energy",
            "Kinetic Energy",
            "Strain Energy",
            "Stored Elastic Energy",
        ];
        if is(&energies) {
            let note =
                "`kinetic_energy`, `strain_energy` and others of the history are always there";
            return Ok(Written::new(Fate::Taken, note));
        }
        if is(&["Linear Momentum"]) {
            let note = "`momentum_x`, … of the history are always there";
            return Ok(Written::new(Fate::Taken, note));
        }
        if is(&["Angular Momentum"]) && translation.dimension > 1 {
            return Ok(Written {
                angular_momentum: true,
                ..Written::new(Fate::Taken, ANGULAR_MOMENTUM)
            });
        }
        Written::left_out(format!(
            "the class {} has no counterpart",
            excerpt(self.class)
        ))
    }

    /// Write a probe. It records the variable at the point nearest to the position in the source deck. Every
    /// probe records displacement and velocity, so these two need no key.
    fn probe(&self, translation: &mut Translation) -> Result<Written> {
        let mut position = Vec::new();
        for axis in ["X", "Y", "Z"].iter().take(translation.dimension) {
            let what = format!("the quantity `{}`", self.label);
            let node = translation.required(self.table, axis, &what)?;
            position.push(translation.number(node, axis)?);
        }
        if is_key(self.variable, "Model Coordinates") {
            return Written::left_out("a constant: the position of the nearest point");
        }
        let field = if is_key(self.variable, "Coordinates") {
            Some(FieldOf {
                name: "displacement",
                difference: "add the position",
                part: None,
            })
        } else {
            field_of(self.variable).filter(|field| field.name != "rank")
        };
        let Some(field) = field else {
            return Written::left_out("there is no such field");
        };
        let mut probe = vec![("at".to_owned(), Value::numbers(&position))];
        if !["displacement", "velocity"].contains(&field.name) {
            let fields = Value::list([Value::text(field.name)]);
            probe.push(("fields".to_owned(), fields));
        }
        let name = translation.name("probe", self.label);
        let history = translation.draft.section("history");
        history.set(format!("probe.{name}"), Value::Table(probe));
        let note = format!("[history] probe.{name}: {}", field.name);
        Ok(if field.difference.is_empty() {
            Written::new(Fate::Taken, note)
        } else {
            Written::new(Fate::Approximated, format!("{note}; {}", field.difference))
        })
    }

    /// Write a sum, a mean or an extreme over a set. The section `[history]` gets one table per component.
    fn statistics(&self, translation: &mut Translation, set: String) -> Result<Written> {
        let calculation = self.table.get("Calculation Type").and_then(Node::text);
        let calculation = calculation.unwrap_or("");
        let statistics = [
            ("Sum", "sum"),
            ("Minimum", "minimum"),
            ("Maximum", "maximum"),
            ("Average", "mean"),
            ("Mean", "mean"),
        ];
        let known = statistics
            .iter()
            .find(|(name, _)| is_key(calculation, name));
        let Some((_, statistic)) = known else {
            return Written::left_out(format!(
                "the calculation {} is not known",
                excerpt(calculation)
            ));
        };
        let is_sum = *statistic == "sum";
        if is_key(self.variable, "External Forces") && is_sum {
            let note = format!("column reaction_{set}: the force of the supports on the set");
            return Ok(Written {
                reaction: Some(set),
                ..Written::new(Fate::Approximated, note)
            });
        }
        if is_key(self.variable, "Kinetic Energy") && is_sum {
            let note = "kinetic_energy of the history, of all bodies";
            return Ok(Written::new(Fate::Approximated, note));
        }
        let without = [
            "Kinetic Energy",
            "External Forces",
            "External Force Densities",
        ];
        let field = field_of(self.variable)
            .filter(|_| !without.iter().any(|name| is_key(self.variable, name)));
        let known = field.and_then(|field| {
            let known = Field::ALL
                .into_iter()
                .find(|known| known.name() == field.name)?;
            (known != Field::Rank).then_some((field, known))
        });
        let Some((field, known)) = known else {
            return Written::left_out("there is no such field");
        };
        // The sum of a density times the volume of a point is the integral of the density.
        let (statistic, difference) = match (*statistic, field.difference) {
            ("sum", TIMES_VOLUME) => ("integral", ""),
            ("mean", "") => ("mean", "weighted by volume"),
            (statistic, difference) => (statistic, difference),
        };
        // Symmetric tensors store xy, not yx.
        let part = field.part.map(|part| {
            let mut axes: Vec<char> = part.to_lowercase().chars().collect();
            if known.components() == 6 {
                axes.sort_unstable();
            }
            String::from_iter(axes)
        });
        let mut names = Vec::new();
        for (_, component) in entries(known.components(), translation.dimension) {
            if part.as_ref().is_some_and(|part| part != component) {
                continue;
            }
            let name = format!("{} {component}", self.label);
            let name = translation.new_name("field", &name);
            let mut table = vec![("field".to_owned(), Value::text(field.name))];
            if !component.is_empty() {
                table.push(("component".to_owned(), Value::text(component)));
            }
            table.push(("set".to_owned(), Value::text(set.clone())));
            table.push(("of".to_owned(), Value::list([Value::text(statistic)])));
            let history = translation.draft.section("history");
            history.set(format!("field.{name}"), Value::Table(table));
            names.push(format!("field.{name}"));
        }
        if names.is_empty() {
            return Written::left_out("the problem has no such component");
        }
        let mut note = format!(
            "[history] {}: {statistic} of {}",
            names.join(", "),
            field.name
        );
        let mut fate = Fate::Taken;
        if !difference.is_empty() {
            note += &format!("; {difference}");
            fate = Fate::Approximated;
        }
        let mut reaction = None;
        if field.name == "force_density" {
            if translation.draft.has("contact") {
                note += "; contact included";
                fate = Fate::Approximated;
            }
            if statistic == "integral" && translation.draft.has_support() {
                note += &format!(
                    "; column reaction_{set}: the force of the supports, opposite at rest"
                );
                reaction = Some(set);
            }
        }
        Ok(Written {
            reaction,
            ..Written::new(fate, note)
        })
    }
}
