//! Ordinary state-based standard linear solid: the deviatoric part of the force relaxes.
//!
//! Mitchell 2011, SAND2011-8064. Each bond has a back extension e_b per end. With the symbols of
//! `ordinary.rs`, e_b follows the deviatoric extension e_d with the relaxation time τ. The fraction λ of the
//! deviatoric force depends on e_d − e_b, and the rest on e_d:
//!
//! t = (d k′θ/m) ω|ξ| + (A/m) ω (e_d − λ e_b), ė_b = (e_d − e_b)/τ.
//!
//! The energy W = ½ κθ² + ½ (A/m) Σ ω (e² + λ (e_b² − 2 e_d e_b)) Ṽ depends on θ also through e_d.
//! The force is the derivative of W, and therefore has the additional term λ (A/m²) ω|ξ| Σ ω|ξ| e_b Ṽ. This
//! term is 0 until bonds of the family break.
//!
//! The index n marks values at the start of a step Δt. During the step, e_d is assumed to change linearly
//! from e_d,n to e_d,n + Δe_d. Then
//! e_b ← e_d,n (1 − a) + e_b,n a + β Δe_d with a = exp(−Δt/τ) and β = 1 − (τ/Δt)(1 − a).
//! The elastic constants are those of the instantaneous response. The long-term shear modulus is (1 − λ) G.

use super::ordinary::{
    INFLUENCE, Ordinary, SURFACE_CORRECTION, inelastic_force_state, influence, with_influence,
};
use super::{
    Along, Bond, Built, Declaration, Declared, Described, Given, Invariants, Key, Kind, Law,
    PlasticState, PositionAware, PositionAwareViscoelastic, Property,
};
use crate::lanes::{IsaSet, Lanes};

/// The constants of the law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OrdinaryViscoelastic {
    elastic: Ordinary,
    relaxation: Relaxation,
}

const RELAXATION_TIME: Key = Key {
    name: "relaxation_time",
    meaning: "relaxation time τ of the deviatoric force, s",
    kind: Kind::POSITIVE,
};

const RELAXING_SHARE: Key = Key {
    name: "relaxing_share",
    meaning: "fraction λ of the deviatoric force that relaxes",
    kind: Kind::Number {
        range: 0.0..1.0,
        words: "at least 0 and below 1",
        default: None,
    },
};

impl Declared for OrdinaryViscoelastic {
    const DECLARATIONS: &'static [Declaration] = &[Declaration {
        keys: &[
            RELAXATION_TIME,
            RELAXING_SHARE,
            INFLUENCE,
            SURFACE_CORRECTION,
        ],
        any_poisson_ratio: true,
        no_line: Some("`ordinary_viscoelastic` has no 1-D form"),
        invariants: |_| Invariants {
            conservative: false,
            ..Invariants::ALL
        },
        breaks_by_energy: true,
        critical_stretch: Some(super::ordinary::critical_stretch),
        examples: &[
            "poisson_ratio = 0.3, relaxation_time = 0.05, relaxing_share = 0.4",
            "poisson_ratio = 0.2, relaxation_time = 0.05, relaxing_share = 0.6, surface_correction = 'pals'",
            "poisson_ratio = 0.3, relaxation_time = 0.05, relaxing_share = 0.5, surface_correction = 'directional'",
        ],
        ..Declaration::new(
            "ordinary_viscoelastic",
            "as `ordinary`, but a fraction of the deviatoric force relaxes",
            build,
        )
    }];
}

fn build(given: &Given) -> Built {
    let relaxation = Relaxation {
        time: given.values.number(RELAXATION_TIME.name),
        share: given.values.number(RELAXING_SHARE.name),
    };
    let influence = influence(given);
    match given.values.word(SURFACE_CORRECTION.name) {
        "none" => {
            let elastic = Ordinary::of(given, influence);
            let law = OrdinaryViscoelastic {
                elastic,
                relaxation,
            };
            with_influence(law, given)
        }
        _ => {
            let elastic = PositionAware::of(given, influence);
            with_influence(PositionAwareViscoelastic::new(elastic, relaxation), given)
        }
    }
}

impl Described for OrdinaryViscoelastic {
    fn described(&self) -> Vec<(&'static str, Property)> {
        let mut facts = self.elastic.described();
        facts.extend(self.relaxation.described());
        facts
    }
}

/// Relaxation of the deviatoric force of bonds. At each end of a bond, the back extension follows the
/// deviatoric extension.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Relaxation {
    /// Relaxation time τ, s.
    time: f64,
    /// Relaxing fraction λ.
    share: f64,
}

impl Relaxation {
    /// Return the relaxing fraction λ.
    pub(super) fn share(&self) -> f64 {
        self.share
    }

