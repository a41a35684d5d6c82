//! Damage laws, one a file: when a bond breaks.

mod critical_stretch;
mod pull_apart;

pub use critical_stretch::CriticalStretch;
