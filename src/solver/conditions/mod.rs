//! Loads, supports and temperatures on this rank's points.

mod finite;
mod initial;
mod load_factors;
mod loads;
mod supports;
mod temperatures;
mod values;

use crate::comm::sum::{ExactSum, reduce};
use crate::comm::{Communicator, total};
use crate::error::{Error, Result};
use crate::expression::Expression;
use crate::points::set;
use crate::problem::{Action, Body, Condition, Depth, Output, Problem};
use crate::refine::{Grids, SetFractions};

use super::model::Model;
use super::motion::Fields;
use super::motion::walk::{PART, Part, parts};
pub use finite::{are_finite, sets_are_finite, trigger_is_finite};
pub use initial::apply_initials;
pub use load_factors::LoadFactors;
use loads::{Load, Loaded};
use supports::{Motion, Support, Supported};
use temperatures::{Heated, Temperatures};

/// Loads, supports and temperatures, and the points of this rank on which they act.
#[derive(Default)]
pub struct Conditions<const D: usize> {
    loads: Vec<Load<D>>,
    supports: Vec<Support>,
    temperatures: Temperatures,
    /// The points on which conditions act, by [`Part`].
    on_parts: Vec<OnPart<D>>,
}

/// The points of a [`Part`] on which conditions act. The entries of each list are in the order of the
/// conditions in the deck.
#[derive(Default)]
pub struct OnPart<const D: usize> {
    loads: Vec<Loaded<D>>,
    supports: Vec<Supported>,
    heated: Vec<Heated>,
}

/// Formula for the work that loads and supports do from a stored state 0 to the present state.
///
/// f is the force density of a load or a reaction, u is the displacement, and V is the volume of a point. In
/// a load step in which bonds break, state 1 is the first equilibrium, and state 2 is the last equilibrium.
/// From 0 to 1, the work is ½ (f₀ + f₁)·(u₁ − u₀) V. From 1 to 2, supports do not move, and the force
/// density of loads remains f₁. The displacement u₁ is not stored for equilibrium 2. Therefore the work that
/// loads do from 0 to 2 is the sum of two terms. The first term is added at equilibrium 1, and the second
/// term at equilibrium 2:
/// ½ (f₀ − f₁)·(u₁ − u₀) V + f₁·(u₂ − u₀) V.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Work {
    /// ½ (f₀ + f)·(u − u₀) V, with the present f and u.
    Trapezoid,
    /// At the first of several equilibria: for supports, ½ (f₀ + f₁)·(u₁ − u₀) V; for loads,
    /// ½ (f₀ − f₁)·(u₁ − u₀) V.
    FirstEquilibrium,
    /// At the last of several equilibria: for supports, 0; for loads, f₁·(u₂ − u₀) V.
    LastEquilibrium,
    /// In an explicit step: for loads, as [`Self::Trapezoid`]; for supports, the change of the kinetic energy
    /// minus the work of the other forces g: ½ ρ (u̇·u̇ − u̇₀·u̇₀) V − ½ (g₀ + g)·(u − u₀) V.
    ///
    /// The trapezoidal rule is not used for supports. If the velocity of a support jumps, the rule would add
    /// part of the kinetic energy one step too early or too late. The energy balance would then not close at
    /// this time. If the next step had another length, the balance would not close afterwards either.
    Step,
}

/// The conditions that act on a [`Part`] of the points.
pub struct PartConditions<'a, const D: usize> {
    stage: StageConditions<'a, D>,
    on: &'a mut OnPart<D>,
}

/// The conditions of the stage, which all parts share.
#[derive(Clone, Copy)]
pub struct StageConditions<'a, const D: usize> {
    loads: &'a [Load<D>],
    supports: &'a [Support],
    temperatures: &'a Temperatures,
}

