//! The history: global quantities (energies, reactions, probes) over time, as a table in the result file
//! and as a CSV file.

use super::attribute::Attribute;
use super::collective::CollectiveFile;
use super::dataset::{Dataset, Rows};
use super::vtkhdf::MIN_CHUNK_ROWS;
use crate::comm::agree;
use crate::error::{Error, Result};
use std::fmt::Write as _;
use std::fs::File;
use std::io::{Seek as _, Write as _};
use std::path::{Path, PathBuf};

/// Path of the table. Each row has the quantities at one time.
pub(super) const HISTORY: &str = "/history";

/// Attribute with the names of the columns.
pub(super) const COLUMNS: &str = "columns";
/// Attribute with the units of the columns.
pub(super) const UNITS: &str = "units";
/// Separator of the names in [`COLUMNS`] and of the units in [`UNITS`].
pub(super) const SEPARATOR: &str = ",";

/// Description of a history.
#[derive(Debug, Clone, Copy)]
pub struct HistoryContents<'a> {
    /// Name and unit of each column.
    pub columns: &'a [(String, &'static str)],
    /// Path of the CSV file.
    pub csv: &'a Path,
    /// Expected number of rows; more rows are allowed.
    pub rows: u64,
}

/// The open history.
pub struct History {
    table: Dataset,
    csv: PathBuf,
    /// The open CSV file, on rank 0 only.
    writer: Option<File>,
}

impl History {
    /// Create the table `/history` and the CSV file. The CSV file replaces an existing file. Collective.
    ///
    /// Example of the header of the CSV file: `time [s],step [1],kinetic_energy [J]`.
    ///
    /// # Errors
    /// If the table exists or a file cannot be written.
    pub fn create(file: &mut CollectiveFile<'_>, contents: &HistoryContents) -> Result<Self> {
        let HistoryContents { columns, csv, rows } = *contents;
        let rows = Rows::Extensible {
            per_append: rows.max(MIN_CHUNK_ROWS),
        };
        let table = file.create_dataset::<f64>(HISTORY, rows, Some(columns.len()))?;
        let names: Vec<&str> = columns.iter().map(|(name, _)| &name[..]).collect();
        let units: Vec<&str> = columns.iter().map(|(_, unit)| *unit).collect();
        for (name, texts) in [(COLUMNS, names), (UNITS, units)] {
            file.set_dataset_attribute(&table, name, Attribute::Text(&texts.join(SEPARATOR)))?;
        }
        Self::with(file, table, csv, || create_csv(csv, &header(columns)))
    }

    /// Continue the history of a file whose table holds the rows `past`. Collective.
    ///
    /// The rows `past` are written to a temporary file, which then replaces the CSV file by a rename.
    ///
    /// # Errors
    /// If the table is missing or a file cannot be written.
    pub fn resume(
        file: &mut CollectiveFile<'_>,
        contents: &HistoryContents,
        past: &[Vec<f64>],
    ) -> Result<Self> {
        let table = file.open_dataset(HISTORY)?;
        let csv = contents.csv;
        let rewritten = || -> Result<File> {
            let part = csv.with_extension("csv.part");
            let writer = create_csv(&part, &(header(contents.columns) + &lines(past)))?;
            std::fs::rename(&part, csv).map_err(|error| csv_failure(csv, &error))?;
            Ok(writer)
        };
        Self::with(file, table, csv, rewritten)
    }

    /// Call `begin` on rank 0 to open the CSV file, and return the history.
    fn with(
        file: &CollectiveFile<'_>,
        table: Dataset,
        csv: &Path,
        begin: impl FnOnce() -> Result<File>,
    ) -> Result<Self> {
        let comm = file.communicator();
        let writer = if comm.rank() == 0 {
            begin().map(Some)
        } else {
            Ok(None)
        };
        Ok(Self {
            table,
            csv: csv.to_path_buf(),
            writer: agree(comm, writer)?,
        })
    }

