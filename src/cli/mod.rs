//! The command line, one file per subcommand.

mod bench;
mod bench_report;
mod check;
mod check_json;
mod check_report;
mod compare;
mod explain;
mod format;
mod generate;
mod import;
mod init;
mod launch;
mod machine_limits;
mod movie;
mod plot;
mod progress;
mod report;
mod run;
mod summary;
mod sweep;
mod version;
mod wall_time;

/// Print a line to standard output. Ignore write errors, so that a closed pipe does not end a run.
macro_rules! outln {
    ($($words:tt)*) => {{
        use std::io::Write as _;
        let _ = writeln!(std::io::stdout(), $($words)*);
    }};
}
pub(crate) use outln;

/// Print a line to standard error. Ignore write errors, as [`outln`] does.
macro_rules! errln {
    ($($words:tt)*) => {{
        use std::io::Write as _;
        let _ = writeln!(std::io::stderr(), $($words)*);
    }};
}
pub(crate) use errln;

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Duration;

use clap::error::ErrorKind;
use clap::{Args, Parser, Subcommand};
use fissure::comm::mpi::World;
use fissure::error::{Error, Result};

/// Peridynamics for batch jobs: cracks that start, run and branch by themselves.
///
/// A deck is a TOML file that describes a run. Results are bit-identical on any number of MPI ranks and
/// threads.
#[derive(Parser)]
#[command(version, propagate_version = true, arg_required_else_help = true)]
#[command(after_help = "\
Examples:
  fissure init plate.toml                       write a commented example deck
  fissure check plate.toml                      validate it; show mass, bonds, step, memory, time
  fissure run plate.toml                        run it; the result goes to out/plate/
  mpirun -n 4 fissure run plate.toml            the same on 4 ranks
  fissure plot out/plate                        a picture of the damage at the end
  fissure plot out/plate --y kinetic_energy     a curve of the history
  fissure movie out/plate                       the damage over time
  fissure compare out/plate out/before          the differences between two results
  fissure sweep plate.toml --set dx=2e-3,1e-3   run the deck for several values
  fissure import disk_impact.yaml               translate a deck of another code
  fissure bench                                 measure the speed of this machine
  fissure slurm hybrid > job.sbatch             print a job script

Exit codes: 0 done, 1 the run failed or the compared results differ, 2 the deck or the arguments are
wrong, 75 the run was stopped by a signal or the wall-clock limit and can be continued with --restart.")]
struct CommandLine {
    #[command(subcommand)]
    command: Command,

    /// Print errors only.
    #[arg(short, long, global = true)]
    quiet: bool,

    /// Print more; only `run` and `compare` have more to print.
    #[arg(short, long, global = true, conflicts_with = "quiet")]
    verbose: bool,
}

#[derive(Subcommand)]
enum Command {
    Run(RunArguments),
    Check(CheckArguments),
    Plot(plot::PlotArguments),
    Movie(movie::MovieArguments),
    Compare(compare::CompareArguments),
    Sweep(sweep::SweepArguments),
    Explain(DeckArguments),
    Init(init::InitArguments),
    Import(import::ImportArguments),
    Bench(BenchArguments),
    Schema(generate::SchemaArguments),
    Completions(generate::CompletionsArguments),
    Man(generate::ManArguments),
    Slurm(generate::SlurmArguments),
}

/// Run a deck, alone or under mpirun.
///
/// Writes result.vtkhdf (for ParaView 5.12 and later), result.xdmf (for older ParaView) and history.csv to
/// the output folder. Also writes crack_NAME.csv for each crack whose path the deck requests.
#[derive(Args)]
#[command(after_help = "\
Examples:
  fissure run plate.toml
  fissure run plate.toml --threads 8 --output /scratch/plate
  mpirun -n 2 --bind-to none fissure run plate.toml --threads 4
  srun fissure run plate.toml                   in a Slurm job, see `fissure slurm`
  fissure run plate.toml --restart              continue from the last checkpoint
  fissure run plate.toml --set tension=20e6     another value of a parameter of the deck
  fissure run plate.toml --set time.safety=0.4  a value of any key, even if the deck lacks it
  fissure run plate.toml --with slow.toml       keys of slow.toml replace those of plate.toml

Give each rank as many cores as it has threads: --bind-to none or --map-by slot:PE=4.

The loops use the largest vector instruction set that all ranks have. The environment variable
FISSURE_INSTRUCTIONS (avx2 or avx512) limits this set. Results with AVX2 and AVX-512 are bit-identical.

SIGTERM, SIGINT or SIGUSR1 to any rank: within a few steps, the run writes a checkpoint and ends with
exit code 75. If a rank receives another of these signals more than a second later, it exits at once
with code 130. SIGUSR2 to any rank: the run writes a checkpoint and continues.")]
struct RunArguments {
    /// Deck to run.
    deck: PathBuf,

    /// Folder of the result [default: out/NAME for a deck NAME.toml].
    #[arg(short, long, value_name = "DIR")]
    output: Option<PathBuf>,

