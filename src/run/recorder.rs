//! Writing result and history when they are due.

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
use super::layout::{FIXED, Layout, pick};
use super::observer::{Observer, Row};
use super::restart_compatibility::history_differences;

/// History rows that are held back before they are written.
const ROWS_HELD: usize = 256;

/// The open result and history of a run.
pub struct Recorder<'a> {
    /// The result file.
    pub file: ResultFile<'a>,
    /// What the history is made of.
    pub observer: HistoryObserver,
    /// The way from points to the rows of checkpoints, and, but for those that `kept` leaves out, of the
    /// result.
    pub order: IdOrder,
    /// Which of this rank's block of ids the result holds; `None` for all.
    kept: Option<Vec<usize>>,
    /// The last row of the history.
    pub last_row: Option<HistoryRow>,
    /// Time spent on the result.
    pub spent: Duration,
    /// Time spent on the history.
    pub spent_on_rows: Duration,
    /// Where the paths of cracks go.
    folder: PathBuf,
    fields: Vec<Field>,
    outputs: Schedule,
    rows: Schedule,
    held: Vec<Vec<f64>>,
    /// On rank 0.
    side_car: Option<SideCar>,
}

/// How a recorder starts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Start {
    /// With new files; older ones may be replaced or not.
    New(Creation),
    /// After so many outputs and history rows of files that are there.
    After(u64, u64),
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
        let (problem, comm) = (simulation.problem, simulation.comm);
        let mut observer = HistoryObserver::new(simulation)?;
        let order = simulation.id_order();
        let kept = kept(simulation, &order)?;
        let clock = &simulation.expected_clock();
        let (outputs, rows) = (
            Schedule(problem.output.every),
            Schedule(problem.row_interval()),
        );
        let layout = Layout::new(simulation, (&order, &kept), outputs.count(clock), metadata);
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
        let side_car =
            (comm.rank() == 0).then(|| SideCar::new(&files.result, &contents, file.past()));
        Ok(Self {
            file,
            observer,
            order,
            kept,
            last_row: None,
            spent: Duration::ZERO,
            spent_on_rows: Duration::ZERO,
            folder: files.folder.clone(),
            fields: problem.output.fields.clone(),
            outputs,
            rows,
            held: Vec::new(),
            side_car,
        })
    }

    /// Follows the points after they have been dealt out anew, or others have come. Collective.
    ///
    /// # Errors
    /// As those of [`HistoryObserver::new`].
    pub fn follow<const D: usize>(&mut self, simulation: &Simulation<'a, D>) -> Result<()> {
        self.order = simulation.id_order();
        self.kept = kept(simulation, &self.order)?;
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
        let energies = row || self.fields.contains(&Field::StrainEnergyDensity);
        let snapshot = if energies {
            Snapshot::new(simulation)
        } else {
            Snapshot::without_energies(simulation)
        };
        // What both need is the output's, if there is one.
        let found = if output { Instant::now() } else { start };
        if row {
            let row = self.observer.row(simulation, &snapshot);
            self.held.push(row.values.clone());
            self.last_row = Some(row);
        }
        if output || self.held.len() >= ROWS_HELD {
            self.write_rows()?;
        }
        let for_rows = found.elapsed();
        self.spent_on_rows += for_rows;
        if output {
            if simulation.may_refine() {
                let layout = Layout::new(simulation, (&self.order, &self.kept), 0, &[]);
                let fixed = layout.fixed();
                self.file.set_points(&layout.contents(&fixed))?;
            }
            let (time, number) = (simulation.clock.time(), simulation.clock.number());
            let (fields, order, kept) = (&self.fields, &self.order, &self.kept);
            self.file.write_step(time, number, |k| {
                let (field, width) = (fields[k], fields[k].components());
                let values = snapshot.field(simulation, field);
                pick(kept, order.collect(simulation.comm, &values, width), width)
            })?;
            let cracks = self.observer.crack_paths(simulation, &snapshot);
            crack_files::write(simulation.comm, &self.folder, &cracks)?;
            let told = match &mut self.side_car {
                Some(side_car) => side_car.add(simulation.clock.time(), self.file.points()),
                None => Ok(()),
            };
            agree(simulation.comm, told)?;
            simulation.fields.forget_newly_broken();
        }
        self.spent += start.elapsed() - for_rows;
        Ok(())
    }

    /// The row of the history that is of the present step, if there is one.
    pub fn row_of(&self, clock: &Clock) -> Option<&HistoryRow> {
        let is_now = |row: &&HistoryRow| row.number == clock.number();
        self.last_row.as_ref().filter(is_now)
    }

    /// Writes the present step for those who want to see where a run has failed. Collective.
    ///
    /// # Errors
    /// When the disc is full.
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

    /// Closes the result; `goes_on` if another run is to continue it. Collective.
    ///
    /// # Errors
    /// When the disc is full, or writing has failed before.
    pub fn close(self, goes_on: bool) -> Result<()> {
        let comm = self.file.communicator();
        self.file.close(goes_on)?;
        agree(comm, self.side_car.map_or(Ok(()), SideCar::finish))
    }

    /// Makes all that has been recorded safe from a loss of power. Collective.
    ///
    /// # Errors
    /// When the disc is full.
    pub fn sync(&mut self) -> Result<()> {
        self.write_rows()?;
        self.file.sync()
    }

    fn write_rows(&mut self) -> Result<()> {
        if !self.held.is_empty() {
            self.file.append_history(&self.held)?;
            self.held.clear();
        }
        Ok(())
    }
}

