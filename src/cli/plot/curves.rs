//! Curves of the history.

use std::path::{Path, PathBuf};

use fissure::error::{Error, Result};
use fissure::message::suggestion;
use fissure::output::{ResultReader, StoredColumn};
use fissure::picture::chart::{Chart, Label, Series};

use super::{PlotArguments, check_ending};
use crate::cli::{Verbosity, errln, outln};

/// The default of `--x`.
const TIME: &str = "time";

/// Largest number of column names in the default file name of a picture.
const MOST_NAMED: usize = 3;

/// The columns of a history.
struct Table {
    path: PathBuf,
    columns: Vec<StoredColumn>,
    /// Number of the last line of a CSV file if [`read_csv`] ignored this line; otherwise `None`.
    ignored_line: Option<usize>,
}

/// Draw columns of one or more histories as curves.
///
/// # Errors
/// If an argument is wrong, if a file lacks a column or cannot be read, if there is no finite value to draw,
/// or if the picture cannot be written.
pub fn plot(arguments: &PlotArguments, verbosity: Verbosity) -> Result<()> {
    let first = &arguments.results[0];
    let tables: Vec<Table> = arguments
        .results
        .iter()
        .map(|path| Table::read(path))
        .collect::<Result<_>>()?;
    for table in &tables {
        if let (Some(line), true) = (table.ignored_line, verbosity > Verbosity::Quiet) {
            errln!(
                "warning: {}:{line}: the last line is ignored: it does not end with a newline, so it may be \
                 incomplete",
                table.path.display()
            );
        }
    }
    let x = arguments.x.as_deref().unwrap_or(TIME);
    if arguments.y.is_empty() {
        let names: Vec<&str> = tables[0].names().collect();
        return Err(Error::input(format!(
            "--y is missing; name the columns to draw with --y COLUMN,COLUMN; {} has {}",
            tables[0].path.display(),
            names.join(", ")
        )));
    }
    let path = arguments.output.clone().unwrap_or_else(|| {
        let columns = &arguments.y[..arguments.y.len().min(MOST_NAMED)];
        let name = format!("{}.png", columns.join("_"));
        if first.is_dir() {
            first.join(name)
        } else {
            first.with_file_name(name)
        }
    });
    check_ending(&path, &["png", "svg"], "")?;
    let horizontal = tables[0].column(x, "--x")?;
    let mut units: Vec<&str> = Vec::new();
    for table in &tables {
        if table.column(x, "--x")?.unit != horizontal.unit {
            return Err(Error::input(format!(
                "--x {x} has different units in {} and {}",
                tables[0].path.display(),
                table.path.display()
            )));
        }
        for name in &arguments.y {
            units.push(&table.column(name, "--y")?.unit);
        }
    }
    let one_unit = units.iter().all(|unit| *unit == units[0]);
    let runs = run_names(&tables);
    let mut series = Vec::new();
    for (table, run) in tables.iter().zip(&runs) {
        let across = table.column(x, "--x")?;
        for name in &arguments.y {
            let column = table.column(name, "--y")?;
            let named = match column.unit.as_str() {
                "" => name.clone(),
                _ if one_unit => name.clone(),
                unit => format!("{name} ({unit})"),
            };
            let points = across.values.iter().zip(&column.values);
            series.push(Series {
                name: match (tables.len(), arguments.y.len()) {
                    (1, _) => named,
                    (_, 1) if one_unit => run.clone(),
                    _ => format!("{run}: {named}"),
                },
                points: points.map(|(x, y)| [*x, *y]).collect(),
            });
        }
    }
    let title = if tables.len() == 1 { &runs[0] } else { "" };
    let chart = Chart {
        title,
        x: Label {
            name: x,
            unit: &horizontal.unit,
        },
        y: Label {
            name: match &arguments.y[..] {
                [name] => name,
                _ => "",
            },
            unit: if one_unit { units[0] } else { "" },
        },
        series: &series,
        width: arguments.picture.width,
    };
    if !chart.has_points() {
        return Err(Error::input(format!(
            "--y {}: no finite values to draw",
            arguments.y.join(",")
        )));
    }
    let is_svg = path
        .extension()
        .is_some_and(|ending| ending.eq_ignore_ascii_case("svg"));
    let written = if is_svg {
        std::fs::write(&path, chart.svg())
    } else {
        chart.image().write_png(&path)
    };
    written.map_err(|error| Error::file(&path, "write", &error))?;
    if verbosity > Verbosity::Quiet {
        let curves = match series.len() {
            1 => "1 curve".to_owned(),
            count => format!("{count} curves"),
        };
        outln!("wrote {}: {curves}", path.display());
    }
    Ok(())
}

impl Table {
    /// Read a CSV file, the history of a result file, or `history.csv` in a folder.
    ///
    /// # Errors
    /// If the file cannot be read, or if it is a result without a history.
    fn read(path: &Path) -> Result<Self> {
        let path = if path.is_dir() {
            path.join("history.csv")
        } else {
            path.to_path_buf()
        };
        let (columns, ignored_line) = if is_csv(&path) {
            read_csv(&path)?
        } else {
            let columns = ResultReader::open(&path)?.history()?;
            if columns.is_empty() {
                return Err(Error::input(format!(
                    "{}: this result has no history; curves need `result.vtkhdf`, the main result of a run, or \
                     `history.csv`",
                    path.display()
                )));
            }
            (columns, None)
        };
        let columns = columns.into_iter().map(|column| StoredColumn {
            unit: if column.unit == "1" {
                String::new()
            } else {
                column.unit
            },
            ..column
        });
        let columns = columns.collect();
        Ok(Self {
            path,
            columns,
            ignored_line,
        })
    }

