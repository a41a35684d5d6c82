//! The library form of `fissure run`: runs of a problem, with result, history, checkpoints and restart.
//!
//! ```no_run
//! use std::path::Path;
//!
//! use fissure::comm::threads;
//! use fissure::run::{Options, Unobserved};
//!
//! # fn main() -> fissure::error::Result<()> {
//! let deck = fissure::deck::read(Path::new("plate.toml"), &[])?;
//! let mut options = Options::new("out/plate");
//! let problem = deck.problem()?;
//! options.deck = Some(deck);
//! fissure::run(&problem, &threads::alone(), options, &mut Unobserved)?;
//! # Ok(())
//! # }
//! ```
//!
//! `examples/` contains complete programs: one runs a deck under MPI, another builds its problem in Rust.

mod checkpoints;
mod crack_files;
mod decisions;
mod energy_watch;
mod files;
mod layout;
mod observer;
mod options;
mod output_file;
mod recorder;
mod restart;
mod restart_compatibility;
mod shared_folder;
mod signals;
mod stale_files;
mod summary;
mod warnings;
mod watch;

pub use files::Files;
pub use observer::{Message, Observer, Row, RunState, StateEnergies, Unobserved};
pub use options::{Existing, Options};
pub use signals::Signals;
pub use summary::{Phases, Summary};
pub use watch::Reason;

use std::path::PathBuf;

use crate::comm::mpi::{self, World};
use crate::comm::sum::{ExactSum, reduce};
use crate::comm::{self, Communicator, agree, check_equal};
use crate::deck::{Deck, Source};
use crate::error::{Error, Result};
use crate::message::RESTART;
use crate::output::{self, Creation};
use crate::problem::Problem;
use crate::solver::calibration::calibrated;
use crate::solver::conditions::output_members;
use crate::solver::observers::{HistoryRow, InterpenetrationWatch};
use crate::solver::repartition::BalanceWatch;
use crate::solver::{Simulation, Stepper};
use crate::survey::Survey;

use checkpoints::CheckpointWriter;
use decisions::decisions;
use output_file::Start;
use recorder::{Continuation, Recorder, damage, reasons_for_new_results};
use restart::{Restart, restart};
use warnings::MAX_DEPTH;
use watch::{Decision, OwnRequests, Watch};

/// The outcome of a run; equal on all ranks.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// Reason of a stop before the end; `None` if the run is complete. A checkpoint was written at the stop.
    pub stopped: Option<Reason>,
    /// Number of the step reached.
    pub number: u64,
    /// Expected number of the last step of the whole run. The present time step is assumed to stay the same
    /// until the end of the stage.
    pub last: u64,
    /// Time reached, s.
    pub time: f64,
    /// The last row of the history; `None` if this run has not written any.
    pub last_row: Option<HistoryRow>,
    /// The output files.
    pub files: Files,
    /// Size and times of the run, for the summary.
    pub summary: Summary,
    /// Causes of non-collective writes to the results, as bits defined by HDF5; 0 if all writes were
    /// collective.
    pub no_collective_cause: u32,
}

/// Initialise HDF5 and MPI: for all ranks that `mpirun` started, or for one rank without `mpirun`.
///
/// # Errors
/// If MPI is already running in this process or lacks support for threads.
pub fn start_mpi() -> Result<World> {
    // HDF5 must be initialised before MPI.
    output::initialise();
    World::start()
}

/// Run a problem to its end or to a stop, and write the result. Collective.
///
/// The loops use the threads of Rayon's global pool. A communicator without MPI must have one rank.
///
/// # Errors
/// The error is the same on all ranks. There is an error if:
///
/// - a value of the problem is not allowed ([`Problem::check`]), or the problem cannot be run;
/// - the problem differs from the deck in `options`, except in settings that a restart may change;
/// - the ranks have different problems, decks or folders, or handle existing files differently;
/// - a rank does not see the folder that rank 0 has created;
/// - a signal stopped the run before the first step;
/// - the folder contains files that must not be replaced;
/// - the checkpoint is missing or belongs to another problem;
/// - a file cannot be read or written;
/// - the motion of a point or rigid body is not finite;
/// - a load step has no equilibrium;
/// - the energy grows without limit;
/// - an observer makes an invalid request.
pub fn run(
    problem: &Problem,
    comm: &dyn Communicator,
    options: Options,
    observer: &mut dyn Observer,
) -> Result<Outcome> {
    let outcome = run_unlocated(problem, comm, &options, observer);
    outcome.map_err(|error| match &options.deck {
        Some(deck) => deck.locate(error),
        None => error,
    })
}

