//! Rows of a text file; each rank reads a part of the bytes.

use std::fs::File;
use std::io::{BufRead, BufReader, Read, Seek, SeekFrom};
use std::path::Path;

use crate::comm::{Communicator, agree, scan};
use crate::error::{Error, Result};

use super::columns::{BYTE_ORDER_MARK, LONGEST_ROW, entries, is_comment};

/// Number of lines and first error of one part of a file.
#[derive(Default)]
pub struct Part {
    /// Number of lines in the part, including comments and empty lines.
    lines: u64,
    /// The first invalid row: its line within the part, from 0, and the message.
    error: Option<(u64, String)>,
}

/// Split the bytes of a file into `parts` equal parts, and call `row` with the entries of each row that
/// starts in part `part`. Empty rows, comments and the heading, which starts at offset `heading`, are
/// skipped.
///
/// # Errors
/// If the file cannot be read. Invalid rows do not count as an error of the call; the returned part contains
/// the message of the first invalid row.
pub fn for_each_row(
    path: &Path,
    heading: Option<u64>,
    [part, parts]: [usize; 2],
    mut row: impl FnMut(&[&str]) -> std::result::Result<(), String>,
) -> std::io::Result<Part> {
    let mut file = File::open(path)?;
    let length = file.metadata()?.len();
    let border = |part: usize| (u128::from(length) * part as u128 / parts as u128) as u64;
    let (start, end) = (border(part), border(part + 1));
    let mut read_part = Part::default();
    let mut line = Vec::new();
    let mut at = start;
    let mut reader = if start == 0 {
        BufReader::new(file)
    } else {
        // A row that crosses `start` belongs to the previous part.
        file.seek(SeekFrom::Start(start - 1))?;
        let mut reader = BufReader::new(file);
        let skipped = (&mut reader).take(LONGEST_ROW + 1).skip_until(b'\n')? as u64;
        if skipped > LONGEST_ROW {
            // The rank whose part contains the start of this row reports the error.
            return Ok(read_part);
        }
        at = start - 1 + skipped;
        reader
    };
    while at < end {
        line.clear();
        let read = (&mut reader)
            .take(LONGEST_ROW)
            .read_until(b'\n', &mut line)? as u64;
        if read == 0 {
            break;
        }
        let bytes = match at {
            0 => line.strip_prefix(BYTE_ORDER_MARK).unwrap_or(&line),
            _ => &line[..],
        };
        let is_heading = heading == Some(at);
        at += read;
        let is_cut = read == LONGEST_ROW && !bytes.ends_with(b"\n");
        let found = if is_cut {
            Err(format!(
                "is longer than {LONGEST_ROW} bytes; is this a file with one row per point?"
            ))
        } else if is_heading {
            Ok(())
        } else {
            of_row(bytes, &mut row)
        };
        if let Err(message) = found {
            read_part.error.get_or_insert((read_part.lines, message));
        }
        if is_cut {
            break;
        }
        read_part.lines += 1;
    }
    Ok(read_part)
}

/// Call `row` with the entries of a row, unless the row is empty or a comment.
fn of_row(
    bytes: &[u8],
    row: &mut impl FnMut(&[&str]) -> std::result::Result<(), String>,
) -> std::result::Result<(), String> {
    let text = std::str::from_utf8(bytes).map_err(|_| "is not UTF-8 text".to_owned())?;
    if is_comment(text) {
        return Ok(());
    }
    let entries = entries(text)?;
    if entries.is_empty() {
        return Ok(());
    }
    row(&entries)
}

impl Part {
    /// Return an error if a part of any rank has an invalid row. Collective.
    ///
    /// # Errors
    /// The message names the file and the line of the first invalid row.
    pub fn check(self, path: &Path, comm: &dyn Communicator) -> Result<()> {
        let (lines_before, _) = scan(comm, self.lines);
        let checked = match self.error {
            None => Ok(()),
            Some((line, message)) => {
                let line = lines_before + line + 1;
                Err(Error::input(format!(
                    "{}:{line}: {message}",
                    path.display()
                )))
            }
        };
        agree(comm, checked)
    }
}
