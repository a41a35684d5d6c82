//! Fissure: a peridynamics solver for batch jobs on clusters.
pub mod comm;
pub mod component;
pub mod damage;
pub mod deck;
pub mod dimension;
pub mod elastic;
pub mod error;
pub mod expression;
pub mod families;
pub mod import;
pub mod lanes;
pub mod material;
pub mod memory;
pub mod mesh;
pub mod message;
pub mod output;
pub mod partition;
#[cfg(feature = "pictures")]
pub mod picture;
pub mod points;
pub mod problem;
pub mod refine;
pub mod run;
pub mod scatter;
pub mod solver;
pub mod survey;

pub use run::run;

/// Return the version. In a release build from a checkout or a published package, append the commit.
pub fn version() -> String {
    match option_env!("FISSURE_COMMIT") {
        Some(commit) => format!("{} (commit {commit})", env!("CARGO_PKG_VERSION")),
        None => env!("CARGO_PKG_VERSION").to_owned(),
    }
}
