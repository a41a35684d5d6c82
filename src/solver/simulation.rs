//! The part of a run on one rank: set-up from the problem, and time steps.

use std::cell::Cell;
use std::time::{Duration, Instant};

use crate::comm::{self, Communicator, Found, agree, least};
use crate::error::{Error, ErrorKind, Result};
use crate::partition::distribute_by_time;
use crate::points::Point;
use crate::problem::{Action, Condition, Damage, Initial, Problem, Time};
use crate::refine::Grids;
use crate::{families, points};

use super::assign::{assign, block_laws, cutoffs, laws_are_possible};
use super::bonds::{Acting, BondUpdate, ForceTimes, Forces, history_fits};
use super::conditions::{
    Conditions, PartConditions, Work, apply_initials, are_finite, members, sets_are_finite,
    trigger_is_finite,
};
use super::contact::{Contact, ContactEvaluation, StepEnd};
use super::grids::grids;
use super::model::Model;
use super::motion::fictitious_density::fictitious_density;
use super::motion::fields::{Needs, plastic_columns};
use super::motion::integrator::{Integrator, integrator};
use super::motion::stable_step::stable_step;
use super::motion::walk::{Part, walk};
use super::motion::{Clock, Fields, Kept, verlet};
use super::palette_column::PaletteColumn;
use super::progress::Progress;
use super::refinement;
use super::size;
use super::stages::Stages;
use super::stages::begins;
use super::steps::choose_steps;

/// Extra reach, as a fraction of the longest bond, in the search for ghosts and for points near pre-cracks.
/// This reach is needed because points may deviate from their grid by a millionth of a cell.
const SLACK: f64 = 1e-5;

/// The part of a run on one rank.
pub struct Simulation<'a, const D: usize> {
    /// The problem.
    pub problem: &'a Problem,
    /// Communication with the other ranks.
    pub comm: &'a dyn Communicator,
    /// The local points: positions, volumes and blocks.
    pub model: Model<D>,
    /// The fields of the points.
    pub fields: Fields<D>,
    /// The bonds and their forces.
    pub forces: Forces<D>,
    /// Contact between points that no intact bond joins, and contact of points with rigid bodies. `None` in
    /// runs without contact.
    pub contact: Option<Contact<D>>,
    /// Conditions of the present stage.
    pub conditions: Conditions<D>,
    /// Rules of all stages, and conditions of all stages except the present stage.
    pub stages: Stages<D>,
    /// Quantities of the undeformed bodies.
    pub undeformed: Undeformed,
    /// Time, time step and number of steps of the run.
    pub clock: Clock,
    /// Integrator of the present stage; `None` while the integrator advances the simulation.
    pub(super) integrator: Option<Box<dyn Integrator<D>>>,
    /// Progress of the run, without point data and clock.
    pub progress: Progress,
    /// Copy of the state before the present step; empty if steps are not rolled back.
    pub(super) kept: Kept,
    /// The refined grids of the bodies.
    pub grids: Grids<'a>,
    /// Wall-clock time by phase.
    pub times: Times,
    bad: Option<BadPoint>,
}

/// Quantities of the undeformed bodies.
#[derive(Debug)]
pub struct Undeformed {
    /// Volume of each owned point's whole family, including broken bonds, m³.
    pub family_volume: PaletteColumn,
    /// For each pre-crack: number of cut bonds of the owned points. A bond between two owned points counts
    /// twice.
    pub cut: Vec<u64>,
    /// Number of intact bonds of the owned points before any bond could break. A bond between two owned
    /// points counts twice. `None` if no bond can break at the initial positions, see `starts_deformed`.
    pub intact: Option<u64>,
    /// Stable step with the unscaled density of the materials, s.
    pub stable_step: f64,
}

/// Wall-clock time by phase on this rank.
#[derive(Debug, Clone, Copy, Default)]
pub struct Times {
    /// Set-up: points, partition, families, conditions and the first forces.
    pub set_up: Duration,
    /// Bond forces and halo exchanges in the time loop.
    pub forces: ForceTimes,
    /// Contact search and contact forces.
    pub contact: Duration,
    /// Parts of steps that are in no other phase: integration, conditions, and the solution of load steps.
    /// This includes the time to copy displacements and thermal stretches for the bond passes.
    pub motion: Duration,
    /// Number of force evaluations in the time loop.
    pub evaluations: u64,
    /// Refinement of grids, and rebalancing.
    pub regridding: Duration,
}

