//! `fissure run`: from a deck to a result.

use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::{Duration, Instant};

use fissure::comm::mpi::World;
use fissure::comm::{Communicator, IdOrder, agree};
use fissure::deck::plan::{Field, Plan};
use fissure::deck::{self};
use fissure::error::{Error, Result};
use fissure::output::{self, Contents, Creation, FieldData, FieldDescription, Piece, ResultFile};
use fissure::solver::Simulation;
use fissure::solver::observe::{Energies, HistoryObserver, HistoryRow, Snapshot};
use fissure::solver::schedule::Schedule;

use super::progress::Progress;
use super::summary::Summary;
use super::{RunArguments, Verbosity, finish, launch};

/// History rows that are held back before they are written.
const ROWS_HELD: usize = 256;

/// Runs a deck on all ranks and ends MPI.
pub fn run(arguments: &RunArguments, verbosity: Verbosity) -> ExitCode {
    output::initialise();
    let world = match World::start() {
        Ok(world) => world,
        Err(error) => return finish(Err(error), true),
    };
    let speaks = world.rank() == 0;
    // A panic on one rank would leave the others waiting; its message has been printed.
    let outcome = catch_unwind(AssertUnwindSafe(|| run_deck(&world, arguments, verbosity)))
        .unwrap_or_else(|_| world.abort(1));
    finish(outcome, speaks)
}

fn run_deck(world: &World, arguments: &RunArguments, verbosity: Verbosity) -> Result<()> {
    let plan = agree(world, deck::load(&arguments.deck))?;
    let threads = launch::threads(arguments.threads);
    agree(world, launch::start_threads(threads))?;
    if let (Some(warning), true, true) = (
        launch::warning(threads),
        world.rank() == 0,
        verbosity > Verbosity::Quiet,
    ) {
        eprintln!("warning: {warning}");
    }
    let stem = arguments.deck.file_stem().unwrap_or_default();
    let folder = arguments
        .output
        .clone()
        .unwrap_or_else(|| Path::new("out").join(stem));
    let files = Files::new(folder);
    let prepared = match world.rank() {
        0 => files.prepare(arguments.overwrite),
        _ => Ok(()),
    };
    agree(world, prepared)?;
    let job = Job {
        world,
        plan: &plan,
        files: &files,
        threads,
        overwrite: arguments.overwrite,
        verbosity,
    };
    match plan.dimension.count() {
        1 => job.run::<1>(),
        2 => job.run::<2>(),
        _ => job.run::<3>(),
    }
}

/// Where a run writes to.
struct Files {
    folder: PathBuf,
    result: PathBuf,
    history: PathBuf,
}

impl Files {
    fn new(folder: PathBuf) -> Self {
        Self {
            result: folder.join("result.vtkhdf"),
            history: folder.join("history.csv"),
            folder,
        }
    }

    /// Makes the folder; an error if a result is there that must not be replaced.
    fn prepare(&self, overwrite: bool) -> Result<()> {
        let existing = [&self.result, &self.history]
            .into_iter()
            .find(|file| file.exists());
        if let (Some(file), false) = (existing, overwrite) {
            return Err(Error::input(format!(
                "{} exists already; --overwrite replaces it, --output DIR writes elsewhere",
                file.display()
            )));
        }
        fs::create_dir_all(&self.folder)
            .map_err(|error| super::file_error(&self.folder, "create the folder", &error))
    }
}

/// Everything that a run needs beside the points.
struct Job<'a> {
    world: &'a World,
    plan: &'a Plan,
    files: &'a Files,
    threads: usize,
    overwrite: bool,
    verbosity: Verbosity,
}

impl<'a> Job<'a> {
    fn run<const D: usize>(&self) -> Result<()> {
        let start = Instant::now();
        let speaks = self.world.rank() == 0 && self.verbosity > Verbosity::Quiet;
        let hosts = self.world.hosts();
        if speaks {
            let (ranks, threads) = (self.world.size(), self.threads);
            println!("{}", self.plan.title);
            println!("{ranks} ranks × {threads} threads on {hosts} host(s)");
        }
        let mut simulation = Simulation::<D>::new(self.plan, self.world)?;
        let mut recorder = Recorder::new(self, &simulation, hosts)?;
        let mut progress = Progress::new(speaks, simulation.last);
        recorder.record(&mut simulation)?;
        while simulation.number < simulation.last {
            simulation.advance();
            if simulation.check_is_due()
                && let Err(error) = simulation.check()
            {
                // The reader of the result should see where it went wrong.
                recorder.write(&mut simulation, true, true)?;
                recorder.file.close()?;
                self.write_side_car()?;
                return Err(error);
            }
            recorder.record(&mut simulation)?;
            progress.show(simulation.number, simulation.time());
        }
        progress.finish();
        let spent = recorder.spent;
        let (energies, broken) = (recorder.energies, recorder.broken);
        let cause = recorder.file.no_collective_cause();
        recorder.file.close()?;
        self.write_side_car()?;
        let summary = Summary::new(&simulation, spent, start.elapsed());
        if speaks {
            summary.print(&simulation, self.threads, energies, broken);
            match cause {
                0 if self.verbosity == Verbosity::Verbose => println!("all writes were collective"),
                0 => {}
                _ => println!("warning: some writes were not collective (HDF5 cause {cause:#x})"),
            }
            self.say_where();
        }
        Ok(())
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
        println!("result   {result}   (ParaView 5.12 or later; result.xdmf for older ones)");
        println!("history  {history}");
        println!("picture  fissure plot {result}");
    }

