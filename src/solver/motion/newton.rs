//! Equilibria by an inexact Newton method with conjugate gradients.
//!
//! [`super::load_step`] defines the equilibrium and when bonds break. Let u be the displacements, f the total
//! forces on the points, K = −∂f/∂u the tangent stiffness, and x the correction of u. An iteration is
//!
//! ```text
//! solve K x = f to ‖f − K x‖ ≤ η ‖f‖       K v = −(f(u + ε v) − f(u))/ε, one force evaluation per v
//! u ← u + s x                              s = 1 if |x·f(u + x)| ≤ 0.9 x·f(u), otherwise by line search
//! η ← | ‖f(u + s x)‖ − ‖f − K x‖ | / ‖f‖   at most 0.1; a measure of the nonlinearity of the forces
//! ```
//!
//! η follows Eisenstat & Walker 1996, and the differences of f follow Knoll & Keyes 2004. f includes the
//! reactions, so f is 0 for supported components. All force evaluations use a trial history
//! (`BondUpdate::Trial`): the history after a step from the last equilibrium to the displaced positions.
//! Therefore K is the consistent tangent at points that yield. ε is chosen such that the largest component of
//! ε v is `SHIFT` times the shortest horizon. The difference then has two relative errors: an error of the
//! order of `SHIFT` from bonds that rotate, and an error of the order of (machine precision)/`SHIFT` from
//! rounding.
//!
//! K is symmetric if the forces of the law derive from an energy. In a body that softens or buckles, K may
//! not be positive definite. The conjugate gradients then stop at the first direction of negative curvature.
//! The preconditioner is the sum of two terms. The inverse of the diagonal of K is effective for short waves
//! of the displacement. A coarse grid (`coarse_grid.rs`) is effective for long waves.
//!
//! A load step begins with a prediction of the displacements. If the last load step had the same size as the
//! new one, and no bond broke in the last one, each point repeats its motion of the last load step.
//! Otherwise, and in the first load step of a stage, the prediction is the solution of the problem that is
//! linearized about the last equilibrium. The change of the prescribed displacements is then part of x.
//!
//! A load step without an equilibrium is repeated with half its size, at most `max_halvings` times. The
//! smaller load steps continue up to the end of the original load step. A load step in which bonds have
//! broken is not repeated: bonds break only at an equilibrium, so an equilibrium at the full load was found.
//! A load step is also not repeated if a loaded piece of a body is not held by supports.

use rayon::prelude::*;

use crate::comm::sum::reduce;
use crate::dimension::{Constraint, Dimension};
use crate::elastic::Isotropic;
use crate::problem::Static;
use crate::scatter::{Scattered, uniform};
use crate::solver::Simulation;

use super::coarse_grid::{CoarseGrid, PointStiffness};
use super::integrator::Integrator;
use super::load_step::{CHUNK, sums};

/// Largest component of the displacement ε v in a finite difference, divided by the shortest horizon.
const SHIFT: f64 = 1e-6;

/// Maximum number of conjugate gradient iterations per Newton iteration.
const MAX_CG_ITERATIONS: u64 = 500;

/// Maximum number of step lengths that are tried along a direction.
const MAX_LINE_SEARCH_STEPS: usize = 8;

/// The line search ends when |x·f| is at most this fraction of the value that x·f had before the search.
const LINE_SEARCH_TOLERANCE: f64 = 0.9;

/// Value of η for the first linear problem of a run.
const FIRST_FORCING: f64 = 0.01;

/// Upper limit of η for all linear problems after the first.
const MOST_FORCING: f64 = 0.1;

/// Lower bound of the tolerance of the linear problem, as a fraction of the tolerance of the load step.
const LINEAR_TOLERANCE_SHARE: f64 = 0.5;

/// Lower bound of the intact fraction of a point's family in the preconditioner. This fraction is the volume
/// of the neighbours with intact bonds, divided by the volume of the family.
const LEAST_INTACT: f64 = 1e-3;

