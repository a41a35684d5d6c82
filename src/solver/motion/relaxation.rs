//! Adaptive dynamic relaxation: from one equilibrium to the next.
//!
//! A load step moves time, which is the load parameter, and with it loads and supports; the points go on as
//! far as in the load step before. Then the motion
//! ρ ü + c ρ u̇ = f of a fictitious density ρ is followed, in iterations of Δt = 1, until it has come to
//! rest (Underwood 1983; Kilic & Madenci 2010):
//!
//! ```text
//! u̇ ← ((2 − c) u̇ + 2 f/ρ)/(2 + c)        (f/(2ρ) from rest)
//! u ← u + u̇
//! c ← 2 √(u̇·¹K u̇ / u̇·ρ u̇),   ¹K u̇ = −(f_new − f_old)
//! ```
//!
//! ρ is what the bound of [`super::stable_step`] makes of Δt = 1, the row sums of the stiffness; c damps
//! the present motion critically: the Rayleigh quotient is taken along u̇, where the diagonal ¹K of the
//! secants is known exactly, rather than along u. All sums are exact, so that neither ranks nor threads
//! change a bit.
//!
//! Bonds break at equilibria only: in equilibrium those that must break do, and the next equilibrium is looked for at
//! the same load, until nothing breaks. The history of bonds and points is part of the equilibrium. Each iteration takes
//! the forces from the history that a step from the last equilibrium to the present place would leave, and stores it
//! when the equilibrium is found.
//!
//! The equilibrium is found when ‖f‖ ≤ tolerance · (‖loads‖ + ‖reactions‖). Without loads and reactions, as in a
//! free body that is moved, both sides are round-off; so ‖f‖ ≤ `ROUND_OFF` ‖V ρ u‖ is an equilibrium, too. ρ bounds
//! the stiffness of a point, hence ε ‖V ρ u‖ the forces that come from rounding u.

use std::time::Instant;

use rayon::prelude::*;

use crate::comm::ExactSum;
use crate::comm::sum::reduce;
use crate::comm::total;
use crate::error::{Error, Result};
use crate::problem::Relaxation;
use crate::solver::Simulation;
use crate::solver::bonds::BondUpdate;
use crate::solver::conditions::Work;
use crate::solver::model::Model;

use super::Fields;
use super::integrator::Integrator;
use super::stable_step::largest_eigenvalue;

/// Damped iterations towards each equilibrium.
pub struct DynamicRelaxation(pub Relaxation);

impl<const D: usize> Integrator<D> for DynamicRelaxation {
    fn advance(&mut self, simulation: &mut Simulation<'_, D>, _half_kick_pending: bool) -> bool {
        simulation.relax(&self.0);
        false
    }
}

/// Points handled by one task.
const CHUNK: usize = 4096;

/// How much larger the fictitious density is than the bound, for bonds that turn.
const MARGIN: f64 = 1.2;

/// The largest damping c; from 2 on the velocity would change its sign.
const MOST_DAMPING: f64 = 1.9;

/// Forces on the points are round-off below this share of ‖V ρ u‖.
const ROUND_OFF: f64 = 8.0 * f64::EPSILON;

/// How far a load step has come; the same on all ranks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoadStep {
    /// Iterations made in this load step.
    pub iterations: u64,
    /// Those of them since bonds broke.
    pub since_breaking: u64,
    /// ‖f‖/(‖loads‖ + ‖reactions‖), norms of the forces on the points; 0 where f is round-off, not a number before
    /// the first load step.
    pub residual: f64,
    /// c; not a number from rest.
    damping: f64,
    /// The largest ‖loads‖ + ‖reactions‖ of an equilibrium so far, N: a body that is unloaded, or broken
    /// in two, is not looked at more closely than when it was loaded.
    scale: f64,
    /// Bonds have broken in an equilibrium of this load step.
    has_broken: bool,
    /// Whether the equilibrium has been found, and nothing more breaks.
    pub is_settled: bool,
    /// Whether it has not been found in as many iterations as there may be.
    pub has_failed: bool,
}

impl Default for LoadStep {
    fn default() -> Self {
        Self {
            iterations: 0,
            since_breaking: 0,
            residual: f64::NAN,
            damping: f64::NAN,
            scale: 0.0,
            has_broken: false,
            is_settled: true,
            has_failed: false,
        }
    }
}

