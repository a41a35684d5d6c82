//! What a result consists of.

use crate::comm::{self, IdOrder};
use crate::output::{Contents, FieldData, FieldDescription, Piece};
use crate::problem::Field;
use crate::solver::Simulation;

/// The fields that do not change while the points are the same.
pub const FIXED: [&str; 4] = ["id", "block", "volume", "level"];

/// What a result consists of, whether it is new or continued.
pub struct Layout<'a> {
    places: Vec<f64>,
    ids: Vec<u64>,
    blocks: Vec<u32>,
    volumes: Vec<f64>,
    levels: Option<Vec<u32>>,
    changing: bool,
    moving: Vec<FieldDescription>,
    metadata: &'a [(&'a str, String)],
    single: bool,
    piece: Piece,
    steps: u64,
}

impl<'a> Layout<'a> {
    /// From all ranks.
    pub fn new<const D: usize>(
        simulation: &Simulation<'_, D>,
        (order, kept): (&IdOrder, &Option<Vec<usize>>),
        steps: u64,
        metadata: &'a [(&'a str, String)],
    ) -> Self {
        let (comm, model) = (simulation.comm, &simulation.model);
        let owned = model.owned();
        let problem = simulation.problem;
        let places: Vec<f64> = (0..owned).flat_map(|k| model.position(k)).collect();
        let body = |block: &u16| problem.body_of(usize::from(*block)) as u32;
        let blocks: Vec<u32> = model.block.iter().map(body).collect();
        let level = |block: &u16| problem.block(usize::from(*block)).level;
        let levels: Option<Vec<u32>> =
            (problem.refinement.is_some()).then(|| model.block.iter().map(level).collect());
        let output = &problem.output;
        let describe = |field: &Field| FieldDescription {
            name: field.name(),
            unit: field.unit(),
            components: field.components(),
        };
        let ids = pick(kept, order.collect(comm, &model.ids[..owned], 1), 1);
        let (first, total) = comm::scan(comm, ids.len() as u64);
        let volumes: Vec<f64> = model.volume.iter().take(owned).collect();
        Self {
            places: pick(kept, order.collect(comm, &places, 3), 3),
            blocks: pick(kept, order.collect(comm, &blocks, 1), 1),
            volumes: pick(kept, order.collect(comm, &volumes, 1), 1),
            ids,
            levels: levels.map(|levels| pick(kept, order.collect(comm, &levels, 1), 1)),
            changing: simulation.may_refine(),
            moving: output.fields.iter().map(describe).collect(),
            metadata,
            single: output.single,
            piece: Piece { first, total },
            steps,
        }
    }

    /// The fields that do not change while the points are the same.
    pub fn fixed(&self) -> Vec<(FieldDescription, FieldData<'_>)> {
        let scalar = |name, unit| FieldDescription {
            name,
            unit,
            components: 1,
        };
        let [id, block, volume, level] = FIXED;
        let mut fixed = vec![
            (scalar(id, "1"), FieldData::U64(&self.ids)),
            (scalar(block, "1"), FieldData::U32(&self.blocks)),
            (scalar(volume, "m^3"), FieldData::F64(&self.volumes)),
        ];
        if let Some(levels) = &self.levels {
            fixed.push((scalar(level, "1"), FieldData::U32(levels)));
        }
        fixed
    }

    /// With the fields that [`Self::fixed`] gives.
    pub fn contents<'b>(&'b self, fixed: &'b [(FieldDescription, FieldData<'b>)]) -> Contents<'b> {
        Contents {
            piece: self.piece,
            changing: self.changing,
            positions: bytemuck::cast_slice(&self.places),
            fixed,
            moving: &self.moving,
            metadata: self.metadata,
            single: self.single,
            steps: self.steps,
        }
    }
}

/// The rows that are kept of values with `width` numbers a row.
pub fn pick<T: Copy>(kept: &Option<Vec<usize>>, values: Vec<T>, width: usize) -> Vec<T> {
    let Some(kept) = kept else {
        return values;
    };
    let row = |row: &usize| &values[row * width..(row + 1) * width];
    kept.iter().flat_map(row).copied().collect()
}
