//! Start of MPI and of the threads. The launcher is the program that starts the ranks. Its environment
//! variables give the rank, the number of ranks on the host and the number of threads.

use std::process::ExitCode;
use std::time::Duration;

use fissure::comm::mpi::World;
use fissure::comm::{self, Communicator};
use fissure::error::{Error, Result};
use fissure::run::start_mpi;

use super::{errln, finish};

/// Maximum number of threads of a rank on a host with few cores. On other hosts, the maximum is four threads
/// per core.
const ALWAYS_ALLOWED_THREADS: usize = 64;

/// Start MPI, run `body` on all ranks and finalise MPI. If `body` returns an error on one rank, `body` must
/// return the same error on all ranks.
pub fn on_all_ranks(body: impl FnOnce(&World) -> Result<ExitCode>) -> ExitCode {
    // MPI may set the launcher's environment variables even for a single process that has no launcher, so
    // read the variables before MPI starts.
    let (started, rank) = (started(), rank_from_environment());
    let world = match start_mpi() {
        Ok(world) => world,
        Err(error) => return finish(Err(error), true),
    };
    if let Err(error) = joined(started, world.size()) {
        let speaks = rank.unwrap_or(0) == 0;
        if !speaks {
            // The launcher kills all processes when one process fails. Wait until rank 0 has printed the
            // error.
            std::thread::sleep(EXIT_DELAY);
        }
        return finish(Err(error), speaks);
    }
    comm::mpi::abort_on_panic();
    let speaks = world.rank() == 0;
    body(&world).unwrap_or_else(|error| finish(Err(error), speaks))
}

/// Time by which all processes except rank 0 delay their exit, so that rank 0 can print an error.
const EXIT_DELAY: Duration = Duration::from_secs(1);

/// Environment variables with the number of launched processes. If launchers are nested, the variable of the
/// innermost launcher comes first. `MPI_LOCALNRANKS` counts only the processes on this host.
const SIZES: [&str; 5] = [
    "OMPI_COMM_WORLD_SIZE",
    "MV2_COMM_WORLD_SIZE",
    "PMI_SIZE",
    "MPI_LOCALNRANKS",
    SLURM_TASKS,
];

/// Return the name of the variable that gives the number of launched processes, and this number. `None`
/// without a launcher.
fn started() -> Option<(&'static str, usize)> {
    SIZES
        .iter()
        .find_map(|name| Some((*name, number(&[name])?)))
}

/// Environment variables that the launchers of MPI set for each rank, also for a single rank.
const MPI_LAUNCHERS: [&str; 4] = [
    "OMPI_COMM_WORLD_SIZE",
    "MV2_COMM_WORLD_SIZE",
    "PMIX_RANK",
    "PMI_RANK",
];

/// Environment variable with the number of processes that `srun` started. Slurm sets it to 1 also for the
/// shell of an interactive job, and does not set it for a batch script.
const SLURM_TASKS: &str = "SLURM_STEP_NUM_TASKS";

/// Return the name of a variable which shows that a launcher started this process as a rank; `None` without a
/// launcher. Processes that a rank starts inherit these variables. MPI in these processes could then wait
/// forever for the launcher.
pub fn launcher_variable() -> Option<&'static str> {
    let is_set = |name: &&str| std::env::var_os(name).is_some();
    let by_mpi = MPI_LAUNCHERS.into_iter().find(|name| is_set(name));
    let by_slurm = number(&[SLURM_TASKS]).is_some_and(|tasks| tasks > 1);
    by_mpi.or(by_slurm.then_some(SLURM_TASKS))
}

/// Check that the launcher works with the MPI library of this program. With an incompatible launcher, each
/// process would run alone, as rank 0.
///
/// # Errors
/// If MPI has one rank but the launcher started several processes.
fn joined(started: Option<(&str, usize)>, ranks: usize) -> Result<()> {
    match started {
        Some((name, started)) if ranks == 1 && started > 1 => {
            let mpi = comm::mpi::library();
            Err(Error::input(format!(
                "{name} says that {started} ranks were started, but MPI ({mpi}) sees only this one: \
                 the launcher is of another MPI\n\
                 Start with the mpirun of {mpi}, or with srun and the --mpi=… of `srun --mpi=list` \
                 that it was built for, or build fissure with the launcher's MPI; to run on one \
                 rank, unset {name}"
            )))
        }
        _ => Ok(()),
    }
}