/// Same as [`run`], but errors refer to the deck by spans instead of file and line.
fn run_unlocated(
    problem: &Problem,
    comm: &dyn Communicator,
    options: &Options,
    observer: &mut dyn Observer,
) -> Result<Outcome> {
    let calibrated = agree(comm, calibrated(problem))?;
    let explained = options.deck.as_ref().map(Deck::explain).transpose();
    let explained = agree(comm, explained)?;
    check_inputs(problem, comm, options, explained.as_deref())?;
    if let Some(deck) = &options.deck {
        is_of_deck(problem, &deck.problem_on(comm)?)?;
    }
    let files = Files::new(problem, options.folder.clone());
    // The folder is locked before any file changes, and until the end of the run.
    let prepared = match comm.rank() {
        0 => files.lock().and_then(|lock| {
            if options.existing != Existing::Continue {
                files.prepare(options.existing == Existing::Replace)?;
            }
            Ok(Some(lock))
        }),
        _ => Ok(None),
    };
    let lock = agree(comm, prepared)?;
    shared_folder::check(comm, &files, lock.as_ref(), shared_folder::TIMEOUT)?;
    let mut job = Job {
        problem: &calibrated,
        comm,
        files,
        physics: restart_compatibility::describe(problem, explained.as_deref()),
        options,
        observer,
    };
    match problem.dimension.count() {
        1 => job.run::<1>(),
        2 => job.run::<2>(),
        _ => job.run::<3>(),
    }
}

/// Check that all ranks have the same inputs. `explained` is the deck with all defaults. Collective.
///
/// # Errors
/// If an input of a rank differs from that of rank 0.
fn check_inputs(
    problem: &Problem,
    comm: &dyn Communicator,
    options: &Options,
    explained: Option<&str>,
) -> Result<()> {
    let deck = options.deck.as_ref().map(|deck| &deck.source().text);
    check_equal(
        comm,
        &(problem, deck, explained),
        "problem",
        "all ranks must run the same deck and read equal files, such as tables and ids of points",
    )?;
    check_equal(
        comm,
        &options.folder,
        "output folder",
        "all ranks must write to the same folder (--output)",
    )?;
    check_equal(
        comm,
        &options.existing,
        "handling of existing files",
        "--restart or --overwrite must be given to all ranks or to none",
    )
}

/// Check that a deck describes the problem that is run. The deck is stored for a restart in place of the
/// problem.
///
/// # Errors
/// If the problem differs from the problem of the deck in a setting that a restart must not change.
fn is_of_deck(problem: &Problem, of_deck: &Problem) -> Result<()> {
    match restart_compatibility::difference_from_deck(problem, of_deck) {
        None => Ok(()),
        Some(line) => Err(Error::input(format!(
            "the problem differs from the deck in `Options::deck`, so a restart would not notice the change: {line}; change \
             the deck, or set `Options::deck` to `None`"
        ))),
    }
}

/// Outcome of the time loop.
enum LoopEnd {
    Complete,
    Stopped(Reason),
    /// The motion is not finite, a load step has no equilibrium, the energy grows without limit, or an
    /// observer has made an invalid request.
    Failed(Error),
}

/// The inputs of a run.
struct Job<'a> {
    problem: &'a Problem,
    comm: &'a dyn Communicator,
    files: Files,
    physics: String,
    options: &'a Options,
    observer: &'a mut dyn Observer,
}

