//! Material laws, one a file. A law knows one bond, eight at a time, and nothing of decks, points,
//! ranks or state.

pub mod lanes;
mod pmb;

pub use lanes::Lanes;
pub use pmb::Pmb;

/// Eight bonds of the reference lengths |ξ| and the stretches s = (|Y| − |ξ|)/|ξ|.
#[derive(Debug, Clone, Copy)]
pub struct Bond {
    /// |ξ|, m.
    pub length: Lanes,
    /// s.
    pub stretch: Lanes,
}

/// A bond-based law: a force along the deformed bond that depends on the bond alone.
pub trait BondLaw: Copy + Sync {
    /// Pairwise force density f, N/m⁶; positive pulls the ends together.
    fn force(&self, bond: &Bond) -> Lanes;

    /// Pairwise potential w, N/m⁵, so that f = ∂w/∂|Y|.
    fn energy(&self, bond: &Bond) -> Lanes;

    /// Stiffness |∂f/∂η| of the undeformed bond, N/m⁷.
    fn stiffness(&self, length: Lanes) -> Lanes;

    /// The law of a bond between two blocks.
    fn between(&self, other: &Self) -> Self;
}
