//! The solver: state, bond loops, time integration, conditions and what is observed.

pub mod conditions;
pub mod forces;
mod kernels;
pub mod model;
pub mod observe;
mod saved;
pub mod schedule;
pub mod simulation;
pub mod stable_step;
pub mod state;
mod sweep;
mod verlet;

pub use kernels::{Response, Stored};
pub use saved::Saved;
pub use simulation::Simulation;
