//! Velocity Verlet: half a kick, a drift, new forces, half a kick.
//!
//! Silling & Askari 2005; second order in the step, time-reversible, and velocities are known at full
//! steps.

use rayon::prelude::*;

use super::model::Model;
use super::state::State;

/// Points handled by one task.
const CHUNK: usize = 4096;

/// Half a kick with the forces at the old place, then the drift: u̇ += ½ Δt ü, u += Δt u̇. `step` in s.
pub fn kick_and_drift<const D: usize>(model: &Model<D>, state: &mut State<D>, step: f64) {
    let responses = &state.responses;
    let fields = state.displacement.iter_mut().zip(&mut state.velocity);
    for (d, (displacement, velocity)) in fields.enumerate() {
        displacement[..responses.len()]
            .par_chunks_mut(CHUNK)
            .zip(velocity.par_chunks_mut(CHUNK))
            .zip(
                responses
                    .par_chunks(CHUNK)
                    .zip(model.block.par_chunks(CHUNK)),
            )
            .for_each(|((displacement, velocity), (responses, block))| {
                for k in 0..velocity.len() {
                    let density = model.density[usize::from(block[k])];
                    velocity[k] += 0.5 * step * (responses[k].force[d] / density);
                    displacement[k] += step * velocity[k];
                }
            });
    }
}

/// Half a kick with the forces at the new place, and with the damping at the velocity that comes out:
/// u̇ ← (u̇ + ½ Δt ü)/(1 + ½ r Δt). Returns whether all velocities are still finite. `step` in s.
pub fn kick<const D: usize>(model: &Model<D>, state: &mut State<D>, step: f64) -> bool {
    let responses = &state.responses;
    let mut finite = true;
    for (d, velocity) in state.velocity.iter_mut().enumerate() {
        finite &= velocity
            .par_chunks_mut(CHUNK)
            .zip(
                responses
                    .par_chunks(CHUNK)
                    .zip(model.block.par_chunks(CHUNK)),
            )
            .map(|(velocity, (responses, block))| {
                let mut finite = true;
                for k in 0..velocity.len() {
                    let density = model.density[usize::from(block[k])];
                    velocity[k] += 0.5 * step * (responses[k].force[d] / density);
                    let damping = model.damping[usize::from(block[k])];
                    if damping > 0.0 {
                        velocity[k] /= 1.0 + 0.5 * damping * step;
                    }
                    finite &= velocity[k].is_finite();
                }
                finite
            })
            .reduce(|| true, |a, b| a & b);
    }
    finite
}
