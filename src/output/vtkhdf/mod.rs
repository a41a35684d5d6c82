//! The result file in VTKHDF layout, which VTK and ParaView (5.12 and later) open directly.
//!
//! ```text
//! /                      attributes: the run (deck, version, command line, …)
//! /VTKHDF                Version, Type = UnstructuredGrid; Points, Types, Offsets, Connectivity:
//!                        one vertex per point, at its reference position, written once
//! /VTKHDF/PointData/f    a field f: one row per point, for each step unless f is static; columns: components
//! /VTKHDF/Steps          NSteps; Values (times), Step (numbers of time steps), and offsets of a step's rows
//! /history               table, one row per time; attributes: columns, units, comma-separated
//! ```
//!
//! As in VTKHDF, the word "step" means an output, not a time step.
//!
//! With adaptive refinement, each step is a separate VTK part. The points and static fields of all steps are
//! then concatenated.
//!
//! Even on several ranks, a step has only one VTK part. The points of a part are in the order of
//! [`IdOrder`](crate::comm::IdOrder). The data of a step are flushed before the row of the step is added to
//! the tables. The file of a killed run therefore contains all complete steps.

mod resume;

use super::access::Creation;
use super::attribute::Attribute;
use super::changing::ChangingPoints;
use super::collective::CollectiveFile;
use super::dataset::{Dataset, Rows};
use super::field::{
    FieldData, FieldDescription, Number, POINT_DATA, check, create_field, write_field,
};
use super::history::{History, HistoryContents};
use crate::comm::{Communicator, agree, threads};
use crate::error::{Error, Result};
use hdf5_metno::H5Type;
use std::path::Path;

/// VTK's cell type of a single point.
pub(super) const VTK_VERTEX: u8 = 1;

/// The group of the steps (outputs).
pub(super) const STEPS: &str = "/VTKHDF/Steps";

/// Tables with one row per step. Each entry contains the name of the table, its number of columns, the value
/// for the first step, and the quantity that the values of later steps count. A table without a number of
/// columns is one-dimensional.
const STEP_TABLES: [(&str, Option<usize>, i64, Counted); 5] = [
    ("PartOffsets", None, 0, Counted::Steps),
    ("NumberOfParts", None, 1, Counted::Nothing),
    ("PointOffsets", None, 0, Counted::Points),
    ("CellOffsets", Some(1), 0, Counted::Points),
    ("ConnectivityIdOffsets", Some(1), 0, Counted::Points),
];

/// Quantity that a table counts if each step has its own points: nothing, the previous steps, or the points
/// of the previous steps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Counted {
    Nothing,
    Steps,
    Points,
}

/// Range of this rank's rows in the point data. The range of a rank starts where the range of the previous
/// rank ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Piece {
    /// Number of points of all lower ranks.
    pub first: u64,
    /// Number of points of all ranks.
    pub total: u64,
}

/// A result file open for writing. Every method that returns a `Result` is collective. A method that fails on
/// one rank fails on all ranks. After a failure, the file is abandoned: further calls fail.
///
/// If all steps have the same points, space for all expected steps is allocated in advance. A new step then
/// changes little metadata.
pub struct ResultFile<'a> {
    file: CollectiveFile<'a>,
    piece: Piece,
    points: usize,
    steps: u64,
    /// In a resumed file: time (s) and number of points of each retained step.
    past: Vec<(f64, usize)>,
    /// Number of points, summed over all written steps. This is also the number of rows that have been
    /// written to the dataset of each field with values per step.
    rows: u64,
    /// The datasets of the points; `None` if all steps have the same points.
    changing: Option<ChangingPoints>,
    /// Number of steps with allocated space.
    capacity: u64,
    tables: Vec<Table>,
    numbers: Dataset,
    times: Dataset,
    fields: Vec<(FieldDescription, Dataset)>,
    history: Option<History>,
}

/// A table with one row per step, and the rule for its values.
struct Table {
    dataset: Dataset,
    rule: Rule,
}

