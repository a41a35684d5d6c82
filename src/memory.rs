//! Memory available to this process.

use std::fs;

/// [`check_room`] does not check allocations below this size (bytes), to save system calls. A checked
/// allocation must leave this number of bytes free for other allocations.
const LARGE: u64 = 64 << 20;

/// Insufficient memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shortage {
    /// Needed memory, bytes.
    pub needed: u64,
    /// Memory available to this process, bytes.
    pub available: u64,
}

/// Check that this process can allocate `needed` more bytes.
///
/// # Errors
/// If the available memory is too small.
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

/// Return the memory that this process can still allocate, bytes: the smallest of the amounts that the limit
/// of the address space (`ulimit -v`), the control group and the machine leave. `u64::MAX` on systems that
/// report none of the three.
fn available() -> u64 {
    let limits = [address_space(), control_group(), machine()];
    limits.into_iter().flatten().min().unwrap_or(u64::MAX)
}

fn address_space() -> Option<u64> {
    let mut limit = libc::rlimit {
        rlim_cur: 0,
        rlim_max: 0,
    };
    // SAFETY: the pointer is valid for the call, which fills in the structure.
    let failed = unsafe { libc::getrlimit(libc::RLIMIT_AS, &raw mut limit) } != 0;
    if failed || limit.rlim_cur == libc::RLIM_INFINITY {
        return None;
    }
    let taken = kibibytes("/proc/self/status", "VmSize:")?;
    Some(limit.rlim_cur.saturating_sub(taken))
}

/// Return the memory and swap left in this process's control group, bytes. `None` if the group has no limit,
/// or on systems without control groups of version 2. Limits of parent groups are not read.
fn control_group() -> Option<u64> {
    let groups = fs::read_to_string("/proc/self/cgroup").ok()?;
    let path = groups.lines().find_map(|line| line.strip_prefix("0::"))?;
    let read = |name: &str| fs::read_to_string(format!("/sys/fs/cgroup{path}/{name}")).ok();
    let number = |name: &str| read(name)?.trim().parse::<u64>().ok();
    let (limit, taken) = (number("memory.max")?, number("memory.current")?);
    // The kernel frees inactive file cache before an allocation fails.
    let cached = entry(&read("memory.stat")?, "inactive_file ")?;
    let swap = match (number("memory.swap.max"), number("memory.swap.current")) {
        (Some(limit), Some(taken)) => limit.saturating_sub(taken),
        _ => free_swap()?,
    };
    Some(limit.saturating_sub(taken.saturating_sub(cached)) + swap)
}

fn machine() -> Option<u64> {
    Some(kibibytes("/proc/meminfo", "MemAvailable:")? + free_swap()?)
}

fn free_swap() -> Option<u64> {
    kibibytes("/proc/meminfo", "SwapFree:")
}

/// Read an entry of a file that gives the entry in KiB, and return it in bytes.
fn kibibytes(path: &str, name: &str) -> Option<u64> {
    entry(&fs::read_to_string(path).ok()?, name).map(|kibibytes| 1024 * kibibytes)
}

/// Return the number after `name` in the first line that starts with `name`.
fn entry(text: &str, name: &str) -> Option<u64> {
    let rest = text.lines().find_map(|line| line.strip_prefix(name))?;
    rest.split_whitespace().next()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_excessive_allocation_is_refused() {
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