/// Start of a phase, see [`Times::start`].
pub(super) struct PhaseStart {
    start: Instant,
    /// Value of [`Times::counted`] at the start of the phase.
    counted: Duration,
}

impl Times {
    /// Start a phase that may contain other phases, such as motion with force evaluations.
    pub(super) fn start(&self) -> PhaseStart {
        PhaseStart {
            start: Instant::now(),
            counted: self.counted(),
        }
    }

    /// Time since the start of a phase, minus the time that other phases have counted since then. No time is
    /// therefore counted twice.
    pub(super) fn since(&self, phase: &PhaseStart) -> Duration {
        let others = self.counted() - phase.counted;
        phase.start.elapsed().saturating_sub(others)
    }

    /// Time of all phases of the time loop.
    fn counted(&self) -> Duration {
        self.forces.whole() + self.contact + self.motion + self.regridding
    }
}

/// The first point of this rank whose motion, force or reaction is not finite. If several points are found at
/// the same step, this is the one with the smallest id.
#[derive(Debug, Clone, Copy)]
struct BadPoint {
    step: u64,
    /// Index of the stage. At the end of a stage, it is this stage and not the next one.
    stage: usize,
    time: f64,
    id: u64,
    block: u16,
    position: [f64; 3],
}

impl<'a, const D: usize> Simulation<'a, D> {
    /// Create and distribute the points and bonds, and evaluate the forces at time 0. Collective.
    ///
    /// # Errors
    /// If the problem cannot be run, for example in these cases:
    ///
    /// - The problem has not `D` dimensions, or a value is not allowed ([`Problem::check`]).
    /// - The points cannot be created.
    /// - The set of a condition contains no points.
    /// - There is no stable step.
    /// - In a quasi-static stage, no support holds a piece on which a load acts.
    ///
    /// The error is the same on all ranks.
    pub fn new(problem: &'a Problem, comm: &'a dyn Communicator) -> Result<Self> {
        Self::set_up(problem, comm, &mut || Ok(()))
    }

    /// Same as [`Self::new`], with a call of `between` between the phases of the set-up. An error of
    /// `between` ends the set-up; the error must be the same on all ranks.
    ///
    /// # Errors
    /// The errors of [`Self::new`] and of `between`.
    pub fn set_up(
        problem: &'a Problem,
        comm: &'a dyn Communicator,
        between: &mut dyn FnMut() -> Result<()>,
    ) -> Result<Self> {
        let start = Instant::now();
        problem.check_dimension(D)?;
        problem.check()?;
        laws_are_possible(problem)?;
        refinement::is_possible(problem)?;
        problem.check_contact()?;
        let cutoffs = cutoffs(problem);
        size::is_feasible(problem, &cutoffs, comm.size())?;
        let (coarse, coarsest) = points::generate(problem, comm)?;
        let mut refined = Grids::new(problem, coarsest)?;
        refined.refine_regions(comm, &coarse)?;
        let points = refined.points(coarse);
        between()?;
        let mut simulation = Self::of_points(problem, comm, (points, refined), None, between)?;
        apply_initials(problem, comm, &simulation.model, &mut simulation.fields)?;
        simulation.begin();
        simulation.check_loads_are_held()?;
        simulation.can_bond_new_points()?;
        trigger_is_finite(problem, comm, &simulation.model, 0.0)?;
        simulation.times.set_up = start.elapsed();
        Ok(simulation)
    }

