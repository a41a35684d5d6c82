//! The deck's text, and errors that point into it.

use std::ops::Range;
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};

/// A deck's file name and text; both are empty for a plan that was made without a deck.
#[derive(Debug, Clone, Default)]
pub struct Source {
    /// Where it was read from.
    pub path: PathBuf,
    /// The whole text.
    pub text: String,
}

impl Source {
    /// Reads a deck.
    ///
    /// # Errors
    /// When the file cannot be read or is not UTF-8.
    pub fn read(path: &Path) -> Result<Self> {
        let text = std::fs::read_to_string(path).map_err(|error| {
            Error::input(format!("cannot read the deck {}: {error}", path.display()))
        })?;
        Ok(Self {
            path: path.to_owned(),
            text,
        })
    }

    /// An error that names file, line and column and shows the line with a caret below the bytes
    /// of `span`; without a deck, the message alone.
    pub fn error(&self, span: Range<usize>, message: impl AsRef<str>) -> Error {
        if self.path.as_os_str().is_empty() {
            return Error::input(message.as_ref());
        }
        let start = span.start.min(self.text.len());
        let start = (0..=start)
            .rev()
            .find(|at| self.text.is_char_boundary(*at))
            .unwrap_or(0);
        let before = &self.text[..start];
        let line_number = before.matches('\n').count() + 1;
        let line_start = before.rfind('\n').map_or(0, |at| at + 1);
        let line = self.text[line_start..].lines().next().unwrap_or("");
        let column = self.text[line_start..start].chars().count();
        let rest = line.chars().count().saturating_sub(column);
        let marked = self
            .text
            .get(start..span.end)
            .map_or(1, |text| text.chars().count());
        let carets = "^".repeat(marked.clamp(1, rest.max(1)));
        let gutter = " ".repeat(line_number.to_string().len());
        let tabs_kept: String = line
            .chars()
            .take(column)
            .map(|c| if c == '\t' { '\t' } else { ' ' })
            .collect();
        Error::input(format!(
            "{}:{line_number}:{}: {}\n{gutter} |\n{line_number} | {line}\n{gutter} | {tabs_kept}{carets}",
            self.path.display(),
            column + 1,
            message.as_ref(),
        ))
    }
}

/// The entry of `known` that is most like `name`, if any is like it at all.
pub fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    known
        .into_iter()
        .map(|candidate| {
            let likeness = strsim::jaro_winkler(&name.to_lowercase(), &candidate.to_lowercase());
            (likeness, candidate)
        })
        .filter(|(likeness, _)| *likeness > 0.75)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, candidate)| candidate)
}

/// `; did you mean …? known: …`, for an error on an unknown name.
pub fn suggestion<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    let known: Vec<&str> = known.into_iter().collect();
    let mean = nearest(name, known.iter().copied())
        .map_or(String::new(), |near| format!("; did you mean `{near}`?"));
    match known.is_empty() {
        true => format!("{mean} (none is defined)"),
        false => format!("{mean} (known: {})", known.join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_caret_stands_below_the_mistake() {
        let source = Source {
            path: "a.toml".into(),
            text: "one = 1\ntwo = µ, bad\n".into(),
        };
        let at = source.text.find("bad").unwrap();
        let error = source.error(at..at + 3, "no such thing");
        assert_eq!(
            error.message,
            "a.toml:2:10: no such thing\n  |\n2 | two = µ, bad\n  |          ^^^"
        );
    }

    #[test]
    fn a_suggestion_names_the_nearest() {
        assert_eq!(
            suggestion("horizn", ["spacing", "horizon"]),
            "; did you mean `horizon`? (known: spacing, horizon)"
        );
        assert_eq!(suggestion("a", []), " (none is defined)");
    }
}
