//! Initial values of points from a text file: one row per point, with columns that the heading names.

use std::path::Path;

use crate::comm::{Communicator, agree};
use crate::error::{Error, Result, excerpt};
use crate::problem::InitialFile;

use super::columns::heading;
use super::rows::for_each_row;
use super::same_file::check_same_file;

/// Names of the columns of displacements (m), by component.
const DISPLACEMENT: [&str; 3] = ["ux", "uy", "uz"];

/// Names of the columns of velocities (m/s), by component.
const VELOCITY: [&str; 3] = ["vx", "vy", "vz"];

/// Name of the column with the ids of the points, from 0.
const ID: &str = "id";

/// Columns of a file of initial values.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ValueColumns {
    /// Number of columns; each row has this number of entries.
    pub width: usize,
    /// Offset of the heading in the file, bytes.
    pub heading: u64,
    /// Column with the id of the point. Without this column, the rows have the ids 0, 1, 2, …
    pub id: Option<usize>,
    /// Column of each component of the displacement; a missing component is 0.
    pub displacement: Vec<Option<usize>>,
    /// Column of each component of the velocity; a missing component is 0.
    pub velocity: Vec<Option<usize>>,
    /// Names of the columns that are not read.
    pub ignored: Vec<String>,
}

impl ValueColumns {
    /// Test whether the file has a column of displacements.
    pub fn has_displacement(&self) -> bool {
        self.displacement.iter().any(Option::is_some)
    }

    /// Test whether the file has a column of velocities.
    pub fn has_velocity(&self) -> bool {
        self.velocity.iter().any(Option::is_some)
    }
}

/// Find the columns of a file by its heading; upper and lower case are equivalent.
///
/// # Errors
/// If the file cannot be read or has no heading. If the heading has no column of displacements or velocities,
/// or has a known name twice.
pub fn columns(path: &Path, dimension: usize) -> std::result::Result<ValueColumns, String> {
    let name = path.display();
    let found = heading(path).map_err(|error| format!("cannot read {name}: {error}"))?;
    let mut known = vec![ID];
    known.extend(&DISPLACEMENT[..dimension]);
    known.extend(&VELOCITY[..dimension]);
    let known_names = || format!("the known names are `{}`", known.join(" "));
    let Some(heading) = found else {
        return Err(format!("{name}: has no heading; {}", known_names()));
    };
    let mut ignored = heading.names.clone();
    ignored.retain(|name| !known.iter().any(|other| name.eq_ignore_ascii_case(other)));
    for known in &known {
        let columns = heading.names.iter();
        if columns
            .filter(|name| name.eq_ignore_ascii_case(known))
            .count()
            > 1
        {
            let line = heading.line;
            return Err(format!("{name}:{line}: has two columns `{known}`"));
        }
    }
    let column = |name: &str| {
        let mut names = heading.names.iter();
        names.position(|other| other.eq_ignore_ascii_case(name))
    };
    let of_each = |names: [&str; 3]| names[..dimension].iter().map(|name| column(name)).collect();
    let columns = ValueColumns {
        width: heading.names.len(),
        heading: heading.offset,
        id: column(ID),
        displacement: of_each(DISPLACEMENT),
        velocity: of_each(VELOCITY),
        ignored,
    };
    if !columns.has_displacement() && !columns.has_velocity() {
        return Err(format!(
            "{name}:{}: has no column of values; its columns are {}; {}",
            heading.line,
            excerpt(&heading.names.join(" ")),
            known_names()
        ));
    }
    Ok(columns)
}

/// Id of a point and its values: the components of the displacement, then the components of the velocity.
pub type Row = (u64, Vec<f64>);

/// Read this rank's part of the rows. `total` is the number of points. Collective.
///
/// # Errors
/// - If the file cannot be read, or the ranks read different contents.
/// - If a row is invalid, or has an id that no point has.
/// - If a file without ids has more rows than there are points.
///
/// The message gives the file, and the line of a wrong row.
pub fn read(file: &InitialFile, total: u64, comm: &dyn Communicator) -> Result<Vec<Row>> {
    let columns = &file.columns;
    let unreadable = |error| {
        let message = format!("cannot read the file {}: {error}", file.path.display());
        Error::input(message).at(&file.span)
    };
    check_same_file(&file.path, comm, unreadable)?;
    let mut rows = Vec::new();
    let part = for_each_row(
        &file.path,
        Some(columns.heading),
        [comm.rank(), comm.size()],
        |entries| {
            rows.push(row(columns, entries, total)?);
            Ok(())
        },
    );
    agree(comm, part.map_err(unreadable))?.check(&file.path, comm)?;
    if columns.id.is_none() {
        let (before, count) = crate::comm::scan(comm, rows.len() as u64);
        if count > total {
            let path = file.path.display();
            let message = format!(
                "{path}: has {count} rows, must have at most one for each of the {total} points"
            );
            return Err(Error::input(message).at(&file.span));
        }
        for ((id, _), number) in rows.iter_mut().zip(before..) {
            *id = number;
        }
    }
    Ok(rows)
}

/// Parse the entries of a row. Without a column of ids, the id is 0.
fn row(columns: &ValueColumns, entries: &[&str], total: u64) -> std::result::Result<Row, String> {
    if entries.len() != columns.width {
        return Err(format!(
            "has {} entries, must have {} as the heading",
            entries.len(),
            columns.width
        ));
    }
    let id = match columns.id {
        None => 0,
        Some(column) => entries[column].parse().map_err(|_| {
            let entry = excerpt(entries[column]);
            format!("id must be a whole number, 0 or more, is {entry}")
        })?,
    };
    if id >= total {
        return Err(format!(
            "id must be at most {}, the id of the last point, is {id}",
            total - 1
        ));
    }
    let value = |column: &Option<usize>| {
        let Some(column) = column else {
            return Ok(0.0);
        };
        let value = entries[*column].parse::<f64>().ok();
        value.filter(|value| value.is_finite()).ok_or_else(|| {
            let entry = excerpt(entries[*column]);
            format!("column {}: must be a number, is {entry}", column + 1)
        })
    };
    let all = columns.displacement.iter().chain(&columns.velocity);
    Ok((id, all.map(value).collect::<std::result::Result<_, _>>()?))
}
