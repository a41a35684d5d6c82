//! For which vector instructions a loop is compiled.

/// The versions of a loop. AVX-512 and AVX2 give the same bits; the one for any processor does so only where every
/// processor of the kind fuses multiply-adds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Versions {
    /// AVX-512, AVX2 and any processor.
    Each,
    /// AVX2, which is not much slower, and any processor.
    Avx2,
    /// Any processor, and nowhere fused multiply-adds, so that the bits are the same everywhere.
    One,
}

impl Versions {
    /// Whether there is one for each set of instructions.
    pub const fn is_each(self) -> bool {
        matches!(self, Self::Each)
    }

    /// Whether there is one only.
    pub const fn is_one(self) -> bool {
        matches!(self, Self::One)
    }
}