impl LoadStep {
    /// An error if no equilibrium has been found at a time (s).
    ///
    /// # Errors
    /// Says how near it came.
    pub fn outcome(&self, time: f64) -> Result<()> {
        if !self.has_failed {
            return Ok(());
        }
        let balance = if self.residual.is_finite() {
            let residual = self.residual;
            format!(
                "are still {residual:.1e} of loads and reactions. More load than the body bears?"
            )
        } else {
            "are more than round-off, without loads and reactions.".to_owned()
        };
        Err(Error::run(format!(
            "{}; the forces out of balance {balance} Otherwise give [time.relaxation] more `iterations` or a \
             larger `tolerance`",
            self.failure(time)
        )))
    }

    /// What has failed at a time (s).
    fn failure(&self, time: f64) -> String {
        let iterations = self.since_breaking;
        format!("t = {time:.6e} s: no equilibrium within {iterations} iterations")
    }

    /// All of it, as a checkpoint holds it.
    pub fn words(&self) -> [u64; 8] {
        let [residual, damping, scale] =
            [self.residual, self.damping, self.scale].map(f64::to_bits);
        let [broken, settled, failed] =
            [self.has_broken, self.is_settled, self.has_failed].map(u64::from);
        let counts = [self.iterations, self.since_breaking];
        [
            counts[0], counts[1], residual, damping, scale, broken, settled, failed,
        ]
    }

    /// What [`Self::words`] gave.
    pub fn of_words(words: [u64; 8]) -> Self {
        let [
            iterations,
            since_breaking,
            residual,
            damping,
            scale,
            broken,
            settled,
            failed,
        ] = words;
        let [residual, damping, scale] = [residual, damping, scale].map(f64::from_bits);
        Self {
            iterations,
            since_breaking,
            residual,
            damping,
            scale,
            has_broken: broken == 1,
            is_settled: settled == 1,
            has_failed: failed == 1,
        }
    }
}

/// The density of each owned point (N/m⁴) with which iterations of Δt = 1 are stable; infinite for one
/// without bonds. `stiffness` is that of [`super::stable_step`].
pub fn fictitious_density(stiffness: &[Vec<f64>; 6]) -> Vec<f64> {
    let density = |point: usize| {
        let entries = stiffness.each_ref().map(|column| column[point]);
        match 0.5 * MARGIN * largest_eigenvalue(&entries) {
            0.0 => f64::INFINITY,
            density => density,
        }
    };
    (0..stiffness[0].len()).map(density).collect()
}

/// What is summed before the forces are found anew: u̇·f and u̇·ρ u̇, J.
struct Before {
    power: ExactSum,
    inertia: ExactSum,
}

