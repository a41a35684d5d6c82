//! How this process was launched: its rank before MPI has started, its cores and its threads.

use fissure::error::{Error, Result};

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
    let Ok(list) = std::fs::read_to_string("/sys/devices/system/cpu/online") else {
        return false;
    };
    let online: usize = list
        .trim()
        .split(',')
        .map(|range| match range.split_once('-') {
            Some((first, last)) => {
                let bounds = (first.parse::<usize>(), last.parse::<usize>());
                if let (Ok(first), Ok(last)) = bounds {
                    last + 1 - first
                } else {
                    1
                }
            }
            None => 1,
        })
        .sum();
    cores() < online
}

/// What is wrong with the way that threads and cores fit together, if anything.
pub fn warning(threads: usize) -> Option<String> {
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
/// When the system refuses.
pub fn start_threads(threads: usize) -> Result<()> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .build_global()
        .map_err(|error| Error::run(format!("cannot start {threads} threads: {error}")))
}
