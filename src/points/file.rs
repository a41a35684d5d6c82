//! Points from a text file; each rank reads its share of the bytes.
//!
//! A row is `x [y [z]] volume block`, separated by commas, semicolons or white space. Skipped are empty
//! rows, rows that start with `#`, and a heading: a first row without any number.

use std::fs::File;
use std::io::{BufRead, BufReader, Read, Seek, SeekFrom};
use std::path::Path;

use crate::comm::{Communicator, agree, scan};
use crate::error::{Error, Result, excerpt};
use crate::problem::{PointSource, Problem};

use super::Point;

/// The bodies that use a file: their index and the block number they select.
pub fn users(problem: &Problem, file: &Path) -> Vec<(usize, Option<u32>)> {
    problem
        .bodies
        .iter()
        .enumerate()
        .filter_map(|(index, body)| match &body.points {
            PointSource::File { path, block, .. } if path == file => Some((index, *block)),
            _ => None,
        })
        .collect()
}

/// Maximum length of a row, bytes.
const LONGEST_ROW: u64 = 1 << 16;

/// Length of a sample of a long file, bytes.
const PIECE: u64 = 1 << 16;
/// Number of samples of a long file.
const SAMPLED: u64 = 256;

/// Largest absolute coordinate, m; squared distances stay far from overflow.
const FARTHEST: f64 = 1e30;

/// Optional first bytes of a UTF-8 file.
const BYTE_ORDER_MARK: &[u8] = "\u{feff}".as_bytes();

/// An invalid row: its line within the share, from 0, and the message.
type RowError = (u64, String);

/// The parsed share of one rank.
#[derive(Default)]
struct Share {
    points: Vec<Point>,
    lines: u64,
    /// The share has at least one row.
    has_rows: bool,
    /// The first row, if it has no number; an error unless it is the first row of the file.
    heading: Option<RowError>,
    /// The first invalid row after that.
    error: Option<RowError>,
}

