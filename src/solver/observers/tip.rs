//! Crack tips: position and speed of the farthest damage in one direction.

use crate::error::{Error, Result};
use crate::problem;

use super::crack_points::horizon_of;
use super::reach::{Course, Reached};
use crate::solver::Simulation;
use crate::solver::conditions::{members, not_empty};

/// A tracked crack tip.
pub struct Tip {
    name: String,
    threshold: f64,
    course: Course,
    growth: Growth,
}

/// State of a crack tip at the time of a row. All values are NaN if no damage exceeds the threshold of the
/// tip.
#[derive(Debug, Clone, Copy)]
pub struct TipNow {
    /// Position, m.
    pub position: [f64; 3],
    /// Length of the crack, m: distance of the tip from the start of the line, along the line.
    pub length: f64,
    /// Speed, m/s.
    pub speed: f64,
}

impl Tip {
    /// Find the points of the set in which the tip is tracked. Collective.
    ///
    /// # Errors
    /// If the set is empty, or all its points lie behind the start of the line; the error is the same on all
    /// ranks.
    pub fn new<const D: usize>(
        simulation: &Simulation<'_, D>,
        rule: &problem::Tip,
    ) -> Result<Self> {
        let (problem, model) = (simulation.problem, &simulation.model);
        let points = members(problem, model, rule.set);
        let key = format!("[history.tip.{}] set", rule.name);
        let place = (&key[..], rule.span.clone());
        not_empty(problem, simulation.comm, rule.set, &points, place)?;
        let horizon = horizon_of(simulation, &points);
        let everywhere = (f64::INFINITY, f64::INFINITY);
        let course = Course::new(simulation, rule.line, everywhere, points.into_iter());
        if course.is_empty(simulation.comm) {
            let message = format!(
                "[history.tip.{}]: all points of the set `{}` lie behind `from`",
                rule.name, problem.sets[rule.set].name
            );
            return Err(Error::input(message).at(&rule.span));
        }
        Ok(Self {
            name: rule.name.clone(),
            threshold: rule.threshold,
            course,
            growth: Growth::new(horizon),
        })
    }

    /// Name of the tip.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Return the state of the tip for the given damage of the owned points. Also record the length of the
    /// crack, because the speeds in later rows are computed from it. Collective.
    pub fn row<const D: usize>(
        &mut self,
        simulation: &Simulation<'_, D>,
        damage: impl Fn(usize) -> f64,
    ) -> TipNow {
        let reached = self.course.reached(simulation, self.threshold, damage);
        let Reached { along, position } = reached.unwrap_or(Reached {
            along: f64::NAN,
            position: [f64::NAN; 3],
        });
        TipNow {
            position,
            length: along,
            speed: self.growth.speed(simulation.clock.time(), along),
        }
    }

    /// Move the past lengths of the crack from an earlier observer of the same tip to this one.
    pub fn take_past(&mut self, earlier: &mut Self) {
        std::mem::swap(&mut self.growth, &mut earlier.growth);
    }

    /// Record the length (m) that the crack had in an earlier row. `time` is the time of that row, s.
    pub fn record_past(&mut self, time: f64, length: f64) {
        self.growth.speed(time, length);
    }
}

/// The length of a crack over time, from which its speed is computed.
///
/// The speed is the mean over an interval of rows that ends at the present row. The interval begins at the
/// latest row in which the crack was at least one horizon shorter than in the present row. If there is no
/// such row, let l₀ be the length of the crack in the first row with a tip. The interval then begins at the
/// latest row in which the length of the crack was at most l₀.
///
/// If the crack grew by less than one horizon in the interval, the speed would show each jump of the tip from
/// one point of the lattice to the next. If the interval had a fixed number of rows, the speed would depend
/// on the time between rows. A crack that has not grown has speed 0. After a crack has stopped, the computed
/// speed is about one horizon divided by the duration of the interval. This duration grows from row to row.
struct Growth {
    horizon: f64,
    /// Time (s) and length of the crack (m) in each row with a tip.
    past: Vec<(f64, f64)>,
}

impl Growth {
    fn new(horizon: f64) -> Self {
        Self {
            horizon,
            past: Vec::new(),
        }
    }

    /// Record `length` (m) at `time` (s), and return the speed, m/s. The speed is NaN at the first length,
    /// and if the length is NaN.
    fn speed(&mut self, time: f64, length: f64) -> f64 {
        if length.is_nan() {
            return f64::NAN;
        }
        let first = self.past.first().map_or(f64::NAN, |first| first.1);
        let shorter = (length - self.horizon).max(first);
        let then = self.past.iter().rev().find(|then| then.1 <= shorter);
        let speed = then.map_or(f64::NAN, |then| (length - then.1) / (time - then.0));
        self.past.push((time, length));
        speed
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn speed_is_the_mean_over_the_last_horizon_of_growth() {
        let mut growth = Growth::new(3.0);
        assert!(growth.speed(0.0, f64::NAN).is_nan());
        assert!(growth.speed(1.0, 10.0).is_nan());
        assert_eq!(growth.speed(2.0, 10.0), 0.0);
        // The length grows by one spacing every second row.
        assert_eq!(growth.speed(3.0, 11.0), 1.0);
        assert_eq!(growth.speed(4.0, 11.0), 0.5);
        assert_eq!(growth.speed(5.0, 12.0), 2.0 / 3.0);
        assert_eq!(growth.speed(6.0, 12.0), 0.5);
        assert_eq!(growth.speed(7.0, 13.0), 0.6);
        assert_eq!(growth.speed(8.0, 13.0), 0.5);
        assert_eq!(growth.speed(9.0, 14.0), 0.6);
        assert_eq!(growth.speed(10.0, 14.0), 0.5);
        // The crack is at rest.
        assert_eq!(growth.speed(304.0, 14.0), 0.01);
    }

    #[test]
    fn a_crack_that_seems_to_shrink_has_a_negative_speed() {
        let mut growth = Growth::new(3.0);
        growth.speed(0.0, 5.0);
        growth.speed(1.0, 9.0);
        assert_eq!(growth.speed(2.0, 8.5), 3.5 / 2.0);
        assert_eq!(growth.speed(4.0, 4.0), -0.25);
    }
}
