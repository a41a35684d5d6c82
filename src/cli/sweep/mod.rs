//! `fissure sweep`: run a deck for several values of its parameters and keys.

mod convergence;
mod design;
mod runs;
mod table;
mod value;

use std::path::{Path, PathBuf};

use clap::Args;
use fissure::deck;
use fissure::error::{Error, Result};
use fissure::solver::observers::column_names;

use super::{Verbosity, errln, launch, outln};
use design::{Axis, Design};
use runs::{Program, Run, State};
use table::Table;
use value::{Column, Reference};

/// Run a deck for several values of its parameters and keys.
///
/// Each combination of values is a separate run in a separate process. Complete runs are not repeated, and
/// interrupted runs continue from their checkpoints. Writes sweep.csv, a table of values picked from the
/// histories, to the output folder. Also draws each picked value over a parameter.
#[derive(Args)]
#[command(after_help = "\
Examples:
  fissure sweep plate.toml --set tension=18e6,20e6,22e6 --value max:fracture_energy
  fissure sweep plate.toml --set dx=2e-3,1e-3,0.5e-3 --value last:strain_energy --reference 1.25e-3
  fissure sweep plate.toml --set dx=2e-3,1e-3 --set time.safety=0.8,0.4 --jobs 4 --threads 1
  fissure sweep plate.toml --set dx=2e-3,1e-3 --set 'grid.horizon=3*dx,6*dx' --zip
  fissure sweep plate.toml --set dx=2e-3,1e-3 --launcher 'mpirun -n 4 --bind-to none'
  fissure sweep plate.toml --set dx=2e-3,1e-3 --rows $SLURM_ARRAY_TASK_ID           in a job array

A value with commas, such as [1, 2] or max(a, b), is one value.

With a reference r, the error of a value f is (f - r)/|r|. The convergence rate over a parameter h is
the exponent p in |f - r| ~ h^p, computed from each run and the run before it.
Without a reference, the rate is the exponent p in f - f0 ~ h^p, computed from three successive runs,
because the limit f0 is also unknown. This rate is printed only if h changes a spacing, a horizon or a time
step, or if --x names h.

Exit codes: 0 done, 1 runs failed, 2 the deck or the arguments are wrong, 75 a signal or a time
limit stopped the sweep; the same command continues it.")]
pub struct SweepArguments {
    /// Deck to run.
    deck: PathBuf,

    /// Override keys of the deck with those of another deck. May be repeated.
    #[arg(long, value_name = "OVERLAY")]
    with: Vec<PathBuf>,

    /// Values of a parameter or key. Give a key with its section, such as time.safety. May be repeated.
    #[arg(long, required = true, value_name = "NAME=VALUE,…", value_parser = design::axis)]
    set: Vec<Axis>,

    /// Combine the k-th values of all --set options into run k, instead of running all combinations.
    #[arg(long)]
    zip: bool,

    /// Folder of the runs and of the table [default: out/NAME_sweep for a deck NAME.toml].
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,

    /// Value to pick from the column COLUMN of each history. PICK is last (default), first, max or min. May
    /// be repeated.
    #[arg(long, value_name = "[PICK:]COLUMN", value_parser = value::column)]
    value: Vec<Column>,

    /// Expected number for a --value. If there are several --value options, give one of them as VALUE before
    /// the number, as in max:kinetic_energy=2.5. May be repeated.
    #[arg(long, value_name = "[VALUE=]NUMBER", value_parser = value::reference)]
    reference: Vec<Reference>,

    /// Parameter on the horizontal axis of pictures. Rates of convergence are computed over this parameter
    /// [default: the first parameter with several values that are all numbers].
    #[arg(long, value_name = "NAME")]
    x: Option<String>,

    /// Number of simultaneous runs.
    #[arg(short, long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u16).range(1..))]
    jobs: u16,

    /// Threads of each rank [default: number of cores of the rank].
    #[arg(short, long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,

    /// Command that starts the ranks of each run, such as 'mpirun -n 4'.
    #[arg(long, value_name = "WORDS")]
    launcher: Option<String>,

    /// Run only the combinations with these numbers, counted from 1, such as 1-4,7.
    #[arg(long, value_name = "LIST")]
    rows: Option<String>,

    /// Repeat complete runs, and replace runs of another deck in the folders of this sweep.
    #[arg(long)]
    overwrite: bool,
}

impl SweepArguments {
    /// Return the output folder, by default `out/<deck>_sweep`.
    fn folder(&self) -> PathBuf {
        let default = || {
            let stem = self.deck.file_stem().unwrap_or_default();
            let mut name = stem.to_os_string();
            name.push("_sweep");
            Path::new("out").join(name)
        };
        self.output.clone().unwrap_or_else(default)
    }
}

