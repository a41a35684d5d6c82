//! The solver: bonds and their forces, motion, conditions, and observed quantities.

pub mod assign;
pub mod bonds;
pub mod calibration;
pub mod conditions;
mod connected;
pub mod contact;
mod grids;
pub mod model;
pub mod motion;
pub mod observers;
pub mod palette_column;
pub mod progress;
pub mod refinement;
pub mod repartition;
pub mod simulation;
pub mod size;
mod stages;
mod stepper;
pub mod steps;

pub use simulation::Simulation;
pub use stepper::Stepper;