/// State of Newton's method between iterations; the same on all ranks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct NewtonState {
    /// Number of force evaluations of the present load step, by relaxation or by Newton's method. In explicit
    /// stages, the number of force evaluations of the present time step.
    pub evaluations: u64,
    /// Relative tolerance η for the next solution of the linear problem K x = f.
    forcing: f64,
    /// Mean of the diagonal of K, divided by the mean of ρ φ; NaN until it is computed. Here ρ is the
    /// fictitious density, and φ the intact fraction of a point's family, see `LEAST_INTACT`.
    diagonal: f64,
    /// Number of times that the present load step has been halved.
    pub halvings: u64,
    /// Number of load steps of the present size that remain up to the end of the original load step.
    left: u64,
}

impl Default for NewtonState {
    fn default() -> Self {
        Self {
            evaluations: 0,
            forcing: FIRST_FORCING,
            diagonal: f64::NAN,
            halvings: 0,
            left: 1,
        }
    }
}

impl NewtonState {
    /// Encode the state for a checkpoint.
    pub fn words(&self) -> [u64; 5] {
        let [forcing, diagonal] = [self.forcing, self.diagonal].map(f64::to_bits);
        [
            self.evaluations,
            forcing,
            diagonal,
            self.halvings,
            self.left,
        ]
    }

    /// Decode the state from [`Self::words`].
    pub fn of_words([evaluations, forcing, diagonal, halvings, left]: [u64; 5]) -> Self {
        let [forcing, diagonal] = [forcing, diagonal].map(f64::from_bits);
        Self {
            evaluations,
            forcing,
            diagonal,
            halvings,
            left,
        }
    }
}

/// Newton–Krylov method with its work vectors.
pub struct NewtonKrylov<const D: usize> {
    rule: Static,
    /// The work vectors; `None` before the first iteration.
    vectors: Option<Vectors<D>>,
}

impl<const D: usize> NewtonKrylov<D> {
    /// Create the method with the settings of `[time.static]`.
    pub fn new(rule: Static) -> Self {
        Self {
            rule,
            vectors: None,
        }
    }
}

impl<const D: usize> Integrator<D> for NewtonKrylov<D> {
    fn advance(&mut self, simulation: &mut Simulation<'_, D>, _half_kick_pending: bool) -> bool {
        let rule = self.rule;
        let vectors = (self.vectors).get_or_insert_with(|| Vectors::new(simulation));
        if simulation.progress.load_step.is_settled {
            vectors.begin_load_step(simulation, &rule);
        } else {
            vectors.iterate(simulation, &rule);
        }
        if simulation.is_drifting() {
            vectors.bisect_or_fail(simulation, &rule);
        } else if simulation.progress.load_step.residual <= rule.tolerance {
            if simulation.break_or_settle() {
                vectors.is_stale = true;
                simulation.evaluate_at_rest();
                simulation.find_residual();
            } else {
                simulation.end_halves();
            }
        } else if simulation.progress.load_step.residual.is_nan()
            || simulation.progress.load_step.since_breaking >= rule.max_iterations
        {
            vectors.bisect_or_fail(simulation, &rule);
        }
        false
    }
}

/// Work vectors over the owned points.
struct Vectors<const D: usize> {
    /// Displacement u at which finite differences of the forces approximate K, m.
    base: [Vec<f64>; D],
    /// Total force density f at `base`, N/m³.
    force: [Vec<f64>; D],
    /// Correction x, m.
    correction: [Vec<f64>; D],
    /// Residual f − K x of the linear problem, N/m³.
    residual: [Vec<f64>; D],
    /// Present search direction, m.
    direction: [Vec<f64>; D],
    /// K times the search direction, N/m³.
    product: [Vec<f64>; D],
    /// Preconditioned residual, m.
    preconditioned: [Vec<f64>; D],
    /// Estimated inverse of the diagonal of K, m⁴/N; 0 for supported components and for points that have
    /// never had an intact bond.
    inverse_diagonal: [Vec<f64>; D],
    /// Coarse grid of the preconditioner.
    coarse: CoarseGrid<D>,
    /// Whether the preconditioner must be computed: at first, and after bonds have broken.
    is_stale: bool,
    /// The shortest horizon, m.
    horizon: f64,
}

