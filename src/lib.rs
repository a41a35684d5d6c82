//! Fissure: a peridynamics solver for batch jobs on clusters.
pub mod comm;
pub mod damage;
pub mod deck;
pub mod dimension;
pub mod elastic;
pub mod error;
pub mod families;
pub mod material;
pub mod output;
pub mod partition;
pub mod picture;
pub mod points;
pub mod solver;
pub mod survey;
