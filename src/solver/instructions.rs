//! Which vector instructions the loops over bonds use: the best that all ranks have, found at run
//! time.
//!
//! Between two kinds results differ in the last bits, see [`crate::material::arithmetic`]; between
//! ranks they never do.

use crate::comm::{self, Communicator, agree};
use crate::error::{Error, Result};

/// Sets of vector instructions, each with all that come before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Instructions {
    /// Those that the program was built for.
    Baseline,
    /// AVX2 with fused multiplication and addition.
    Avx2,
    /// AVX-512.
    Avx512,
}

/// The environment variable that names the most to use: for machines of several kinds that are to
/// come to the same bits.
pub const VARIABLE: &str = "FISSURE_INSTRUCTIONS";

const ALL: [Instructions; 3] = [
    Instructions::Baseline,
    Instructions::Avx2,
    Instructions::Avx512,
];

impl Instructions {
    /// The best that all ranks have, or the most that [`VARIABLE`] allows; collective.
    ///
    /// # Errors
    /// When the variable names none; the same on all ranks.
    pub fn of_all(comm: &dyn Communicator) -> Result<Self> {
        let allowed = match std::env::var(VARIABLE) {
            Err(_) => Ok(Self::Avx512),
            Ok(name) => Self::named(&name),
        };
        let own = Self::of_this_machine().min(agree(comm, allowed)?);
        let mut level = [f64::from(own as u8)];
        comm::min(comm, &mut level);
        Ok(ALL[level[0] as usize])
    }

    fn named(name: &str) -> Result<Self> {
        let short = |instructions: Self| instructions.name().replace('-', "").to_lowercase();
        let found = ALL.into_iter().find(|known| short(*known) == name);
        found.ok_or_else(|| {
            let known = ALL.map(short).join(", ");
            Error::input(format!("{VARIABLE}: `{name}` is none of {known}"))
        })
    }

    /// Its name, as a summary shows it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Baseline => "baseline",
            Self::Avx2 => "AVX2",
            Self::Avx512 => "AVX-512",
        }
    }

    #[cfg(target_arch = "x86_64")]
    fn of_this_machine() -> Self {
        let avx2 = is_x86_feature_detected!("avx2")
            && is_x86_feature_detected!("bmi2")
            && is_x86_feature_detected!("fma");
        let avx512 = is_x86_feature_detected!("avx512f")
            && is_x86_feature_detected!("avx512dq")
            && is_x86_feature_detected!("avx512vl")
            && is_x86_feature_detected!("avx512bw");
        match (avx2, avx512) {
            (true, true) => Self::Avx512,
            (true, false) => Self::Avx2,
            _ => Self::Baseline,
        }
    }

    #[cfg(not(target_arch = "x86_64"))]
    fn of_this_machine() -> Self {
        Self::Baseline
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_the_variable() {
        assert_eq!(Instructions::named("avx512").unwrap(), Instructions::Avx512);
        assert_eq!(
            Instructions::named("baseline").unwrap(),
            Instructions::Baseline
        );
        let error = Instructions::named("sse").unwrap_err();
        assert!(error.message.contains("baseline, avx2, avx512"), "{error}");
    }
}
