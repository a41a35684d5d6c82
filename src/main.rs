//! The `fissure` command.

mod cli;

use std::process::ExitCode;

fn main() -> ExitCode {
    give_memory_back();
    cli::main()
}

/// Return large arrays to the system as soon as they are freed, because the arrays of the set-up are as large as those
/// of the run.
fn give_memory_back() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    // SAFETY: only sets a parameter of the allocator, before there is another thread.
    unsafe {
        libc::mallopt(libc::M_MMAP_THRESHOLD, 1 << 20);
    }
}
