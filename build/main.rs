//! Build script: check that HDF5 uses the linked MPI, and record the commit.

mod commit;
mod one_mpi;

fn main() {
    println!("cargo::rerun-if-changed=build");
    for name in [
        "MPICC",
        "MPI_PKG_CONFIG",
        "CRAY_MPICH_DIR",
        "HDF5_DIR",
        "PKG_CONFIG_PATH",
    ] {
        println!("cargo::rerun-if-env-changed={name}");
    }
    println!("cargo::rustc-check-cfg=cfg(open_mpi)");
    commit::set_environment();
    match one_mpi::check() {
        Ok(mpi) => {
            if mpi.is_open_mpi {
                println!("cargo::rustc-cfg=open_mpi");
            }
        }
        Err(message) => {
            for line in message.lines() {
                println!("cargo::error={line}");
            }
        }
    }
}
