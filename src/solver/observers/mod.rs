//! What is seen of a run: fields for the result; sums, probes, fronts and crack tips for the history.

mod contact;
mod front;
pub mod history;
pub mod nearest;
mod reach;
pub mod schedule;
pub mod snapshot;
mod tip;

pub use contact::{Contact, ContactWatch};
pub use history::{Energies, HistoryObserver, HistoryRow};
pub use nearest::{Nearest, nearest};
pub use schedule::Schedule;
pub use snapshot::Snapshot;
