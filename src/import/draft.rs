//! The new deck of an import: sections with keys, and their conversion to TOML.

use std::fmt::Write;

use super::log::Entry;

/// Order of the sections in the text, by the first word of the header.
const ORDER: [&str; 16] = [
    "parameters",
    "grid",
    "interface",
    "contact",
    "rigid",
    "material",
    "damage",
    "body",
    "set",
    "crack",
    "initial",
    "condition",
    "time",
    "stage",
    "output",
    "history",
];

/// A value of a deck.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    /// A number, as text.
    Number(String),
    /// A text, a name or an expression.
    Text(String),
    /// Whole numbers.
    Ids(Vec<u64>),
    /// A list of values.
    List(Vec<Value>),
    /// An inline table.
    Table(Vec<(String, Value)>),
    /// `true` or `false`.
    Flag(bool),
}

impl Value {
    /// Create a text value.
    pub fn text(text: impl Into<String>) -> Self {
        Self::Text(text.into())
    }

    /// Create a value from a computed number. The number is rounded to 15 digits, which hides round-off.
    pub fn number(value: f64) -> Self {
        let rounded = format!("{value:.14e}").parse::<f64>().unwrap_or(value);
        Self::Number(if rounded.is_nan() {
            "nan".to_owned()
        } else {
            format!("{rounded:?}")
        })
    }

    /// Create a number if the text is a finite number, otherwise an expression. The text is kept if TOML
    /// reads it as the same number.
    pub fn number_or_expression(text: &str) -> Self {
        match text.parse::<f64>() {
            Ok(value) if value.is_finite() && is_toml_number(text) => Self::Number(text.to_owned()),
            Ok(value) if value.is_finite() => Self::number(value),
            _ => Self::text(text),
        }
    }

    /// Return a number or expression as text, without quotes around an expression.
    pub fn plain(&self) -> String {
        match self {
            Self::Text(text) => text.clone(),
            other => written(other),
        }
    }

    /// Create a list value.
    pub fn list(values: impl IntoIterator<Item = Value>) -> Self {
        Self::List(values.into_iter().collect())
    }

    /// Create a list of numbers.
    pub fn numbers(values: &[f64]) -> Self {
        Self::list(values.iter().map(|value| Self::number(*value)))
    }
}

/// Test whether the text of a number is also a number in TOML.
fn is_toml_number(text: &str) -> bool {
    let digits = |part: &str| !part.is_empty() && part.bytes().all(|b| b.is_ascii_digit());
    let unsigned = text.strip_prefix(['+', '-']).unwrap_or(text);
    let (mantissa, exponent) = match unsigned.split_once(['e', 'E']) {
        Some((mantissa, exponent)) => (mantissa, Some(exponent)),
        None => (unsigned, None),
    };
    let (whole, fraction) = match mantissa.split_once('.') {
        Some((whole, fraction)) => (whole, Some(fraction)),
        None => (mantissa, None),
    };
    let exponent_digits = |text: &str| digits(text.strip_prefix(['+', '-']).unwrap_or(text));
    digits(whole)
        && (whole == "0" || !whole.starts_with('0'))
        && whole.len() < 19
        && fraction.is_none_or(digits)
        && exponent.is_none_or(exponent_digits)
}

/// A section of the new deck.
#[derive(Debug, Clone, PartialEq)]
pub struct Section {
    header: String,
    /// Comment lines before the section.
    comments: Vec<String>,
    lines: Vec<(String, Value)>,
    /// Whether only the comments are written.
    is_left_out: bool,
}

impl Section {
    /// Create a section without keys; the header is the text between the brackets.
    pub fn new(header: impl Into<String>) -> Self {
        Self {
            header: header.into(),
            comments: Vec::new(),
            lines: Vec::new(),
            is_left_out: false,
        }
    }

    /// Test whether this section has the header `header`. False if only the comments of the section are
    /// written.
    fn is(&self, header: &str) -> bool {
        !self.is_left_out && self.header == header
    }

