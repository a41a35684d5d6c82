//! Serial reader of result files. As in VTKHDF, the word "step" means an output, not a time step.

use super::failure::{innermost, system_error};
use super::field::{Number, POINT_DATA};
use super::history::{COLUMNS, HISTORY, SEPARATOR, UNITS};
use super::vtkhdf::STEPS;
use crate::component;
use crate::error::{Error, Result};
use hdf5_metno as hdf5;
use hdf5_metno::types::{FloatSize, IntSize, TypeDescriptor, VarLenUnicode};
use std::io::ErrorKind::{NotFound, WouldBlock};
use std::ops::Range;
use std::path::{Path, PathBuf};

/// A field of a result file, as stored.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StoredField {
    /// Name of the field.
    pub name: String,
    /// Unit of the field; `1` or empty if dimensionless.
    pub unit: String,
    /// Components per point: 1, 3, 6 or 9.
    pub components: usize,
    /// Number type of the stored values.
    pub number: Number,
    /// Whether the field has values for each step. True if the field changes with time, or if each step has
    /// its own points.
    pub dynamic: bool,
}

impl StoredField {
    /// Return the names of the components in storage order; empty for a scalar.
    pub fn component_names(&self) -> &'static [&'static str] {
        component::names(self.components)
    }
}

/// A column of the history.
#[derive(Debug, Clone, PartialEq)]
pub struct StoredColumn {
    /// Name of the column.
    pub name: String,
    /// Unit of the column; `1` or empty if dimensionless.
    pub unit: String,
    /// One number per row.
    pub values: Vec<f64>,
}

/// A result file open for reading.
///
/// Errors are of kind [`Input`](crate::error::ErrorKind::Input) if the file is missing, damaged or not a
/// result. Errors are of kind [`Run`](crate::error::ErrorKind::Run) if the system fails to read the file.
#[derive(Debug)]
pub struct ResultReader {
    file: hdf5::File,
    path: PathBuf,
    /// Number of points: one entry for all steps, or one entry per step.
    counts: Vec<usize>,
    steps: usize,
}

impl ResultReader {
    /// Open a result file.
    ///
    /// # Errors
    /// If the file is missing, not a result of Fissure, locked by another program, or unreadable, or if its
    /// path is not UTF-8.
    pub fn open(path: &Path) -> Result<Self> {
        let problem = |text: &str| Err(Error::input(format!("{}: {text}", path.display())));
        if let Err(error) = std::fs::metadata(path) {
            if error.kind() != NotFound {
                return Err(cannot_read(path, &error));
            }
            return problem(&format!("cannot open the result file: {error}"));
        }
        if path.to_str().is_none() {
            return problem(
                "the path of a result file must be UTF-8; rename the file or its folder",
            );
        }
        let readable = |error: &hdf5::Error| match system_error(error) {
            Some(cause) => Err(cannot_read(path, &cause)),
            None => Ok(()),
        };
        let file = match hdf5::File::open(path) {
            Ok(file) => file,
            Err(error) => {
                readable(&error)?;
                let cause = innermost(&error);
                return problem(&format!("this is not a readable HDF5 file: {cause}"));
            }
        };
        if let Err(error) = file.group("VTKHDF") {
            readable(&error)?;
            return problem("this HDF5 file is not a result of Fissure: it has no group /VTKHDF");
        }
        let steps = file.group(STEPS).and_then(|group| group.attr("NSteps"));
        let steps = match steps.and_then(|attribute| attribute.read_scalar::<i64>()) {
            Ok(steps) => steps as usize,
            Err(error) => {
                readable(&error)?;
                let text = "this VTKHDF file is not a result of Fissure: it has no time steps";
                return problem(text);
            }
        };
        // After a loss of power, NSteps and the lengths of the tables `Values` and `Step` can differ. Steps
        // up to the smallest of these three numbers are valid.
        let mut complete = steps;
        for name in ["Values", "Step"] {
            let rows = match file.dataset(&format!("{STEPS}/{name}")) {
                Ok(table) => table.size(),
                Err(error) => {
                    readable(&error)?;
                    0
                }
            };
            complete = complete.min(rows);
        }
        let points = file.dataset("/VTKHDF/NumberOfPoints");
        let counts: Vec<usize> = match points.and_then(|dataset| dataset.read_raw::<u64>()) {
            Ok(points) => points.into_iter().map(|count| count as usize).collect(),
            Err(error) => {
                readable(&error)?;
                Vec::new()
            }
        };
        if counts.is_empty() {
            return problem("this VTKHDF file is not a result of Fissure: it has no points");
        }
        Ok(Self {
            file,
            path: path.to_path_buf(),
            counts,
            steps: complete,
        })
    }

    /// Return the path of the file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Return the number of points at one of the [times](Self::times).
    pub fn points(&self, time_index: usize) -> usize {
        self.counts[time_index.min(self.counts.len() - 1)]
    }

