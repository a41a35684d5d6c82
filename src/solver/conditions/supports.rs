//! Supports: prescribed motions and their reactions.

use crate::expression::Expression;
use crate::solver::motion::walk::Part;

use super::Work;
use super::values::{At, Values};

/// The quantity that a support prescribes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Motion {
    /// Displacement, m.
    Displacement,
    /// Velocity, m/s.
    Velocity,
}

/// A prescribed component of motion.
pub struct Support {
    /// Index of the component.
    pub component: usize,
    motion: Motion,
    /// Time at which the support begins to act, s.
    begin: f64,
    values: Values,
    displacement: PrescribedDisplacement,
    velocity: PrescribedVelocity,
}

/// Values that prescribe the displacements of the supported points at the present time.
struct PrescribedDisplacement {
    /// Length of the last step, s; 0 at the start.
    step: f64,
    /// The prescribed values (displacements or velocities) at the start and the end of the last step.
    values: [At; 2],
}

/// Time and time step, both in s, for which the velocities and accelerations of the supported points are
/// prescribed.
struct PrescribedVelocity {
    time: f64,
    step: f64,
    /// Velocity (m/s) and acceleration (m/s²), if they are the same for all points.
    same: Option<(f64, f64)>,
}

/// The points of a [`Part`] on which a support acts.
pub struct Supported {
    /// Index of the support among the supports of the stage.
    support: usize,
    /// Index of each of these points within the part.
    points: Vec<u16>,
    /// Reaction before the step, N/m³.
    before: Vec<f64>,
    /// Displacement before the step, m.
    moved_from: Vec<f64>,
    /// Velocity before the step (m/s), and force density without the reaction before the step (N/m³). Empty
    /// if no step has used [`Work::Step`].
    motion: Vec<[f64; 2]>,
}

impl Support {
    /// Create a support that prescribes a component of motion from the time `begin` (s) on.
    pub fn new(component: usize, motion: Motion, value: &Expression, begin: f64) -> Self {
        let values = Values::new(value);
        let start = || values.at(0.0);
        Self {
            component,
            motion,
            begin,
            displacement: PrescribedDisplacement {
                step: 0.0,
                values: [start(), start()],
            },
            velocity: PrescribedVelocity {
                time: 0.0,
                step: 0.0,
                same: None,
            },
            values,
        }
    }

    /// Set the values that prescribe the displacements of the supported points at `time` (s). `step` is the
    /// length of the last step (s), 0 at the start.
    pub fn set_displacements(&mut self, time: f64, step: f64) {
        self.displacement = PrescribedDisplacement {
            step,
            values: [time - step, time].map(|time| self.values.at(time)),
        };
    }

    /// Prepare the velocities of points at `time` (s); `step` is the time step (s).
    pub fn set_velocities(&mut self, time: f64, step: f64) {
        let same = || self.moving([0.0; 3], time, step);
        self.velocity = PrescribedVelocity {
            time,
            step,
            same: (!self.values.varies).then(same),
        };
    }

    /// Velocity (m/s) and acceleration (m/s²) of a point in the Verlet scheme. `position` is the reference
    /// position of the point (m). The step begins at `time` (s) and has the length `step` (s).
    fn moving(&self, position: [f64; 3], time: f64, step: f64) -> (f64, f64) {
        // Values before the support begins have no meaning. A displacement is extrapolated to such times by a
        // parabola, and a velocity linearly. If the change in the next step is not finite, as for √(1 − t) at
        // t = 1, the change of the last step is repeated.
        let has_past = time - self.begin >= 0.5 * step;
        let change = |step: f64| self.values.expression.increment(position, time, step);
        let to_come = match change(step) {
            to_come if to_come.is_finite() || !has_past => to_come,
            _ => -change(-step),
        };
        let before = match self.motion {
            _ if has_past => -change(-step),
            Motion::Displacement => match change(2.0 * step) - 2.0 * to_come {
                second_difference if second_difference.is_finite() => to_come - second_difference,
                _ => to_come,
            },
            Motion::Velocity => to_come,
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
    }
}

impl Supported {
    /// Create the supported points of the support with index `support`. `points` are the indices of these
    /// points in the part.
    pub fn new(support: usize, points: Vec<u16>) -> Self {
        Self {
            support,
            before: vec![0.0; points.len()],
            moved_from: vec![0.0; points.len()],
            motion: Vec::new(),
            points,
        }
    }

    /// The supported component, and the indices of the points in the part.
    pub fn points<'a>(&'a self, supports: &[Support]) -> (usize, impl Iterator<Item = usize> + 'a) {
        let points = self.points.iter().map(|point| usize::from(*point));
        (supports[self.support].component, points)
    }

    /// Store reactions and displacements. [`Self::add_work`] uses them to compute the work of the support.
    /// The arguments are the displacements (m) and reactions (N/m³) of all points of the part.
    pub fn record_for_work<const D: usize>(
        &mut self,
        supports: &[Support],
        displacement: [&[f64]; D],
        reaction: Option<[&[f64]; D]>,
    ) {
        let component = supports[self.support].component;
        for (k, point) in self.points.iter().enumerate() {
            let point = usize::from(*point);
            self.moved_from[k] = displacement[component][point];
            self.before[k] = reaction.map_or(0.0, |field| field[component][point]);
        }
    }

