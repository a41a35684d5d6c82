//! Resident memory of this process.

/// Resident memory, bytes.
#[derive(Debug, Clone, Copy)]
pub struct Resident {
    /// Current resident memory.
    pub now: f64,
    /// Largest resident memory since the start of the process or the last [reset](reset_peak).
    pub peak: f64,
}

/// Read the resident memory; NaN on systems other than Linux.
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

/// Reset the peak and return the current resident memory, bytes. `None` if the peak cannot be reset, as on
/// systems other than Linux.
pub fn reset_peak() -> Option<f64> {
    std::fs::write("/proc/self/clear_refs", "5").ok()?;
    Some(resident().now)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn written_memory_is_resident() {
        let before = resident();
        let block = std::hint::black_box(vec![1_u8; 64 << 20]);
        let after = resident();
        assert!(after.now - before.now > 6e7 && block[0] == 1);
        assert!(after.peak >= after.now);
    }
}
