//! Instruction sets of the loops over bonds. The best set that all ranks have is selected at run time.
//!
//! All sets round each multiply-add once and give bitwise the same results, see [`super::simd`].

use crate::comm::{self, Communicator, agree};
use crate::error::{Error, Result};

#[cfg(target_arch = "x86_64")]
use super::simd::{Avx2, Avx512};

/// An instruction set that this machine has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Instructions {
    /// Instruction set for which the program was built.
    #[cfg(not(target_arch = "x86_64"))]
    Portable,
    /// AVX2 with fused multiply-add.
    #[cfg(target_arch = "x86_64")]
    Avx2(Avx2),
    /// AVX-512.
    #[cfg(target_arch = "x86_64")]
    Avx512(Avx512),
}

/// Environment variable for tests. Its value is the name of the largest instruction set that may be used.
pub const VARIABLE: &str = "FISSURE_INSTRUCTIONS";

/// Names of the instruction sets that the program was built for, from the smallest to the largest.
pub const BUILT: &[&str] = if cfg!(target_arch = "x86_64") {
    &["AVX2", "AVX-512"]
} else if cfg!(target_arch = "aarch64") {
    &["NEON"]
} else {
    &["portable"]
};

impl Instructions {
    /// Select the largest set that all ranks have, limited by [`VARIABLE`]. Collective.
    ///
    /// # Errors
    /// If [`VARIABLE`] is not empty and its value does not name an instruction set in [`BUILT`]. If a rank
    /// has none of these instruction sets. The error is the same on all ranks.
    pub fn of_all(comm: &dyn Communicator) -> Result<Self> {
        let allowed = match std::env::var(VARIABLE) {
            Ok(name) if !name.is_empty() => named(&name),
            _ => Ok(BUILT.len() - 1),
        };
        let own = allowed.and_then(|allowed| Self::up_to(allowed).ok_or_else(unsupported));
        let own = agree(comm, own)?;
        let mut level = [own.level() as f64];
        comm::min(comm, &mut level);
        Self::up_to(level[0] as usize).ok_or_else(unsupported)
    }

    /// Return the largest set that this machine has; `None` if the machine has none of the sets.
    pub fn of_this_machine() -> Option<Self> {
        Self::up_to(BUILT.len() - 1)
    }

    /// Return the largest set that this machine has, of the sets up to index `level` in [`BUILT`]; `None` if
    /// the machine has none of these sets.
    #[cfg(target_arch = "x86_64")]
    fn up_to(level: usize) -> Option<Self> {
        match Avx512::detect() {
            Some(avx512) if level >= 1 => Some(Self::Avx512(avx512)),
            _ => Avx2::detect().map(Self::Avx2),
        }
    }

    /// Return the only set of this machine.
    #[cfg(not(target_arch = "x86_64"))]
    fn up_to(_: usize) -> Option<Self> {
        Some(Self::Portable)
    }

    /// Return the index of the set in [`BUILT`].
    fn level(self) -> usize {
        match self {
            #[cfg(not(target_arch = "x86_64"))]
            Self::Portable => 0,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(_) => 0,
            #[cfg(target_arch = "x86_64")]
            Self::Avx512(_) => 1,
        }
    }

    /// Return the name of the set, as printed in the summary.
    pub fn name(self) -> &'static str {
        BUILT[self.level()]
    }
}

fn unsupported() -> Error {
    Error::run(
        "this processor has no AVX2 and FMA instructions; Fissure needs them (x86-64 processors since 2015 have them)",
    )
}

/// Return the index in [`BUILT`] of the instruction set with this name. Hyphens and case are ignored.
///
/// # Errors
/// If no set has this name.
fn named(name: &str) -> Result<usize> {
    let short = |name: &str| name.replace('-', "").to_lowercase();
    let found = BUILT.iter().position(|known| short(known) == short(name));
    found.ok_or_else(|| {
        let known: Vec<String> = BUILT.iter().map(|name| short(name)).collect();
        Error::input(format!(
            "{VARIABLE}: `{name}` is none of {}",
            known.join(", ")
        ))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_the_variable() {
        for (level, name) in BUILT.iter().enumerate() {
            assert_eq!(named(name).unwrap(), level);
            assert_eq!(named(&name.replace('-', "").to_lowercase()).unwrap(), level);
        }
        let error = named("sse").unwrap_err();
        assert!(error.message.contains("`sse` is none of"), "{error}");
    }
}