/// Which of this rank's block of ids the result holds; `None` for all. Collective.
///
/// # Errors
/// When it would hold none.
fn kept<const D: usize>(
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

/// Why the result that a checkpoint belongs to cannot be continued, if it cannot: it is not there, damaged or
/// another one, or the problem asks for other fields or columns. Collective.
///
/// # Errors
/// When a set of the history is empty, or a deck cannot be parsed; when another program has locked the result, or
/// the system does not let it be read.
pub fn why_not_continued<const D: usize>(
    simulation: &Simulation<'_, D>,
    files: &Files,
    header: &Header,
    physics: &str,
) -> Result<Option<String>> {
    let comm: &dyn Communicator = simulation.comm;
    let observer = HistoryObserver::new(simulation)?;
    let changed = agree(comm, history_differences(&header.deck, physics))?;
    let order = simulation.id_order();
    let kept = kept(simulation, &order)?;
    let owned = &simulation.model.ids[..simulation.model.owned()];
    let ids = pick(&kept, order.collect(comm, owned, 1), 1);
    let own = ids.into_iter().map(mix).fold(0, u64::wrapping_add);
    let points = comm::total(comm, own);
    let look = || -> Result<Option<String>> {
        if !is_taken(&files.result) {
            return Ok(Some("the result so far is gone".to_owned()));
        }
        // A link to a disc that is not mounted is no damage.
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
        let mut wanted: Vec<&str> = wanted_fields(simulation.problem);
        wanted.sort_unstable();
        let names = columns.iter().map(|column| &column.name);
        let expected = observer.columns().iter().map(|(name, _)| name);
        let single = |field: &StoredField| field.number == Number::F32;
        let changing = simulation.may_refine();
        if reader.is_changing() != changing {
            return Ok(Some("points are born now or were then".to_owned()));
        }
        let found_points = reader.ids(0)?.into_iter().map(mix);
        if !changing && found_points.fold(0, u64::wrapping_add) != points {
            return Ok(Some("other points are asked for".to_owned()));
        } else if fields.iter().any(single)
            != (simulation.problem.output.single && !wanted.is_empty())
        {
            return Ok(Some("numbers of another length are asked for".to_owned()));
        } else if found != wanted {
            return Ok(Some("other fields are asked for".to_owned()));
        } else if !names.eq(expected) {
            return Ok(Some(
                "other columns of the history are asked for".to_owned(),
            ));
        }
        Ok(changed.map(|lines| format!("columns of the history mean something else: {lines}")))
    };
    found_by_root(comm, look)
}

/// The damage for which the first outputs of a result cannot be read; none where they can. Collective.
///
/// # Errors
/// When another program has locked the result, or the system does not let it be read.
pub fn damage(comm: &dyn Communicator, files: &Files, outputs: u64) -> Result<Option<String>> {
    found_by_root(comm, || {
        ResultReader::open(&files.result)?.check(outputs as usize)?;
        Ok(None)
    })
}

/// Why rank 0 finds that a result cannot be continued. A result that is damaged is such a reason, a failure of
/// the system to read it is an error. Collective.
fn found_by_root(
    comm: &dyn Communicator,
    look: impl FnOnce() -> Result<Option<String>>,
) -> Result<Option<String>> {
    let found = match comm.rank() {
        0 => match look() {
            Err(error) if error.kind == ErrorKind::Input => {
                let text = format!("the result so far is damaged ({})", error.message);
                Ok(Some(text))
            }
            found => found,
        },
        _ => Ok(None),
    };
    let mut why = agree(comm, found)?.unwrap_or_default().into_bytes();
    comm.broadcast(0, &mut why);
    let why = String::from_utf8_lossy(&why).into_owned();
    Ok((!why.is_empty()).then_some(why))
}

fn wanted_fields(problem: &Problem) -> Vec<&'static str> {
    problem
        .output
        .fields
        .iter()
        .map(|field| field.name())
        .collect()
}
