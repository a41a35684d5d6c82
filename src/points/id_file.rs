//! Sets of points from a text file of point ids, like the node sets of Peridigm and PeriLab.

use std::path::Path;

use super::columns::{BYTE_ORDER_MARK, heading, is_comment};
use crate::error::excerpt;

/// Maximum length of a file, bytes.
const LONGEST: u64 = 1 << 32;

/// Read ids from a file. The returned ids are counted from 0, sorted, and without repeats. `first` is the
/// number that the file uses for the first point.
///
/// Numbers are separated by white space, commas or semicolons. Comments and a heading are skipped.
///
/// # Errors
/// If the file cannot be read, is too long, is not UTF-8 text or contains no number. If an entry is not a
/// whole number, or is below `first`. The message names the file, and the line of a wrong entry.
pub fn read(path: &Path, first: u64) -> Result<Vec<u64>, String> {
    let name = path.display();
    let unreadable = |error: std::io::Error| format!("cannot read {name}: {error}");
    let heading = heading(path).map_err(unreadable)?;
    let length = std::fs::metadata(path).map_err(unreadable)?.len();
    if length > LONGEST {
        return Err(format!(
            "{name}: is longer than {LONGEST} bytes; is this a set?"
        ));
    }
    let bytes = std::fs::read(path).map_err(unreadable)?;
    let text = std::str::from_utf8(bytes.strip_prefix(BYTE_ORDER_MARK).unwrap_or(&bytes));
    let text = text.map_err(|_| format!("{name}: is not UTF-8 text"))?;
    let mut ids = Vec::new();
    for (line, row) in (1..).zip(text.lines()) {
        if is_comment(row) || heading.as_ref().is_some_and(|heading| heading.line == line) {
            continue;
        }
        for entry in words(row) {
            let id = entry.parse::<u64>().ok().filter(|id| *id >= first);
            let id = id.ok_or_else(|| {
                let hint = match entry.parse::<u64>() {
                    Ok(0) => format!(
                        "; the first point has the number {first}; if the file counts from 0, set `first_id = 0`"
                    ),
                    _ => String::new(),
                };
                format!(
                    "{name}:{line}: must contain point numbers, {first} or larger, has {}{hint}",
                    excerpt(entry)
                )
            })?;
            ids.push(id - first);
        }
    }
    if ids.is_empty() {
        return Err(format!("{name}: has no number of a point"));
    }
    ids.sort_unstable();
    ids.dedup();
    Ok(ids)
}

/// Return the number of the first line with the entry `number`; lines are counted from 1. `None` if there is
/// no such line or the file cannot be read. Comments and the heading are counted as lines, but not searched.
pub fn line_of(path: &Path, number: u64) -> Option<u64> {
    let heading = heading(path).ok()?.map(|heading| heading.line);
    let text = std::fs::read_to_string(path).ok()?;
    let text = text.trim_start_matches('\u{feff}');
    let mut rows = (1..).zip(text.lines());
    let found = rows.find(|(line, row)| {
        let is_number = |entry: &str| entry.parse() == Ok(number);
        !is_comment(row) && heading != Some(*line) && words(row).any(is_number)
    });
    found.map(|(line, _)| line)
}

/// Return the entries of a row.
fn words(row: &str) -> impl Iterator<Item = &str> {
    let words = row.split([',', ';', ' ', '\t', '\r']);
    words.filter(|entry| !entry.is_empty())
}
