//! Loads: force densities on some points.

use rayon::prelude::*;

use crate::deck::expression::Expression;
use crate::solver::model::Model;
use crate::solver::motion::Fields;

use super::scattered::{CHUNK, for_each_point};
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
        let (positions, shares, factors) = (&self.positions, self.shares.as_ref(), self.factors);
        let values = self
            .values
            .each_ref()
            .map(|values| values.at(positions, time));
        let forces = self.force.par_iter_mut().with_min_len(CHUNK).enumerate();
        forces.for_each(|(k, force)| {
            *force = std::array::from_fn(|d| {
                let component = factors[d] * values[d](k);
                shares.map_or(component, |shares| shares[k] * component)
            });
        });
    }

    /// Takes the load's points out of a field of external forces.
    pub fn clear(&self, external: &mut [Vec<f64>; D]) {
        let columns = external.each_mut().map(Vec::as_mut_slice);
        for_each_point(&self.points, columns, |_, _, entries| {
            entries.into_iter().for_each(|entry| *entry = 0.0);
            true
        });
    }

    /// Adds the load to a field of external forces.
    pub fn add(&self, external: &mut [Vec<f64>; D]) {
        let columns = external.each_mut().map(Vec::as_mut_slice);
        for_each_point(&self.points, columns, |k, _, entries| {
            for (entry, force) in entries.into_iter().zip(self.force[k]) {
                *entry += force;
            }
            true
        });
    }

    /// Remembers force and place, for the work of the coming step.
    pub fn before_moving(&mut self, fields: &Fields<D>) {
        self.remember_now(&fields.displacement);
    }

    /// Remembers force and place at an earlier time (s), when points had these displacements (m).
    pub fn remember(&mut self, displacement: &[Vec<f64>; D], time: f64, now: f64) {
        self.update(time);
        self.remember_now(displacement);
        self.update(now);
    }

    fn remember_now(&mut self, displacement: &[Vec<f64>; D]) {
        let now = self.force.par_iter().with_min_len(CHUNK).zip(&self.points);
        let past = self.before.par_iter_mut().zip(&mut self.moved_from);
        past.zip(now).for_each(|((before, from), (force, point))| {
            *before = *force;
            *from = std::array::from_fn(|d| displacement[d][*point as usize]);
        });
    }

    /// Adds the work of the step (J), by the trapezoid rule.
    pub fn add_work(&self, model: &Model<D>, displacement: &[Vec<f64>; D], work: &mut [f64]) {
        for_each_point(&self.points, [work], |k, point, [work]| {
            for d in 0..D {
                let moved = displacement[d][point] - self.moved_from[k][d];
                let force = 0.5 * (self.before[k][d] + self.force[k][d]);
                *work += force * moved * model.volume[point];
            }
            true
        });
    }
}
