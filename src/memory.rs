//! Memory that this process can still allocate.

use std::fs;

/// Smaller allocations are not compared with the memory that is left, which takes some system calls, bytes. As much is
/// left for everything else.
const LARGE: u64 = 64 << 20;

/// More memory is needed than there is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shortage {
    /// What is needed, bytes.
    pub needed: u64,
    /// What this process can still allocate, bytes.
    pub available: u64,
}

/// Check that this process can allocate so many bytes more.
///
/// # Errors
/// When it cannot.
pub fn check_room(needed: u64) -> Result<(), Shortage> {
    if needed < LARGE {
        return Ok(());
    }
    let available = available();
    if needed.saturating_add(LARGE) > available {
        return Err(Shortage { needed, available });
    }
    Ok(())
}

/// Bytes that this process can still allocate: the least that its limit on address space (`ulimit -v`), its control group
/// and the machine leave; the largest number where the system tells none of them (Linux does).
fn available() -> u64 {
    let limits = [address_space(), control_group(), machine()];
    limits.into_iter().flatten().min().unwrap_or(u64::MAX)
}

fn address_space() -> Option<u64> {
    let mut limit = libc::rlimit {
        rlim_cur: 0,
        rlim_max: 0,
    };
    // SAFETY: the call fills in the structure.
    let failed = unsafe { libc::getrlimit(libc::RLIMIT_AS, &raw mut limit) } != 0;
    if failed || limit.rlim_cur == libc::RLIM_INFINITY {
        return None;
    }
    let taken = kibibytes("/proc/self/status", "VmSize:")?;
    Some(limit.rlim_cur.saturating_sub(taken))
}

/// Version 2 only.
fn control_group() -> Option<u64> {
    let groups = fs::read_to_string("/proc/self/cgroup").ok()?;
    let path = groups.lines().find_map(|line| line.strip_prefix("0::"))?;
    let read = |name: &str| fs::read_to_string(format!("/sys/fs/cgroup{path}/{name}")).ok();
    let number = |name: &str| read(name)?.trim().parse::<u64>().ok();
    let (most, taken) = (number("memory.max")?, number("memory.current")?);
    // The system gives up cached files before it refuses memory.
    let cached = entry(&read("memory.stat")?, "inactive_file ")?;
    let swap = match (number("memory.swap.max"), number("memory.swap.current")) {
        (Some(most), Some(taken)) => most.saturating_sub(taken),
        _ => free_swap()?,
    };
    Some(most.saturating_sub(taken.saturating_sub(cached)) + swap)
}

fn machine() -> Option<u64> {
    Some(kibibytes("/proc/meminfo", "MemAvailable:")? + free_swap()?)
}

fn free_swap() -> Option<u64> {
    kibibytes("/proc/meminfo", "SwapFree:")
}

/// A number of kibibytes of a file, as bytes.
fn kibibytes(path: &str, name: &str) -> Option<u64> {
    entry(&fs::read_to_string(path).ok()?, name).map(|kibibytes| 1024 * kibibytes)
}

/// The number after a name at the begin of a line.
fn entry(text: &str, name: &str) -> Option<u64> {
    let rest = text.lines().find_map(|line| line.strip_prefix(name))?;
    rest.split_whitespace().next()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_than_any_machine_has_is_refused() {
        assert_eq!(check_room(LARGE), Ok(()));
        let needed = 1 << 60;
        let shortage = check_room(needed).unwrap_err();
        assert_eq!(shortage.needed, needed);
        assert!(
            (LARGE..needed).contains(&shortage.available),
            "{shortage:?}"
        );
    }
}
