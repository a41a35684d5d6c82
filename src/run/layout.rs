//! Static data of a result, and descriptions of its fields.

use crate::comm::{self, IdOrder};
use crate::output::{Contents, FieldData, FieldDescription, Number, Piece};
use crate::problem::{Field, Output};
use crate::solver::Simulation;

/// Names of the static fields. Their values change only if refinement creates or removes points.
pub const FIXED: [&str; 4] = ["id", "block", "volume", "level"];

/// Static data and field descriptions of a new or resumed result.
pub struct ResultLayout<'a> {
    positions: Vec<f64>,
    ids: Vec<u64>,
    blocks: Vec<u32>,
    volumes: Vec<f64>,
    levels: Option<Vec<u32>>,
    changing: bool,
    moving: Vec<FieldDescription>,
    metadata: &'a [(&'a str, String)],
    piece: Piece,
    steps: u64,
}

impl<'a> ResultLayout<'a> {
    /// Create the layout. The static data are redistributed, so that each rank has the data of its range of
    /// ids. `rows` are the rows of this rank's range whose points are in the result; `None` for all rows.
    /// `steps` is the expected number of outputs. Collective.
    pub fn new<const D: usize>(
        simulation: &Simulation<'_, D>,
        output: &Output,
        (order, rows): (&IdOrder, &Option<Vec<usize>>),
        steps: u64,
        metadata: &'a [(&'a str, String)],
    ) -> Self {
        let (comm, model) = (simulation.comm, &simulation.model);
        let owned = model.owned();
        let problem = simulation.problem;
        let positions: Vec<f64> = (0..owned).flat_map(|k| model.position(k)).collect();
        let body = |block: &u16| problem.body_of(usize::from(*block)) as u32;
        let blocks: Vec<u32> = model.block.iter().map(body).collect();
        let level = |block: &u16| problem.block(usize::from(*block)).level;
        let levels: Option<Vec<u32>> =
            (problem.refinement.is_some()).then(|| model.block.iter().map(level).collect());
        let describe = |field: &Field| FieldDescription {
            name: field.name(),
            unit: field.unit(),
            components: field.components(),
            number: if output.is_single(*field) {
                Number::F32
            } else {
                Number::F64
            },
        };
        let ids = select(rows, order.collect(comm, &model.ids[..owned], 1), 1);
        let (first, total) = comm::scan(comm, ids.len() as u64);
        let volumes: Vec<f64> = model.volume.iter().take(owned).collect();
        Self {
            positions: select(rows, order.collect(comm, &positions, 3), 3),
            blocks: select(rows, order.collect(comm, &blocks, 1), 1),
            volumes: select(rows, order.collect(comm, &volumes, 1), 1),
            ids,
            levels: levels.map(|levels| select(rows, order.collect(comm, &levels, 1), 1)),
            changing: simulation.may_refine(),
            moving: output.fields.iter().map(describe).collect(),
            metadata,
            piece: Piece { first, total },
            steps,
        }
    }

    /// Return the static fields, see [`FIXED`]. `level` is returned only for a deck with `[refinement]`.
    pub fn fixed(&self) -> Vec<(FieldDescription, FieldData<'_>)> {
        let [id, block, volume, level] = FIXED;
        let mut fixed = vec![
            scalar(id, "1", FieldData::U64(&self.ids)),
            scalar(block, "1", FieldData::U32(&self.blocks)),
            scalar(volume, "m^3", FieldData::F64(&self.volumes)),
        ];
        if let Some(levels) = &self.levels {
            fixed.push(scalar(level, "1", FieldData::U32(levels)));
        }
        fixed
    }

    /// Return the description of the result. `fixed` are the fields of [`Self::fixed`].
    pub fn contents<'b>(&'b self, fixed: &'b [(FieldDescription, FieldData<'b>)]) -> Contents<'b> {
        Contents {
            piece: self.piece,
            changing: self.changing,
            positions: bytemuck::cast_slice(&self.positions),
            fixed,
            moving: &self.moving,
            metadata: self.metadata,
            steps: self.steps,
        }
    }
}

/// Return a scalar field of static data with its description.
fn scalar<'a>(
    name: &'static str,
    unit: &'static str,
    data: FieldData<'a>,
) -> (FieldDescription, FieldData<'a>) {
    let description = FieldDescription {
        name,
        unit,
        components: 1,
        number: data.number(),
    };
    (description, data)
}

/// Select rows of `values`, which has `width` numbers per row; `None` selects all rows.
pub fn select<T: Copy>(rows: &Option<Vec<usize>>, values: Vec<T>, width: usize) -> Vec<T> {
    let Some(rows) = rows else {
        return values;
    };
    let row = |row: &usize| &values[row * width..(row + 1) * width];
    rows.iter().flat_map(row).copied().collect()
}
