//! The history: numbers of the whole body (energies, reactions, probes) over time, as a table in the
//! result file and as a CSV file beside it.

use super::attribute::Attribute;
use super::collective::CollectiveFile;
use super::dataset::{Dataset, Rows};
use super::vtkhdf::LEAST_ROWS;
use crate::comm::agree;
use crate::error::{Error, Result};
use std::fmt::Write as _;
use std::fs::File;
use std::io::Write as _;
use std::path::{Path, PathBuf};

/// The table: a row for each moment.
pub(super) const HISTORY: &str = "/history";

/// Its attributes, with the names and the units of the columns, and what is between them there.
pub(super) const COLUMNS: &str = "columns";
pub(super) const UNITS: &str = "units";
pub(super) const SEPARATOR: &str = ",";

/// What a history holds from the start.
#[derive(Debug, Clone, Copy)]
pub struct HistoryContents<'a> {
    /// Name and unit of each column.
    pub columns: &'a [(String, &'static str)],
    /// Where the CSV file goes.
    pub csv: &'a Path,
    /// Number of rows that are expected; there may be more.
    pub rows: u64,
}

/// The open history.
pub struct History {
    table: Dataset,
    csv: PathBuf,
    /// On rank 0 only.
    writer: Option<File>,
}

impl History {
    /// Collective. Makes the table `/history`, and the CSV file with a header such as
    /// `time [s],step,kinetic_energy [J]`; an older one is replaced.
    ///
    /// # Errors
    /// There is a history already, or the files cannot be written.
    pub fn create(file: &mut CollectiveFile<'_>, contents: &HistoryContents) -> Result<Self> {
        let HistoryContents { columns, csv, rows } = *contents;
        let rows = Rows::Extensible {
            per_append: rows.max(LEAST_ROWS),
        };
        let table = file.create_dataset::<f64>(HISTORY, rows, Some(columns.len()))?;
        let names: Vec<&str> = columns.iter().map(|(name, _)| &name[..]).collect();
        let units: Vec<&str> = columns.iter().map(|(_, unit)| *unit).collect();
        for (name, texts) in [(COLUMNS, names), (UNITS, units)] {
            file.set_dataset_attribute(&table, name, Attribute::Text(&texts.join(SEPARATOR)))?;
        }
        Self::with(file, table, csv, || create_csv(csv, &header(columns)))
    }

    /// Collective. Goes on after the rows of the history in a file, which are given. The CSV file is written anew,
    /// beside its place, so that the old one is there until the new one is whole.
    ///
    /// # Errors
    /// The table is missing, or the files cannot be written.
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

    /// With the CSV file that rank 0 begins.
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

    /// Collective. The first `count` rows of the history in a file, the same on all ranks.
    ///
    /// # Errors
    /// The table is missing or too short.
    pub fn read(file: &mut CollectiveFile<'_>, count: u64) -> Result<Vec<Vec<f64>>> {
        let table = file.open_dataset(HISTORY)?;
        let values: Vec<f64> = file.read_rows(&table, 0, count as usize)?;
        Ok(values
            .chunks_exact(table.columns())
            .map(<[f64]>::to_vec)
            .collect())
    }

    /// Number of rows written.
    pub fn rows(&self) -> u64 {
        self.table.rows()
    }

    /// Collective. Adds rows to both files; all ranks pass the same, rank 0 writes them.
    ///
    /// # Errors
    /// A row has not one number per column, or the disc is full.
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
        writer
            .write_all(lines(rows).as_bytes())
            .map_err(|error| csv_failure(&self.csv, &error))
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

/// The lines of some rows.
fn lines(rows: &[Vec<f64>]) -> String {
    let mut text = String::new();
    for row in rows {
        let cells: Vec<_> = row.iter().map(|&value| shortest(value)).collect();
        text.push_str(&cells.join(","));
        text.push('\n');
    }
    text
}

/// The shortest text that reads back as the same number; whole numbers without a point.
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
    fn numbers_read_back_as_they_were() {
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
