//! Velocity Verlet: half a kick, a drift, a force evaluation, half a kick. A kick changes the velocities, and
//! a drift changes the displacements.
//!
//! See Silling & Askari 2005. The method is time-reversible and of second order in the time step. Velocities
//! are known at full steps. With viscous damping at a rate r, the equation of motion is ρ ü = f − r ρ u̇
//! (Emmrich & Weckner 2006, eq. 11).

use crate::solver::Simulation;
use crate::solver::model::Model;

use super::integrator::Integrator;
use super::walk::{Moving, Part};

/// Verlet integrator with the step of the stage. Contact may require shorter steps.
pub struct Verlet;

impl<const D: usize> Integrator<D> for Verlet {
    fn advance(&mut self, simulation: &mut Simulation<'_, D>, half_kick_pending: bool) -> bool {
        if let Some(step) = simulation.step_for_contact() {
            simulation.set_step_for_contact(step);
        }
        simulation.make_step(half_kick_pending);
        simulation.count_calm_steps();
        true
    }
}

/// Density (kg/m³) and damping rate (1/s) of a point.
type Constants = (f64, f64);

fn constants<const D: usize>(model: &Model<D>, block: u16) -> Constants {
    let block = usize::from(block);
    (model.density[block], model.damping[block])
}

/// Return the constants if all points of the part belong to the same block. With the same constants for all
/// points, the compiler can vectorize the loop over the points.
fn same_constants<const D: usize>(part: &Part<'_, D>) -> Option<Constants> {
    let (first, others) = part.blocks().split_first()?;
    let is_same = others.iter().all(|block| block == first);
    is_same.then(|| constants(part.model, *first))
}

/// Apply half a kick with the forces at the old positions, then the drift: u̇ += ½ Δt ü, u += Δt u̇. `step`
/// is Δt, s.
pub fn half_kick_and_drift<const D: usize>(part: &mut Part<'_, D>, step: f64) {
    for_each_component(part, |place, velocity, force, (density, damping)| {
        let mut total = force;
        if damping > 0.0 {
            total -= damping * density * *velocity;
        }
        *velocity += 0.5 * step * (total / density);
        *place += step * *velocity;
        true
    });
}

/// Apply half a kick with the forces at the new positions. The damping uses the final velocity: u̇ ← (u̇ + ½
/// Δt f/ρ)/(1 + ½ r Δt). Returns whether all velocities are finite. `step` is Δt, s.
pub fn second_half_kick<const D: usize>(part: &mut Part<'_, D>, step: f64) -> bool {
    for_each_component(part, |_, velocity, force, (density, damping)| {
        *velocity += 0.5 * step * (force / density);
        if damping > 0.0 {
            *velocity /= 1.0 + 0.5 * damping * step;
        }
        velocity.is_finite()
    })
}

/// Apply [`second_half_kick`] of a step and [`half_kick_and_drift`] of the next step in one loop. The steps
/// have the same length (s), and there is no damping. The results are bitwise the same as with two loops.
/// Returns whether all velocities between the two half kicks are finite.
pub fn kick_and_drift<const D: usize>(part: &mut Part<'_, D>, step: f64) -> bool {
    for_each_component(part, |place, velocity, force, (density, _)| {
        let half_kick = 0.5 * step * (force / density);
        *velocity += half_kick;
        let finite = velocity.is_finite();
        *velocity += half_kick;
        *place += step * *velocity;
        finite
    })
}

/// Call `work` with displacement (m), velocity (m/s), force density (N/m³) and constants, for each component
/// of each point. Returns whether all calls returned true.
fn for_each_component<const D: usize>(
    part: &mut Part<'_, D>,
    work: impl Fn(&mut f64, &mut f64, f64, Constants) -> bool,
) -> bool {
    let (model, blocks, same) = (part.model, part.blocks(), same_constants(part));
    let mut all = true;
    for d in 0..D {
        let moving = part.component(d);
        all &= match same {
            Some(same) => for_each_point(moving, &work, |_| same),
            None => for_each_point(moving, &work, |k| constants(model, blocks[k])),
        };
    }
    all
}

#[inline(always)]
fn for_each_point(
    moving: Moving<'_>,
    work: impl Fn(&mut f64, &mut f64, f64, Constants) -> bool,
    constants: impl Fn(usize) -> Constants,
) -> bool {
    let count = moving.velocity.len();
    let (places, velocities) = (&mut moving.displacement[..count], moving.velocity);
    let internal = &moving.force.internal[..count];
    let mut all = true;
    // The loop exists twice, so that it does not contain the check for external forces.
    match moving.force.external {
        None => {
            for k in 0..count {
                let force = internal[k];
                all &= work(&mut places[k], &mut velocities[k], force, constants(k));
            }
        }
        Some(external) => {
            let external = &external[..count];
            for k in 0..count {
                let force = internal[k] + external[k];
                all &= work(&mut places[k], &mut velocities[k], force, constants(k));
            }
        }
    }
    all
}
