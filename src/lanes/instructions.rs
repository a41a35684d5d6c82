//! Which vector instructions the loops over bonds use: the best that all ranks have, found at run
//! time.
//!
//! Between two kinds results differ in the last bits, see [`super::arithmetic`]; between
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

/// All of them, the least first.
pub const ALL: [Instructions; 3] = [
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
            Ok(name) if !name.is_empty() => Self::named(&name),
            _ => Ok(Self::Avx512),
        };
        let own = Self::of_this_machine().min(agree(comm, allowed)?);
        let mut level = [f64::from(own as u8)];
        comm::min(comm, &mut level);
        let best = ALL[level[0] as usize];
        if best < Self::Avx512 {
            return Ok(best);
        }
        // Makers are free in the estimates that roots start from.
        let estimates = estimates_of_roots();
        let mut extremes = [estimates, -estimates];
        comm.max(&mut extremes);
        Ok(match extremes[0] == -extremes[1] {
            true => Self::Avx512,
            false => Self::Avx2,
        })
    }

    fn named(name: &str) -> Result<Self> {
        let short = |instructions: Self| instructions.name().replace('-', "").to_lowercase();
        let wanted = name.replace('-', "").to_lowercase();
        let found = ALL.into_iter().find(|known| short(*known) == wanted);
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

    /// The best that this machine has.
    #[cfg(target_arch = "x86_64")]
    pub fn of_this_machine() -> Self {
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

    /// The best that this machine has.
    #[cfg(not(target_arch = "x86_64"))]
    pub fn of_this_machine() -> Self {
        Self::Baseline
    }
}

/// A number that is the same only where AVX-512 gives the same estimates of 1/√a; only on machines
/// that have it.
fn estimates_of_roots() -> f64 {
    #[cfg(target_arch = "x86_64")]
    {
        use crate::lanes::Lanes;
        use crate::lanes::arithmetic::estimate_of_inverse_sqrt;
        let mut hash = 0_u64;
        for k in 0..2048 {
            let a = Lanes(std::array::from_fn(|lane| {
                1.0 + f64::from(8 * k + lane as u32) * (3.0 / 16384.0)
            }));
            // SAFETY: the machine has AVX-512.
            let estimates = unsafe { estimate_of_inverse_sqrt(a) };
            for estimate in estimates.0 {
                hash = (hash ^ estimate.to_bits()).wrapping_mul(0x0000_0100_0000_01b3);
            }
        }
        (hash >> 12) as f64
    }
    #[cfg(not(target_arch = "x86_64"))]
    0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_the_variable() {
        assert_eq!(Instructions::named("avx512").unwrap(), Instructions::Avx512);
        assert_eq!(
            Instructions::named("AVX-512").unwrap(),
            Instructions::Avx512
        );
        assert_eq!(
            Instructions::named("baseline").unwrap(),
            Instructions::Baseline
        );
        let error = Instructions::named("sse").unwrap_err();
        assert!(error.message.contains("baseline, avx2, avx512"), "{error}");
    }
}
