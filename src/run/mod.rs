//! A run: from a problem to a result, with history, checkpoints and restart. What `fissure run` does, for
//! Rust.
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
//! `examples/` holds whole programs: one that runs a deck under MPI, and one that has no deck but builds
//! its problem.

mod checkpoints;
mod crack_files;
mod decisions;
mod energy_watch;
mod files;
mod layout;
mod observer;
mod options;
mod recorder;
mod restart;
mod restart_compatibility;
mod signals;
mod summary;
mod warnings;
mod watch;

pub use files::Files;
pub use observer::{Message, Observer, Row, Unobserved, View};
pub use options::{Existing, Options};
pub use signals::Signals;
pub use summary::{Phases, Summary};
pub use watch::Reason;

use std::path::PathBuf;

use crate::comm::mpi::{self, World};
use crate::comm::{self, Communicator, agree};
use crate::deck::{Deck, Source};
use crate::error::{Error, Result};
use crate::output::{self, Creation};
use crate::problem::Problem;
use crate::solver::calibration::calibrated;
use crate::solver::observers::{ContactWatch, HistoryRow};
use crate::solver::repartition::BalanceWatch;
use crate::solver::{Simulation, Stepper};
use crate::survey::Survey;

use checkpoints::CheckpointWriter;
use decisions::decisions;
use energy_watch::EnergyWatch;
use recorder::{Recorder, Start, damage, why_not_continued};
use restart::{Restart, restart};
use watch::{Decision, Watch};

/// How a run ended, and what it did; the same on all ranks.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// Why it stopped before its end, if it did; a checkpoint has been written then.
    pub stopped: Option<Reason>,
    /// Number of steps made since the time 0.
    pub number: u64,
    /// Number of the last step.
    pub last: u64,
    /// Time reached, s.
    pub time: f64,
    /// The last row of the history, if this run has written any.
    pub last_row: Option<HistoryRow>,
    /// Where everything is.
    pub files: Files,
    /// Figures.
    pub summary: Summary,
    /// Why not all writes to the result were collective, in bits of HDF5; 0 if they were.
    pub no_collective_cause: u32,
}

/// Starts MPI for runs on all ranks that `mpirun` started; on one rank without it.
///
/// # Errors
/// When MPI was started before in this process or has no support for threads.
pub fn start_mpi() -> Result<World> {
    // HDF5 must be there before MPI.
    output::initialise();
    World::start()
}

/// Runs a problem to its end, or until it is stopped, and writes the result. Threads are those of Rayon's
/// global pool. Collective; without MPI there must be one rank.
///
/// # Errors
/// When the problem cannot be run, a signal has come before the first step, the folder holds what must not be replaced, the checkpoint to go on from
/// is none of this problem, the disc is full, or the motion of a point is not finite; the same on all ranks.
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

