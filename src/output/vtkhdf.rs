//! The result file: VTKHDF, so that ParaView (5.12 and later) and VTK open it as it is.
//!
//! ```text
//! /                      attributes: the run (deck, version, command line, …)
//! /VTKHDF                Version, Type = UnstructuredGrid; Points, Types, Offsets, Connectivity:
//!                        one vertex per point, at its reference position, written once
//! /VTKHDF/PointData/f    static fields [points], others [steps × points] (, components)
//! /VTKHDF/Steps          NSteps; Values (times), Step (numbers), and where a step's rows start
//! /history/c             one number per history row and column
//! ```
//!
//! The points are one part whatever the number of ranks, in rank order. A step's data are flushed
//! before its row of the tables: a file whose writer was killed holds all its complete steps.

use super::access::Creation;
use super::attribute::Attribute;
use super::collective::CollectiveFile;
use super::dataset::{Dataset, Rows};
use super::field::{FieldData, FieldDescription, POINT_DATA, check, create_field, write_field};
use super::history::History;
use crate::comm::{Communicator, agree};
use crate::error::{Error, Result};
use hdf5_metno::H5Type;
use std::path::Path;

/// VTK's number of a cell that is one point.
const VTK_VERTEX: u8 = 1;

/// The group of the time steps.
pub(super) const STEPS: &str = "/VTKHDF/Steps";

/// What each step has one number of besides its time and number, and how many columns VTK wants.
const STEP_TABLES: [(&str, Option<usize>, u64); 5] = [
    ("PartOffsets", None, 0),
    ("NumberOfParts", None, 1),
    ("PointOffsets", None, 0),
    ("CellOffsets", Some(1), 0),
    ("ConnectivityIdOffsets", Some(1), 0),
];

/// Which rows of the point data are this rank's; ranks follow each other without gaps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Piece {
    /// The number of points of all ranks before this one.
    pub first: u64,
    /// The number of points of all ranks.
    pub total: u64,
}

/// A result file being written. All methods are collective, see [`CollectiveFile`].
pub struct ResultFile<'a> {
    file: CollectiveFile<'a>,
    piece: Piece,
    points: usize,
    steps: u64,
    tables: Vec<(Dataset, u64)>,
    numbers: Dataset,
    times: Dataset,
    static_offsets: Vec<Dataset>,
    fields: Vec<Field>,
    history: Option<History>,
}

/// A field that changes with time; its dataset is made when the first step tells its type.
#[derive(Debug)]
struct Field {
    description: FieldDescription,
    offsets: Dataset,
    values: Option<Dataset>,
}

/// What a result file holds from the start.
#[derive(Debug, Clone, Copy)]
pub struct Contents<'a> {
    /// Which points are this rank's.
    pub piece: Piece,
    /// Their reference positions, m.
    pub positions: &'a [[f64; 3]],
    /// Fields that do not change with time, with their values.
    pub fixed: &'a [(FieldDescription, FieldData<'a>)],
    /// Fields that get their values with every step.
    pub moving: &'a [FieldDescription],
    /// Attributes of the file: name and text.
    pub metadata: &'a [(&'a str, String)],
}