    /// Return the header, without brackets.
    pub fn header(&self) -> &str {
        &self.header
    }

    /// Add a comment line before the section.
    pub fn comment(&mut self, comment: impl Into<String>) -> &mut Self {
        self.comments.push(comment.into());
        self
    }

    /// Return the value of a key.
    pub fn get(&self, key: &str) -> Option<&Value> {
        let (_, value) = self.lines.iter().find(|(known, _)| known == key)?;
        Some(value)
    }

    /// Set a key.
    pub fn set(&mut self, key: impl Into<String>, value: Value) -> &mut Self {
        let key = key.into();
        match self.lines.iter_mut().find(|(known, _)| *known == key) {
            Some(line) => line.1 = value,
            None => self.lines.push((key, value)),
        }
        self
    }
}

/// The new deck of an import.
#[derive(Debug, Default)]
pub struct Draft {
    /// Keys before all sections.
    top: Vec<(String, Value)>,
    sections: Vec<Section>,
}

impl Draft {
    /// Set a key that stands before all sections of the deck.
    pub fn top(&mut self, key: &str, value: Value) {
        self.top.push((key.to_owned(), value));
    }

    /// Test whether this key is one of the keys before all sections.
    pub fn has_top(&self, key: &str) -> bool {
        self.top.iter().any(|(known, _)| known == key)
    }

    /// Test whether a key before all sections has this text as its value.
    pub fn top_is(&self, key: &str, text: &str) -> bool {
        let wanted = Value::text(text);
        self.top
            .iter()
            .any(|(known, value)| known == key && *value == wanted)
    }

    /// Add a section.
    pub fn add(&mut self, section: Section) {
        self.sections.push(section);
    }

    /// Return the section whose header is `header`; add this section if it is missing.
    pub fn section(&mut self, header: &str) -> &mut Section {
        let found = self.sections.iter().position(|section| section.is(header));
        let index = found.unwrap_or_else(|| {
            self.sections.push(Section::new(header));
            self.sections.len() - 1
        });
        &mut self.sections[index]
    }

    /// Test whether the deck has a section with this header. Sections that [`Self::leave_out`] added do not
    /// count.
    pub fn has(&self, header: &str) -> bool {
        self.sections.iter().any(|section| section.is(header))
    }

    /// Test whether any condition of the deck prescribes displacement or velocity.
    pub fn has_support(&self) -> bool {
        let prescribes = |section: &Section, key: &str| section.get(key).is_some();
        self.sections.iter().any(|section| {
            section.header.starts_with("condition.")
                && (prescribes(section, "displacement") || prescribes(section, "velocity"))
        })
    }

    /// Write a comment instead of a section that the import cannot translate.
    pub fn leave_out(&mut self, header: &str, why: &str) {
        let mut section = Section::new(header);
        section.comment(format!("left out: [{header}] {why}"));
        section.is_left_out = true;
        self.sections.push(section);
    }

    /// Return the text of the deck. The text starts with comments: the lines of `heading`, then one line for
    /// each of `entries`. An entry is a key of the source deck with its outcome.
    pub fn text(&self, heading: &[String], entries: &[Entry]) -> String {
        let mut text = String::new();
        let comment = |text: &mut String, line: &str| {
            let _ = writeln!(text, "{}", format!("# {line}").trim_end());
        };
        for line in heading {
            comment(&mut text, &printable(line));
        }
        comment(&mut text, "");
        comment(&mut text, " line  what became of it");
        for entry in entries {
            comment(&mut text, &printable(&entry.to_string()));
        }
        text.push('\n');
        for (key, value) in &self.top {
            let _ = writeln!(text, "{key} = {}", written(value));
        }
        let rank = |section: &&Section| {
            let word = section.header.split('.').next().unwrap_or("");
            ORDER.iter().position(|known| *known == word)
        };
        let mut sections: Vec<&Section> = self.sections.iter().collect();
        sections.sort_by_key(rank);
        for section in sections {
            text.push('\n');
            for line in &section.comments {
                comment(&mut text, &printable(line));
            }
            if section.is_left_out {
                continue;
            }
            let header = &section.header;
            let _ = match header.as_str() {
                "stage" => writeln!(text, "[[{header}]]"),
                _ => writeln!(text, "[{header}]"),
            };
            for (key, value) in &section.lines {
                let _ = writeln!(text, "{key} = {}", written(value));
            }
        }
        text
    }
}

