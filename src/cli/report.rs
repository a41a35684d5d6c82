//! Reports: lines of names and values under headings.

use std::fmt::{Display, Write};

/// The text of a report.
#[derive(Default)]
pub struct Report {
    /// Lines of the report.
    pub text: String,
}

impl Report {
    /// Append a line that is not indented, such as a heading or a warning.
    pub fn heading(&mut self, text: impl Display) {
        let _ = writeln!(self.text, "{text}");
    }

    /// Append an indented line with a name and its value.
    pub fn line(&mut self, name: &str, value: impl Display) {
        let _ = writeln!(self.text, "  {name:<24}{value}");
    }
}
