//! Which vector instructions the loops over bonds use: the best that all ranks have, found at run
//! time.
//!
//! Between two kinds results differ in the last bits, see [`crate::material::arithmetic`]; between
//! ranks they never do.

use crate::comm::{self, Communicator};

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

impl Instructions {
    /// The best that all ranks have; collective.
    pub fn of_all(comm: &dyn Communicator) -> Self {
        let mut level = [f64::from(Self::of_this_machine() as u8)];
        comm::min(comm, &mut level);
        let all = [Self::Baseline, Self::Avx2, Self::Avx512];
        all[level[0] as usize]
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