    /// Attributes of the result: how it was made.
    fn metadata<const D: usize>(
        &self,
        simulation: &Simulation<'_, D>,
        hosts: usize,
    ) -> Vec<(&'static str, String)> {
        vec![
            ("title", self.plan.title.clone()),
            ("deck", self.plan.source.text.clone()),
            ("deck_path", self.plan.source.path.display().to_string()),
            ("version", env!("CARGO_PKG_VERSION").to_owned()),
            (
                "command_line",
                std::env::args().collect::<Vec<_>>().join(" "),
            ),
            ("ranks", self.world.size().to_string()),
            ("threads", self.threads.to_string()),
            ("hosts", hosts.to_string()),
            ("dimension", D.to_string()),
            ("section", self.plan.dimension.section().to_string()),
            ("time_step", simulation.step.to_string()),
        ]
    }
}

/// Writes result and history when they are due.
struct Recorder<'a> {
    file: ResultFile<'a>,
    order: IdOrder,
    fields: Vec<Field>,
    observer: HistoryObserver,
    outputs: Schedule,
    rows: Schedule,
    held: Vec<Vec<f64>>,
    energies: Energies,
    broken: u64,
    spent: Duration,
}

impl<'a> Recorder<'a> {
    fn new<const D: usize>(
        job: &'a Job<'a>,
        simulation: &Simulation<'_, D>,
        hosts: usize,
    ) -> Result<Self> {
        let (plan, model) = (job.plan, &simulation.model);
        let observer = HistoryObserver::new(simulation)?;
        let comm: &dyn Communicator = job.world;
        let owned = model.owned();
        let order = IdOrder::new(comm, &model.ids[..owned], model.total);
        let first = order.first();
        let places: Vec<f64> = (0..owned).flat_map(|k| model.position(k)).collect();
        let places = order.collect(comm, &places, 3);
        let ids: Vec<u64> = (first..first + order.count() as u64).collect();
        let blocks: Vec<u32> = model.block.iter().map(|block| u32::from(*block)).collect();
        let blocks = order.collect(comm, &blocks, 1);
        let volumes = order.collect(comm, &model.volume[..owned], 1);
        let scalar = |name, unit| FieldDescription {
            name,
            unit,
            components: 1,
        };
        let fixed = [
            (scalar("id", "1"), FieldData::U64(&ids)),
            (scalar("block", "1"), FieldData::U32(&blocks)),
            (scalar("volume", "m^3"), FieldData::F64(&volumes)),
        ];
        let described: Vec<FieldDescription> = plan
            .output
            .fields
            .iter()
            .map(|field| FieldDescription {
                name: field.name(),
                unit: field.unit(),
                components: field.components(),
            })
            .collect();
        let mut file = ResultFile::create(
            &job.files.result,
            job.world,
            match job.overwrite {
                true => Creation::Truncate,
                false => Creation::Exclusive,
            },
            &Contents {
                piece: Piece {
                    first,
                    total: model.total,
                },
                positions: bytemuck::cast_slice(&places),
                fixed: &fixed,
                moving: &described,
                metadata: &job.metadata(simulation, hosts),
            },
        )?;
        file.create_history(observer.columns(), &job.files.history)?;
        let schedule = |every| Schedule::new(every, simulation.step, simulation.last);
        Ok(Self {
            file,
            order,
            fields: plan.output.fields.clone(),
            observer,
            outputs: schedule(plan.output.every),
            rows: schedule(plan.history.every),
            held: Vec::new(),
            energies: Energies::default(),
            broken: 0,
            spent: Duration::ZERO,
        })
    }

    /// Writes what is due after the present step.
    fn record<const D: usize>(&mut self, simulation: &mut Simulation<'_, D>) -> Result<()> {
        let number = simulation.number;
        self.write(
            simulation,
            self.outputs.is_due(number),
            self.rows.is_due(number),
        )
    }

    fn write<const D: usize>(
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
            let HistoryRow {
                values,
                energies,
                broken,
            } = self.observer.row(simulation, &snapshot);
            self.held.push(values);
            (self.energies, self.broken) = (energies, broken);
        }
        if output || self.held.len() >= ROWS_HELD {
            self.file.append_history(&self.held)?;
            self.held.clear();
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
            let data: Vec<FieldData> = values.iter().map(|v| FieldData::F64(v)).collect();
            self.file
                .write_step(simulation.time(), simulation.number, &data)?;
        }
        self.spent += start.elapsed();
        Ok(())
    }
}
