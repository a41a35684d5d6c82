//! Output of result and history at their scheduled steps.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use crate::comm::{self, Communicator, IdOrder, agree};
use crate::error::{Error, ErrorKind, Result};
use crate::output::checkpoint::{Header, is_taken};
use crate::output::{
    Creation, HistoryContents, Number, ResultFile, ResultReader, SideCar, StoredField, mix,
};
use crate::problem::Field;
use crate::problem::Problem;
use crate::solver::conditions::output_members;
use crate::solver::motion::Clock;
use crate::solver::observers::Schedule;
use crate::solver::observers::{HistoryObserver, HistoryRow, Snapshot};
use crate::solver::{Simulation, Stepper};

use super::crack_files;
use super::files::Files;
use super::layout::{FIXED, ResultLayout, select};
use super::observer::{Observer, Row};
use super::restart_compatibility::history_differences;

/// Number of history rows buffered before a write.
const BUFFERED_ROWS: usize = 256;

/// The open result and history of a run.
pub struct Recorder<'a> {
    /// The result file.
    pub file: ResultFile<'a>,
    /// Computes the rows of the history.
    pub observer: HistoryObserver,
    /// Redistribution from owned points to blocks of ids, for checkpoints and the result.
    pub order: IdOrder,
    /// The rows of this rank's block that the result contains; `None` for all rows.
    output_rows: Option<Vec<usize>>,
    /// The last row of the history.
    pub last_row: Option<HistoryRow>,
    /// Time spent on the result.
    pub spent: Duration,
    /// Time spent on the history.
    pub spent_on_rows: Duration,
    /// Folder of the crack files.
    folder: PathBuf,
    fields: Vec<Field>,
    outputs: Schedule,
    rows: Schedule,
    buffered: Vec<Vec<f64>>,
    /// The side-car; on rank 0 only.
    side_car: Option<SideCar>,
}

/// Start of a recorder.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Start {
    /// Create new files.
    New(Creation),
    /// Resume existing files after a number of outputs and history rows.
    After(u64, u64),
}

