//! Fissure: a peridynamics solver for batch jobs on clusters.
pub mod comm;
pub mod damage;
pub mod deck;
pub mod dimension;
pub mod elastic;
pub mod error;
pub mod families;
pub mod lanes;
pub mod material;
pub mod output;
pub mod partition;
pub mod picture;
pub mod points;
pub mod run;
pub mod solver;

pub use run::run;