impl<const D: usize> Vectors<D> {
    fn new(simulation: &Simulation<'_, D>) -> Self {
        let (model, comm) = (&simulation.model, simulation.comm);
        let zero = || std::array::from_fn(|_| vec![0.0; model.owned()]);
        let horizons = simulation.problem.blocks().map(|block| block.horizon);
        let horizon = horizons.fold(f64::INFINITY, f64::min);
        Self {
            base: zero(),
            force: zero(),
            correction: zero(),
            residual: zero(),
            direction: zero(),
            product: zero(),
            preconditioned: zero(),
            inverse_diagonal: zero(),
            coarse: CoarseGrid::new(comm, model, horizon),
            is_stale: true,
            horizon,
        }
    }

    /// Begin a load step, and compute the residual at the predicted positions. Collective.
    fn begin_load_step(&mut self, simulation: &mut Simulation<'_, D>, rule: &Static) {
        let follows_the_last =
            !simulation.clock.is_new_size() && !simulation.progress.load_step.has_broken;
        self.refresh(simulation);
        simulation.begin_load_step(follows_the_last);
        if follows_the_last {
            simulation.evaluate_at_rest();
            simulation.find_residual();
        } else {
            self.predict(simulation, rule);
        }
    }

    /// Predict the displacements of a load step: solve the problem that is linearized about the last
    /// equilibrium. Collective.
    fn predict(&mut self, simulation: &mut Simulation<'_, D>, rule: &Static) {
        let owned = simulation.model.owned();
        let fields = &mut simulation.fields;
        let equilibrium = fields.equilibrium_displacement.as_ref();
        for (d, equilibrium) in equilibrium.into_iter().flatten().enumerate() {
            self.base[d].copy_from_slice(equilibrium);
            for point in 0..owned {
                self.correction[d][point] = fields.displacement[d][point] - equilibrium[point];
            }
            self.direction[d].copy_from_slice(&self.correction[d]);
            fields.displacement[d][..owned].copy_from_slice(equilibrium);
        }
        simulation.evaluate_at_rest();
        self.note_force(simulation);
        self.multiply(simulation);
        add(&mut self.residual, -1.0, &self.product);
        let linear = self.solve(
            simulation,
            rule.tolerance * simulation.progress.load_step.scale,
        );
        move_from(simulation, &self.base, 1.0, &self.correction);
        let (time, step) = (simulation.clock.time(), simulation.clock.step());
        simulation.apply_displacements(time, step);
        simulation.evaluate_at_rest();
        let force = simulation.find_residual();
        simulation.progress.newton.adapt(linear, force);
    }

    /// Make one Newton iteration: solve K x = f, move the points along x by the line search, and adapt η.
    /// Collective.
    fn iterate(&mut self, simulation: &mut Simulation<'_, D>, rule: &Static) {
        simulation.progress.load_step.iterations += 1;
        simulation.progress.load_step.since_breaking += 1;
        self.refresh(simulation);
        let owned = simulation.model.owned();
        for d in 0..D {
            self.base[d].copy_from_slice(&simulation.fields.displacement[d][..owned]);
            self.correction[d].fill(0.0);
        }
        self.note_force(simulation);
        let scale = self.residual_norm(simulation) / simulation.progress.load_step.residual;
        let linear = self.solve(simulation, rule.tolerance * scale);
        let force = self.search(simulation, rule);
        simulation.progress.newton.adapt(linear, force);
    }

    /// Store the total forces at the present displacements, which must be those in `base`. Set the residual
    /// of the linear problem to these forces, and to 0 where the inverse diagonal is 0.
    fn note_force(&mut self, simulation: &Simulation<'_, D>) {
        let (model, fields) = (&simulation.model, &simulation.fields);
        for d in 0..D {
            let inverse = &self.inverse_diagonal[d];
            in_chunks(&mut self.force[d], &|first, chunk| {
                for (point, force) in (first..).zip(chunk) {
                    *force = fields.total_force(model, d, point);
                }
            });
            let force = &self.force[d];
            in_chunks(&mut self.residual[d], &|first, chunk| {
                for (point, residual) in (first..).zip(chunk) {
                    *residual = if inverse[point] > 0.0 {
                        force[point]
                    } else {
                        0.0
                    };
                }
            });
        }
    }