/// Return the local indices of the owned points of the set with this index.
pub fn members<const D: usize>(problem: &Problem, model: &Model<D>, set: usize) -> Vec<u32> {
    let chosen = |point: usize| {
        let body = problem.body_of(usize::from(model.block[point]));
        let (id, position) = (model.ids[point], model.position(point));
        set::contains(&problem.sets[set], problem.horizon, id, position, body)
    };
    (0..model.owned())
        .filter(|point| chosen(*point))
        .map(|point| point as u32)
        .collect()
}

/// Return the local indices of the owned points on which a load on a set acts. With refinement, also return
/// the fraction of each of these points that belongs to the set; `None` without refinement. With these
/// fractions, refinement does not change the total load.
fn loaded<const D: usize>(
    problem: &Problem,
    model: &Model<D>,
    grids: &Grids<'_>,
    set: usize,
) -> (Vec<u32>, Option<Vec<f64>>) {
    if problem.refinement.is_none() {
        return (members(problem, model, set), None);
    }
    let mut fractions = SetFractions::new(grids);
    // In runs with refinement, the sets of loads are never given by ids. The id 0 that is passed here is
    // therefore not read; see `refinement::trigger::is_possible`.
    let chosen = |body: usize, position: [f64; 3]| {
        set::contains(&problem.sets[set], problem.horizon, 0, position, body)
    };
    let found = (0..model.owned()).map(|point| {
        let body = problem.body_of(usize::from(model.block[point]));
        let fraction = fractions.of((body, model.ids[point], model.position(point)), &chosen);
        (point as u32, fraction)
    });
    let (points, fractions) = found.filter(|(_, fraction)| *fraction > 0.0).unzip();
    (points, Some(fractions))
}

/// The body of an owned point.
fn body_of<'p, const D: usize>(problem: &'p Problem, model: &Model<D>, point: u32) -> &'p Body {
    problem.block(usize::from(model.block[point as usize])).body
}

/// Check a load on a layer that is one spacing thick. Return an input error if a loaded point on any rank
/// belongs to a body without a [single spacing](Body::single_spacing). Do nothing for other loads.
/// Collective.
fn have_depths<const D: usize>(
    problem: &Problem,
    comm: &dyn Communicator,
    model: &Model<D>,
    condition: &Condition,
    points: &[u32],
) -> Result<()> {
    if condition.depth != Some(Depth::Spacing) {
        return Ok(());
    }
    let dimension = problem.dimension.count();
    let mut without = vec![0; problem.bodies.len()];
    for point in points {
        let body = problem.body_of(usize::from(model.block[*point as usize]));
        let divisor = condition.divisor(&problem.bodies[body], dimension);
        without[body] += u64::from(divisor.is_none());
    }
    comm.sum(&mut without);
    let first = without.iter().position(|points| *points > 0);
    first.map_or(
        Ok(()),
        |body| Err(condition.no_depth(&problem.bodies[body])),
    )
}

/// Return the loaded points for which `is_chosen` is true, with their fractions as in [`loaded`].
fn only(
    (points, fractions): &(Vec<u32>, Option<Vec<f64>>),
    is_chosen: impl Fn(u32) -> bool,
) -> (Vec<u32>, Option<Vec<f64>>) {
    let chosen = |k: &usize| is_chosen(points[*k]);
    let chosen: Vec<usize> = (0..points.len()).filter(chosen).collect();
    let fractions = fractions.as_ref();
    (
        chosen.iter().map(|k| points[*k]).collect(),
        fractions.map(|fractions| chosen.iter().map(|k| fractions[*k]).collect()),
    )
}

/// Return the local indices of the owned points that the result `output` contains; `None` for all points.
/// Collective.
///
/// # Errors
/// If the set of the result is empty; the error is the same on all ranks.
pub fn output_members<const D: usize>(
    problem: &Problem,
    output: &Output,
    comm: &dyn Communicator,
    model: &Model<D>,
) -> Result<Option<Vec<u32>>> {
    let Some((set, span)) = &output.set else {
        return Ok(None);
    };
    let points = members(problem, model, *set);
    let key = format!("{} set", output.section());
    not_empty(problem, comm, *set, &points, (&key, span.clone()))?;
    Ok(Some(points))
}

