//! Points from a text file, read in pieces by all ranks.
//!
//! Each row is `x [y [z]] volume block`, separated by commas or white space. Empty rows and rows
//! that start with `#` are skipped, and so is a first row that names the columns.

use std::fs::File;
use std::io::{BufRead, BufReader, Seek, SeekFrom};
use std::path::Path;

use crate::comm::{Communicator, agree, scan};
use crate::deck::plan::{Plan, PointSource};
use crate::error::{Error, Result};

use super::Point;

/// The bodies that take rows of a file: their index and the block number they ask for.
pub(super) fn users(plan: &Plan, file: &Path) -> Vec<(usize, Option<u32>)> {
    plan.bodies
        .iter()
        .enumerate()
        .filter_map(|(index, body)| match &body.points {
            PointSource::File { path, block, .. } if path == file => Some((index, *block)),
            _ => None,
        })
        .collect()
}

/// What one rank found in its share of the file.
#[derive(Default)]
struct Share {
    points: Vec<Point>,
    lines: u64,
    /// The first wrong row: its line within the share, from 0, and what is wrong with it.
    mistake: Option<(u64, String)>,
}

/// This rank's piece of a file's points, for all bodies that use it.
///
/// # Errors
/// When the file cannot be read or a row is wrong; names the file and the line.
pub(super) fn piece(plan: &Plan, path: &Path, comm: &dyn Communicator) -> Result<Vec<Point>> {
    let users = users(plan, path);
    let share = read_share(plan, path, &users, comm.rank(), comm.size()).map_err(|error| {
        let PointSource::File { span, .. } = &plan.bodies[users[0].0].points else {
            unreachable!("users are bodies with a file");
        };
        let message = format!("cannot read the point file {}: {error}", path.display());
        plan.source.error(span.clone(), message)
    });
    let share = agree(comm, share)?;
    let (lines_before, _) = scan(comm, share.lines);
    let checked = match share.mistake {
        None => Ok(share.points),
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

/// Reads the rows that start within this rank's share of the file's bytes.
fn read_share(
    plan: &Plan,
    path: &Path,
    users: &[(usize, Option<u32>)],
    rank: usize,
    size: usize,
) -> std::io::Result<Share> {
    let mut file = File::open(path)?;
    let length = file.metadata()?.len();
    let border = |rank: usize| (u128::from(length) * rank as u128 / size as u128) as u64;
    let (start, end) = (border(rank), border(rank + 1));
    let mut share = Share::default();
    let mut line = Vec::new();
    let mut at = start;
    let mut reader = if start == 0 {
        BufReader::new(file)
    } else {
        // The row that is under way at `start` belongs to the share before.
        file.seek(SeekFrom::Start(start - 1))?;
        let mut reader = BufReader::new(file);
        at = start - 1 + reader.read_until(b'\n', &mut line)? as u64;
        reader
    };
    while at < end {
        line.clear();
        let read = reader.read_until(b'\n', &mut line)?;
        if read == 0 {
            break;
        }
        let first = at == 0;
        at += read as u64;
        let row = match std::str::from_utf8(&line) {
            Ok(text) => parse_row(plan, users, text, first),
            Err(_) => Err("is not text".to_owned()),
        };
        match row {
            Ok(point) => share.points.extend(point),
            Err(message) => {
                share.mistake.get_or_insert((share.lines, message));
            }
        }
        share.lines += 1;
    }
    Ok(share)
}

/// The point of a row; none where the row is empty, a comment or the head of the table.
fn parse_row(
    plan: &Plan,
    users: &[(usize, Option<u32>)],
    row: &str,
    first: bool,
) -> std::result::Result<Option<Point>, String> {
    let row = row.trim();
    if row.is_empty() || row.starts_with('#') {
        return Ok(None);
    }
    let dimension = plan.dimension.count();
    let names = &["x", "y", "z"][..dimension];
    let entries: Vec<&str> = row
        .split(|c: char| c == ',' || c == ';' || c.is_whitespace())
        .filter(|entry| !entry.is_empty())
        .collect();
    if first && entries[0].parse::<f64>().is_err() {
        return Ok(None);
    }
    if entries.len() != dimension + 2 {
        return Err(format!(
            "has {} entries, must have {}: {} volume block",
            entries.len(),
            dimension + 2,
            names.join(" ")
        ));
    }
    let number = |k: usize, name: &str| {
        let value = entries[k]
            .parse::<f64>()
            .ok()
            .filter(|value| value.is_finite());
        value.ok_or_else(|| format!("{name} must be a number, is `{}`", entries[k]))
    };
    let mut position = [0.0; 3];
    for (k, name) in names.iter().enumerate() {
        position[k] = number(k, name)?;
    }
    let volume = number(dimension, "volume")?;
    if volume <= 0.0 {
        return Err(format!("volume must be above 0 m³, is {volume}"));
    }
    let block: u32 = entries[dimension + 1].parse().map_err(|_| {
        format!(
            "block must be a whole number, is `{}`",
            entries[dimension + 1]
        )
    })?;
    let body = users
        .iter()
        .find(|(_, wanted)| wanted.is_none_or(|wanted| wanted == block));
    let Some((body, _)) = body else {
        return Err(format!(
            "block {block} belongs to no body; add a body with `points = {{ file = …, block = \
             {block} }}`"
        ));
    };
    Ok(Some(Point::new(0, position, volume, *body)))
}
