//! Velocity Verlet: half a kick, a drift, new forces, half a kick.
//!
//! Silling & Askari 2005; second order in the step, time-reversible, and velocities are known at full
//! steps. With viscous damping at a rate r the equation of motion is ρ ü = f − r ρ u̇ (Emmrich & Weckner
//! 2006, eq. 11).

use rayon::prelude::*;

use super::Fields;
use super::fields::Exerted;
use crate::solver::model::Model;

/// Points handled by one task.
const CHUNK: usize = 4096;

/// Calls `work` with each part of a component: displacement, velocity, forces and blocks of the points.
/// Returns whether all calls did.
fn for_each_part<const D: usize>(
    model: &Model<D>,
    fields: &mut Fields<D>,
    work: impl Fn(&mut [f64], &mut [f64], Exerted<'_>, &[u16]) -> bool + Sync,
) -> bool {
    let mut all = true;
    for d in 0..D {
        let external = fields.external_force.as_ref().map(|field| &field[d]);
        let part = |chunk: usize, length: usize| {
            external.map(|field| &field[chunk * CHUNK..chunk * CHUNK + length])
        };
        all &= fields.displacement[d][..model.owned()]
            .par_chunks_mut(CHUNK)
            .zip(fields.velocity[d].par_chunks_mut(CHUNK))
            .zip(fields.internal_force[d].par_chunks(CHUNK))
            .zip(model.block.par_chunks(CHUNK))
            .enumerate()
            .map(|(chunk, (((displacement, velocity), internal), block))| {
                let external = part(chunk, internal.len());
                work(
                    displacement,
                    velocity,
                    Exerted { internal, external },
                    block,
                )
            })
            .reduce(|| true, |a, b| a & b);
    }
    all
}

/// Half a kick with the forces at the old place, then the drift: u̇ += ½ Δt ü, u += Δt u̇. `step` in s.
pub fn half_kick_and_drift<const D: usize>(model: &Model<D>, fields: &mut Fields<D>, step: f64) {
    for_each_part(model, fields, |displacement, velocity, force, block| {
        for k in 0..velocity.len() {
            let block = usize::from(block[k]);
            let (density, damping) = (model.density[block], model.damping[block]);
            let mut total = force.at(k);
            if damping > 0.0 {
                total -= damping * density * velocity[k];
            }
            velocity[k] += 0.5 * step * (total / density);
            displacement[k] += step * velocity[k];
        }
        true
    });
}

/// Half a kick with the forces at the new place, and with the damping at the velocity that comes out:
/// u̇ ← (u̇ + ½ Δt f/ρ)/(1 + ½ r Δt). Returns whether all velocities are still finite. `step` in s.
pub fn second_half_kick<const D: usize>(
    model: &Model<D>,
    fields: &mut Fields<D>,
    step: f64,
) -> bool {
    for_each_part(model, fields, |_, velocity, force, block| {
        let mut finite = true;
        for k in 0..velocity.len() {
            let block = usize::from(block[k]);
            let (density, damping) = (model.density[block], model.damping[block]);
            velocity[k] += 0.5 * step * (force.at(k) / density);
            if damping > 0.0 {
                velocity[k] /= 1.0 + 0.5 * damping * step;
            }
            finite &= velocity[k].is_finite();
        }
        finite
    })
}
