//! Wall-clock limits in Slurm's format.

use std::time::Duration;

/// Parse `HH:MM`, `HH:MM:SS` or `D-HH:MM:SS`.
///
/// # Errors
/// If the text has another format or a number is too large; the message names the allowed formats.
pub fn wall_time(text: &str) -> std::result::Result<Duration, String> {
    let wrong = || format!("`{text}` must be HH:MM, HH:MM:SS or D-HH:MM:SS");
    let (days, clock) = match text.split_once('-') {
        Some((days, clock)) => (days.parse::<u64>().map_err(|_| wrong())?, clock),
        None => (0, text),
    };
    let parts: Vec<u64> = clock
        .split(':')
        .map(|part| part.parse().map_err(|_| wrong()))
        .collect::<std::result::Result<_, _>>()?;
    let [hours, minutes, seconds] = match parts[..] {
        [hours, minutes] => [hours, minutes, 0],
        [hours, minutes, seconds] => [hours, minutes, seconds],
        _ => return Err(wrong()),
    };
    if minutes > 59 || seconds > 59 || days > 10_000 || hours > 1_000_000 {
        return Err(wrong());
    }
    Ok(Duration::from_secs(
        ((days * 24 + hours) * 60 + minutes) * 60 + seconds,
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wall_times_in_the_format_of_slurm() {
        let seconds = |text| wall_time(text).map(|time| time.as_secs());
        assert_eq!(seconds("23:50"), Ok(85_800));
        assert_eq!(seconds("0:00:07"), Ok(7));
        assert_eq!(seconds("2-00:00:01"), Ok(172_801));
        for wrong in ["90", "1:60", "1:2:3:4", "x:10", "-1:10"] {
            assert!(seconds(wrong).is_err(), "{wrong}");
        }
    }
}