    /// Threads of each rank [default: number of cores of the rank].
    #[arg(short, long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,

    /// Replace an existing result.
    #[arg(long)]
    overwrite: bool,

    /// Continue from the newest checkpoint in the output folder, on any number of ranks.
    #[arg(long, conflicts_with = "overwrite")]
    restart: bool,

    /// Write a checkpoint and stop before the run has lasted this long [default: the time limit of the Slurm
    /// job].
    #[arg(long, value_name = "HH:MM[:SS]", value_parser = wall_time::wall_time)]
    wall_time: Option<Duration>,

    /// Override keys of the deck with those of another deck. May be repeated.
    #[arg(long, value_name = "OVERLAY")]
    with: Vec<PathBuf>,

    /// Override a parameter or any key of the deck. Give a key with its section, such as time.safety=0.4. May
    /// be repeated.
    #[arg(long, value_name = "NAME=VALUE", value_parser = assignment)]
    set: Vec<(String, String)>,
}

/// Split `NAME=VALUE` at the first `=`, and trim both parts.
fn assignment(text: &str) -> std::result::Result<(String, String), String> {
    match text.split_once('=') {
        Some((name, value)) if !name.trim().is_empty() && !value.trim().is_empty() => {
            Ok((name.trim().to_owned(), value.trim().to_owned()))
        }
        _ => Err(format!(
            "`{text}` must be NAME=VALUE, with a name of [parameters] or a key such as time.safety"
        )),
    }
}

/// Validate decks and print their mass, bonds, memory and run time.
///
/// Creates the points and finds the bonds on this machine. If a deck is too large to create its
/// points and bonds, their numbers are estimated.
#[derive(Args)]
#[command(after_help = "\
Examples:
  fissure check plate.toml
  fissure check plate.toml --ranks 256          memory estimated for 256 ranks
  fissure check -q *.toml                       print only the errors of invalid decks
  fissure check --json plate.toml | jq .points  numbers for scripts")]
struct CheckArguments {
    /// Decks to check.
    #[arg(required = true, value_name = "DECK")]
    decks: Vec<PathBuf>,

    /// Override keys of the decks with those of another deck. May be repeated.
    #[arg(long, value_name = "OVERLAY")]
    with: Vec<PathBuf>,

    /// Override a parameter or any key of the decks. Give a key with its section, such as time.safety=0.4.
    /// May be repeated.
    #[arg(long, value_name = "NAME=VALUE", value_parser = assignment)]
    set: Vec<(String, String)>,

    /// Estimate the memory for this many ranks.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    ranks: u32,

    /// Print the numbers in SI units as JSON, one line per deck; for an invalid deck, print the error message
    /// as JSON.
    #[arg(long)]
    json: bool,
}

/// Print decks with every default filled in.
#[derive(Args)]
#[command(after_help = "\
Example:
  fissure explain plate.toml > plate_in_full.toml")]
struct DeckArguments {
    /// Decks to print.
    #[arg(required = true, value_name = "DECK")]
    decks: Vec<PathBuf>,

    /// Override keys of the decks with those of another deck. May be repeated.
    #[arg(long, value_name = "OVERLAY")]
    with: Vec<PathBuf>,

    /// Override a parameter or any key of the decks. Give a key with its section, such as time.safety=0.4.
    /// May be repeated.
    #[arg(long, value_name = "NAME=VALUE", value_parser = assignment)]
    set: Vec<(String, String)>,
}

/// Measure the speed of the time loop on a fixed problem, alone or under mpirun.
///
/// The problem is a cubic lattice with 122 neighbours within the horizon. The time step is fixed, and no
/// output is written. Prints the bond updates per second and core, the time by phase, the memory of all
/// processes and the halo traffic. Also measures the memory bandwidth and the arithmetic rate that the same
/// threads can reach, and prints which fractions of these limits the time loop reaches.
/// docs/src/developers/performance.md explains the numbers.
#[derive(Args)]
#[command(after_help = "\
Examples:
  fissure bench                                 262 144 points, PMB, bonds can break
  fissure bench --law lps --no-failure --threads 1
  fissure bench --points 128,128,64             a block of 128 × 128 × 64 points
  mpirun -n 2 --bind-to none fissure bench --threads 1
  fissure bench --json                          one line for scripts

FISSURE_INSTRUCTIONS=avx2 limits the vector instructions of the loops.")]
struct BenchArguments {
    /// Material law.
    #[arg(long, value_enum, default_value_t = bench::Law::Pmb)]
    law: bench::Law,

    /// Storage of the bonds.
    #[arg(long, value_enum, default_value_t = bench::Family::Auto)]
    family: bench::Family,

    /// Omit damage. Without this option, each bond is tested for failure in every step, but none breaks.
    #[arg(long)]
    no_failure: bool,

    /// Add contact. SHARE, from 0 to 0.25, is the fraction of the points that touch other points. These
    /// points lie on the faces of closed cracks. Without SHARE, no points touch.
    #[arg(long, value_name = "SHARE", num_args = 0..=1, default_missing_value = "0", value_parser = bench::touching_share)]
    contact: Option<f64>,

