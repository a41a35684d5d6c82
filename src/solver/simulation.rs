//! A run: from the plan to points in motion, step by step.

use std::cell::Cell;
use std::time::{Duration, Instant};

use crate::comm::{self, Communicator, agree};
use crate::deck::plan::{Plan, StepRule};
use crate::deck::shown;
use crate::error::{Error, Result};
use crate::partition::distribute;
use crate::{families, points};

use super::assign::{assign, block_laws, cutoffs};
use super::conditions::{Conditions, apply_initials, members};
use super::damping::Damping;
use super::forces::{ForceTimes, Forces};
use super::grids::grids;
use super::model::Model;
use super::size;
use super::stable_step::stable_step;
use super::state::State;
use super::{values, verlet};

/// The share of the longest bond by which ghosts may lie farther away: points may be a millionth of a
/// cell off their grid.
const SLACK: f64 = 1e-5;

/// A run on one rank.
pub struct Simulation<'a, const D: usize> {
    /// The validated deck.
    pub plan: &'a Plan,
    /// The other ranks.
    pub comm: &'a dyn Communicator,
    /// The points.
    pub model: Model<D>,
    /// Their motion.
    pub state: State<D>,
    /// Their bonds.
    pub forces: Forces<D>,
    /// Loads and supports.
    pub conditions: Conditions<D>,
    /// What viscous damping takes.
    pub damping: Damping,
    /// Volume of each owned point's whole family, broken bonds included, m³.
    pub family_volume: Vec<f64>,
    /// Bonds of the owned points that each pre-crack cuts, counted from their ends here.
    pub cut: Vec<u64>,
    /// The stable step, s.
    pub stable_step: f64,
    /// The time step, s.
    pub step: f64,
    /// Number of the last step.
    pub last: u64,
    /// Number of steps made.
    pub number: u64,
    /// Where the time went.
    pub times: Times,
    bad: Option<BadPoint>,
}

/// Wall-clock time by phase on this rank.
#[derive(Debug, Clone, Copy, Default)]
pub struct Times {
    /// Points, partition, families.
    pub set_up: Duration,
    /// Bonds and halo in the time loop.
    pub forces: ForceTimes,
    /// Integration and conditions.
    pub motion: Duration,
}

/// The first point of a rank whose velocity was not finite.
#[derive(Debug, Clone, Copy)]
struct BadPoint {
    step: u64,
    id: u64,
    index: usize,
}

impl<'a, const D: usize> Simulation<'a, D> {
    /// Makes, distributes and bonds the points, and evaluates the forces at time 0.
    ///
    /// # Errors
    /// When the points cannot be made, a set that is acted on is empty, or no stable step exists; the
    /// same on all ranks.
    pub fn new(plan: &'a Plan, comm: &'a dyn Communicator) -> Result<Self> {
        let start = Instant::now();
        let cutoffs = cutoffs(plan);
        size::is_feasible(plan, &cutoffs, comm.size())?;
        let (pieces, total) = points::generate(plan, comm)?;
        let longest = cutoffs.iter().copied().fold(0.0, f64::max);
        // Bonds at the limit must find their ghosts however their length is rounded.
        let mut domain = distribute(comm, pieces, total, longest * (1.0 + SLACK))?;
        let frames = grids(plan, comm, &domain, longest)?;
        families::arrange(&mut domain, &frames);
        let (bodies, dimension) = (plan.bodies.len(), plan.dimension.count());
        let found = families::find(&domain, &frames, bodies, &cutoffs, dimension)
            .map_err(|fault| fault.error(plan));
        let (families, grids) = agree(comm, found)?;
        let model = Model::new(plan, &domain);
        let bodies = plan.bodies.iter();
        let blocks: Vec<_> = bodies.map(|body| block_laws(plan, body)).collect();
        let halo = std::mem::take(&mut domain.halo);
        // The points are known to the model from here on.
        drop(domain);
        let bonds = assign(plan, &model, &blocks, families);
        let mut forces = Forces::new(comm, &model, bonds, grids, halo, blocks)?;
        let stable = stable_step(comm, &model, &forces.stiffness(&model));
        let mut state = State::new(&model);
        let (step, last) = choose_step(plan, stable)?;
        let family_volume = forces.family_volume(&model);
        let cut = pre_crack(plan, &model, &mut forces);
        protect(plan, &model, comm, &mut forces);

        apply_initials(plan, comm, &model, &mut state)?;
        let conditions = Conditions::new(plan, comm, &model)?;
        values::are_finite(plan, comm, &model, 0.0)?;
        let mut simulation = Self {
            damping: Damping::new(&model),
            plan,
            comm,
            model,
            state,
            forces,
            conditions,
            family_volume,
            cut,
            stable_step: stable,
            step,
            last,
            number: 0,
            times: Times::default(),
            bad: None,
        };
        simulation.conditions.place(&mut simulation.state, 0.0, 0.0);
        simulation.act(None);
        simulation
            .damping
            .after_moving(&simulation.model, &simulation.state, 0.0);
        simulation.bad = simulation.first_bad();
        simulation.times = Times {
            set_up: start.elapsed(),
            ..Times::default()
        };
        Ok(simulation)
    }

