//! What contact demands of the step, and what of contact a checkpoint holds.

use bytemuck::{Pod, Zeroable};

use crate::solver::bonds::Forces;
use crate::solver::model::Model;

use super::Contact;
use super::rigid::RigidState;

/// Steps that could have been longer before they become so.
const CALM: u64 = 100;

/// What contact demands of the step, over all ranks and over what will touch within two steps.
#[derive(Debug, Clone, Copy, Default, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub(super) struct StepDemand {
    /// The largest 2 Σ k/m of a point or body, 1/s²: a bound of what contact adds to the squares of the frequencies.
    pub stiffness: f64,
    /// The largest 2 Σ c/m, 1/s.
    pub damping: f64,
    /// Steps in a row that could have been longer.
    calm: u64,
}

/// What of contact changes besides the fields of the points; the same on all ranks.
#[derive(Debug, Clone, Default)]
pub struct ContactState {
    rigid: Vec<RigidState>,
    demand: StepDemand,
    /// Owned points that touch a rigid body.
    at_rigid: Vec<u32>,
}

impl ContactState {
    /// As a checkpoint holds it; points that touch rigid bodies are found again.
    pub fn words(&self) -> Vec<u64> {
        let demand = bytemuck::cast_slice(std::slice::from_ref(&self.demand));
        [demand, bytemuck::cast_slice(&self.rigid)].concat()
    }

    /// What [`Self::words`] gave.
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
    /// What of it changes besides the fields.
    pub fn state(&self) -> ContactState {
        ContactState {
            rigid: self.rigid.iter().map(|rigid| rigid.state).collect(),
            demand: self.demand,
            at_rigid: self.at_rigid[0].clone(),
        }
    }

    /// Goes back to a state of the present points before the last step, whose bonds were put back.
    pub fn undo(&mut self, state: &ContactState, model: &Model<D>, forces: &Forces<D>) {
        self.set_state(state);
        self.update_bonds(model, forces);
    }

    /// Goes back to a state of a checkpoint.
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

    /// Whether anything touches or will soon.
    pub fn is_felt(&self) -> bool {
        self.demand.stiffness > 0.0
    }

    /// Whether steps have been shorter than they must be for so long that they may become longer.
    pub fn is_calm(&self) -> bool {
        self.demand.calm >= CALM
    }

    /// The stable step (s) with contact as it is now, where it is `step` (s) without.
    ///
    /// With damping at the velocities half a step before, Δt² ω² + 2 Δt C/m < 4 is stable.
    pub fn stable_step(&self, step: f64) -> f64 {
        let square = 4.0 / (step * step) + self.demand.stiffness;
        let damping = self.demand.damping;
        ((damping * damping + 4.0 * square).sqrt() - damping) / square
    }

    /// Counts the present step if it could have been longer.
    pub fn count_calm(&mut self, could_be_longer: bool) {
        self.demand.calm = if could_be_longer {
            self.demand.calm + 1
        } else {
            0
        };
    }

    /// Densities of the points were multiplied by a factor.
    pub fn scale_density(&mut self, factor: f64) {
        self.demand.stiffness /= factor.min(1.0);
        self.demand.damping /= factor.min(1.0);
    }
}
