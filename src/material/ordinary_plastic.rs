//! Ordinary state-based elastic–perfectly plastic solid: the norm of the deviatoric force state cannot exceed
//! a yield value.
//!
//! Mitchell 2011, SAND2011-3166. Each bond has a plastic extension e_p per end. Energy and force are those of
//! [`Ordinary`], with the elastic extension e − e_p instead of e. With the symbols of `ordinary.rs`, the
//! energy W and the dilatation θ are
//!
//! W = ½ κθ² + ½ (A/m) Σ ω (e − e_p)² Ṽ, θ = (d/m) Σ ω|ξ| (e − e_p) Ṽ.
//!
//! The deviatoric force is t_d = (A/m) ω e_d. Here e_d is the elastic extension minus |ξ| times the mean
//! elastic stretch of the intact bonds: e_d = e − e_p − |ξ| Σ ω|ξ| (e − e_p) Ṽ/Σ ω|ξ|² Ṽ.
//!
//! The yield condition of a point is ½‖t_d‖² − ψ₀ ≤ 0 with ‖t_d‖² = Σ t_d² Ṽ and the yield value ψ₀.
//! The return to the yield surface is radial: t_d is multiplied by r = √(2ψ₀)/‖t_d‖, and e_p grows by
//! (1 − r) e_d.
//!
//! Mitchell computes θ from the total extension e instead of e − e_p. Plastic flow preserves volume, so
//! Σ ω|ξ| e_p Ṽ = 0 until bonds of the family break. Until then, both extensions give the same θ, and the law
//! equals Mitchell's law. After that, Σ ω|ξ| e_p Ṽ of the remaining bonds is not 0. With Mitchell's θ, the
//! force on the remaining bonds would not be the derivative of the energy: the plastic extensions would
//! expand the family, and breaking bonds would add energy.
//!
//! ψ₀ is calibrated in pure shear: the point yields when the equivalent stress of von Mises reaches σ_y. For
//! a deviatoric strain ε, ½‖t_d‖² is 15 G² ε:ε/m in space and 8 G² ε:ε/m in the plane. The equivalent stress
//! is σ_y at ε:ε = σ_y²/(6G²). Therefore ψ₀ = (5/2) σ_y²/m in space and (4/3) σ_y²/m in the plane. With m of
//! an untruncated family, the value in space is Mitchell's 25σ_y²/(8πδ⁵). With the thickness h, Mitchell's
//! value in the plane is 75σ_y²/(8πhδ⁴). That value belongs to A = 15G, whereas this law has A = 8G in the
//! plane.

use super::ordinary::{Ordinary, SURFACE_CORRECTION, inelastic_force_state};
use super::{
    Along, Bond, Built, Declaration, Declared, Described, Given, Influence, Invariants, Key, Kind,
    Law, LawFault, PlasticState, PositionAware, PositionAwarePlastic, Property, Values, Word,
};
use crate::dimension::Dimension;
use crate::lanes::{IsaSet, Lanes};

/// The constants of the law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OrdinaryPlastic {
    elastic: Ordinary,
    /// Product ψ₀ m, Pa²: the yield value ψ₀ of a point is this product divided by the weighted volume m.
    /// `untruncated_weighted_volume` determines which m is used.
    strength: f64,
    /// m of an untruncated family (m⁵), if this m determines the yield value of all points. `None` if the m
    /// of each point determines the yield value of the point.
    untruncated_weighted_volume: Option<f64>,
}

const YIELD_STRESS: Key = Key {
    name: "yield_stress",
    meaning: "yield stress σ_y in uniaxial tension, Pa (von Mises)",
    kind: Kind::POSITIVE,
};

const CALIBRATION: Key = Key {
    name: "calibration",
    meaning: "whether the yield limit of a point is computed for its own family or for a \
              complete family",
    kind: Kind::Word(&[Word::new("family"), Word::new("continuum")]),
};

