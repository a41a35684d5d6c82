//! Load steps: from one equilibrium to the next, with any method.
//!
//! A load step advances the time, which is the load parameter; loads and supports follow the time. A method
//! then solves for the equilibrium: [`super::relaxation`] or [`super::newton`].
//!
//! Bonds break only at equilibria. A bond breaks if it reaches its criterion at an equilibrium. The next
//! equilibrium is then found at the same load. This is repeated until no bond breaks. The forces at an
//! equilibrium follow from the history of bonds and points at this equilibrium. Therefore iterations compute
//! the forces from a trial history: the history after a step from the last equilibrium to the present
//! positions. The history is stored at equilibrium.
//!
//! The convergence criterion is ‖f‖ ≤ tolerance · (‖loads‖ + ‖reactions‖), with the total forces f on the
//! points. Two further states are accepted as equilibrium, because loads and reactions can vanish:
//!
//! ```text
//! ‖f‖ + ‖reactions‖ ≤ tolerance · ‖f at the start‖, without loads
//! ‖f‖ ≤ ROUND_OFF · ‖V ρ u‖
//! ```
//!
//! The first one is for a body that is heated or begins deformed, and whose supports, if any, only prevent
//! rigid motion. The reactions are on the left side, because they must vanish too.
//!
//! The second one is for a body that only moves rigidly. f, the loads and the reactions are then round-off. V
//! is the volume, ρ the fictitious density (N/m⁴) and u the displacement of a point. ρ is an upper bound of
//! the stiffness of a point. So ε ‖V ρ u‖, with the machine precision ε, bounds the forces that come from
//! rounding u.

use rayon::prelude::*;

use crate::comm::sum::reduce;
use crate::comm::{ExactSum, Found, least, total};
use crate::error::{Error, Result};
use crate::problem::Method;
use crate::solver::Simulation;
use crate::solver::bonds::BondUpdate;
use crate::solver::conditions::Work;
use crate::solver::model::Model;

use super::Fields;

/// Minimum number of points of a task in a parallel loop; the last task may have fewer.
pub(super) const CHUNK: usize = 4096;

/// The unbalanced force is round-off if its norm is below this fraction of ‖V ρ u‖.
const ROUND_OFF: f64 = 8.0 * f64::EPSILON;

/// Progress of a load step; the same on all ranks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoadStep {
    /// Number of iterations in this load step. The prediction with which Newton's method begins a load step
    /// does not count.
    pub iterations: u64,
    /// Number of iterations in this load step since bonds last broke. If no bonds have broken in this load
    /// step, the number of all its iterations.
    pub since_breaking: u64,
    /// ‖f‖ divided by ‖loads‖ + ‖reactions‖ (at least `scale`), where f is the total force on a point.
    /// Without loads, the smaller of this ratio and ‖f‖ + ‖reactions‖ divided by `start`. The residual is 0
    /// if f is round-off, and NaN before the first load step.
    pub residual: f64,
    /// Damping c of a relaxation, see [`super::relaxation`]; NaN if all points are at rest.
    pub(super) damping: f64,
    /// Largest ‖loads‖ + ‖reactions‖ of the equilibria so far, N. The tolerance is relative to at least this
    /// norm, so the allowed ‖f‖ does not shrink when a body is unloaded or breaks.
    pub(super) scale: f64,
    /// Largest ‖f‖ at the start of a load step so far, N. Supports do not contribute: this is ‖f‖ before the
    /// supports move, under the new temperatures. In runs without temperatures, only the first load step
    /// counts.
    pub(super) start: f64,
    /// Whether the residual is the ratio to `start`.
    pub(super) is_relative_to_start: bool,
    /// Whether bonds have broken at an equilibrium of this load step.
    pub(super) has_broken: bool,
    /// Whether the equilibrium has been found, and no more bonds break. True before the first load step.
    pub is_settled: bool,
    /// Whether the load step ended without an equilibrium: the maximum number of iterations was reached, a
    /// force is not finite, or a loaded piece without support drifts away.
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
            start: 0.0,
            is_relative_to_start: false,
            has_broken: false,
            is_settled: true,
            has_failed: false,
        }
    }
}