/// The values of a table. If all steps have the same points, the value of step k is `start + stride · k`. If
/// each step has its own points, the value is `start` plus the total of the quantity `counted` over all
/// previous steps.
#[derive(Debug, Clone, Copy)]
struct Rule {
    start: i64,
    stride: i64,
    counted: Counted,
}

/// Description of a result file.
#[derive(Debug, Clone, Copy)]
pub struct Contents<'a> {
    /// Range of rows of this rank.
    pub piece: Piece,
    /// Whether each step has its own points, which [`ResultFile::set_points`] sets.
    pub changing: bool,
    /// Reference positions of this rank's points, m.
    pub positions: &'a [[f64; 3]],
    /// Static fields with their values.
    pub fixed: &'a [(FieldDescription, FieldData<'a>)],
    /// Fields with values per step; their values are floats.
    pub moving: &'a [FieldDescription],
    /// Attributes of the file: name and text.
    pub metadata: &'a [(&'a str, String)],
    /// Expected number of steps; more steps are allowed.
    pub steps: u64,
}

impl<'a> ResultFile<'a> {
    /// Create the file and write the static data.
    ///
    /// # Errors
    /// If the file exists and `creation` is exclusive, if the file cannot be written, if there are no points,
    /// or if a field has the wrong length.
    pub fn create(
        path: &Path,
        comm: &'a dyn Communicator,
        creation: Creation,
        contents: &Contents,
    ) -> Result<Self> {
        let Contents {
            piece,
            changing,
            positions,
            fixed,
            moving,
            metadata,
            steps,
        } = *contents;
        let points = positions.len();
        let mut checked = fixed
            .iter()
            .try_for_each(|(field, data)| check(field, data, points));
        if piece.total == 0 {
            checked = Err(Error::run(format!(
                "{}: there are no points",
                path.display()
            )));
        }
        agree(comm, checked)?;

        let mut file = CollectiveFile::create(path, comm, creation)?;
        for (name, value) in metadata {
            file.set_attribute("/", name, Attribute::Text(value))?;
        }
        for group in [
            "/VTKHDF",
            POINT_DATA,
            STEPS,
            &format!("{STEPS}/PointDataOffsets"),
        ] {
            file.create_group(group)?;
        }
        file.set_attribute("/VTKHDF", "Version", Attribute::Integers(&[2, 0]))?;
        file.set_attribute("/VTKHDF", "Type", Attribute::Ascii("UnstructuredGrid"))?;
        file.set_attribute(STEPS, "NSteps", Attribute::Integer(0))?;
        let geometry = if changing {
            Some(ChangingPoints::create(&mut file, piece.total, fixed)?)
        } else {
            write_geometry(&mut file, piece, positions)?;
            None
        };

        let mut result = Self {
            times: growing::<f64>(&mut file, "Values", steps)?,
            numbers: growing::<u64>(&mut file, "Step", steps)?,
            file,
            piece,
            points,
            past: Vec::new(),
            steps: 0,
            rows: 0,
            changing: geometry,
            capacity: 0,
            tables: Vec::new(),
            fields: Vec::new(),
            history: None,
        };
        for (field, data) in fixed.iter().filter(|_| !changing) {
            let rows = Rows::Fixed(piece.total);
            let dataset = create_field(&mut result.file, field, rows)?;
            write_field(&mut result.file, &dataset, piece.first, field, data)?;
        }
        for field in moving {
            let per_append = piece.total;
            let rows = Rows::Extensible { per_append };
            let dataset = create_field(&mut result.file, field, rows)?;
            result.fields.push((*field, dataset));
        }
        for (path, columns, rule) in tables_of(contents) {
            result.create_table(&path, columns, steps, rule)?;
        }
        let file = &mut result.file;
        file.set_dataset_attribute(&result.times, "unit", Attribute::Text("s"))?;
        result.allocate_steps(steps.max(1))?;
        result.file.flush()?;
        Ok(result)
    }

