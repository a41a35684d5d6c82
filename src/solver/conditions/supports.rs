//! Supports: prescribed motions, and the reactions that they take.

use crate::deck::expression::Expression;
use crate::solver::model::Model;
use crate::solver::motion::Fields;

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
        let displacement = &fields.displacement[self.component];
        for (k, point) in self.points.iter().enumerate() {
            self.moved_from[k] = displacement[*point as usize];
        }
        if let Some(reaction) = &fields.reaction {
            for (k, point) in self.points.iter().enumerate() {
                self.before[k] = reaction[self.component][*point as usize];
            }
        }
    }

    /// After the points have moved to time `time` (s): puts those supported in their place. `step` is
    /// the step just made (s), 0 at the start.
    pub fn place(&self, displacement: &mut [f64], time: f64, step: f64) {
        let points = &self.points;
        match self.motion {
            Motion::Displacement => self.values.at(&self.positions, time, |k, value| {
                displacement[points[k] as usize] = value;
            }),
            // The trapezoid rule, from where the points were before they drifted.
            Motion::Velocity if step > 0.0 => {
                for (from, point) in self.moved_from.iter().zip(points) {
                    displacement[*point as usize] = *from;
                }
                for now in [time - step, time] {
                    self.values.at(&self.positions, now, |k, value| {
                        displacement[points[k] as usize] += 0.5 * step * value;
                    });
                }
            }
            // At the start the points are at their initial displacement.
            Motion::Velocity => {}
        }
    }

    /// Gives the points their mean velocity in the step just made (s).
    pub fn set_mean_velocity(&self, displacement: &[f64], velocity: &mut [f64], step: f64) {
        for (from, point) in self.moved_from.iter().zip(&self.points) {
            let point = *point as usize;
            velocity[point] = (displacement[point] - from) / step;
        }
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
        let component = self.component;
        let mut finite = true;
        // Value now, and its changes in the step before and the one to come; before the start the motion is
        // extrapolated.
        let mut now = 0.0;
        let mut changes = [0.0; 2];
        for (k, point) in self.points.iter().enumerate() {
            let position = self.positions[k];
            let change = |step: f64| self.values.expression.increment(position, time, step);
            if self.values.varies || k == 0 {
                now = self.values.expression.evaluate(position, time);
                // The motion may end here, as √(1 − t) does: then it is extrapolated.
                let to_come = match change(step) {
                    to_come if to_come.is_finite() || time < step => to_come,
                    _ => -change(-step),
                };
                let before = match self.motion {
                    _ if time >= step => -change(-step),
                    Motion::Displacement => to_come,
                    Motion::Velocity => 0.0,
                };
                changes = [before, to_come];
            }
            let [before, to_come] = changes;
            let (velocity, acceleration) = match self.motion {
                Motion::Displacement => (
                    (before + to_come) / (2.0 * step),
                    (to_come - before) / (step * step),
                ),
                Motion::Velocity => (now, (before + to_come) / (2.0 * step)),
            };
            let point = *point as usize;
            fields.velocity[component][point] = velocity;
            let needed = model.density_of(point) * acceleration;
            let reaction = needed - fields.acting(model, component, point);
            if let Some(field) = &mut fields.reaction {
                field[component][point] = reaction;
            }
            finite &= velocity.is_finite() && reaction.is_finite();
        }
        finite
    }

    /// Finds the reactions that keep the points where they are, at rest. Returns whether they are
    /// finite.
    pub fn hold<const D: usize>(&self, model: &Model<D>, fields: &mut Fields<D>) -> bool {
        let mut finite = true;
        for point in &self.points {
            let point = *point as usize;
            fields.velocity[self.component][point] = 0.0;
            let reaction = -fields.acting(model, self.component, point);
            if let Some(field) = &mut fields.reaction {
                field[self.component][point] = reaction;
            }
            finite &= reaction.is_finite();
        }
        finite
    }

    /// Remembers reaction (N/m³) and place of an earlier time, when points had these displacements (m).
    pub fn remember<const D: usize>(
        &mut self,
        displacement: &[Vec<f64>; D],
        reaction: Option<&[Vec<f64>; D]>,
    ) {
        for (k, point) in self.points.iter().enumerate() {
            let point = *point as usize;
            self.moved_from[k] = displacement[self.component][point];
            self.before[k] = reaction.map_or(0.0, |field| field[self.component][point]);
        }
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
        for (k, point) in self.points.iter().enumerate() {
            let point = *point as usize;
            let moved = displacement[point] - self.moved_from[k];
            let force = 0.5 * (self.before[k] + reaction[point]);
            work[point] += force * moved * model.volume[point];
        }
    }
}
