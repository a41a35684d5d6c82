//! Fatigue of microelastic bonds: f = c s Y/|Y| with the micromodulus c, until the remaining life λ of the
//! bond is used up.
//!
//! Silling & Askari 2014, SAND2014-18590. In a cyclic load with the load ratio R, a bond has the stretch s at
//! the largest load and R s at the smallest load. If at least one of these two stretches is positive, the
//! cyclic strain of the bond is ε = (1 − R) |s|; otherwise ε is 0. The remaining life λ begins at 1 and
//! decreases with the number N of cycles:
//!
//! dλ/dN = −A (ε − ε∞)^m for ε > ε∞, otherwise 0.
//!
//! A, m and the fatigue limit ε∞ are constants of the law. The bond breaks when λ reaches 0. If the cyclic
//! strain is constant, the bond breaks after 1/(A (ε − ε∞)^m) cycles. With ε∞ = 0, a crack of length a grows
//! by da/dN ∝ ΔK^m, with the range ΔK of the stress intensity factor.
//!
//! The law stores the used life 1 − λ. The number of cycles in a time step is the length of the step times
//! [`FatiguePmb::cycles_per_second`]. For all these cycles, s is the stretch of the bond at the end of the
//! step. λ does not change the force of an intact bond.
//!
//! The law of SAND2014-18590 has separate constants A and m for the nucleation of cracks (phase I) and for
//! their growth (phase II). This law has one pair of constants for both phases.

use super::bond::Weights;
use super::declaration::bond_based_critical_stretch;
use super::{
    Along, Bond, Built, Declaration, Declared, Described, Given, Key, Kind, Law, Pmb, Property,
};
use crate::lanes::{IsaSet, Lanes, Simd};

/// The constants of the law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FatiguePmb {
    /// The elastic part.
    pub elastic: Pmb,
    /// Number of cycles per second, 1/s.
    pub cycles_per_second: f64,
    /// Load ratio R: smallest load divided by largest load of a cycle.
    pub load_ratio: f64,
    /// Factor A in dλ/dN.
    pub coefficient: f64,
    /// Exponent m in dλ/dN.
    pub exponent: f64,
    /// Cyclic strain ε∞ up to which bonds have infinite life.
    pub limit: f64,
}

const CYCLES_PER_SECOND: Key = Key {
    name: "cycles_per_second",
    meaning: "number of load cycles per unit of the time t, 1/s",
    kind: Kind::POSITIVE,
};

const LOAD_RATIO: Key = Key {
    name: "load_ratio",
    meaning: "load ratio R, the smallest load of a cycle divided by the largest load",
    kind: Kind::Number {
        range: f64::MIN..1.0,
        words: "below 1",
        default: Some(0.0),
    },
};

const FATIGUE_COEFFICIENT: Key = Key {
    name: "fatigue_coefficient",
    meaning: "factor A in the life 1/(A (ε − ε∞)^m) of a bond, in cycles",
    kind: Kind::POSITIVE,
};

const FATIGUE_EXPONENT: Key = Key {
    name: "fatigue_exponent",
    meaning: "exponent m in the life 1/(A (ε − ε∞)^m) of a bond",
    kind: Kind::POSITIVE,
};

const FATIGUE_LIMIT: Key = Key {
    name: "fatigue_limit",
    meaning: "cyclic strain ε∞ up to which a bond has infinite life",
    kind: Kind::Number {
        range: 0.0..f64::INFINITY,
        words: "at least 0",
        default: Some(0.0),
    },
};

impl Declared for FatiguePmb {
    const DECLARATIONS: &'static [Declaration] = &[Declaration {
        keys: &[
            CYCLES_PER_SECOND,
            LOAD_RATIO,
            FATIGUE_COEFFICIENT,
            FATIGUE_EXPONENT,
            FATIGUE_LIMIT,
        ],
        breaks_by_energy: true,
        critical_stretch: Some(bond_based_critical_stretch),
        wears_out: true,
        examples: &[
            "cycles_per_second = 10, fatigue_coefficient = 1e4, fatigue_exponent = 2",
            "cycles_per_second = 10, fatigue_coefficient = 1e3, fatigue_exponent = 1.5, \
             fatigue_limit = 0.01, load_ratio = -0.5",
        ],
        ..Declaration::new(
            "fatigue_pmb",
            "f = c s e; a bond with the cyclic strain ε = (1 − R) |s| also breaks after \
             1/(A (ε − ε∞)^m) load cycles",
            build,
        )
    }];
}

