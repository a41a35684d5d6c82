//! Points from a text file; each rank reads a part of the bytes.
//!
//! A row is `x [y [z]] volume block`, unless the deck or a heading names other columns. Entries are separated
//! by commas, semicolons or white space. Empty rows, comments and a heading are skipped. The first row that
//! is neither empty nor a comment is a heading if it contains neither a number nor an empty entry.

use std::path::Path;

use crate::comm::{Communicator, agree};
use crate::error::{Error, Result, excerpt};
use crate::problem::{PointSource, Problem};

use super::columns::{Columns, Layout, layout};
use super::rows::{Part, for_each_row};
use super::same_file::check_same_file;
use super::{BodyPoints, Point};

/// Return the bodies that use a file: index of the body, and the block number that the body selects. Without
/// a block number, a body selects the rows that no other body selects.
pub fn users(bodies: &[BodyPoints], file: &Path) -> Vec<(usize, Option<u32>)> {
    bodies
        .iter()
        .enumerate()
        .filter_map(|(index, body)| match body.points {
            PointSource::File { path, block, .. } if path == file => Some((index, *block)),
            _ => None,
        })
        .collect()
}

/// Length of each piece that is sampled from a long file, bytes.
const PIECE: u64 = 1 << 16;
/// Number of pieces that are sampled from a long file.
const SAMPLED: u64 = 256;

/// Largest accepted absolute value of a coordinate, m. This limit prevents an overflow of squared distances.
const FARTHEST: f64 = 1e30;

/// Return the columns that the deck names for the file of the body with index `user`; `None` if the deck
/// names no columns. The columns are equal for all bodies that use the file.
fn columns<'a>(bodies: &[BodyPoints<'a>], user: usize) -> Option<&'a Columns> {
    match bodies[user].points {
        PointSource::File { columns, .. } => columns.as_ref(),
        _ => None,
    }
}

/// Find the layout of a file whose points have `dimension` coordinates.
///
/// # Errors
/// Same as for [`layout`].
pub fn layout_of(
    bodies: &[BodyPoints],
    dimension: usize,
    path: &Path,
) -> std::io::Result<Result<Layout>> {
    let given = users(bodies, path)
        .first()
        .and_then(|(user, _)| columns(bodies, *user));
    let layout = layout(path, given, dimension)?;
    Ok(layout.map_err(|error| {
        let (line, message) = (error.line, error.message);
        Error::input(format!("{}:{line}: {message}", path.display()))
    }))
}

/// Read this rank's part of a file's points, for all bodies that use the file, and pass each point to `take`.
/// Collective.
///
/// # Errors
/// If the file cannot be read, the ranks read different contents, or the heading or a row is invalid. The
/// message gives the file, and the line of the heading or row.
pub(super) fn for_each_point(
    bodies: &[BodyPoints],
    dimension: usize,
    path: &Path,
    comm: &dyn Communicator,
    take: impl FnMut(Point),
) -> Result<()> {
    let users = users(bodies, path);
    let unreadable = |error| {
        let PointSource::File { span, .. } = bodies[users[0].0].points else {
            unreachable!("users are bodies with a file");
        };
        let message = format!("cannot read the point file {}: {error}", path.display());
        Error::input(message).at(span)
    };
    check_same_file(path, comm, unreadable)?;
    let layout = layout_of(bodies, dimension, path);
    let layout = agree(comm, layout.map_err(unreadable).flatten())?;
    let part = read_part(path, &layout, &users, [comm.rank(), comm.size()], take);
    let part = agree(comm, part.map_err(unreadable))?;
    part.check(path, comm)
}

/// Sample the points of a file. Return the sampled points, and the number of points of the file that each
/// sampled point represents.
///
/// Only evenly spaced pieces of a long file are read. Invalid rows are skipped. `None` if the file cannot be
/// read or its heading is invalid.
pub fn sample(problem: &Problem, path: &Path) -> Option<(Vec<Point>, f64)> {
    let bodies = BodyPoints::of(&problem.bodies);
    let users = users(&bodies, path);
    let dimension = problem.dimension.count();
    let layout = layout_of(&bodies, dimension, path).ok()?.ok()?;
    let mut points = Vec::new();
    let mut read = |part| read_part(path, &layout, &users, part, |point| points.push(point)).ok();
    let length = std::fs::metadata(path).ok()?.len();
    if length <= SAMPLED * PIECE {
        read([0, 1])?;
        return Some((points, 1.0));
    }
    let pieces = length.div_ceil(PIECE);
    for k in 0..SAMPLED {
        let piece = (u128::from(pieces) * u128::from(k) / u128::from(SAMPLED)) as usize;
        read([piece, pieces as usize])?;
    }
    Some((points, pieces as f64 / SAMPLED as f64))
}

