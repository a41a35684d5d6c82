//! Loads, supports and initial values on this rank's points.

mod finite;
mod initial;
mod loads;
mod scattered;
mod supports;
mod values;

use crate::comm::sum::{ExactSum, reduce};
use crate::comm::{Communicator, total};
use crate::deck::expression::Expression;
use crate::deck::plan::{Action, Plan};
use crate::error::Result;
use crate::points::set;
use crate::refine::{Grids, Shares};

use super::model::Model;
use super::motion::Fields;
pub use finite::are_finite;
pub use initial::apply_initials;
use loads::Load;
use supports::{Motion, Support};

/// Loads and supports of this rank's points.
#[derive(Default)]
pub struct Conditions<const D: usize> {
    loads: Vec<Load<D>>,
    supports: Vec<Support>,
}

/// Local indices of the owned points of a set, by index.
pub fn members<const D: usize>(plan: &Plan, model: &Model<D>, set: usize) -> Vec<u32> {
    let chosen = |point: usize| {
        let body = plan.body_of(usize::from(model.block[point]));
        let (id, position) = (model.ids[point], model.position(point));
        set::contains(&plan.sets[set], plan.horizon, id, position, body)
    };
    (0..model.owned())
        .filter(|point| chosen(*point))
        .map(|point| point as u32)
        .collect()
}

