//! Loads, supports and initial values on this rank's points.

use crate::comm::sum::{ExactSum, reduce};
use crate::comm::{Communicator, total};
use crate::deck::expression::{Expression, Variable};
use crate::deck::plan::{Action, Plan};
use crate::error::Result;
use crate::points::set;

use super::kernels::Response;
use super::model::Model;
use super::state::State;

/// Values of an expression at some points, evaluated no more often than it can change.
struct Values {
    expression: Expression,
    changes: bool,
    varies: bool,
}

impl Values {
    fn new(expression: &Expression) -> Self {
        let space = [Variable::X, Variable::Y, Variable::Z];
        Self {
            changes: expression.uses(Variable::T),
            varies: space.iter().any(|variable| expression.uses(*variable)),
            expression: expression.clone(),
        }
    }

    /// Calls `set` with the number of each position and the value there.
    fn at(&self, positions: &[[f64; 3]], time: f64, mut set: impl FnMut(usize, f64)) {
        if self.varies {
            for (k, position) in positions.iter().enumerate() {
                set(k, self.expression.evaluate(*position, time));
            }
        } else {
            let value = self.expression.evaluate([0.0; 3], time);
            (0..positions.len()).for_each(|k| set(k, value));
        }
    }
}

/// A body force density on some points.
struct Load<const D: usize> {
    points: Vec<u32>,
    positions: Vec<[f64; 3]>,
    values: [Values; D],
    factors: [f64; D],
    /// Force density now, N/m³.
    force: Vec<[f64; D]>,
    before: Vec<[f64; D]>,
    moved_from: Vec<[f64; D]>,
}

/// What a support prescribes.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Motion {
    Displacement,
    Velocity,
}

/// One component of the motion of some points.
struct Support {
    component: usize,
    motion: Motion,
    points: Vec<u32>,
    positions: Vec<[f64; 3]>,
    values: Values,
    /// Force density that the support exerts now, N/m³.
    reaction: Vec<f64>,
    before: Vec<f64>,
    moved_from: Vec<f64>,
}

/// All loads and supports of this rank's points.
pub struct Conditions<const D: usize> {
    loads: Vec<Load<D>>,
    supports: Vec<Support>,
    /// Work done on each owned point so far, J; empty if nothing acts.
    work: Vec<f64>,
    /// Whether anything acts on any point of any rank.
    acts: bool,
}

/// Local indices of the owned points of a set, by index.
pub fn members<const D: usize>(plan: &Plan, model: &Model<D>, set: usize) -> Vec<u32> {
    let chosen = |point: usize| {
        let block = usize::from(model.block[point]);
        let (id, position) = (model.ids[point], model.position(point));
        set::contains(&plan.sets[set], plan.horizon, id, position, block)
    };
    (0..model.owned())
        .filter(|point| chosen(*point))
        .map(|point| point as u32)
        .collect()
}

/// An input error if a set that something acts on has no points on any rank.
pub fn not_empty(
    plan: &Plan,
    comm: &dyn Communicator,
    set: usize,
    members: &[u32],
    place: (&str, std::ops::Range<usize>),
) -> Result<()> {
    if total(comm, members.len() as u64) > 0 {
        return Ok(());
    }
    let message = format!(
        "{}: the set `{}` has no points",
        place.0, plan.sets[set].name
    );
    Err(plan.source.error(place.1, message))
}

/// Sets the initial displacements and velocities.
///
/// # Errors
/// On an empty set; the same on all ranks.
pub fn apply_initials<const D: usize>(
    plan: &Plan,
    comm: &dyn Communicator,
    model: &Model<D>,
    state: &mut State<D>,
) -> Result<()> {
    for initial in &plan.initials {
        let points = members(plan, model, initial.set);
        let key = format!("[initial.{}] set", initial.name);
        not_empty(
            plan,
            comm,
            initial.set,
            &points,
            (&key, initial.span.clone()),
        )?;
        for point in points {
            let position = model.position(point as usize);
            for d in 0..D {
                if let Some((values, _)) = &initial.displacement {
                    state.displacement[d][point as usize] = values[d].evaluate(position, 0.0);
                }
                if let Some((values, _)) = &initial.velocity {
                    state.velocity[d][point as usize] = values[d].evaluate(position, 0.0);
                }
            }
        }
    }
    Ok(())
}