impl LoadStep {
    /// Return the beginning of the error message for a load step that failed at `time` (s).
    fn failure(&self, time: f64) -> String {
        let iterations = self.since_breaking;
        format!("t = {time:.6e} s: no equilibrium after {iterations} iteration(s)")
    }

    /// Compute the residual. `squares` contains the squares of four norms: the values of [`balance`], summed
    /// over all points.
    pub(super) fn set_residual(&mut self, squares: [f64; 4]) {
        let [free, loads, reactions, stiffness] = squares.map(f64::sqrt);
        let to_exerted = free / (loads + reactions).max(self.scale);
        let to_start = (free + reactions) / self.start;
        // A large force at the start must not hide a small load. False if a ratio is NaN. The residual is
        // then NaN, and the load step fails.
        self.is_relative_to_start = loads == 0.0 && to_start < to_exerted;
        self.residual = if free <= ROUND_OFF * stiffness {
            0.0
        } else if self.is_relative_to_start {
            to_start
        } else {
            to_exerted
        };
    }

    /// Return the forces to which the residual is relative, for error messages.
    fn reference(&self) -> &'static str {
        if self.is_relative_to_start {
            "the forces at the start of the load step"
        } else {
            "loads and reactions"
        }
    }

    /// Encode the state for a checkpoint.
    pub fn words(&self) -> [u64; 10] {
        let [residual, damping, scale, start] =
            [self.residual, self.damping, self.scale, self.start].map(f64::to_bits);
        [
            self.iterations,
            self.since_breaking,
            residual,
            damping,
            scale,
            start,
            u64::from(self.is_relative_to_start),
            u64::from(self.has_broken),
            u64::from(self.is_settled),
            u64::from(self.has_failed),
        ]
    }

    /// Decode the state from [`Self::words`].
    pub fn of_words(words: [u64; 10]) -> Self {
        let [
            iterations,
            since_breaking,
            residual,
            damping,
            scale,
            start,
            relative_to_start,
            broken,
            settled,
            failed,
        ] = words;
        let [residual, damping, scale, start] =
            [residual, damping, scale, start].map(f64::from_bits);
        Self {
            iterations,
            since_breaking,
            residual,
            damping,
            scale,
            start,
            is_relative_to_start: relative_to_start == 1,
            has_broken: broken == 1,
            is_settled: settled == 1,
            has_failed: failed == 1,
        }
    }
}

/// Return the squared norms (N²) of four vectors of a point: total force, load, reaction, and V ρ u with the
/// fictitious density ρ = `density` (N/m⁴).
pub(super) fn balance<const D: usize>(
    model: &Model<D>,
    fields: &Fields<D>,
    point: usize,
    density: f64,
) -> [f64; 4] {
    let volume = model.volume[point];
    let of = |field: &Option<[Vec<f64>; D]>, d: usize| field.as_ref().map_or(0.0, |f| f[d][point]);
    let mut squares = [0.0; 4];
    for d in 0..D {
        squares[0] += (volume * fields.total_force(model, d, point)).powi(2);
        squares[1] += (volume * of(&fields.external_force, d)).powi(2);
        squares[2] += (volume * of(&fields.reaction, d)).powi(2);
        squares[3] += (volume * density * fields.displacement[d][point]).powi(2);
    }
    squares
}

