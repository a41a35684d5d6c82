//! Writing result and history when they are due.

use std::time::{Duration, Instant};

use crate::comm::{Communicator, IdOrder, agree};
use crate::deck::Plan;
use crate::deck::plan::Field;
use crate::error::{ErrorKind, Result};
use crate::output::checkpoint::Header;
use crate::output::{
    Contents, Creation, FieldData, FieldDescription, HistoryContents, Piece, ResultFile,
    ResultReader,
};
use crate::solver::Simulation;
use crate::solver::motion::Clock;
use crate::solver::observers::Schedule;
use crate::solver::observers::{HistoryObserver, HistoryRow, Snapshot};

use super::files::Files;
use super::observer::{Observer, Row};

/// History rows that are held back before they are written.
const ROWS_HELD: usize = 256;

/// The open result and history of a run.
pub struct Recorder<'a> {
    /// The result file.
    pub file: ResultFile<'a>,
    /// What the history is made of.
    pub observer: HistoryObserver,
    /// The way from points to the rows of files.
    pub order: IdOrder,
    /// The last row of the history.
    pub last_row: Option<HistoryRow>,
    /// Time spent here.
    pub spent: Duration,
    fields: Vec<Field>,
    outputs: Schedule,
    rows: Schedule,
    held: Vec<Vec<f64>>,
}

/// How a recorder starts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Start {
    /// With new files; older ones may be replaced or not.
    New(Creation),
    /// After so many outputs and history rows of files that are there.
    After(u64, u64),
}

/// What a result consists of, whether it is new or continued.
struct Layout<'a> {
    places: Vec<f64>,
    ids: Vec<u64>,
    blocks: Vec<u32>,
    volumes: Vec<f64>,
    levels: Option<Vec<u32>>,
    moving: Vec<FieldDescription>,
    metadata: &'a [(&'a str, String)],
    piece: Piece,
    steps: u64,
}

impl<'a> Recorder<'a> {
    /// Creates or reopens the files. Collective.
    ///
    /// # Errors
    /// When they cannot be written, or a set of the history is empty.
    pub fn new<const D: usize>(
        simulation: &Simulation<'a, D>,
        files: &Files,
        start: Start,
        metadata: &[(&str, String)],
    ) -> Result<Self> {
        let (plan, comm) = (simulation.plan, simulation.comm);
        let mut observer = HistoryObserver::new(simulation)?;
        let order = simulation.id_order();
        let clock = &simulation.clock;
        let (outputs, rows) = (Schedule(plan.output.every), Schedule(plan.history.every));
        let layout = Layout::new(simulation, &order, outputs.count(clock), metadata);
        let fixed = layout.fixed();
        let contents = layout.contents(&fixed);
        let history = HistoryContents {
            columns: observer.columns(),
            csv: &files.history,
            rows: rows.count(clock),
        };
        let file = match start {
            Start::New(creation) => {
                let made = ResultFile::create(&files.result, comm, creation, &contents).and_then(
                    |mut file| {
                        file.create_history(&history)?;
                        Ok(file)
                    },
                );
                let begun = made
                    .as_ref()
                    .err()
                    .is_some_and(|error| error.kind == ErrorKind::Run);
                if begun && comm.rank() == 0 {
                    // Without its first output it is of no use; that it cannot be removed either
                    // changes nothing.
                    let _ = std::fs::remove_file(&files.result);
                }
                made?
            }
            Start::After(outputs, rows) => {
                let kept = (outputs, rows);
                let (file, past) =
                    ResultFile::resume(&files.result, comm, &contents, &history, kept)?;
                observer.recall::<D>(&past);
                file
            }
        };
        Ok(Self {
            file,
            observer,
            order,
            last_row: None,
            spent: Duration::ZERO,
            fields: plan.output.fields.clone(),
            outputs,
            rows,
            held: Vec::new(),
        })
    }

    /// Follows the points after they have been dealt out anew. Collective.
    ///
    /// # Errors
    /// As those of [`HistoryObserver::new`].
    pub fn follow<const D: usize>(&mut self, simulation: &Simulation<'a, D>) -> Result<()> {
        self.order = simulation.id_order();
        self.observer.follow(simulation)
    }

    /// Whether something is due after a step.
    pub fn is_due(&self, clock: &Clock) -> bool {
        self.outputs.is_due(clock) || self.rows.is_due(clock)
    }

    /// Writes what is due after the present step, and shows `observer` the row of the history.
    /// Collective.
    ///
    /// # Errors
    /// When the disc is full.
    pub fn record<const D: usize>(
        &mut self,
        simulation: &mut Simulation<'_, D>,
        observer: &mut dyn Observer,
    ) -> Result<()> {
        let clock = &simulation.clock;
        let (output, row) = (self.outputs.is_due(clock), self.rows.is_due(clock));
        self.write(simulation, output, row)?;
        if let (Some(values), true) = (&self.last_row, row) {
            let columns = self.observer.columns();
            let row = Row {
                columns,
                row: values,
            };
            observer.row(simulation, &row);
        }
        Ok(())
    }