impl<const D: usize> Conditions<D> {
    /// Finds the points of every condition. Where two supports prescribe the same component of a
    /// point, the later one holds.
    ///
    /// # Errors
    /// On an empty set; the same on all ranks.
    pub fn new(plan: &Plan, comm: &dyn Communicator, model: &Model<D>) -> Result<Self> {
        let mut loads = Vec::new();
        let mut supports: Vec<Support> = Vec::new();
        for condition in &plan.conditions {
            let points = members(plan, model, condition.set);
            let key = format!("[condition.{}] set", condition.name);
            not_empty(
                plan,
                comm,
                condition.set,
                &points,
                (&key, condition.span.clone()),
            )?;
            let mut prescribe = |motion, components: &[Option<Expression>]| {
                for (component, value) in components.iter().enumerate() {
                    let Some(value) = value else { continue };
                    for earlier in supports.iter_mut().filter(|s| s.component == component) {
                        earlier
                            .points
                            .retain(|point| points.binary_search(point).is_err());
                    }
                    supports.push(Support {
                        component,
                        motion,
                        points: points.clone(),
                        positions: Vec::new(),
                        values: Values::new(value),
                        reaction: Vec::new(),
                        before: Vec::new(),
                        moved_from: Vec::new(),
                    });
                }
            };
            match &condition.action {
                Action::Displacement(values) => prescribe(Motion::Displacement, values),
                Action::Velocity(values) => prescribe(Motion::Velocity, values),
                Action::BodyForce(values, factors) => {
                    let factors = std::array::from_fn(|d| factors[d]);
                    loads.push(Load::new(model, points, values, factors));
                }
                Action::Force(values) => {
                    let mut volume = [ExactSum::default()];
                    for point in &points {
                        volume[0].add(model.volume[*point as usize]);
                    }
                    let volume = reduce(comm, &mut volume)[0];
                    loads.push(Load::new(model, points, values, [1.0 / volume; D]));
                }
            }
        }
        for support in &mut supports {
            let count = support.points.len();
            let position = |point: &u32| model.position(*point as usize);
            support.positions = support.points.iter().map(position).collect();
            support.reaction = vec![0.0; count];
            support.before = vec![0.0; count];
            support.moved_from = vec![0.0; count];
        }
        let acts = !plan.conditions.is_empty();
        Ok(Self {
            loads,
            supports,
            work: vec![0.0; if acts { model.owned() } else { 0 }],
            acts,
        })
    }

    /// Before the points move: remembers forces and places, for the work of the coming step.
    pub fn before_moving(&mut self, state: &State<D>) {
        for load in &mut self.loads {
            load.before.copy_from_slice(&load.force);
            for (from, point) in load.moved_from.iter_mut().zip(&load.points) {
                *from = std::array::from_fn(|d| state.displacement[d][*point as usize]);
            }
        }
        for support in &mut self.supports {
            support.before.copy_from_slice(&support.reaction);
            let field = &state.displacement[support.component];
            for (from, point) in support.moved_from.iter_mut().zip(&support.points) {
                *from = field[*point as usize];
            }
        }
    }

    /// After the points have moved to time `time` (s): puts supported ones in their place. `step` is
    /// the step just made (s), 0 at the start.
    pub fn place(&self, state: &mut State<D>, time: f64, step: f64) {
        for support in &self.supports {
            let field = &mut state.displacement[support.component];
            let points = &support.points;
            match support.motion {
                Motion::Displacement => support.values.at(&support.positions, time, |k, value| {
                    field[points[k] as usize] = value;
                }),
                // The trapezoid rule, from where the points were before they drifted.
                Motion::Velocity if step > 0.0 => {
                    for (from, point) in support.moved_from.iter().zip(points) {
                        field[*point as usize] = *from;
                    }
                    for now in [time - step, time] {
                        support.values.at(&support.positions, now, |k, value| {
                            field[points[k] as usize] += 0.5 * step * value;
                        });
                    }
                }
                // At the start the points are at their initial displacement.
                Motion::Velocity => {}
            }
        }
    }

    /// Adds the loads at time `time` (s) to the force densities.
    pub fn add_loads(&mut self, time: f64, responses: &mut [Response<D>]) {
        for load in &mut self.loads {
            if time == 0.0 || load.values.iter().any(|values| values.changes) {
                load.update(time);
            }
            for (force, point) in load.force.iter().zip(&load.points) {
                let total = &mut responses[*point as usize].force;
                (0..D).for_each(|d| total[d] += force[d]);
            }
        }
    }

    /// Gives supported points their velocity at `time` (s), and finds the reactions: what a support
    /// must add to the forces so that the Verlet scheme makes the prescribed motion. `step` is the
    /// time step (s). Returns whether all of that is finite.
    pub fn guide(&mut self, model: &Model<D>, state: &mut State<D>, time: f64, step: f64) -> bool {
        let mut finite = true;
        for support in &mut self.supports {
            let (component, motion) = (support.component, support.motion);
            // Value now, and a step before and after; before the start the motion is extrapolated.
            let mut now = 0.0;
            let mut around = [0.0; 2];
            for (k, point) in support.points.iter().enumerate() {
                let position = support.positions[k];
                let value = |time: f64| support.values.expression.evaluate(position, time);
                if support.values.varies || k == 0 {
                    now = value(time);
                    // The motion may end here, as √(1 − t) does: then it is extrapolated.
                    let after = match value(time + step) {
                        after if after.is_finite() || time < step => after,
                        _ => 2.0 * now - value(time - step),
                    };
                    let before = match motion {
                        _ if time >= step => value(time - step),
                        Motion::Displacement => 2.0 * now - after,
                        Motion::Velocity => now,
                    };
                    around = [before, after];
                }
                let [before, after] = around;
                let (velocity, acceleration) = match motion {
                    Motion::Displacement => (
                        (after - before) / (2.0 * step),
                        ((after - now) - (now - before)) / (step * step),
                    ),
                    Motion::Velocity => (now, (after - before) / (2.0 * step)),
                };
                let point = *point as usize;
                let damping = model.damping_of(point) * model.density_of(point);
                let change = velocity - state.velocity[component][point];
                state.velocity[component][point] = velocity;
                let force = &mut state.responses[point].force[component];
                *force -= damping * change;
                let needed = model.density_of(point) * acceleration;
                support.reaction[k] = needed - *force;
                *force = needed;
                finite &= velocity.is_finite() && support.reaction[k].is_finite();
            }
        }
        finite
    }

