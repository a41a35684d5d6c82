//! How this process was launched: its rank before MPI has started, its cores and its threads.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::process::ExitCode;
use std::time::Duration;

use fissure::comm::mpi::World;
use fissure::comm::{self, Communicator};
use fissure::error::{Error, Result};
use fissure::run::start_mpi;

use super::{errln, finish};

/// Threads that no host is asked too much with.
const MOST_THREADS: usize = 64;

/// Starts MPI, runs `body` on all ranks, and ends MPI. Its errors must be the same on all ranks.
pub fn on_all_ranks(body: impl FnOnce(&World) -> Result<ExitCode>) -> ExitCode {
    // MPI may set such variables for a process that it finds alone.
    let (started, rank) = (started(), rank_from_environment());
    let world = match start_mpi() {
        Ok(world) => world,
        Err(error) => return finish(Err(error), true),
    };
    if let Err(error) = joined(started, world.size()) {
        let speaks = rank.unwrap_or(0) == 0;
        if !speaks {
            // The launcher ends all processes as soon as one has failed.
            std::thread::sleep(TIME_TO_SPEAK);
        }
        return finish(Err(error), speaks);
    }
    let speaks = world.rank() == 0;
    // A panic on one rank would leave the others waiting; its message has been printed.
    catch_unwind(AssertUnwindSafe(|| body(&world)))
        .unwrap_or_else(|_| world.abort(1))
        .unwrap_or_else(|error| finish(Err(error), speaks))
}

/// How long the other processes of a launcher wait for the first one to print an error.
const TIME_TO_SPEAK: Duration = Duration::from_secs(1);

/// Where launchers say how many processes they have started, the innermost launcher first.
const SIZES: [&str; 5] = [
    "OMPI_COMM_WORLD_SIZE",
    "MV2_COMM_WORLD_SIZE",
    "PMI_SIZE",
    "MPI_LOCALNRANKS",
    "SLURM_STEP_NUM_TASKS",
];

/// How many processes the launcher has started, and which variable says so; `None` without a launcher.
fn started() -> Option<(&'static str, usize)> {
    SIZES
        .iter()
        .find_map(|name| Some((*name, number(&[name])?)))
}

/// Refuses a launcher that MPI does not know, whose processes would each run alone.
///
/// # Errors
/// MPI sees one rank, and the launcher says that it has started several.
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

/// The first of some environment variables that holds a number.
fn number(names: &[&str]) -> Option<usize> {
    names
        .iter()
        .find_map(|name| std::env::var(name).ok()?.parse().ok())
}

/// This process's rank as the launcher tells it before MPI has started; `None` without a launcher.
pub fn rank_from_environment() -> Option<usize> {
    number(&[
        "OMPI_COMM_WORLD_RANK",
        "PMIX_RANK",
        "PMI_RANK",
        "SLURM_PROCID",
    ])
}

/// The number of ranks on this host as the launcher tells it.
pub fn ranks_on_host() -> usize {
    number(&[
        "OMPI_COMM_WORLD_LOCAL_SIZE",
        "MPI_LOCALNRANKS",
        "SLURM_NTASKS_PER_NODE",
    ])
    .unwrap_or(1)
    .max(1)
}

/// The cores that this process may use.
pub fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// The number of threads: as asked for, or as Slurm gives cores to a task, or an even share of the
/// cores that this process may use.
pub fn threads(asked: Option<u16>) -> usize {
    let share = || {
        let shared_by = if is_bound() { 1 } else { ranks_on_host() };
        (cores() / shared_by).max(1)
    };
    asked
        .map(usize::from)
        .or_else(|| number(&["SLURM_CPUS_PER_TASK"]))
        .unwrap_or_else(share)
}

/// Whether the launcher has bound this process to fewer cores than the host has.
fn is_bound() -> bool {
    cores() < cores_of_host()
}

/// The cores of this host, as far as the system tells.
fn cores_of_host() -> usize {
    let list = std::fs::read_to_string("/sys/devices/system/cpu/online").unwrap_or_default();
    cores_in(&list).max(cores())
}

/// The number of cores in a list such as `0-3,8`, as Linux writes them; 0 of an empty one.
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

/// Says what is wrong with the way that threads and cores fit together, if anything.
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

/// Sets up the threads of this rank.
///
/// # Errors
/// When there are far more than cores, or the system refuses.
pub fn start_threads(threads: usize) -> Result<()> {
    let most = MOST_THREADS.max(4 * cores_of_host());
    if threads > most {
        return Err(Error::input(format!(
            "--threads {threads}: this host has {} cores; {most} threads at most",
            cores_of_host()
        )));
    }
    // This thread is one of them: work that it hands out and then waits for would begin some microseconds later.
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .use_current_thread()
        .build_global()
        .map_err(|error| Error::run(format!("cannot start {threads} threads: {error}")))
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