impl<'a> Job<'a> {
    fn run<const D: usize>(&mut self) -> Result<Outcome> {
        self.observer.message(&Message::Started);
        self.check_signals()?;
        let mut interrupt = || self.check_signals();
        let mut simulation = Simulation::<D>::set_up(self.problem, self.comm, &mut interrupt)?;
        simulation.check()?;
        // Check the sets of all outputs before any file is created or replaced.
        for output in self.problem.outputs() {
            output_members(self.problem, output, self.comm, &simulation.model)?;
        }
        let mut survey = Survey::new(&mut simulation);
        if let Some(deck) = &self.options.deck {
            let warnings = survey.warnings.into_iter();
            survey.warnings = warnings
                .map(|warning| deck.locate_warning(warning))
                .collect();
        }
        self.observer.message(&Message::SetUp {
            step: simulation.clock.step(),
            stable_step: simulation.scaled_stable_step(),
            survey,
        });
        let decisions = decisions(&mut simulation);
        self.observer.message(&Message::Decided(decisions));
        self.check_signals()?;
        let mut stepper = Stepper::new(simulation);
        let removed = match self.comm.rank() {
            0 => self.files.remove_temporary(),
            _ => Ok(()),
        };
        agree(self.comm, removed)?;
        let (mut checkpoints, mut recorder) = match self.options.existing {
            Existing::Continue => self.continue_run(stepper.at_full_step())?,
            Existing::Refuse | Existing::Replace => self.begin_run(&mut stepper)?,
        };
        let first = stepper.clock().number();
        self.observer.begin(&mut stepper);
        let end = self.make_steps(&mut stepper, &mut checkpoints, &mut recorder)?;
        self.observer.end(matches!(end, LoopEnd::Complete));
        let no_collective_cause = recorder.no_collective_cause();
        let last_row = recorder.last_row.take();
        let spent = (recorder.spent, recorder.spent_on_rows);
        recorder.close(matches!(end, LoopEnd::Stopped(_)))?;
        let stopped = match end {
            LoopEnd::Complete => None,
            LoopEnd::Stopped(reason) => Some(reason),
            LoopEnd::Failed(error) => return Err(error),
        };
        let whole = self.options.started.elapsed();
        let spent = [spent.0, spent.1, checkpoints.spent, whole];
        let simulation = stepper.at_full_step();
        let steps = simulation.clock.number() - first;
        Ok(Outcome {
            stopped,
            number: simulation.clock.number(),
            last: simulation.last_step(),
            time: simulation.clock.time(),
            last_row,
            files: self.files.clone(),
            summary: Summary::new(simulation, steps, checkpoints.written, spent),
            no_collective_cause,
        })
    }

    /// Check for stop signals received during the set-up. Collective.
    ///
    /// # Errors
    /// If any rank received a stop signal.
    fn check_signals(&self) -> Result<()> {
        let stop = self.options.signals.as_ref().is_some_and(Signals::stop);
        if comm::total(self.comm, u64::from(stop)) == 0 {
            return Ok(());
        }
        let then = match self.options.existing {
            Existing::Continue => format!("the checkpoint is as it was, {RESTART} continues"),
            Existing::Refuse | Existing::Replace => {
                "nothing is computed yet, start it again".to_owned()
            }
        };
        Err(Error::stopped(format!(
            "stopped by a signal before the first step; {then}"
        )))
    }

