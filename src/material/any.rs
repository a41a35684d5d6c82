//! The list of all laws, and laws that are one of several: for what is done once a point, and for the
//! bonds between blocks of different laws.

use super::{
    Bond, Described, ElasticPlasticPmb, ForceState, Law, LinearMicroelastic, Normalised, Ordinary,
    Pmb,
};
use crate::lanes::{Lanes, Numbers};

/// Makes the enums of laws, and the macros that run code for whichever law it is, from the list of
/// laws. `$` stands first because the macros that are made need it.
macro_rules! register {
    ($d:tt $($(#[$doc:meta])* $law:ident),+ $(,)?) => {
        /// One of the laws.
        #[derive(Debug, Clone, Copy, PartialEq)]
        pub enum AnyLaw {
            $($(#[$doc])* $law($law),)+
        }

        /// The laws of the own and of the far end of bonds.
        #[derive(Debug, Clone, Copy)]
        pub enum PairLaw {
            $($(#[$doc])* $law([$law; 2]),)+
            /// Different laws at the two ends.
            Mixed([AnyLaw; 2]),
        }

        impl PairLaw {
            /// From the laws of the own and of the far end.
            pub fn new(here: AnyLaw, there: AnyLaw) -> Self {
                match (here, there) {
                    $((AnyLaw::$law(here), AnyLaw::$law(there)) => Self::$law([here, there]),)+
                    _ => Self::Mixed([here, there]),
                }
            }
        }

        /// Runs code for whichever law an [`AnyLaw`] is; compiled for each.
        macro_rules! with_law {
            ($d any:expr, $d law_name:ident => $d body:expr) => {
                match $d any {
                    $($crate::material::AnyLaw::$law($d law_name) => $d body,)+
                }
            };
        }

        /// Runs code for whichever laws a [`PairLaw`] has; compiled for each.
        macro_rules! with_pair {
            ($d pair:expr, $d laws:ident => $d body:expr) => {
                match $d pair {
                    $($crate::material::PairLaw::$law($d laws) => $d body,)+
                    $crate::material::PairLaw::Mixed($d laws) => $d body,
                }
            };
        }

        const COUNTS: &[Counts] = &[$(Counts::of::<$law, 3>()),+];
    };
}

register! {
    $
    /// Prototype or proportional microelastic.
    Pmb,
    /// Prototype microelastic up to a yield stretch.
    ElasticPlasticPmb,
    /// With a micromodulus for each point.
    Normalised,
    /// Linear microelastic.
    LinearMicroelastic,
    /// Ordinary state-based.
    Ordinary,
}
pub(crate) use {with_law, with_pair};

/// How many numbers of each kind the points and bonds of a law have.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Counts {
    /// [`Law::CONSTANTS`].
    pub constants: usize,
    /// [`Law::Point`].
    pub point: usize,
    /// [`Law::OWN_NUMBERS`].
    pub own: usize,
    /// [`Law::STAGES`].
    pub stages: usize,
    /// [`Law::WholeSum`].
    pub whole_sum: usize,
    /// [`Law::Sum`].
    pub sum: usize,
    /// [`Law::Memory`].
    pub memory: usize,
}

impl Counts {
    const fn of<L: Law<D>, const D: usize>() -> Self {
        Self {
            constants: L::CONSTANTS,
            point: L::Point::COUNT,
            own: L::OWN_NUMBERS,
            stages: L::STAGES,
            whole_sum: L::WholeSum::COUNT,
            sum: L::Sum::COUNT,
            memory: L::Memory::COUNT,
        }
    }

    /// The larger of each.
    const fn or_more(self, other: Self) -> Self {
        const fn more(a: usize, b: usize) -> usize {
            if a > b { a } else { b }
        }
        Self {
            constants: more(self.constants, other.constants),
            point: more(self.point, other.point),
            own: more(self.own, other.own),
            stages: more(self.stages, other.stages),
            whole_sum: more(self.whole_sum, other.whole_sum),
            sum: more(self.sum, other.sum),
            memory: more(self.memory, other.memory),
        }
    }
}

/// The most that any law has: in three dimensions.
pub const MOST: Counts = {
    let mut most = COUNTS[0];
    let mut k = 1;
    while k < COUNTS.len() {
        most = most.or_more(COUNTS[k]);
        k += 1;
    }
    most
};

/// The first of some numbers.
#[inline(always)]
fn first<A: Numbers, B: Numbers>(all: &A) -> B {
    B::each(|k| all.get(k))
}

/// Some numbers, and zeros after them.
#[inline(always)]
fn filled_up<A: Numbers, B: Numbers>(some: A) -> B {
    B::each(|k| {
        if k < A::COUNT {
            some.get(k)
        } else {
            Lanes::splat(0.0)
        }
    })
}

impl AnyLaw {
    /// [`Described::described`] of the law that it is.
    pub fn described(&self) -> Vec<(&'static str, String)> {
        with_law!(self, law => law.described())
    }

    /// How many numbers the law has in `D` dimensions.
    pub fn counts<const D: usize>(&self) -> Counts {
        fn of<L: Law<D>, const D: usize>(_: &L) -> Counts {
            Counts::of::<L, D>()
        }
        with_law!(self, law => of::<_, D>(law))
    }
}

/// Bonds of linear laws meet no others, so these are bonds of the deformed body.
impl<const D: usize> Law<D> for AnyLaw {
    type Point = [Lanes; MOST.point];
    type Memory = [Lanes; MOST.memory];
    type WholeSum = [Lanes; MOST.whole_sum];
    type Sum = [Lanes; MOST.sum];
    type Force = [Lanes; D];
    const HOT: bool = false;
    const STAGES: usize = MOST.stages;
    const OWN_NUMBERS: usize = MOST.own;
    const FORCE_READS_STRETCH: bool = true;
    const SCALED: bool = true;

    #[inline(always)]
    fn whole_share(&self, length: Lanes) -> Self::WholeSum {
        with_law!(self, law => filled_up(Law::<D>::whole_share(law, length)))
    }

    fn constants(&self, sums: &[f64], numbers: &mut [f64]) {
        with_law!(self, law => Law::<D>::constants(law, sums, numbers));
    }

    #[inline(always)]
    fn share<const S: usize>(&self, bond: &Bond<D>, own: &Self::Point) -> Self::Sum {
        with_law!(self, law => filled_up(law.share::<S>(bond, &first(own))))
    }

    #[inline(always)]
    fn point(&self, stage: usize, sums: &[f64], numbers: &mut [f64]) {
        with_law!(self, law => Law::<D>::point(law, stage, sums, numbers));
    }

    #[inline(always)]
    fn memory(&self, bond: &Bond<D>, end: &Self::Point, before: &Self::Memory) -> Self::Memory {
        with_law!(self, law => filled_up(law.memory(bond, &first(end), &first(before))))
    }

    #[inline(always)]
    fn force(&self, bond: &Bond<D>, end: &Self::Point, memory: &Self::Memory) -> [Lanes; D] {
        with_law!(self, law => law.force(bond, &first(end), &first(memory)).vector(bond))
    }

    #[inline(always)]
    fn bond_energy(&self, bond: &Bond<D>, end: &Self::Point, memory: &Self::Memory) -> Lanes {
        with_law!(self, law => law.bond_energy(bond, &first(end), &first(memory)))
    }

    fn point_energy(&self, numbers: &[f64]) -> f64 {
        with_law!(self, law => Law::<D>::point_energy(law, numbers))
    }

    #[inline(always)]
    fn dissipated(&self, length: Lanes, memory: &Self::Memory) -> Lanes {
        with_law!(self, law => Law::<D>::dissipated(law, length, &first(memory)))
    }

    #[inline(always)]
    fn stiffness(&self, length: Lanes, end: &Self::Point) -> Lanes {
        with_law!(self, law => Law::<D>::stiffness(law, length, &first(end)))
    }

    #[inline(always)]
    fn toughness_scale(&self, here: &Self::Point, other: &Self, there: &Self::Point) -> Lanes {
        if let (Self::Normalised(law), Self::Normalised(other)) = (self, other) {
            return Law::<D>::toughness_scale(law, &first(here), other, &first(there));
        }
        Lanes::splat(1.0)
    }
}