    /// Set the points and static fields of the next step. The static fields must have the names and order
    /// that they had in [`create`](Self::create).
    ///
    /// # Errors
    /// If the points of the result never change, or a field has the wrong length. If a write fails, for
    /// example because the disk is full.
    pub fn set_points(&mut self, contents: &Contents) -> Result<()> {
        let Contents {
            piece,
            positions,
            fixed,
            ..
        } = *contents;
        let mut pairs = fixed.iter();
        let checked = pairs.try_for_each(|(field, data)| check(field, data, positions.len()));
        agree(self.file.communicator(), checked)?;
        let Some(changing) = &mut self.changing else {
            let text = "the points of this result do not change";
            return agree(self.file.communicator(), Err(Error::run(text)));
        };
        (self.piece, self.points) = (piece, positions.len());
        changing.write(
            &mut self.file,
            piece,
            (self.rows, self.steps),
            positions,
            fixed,
        )?;
        let root = self.file.communicator().rank() == 0;
        for table in &mut self.tables {
            let value = table.rule.start
                + match table.rule.counted {
                    Counted::Nothing => 0,
                    Counted::Steps => self.steps as i64,
                    Counted::Points => self.rows as i64,
                };
            self.file.resize(&mut table.dataset, self.steps + 1)?;
            let own: &[i64] = if root { &[value] } else { &[] };
            self.file.write_rows(&table.dataset, self.steps, own)?;
        }
        for (_, dataset) in &mut self.fields {
            self.file.resize(dataset, self.rows + piece.total)?;
        }
        Ok(())
    }

    /// Append an output: its time (s), the number `step` of the time step and this rank's values of the
    /// moving fields.
    ///
    /// `values(k)` returns the values of moving field k. The step has been flushed when this method returns.
    ///
    /// # Errors
    /// If a field has the wrong length, or a write fails, for example because the disk is full.
    pub fn write_step(
        &mut self,
        time: f64,
        step: u64,
        mut values: impl FnMut(usize) -> Vec<f64>,
    ) -> Result<()> {
        if self.changing.is_none() && self.steps == self.capacity {
            self.allocate_steps(self.capacity + 1)?;
        }
        let first = self.rows + self.piece.first;
        for (k, (description, dataset)) in self.fields.iter().enumerate() {
            let data = values(k);
            let rounded: Vec<f32>;
            let data = if description.number == Number::F32 {
                rounded = data.iter().map(|value| *value as f32).collect();
                FieldData::F32(&rounded)
            } else {
                FieldData::F64(&data)
            };
            let checked = check(description, &data, self.points);
            agree(self.file.communicator(), checked)?;
            write_field(&mut self.file, dataset, first, description, &data)?;
        }
        // Flush the data before the tables that refer to these data.
        self.file.flush()?;
        append_one(&mut self.file, &mut self.numbers, step)?;
        append_one(&mut self.file, &mut self.times, time)?;
        self.steps += 1;
        self.rows += self.piece.total;
        let steps = Attribute::Integer(self.steps as i64);
        self.file.set_attribute(STEPS, "NSteps", steps)?;
        self.file.flush()
    }

    /// Return the time (s) and number of points of each step that a resumed file has retained.
    pub fn past(&self) -> &[(f64, usize)] {
        &self.past
    }

    /// Return the number of points of all ranks in one step. If each step has its own points, this is the
    /// number at the last call of [`set_points`](Self::set_points).
    pub fn points(&self) -> u64 {
        self.piece.total
    }