/// Return an input error if the set of a condition or output has no points on any rank. `members` are the
/// points of the set on this rank; `place` is the key and its span in the deck. Collective.
pub fn not_empty(
    problem: &Problem,
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
        place.0, problem.sets[set].name
    );
    Err(Error::input(message).at(&place.1))
}

impl<const D: usize> Conditions<D> {
    /// Find the points of the conditions that act in a stage. For each condition, `begins` contains the time
    /// (s) at which the condition begins to act; `None` if the condition does not act in this stage. If two
    /// supports prescribe the same component of a point, the support that comes later in the deck applies.
    /// Collective.
    ///
    /// # Errors
    /// - If a set is empty.
    /// - If a load acts on a layer whose thickness is the spacing, and a loaded point belongs to a body
    ///   without a single spacing.
    ///
    /// The error is the same on all ranks.
    pub fn new(
        problem: &Problem,
        comm: &dyn Communicator,
        (model, grids): (&Model<D>, &Grids<'_>),
        begins: &[Option<f64>],
    ) -> Result<Self> {
        let mut conditions = Self {
            on_parts: (0..parts(model.owned()))
                .map(|_| OnPart::default())
                .collect(),
            ..Self::default()
        };
        // The points of the supports, collected until all supports are known.
        let mut supported: Vec<Vec<u32>> = Vec::new();
        for (index, condition) in problem.conditions.iter().enumerate() {
            let Some(begin) = begins[index] else { continue };
            let points = members(problem, model, condition.set);
            let key = format!("[condition.{}] set", condition.name);
            let place = (&key[..], condition.span.clone());
            not_empty(problem, comm, condition.set, &points, place)?;
            let mut prescribe = |motion, components: &[Option<Expression>]| {
                for (component, value) in components.iter().enumerate() {
                    let Some(value) = value else { continue };
                    let earlier = conditions.supports.iter().zip(&mut supported);
                    for (_, others) in earlier.filter(|(other, _)| other.component == component) {
                        others.retain(|point| points.binary_search(point).is_err());
                    }
                    let support = Support::new(component, motion, value, begin);
                    conditions.supports.push(support);
                    supported.push(points.clone());
                }
            };
            match &condition.action {
                Action::Displacement(values) => prescribe(Motion::Displacement, values),
                Action::Velocity(values) => prescribe(Motion::Velocity, values),
                Action::BodyForce(values, factors) => {
                    have_depths(problem, comm, model, condition, &points)?;
                    let points = loaded(problem, model, grids, condition.set);
                    // All ranks, also ranks without points of the set, add the same loads.
                    let dimension = problem.dimension.count();
                    let bodies = problem.sets[condition.set].possible_bodies(&problem.bodies);
                    for divisor in condition.divisors(bodies, dimension) {
                        let is_divided = |point: u32| {
                            let body = body_of(problem, model, point);
                            condition.divisor(body, dimension) == Some(divisor)
                        };
                        let factors = std::array::from_fn(|d| factors[d] / divisor);
                        let points = only(&points, is_divided);
                        conditions.add_load(Load::new(index, values, factors), points);
                    }
                }
                Action::Force(values) => {
                    let mut volume = [ExactSum::default()];
                    let points = loaded(problem, model, grids, condition.set);
                    for (k, point) in points.0.iter().enumerate() {
                        let fraction = points.1.as_ref().map_or(1.0, |fractions| fractions[k]);
                        volume[0].add(fraction * model.volume[*point as usize]);
                    }
                    let volume = reduce(comm, &mut volume)[0];
                    let load = Load::new(index, values, [1.0 / volume; D]);
                    conditions.add_load(load, points);
                }
                Action::Temperature(value) => {
                    let temperature = conditions.temperatures.add(value);
                    for points in points.chunk_by(|a, b| part_of(*a) == part_of(*b)) {
                        let heated = Heated::new(temperature, numbers_in_part(points));
                        conditions.on_parts[part_of(points[0])].heated.push(heated);
                    }
                }
            }
        }
        for (support, points) in supported.iter().enumerate() {
            for points in points.chunk_by(|a, b| part_of(*a) == part_of(*b)) {
                let supported = Supported::new(support, numbers_in_part(points));
                conditions.on_parts[part_of(points[0])]
                    .supports
                    .push(supported);
            }
        }
        Ok(conditions)
    }

    /// Add a load on `points`, which are local indices of owned points in ascending order. The load acts on
    /// the fraction `fractions[k]` of the point `points[k]`. `fractions` is `None` if all fractions are 1.
    fn add_load(&mut self, load: Load<D>, (points, fractions): (Vec<u32>, Option<Vec<f64>>)) {
        let mut first = 0;
        for points in points.chunk_by(|a, b| part_of(*a) == part_of(*b)) {
            let own = first..first + points.len();
            first = own.end;
            let fractions = fractions.as_ref().map(|fractions| fractions[own].to_vec());
            let loaded = Loaded::new(self.loads.len(), numbers_in_part(points), fractions);
            self.on_parts[part_of(points[0])].loads.push(loaded);
        }
        self.loads.push(load);
    }

    /// Whether there are loads in the present stage; the same on all ranks.
    pub fn have_loads(&self) -> bool {
        !self.loads.is_empty()
    }

    /// Prepare the displacements of supported points at `time` (s). `step` is the length of the last step
    /// (s), 0 at the start.
    pub fn set_displacements(&mut self, time: f64, step: f64) {
        for support in &mut self.supports {
            support.set_displacements(time, step);
        }
    }

    /// Prepare the loads at `time` (s). `factors` has a factor per condition. If `all` is true, loads that
    /// have not changed are applied again, too.
    pub fn set_loads(&mut self, time: f64, factors: &[f64], all: bool) {
        for load in &mut self.loads {
            load.set_time(time, factors, all);
        }
    }

    /// Prepare the velocities of supported points at `time` (s). `step` is the time step (s).
    pub fn set_velocities(&mut self, time: f64, step: f64) {
        for support in &mut self.supports {
            support.set_velocities(time, step);
        }
    }

    /// Prepare the temperatures at a time (s).
    pub fn set_temperatures(&mut self, time: f64) {
        self.temperatures.set_time(time);
    }

    /// Make the next call of [`Self::set_temperatures`] mark all temperatures as changed.
    /// [`PartConditions::apply_temperatures`] then sets the temperatures of all points.
    pub fn reset_temperatures(&mut self) {
        self.temperatures.reset();
    }

    /// Return the conditions of the stage, and for each part the points on which these conditions act.
    pub fn by_part(&mut self) -> (StageConditions<'_, D>, &mut [OnPart<D>]) {
        let stage = StageConditions {
            loads: &self.loads,
            supports: &self.supports,
            temperatures: &self.temperatures,
        };
        (stage, &mut self.on_parts)
    }

    /// Return a column per component, with an entry for each of the `local` points. The entry of an owned
    /// point is 0 if a support prescribes this component of the point. All other entries are 1.
    pub fn free_components(&self, local: usize) -> [Vec<f64>; D] {
        let mut free = std::array::from_fn(|_| vec![1.0; local]);
        for (number, part) in self.on_parts.iter().enumerate() {
            for supported in &part.supports {
                let (component, points) = supported.points(&self.supports);
                points.for_each(|point| free[component][number * PART + point] = 0.0);
            }
        }
        free
    }

    /// Sum the forces that supports exert on some owned points, by component (N). `members` are the sorted
    /// local indices of these points.
    pub fn reaction(&self, model: &Model<D>, fields: &Fields<D>, members: &[u32]) -> [ExactSum; D] {
        let mut sums = [const { ExactSum::ZERO }; D];
        let Some(reaction) = &fields.reaction else {
            return sums;
        };
        for (number, part) in self.on_parts.iter().enumerate() {
            for supported in &part.supports {
                let (component, points) = supported.points(&self.supports);
                for point in points.map(|point| number * PART + point) {
                    if members.binary_search(&(point as u32)).is_ok() {
                        let force = reaction[component][point] * model.volume[point];
                        sums[component].add(force);
                    }
                }
            }
        }
        sums
    }

    /// For each condition with loads in this stage, sum `weight(point, force)` over the loads and the points
    /// on which they act. Only points in `points` count. `points` are sorted local indices of owned points.
    /// The arguments of `weight` are the local index of a point and the force of a load on this point (N).
    /// Returns the indices of the conditions, and the sums of this rank.
    pub fn load_sums(
        &self,
        model: &Model<D>,
        points: &[usize],
        weight: impl Fn(usize, [f64; D]) -> f64,
    ) -> (Vec<usize>, Vec<ExactSum>) {
        // The loads of a condition are adjacent.
        let mut conditions: Vec<usize> = self.loads.iter().map(Load::condition).collect();
        conditions.dedup();
        let mut sums = vec![ExactSum::ZERO; conditions.len()];
        for (number, part) in self.on_parts.iter().enumerate() {
            for loaded in &part.loads {
                let condition = self.loads[loaded.load()].condition();
                let entry = conditions.partition_point(|other| *other < condition);
                for (point, density) in loaded.densities() {
                    let point = number * PART + point;
                    if points.binary_search(&point).is_ok() {
                        let force = density.map(|density| model.volume[point] * density);
                        sums[entry].add(weight(point, force));
                    }
                }
            }
        }
        (conditions, sums)
    }

    /// Return an upper estimate of the kinetic energy (J) that loads and prescribed motions add in one step,
    /// but that is not part of the recorded work. `step` is the length of the step, s. The work of a load is
    /// integrated by the trapezoidal rule, which misses the energy that the load adds in one step to points
    /// initially at rest. The works of several supports can cancel. A supported component therefore
    /// contributes the kinetic energy of its velocity, and the energy that a point initially at rest gains
    /// from the prescribed acceleration in one step.
    ///
    /// Verlet conserves ½ ρ u̇² − Δt² f²/8ρ instead of ½ ρ u̇². So when the force density on a point jumps
    /// from 0 to f, the energy ½ ρ u̇² jumps by Δt² f²/8ρ. Internal forces are excluded, because they grow
    /// without bound in an unstable run.
    pub fn step_energy(&self, model: &Model<D>, fields: &Fields<D>, step: f64) -> ExactSum {
        let mut sum = ExactSum::ZERO;
        let kinetic = |point: usize, velocity: f64| {
            0.5 * model.density_of(point) * model.volume[point] * velocity * velocity
        };
        for force in fields.external_force.iter().flatten() {
            let loaded = force.iter().enumerate().filter(|(_, force)| **force != 0.0);
            for (point, force) in loaded {
                sum.add(kinetic(point, step * force / model.density_of(point)));
            }
        }
        for (number, part) in self.on_parts.iter().enumerate() {
            for supported in &part.supports {
                let (component, points) = supported.points(&self.supports);
                for point in points.map(|point| number * PART + point) {
                    let needed = fields.total_force(model, component, point);
                    sum.add(kinetic(point, step * needed / model.density_of(point)));
                    sum.add(kinetic(point, fields.velocity[component][point]));
                }
            }
        }
        sum
    }
}

/// Index of the part that contains an owned point.
fn part_of(point: u32) -> usize {
    point as usize / PART
}

/// Return the index of each of these owned points in its part.
fn numbers_in_part(points: &[u32]) -> Vec<u16> {
    let each = points.iter().map(|point| *point as usize);
    each.map(|point| (point % PART) as u16).collect()
}

impl<'a, const D: usize> PartConditions<'a, D> {
    /// Combine the conditions of the stage with `on`, the points of one part on which these conditions act.
    pub fn new(stage: StageConditions<'a, D>, on: &'a mut OnPart<D>) -> Self {
        Self { stage, on }
    }