/// Return the value of the first of these environment variables that is set to a number.
fn number(names: &[&str]) -> Option<usize> {
    names
        .iter()
        .find_map(|name| std::env::var(name).ok()?.parse().ok())
}

/// Return the rank of this process, from the launcher's environment; `None` without a launcher.
pub fn rank_from_environment() -> Option<usize> {
    number(&[
        "OMPI_COMM_WORLD_RANK",
        "PMIX_RANK",
        "PMI_RANK",
        "SLURM_PROCID",
    ])
}

/// Return the number of ranks on this host, from the launcher's environment; 1 without a launcher.
pub fn ranks_on_host() -> usize {
    number(&[
        "OMPI_COMM_WORLD_LOCAL_SIZE",
        "MPI_LOCALNRANKS",
        "SLURM_NTASKS_PER_NODE",
    ])
    .unwrap_or(1)
    .max(1)
}

/// Return the number of cores available to this process.
pub fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// Environment variable with Slurm's number of cores per task.
const SLURM_CORES: &str = "SLURM_CPUS_PER_TASK";

/// Return the number of threads: the requested number, else Slurm's number of cores per task if it is not 0,
/// else the number of cores of this process. In the last case, if the launcher has not bound the process to
/// cores, the ranks on one host share the cores evenly.
fn threads(asked: Option<u16>) -> usize {
    let share = || {
        let shared_by = if is_bound() { 1 } else { ranks_on_host() };
        (cores() / shared_by).max(1)
    };
    asked
        .map(usize::from)
        .or_else(|| number(&[SLURM_CORES]).filter(|cores| *cores > 0))
        .unwrap_or_else(share)
}

/// Test whether the launcher has bound this process to a part of the host's cores.
fn is_bound() -> bool {
    cores() < cores_of_host()
}

/// Return the number of cores of this host, including the cores that this process may not use.
fn cores_of_host() -> usize {
    let list = std::fs::read_to_string("/sys/devices/system/cpu/online").unwrap_or_default();
    cores_in(&list).max(cores())
}

/// Return the number of cores in a CPU list in Linux's format, such as `0-3,8`.
pub fn cores_in(list: &str) -> usize {
    let range = |range: &str| match range.split_once('-') {
        Some((first, last)) => match (first.parse::<usize>(), last.parse::<usize>()) {
            (Ok(first), Ok(last)) => last + 1 - first,
            _ => 1,
        },
        None => 1,
    };
    let ranges = list.trim().split(',').filter(|range| !range.is_empty());
    ranges.map(range).sum()
}

/// Print a warning if this rank has more threads than cores. Also print a warning if the ranks of this host
/// are not bound to cores and together have more threads than the host has cores.
pub fn warn(threads: usize) {
    if let Some(warning) = warning(threads) {
        errln!("warning: {warning}");
    }
}

fn warning(threads: usize) -> Option<String> {
    let (cores, ranks) = (cores(), ranks_on_host());
    if threads > cores {
        return Some(format!(
            "each rank has {threads} threads but only {cores} core(s); mpirun --bind-to none or \
             --map-by slot:PE={threads} gives it more"
        ));
    }
    if !is_bound() && threads * ranks > cores {
        return Some(format!(
            "{ranks} ranks of {threads} threads share {cores} core(s) of this host"
        ));
    }
    None
}

/// Start the threads of this rank, and return their number. The number is `asked` if it is given. Otherwise,
/// it is a default from Slurm or from the cores of this process.
///
/// # Errors
/// If there are more than `ALWAYS_ALLOWED_THREADS` threads and more than four threads per core of the host,
/// or if the system cannot start the threads.
pub fn start_threads(asked: Option<u16>) -> Result<usize> {
    let threads = threads(asked);
    let most = ALWAYS_ALLOWED_THREADS.max(4 * cores_of_host());
    if threads > most {
        let source = match asked {
            Some(_) => format!("--threads {threads}"),
            None => format!("{SLURM_CORES}={threads} in the environment"),
        };
        return Err(Error::input(format!(
            "{source}: this host has {} cores; {most} threads at most",
            cores_of_host()
        )));
    }
    // This thread joins the pool, because handing work to another thread takes some microseconds.
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .use_current_thread()
        .build_global()
        .map_err(|error| Error::run(format!("cannot start {threads} threads: {error}")))?;
    Ok(threads)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_of_cores() {
        assert_eq!(cores_in("0-3,8\n"), 5);
        assert_eq!(cores_in("2"), 1);
        assert_eq!(cores_in(""), 0);
    }
}
