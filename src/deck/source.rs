//! The text of the deck, and errors that point into this text.

use std::fs::File;
use std::io::Read;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::source_map::SourceMap;
use crate::error::{Error, Result, Warning};

/// Largest size of a deck, bytes.
const LONGEST: u64 = 1 << 28;

/// Approximate largest number of characters of an error, unless the path is very long.
const LONGEST_ERROR: usize = 790;

/// Largest number of characters in the message of an error or warning. The location and the excerpt do not
/// count.
const LONGEST_MESSAGE: usize = 600;

/// Smallest and largest width of the excerpt of a line, in characters. The longer the
/// message of the error, the smaller the width. A line that fits in this width is shown whole.
const EXCERPT_WIDTHS: [usize; 2] = [24, 160];

/// The path and the text of a deck.
#[derive(Debug, Clone)]
pub struct Source {
    /// Path of the file.
    pub path: PathBuf,
    /// The whole text.
    pub text: String,
    /// The files that the text was merged from; `None` if the text is the content of the file at `path`.
    source_map: Option<Arc<SourceMap>>,
}

/// Note for an error in a line of the merged deck that comes from none of the merged files.
const CHANGED: &str = "\nnote: lines are those of the deck as changed by --with and --set";

impl Source {
    /// Create a source from the path and the text of a file.
    pub fn new(path: impl Into<PathBuf>, text: impl Into<String>) -> Self {
        Self {
            path: path.into(),
            text: text.into(),
            source_map: None,
        }
    }

    /// Create a source from a text that was merged from `files`; the first file is the deck. Errors name the
    /// lines of these files.
    pub(super) fn changed(text: String, files: Vec<Self>) -> Self {
        let files: Vec<_> = files
            .into_iter()
            .map(|file| (file.path, file.text))
            .collect();
        let mut source = Self::new(files[0].0.clone(), text);
        source.source_map = Some(Arc::new(SourceMap::new(&source.text, files)));
        source
    }

    /// Return the path and text of the file that `span` comes from, the span in this file, and an empty note.
    /// For a span that comes from no file, return the path of the deck, the merged text, the unchanged span
    /// and the note [`CHANGED`].
    fn place(&self, span: Range<usize>) -> (&Path, &str, Range<usize>, &'static str) {
        let Some(source_map) = &self.source_map else {
            return (&self.path, &self.text, span, "");
        };
        match source_map.find(&span, self.text.len()) {
            Some((path, text, span)) => (path, text, span, ""),
            None => (&self.path, &self.text, span, CHANGED),
        }
    }

    /// Read a deck.
    ///
    /// # Errors
    /// If the file cannot be read, is not UTF-8, or is longer than `LONGEST`.
    pub fn read(path: &Path) -> Result<Self> {
        let mut bytes = Vec::new();
        let read = |bytes: &mut Vec<u8>| File::open(path)?.take(LONGEST + 1).read_to_end(bytes);
        read(&mut bytes).map_err(|error| {
            Error::input(format!("cannot read the deck {}: {error}", path.display()))
        })?;
        if bytes.len() as u64 > LONGEST {
            let message = format!("{}: is longer than {LONGEST} bytes", path.display());
            return Err(Error::input(format!("{message}; is this a deck?")));
        }
        match String::from_utf8(bytes) {
            Ok(text) => Ok(Self::new(path, text)),
            Err(error) => {
                let valid = error.utf8_error().valid_up_to();
                let source = Self::new(path, String::from_utf8_lossy(error.as_bytes()));
                let message = "is not UTF-8 text from here on; save the deck as UTF-8";
                Err(source.error(valid..valid + 1, message))
            }
        }
    }

    /// Return an input error with file, line, column and an excerpt of the line.
    pub fn error(&self, span: Range<usize>, message: impl AsRef<str>) -> Error {
        Error::input(self.marked(span, message.as_ref()))
    }

    /// Add file and line to a warning that has a span.
    pub fn locate_warning(&self, warning: Warning) -> Warning {
        let Some(span) = warning.span else {
            return warning;
        };
        let message = shortened(&warning.message, LONGEST_MESSAGE);
        let (path, text, span, _) = self.place(span);
        let start = text.floor_char_boundary(span.start);
        let line = text[..start].matches('\n').count() + 1;
        Warning::new(format!("{}:{line}: {message}", path.display()))
    }

    /// Add file, line, column and an excerpt of the line to an error that has a span.
    pub fn locate(&self, error: Error) -> Error {
        let Some(span) = error.span else {
            return error;
        };
        Error {
            message: self.marked(span, &error.message),
            span: None,
            ..error
        }
    }

