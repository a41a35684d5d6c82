//! For which vector instructions a loop is compiled.

/// The versions of a loop on x86-64; other processors have one. All give the same bits.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum IsaSet {
    /// AVX-512 and AVX2.
    Each,
    /// AVX2, which is not much slower.
    Avx2,
    /// No vector instructions and no fused multiply-adds.
    One,
}

impl IsaSet {
    /// Whether there is one for each set of instructions.
    pub const fn is_each(self) -> bool {
        matches!(self, Self::Each)
    }

    /// Whether there is one only.
    pub const fn is_one(self) -> bool {
        matches!(self, Self::One)
    }
}
