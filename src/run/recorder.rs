//! Output of results and history at their scheduled steps.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use crate::comm::{self, Communicator, IdOrder, agree};
use crate::error::{Error, ErrorKind, Result};
use crate::output::checkpoint::{FurtherResult, Header, is_taken};
use crate::output::{HistoryContents, Number, ResultFile, ResultReader, mix};
use crate::problem::{Output, Problem};
use crate::solver::motion::Clock;
use crate::solver::observers::Schedule;
use crate::solver::observers::{HistoryObserver, HistoryRow, Snapshot};
use crate::solver::{Simulation, Stepper};

use super::crack_files;
use super::energy_watch::{EnergyWatch, StepKinds, check_finite};
use super::files::Files;
use super::layout::{FIXED, select};
use super::observer::{Observer, Row};
use super::output_file::{OutputFile, Start, output_rows};
use super::restart_compatibility::{self, history_differences, in_one_line};

/// Number of history rows that are buffered before a write.
const BUFFERED_ROWS: usize = 256;

/// The open results and history of a run.
pub struct Recorder<'a> {
    /// Observer that computes the rows of the history.
    pub observer: HistoryObserver,
    /// Checks of the energy balance.
    pub energy: EnergyWatch,
    /// Plan of the exchange between owned points and ranges of ids, for checkpoints and results.
    pub order: IdOrder,
    /// The last row of the history; `None` before the first row.
    pub last_row: Option<HistoryRow>,
    /// Time spent on results.
    pub spent: Duration,
    /// Time spent on the history.
    pub spent_on_rows: Duration,
    /// The result files. The first is the main result, which contains the history.
    files: Vec<OutputFile<'a>>,
    /// Folder of the crack files.
    folder: PathBuf,
    /// Schedule of the history rows.
    rows: Schedule,
    /// History rows that are not yet written.
    buffered: Vec<Vec<f64>>,
}

impl<'a> Recorder<'a> {
    /// Create or resume all result files. `starts` has an entry per file. A resumed history continues after
    /// `rows` rows. Collective.
    ///
    /// # Errors
    /// If a file cannot be created, resumed or written, or if the set of an output is empty. The errors of
    /// [`HistoryObserver::new`] are also returned.
    pub fn new<const D: usize>(
        simulation: &Simulation<'a, D>,
        files: &Files,
        (starts, rows): (&[Start], u64),
        metadata: &[(&str, String)],
    ) -> Result<Self> {
        let problem = simulation.problem;
        let mut observer = HistoryObserver::new(simulation)?;
        let order = simulation.id_order();
        let schedule = Schedule::every(problem.row_interval());
        let contents = HistoryContents {
            columns: observer.columns(),
            csv: &files.history,
            rows: schedule.count(&simulation.expected_clock()),
        };
        let mut opened = Vec::new();
        let mut past = Vec::new();
        let outputs = problem.outputs().zip(files.results()).zip(starts);
        for (number, (output, start)) in outputs.enumerate() {
            let history = (number == 0).then_some((&contents, rows));
            let file = OutputFile::new(simulation, output, &order, (*start, history), metadata);
            match file {
                Ok((file, rows)) => {
                    opened.push(file);
                    past.extend(rows);
                }
                Err(error) => {
                    abandon(simulation.comm, opened, files, starts);
                    return Err(error);
                }
            }
        }
        observer.record_past(&past);
        Ok(Self {
            observer,
            energy: EnergyWatch::new(simulation),
            order,
            last_row: None,
            spent: Duration::ZERO,
            spent_on_rows: Duration::ZERO,
            files: opened,
            folder: files.folder.clone(),
            rows: schedule,
            buffered: Vec::new(),
        })
    }

