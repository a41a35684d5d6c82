//! State of an import: the source deck, the log of its keys, and the new deck.

use std::cell::RefCell;
use std::path::{Path, PathBuf};

use super::draft::{Draft, Section, Value};
use super::expression::{Dialect, rewrite};
use super::files::relative;
use super::log::Log;
use super::tree::Node;
use crate::deck::Source;
use crate::error::{Error, Result, excerpt};
use crate::expression::{POSITION, POSITION_AND_TIME};

/// Maximum length of the name of a table before a suffix such as `_2` is added, characters. Names in decks
/// have at most 64 characters.
const LONGEST_NAME: usize = 56;

/// State of an import.
pub struct Translation<'a> {
    /// The source deck.
    pub source: &'a Source,
    /// Folder of the new deck.
    target: PathBuf,
    /// Language of the expressions in the source deck.
    pub dialect: Dialect,
    /// Outcome of each key of the source deck.
    pub log: Log,
    /// The new deck.
    pub draft: Draft,
    /// Number of dimensions.
    pub dimension: usize,
    /// Time of the source deck minus the time of the run, in the first solver step in which the current
    /// condition acts, s.
    pub shift: f64,
    /// Files that the new deck reads, relative to the working directory or absolute.
    pub files: RefCell<Vec<PathBuf>>,
    /// Start of the first solver step in which the current condition acts, measured from the start of the
    /// run, s.
    pub step_start: f64,
    /// Names of tables: section, name in the source deck, and name in the new deck.
    names: Vec<(&'static str, String, String)>,
}

impl<'a> Translation<'a> {
    /// Start an import; `target` is the path of the new deck.
    pub fn new(source: &'a Source, target: &Path, dialect: Dialect) -> Self {
        Self {
            source,
            target: target.parent().unwrap_or("".as_ref()).to_owned(),
            dialect,
            log: Log::default(),
            draft: Draft::default(),
            dimension: 3,
            shift: 0.0,
            files: RefCell::default(),
            step_start: 0.0,
            names: Vec::new(),
        }
    }

    /// Create an error for a line of the source deck.
    pub fn error(&self, line: usize, message: impl AsRef<str>) -> Error {
        line_error(self.source, line, message)
    }

