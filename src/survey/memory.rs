//! The memory of this process as the system counts it.

/// What of this process is in memory, bytes.
#[derive(Debug, Clone, Copy)]
pub struct Resident {
    /// Now.
    pub now: f64,
    /// The most that there has been.
    pub peak: f64,
}

/// What of this process is in memory; NaN where the system does not tell (Linux does).
pub fn resident() -> Resident {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let entry = |name: &str| {
        let line = status.lines().find_map(|line| line.strip_prefix(name));
        let kibibytes = line.and_then(|rest| rest.split_whitespace().next()?.parse::<f64>().ok());
        kibibytes.map_or(f64::NAN, |kibibytes| 1024.0 * kibibytes)
    };
    Resident {
        now: entry("VmRSS:"),
        peak: entry("VmHWM:"),
    }
}

/// Forgets the most that there has been, and returns what is in memory now, bytes; `None` where the system
/// cannot forget (Linux can).
pub fn forget_peak() -> Option<f64> {
    std::fs::write("/proc/self/clear_refs", "5").ok()?;
    Some(resident().now)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_written_to_is_counted() {
        let before = resident();
        let block = std::hint::black_box(vec![1_u8; 64 << 20]);
        let after = resident();
        assert!(after.now - before.now > 6e7 && block[0] == 1);
        assert!(after.peak >= after.now);
    }
}