    /// Improve x by conjugate gradients until ‖f − K x‖ is at most η times its initial value, or at most
    /// `LINEAR_TOLERANCE_SHARE` times `allowed`. `allowed` is the norm ‖f‖ (N) that is accepted as
    /// equilibrium. The method also stops at a direction of negative curvature, and after
    /// `MAX_CG_ITERATIONS`. Returns ‖f − K x‖ before and after the iterations. Collective.
    fn solve(&mut self, simulation: &mut Simulation<'_, D>, allowed: f64) -> Linear {
        let first = self.residual_norm(simulation);
        let mut linear = Linear { first, last: first };
        let wanted = simulation.progress.newton.forcing * first;
        let wanted = wanted.max(LINEAR_TOLERANCE_SHARE * allowed);
        // `power` is the inner product of the residual and the preconditioned residual in the last iteration;
        // `length` is the step length along the direction of that iteration.
        let (mut power, mut length) = (f64::NAN, 0.0);
        for number in 0..MAX_CG_ITERATIONS {
            if linear.last.is_nan() || linear.last <= wanted {
                break;
            }
            self.precondition(simulation);
            let own = dot(simulation, &self.residual, &self.preconditioned);
            // Along the last direction, the residual has changed by −`length` · K · direction.
            let kept = if number == 0 {
                0.0
            } else {
                let change = dot(simulation, &self.product, &self.preconditioned);
                (-length * change / power).max(0.0)
            };
            power = own;
            for (direction, preconditioned) in self.direction.iter_mut().zip(&self.preconditioned) {
                in_chunks(direction, &|first, chunk| {
                    for (direction, new) in chunk.iter_mut().zip(&preconditioned[first..]) {
                        *direction = new + kept * *direction;
                    }
                });
            }
            self.multiply(simulation);
            let curvature = dot(simulation, &self.direction, &self.product);
            if curvature.is_nan() || curvature <= 0.0 {
                if number == 0 {
                    add(&mut self.correction, 1.0, &self.direction);
                }
                break;
            }
            length = power / curvature;
            add(&mut self.correction, length, &self.direction);
            add(&mut self.residual, -length, &self.product);
            linear.last = self.residual_norm(simulation);
        }
        linear
    }

    /// Return ‖f − K x‖, N. Collective.
    fn residual_norm(&self, simulation: &Simulation<'_, D>) -> f64 {
        let (model, fields) = (&simulation.model, &simulation.fields);
        let square = sums(model, fields, &|point, _| {
            let force = |d: usize| model.volume[point] * self.residual[d][point];
            [(0..D).map(|d| f64::powi(force(d), 2)).sum()]
        });
        reduce(simulation.comm, &mut { square })[0].sqrt()
    }

    /// Compute K times the search direction. Collective.
    fn multiply(&mut self, simulation: &mut Simulation<'_, D>) {
        let columns = self.direction.par_iter().flatten();
        let magnitude = columns.map(|component: &f64| component.abs());
        let mut largest = [magnitude.reduce(|| 0.0, f64::max)];
        simulation.comm.max(&mut largest);
        if largest[0] == 0.0 {
            self.product.iter_mut().for_each(|column| column.fill(0.0));
            return;
        }
        let shift = SHIFT * self.horizon / largest[0];
        move_from(simulation, &self.base, shift, &self.direction);
        simulation.evaluate_at_rest();
        let (model, fields) = (&simulation.model, &simulation.fields);
        for d in 0..D {
            let (force, inverse) = (&self.force[d], &self.inverse_diagonal[d]);
            in_chunks(&mut self.product[d], &|first, chunk| {
                for (point, product) in (first..).zip(chunk) {
                    let change = force[point] - fields.total_force(model, d, point);
                    *product = if inverse[point] > 0.0 {
                        change / shift
                    } else {
                        0.0
                    };
                }
            });
        }
    }