impl<const D: usize> Simulation<'_, D> {
    /// Record the last equilibrium, and advance time, loads and supports. With `extrapolates`, the points
    /// repeat their motion of the last load step if the step length has not changed.
    pub(super) fn begin_load_step(&mut self, extrapolates: bool) {
        self.walk(|part, mut conditions| {
            conditions.before_moving(part, Work::Trapezoid);
            true
        });
        self.note_reaction();
        let repeats = extrapolates && !self.clock.is_new_size();
        self.clock.advance();
        let is_first = self.progress.load_step.residual.is_nan();
        if is_first || self.problem.has_temperature() {
            self.raise_start();
        }
        self.note_displacement(repeats);
        let (time, step) = (self.clock.time(), self.clock.step());
        self.apply_displacements(time, step);
        self.progress.load_factors.begin_load_step();
        self.apply_loads(time, false);
        if let Some(contact) = &mut self.contact {
            contact.place_rigid(time);
        }
        self.progress.load_step = LoadStep {
            scale: self.progress.load_step.scale,
            start: self.progress.load_step.start,
            is_settled: false,
            ..LoadStep::default()
        };
    }

    /// Record the displacements of the last equilibrium. With `again`, repeat the motion of the last load
    /// step.
    fn note_displacement(&mut self, again: bool) {
        let owned = self.model.owned();
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
    }

    /// Record the reactions of the last equilibrium.
    fn note_reaction(&mut self) {
        let fields = &mut self.fields;
        if let (Some(equilibrium), Some(reaction)) =
            (&mut fields.equilibrium_reaction, &fields.reaction)
        {
            equilibrium.clone_from(reaction);
        }
    }

    /// Raise `start` to the norm of the total forces at the present displacements under the temperatures of
    /// the present time, if this norm is larger. Collective.
    fn raise_start(&mut self) {
        self.evaluate(BondUpdate::None);
        self.apply_velocities();
        let (model, fields) = (&self.model, &self.fields);
        let [square, ..] = sums(model, fields, &|point, density| {
            balance(model, fields, point, density)
        });
        let force = reduce(self.comm, &mut [square])[0].sqrt();
        let load_step = &mut self.progress.load_step;
        if force.is_finite() {
            load_step.start = load_step.start.max(force);
        }
    }

    /// Evaluate forces and reactions at the present positions, with the history that the bonds would have if
    /// these positions were an equilibrium. Collective.
    pub(super) fn evaluate_at_rest(&mut self) {
        self.evaluate(self.bond_update_at_rest());
        self.apply_velocities();
    }

    /// Compute the residual. Returns ‖f‖, N. Collective.
    pub(super) fn find_residual(&mut self) -> f64 {
        let (model, fields) = (&self.model, &self.fields);
        let mut squares = sums(model, fields, &|point, density| {
            balance(model, fields, point, density)
        });
        let squares = reduce(self.comm, &mut squares);
        let squares = std::array::from_fn(|k| squares[k]);
        self.progress.load_step.set_residual(squares);
        f64::sqrt(squares[0])
    }

    /// Time increment of the bond history at the next equilibrium (s). The history advances once per load
    /// step, even if the load step has several equilibria.
    fn time_to_advance(&self) -> f64 {
        if self.progress.load_step.has_broken {
            0.0
        } else {
            self.clock.step()
        }
    }

    /// Bond update for a force evaluation that does not change the state. During a load step, the forces
    /// follow from the history that the bonds would have if the present positions were an equilibrium; this
    /// history is not stored.
    pub(in crate::solver) fn bond_update_at_rest(&self) -> BondUpdate {
        if self.progress.load_step.is_settled {
            BondUpdate::None
        } else {
            BondUpdate::Trial(self.time_to_advance())
        }
    }

    /// Break the bonds that reach their criterion at the present equilibrium. If no bond breaks, the load
    /// step is finished. Returns whether any bond broke. If so, the forces no longer include broken bonds,
    /// and the reactions must be recomputed. Collective.
    pub(super) fn break_or_settle(&mut self) -> bool {
        self.raise_scale();
        let is_first = !self.progress.load_step.has_broken;
        self.evaluate(BondUpdate::Step(self.time_to_advance()));
        let breaks = total(self.comm, self.forces.broken().len() as u64) > 0;
        match (is_first, breaks) {
            (true, true) => self.add_work_since_equilibrium(Work::FirstEquilibrium),
            (true, false) => self.add_work_since_equilibrium(Work::Trapezoid),
            (false, true) => {}
            (false, false) => self.add_work_since_equilibrium(Work::LastEquilibrium),
        }
        if breaks {
            self.progress.load_step.has_broken = true;
            self.progress.load_step.since_breaking = 0;
        } else {
            self.progress.load_factors.record_equilibrium();
        }
        self.progress.load_step.is_settled = !breaks;
        breaks
    }

    /// Sum of the squared forces of rigid bodies on the points of this rank, N².
    pub(super) fn rigid_forces(&self) -> ExactSum {
        let contact = self.contact.as_ref();
        contact.map_or(ExactSum::ZERO, |contact| contact.rigid_forces().clone())
    }

    /// Raise `scale` to the sum of the norms of loads and reactions at the present equilibrium, if this sum
    /// is larger. Collective.
    fn raise_scale(&mut self) {
        let (model, fields) = (&self.model, &self.fields);
        let [loads, mut reactions] = sums(model, fields, &|point, _| {
            let of = |field: &Option<[Vec<f64>; D]>| {
                let square = |f: &[Vec<f64>; D]| f.iter().map(|f| f[point].powi(2)).sum::<f64>();
                model.volume[point].powi(2) * field.as_ref().map_or(0.0, square)
            };
            [of(&fields.external_force), of(&fields.reaction)]
        });
        reactions.merge(&self.rigid_forces());
        let norms = reduce(self.comm, &mut [loads, reactions]);
        let scale = norms.into_iter().map(f64::sqrt).sum();
        self.progress.load_step.scale = self.progress.load_step.scale.max(scale);
    }

    /// Check that the load step has not failed. Collective.
    ///
    /// # Errors
    /// If the load step has failed. In runs without contact, the message names a piece that is loaded along
    /// an axis, but that no support holds along this axis. In runs with contact, or if there is no such
    /// piece, the message describes the unbalanced forces, or says that forces are not finite. If it
    /// describes unbalanced forces of `static`, it also names a piece whose supports leave rigid motions
    /// free, if there is one.
    pub(in crate::solver) fn check_equilibrium(&mut self) -> Result<()> {
        if !self.progress.load_step.has_failed {
            return Ok(());
        }
        let mut failure = self.progress.load_step.failure(self.clock.time());
        if self.progress.newton.halvings > 0 {
            failure += &format!(
                ", the load step halved {} times",
                self.progress.newton.halvings
            );
        }
        // Contact can also support pieces.
        if self.contact.is_none() {
            self.check_pieces_are_held(&failure)?;
        }
        let residual = self.progress.load_step.residual;
        let method = self.time_rule().method;
        let cause = if residual.is_finite() {
            let free_motions = match method {
                // Contact can also hold pieces.
                Method::Static(_) if self.contact.is_none() => self.describe_free_motions(),
                _ => None,
            };
            format!(
                "the unbalanced forces are still {residual:.1e} of {}{}. If the body can carry the loads, {}{}",
                self.progress.load_step.reference(),
                self.worst_point(),
                method.remedy(),
                free_motions.map_or(String::new(), |text| format!(". {text}"))
            )
        } else {
            "forces are not finite; reduce the loads".to_owned()
        };
        Err(Error::run(format!("{failure}: {cause}")))
    }

    /// Return a text for error messages that describes the point with the largest unbalanced force; empty if
    /// no point has ever had an intact bond. Collective.
    fn worst_point(&self) -> String {
        let (model, fields) = (&self.model, &self.fields);
        let density = fields.fictitious_density.as_deref().unwrap_or_default();
        let force = |point: usize| {
            let square = |d: usize| fields.total_force(model, d, point).powi(2);
            model.volume[point] * (0..D).map(square).sum::<f64>().sqrt()
        };
        let bonded = (0..model.owned()).filter(|point| density[*point].is_finite());
        let own = bonded.map(|point| (point, force(point)));
        let order = |(a, of_a): &(usize, f64), (b, of_b): &(usize, f64)| {
            let ids = model.ids[*b].cmp(&model.ids[*a]);
            of_a.total_cmp(of_b).then(ids)
        };
        let own = own.max_by(order).map(|(point, force)| {
            let [x, y, z] = model.position(point);
            Found {
                key: -force,
                ids: [model.ids[point]],
                payload: [f64::from(model.block[point]), x, y, z],
            }
        });
        let Some(Found {
            key,
            ids: [id],
            payload: [block, position @ ..],
        }) = least(self.comm, own)
        else {
            return String::new();
        };
        format!(
            ", most of them {:.1e} N at point {id} of body `{}`, {:?} m",
            -key,
            self.problem.block(block as usize).body.name,
            &position[..D]
        )
    }

    /// Add the work of loads and supports in the present load step. This function is called at an
    /// equilibrium. `work` selects the formula; see [`Work`].
    fn add_work_since_equilibrium(&mut self, work: Work) {
        let (then, now) = (self.clock.time_before(), self.clock.time());
        // The columns are taken out of `fields` while they are read.
        let displacement = self.fields.equilibrium_displacement.take();
        let reaction = self.fields.equilibrium_reaction.take();
        if let Some(displacement) = &displacement {
            let factors = self.progress.load_factors.at_equilibrium();
            self.conditions.set_loads(then, factors, true);
            self.walk(|part, mut conditions| {
                let reaction = reaction.as_ref().map(|field| part.of(field));
                conditions.find_loads(part);
                conditions.record_for_work(part.of(displacement), reaction);
                true
            });
            let factors = self.progress.load_factors.present();
            self.conditions.set_loads(now, factors, true);
        }
        self.walk(|part, mut conditions| {
            conditions.find_loads(part);
            conditions.add_work(part, work);
            true
        });
        self.fields.equilibrium_displacement = displacement;
        self.fields.equilibrium_reaction = reaction;
    }
}

