//! Ordinary state-based linear peridynamic solid, for any Poisson ratio.
//!
//! Silling, Epton, Weckner, Xu & Askari 2007; the plane forms follow Le, Chan & Schwartz 2014.
//! In d dimensions, the law uses these quantities:
//!
//! - weighted volume m = Σ ω|ξ|²Ṽ,
//! - extension e = |Y| − |ξ|,
//! - dilatation θ = (d/m) Σ ω|ξ|eṼ,
//! - deviatoric extension e_d = e − θ|ξ|/d.
//!
//! The force state t along the bond (N/m⁶) and the strain energy density W (J/m³) are
//!
//! t = (d k′θ/m) ω|ξ| + (A/m) ω e_d, W = ½ k′θ² + ½ (A/m) Σ ω e_d² Ṽ.
//!
//! | dimension | k′ | A |
//! |---|---|---|
//! | 3-D | K | 15G |
//! | plane strain | K + G/3 | 8G |
//! | plane stress | E/(2(1−ν)) | 8G |
//!
//! With κ = k′ − A/d² the same law is t = (d κ θ/m) ω|ξ| + (A/m) ω e and W = ½ κθ² + ½ (A/m) Σ ω e² Ṽ. Here m
//! is a sum over the initial family, whereas θ is a sum over the intact bonds. Therefore t is the derivative
//! of W even if bonds are broken.

use super::bond::Weights;
use super::{
    Along, AnyLaw, Bond, Built, Declaration, Declared, Described, Given, Influence, Key, Kind, Law,
    PlasticState, PositionAware, Property, Word,
};
use crate::damage::CriticalStretch;
use crate::dimension::Dimension;
use crate::elastic::Isotropic;
use crate::lanes::{Lanes, Simd};

/// The constants of the law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ordinary {
    /// Number of dimensions d.
    dimension: f64,
    /// κ = k′ − A/d², Pa.
    volumetric: f64,
    /// Constant A of the law, Pa.
    extensional: f64,
    /// Weighted volume m of an untruncated family, m⁵.
    untruncated_weighted_volume: f64,
}

impl Ordinary {
    /// Create the law from the elastic constants and the weighted volume (m⁵) of an untruncated family.
    /// `None` in 1-D, where the Poisson ratio has no meaning.
    pub fn new(
        dimension: Dimension,
        elastic: Isotropic,
        untruncated_weighted_volume: f64,
    ) -> Option<Self> {
        let (modulus, shear) = (bulk_modulus(dimension, elastic)?, elastic.shear_modulus());
        let (count, extensional) = match dimension {
            Dimension::Space => (3.0, 15.0 * shear),
            _ => (2.0, 8.0 * shear),
        };
        Some(Self {
            dimension: count,
            volumetric: modulus - extensional / (count * count),
            extensional,
            untruncated_weighted_volume,
        })
    }

    /// Create the law with this influence function for a body in the plane or in space.
    pub(super) fn of(given: &Given, influence: Influence) -> Self {
        let untruncated_weighted_volume = influence.weighted_volume(given.dimension, given.horizon);
        Self::new(given.dimension, given.elastic, untruncated_weighted_volume)
            .expect("the law declares that it has no 1-D form")
    }

    /// Return d κ θ/m (N/m⁷) and θ, from A/m and Σ ω|ξ|eṼ.
    #[inline(always)]
    pub(super) fn dilated(&self, extension_factor: f64, sum: f64) -> [f64; 2] {
        let share = self.dimension * extension_factor / self.extensional;
        let dilatation = share * sum;
        [share * self.volumetric * dilatation, dilatation]
    }

    /// Return the energy density of the dilatation, ½ κθ², J/m³.
    pub(super) fn dilatation_energy(&self, dilatation: f64) -> f64 {
        0.5 * self.volumetric * dilatation.powi(2)
    }

    /// Return the number of dimensions d.
    pub fn dimension(&self) -> f64 {
        self.dimension
    }

    /// Return the constant κ = k′ − A/d², Pa.
    pub fn volumetric(&self) -> f64 {
        self.volumetric
    }

    /// Return the constant A of the law, Pa.
    pub fn extensional(&self) -> f64 {
        self.extensional
    }

    /// Return the weighted volume m of an untruncated family, m⁵.
    pub(super) fn untruncated_weighted_volume(&self) -> f64 {
        self.untruncated_weighted_volume
    }

