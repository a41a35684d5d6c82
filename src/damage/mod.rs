//! Damage laws, one a file: when a bond breaks.

mod critical_stretch;

pub use critical_stretch::CriticalStretch;