    /// Return the names and values of the constants, for display.
    pub(super) fn described(&self) -> [(&'static str, Property); 2] {
        [
            ("relaxation time", Property::Number(self.time, "s")),
            ("relaxing share", Property::Number(self.share, "")),
        ]
    }

    /// Return 1 − a and β of a step (s).
    fn relaxed(&self, step: f64) -> [f64; 2] {
        let x = step / self.time;
        if x < 1e-3 {
            // Series of 1 − (1 − e^−x)/x, which avoids cancellation. It also avoids the exponential function,
            // which would take a sixth of the time of a step.
            let beta =
                x * (0.5 - x * (1.0 / 6.0 - x * (1.0 / 24.0 - x * (1.0 / 120.0 - x / 720.0))));
            [x - x * beta, beta]
        } else {
            let gone = -libm::expm1(-x);
            [gone, 1.0 - gone / x]
        }
    }

    /// Return e_b/|ξ|, e_d/|ξ| and the dissipated energy (J/m⁶) of bonds after a step of length `step` (s).
    /// The second argument contains these three quantities before the step. `deviatoric` is e_d/|ξ| after the
    /// step. Without relaxation, a bond has the energy ½ `factor` (e_d/|ξ|)², J/m⁶.
    #[inline(always)]
    pub(super) fn after(
        &self,
        deviatoric: Lanes,
        [back, before, loss]: &[Lanes; 3],
        factor: Lanes,
        step: f64,
    ) -> [Lanes; 3] {
        let [gone, beta] = self.relaxed(step);
        let change = (*before - *back) * gone + (deviatoric - *before) * beta;
        let now = *back + change;
        // Energy that the dashpot dissipates, with the force of the dashpot at the middle of the step.
        let force = (*before - *back + deviatoric - now) * (0.5 * self.share);
        let dissipated = factor * force * change;
        [now, deviatoric, *loss + dissipated]
    }

    /// Return λ (e_b² − 2 e_d e_b)/|ξ|² from e_d/|ξ| and e_b/|ξ|.
    #[inline(always)]
    pub(super) fn change_of_square(&self, deviatoric: Lanes, back: Lanes) -> Lanes {
        (back - deviatoric * 2.0) * back * self.share
    }
}

impl<const D: usize> Law<D> for OrdinaryViscoelastic {
    /// 1. A/m, N/m⁷;
    /// 2. d κ θ/m + λ (A/m²) Σ ω|ξ| e_b Ṽ, N/m⁷;
    /// 3. θ/d.
    type Point = [Lanes; 3];
    /// e_b/|ξ|, e_d/|ξ|, and the dissipated energy, J/m⁶.
    type BondHistory = [Lanes; 3];
    type ReferenceSum = [Lanes; 1];
    type Sum = [Lanes; 1];
    type Force = Along;
    const ISA_SET: IsaSet = IsaSet::Avx2;
    const CONSTANTS: usize = 1;
    const PASSES: usize = 2;
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

    /// Pass 0: Σ ω|ξ|eṼ. Pass 1: Σ ω|ξ| e_b Ṽ. Both in m⁵.
    #[inline(always)]
    fn pass_contribution<const S: usize>(
        &self,
        bond: &Bond<D>,
        _: &[Lanes; 3],
        [back, ..]: &[Lanes; 3],
    ) -> [Lanes; 1] {
        let extension = if S == 0 { bond.stretch } else { *back };
        [bond.length * bond.length * extension]
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
        if pass == 1 {
            let extension_factor = numbers[0];
            let volume_factor =
                extension_factor * extension_factor / self.elastic.extensional() * sums[0];
            numbers[1] += self.relaxation.share * volume_factor;
            return;
        }
        let [volume_factor, dilatation] = self.elastic.dilated(numbers[0], sums[0]);
        numbers[1] = volume_factor;
        numbers[2] = dilatation / D as f64;
        numbers[3] = dilatation;
    }

    fn reads_advanced_history(&self, pass: usize) -> bool {
        pass == 1
    }

    #[inline(always)]
    fn bond_history(
        &self,
        bond: &Bond<D>,
        [extension_factor, _, isotropic_stretch]: &[Lanes; 3],
        history: &[Lanes; 3],
        step: f64,
    ) -> [Lanes; 3] {
        let factor = *extension_factor * (bond.length * bond.length);
        (self.relaxation).after(bond.stretch - *isotropic_stretch, history, factor, step)
    }

    #[inline(always)]
    fn force_state(
        &self,
        bond: &Bond<D>,
        [extension_factor, volume_factor, _]: &[Lanes; 3],
        [back, ..]: &[Lanes; 3],
    ) -> Along {
        inelastic_force_state(
            bond,
            *extension_factor,
            *volume_factor,
            *back * self.relaxation.share,
        )
    }

    #[inline(always)]
    fn bond_energy(
        &self,
        bond: &Bond<D>,
        [extension_factor, _, isotropic_stretch]: &[Lanes; 3],
        [back, ..]: &[Lanes; 3],
    ) -> Lanes {
        let deviatoric = bond.stretch - *isotropic_stretch;
        let change = self.relaxation.change_of_square(deviatoric, *back);
        let square = bond.stretch * bond.stretch + change;
        square * (bond.length * bond.length) * *extension_factor * 0.5
    }

    fn point_energy(&self, numbers: &[f64]) -> f64 {
        self.elastic.dilatation_energy(numbers[3])
    }

    #[inline(always)]
    fn dissipated(&self, _: Lanes, [.., loss]: &[Lanes; 3]) -> Lanes {
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
        [extension_factor, volume_factor, _]: &[Lanes; 3],
    ) -> Lanes {
        Law::<D>::stiffness(&self.elastic, bond, &[*extension_factor, *volume_factor])
    }
}
