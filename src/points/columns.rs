//! Columns of a point file: named by its heading or by the deck, or in the default order.

use std::fs::File;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;

use crate::error::excerpt;

/// Names of the coordinate columns, in the order of the axes.
const COORDINATES: [&str; 3] = ["x", "y", "z"];

/// Accepted names of the column of volumes.
const VOLUME: [&str; 2] = ["volume", "vol"];

/// Accepted names of the column of block numbers.
const BLOCK: [&str; 3] = ["block", "block_id", "block id"];

/// First word of the header in PeriLab files.
const PERILAB_HEADER: &str = "header:";

/// Optional first bytes of a UTF-8 file.
pub const BYTE_ORDER_MARK: &[u8] = "\u{feff}".as_bytes();

/// Maximum length of a row, bytes.
pub const LONGEST_ROW: u64 = 1 << 16;

/// The columns of a point file, with the indices of the columns that are read.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Columns {
    /// Names of all columns of a row.
    pub names: Vec<String>,
    /// Columns of the coordinates.
    pub position: Vec<usize>,
    /// Column of the volume.
    pub volume: usize,
    /// Column of the block number; without it, all rows have block 0.
    pub block: Option<usize>,
}

impl Columns {
    /// Create columns in the default order: coordinates, volume, block.
    pub fn default_order(dimension: usize) -> Self {
        let coordinates = COORDINATES[..dimension].iter().copied();
        let names = coordinates.chain(["volume", "block"]);
        Self {
            names: names.map(str::to_owned).collect(),
            position: (0..dimension).collect(),
            volume: dimension,
            block: Some(dimension + 1),
        }
    }

    /// Find columns by name; upper and lower case are equivalent.
    ///
    /// # Errors
    /// If a coordinate or the volume is missing, or a name occurs twice.
    pub fn named(names: &[String], dimension: usize) -> Result<Self, String> {
        let find = |known: &[&str]| {
            let is_known = |name: &String| known.iter().any(|k| name.eq_ignore_ascii_case(k));
            let mut found = (0..names.len()).filter(|k| is_known(&names[*k]));
            match (found.next(), found.next()) {
                (Some(_), Some(_)) => Err(format!("has two columns `{}`", known[0])),
                (column, _) => Ok(column),
            }
        };
        let required = |known: &[&str]| {
            let missing = || {
                let has = match names {
                    [] => "it has no columns".to_owned(),
                    names => format!("its columns are {}", excerpt(&names.join(" "))),
                };
                format!(
                    "has no column `{}`; {has}; the known names are `{} volume block`",
                    known[0],
                    COORDINATES[..dimension].join(" ")
                )
            };
            find(known)?.ok_or_else(missing)
        };
        let position = COORDINATES[..dimension]
            .iter()
            .map(|name| required(&[name]));
        Ok(Self {
            position: position.collect::<Result<_, _>>()?,
            volume: required(&VOLUME)?,
            block: find(&BLOCK)?,
            names: names.to_vec(),
        })
    }

    /// Return the names of the columns that are not read.
    pub fn ignored(&self) -> Vec<&str> {
        let is_read = |column: &usize| {
            self.position.contains(column) || *column == self.volume || Some(*column) == self.block
        };
        let ignored = (0..self.names.len()).filter(|column| !is_read(column));
        ignored.map(|column| self.names[column].as_str()).collect()
    }
}

/// Layout of the rows of a file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Layout {
    /// Columns of each row.
    pub columns: Columns,
    /// Offset of the heading in the file, bytes; `None` if the file has no heading.
    pub heading: Option<u64>,
}

/// Error in the heading of a point file.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct HeadingError {
    /// Line of the heading, from 1.
    pub line: u64,
    /// Description of the error.
    pub message: String,
}

