//! A law that is one of several: for the bonds between blocks of different laws, and for what is done
//! once a point.

use super::{Bond, End, Lanes, Law, LinearMicroelastic, Normalised, Ordinary, Pmb};

/// One of the laws.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum AnyLaw {
    /// Prototype or proportional microelastic.
    Pmb(Pmb),
    /// With a micromodulus for each point.
    Normalised(Normalised),
    /// Linear microelastic.
    LinearMicroelastic(LinearMicroelastic),
    /// Ordinary state-based.
    Ordinary(Ordinary),
}

/// Asks whichever law it is.
macro_rules! ask {
    ($any:expr, $law:ident => $answer:expr) => {
        match $any {
            AnyLaw::Pmb($law) => $answer,
            AnyLaw::Normalised($law) => $answer,
            AnyLaw::LinearMicroelastic($law) => $answer,
            AnyLaw::Ordinary($law) => $answer,
        }
    };
}

impl AnyLaw {
    /// [`Law::CONSTANT`] of the law that it is.
    pub fn has_constant(&self) -> bool {
        fn of<L: Law>(_: &L) -> bool {
            L::CONSTANT
        }
        ask!(self, law => of(law))
    }

    /// [`Law::STATE`] of the law that it is.
    pub fn has_state(&self) -> bool {
        fn of<L: Law>(_: &L) -> bool {
            L::STATE
        }
        ask!(self, law => of(law))
    }
}

/// Forces along Y: bonds of linear laws meet no others.
impl Law for AnyLaw {
    const CONSTANT: bool = true;
    const STATE: bool = true;
    const SCALED: bool = true;

    #[inline(always)]
    fn constant_share(&self, length: Lanes) -> Lanes {
        ask!(self, law => law.constant_share(length))
    }

    #[inline(always)]
    fn constant(&self, sum: f64) -> f64 {
        ask!(self, law => law.constant(sum))
    }

    #[inline(always)]
    fn state_share(&self, bond: &Bond) -> Lanes {
        ask!(self, law => law.state_share(bond))
    }

    #[inline(always)]
    fn state(&self, sum: f64, constant: f64) -> f64 {
        ask!(self, law => law.state(sum, constant))
    }

    #[inline(always)]
    fn force(&self, bond: &Bond, end: &End) -> Lanes {
        ask!(self, law => law.force(bond, end))
    }

    #[inline(always)]
    fn bond_energy(&self, bond: &Bond, end: &End) -> Lanes {
        ask!(self, law => law.bond_energy(bond, end))
    }

    #[inline(always)]
    fn point_energy(&self, sum: f64, constant: f64) -> f64 {
        ask!(self, law => law.point_energy(sum, constant))
    }

    #[inline(always)]
    fn stiffness(&self, length: Lanes, end: &End) -> Lanes {
        ask!(self, law => law.stiffness(length, end))
    }

    #[inline(always)]
    fn toughness_scale(&self, here: &End, other: &Self, there: &End) -> Lanes {
        match (self, other) {
            (Self::Normalised(law), Self::Normalised(other)) => {
                law.toughness_scale(here, other, there)
            }
            _ => Lanes::splat(1.0),
        }
    }
}
