//! What a command finds, as lines of a name and a value under headings.

use std::fmt::{Display, Write};

/// The text of a report.
#[derive(Default)]
pub struct Report {
    /// All lines so far.
    pub text: String,
}

impl Report {
    /// A line of its own, such as a heading.
    pub fn say(&mut self, words: impl Display) {
        let _ = writeln!(self.text, "{words}");
    }

    /// A name and its value.
    pub fn line(&mut self, name: &str, value: impl Display) {
        let _ = writeln!(self.text, "  {name:<24}{value}");
    }
}