    /// Store the velocities and the force densities without reactions, for [`Work::Step`] of the next step.
    pub fn record_motion<const D: usize>(&mut self, supports: &[Support], part: &Part<'_, D>) {
        let component = supports[self.support].component;
        self.motion.clear();
        let points = self.points.iter().map(|point| usize::from(*point));
        self.motion.extend(points.map(|point| {
            [
                part.velocity[component][point],
                part.force_without_reaction(component, point),
            ]
        }));
    }

    /// Set the displacements of the points, and their mean velocities in the last step. Called after the
    /// drift.
    pub fn apply_displacements<const D: usize>(
        &self,
        supports: &[Support],
        part: &mut Part<'_, D>,
    ) {
        let support = &supports[self.support];
        let PrescribedDisplacement { step, values: at } = &support.displacement;
        let (model, first) = (part.model, part.first);
        let value = |at: &At, point: usize| support.values.of(at, || model.position(first + point));
        let moving = part.component(support.component);
        for (k, point) in self.points.iter().enumerate() {
            let point = usize::from(*point);
            let displacement = &mut moving.displacement[point];
            match support.motion {
                Motion::Displacement => *displacement = value(&at[1], point),
                // Integrate the velocity by the trapezoidal rule, from the displacement before the drift.
                Motion::Velocity if *step > 0.0 => {
                    *displacement = self.moved_from[k];
                    for at in at {
                        *displacement += 0.5 * step * value(at, point);
                    }
                }
                // At the start, the points have their initial displacement.
                Motion::Velocity => {}
            }
            if *step > 0.0 {
                moving.velocity[point] = (*displacement - self.moved_from[k]) / step;
            }
        }
    }

    /// Set the velocities of the points and compute the reactions. Together with the other forces, the
    /// reactions give the prescribed motion in the Verlet scheme. Returns whether these velocities and
    /// reactions are finite.
    pub fn apply_velocities<const D: usize>(
        &self,
        supports: &[Support],
        part: &mut Part<'_, D>,
    ) -> bool {
        let support = &supports[self.support];
        let PrescribedVelocity { time, step, same } = support.velocity;
        let (model, first) = (part.model, part.first);
        self.react(support.component, part, |point| {
            let own = || support.moving(model.position(first + point), time, step);
            let (velocity, acceleration) = same.unwrap_or_else(own);
            (velocity, model.density_of(first + point) * acceleration)
        })
    }

    /// Set the velocities of the points to 0, and compute the reactions that keep the points at rest. Returns
    /// whether the reactions are finite.
    pub fn project_residual<const D: usize>(
        &self,
        supports: &[Support],
        part: &mut Part<'_, D>,
    ) -> bool {
        // A required force of −0 makes the reaction the exact opposite of the other forces, even for a force
        // of 0.
        self.react(supports[self.support].component, part, |_| (0.0, -0.0))
    }

    /// Set the velocities of the points, and compute the reactions that give the required total force
    /// density. `wanted` returns the velocity (m/s) and the total force density (N/m³) of a point, given its
    /// index in the part. Returns whether the velocities and reactions are finite.
    fn react<const D: usize>(
        &self,
        component: usize,
        part: &mut Part<'_, D>,
        wanted: impl Fn(usize) -> (f64, f64),
    ) -> bool {
        let (model, first) = (part.model, part.first);
        let moving = part.component(component);
        let reaction = moving.reaction.expect("a run with supports has reactions");
        let mut finite = true;
        for point in &self.points {
            let point = usize::from(*point);
            let (velocity, needed) = wanted(point);
            let other = model.with_damping(first + point, moving.force.at(point), velocity);
            moving.velocity[point] = velocity;
            reaction[point] = needed - other;
            finite &= velocity.is_finite() && reaction[point].is_finite();
        }
        finite
    }

    /// Add the work (J) of the support since the last call of [`Self::record_for_work`] to the external work
    /// of each point; see [`Work`].
    pub fn add_work<const D: usize>(
        &self,
        supports: &[Support],
        part: &mut Part<'_, D>,
        work: Work,
    ) {
        if work == Work::LastEquilibrium {
            return;
        }
        let component = supports[self.support].component;
        let model = part.model;
        for (k, point) in self.points.iter().enumerate() {
            let point = usize::from(*point);
            let moved = part.displacement[component][point] - self.moved_from[k];
            let density = if work == Work::Step {
                let [velocity, force] = self.motion[k];
                let now = part.velocity[component][point];
                let others = 0.5 * (force + part.force_without_reaction(component, point));
                let kinetic = 0.5 * model.density_of(part.first + point) * (now - velocity);
                kinetic * (now + velocity) - others * moved
            } else {
                let reaction = part.reaction.as_ref();
                let reaction = reaction.expect("a run with supports has reactions");
                0.5 * (self.before[k] + reaction[component][point]) * moved
            };
            if let Some([work]) = &mut part.external_work {
                work[point] += density * model.volume[part.first + point];
            }
        }
    }
}
