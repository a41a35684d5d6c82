//! Outputs of Peridigm and PeriLab.

use super::computed::{ANGULAR_MOMENTUM, Quantity};
use super::draft::{Section, Value};
use super::log::Fate;
use super::sets::Sets;
use super::translation::Translation;
use super::tree::{Node, is_key};
use crate::error::Result;

/// Output variables. An entry has the name of the variable, the name of its field, and a text that says
/// how the field differs from the variable. The text is empty if the field equals the variable.
const FIELDS: [(&str, &str, &str); 33] = [
    ("Displacement", "displacement", ""),
    ("Displacements", "displacement", ""),
    ("Velocity", "velocity", ""),
    ("Acceleration", "acceleration", ""),
    ("Force Density", "force_density", ""),
    ("Force Densities", "force_density", ""),
    ("Force", "force_density", "times the volume"),
    ("Forces", "force_density", "times the volume"),
    ("Contact Force Density", "contact_force_density", ""),
    ("Contact Force", "contact_force_density", "times the volume"),
    ("Damage", "damage", ""),
    ("Temperature", "temperature", ""),
    ("Dilatation", "dilatation", ""),
    ("Weighted Volume", "weighted_volume", ""),
    ("Number Of Neighbors", "neighbours", "without broken bonds"),
    ("Number of Filtered Neighbors", "neighbours", ""),
    ("Proc Num", "rank", ""),
    ("Cauchy Stress", "cauchy_stress", ""),
    ("Unrotated Cauchy Stress", "cauchy_stress", "rotated"),
    ("Partial Stress", "stress", ""),
    ("Von Mises Stress", "von_mises_stress", ""),
    ("Deformation Gradient", "deformation_gradient", ""),
    (
        "Stored Elastic Energy",
        "strain_energy_density",
        "times the volume",
    ),
    ("Stored Elastic Energy Density", "strain_energy_density", ""),
    ("Strain Energy", "strain_energy_density", "times the volume"),
    ("Equivalent Plastic Strain", "plastic_strain_equivalent", ""),
    ("Plastic Strain", "plastic_strain_equivalent", ""),
    ("Strain", "strain", ""),
    (
        "Left Stretch Tensor",
        "deformation_gradient",
        "from which stretch follows",
    ),
    (
        "Rotation Tensor",
        "deformation_gradient",
        "from which rotation follows",
    ),
    ("External Forces", "force_density", "loads are not written"),
    (
        "External Force Densities",
        "force_density",
        "loads are not written",
    ),
    (
        "Kinetic Energy",
        "velocity",
        "from which it follows; the sum is in the history",
    ),
];

/// Output variables of the source deck that need no field in the new deck, with their notes for the log.
const ALWAYS: [(&str, &str); 8] = [
    ("Element Id", "`id` is always there"),
    ("Block Id", "`block` is always there"),
    ("Model Coordinates", "always there"),
    ("Coordinates", "coordinates and displacement"),
    ("Volume", "always there"),
    ("Specific Volume", "`volume` is always there"),
    ("Current Coordinates", "coordinates and displacement"),
    ("Deformed Coordinates", "coordinates and displacement"),
];

/// Global variables that the history always contains, with their notes for the log.
const GLOBALS: [(&str, &str); 3] = [
    (
        "Global Kinetic Energy",
        "`kinetic_energy` of the history is always there",
    ),
    (
        "Global Linear Momentum",
        "`momentum_x`, … of the history are always there",
    ),
    (
        "Global Strain Energy",
        "`strain_energy` of the history is always there",
    ),
];

/// Reason for leaving out temperatures.
pub(super) const NO_TEMPERATURE: &str = "no temperature acts on a material that expands";

/// Suffixes of variables that are tensor components, such as `XX` in `Cauchy_StressXX`.
const TENSOR_PARTS: [&str; 9] = ["XX", "XY", "XZ", "YX", "YY", "YZ", "ZX", "ZY", "ZZ"];

/// Interval of outputs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Interval {
    /// Number of steps between outputs.
    Steps(u64),
    /// Number of outputs in the run.
    Number(u64),
}

/// The field of Fissure that corresponds to an output variable of the other code.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct FieldOf {
    /// Name of the field.
    pub(super) name: &'static str,
    /// How the field differs from the variable; empty if both are equal.
    pub(super) difference: &'static str,
    /// Tensor component that the variable selects, in upper case.
    pub(super) part: Option<&'static str>,
}

/// Find the field for an output variable such as `Cauchy_StressXX`.
pub(super) fn field_of(variable: &str) -> Option<FieldOf> {
    let find = |wanted: &str, part| {
        let found = FIELDS.iter().find(|(known, ..)| is_key(wanted, known))?;
        let (_, name, difference) = *found;
        Some(FieldOf {
            name,
            difference,
            part,
        })
    };
    find(variable, None).or_else(|| {
        let part = TENSOR_PARTS.iter().find(|part| variable.ends_with(**part));
        let part = part.copied()?;
        find(variable.trim_end_matches(part), Some(part))
    })
}