/// Local indices of the owned points that a load on a set acts on, and with which share where that can be less
/// than all: so the sum of the load stays the same when the grid is refined.
fn loaded<const D: usize>(
    plan: &Plan,
    model: &Model<D>,
    grids: &Grids<'_>,
    set: usize,
) -> (Vec<u32>, Option<Vec<f64>>) {
    if plan.refinement.is_none() {
        return (members(plan, model, set), None);
    }
    let mut shares = Shares::new(grids);
    // Sets of a load are not given by ids here, see `is_possible`.
    let chosen = |body: usize, position: [f64; 3]| {
        set::contains(&plan.sets[set], plan.horizon, 0, position, body)
    };
    let found = (0..model.owned()).map(|point| {
        let body = plan.body_of(usize::from(model.block[point]));
        let share = shares.of((body, model.ids[point], model.position(point)), &chosen);
        (point as u32, share)
    });
    let (points, shares) = found.filter(|(_, share)| *share > 0.0).unzip();
    (points, Some(shares))
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

impl<const D: usize> Conditions<D> {
    /// Finds the points of every condition that is `acting`. Where two supports prescribe the same
    /// component of a point, the later one holds.
    ///
    /// # Errors
    /// On an empty set; the same on all ranks.
    pub fn new(
        plan: &Plan,
        comm: &dyn Communicator,
        (model, grids): (&Model<D>, &Grids<'_>),
        acting: &[bool],
    ) -> Result<Self> {
        let mut loads = Vec::new();
        let mut supports: Vec<Support> = Vec::new();
        let conditions = plan.conditions.iter().zip(acting);
        for (condition, _) in conditions.filter(|(_, acting)| **acting) {
            let points = members(plan, model, condition.set);
            let key = format!("[condition.{}] set", condition.name);
            let place = (&key[..], condition.span.clone());
            not_empty(plan, comm, condition.set, &points, place)?;
            let mut prescribe = |motion, components: &[Option<Expression>]| {
                for (component, value) in components.iter().enumerate() {
                    let Some(value) = value else { continue };
                    for earlier in supports.iter_mut().filter(|s| s.component == component) {
                        earlier.release(&points);
                    }
                    let points = points.clone();
                    supports.push(Support::new(model, component, motion, points, value));
                }
            };
            match &condition.action {
                Action::Displacement(values) => prescribe(Motion::Displacement, values),
                Action::Velocity(values) => prescribe(Motion::Velocity, values),
                Action::BodyForce(values, factors) => {
                    let factors = std::array::from_fn(|d| factors[d]);
                    let points = loaded(plan, model, grids, condition.set);
                    loads.push(Load::new(model, points, values, factors));
                }
                Action::Force(values) => {
                    let mut volume = [ExactSum::default()];
                    let points = loaded(plan, model, grids, condition.set);
                    for (k, point) in points.0.iter().enumerate() {
                        let share = points.1.as_ref().map_or(1.0, |shares| shares[k]);
                        volume[0].add(share * model.volume[*point as usize]);
                    }
                    let volume = reduce(comm, &mut volume)[0];
                    loads.push(Load::new(model, points, values, [1.0 / volume; D]));
                }
            }
        }
        Ok(Self { loads, supports })
    }

    /// Whether there are loads; the same on all ranks.
    pub fn have_loads(&self) -> bool {
        !self.loads.is_empty()
    }

    /// Whether there are supports; the same on all ranks.
    pub fn have_supports(&self) -> bool {
        !self.supports.is_empty()
    }

    /// Before the points move: remembers forces and places, for the work of the coming step.
    pub fn before_moving(&mut self, fields: &Fields<D>) {
        for load in &mut self.loads {
            load.before_moving(fields);
        }
        for support in &mut self.supports {
            support.before_moving(fields);
        }
    }

    /// After the points have moved to time `time` (s): puts supported ones in their place. `step` is
    /// the step just made (s), 0 at the start.
    pub fn place(&self, fields: &mut Fields<D>, time: f64, step: f64) {
        for support in &self.supports {
            let component = support.component;
            support.place(&mut fields.displacement[component], time, step);
            if step > 0.0 {
                let displacement = &fields.displacement[component];
                support.set_mean_velocity(displacement, &mut fields.velocity[component], step);
            }
        }
    }

    /// Finds the external forces at `time` (s); those that do not change are found only where `all` are
    /// wanted.
    pub fn load(&mut self, fields: &mut Fields<D>, time: f64, all: bool) {
        let Some(external) = &mut fields.external_force else {
            return;
        };
        if !all && !self.loads.iter().any(Load::changes) {
            return;
        }
        for load in self.loads.iter_mut().filter(|load| all || load.changes()) {
            load.update(time);
        }
        for load in &self.loads {
            load.clear(external);
        }
        for load in &self.loads {
            load.add(external);
        }
    }

    /// Gives supported points their velocity at `time` (s), and finds the reactions. `step` is the time
    /// step (s). Returns whether all of that is finite.
    pub fn guide(&self, model: &Model<D>, fields: &mut Fields<D>, time: f64, step: f64) -> bool {
        let mut finite = true;
        for support in &self.supports {
            finite &= support.guide(model, fields, time, step);
        }
        finite
    }

    /// Finds the reactions that keep supported points where they are, at rest. Returns whether they are
    /// finite.
    pub fn hold(&self, model: &Model<D>, fields: &mut Fields<D>) -> bool {
        let mut finite = true;
        for support in &self.supports {
            finite &= support.hold(model, fields);
        }
        finite
    }

    /// Remembers forces and places of the last equilibrium, at the time `then` (s), for the work until
    /// the one at `now` (s).
    pub fn remember_equilibrium(&mut self, fields: &Fields<D>, then: f64, now: f64) {
        let Some(displacement) = &fields.equilibrium_displacement else {
            return;
        };
        for load in &mut self.loads {
            load.remember(displacement, then, now);
        }
        for support in &mut self.supports {
            support.remember(displacement, fields.equilibrium_reaction.as_ref());
        }
    }

    /// After forces and reactions are known at the new place: adds up the work of the step, by the
    /// trapezoid rule.
    pub fn add_work(&self, model: &Model<D>, fields: &mut Fields<D>) {
        let Some(work) = &mut fields.external_work else {
            return;
        };
        for load in &self.loads {
            load.add_work(model, &fields.displacement, work);
        }
        let Some(reaction) = &fields.reaction else {
            return;
        };
        for support in &self.supports {
            let component = support.component;
            let displacement = &fields.displacement[component];
            support.add_work(model, displacement, &reaction[component], work);
        }
    }

    /// Sums the force of the supports on a set's points by component, N. `members` is sorted.
    pub fn reaction(&self, model: &Model<D>, fields: &Fields<D>, members: &[u32]) -> [ExactSum; D] {
        let mut sums = [const { ExactSum::ZERO }; D];
        let Some(reaction) = &fields.reaction else {
            return sums;
        };
        for support in &self.supports {
            for point in support.points() {
                if members.binary_search(point).is_ok() {
                    let point = *point as usize;
                    let force = reaction[support.component][point] * model.volume[point];
                    sums[support.component].add(force);
                }
            }
        }
        sums
    }
}