    /// Return the weighted volume m (m⁵) of a point. `extension_factor` is A/m. `None` if the point has no
    /// bonds.
    pub(super) fn weighted_volume_of(&self, extension_factor: f64) -> Option<f64> {
        (extension_factor > 0.0).then(|| self.extensional / extension_factor)
    }

    /// Return the energy of a bond at one end, divided by the energy of this bond in an untruncated family at
    /// the same stretch. `sum` is the weighted volume m of this end, m⁵.
    pub(super) fn truncation_factor_of(&self, sum: f64) -> f64 {
        if sum > 0.0 {
            self.untruncated_weighted_volume / sum
        } else {
            1.0
        }
    }
}

/// Return k′ (Pa): ½ k′ θ² is the energy density of an isotropic expansion with the dilatation θ in this
/// dimension. `None` in 1-D.
fn bulk_modulus(dimension: Dimension, elastic: Isotropic) -> Option<f64> {
    match dimension {
        Dimension::Line { .. } => None,
        Dimension::PlaneStress { .. } => {
            Some(elastic.youngs_modulus / (2.0 * (1.0 - elastic.poisson_ratio)))
        }
        Dimension::PlaneStrain { .. } => {
            Some(elastic.bulk_modulus() + elastic.shear_modulus() / 3.0)
        }
        Dimension::Space => Some(elastic.bulk_modulus()),
    }
}

pub(super) const INFLUENCE: Key = Key {
    name: "influence",
    meaning: "influence function ω of bonds of length r at a horizon δ: 1, 1 − r/δ, exp(−4r²/δ²) \
              or δ/r",
    kind: Kind::Word(&[
        Word::new("constant"),
        Word::new("linear"),
        Word::new("gaussian"),
        Word::new("inverse"),
    ]),
};

pub(super) const SURFACE_CORRECTION: Key = Key {
    name: "surface_correction",
    meaning: "surface correction of the dilatation and of the deviatoric energy of each point, from its own family: \
              none, by extensions along the axes, or the position-aware linear solid",
    kind: Kind::Word(&[
        Word::new("none"),
        Word::new("directional"),
        Word::new("pals"),
    ]),
};

impl Declared for Ordinary {
    const DECLARATIONS: &'static [Declaration] = &[Declaration {
        keys: &[INFLUENCE, SURFACE_CORRECTION],
        any_poisson_ratio: true,
        no_line: Some("`ordinary` has no 1-D form; use `pmb`"),
        breaks_by_energy: true,
        critical_stretch: Some(critical_stretch),
        examples: &[
            "poisson_ratio = 0.4",
            "poisson_ratio = 0.1, influence = 'linear'",
            "poisson_ratio = 0.25, influence = 'gaussian'",
            "poisson_ratio = -0.3, influence = 'inverse'",
            "poisson_ratio = 0.3, surface_correction = 'pals'",
            "poisson_ratio = 0.4, surface_correction = 'pals', influence = 'linear'",
            "poisson_ratio = 0.3, surface_correction = 'directional'",
        ],
        ..Declaration::new(
            "ordinary",
            "linear peridynamic solid (LPS): state-based, with the dilatation of the family",
            build,
        )
    }];
}

fn build(given: &Given) -> Built {
    match given.values.word(SURFACE_CORRECTION.name) {
        "none" => with_influence(Ordinary::of(given, influence(given)), given),
        _ => with_influence(PositionAware::of(given, influence(given)), given),
    }
}

/// Add the influence function of the deck to a law.
pub(super) fn with_influence(law: impl Into<AnyLaw>, given: &Given) -> Built {
    let horizon = given.horizon;
    match influence(given) {
        Influence::Constant => Built::plain(law),
        influence => Built::with_influence(law, move |length| influence.at(length, horizon)),
    }
}

pub(super) fn influence(given: &Given) -> Influence {
    match given.values.word(INFLUENCE.name) {
        "linear" => Influence::Linear,
        "gaussian" => Influence::Gaussian,
        "inverse" => Influence::Inverse,
        _ => Influence::Constant,
    }
}

pub(super) fn critical_stretch(given: &Given, energy: f64) -> f64 {
    let law = Ordinary::of(given, influence(given));
    CriticalStretch::from_energy_ordinary(&law, influence(given), energy, given.horizon)
}

