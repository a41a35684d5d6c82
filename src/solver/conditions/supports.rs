//! Supports: prescribed motions, and the reactions that they take.

use rayon::prelude::*;

use crate::deck::expression::Expression;
use crate::solver::model::Model;
use crate::solver::motion::Fields;
use crate::solver::motion::fields::Exerted;

use super::scattered::{CHUNK, for_each_point};
use super::values::Values;

/// What a support prescribes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Motion {
    /// Displacement, m.
    Displacement,
    /// Velocity, m/s.
    Velocity,
}

/// One component of the motion of some points.
pub struct Support {
    /// Which component.
    pub component: usize,
    motion: Motion,
    /// Local indices, ascending.
    points: Vec<u32>,
    positions: Vec<[f64; 3]>,
    values: Values,
    /// Force density and place (m) before the step.
    before: Vec<f64>,
    moved_from: Vec<f64>,
}

impl Support {
    /// Prescribes a component of the motion of some of the owned points.
    pub fn new<const D: usize>(
        model: &Model<D>,
        component: usize,
        motion: Motion,
        points: Vec<u32>,
        value: &Expression,
    ) -> Self {
        let position = |point: &u32| model.position(*point as usize);
        Self {
            component,
            motion,
            positions: points.iter().map(position).collect(),
            values: Values::new(value),
            before: vec![0.0; points.len()],
            moved_from: vec![0.0; points.len()],
            points,
        }
    }

    /// Leaves those points alone that `others` (ascending) names.
    pub fn release(&mut self, others: &[u32]) {
        let mut keep = (self.points.iter()).map(|point| others.binary_search(point).is_err());
        let kept: Vec<bool> = keep.by_ref().collect();
        let mut each = kept.iter();
        self.points.retain(|_| *each.next().expect("one a point"));
        let mut each = kept.iter();
        self.positions
            .retain(|_| *each.next().expect("one a point"));
        self.before.truncate(self.points.len());
        self.moved_from.truncate(self.points.len());
    }

    /// The points that it holds.
    pub fn points(&self) -> &[u32] {
        &self.points
    }

    /// Remembers reaction and place, for the work of the coming step.
    pub fn before_moving<const D: usize>(&mut self, fields: &Fields<D>) {
        self.remember(&fields.displacement, fields.reaction.as_ref());
    }

    /// After the points have moved to time `time` (s): puts those supported in their place. `step` is
    /// the step just made (s), 0 at the start.
    pub fn place(&self, displacement: &mut [f64], time: f64, step: f64) {
        let at = |time| self.values.at(&self.positions, time);
        match self.motion {
            Motion::Displacement => {
                let value = at(time);
                for_each_point(&self.points, [displacement], |k, _, [place]| {
                    *place = value(k);
                    true
                });
            }
            // The trapezoid rule, from where the points were before they drifted.
            Motion::Velocity if step > 0.0 => {
                let velocities = [at(time - step), at(time)];
                for_each_point(&self.points, [displacement], |k, _, [place]| {
                    *place = self.moved_from[k];
                    for velocity in &velocities {
                        *place += 0.5 * step * velocity(k);
                    }
                    true
                });
            }
            // At the start the points are at their initial displacement.
            Motion::Velocity => {}
        }
    }

    /// Gives the points their mean velocity in the step just made (s).
    pub fn set_mean_velocity(&self, displacement: &[f64], velocity: &mut [f64], step: f64) {
        for_each_point(&self.points, [velocity], |k, point, [velocity]| {
            *velocity = (displacement[point] - self.moved_from[k]) / step;
            true
        });
    }

    /// Gives the points their velocity at `time` (s), and finds the reactions: what must be added to
    /// the other forces so that the Verlet scheme makes the prescribed motion. `step` is the time
    /// step (s). Returns whether all of that is finite.
    pub fn guide<const D: usize>(
        &self,
        model: &Model<D>,
        fields: &mut Fields<D>,
        time: f64,
        step: f64,
    ) -> bool {
        let motion = |position: [f64; 3]| {
            // Before the start the motion is extrapolated, and where it ends, as √(1 − t) does.
            let change = |step: f64| self.values.expression.increment(position, time, step);
            let to_come = match change(step) {
                to_come if to_come.is_finite() || time < step => to_come,
                _ => -change(-step),
            };
            let before = match self.motion {
                _ if time >= step => -change(-step),
                Motion::Displacement => to_come,
                Motion::Velocity => 0.0,
            };
            match self.motion {
                Motion::Displacement => (
                    (before + to_come) / (2.0 * step),
                    (to_come - before) / (step * step),
                ),
                Motion::Velocity => (
                    self.values.expression.evaluate(position, time),
                    (before + to_come) / (2.0 * step),
                ),
            }
        };
        let first = self.positions.first();
        let same = first.filter(|_| !self.values.varies).map(|at| motion(*at));
        self.react(model, fields, |k, point| {
            let (velocity, acceleration) = same.unwrap_or_else(|| motion(self.positions[k]));
            (velocity, model.density_of(point) * acceleration)
        })
    }

    /// Finds the reactions that keep the points where they are, at rest. Returns whether they are
    /// finite.
    pub fn hold<const D: usize>(&self, model: &Model<D>, fields: &mut Fields<D>) -> bool {
        // A reaction is then the force with its sign changed, that of 0 as well.
        self.react(model, fields, |_, _| (0.0, -0.0))
    }

    /// Gives the points their velocities, and finds the reactions with which the forces are those that are needed
    /// (N/m³): both are `wanted` of a point, by its number here and its local index. Returns whether all is finite.
    fn react<const D: usize>(
        &self,
        model: &Model<D>,
        fields: &mut Fields<D>,
        wanted: impl Fn(usize, usize) -> (f64, f64) + Sync,
    ) -> bool {
        let component = self.component;
        let Fields {
            velocity,
            internal_force,
            external_force,
            reaction: Some(reaction),
            ..
        } = fields
        else {
            unreachable!("a run with supports has reactions");
        };
        let exerted = Exerted::new(internal_force, external_force.as_ref(), component);
        let columns = [&mut velocity[component][..], &mut reaction[component][..]];
        for_each_point(&self.points, columns, |k, point, [velocity, reaction]| {
            let (moving, needed) = wanted(k, point);
            *velocity = moving;
            *reaction = needed - model.less_damping(point, exerted.at(point), moving);
            velocity.is_finite() && reaction.is_finite()
        })
    }

    /// Remembers reaction (N/m³) and place of an earlier time, when points had these displacements (m).
    pub fn remember<const D: usize>(
        &mut self,
        displacement: &[Vec<f64>; D],
        reaction: Option<&[Vec<f64>; D]>,
    ) {
        let component = self.component;
        let past = self.before.par_iter_mut().zip(&mut self.moved_from);
        let past = past.with_min_len(CHUNK).zip(&self.points);
        past.for_each(|((before, from), point)| {
            let point = *point as usize;
            *from = displacement[component][point];
            *before = reaction.map_or(0.0, |field| field[component][point]);
        });
    }

    /// Adds the work of the step (J), by the trapezoid rule. `displacement` and `reaction` (N/m³) are
    /// those of the support's component.
    pub fn add_work<const D: usize>(
        &self,
        model: &Model<D>,
        displacement: &[f64],
        reaction: &[f64],
        work: &mut [f64],
    ) {
        for_each_point(&self.points, [work], |k, point, [work]| {
            let moved = displacement[point] - self.moved_from[k];
            let force = 0.5 * (self.before[k] + reaction[point]);
            *work += force * moved * model.volume[point];
            true
        });
    }
}
