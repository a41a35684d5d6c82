//! Memory available to this process.

use std::fs;
use std::path::Path;

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

/// Check that this process can allocate `needed` more bytes. Allocations below 64 MiB are not checked.
///
/// # Errors
/// If less memory than `needed` + 64 MiB is available.
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

/// Return the memory that this process can still allocate, bytes. This is the smallest of three amounts: the
/// memory left within the limit of the address space (`ulimit -v`), the memory left in the control group, and
/// the memory left on the machine. `u64::MAX` on systems that report none of the three.
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

/// Return the memory and swap that this process can still use within the limits of its control groups,
/// bytes. These groups are the group of the process and all groups above it. The result is the smallest
/// amount that is left in any of these groups. `None` if none of these groups has a limit, or on systems
/// without control groups of version 2.
fn control_group() -> Option<u64> {
    let groups = fs::read_to_string("/proc/self/cgroup").ok()?;
    let path = groups.lines().find_map(|line| line.strip_prefix("0::/"))?;
    left_in_groups(Path::new("/sys/fs/cgroup"), Path::new(path))
}

/// Compute the memory and swap that is left in the control group `path` below `root`, and in each group above
/// it. Return the smallest of these amounts, bytes; `None` if none of these groups has a limit.
fn left_in_groups(root: &Path, path: &Path) -> Option<u64> {
    let groups = path.ancestors().map(|group| root.join(group));
    groups.filter_map(|group| left_in_group(&group)).min()
}

/// Return the memory and swap left in the control group with this folder, bytes. `None` if the group has no
/// limit, or if its files cannot be read.
fn left_in_group(group: &Path) -> Option<u64> {
    let read = |name: &str| fs::read_to_string(group.join(name)).ok();
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

/// Read the number of KiB after `name` from a file, and return the number of bytes. `None` if the file cannot
/// be read or has no such number.
fn kibibytes(path: &str, name: &str) -> Option<u64> {
    entry(&fs::read_to_string(path).ok()?, name).map(|kibibytes| 1024 * kibibytes)
}

/// Return the number after `name` in the first line that starts with `name`; `None` without such a line or
/// number.
fn entry(text: &str, name: &str) -> Option<u64> {
    let rest = text.lines().find_map(|line| line.strip_prefix(name))?;
    rest.split_whitespace().next()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Slurm sets the memory limit on the control group of a job or step. The control group of the process
    /// lies below this group.
    #[test]
    fn limits_of_parent_groups_count() {
        let root = std::env::temp_dir().join(format!("control_groups_{}", std::process::id()));
        let task = Path::new("job/step/task");
        fs::create_dir_all(root.join(task)).unwrap();
        let write = |group: &str, limit: &str, taken: &str| {
            let files = [
                ("memory.max", limit),
                ("memory.current", taken),
                ("memory.stat", "anon 5\ninactive_file 20\n"),
                ("memory.swap.max", "0"),
                ("memory.swap.current", "0"),
            ];
            for (name, text) in files {
                fs::write(root.join(group).join(name), text).unwrap();
            }
        };
        assert_eq!(left_in_groups(&root, task), None);
        write("job/step/task", "max", "300");
        write("job/step", "1000", "400");
        assert_eq!(left_in_groups(&root, task), Some(620));
        write("job", "700", "500");
        assert_eq!(left_in_groups(&root, task), Some(220));
        write("job/step/task", "310", "300");
        assert_eq!(left_in_groups(&root, task), Some(30));
        fs::remove_dir_all(root).unwrap();
    }

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
