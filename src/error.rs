//! The error type of the crate, and warnings. An error has a message for the user and a category.
//!
//! An error or warning may refer to bytes of the deck by a span. [`Deck::locate`](crate::deck::Deck::locate)
//! converts the span to file, line and column.

use std::fmt;
use std::io;
use std::ops::Range;
use std::path::Path;

/// Category of an error; sets the exit code.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ErrorKind {
    /// The deck, a file that it names, or the command line is wrong: exit code 2.
    Input,
    /// The run itself failed, for example because of the disk, the memory or a value that is not finite: exit
    /// code 1.
    Run,
    /// A signal or a time limit has stopped `fissure sweep`, or a signal has stopped a run before its first
    /// step. The exit code is 75, which `sysexits.h` defines as "try again".
    Stopped,
}

/// An error for the user. If the input is wrong, the message names the wrong key or file, and what is
/// allowed.
#[derive(Debug, Clone)]
pub struct Error {
    /// Category of the error.
    pub kind: ErrorKind,
    /// The message, without a leading `error:`; may span several lines.
    pub message: String,
    /// Span of the wrong text in the deck. `None` if the message itself says where the error is, or if no
    /// text of the deck is wrong.
    pub span: Option<Range<usize>>,
}

/// A warning: an allowed setting that is probably a mistake.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Warning {
    /// The message, without a leading `warning:`; one line.
    pub message: String,
    /// Span of the text in the deck that the warning refers to; `None` if the message itself states the
    /// location.
    pub span: Option<Range<usize>>,
}

/// `Result` with the error type of this crate.
pub type Result<T> = std::result::Result<T, Error>;

/// Largest number of characters of a user's text that a message quotes.
const EXCERPT: usize = 40;

/// Format a user's text for a message: in backticks, with escaped control characters. A text of more than
/// `EXCERPT` characters is cut after the first `EXCERPT` characters, and `…` is appended.
pub fn excerpt(text: &str) -> String {
    let escape = |c: char| {
        if c.is_control() {
            c.escape_default().to_string()
        } else {
            c.to_string()
        }
    };
    let mut shown: String = text.chars().take(EXCERPT).map(escape).collect();
    if text.chars().nth(EXCERPT).is_some() {
        shown.push('…');
    }
    format!("`{shown}`")
}

impl Error {
    fn new(kind: ErrorKind, message: impl Into<String>) -> Self {
        Self {
            kind,
            message: message.into(),
            span: None,
        }
    }

    /// Create an error about wrong input: a deck, a file that the deck names, or the command line.
    pub fn input(message: impl Into<String>) -> Self {
        Self::new(ErrorKind::Input, message)
    }

    /// Create an error about a run that failed.
    pub fn run(message: impl Into<String>) -> Self {
        Self::new(ErrorKind::Run, message)
    }

    /// Create an error of the kind [`ErrorKind::Stopped`].
    pub fn stopped(message: impl Into<String>) -> Self {
        Self::new(ErrorKind::Stopped, message)
    }

    /// Create the error of a failed file operation. `doing` is the operation, such as `read`.
    pub fn file(path: &Path, doing: &str, error: &io::Error) -> Self {
        Self::run(format!("cannot {doing} {}: {error}", path.display()))
    }

    /// Return the error with a span in the deck.
    pub fn at(self, span: &Range<usize>) -> Self {
        Self {
            span: Some(span.clone()),
            ..self
        }
    }

    /// Test whether a run or `fissure sweep` was stopped. Such a stop is not a failure.
    pub fn is_stop(&self) -> bool {
        self.kind == ErrorKind::Stopped
    }

    /// Return the process's exit code: 1 for a failed run, 2 for wrong input, 75 for a stop.
    pub fn exit_code(&self) -> u8 {
        match self.kind {
            ErrorKind::Run => 1,
            ErrorKind::Input => 2,
            ErrorKind::Stopped => 75,
        }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.message)
    }
}

impl std::error::Error for Error {}

impl Warning {
    /// Create a warning without a span in the deck.
    pub fn new(message: impl Into<String>) -> Self {
        Self {
            message: message.into(),
            span: None,
        }
    }

    /// Return the warning with a span in the deck.
    pub fn at(self, span: &Range<usize>) -> Self {
        Self {
            span: Some(span.clone()),
            ..self
        }
    }
}

impl fmt::Display for Warning {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.message)
    }
}

#[cfg(test)]
mod tests {
    use super::excerpt;

    #[test]
    fn an_excerpt_is_short_and_on_one_line() {
        assert_eq!(excerpt("half"), "`half`");
        assert_eq!(excerpt("a\nb\0é"), "`a\\nb\\u{0}é`");
        assert_eq!(excerpt(&"µ".repeat(41)), format!("`{}…`", "µ".repeat(40)));
    }
}
