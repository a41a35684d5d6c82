//! The clock of a run: time, time step and number of steps.

/// Time, time step and number of steps. The time step may change. The time that has passed since
/// the last change is computed as a multiple of the time step, so round-off does not accumulate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Clock {
    /// Time (s) and number of completed steps at the last change of the time step.
    since: (f64, u64),
    /// Time before the last step, s.
    before: f64,
    step: f64,
    number: u64,
    end: f64,
}

impl Clock {
    /// Create a clock at time 0 with steps of `step` (s) until `end` (s).
    pub fn new(step: f64, end: f64) -> Self {
        Self {
            since: (0.0, 0),
            before: 0.0,
            step,
            number: 0,
            end,
        }
    }

    /// Encode the clock, except its end, for a checkpoint.
    pub fn words(&self) -> [u64; 5] {
        let [since, before, step] = [self.since.0, self.before, self.step].map(f64::to_bits);
        [since, self.since.1, before, step, self.number]
    }

    /// Decode a clock from [`Self::words`], in a stage that ends at `end` (s).
    pub fn of_words([since, at, before, step, number]: [u64; 5], end: f64) -> Self {
        let [since, before, step] = [since, before, step].map(f64::from_bits);
        Self {
            since: (since, at),
            before,
            step,
            number,
            end,
        }
    }

    /// Present time, s.
    pub fn time(&self) -> f64 {
        let (time, number) = self.since;
        time + (self.number - number) as f64 * self.step
    }

    /// Time before the last step, s.
    pub fn time_before(&self) -> f64 {
        self.before
    }

    /// Present time step, s.
    pub fn step(&self) -> f64 {
        self.step
    }

    /// Number of completed steps.
    pub fn number(&self) -> u64 {
        self.number
    }

    /// End of the present stage, s.
    pub fn end(&self) -> f64 {
        self.end
    }

    /// Advance by one step.
    pub fn advance(&mut self) {
        self.before = self.time();
        self.number += 1;
    }

    /// Set the time step to `step` (s), from the present time on.
    pub fn set_step(&mut self, step: f64) {
        self.since = (self.time(), self.number);
        self.step = step;
    }

    /// Return to the time before the last step, and continue from there with steps of `step` (s).
    pub fn retreat(&mut self, step: f64) {
        self.number -= 1;
        self.since = (self.before, self.number);
        self.step = step;
    }

    /// Whether the time step has been set since the last completed step, or no step has been completed.
    pub fn is_new_size(&self) -> bool {
        self.number == self.since.1
    }

    /// Begin a stage at the present time, with steps of `step` (s) until `end` (s).
    pub fn set_stage(&mut self, step: f64, end: f64) {
        self.set_step(step);
        self.end = end;
    }

    /// Number of completed steps at the end of the stage, if the time step does not change.
    pub fn last(&self) -> u64 {
        let (time, number) = self.since;
        number + steps_to(self.end - time, self.step) as u64
    }

    /// Whether the end of the stage has been reached.
    pub fn is_over(&self) -> bool {
        self.number >= self.last()
    }
}

/// Number of steps of length `step` (s) in a duration `time` (s), rounded up, but at least 1. A fraction of a
/// step that is only round-off does not count.
pub fn steps_to(time: f64, step: f64) -> f64 {
    let steps = time / step;
    let whole = if (steps - steps.round()).abs() < 1e-9 * steps {
        steps.round()
    } else {
        steps.ceil()
    };
    whole.max(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_is_a_multiple_of_the_step() {
        let mut clock = Clock::new(0.1, 1.0);
        assert_eq!(clock.last(), 10);
        for number in 1..=10 {
            assert!(!clock.is_over());
            clock.advance();
            assert_eq!(clock.time(), number as f64 * 0.1);
            assert_eq!(clock.time_before(), (number - 1) as f64 * 0.1);
        }
        assert!(clock.is_over());
        assert_eq!(Clock::of_words(clock.words(), 1.0), clock);
    }

    #[test]
    fn the_step_may_change() {
        let mut clock = Clock::new(0.25, 1.0);
        clock.advance();
        clock.advance();
        assert!(!clock.is_new_size());
        clock.set_step(0.125);
        assert!(clock.is_new_size());
        assert_eq!((clock.time(), clock.last()), (0.5, 6));
        clock.advance();
        assert_eq!((clock.time(), clock.time_before()), (0.625, 0.5));
        clock.set_step(0.375);
        clock.advance();
        assert_eq!(clock.time(), 1.0);
        assert!(clock.is_over());
        assert_eq!(Clock::of_words(clock.words(), 1.0), clock);
    }

    #[test]
    fn steps_that_fit_but_for_rounding() {
        assert_eq!(steps_to(1.0, 0.1), 10.0);
        assert_eq!(steps_to(1.05, 0.1), 11.0);
        assert_eq!(steps_to(1e-9, 0.1), 1.0);
    }
}