    /// Time reached, s.
    pub fn time(&self) -> f64 {
        self.number as f64 * self.step
    }

    /// Makes one step.
    pub fn advance(&mut self) {
        let start = Instant::now();
        self.conditions.before_moving(&self.state);
        verlet::kick_and_drift(&self.model, &mut self.state, self.step);
        self.number += 1;
        let time = self.time();
        self.conditions.place(&mut self.state, time, self.step);
        self.times.motion += start.elapsed();
        self.act(Some(self.step));
        let start = Instant::now();
        self.conditions.after_moving(&self.model, &self.state);
        self.damping
            .after_moving(&self.model, &self.state, self.step);
        self.times.motion += start.elapsed();
    }

    /// Forces, loads and reactions at the present place, and the half kick that ends a step.
    fn act(&mut self, kick: Option<f64>) {
        self.forces.evaluate(
            self.comm,
            &self.model,
            &mut self.state.displacement,
            &mut self.state.responses,
            &mut self.times.forces,
        );
        let start = Instant::now();
        let time = self.time();
        self.conditions.add_loads(time, &mut self.state.responses);
        let mut finite = match kick {
            Some(step) => verlet::kick(&self.model, &mut self.state, step),
            None => true,
        };
        let (model, state) = (&self.model, &mut self.state);
        self.damping.add(model, state);
        finite &= self.conditions.guide(model, state, time, self.step);
        if !finite && self.bad.is_none() {
            self.bad = self.first_bad();
        }
        self.times.motion += start.elapsed();
    }

    /// The point with the smallest id among those with a motion or force that is not finite.
    fn first_bad(&self) -> Option<BadPoint> {
        (0..self.model.owned())
            .filter(|k| {
                let motion = self.state.velocity.iter().chain(&self.state.displacement);
                let force = self.state.responses[*k].force;
                let mut values = motion.map(|field| field[*k]).chain(force);
                values.any(|value| !value.is_finite())
            })
            .min_by_key(|k| self.model.ids[*k])
            .map(|index| BadPoint {
                step: self.number,
                id: self.model.ids[index],
                index,
            })
    }

    /// Looks on all ranks whether every value is still finite.
    ///
    /// # Errors
    /// Names the first point (earliest step, then smallest id) that was not.
    pub fn check(&self) -> Result<()> {
        let mut earliest = [self.bad.map_or(f64::MAX, |bad| bad.step as f64)];
        comm::min(self.comm, &mut earliest);
        if earliest[0] == f64::MAX {
            return Ok(());
        }
        let time = earliest[0] * self.step;
        values::are_finite(self.plan, self.comm, &self.model, time)
            .map_err(|error| Error::run(error.message))?;
        let own = self.bad.filter(|bad| bad.step as f64 == earliest[0]);
        let mut smallest = [own.map_or(f64::MAX, |bad| bad.id as f64)];
        comm::min(self.comm, &mut smallest);
        let named = match own.filter(|bad| bad.id as f64 == smallest[0]) {
            None => Ok(()),
            Some(bad) => {
                let block = usize::from(self.model.block[bad.index]);
                let body = &self.plan.bodies[block];
                let position = self.model.position(bad.index);
                Err(if bad.step == 0 {
                    let message = format!(
                        "[body.{}]: the force on its point {}, {:?} m, is not finite at the start; \
                         do displacements move points onto one another?",
                        body.name,
                        bad.id,
                        &position[..D],
                    );
                    self.plan.source.error(body.span.clone(), message)
                } else {
                    Error::run(format!(
                        "step {} (t = {time:.6e} s): the motion of point {} of body `{}` is not \
                         finite; reference position {:?} m. A time step beyond the stable one, or a \
                         load that grows without bound? (time step {:.3e} s, stable {:.3e} s)",
                        bad.step,
                        bad.id,
                        body.name,
                        &position[..D],
                        self.step,
                        self.stable_step,
                    ))
                })
            }
        };
        agree(self.comm, named)
    }
}

