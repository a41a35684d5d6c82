//! Elastic–perfectly plastic microelastic material: f = c (s − s_p) Y/|Y|. Here c is the micromodulus, s is
//! the stretch of the bond, and s_p is the plastic stretch of the bond. s_p changes so that |s − s_p| never
//! exceeds the yield stretch s_y.
//!
//! Below the yield stretch this is the prototype microelastic material (Silling & Askari 2005). The slope of
//! the force over the stretch is c during unloading, as in elastic loading.
//! The elastic energy of a bond is c (s − s_p)² |ξ|/2. Plastic flow by Δs_p dissipates c s_y |Δs_p| |ξ|.

use super::bond::Weights;
use super::declaration::bond_based_critical_stretch;
use super::{
    Along, Bond, Built, Declaration, Declared, Described, Given, Invariants, Key, Kind, Law, Pmb,
    Property,
};
use crate::lanes::{IsaSet, Lanes, Simd};

/// The constants of the law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ElasticPlasticPmb {
    /// The elastic part.
    pub elastic: Pmb,
    /// Yield stretch s_y.
    pub yield_stretch: f64,
}

const YIELD_STRETCH: Key = Key {
    name: "yield_stretch",
    meaning: "stretch s_y at which a bond yields, in tension and in compression",
    kind: Kind::POSITIVE,
};

impl Declared for ElasticPlasticPmb {
    const DECLARATIONS: &'static [Declaration] = &[Declaration {
        keys: &[YIELD_STRETCH],
        invariants: |_| Invariants {
            conservative: false,
            ..Invariants::ALL
        },
        breaks_by_energy: true,
        critical_stretch: Some(critical_stretch),
        examples: &["yield_stretch = 0.02"],
        ..Declaration::new(
            "elastic_plastic_pmb",
            "f = c (s − s_p) e, where the plastic stretch s_p of a bond keeps |s − s_p| ≤ s_y",
            build,
        )
    }];
}

fn build(given: &Given) -> Built {
    Built::plain(ElasticPlasticPmb {
        elastic: Pmb::of(given),
        yield_stretch: given.values.number(YIELD_STRETCH.name),
    })
}

/// Return the critical stretch s0 for a fracture energy (J/m²). Stretching a bond to s0 and breaking it
/// dissipates the same energy as breaking an elastic bond at s_e. Here s_e is the critical stretch of `pmb`
/// for this fracture energy.
///
/// If s0 > s_y, the bond dissipates c s_y (s0 − s_y/2) |ξ|. The elastic bond dissipates c s_e² |ξ|/2.
/// Therefore s0 = s_e²/(2 s_y) + s_y/2 if s_e > s_y; otherwise s0 = s_e.
fn critical_stretch(given: &Given, energy: f64) -> f64 {
    let elastic = bond_based_critical_stretch(given, energy);
    let limit = given.values.number(YIELD_STRETCH.name);
    if elastic <= limit {
        elastic
    } else {
        0.5 * (elastic * elastic / limit + limit)
    }
}

impl Described for ElasticPlasticPmb {
    fn described(&self) -> Vec<(&'static str, Property)> {
        let mut facts = self.elastic.described();
        facts.push(("yield stretch", Property::Number(self.yield_stretch, "")));
        facts
    }
}

impl<const D: usize> Law<D> for ElasticPlasticPmb {
    type Point = [Lanes; 0];
    /// s_p, and the sum of |Δs_p| over all steps.
    type BondHistory = [Lanes; 2];
    type ReferenceSum = [Lanes; 0];
    type Sum = [Lanes; 0];
    type Force = Along;
    const ISA_SET: IsaSet = IsaSet::Avx2;
    const FORCE_READS_STRETCH: bool = true;

    #[inline(always)]
    fn bond_history(
        &self,
        bond: &Bond<D>,
        _: &[Lanes; 0],
        before: &[Lanes; 2],
        _: f64,
    ) -> [Lanes; 2] {
        let [plastic, path] = *before;
        let limit = Lanes::splat(self.yield_stretch);
        // s_p is clamped to the range from s − s_y to s + s_y.
        let now = plastic.max(bond.stretch - limit).min(bond.stretch + limit);
        [now, path + (now - plastic).abs()]
    }

    #[inline(always)]
    fn force_state(&self, bond: &Bond<D>, _: &[Lanes; 0], [plastic, _]: &[Lanes; 2]) -> Along {
        // With P = `extension_over_deformed`: s/|Y| = P/|ξ| and 1/|Y| = (1 − P)/|ξ|.
        let elastic = bond.extension_over_deformed
            - *plastic * (Lanes::splat(1.0) - bond.extension_over_deformed);
        Along(elastic * (bond.inverse * (0.5 * self.elastic.micromodulus)))
    }

    #[inline(always)]
    fn bond_force<S: Simd>(
        _: S,
        laws: &[Self; 2],
        bond: &Bond<D>,
        _: [&[Lanes; 0]; 2],
        [here, there]: &[[Lanes; 2]; 2],
        weights: Weights,
    ) -> Along {
        let half = |end: usize| Lanes::splat(0.5 * laws[end].elastic.micromodulus);
        let (a, b) = (half(0), half(1));
        let elastic = bond.extension_over_deformed * (bond.inverse * weights.sum(a, b));
        let plastic = bond.inverse * weights.sum(a * here[0], b * there[0]);
        Along(elastic - (Lanes::splat(1.0) - bond.extension_over_deformed) * plastic)
    }

    #[inline(always)]
    fn bond_energy(&self, bond: &Bond<D>, _: &[Lanes; 0], [plastic, _]: &[Lanes; 2]) -> Lanes {
        let elastic = bond.stretch - *plastic;
        elastic * elastic * bond.length * (0.25 * self.elastic.micromodulus)
    }

    #[inline(always)]
    fn dissipated(&self, length: Lanes, [_, path]: &[Lanes; 2]) -> Lanes {
        *path * length * (0.5 * self.elastic.micromodulus * self.yield_stretch)
    }

    #[inline(always)]
    fn stiffness(&self, bond: &Bond<D>, end: &[Lanes; 0]) -> Lanes {
        Law::<D>::stiffness(&self.elastic, bond, end)
    }
}