impl<const D: usize> Simulation<'_, D> {
    /// Makes an iteration towards the equilibrium of this load step, or, if that is found, begins the next
    /// one. Collective.
    fn relax(&mut self, rule: &Relaxation) {
        let (start, forces) = (Instant::now(), self.times.forces.whole());
        let before = if self.load_step.is_settled {
            self.begin_load_step();
            None
        } else {
            Some(self.drift())
        };
        self.evaluate(self.bond_update_at_rest());
        self.apply_velocities();
        self.look(before);
        let forces = self.times.forces.whole() - forces;
        self.times.motion += start.elapsed().saturating_sub(forces);
        if self.load_step.residual <= rule.tolerance {
            self.break_or_settle();
        } else if self.load_step.residual.is_nan() {
            self.load_step.has_failed = true;
            let clock = self.clock;
            self.note_bad(&clock);
        } else if self.load_step.since_breaking >= rule.iterations {
            self.load_step.has_failed = true;
        }
    }

    /// Moves time, loads and supports on, and the points as far as in the last load step.
    fn begin_load_step(&mut self) {
        self.walk(|part, mut here| {
            here.before_moving(part);
            true
        });
        self.extrapolate();
        self.clock.advance();
        let (time, step) = (self.clock.time(), self.clock.step());
        self.apply_displacements(time, step);
        self.apply_loads(time, false);
        self.load_step = LoadStep {
            scale: self.load_step.scale,
            is_settled: false,
            ..LoadStep::default()
        };
        self.stop();
    }

    /// Takes note of the last equilibrium, and moves the points on as if all went on as before.
    fn extrapolate(&mut self) {
        let (owned, again) = (self.model.owned(), !self.clock.is_new_size());
        let fields = &mut self.fields;
        if let Some(equilibrium) = &mut fields.equilibrium_displacement {
            for d in 0..D {
                let displacement = fields.displacement[d][..owned].par_iter_mut();
                let both = displacement.zip(&mut equilibrium[d]);
                both.with_min_len(CHUNK).for_each(|(now, before)| {
                    let moved = *now - *before;
                    *before = *now;
                    if again {
                        *now += moved;
                    }
                });
            }
        }
        if let (Some(equilibrium), Some(reaction)) =
            (&mut fields.equilibrium_reaction, &fields.reaction)
        {
            equilibrium.clone_from(reaction);
        }
    }

    /// Lets the points start from rest.
    fn stop(&mut self) {
        self.load_step.damping = f64::NAN;
        let velocity = self.fields.relaxation_velocity.iter_mut().flatten();
        velocity.for_each(|component| component.fill(0.0));
    }

    /// Moves the points by an iteration.
    fn drift(&mut self) -> Before {
        self.load_step.iterations += 1;
        self.load_step.since_breaking += 1;
        let damping = self.load_step.damping;
        let (model, fields) = (&self.model, &mut self.fields);
        // Taken out while they are written.
        let mut velocity = fields.relaxation_velocity.take();
        let density = fields.fictitious_density.take();
        if let (Some(velocity), Some(density)) = (&mut velocity, &density) {
            for d in 0..D {
                velocity[d]
                    .par_iter_mut()
                    .with_min_len(CHUNK)
                    .enumerate()
                    .for_each(|(point, velocity)| {
                        let kick = fields.total_force(model, d, point) / density[point];
                        *velocity = if damping.is_nan() {
                            0.5 * kick
                        } else {
                            ((2.0 - damping) * *velocity + 2.0 * kick) / (2.0 + damping)
                        };
                    });
                fields.displacement[d][..model.owned()]
                    .par_iter_mut()
                    .with_min_len(CHUNK)
                    .zip(&velocity[d])
                    .for_each(|(displacement, velocity)| *displacement += velocity);
            }
        }
        (fields.relaxation_velocity, fields.fictitious_density) = (velocity, density);
        let fields = &self.fields;
        let [power, inertia] = sums(model, fields, |point, density| {
            let velocity = |d: usize| {
                fields
                    .relaxation_velocity
                    .as_ref()
                    .map_or(0.0, |v| v[d][point])
            };
            let square: f64 = (0..D).map(|d| f64::powi(velocity(d), 2)).sum();
            let power = (0..D).map(|d| velocity(d) * fields.total_force(model, d, point));
            let volume = model.volume[point];
            [volume * power.sum::<f64>(), volume * density * square]
        });
        Before { power, inertia }
    }

    /// Finds damping and residual from the forces at the new place.
    fn look(&mut self, before: Option<Before>) {
        let (model, fields) = (&self.model, &self.fields);
        let [power, free, loads, reactions, stiffness] = sums(model, fields, |point, density| {
            let volume = model.volume[point];
            let mut terms = [0.0; 5];
            for d in 0..D {
                let force = fields.total_force(model, d, point);
                let of =
                    |field: &Option<[Vec<f64>; D]>| field.as_ref().map_or(0.0, |f| f[d][point]);
                terms[0] += of(&fields.relaxation_velocity) * force;
                terms[1] += (volume * force).powi(2);
                terms[2] += (volume * of(&fields.external_force)).powi(2);
                terms[3] += (volume * of(&fields.reaction)).powi(2);
                terms[4] += (volume * density * fields.displacement[d][point]).powi(2);
            }
            terms[0] *= volume;
            terms
        });
        let Before {
            power: old,
            inertia,
        } = before.unwrap_or(Before {
            power: ExactSum::ZERO,
            inertia: ExactSum::ZERO,
        });
        let mut all = [power, old, inertia, free, loads, reactions, stiffness];
        let all = reduce(self.comm, &mut all);
        let [power, old, inertia] = [all[0], all[1], all[2]];
        let [free, loads, reactions, stiffness] = [all[3], all[4], all[5], all[6]].map(f64::sqrt);
        let scale = (loads + reactions).max(self.load_step.scale);
        let is_round_off = free <= ROUND_OFF * stiffness;
        self.load_step.residual = if is_round_off { 0.0 } else { free / scale };
        if inertia > 0.0 {
            let quotient = ((old - power) / inertia).max(0.0);
            self.load_step.damping = (2.0 * quotient.sqrt()).min(MOST_DAMPING);
        }
    }

    /// The time by which the history of bonds advances at the next equilibrium (s): once in a load step, however often
    /// bonds break.
    fn time_to_advance(&self) -> f64 {
        if self.load_step.has_broken {
            0.0
        } else {
            self.clock.step()
        }
    }

    /// How forces follow from the present place without a change of the state: during a load step from the history that
    /// bonds would have if this were its equilibrium.
    pub(in crate::solver) fn bond_update_at_rest(&self) -> BondUpdate {
        if self.load_step.is_settled {
            BondUpdate::None
        } else {
            BondUpdate::Trial(self.time_to_advance())
        }
    }

    /// In equilibrium: breaks the bonds that must, and lets the points start anew; where none does, the
    /// load step is over.
    fn break_or_settle(&mut self) {
        self.raise_scale();
        let is_first = !self.load_step.has_broken;
        self.evaluate(BondUpdate::Step(self.time_to_advance()));
        let breaks = total(self.comm, self.forces.broken().len() as u64) > 0;
        match (is_first, breaks) {
            (true, true) => self.add_work_since_equilibrium(Work::FirstEquilibrium),
            (true, false) => self.add_work_since_equilibrium(Work::Trapezoid),
            (false, true) => {}
            (false, false) => self.add_work_since_equilibrium(Work::LastEquilibrium),
        }
        if breaks {
            self.load_step.has_broken = true;
            self.load_step.since_breaking = 0;
            self.stop();
            self.evaluate(self.bond_update_at_rest());
            self.apply_velocities();
            self.look(None);
            return;
        }
        self.load_step.is_settled = true;
    }

    /// Raise the scale to the loads and reactions of the present equilibrium.
    fn raise_scale(&mut self) {
        let (model, fields) = (&self.model, &self.fields);
        let [loads, reactions] = sums(model, fields, |point, _| {
            let of = |field: &Option<[Vec<f64>; D]>| {
                let square = |f: &[Vec<f64>; D]| f.iter().map(|f| f[point].powi(2)).sum::<f64>();
                model.volume[point].powi(2) * field.as_ref().map_or(0.0, square)
            };
            [of(&fields.external_force), of(&fields.reaction)]
        });
        let norms = reduce(self.comm, &mut [loads, reactions]);
        let scale = norms.into_iter().map(f64::sqrt).sum();
        self.load_step.scale = self.load_step.scale.max(scale);
    }

    /// An error if the present load step has failed. Collective.
    ///
    /// # Errors
    /// Names a piece that loads act on and nothing holds, if there is one, else says how near it came.
    pub(in crate::solver) fn check_equilibrium(&mut self) -> Result<()> {
        let time = self.clock.time();
        if self.load_step.has_failed {
            let failure = self.load_step.failure(time);
            self.check_pieces_are_held(&failure)?;
        }
        self.load_step.outcome(time)
    }

    /// Add the work of loads and supports since the last load step, which ended in equilibrium.
    fn add_work_since_equilibrium(&mut self, work: Work) {
        let (then, now) = (self.clock.time_before(), self.clock.time());
        // Taken out while they are read.
        let displacement = self.fields.equilibrium_displacement.take();
        let reaction = self.fields.equilibrium_reaction.take();
        if let Some(displacement) = &displacement {
            self.conditions.set_loads(then, true);
            self.walk(|part, mut here| {
                let reaction = reaction.as_ref().map(|field| part.of(field));
                here.find_loads();
                here.remember(part.of(displacement), reaction);
                true
            });
            self.conditions.set_loads(now, true);
        }
        self.walk(|part, mut here| {
            here.find_loads();
            here.add_work(part, work);
            true
        });
        self.fields.equilibrium_displacement = displacement;
        self.fields.equilibrium_reaction = reaction;
    }
}

/// Sums over the owned points with bonds: `terms` finds those of a point from its index and its
/// fictitious density (N/m⁴).
fn sums<const D: usize, const N: usize>(
    model: &Model<D>,
    fields: &Fields<D>,
    terms: impl Fn(usize, f64) -> [f64; N] + Sync,
) -> [ExactSum; N] {
    let density = fields.fictitious_density.as_deref().unwrap_or_default();
    (0..model.owned().div_ceil(CHUNK))
        .into_par_iter()
        .map(|chunk| {
            let mut sums = [const { ExactSum::ZERO }; N];
            for point in chunk * CHUNK..((chunk + 1) * CHUNK).min(model.owned()) {
                if density[point].is_finite() {
                    let terms = terms(point, density[point]);
                    sums.iter_mut()
                        .zip(terms)
                        .for_each(|(sum, term)| sum.add(term));
                }
            }
            sums
        })
        .reduce(
            || [const { ExactSum::ZERO }; N],
            |mut a, b| {
                a.iter_mut().zip(&b).for_each(|(a, b)| a.merge(b));
                a
            },
        )
}