impl Declared for OrdinaryPlastic {
    const DECLARATIONS: &'static [Declaration] = &[Declaration {
        keys: &[YIELD_STRESS, CALIBRATION, SURFACE_CORRECTION],
        any_poisson_ratio: true,
        no_line: Some("`ordinary_plastic` has no 1-D form; `elastic_plastic_pmb` has"),
        invariants: |_| Invariants {
            conservative: false,
            ..Invariants::ALL
        },
        breaks_by_energy: true,
        fault: Some(fault),
        examples: &[
            "poisson_ratio = 0.3, yield_stress = 0.3",
            "poisson_ratio = 0.2, yield_stress = 0.4, calibration = 'continuum'",
            "poisson_ratio = 0.4, yield_stress = 0.3, surface_correction = 'pals'",
            "poisson_ratio = 0.3, yield_stress = 0.3, surface_correction = 'directional'",
        ],
        ..Declaration::new(
            "ordinary_plastic",
            "as `ordinary`, with a perfectly plastic deviatoric part",
            build,
        )
    }];
}

fn build(given: &Given) -> Built {
    let stress = given.values.number(YIELD_STRESS.name);
    let shear = given.elastic.shear_modulus();
    match given.values.word(SURFACE_CORRECTION.name) {
        "none" => without_correction(given, stress),
        _ => {
            let elastic = PositionAware::of(given, Influence::Constant);
            Built::plain(PositionAwarePlastic::new(elastic, stress, shear))
        }
    }
}

fn without_correction(given: &Given, stress: f64) -> Built {
    let factor = match given.dimension {
        Dimension::Space => 2.5,
        _ => 4.0 / 3.0,
    };
    let of_family = given.values.word(CALIBRATION.name) == "family";
    let elastic = Ordinary::of(given, Influence::Constant);
    Built::plain(OrdinaryPlastic {
        elastic,
        strength: factor * stress * stress,
        untruncated_weighted_volume: (!of_family).then_some(elastic.untruncated_weighted_volume()),
    })
}

/// Return the error if the deck has `calibration = "continuum"` and a surface correction. With a surface
/// correction, each point has its own influence functions, and its own family determines the yield value.
fn fault(values: &Values, _: Dimension) -> Option<LawFault> {
    let is_corrected = values.word(SURFACE_CORRECTION.name) != "none";
    (is_corrected && values.word(CALIBRATION.name) != "family").then(|| LawFault {
        key: Some(CALIBRATION.name),
        message: "with a `surface_correction`, the yield limit is always computed for each point's own family; \
                  use \"family\""
            .to_owned(),
    })
}

impl Described for OrdinaryPlastic {
    fn described(&self) -> Vec<(&'static str, Property)> {
        let mut facts = self.elastic.described();
        let yields = match self.untruncated_weighted_volume {
            None => "by each point's own family",
            Some(_) => "as if families were whole",
        };
        facts.push(("yields", Property::Text(yields)));
        facts
    }
}

impl<const D: usize> Law<D> for OrdinaryPlastic {
    /// Four numbers:
    /// - A/m, N/m⁷,
    /// - d κ θ/m, N/m⁷,
    /// - the mean elastic stretch Σ ω|ξ| (e − e_p) Ṽ/Σ ω|ξ|² Ṽ,
    /// - 1 − r.
    type Point = [Lanes; 4];
    /// e_p/|ξ|, and the dissipated energy, J/m⁶.
    type BondHistory = [Lanes; 2];
    type ReferenceSum = [Lanes; 1];
    type Sum = [Lanes; 2];
    type Force = Along;
    const ISA_SET: IsaSet = IsaSet::Avx2;
    const CONSTANTS: usize = 1;
    const PASSES: usize = 3;
    /// The only own number of a point is the dilatation θ.
    const OWN_NUMBERS: usize = 1;
    const LEAST_DIMENSION: usize = 2;
    const FORCE_READS_STRETCH: bool = true;

    #[inline(always)]
    fn reference_contribution(&self, bond: &Bond<D>) -> [Lanes; 1] {
        self.elastic.reference_contribution(bond)
    }

    fn constants(&self, sums: &[f64], numbers: &mut [f64]) {
        Law::<D>::constants(&self.elastic, sums, numbers);
    }

