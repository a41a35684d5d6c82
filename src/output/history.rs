//! The history: numbers of the whole body (energies, reactions, probes) over time, as columns of
//! the result file and as a CSV file beside it.

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

/// The group of the columns.
pub(super) const HISTORY: &str = "/history";

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

/// A table of f64 columns that grows by rows.
pub struct History {
    columns: Vec<Dataset>,
    csv: PathBuf,
    /// On rank 0 only.
    writer: Option<File>,
}

impl History {
    /// Collective. Makes the group `/history` with one dataset per (name, unit) column, and the
    /// CSV file with a header such as `time [s],step,kinetic_energy [J]`; an older one is replaced.
    ///
    /// # Errors
    /// There is a history already, two columns have one name, or the files cannot be written.
    pub fn create(file: &mut CollectiveFile<'_>, contents: &HistoryContents) -> Result<Self> {
        let HistoryContents { columns, csv, rows } = *contents;
        file.create_group(HISTORY)?;
        let mut datasets = Vec::new();
        for (position, (name, unit)) in columns.iter().enumerate() {
            let rows = Rows::Extensible {
                per_append: rows.max(LEAST_ROWS),
            };
            let column = file.create_dataset::<f64>(&format!("{HISTORY}/{name}"), rows, None)?;
            file.set_dataset_attribute(&column, "unit", Attribute::Text(unit))?;
            file.set_dataset_attribute(&column, "column", Attribute::Integer(position as i64))?;
            datasets.push(column);
        }
        let comm = file.communicator();
        let writer = if comm.rank() == 0 {
            create_csv(csv, &header(columns)).map(Some)
        } else {
            Ok(None)
        };
        Ok(Self {
            columns: datasets,
            csv: csv.to_path_buf(),
            writer: agree(comm, writer)?,
        })
    }

    /// Collective. The first `count` rows of the history in a file, the same on all ranks.
    ///
    /// # Errors
    /// A column is missing or too short.
    pub fn read(
        file: &mut CollectiveFile<'_>,
        columns: &[(String, &str)],
        count: u64,
    ) -> Result<Vec<Vec<f64>>> {
        let mut rows = vec![Vec::with_capacity(columns.len()); count as usize];
        for (name, _) in columns {
            let column = file.open_dataset(&format!("{HISTORY}/{name}"))?;
            let values: Vec<f64> = file.read_rows(&column, 0, count as usize)?;
            for (row, value) in rows.iter_mut().zip(values) {
                row.push(value);
            }
        }
        Ok(rows)
    }

    /// Number of rows written.
    pub fn rows(&self) -> u64 {
        self.columns.first().map_or(0, Dataset::rows)
    }

    /// Collective. Adds rows to both files; all ranks pass the same, rank 0 writes them.
    ///
    /// # Errors
    /// A row has not one number per column, or the disc is full.
    pub fn append(&mut self, file: &mut CollectiveFile<'_>, rows: &[Vec<f64>]) -> Result<()> {
        agree(file.communicator(), self.append_csv(rows))?;
        for (position, column) in self.columns.iter_mut().enumerate() {
            let first = column.rows();
            file.extend(column, rows.len() as u64)?;
            let values: Vec<f64> = match self.writer {
                Some(_) => rows.iter().map(|row| row[position]).collect(),
                None => Vec::new(),
            };
            file.write_rows(column, first, &values)?;
        }
        Ok(())
    }

    fn append_csv(&mut self, rows: &[Vec<f64>]) -> Result<()> {
        let Some(writer) = &mut self.writer else {
            return Ok(());
        };
        let mut text = String::new();
        for row in rows {
            if row.len() != self.columns.len() {
                let (length, columns) = (row.len(), self.columns.len());
                let message = format!("a history row has {length} numbers for {columns} columns");
                return Err(Error::run(message));
            }
            let cells: Vec<_> = row.iter().map(|&value| shortest(value)).collect();
            text.push_str(&cells.join(","));
            text.push('\n');
        }
        writer
            .write_all(text.as_bytes())
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