    /// Size of the block. With one number N, the block is a cube with N points; N is rounded to a cube
    /// number. Three numbers X,Y,Z are the numbers of points along the edges.
    #[arg(short, long, value_name = "N", default_value = "262144", value_parser = bench::edges)]
    points: [u64; 3],

    /// Number of measured time steps. Before these steps, N/10 warm-up steps (rounded up) are run.
    #[arg(short, long, value_name = "N", default_value_t = 200, value_parser = clap::value_parser!(u32).range(1..))]
    steps: u32,

    /// Threads of each rank [default: number of cores of the rank].
    #[arg(short, long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,

    /// Do not measure the memory bandwidth and the arithmetic rate. This measurement needs several seconds,
    /// and several hundred MiB of memory (12 times the size of the last-level cache).
    #[arg(long)]
    no_limits: bool,

    /// Print the numbers as one line of JSON in SI units.
    #[arg(long)]
    json: bool,
}

/// Amount of printed output.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Verbosity {
    Quiet,
    Normal,
    Verbose,
}

/// Parse the command line, run the command and return its exit code.
pub fn main() -> ExitCode {
    let rank = launch::rank_from_environment();
    let speaks = rank.unwrap_or(0) == 0;
    let line = match CommandLine::try_parse() {
        Ok(line) => line,
        Err(error) if error.kind() == ErrorKind::DisplayVersion => {
            if speaks {
                version::print();
            }
            return ExitCode::SUCCESS;
        }
        Err(error) => {
            // A launcher kills all ranks when one rank exits with an error, perhaps before rank 0 has printed
            // the message. Start MPI, because MPI makes the ranks wait for each other at the exit.
            let _together = (error.exit_code() != 0 && rank.is_some()).then(World::start);
            if speaks {
                // Ignore write errors, such as a closed pipe.
                let _ = error.print();
            }
            return ExitCode::from(error.exit_code() as u8);
        }
    };
    let verbosity = match (line.quiet, line.verbose) {
        (true, _) => Verbosity::Quiet,
        (_, false) => Verbosity::Normal,
        (_, true) => Verbosity::Verbose,
    };
    let outcome = match line.command {
        Command::Run(arguments) => return run::run(&arguments, verbosity),
        Command::Bench(arguments) => return bench::bench(&arguments, verbosity),
        // Under mpirun, only rank 0 runs these commands.
        _ if !speaks => Ok(()),
        Command::Check(arguments) => check::check(&arguments, verbosity),
        Command::Plot(arguments) => plot::plot(&arguments, verbosity),
        Command::Movie(arguments) => movie::movie(&arguments, verbosity),
        Command::Compare(arguments) => compare::run(&arguments, verbosity),
        Command::Sweep(arguments) => sweep::sweep(&arguments, verbosity),
        Command::Explain(arguments) => explain::explain(&arguments),
        Command::Init(arguments) => init::init(&arguments, verbosity),
        Command::Schema(_) => generate::schema(),
        Command::Completions(arguments) => generate::completions(&arguments),
        Command::Man(arguments) => generate::man(&arguments, verbosity),
        Command::Slurm(arguments) => generate::slurm(&arguments),
        Command::Import(arguments) => import::import(&arguments, verbosity),
    };
    finish(outcome, true)
}

/// Run `work` on all decks, even after an error. Print all errors except the last one, and return the last
/// one.
///
/// # Errors
/// The last error of `work`.
fn each(decks: &[PathBuf], mut work: impl FnMut(&Path) -> Result<()>) -> Result<()> {
    let mut latest = Ok(());
    for deck in decks {
        let done = work(deck);
        if done.is_err()
            && let Err(error) = std::mem::replace(&mut latest, done)
        {
            errln!("error: {error}");
        }
    }
    latest
}

/// Print text to standard output. A closed pipe is not an error.
///
/// # Errors
/// If the output cannot be written.
fn print(text: &str) -> Result<()> {
    let mut output = std::io::stdout().lock();
    let written = output
        .write_all(text.as_bytes())
        .and_then(|()| output.flush());
    match written {
        Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
            let message = format!("cannot write to the standard output: {error}");
            Err(Error::run(message))
        }
        _ => Ok(()),
    }
}

/// Return the exit code of an outcome. If the outcome is an error and `prints` is true, print the error.
fn finish(outcome: Result<()>, prints: bool) -> ExitCode {
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            if prints {
                let label = if error.is_stop() { "" } else { "error: " };
                errln!("{label}{error}");
            }
            ExitCode::from(error.exit_code())
        }
    }
}

/// Return the path of a result file: `path` itself, or `result.vtkhdf` in `path` if `path` is a folder.
fn result_file(path: &Path) -> PathBuf {
    if path.is_dir() {
        path.join("result.vtkhdf")
    } else {
        path.to_path_buf()
    }
}

/// Return the error for a result without outputs.
fn without_output(path: &Path) -> Error {
    Error::input(format!(
        "{}: the result holds no output yet",
        path.display()
    ))
}
