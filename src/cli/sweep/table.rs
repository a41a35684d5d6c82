//! The table and the pictures of a sweep.

use std::path::Path;

use fissure::error::{Error, Result};
use fissure::picture::chart::{Chart, Label, Series};

use super::convergence::rates;
use super::design::Design;
use super::value::{self, Column};
use crate::cli::outln;

/// Width of the pictures in pixels.
const WIDTH: u32 = 900;

/// Values of all runs, with the data from which errors and rates of convergence are computed.
pub struct Table<'a> {
    design: &'a Design,
    columns: &'a [Column],
    references: &'a [Option<f64>],
    abscissa: Option<usize>,
    /// Whether rates are also computed for values without a reference. This is the case if the runs differ in
    /// resolution or `--x` is given.
    has_rates: bool,
    /// Values by run and column. The outer `None` stands for an incomplete run. The inner `None` stands for a
    /// value that is not finite, and for each value of a history without rows.
    values: Vec<Option<Vec<Option<f64>>>>,
    /// States of the incomplete runs.
    states: Vec<&'static str>,
    units: Vec<String>,
}

/// A column of the table. Each row has one text for the printed table and one text for sweep.csv.
struct Cells {
    /// Headings in the printed table, and in sweep.csv.
    heading: [String; 2],
    unit: String,
    /// For each run, the text in the printed table and the text in sweep.csv.
    texts: Vec<[String; 2]>,
}

impl<'a> Table<'a> {
    /// Create a table without values.
    pub fn new(
        design: &'a Design,
        columns: &'a [Column],
        references: &'a [Option<f64>],
        abscissa: Option<usize>,
        has_rates: bool,
    ) -> Self {
        Self {
            design,
            columns,
            references,
            abscissa,
            has_rates,
            values: vec![None; design.rows.len()],
            states: vec!["missing"; design.rows.len()],
            units: vec![String::new(); columns.len()],
        }
    }

    /// Read the values of a complete run.
    ///
    /// # Errors
    /// If the history of the run cannot be read or lacks a column.
    pub fn read(&mut self, number: usize, folder: &Path) -> Result<()> {
        let found = value::read(folder, self.columns)?;
        let (values, units): (Vec<_>, Vec<_>) = found.into_iter().unzip();
        self.values[number] = Some(values);
        self.units = units;
        Ok(())
    }

    /// Set the state of an incomplete run, such as `failed`. The default is `missing`.
    pub fn set_state(&mut self, number: usize, state: &'static str) {
        self.states[number] = state;
    }

    /// Return the number of complete runs.
    pub fn complete(&self) -> usize {
        self.values.iter().flatten().count()
    }

