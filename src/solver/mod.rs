//! The solver: state, bond loops, time integration, conditions and what is observed.

pub mod assign;
mod cloud;
pub mod conditions;
pub mod damping;
mod failure;
pub mod forces;
mod foremost;
mod front;
mod geometry;
mod grids;
pub mod instructions;
mod kernels;
pub mod laws;
mod measures;
pub mod model;
pub mod nearest;
pub mod observe;
mod passes;
mod places;
mod saved;
pub mod schedule;
pub mod simulation;
pub mod size;
pub mod stable_step;
pub mod state;
mod sweep;
mod tip;
pub mod values;
mod verlet;

pub use kernels::{Response, Stored};
pub use saved::Saved;
pub use simulation::Simulation;
