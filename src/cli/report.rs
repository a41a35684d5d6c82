//! Reports: lines of names and values under headings.

use std::fmt::{Display, Write};

/// The text of a report.
#[derive(Default)]
pub struct Report {
    /// Lines of the report.
    pub text: String,
}

impl Report {
    /// Append a line, such as a heading.
    pub fn heading(&mut self, text: impl Display) {
        let _ = writeln!(self.text, "{text}");
    }

    /// Append a name and its value.
    pub fn line(&mut self, name: &str, value: impl Display) {
        let _ = writeln!(self.text, "  {name:<24}{value}");
    }
}