    /// Apply the preconditioner to the residual. Collective.
    fn precondition(&mut self, simulation: &Simulation<'_, D>) {
        let (model, comm) = (&simulation.model, simulation.comm);
        self.coarse.solve(comm, model, &self.residual);
        for d in 0..D {
            let (residual, inverse) = (&self.residual[d], &self.inverse_diagonal[d]);
            let coarse = &self.coarse;
            in_chunks(&mut self.preconditioned[d], &|first, chunk| {
                for (point, value) in (first..).zip(chunk) {
                    *value = if inverse[point] > 0.0 {
                        inverse[point] * residual[point] + coarse.displacement(model, d, point)
                    } else {
                        0.0
                    };
                }
            });
        }
    }

    /// Move the points along x until |x·f| is at most `LINE_SEARCH_TOLERANCE` times x·f at `base`, and
    /// compute the residual at the new positions. The search also ends if the residual is within the
    /// tolerance, if x·f at `base` is not positive, or after `MAX_LINE_SEARCH_STEPS` step lengths. Returns
    /// ‖f‖ at the new positions, N. Collective.
    fn search(&mut self, simulation: &mut Simulation<'_, D>, rule: &Static) -> f64 {
        let at_base = dot(simulation, &self.force, &self.correction);
        let mut length = 1.0;
        // Step lengths on both sides of the sign change of x·f, with their values of x·f.
        let (mut below, mut above) = ((0.0, at_base), None);
        for place in 1.. {
            move_from(simulation, &self.base, length, &self.correction);
            simulation.evaluate_at_rest();
            let force = simulation.find_residual();
            let power = self.power(simulation);
            let is_good = power.abs() <= LINE_SEARCH_TOLERANCE * at_base
                || simulation.progress.load_step.residual <= rule.tolerance;
            if is_good || place == MAX_LINE_SEARCH_STEPS || at_base <= 0.0 {
                return force;
            }
            if power.is_nan() {
                length = 0.5 * (below.0 + length);
                continue;
            }
            if power > 0.0 {
                below = (length, power);
            } else {
                above = Some((length, power));
            }
            length = match above {
                None => 2.0 * length,
                Some((end, power)) => {
                    let width = end - below.0;
                    let share = below.1 / (below.1 - power);
                    below.0 + width * share.clamp(0.1, 0.9)
                }
            };
        }
        unreachable!("the loop returns")
    }

    /// Return the product x·f of the correction and the total forces at the present positions, J. Collective.
    fn power(&self, simulation: &Simulation<'_, D>) -> f64 {
        let (model, fields) = (&simulation.model, &simulation.fields);
        let power = sums(model, fields, &|point, _| {
            let of = |d: usize| self.correction[d][point] * fields.total_force(model, d, point);
            [model.volume[point] * (0..D).map(of).sum::<f64>()]
        });
        reduce(simulation.comm, &mut { power })[0]
    }

    /// Compute the preconditioner at the first call, and if bonds have broken since its last computation.
    /// Collective.
    fn refresh(&mut self, simulation: &mut Simulation<'_, D>) {
        if !std::mem::take(&mut self.is_stale) {
            return;
        }
        let (model, forces) = (&simulation.model, &mut simulation.forces);
        let owned = model.owned();
        let family = &simulation.undeformed.family_volume;
        let mut intact = forces.intact_families(model).volume;
        in_chunks(&mut intact, &|first, chunk| {
            for (point, share) in (first..).zip(chunk) {
                *share = if family[point] > 0.0 {
                    (*share / family[point]).max(LEAST_INTACT)
                } else {
                    0.0
                };
            }
        });
        let is_free = simulation.conditions.free_components(owned);
        let density = simulation.fields.fictitious_density.as_deref();
        let density = density.expect("a run with equilibria has fictitious densities");
        for (inverse, is_free) in self.inverse_diagonal.iter_mut().zip(&is_free) {
            in_chunks(inverse, &|first, chunk| {
                for (point, inverse) in (first..).zip(chunk) {
                    let stiffness = density[point] * intact[point];
                    let takes_part = is_free[point] == 1.0 && stiffness.is_finite();
                    *inverse = if takes_part && stiffness > 0.0 {
                        1.0 / stiffness
                    } else {
                        0.0
                    };
                }
            });
        }
        if simulation.progress.newton.diagonal.is_nan() {
            self.measure_diagonal(simulation);
        }
        let diagonal = simulation.progress.newton.diagonal;
        let columns = self.inverse_diagonal.iter_mut().flatten();
        columns.for_each(|inverse| *inverse /= diagonal);
        let problem = simulation.problem;
        let moduli: Vec<[f64; 2]> = problem
            .blocks()
            .map(|block| moduli(block.body.material.elastic, problem.dimension))
            .collect();
        let model = &simulation.model;
        let density = simulation.fields.fictitious_density.as_deref();
        let density = density.expect("a run with equilibria has fictitious densities");
        self.coarse.assemble(simulation.comm, model, |point| {
            let weight = model.volume[point] * intact[point];
            let stiffness = density[point] * diagonal * weight;
            PointStiffness {
                moduli: moduli[usize::from(model.block[point])].map(|modulus| weight * modulus),
                springs: std::array::from_fn(|d| {
                    if is_free[d][point] == 1.0 || !stiffness.is_finite() {
                        0.0
                    } else {
                        stiffness
                    }
                }),
            }
        });
    }