/// Return the force state t = v |ξ| + a (e − e_i) of bonds with the inelastic deviatoric extension e_i. Here
/// a = A/m is `extension_factor`, and v is `volume_factor`, such as d κ θ/m. The unit of both factors is
/// N/m⁷. `inelastic_stretch` is e_i/|ξ|.
#[inline(always)]
pub(super) fn inelastic_force_state<const D: usize>(
    bond: &Bond<D>,
    extension_factor: Lanes,
    volume_factor: Lanes,
    inelastic_stretch: Lanes,
) -> Along {
    let inelastic = inelastic_stretch * (Lanes::splat(1.0) - bond.extension_over_deformed);
    Along(
        volume_factor + bond.extension_over_deformed * (extension_factor - volume_factor)
            - extension_factor * inelastic,
    )
}

impl Described for Ordinary {
    fn described(&self) -> Vec<(&'static str, Property)> {
        vec![("forces", Property::Text("ordinary state-based"))]
    }
}

impl<const D: usize> Law<D> for Ordinary {
    /// A/m and d κ θ/m, N/m⁷.
    type Point = [Lanes; 2];
    type BondHistory = [Lanes; 0];
    /// m = Σ ω|ξ|²Ṽ, m⁵.
    type ReferenceSum = [Lanes; 1];
    /// Σ ω|ξ|eṼ over the intact bonds, m⁵.
    type Sum = [Lanes; 1];
    type Force = Along;
    const CONSTANTS: usize = 1;
    const PASSES: usize = 1;
    const LEAST_DIMENSION: usize = 2;
    /// The only own number of a point is the dilatation θ.
    const OWN_NUMBERS: usize = 1;

    #[inline(always)]
    fn reference_contribution(&self, bond: &Bond<D>) -> [Lanes; 1] {
        [bond.length * bond.length]
    }

    fn constants(&self, sums: &[f64], numbers: &mut [f64]) {
        numbers[0] = if sums[0] > 0.0 {
            self.extensional / sums[0]
        } else {
            0.0
        };
    }

    #[inline(always)]
    fn pass_contribution<const S: usize>(
        &self,
        bond: &Bond<D>,
        _: &[Lanes; 2],
        _: &[Lanes; 0],
    ) -> [Lanes; 1] {
        [bond.length * bond.length * bond.stretch]
    }

    #[inline(always)]
    fn update_point(
        &self,
        _: usize,
        sums: &[f64],
        numbers: &mut [f64],
        _: &mut PlasticState,
        _: f64,
    ) {
        let [volume_factor, dilatation] = self.dilated(numbers[0], sums[0]);
        numbers[1] = volume_factor;
        numbers[2] = dilatation;
    }

    #[inline(always)]
    fn force_state(
        &self,
        bond: &Bond<D>,
        [extension_factor, volume_factor]: &[Lanes; 2],
        _: &[Lanes; 0],
    ) -> Along {
        // With P = `extension_over_deformed`: |ξ|/|Y| = 1 − P and |ξ| s/|Y| = P.
        Along(*volume_factor + bond.extension_over_deformed * (*extension_factor - *volume_factor))
    }

    #[inline(always)]
    fn bond_force<S: Simd>(
        simd: S,
        _: &[Self; 2],
        bond: &Bond<D>,
        [here, there]: [&[Lanes; 2]; 2],
        _: &[[Lanes; 0]; 2],
        weights: Weights,
    ) -> Along {
        let extension_factor = weights.sum(here[0], there[0]);
        let volume_factor = weights.sum(here[1], there[1]);
        Along(simd.multiply_add(
            bond.extension_over_deformed,
            extension_factor - volume_factor,
            volume_factor,
        ))
    }

    #[inline(always)]
    fn bond_energy(
        &self,
        bond: &Bond<D>,
        [extension_factor, _]: &[Lanes; 2],
        _: &[Lanes; 0],
    ) -> Lanes {
        let extension = bond.length * bond.stretch;
        extension * extension * *extension_factor * 0.5
    }

    fn point_energy(&self, numbers: &[f64]) -> f64 {
        self.dilatation_energy(numbers[2])
    }

    fn weighted_volume(&self, numbers: &[f64]) -> Option<f64> {
        self.weighted_volume_of(numbers[0])
    }

    fn truncation_factor(&self, sums: &[f64]) -> f64 {
        self.truncation_factor_of(sums[0])
    }

    /// By Cauchy–Schwarz, θ² ≤ (d²/m) Σ ω e² Ṽ. Therefore W ≤ ½ k Σ ω e² Ṽ, with the spring constant
    /// k = (A + max(κ, 0) d²)/m.
    #[inline(always)]
    fn stiffness(&self, _: &Bond<D>, [extension_factor, _]: &[Lanes; 2]) -> Lanes {
        let square = self.dimension * self.dimension;
        *extension_factor * (1.0 + square * self.volumetric.max(0.0) / self.extensional)
    }
}
