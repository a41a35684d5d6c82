//! Points of a result with adaptive refinement: each step has its own points. In this file, the word step
//! means an output, as in VTKHDF.

use hdf5_metno::H5Type;

use super::collective::CollectiveFile;
use super::dataset::{Dataset, Rows};
use super::field::{FieldData, FieldDescription, Number, create_field, write_field};
use super::vtkhdf::{MIN_CHUNK_ROWS, Piece, VTK_VERTEX};
use crate::error::Result;

/// VTKHDF's datasets of counts, one row per step.
const COUNTS: [&str; 3] = ["NumberOfPoints", "NumberOfCells", "NumberOfConnectivityIds"];

/// The datasets of the points. In each dataset, the rows of all steps follow one another.
pub struct ChangingPoints {
    counts: Vec<Dataset>,
    positions: Dataset,
    types: Dataset,
    connectivity: Dataset,
    offsets: Dataset,
    fixed: Vec<Fixed>,
}

/// A static field, which changes only when the points change.
struct Fixed {
    field: FieldDescription,
    dataset: Dataset,
}

impl ChangingPoints {
    /// Create empty datasets; `total` is the expected number of points per step.
    pub fn create(
        file: &mut CollectiveFile<'_>,
        total: u64,
        fixed: &[(FieldDescription, FieldData<'_>)],
    ) -> Result<Self> {
        let rows = Rows::Extensible { per_append: total };
        let parts = Rows::Extensible {
            per_append: MIN_CHUNK_ROWS,
        };
        let counts = COUNTS
            .iter()
            .map(|name| file.create_dataset::<i64>(&format!("/VTKHDF/{name}"), parts, None));
        let counts = counts.collect::<Result<_>>()?;
        let make = |(field, _): &(FieldDescription, FieldData)| {
            Ok(Fixed {
                field: *field,
                dataset: create_field(file, field, rows)?,
            })
        };
        let fixed = fixed.iter().map(make).collect::<Result<_>>()?;
        Ok(Self {
            counts,
            positions: file.create_dataset::<f64>("/VTKHDF/Points", rows, Some(3))?,
            types: file.create_dataset::<u8>("/VTKHDF/Types", rows, None)?,
            connectivity: file.create_dataset::<i64>("/VTKHDF/Connectivity", rows, None)?,
            offsets: file.create_dataset::<i64>("/VTKHDF/Offsets", rows, None)?,
            fixed,
        })
    }

    /// Append the points of a step. The file already holds `rows` points in `steps` steps. Collective.
    pub fn write(
        &mut self,
        file: &mut CollectiveFile<'_>,
        piece: Piece,
        (rows, steps): (u64, u64),
        positions: &[[f64; 3]],
        fixed: &[(FieldDescription, FieldData<'_>)],
    ) -> Result<()> {
        let count = positions.len();
        let root = file.communicator().rank() == 0;
        let total: &[i64] = &[piece.total as i64];
        for dataset in &mut self.counts {
            file.resize(dataset, steps + 1)?;
            file.write_rows(dataset, steps, if root { total } else { &[] })?;
        }
        let (first, end) = (rows + piece.first, rows + piece.total);
        for dataset in [&mut self.positions, &mut self.types, &mut self.connectivity] {
            file.resize(dataset, end)?;
        }
        file.write_rows(&self.positions, first, positions.as_flattened())?;
        file.write_rows(&self.types, first, &vec![VTK_VERTEX; count])?;
        let own = piece.first as i64..(piece.first as usize + count) as i64;
        let own: Vec<i64> = own.collect();
        file.write_rows(&self.connectivity, first, &own)?;
        // A step with n cells has n + 1 offsets: each rank writes the end offsets of its cells, and rank 0
        // also writes the start offset of the first cell.
        file.resize(&mut self.offsets, end + steps + 1)?;
        let begin = piece.first + u64::from(!root);
        let ends: Vec<i64> = (begin..piece.first + count as u64 + 1)
            .map(|k| k as i64)
            .collect();
        file.write_rows(&self.offsets, rows + steps + begin, &ends)?;
        for (target, (_, data)) in self.fixed.iter_mut().zip(fixed) {
            file.resize(&mut target.dataset, end)?;
            write_field(file, &target.dataset, first, &target.field, data)?;
        }
        Ok(())
    }

    /// Copy the points of the first `steps` steps from the file `old` to `file`; these steps have `rows`
    /// points in total. Collective.
    pub fn copy(
        &mut self,
        old: &mut CollectiveFile<'_>,
        file: &mut CollectiveFile<'_>,
        rows: u64,
        steps: u64,
    ) -> Result<()> {
        for dataset in &mut self.counts {
            copy::<i64>(old, file, dataset, steps)?;
        }
        copy::<f64>(old, file, &mut self.positions, rows)?;
        copy::<u8>(old, file, &mut self.types, rows)?;
        copy::<i64>(old, file, &mut self.connectivity, rows)?;
        copy::<i64>(old, file, &mut self.offsets, rows + steps)?;
        for Fixed { field, dataset } in &mut self.fixed {
            copy_field(old, file, field.number, dataset, rows)?;
        }
        Ok(())
    }
}

/// Copy the first `rows` rows of a field; see [`copy`].
pub fn copy_field(
    old: &mut CollectiveFile<'_>,
    file: &mut CollectiveFile<'_>,
    number: Number,
    dataset: &mut Dataset,
    rows: u64,
) -> Result<()> {
    match number {
        Number::F64 => copy::<f64>(old, file, dataset, rows),
        Number::F32 => copy::<f32>(old, file, dataset, rows),
        Number::U64 => copy::<u64>(old, file, dataset, rows),
        Number::U32 => copy::<u32>(old, file, dataset, rows),
        Number::U8 => copy::<u8>(old, file, dataset, rows),
    }
}

/// Copy the first `rows` rows to `dataset` from the dataset with the same path in the file `old`. Each rank
/// copies a share of the rows. Collective.
pub fn copy<T: H5Type + bytemuck::Pod>(
    old: &mut CollectiveFile<'_>,
    file: &mut CollectiveFile<'_>,
    dataset: &mut Dataset,
    rows: u64,
) -> Result<()> {
    let (rank, size) = {
        let comm = file.communicator();
        (comm.rank() as u64, comm.size() as u64)
    };
    let start = |rank: u64| (u128::from(rows) * u128::from(rank) / u128::from(size)) as u64;
    let (first, end) = (start(rank), start(rank + 1));
    let source = old.open_dataset(&dataset.path)?;
    let values: Vec<T> = old.read_rows(&source, first, (end - first) as usize)?;
    file.resize(dataset, rows)?;
    file.write_rows(dataset, first, &values)
}
