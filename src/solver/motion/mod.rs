//! Motion: the fields of the points, the clock, and time integration.

pub mod adaptive;
mod banded;
pub mod clock;
mod coarse_grid;
mod contact_step;
pub mod fictitious_density;
pub mod fields;
pub mod held;
pub mod integrator;
pub mod load_step;
pub mod newton;
mod pieces;
pub mod relaxation;
mod rigid_motions;
pub mod saved;
pub mod stable_step;
pub mod undo;
pub mod verlet;
pub mod walk;

pub use clock::Clock;
pub use fields::Fields;
pub use saved::{Saved, SavedBonds, SavedColumn};
pub use undo::Kept;
