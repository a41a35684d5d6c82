//! At which steps something is written.

use crate::problem::Interval;
use crate::solver::motion::Clock;

/// When an interval says that something is due; always at the start and at the end.
#[derive(Debug, Clone, Copy)]
pub struct Schedule(pub Interval);

impl Schedule {
    /// Whether something is due now: after the first step that reaches a multiple of the interval, up
    /// to rounding.
    pub fn is_due(&self, clock: &Clock) -> bool {
        if clock.number() == 0 || clock.is_over() {
            return true;
        }
        let passed =
            |seconds, before| multiples(clock.time(), seconds) > multiples(before, seconds);
        match self.0 {
            Interval::Steps(steps) => clock.number().is_multiple_of(steps),
            Interval::Seconds(seconds) => passed(seconds, clock.time_before()),
            Interval::SecondsAtSteps { seconds, steps } => {
                // Where steps change, as long before as it would be with the present one.
                let before = clock.time() - steps as f64 * clock.step();
                clock.number().is_multiple_of(steps) && passed(seconds, before)
            }
        }
    }

    /// How many times something is due in the whole run, if the step keeps its size.
    pub fn count(&self, clock: &Clock) -> u64 {
        let last = clock.last();
        let multiples = |number: u64| match self.0 {
            Interval::Steps(steps) => (number / steps) as f64,
            Interval::Seconds(seconds) => multiples(number as f64 * clock.step(), seconds),
            Interval::SecondsAtSteps { seconds, steps } => {
                let rounds = (number / steps) as f64;
                multiples(rounds * steps as f64 * clock.step(), seconds).min(rounds)
            }
        };
        let [whole, before] = [last, last - 1].map(multiples);
        // At the end as well, which may be a multiple itself.
        1 + (whole as u64).min(last) + u64::from(whole == before)
    }
}

/// How many times an interval (s) has passed at a time (s), up to rounding.
fn multiples(time: f64, seconds: f64) -> f64 {
    (time / seconds + 1e-9).floor()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn due(interval: Interval, step: f64, last: u64) -> Vec<u64> {
        let schedule = Schedule(interval);
        let mut clock = Clock::new(step, last as f64 * step);
        let mut due = vec![0];
        while !clock.is_over() {
            clock.advance();
            if schedule.is_due(&clock) {
                due.push(clock.number());
            }
        }
        assert_eq!(schedule.count(&clock), due.len() as u64);
        due
    }

    #[test]
    fn seconds_and_steps() {
        assert_eq!(due(Interval::Seconds(0.3), 0.1, 10), [0, 3, 6, 9, 10]);
        assert_eq!(due(Interval::Seconds(0.25), 0.1, 10), [0, 3, 5, 8, 10]);
        assert_eq!(due(Interval::Steps(4), 0.1, 10), [0, 4, 8, 10]);
        assert_eq!(due(Interval::Seconds(0.01), 0.1, 3), [0, 1, 2, 3]);
        let seldom = |seconds| Interval::SecondsAtSteps { seconds, steps: 4 };
        assert_eq!(due(seldom(0.01), 0.1, 10), [0, 4, 8, 10]);
        assert_eq!(due(seldom(0.01), 0.1, 8), [0, 4, 8]);
        assert_eq!(due(seldom(0.6), 0.1, 20), [0, 8, 12, 20]);
    }
}