    /// Test whether the file stores a separate set of points for each step.
    pub fn is_changing(&self) -> bool {
        let id = self.file.dataset(&format!("{POINT_DATA}/id"));
        id.is_ok_and(|dataset| dataset.is_resizable())
    }

    /// Return the times (s) of the complete steps.
    ///
    /// # Errors
    /// If the file is damaged.
    pub fn times(&self) -> Result<Vec<f64>> {
        self.table(&format!("{STEPS}/Values"))
    }

    /// Return the solver's time step number at each complete output.
    ///
    /// # Errors
    /// If the file is damaged.
    pub fn steps(&self) -> Result<Vec<u64>> {
        self.table(&format!("{STEPS}/Step"))
    }

    /// Return the rows of a dataset that belong to a range of points at one of the [times](Self::times).
    /// `offsets` is the path of a table with one entry per step: the first row of the step in the dataset.
    fn rows(&self, offsets: &str, time_index: usize, points: Range<usize>) -> Result<Range<usize>> {
        let offsets: Vec<u64> = self.table(offsets)?;
        let first = offsets.get(time_index).map_or(0, |offset| *offset as usize);
        Ok(first + points.start..first + points.end)
    }

    /// Return the reference positions at one of the [times](Self::times), m.
    ///
    /// # Errors
    /// If the file is damaged.
    pub fn positions(&self, time_index: usize) -> Result<Vec<[f64; 3]>> {
        self.positions_of(time_index, 0..self.points(time_index))
    }

    /// Return the reference positions of consecutive points, as [`positions`](Self::positions) does for all
    /// points.
    ///
    /// # Errors
    /// If the file is damaged.
    pub fn positions_of(&self, time_index: usize, points: Range<usize>) -> Result<Vec<[f64; 3]>> {
        let path = "/VTKHDF/Points";
        let rows = self.rows(&format!("{STEPS}/PointOffsets"), time_index, points)?;
        let read = self.file.dataset(path).and_then(|dataset| {
            let values = dataset.read_slice_2d::<f64, _>((rows, ..))?;
            Ok(values.into_iter().collect::<Vec<f64>>())
        });
        let values = read.map_err(|error| self.damaged(path, &error))?;
        Ok(values.as_chunks::<3>().0.to_vec())
    }

    /// Return the global ids of the points at one of the [times](Self::times). All other point data at this
    /// time are in the same order.
    ///
    /// # Errors
    /// If the file is damaged or has no ids.
    pub fn ids(&self, time_index: usize) -> Result<Vec<u64>> {
        self.ids_of(time_index, 0..self.points(time_index))
    }

    /// Return the ids of consecutive points, as [`ids`](Self::ids) does for all points.
    ///
    /// # Errors
    /// If the file is damaged or has no ids.
    pub fn ids_of(&self, time_index: usize, points: Range<usize>) -> Result<Vec<u64>> {
        let path = format!("{POINT_DATA}/id");
        let rows = self.rows(&format!("{STEPS}/PointDataOffsets/id"), time_index, points)?;
        let read = self.file.dataset(&path).and_then(|dataset| {
            let values = dataset.read_slice_1d::<u64, _>(rows)?;
            Ok(values.into_iter().collect())
        });
        read.map_err(|error| self.damaged(&path, &error))
    }

    /// Return the fields in the order of their names.
    ///
    /// # Errors
    /// If the file is damaged.
    pub fn fields(&self) -> Result<Vec<StoredField>> {
        let names = self
            .file
            .group(POINT_DATA)
            .and_then(|group| group.member_names());
        let names = names.map_err(|error| self.damaged(POINT_DATA, &error))?;
        names
            .into_iter()
            .map(|name| self.stored_field(name))
            .collect()
    }

    /// Return the values of a field at one of the [times](Self::times), as a row-major array
    /// [points, components]. Integers are converted to floats.
    ///
    /// # Errors
    /// If the field or time is missing, or the file is damaged.
    pub fn field(&self, name: &str, time_index: usize) -> Result<Vec<f64>> {
        self.field_of(name, time_index, 0..self.points(time_index))
    }

    /// Return the values of consecutive points, as [`field`](Self::field) does for all points.
    ///
    /// # Errors
    /// If the field or time is missing, or the file is damaged.
    pub fn field_of(
        &self,
        name: &str,
        time_index: usize,
        points: Range<usize>,
    ) -> Result<Vec<f64>> {
        let path = format!("{POINT_DATA}/{name}");
        if !self.file.link_exists(&path) {
            let names: Vec<_> = self.fields()?.into_iter().map(|field| field.name).collect();
            let (file, known) = (self.path.display(), names.join(", "));
            return Err(Error::input(format!(
                "{file}: no field `{name}`; there are {known}"
            )));
        }
        if time_index >= self.steps {
            let (file, steps) = (self.path.display(), self.steps);
            return Err(Error::input(format!(
                "{file}: no time {time_index}; there are {steps}"
            )));
        }
        let offsets = format!("{STEPS}/PointDataOffsets/{name}");
        let rows = self.rows(&offsets, time_index, points)?;
        let read = self.file.dataset(&path).and_then(|dataset| {
            Ok(if dataset.ndim() == 1 {
                dataset.read_slice_1d::<f64, _>(rows)?.into_iter().collect()
            } else {
                dataset
                    .read_slice_2d::<f64, _>((rows, ..))?
                    .into_iter()
                    .collect()
            })
        });
        read.map_err(|error| self.damaged(&path, &error))
    }