/// Find the layout of a file. `given` are the columns that the deck names.
///
/// If the deck names no columns, a heading with a column `x` names them. Any other heading is skipped.
///
/// # Errors
/// If the file cannot be read. The inner result is an error if the heading names the columns, but lacks a
/// required column or names a column twice.
pub fn layout(
    path: &Path,
    given: Option<&Columns>,
    dimension: usize,
) -> std::io::Result<Result<Layout, HeadingError>> {
    let mut layout = Layout {
        columns: given.cloned().unwrap_or(Columns::default_order(dimension)),
        heading: None,
    };
    let Some(heading) = heading(path)? else {
        return Ok(Ok(layout));
    };
    layout.heading = Some(heading.offset);
    if given.is_none()
        && heading
            .names
            .iter()
            .any(|name| name.eq_ignore_ascii_case("x"))
    {
        match Columns::named(&heading.names, dimension) {
            Ok(columns) => layout.columns = columns,
            Err(message) => {
                let line = heading.line;
                return Ok(Err(HeadingError { line, message }));
            }
        }
    }
    Ok(Ok(layout))
}

/// The heading of a file. The heading is the first row that is not empty and not a comment. If this row
/// contains a number or an empty entry, the file has no heading.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Heading {
    /// Entries of the heading, without quotes.
    pub names: Vec<String>,
    /// Offset of the first byte of the heading in the file, bytes.
    pub offset: u64,
    /// Line of the heading, from 1.
    pub line: u64,
}

/// Read the heading of a file; `None` if the file has no heading, or if a row up to the heading is not UTF-8
/// text.
///
/// # Errors
/// If the file cannot be read or is not a regular file.
pub fn heading(path: &Path) -> std::io::Result<Option<Heading>> {
    // Opening a pipe would block until its other end is opened, so only regular files are read.
    if !std::fs::metadata(path)?.is_file() {
        return Err(std::io::Error::other("it is not a regular file"));
    }
    let mut reader = BufReader::new(File::open(path)?);
    let (mut row, mut offset, mut line) = (Vec::new(), 0, 0);
    loop {
        row.clear();
        let read = (&mut reader)
            .take(LONGEST_ROW)
            .read_until(b'\n', &mut row)? as u64;
        line += 1;
        if read == 0 {
            return Ok(None);
        }
        let bytes = match offset {
            0 => row.strip_prefix(BYTE_ORDER_MARK).unwrap_or(&row),
            _ => &row[..],
        };
        // A row that is too long or is not text is reported when the rows are read.
        let Some(text) = std::str::from_utf8(bytes).ok().map(str::trim) else {
            return Ok(None);
        };
        if !text.is_empty() && !is_comment(text) {
            return Ok(names(text).map(|names| Heading {
                names,
                offset,
                line,
            }));
        }
        offset += read;
    }
}

/// Test whether a row is a comment: it starts with `#`, or with `/` or `*` as in Peridigm.
pub fn is_comment(row: &str) -> bool {
    row.trim_start().starts_with(['#', '/', '*'])
}

/// Return the names of the columns if the row is a heading; `None` if the row contains a number or an empty
/// entry.
fn names(row: &str) -> Option<Vec<String>> {
    let row = row.strip_prefix(PERILAB_HEADER).unwrap_or(row);
    let entries = entries(row).ok()?;
    let is_heading = !entries.iter().any(|entry| resembles_number(entry));
    let bare = |entry: &&str| entry.trim_matches(['"', '\'']).to_owned();
    is_heading.then(|| entries.iter().map(bare).collect())
}

/// Split a row into entries.
///
/// # Errors
/// If an entry before or after a comma or semicolon is empty.
pub fn entries(row: &str) -> Result<Vec<&str>, String> {
    let row = row.trim();
    let mut entries = Vec::new();
    for part in row.split([',', ';']) {
        let before = entries.len();
        entries.extend(part.split_whitespace());
        if entries.len() == before && !row.is_empty() {
            return Err(format!("entry {} is empty", before + 1));
        }
    }
    Ok(entries)
}

/// Test whether an entry is a number or looks like a mistyped number. Quotes around the entry are ignored.
fn resembles_number(entry: &str) -> bool {
    let bare = entry.trim_matches(['"', '\'']);
    let digits = bare.trim_start_matches(['+', '-', '.']);
    bare.parse::<f64>().is_ok() || digits.starts_with(|c: char| c.is_ascii_digit())
}