    fn names(&self) -> impl Iterator<Item = &str> {
        self.columns.iter().map(|column| column.name.as_str())
    }

    fn column(&self, name: &str, option: &str) -> Result<&StoredColumn> {
        let found = self.columns.iter().find(|column| column.name == name);
        found.ok_or_else(|| {
            let known = suggestion(name, self.names());
            Error::input(format!(
                "{option} {name}: {} has no column `{name}`{known}",
                self.path.display()
            ))
        })
    }
}

/// Test whether the name of a file ends with `.csv`, in lower or upper case.
pub fn is_csv(path: &Path) -> bool {
    let ending = path.extension();
    ending.is_some_and(|ending| ending.eq_ignore_ascii_case("csv"))
}

/// Read a CSV file whose first row has names with units, such as `time [s]`. A last line without a newline is
/// ignored, because a killed run or a full disk may leave an incomplete row. Return the columns, and the
/// number of the ignored line.
///
/// # Errors
/// - If the file cannot be read.
/// - If the file has no complete line.
/// - If a row does not have one number per column.
pub fn read_csv(path: &Path) -> Result<(Vec<StoredColumn>, Option<usize>)> {
    let text = std::fs::read_to_string(path)
        .map_err(|error| Error::input(format!("cannot read {}: {error}", path.display())))?;
    let (complete, last) = text.rsplit_once('\n').unwrap_or(("", &text));
    let has_last = !last.trim().is_empty();
    let mut rows = complete.lines().enumerate();
    let (_, header) = rows.next().ok_or_else(|| {
        let path = path.display();
        Error::input(if has_last && last.len() == text.len() {
            format!(
                "{path}:1: the line with the names of the columns is incomplete: it must end with a newline"
            )
        } else {
            format!("{path}: must have a line with the names of the columns")
        })
    })?;
    let mut columns: Vec<StoredColumn> = header
        .split(',')
        .map(|cell| {
            let (name, unit) = cell.rsplit_once('[').unwrap_or((cell, ""));
            StoredColumn {
                name: name.trim().to_owned(),
                unit: unit.trim().trim_end_matches(']').to_owned(),
                values: Vec::new(),
            }
        })
        .collect();
    for (number, row) in rows.filter(|(_, row)| !row.trim().is_empty()) {
        let wrong =
            |message: String| Error::input(format!("{}:{}: {message}", path.display(), number + 1));
        let cells: Vec<&str> = row.split(',').map(str::trim).collect();
        if cells.len() != columns.len() {
            let (count, wanted) = (cells.len(), columns.len());
            return Err(wrong(format!("has {count} values for {wanted} columns")));
        }
        for (column, cell) in columns.iter_mut().zip(cells) {
            let value = cell
                .parse()
                .map_err(|_| wrong(format!("`{}` must be a number, is `{cell}`", column.name)))?;
            column.values.push(value);
        }
    }
    let ignored_line = has_last.then(|| text.split('\n').count());
    Ok((columns, ignored_line))
}

/// Return short, distinct names of runs: the folder of each history, with as many parent folders as needed to
/// make the names distinct.
fn run_names(tables: &[Table]) -> Vec<String> {
    let parts = |table: &Table| -> Vec<String> {
        let absolute = std::path::absolute(&table.path).unwrap_or_else(|_| table.path.clone());
        let folder = absolute.parent().unwrap_or(Path::new(""));
        let names = folder.components().rev();
        names
            .map(|part| part.as_os_str().to_string_lossy().into_owned())
            .collect()
    };
    let all: Vec<Vec<String>> = tables.iter().map(parts).collect();
    let deepest = all.iter().map(Vec::len).max().unwrap_or(1);
    let names = |depth: usize| -> Vec<String> {
        let name = |parts: &Vec<String>| {
            let mut used = parts[..depth.min(parts.len())].to_vec();
            used.reverse();
            used.join("/")
        };
        all.iter().map(name).collect()
    };
    let distinct = |names: &Vec<String>| {
        let mut sorted = names.clone();
        sorted.sort();
        sorted.dedup();
        sorted.len() == names.len()
    };
    let found = (1..=deepest).map(names).find(distinct);
    // Files in the same folder have no distinct folder names, so use the file names.
    found.unwrap_or_else(|| {
        let name = |table: &Table| {
            let stem = table.path.file_stem().unwrap_or_default();
            stem.to_string_lossy().into_owned()
        };
        tables.iter().map(name).collect()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_are_told_apart_by_their_folders() {
        let names = |paths: &[&str]| {
            let table = |path: &&str| Table {
                path: PathBuf::from(path),
                columns: Vec::new(),
                ignored_line: None,
            };
            run_names(&paths.iter().map(table).collect::<Vec<_>>())
        };
        assert_eq!(
            names(&["out/a/history.csv", "out/b/history.csv"]),
            ["a", "b"]
        );
        assert_eq!(
            names(&["/1/a/history.csv", "/2/a/history.csv"]),
            ["1/a", "2/a"]
        );
        assert_eq!(names(&["a/one.csv", "a/two.csv"]), ["one", "two"]);
    }
}
