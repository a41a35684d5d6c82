//! `fissure run`: from a deck to a result.

use crate::cli::{say, tell};
use std::path::Path;
use std::process::ExitCode;
use std::time::Instant;

use fissure::comm::mpi::World;
use fissure::comm::{Communicator, agree};
use fissure::deck::{self, Plan};
use fissure::error::Result;
use fissure::output::{self, Creation};
use fissure::solver::Simulation;
use fissure::survey::Survey;

use super::files::Files;
use super::format::{count, si};
use super::progress::Progress;
use super::recorder::{Recorder, Start, can_continue};
use super::restart::{Keeper, Restart, restart};
use super::summary::Summary;
use super::watch::{Reason, STOPPED, Signals, Watch};
use super::{RunArguments, Verbosity, launch};

/// How a run ended.
enum Ending {
    Complete,
    Stopped,
}

/// Runs a deck on all ranks and ends MPI.
pub fn run(arguments: &RunArguments, verbosity: Verbosity) -> ExitCode {
    let start = Instant::now();
    launch::on_all_ranks(|world| {
        let ending = run_deck(world, arguments, verbosity, start)?;
        Ok(match ending {
            Ending::Stopped => ExitCode::from(STOPPED),
            Ending::Complete => ExitCode::SUCCESS,
        })
    })
}

fn run_deck(
    world: &World,
    arguments: &RunArguments,
    verbosity: Verbosity,
    start: Instant,
) -> Result<Ending> {
    let signals = agree(world, Signals::listen())?;
    let deck = agree(world, deck::read(&arguments.deck, &arguments.set))?;
    let plan = agree(world, deck.plan())?;
    let explained = agree(world, deck.explain())?;
    let threads = launch::threads(arguments.threads);
    agree(world, launch::start_threads(threads))?;
    if world.rank() == 0 && verbosity > Verbosity::Quiet {
        launch::warn(threads);
    }
    let stem = arguments.deck.file_stem().unwrap_or_default();
    let folder = arguments.output.clone();
    let files = Files::new(folder.unwrap_or_else(|| Path::new("out").join(stem)));
    // Taken before anything is looked at, and kept until the end.
    let prepared = match world.rank() {
        0 => files.lock().and_then(|lock| {
            if !arguments.restart {
                files.prepare(arguments.overwrite)?;
            }
            Ok(Some(lock))
        }),
        _ => Ok(None),
    };
    let _lock = agree(world, prepared)?;
    let job = Job {
        world,
        plan: &plan,
        explained,
        files: &files,
        threads,
        arguments,
        verbosity,
        signals: &signals,
        start,
    };
    match plan.dimension.count() {
        1 => job.run::<1>(),
        2 => job.run::<2>(),
        _ => job.run::<3>(),
    }
}

/// Everything that a run needs beside the points.
struct Job<'a> {
    world: &'a World,
    plan: &'a Plan,
    explained: String,
    files: &'a Files,
    threads: usize,
    arguments: &'a RunArguments,
    verbosity: Verbosity,
    signals: &'a Signals,
    start: Instant,
}

impl<'a> Job<'a> {
    fn speaks(&self) -> bool {
        self.world.rank() == 0 && self.verbosity > Verbosity::Quiet
    }

    fn run<const D: usize>(&self) -> Result<Ending> {
        let hosts = self.world.hosts();
        if self.speaks() {
            let (ranks, threads) = (self.world.size(), self.threads);
            say!("{}", self.plan.title);
            say!("{ranks} ranks × {threads} threads on {hosts} host(s)");
        }
        let mut simulation = Simulation::<D>::new(self.plan, self.world)?;
        simulation.check()?;
        let survey = Survey::new(&mut simulation);
        if self.speaks() {
            for (pair, bonds) in &survey.joints {
                let [a, b] = pair.map(|body| &self.plan.bodies[body].name);
                say!("{} bonds join {a} and {b}", count(*bonds));
            }
            for warning in &survey.warnings {
                tell!("warning: {warning}");
            }
        }
        let (mut keeper, mut recorder) = match self.arguments.restart {
            true => self.continue_run(&mut simulation, hosts)?,
            false => self.begin_run(&mut simulation, hosts)?,
        };
        let rule = self.plan.checkpoint;
        let limit = self.arguments.wall_time.map(|limit| (self.start, limit));
        let steps = (simulation.step, simulation.number, simulation.last);
        let mut watch = Watch::new(self.signals, rule, limit, steps);
        let first = simulation.number;
        let mut progress = Progress::new(self.speaks(), first, simulation.last);
        let mut stopped = None;
        while simulation.number < simulation.last {
            simulation.advance();
            let complete = simulation.number == simulation.last;
            let number = simulation.number;
            if complete || watch.is_due(number) || recorder.is_due(number) {
                if let Err(error) = simulation.check() {
                    // The reader of the result should see where it went wrong.
                    recorder.write(&mut simulation, true, true)?;
                    recorder.file.close()?;
                    self.write_side_car()?;
                    return Err(error);
                }
                recorder.record(&mut simulation)?;
                let decision = watch.look(self.world, number);
                if complete || decision.checkpoint || decision.stop.is_some() {
                    watch.wrote_checkpoint(keeper.write(&simulation, &mut recorder)?);
                }
                progress.show(simulation.number, simulation.time());
                if decision.stop.is_some() && !complete {
                    stopped = decision.stop;
                    break;
                }
            } else {
                progress.show(number, simulation.time());
            }
        }
        progress.finish(stopped.is_none());
        let cause = recorder.file.no_collective_cause();
        let steps = simulation.number - first;
        let record = (recorder.energies, recorder.broken);
        let (output, checkpoints) = (recorder.spent, (keeper.written, keeper.spent));
        recorder.file.close()?;
        self.write_side_car()?;
        let spent = (output, checkpoints.1, self.start.elapsed());
        let summary = Summary::new(&simulation, steps, checkpoints.0, spent);
        if self.speaks() {
            if steps > 0 {
                summary.print(&simulation, self.threads, record.0, record.1);
            }
            match cause {
                0 if self.verbosity == Verbosity::Verbose => say!("all writes were collective"),
                0 => {}
                _ => say!("warning: some writes were not collective (HDF5 cause {cause:#x})"),
            }
            self.say_where();
        }
        match stopped {
            None => Ok(Ending::Complete),
            Some(reason) => {
                self.say_stopped(&simulation, reason);
                Ok(Ending::Stopped)
            }
        }
    }

