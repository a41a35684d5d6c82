//! `fissure --version`: versions of program and libraries, for bug reports.

use crate::cli::outln;
use fissure::comm::mpi;
use fissure::lanes::instructions::{BUILT, Instructions};
use fissure::output;

/// Print the versions of program and libraries, and the instruction sets.
pub fn print() {
    let best = Instructions::of_this_machine();
    let all = BUILT.join(", ");
    outln!("fissure {}", fissure::version());
    outln!("  MPI           {}", mpi::library());
    outln!("  HDF5          {}", output::library());
    let best = best.map_or("none", Instructions::name);
    outln!("  instructions  {best}, of {all}");
}
