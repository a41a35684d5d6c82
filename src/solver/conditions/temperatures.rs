//! Prescribed temperatures and the resulting thermal stretches.

use crate::expression::Expression;
use crate::solver::motion::walk::Part;

use super::values::{At, Values};

/// A prescribed temperature.
pub struct Temperature {
    values: Values,
    now: At,
}

/// The points of a [`Part`] to which a temperature condition applies.
pub struct Heated {
    /// Index of the temperature condition.
    temperature: usize,
    /// Indices of the points in the part.
    points: Vec<u16>,
}

/// All prescribed temperatures of a stage.
#[derive(Default)]
pub struct Temperatures {
    each: Vec<Temperature>,
    /// The time (s) of the last [`Self::set_time`]; `None` before the first call and after [`Self::reset`].
    time: Option<f64>,
    /// Whether [`Self::apply`] must set the temperatures of the points.
    is_due: bool,
}

impl Temperatures {
    /// Add a temperature; return its index.
    pub fn add(&mut self, value: &Expression) -> usize {
        let values = Values::new(value);
        self.each.push(Temperature {
            now: values.at(0.0),
            values,
        });
        self.each.len() - 1
    }

    /// Prepare the temperatures at a time (s). After the first call of this function, [`Self::apply`] sets
    /// the temperatures of points. If temperatures change with time, [`Self::apply`] also sets the
    /// temperatures of points after each call of this function with a new time.
    pub fn set_time(&mut self, time: f64) {
        let is_new = self.time != Some(time);
        let changes = self.each.iter().any(|one| one.values.changes);
        self.is_due = self.time.is_none() || (is_new && changes);
        self.time = Some(time);
        for one in &mut self.each {
            one.now = one.values.at(time);
        }
    }

    /// Ensure that [`Self::apply`] sets all temperatures after the next call of [`Self::set_time`].
    pub fn reset(&mut self) {
        self.time = None;
    }

    /// Set temperature and thermal stretch of the points of a part, if prescribed temperatures may have
    /// changed. If several conditions apply to a point, the last of these conditions in the deck counts. A
    /// point without a condition has the reference temperature of its material.
    pub fn apply<const D: usize>(&self, heated: &[Heated], part: &mut Part<'_, D>) {
        let (model, first) = (part.model, part.first);
        let (Some([temperature]), Some([stretch]), true) = (
            &mut part.temperature,
            &mut part.thermal_stretch,
            self.is_due,
        ) else {
            return;
        };
        for (k, value) in temperature.iter_mut().enumerate() {
            *value = model.expansion_of(first + k).reference_temperature;
        }
        for heated in heated {
            let Temperature { values, now } = &self.each[heated.temperature];
            for point in &heated.points {
                let point = usize::from(*point);
                temperature[point] = values.of(now, || model.position(first + point));
            }
        }
        for (k, (stretch, value)) in stretch.iter_mut().zip(temperature.iter()).enumerate() {
            let free = model.expansion_of(first + k).stretch_at(*value);
            // NaN ends the run with a message that names the temperature.
            *stretch = if free > -1.0 { free } else { f64::NAN };
        }
    }
}

impl Heated {
    /// Create the entry for a temperature condition. `temperature` is the index of the condition, and
    /// `points` are the indices of its points within the part.
    pub fn new(temperature: usize, points: Vec<u16>) -> Self {
        Self {
            temperature,
            points,
        }
    }
}