    /// Return the main result.
    pub fn main(&self) -> &ResultFile<'a> {
        &self.files[0].file
    }

    /// Return the name of each further result and the number of its outputs, for a checkpoint.
    pub fn further<const D: usize>(&self, simulation: &Simulation<'_, D>) -> Vec<FurtherResult> {
        let problem = simulation.problem;
        let outputs = problem.further_outputs.iter().zip(&self.files[1..]);
        let result = |(output, file): (&Output, &OutputFile)| FurtherResult {
            name: output.name.clone().unwrap_or_default(),
            outputs: file.file.steps(),
        };
        outputs.map(result).collect()
    }

    /// Return the causes of non-collective writes to any result, as bits defined by HDF5; 0 if all writes
    /// were collective.
    pub fn no_collective_cause(&self) -> u32 {
        let causes = self
            .files
            .iter()
            .map(|file| file.file.no_collective_cause());
        causes.fold(0, |all, cause| all | cause)
    }

    /// Find the points of outputs and history again after a rebalance or refinement. Collective.
    ///
    /// # Errors
    /// Same as for [`HistoryObserver::new`]. There is also an error if the set of an output is empty.
    pub fn update_points<const D: usize>(&mut self, simulation: &Simulation<'a, D>) -> Result<()> {
        self.order = simulation.id_order();
        for file in &mut self.files {
            file.update_points(simulation, &self.order)?;
        }
        self.observer.follow(simulation)
    }

    /// Test whether an output or row is due after a step.
    pub fn is_due(&self, clock: &Clock) -> bool {
        let mut outputs = self.files.iter();
        outputs.any(|file| file.schedule.is_due(clock)) || self.rows.is_due(clock)
    }

    /// Write the outputs that are due. If a history row is due, write the row and pass it to `observer`.
    /// Collective.
    ///
    /// # Errors
    /// If a write fails, for example because the disk is full.
    pub fn record<const D: usize>(
        &mut self,
        stepper: &mut Stepper<'_, D>,
        observer: &mut dyn Observer,
    ) -> Result<()> {
        let clock = *stepper.clock();
        let row = self.rows.is_due(&clock);
        let is_due = |file: &OutputFile| file.schedule.is_due(&clock);
        self.write(stepper.at_full_step(), is_due, row)?;
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

    /// Write outputs to all files, and a history row. Collective.
    ///
    /// # Errors
    /// If a write fails, for example because the disk is full.
    pub fn write_all<const D: usize>(&mut self, simulation: &mut Simulation<'_, D>) -> Result<()> {
        self.write(simulation, |_| true, true)
    }

    /// Write an output to each new file, and a history row if the main file is new. Collective.
    ///
    /// # Errors
    /// If a write fails, for example because the disk is full.
    pub fn write_first<const D: usize>(
        &mut self,
        simulation: &mut Simulation<'_, D>,
    ) -> Result<()> {
        let row = self.main().steps() == 0;
        self.write(simulation, |file| file.file.steps() == 0, row)
    }

    /// Write an output to each file for which `is_chosen` is true. If `row` is true, also write a history
    /// row. Collective.
    ///
    /// # Errors
    /// If a write fails, for example because the disk is full.
    fn write<const D: usize>(
        &mut self,
        simulation: &mut Simulation<'_, D>,
        is_chosen: impl Fn(&OutputFile) -> bool,
        row: bool,
    ) -> Result<()> {
        let is_main = is_chosen(&self.files[0]);
        let output = self.files.iter().any(&is_chosen);
        if !output && !row {
            return Ok(());
        }
        let start = Instant::now();
        let chosen = self.files.iter().filter(|file| is_chosen(file));
        let snapshot = if row {
            Snapshot::new(simulation)
        } else {
            Snapshot::for_fields(simulation, chosen.flat_map(OutputFile::fields).copied())
        };
        // If an output and a row share a snapshot, the time of the snapshot counts as output.
        let rows_start = if output { Instant::now() } else { start };
        if row {
            let row = self.observer.row(simulation, &snapshot);
            self.buffered.push(row.values.clone());
            self.last_row = Some(row);
        }
        if is_main || self.buffered.len() >= BUFFERED_ROWS {
            self.write_rows()?;
        }
        let row_time = rows_start.elapsed();
        self.spent_on_rows += row_time;
        for file in self.files.iter_mut().filter(|file| is_chosen(file)) {
            file.write(simulation, &snapshot, &self.order)?;
        }
        if is_main {
            let paths = self.observer.crack_paths(simulation, &snapshot);
            let mut tables = crack_files::of_paths(paths);
            let surfaces = self.observer.crack_surfaces(simulation, &snapshot);
            tables.extend(crack_files::of_surfaces(surfaces));
            crack_files::write(simulation.comm, &self.folder, &tables)?;
        }
        self.spent += start.elapsed() - row_time;
        Ok(())
    }

    /// Check the energies in the history row of the current step, and return warnings. If no row was due,
    /// nothing is checked. `is_last` says whether the step is the last of the run. The warnings are the same
    /// on all ranks.
    ///
    /// # Errors
    /// If an energy is not finite, or a time step is clearly unstable.
    pub fn check_energy<const D: usize>(
        &mut self,
        simulation: &Simulation<'_, D>,
        is_last: bool,
    ) -> Result<Vec<String>> {
        let clock = &simulation.clock;
        let is_now = |row: &&HistoryRow| row.number == clock.number();
        let Some(row) = self.last_row.as_ref().filter(is_now) else {
            return Ok(Vec::new());
        };
        check_finite(row, clock)?;
        if !is_closed(simulation.problem) {
            return Ok(Vec::new());
        }
        self.energy.check_row(row, simulation, is_last)
    }

    /// Return a warning if the energy balance does not close at the end of the run.
    pub fn check_energy_at_end(&self, problem: &Problem) -> Option<String> {
        let row = self.last_row.as_ref().filter(|_| is_closed(problem))?;
        self.energy.check_end(row, StepKinds::of(problem))
    }

    /// Write the state of a failed run to the files that have no output at this step, and fsync all files.
    /// Collective.
    ///
    /// # Errors
    /// If a write fails, for example because the disk is full.
    pub fn write_failure<const D: usize>(
        &mut self,
        simulation: &mut Simulation<'_, D>,
    ) -> Result<()> {
        let clock = simulation.clock;
        self.write(simulation, |file| !file.schedule.is_due(&clock), false)?;
        self.sync()
    }

    /// Close all result files. If `will_resume` is true, unused space in the files is not freed. Collective.
    ///
    /// # Errors
    /// If a file cannot be closed, or if an earlier write has failed, for example because the disk is full.
    pub fn close(self, will_resume: bool) -> Result<()> {
        let mut files = self.files.into_iter();
        files.try_for_each(|file| file.close(will_resume))
    }

    /// Write buffered rows and fsync the results. Collective.
    ///
    /// # Errors
    /// If a write fails, for example because the disk is full.
    pub fn sync(&mut self) -> Result<()> {
        self.write_rows()?;
        let mut files = self.files.iter_mut();
        files.try_for_each(|file| file.file.sync())
    }

    fn write_rows(&mut self) -> Result<()> {
        if !self.buffered.is_empty() {
            self.files[0].file.append_history(&self.buffered)?;
            self.buffered.clear();
        }
        Ok(())
    }
}