    /// Return the communicator of the ranks that write the file.
    pub fn communicator(&self) -> &'a dyn Communicator {
        self.file.communicator()
    }

    /// Return the number of steps written.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// Flush and fsync all data and history rows of the file, so that these survive a loss of power.
    ///
    /// # Errors
    /// If a write fails, for example because the disk is full.
    pub fn sync(&mut self) -> Result<()> {
        self.file.sync()
    }

    fn create_table(
        &mut self,
        path: &str,
        columns: Option<usize>,
        steps: u64,
        rule: Rule,
    ) -> Result<()> {
        let rows = Rows::Extensible {
            per_append: steps.max(MIN_CHUNK_ROWS),
        };
        let dataset = self.file.create_dataset::<i64>(path, rows, columns)?;
        self.tables.push(Table { dataset, rule });
        Ok(())
    }

    /// Allocate space for a total number of steps, and fill the tables whose values are known in advance. Do
    /// nothing if each step has its own points.
    fn allocate_steps(&mut self, steps: u64) -> Result<()> {
        if steps <= self.capacity || self.changing.is_some() {
            return Ok(());
        }
        let file = &mut self.file;
        // Several ranks must never shrink a dataset, see `close`.
        for (_, dataset) in &mut self.fields {
            let rows = dataset.rows().max(steps * self.piece.total);
            file.resize(dataset, rows)?;
        }
        let root = file.communicator().rank() == 0;
        for table in &mut self.tables {
            let rows = table.dataset.rows().max(steps);
            file.resize(&mut table.dataset, rows)?;
            let value = |k: u64| table.rule.start + table.rule.stride * k as i64;
            let values: Vec<i64> = (0..steps).map(value).collect();
            file.write_rows(&table.dataset, 0, if root { &values } else { &[] })?;
        }
        self.capacity = steps;
        Ok(())
    }

    /// Create the history: the table in the file, and the CSV file.
    ///
    /// # Errors
    /// If a file cannot be written.
    pub fn create_history(&mut self, contents: &HistoryContents) -> Result<()> {
        self.history = Some(History::create(&mut self.file, contents)?);
        self.file.flush()
    }

    /// Return the number of history rows written.
    pub fn history_rows(&self) -> u64 {
        self.history.as_ref().map_or(0, History::rows)
    }

    /// Append rows to the history; all ranks pass the same rows. On return, the rows are in the CSV file. The
    /// next [`write_step`](Self::write_step) also flushes the rows to the result file.
    ///
    /// # Errors
    /// If there is no history, or a row has the wrong length. If a write fails, for example because the disk
    /// is full.
    pub fn append_history(&mut self, rows: &[Vec<f64>]) -> Result<()> {
        match &mut self.history {
            Some(history) => history.append(&mut self.file, rows),
            None => Err(Error::run("history rows without a history")),
        }
    }

    /// Return the causes of non-collective writes, as HDF5's `H5D_MPIO_…` bits, combined over all ranks and
    /// writes. Return 0 if all writes were collective.
    pub fn no_collective_cause(&self) -> u32 {
        self.file.no_collective_cause()
    }

    /// Close the file. Free unused space, unless the run will be resumed (`will_resume`).
    ///
    /// # Errors
    /// If this or an earlier operation fails, for example because the disk is full.
    pub fn close(self, will_resume: bool) -> Result<()> {
        let (comm, path) = (self.file.communicator(), self.file.path().to_path_buf());
        let tables = self.tables.iter().map(|table| (&table.dataset, self.steps));
        let fields = self.fields.iter().map(|(_, field)| (field, self.rows));
        let unused = tables
            .chain(fields)
            .filter(|(dataset, rows)| dataset.rows() > *rows);
        let unused = unused.map(|(dataset, rows)| (dataset.path().to_owned(), rows));
        let unused: Vec<_> = unused.collect();
        self.file.close()?;
        // Use one rank: HDF5 1.10 deadlocks when several ranks shrink datasets of an existing file. A
        // failure, such as a reader's lock, is harmless, because the unused rows are never read.
        if !will_resume && !unused.is_empty() && comm.rank() == 0 {
            let alone = threads::alone();
            let _ = CollectiveFile::open_to_append(&path, &alone).and_then(|mut file| {
                truncate(&mut file, &unused)?;
                file.close()
            });
        }
        agree(comm, Ok(()))
    }
}

