//! Which vector instructions the loops over bonds use: the best that all ranks have, found at run
//! time.
//!
//! All kinds that round products and sums once give the same bits, see [`super::simd`]. A machine
//! without them is the exception; between the ranks of a run there is never a difference.

use crate::comm::{self, Communicator, agree};
use crate::error::{Error, Result};

use super::simd::FUSED;
#[cfg(target_arch = "x86_64")]
use super::simd::{Avx2, Avx512};

/// Sets of vector instructions that this machine has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Instructions {
    /// Those that the program was built for.
    Baseline,
    /// AVX2 with fused multiplication and addition.
    #[cfg(target_arch = "x86_64")]
    Avx2(Avx2),
    /// AVX-512.
    #[cfg(target_arch = "x86_64")]
    Avx512(Avx512),
}

/// The environment variable that names the most to use, for tests.
pub const VARIABLE: &str = "FISSURE_INSTRUCTIONS";

/// Names of the sets in the order of what they can, as [`VARIABLE`] has them on all processors.
const NAMES: [&str; 3] = ["baseline", "AVX2", "AVX-512"];

/// Names of the sets that the program was built for, in that order.
pub const BUILT: &[&str] = if cfg!(target_arch = "x86_64") {
    &NAMES
} else if cfg!(target_arch = "aarch64") {
    &["NEON"]
} else {
    &["baseline"]
};

impl Instructions {
    /// The best that all ranks have, or the most that [`VARIABLE`] allows; collective.
    ///
    /// # Errors
    /// When the variable names none; the same on all ranks.
    pub fn of_all(comm: &dyn Communicator) -> Result<Self> {
        let allowed = match std::env::var(VARIABLE) {
            Ok(name) if !name.is_empty() => named(&name),
            _ => Ok(NAMES.len() - 1),
        };
        let allowed = agree(comm, allowed)?;
        let own = Self::up_to(allowed);
        let mut level = [own.level() as f64];
        comm::min(comm, &mut level);
        Ok(Self::up_to(level[0] as usize))
    }

    /// The best that this machine has.
    pub fn of_this_machine() -> Self {
        Self::up_to(NAMES.len() - 1)
    }

    /// The best of this machine up to a level.
    #[cfg(target_arch = "x86_64")]
    fn up_to(level: usize) -> Self {
        match (Avx512::detect(), Avx2::detect()) {
            (Some(avx512), _) if level >= 2 => Self::Avx512(avx512),
            (_, Some(avx2)) if level >= 1 => Self::Avx2(avx2),
            _ => Self::Baseline,
        }
    }

    /// The best of this machine.
    #[cfg(not(target_arch = "x86_64"))]
    fn up_to(_: usize) -> Self {
        Self::Baseline
    }

    fn level(self) -> usize {
        match self {
            Self::Baseline => 0,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(_) => 1,
            #[cfg(target_arch = "x86_64")]
            Self::Avx512(_) => 2,
        }
    }

    /// Its name, as a summary shows it.
    pub fn name(self) -> &'static str {
        BUILT[self.level()]
    }

    /// How a product and a sum are rounded, in a word: "fused", once, or "unfused", twice.
    pub fn rounding(self) -> &'static str {
        if self.are_fused() { "fused" } else { "unfused" }
    }

    /// Whether products and sums are rounded once, so that results have the bits of all other
    /// machines that do so.
    pub fn are_fused(self) -> bool {
        self.level() > 0 || FUSED
    }
}

/// The level of a name.
fn named(name: &str) -> Result<usize> {
    let short = |name: &str| name.replace('-', "").to_lowercase();
    let found = NAMES.iter().position(|known| short(known) == short(name));
    found.ok_or_else(|| {
        let known = NAMES.map(short).join(", ");
        Error::input(format!("{VARIABLE}: `{name}` is none of {known}"))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_the_variable() {
        assert_eq!(named("avx512").unwrap(), 2);
        assert_eq!(named("AVX-512").unwrap(), 2);
        assert_eq!(named("baseline").unwrap(), 0);
        let error = named("sse").unwrap_err();
        assert!(error.message.contains("baseline, avx2, avx512"), "{error}");
    }
}