/// Whether the energy balance of a run is checked. The energy input from changing temperatures is not
/// counted, so the balance of runs with changing temperatures is not checked.
fn is_closed(problem: &Problem) -> bool {
    !problem.temperature_changes()
}

/// Clean up after a result file could not be opened. Close all open result files, and delete each of these
/// files that this run has created. Collective.
fn abandon(comm: &dyn Communicator, opened: Vec<OutputFile>, files: &Files, starts: &[Start]) {
    for ((file, path), start) in opened.into_iter().zip(files.results()).zip(starts) {
        // The caller reports why the other file could not be opened, so an error here is ignored.
        let _ = file.close(true);
        if matches!(start, Start::New(_)) && comm.rank() == 0 {
            // An error is ignored, because a result without outputs only takes space.
            let _ = std::fs::remove_file(path);
        }
    }
}

/// For each output, find out whether a restart can resume the result file. If not, return the reason for a
/// new file. The reason is `None` if neither the checkpoint nor the folder contains a result of this output.
/// Collective.
///
/// # Errors
/// If a set of the history is empty, a deck cannot be parsed, or a result is locked or unreadable.
pub fn reasons_for_new_results<const D: usize>(
    simulation: &Simulation<'_, D>,
    files: &Files,
    header: &Header,
    physics: &str,
) -> Result<Vec<Continuation>> {
    let mut found = Vec::new();
    for (output, path) in simulation.problem.outputs().zip(files.results()) {
        let reason = match &output.name {
            None => {
                let observer = HistoryObserver::new(simulation)?;
                let changed = history_differences(&header.deck, physics);
                let changed = agree(simulation.comm, changed)?;
                let history = Some((&observer, header.rows, changed));
                let counted = (output, path, header.outputs);
                reason_for_new_result(simulation, counted, physics, history)?
            }
            Some(name) => match header.further.iter().find(|result| result.name == *name) {
                Some(known) => {
                    let counted = (output, path, known.outputs);
                    reason_for_new_result(simulation, counted, physics, None)?
                }
                None => {
                    let there = || {
                        let text = "the checkpoint does not contain this output".to_owned();
                        Ok(is_taken(path).then_some(text))
                    };
                    let there = check_on_rank_0(simulation.comm, there)?;
                    found.push(Continuation::New(there));
                    continue;
                }
            },
        };
        found.push(match reason {
            None => Continuation::Resume,
            Some(reason) => Continuation::New(Some(reason)),
        });
    }
    Ok(found)
}

/// Continuation of a result file at a restart.
#[derive(Debug, Clone, PartialEq)]
pub enum Continuation {
    /// The existing file is resumed.
    Resume,
    /// A new file starts. The text is the reason for the new file; `None` if neither the checkpoint nor
    /// the folder contains a result of this output.
    New(Option<String>),
}

