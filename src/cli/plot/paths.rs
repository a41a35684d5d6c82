//! Lines that `fissure plot` draws over a picture, read from CSV files.

use std::path::Path;

use fissure::error::{Error, Result};

/// A line through positions in the plane, m.
pub type Line = Vec<[f64; 2]>;

/// Read the lines to draw from a CSV file. The first row of the file names the columns. The columns `x` and
/// `y` (m) are required.
///
/// Consecutive rows with the same entry in the column `branch` form a line. Without this column, all rows
/// form one line.
///
/// # Errors
/// If the file cannot be read, or if the column `x` or `y` is missing. If a coordinate is not a finite
/// number, or if a row has more or fewer values than the first row.
pub fn read(path: &Path) -> Result<Vec<Line>> {
    let text = std::fs::read_to_string(path).map_err(|error| Error::file(path, "read", &error))?;
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
    name.rsplit_once('[').map_or(name, |(bare, _)| bare).trim()
}

/// Search for the point nearest to each vertex of the lines. Each vertex is drawn with the displacement of
/// its nearest point.
pub struct NearestPoints<'a> {
    /// The lines, each with the index of its file.
    lines: Vec<(usize, &'a Line)>,
    /// For each vertex of all lines, in the order of `lines`: distance (m) from the nearest point found so
    /// far, and displacement (m) of this point.
    nearest: Vec<(f64, [f64; 2])>,
}

impl<'a> NearestPoints<'a> {
    /// Begin the search for the points nearest to the lines of several files. `files` has one entry per file:
    /// the lines of this file.
    pub fn new(files: &'a [Vec<Line>]) -> Self {
        let files = files.iter().enumerate();
        let lines = files.flat_map(|(number, lines)| lines.iter().map(move |line| (number, line)));
        let lines: Vec<_> = lines.collect();
        let vertices = lines.iter().map(|(_, line)| line.len()).sum();
        Self {
            lines,
            nearest: vec![(f64::INFINITY, [0.0; 2]); vertices],
        }
    }

    /// Continue the search with more points. `positions` are their reference positions (m). `displacements`
    /// are their displacements (m), three components per point.
    pub fn search(&mut self, positions: &[[f64; 3]], displacements: &[f64]) {
        let vertices = self.lines.iter().flat_map(|(_, line)| line.iter());
        for (place, nearest) in vertices.zip(&mut self.nearest) {
            for (point, u) in positions.iter().zip(displacements.chunks_exact(3)) {
                let distance = (point[0] - place[0]).hypot(point[1] - place[1]);
                if distance < nearest.0 {
                    *nearest = (distance, [u[0], u[1]]);
                }
            }
        }
    }

    /// Return the lines to draw, each with the index of its file. Each vertex is moved by the displacement of
    /// its nearest point times `factor`.
    pub fn moved_lines(&self, factor: f64) -> Vec<(usize, Vec<[f64; 3]>)> {
        let mut nearest = self.nearest.iter();
        let mut moved = |place: &[f64; 2]| {
            let (_, [x, y]) = nearest.next().expect("one for each vertex");
            [place[0] + factor * x, place[1] + factor * y, 0.0]
        };
        let lines = self.lines.iter();
        lines
            .map(|(number, line)| (*number, line.iter().map(&mut moved).collect()))
            .collect()
    }
}