    fn begin_run<const D: usize>(
        &self,
        simulation: &mut Simulation<'a, D>,
        hosts: usize,
    ) -> Result<(Keeper, Recorder<'a>)> {
        let creation = match self.arguments.overwrite {
            true => Creation::Truncate,
            false => Creation::Exclusive,
        };
        let keeper = Keeper::new(simulation, self.files, self.explained.clone())?;
        let metadata = self.metadata(simulation, hosts);
        let mut recorder = Recorder::new(simulation, self.files, Start::New(creation), &metadata)?;
        recorder.record(simulation)?;
        Ok((keeper, recorder))
    }

    fn continue_run<const D: usize>(
        &self,
        simulation: &mut Simulation<'a, D>,
        hosts: usize,
    ) -> Result<(Keeper, Recorder<'a>)> {
        let Restart { mut keeper, header } =
            restart(simulation, self.files, self.explained.clone())?;
        if self.speaks() {
            let time = si(simulation.time(), "s");
            say!("continued after step {} (t = {time})", simulation.number);
            if simulation.number >= simulation.last {
                say!("the run was complete already");
            }
        }
        let metadata = self.metadata(simulation, hosts);
        if can_continue(simulation, self.files, &header)? {
            let start = Start::After(header.outputs, header.rows);
            let mut recorder = Recorder::new(simulation, self.files, start, &metadata)?;
            recorder.observer.continue_from(header.start);
            return Ok((keeper, recorder));
        }
        let aside = match self.world.rank() {
            0 => self.files.set_aside(simulation.number).map(Some),
            _ => Ok(None),
        };
        if let (Some(aside), true) = (agree(self.world, aside)?, self.speaks()) {
            let aside = aside.display();
            say!("other outputs are asked for, or the result is gone: it is kept as {aside}");
        }
        let start = Start::New(Creation::Exclusive);
        let mut recorder = Recorder::new(simulation, self.files, start, &metadata)?;
        recorder.observer.continue_from(header.start);
        recorder.write(simulation, true, true)?;
        // The checkpoint counts the outputs of the file that was set aside.
        keeper.write(simulation, &mut recorder)?;
        Ok((keeper, recorder))
    }

    /// The description of the result for older versions of ParaView.
    fn write_side_car(&self) -> Result<()> {
        let written = match self.world.rank() {
            0 => output::xdmf::write_beside(&self.files.result).map(|_| ()),
            _ => Ok(()),
        };
        agree(self.world, written)
    }

    fn say_where(&self) {
        let (result, history) = (self.files.result.display(), self.files.history.display());
        say!("result   {result}   (ParaView 5.12 or later; result.xdmf for older ones)");
        say!("history  {history}");
        say!("picture  fissure plot {result}");
    }

    fn say_stopped<const D: usize>(&self, simulation: &Simulation<'_, D>, reason: Reason) {
        if self.world.rank() == 0 {
            let because = match reason {
                Reason::Signal => "by a signal",
                Reason::WallTime => "as the wall-clock limit is near",
            };
            let (number, last) = (simulation.number, simulation.last);
            let time = si(simulation.time(), "s");
            tell!(
                "stopped {because} after step {number} of {last} (t = {time}); a checkpoint is \
                 written, --restart continues"
            );
        }
    }

    /// Attributes of the result: how it was made.
    fn metadata<const D: usize>(
        &self,
        simulation: &Simulation<'_, D>,
        hosts: usize,
    ) -> Vec<(&'static str, String)> {
        let command_line: Vec<String> = std::env::args().collect();
        // All ranks must write the same; what differs between them is told by rank 0.
        let mut own = format!("{}\n{}", self.threads, command_line.join(" ")).into_bytes();
        self.world.broadcast(0, &mut own);
        let own = String::from_utf8_lossy(&own);
        let (threads, command_line) = own.split_once('\n').unwrap_or_default();
        vec![
            ("title", self.plan.title.clone()),
            ("deck", self.plan.source.text.clone()),
            ("deck_in_full", self.explained.clone()),
            ("deck_path", self.plan.source.path.display().to_string()),
            ("version", env!("CARGO_PKG_VERSION").to_owned()),
            ("command_line", command_line.to_owned()),
            ("ranks", self.world.size().to_string()),
            ("threads", threads.to_owned()),
            ("hosts", hosts.to_string()),
            ("dimension", D.to_string()),
            ("section", self.plan.dimension.section().to_string()),
            ("time_step", simulation.step.to_string()),
        ]
    }
}