impl<'a> Recorder<'a> {
    /// Create or resume the files. Collective.
    ///
    /// # Errors
    /// If they cannot be written, or a set of the history is empty.
    pub fn new<const D: usize>(
        simulation: &Simulation<'a, D>,
        files: &Files,
        start: Start,
        metadata: &[(&str, String)],
    ) -> Result<Self> {
        let (problem, comm) = (simulation.problem, simulation.comm);
        let mut observer = HistoryObserver::new(simulation)?;
        let order = simulation.id_order();
        let output_rows = output_rows(simulation, &order)?;
        let clock = &simulation.expected_clock();
        let (outputs, rows) = (
            Schedule::of_outputs(&problem.output),
            Schedule::every(problem.row_interval()),
        );
        let selection = (&order, &output_rows);
        let layout = ResultLayout::new(simulation, selection, outputs.count(clock), metadata);
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
                    // Errors are ignored: a result without outputs only uses disk space.
                    let _ = std::fs::remove_file(&files.result);
                }
                made?
            }
            Start::After(outputs, rows) => {
                let retained = (outputs, rows);
                let (file, past) =
                    ResultFile::resume(&files.result, comm, &contents, &history, retained)?;
                observer.recall(&past);
                file
            }
        };
        let side_car =
            (comm.rank() == 0).then(|| SideCar::new(&files.result, &contents, file.past()));
        Ok(Self {
            file,
            observer,
            order,
            output_rows,
            last_row: None,
            spent: Duration::ZERO,
            spent_on_rows: Duration::ZERO,
            folder: files.folder.clone(),
            fields: problem.output.fields.clone(),
            outputs,
            rows,
            buffered: Vec::new(),
            side_car,
        })
    }

    /// Update after rebalancing or refinement. Collective.
    ///
    /// # Errors
    /// Same as for [`HistoryObserver::new`].
    pub fn update_points<const D: usize>(&mut self, simulation: &Simulation<'a, D>) -> Result<()> {
        self.order = simulation.id_order();
        self.output_rows = output_rows(simulation, &self.order)?;
        self.observer.follow(simulation)
    }

    /// Test whether an output or row is due after a step.
    pub fn is_due(&self, clock: &Clock) -> bool {
        self.outputs.is_due(clock) || self.rows.is_due(clock)
    }

    /// Write the due output and history row, and pass the row to `observer`. Collective.
    ///
    /// # Errors
    /// If the disk is full.
    pub fn record<const D: usize>(
        &mut self,
        stepper: &mut Stepper<'_, D>,
        observer: &mut dyn Observer,
    ) -> Result<()> {
        let clock = stepper.clock();
        let (output, row) = (self.outputs.is_due(clock), self.rows.is_due(clock));
        self.write(stepper.at_full_step(), output, row)?;
        if let (Some(values), true) = (&self.last_row, row) {
            let columns = self.observer.columns();
            let row = Row {
                columns,
                row: values,
            };
            observer.row(stepper, &row);
        }
        Ok(())
    }

    /// Write an output, a history row or both. Collective.
    ///
    /// # Errors
    /// If the disk is full.
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
        let energies = row || self.fields.contains(&Field::StrainEnergyDensity);
        let snapshot = if energies {
            Snapshot::new(simulation)
        } else {
            Snapshot::without_energies(simulation)
        };
        // If output and row share a snapshot, its time counts as output.
        let rows_start = if output { Instant::now() } else { start };
        if row {
            let row = self.observer.row(simulation, &snapshot);
            self.buffered.push(row.values.clone());
            self.last_row = Some(row);
        }
        if output || self.buffered.len() >= BUFFERED_ROWS {
            self.write_rows()?;
        }
        let row_time = rows_start.elapsed();
        self.spent_on_rows += row_time;
        if output {
            if simulation.may_refine() {
                let layout =
                    ResultLayout::new(simulation, (&self.order, &self.output_rows), 0, &[]);
                let fixed = layout.fixed();
                self.file.set_points(&layout.contents(&fixed))?;
            }
            let (time, number) = (simulation.clock.time(), simulation.clock.number());
            let (fields, order, rows) = (&self.fields, &self.order, &self.output_rows);
            self.file.write_step(time, number, |k| {
                let (field, width) = (fields[k], fields[k].components());
                let values = snapshot.field(simulation, field);
                select(rows, order.collect(simulation.comm, &values, width), width)
            })?;
            let cracks = self.observer.crack_paths(simulation, &snapshot);
            crack_files::write(simulation.comm, &self.folder, &cracks)?;
            let written = match &mut self.side_car {
                Some(side_car) => side_car.add(simulation.clock.time(), self.file.points()),
                None => Ok(()),
            };
            agree(simulation.comm, written)?;
            simulation.fields.forget_newly_broken();
        }
        self.spent += start.elapsed() - row_time;
        Ok(())
    }

    /// The row of the history of the current step, if any.
    pub fn row_of(&self, clock: &Clock) -> Option<&HistoryRow> {
        let is_now = |row: &&HistoryRow| row.number == clock.number();
        self.last_row.as_ref().filter(is_now)
    }

    /// Output the state of a failed run. Collective.
    ///
    /// # Errors
    /// If the disk is full.
    pub fn write_failure<const D: usize>(
        &mut self,
        simulation: &mut Simulation<'_, D>,
    ) -> Result<()> {
        if self.outputs.is_due(&simulation.clock) {
            self.sync()
        } else {
            self.write(simulation, true, false)
        }
    }

    /// Close the result. With `will_resume`, its unused space is retained. Collective.
    ///
    /// # Errors
    /// If the disk is full, or an earlier write failed.
    pub fn close(self, will_resume: bool) -> Result<()> {
        let comm = self.file.communicator();
        self.file.close(will_resume)?;
        agree(comm, self.side_car.map_or(Ok(()), SideCar::finish))
    }

    /// Write buffered rows and fsync the result. Collective.
    ///
    /// # Errors
    /// If the disk is full.
    pub fn sync(&mut self) -> Result<()> {
        self.write_rows()?;
        self.file.sync()
    }

    fn write_rows(&mut self) -> Result<()> {
        if !self.buffered.is_empty() {
            self.file.append_history(&self.buffered)?;
            self.buffered.clear();
        }
        Ok(())
    }
}

/// The rows of this rank's block that the result contains; `None` for all rows. Collective.
///
/// # Errors
/// If the output set is empty.
fn output_rows<const D: usize>(
    simulation: &Simulation<'_, D>,
    order: &IdOrder,
) -> Result<Option<Vec<usize>>> {
    let (problem, model, comm) = (simulation.problem, &simulation.model, simulation.comm);
    let Some(points) = output_members(problem, comm, model)? else {
        return Ok(None);
    };
    let mut flags = vec![0_u32; model.owned()];
    points.iter().for_each(|point| flags[*point as usize] = 1);
    let flags = order.collect(comm, &flags, 1);
    Ok(Some(
        (0..flags.len()).filter(|row| flags[*row] == 1).collect(),
    ))
}