    /// Set temperature and thermal stretch of the points, if temperatures may have changed.
    pub fn apply_temperatures(&self, part: &mut Part<'_, D>) {
        self.stage.temperatures.apply(&self.on.heated, part);
    }

    /// Whether no load and no support acts on this part.
    pub fn is_empty(&self) -> bool {
        self.on.loads.is_empty() && self.on.supports.is_empty()
    }

    /// Store force densities and displacements before the points move, for the work of the next step. `work`
    /// is the formula for this work.
    pub fn before_moving(&mut self, part: &Part<'_, D>, work: Work) {
        let displacement = part.displacement.each_ref().map(|column| &**column);
        let reaction = part.reaction.as_ref();
        let reaction = reaction.map(|reaction| reaction.each_ref().map(|column| &**column));
        self.record_for_work(displacement, reaction);
        if work == Work::Step {
            for support in &mut self.on.supports {
                support.record_motion(self.stage.supports, part);
            }
        }
    }

    /// Store force densities and displacements for the work of the next step. The arguments are the
    /// displacements (m) and reactions (N/m³) of all points of the part.
    pub fn record_for_work(&mut self, displacement: [&[f64]; D], reaction: Option<[&[f64]; D]>) {
        for load in &mut self.on.loads {
            load.record_for_work(displacement);
        }
        for support in &mut self.on.supports {
            support.record_for_work(self.stage.supports, displacement, reaction);
        }
    }