    /// Estimate [`NewtonState::diagonal`]. If the estimate is not positive or not finite, use 1 instead. For
    /// a vector s of random signs, s·K s approximates the trace of K (Hutchinson 1990). Collective.
    fn measure_diagonal(&mut self, simulation: &mut Simulation<'_, D>) {
        let owned = simulation.model.owned();
        for d in 0..D {
            self.base[d].copy_from_slice(&simulation.fields.displacement[d][..owned]);
            for point in 0..owned {
                let is_free = self.inverse_diagonal[d][point] > 0.0;
                let id = simulation.model.ids[point];
                let is_positive = uniform(0, Scattered::Probe(d), id) < 0.5;
                let sign = if is_positive { 1.0 } else { -1.0 };
                self.direction[d][point] = if is_free { sign } else { 0.0 };
            }
        }
        simulation.evaluate_at_rest();
        self.note_force(simulation);
        self.multiply(simulation);
        let [direction, product, inverse] =
            [&self.direction, &self.product, &self.inverse_diagonal];
        let (model, fields) = (&simulation.model, &simulation.fields);
        let both = sums(model, fields, &|point, _| {
            let mut terms = [0.0; 2];
            for d in (0..D).filter(|d| inverse[*d][point] > 0.0) {
                terms[0] += model.volume[point] * direction[d][point] * product[d][point];
                terms[1] += model.volume[point] / inverse[d][point];
            }
            terms
        });
        let both = reduce(simulation.comm, &mut { both });
        let diagonal = both[0] / both[1];
        simulation.progress.newton.diagonal = if diagonal > 0.0 && diagonal.is_finite() {
            diagonal
        } else {
            1.0
        };
        move_from(simulation, &self.base, 0.0, &self.direction);
        simulation.evaluate_at_rest();
    }

    /// Repeat the load step with half its size if this is allowed, otherwise mark it as failed. Collective.
    fn bisect_or_fail(&mut self, simulation: &mut Simulation<'_, D>, rule: &Static) {
        let can_be_halved = !simulation.progress.load_step.has_broken
            && simulation.progress.newton.halvings < rule.max_halvings
            && simulation.check_pieces_are_held("").is_ok();
        if can_be_halved {
            simulation.return_to_equilibrium();
            self.begin_load_step(simulation, rule);
            return;
        }
        simulation.progress.load_step.has_failed = true;
        if simulation.progress.load_step.residual.is_nan() {
            let clock = simulation.clock;
            simulation.note_bad(&clock);
        }
    }
}

/// ‖f − K x‖ before and after the solution of the linear problem, N.
struct Linear {
    first: f64,
    last: f64,
}

impl NewtonState {
    /// Choose the next η from `force`, which is ‖f‖ at the new positions (N), and from the norms of the
    /// linear problem.
    fn adapt(&mut self, linear: Linear, force: f64) {
        let forcing = (force - linear.last).abs() / linear.first;
        if forcing.is_finite() {
            self.forcing = forcing.min(MOST_FORCING);
        }
    }
}