    /// Write sweep.csv and the pictures. If `prints` is true, print the table and the paths of the files.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn write(&self, folder: &Path, prints: bool) -> Result<()> {
        std::fs::create_dir_all(folder).map_err(|error| Error::file(folder, "create", &error))?;
        let cells = self.cells();
        if prints {
            outln!("{}", printed(&cells));
        }
        // Several tasks of a job array may write this table, so write a temporary file and rename it.
        let path = folder.join("sweep.csv");
        let part = folder.join(format!("sweep.csv.{}", std::process::id()));
        std::fs::write(&part, csv(&cells))
            .and_then(|()| std::fs::rename(&part, &path))
            .map_err(|error| Error::file(&path, "write", &error))?;
        if prints {
            outln!("table    {}", path.display());
        }
        for index in 0..self.columns.len() {
            let path = folder.join(format!("{}.png", self.columns[index].key()));
            if self.draw(index, &path)? && prints {
                outln!("picture  {}", path.display());
            }
        }
        Ok(())
    }

    fn value(&self, row: usize, column: usize) -> Option<f64> {
        self.values[row].as_ref()?[column]
    }

    /// Return the columns of the table: the values of each axis, the state of the runs, and each picked
    /// value. The errors and the rates of convergence of a picked value follow in further columns.
    fn cells(&self) -> Vec<Cells> {
        let rows = 0..self.design.rows.len();
        let alike = |text: String| [text.clone(), text];
        let mut cells = Vec::new();
        for (axis, description) in self.design.axes.iter().enumerate() {
            let text = |row: &Vec<usize>| alike(self.design.value(row, axis).to_owned());
            cells.push(Cells {
                heading: alike(description.name.clone()),
                unit: String::new(),
                texts: self.design.rows.iter().map(text).collect(),
            });
        }
        let state = |row: usize| match self.values[row] {
            Some(_) => alike("complete".to_owned()),
            None => alike(self.states[row].to_owned()),
        };
        cells.push(Cells {
            heading: alike("state".to_owned()),
            unit: String::new(),
            texts: rows.clone().map(state).collect(),
        });
        for (index, column) in self.columns.iter().enumerate() {
            let number = |value: Option<f64>, print: fn(f64) -> String| match value {
                Some(value) => [print(value), format!("{value:?}")],
                None => [String::new(), String::new()],
            };
            let value = |row: usize| number(self.value(row, index), |value| format!("{value:.6e}"));
            cells.push(Cells {
                heading: [column.title(), column.key()],
                unit: self.units[index].clone(),
                texts: rows.clone().map(value).collect(),
            });
            if let Some(exact) = self.references[index] {
                let error = |row: usize| {
                    let error = self
                        .value(row, index)
                        .map(|value| (value - exact) / exact.abs());
                    number(error, |error| format!("{:+.3} %", 100.0 * error))
                };
                cells.push(Cells {
                    heading: ["error".to_owned(), format!("{}_error", column.key())],
                    unit: String::new(),
                    texts: rows.clone().map(error).collect(),
                });
            }
            let rates = self.rates(index);
            if rates.iter().any(Option::is_some) {
                let rate = |rate: &Option<f64>| number(*rate, |rate| format!("{rate:.2}"));
                cells.push(Cells {
                    heading: ["rate".to_owned(), format!("{}_rate", column.key())],
                    unit: String::new(),
                    texts: rates.iter().map(rate).collect(),
                });
            }
        }
        cells
    }

    /// Compute the rate of convergence of a picked value for each row; `None` for a row without a rate.
    fn rates(&self, column: usize) -> Vec<Option<f64>> {
        let mut found = vec![None; self.design.rows.len()];
        let Some(abscissa) = self.abscissa else {
            return found;
        };
        if self.references[column].is_none() && !self.has_rates {
            return found;
        }
        for (_, rows) in self.design.groups(abscissa) {
            let series = self.series(&rows, abscissa, column);
            for (row, rate) in rows.iter().zip(rates(&series, self.references[column])) {
                found[*row] = rate;
            }
        }
        found
    }

    fn series(&self, rows: &[usize], abscissa: usize, column: usize) -> Vec<(f64, Option<f64>)> {
        let number = |row: usize| self.design.number(&self.design.rows[row], abscissa);
        let pair = |row: &usize| (number(*row).unwrap_or(f64::NAN), self.value(*row, column));
        rows.iter().map(pair).collect()
    }

    /// Draw a picked value over the abscissa, one curve for each combination of the values of the other axes.
    /// Draw nothing and return false if there is no abscissa, or if fewer than two runs have the value.
    fn draw(&self, column: usize, path: &Path) -> Result<bool> {
        let Some(abscissa) = self.abscissa else {
            return Ok(false);
        };
        let (mut series, mut runs) = (Vec::new(), 0);
        let mut range = [f64::INFINITY, f64::NEG_INFINITY];
        for (name, rows) in self.design.groups(abscissa) {
            let mut points = self.series(&rows, abscissa, column);
            points.sort_by(|a, b| a.0.total_cmp(&b.0));
            let points = points
                .into_iter()
                .filter_map(|(h, value)| Some([h, value?]));
            let points: Vec<[f64; 2]> = points.collect();
            for [h, _] in &points {
                range = [range[0].min(*h), range[1].max(*h)];
            }
            runs += points.len();
            // Add each run to the curve again as an isolated point, because the chart draws isolated points
            // as markers.
            let gap = [f64::NAN; 2];
            let markers: Vec<[f64; 2]> = points.iter().flat_map(|point| [gap, *point]).collect();
            let points = [points, markers].concat();
            series.push(Series { name, points });
        }
        if runs < 2 {
            return Ok(false);
        }
        if let Some(exact) = self.references[column] {
            series.push(Series {
                name: "reference".to_owned(),
                points: range.map(|h| [h, exact]).to_vec(),
            });
            if let [only, _] = &mut series[..] {
                only.name = "runs".to_owned();
            }
        }
        let title = self.columns[column].title();
        let chart = Chart {
            title: "",
            x: Label {
                name: &self.design.axes[abscissa].name,
                unit: "",
            },
            y: Label {
                name: &title,
                unit: &self.units[column],
            },
            series: &series,
            width: WIDTH,
        };
        let written = chart.image().write_png(path);
        written.map_err(|error| Error::file(path, "write", &error))?;
        Ok(true)
    }
}

/// Format the table with aligned columns.
fn printed(cells: &[Cells]) -> String {
    let headings = cells.iter().map(|column| match column.unit.as_str() {
        "" => column.heading[0].clone(),
        unit => format!("{} ({unit})", column.heading[0]),
    });
    let headings: Vec<String> = headings.collect();
    let width = |(column, heading): (&Cells, &String)| {
        let texts = column
            .texts
            .iter()
            .map(|[printed, _]| printed.chars().count());
        texts.chain([heading.chars().count()]).max().unwrap_or(0)
    };
    let widths: Vec<usize> = cells.iter().zip(&headings).map(width).collect();
    let line = |texts: Vec<&String>| {
        let padded = texts
            .iter()
            .zip(&widths)
            .map(|(text, width)| format!("{text:<width$}"));
        padded.collect::<Vec<_>>().join("  ").trim_end().to_owned()
    };
    let rows = cells.first().map_or(0, |column| column.texts.len());
    let mut lines = vec![line(headings.iter().collect())];
    lines.extend(
        (0..rows).map(|row| line(cells.iter().map(|column| &column.texts[row][0]).collect())),
    );
    lines.join("\n")
}

/// Format the table as CSV. The headings have the same form as in history.csv, such as
/// `max_kinetic_energy [J]`.
fn csv(cells: &[Cells]) -> String {
    let quoted = |text: &str| {
        if text.contains([',', '"', '\n']) {
            format!("\"{}\"", text.replace('"', "\"\""))
        } else {
            text.to_owned()
        }
    };
    let heading = |column: &Cells| match column.unit.as_str() {
        "" => quoted(&column.heading[1]),
        unit => quoted(&format!("{} [{unit}]", column.heading[1])),
    };
    let rows = cells.first().map_or(0, |column| column.texts.len());
    let mut lines = vec![cells.iter().map(heading).collect::<Vec<_>>().join(",")];
    for row in 0..rows {
        let texts = cells.iter().map(|column| quoted(&column.texts[row][1]));
        lines.push(texts.collect::<Vec<_>>().join(","));
    }
    lines.join("\n") + "\n"
}