fn build(given: &Given) -> Built {
    let number = |key: &Key| given.values.number(key.name);
    Built::plain(FatiguePmb {
        elastic: Pmb::of(given),
        cycles_per_second: number(&CYCLES_PER_SECOND),
        load_ratio: number(&LOAD_RATIO),
        coefficient: number(&FATIGUE_COEFFICIENT),
        exponent: number(&FATIGUE_EXPONENT),
        limit: number(&FATIGUE_LIMIT),
    })
}

impl Described for FatiguePmb {
    fn described(&self) -> Vec<(&'static str, Property)> {
        let mut facts = self.elastic.described();
        let cycles = Property::Number(self.cycles_per_second, "1/s");
        facts.push(("cycles per second", cycles));
        for (name, value) in [
            ("load ratio", self.load_ratio),
            ("fatigue coefficient", self.coefficient),
            ("fatigue exponent", self.exponent),
            ("fatigue limit", self.limit),
        ] {
            facts.push((name, Property::Number(value, "")));
        }
        facts
    }
}

impl<const D: usize> Law<D> for FatiguePmb {
    type Point = [Lanes; 0];
    /// Used life 1 − λ.
    type BondHistory = [Lanes; 1];
    type ReferenceSum = [Lanes; 0];
    type Sum = [Lanes; 0];
    type Force = Along;
    const ISA_SET: IsaSet = IsaSet::Avx2;
    const FORCE_READS_STRETCH: bool = true;
    const FORCE_READS_HISTORY: bool = false;
    const WEARS_OUT: bool = true;

    #[inline(always)]
    fn bond_history(
        &self,
        bond: &Bond<D>,
        _: &[Lanes; 0],
        [used]: &[Lanes; 1],
        step: f64,
    ) -> [Lanes; 1] {
        let range = bond.stretch * (1.0 - self.load_ratio);
        // With a negative load ratio, a bond that the largest load compresses is stretched by the smallest
        // load.
        let strain = if self.load_ratio < 0.0 {
            range.abs()
        } else {
            range
        };
        let excess = (strain - Lanes::splat(self.limit)).max(Lanes::splat(0.0));
        if step == 0.0 || excess.above(0.0) == 0 {
            return [*used];
        }
        // The factor must be finite and above 0. The product of 0 and infinity would be NaN, and a bond with
        // the used life NaN would never break.
        let factor = self.coefficient * self.cycles_per_second * step;
        let factor = factor.clamp(f64::MIN_POSITIVE, f64::MAX);
        [*used + excess.pow(self.exponent) * factor]
    }

    #[inline(always)]
    fn is_worn_out<S: Simd>(&self, simd: S, [used]: &[Lanes; 1]) -> u8 {
        simd.at_least(*used, Lanes::splat(1.0))
    }

    #[inline(always)]
    fn force_state(&self, bond: &Bond<D>, _: &[Lanes; 0], _: &[Lanes; 1]) -> Along {
        self.elastic.force_state(bond, &[], &[])
    }

    #[inline(always)]
    fn bond_force<S: Simd>(
        simd: S,
        laws: &[Self; 2],
        bond: &Bond<D>,
        _: [&[Lanes; 0]; 2],
        _: &[[Lanes; 1]; 2],
        weights: Weights,
    ) -> Along {
        let laws = [laws[0].elastic, laws[1].elastic];
        Pmb::bond_force(simd, &laws, bond, [&[]; 2], &[[]; 2], weights)
    }

    #[inline(always)]
    fn bond_energy(&self, bond: &Bond<D>, _: &[Lanes; 0], _: &[Lanes; 1]) -> Lanes {
        self.elastic.bond_energy(bond, &[], &[])
    }

    #[inline(always)]
    fn stiffness(&self, bond: &Bond<D>, end: &[Lanes; 0]) -> Lanes {
        Law::<D>::stiffness(&self.elastic, bond, end)
    }
}