/// The time step and the number of the last one. An automatic step divides the run evenly.
///
/// # Errors
/// When there is no stable step, or there are more steps than can be counted.
pub fn choose_step(plan: &Plan, stable: f64) -> Result<(f64, u64)> {
    let (step, last) = match plan.time.step {
        StepRule::Fixed(step) => (step, steps_to(plan.time.end, step)),
        StepRule::Automatic(_) if stable.is_infinite() => {
            return Err(plan.source.error(
                plan.places.horizon.clone(),
                "[grid] horizon: no point has a neighbour, so there is no stable step; is the horizon \
                 in m and larger than the distance of the points?",
            ));
        }
        StepRule::Automatic(safety) => {
            let last = (plan.time.end / (safety * stable)).ceil();
            (plan.time.end / last, last)
        }
    };
    if last > 1e15 {
        let message = format!(
            "[time] end: {} s take {last:.1e} steps of {step:.1e} s",
            shown(plan.time.end)
        );
        return Err(plan.source.error(plan.places.step.clone(), message));
    }
    Ok((step, last.max(1.0) as u64))
}

/// The number of steps (s) that reach an end time (s), up to rounding.
pub(super) fn steps_to(end: f64, step: f64) -> f64 {
    let steps = end / step;
    match (steps - steps.round()).abs() < 1e-9 * steps {
        true => steps.round(),
        false => steps.ceil(),
    }
}

/// Breaks the bonds that cross a pre-crack, and counts them by crack. Both ends ask with the lower id
/// first.
fn pre_crack<const D: usize>(plan: &Plan, model: &Model<D>, forces: &mut Forces<D>) -> Vec<u64> {
    if plan.cracks.is_empty() {
        return Vec::new();
    }
    let counts = vec![Cell::new(0); plan.cracks.len()];
    forces.cut(|here, there| {
        let (first, second) = match model.ids[here] < model.ids[there] {
            true => (here, there),
            false => (there, here),
        };
        let [from, to] = [first, second].map(|point| model.position(point));
        let mut cut = false;
        for (crack, count) in plan.cracks.iter().zip(&counts) {
            if points::crack::crosses(&crack.surface, from, to) {
                count.set(count.get() + 1);
                cut = true;
            }
        }
        cut
    });
    counts.into_iter().map(Cell::into_inner).collect()
}

/// Makes the bonds of no-failure zones unbreakable.
fn protect<const D: usize>(
    plan: &Plan,
    model: &Model<D>,
    comm: &dyn Communicator,
    forces: &mut Forces<D>,
) {
    let laws = plan.bodies.iter().filter_map(|body| body.damage.as_ref());
    let mut sets: Vec<usize> = laws
        .flat_map(|law| law.no_failure.iter().copied())
        .collect();
    sets.sort_unstable();
    sets.dedup();
    if sets.is_empty() {
        return;
    }
    let mut protected = vec![0.0; model.volume.len()];
    for set in sets {
        for point in members(plan, model, set) {
            let body = &plan.bodies[usize::from(model.block[point as usize])];
            if body
                .damage
                .as_ref()
                .is_some_and(|law| law.no_failure.contains(&set))
            {
                protected[point as usize] = 1.0;
            }
        }
    }
    forces.protect(comm, &mut protected);
}