    /// Format the path, the line number, the column and the message. Append the text of the line, with carets
    /// below the bytes of `span`. The result has at most about 800 characters, unless the path is very long.
    fn marked(&self, span: Range<usize>, message: &str) -> String {
        let message = shortened(message, LONGEST_MESSAGE);
        let (path, text, span, note) = self.place(span);
        let start = text.floor_char_boundary(span.start);
        let before = &text[..start];
        let line_number = before.matches('\n').count() + 1;
        let line_start = before.rfind('\n').map_or(0, |at| at + 1);
        let line = text[line_start..].lines().next().unwrap_or("");
        let column = text[line_start..start].chars().count();
        let marked = text
            .get(start..span.end)
            .map_or(1, |text| text.chars().take(LONGEST_ERROR).count());
        let heading = format!("{}:{line_number}:{}: {message}", path.display(), column + 1);
        let room = LONGEST_ERROR.saturating_sub(heading.chars().count()) / 2;
        let window = Window::new(
            line,
            column,
            room.saturating_sub(12)
                .clamp(EXCERPT_WIDTHS[0], EXCERPT_WIDTHS[1]),
        );
        let carets = "^".repeat(marked.clamp(1, window.rest().max(1)));
        let gutter = " ".repeat(line_number.to_string().len());
        format!(
            "{heading}\n{gutter} |\n{line_number} | {}\n{gutter} | {}{carets}{note}",
            window.text, window.indent,
        )
    }
}

/// Excerpt of the marked line, for an error message.
struct Window {
    text: String,
    /// Blanks of the same width as the text before the marked column; tabs are kept as tabs.
    indent: String,
}

impl Window {
    /// Return an excerpt of a line. The excerpt includes `column` and has at most `width` characters.
    fn new(line: &str, column: usize, width: usize) -> Self {
        // `column` may be one past the last character of the line.
        let fits = line.chars().nth(width).is_none();
        let first = if fits || column < 2 * width / 3 {
            0
        } else {
            column - width / 3
        };
        let mut shown: Vec<char> = line.chars().skip(first).take(width).collect();
        if first > 0 {
            shown[0] = '…';
        }
        if line.chars().nth(first + width).is_some() {
            shown[width - 1] = '…';
        }
        for c in &mut shown {
            if c.is_control() && *c != '\t' {
                *c = char::REPLACEMENT_CHARACTER;
            }
        }
        let blank = |c: &char| if *c == '\t' { '\t' } else { ' ' };
        Self {
            indent: shown.iter().take(column - first).map(blank).collect(),
            text: shown.into_iter().collect(),
        }
    }

    /// Return the number of characters from the marked column to the end of the excerpt.
    fn rest(&self) -> usize {
        self.text.chars().count() - self.indent.chars().count()
    }
}

/// Return a message with escaped control characters. A message of more than `most` characters is cut, and
/// ends with an ellipsis.
fn shortened(message: &str, most: usize) -> String {
    let mut shown = String::new();
    for c in message.chars() {
        if c.is_control() {
            shown.extend(c.escape_default());
        } else {
            shown.push(c);
        }
        if shown.len() > 4 * most {
            break;
        }
    }
    match shown.char_indices().nth(most) {
        None => shown,
        Some((end, _)) => format!("{}…", &shown[..end]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_caret_stands_below_the_mistake() {
        let source = Source::new("a.toml", "one = 1\ntwo = µ, bad\n");
        let at = source.text.find("bad").unwrap();
        let error = source.error(at..at + 3, "no such thing");
        assert_eq!(
            error.message,
            "a.toml:2:10: no such thing\n  |\n2 | two = µ, bad\n  |          ^^^"
        );
    }

    fn shown(text: &str, marked: Range<usize>, message: &str) -> String {
        let source = Source::new("a.toml", text);
        source.error(marked, message).message
    }

    #[test]
    fn of_a_long_line_only_what_is_near_the_mark_is_shown() {
        let text = format!(
            "a = [{} bad{}]",
            "1, ".repeat(1_000_000),
            ", 1".repeat(1_000_000)
        );
        let at = text.find("bad").unwrap();
        let error = shown(&text, at..at + 3, "no such thing");
        let lines: Vec<&str> = error.lines().collect();
        assert_eq!(lines[0], "a.toml:1:3000007: no such thing");
        assert!(
            lines[2].starts_with("1 | …") && lines[2].ends_with('…'),
            "{error}"
        );
        let carets = lines[3].chars().position(|c| c == '^').unwrap();
        let marked: String = lines[2].chars().skip(carets).take(3).collect();
        assert_eq!(marked, "bad");
        assert_eq!(lines[3].matches('^').count(), 3);
        assert!(error.chars().count() <= 400, "{error}");
    }

    #[test]
    fn an_error_is_never_long_and_has_no_control_characters() {
        let long = "é\n\u{1b}".repeat(100_000);
        let text = format!("a = \"{}\"", "é\u{1b}".repeat(100_000));
        for (marked, message) in [
            (4..text.len(), &long[..]),
            (text.len() - 1..text.len(), "no"),
            (text.len()..text.len(), &long),
            (0..1, &long),
        ] {
            let error = shown(&text, marked, message);
            assert!(error.chars().count() <= 800, "{error}");
            assert_eq!(error.lines().count(), 4, "{error}");
            assert!(
                !error.replace('\n', "").contains(char::is_control),
                "{error}"
            );
        }
    }

    #[test]
    fn text_of_another_encoding_has_a_line() {
        let path = std::env::temp_dir().join(format!("fissure-latin-{}", std::process::id()));
        std::fs::write(&path, b"title = 'a'\nend = 1 # \xb5s\n").unwrap();
        let error = Source::read(&path).unwrap_err().message;
        std::fs::remove_file(&path).unwrap();
        assert!(
            error.contains(":2:11: is not UTF-8 text from here on"),
            "{error}"
        );
    }
}