    /// Set the displacements of supported points, after the other points have moved.
    pub fn apply_displacements(&self, part: &mut Part<'_, D>) {
        for support in &self.on.supports {
            support.apply_displacements(self.stage.supports, part);
        }
    }

    /// Compute the force densities of the loads that are due, see `Load::is_due`.
    pub fn find_loads(&mut self, part: &Part<'_, D>) {
        for load in &mut self.on.loads {
            load.compute_densities(self.stage.loads, part);
        }
    }

    /// Update the external forces if any load is due, see `Load::is_due`.
    pub fn apply_loads(&mut self, part: &mut Part<'_, D>) {
        if !self.stage.loads.iter().any(|load| load.is_due) {
            return;
        }
        self.find_loads(part);
        for load in &self.on.loads {
            load.clear(part);
        }
        for load in &self.on.loads {
            load.add(part);
        }
    }

    /// Set the supported components of the velocities, and compute the reactions. Returns whether these
    /// velocities and reactions are finite.
    pub fn apply_velocities(&self, part: &mut Part<'_, D>) -> bool {
        let mut finite = true;
        for support in &self.on.supports {
            finite &= support.apply_velocities(self.stage.supports, part);
        }
        finite
    }

    /// Set the supported components of the velocities to 0, and compute the reactions that keep the points at
    /// rest in these components. Returns whether the reactions are finite.
    pub fn project_residual(&self, part: &mut Part<'_, D>) -> bool {
        let mut finite = true;
        for support in &self.on.supports {
            finite &= support.project_residual(self.stage.supports, part);
        }
        finite
    }

    /// Add the work of loads and supports since the last call of [`Self::record_for_work`]. Force densities
    /// and reactions must belong to the present positions.
    pub fn add_work(&self, part: &mut Part<'_, D>, work: Work) {
        for load in &self.on.loads {
            load.add_work(part, work);
        }
        for support in &self.on.supports {
            support.add_work(self.stage.supports, part, work);
        }
    }
}