    /// Pass 0: Σ ω|ξ| (e − e_p) Ṽ and Σ ω|ξ|² Ṽ. Pass 1: Σ ω e_d² Ṽ. Pass 2: the sums of pass 0 after the
    /// flow. All in m⁵.
    #[inline(always)]
    fn pass_contribution<const S: usize>(
        &self,
        bond: &Bond<D>,
        [_, _, mean, _]: &[Lanes; 4],
        [plastic, _]: &[Lanes; 2],
    ) -> [Lanes; 2] {
        let square = bond.length * bond.length;
        let elastic = bond.stretch - *plastic;
        if S == 1 {
            let deviatoric = elastic - *mean;
            [square * deviatoric * deviatoric, Lanes::splat(0.0)]
        } else {
            [square * elastic, square]
        }
    }

    #[inline(always)]
    fn update_point(
        &self,
        pass: usize,
        sums: &[f64],
        numbers: &mut [f64],
        _: &mut PlasticState,
        _: f64,
    ) {
        let extension_factor = numbers[0];
        match pass {
            0 => {
                let [sum, square] = [sums[0], sums[1]];
                numbers[2] = if square > 0.0 { sum / square } else { 0.0 };
            }
            1 => {
                let mass = self
                    .untruncated_weighted_volume
                    .unwrap_or(self.elastic.extensional() / extension_factor);
                let limit = 2.0 * self.strength / mass;
                let square = extension_factor * extension_factor * sums[0];
                // Without bonds A/m is 0, so the square is 0 and the point does not yield.
                numbers[3] = if square > limit {
                    1.0 - (limit / square).sqrt()
                } else {
                    0.0
                };
            }
            _ => {
                let [volume_factor, dilatation] = self.elastic.dilated(extension_factor, sums[0]);
                numbers[1] = volume_factor;
                numbers[4] = dilatation;
            }
        }
    }

    fn reads_advanced_history(&self, pass: usize) -> bool {
        pass == 2
    }

    #[inline(always)]
    fn bond_history(
        &self,
        bond: &Bond<D>,
        [extension_factor, _, mean, plastic_fraction]: &[Lanes; 4],
        [plastic, loss]: &[Lanes; 2],
        _: f64,
    ) -> [Lanes; 2] {
        let trial = bond.stretch - *mean - *plastic;
        let change = trial * *plastic_fraction;
        let dissipated =
            *extension_factor * (bond.length * bond.length) * (trial - change) * change;
        [*plastic + change, *loss + dissipated]
    }

    #[inline(always)]
    fn force_state(
        &self,
        bond: &Bond<D>,
        [extension_factor, volume_factor, ..]: &[Lanes; 4],
        [plastic, _]: &[Lanes; 2],
    ) -> Along {
        inelastic_force_state(bond, *extension_factor, *volume_factor, *plastic)
    }

    #[inline(always)]
    fn bond_energy(
        &self,
        bond: &Bond<D>,
        [extension_factor, ..]: &[Lanes; 4],
        [plastic, _]: &[Lanes; 2],
    ) -> Lanes {
        let elastic = bond.length * (bond.stretch - *plastic);
        elastic * elastic * *extension_factor * 0.5
    }

    fn point_energy(&self, numbers: &[f64]) -> f64 {
        self.elastic.dilatation_energy(numbers[4])
    }

    #[inline(always)]
    fn dissipated(&self, _: Lanes, [_, loss]: &[Lanes; 2]) -> Lanes {
        *loss
    }

    fn weighted_volume(&self, numbers: &[f64]) -> Option<f64> {
        self.elastic.weighted_volume_of(numbers[0])
    }

    fn truncation_factor(&self, sums: &[f64]) -> f64 {
        self.elastic.truncation_factor_of(sums[0])
    }

    #[inline(always)]
    fn stiffness(
        &self,
        bond: &Bond<D>,
        [extension_factor, volume_factor, ..]: &[Lanes; 4],
    ) -> Lanes {
        Law::<D>::stiffness(&self.elastic, bond, &[*extension_factor, *volume_factor])
    }
}
