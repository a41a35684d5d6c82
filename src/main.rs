//! The `fissure` command.

mod cli;

use std::process::ExitCode;

fn main() -> ExitCode {
    give_memory_back();
    cli::main()
}

/// Make the allocator return large arrays to the system as soon as they are freed. Otherwise, the memory of the
/// set-up, which is as large as that of the run, would stay allocated.
fn give_memory_back() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    // SAFETY: only sets a parameter of the allocator, before there is another thread.
    unsafe {
        libc::mallopt(libc::M_MMAP_THRESHOLD, 1 << 20);
    }
}
