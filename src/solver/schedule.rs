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
            Interval::Seconds(_) => self.reaches(number),
        }
    }

    /// Whether a multiple of the seconds is reached in this step.
    fn reaches(&self, number: u64) -> bool {
        let Interval::Seconds(seconds) = self.interval else {
            return false;
        };
        let multiple = |number: u64| (number as f64 * self.step / seconds + 1e-9).floor();
        multiple(number) > multiple(number - 1)
    }

    /// How many times something is due.
    pub fn count(&self) -> u64 {
        let times = match self.interval {
            Interval::Steps(steps) => self.last / steps,
            Interval::Seconds(seconds) => {
                let whole = (self.last as f64 * self.step / seconds + 1e-9).floor();
                (whole as u64).min(self.last)
            }
        };
        // Before the last step as often as that, or once less if the last one is a multiple itself.
        let last_is_extra = match self.interval {
            Interval::Steps(steps) => !self.last.is_multiple_of(steps),
            Interval::Seconds(_) => !self.reaches(self.last),
        };
        1 + times + u64::from(last_is_extra)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn due(interval: Interval, step: f64, last: u64) -> Vec<u64> {
        let schedule = Schedule::new(interval, step, last);
        let due: Vec<u64> = (0..=last)
            .filter(|number| schedule.is_due(*number))
            .collect();
        assert_eq!(schedule.count(), due.len() as u64);
        due
    }

    #[test]
    fn seconds_and_steps() {
        assert_eq!(due(Interval::Seconds(0.3), 0.1, 10), [0, 3, 6, 9, 10]);
        assert_eq!(due(Interval::Seconds(0.25), 0.1, 10), [0, 3, 5, 8, 10]);
        assert_eq!(due(Interval::Steps(4), 0.1, 10), [0, 4, 8, 10]);
        assert_eq!(due(Interval::Seconds(0.01), 0.1, 3), [0, 1, 2, 3]);
    }
}
