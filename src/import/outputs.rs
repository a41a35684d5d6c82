//! Outputs and computed quantities of Peridigm and PeriLab.

use super::draft::Value;
use super::log::Fate;
use super::sets::Sets;
use super::translation::Translation;
use super::tree::{Node, is_key};
use crate::error::Result;

/// Output variables: their names, the field, and how the field differs.
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

/// Output variables that need no field.
const ALWAYS: [(&str, &str); 11] = [
    ("Element Id", "`id` is always there"),
    ("Block Id", "`block` is always there"),
    ("Model Coordinates", "always there"),
    ("Coordinates", "always there"),
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
    ("Volume", "always there"),
    ("Specific Volume", "`volume` is always there"),
    ("Current Coordinates", "coordinates and displacement"),
    ("Deformed Coordinates", "coordinates and displacement"),
];

/// Words for the parts of tensors behind a name, such as `Cauchy_StressXX`.
const TENSOR_PARTS: [&str; 9] = ["XX", "XY", "XZ", "YX", "YY", "YZ", "ZX", "ZY", "ZZ"];

/// How often outputs are written.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Interval {
    /// Steps between outputs.
    Steps(u64),
    /// Outputs in the run.
    Number(u64),
}

/// The outputs of a deck so far.
#[derive(Default)]
pub struct Outputs {
    fields: Vec<&'static str>,
    /// The interval of each output, its key, and whether the output has fields.
    intervals: Vec<(Interval, Node, bool)>,
    /// Materials expand by prescribed temperatures, so points have some.
    has_temperature: bool,
    /// Names of computed quantities and what became of them.
    computed: Vec<(String, Fate, String)>,
    reactions: Vec<String>,
}

impl Outputs {
    /// No outputs; `has_temperature` if points have temperatures.
    pub fn new(has_temperature: bool) -> Self {
        Self {
            has_temperature,
            ..Self::default()
        }
    }

    /// Read a table of computed quantities; `label` is the key with the name of a quantity, which else is that of its table.
    ///
    /// # Errors
    /// If a position is no number, or a set is unknown.
    pub fn computed(
        &mut self,
        translation: &mut Translation,
        sets: &mut Sets,
        bodies: &[(String, String)],
        node: &Node,
    ) -> Result<()> {
        for (name, table) in node.tables() {
            let label_node = table.get("Output Label");
            let label = label_node.and_then(Node::text).unwrap_or(name).to_owned();
            let (fate, note) = self.quantity(translation, sets, bodies, (&label, table))?;
            translation.log.note(table, fate, note.clone());
            if fate != Fate::LeftOut {
                for (_, key) in table.entries() {
                    translation.log.note(key, fate, "as its table");
                }
            }
            self.computed.push((label, fate, note));
        }
        Ok(())
    }

    /// Write a computed quantity; return what became of it.
    fn quantity(
        &mut self,
        translation: &mut Translation,
        sets: &mut Sets,
        bodies: &[(String, String)],
        (label, table): (&str, &Node),
    ) -> Result<(Fate, String)> {
        let word = |key: &str| table.get(key).and_then(Node::text).unwrap_or("").to_owned();
        let class = word("Compute Class");
        let variable = word("Variable");
        let is_force = ["Force", "Forces", "External Forces"]
            .iter()
            .any(|name| is_key(&variable, name));
        let is_sum = is_key(&word("Calculation Type"), "Sum");
        if is_key(&class, "Nearest Point Data") {
            let mut position = Vec::new();
            for axis in ["X", "Y", "Z"].iter().take(translation.dimension) {
                let node = translation.required(table, axis, &format!("the quantity `{label}`"))?;
                position.push(translation.number(node, axis)?);
            }
            if is_key(&variable, "Model Coordinates") || is_key(&variable, "Coordinates") {
                let note = "a constant: the position of the nearest point";
                return Ok((Fate::LeftOut, note.to_owned()));
            }
            let field = FIELDS.iter().find(|(name, ..)| is_key(&variable, name));
            let field = field.filter(|(_, field, _)| *field != "rank");
            let Some((_, field, difference)) = field else {
                return Ok((Fate::LeftOut, "there is no such field".to_owned()));
            };
            let mut probe = vec![("at".to_owned(), Value::numbers(&position))];
            if !["displacement", "velocity"].contains(field) {
                let fields = Value::list([Value::text(*field)]);
                probe.push(("fields".to_owned(), fields));
            }
            let name = translation.name("probe", label);
            let history = translation.draft.section("history");
            history.set(format!("probe.{name}"), Value::Table(probe));
            let note = format!("[history] probe.{name}");
            return Ok(if difference.is_empty() {
                (Fate::Taken, note)
            } else {
                (Fate::Approximated, format!("{note}, {difference}"))
            });
        }
        if is_force && is_sum {
            let set = if is_key(&class, "Block Data") {
                let block = word("Block");
                let body = bodies.iter().find(|(read, _)| is_key(read, &block));
                match body {
                    Some((_, body)) => body.clone(),
                    None => return Ok((Fate::LeftOut, "its block is unknown".to_owned())),
                }
            } else if is_key(&class, "Node Set Data") {
                let name = word("Node Set");
                sets.find(translation, table, &name)?
            } else {
                return Ok((
                    Fate::LeftOut,
                    "unknown, or without a counterpart".to_owned(),
                ));
            };
            if !self.reactions.contains(&set) {
                self.reactions.push(set.clone());
            }
            let note = format!(
                "column reaction_{set}: the force of the supports on the set; opposite to the internal force at rest"
            );
            return Ok((Fate::Approximated, note));
        }
        if is_key(&variable, "Kinetic Energy") && is_sum {
            let note = "kinetic_energy of the history, of all bodies";
            return Ok((Fate::Approximated, note.to_owned()));
        }
        let energies = ["Stored Elastic Energy", "Strain Energy"];
        if energies.iter().any(|name| is_key(&variable, name)) && is_sum {
            let note = "strain_energy of the history, of all bodies";
            return Ok((Fate::Approximated, note.to_owned()));
        }
        let note = "the history has no such quantity; it follows from the fields";
        Ok((Fate::LeftOut, note.to_owned()))
    }