/// Return the reason why the result file of an output cannot be continued; `None` if the file can be
/// continued. Possible reasons are:
///
/// - the file is missing or damaged;
/// - the file belongs to a run with other physics;
/// - the file has fewer outputs or rows than the checkpoint counts;
/// - the deck requests other points, fields, precision or history columns;
/// - the deck defines a history column in another way;
/// - adaptive refinement was switched on or off.
///
/// `outputs` is the number of outputs that the checkpoint counts, `physics` the description of the physics, see
/// [`restart_compatibility::describe`]. For the main result, `history` contains the
/// observer, the number of rows that the checkpoint counts, and the changes of the column definitions.
/// Collective.
///
/// # Errors
/// If the result is locked or unreadable.
fn reason_for_new_result<const D: usize>(
    simulation: &Simulation<'_, D>,
    (output, path, outputs): (&Output, &Path, u64),
    physics: &str,
    history: Option<(&HistoryObserver, u64, Option<String>)>,
) -> Result<Option<String>> {
    let comm: &dyn Communicator = simulation.comm;
    let order = simulation.id_order();
    let rows = output_rows(simulation, output, &order)?;
    let owned = &simulation.model.ids[..simulation.model.owned()];
    let ids = select(&rows, order.collect(comm, owned, 1), 1);
    let own = ids.into_iter().map(mix).fold(0, u64::wrapping_add);
    let points = comm::total(comm, own);
    let compare = || -> Result<Option<String>> {
        if !is_taken(path) {
            return Ok(Some("the result file is missing".to_owned()));
        }
        // A link to a file system that is not mounted gives an error here, instead of counting as damaged.
        std::fs::metadata(path).map_err(|error| {
            let path = path.display();
            Error::run(format!("{path}: cannot read the result so far: {error}"))
        })?;
        let reader = ResultReader::open(path)?;
        let columns = reader.history()?;
        let rows = columns
            .first()
            .map_or(0, |column| column.values.len() as u64);
        let found_outputs = reader.steps()?.len() as u64;
        reader.times()?;
        if let Some(differences) = other_physics(&reader, physics)? {
            let text = format!("the result so far is of another run ({differences})");
            return Ok(Some(text));
        }
        let counted_rows = history.as_ref().map_or(0, |(_, rows, _)| *rows);
        if found_outputs < outputs || rows < counted_rows {
            let text = "the result so far has fewer outputs or rows than the checkpoint counts";
            return Ok(Some(text.to_owned()));
        }
        let fields = reader.fields()?;
        let moving = fields
            .iter()
            .filter(|field| field.dynamic && !FIXED.contains(&&field.name[..]));
        let found = moving.map(|field| (&field.name[..], field.number == Number::F32));
        let (found, found_single): (Vec<&str>, Vec<bool>) = found.unzip();
        let requested = output
            .fields
            .iter()
            .map(|field| (field.name(), output.is_single(*field)));
        let mut requested: Vec<(&str, bool)> = requested.collect();
        requested.sort_unstable();
        let (requested, requested_single): (Vec<&str>, Vec<bool>) = requested.into_iter().unzip();
        let changing = simulation.may_refine();
        if reader.is_changing() != changing {
            let text = "adaptive refinement was switched on or off";
            return Ok(Some(text.to_owned()));
        }
        let found_points = reader.ids(0)?.into_iter().map(mix);
        if !changing && found_points.fold(0, u64::wrapping_add) != points {
            return Ok(Some("the deck requests other points".to_owned()));
        } else if found != requested {
            return Ok(Some("the deck requests other fields".to_owned()));
        } else if found_single != requested_single {
            return Ok(Some("the deck requests another precision".to_owned()));
        }
        let Some((observer, _, changed)) = history else {
            return Ok(None);
        };
        let names = columns.iter().map(|column| &column.name);
        if !names.eq(observer.columns().iter().map(|(name, _)| name)) {
            return Ok(Some("the deck requests other history columns".to_owned()));
        }
        Ok(changed.map(|lines| format!("history columns have another definition: {lines}")))
    };
    check_on_rank_0(comm, compare)
}

/// Compare the physics of a result with the physics of this run. Return the differences; `None` if there are
/// none.
///
/// # Errors
/// If the attributes of the result cannot be read, or its deck cannot be parsed.
fn other_physics(reader: &ResultReader, physics: &str) -> Result<Option<String>> {
    let name = restart_compatibility::attribute(physics);
    let mut attributes = reader.attributes()?.into_iter();
    let stored = attributes.find(|(stored, _)| stored == name);
    let stored = stored.map_or(String::new(), |(_, text)| text);
    let differences = restart_compatibility::differences(&stored, physics)?;
    Ok(in_one_line(&differences))
}

/// Check that the first `outputs` outputs of a result file can be read. Return a description of the damage,
/// or `None` for an intact file. Collective.
///
/// # Errors
/// If the result is locked or unreadable.
pub fn damage(comm: &dyn Communicator, path: &Path, outputs: u64) -> Result<Option<String>> {
    check_on_rank_0(comm, || {
        ResultReader::open(path)?.check(outputs as usize)?;
        Ok(None)
    })
}

/// Run `check` on rank 0, and return its result on all ranks. If the result file is damaged, return a
/// description of the damage. If the file cannot be read, return an error. Collective.
fn check_on_rank_0(
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
