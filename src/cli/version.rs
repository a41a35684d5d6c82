//! `fissure --version`: what this program is made of, for the reader of a bug report.

use crate::cli::outln;
use fissure::comm::mpi;
use fissure::lanes::instructions::{BUILT, Instructions};
use fissure::output;

/// Prints version, libraries and vector instructions.
pub fn print() {
    let best = Instructions::of_this_machine();
    let all = BUILT.join(", ");
    outln!("fissure {}", fissure::version());
    outln!("  MPI           {}", mpi::library());
    outln!("  HDF5          {}", output::library());
    let best = best.map_or("none", Instructions::name);
    outln!("  instructions  {best}, of {all}");
}