/// The reason why the result of a checkpoint cannot be continued, if any: it is missing or damaged, has
/// other points, or has other fields or columns. Collective.
///
/// # Errors
/// If a set of the history is empty, a deck cannot be parsed, or the result is locked or unreadable.
pub fn reason_for_new_result<const D: usize>(
    simulation: &Simulation<'_, D>,
    files: &Files,
    header: &Header,
    physics: &str,
) -> Result<Option<String>> {
    let comm: &dyn Communicator = simulation.comm;
    let observer = HistoryObserver::new(simulation)?;
    let changed = agree(comm, history_differences(&header.deck, physics))?;
    let order = simulation.id_order();
    let rows = output_rows(simulation, &order)?;
    let owned = &simulation.model.ids[..simulation.model.owned()];
    let ids = select(&rows, order.collect(comm, owned, 1), 1);
    let own = ids.into_iter().map(mix).fold(0, u64::wrapping_add);
    let points = comm::total(comm, own);
    let compare = || -> Result<Option<String>> {
        if !is_taken(&files.result) {
            return Ok(Some("the result so far is gone".to_owned()));
        }
        // If the path is a link to an unmounted file system, this is an error, not damage.
        std::fs::metadata(&files.result).map_err(|error| {
            let path = files.result.display();
            Error::run(format!("{path}: cannot read the result so far: {error}"))
        })?;
        let reader = ResultReader::open(&files.result)?;
        let columns = reader.history()?;
        let rows = columns
            .first()
            .map_or(0, |column| column.values.len() as u64);
        let outputs = reader.steps()?.len() as u64;
        reader.times()?;
        if outputs < header.outputs || rows < header.rows {
            let text = "the result so far has fewer outputs or rows than the checkpoint counts";
            return Ok(Some(text.to_owned()));
        }
        let fields = reader.fields()?;
        let moving = fields
            .iter()
            .filter(|field| field.dynamic && !FIXED.contains(&&field.name[..]));
        let found: Vec<&str> = moving.map(|field| &field.name[..]).collect();
        let mut requested: Vec<&str> = requested_fields(simulation.problem);
        requested.sort_unstable();
        let names = columns.iter().map(|column| &column.name);
        let expected = observer.columns().iter().map(|(name, _)| name);
        let single = |field: &StoredField| field.number == Number::F32;
        let changing = simulation.may_refine();
        if reader.is_changing() != changing {
            let text = "adaptive refinement was switched on or off";
            return Ok(Some(text.to_owned()));
        }
        let found_points = reader.ids(0)?.into_iter().map(mix);
        if !changing && found_points.fold(0, u64::wrapping_add) != points {
            return Ok(Some("other points are asked for".to_owned()));
        } else if fields.iter().any(single)
            != (simulation.problem.output.single && !requested.is_empty())
        {
            return Ok(Some("numbers of another length are asked for".to_owned()));
        } else if found != requested {
            return Ok(Some("other fields are asked for".to_owned()));
        } else if !names.eq(expected) {
            return Ok(Some(
                "other columns of the history are asked for".to_owned(),
            ));
        }
        Ok(changed.map(|lines| format!("columns of the history mean something else: {lines}")))
    };
    found_by_root(comm, compare)
}

/// The damage of a result, if its first outputs cannot be read. Collective.
///
/// # Errors
/// If the result is locked or unreadable.
pub fn damage(comm: &dyn Communicator, files: &Files, outputs: u64) -> Result<Option<String>> {
    found_by_root(comm, || {
        ResultReader::open(&files.result)?.check(outputs as usize)?;
        Ok(None)
    })
}

/// Run `check` on rank 0 and broadcast the reason that it returns. Damage of the result is a reason; a
/// failure to read it is an error. Collective.
fn found_by_root(
    comm: &dyn Communicator,
    check: impl FnOnce() -> Result<Option<String>>,
) -> Result<Option<String>> {
    let found = match comm.rank() {
        0 => match check() {
            Err(error) if error.kind == ErrorKind::Input => {
                let text = format!("the result so far is damaged ({})", error.message);
                Ok(Some(text))
            }
            found => found,
        },
        _ => Ok(None),
    };
    let mut reason = agree(comm, found)?.unwrap_or_default().into_bytes();
    comm.broadcast(0, &mut reason);
    let reason = String::from_utf8_lossy(&reason).into_owned();
    Ok((!reason.is_empty()).then_some(reason))
}

fn requested_fields(problem: &Problem) -> Vec<&'static str> {
    problem
        .output
        .fields
        .iter()
        .map(|field| field.name())
        .collect()
}
