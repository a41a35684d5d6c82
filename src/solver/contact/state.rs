//! The limits that contact sets for the time step, and the contact state in checkpoints.

use bytemuck::{Pod, Zeroable};

use crate::solver::bonds::Forces;
use crate::solver::model::Model;

use super::Contact;
use super::rigid::RigidState;

/// The step may be lengthened after this number of consecutive steps that contact did not limit.
const CALM: u64 = 100;

/// Limits that contact sets for the time step, over all ranks. The limits include contacts that will begin
/// within the look-ahead (`LOOK_AHEAD` steps). k is the stiffness of a contact (N/m), and c is the damping
/// coefficient of a contact (N s/m). 1/m is the inverse mass of a point, or the
/// [mobility](super::rigid::RigidBody::mobility) of a rigid body (1/kg).
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct StepDemand {
    /// Largest value of 2 Σ k/m over all points and rigid bodies, 1/s². The sum is over the contacts of the
    /// point or body. Contact increases the square of each angular frequency by at most this value.
    pub stiffness: f64,
    /// Largest 2 Σ c/m of a point or rigid body, 1/s.
    pub damping: f64,
    /// Number of consecutive steps that contact did not limit. In a stage without an adaptive step, the count
    /// is also reset to 0 when the step is lengthened. Before contact has limited any step, the count starts
    /// at a large number.
    calm: u64,
}

impl Default for StepDemand {
    fn default() -> Self {
        Self {
            stiffness: 0.0,
            damping: 0.0,
            calm: u64::MAX / 2,
        }
    }
}

/// The contact state that is not part of the fields of the points; the same on all ranks, except `at_rigid`.
#[derive(Debug, Clone, Default)]
pub struct ContactState {
    rigid: Vec<RigidState>,
    demand: StepDemand,
    /// Owned points of this rank that touch a rigid body or will do so within the look-ahead (`LOOK_AHEAD`).
    at_rigid: Vec<u32>,
}

impl ContactState {
    /// Encode the state for a checkpoint. Points that touch rigid bodies are not included, because the next
    /// evaluation finds these points.
    pub fn words(&self) -> Vec<u64> {
        let demand = bytemuck::cast_slice(std::slice::from_ref(&self.demand));
        [demand, bytemuck::cast_slice(&self.rigid)].concat()
    }

    /// Decode the state from [`Self::words`].
    pub fn of_words(words: &[u64]) -> Self {
        let (demand, rigid) = words.split_at(size_of::<StepDemand>() / size_of::<u64>());
        Self {
            rigid: bytemuck::cast_slice(rigid).to_vec(),
            demand: bytemuck::cast_slice(demand)[0],
            at_rigid: Vec::new(),
        }
    }
}

impl<const D: usize> Contact<D> {
    /// Copy the contact state that is not part of the fields.
    pub fn state(&self) -> ContactState {
        ContactState {
            rigid: self.rigid.iter().map(|rigid| rigid.state).collect(),
            demand: self.demand,
            at_rigid: self.at_rigid[0].clone(),
        }
    }

    /// Roll back a step: restore `state`, the contact state before the step. The rank must own the same
    /// points as before the step. The bonds must have been restored already.
    pub fn undo(&mut self, state: &ContactState, model: &Model<D>, forces: &Forces<D>) {
        self.set_state(state);
        self.update_bonds(model, forces);
    }

    /// Restore the state of a checkpoint.
    pub fn restore(&mut self, state: &ContactState) {
        self.set_state(state);
        self.is_stale = true;
    }

    fn set_state(&mut self, state: &ContactState) {
        for (rigid, state) in self.rigid.iter_mut().zip(&state.rigid) {
            rigid.state = *state;
        }
        self.demand = state.demand;
        self.at_rigid[0].clone_from(&state.at_rigid);
    }

    /// Whether there are contacts now or within the look-ahead (`LOOK_AHEAD`), so that contact sets a limit
    /// for the step.
    pub fn is_felt(&self) -> bool {
        self.demand.stiffness > 0.0
    }

    /// Number of consecutive steps that contact did not limit.
    pub fn calm(&self) -> u64 {
        self.demand.calm
    }

    /// Whether the step may be lengthened: contact did not limit the last `CALM` steps.
    pub fn is_calm(&self) -> bool {
        self.demand.calm >= CALM
    }

    /// Stable step (s) with contact; `step` is the stable step without contact.
    ///
    /// Damping forces use the velocities of half a step earlier. Therefore the step Δt is stable if
    /// Δt² ω² + 2 Δt C/m < 4. Here ω² is the sum of 4/`step`² and `StepDemand::stiffness`, and C/m is
    /// `StepDemand::damping`.
    pub fn stable_step(&self, step: f64) -> f64 {
        let square = 4.0 / (step * step) + self.demand.stiffness;
        let damping = self.demand.damping;
        ((damping * damping + 4.0 * square).sqrt() - damping) / square
    }

    /// Count the consecutive steps that contact did not limit. If `is_unlimited` is true, contact did not
    /// limit the present step, and the count increases by 1. Otherwise the count is reset to 0.
    pub fn count_calm(&mut self, is_unlimited: bool) {
        self.demand.calm = if is_unlimited {
            self.demand.calm + 1
        } else {
            0
        };
    }

    /// Scale the limits after the densities of the points were multiplied by a factor. For a factor above 1,
    /// the limits are not changed, because the old values are then upper bounds.
    pub fn scale_density(&mut self, factor: f64) {
        self.demand.stiffness /= factor.min(1.0);
        self.demand.damping /= factor.min(1.0);
    }
}