    /// Return the columns of the history in their order in the file. The list is empty if the file has no
    /// history.
    ///
    /// # Errors
    /// If the file is damaged.
    pub fn history(&self) -> Result<Vec<StoredColumn>> {
        if !self.file.link_exists(HISTORY) {
            return Ok(Vec::new());
        }
        let read = || -> hdf5::Result<Vec<StoredColumn>> {
            let table = self.file.dataset(HISTORY)?;
            let (names, units) = (text(&table, COLUMNS)?, text(&table, UNITS)?);
            let both = names.split(SEPARATOR).zip(units.split(SEPARATOR));
            let column = |(name, unit): (&str, &str)| StoredColumn {
                name: name.to_owned(),
                unit: unit.to_owned(),
                values: Vec::new(),
            };
            let mut columns: Vec<StoredColumn> = both.map(column).collect();
            let values: Vec<f64> = table.read_raw()?;
            for row in values.chunks_exact(columns.len()) {
                for (column, value) in columns.iter_mut().zip(row) {
                    column.values.push(*value);
                }
            }
            Ok(columns)
        };
        read().map_err(|error| self.damaged(HISTORY, &error))
    }

    /// Return the attributes of the file (deck, version, command line, …), in the order of their names.
    ///
    /// # Errors
    /// If the file is damaged.
    pub fn attributes(&self) -> Result<Vec<(String, String)>> {
        let read = || -> hdf5::Result<Vec<_>> {
            let names = self.file.attr_names()?.into_iter();
            names
                .map(|name| Ok((name.clone(), text(&self.file, &name)?)))
                .collect()
        };
        read().map_err(|error| self.damaged("/", &error))
    }

    fn stored_field(&self, name: String) -> Result<StoredField> {
        let path = format!("{POINT_DATA}/{name}");
        let read = || -> hdf5::Result<StoredField> {
            let dataset = self.file.dataset(&path)?;
            let number = match dataset.dtype()?.to_descriptor()? {
                TypeDescriptor::Float(FloatSize::U4) => Number::F32,
                TypeDescriptor::Float(_) => Number::F64,
                TypeDescriptor::Unsigned(IntSize::U1) => Number::U8,
                TypeDescriptor::Unsigned(IntSize::U4) => Number::U32,
                TypeDescriptor::Unsigned(IntSize::U8) => Number::U64,
                other => return Err(format!("unexpected numbers of type {other}").into()),
            };
            Ok(StoredField {
                unit: text(&dataset, "unit")?,
                components: dataset.shape().get(1).copied().unwrap_or(1),
                number,
                dynamic: dataset.is_resizable(),
                name,
            })
        };
        read().map_err(|error| self.damaged(&path, &error))
    }

    /// Read a table with one number per complete step.
    fn table<T: hdf5::H5Type>(&self, path: &str) -> Result<Vec<T>> {
        let read = self
            .file
            .dataset(path)
            .and_then(|dataset| dataset.read_raw::<T>());
        let mut values = read.map_err(|error| self.damaged(path, &error))?;
        if values.len() < self.steps {
            let error = hdf5::Error::from("there are fewer numbers than steps");
            return Err(self.damaged(path, &error));
        }
        values.truncate(self.steps);
        Ok(values)
    }

    /// Check that the history, and all points and values of the first `steps` steps, are readable.
    ///
    /// # Errors
    /// If the file is damaged or has fewer than `steps` steps.
    pub fn check(&self, steps: usize) -> Result<()> {
        let fields = self.fields()?;
        self.history()?;
        for step in 0..steps {
            self.positions(step)?;
            for field in &fields {
                self.field(&field.name, step)?;
            }
        }
        Ok(())
    }

    fn damaged(&self, object: &str, error: &hdf5::Error) -> Error {
        if let Some(cause) = system_error(error) {
            return cannot_read(&self.path, &cause);
        }
        let file = self.path.display();
        Error::input(format!(
            "{file}: cannot read {object} of this result file: {error}"
        ))
    }
}

/// Return the error for a file that the system cannot read.
fn cannot_read(path: &Path, cause: &std::io::Error) -> Error {
    let path = path.display();
    Error::run(match cause.kind() {
        WouldBlock => format!(
            "{path} is locked by another program that has it open for writing; close it there, then try again"
        ),
        _ => format!("{path}: cannot read the result file: {cause}"),
    })
}

fn text(object: &hdf5::Location, name: &str) -> hdf5::Result<String> {
    let value: VarLenUnicode = object.attr(name)?.read_scalar()?;
    Ok(value.to_string())
}
