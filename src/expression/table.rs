//! Tables of values over time, with linear interpolation.

/// A piecewise linear function of time.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// Times in s, strictly increasing.
    times: Vec<f64>,
    values: Vec<f64>,
}

impl Table {
    /// Create a table of times (s) and values of the same count.
    ///
    /// # Errors
    /// If there are fewer than two rows, the counts differ, a number is not finite, or the times do not
    /// increase. The error holds a message and the index of a row, counted from 0. If there are too few rows
    /// or the counts differ, this is the index of the last row. Otherwise, it is the index of the first row
    /// with a wrong number, or with a time that is not larger than the time of the row before it.
    pub fn new(times: Vec<f64>, values: Vec<f64>) -> Result<Self, (usize, String)> {
        let last = times.len().saturating_sub(1);
        if times.len() != values.len() {
            let (times, values) = (times.len(), values.len());
            let message =
                format!("needs as many values as times, has {times} times and {values} values");
            return Err((last, message));
        }
        if times.len() < 2 {
            let message = format!("needs two rows or more, has {}", times.len());
            return Err((last, message));
        }
        for (name, numbers) in [("time", &times), ("value", &values)] {
            if let Some(row) = numbers.iter().position(|number| !number.is_finite()) {
                return Err((row, format!("{name} must be finite, is {}", numbers[row])));
            }
        }
        for (k, pair) in times.windows(2).enumerate() {
            if pair[1] <= pair[0] {
                let message = format!(
                    "time must be larger than in the row before, {:?}, is {:?}",
                    pair[0], pair[1]
                );
                return Err((k + 1, message));
            }
        }
        Ok(Self { times, values })
    }

    /// Return the first and last time, s.
    pub fn range(&self) -> [f64; 2] {
        [self.times[0], self.times[self.times.len() - 1]]
    }

    /// Return the times (s) and values of the rows.
    pub fn rows(&self) -> [&[f64]; 2] {
        [&self.times, &self.values]
    }

    /// Test whether the table starts with all rows of another table.
    pub fn extends(&self, other: &Self) -> bool {
        self.times.starts_with(&other.times) && self.values.starts_with(&other.values)
    }

    /// Return the value at a time (s). The first and the last segment extend beyond the rows. Times beyond
    /// the rows occur for two reasons. The last step of a run may pass the end of the run. The velocity of a
    /// support at a time is computed from values before and after this time.
    pub(super) fn at(&self, time: f64) -> f64 {
        let k = self.segment(time);
        let [from, to] = [self.values[k], self.values[k + 1]];
        if time == self.times[k + 1] {
            return to;
        }
        from + (to - from) * ((time - self.times[k]) / (self.times[k + 1] - self.times[k]))
    }

    /// Compute the change of the value from `time` to `time + step` (s); `step` may be negative. If both
    /// times lie in the same segment, the round-off error is proportional to the change, not to the value.
    pub(super) fn increment(&self, time: f64, step: f64) -> f64 {
        let end = time + step;
        let k = self.segment(0.5 * (time + end));
        let is_first = k == 0;
        let is_last = k + 2 == self.times.len();
        let within = |time: f64| {
            (is_first || self.times[k] <= time) && (is_last || time <= self.times[k + 1])
        };
        if within(time) && within(end) {
            let slope = (self.values[k + 1] - self.values[k]) / (self.times[k + 1] - self.times[k]);
            return slope * step;
        }
        self.at(end) - self.at(time)
    }

    /// Return the index of the first row of the segment that contains a time (s). A time before or after all
    /// rows belongs to the nearest segment.
    fn segment(&self, time: f64) -> usize {
        let after = self.times.partition_point(|row| *row <= time);
        after.clamp(1, self.times.len() - 1) - 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn table() -> Table {
        Table::new(vec![0.0, 1.0, 3.0, 3.5], vec![0.0, 2.0, -2.0, -2.0]).unwrap()
    }

    #[test]
    fn values_are_linear_between_rows_and_go_on_beyond_them() {
        let table = table();
        for (time, value) in [
            (0.0, 0.0),
            (0.25, 0.5),
            (1.0, 2.0),
            (2.0, 0.0),
            (3.0, -2.0),
            (3.2, -2.0),
            (3.5, -2.0),
            (-1.0, -2.0),
            (9.0, -2.0),
        ] {
            assert_eq!(table.at(time), value, "{time}");
        }
    }

    #[test]
    fn increments_are_differences_of_values() {
        let table = table();
        for (time, step) in [
            (0.0, 0.5),
            (0.5, 1.0),
            (1.0, 2.0),
            (3.0, -1.5),
            (2.0, 4.0),
            (-1.0, 1.5),
        ] {
            let difference = table.at(time + step) - table.at(time);
            assert!((table.increment(time, step) - difference).abs() < 1e-15);
        }
        // The round-off is relative to the change. The difference of the values before and after the step
        // would have a larger error.
        let steep = Table::new(vec![0.0, 1.0], vec![1e6, 1e6 + 1.0]).unwrap();
        assert_eq!(steep.increment(0.3, 1e-9), 1e-9);
    }

    #[test]
    fn times_grow() {
        let wrong = Table::new(vec![0.0, 1.0, 1.0], vec![0.0; 3]).unwrap_err();
        assert_eq!(wrong.0, 2);
        assert_eq!(
            wrong.1,
            "time must be larger than in the row before, 1.0, is 1.0"
        );
        assert!(Table::new(vec![0.0], vec![0.0]).is_err());
    }

    #[test]
    fn rows_are_complete_and_finite() {
        for (times, values, row, message) in [
            (
                vec![0.0, 1.0, 2.0],
                vec![0.0, 1.0],
                2,
                "needs as many values as times, has 3 times and 2 values",
            ),
            (
                vec![0.0, f64::NAN],
                vec![0.0; 2],
                1,
                "time must be finite, is NaN",
            ),
            (
                vec![0.0, 1.0],
                vec![f64::INFINITY, 0.0],
                0,
                "value must be finite, is inf",
            ),
        ] {
            let wrong = Table::new(times, values).unwrap_err();
            assert_eq!(wrong, (row, message.to_owned()));
        }
    }
}