    /// Run the time loop.
    fn make_steps<const D: usize>(
        &mut self,
        stepper: &mut Stepper<'a, D>,
        checkpoints: &mut CheckpointWriter,
        recorder: &mut Recorder<'a>,
    ) -> Result<LoopEnd> {
        let signals = self.options.signals.clone();
        let started = self.options.started;
        let limit = self.options.wall_time.map(|limit| (started, limit));
        let mut watch = Watch::new(signals.as_ref(), self.problem.checkpoint, limit);
        let simulation = stepper.at_full_step();
        let without_contact = self.problem.contact.is_none();
        let mut interpenetration = without_contact.then(|| InterpenetrationWatch::new(simulation));
        let (mut warned_of_contact, mut warned_of_depth) = (false, false);
        let mut balance = BalanceWatch::new(simulation);
        let mut slow = true;
        let mut stable = simulation.scaled_stable_step();
        while !stepper.is_over() {
            if stepper.is_refinement_due()
                && let Some(regridded) = stepper.at_full_step().refine()?
            {
                let simulation = stepper.at_full_step();
                recorder.update_points(simulation)?;
                stable = stable.min(self.warn_of_step(simulation, stable));
                self.observer.message(&Message::Refined {
                    number: simulation.clock.number(),
                    regridded,
                    points: simulation.model.total,
                });
            }
            if !warned_of_contact
                && let Some(step) = stepper.step_for_contact()
                && step < stepper.clock().step()
            {
                self.warn_of_stiff_contact(stepper.clock(), step);
                warned_of_contact = true;
            }
            stepper.advance();
            if !warned_of_depth && stepper.deepest_contact() > MAX_DEPTH {
                self.warn_of_deep_contact(stepper.clock());
                warned_of_depth = true;
            }
            let clock = *stepper.clock();
            let complete = stepper.is_over();
            let step = stepper.load_step().is_settled.then_some(&clock);
            let due = step.is_some_and(|clock| recorder.is_due(clock));
            let is_checked = due || complete || stepper.load_step().has_failed;
            let is_agreed = watch.end_iteration(step) || is_checked;
            let mut decision = if is_agreed {
                watch.decide(self.comm, step, OwnRequests::of(stepper))
            } else {
                Decision::default()
            };
            if decision.has_wrong_request {
                return Ok(LoopEnd::Failed(self.wrong_request(stepper)));
            }
            let mut saves = complete || decision.checkpoint || decision.stop.is_some();
            if is_checked || saves {
                // The check and the outputs use the velocities at the end of the step, after the second half
                // kick.
                stepper.at_full_step();
            }
            if is_agreed {
                if let Err(error) = stepper.check() {
                    // Write the failed state to the results, for analysis.
                    recorder.write_all(stepper.at_full_step())?;
                    return Ok(LoopEnd::Failed(error));
                }
                if due {
                    let simulation = stepper.at_full_step();
                    if let Some(found) = interpenetration
                        .as_ref()
                        .and_then(|watch| watch.find(simulation))
                    {
                        self.warn_of_interpenetration(&found, clock.time());
                        interpenetration = None;
                    }
                    recorder.record(stepper, self.observer)?;
                    // The observer may have made requests during the output of the row. If the requests of
                    // the ranks differ, the checkpoint below must not be written.
                    let requests = OwnRequests::of(stepper).agree(self.comm);
                    if requests.are_wrong {
                        return Ok(LoopEnd::Failed(self.wrong_request(stepper)));
                    }
                    if decision.stop.is_none() && requests.stop {
                        decision.stop = Some(Reason::Observer);
                        saves = true;
                    }
                    slow = slow && !self.warn_of_inertia(stepper, recorder);
                }
                if due {
                    let simulation = stepper.at_full_step();
                    match recorder.check_energy(simulation, complete) {
                        Ok(texts) => {
                            for text in texts {
                                self.observer.message(&Message::Warning(text));
                            }
                        }
                        Err(error) => {
                            recorder.write_failure(simulation)?;
                            return Ok(LoopEnd::Failed(error));
                        }
                    }
                }
                if saves {
                    let cost = checkpoints.write(stepper.at_full_step(), recorder)?;
                    watch.record_checkpoint(cost);
                }
            }
            self.observer.step(stepper);
            if let (Some(reason), false) = (decision.stop, complete) {
                return Ok(LoopEnd::Stopped(reason));
            }
            if !complete && let Some(repartition) = balance.rebalance_if_due(stepper)? {
                recorder.update_points(stepper.at_full_step())?;
                self.observer.message(&Message::Repartitioned {
                    number: clock.number(),
                    repartition,
                });
            }
        }
        self.warn_of_overshoot(recorder);
        if let Some(text) = recorder.check_energy_at_end(self.problem) {
            self.observer.message(&Message::Warning(text));
        }
        Ok(LoopEnd::Complete)
    }

    /// Return the error that an invalid request of an observer causes. The error is the same on all ranks.
    /// Collective.
    fn wrong_request<const D: usize>(&self, stepper: &Stepper<'a, D>) -> Error {
        let own = stepper.wrong_request().cloned().map_or(Ok(()), Err);
        match agree(self.comm, own) {
            Err(error) => error,
            Ok(()) => Error::run("the observers of the ranks have set different load factors"),
        }
    }