/// Read this rank's share of a file's points, for all bodies that use it. Collective.
///
/// # Errors
/// If the file cannot be read or a row is invalid; the message gives file and line.
pub(super) fn piece(problem: &Problem, path: &Path, comm: &dyn Communicator) -> Result<Vec<Point>> {
    let users = users(problem, path);
    let share = read_share(problem, path, &users, comm.rank(), comm.size()).map_err(|error| {
        let PointSource::File { span, .. } = &problem.bodies[users[0].0].points else {
            unreachable!("users are bodies with a file");
        };
        let message = format!("cannot read the point file {}: {error}", path.display());
        Error::input(message).at(span)
    });
    let share = agree(comm, share)?;
    let (lines_before, _) = scan(comm, share.lines);
    let (ranks_before, _) = scan(comm, u64::from(share.has_rows));
    let heading = share.heading.filter(|_| ranks_before > 0);
    let checked = match heading.or(share.error) {
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

/// Sample the points of a file; return them and the number of points that each represents.
///
/// Of a long file, evenly spaced pieces are read. Invalid rows are skipped. `None` if the file cannot
/// be read.
pub fn sample(problem: &Problem, path: &Path) -> Option<(Vec<Point>, f64)> {
    let users = users(problem, path);
    let length = std::fs::metadata(path).ok()?.len();
    if length <= SAMPLED * PIECE {
        let share = read_share(problem, path, &users, 0, 1).ok()?;
        return Some((share.points, 1.0));
    }
    let pieces = length.div_ceil(PIECE);
    let mut points = Vec::new();
    for k in 0..SAMPLED {
        let piece = (u128::from(pieces) * u128::from(k) / u128::from(SAMPLED)) as usize;
        points.extend(
            read_share(problem, path, &users, piece, pieces as usize)
                .ok()?
                .points,
        );
    }
    Some((points, pieces as f64 / SAMPLED as f64))
}

/// Read the rows that start within a rank's share of the file's bytes.
fn read_share(
    problem: &Problem,
    path: &Path,
    users: &[(usize, Option<u32>)],
    rank: usize,
    size: usize,
) -> std::io::Result<Share> {
    // Opening a pipe would block until its other end is opened.
    if !std::fs::metadata(path)?.is_file() {
        return Err(std::io::Error::other("it is not a regular file"));
    }
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
        // A row that spans `start` belongs to the previous share.
        file.seek(SeekFrom::Start(start - 1))?;
        let mut reader = BufReader::new(file);
        let skipped = (&mut reader).take(LONGEST_ROW + 1).skip_until(b'\n')? as u64;
        if skipped > LONGEST_ROW {
            // The share with the start of this row reports the error.
            return Ok(share);
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
        at += read;
        if read == LONGEST_ROW && !bytes.ends_with(b"\n") {
            let message = format!("is longer than {LONGEST_ROW} bytes; is this a point file?");
            share.error.get_or_insert((share.lines, message));
            break;
        }
        share.read_row(problem, users, bytes);
        share.lines += 1;
    }
    Ok(share)
}

impl Share {
    /// Parse the next row and append its point.
    fn read_row(&mut self, problem: &Problem, users: &[(usize, Option<u32>)], row: &[u8]) {
        let entries = match std::str::from_utf8(row) {
            Ok(row) if row.trim_start().starts_with('#') => return,
            Ok(row) => entries(row),
            Err(_) => Err("is not UTF-8 text".to_owned()),
        };
        if entries.as_ref().is_ok_and(Vec::is_empty) {
            return;
        }
        let is_first = !std::mem::replace(&mut self.has_rows, true);
        let names_columns =
            |entries: &Vec<&str>| !entries.iter().any(|entry| resembles_number(entry));
        let is_heading = is_first && entries.as_ref().is_ok_and(names_columns);
        match entries.and_then(|entries| point(problem, users, &entries)) {
            Ok(point) => self.points.push(point),
            Err(message) if is_heading => self.heading = Some((self.lines, message)),
            Err(message) => {
                self.error.get_or_insert((self.lines, message));
            }
        }
    }
}

/// Split a row into entries.
fn entries(row: &str) -> std::result::Result<Vec<&str>, String> {
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

/// Test whether an entry is a number, possibly mistyped or in quotes.
fn resembles_number(entry: &str) -> bool {
    let bare = entry.trim_matches(['"', '\'']);
    let digits = bare.trim_start_matches(['+', '-', '.']);
    bare.parse::<f64>().is_ok() || digits.starts_with(|c: char| c.is_ascii_digit())
}

/// Parse the point of a row.
fn point(
    problem: &Problem,
    users: &[(usize, Option<u32>)],
    entries: &[&str],
) -> std::result::Result<Point, String> {
    let dimension = problem.dimension.count();
    let names = &["x", "y", "z"][..dimension];
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
        value.ok_or_else(|| format!("{name} must be a number, is {}", excerpt(entries[k])))
    };
    let mut position = [0.0; 3];
    for (k, name) in names.iter().enumerate() {
        position[k] = number(k, name)?;
        if position[k].abs() > FARTHEST {
            return Err(format!(
                "{name} must be at most {FARTHEST:e} m, is {:e}",
                position[k]
            ));
        }
    }
    let volume = number(dimension, "volume")?;
    if volume <= 0.0 {
        return Err(format!("volume must be above 0 m³, is {volume}"));
    }
    let block: u32 = entries[dimension + 1].parse().map_err(|_| {
        format!(
            "block must be a whole number, is {}",
            excerpt(entries[dimension + 1])
        )
    })?;
    let body = users
        .iter()
        .find(|(_, selected)| selected.is_none_or(|selected| selected == block));
    let Some((body, _)) = body else {
        return Err(format!(
            "block {block} belongs to no body; add a body with `points = {{ file = …, block = \
             {block} }}`"
        ));
    };
    Ok(Point::new(0, position, volume, *body))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comm::threads;
    use crate::dimension::Dimension;
    use crate::elastic::Isotropic;
    use crate::problem::{Law, Material, Shape};

    /// Read a 2-D file; return the x of its points by id, or the error. Asserts that the result is equal on
    /// any number of ranks.
    fn read(name: &str, text: &[u8]) -> std::result::Result<Vec<f64>, String> {
        let folder = std::env::temp_dir().join(format!("fissure-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        std::fs::write(folder.join("points.csv"), text).unwrap();
        let found = read_in(&folder);
        std::fs::remove_dir_all(&folder).unwrap();
        found
    }

    fn read_in(folder: &Path) -> std::result::Result<Vec<f64>, String> {
        let path = folder.join("points.csv");
        let dimension = Dimension::PlaneStress { thickness: 1.0 };
        let mut problem = Problem::new(dimension, 3.0, 1.0);
        let elastic = Isotropic {
            youngs_modulus: 5.0,
            poisson_ratio: 1.0 / 3.0,
        };
        let glass = Material::new(Law::named("pmb").unwrap(), 2.0, elastic);
        problem.add_body("plate", glass, None, Shape::Union(Vec::new()), 1.0);
        problem.bodies[0].points = PointSource::File {
            path: path.clone(),
            block: None,
            span: 0..0,
        };
        let on = |ranks: usize| {
            let pieces = threads::run(ranks, |comm| piece(&problem, &path, comm));
            let pieces: Result<Vec<Vec<Point>>> = pieces.into_iter().collect();
            let shorten = |error: Error| {
                let folder = folder.display().to_string();
                error
                    .message
                    .replace(&folder, "")
                    .replace("/points", "points")
            };
            let xs = |pieces: Vec<Vec<Point>>| {
                pieces
                    .concat()
                    .iter()
                    .map(|point| point.position[0])
                    .collect()
            };
            pieces.map(xs).map_err(shorten)
        };
        let single = on(1);
        for ranks in 2..7 {
            assert_eq!(on(ranks), single, "{ranks} ranks");
        }
        single
    }

    #[test]
    fn a_heading_is_a_row_without_any_number() {
        let rows = "0,0,1,1\n1,0,1,1\n2,0,1,1\n";
        for before in [
            "",
            "x,y,volume,block\n",
            "\"Points:0\",\"Points:1\",\"m³\",\"id\"\r\n",
            "# by hand\n\n  # twice\nx y volume block\n",
            "\u{feff}",
            "\u{feff}# marked\nx;y;volume;block\n",
            "\u{feff}x,y,volume,block\n",
        ] {
            let text = format!("{before}{rows}");
            assert_eq!(
                read("heading", text.as_bytes()),
                Ok(vec![0.0, 1.0, 2.0]),
                "{before}"
            );
        }
    }

    #[test]
    fn invalid_rows_are_not_taken_for_headings_or_points() {
        let rows = "1,0,1,1\n2,0,1,1\n";
        for (row, message) in [
            ("O.0,0,1,1", "x must be a number, is `O.0`"),
            ("0x0,0,1,1", "x must be a number, is `0x0`"),
            ("'0','0','1','1'", "x must be a number, is `'0'`"),
            ("nan,nan,nan,nan", "x must be a number, is `nan`"),
            ("-.5e,a,b,c", "x must be a number, is `-.5e`"),
            ("x,y,volume,1", "x must be a number, is `x`"),
            ("0,,0,1,1", "entry 2 is empty"),
            (",0,0,1,1", "entry 1 is empty"),
            ("0,0,1,1,", "entry 5 is empty"),
            ("0, ;0,1,1", "entry 2 is empty"),
            ("1e31,0,1,1", "x must be at most 1e30 m, is 1e31"),
        ] {
            let first = format!("{row}\n{rows}");
            let expected = Err(format!("points.csv:1: {message}"));
            assert_eq!(read("first", first.as_bytes()), expected);
            let third = format!("{rows}{row}\n{rows}");
            let expected = Err(format!("points.csv:3: {message}"));
            assert_eq!(read("third", third.as_bytes()), expected);
        }
        let message = "x must be a number, is `x`";
        let twice = format!("x y volume block\n# and\nx y volume block\n{rows}");
        let expected = Err(format!("points.csv:3: {message}"));
        assert_eq!(read("twice", twice.as_bytes()), expected);
        let late = format!("{rows}x y volume block\n");
        assert_eq!(read("late", late.as_bytes()), expected);
        let expected = Err("points.csv:2: is not UTF-8 text".to_owned());
        assert_eq!(read("latin", b"0,0,1,1\n# \xb5m\n1,0,1,1\n"), expected);
    }

    #[test]
    fn a_row_without_end_is_not_read_to_its_end() {
        let long = [b"0 0 1 1\n".to_vec(), vec![b'0'; 1 << 17]].concat();
        let expected = "points.csv:2: is longer than 65536 bytes; is this a point file?";
        assert_eq!(read("long", &long), Err(expected.to_owned()));
        // A row of maximum length; shares start within it.
        let spaces = |count: usize| [&b"0 0 1 1"[..], &vec![b' '; count], b"\n1 0 1 1\n"].concat();
        assert_eq!(read("longest", &spaces(65_528)), Ok(vec![0.0, 1.0]));
        let expected = "points.csv:1: is longer than 65536 bytes; is this a point file?";
        assert_eq!(read("longer", &spaces(65_529)), Err(expected.to_owned()));
    }

    #[test]
    fn a_pipe_is_rejected() {
        let folder = std::env::temp_dir().join(format!("fissure-pipe-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let made = std::process::Command::new("mkfifo")
            .arg(folder.join("points.csv"))
            .status();
        assert!(made.unwrap().success());
        let error = read_in(&folder).unwrap_err();
        std::fs::remove_dir_all(&folder).unwrap();
        assert!(error.contains("cannot read the point file"), "{error}");
        assert!(error.contains("it is not a regular file"), "{error}");
    }
}