/// Kind of an output variable.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    /// A field of the result.
    Field,
    /// A column of the history.
    Global,
    /// Neither field nor column.
    Other,
}

/// An output interval, and the node of the source deck that contains this interval.
struct Frequency {
    interval: Interval,
    node: Node,
    /// Whether the output contains fields.
    has_fields: bool,
}

/// The outputs that have been read from the source deck.
#[derive(Default)]
pub struct Outputs {
    fields: Vec<&'static str>,
    /// Interval of each output, except the outputs with an interval in `history_intervals`.
    intervals: Vec<Frequency>,
    /// Interval of each output that contains only columns of the history.
    history_intervals: Vec<Frequency>,
    /// Whether points have temperatures. They have temperatures if temperatures are prescribed and a material
    /// expands.
    has_temperature: bool,
    /// Computed quantities: name, outcome and note.
    computed: Vec<(String, Fate, String)>,
    reactions: Vec<String>,
    angular_momentum: bool,
}

impl Outputs {
    /// Create outputs without fields and intervals. `has_temperature` says whether points have temperatures.
    pub fn new(has_temperature: bool) -> Self {
        Self {
            has_temperature,
            ..Self::default()
        }
    }

    /// Read a table of computed quantities. The name of a quantity is the value of its key `Output Label`.
    /// Without this key, the quantity has the name of its table. Each pair in `bodies` is the name of a block
    /// and the name of its body.
    ///
    /// # Errors
    /// If a position is missing or not a number, or a set is unknown.
    pub fn computed(
        &mut self,
        translation: &mut Translation,
        sets: &mut Sets,
        bodies: &[(String, String)],
        node: &Node,
    ) -> Result<()> {
        for (name, table) in node.tables() {
            let label = table.get("Output Label").and_then(Node::text);
            let label = label.unwrap_or(name).to_owned();
            let quantity = Quantity::new(&label, table);
            let written = quantity.write(translation, sets, bodies, self.has_temperature)?;
            if let Some(set) = written.reaction
                && !self.reactions.contains(&set)
            {
                self.reactions.push(set);
            }
            self.angular_momentum |= written.angular_momentum;
            let (fate, note) = (written.fate, written.note);
            translation.log.note_whole_table(table, fate, note.clone());
            self.computed.push((label, fate, note));
        }
        Ok(())
    }

    /// Read the variables of an output, and the interval if the output has one.
    ///
    /// # Errors
    /// If the frequency or the number of outputs is not a whole number above 0.
    pub fn output(&mut self, translation: &Translation, node: &Node) -> Result<()> {
        let log = &translation.log;
        let (mut has_fields, mut has_globals) = (false, false);
        if let Some(variables) = node.get("Output Variables") {
            for (name, variable) in variables.entries() {
                if !translation.is_true(variable) {
                    log.taken(variable, "not written");
                    continue;
                }
                let (kind, fate, note) = self.variable(translation, name);
                has_fields |= kind == Kind::Field;
                has_globals |= kind == Kind::Global;
                log.note(variable, fate, note);
            }
        }
        let is_history = has_globals && !has_fields;
        if let Some(first) = node.get("Initial Output Step") {
            log.left_out(first, "the first and the last state are always written");
        }
        let keys = ["Output Frequency", "Number of Output Steps"];
        for (index, key) in keys.iter().enumerate() {
            let Some(interval) = node.get(key) else {
                continue;
            };
            // PeriLab allows one number per solver step; the first number is used.
            let text = translation.text(interval, key)?;
            let first = text
                .split_whitespace()
                .next()
                .and_then(|word| word.parse::<u64>().ok());
            let Some(count) = first.filter(|count| *count > 0) else {
                let message = format!("`{key}` must be a whole number above 0");
                return Err(translation.error(interval.line, message));
            };
            let read = match index {
                0 => Interval::Steps(count),
                _ => Interval::Number(count),
            };
            let section = if is_history { "history" } else { "output" };
            let note = match (index, text.contains(' ')) {
                (0, true) => "every_steps; the first number counts for all steps",
                (_, true) => "every; the first number counts for all steps",
                (0, _) => "every_steps",
                _ => "every: the length of the run over it",
            };
            log.taken(interval, format!("[{section}] {note}"));
            let frequency = Frequency {
                interval: read,
                node: interval.clone(),
                has_fields,
            };
            if is_history {
                self.history_intervals.push(frequency);
            } else {
                self.intervals.push(frequency);
            }
        }
        for (name, setting) in node.entries() {
            let files = [
                "Output File Type",
                "Output Format",
                "Output Filename",
                "Parallel Write",
                "Flush File",
                "Write After Damage",
                "Output Precision",
                "Output Processor",
            ];
            if files.iter().any(|key| is_key(name, key)) {
                log.left_out(
                    setting,
                    "the result is one HDF5 file, the history one table",
                );
            }
        }
        Ok(())
    }