/// Split the bytes of a file into equal parts, and pass the points of one part to `take`. `part_of_parts` is
/// the index of this part and the number of parts.
fn read_part(
    path: &Path,
    layout: &Layout,
    users: &[(usize, Option<u32>)],
    part_of_parts: [usize; 2],
    mut take: impl FnMut(Point),
) -> std::io::Result<Part> {
    for_each_row(path, layout.heading, part_of_parts, |entries| {
        take(point(&layout.columns, users, entries)?);
        Ok(())
    })
}

/// Parse the point of a row. The returned point has the id 0.
fn point(
    columns: &Columns,
    users: &[(usize, Option<u32>)],
    entries: &[&str],
) -> std::result::Result<Point, String> {
    if entries.len() != columns.names.len() {
        return Err(format!(
            "has {} entries, must have {}: {}",
            entries.len(),
            columns.names.len(),
            columns.names.join(" ")
        ));
    }
    let number = |column: usize, name: &str| {
        let value = entries[column]
            .parse::<f64>()
            .ok()
            .filter(|value| value.is_finite());
        value.ok_or_else(|| format!("{name} must be a number, is {}", excerpt(entries[column])))
    };
    let mut position = [0.0; 3];
    for (k, column) in columns.position.iter().enumerate() {
        let name = ["x", "y", "z"][k];
        position[k] = number(*column, name)?;
        if position[k].abs() > FARTHEST {
            return Err(format!(
                "{name} must be at most {FARTHEST:e} m, is {:e}",
                position[k]
            ));
        }
    }
    let volume = number(columns.volume, "volume")?;
    if volume <= 0.0 {
        return Err(format!("volume must be above 0 m³, is {volume}"));
    }
    let block: u32 = match columns.block {
        None => 0,
        Some(column) => entries[column].parse().map_err(|_| {
            format!(
                "block must be a whole number, is {}; the columns are `{}`",
                excerpt(entries[column]),
                columns.names.join(" ")
            )
        })?,
    };
    let body = users
        .iter()
        .find(|(_, selected)| selected.is_none_or(|selected| selected == block));
    let Some((body, _)) = body else {
        return Err(format!(
            "block {block} belongs to no body; add a body with `points = {{ file = …, block = \
             {block} }}`, or remove the rows of this block"
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

    /// Read a 2-D file. Return the x coordinates of its points in the order of the rows, or the error.
    /// Asserts that the result is equal on any number of ranks.
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
            columns: None,
            span: 0..0,
        };
        let on = |ranks: usize| {
            let bodies = BodyPoints::of(&problem.bodies);
            let pieces = threads::run(ranks, |comm| {
                let mut piece = Vec::new();
                for_each_point(&bodies, 2, &path, comm, |point| piece.push(point))?;
                Ok(piece)
            });
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
    fn a_heading_with_a_column_x_names_the_columns() {
        for (text, expected) in [
            ("block volume y x\n1 1 0 5\n1 1 0 6\n", vec![5.0, 6.0]),
            ("X,Y,Block_ID,Volume\n5,0,1,2\n", vec![5.0]),
            (
                "# by PeriLab\n\nheader: x y block_id volume Temperature\n5 0 1 2 20\n/ no\n* no\n",
                vec![5.0],
            ),
            ("\u{feff}z\tx\ty\tvol\n9\t5\t0\t2\n", vec![5.0]),
            // Without a column x, the default order applies.
            ("a,b,c,d\n5,0,2,1\n", vec![5.0]),
        ] {
            assert_eq!(read("columns", text.as_bytes()), Ok(expected), "{text}");
        }
        for (text, message) in [
            (
                "# volumes\nx y block\n0 0 1\n",
                "2: has no column `volume`; its columns are `x y block`; the known names are `x y volume block`",
            ),
            ("x x y volume\n0 0 0 1\n", "1: has two columns `x`"),
            (
                "x y volume vx\n0 0 1 2\n0 0 1\n",
                "3: has 3 entries, must have 4: x y volume vx",
            ),
            (
                "y x volume\n0 1 -1\n",
                "2: volume must be above 0 m³, is -1",
            ),
        ] {
            let expected = Err(format!("points.csv:{message}"));
            assert_eq!(read("columns", text.as_bytes()), expected, "{text}");
        }
    }

    #[test]
    fn a_row_without_end_is_not_read_to_its_end() {
        let long = [b"0 0 1 1\n".to_vec(), vec![b'0'; 1 << 17]].concat();
        let expected =
            "points.csv:2: is longer than 65536 bytes; is this a file with one row per point?";
        assert_eq!(read("long", &long), Err(expected.to_owned()));
        // A row of maximum length; parts start within it.
        let spaces = |count: usize| [&b"0 0 1 1"[..], &vec![b' '; count], b"\n1 0 1 1\n"].concat();
        assert_eq!(read("longest", &spaces(65_528)), Ok(vec![0.0, 1.0]));
        let expected =
            "points.csv:1: is longer than 65536 bytes; is this a file with one row per point?";
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