/// Return the runs of all combinations. Validate the deck of each run, and check that the history of the run
/// has every column that a `--value` option names.
///
/// # Errors
/// If the deck of a combination is invalid, or if a `--value` option names an unknown column. The message
/// names the combination.
fn planned_runs(arguments: &SweepArguments, design: &Design, folder: &Path) -> Result<Vec<Run>> {
    let run = |(row, name): (&Vec<usize>, String)| {
        let (label, set) = (design.label(row), design.assignments(row));
        let read = || {
            let deck = deck::read_with(&arguments.deck, &arguments.with, &set)?;
            let problem = deck.problem()?;
            value::check(&arguments.value, &column_names(&problem))?;
            Ok((deck.explain()?, runs::resolution(&problem)))
        };
        let (deck, resolution) = read().map_err(|error: Error| Error {
            message: format!("{label}: {}", error.message),
            ..error
        })?;
        let folder = folder.join(name);
        Ok(Run {
            label,
            folder,
            set,
            deck,
            resolution,
        })
    };
    design.rows.iter().zip(design.folders()).map(run).collect()
}

/// Run the combinations that `--rows` selects, or all combinations if `--rows` is not given. Without
/// `--overwrite`, skip complete runs. Write the table and pictures of all combinations.
///
/// # Errors
/// - If a launcher of MPI has started this process.
/// - If the deck or an argument is wrong.
/// - If a run fails.
/// - If a file cannot be written.
/// - If a signal or a time limit stops a run.
pub fn sweep(arguments: &SweepArguments, verbosity: Verbosity) -> Result<()> {
    if let Some(name) = launch::launcher_variable() {
        return Err(Error::input(format!(
            "{name} is set by a launcher such as mpirun or srun; start fissure sweep without a launcher, and \
             give the launcher of its runs as --launcher, such as --launcher 'mpirun -n 4'"
        )));
    }
    let design = Design::new(&arguments.set, arguments.zip)?;
    let chosen = match &arguments.rows {
        Some(list) => design::rows(list, design.rows.len())?,
        None => (0..design.rows.len()).collect(),
    };
    let references = value::references(&arguments.value, &arguments.reference)?;
    let abscissa = design.abscissa(arguments.x.as_deref())?;
    let folder = arguments.folder();
    let runs = planned_runs(arguments, &design, &folder)?;
    let program = Program::new(arguments)?;
    let differs = |rows: &[usize]| {
        let mut pairs = rows.windows(2);
        pairs.any(|pair| runs[pair[0]].resolution != runs[pair[1]].resolution)
    };
    let converges = |axis| design.groups(axis).iter().any(|(_, rows)| differs(rows));
    let has_rates = arguments.x.is_some() || abscissa.is_some_and(converges);
    let mut table = Table::new(&design, &arguments.value, &references, abscissa, has_rates);
    let mut due = Vec::new();
    for (number, run) in runs.iter().enumerate() {
        let is_chosen = chosen.contains(&number);
        if is_chosen {
            run.check(arguments.overwrite)?;
        }
        if run.is_complete() && !(is_chosen && arguments.overwrite) {
            table.read(number, &run.folder)?;
        } else if is_chosen {
            due.push(number);
        }
    }
    let prints = verbosity > Verbosity::Quiet;
    if prints && due.len() < runs.len() {
        let complete = table.complete();
        outln!(
            "{complete} of {} runs are complete, {} to do",
            runs.len(),
            due.len()
        );
    }
    let (mut failed, mut ended) = (Vec::new(), 0);
    let stopped = program.run_all(&runs, &due, |number, state, seconds| {
        let run = &runs[number];
        ended += 1;
        match state {
            State::Complete => {
                if prints {
                    let time = super::format::duration(seconds);
                    outln!(
                        "{}: complete after {time}, {ended} of {}",
                        run.label,
                        due.len()
                    );
                }
                table.read(number, &run.folder)?;
            }
            State::Failed(how) => {
                errln!("{}: {how}: {}", run.label, run.last_words());
                failed.push(number);
            }
        }
        Ok(())
    })?;
    for (number, run) in runs.iter().enumerate() {
        if failed.contains(&number) {
            table.set_state(number, "failed");
        } else if run.is_begun() {
            table.set_state(number, "incomplete");
        }
    }
    table.write(&folder, prints)?;
    if stopped {
        let message =
            "the sweep was stopped by a signal or a time limit; the same command continues it";
        return Err(Error::stopped(message));
    }
    match &failed[..] {
        [] => Ok(()),
        [first, ..] => Err(Error::run(format!(
            "{} of {} runs failed; what they printed is in log.txt of their folders, such as {}",
            failed.len(),
            due.len(),
            runs[*first].folder.join(runs::LOG).display()
        ))),
    }
}