/// As [`run`]; errors name places in the deck by spans.
fn run_unlocated(
    problem: &Problem,
    comm: &dyn Communicator,
    options: &Options,
    observer: &mut dyn Observer,
) -> Result<Outcome> {
    let calibrated = calibrated(problem)?;
    let explained = options.deck.as_ref().map(Deck::explain).transpose();
    let explained = agree(comm, explained)?;
    let files = Files::new(options.folder.clone());
    // Taken before anything is looked at, and kept until the end.
    let prepared = match comm.rank() {
        0 => files.lock().and_then(|lock| {
            if options.existing != Existing::Continue {
                files.prepare(options.existing == Existing::Replace)?;
            }
            Ok(Some(lock))
        }),
        _ => Ok(None),
    };
    let _lock = agree(comm, prepared)?;
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

/// Why the time loop was left.
enum Left {
    Complete,
    Stopped(Reason),
    /// The motion of a point is not finite, or the energy grows without bound.
    Failed(Error),
}

/// Everything that a run needs beside the points.
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
        self.look_before_the_first_step()?;
        let mut look = || self.look_before_the_first_step();
        let mut simulation = Simulation::<D>::set_up(self.problem, self.comm, &mut look)?;
        simulation.check()?;
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
        let decided = decisions(&simulation);
        self.observer.message(&Message::Decided(decided));
        self.look_before_the_first_step()?;
        let mut stepper = Stepper::new(simulation);
        let (mut checkpoints, mut recorder) = match self.options.existing {
            Existing::Continue => self.continue_run(stepper.at_full_step())?,
            Existing::Refuse | Existing::Replace => self.begin_run(&mut stepper)?,
        };
        let first = stepper.clock().number();
        self.observer.begin(&mut stepper);
        let left = self.make_steps(&mut stepper, &mut checkpoints, &mut recorder)?;
        self.observer.end(matches!(left, Left::Complete));
        let no_collective_cause = recorder.file.no_collective_cause();
        let last_row = recorder.last_row.take();
        let spent = (recorder.spent, recorder.spent_on_rows);
        recorder.close(matches!(left, Left::Stopped(_)))?;
        let stopped = match left {
            Left::Complete => None,
            Left::Stopped(reason) => Some(reason),
            Left::Failed(error) => return Err(error),
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

    /// Whether a signal has come that stops the run while nothing is computed yet. Collective.
    ///
    /// # Errors
    /// It has.
    fn look_before_the_first_step(&self) -> Result<()> {
        let stop = self.options.signals.as_ref().is_some_and(Signals::stop);
        if comm::total(self.comm, u64::from(stop)) == 0 {
            return Ok(());
        }
        let then = match self.options.existing {
            Existing::Continue => "the checkpoint is as it was, --restart continues",
            Existing::Refuse | Existing::Replace => "nothing is computed yet, start it again",
        };
        Err(Error::stopped(format!(
            "stopped by a signal before the first step; {then}"
        )))
    }

    /// The time loop.
    fn make_steps<const D: usize>(
        &mut self,
        stepper: &mut Stepper<'a, D>,
        checkpoints: &mut CheckpointWriter,
        recorder: &mut Recorder<'a>,
    ) -> Result<Left> {
        let signals = self.options.signals.clone();
        let started = self.options.started;
        let limit = self.options.wall_time.map(|limit| (started, limit));
        let mut watch = Watch::new(signals.as_ref(), self.problem.checkpoint, limit);
        let simulation = stepper.at_full_step();
        let mut contact = Some(ContactWatch::new(simulation));
        let mut balance = BalanceWatch::new(simulation);
        let mut slow = true;
        let mut stable = simulation.scaled_stable_step();
        let mut energy = (!self.problem.relaxes()).then(|| EnergyWatch::new(simulation));
        while !stepper.is_over() {
            if stepper.is_refinement_due()
                && let Some(regridded) = stepper.at_full_step().refine()?
            {
                let simulation = stepper.at_full_step();
                recorder.follow(simulation)?;
                stable = stable.min(self.warn_of_step(simulation, stable));
                self.observer.message(&Message::Refined {
                    number: simulation.clock.number(),
                    regridded,
                    points: simulation.model.total,
                });
            }
            stepper.advance();
            let clock = *stepper.clock();
            let complete = stepper.is_over();
            let step = stepper.load_step().is_settled.then_some(&clock);
            let due = step.is_some_and(|clock| recorder.is_due(clock));
            let shows = due || complete || stepper.load_step().has_failed;
            let looks = watch.end_turn(step) || shows;
            let decision = if looks {
                watch.look(self.comm, step)
            } else {
                Decision::default()
            };
            let saves = complete || decision.checkpoint || decision.stop.is_some();
            if shows || saves {
                // What the second half kick finds is checked, too.
                stepper.at_full_step();
            }
            if looks {
                if let Err(error) = stepper.check() {
                    // The reader of the result should see where it went wrong.
                    recorder.write(stepper.at_full_step(), true, true)?;
                    return Ok(Left::Failed(error));
                }
                if due {
                    let simulation = stepper.at_full_step();
                    if let Some(found) = contact.as_ref().and_then(|watch| watch.look(simulation)) {
                        self.warn_of_contact(&found, clock.time());
                        contact = None;
                    }
                    recorder.record(stepper, self.observer)?;
                    slow = slow && !self.warn_of_inertia(stepper, recorder);
                }
                if let (Some(energy), Some(row)) = (&mut energy, recorder.row_of(&clock)) {
                    let growth = energy.look(row, &clock);
                    let of_breaking = energy.look_at_breaking(row, &clock);
                    match growth {
                        Ok(text) => {
                            for text in text.into_iter().chain(of_breaking) {
                                self.observer.message(&Message::Warning(text));
                            }
                        }
                        Err(error) => {
                            recorder.write_failure(stepper.at_full_step())?;
                            return Ok(Left::Failed(error));
                        }
                    }
                }
                if saves {
                    let cost = checkpoints.write(stepper.at_full_step(), recorder)?;
                    watch.wrote_checkpoint(cost);
                }
            }
            self.observer.step(stepper);
            if let (Some(reason), false) = (decision.stop, complete) {
                return Ok(Left::Stopped(reason));
            }
            if !complete && let Some(done) = balance.look(stepper)? {
                recorder.follow(stepper.at_full_step())?;
                self.observer.message(&Message::Repartitioned {
                    number: clock.number(),
                    what: done,
                });
            }
        }
        self.warn_of_overshoot(recorder);
        Ok(Left::Complete)
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
        let mut recorder = Recorder::new(simulation, &self.files, Start::New(creation), &metadata)?;
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
        self.tell_kept_step(simulation)?;
        let metadata = self.metadata(simulation);
        let why = why_not_continued(simulation, &self.files, &header, &self.physics)?;
        let why = match why {
            Some(why) => why,
            None => {
                let start = Start::After(header.outputs, header.rows);
                match Recorder::new(simulation, &self.files, start, &metadata) {
                    Ok(mut recorder) => {
                        recorder.observer.continue_from(header.start);
                        return Ok((checkpoints, recorder));
                    }
                    // The checkpoint is intact: a damaged result must not keep the run from going on. Other
                    // failures, such as a full disc, leave the result in its place.
                    Err(error) => match damage(self.comm, &self.files, header.outputs)? {
                        Some(why) => why,
                        None => return Err(error),
                    },
                }
            }
        };
        let kept = match self.comm.rank() {
            0 => self.files.set_aside(simulation.clock.number()),
            _ => Ok(Vec::new()),
        };
        let kept: Vec<String> = agree(self.comm, kept)?
            .iter()
            .map(|path| path.to_string_lossy().into_owned())
            .collect();
        let kept = self.text_of_rank_0(&kept.join("\n"));
        let kept = kept.lines().map(PathBuf::from).collect();
        self.observer.message(&Message::SetAside { why, kept });
        let start = Start::New(Creation::Exclusive);
        let mut recorder = Recorder::new(simulation, &self.files, start, &metadata)?;
        recorder.observer.continue_from(header.start);
        recorder.write(simulation, true, true)?;
        // The checkpoint counts the outputs of the file that was set aside.
        checkpoints.write(simulation, &mut recorder)?;
        Ok((checkpoints, recorder))
    }

    /// Rank 0's text on all ranks.
    fn text_of_rank_0(&self, text: &str) -> String {
        let mut bytes = text.as_bytes().to_vec();
        self.comm.broadcast(0, &mut bytes);
        String::from_utf8_lossy(&bytes).into_owned()
    }

    /// Attributes of the result: how it was made.
    fn metadata<const D: usize>(
        &self,
        simulation: &Simulation<'_, D>,
    ) -> Vec<(&'static str, String)> {
        // All ranks must write the same; what differs between them is told by rank 0.
        let [text, in_full, path] = match self.options.deck.as_ref().map(Deck::source) {
            Some(Source { path, text }) => [
                text.clone(),
                self.physics.clone(),
                path.display().to_string(),
            ],
            None => Default::default(),
        };
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
            ("time_step", simulation.clock.step().to_string()),
        ];
        let more = self.options.attributes.iter();
        metadata.extend(more.map(|(name, text)| (*name, self.text_of_rank_0(text))));
        metadata
    }
}
