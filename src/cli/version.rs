//! `fissure --version`: versions of the program and its libraries, for bug reports.

use crate::cli::outln;
use fissure::comm::mpi;
use fissure::lanes::instructions::{BUILT, Instructions};
use fissure::output;

/// Print the versions of the program, MPI and HDF5. Also print the best instruction set of this machine, and
/// all instruction sets of this build.
pub fn print() {
    let best = Instructions::of_this_machine();
    let all = BUILT.join(", ");
    outln!("fissure {}", fissure::version());
    outln!("  MPI           {}", mpi::library());
    outln!("  HDF5          {}", output::library());
    let best = best.map_or("none", Instructions::name);
    outln!("  instructions  {best}, of {all}");
}