    /// After forces and reactions are known at the new place: adds up the work of the step, by the
    /// trapezoid rule.
    pub fn after_moving(&mut self, model: &Model<D>, state: &State<D>) {
        for load in &self.loads {
            for (k, point) in load.points.iter().enumerate() {
                let volume = model.volume[*point as usize];
                for d in 0..D {
                    let moved = state.displacement[d][*point as usize] - load.moved_from[k][d];
                    let force = 0.5 * (load.before[k][d] + load.force[k][d]);
                    self.work[*point as usize] += force * moved * volume;
                }
            }
        }
        for support in &self.supports {
            let field = &state.displacement[support.component];
            for (k, point) in support.points.iter().enumerate() {
                let moved = field[*point as usize] - support.moved_from[k];
                let force = 0.5 * (support.before[k] + support.reaction[k]);
                self.work[*point as usize] += force * moved * model.volume[*point as usize];
            }
        }
    }

    /// Work done so far on this rank's points, J.
    pub fn work(&self) -> ExactSum {
        let mut sum = ExactSum::default();
        self.work.iter().for_each(|work| sum.add(*work));
        sum
    }

    /// Whether nothing acts on any point of any rank.
    pub fn are_none(&self) -> bool {
        !self.acts
    }

    /// What a checkpoint must hold: the work done on each owned point (J), then the force density of
    /// the supports on it by component (N/m³).
    pub fn save(&self) -> Vec<f64> {
        let width = 1 + D;
        let mut values = vec![0.0; width * self.work.len()];
        for (row, work) in values.chunks_exact_mut(width).zip(&self.work) {
            row[0] = *work;
        }
        for (point, component, reaction) in self.reactions() {
            values[width * point + 1 + component] = reaction;
        }
        values
    }

    /// Puts back what [`Self::save`] gave, at time `time` (s).
    pub fn restore(&mut self, values: &[f64], time: f64) {
        let width = 1 + D;
        for (work, row) in self.work.iter_mut().zip(values.chunks_exact(width)) {
            *work = row[0];
        }
        for support in &mut self.supports {
            for (reaction, point) in support.reaction.iter_mut().zip(&support.points) {
                *reaction = values[width * *point as usize + 1 + support.component];
            }
        }
        for load in &mut self.loads {
            load.update(time);
        }
    }

    /// Sums the force of the supports on a set's points by component, N. `members` is sorted.
    pub fn reaction(&self, model: &Model<D>, members: &[u32]) -> [ExactSum; D] {
        let mut sums = [const { ExactSum::ZERO }; D];
        for support in &self.supports {
            for (reaction, point) in support.reaction.iter().zip(&support.points) {
                if members.binary_search(point).is_ok() {
                    sums[support.component].add(reaction * model.volume[*point as usize]);
                }
            }
        }
        sums
    }

    /// What the loads add to the force density of each loaded point, N/m³.
    pub fn loads(&self) -> impl Iterator<Item = (usize, &[f64; D])> {
        self.loads.iter().flat_map(|load| {
            load.points
                .iter()
                .map(|point| *point as usize)
                .zip(&load.force)
        })
    }

    /// What the supports add to a component of the force density of each supported point, N/m³.
    pub fn reactions(&self) -> impl Iterator<Item = (usize, usize, f64)> {
        self.supports.iter().flat_map(|support| {
            let reactions = support.points.iter().zip(&support.reaction);
            reactions.map(|(point, reaction)| (*point as usize, support.component, *reaction))
        })
    }
}

impl<const D: usize> Load<D> {
    fn new(model: &Model<D>, points: Vec<u32>, values: &[Expression], factors: [f64; D]) -> Self {
        let position = |point: &u32| model.position(*point as usize);
        Self {
            positions: points.iter().map(position).collect(),
            values: std::array::from_fn(|d| Values::new(&values[d])),
            factors,
            force: vec![[0.0; D]; points.len()],
            before: vec![[0.0; D]; points.len()],
            moved_from: vec![[0.0; D]; points.len()],
            points,
        }
    }

    /// Evaluates the force density at a time (s).
    fn update(&mut self, time: f64) {
        for d in 0..D {
            let (force, factor) = (&mut self.force, self.factors[d]);
            self.values[d].at(&self.positions, time, |k, value| {
                force[k][d] = factor * value;
            });
        }
    }
}