    /// Return the value of a required key. `name` describes the table in the error message.
    ///
    /// # Errors
    /// If the key is missing.
    pub fn required<'n>(&self, table: &'n Node, key: &str, name: &str) -> Result<&'n Node> {
        let missing = || self.error(table.line, format!("{name} has no `{key}`"));
        table.get(key).ok_or_else(missing)
    }

    /// Return the text of a value.
    ///
    /// # Errors
    /// If the value is a list or a table.
    pub fn text<'n>(&self, node: &'n Node, key: &str) -> Result<&'n str> {
        let wrong = || self.error(node.line, format!("`{key}` must be a number or a text"));
        node.text().ok_or_else(wrong)
    }

    /// Return a number, which may be given as an expression without variables.
    ///
    /// # Errors
    /// If the value is not a number.
    pub fn number(&self, node: &Node, key: &str) -> Result<f64> {
        let text = self.text(node, key)?;
        let number = text.parse::<f64>().ok().or_else(|| {
            let constant = rewrite(text, self.dialect, &|_| None, &[]).ok()?;
            constant.parse().ok()
        });
        let number = number.filter(|number| number.is_finite());
        number.ok_or_else(|| {
            let message = format!("`{key}` must be a number, is {}", excerpt(text));
            self.error(node.line, message)
        })
    }

    /// Return a number as a value of the new deck.
    ///
    /// # Errors
    /// Same as [`number`](Self::number).
    pub fn number_value(&self, node: &Node, key: &str) -> Result<Value> {
        let number = self.number(node, key)?;
        let text = self.text(node, key)?;
        Ok(match text.parse::<f64>() {
            Ok(_) => Value::number_or_expression(text),
            Err(_) => Value::number(number),
        })
    }

    /// Return a whole number.
    ///
    /// # Errors
    /// If the value is negative, not whole, or 10¹⁵ or more.
    pub fn count(&self, node: &Node, key: &str) -> Result<u64> {
        let number = self.number(node, key)?;
        let is_whole = (0.0..1e15).contains(&number) && number.fract() == 0.0;
        if is_whole {
            Ok(number as u64)
        } else {
            let message = format!("`{key}` must be a whole number, is {number}");
            Err(self.error(node.line, message))
        }
    }

    /// Read a truth value: `true`, `yes`, `on` and `1` are true, any other text is false.
    pub fn is_true(&self, node: &Node) -> bool {
        node.text().is_some_and(|text| {
            ["true", "yes", "on", "1"]
                .iter()
                .any(|word| text.eq_ignore_ascii_case(word))
        })
    }

    /// Translate an expression of the position. If `of_time` is true, the expression may also contain the
    /// time. `Err` holds a message.
    pub fn expression(&self, text: &str, of_time: bool) -> std::result::Result<Value, String> {
        let shift = self.shift;
        let names = |name: &str| match name {
            "t" if shift > 0.0 => Some(format!("(t + {shift:?})")),
            "t" if shift < 0.0 => Some(format!("(t - {:?})", -shift)),
            // In PeriLab `st` is the time since the start of a step.
            "st" if self.dialect == Dialect::PeriLab => Some(if self.step_start == 0.0 {
                "t".to_owned()
            } else {
                format!("(t - {:?})", self.step_start)
            }),
            _ => None,
        };
        let variables = if of_time {
            &POSITION_AND_TIME[..]
        } else {
            &POSITION[..]
        };
        let variables: Vec<_> = (0..variables.len())
            .filter(|k| *k < self.dimension || *k == 3)
            .map(|k| variables[k])
            .collect();
        let text = rewrite(text, self.dialect, &names, &variables)?;
        Ok(Value::number_or_expression(&text))
    }

    /// Translate an expression of position and time for a given time of the source deck (s). `Err` holds a
    /// message.
    pub fn at_time(&self, text: &str, time: f64) -> std::result::Result<Value, String> {
        let names = |name: &str| (name == "t").then(|| format!("({time:?})"));
        let variables = &POSITION[..self.dimension.min(POSITION.len())];
        let text = rewrite(text, self.dialect, &names, variables)?;
        Ok(Value::number_or_expression(&text))
    }

    /// Return the name in the new deck for a table of the source deck. The name is unique in its section.
    /// Calls with the same section and the same source name return the same name.
    pub fn name(&mut self, section: &'static str, name: &str) -> String {
        let same = |(s, read, _): &&(&str, String, String)| *s == section && read == name;
        if let Some((.., written)) = self.names.iter().find(same) {
            return written.clone();
        }
        let written = self.new_name(section, name);
        self.names.push((section, name.to_owned(), written.clone()));
        written
    }

    /// Return a name for a new table of a section of the new deck. The name differs from the names of all
    /// earlier tables of this section, even if an earlier table had the same name in the source deck. For a
    /// body, pass `set` as the section: a body is also a set, so a body and a set must not have the same
    /// name.
    pub fn new_name(&mut self, section: &'static str, name: &str) -> String {
        let plain = slug(name);
        let taken = |written: &str| {
            let mut names = self.names.iter();
            (section == "set" && written == "all")
                || names.any(|(s, _, known)| *s == section && known == written)
        };
        let free = (1..).map(|k| match k {
            1 => plain.clone(),
            k => format!("{plain}_{k}"),
        });
        let written = free
            .into_iter()
            .find(|name| !taken(name))
            .expect("numbers have no end");
        self.names.push((section, String::new(), written.clone()));
        written
    }

    /// Return the path, relative to the working directory, of a file that the source deck names.
    pub fn path(&self, file: &str) -> PathBuf {
        let folder = self.source.path.parent().unwrap_or("".as_ref());
        folder.join(file)
    }

    /// Return the path of a file of the source deck, relative to the new deck. An absolute path stays
    /// absolute. Also add the file to [`Self::files`], because the new deck reads it.
    pub fn file(&self, file: &str) -> Value {
        let path = self.path(file);
        self.files.borrow_mut().push(path.clone());
        let path = if Path::new(file).is_absolute() {
            path
        } else {
            relative(&path, &self.target)
        };
        Value::text(path.display().to_string().replace('\\', "/"))
    }

    /// Create a vector. The component with the index `component` is `value`, and each other component is
    /// `others`.
    pub fn component(&self, component: usize, value: Value, others: &Value) -> Value {
        Value::list((0..self.dimension).map(|k| {
            if k == component {
                value.clone()
            } else {
                others.clone()
            }
        }))
    }

    /// Leave out an initial value, load or support, and write a comment in its place.
    pub fn leave_out_load(&mut self, node: &Node, section: &str, name: &str, why: &str) {
        self.log.lose_load(node, why);
        let header = format!("{section}.{}", slug(name));
        self.draft.leave_out(&header, why);
    }

    /// Add a section to the new deck.
    pub fn add(&mut self, section: Section) {
        self.draft.add(section);
    }
}

/// Create an error for a line of a deck.
pub fn line_error(source: &Source, line: usize, message: impl AsRef<str>) -> Error {
    let start = match line {
        0 | 1 => 0,
        line => {
            let breaks = source.text.match_indices('\n').map(|(at, _)| at + 1);
            breaks.take(line - 1).last().unwrap_or(0)
        }
    };
    let rest = &source.text[start..];
    let text = rest.lines().next().unwrap_or("");
    let indent = text.len() - text.trim_start().len();
    source.error(
        start + indent..start + text.trim_end().len().max(indent),
        message,
    )
}

/// Return a name in lower case, with letters, digits and underscores only, and with at most `LONGEST_NAME`
/// characters.
fn slug(name: &str) -> String {
    let mut slug = String::new();
    for c in name.trim().chars().take(LONGEST_NAME) {
        let c = c.to_ascii_lowercase();
        if c.is_ascii_alphanumeric() {
            slug.push(c);
        } else if !slug.ends_with('_') && !slug.is_empty() {
            slug.push('_');
        }
    }
    match slug.trim_end_matches('_') {
        "" => "unnamed".to_owned(),
        slug => slug.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_plain_and_unique() {
        let source = Source::new("a.yaml", String::new());
        let mut translation = Translation::new(&source, "b.toml".as_ref(), Dialect::Peridigm);
        assert_eq!(translation.name("set", "My Set (left)"), "my_set_left");
        assert_eq!(translation.name("set", "my set left"), "my_set_left_2");
        assert_eq!(translation.name("set", "My Set (left)"), "my_set_left");
        assert_eq!(translation.name("body", "my set left"), "my_set_left");
        assert_eq!(translation.new_name("set", "All"), "all_2");
        assert_eq!(translation.name("set", "é"), "unnamed");
    }
}
