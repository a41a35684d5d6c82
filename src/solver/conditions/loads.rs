//! Loads: force densities on some points.

use crate::deck::expression::Expression;
use crate::solver::model::Model;
use crate::solver::motion::Fields;

use super::values::Values;

/// A body force density on some points.
pub struct Load<const D: usize> {
    points: Vec<u32>,
    positions: Vec<[f64; 3]>,
    values: [Values; D],
    factors: [f64; D],
    /// With which share points take part; wholly if there is none.
    shares: Option<Vec<f64>>,
    /// Force density now, N/m³.
    force: Vec<[f64; D]>,
    /// Force density and place (m) before the step.
    before: Vec<[f64; D]>,
    moved_from: Vec<[f64; D]>,
}

impl<const D: usize> Load<D> {
    /// On some of the owned points: each component is its expression times its factor, N/m³, times the
    /// point's share if there are shares.
    pub fn new(
        model: &Model<D>,
        (points, shares): (Vec<u32>, Option<Vec<f64>>),
        values: &[Expression],
        factors: [f64; D],
    ) -> Self {
        let position = |point: &u32| model.position(*point as usize);
        Self {
            positions: points.iter().map(position).collect(),
            values: std::array::from_fn(|d| Values::new(&values[d])),
            factors,
            shares,
            force: vec![[0.0; D]; points.len()],
            before: vec![[0.0; D]; points.len()],
            moved_from: vec![[0.0; D]; points.len()],
            points,
        }
    }

    /// Whether it changes in time.
    pub fn changes(&self) -> bool {
        self.values.iter().any(|values| values.changes)
    }

    /// Evaluates the force density at a time (s).
    pub fn update(&mut self, time: f64) {
        for d in 0..D {
            let (force, factor) = (&mut self.force, self.factors[d]);
            self.values[d].at(&self.positions, time, |k, value| {
                force[k][d] = factor * value;
            });
        }
        for (force, share) in self.force.iter_mut().zip(self.shares.iter().flatten()) {
            *force = force.map(|component| share * component);
        }
    }

    /// Takes the load's points out of a field of external forces.
    pub fn clear(&self, external: &mut [Vec<f64>; D]) {
        for component in external {
            for point in &self.points {
                component[*point as usize] = 0.0;
            }
        }
    }

    /// Adds the load to a field of external forces.
    pub fn add(&self, external: &mut [Vec<f64>; D]) {
        for (force, point) in self.force.iter().zip(&self.points) {
            for d in 0..D {
                external[d][*point as usize] += force[d];
            }
        }
    }

    /// Remembers force and place, for the work of the coming step.
    pub fn before_moving(&mut self, fields: &Fields<D>) {
        self.before.copy_from_slice(&self.force);
        for (from, point) in self.moved_from.iter_mut().zip(&self.points) {
            *from = std::array::from_fn(|d| fields.displacement[d][*point as usize]);
        }
    }

    /// Remembers force and place at an earlier time (s), when points had these displacements (m).
    pub fn remember(&mut self, displacement: &[Vec<f64>; D], time: f64, now: f64) {
        self.update(time);
        self.before.copy_from_slice(&self.force);
        self.update(now);
        for (from, point) in self.moved_from.iter_mut().zip(&self.points) {
            *from = std::array::from_fn(|d| displacement[d][*point as usize]);
        }
    }

    /// Adds the work of the step (J), by the trapezoid rule.
    pub fn add_work(&self, model: &Model<D>, displacement: &[Vec<f64>; D], work: &mut [f64]) {
        for (k, point) in self.points.iter().enumerate() {
            let point = *point as usize;
            for d in 0..D {
                let moved = displacement[d][point] - self.moved_from[k][d];
                let force = 0.5 * (self.before[k][d] + self.force[k][d]);
                work[point] += force * moved * model.volume[point];
            }
        }
    }
}