    fn begin_run<const D: usize>(
        &mut self,
        stepper: &mut Stepper<'a, D>,
    ) -> Result<(CheckpointWriter, Recorder<'a>)> {
        let simulation = stepper.at_full_step();
        let creation = match self.options.existing {
            Existing::Replace => Creation::Truncate,
            Existing::Refuse | Existing::Continue => Creation::Exclusive,
        };
        let checkpoints = CheckpointWriter::new(simulation, &self.files, self.physics.clone())?;
        let metadata = self.metadata(simulation);
        let stale = match creation {
            Creation::Truncate => self.stale_files()?,
            Creation::Exclusive => Vec::new(),
        };
        let starts = vec![Start::New(creation); self.files.results().count()];
        let opened = Recorder::new(simulation, &self.files, (&starts, 0), &metadata);
        if opened.is_err() && creation == Creation::Truncate && self.comm.rank() == 0 {
            // Best effort: the returned error is the cause.
            let _ = self.files.remove_remains(&stale);
        }
        let mut recorder = opened?;
        self.remove_stale_files(stale)?;
        recorder.record(stepper, self.observer)?;
        Ok((checkpoints, recorder))
    }

    fn continue_run<const D: usize>(
        &mut self,
        simulation: &mut Simulation<'a, D>,
    ) -> Result<(CheckpointWriter, Recorder<'a>)> {
        let Restart {
            mut checkpoints,
            header,
        } = restart(simulation, &self.files, self.physics.clone(), self.observer)?;
        self.observer.message(&Message::Continued {
            number: simulation.clock.number(),
            time: simulation.clock.time(),
            complete: simulation.is_over(),
        });
        self.warn_of_resumed_step(simulation)?;
        let metadata = self.metadata(simulation);
        let mut continued =
            reasons_for_new_results(simulation, &self.files, &header, &self.physics)?;
        let counted = |number: usize| match number.checked_sub(1) {
            None => header.outputs,
            Some(number) => {
                let name = self.problem.further_outputs[number].name.as_ref();
                let mut known = header.further.iter();
                let known = known.find(|result| Some(&result.name) == name);
                known.map_or(0, |result| result.outputs)
            }
        };
        let mut recorder = loop {
            let start = |(number, continuation): (usize, &Continuation)| match continuation {
                Continuation::Resume => Start::After(counted(number)),
                Continuation::New(_) => Start::New(Creation::Exclusive),
            };
            let starts: Vec<Start> = continued.iter().enumerate().map(start).collect();
            self.set_aside(simulation, &mut continued)?;
            let opened = Recorder::new(simulation, &self.files, (&starts, header.rows), &metadata);
            let error = match opened {
                Ok(recorder) => break recorder,
                Err(error) => error,
            };
            // If a result is damaged, a new result replaces the damaged result, because the checkpoint is
            // intact. After another error, such as a full disk, the results are not replaced.
            let mut is_damaged = false;
            for (number, path) in self.files.results().enumerate() {
                if matches!(continued[number], Continuation::Resume)
                    && let Some(reason) = damage(self.comm, path, counted(number))?
                {
                    continued[number] = Continuation::New(Some(reason));
                    is_damaged = true;
                }
            }
            if !is_damaged {
                return Err(error);
            }
        };
        recorder.observer.continue_from(header.start);
        recorder.energy.continue_from(header.energy_watch);
        if continued
            .iter()
            .any(|continuation| *continuation != Continuation::Resume)
        {
            recorder.write_first(simulation)?;
            // The previous checkpoint counts the outputs of the renamed files, so it cannot be used any more.
            checkpoints.write(simulation, &mut recorder)?;
        }
        Ok((checkpoints, recorder))
    }

