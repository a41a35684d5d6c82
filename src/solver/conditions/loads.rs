//! Loads: force densities on some points.

use crate::expression::Expression;
use crate::solver::motion::walk::Part;

use super::Work;
use super::values::{At, Values};

/// A load, as a force density on points.
pub struct Load<const D: usize> {
    values: [Values; D],
    factors: [f64; D],
    /// Index of the load's condition.
    condition: usize,
    /// Factor that an observer has set, see `LoadFactors`.
    scale: f64,
    now: [At; D],
    /// Whether the force density must be computed, because it may have changed or because the caller has
    /// requested all loads.
    pub is_due: bool,
}

/// The loaded points of a [`Part`], for one load.
pub struct Loaded<const D: usize> {
    /// Index of the load among the loads of the stage.
    load: usize,
    /// Indices of the points in the part.
    points: Vec<u16>,
    /// Fraction of each point on which the load acts; `None` if the fraction is 1 for all points.
    fractions: Option<Vec<f64>>,
    /// Force density at the present time, N/m³.
    force: Vec<[f64; D]>,
    /// Force density before the step, N/m³.
    before: Vec<[f64; D]>,
    /// Displacement before the step, m.
    moved_from: Vec<[f64; D]>,
}

impl<const D: usize> Load<D> {
    /// Create the load of the condition with this index. Component d of the force density (N/m³) is
    /// `values[d]` times `factors[d]`.
    pub fn new(condition: usize, values: &[Expression], factors: [f64; D]) -> Self {
        let values: [Values; D] = std::array::from_fn(|d| Values::new(&values[d]));
        Self {
            now: values.each_ref().map(|values| values.at(0.0)),
            values,
            factors,
            condition,
            scale: 1.0,
            is_due: false,
        }
    }

    /// Index of the condition that defines the load.
    pub fn condition(&self) -> usize {
        self.condition
    }

    /// Prepare the load for a time (s). `factors` has a factor per condition. With `all`, the load is due
    /// even if its force density has not changed.
    pub fn set_time(&mut self, time: f64, factors: &[f64], all: bool) {
        let scale = factors[self.condition];
        let is_rescaled = scale != self.scale;
        self.scale = scale;
        self.is_due = all || is_rescaled || self.values.iter().any(|values| values.changes);
        if self.is_due {
            self.now = self.values.each_ref().map(|values| values.at(time));
        }
    }

    /// Force density (N/m³) on a point, if the load acts on the whole point. `position` returns the reference
    /// position of the point (m).
    fn on(&self, position: impl Fn() -> [f64; 3]) -> [f64; D] {
        std::array::from_fn(|d| {
            self.scale * (self.factors[d] * self.values[d].of(&self.now[d], &position))
        })
    }
}

impl<const D: usize> Loaded<D> {
    /// Create the loaded points of the load with index `load`. `points` are their indices in the part.
    pub fn new(load: usize, points: Vec<u16>, fractions: Option<Vec<f64>>) -> Self {
        let none = || vec![[0.0; D]; points.len()];
        Self {
            load,
            force: none(),
            before: none(),
            moved_from: none(),
            points,
            fractions,
        }
    }

    /// Compute the force densities on the points of `part` if [`Load::is_due`] is true.
    pub fn compute_densities(&mut self, loads: &[Load<D>], part: &Part<'_, D>) {
        let load = &loads[self.load];
        if !load.is_due {
            return;
        }
        let (model, first) = (part.model, part.first);
        for (k, force) in self.force.iter_mut().enumerate() {
            let whole = load.on(|| model.position(first + usize::from(self.points[k])));
            let fraction = self.fractions.as_ref().map(|fractions| fractions[k]);
            *force =
                whole.map(|component| fraction.map_or(component, |fraction| fraction * component));
        }
    }

    /// Index of the load among the loads of the stage.
    pub fn load(&self) -> usize {
        self.load
    }

    /// Iterate over the points. Each item is the index of a point in the part, and the force density on this
    /// point (N/m³).
    pub fn densities(&self) -> impl Iterator<Item = (usize, [f64; D])> + '_ {
        let points = self.points.iter().map(|point| usize::from(*point));
        points.zip(self.force.iter().copied())
    }

    /// Set the external force densities of the loaded points to 0.
    pub fn clear(&self, part: &mut Part<'_, D>) {
        for component in part.external_force.iter_mut().flatten() {
            for point in &self.points {
                component[usize::from(*point)] = 0.0;
            }
        }
    }

    /// Add the load to the external force densities of the loaded points.
    pub fn add(&self, part: &mut Part<'_, D>) {
        let components = part.external_force.iter_mut().flatten();
        for (d, component) in components.enumerate() {
            for (point, force) in self.points.iter().zip(&self.force) {
                component[usize::from(*point)] += force[d];
            }
        }
    }

    /// Store the force densities and displacements of the loaded points. [`Self::add_work`] uses the stored
    /// values to compute the work of the next step. `displacement` contains the displacements (m) of all
    /// points of the part.
    pub fn record_for_work(&mut self, displacement: [&[f64]; D]) {
        self.before.copy_from_slice(&self.force);
        for (from, point) in self.moved_from.iter_mut().zip(&self.points) {
            *from = displacement.map(|column| column[usize::from(*point)]);
        }
    }

    /// Add the work (J) of the load since the last call of [`Self::record_for_work`] to the external work of
    /// each point; see [`Work`].
    pub fn add_work(&self, part: &mut Part<'_, D>, kind: Work) {
        let Some([work]) = &mut part.external_work else {
            return;
        };
        let mean = |before: f64, now: f64| match kind {
            Work::Trapezoid | Work::Step => 0.5 * (before + now),
            Work::FirstEquilibrium => 0.5 * (before - now),
            Work::LastEquilibrium => now,
        };
        for (k, point) in self.points.iter().enumerate() {
            let point = usize::from(*point);
            for d in 0..D {
                let moved = part.displacement[d][point] - self.moved_from[k][d];
                let force = mean(self.before[k][d], self.force[k][d]);
                work[point] += force * moved * part.model.volume[part.first + point];
            }
        }
    }
}