    /// Writes an output, a history row or both. Collective.
    ///
    /// # Errors
    /// When the disc is full.
    pub fn write<const D: usize>(
        &mut self,
        simulation: &mut Simulation<'_, D>,
        output: bool,
        row: bool,
    ) -> Result<()> {
        if !output && !row {
            return Ok(());
        }
        let start = Instant::now();
        let snapshot = Snapshot::new(simulation);
        if row {
            let row = self.observer.row(simulation, &snapshot);
            self.held.push(row.values.clone());
            self.last_row = Some(row);
        }
        if output || self.held.len() >= ROWS_HELD {
            self.write_rows()?;
        }
        if output {
            let values: Vec<Vec<f64>> = self
                .fields
                .iter()
                .map(|field| {
                    let values = snapshot.field(simulation, *field);
                    self.order
                        .collect(simulation.comm, &values, field.components())
                })
                .collect();
            let data: Vec<&[f64]> = values.iter().map(Vec::as_slice).collect();
            self.file
                .write_step(simulation.clock.time(), simulation.clock.number(), &data)?;
        }
        self.spent += start.elapsed();
        Ok(())
    }

    /// Makes all that has been recorded safe on the disc. Collective.
    ///
    /// # Errors
    /// When the disc is full.
    pub fn flush(&mut self) -> Result<()> {
        self.write_rows()?;
        self.file.flush()
    }

    fn write_rows(&mut self) -> Result<()> {
        if !self.held.is_empty() {
            self.file.append_history(&self.held)?;
            self.held.clear();
        }
        Ok(())
    }
}

/// Whether the result that a checkpoint belongs to is there, with the fields and columns that the plan
/// asks for, so that it can be continued. Collective.
///
/// # Errors
/// When a set of the history is empty, or the result is there but cannot be read.
pub fn can_continue<const D: usize>(
    simulation: &Simulation<'_, D>,
    files: &Files,
    header: &Header,
) -> Result<bool> {
    let comm: &dyn Communicator = simulation.comm;
    let observer = HistoryObserver::new(simulation)?;
    let same = || -> Result<bool> {
        if !files.result.exists() {
            return Ok(false);
        }
        let reader = ResultReader::open(&files.result)?;
        let rows = reader
            .history()?
            .first()
            .map_or(0, |column| column.values.len() as u64);
        // Fewer than the checkpoint counts: it is not the file that the checkpoint belongs to.
        if (reader.steps()?.len() as u64) < header.outputs || rows < header.rows {
            return Ok(false);
        }
        let fields = reader.fields()?;
        let found: Vec<&str> = fields
            .iter()
            .filter(|f| f.dynamic)
            .map(|f| &f.name[..])
            .collect();
        let mut wanted: Vec<&str> = wanted_fields(simulation.plan);
        wanted.sort_unstable();
        let columns = reader.history()?;
        let columns = columns.iter().map(|column| &column.name);
        let expected = observer.columns().iter().map(|(name, _)| name);
        Ok(found == wanted && columns.eq(expected))
    };
    let same = match comm.rank() {
        0 => same(),
        _ => Ok(true),
    };
    let mut answer = vec![u8::from(agree(comm, same)?)];
    comm.broadcast(0, &mut answer);
    Ok(answer == [1])
}

fn wanted_fields(plan: &Plan) -> Vec<&'static str> {
    plan.output
        .fields
        .iter()
        .map(|field| field.name())
        .collect()
}

impl<'a> Layout<'a> {
    fn new<const D: usize>(
        simulation: &Simulation<'_, D>,
        order: &IdOrder,
        steps: u64,
        metadata: &'a [(&'a str, String)],
    ) -> Self {
        let (comm, model) = (simulation.comm, &simulation.model);
        let owned = model.owned();
        let plan = simulation.plan;
        let places: Vec<f64> = (0..owned).flat_map(|k| model.position(k)).collect();
        let body = |block: &u16| plan.body_of(usize::from(*block)) as u32;
        let blocks: Vec<u32> = model.block.iter().map(body).collect();
        let level = |block: &u16| plan.block(usize::from(*block)).level;
        let levels: Option<Vec<u32>> =
            (plan.refinement.is_some()).then(|| model.block.iter().map(level).collect());
        Self {
            places: order.collect(comm, &places, 3),
            ids: order.collect(comm, &model.ids[..owned], 1),
            blocks: order.collect(comm, &blocks, 1),
            volumes: order.collect(comm, &model.volume[..owned], 1),
            levels: levels.map(|levels| order.collect(comm, &levels, 1)),
            moving: plan
                .output
                .fields
                .iter()
                .map(|field| FieldDescription {
                    name: field.name(),
                    unit: field.unit(),
                    components: field.components(),
                })
                .collect(),
            metadata,
            piece: Piece {
                first: order.first(),
                total: model.total,
            },
            steps,
        }
    }

    fn fixed(&self) -> Vec<(FieldDescription, FieldData<'_>)> {
        let scalar = |name, unit| FieldDescription {
            name,
            unit,
            components: 1,
        };
        let mut fixed = vec![
            (scalar("id", "1"), FieldData::U64(&self.ids)),
            (scalar("block", "1"), FieldData::U32(&self.blocks)),
            (scalar("volume", "m^3"), FieldData::F64(&self.volumes)),
        ];
        if let Some(levels) = &self.levels {
            fixed.push((scalar("level", "1"), FieldData::U32(levels)));
        }
        fixed
    }

    fn contents<'b>(&'b self, fixed: &'b [(FieldDescription, FieldData<'b>)]) -> Contents<'b> {
        Contents {
            piece: self.piece,
            positions: bytemuck::cast_slice(&self.places),
            fixed,
            moving: &self.moving,
            metadata: self.metadata,
            steps: self.steps,
        }
    }
}