    /// Read the first `count` rows of the history of a file, on all ranks. Collective.
    ///
    /// # Errors
    /// If the table is missing or too short.
    pub fn read(file: &mut CollectiveFile<'_>, count: u64) -> Result<Vec<Vec<f64>>> {
        let table = file.open_dataset(HISTORY)?;
        let values: Vec<f64> = file.read_rows(&table, 0, count as usize)?;
        Ok(values
            .chunks_exact(table.columns())
            .map(<[f64]>::to_vec)
            .collect())
    }

    /// Return the number of rows written.
    pub fn rows(&self) -> u64 {
        self.table.rows()
    }

    /// Append rows to the table and the CSV file; all ranks pass the same rows. Collective.
    ///
    /// # Errors
    /// If the length of a row differs from the number of columns, or a write fails, for example because the
    /// disk is full. The CSV file then still ends with a complete row.
    pub fn append(&mut self, file: &mut CollectiveFile<'_>, rows: &[Vec<f64>]) -> Result<()> {
        agree(file.communicator(), self.append_csv(rows))?;
        let first = self.table.rows();
        file.extend(&mut self.table, rows.len() as u64)?;
        let values = if self.writer.is_some() {
            rows.concat()
        } else {
            Vec::new()
        };
        file.write_rows(&self.table, first, &values)
    }

    fn append_csv(&mut self, rows: &[Vec<f64>]) -> Result<()> {
        let Some(writer) = &mut self.writer else {
            return Ok(());
        };
        let columns = self.table.columns();
        if let Some(row) = rows.iter().find(|row| row.len() != columns) {
            let length = row.len();
            let message = format!("a history row has {length} numbers for {columns} columns");
            return Err(Error::run(message));
        }
        let written = writer.stream_position().and_then(|length| {
            writer.write_all(lines(rows).as_bytes()).inspect_err(|_| {
                // Best effort: readers ignore an incomplete last row.
                let _ = writer.set_len(length);
            })
        });
        written.map_err(|error| csv_failure(&self.csv, &error))
    }
}

fn create_csv(path: &Path, header: &str) -> Result<File> {
    File::create(path)
        .and_then(|mut file| file.write_all(header.as_bytes()).map(|()| file))
        .map_err(|error| csv_failure(path, &error))
}

fn csv_failure(path: &Path, error: &std::io::Error) -> Error {
    Error::run(format!(
        "{}: cannot write the history: {error}",
        path.display()
    ))
}

fn header(columns: &[(String, &str)]) -> String {
    let mut text = String::new();
    for (position, (name, unit)) in columns.iter().enumerate() {
        let separator = if position == 0 { "" } else { "," };
        let _ = write!(text, "{separator}{name}");
        if !unit.is_empty() {
            let _ = write!(text, " [{unit}]");
        }
    }
    text + "\n"
}

/// Format rows as CSV.
fn lines(rows: &[Vec<f64>]) -> String {
    let mut text = String::new();
    for row in rows {
        let cells: Vec<_> = row.iter().map(|&value| shortest(value)).collect();
        text.push_str(&cells.join(","));
        text.push('\n');
    }
    text
}

/// Format a number with the fewest digits that parse to the same number. Whole numbers with an absolute value
/// below 10¹⁵ have no decimal point.
fn shortest(value: f64) -> String {
    if value.fract() == 0.0 && value.abs() < 1e15 {
        format!("{value}")
    } else {
        format!("{value:?}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn formatted_numbers_parse_to_the_same_value() {
        for value in [0.0, -3.0, 0.1, 1.0 / 3.0, 6.02e23, 5e-324, f64::INFINITY] {
            assert_eq!(shortest(value).parse(), Ok(value));
        }
        assert_eq!(shortest(1200.0), "1200");
        assert_eq!(shortest(2e-9), "2e-9");
    }

    #[test]
    fn the_header_names_the_units() {
        let columns = [("time", "s"), ("step", ""), ("reaction_top_x", "N")];
        let columns = columns.map(|(name, unit)| (name.to_owned(), unit));
        assert_eq!(header(&columns), "time [s],step,reaction_top_x [N]\n");
    }
}