    /// Return the largest entry of `intervals` that belongs to an output with fields. If none of the outputs
    /// has fields, return the largest of all `intervals`. Log the other intervals. Return `None` if there is
    /// no interval.
    fn interval(&self, translation: &Translation) -> Option<Interval> {
        let with_fields = self.intervals.iter().any(|frequency| frequency.has_fields);
        let candidates = self.intervals.iter();
        let candidates = candidates.filter(|frequency| frequency.has_fields || !with_fields);
        let largest = candidates.reduce(|a, b| if is_longer(b, a) { b } else { a })?;
        let mut others = Vec::new();
        for frequency in &self.intervals {
            if frequency.interval != largest.interval {
                let note = "there is one interval for all fields; the largest counts";
                translation.log.approximated(&frequency.node, note);
                others.push(frequency.node.text().unwrap_or("").trim());
            }
        }
        if !others.is_empty() {
            let note = format!("the other outputs have {}", others.join(", "));
            translation.log.approximated(&largest.node, note);
        }
        Some(largest.interval)
    }

    /// Return the smallest interval of the outputs that contain only columns of the history. Log the other
    /// intervals of these outputs. Return `None` if none of these outputs has an interval.
    fn history_interval(&self, translation: &Translation) -> Option<Interval> {
        let all = self.history_intervals.iter();
        let smallest = all.reduce(|a, b| if is_longer(a, b) { b } else { a })?;
        for frequency in &self.history_intervals {
            if frequency.interval != smallest.interval {
                let note = "there is one interval for the history; the smallest counts";
                translation.log.approximated(&frequency.node, note);
            }
        }
        Some(smallest.interval)
    }

    /// Return kind, outcome and note of an output variable. If the variable has a field, add
    /// this field to the output.
    fn variable(&mut self, translation: &Translation, name: &str) -> (Kind, Fate, String) {
        let mut computed = self.computed.iter();
        if let Some((_, fate, note)) = computed.find(|(label, ..)| is_key(label, name)) {
            return (Kind::Global, *fate, note.clone());
        }
        if let Some((_, note)) = ALWAYS.iter().find(|(known, _)| is_key(name, known)) {
            return (Kind::Other, Fate::Taken, (*note).to_owned());
        }
        if let Some((_, note)) = GLOBALS.iter().find(|(known, _)| is_key(name, known)) {
            return (Kind::Global, Fate::Taken, (*note).to_owned());
        }
        if is_key(name, "Global Angular Momentum") && translation.dimension > 1 {
            self.angular_momentum = true;
            return (Kind::Global, Fate::Taken, ANGULAR_MOMENTUM.to_owned());
        }
        if is_key(name, "Temperature") && !self.has_temperature {
            return (Kind::Other, Fate::LeftOut, NO_TEMPERATURE.to_owned());
        }
        let Some(field) = field_of(name) else {
            return (
                Kind::Other,
                Fate::LeftOut,
                "there is no such field".to_owned(),
            );
        };
        if !self.fields.contains(&field.name) {
            self.fields.push(field.name);
        }
        let note = format!("field {}", field.name);
        if field.difference.is_empty() {
            (Kind::Field, Fate::Taken, note)
        } else {
            let note = format!("{note}, {}", field.difference);
            (Kind::Field, Fate::Approximated, note)
        }
    }

    /// Write the output sections; `length` is the duration of the run, s.
    pub fn finish(self, translation: &mut Translation, length: f64) {
        let interval = self.interval(translation);
        let history_interval = self.history_interval(translation);
        let output = translation.draft.section("output");
        set_interval(output, interval, length);
        if !self.fields.is_empty() {
            let fields = self.fields.iter().map(|field| Value::text(*field));
            output.set("fields", Value::list(fields));
        }
        if history_interval.is_some() {
            let history = translation.draft.section("history");
            set_interval(history, history_interval, length);
        }
        if self.angular_momentum {
            let history = translation.draft.section("history");
            history.set("angular_momentum", Value::Flag(true));
        }
        if !self.reactions.is_empty() {
            let sets = self.reactions.into_iter().map(Value::text);
            let history = translation.draft.section("history");
            history.set("reactions", Value::list(sets));
        }
    }
}

/// Test whether the first interval is longer; return false for intervals of different kinds.
fn is_longer(one: &Frequency, other: &Frequency) -> bool {
    match (one.interval, other.interval) {
        (Interval::Steps(a), Interval::Steps(b)) => a > b,
        (Interval::Number(a), Interval::Number(b)) => a < b,
        _ => false,
    }
}

fn set_interval(section: &mut Section, interval: Option<Interval>, length: f64) {
    match interval {
        Some(Interval::Steps(steps)) => {
            section.set("every_steps", Value::Number(steps.to_string()));
        }
        Some(Interval::Number(number)) => {
            section.set("every", Value::number(length / number as f64));
        }
        None => {}
    }
}
