//! Material laws, one a file. A law knows one bond, eight at a time, and nothing of decks, points,
//! ranks or state.
//!
//! The force density that a bond exerts on point i is f = T_i⟨ξ⟩ − T_j⟨−ξ⟩ (Silling et al. 2007). All
//! laws here have force states along the bond, so each end contributes a number. It depends on the
//! bond and on at most two numbers of the end's whole family: a *constant*, found once, and a *state*,
//! found anew before each sum of forces.

mod any;
pub mod arithmetic;
mod influence;
pub mod lanes;
mod linear_microelastic;
mod normalised;
mod ordinary;
mod pmb;

pub use any::AnyLaw;
pub use arithmetic::Arithmetic;
pub use influence::Influence;
pub use lanes::Lanes;
pub use linear_microelastic::LinearMicroelastic;
pub use normalised::Normalised;
pub use ordinary::Ordinary;
pub use pmb::Pmb;

/// Eight bonds.
#[derive(Debug, Clone, Copy)]
pub struct Bond {
    /// |ξ|, m.
    pub length: Lanes,
    /// s = (|Y| − |ξ|)/|ξ|; for linear laws ξ·η/|ξ|².
    pub stretch: Lanes,
}

/// What an end of eight bonds knows of its family.
#[derive(Debug, Clone, Copy)]
pub struct End {
    /// [`Law::constant`] of the point, 0 if the law has none.
    pub constant: Lanes,
    /// [`Law::state`] of the point, 0 if the law has none.
    pub state: Lanes,
}

/// A law with force states along the bond.
///
/// The loops multiply what is summed by Ṽ and by the influence, neither of which the law sees.
pub trait Law: Copy + Send + Sync {
    /// Whether bonds need the constants of their ends.
    const CONSTANT: bool = false;

    /// Whether bonds need the states of their ends.
    const STATE: bool = false;

    /// Whether forces act along ξ and are linear in η; else they act along Y.
    const LINEAR: bool = false;

    /// Whether [`Self::toughness_scale`] is not 1.
    const SCALED: bool = false;

    /// What a bond adds to the sum that gives a point's constant.
    #[inline(always)]
    fn constant_share(&self, _length: Lanes) -> Lanes {
        Lanes::splat(0.0)
    }

    /// The constant of a point from the sum over its whole family.
    #[inline(always)]
    fn constant(&self, _sum: f64) -> f64 {
        0.0
    }

    /// What an intact bond adds to the sum that gives a point's state.
    #[inline(always)]
    fn state_share(&self, _bond: &Bond) -> Lanes {
        Lanes::splat(0.0)
    }

    /// The state of a point from the sum over its intact bonds and its constant.
    #[inline(always)]
    fn state(&self, _sum: f64, _constant: f64) -> f64 {
        0.0
    }

    /// The force state T of one end, N/m⁶; positive pulls the ends together.
    fn force(&self, bond: &Bond, end: &End) -> Lanes;

    /// What a bond adds to the strain energy density of one end, J/m⁶.
    fn bond_energy(&self, bond: &Bond, end: &End) -> Lanes;

    /// The part of a point's strain energy density (J/m³) that belongs to no single bond, from the
    /// sum of the state and the constant.
    #[inline(always)]
    fn point_energy(&self, _sum: f64, _constant: f64) -> f64 {
        0.0
    }

    /// A spring constant (N/m⁷) that the bond's and point's energy at one end nowhere exceed:
    /// W ≤ ½ Σ k (|Y| − |ξ|)² Ṽ. For bond-based laws |∂T/∂η|.
    fn stiffness(&self, length: Lanes, end: &End) -> Lanes;

    /// What the critical stretch of a bond is multiplied by; the same from both ends.
    #[inline(always)]
    fn toughness_scale(&self, _here: &End, _other: &Self, _there: &End) -> Lanes {
        Lanes::splat(1.0)
    }
}