    /// Read an output: its variables and interval. Peridigm counts every step of an output without frequency.
    ///
    /// # Errors
    /// If the frequency is no number.
    pub fn output(&mut self, translation: &Translation, node: &Node) -> Result<()> {
        let log = &translation.log;
        let mut has_fields = false;
        if let Some(variables) = node.get("Output Variables") {
            for (name, variable) in variables.entries() {
                if !translation.is_true(variable) {
                    log.taken(variable, "not written");
                    continue;
                }
                let (fate, note) = self.variable(name, &mut has_fields);
                log.note(variable, fate, note);
            }
        }
        let keys = ["Output Frequency", "Number of Output Steps"];
        for (index, key) in keys.iter().enumerate() {
            let Some(interval) = node.get(key) else {
                continue;
            };
            // A step of PeriLab can have a number of its own; the first one counts.
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
            let note = match (index, text.contains(' ')) {
                (_, true) => "[output] every; the first number counts for all steps",
                (0, _) => "[output] every_steps",
                _ => "[output] every: the length of the run over it",
            };
            log.taken(interval, note);
            self.intervals.push((read, interval.clone(), has_fields));
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

    /// The largest interval of the outputs, of those with fields if any has. The others are listed.
    fn interval(&self, translation: &Translation) -> Option<Interval> {
        let with_fields = self.intervals.iter().any(|(.., fields)| *fields);
        let candidates = self.intervals.iter();
        let mut candidates = candidates.filter(|(.., fields)| *fields || !with_fields);
        let first = candidates.next()?;
        let (largest, node, _) = candidates.fold(first, |known, next| match (known.0, next.0) {
            (Interval::Steps(a), Interval::Steps(b)) if b > a => next,
            (Interval::Number(a), Interval::Number(b)) if b < a => next,
            _ => known,
        });
        let mut others = Vec::new();
        for (interval, other, _) in &self.intervals {
            if interval != largest {
                let note = "there is one interval for all fields; the largest counts";
                translation.log.approximated(other, note);
                others.push(other.text().unwrap_or("").trim());
            }
        }
        if !others.is_empty() {
            let note = format!("the other outputs have {}", others.join(", "));
            translation.log.approximated(node, note);
        }
        Some(*largest)
    }

    /// Note an output variable; return what becomes of it.
    fn variable(&mut self, name: &str, has_fields: &mut bool) -> (Fate, String) {
        if let Some((_, fate, note)) = self.computed.iter().find(|(label, ..)| is_key(label, name))
        {
            return (*fate, note.clone());
        }
        if let Some((_, note)) = ALWAYS.iter().find(|(known, _)| is_key(name, known)) {
            return (Fate::Taken, (*note).to_owned());
        }
        if is_key(name, "Temperature") && !self.has_temperature {
            let note = "no temperature acts on a material that expands";
            return (Fate::LeftOut, note.to_owned());
        }
        let part = TENSOR_PARTS.iter().find_map(|part| name.strip_suffix(part));
        let tensor = part.map(|name| name.trim_end_matches('_')).unwrap_or(name);
        let field = FIELDS
            .iter()
            .find(|(known, ..)| is_key(name, known) || is_key(tensor, known));
        let Some((_, field, difference)) = field else {
            return (Fate::LeftOut, "there is no such field".to_owned());
        };
        *has_fields = true;
        if !self.fields.contains(field) {
            self.fields.push(field);
        }
        if difference.is_empty() {
            (Fate::Taken, format!("field {field}"))
        } else {
            (Fate::Approximated, format!("field {field}, {difference}"))
        }
    }

    /// Write the sections; `length` is that of the run, s.
    pub fn finish(self, translation: &mut Translation, length: f64) {
        let interval = self.interval(translation);
        let output = translation.draft.section("output");
        match interval {
            Some(Interval::Steps(steps)) => {
                output.set("every_steps", Value::Number(steps.to_string()));
            }
            Some(Interval::Number(number)) => {
                output.set("every", Value::number(length / number as f64));
            }
            None => {}
        }
        if !self.fields.is_empty() {
            let fields = self.fields.iter().map(|field| Value::text(*field));
            output.set("fields", Value::list(fields));
        }
        if !self.reactions.is_empty() {
            let sets = self.reactions.into_iter().map(Value::text);
            let history = translation.draft.section("history");
            history.set("reactions", Value::list(sets));
        }
    }
}
