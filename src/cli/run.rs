//! `fissure run`: run a deck and write a result.

use crate::cli::{errln, outln};
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

use fissure::comm::mpi::World;
use fissure::comm::{Communicator, agree};
use fissure::deck;
use fissure::error::{Error, Result};
use fissure::message::{FOLDER, REPLACE, RESTART};
use fissure::run::{Existing, Message, Observer, Options, Outcome, Reason, RunState, Signals};
use fissure::solver::refinement::Regridded;
use fissure::solver::repartition::Repartition;

use super::format::{count, si};
use super::progress::Progress;
use super::{RunArguments, Verbosity, launch, summary};

/// Exit code of a stopped run that can be restarted: EX_TEMPFAIL of sysexits.h.
const STOPPED: u8 = 75;

/// Start MPI, run a deck on all ranks and finalise MPI.
pub fn run(arguments: &RunArguments, verbosity: Verbosity) -> ExitCode {
    let started = Instant::now();
    // MPI takes a while to start, so install the signal handlers first. Without handlers, a signal would end
    // the process.
    let signals = Signals::listen();
    launch::on_all_ranks(|world| {
        let signals = agree(world, signals)?;
        let outcome = run_deck(world, arguments, verbosity, (started, signals))?;
        Ok(match outcome.stopped {
            Some(_) => ExitCode::from(STOPPED),
            None => ExitCode::SUCCESS,
        })
    })
}

fn run_deck(
    world: &World,
    arguments: &RunArguments,
    verbosity: Verbosity,
    (started, signals): (Instant, Signals),
) -> Result<Outcome> {
    let deck = agree(
        world,
        deck::read_with(&arguments.deck, &arguments.with, &arguments.set),
    )?;
    let problem = deck.problem_on(world)?;
    let threads = agree(world, launch::start_threads(arguments.threads))?;
    let prints = world.rank() == 0 && verbosity > Verbosity::Quiet;
    if prints {
        launch::warn(threads);
    }
    let stem = arguments.deck.file_stem().unwrap_or_default();
    let folder = arguments.output.clone();
    let hosts = world.hosts();
    // The command line may contain any bytes, but attributes of the result must be UTF-8.
    let words = std::env::args_os().map(|word| word.to_string_lossy().into_owned());
    let command_line: Vec<String> = words.collect();
    let options = Options {
        existing: match (arguments.overwrite, arguments.restart) {
            (true, _) => Existing::Replace,
            (_, true) => Existing::Continue,
            _ => Existing::Refuse,
        },
        wall_time: arguments.wall_time,
        started,
        signals: Some(signals),
        deck: Some(deck),
        attributes: vec![
            ("command_line", command_line.join(" ")),
            ("hosts", hosts.to_string()),
        ],
        ..Options::new(folder.unwrap_or_else(|| Path::new("out").join(stem)))
    };
    let constraint = problem.dimension.constraint();
    let constraint = constraint.map_or(String::new(), |words| format!("1-D, {words}\n"));
    let mut log = Log {
        prints,
        verbose: verbosity == Verbosity::Verbose,
        title: format!(
            "{}\n{constraint}{} ranks × {threads} threads on {hosts} host(s)",
            problem.title,
            world.size()
        ),
        bodies: problem
            .bodies
            .iter()
            .map(|body| body.name.clone())
            .collect(),
        started,
        progress: Progress::Silent,
    };
    let outcome = fissure::run(&problem, world, options, &mut log).map_err(with_own_options)?;
    if prints {
        report(&outcome, threads, verbosity);
    }
    if let (Some(reason), 0) = (outcome.stopped, world.rank()) {
        print_stop(&outcome, reason);
    }
    Ok(outcome)
}

/// Return an error of the library with the options of the command in place of those of the library.
fn with_own_options(error: Error) -> Error {
    let names = [
        (RESTART, "--restart"),
        (REPLACE, "--overwrite"),
        (FOLDER, "--output DIR"),
    ];
    let replace =
        |message: String, (of_library, own): (&str, &str)| message.replace(of_library, own);
    Error {
        message: names.into_iter().fold(error.message, replace),
        ..error
    }
}

/// Observer that prints the messages and the progress of a run.
struct Log {
    /// Whether this rank prints messages, warnings and progress.
    prints: bool,
    /// Whether this rank also prints verbose messages.
    verbose: bool,
    title: String,
    /// Names of the bodies.
    bodies: Vec<String>,
    started: Instant,
    progress: Progress,
}

