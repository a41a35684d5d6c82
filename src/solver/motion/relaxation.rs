//! Adaptive dynamic relaxation: from one equilibrium to the next.
//!
//! A load step advances the time, which is the load parameter; loads and supports follow the time. The points
//! first repeat their motion of the last load step. Then the motion ρ ü + c ρ u̇ = f with a fictitious
//! density ρ is integrated with Δt = 1 until it comes to rest (Underwood 1983; Kilic & Madenci 2010):
//!
//! ```text
//! u̇ ← ((2 − c) u̇ + 2 f/ρ)/(2 + c)        (f/(2ρ) from rest)
//! u ← u + u̇
//! c ← 2 √(u̇·¹K u̇ / u̇·ρ u̇),   ¹K u̇ = −(f_new − f_old)
//! ```
//!
//! Each point has its own ρ: a reserve factor times the density for which the bound of
//! [`super::stable_step`] gives Δt = 1. This bound contains the largest eigenvalue of the matrix D of the
//! point. c is the critical damping of the present motion. The quotient under the root is a Rayleigh quotient
//! of the tangent stiffness ¹K. It uses u̇ rather than u, because differences of f along u̇ give ¹K u̇
//! exactly. All sums are exact, so the result is bitwise independent of ranks and threads.
//!
//! [`super::load_step`] defines when an equilibrium is reached and when bonds break.
//!
//! Contact is part of the equilibrium. The repulsion has a potential; neither friction nor contact damping
//! acts. ρ includes the largest contact stiffness of the point since the motion started from rest. If ρ fell
//! when points separate, stiff contacts would bounce forever. Rigid bodies with a prescribed motion move with
//! time, as supports do. The forces of rigid bodies on the points count as reactions.

use rayon::prelude::*;

use crate::comm::ExactSum;
use crate::comm::sum::reduce;
use crate::problem::Relaxation;
use crate::solver::Simulation;

use super::integrator::Integrator;
use super::load_step::{CHUNK, balance, sums};

/// Integrator of dynamic relaxation: damped iterations towards each equilibrium.
pub struct DynamicRelaxation(pub Relaxation);

impl<const D: usize> Integrator<D> for DynamicRelaxation {
    fn advance(&mut self, simulation: &mut Simulation<'_, D>, _half_kick_pending: bool) -> bool {
        simulation.relax(&self.0);
        false
    }
}

/// Upper limit of the damping c; from c = 2 on, the velocity would change its sign.
const MOST_DAMPING: f64 = 1.9;

/// Sums over this rank's points, with the velocities u̇ of an iteration and the forces f before this
/// iteration.
struct Before {
    /// Σ V u̇·f, J.
    power: ExactSum,
    /// Σ V ρ u̇², J.
    inertia: ExactSum,
}

impl<const D: usize> Simulation<'_, D> {
    /// Make one iteration towards the equilibrium of the present load step. If this load step is already
    /// settled, begin the next load step. Collective.
    fn relax(&mut self, rule: &Relaxation) {
        let before = if self.progress.load_step.is_settled {
            self.begin_load_step(true);
            self.stop();
            None
        } else {
            Some(self.drift())
        };
        self.evaluate_at_rest();
        self.update_damping_and_residual(before);
        if self.is_drifting() {
            self.progress.load_step.has_failed = true;
        } else if self.progress.load_step.residual <= rule.tolerance {
            if self.break_or_settle() {
                self.stop();
                self.evaluate_at_rest();
                self.update_damping_and_residual(None);
            }
        } else if self.progress.load_step.residual.is_nan() {
            self.progress.load_step.has_failed = true;
            let clock = self.clock;
            self.note_bad(&clock);
        } else if self.progress.load_step.since_breaking >= rule.iterations {
            self.progress.load_step.has_failed = true;
        }
    }

    /// Restart the motion from rest.
    fn stop(&mut self) {
        self.progress.load_step.damping = f64::NAN;
        let velocity = self.fields.relaxation_velocity.iter_mut().flatten();
        let columns = velocity.chain(&mut self.fields.contact_density);
        columns.for_each(|column| column.fill(0.0));
    }

    /// Move the points by one iteration. Returns the sums of [`Before`], with the velocities of this
    /// iteration and the forces before it.
    fn drift(&mut self) -> Before {
        self.progress.load_step.iterations += 1;
        self.progress.load_step.since_breaking += 1;
        let damping = self.progress.load_step.damping;
        let (model, fields) = (&self.model, &mut self.fields);
        // The velocity is taken out of `fields` while it is written.
        let mut velocity = fields.relaxation_velocity.take();
        if let Some(velocity) = &mut velocity {
            for d in 0..D {
                let density = fields.relaxation_density();
                velocity[d]
                    .par_iter_mut()
                    .with_min_len(CHUNK)
                    .enumerate()
                    .for_each(|(point, velocity)| {
                        let kick = fields.total_force(model, d, point) / density.at(point);
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
        fields.relaxation_velocity = velocity;
        let fields = &self.fields;
        let [power, inertia] = sums(model, fields, &|point, density| {
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

    /// Compute damping and residual from the forces at the new positions. `before` is `None` if the points
    /// start from rest. Collective.
    fn update_damping_and_residual(&mut self, before: Option<Before>) {
        let (model, fields) = (&self.model, &self.fields);
        let [power, free, loads, reactions, stiffness] = sums(model, fields, &|point, density| {
            let of = |d: usize| {
                let velocity = fields.relaxation_velocity.as_ref();
                velocity.map_or(0.0, |velocity| velocity[d][point])
            };
            let power = (0..D).map(|d| of(d) * fields.total_force(model, d, point));
            let power = model.volume[point] * power.fold(0.0, |sum, term| sum + term);
            let [free, loads, reactions, stiffness] = balance(model, fields, point, density);
            [power, free, loads, reactions, stiffness]
        });
        let Before {
            power: old,
            inertia,
        } = before.unwrap_or(Before {
            power: ExactSum::ZERO,
            inertia: ExactSum::ZERO,
        });
        let mut reactions = reactions;
        reactions.merge(&self.rigid_forces());
        let mut all = [power, old, inertia, free, loads, reactions, stiffness];
        let all = reduce(self.comm, &mut all);
        let [power, old, inertia] = [all[0], all[1], all[2]];
        self.progress
            .load_step
            .set_residual([all[3], all[4], all[5], all[6]]);
        if inertia > 0.0 {
            let quotient = ((old - power) / inertia).max(0.0);
            self.progress.load_step.damping = (2.0 * quotient.sqrt()).min(MOST_DAMPING);
        }
    }
}