impl<const D: usize> Simulation<'_, D> {
    /// Return to the last equilibrium, and halve the size of the load step.
    fn return_to_equilibrium(&mut self) {
        let fields = &mut self.fields;
        for (d, equilibrium) in fields.equilibrium_displacement.iter().flatten().enumerate() {
            fields.displacement[d][..equilibrium.len()].copy_from_slice(equilibrium);
        }
        if let (Some(equilibrium), Some(reaction)) =
            (&fields.equilibrium_reaction, &mut fields.reaction)
        {
            reaction.clone_from(equilibrium);
        }
        self.clock.retreat(0.5 * self.clock.step());
        self.progress.newton.halvings += 1;
        self.progress.newton.left *= 2;
    }

    /// Count a finished load step. If load steps have been halved, restore the original size at the end of
    /// the load step that was halved first.
    fn end_halves(&mut self) {
        self.progress.newton.left -= 1;
        if self.progress.newton.left > 0 {
            return;
        }
        self.progress.newton.left = 1;
        let halvings = std::mem::take(&mut self.progress.newton.halvings);
        if halvings > 0 && !self.clock.is_over() {
            let whole = libm::scalbn(self.clock.step(), halvings as i32);
            self.clock.set_step(whole);
        }
    }
}

/// Set the displacements of the owned points to `base` plus `length` times `direction`.
fn move_from<const D: usize>(
    simulation: &mut Simulation<'_, D>,
    base: &[Vec<f64>; D],
    length: f64,
    direction: &[Vec<f64>; D],
) {
    for d in 0..D {
        let (base, direction) = (&base[d], &direction[d]);
        let owned = &mut simulation.fields.displacement[d][..base.len()];
        in_chunks(owned, &|first, chunk| {
            let both = base[first..].iter().zip(&direction[first..]);
            for (displacement, (base, direction)) in chunk.iter_mut().zip(both) {
                *displacement = base + length * direction;
            }
        });
    }
}

/// For each chunk of a column, call `change` with the index of the first entry and with the entries. The
/// calls run on several threads.
fn in_chunks(column: &mut [f64], change: &(dyn Fn(usize, &mut [f64]) + Sync)) {
    let chunks = column.par_chunks_mut(CHUNK).enumerate();
    chunks.for_each(|(k, chunk)| change(k * CHUNK, chunk));
}

/// Add `factor` times `vector` to `to`.
fn add<const D: usize>(to: &mut [Vec<f64>; D], factor: f64, vector: &[Vec<f64>; D]) {
    for (to, vector) in to.iter_mut().zip(vector) {
        in_chunks(to, &|first, chunk| {
            for (to, value) in chunk.iter_mut().zip(&vector[first..]) {
                *to += factor * value;
            }
        });
    }
}

/// Return the dot product of a force density (N/m³) and a displacement (m), weighted by volume, J.
/// Collective.
fn dot<const D: usize>(
    simulation: &Simulation<'_, D>,
    a: &[Vec<f64>; D],
    b: &[Vec<f64>; D],
) -> f64 {
    let (model, fields) = (&simulation.model, &simulation.fields);
    let sum = sums(model, fields, &|point, _| {
        let products = (0..D).map(|d| a[d][point] * b[d][point]);
        [model.volume[point] * products.sum::<f64>()]
    });
    reduce(simulation.comm, &mut { sum })[0]
}

/// λ and G (Pa) of the classical solid that represents a body in this dimension.
fn moduli(elastic: Isotropic, dimension: Dimension) -> [f64; 2] {
    let (lambda, shear) = (elastic.lame_lambda(), elastic.shear_modulus());
    match dimension {
        Dimension::Line {
            constraint: Constraint::UniaxialStress,
            ..
        } => [0.0, 0.5 * elastic.youngs_modulus],
        Dimension::PlaneStress { .. } => [2.0 * lambda * shear / (lambda + 2.0 * shear), shear],
        Dimension::Line { .. } | Dimension::PlaneStrain { .. } | Dimension::Space => {
            [lambda, shear]
        }
    }
}
