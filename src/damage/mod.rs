//! Damage laws, one a file: when a bond breaks.

mod criterion;
mod critical_stretch;
mod pull_apart;

pub use criterion::{Criterion, Ends};
pub use critical_stretch::CriticalStretch;
