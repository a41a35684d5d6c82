//! Observed quantities of a run: fields for the result; sums, probes, fronts, cracks, crack tips and J
//! integrals for the history.

mod centre_line;
mod columns;
mod crack_edge;
mod crack_path;
mod crack_points;
mod crack_surface;
mod cracked;
mod foreign_tip;
mod fragments;
mod front;
pub mod history;
mod interpenetration;
mod j_integral;
mod j_weight;
pub mod nearest;
mod reach;
mod row_fields;
pub mod schedule;
pub mod snapshot;
mod statistics;
mod tip;

pub use centre_line::{Branch, Vertex};
pub use crack_surface::Surface;
pub use foreign_tip::foreign_tip;
pub use history::{Energies, HistoryObserver, HistoryRow, column_names, state_energies};
pub use interpenetration::{Interpenetration, InterpenetrationWatch};
pub use nearest::{Nearest, nearest};
pub use schedule::Schedule;
pub use snapshot::Snapshot;