impl Observer for Log {
    fn message(&mut self, message: &Message) {
        match message {
            Message::Started if self.prints => outln!("{}", self.title),
            Message::SetUp { survey, .. } if self.prints => {
                for (pair, bonds) in &survey.bonds_between_bodies {
                    let [a, b] = pair.map(|body| &self.bodies[body]);
                    outln!("{} bonds join {a} and {b}", count(*bonds));
                }
                for warning in &survey.warnings {
                    errln!("warning: {warning}");
                }
            }
            Message::Continued {
                number,
                time,
                complete,
            } if self.prints => {
                outln!("continued after step {number} (t = {})", si(*time, "s"));
                if *complete {
                    outln!("the run was complete already");
                }
            }
            Message::SetAside { reason, renamed } if self.prints => {
                let renamed: Vec<String> = renamed
                    .iter()
                    .map(|path| path.display().to_string())
                    .collect();
                let renamed = if renamed.is_empty() {
                    String::new()
                } else {
                    format!("; earlier files are kept as {}", renamed.join(" and "))
                };
                errln!("warning: {reason}: starting a new result{renamed}");
            }
            Message::Removed(paths) if self.prints => {
                let paths = paths.iter().map(|path| path.display().to_string());
                let paths: Vec<String> = paths.collect();
                outln!("removed files of the earlier run: {}", paths.join(", "));
            }
            Message::Decided(decisions) if self.prints && self.verbose => {
                outln!("decided");
                for (name, value) in decisions {
                    outln!("  {name:<17}{value}");
                }
            }
            Message::Refined {
                number,
                regridded: Regridded { created, removed },
                points,
            } if self.prints && self.verbose => {
                let (created, points) = (count(*created), count(*points));
                let removed = if *removed > 0 {
                    format!(", {} removed", count(*removed))
                } else {
                    String::new()
                };
                self.progress.aside(|| {
                    outln!("after step {number}: {created} new points{removed}, {points} in all");
                });
            }
            Message::Repartitioned {
                number,
                repartition,
            } if self.prints && self.verbose => {
                let Repartition {
                    imbalance,
                    moved,
                    seconds,
                } = repartition;
                let (moved, seconds) = (count(*moved), si(*seconds, "s"));
                self.progress.aside(|| {
                    outln!(
                        "after step {number} the slowest rank took {imbalance:.2} times the mean: \
                         {moved} points changed their rank in {seconds}"
                    );
                });
            }
            Message::Warning(text) if self.prints => {
                self.progress.aside(|| errln!("warning: {text}"));
            }
            _ => {}
        }
    }

    fn begin(&mut self, now: &mut dyn RunState) {
        // A restarted run may end before the step of its checkpoint, if its deck has an earlier end.
        let left = now.last().saturating_sub(now.number());
        if self.prints && left > 0 {
            let step = si(now.step(), "s");
            let set_up = si(self.started.elapsed().as_secs_f64(), "s");
            outln!("{} steps of {step} to go, after {set_up}", count(left));
        }
        self.progress = Progress::new(self.prints, "step", now.number(), now.last());
    }

    fn step(&mut self, now: &mut dyn RunState) {
        self.progress.update(now.number(), now.last(), now.time());
    }

    fn end(&mut self, complete: bool) {
        self.progress.finish(complete);
    }
}

/// Print the summary of a run and the paths of its files.
fn report(outcome: &Outcome, threads: usize, verbosity: Verbosity) {
    if outcome.summary.steps > 0 {
        summary::print(outcome, threads);
    }
    match outcome.no_collective_cause {
        0 if verbosity == Verbosity::Verbose => outln!("all writes were collective"),
        0 => {}
        cause => outln!("warning: some writes were not collective (HDF5 cause {cause:#x})"),
    }
    let (result, history) = (&outcome.files.result, &outcome.files.history);
    let (result, history) = (result.display(), history.display());
    outln!("result   {result}   (ParaView 5.12 or later; result.xdmf for older ones)");
    for further in &outcome.files.further {
        outln!("result   {}", further.display());
    }
    outln!("history  {history}");
    outln!("picture  fissure plot {result}");
}

fn print_stop(outcome: &Outcome, reason: Reason) {
    let because = match reason {
        Reason::Signal => "by a signal",
        Reason::WallTime => "as the wall-clock limit is near",
        Reason::Observer => "by an observer",
    };
    let (number, last) = (outcome.number, outcome.last);
    let time = si(outcome.time, "s");
    errln!(
        "stopped {because} after step {number} of {last} (t = {time}); a checkpoint is written, \
         --restart continues"
    );
}