/// Sum over this rank's owned points whose fictitious density is finite. The density is infinite only at
/// points that have never had an intact bond. `terms` returns the terms of a point, given the index and the
/// fictitious density (N/m⁴) of the point.
pub(super) fn sums<const D: usize, const N: usize>(
    model: &Model<D>,
    fields: &Fields<D>,
    terms: &(dyn Fn(usize, f64) -> [f64; N] + Sync),
) -> [ExactSum; N] {
    let density = fields.relaxation_density();
    (0..model.owned().div_ceil(CHUNK))
        .into_par_iter()
        .map(|chunk| {
            let mut sums = [const { ExactSum::ZERO }; N];
            for point in chunk * CHUNK..((chunk + 1) * CHUNK).min(model.owned()) {
                let density = density.at(point);
                if density.is_finite() {
                    let terms = terms(point, density);
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Return the residual for norms of the total forces, loads and reactions, N.
    fn residual(load_step: &mut LoadStep, norms: [f64; 3]) -> f64 {
        let [free, loads, reactions] = norms.map(|norm| norm * norm);
        load_step.set_residual([free, loads, reactions, 1e-18]);
        load_step.residual
    }

    #[test]
    fn forces_at_the_start_replace_reactions_that_vanish() {
        let mut heated = LoadStep {
            start: 100.0,
            ..LoadStep::default()
        };
        // Reactions that are as small as the unbalanced force do not count.
        assert_eq!(residual(&mut heated, [0.5, 0.0, 0.5]), 0.01);
        assert_eq!(
            heated.reference(),
            "the forces at the start of the load step"
        );
        // Reactions that remain give the smaller allowed force.
        assert_eq!(residual(&mut heated, [0.5, 0.0, 10.0]), 0.05);
        assert_eq!(heated.reference(), "loads and reactions");
        // A load must be balanced, however small it is.
        assert_eq!(residual(&mut heated, [1e-9, 1e-9, 0.0]), 1.0);
        assert!(residual(&mut heated, [f64::NAN, 0.0, 0.0]).is_nan());
        assert_eq!(LoadStep::of_words(heated.words()).start, 100.0);
    }

    #[test]
    fn a_load_step_that_starts_in_equilibrium_has_only_round_off() {
        let mut still = LoadStep::default();
        assert_eq!(residual(&mut still, [0.0; 3]), 0.0);
        assert_eq!(residual(&mut still, [1e-25, 0.0, 0.0]), 0.0);
    }
}