/// Truncate datasets to the given numbers of rows. The file must be open on one rank only.
fn truncate(file: &mut CollectiveFile<'_>, lengths: &[(String, u64)]) -> Result<()> {
    for (path, rows) in lengths {
        let mut dataset = file.open_dataset(path)?;
        file.resize(&mut dataset, *rows)?;
    }
    Ok(())
}

/// Minimum number of rows per chunk of a table.
pub(super) const MIN_CHUNK_ROWS: u64 = 512;

/// Create a table that grows by one row per step.
fn growing<T: H5Type>(file: &mut CollectiveFile<'_>, name: &str, steps: u64) -> Result<Dataset> {
    let per_append = steps.max(MIN_CHUNK_ROWS);
    file.create_dataset::<T>(
        &format!("{STEPS}/{name}"),
        Rows::Extensible { per_append },
        None,
    )
}

/// Return the tables of a result: path, number of columns, and the [`Rule`] that gives the values.
fn tables_of(contents: &Contents) -> Vec<(String, Option<usize>, Rule)> {
    let rule = |start, stride, counted| Rule {
        start,
        stride,
        counted,
    };
    let offsets = |field: &FieldDescription, stride| {
        let path = format!("{STEPS}/PointDataOffsets/{}", field.name);
        (path, None, rule(0, stride, Counted::Points))
    };
    let fixed = contents.fixed.iter().map(|(field, _)| offsets(field, 0));
    let total = contents.piece.total as i64;
    let moving = contents.moving.iter().map(|field| offsets(field, total));
    let of_steps = STEP_TABLES.iter().map(|(name, columns, start, counted)| {
        (
            format!("{STEPS}/{name}"),
            *columns,
            rule(*start, 0, *counted),
        )
    });
    fixed.chain(moving).chain(of_steps).collect()
}

fn write_geometry(
    file: &mut CollectiveFile<'_>,
    piece: Piece,
    positions: &[[f64; 3]],
) -> Result<()> {
    let (first, count) = (piece.first as i64, positions.len() as i64);
    let root = first == 0 && file.communicator().rank() == 0;
    let total = Rows::Fixed(piece.total);
    let one: &[i64] = &[piece.total as i64];
    for name in ["NumberOfPoints", "NumberOfCells", "NumberOfConnectivityIds"] {
        let dataset =
            file.create_dataset::<i64>(&format!("/VTKHDF/{name}"), Rows::Fixed(1), None)?;
        file.write_rows(&dataset, 0, if root { one } else { &[] })?;
    }
    let dataset = file.create_dataset::<f64>("/VTKHDF/Points", total, Some(3))?;
    file.set_dataset_attribute(&dataset, "unit", Attribute::Text("m"))?;
    file.write_rows(&dataset, piece.first, positions.as_flattened())?;
    let dataset = file.create_dataset::<u8>("/VTKHDF/Types", total, None)?;
    file.write_rows(&dataset, piece.first, &vec![VTK_VERTEX; positions.len()])?;
    let dataset = file.create_dataset::<i64>("/VTKHDF/Connectivity", total, None)?;
    let own: Vec<i64> = (first..first + count).collect();
    file.write_rows(&dataset, piece.first, &own)?;
    // n cells have n + 1 offsets: each rank writes the end offsets of its cells, and rank 0 also writes the
    // start offset of the first cell.
    let dataset =
        file.create_dataset::<i64>("/VTKHDF/Offsets", Rows::Fixed(piece.total + 1), None)?;
    let begin = if root { first } else { first + 1 };
    let ends: Vec<i64> = (begin..first + count + 1).collect();
    file.write_rows(&dataset, begin as u64, &ends)
}

fn append_one<T: H5Type>(
    file: &mut CollectiveFile<'_>,
    table: &mut Dataset,
    value: T,
) -> Result<()> {
    let row = table.rows();
    file.extend(table, 1)?;
    let root = file.communicator().rank() == 0;
    file.write_rows(
        table,
        row,
        if root {
            std::slice::from_ref(&value)
        } else {
            &[]
        },
    )
}