    /// Distribute the points of the given grids over the ranks, and create the bonds of these points.
    /// `points` are the points of this rank before the distribution. `time` is the measured computing time of
    /// this rank's points (ns); `None` if this time is not known. `between` is the same as for
    /// [`Self::set_up`]. Initial values are not set, and forces are not evaluated. Collective.
    pub(super) fn of_points(
        problem: &'a Problem,
        comm: &'a dyn Communicator,
        (points, refined): (Vec<Point>, Grids<'a>),
        time: Option<u64>,
        between: &mut dyn FnMut() -> Result<()>,
    ) -> Result<Self> {
        let cutoffs = cutoffs(problem);
        let total = comm::total(comm, points.len() as u64);
        let longest = cutoffs.iter().copied().fold(0.0, f64::max);
        // With this slack, both ends of the longest bonds exist on the rank, for any rounding of the bond
        // length.
        let mut domain = distribute_by_time(comm, points, total, longest * (1.0 + SLACK), time)?;
        between()?;
        let frames = grids(problem, comm, &domain, longest)?;
        families::arrange(&mut domain, &frames);
        let (blocks, dimension) = (problem.block_count(), problem.dimension.count());
        let found = families::find(&domain, &frames, blocks, &cutoffs, dimension)
            .map_err(|fault| fault.error(problem));
        let (bonds, grids) = agree(comm, found)?;
        between()?;
        let model = Model::new(problem, &domain, refined.coarsest());
        sets_are_finite(problem, comm, &model)?;
        let blocks = problem.blocks();
        let blocks: Vec<_> = blocks.map(|block| block_laws(problem, &block)).collect();
        let is_thermal = problem.has_temperature();
        let halo = std::mem::take(&mut domain.halo);
        // From here on, the points are stored in the model.
        drop(domain);
        let interactions = assign(problem, &model, &blocks, bonds)
            .and_then(|all| history_fits::<D>(&all).map(|()| all))
            .map_err(|fault| fault.error(problem));
        let interactions = agree(comm, interactions)?;
        let mut forces = Forces::new(comm, &model, interactions, grids, halo, blocks, is_thermal)?;
        between()?;
        let family_volume = PaletteColumn::new(forces.intact_families(&model).volume);
        let cut = pre_crack(problem, &model, &mut forces);
        forces.find_constants(comm, &model);
        let stiffness = forces.stiffness(&model);
        let stable = stable_step(comm, &model, &stiffness);
        let stages = problem.all_stages();
        let steps = choose_steps(problem, stable)?;
        let clock = Clock::new(steps[0].0, stages[0].time.end);
        protect(problem, &model, comm, &mut forces);

        let each = (0..stages.len()).map(|stage| begins(&stages, stage));
        let each = each.map(|begins| Conditions::new(problem, comm, (&model, &refined), &begins));
        let mut waiting = each
            .map(|conditions| conditions.map(Some))
            .collect::<Result<Vec<_>>>()?;
        let mut fields = Fields::new(&model, Needs::new(problem, forces.has_plasticity()));
        if let Some(density) = &mut fields.fictitious_density {
            *density = fictitious_density(&stiffness);
        }
        are_finite(problem, comm, &model, (0, 0.0))?;
        let intact_at_start = starts_deformed(problem).then(|| {
            let mut intact = 0;
            forces.for_each_intact(|_, _| intact += 1);
            intact
        });
        let contact = Contact::new(problem, comm, &model)?;
        let mut simulation = Self {
            problem,
            comm,
            model,
            fields,
            forces,
            contact,
            conditions: waiting[0].take().unwrap_or_default(),
            integrator: Some(integrator(&stages[0].time)),
            stages: Stages {
                all: stages,
                steps,
                waiting,
            },
            undeformed: Undeformed {
                family_volume,
                cut,
                intact: intact_at_start,
                stable_step: stable,
            },
            clock,
            progress: Progress::new(problem.conditions.len()),
            kept: Kept::default(),
            grids: refined,
            times: Times::default(),
            bad: None,
        };
        simulation.scale_density();
        simulation.begin_adapting();
        Ok(simulation)
    }

    /// Set the displacements and velocities of supported points, and evaluate all forces and reactions at
    /// time 0. Collective.
    fn begin(&mut self) {
        self.apply_displacements(0.0, 0.0);
        self.apply_loads(0.0, true);
        self.evaluate(if self.is_quasi_static() {
            // The initial state is not an equilibrium, so no bond breaks.
            BondUpdate::None
        } else {
            BondUpdate::Step(0.0)
        });
        self.apply_velocities();
        self.update_damping_power();
        self.bad = self.first_bad(&self.clock);
        self.times = Times::default();
    }

    /// Method and time settings of the present stage.
    pub fn time_rule(&self) -> Time {
        self.stages.all[self.progress.stage].time
    }

    /// Make one step, or one iteration of a load step. A sequence of steps is faster with a
    /// [`Stepper`](super::Stepper). Collective.
    pub fn advance(&mut self) {
        if self.leap(false) {
            self.kick();
        }
    }

    /// Make one explicit time step, or one iteration of a load step. An explicit step may leave its second
    /// half kick to the next call. `half_kick_pending` says whether the second half kick of the previous step
    /// must still be applied. This argument must be false if a stage begins or if contact changes the step.
    /// Returns whether the second half kick of this step must still be applied. Collective.
    pub(super) fn leap(&mut self, half_kick_pending: bool) -> bool {
        let start = self.times.start();
        if let Some(stage) = self.next_stage() {
            self.begin_stage(stage);
        }
        if self.progress.load_step.is_settled {
            self.progress.newton.evaluations = 0;
        }
        let evaluations = self.times.evaluations;
        // The integrator is taken out while it advances the simulation.
        let mut integrator = (self.integrator.take()).expect("each stage has an integrator");
        let is_pending = integrator.advance(self, half_kick_pending);
        self.integrator = Some(integrator);
        self.progress.newton.evaluations += self.times.evaluations - evaluations;
        let motion = self.times.since(&start);
        self.times.motion += motion;
        is_pending
    }

    /// Apply the second half kick of the step that ends at the present time.
    pub(super) fn kick(&mut self) {
        let start = self.times.start();
        let clock = self.clock;
        self.set_second_half(&clock);
        let finite =
            self.walk(|part, mut conditions| second_half(part, &mut conditions, clock.step()));
        if !finite {
            self.note_bad(&clock);
        }
        let motion = self.times.since(&start);
        self.times.motion += motion;
    }

    /// Make one explicit step without its second half kick. If the second half kick of the previous step is
    /// pending, apply that half kick first. Collective.
    pub(super) fn make_step(&mut self, half_kick_pending: bool) {
        let before = self.clock;
        let step = before.step();
        if half_kick_pending {
            self.set_second_half(&before);
        }
        self.clock.advance();
        self.conditions.set_displacements(self.clock.time(), step);
        self.conditions.set_temperatures(self.clock.time());
        if let Some(contact) = &mut self.contact {
            contact.drift(self.clock.time(), step);
        }
        let finite = self.walk(|part, mut conditions| {
            let finite = if half_kick_pending && conditions.is_empty() && part.damping.is_none() {
                verlet::kick_and_drift(part, step)
            } else {
                let finite = !half_kick_pending || second_half(part, &mut conditions, step);
                conditions.before_moving(part, Work::Step);
                verlet::half_kick_and_drift(part, step);
                conditions.apply_displacements(part);
                finite
            };
            conditions.apply_temperatures(part);
            part.write_bond_inputs();
            finite
        });
        self.progress.load_factors.end_step();
        if !finite {
            self.note_bad(&before);
        }
        self.evaluate_at_bond_inputs(BondUpdate::Step(step));
    }

    /// Prepare the conditions for the second half kick at the time of `clock`.
    fn set_second_half(&mut self, clock: &Clock) {
        let (time, step) = (clock.time(), clock.step());
        self.conditions
            .set_loads(time, self.progress.load_factors.present(), false);
        self.conditions.set_velocities(time, step);
    }

    /// Call `work` for each part of the owned points, with the conditions that act on this part. The calls
    /// run on several threads. Returns whether all calls returned true.
    pub(super) fn walk(
        &mut self,
        work: impl Fn(&mut Part<'_, D>, PartConditions<'_, D>) -> bool + Sync,
    ) -> bool {
        let Self {
            model,
            fields,
            forces,
            conditions,
            ..
        } = self;
        let (stage, on_parts) = conditions.by_part();
        forces.with_bond_inputs(model.owned(), |bond_inputs| {
            walk(
                Part::all(model, fields, bond_inputs),
                on_parts,
                &|part, on| work(part, PartConditions::new(stage, on)),
            )
        })
    }

    /// Evaluate the internal forces at the present displacements. Collective.
    pub fn evaluate(&mut self, bond_update: BondUpdate) {
        self.conditions.set_temperatures(self.clock.time());
        self.walk(|part, conditions| {
            conditions.apply_temperatures(part);
            part.write_bond_inputs();
            true
        });
        self.evaluate_at_bond_inputs(bond_update);
    }

    /// Evaluate the internal forces from the bond inputs. The caller must have called
    /// [`Part::write_bond_inputs`] for all parts of the points. Collective.
    fn evaluate_at_bond_inputs(&mut self, bond_update: BondUpdate) {
        let is_quasi_static = self.is_quasi_static();
        let longest = self.longest_next_step();
        let fields = &mut self.fields;
        let acting = Acting {
            displacement: &mut fields.displacement,
            thermal_stretch: fields.thermal_stretch.as_deref_mut(),
            force: &mut fields.internal_force,
            plastic: plastic_columns(
                &mut fields.plastic_strain,
                &mut fields.plastic_strain_equivalent,
                &mut fields.yield_change,
                &mut fields.control_energy,
                &mut fields.plastic_work,
            ),
        };
        self.times.evaluations += 1;
        let times = &mut self.times.forces;
        self.forces
            .evaluate(self.comm, &self.model, acting, bond_update, times);
        if let BondUpdate::Step(step) = bond_update {
            fields.book_broken(&self.model, self.forces.broken(), step);
        }
        if let Some(contact) = &mut self.contact {
            let start = Instant::now();
            let end = match bond_update {
                BondUpdate::Step(step) => Some(StepEnd {
                    time: self.clock.time(),
                    step,
                    longest,
                }),
                BondUpdate::None | BondUpdate::Trial(_) => None,
            };
            let evaluation = ContactEvaluation {
                is_quasi_static,
                end,
            };
            contact.add_forces(self.comm, &self.model, &self.forces, fields, evaluation);
            self.times.contact += start.elapsed();
        }
    }

    /// Set the displacements of supported points at `time` (s). `step` is the length of the step that ends at
    /// this time (s); 0 if there is no such step.
    pub(super) fn apply_displacements(&mut self, time: f64, step: f64) {
        self.conditions.set_displacements(time, step);
        self.walk(|part, conditions| {
            conditions.apply_displacements(part);
            true
        });
    }

    /// Update the external forces at `time` (s). Without `all`, only loads that may have changed are
    /// computed.
    pub(super) fn apply_loads(&mut self, time: f64, all: bool) {
        self.conditions
            .set_loads(time, self.progress.load_factors.present(), all);
        self.walk(|part, mut conditions| {
            conditions.apply_loads(part);
            true
        });
    }

    /// Set the velocities of supported points (0 in load steps), and compute the reactions. Returns whether
    /// these velocities and reactions are finite.
    pub(super) fn apply_velocities(&mut self) -> bool {
        if self.is_quasi_static() {
            return self.walk(|part, conditions| conditions.project_residual(part));
        }
        self.conditions
            .set_velocities(self.clock.time(), self.clock.step());
        self.walk(|part, conditions| conditions.apply_velocities(part))
    }

    /// Compute the power of viscous damping at the present velocities.
    pub(super) fn update_damping_power(&mut self) {
        self.walk(|part, _| {
            part.add_damped_energy(0.0);
            true
        });
    }

    /// Recompute the fields that are not part of the state, after the state was restored. Collective.
    pub(super) fn recompute_derived(&mut self) {
        self.apply_loads(self.clock.time(), true);
        self.update_damping_power();
        self.evaluate(self.bond_update_at_rest());
    }

    /// Copy the data that a saved state does not contain. The source of the copy, `before`, is the same run
    /// before its points were redistributed or refined.
    pub(super) fn take_over(&mut self, before: &Self) {
        self.times = before.times;
        self.bad = before.bad;
        // Unlike the saved load factors, the load factors of `before` contain the hash of the requests.
        self.progress
            .load_factors
            .clone_from(&before.progress.load_factors);
    }

    /// Find the owned points whose motion, force or reaction is not finite. Record the one with the smallest
    /// id, with the step and the time of `clock`. If a point has been recorded before, nothing changes.
    pub(super) fn note_bad(&mut self, clock: &Clock) {
        if self.bad.is_none() {
            self.bad = self.first_bad(clock);
        }
    }

    /// Return the point with the smallest id among the owned points whose motion, force or reaction is not
    /// finite. The step and the time of the returned [`BadPoint`] are those of `clock`, in the present stage.
    fn first_bad(&self, clock: &Clock) -> Option<BadPoint> {
        (0..self.model.owned())
            .filter(|k| {
                let Fields {
                    displacement,
                    velocity,
                    internal_force,
                    reaction,
                    ..
                } = &self.fields;
                let columns = displacement.iter().chain(velocity).chain(internal_force);
                let mut columns = columns.chain(reaction.iter().flatten());
                columns.any(|column| !column[*k].is_finite())
            })
            .min_by_key(|k| self.model.ids[*k])
            .map(|index| BadPoint {
                step: clock.number(),
                stage: self.progress.stage,
                time: clock.time(),
                id: self.model.ids[index],
                block: self.model.block[index],
                position: self.model.position(index),
            })
    }

    /// Check on all ranks that all values are finite and that the load step has not failed. Collective.
    ///
    /// # Errors
    /// - If a value is not finite. The message names a condition or initial value that is not finite, or a
    ///   temperature that causes a thermal stretch of −1 or less. If all conditions and initial values are
    ///   valid, the message names a point from the first step at which values are not finite. If there are
    ///   several such points at this step, the message names the point with the smallest id.
    /// - If the motion of a rigid body is not finite. The message names this body.
    /// - If no equilibrium has been found. The message names a loaded piece that no support holds, if there
    ///   is one.
    pub fn check(&mut self) -> Result<()> {
        let mut earliest = self.bad.map_or([f64::MAX; 3], |bad| {
            [bad.step as f64, bad.stage as f64, bad.time]
        });
        comm::min(self.comm, &mut earliest);
        let [step, stage, time] = earliest;
        if step == f64::MAX {
            self.check_rigid()?;
            return self.check_equilibrium();
        }
        let place = (stage as usize, time);
        let valued = are_finite(self.problem, self.comm, &self.model, place);
        valued.map_err(|error| Error {
            kind: ErrorKind::Run,
            ..error
        })?;
        let own = self.bad.filter(|bad| bad.step as f64 == step);
        let own = own.map(|bad| {
            let [x, y, z] = bad.position;
            Found {
                key: 0.0,
                ids: [bad.id],
                payload: [f64::from(bad.block), x, y, z],
            }
        });
        let Some(Found {
            ids: [id],
            payload: [block, position @ ..],
            ..
        }) = least(self.comm, own)
        else {
            unreachable!("a rank has the earliest step");
        };
        let (body, position) = (self.problem.block(block as usize).body, &position[..D]);
        Err(if step == 0.0 {
            let message = format!(
                "[body.{}]: the force on its point {id}, {position:?} m, is not finite at the start; check whether \
                 displacements move points onto each other",
                body.name,
            );
            Error::input(message).at(&body.span)
        } else {
            Error::run(format!(
                "step {step} (t = {time:.6e} s): the motion of point {id} of body `{}` is not finite; reference \
                 position {position:?} m. Possible causes: a time step above the stable one (time step {:.3e} s, stable \
                 {:.3e} s), or a load that grows without bound",
                body.name,
                self.clock.step(),
                self.scaled_stable_step(),
            ))
        })
    }
}

/// Complete a step of length `step` (s) after the forces at the new positions have been evaluated. Apply the
/// loads, the second half kick and the supports. Then add the work of loads and supports, and the energy that
/// viscous damping has dissipated. Return whether all velocities and reactions are finite.
fn second_half<const D: usize>(
    part: &mut Part<'_, D>,
    conditions: &mut PartConditions<'_, D>,
    step: f64,
) -> bool {
    conditions.apply_loads(part);
    let finite = verlet::second_half_kick(part, step);
    let finite = conditions.apply_velocities(part) && finite;
    conditions.add_work(part, Work::Step);
    part.add_damped_energy(step);
    finite
}

/// Whether bonds may break at the initial positions, because initial displacements or conditions can stretch
/// bonds.
fn starts_deformed(problem: &Problem) -> bool {
    let placed = |condition: &Condition| {
        let action = &condition.action;
        matches!(action, Action::Displacement(_) | Action::Temperature(_))
    };
    problem.has_damage()
        && (problem.initials.iter().any(Initial::displaces)
            || problem.conditions.iter().any(placed))
}

/// Break the bonds that cross a pre-crack. Return the number of these bonds for each pre-crack. The test
/// starts from the end with the lower id. Its result is therefore the same for both ends of a bond, even if
/// the ends are on different ranks.
fn pre_crack<const D: usize>(
    problem: &Problem,
    model: &Model<D>,
    forces: &mut Forces<D>,
) -> Vec<u64> {
    if problem.cracks.is_empty() {
        return Vec::new();
    }
    let longest = cutoffs(problem).into_iter().fold(0.0, f64::max) * (1.0 + SLACK);
    let in_reach = |point: usize| {
        let position = model.position(point);
        let mut cracks = problem.cracks.iter();
        cracks.any(|crack| points::crack::is_in_reach(&crack.surface, position, longest))
    };
    let in_reach: Vec<bool> = (0..model.owned()).map(in_reach).collect();
    let counts = vec![Cell::new(0); problem.cracks.len()];
    let crosses = |here, there| {
        let (first, second) = if model.ids[here] < model.ids[there] {
            (here, there)
        } else {
            (there, here)
        };
        let [from, to] = [first, second].map(|point| model.position(point));
        let mut cut = false;
        for (crack, count) in problem.cracks.iter().zip(&counts) {
            if points::crack::crosses(&crack.surface, from, to) {
                count.set(count.get() + 1);
                cut = true;
            }
        }
        cut
    };
    forces.cut(|point| in_reach[point], crosses);
    counts.into_iter().map(Cell::into_inner).collect()
}

/// Make the bonds of no-failure sets unbreakable. These sets belong to the damage of a body, or to the damage
/// of the bonds between a pair of bodies.
fn protect<const D: usize>(
    problem: &Problem,
    model: &Model<D>,
    comm: &dyn Communicator,
    forces: &mut Forces<D>,
) {
    let body_of = |block: usize| problem.block(block).body;
    let mut protected = vec![0.0; model.volume.len()];
    for body in &problem.bodies {
        if let Some(damage) = &body.damage {
            let is_own = |block| body_of(block).name == body.name;
            mark_no_failure(problem, model, damage, is_own, &mut protected);
        }
    }
    let no_failure = |damage: &Damage| !damage.no_failure.is_empty();
    let mut damages = problem
        .bodies
        .iter()
        .filter_map(|body| body.damage.as_ref());
    if damages.any(no_failure) {
        forces.protect(comm, &model.block, &mut protected, |_| true);
    }
    for pair in &problem.interface.pairs {
        let Some(damage) = pair.own_damage().filter(|damage| no_failure(damage)) else {
            continue;
        };
        let is_own = |block| pair.has(body_of(block));
        protected.fill(0.0);
        mark_no_failure(problem, model, damage, is_own, &mut protected);
        forces.protect(comm, &model.block, &mut protected, |[i, j]| {
            problem.body_of(i) != problem.body_of(j) && is_own(i) && is_own(j)
        });
    }
}

/// Set `protected` to 1 at the points of the no-failure sets of `damage`. Skip a point if `is_own` is false
/// for the block of this point.
fn mark_no_failure<const D: usize>(
    problem: &Problem,
    model: &Model<D>,
    damage: &Damage,
    is_own: impl Fn(usize) -> bool,
    protected: &mut [f64],
) {
    for set in &damage.no_failure {
        for point in members(problem, model, *set) {
            let point = point as usize;
            if is_own(usize::from(model.block[point])) {
                protected[point] = 1.0;
            }
        }
    }
}
