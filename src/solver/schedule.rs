//! At which steps something is written.

use crate::deck::plan::Interval;

/// Step numbers from an interval; always 0 and the last one.
#[derive(Debug, Clone, Copy)]
pub struct Schedule {
    interval: Interval,
    step: f64,
    last: u64,
}

impl Schedule {
    /// For steps of `step` seconds, numbered to `last`.
    pub fn new(interval: Interval, step: f64, last: u64) -> Self {
        Self {
            interval,
            step,
            last,
        }
    }

    /// Whether something is due after this step: the first one that reaches a multiple of the
    /// interval, up to rounding.
    pub fn is_due(&self, number: u64) -> bool {
        if number == 0 || number == self.last {
            return true;
        }
        match self.interval {
            Interval::Steps(steps) => number.is_multiple_of(steps),
            Interval::Seconds(seconds) => {
                let reached = |number: u64| (number as f64 * self.step / seconds + 1e-9).floor();
                reached(number) > reached(number - 1)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn due(interval: Interval, step: f64, last: u64) -> Vec<u64> {
        let schedule = Schedule::new(interval, step, last);
        (0..=last)
            .filter(|number| schedule.is_due(*number))
            .collect()
    }

    #[test]
    fn seconds_and_steps() {
        assert_eq!(due(Interval::Seconds(0.3), 0.1, 10), [0, 3, 6, 9, 10]);
        assert_eq!(due(Interval::Seconds(0.25), 0.1, 10), [0, 3, 5, 8, 10]);
        assert_eq!(due(Interval::Steps(4), 0.1, 10), [0, 4, 8, 10]);
        assert_eq!(due(Interval::Seconds(0.01), 0.1, 3), [0, 1, 2, 3]);
    }
}
