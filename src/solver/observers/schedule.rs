//! Schedule of the steps at which output is written.

use crate::problem::{Interval, Output};
use crate::solver::motion::Clock;

/// Schedule of output: at the start, after intervals, at given times, and at the end of each stage.
#[derive(Debug, Clone)]
pub struct Schedule {
    interval: Option<Interval>,
    /// Given times in ascending order, s.
    times: Vec<f64>,
}

impl Schedule {
    /// Create a schedule with this interval and without given times.
    pub fn every(interval: Interval) -> Self {
        Self {
            interval: Some(interval),
            times: Vec::new(),
        }
    }

    /// Create the schedule of the outputs of a result.
    pub fn of_outputs(output: &Output) -> Self {
        Self {
            interval: output.every,
            times: output.times.clone(),
        }
    }

    /// Whether output is due. Output is due at the start and at the end of a stage. Output is also due in the
    /// first step that reaches a multiple of the interval or one of the given times, up to round-off.
    pub fn is_due(&self, clock: &Clock) -> bool {
        if clock.number() == 0 || clock.is_over() {
            return true;
        }
        let (time, before) = (clock.time(), clock.time_before());
        self.reached(time) > self.reached(before) || self.is_interval_over(clock, before)
    }

    /// Whether the last step, which began at `before` (s), reached a multiple of the interval.
    fn is_interval_over(&self, clock: &Clock, before: f64) -> bool {
        let passed =
            |seconds, before| multiples(clock.time(), seconds) > multiples(before, seconds);
        match self.interval {
            None => false,
            Some(Interval::Steps(steps)) => clock.number().is_multiple_of(steps),
            Some(Interval::Seconds(seconds)) => passed(seconds, before),
            Some(Interval::SecondsAtSteps { seconds, steps }) => {
                // Time `steps` steps ago, at the previous check, if the time step has not changed since then.
                let before = clock.time() - steps as f64 * clock.step();
                clock.number().is_multiple_of(steps) && passed(seconds, before)
            }
        }
    }

    /// Number of given times that are at most `time` (s), up to round-off.
    fn reached(&self, time: f64) -> usize {
        self.times
            .partition_point(|given| given * (1.0 - ROUNDING) <= time)
    }

    /// Number of outputs of the whole run, if the step does not change.
    pub fn count(&self, clock: &Clock) -> u64 {
        let (last, step) = (clock.last(), clock.step());
        let multiples = |number: u64| match self.interval {
            None => 0.0,
            Some(Interval::Steps(steps)) => (number / steps) as f64,
            Some(Interval::Seconds(seconds)) => multiples(number as f64 * step, seconds),
            Some(Interval::SecondsAtSteps { seconds, steps }) => {
                let rounds = (number / steps) as f64;
                multiples(rounds * steps as f64 * step, seconds).min(rounds)
            }
        };
        let [whole, before] = [last, last - 1].map(multiples);
        // The output at the end counts once, even if the end is a multiple of the interval.
        let intervals = 1 + (whole as u64).min(last) + u64::from(whole == before);
        let steps = self.times.iter().map(|given| {
            // The first step that reaches the given time, up to round-off.
            let steps = (given * (1.0 - ROUNDING) / step).ceil();
            steps as u64
        });
        let mut steps: Vec<u64> = steps.collect();
        steps.dedup();
        let is_further = |number: &&u64| {
            (1..last).contains(*number) && multiples(**number) == multiples(**number - 1)
        };
        intervals + steps.iter().filter(is_further).count() as u64
    }
}

/// Relative round-off of the clock: a step that falls short of a given time by less than this fraction counts
/// as reaching this time.
const ROUNDING: f64 = 1e-12;

/// Number of whole intervals of length `seconds` in `time` (s), up to round-off.
fn multiples(time: f64, seconds: f64) -> f64 {
    (time / seconds + 1e-9).floor()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn due(interval: Option<Interval>, times: &[f64], step: f64, last: u64) -> Vec<u64> {
        let times = times.to_vec();
        let schedule = Schedule { interval, times };
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
        let due = |interval, step, last| due(Some(interval), &[], step, last);
        assert_eq!(due(Interval::Seconds(0.3), 0.1, 10), [0, 3, 6, 9, 10]);
        assert_eq!(due(Interval::Seconds(0.25), 0.1, 10), [0, 3, 5, 8, 10]);
        assert_eq!(due(Interval::Steps(4), 0.1, 10), [0, 4, 8, 10]);
        assert_eq!(due(Interval::Seconds(0.01), 0.1, 3), [0, 1, 2, 3]);
        let seldom = |seconds| Interval::SecondsAtSteps { seconds, steps: 4 };
        assert_eq!(due(seldom(0.01), 0.1, 10), [0, 4, 8, 10]);
        assert_eq!(due(seldom(0.01), 0.1, 8), [0, 4, 8]);
        assert_eq!(due(seldom(0.6), 0.1, 20), [0, 8, 12, 20]);
    }

    #[test]
    fn given_times() {
        // Output is due at the first step that reaches a given time; once if a step reaches several times.
        assert_eq!(
            due(None, &[0.3, 0.55, 0.58, 0.7], 0.1, 10),
            [0, 3, 6, 7, 10]
        );
        assert_eq!(due(None, &[0.0, 1.0], 0.1, 10), [0, 10]);
        assert_eq!(due(None, &[0.93], 0.1, 10), [0, 10]);
        // Given times combined with an interval.
        let every = |steps| Some(Interval::Steps(steps));
        assert_eq!(due(every(4), &[0.35, 0.72], 0.1, 10), [0, 4, 8, 10]);
        assert_eq!(due(every(4), &[0.1, 0.45], 0.1, 10), [0, 1, 4, 5, 8, 10]);
        let seconds = Some(Interval::Seconds(0.25));
        assert_eq!(due(seconds, &[0.4, 0.5], 0.1, 10), [0, 3, 4, 5, 8, 10]);
        // Time steps whose multiples are not exact in floating point.
        for step in [0.1, 1e-8 / 3.0, 7.3e-9] {
            let times: Vec<f64> = [3, 10, 700, 99_999].map(|k| f64::from(k) * step).to_vec();
            assert_eq!(
                due(None, &times, step, 100_000),
                [0, 3, 10, 700, 99_999, 100_000]
            );
        }
    }

    #[test]
    fn given_times_with_steps_that_change() {
        let schedule = Schedule {
            interval: None,
            times: vec![0.3, 0.35, 0.6],
        };
        let mut clock = Clock::new(0.1, 1.0);
        let mut due = Vec::new();
        while !clock.is_over() {
            clock.advance();
            if schedule.is_due(&clock) {
                due.push(clock.time());
            }
            if clock.number() == 3 {
                clock.set_step(0.05);
            }
        }
        let expected = [0.3, 0.35, 0.6, 1.0];
        assert_eq!(due.len(), expected.len(), "{due:?}");
        for (due, expected) in due.iter().zip(expected) {
            assert!((due - expected).abs() < 1e-12, "{due} {expected}");
        }
    }
}
