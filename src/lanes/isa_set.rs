//! Instruction sets for which a loop is compiled.

/// The compiled versions of a loop on x86-64; other processors have one version. All versions of a loop give
/// bitwise the same results.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum IsaSet {
    /// AVX-512 and AVX2.
    Each,
    /// AVX2 only, for loops that AVX-512 would hardly accelerate.
    Avx2,
    /// One version without fused multiply-adds. It runs on any processor of the target architecture.
    One,
}

impl IsaSet {
    /// Test whether there is a version for each instruction set.
    pub const fn is_each(self) -> bool {
        matches!(self, Self::Each)
    }

    /// Test whether the loop is compiled once, for any processor of the target ([`Self::One`]).
    pub const fn is_one(self) -> bool {
        matches!(self, Self::One)
    }
}