/// Replace control characters, which a comment must not contain.
fn printable(text: &str) -> String {
    text.replace(char::is_control, " ")
}

/// Return a value as TOML.
fn written(value: &Value) -> String {
    match value {
        Value::Number(text) => text.clone(),
        Value::Flag(flag) => flag.to_string(),
        Value::Text(text) => quoted(text),
        Value::Ids(ids) => {
            let mut text = "[".to_owned();
            for (index, id) in ids.iter().enumerate() {
                match index {
                    0 => {}
                    _ if index % 20 == 0 => text.push_str(",\n    "),
                    _ => text.push_str(", "),
                }
                text.push_str(&id.to_string());
            }
            text + "]"
        }
        Value::List(values) => {
            let values: Vec<String> = values.iter().map(written).collect();
            format!("[{}]", values.join(", "))
        }
        Value::Table(entries) => {
            let entries = entries
                .iter()
                .map(|(key, value)| format!("{key} = {}", written(value)));
            format!("{{ {} }}", entries.collect::<Vec<_>>().join(", "))
        }
    }
}

/// Return a text as a basic string of TOML.
fn quoted(text: &str) -> String {
    let mut quoted = "\"".to_owned();
    for c in text.chars() {
        match c {
            '"' | '\\' => quoted.extend(['\\', c]),
            c if c.is_control() => {
                let _ = write!(quoted, "\\u{:04X}", u32::from(c));
            }
            c => quoted.push(c),
        }
    }
    quoted + "\""
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_written_as_they_stand_where_toml_reads_them_alike() {
        for (text, expected) in [
            ("130.0e9", "130.0e9"),
            ("5", "5"),
            ("-1.5E-3", "-1.5E-3"),
            ("1.", "1.0"),
            (".5", "0.5"),
            ("007", "7.0"),
            ("1.e-01", "0.1"),
            ("2.5e+3", "2.5e+3"),
        ] {
            let value = Value::number_or_expression(text);
            assert_eq!(written(&value), expected);
            let parsed: toml::Table = toml::from_str(&format!("a = {expected}")).unwrap();
            let number = parsed["a"]
                .as_float()
                .or(parsed["a"].as_integer().map(|a| a as f64));
            assert_eq!(number, text.parse().ok());
        }
        assert_eq!(written(&Value::number_or_expression("2*t")), "\"2*t\"");
        assert_eq!(written(&Value::number_or_expression("nan")), "\"nan\"");
    }

    #[test]
    fn the_text_of_a_draft_is_toml() {
        let mut draft = Draft::default();
        draft.top("title", Value::text("a \"b\"\n\\"));
        draft.section("time").set("end", Value::number(1e-7));
        draft
            .section("set.a")
            .set("ids", Value::Ids((0..45).collect()));
        let points = vec![("block".to_owned(), Value::Number("1".to_owned()))];
        draft.section("body.b").set("points", Value::Table(points));
        let text = draft.text(&["from\nanother".to_owned()], &[]);
        let table: toml::Table = toml::from_str(&text).unwrap();
        assert_eq!(table["title"].as_str(), Some("a \"b\"\n\\"));
        assert_eq!(table["set"]["a"]["ids"].as_array().map(Vec::len), Some(45));
        assert_eq!(table["body"]["b"]["points"]["block"].as_integer(), Some(1));
        assert!(text.find("[body.b]") < text.find("[set.a]"));
        assert!(text.find("[set.a]") < text.find("[time]"));
    }
}