impl<'a> ResultFile<'a> {
    /// Creates the file and writes what does not change with time.
    ///
    /// # Errors
    /// The file exists already or cannot be written, there are no points at all, or the length of
    /// a field does not match the positions.
    pub fn create(
        path: &Path,
        comm: &'a dyn Communicator,
        creation: Creation,
        contents: &Contents,
    ) -> Result<Self> {
        let Contents {
            piece,
            positions,
            fixed,
            moving,
            metadata,
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
        write_geometry(&mut file, piece, positions)?;

        let mut static_offsets = Vec::new();
        for (field, data) in fixed {
            let rows = Rows::Fixed(piece.total);
            let dataset = create_field(&mut file, field, data, rows)?;
            write_field(&mut file, &dataset, piece.first, field, data)?;
            static_offsets.push(create_offsets(&mut file, field)?);
        }
        let mut fields = Vec::new();
        for field in moving {
            fields.push(Field {
                description: *field,
                offsets: create_offsets(&mut file, field)?,
                values: None,
            });
        }
        let one = Rows::Extensible { per_append: 1 };
        let mut tables = Vec::new();
        for (name, columns, value) in STEP_TABLES {
            let table = file.create_dataset::<i64>(&format!("{STEPS}/{name}"), one, columns)?;
            tables.push((table, value));
        }
        let times = file.create_dataset::<f64>(&format!("{STEPS}/Values"), one, None)?;
        file.set_dataset_attribute(&times, "unit", Attribute::Text("s"))?;
        let numbers = file.create_dataset::<u64>(&format!("{STEPS}/Step"), one, None)?;
        file.flush()?;
        Ok(Self {
            file,
            piece,
            points,
            steps: 0,
            tables,
            numbers,
            times,
            static_offsets,
            fields,
            history: None,
        })
    }

    /// Adds one step: its time in s, its number and this rank's values of the dynamic fields, in
    /// the order they were described. A field keeps the number type of its first step. When this
    /// returns, the step survives the end of the process.
    ///
    /// # Errors
    /// A field's length is wrong, or the disc is full.
    pub fn write_step(&mut self, time: f64, step: u64, fields: &[FieldData]) -> Result<()> {
        let checked = if fields.len() == self.fields.len() {
            let mut pairs = self.fields.iter().zip(fields);
            pairs.try_for_each(|(field, data)| check(&field.description, data, self.points))
        } else {
            let (given, described) = (fields.len(), self.fields.len());
            let text = format!("a step has {given} fields, but {described} were described");
            Err(Error::run(text))
        };
        agree(self.file.communicator(), checked)?;

        let file = &mut self.file;
        let first = self.steps * self.piece.total;
        for (field, data) in self.fields.iter_mut().zip(fields) {
            let description = &field.description;
            let mut values = match field.values.take() {
                Some(values) => values,
                None => {
                    let per_append = self.piece.total;
                    create_field(file, description, data, Rows::Extensible { per_append })?
                }
            };
            file.extend(&mut values, self.piece.total)?;
            write_field(file, &values, first + self.piece.first, description, data)?;
            field.values = Some(values);
        }
        file.flush()?;
        // Only when the data are safe may the file say that it has them; and as VTK trusts the
        // tables to be NSteps long, tables and NSteps go out in one flush.
        for field in &mut self.fields {
            append_one(file, &mut field.offsets, first as i64)?;
        }
        for offsets in &mut self.static_offsets {
            append_one(file, offsets, 0_i64)?;
        }
        for (table, value) in &mut self.tables {
            append_one(file, table, *value as i64)?;
        }
        append_one(file, &mut self.numbers, step)?;
        append_one(file, &mut self.times, time)?;
        self.steps += 1;
        file.set_attribute(STEPS, "NSteps", Attribute::Integer(self.steps as i64))?;
        file.flush()
    }

    /// Starts the history: a table of numbers with the given (name, unit) columns, in the file and
    /// in a CSV file.
    ///
    /// # Errors
    /// As [`History::create`]; or there is a history already.
    pub fn create_history(&mut self, columns: &[(String, &str)], csv: &Path) -> Result<()> {
        self.history = Some(History::create(&mut self.file, columns, csv)?);
        Ok(())
    }

    /// Adds rows to the history, the same on all ranks. In the result file they are safe once
    /// the next step is written, in the CSV file when this returns.
    ///
    /// # Errors
    /// There is no history, a row has the wrong length, or the disc is full.
    pub fn append_history(&mut self, rows: &[Vec<f64>]) -> Result<()> {
        match &mut self.history {
            Some(history) => history.append(&mut self.file, rows),
            None => Err(Error::run("history rows without a history")),
        }
    }

    /// See [`CollectiveFile::no_collective_cause`].
    pub fn no_collective_cause(&self) -> u32 {
        self.file.no_collective_cause()
    }

    /// Closes the file.
    ///
    /// # Errors
    /// The disc is full, or an earlier operation failed.
    pub fn close(self) -> Result<()> {
        self.file.close()
    }
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
    // Offsets has one row more than there are cells: each rank writes where its cells end, the
    // first one also where they begin.
    let dataset =
        file.create_dataset::<i64>("/VTKHDF/Offsets", Rows::Fixed(piece.total + 1), None)?;
    let begin = if root { first } else { first + 1 };
    let ends: Vec<i64> = (begin..first + count + 1).collect();
    file.write_rows(&dataset, begin as u64, &ends)
}

fn create_offsets(file: &mut CollectiveFile<'_>, field: &FieldDescription) -> Result<Dataset> {
    let path = format!("{STEPS}/PointDataOffsets/{}", field.name);
    file.create_dataset::<i64>(&path, Rows::Extensible { per_append: 1 }, None)
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
