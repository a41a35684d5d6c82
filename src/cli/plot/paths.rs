//! Lines that `fissure plot` draws over a picture, read from CSV files.

use std::path::Path;

use fissure::error::{Error, Result};

use crate::cli::file_error;

/// A line through positions in the plane, m.
pub type Line = Vec<[f64; 2]>;

/// Read lines from a CSV file with columns `x` and `y` (m), named in the first row.
///
/// Consecutive rows with the same value of `branch` form a line. Without this column, all rows form one line.
///
/// # Errors
/// If the file cannot be read, a column is missing, or a row has an invalid number.
pub fn read(path: &Path) -> Result<Vec<Line>> {
    let text = std::fs::read_to_string(path).map_err(|error| file_error(path, "read", &error))?;
    let wrong = |line: usize, message: String| {
        Error::input(format!("{}:{line}: {message}", path.display()))
    };
    let mut rows = text.lines().enumerate().map(|(k, row)| (k + 1, row));
    let header = rows.next().map_or("", |(_, row)| row);
    let names: Vec<&str> = header.split(',').map(bare_name).collect();
    let column = |wanted: &str| names.iter().position(|name| *name == wanted);
    let (Some(x), Some(y)) = (column("x"), column("y")) else {
        let message = format!("a path needs the columns `x` and `y`, this has `{header}`");
        return Err(wrong(1, message));
    };
    let branch = column("branch");
    let mut lines: Vec<Line> = Vec::new();
    let mut last = None;
    for (number, row) in rows.filter(|(_, row)| !row.trim().is_empty()) {
        let cells: Vec<&str> = row.split(',').map(str::trim).collect();
        if cells.len() != names.len() {
            let (count, wanted) = (cells.len(), names.len());
            return Err(wrong(
                number,
                format!("has {count} values for {wanted} columns"),
            ));
        }
        let value = |column: usize| {
            let value: Option<f64> = cells[column].parse().ok().filter(|v: &f64| v.is_finite());
            let message = || {
                format!(
                    "`{}` must be a number, is `{}`",
                    names[column], cells[column]
                )
            };
            value.ok_or_else(|| wrong(number, message()))
        };
        let place = [value(x)?, value(y)?];
        let own = branch.map(|column| cells[column]);
        match lines.last_mut() {
            Some(line) if own == last => line.push(place),
            _ => lines.push(vec![place]),
        }
        last = own;
    }
    Ok(lines)
}

/// Remove the unit from a name: `x [m]` becomes `x`.
fn bare_name(name: &str) -> &str {
    name.split('[').next().unwrap_or_default().trim()
}
