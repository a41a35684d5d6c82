//! `fissure --version`: what this program is made of, for the reader of a bug report.

use crate::cli::say;
use fissure::comm::mpi;
use fissure::lanes::instructions::{BUILT, Instructions};
use fissure::output;

/// Prints version, libraries and vector instructions.
pub fn print() {
    let best = Instructions::of_this_machine();
    let all = BUILT.join(", ");
    say!("fissure {}", fissure::version());
    say!("  MPI           {}", mpi::library());
    say!("  HDF5          {}", output::library());
    let best = best.map_or("none", Instructions::name);
    say!("  instructions  {best}, of {all}");
}