    /// Rename the existing files that cannot be continued, so that new files can be created. Report why these
    /// files cannot be continued. Collective.
    fn set_aside<const D: usize>(
        &mut self,
        simulation: &Simulation<'a, D>,
        continued: &mut [Continuation],
    ) -> Result<()> {
        for (number, continuation) in continued.iter_mut().enumerate() {
            let Continuation::New(reason) = continuation else {
                continue;
            };
            let Some(reason) = reason.take() else {
                continue;
            };
            let (files, reason) = match number.checked_sub(1) {
                None => (vec![&*self.files.result, &*self.files.history], reason),
                Some(number) => {
                    let section = self.problem.further_outputs[number].section();
                    (
                        vec![&*self.files.further[number]],
                        format!("{section}: {reason}"),
                    )
                }
            };
            let renamed = match self.comm.rank() {
                0 => Files::set_aside(&files, simulation.clock.number()),
                _ => Ok(Vec::new()),
            };
            let renamed = self.paths_of_rank_0(&agree(self.comm, renamed)?);
            self.observer
                .message(&Message::SetAside { reason, renamed });
        }
        Ok(())
    }

    /// Find the files that an earlier run has written and that this run does not replace. Collective.
    fn stale_files(&self) -> Result<Vec<PathBuf>> {
        let found = match self.comm.rank() {
            0 => stale_files::find(self.problem, &self.files),
            _ => Ok(Vec::new()),
        };
        Ok(self.paths_of_rank_0(&agree(self.comm, found)?))
    }

    /// Remove the files at `paths`, which an earlier run has written, and report the paths. Collective.
    fn remove_stale_files(&mut self, paths: Vec<PathBuf>) -> Result<()> {
        let removed = match self.comm.rank() {
            0 => paths.iter().try_for_each(|path| files::remove(path)),
            _ => Ok(()),
        };
        agree(self.comm, removed)?;
        if !paths.is_empty() {
            self.observer.message(&Message::Removed(paths));
        }
        Ok(())
    }

    /// Broadcast the paths of rank 0.
    fn paths_of_rank_0(&self, paths: &[PathBuf]) -> Vec<PathBuf> {
        let paths: Vec<String> = paths
            .iter()
            .map(|path| path.to_string_lossy().into_owned())
            .collect();
        let text = self.text_of_rank_0(&paths.join("\n"));
        text.lines().map(PathBuf::from).collect()
    }

    /// Broadcast the text of rank 0.
    fn text_of_rank_0(&self, text: &str) -> String {
        let mut bytes = text.as_bytes().to_vec();
        self.comm.broadcast(0, &mut bytes);
        String::from_utf8_lossy(&bytes).into_owned()
    }

    /// Return the attributes of the result that describe its origin: deck, version and settings of the run.
    fn metadata<const D: usize>(
        &self,
        simulation: &Simulation<'_, D>,
    ) -> Vec<(&'static str, String)> {
        // Attributes are written collectively, so values that can differ between ranks come from rank 0.
        let [text, in_full, path] = match self.options.deck.as_ref().map(Deck::source) {
            Some(Source { path, text, .. }) => [
                text.clone(),
                self.physics.clone(),
                path.display().to_string(),
            ],
            None => Default::default(),
        };
        let path = self.text_of_rank_0(&path);
        let model = &simulation.model;
        let mut mass = [ExactSum::ZERO];
        for point in 0..model.owned() {
            mass[0].add(model.density_of(point) * model.volume[point]);
        }
        let mass = reduce(self.comm, &mut mass)[0];
        let mut metadata = vec![
            ("title", self.problem.title.clone()),
            ("deck", text),
            ("deck_in_full", in_full),
            ("deck_path", path),
            ("version", crate::version()),
            ("mpi", self.text_of_rank_0(&mpi::library())),
            ("hdf5", output::library()),
            ("ranks", self.comm.size().to_string()),
            (
                "threads",
                self.text_of_rank_0(&rayon::current_num_threads().to_string()),
            ),
            ("dimension", D.to_string()),
            (
                "out_of_plane_measure",
                self.problem.dimension.out_of_plane_measure().to_string(),
            ),
            ("mass", mass.to_string()),
            ("time_step", simulation.clock.step().to_string()),
        ];
        if self.options.deck.is_none() {
            metadata.push(("problem", self.physics.clone()));
        }
        let more = self.options.attributes.iter();
        metadata.extend(more.map(|(name, text)| (*name, self.text_of_rank_0(text))));
        metadata
    }
}
