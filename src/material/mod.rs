//! Material laws, one per file. A law computes single bonds, eight at a time. It is independent of decks, points, ranks
//! and fields.
//!
//! The force density that a bond exerts on point i is f = T_i⟨ξ⟩ − T_j⟨−ξ⟩ (Silling et al. 2007). The force state T_i
//! of an end depends on the bond, on numbers of the end's whole family (such as a dilatation) and on the bond history
//! (such as a plastic stretch). The law declares the number of both and how they are computed.

mod any;
pub mod bond;
mod correspondence;
mod declaration;
mod elastic_plastic_pmb;
mod force_state;
mod influence;
mod linear_microelastic;
mod normalised;
mod ordinary;
mod ordinary_plastic;
mod ordinary_viscoelastic;
mod pals;
mod plastic_state;
mod pmb;
mod registration;
pub mod rotation;
mod softening_pmb;
mod symmetric;
mod tensor_pmb;

pub use any::{AnyHistory, AnyPoint, Counts, MOST};
pub use bond::Bond;
pub use correspondence::{FamilyShare, ShapeTensor, determinant, eigenvalues, family_share};
pub use declaration::{
    Built, Declaration, Declared, Given, Invariants, Key, Kind, LawFault, OfLength, Value, Values,
    Word,
};
pub use force_state::{Along, ForceState};
pub use influence::Influence;
pub use plastic_state::PlasticState;
pub use rotation::Rotation;

// Every law, by its file and type, in the order of the table of laws.
registration::register! {
    $
    pmb::Pmb,
    elastic_plastic_pmb::ElasticPlasticPmb,
    softening_pmb::SofteningPmb,
    normalised::Normalised,
    tensor_pmb::TensorPmb,
    linear_microelastic::LinearMicroelastic,
    ordinary::Ordinary,
    pals::Pals,
    ordinary_plastic::OrdinaryPlastic,
    ordinary_viscoelastic::OrdinaryViscoelastic,
    correspondence::Correspondence,
    correspondence::BondAssociated,
}

use std::fmt;

use nalgebra::SMatrix;

use crate::lanes::{IsaSet, LaneTuple, Lanes, Simd};
use bond::Weights;

/// A property of a law, for reports.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Property {
    /// A number and its unit; the unit is empty if there is none.
    Number(f64, &'static str),
    /// Words.
    Text(&'static str),
}

impl fmt::Display for Property {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(value, "") => write!(formatter, "{value:.4e}"),
            Self::Number(value, unit) => write!(formatter, "{value:.4e} {unit}"),
            Self::Text(words) => formatter.write_str(words),
        }
    }
}

/// The stress of a point whose law has a deformation gradient per point.
#[derive(Debug, Clone, Copy)]
pub struct FamilyStress<const D: usize> {
    /// Displacement gradient H = F − I.
    pub gradient: SMatrix<f64, D, D>,
    /// First Piola–Kirchhoff stress P, Pa.
    pub piola: SMatrix<f64, D, D>,
    /// Plastic state at this gradient.
    pub plastic: PlasticState,
}

/// What can be told of a law without bonds.
pub trait Described {
    /// Names and values of what it was given or has found, for people to read.
    fn described(&self) -> Vec<(&'static str, Property)>;
}

/// A material law: the contributions of bonds to the numbers of a point, and the resulting force state.
///
/// The loops multiply what is summed by Ṽ and by the influence, neither of which the law sees. They
/// run over bonds in these steps:
///
/// 1. once, over the family without the bonds that pre-cracks cut (see [`Self::needs_shape`]): [`Self::reference_contribution`] → sums → [`Self::constants`], and [`Self::truncation_factor`] where a
///    criterion reads it;
/// 2. before each sum of forces, over the intact bonds, [`Self::PASSES`] times:
///    [`Self::pass_contribution`] → sums → [`Self::update_point`]; then the numbers are sent to the ghosts;
/// 3. [`Self::bond_history`] and [`Self::force`] of both ends.
pub trait Law<const D: usize>: Copy + Send + Sync {
    /// The numbers of a point that bonds read at both ends: first the constants, then the numbers that are recomputed
    /// before each sum of forces.
    type Point: LaneTuple;

    /// The bond history: numbers stored per bond for each of its ends; initially 0.
    type BondHistory: LaneTuple;

    /// The sums over the whole family, which are computed once.
    type ReferenceSum: LaneTuple;

    /// The sums of a pass over the intact bonds. Passes with fewer sums set the rest to 0.
    type Sum: LaneTuple;

    /// The force state's form.
    type Force: ForceState<D>;

    /// Number of constants among the numbers of a point.
    const CONSTANTS: usize = 0;

    /// Number of passes over the bonds before the sum of the forces.
    const PASSES: usize = 0;

    /// Count of numbers of a point that only its own law reads; they follow those of [`Self::Point`].
    const OWN_NUMBERS: usize = 0;

    /// Whether [`Self::force`] or [`Self::bond_history`] read the stretch of bonds.
    const FORCE_READS_STRETCH: bool = false;

    /// Whether [`Self::force`] reads the shortening of bonds.
    const FORCE_READS_EXTENSION: bool = true;

    /// Smallest dimension that the law supports.
    const LEAST_DIMENSION: usize = 1;

    /// Whether [`Self::pass_contribution`] reads the stretch of bonds.
    const SUM_READS_STRETCH: bool = true;

    /// Whether [`Self::pass_contribution`] reads the direction or the length of bonds. Padding bonds of a lane group
    /// have neither.
    const SUM_READS_DIRECTION: bool = false;

    /// Whether forces act along ξ and are linear in η. Otherwise they depend on the deformed bonds.
    const LINEAR: bool = false;

    /// Instruction sets for which the loops of its forces, sums and energies are compiled.
    const ISA_SET: IsaSet = IsaSet::Each;

    /// Whether [`Self::toughness_scale`] is not 1.
    const SCALED: bool = false;

    /// Whether [`Self::lost_stiffness`] is not 0.
    const SOFTENS: bool = false;

    /// Whether the stress of a point, and with it [`Self::stress_across`], is the mean of the stresses of its bonds.
    const HAS_BOND_STRESS_ACROSS: bool = false;

    /// Contribution of a bond of the undeformed body to the sums over the whole family.
    #[inline(always)]
    fn reference_contribution(&self, _bond: &Bond<D>) -> Self::ReferenceSum {
        Self::ReferenceSum::splat(0.0)
    }

    /// The constants of a point from the sums over its whole family.
    fn constants(&self, _sums: &[f64], _numbers: &mut [f64]) {}

    /// Contribution of an intact bond to the sums of pass `S`. It may use the numbers of earlier passes.
    #[inline(always)]
    fn pass_contribution<const S: usize>(
        &self,
        _bond: &Bond<D>,
        _own: &Self::Point,
        _history: &Self::BondHistory,
    ) -> Self::Sum {
        Self::Sum::splat(0.0)
    }

    /// Compute the numbers of a point from the sums of a pass: those of [`Self::Point`], then the law's own. Plastic
    /// flow changes the stored plastic state only in a step.
    fn update_point(
        &self,
        _pass: usize,
        _sums: &[f64],
        _numbers: &mut [f64],
        _plastic: &mut PlasticState,
    ) {
    }

    /// Count of the numbers of points and bonds. A law may need fewer passes and own numbers than its type declares.
    fn counts(&self) -> Counts {
        Counts::of::<Self, D>()
    }

    /// Whether points keep a [`PlasticState`].
    fn has_plasticity(&self) -> bool {
        false
    }

    /// Whether a pass sums the bond history at the end of the step; otherwise the history at its beginning.
    fn reads_advanced_history(&self, _pass: usize) -> bool {
        false
    }

    /// The bond history of one end after a step (s) to this deformation.
    #[inline(always)]
    fn bond_history(
        &self,
        _bond: &Bond<D>,
        _end: &Self::Point,
        before: &Self::BondHistory,
        _step: f64,
    ) -> Self::BondHistory {
        *before
    }

    /// The force state T of one end, N/m⁶; along the bond T/|Y|, or T/|ξ| for linear laws, N/m⁷.
    fn force(&self, bond: &Bond<D>, end: &Self::Point, history: &Self::BondHistory) -> Self::Force;

    /// The force density of bonds per volume, T_i⟨ξ⟩ − T_j⟨−ξ⟩, with the weights of the ends. Both ends compute the
    /// same bits, up to the sign. Laws may override it with fewer operations.
    #[inline(always)]
    fn bond_force<S: Simd>(
        _simd: S,
        laws: &[Self; 2],
        bond: &Bond<D>,
        points: [&Self::Point; 2],
        history: &[Self::BondHistory; 2],
        weights: Weights,
    ) -> Self::Force {
        let force_state_i = laws[0].force(bond, points[0], &history[0]);
        let force_state_j = laws[1].force(bond, points[1], &history[1]);
        match weights {
            Weights::One => force_state_i.plus(force_state_j),
            Weights::Same(weight) => force_state_i.plus(force_state_j).times(weight),
            Weights::Each([own, far]) => force_state_i.times(own).plus(force_state_j.times(far)),
        }
    }

    /// The [work](ForceState::work) of the force state of one end, J/m⁶, with the [`Self::rotation`] of its family.
    #[inline(always)]
    fn end_work<S: Simd>(
        &self,
        simd: S,
        bond: &Bond<D>,
        end: &Self::Point,
        history: &Self::BondHistory,
        rotation: &<Self::Force as ForceState<D>>::Rotation,
    ) -> Lanes {
        let force = self.force(bond, end, history);
        force.work(simd, bond, Self::LINEAR, rotation)
    }

    /// Rotation of a family from the sums of the first pass, for laws whose forces do not act along the bonds.
    fn rotation(&self, _sums: &[f64]) -> Rotation {
        rotation::IDENTITY
    }

    /// The stress of a point, from the sums of the first pass, its numbers and its plastic state before or after flow; for
    /// laws with a deformation gradient per point. `None` where a point carries no stress.
    fn family_stress(
        &self,
        _sums: &[f64],
        _numbers: &[f64],
        _state: &PlasticState,
    ) -> Option<FamilyStress<D>> {
        None
    }

    /// Contribution of a bond to the strain energy density of one end, J/m⁶.
    fn bond_energy(&self, bond: &Bond<D>, end: &Self::Point, history: &Self::BondHistory) -> Lanes;

    /// The part of a point's strain energy density (J/m³) that belongs to no single bond.
    fn point_energy(&self, _numbers: &[f64]) -> f64 {
        0.0
    }

    /// The weighted volume m (m⁵) of a point from its numbers, for laws that store it.
    fn weighted_volume(&self, _numbers: &[f64]) -> Option<f64> {
        None
    }

    /// The dilatation θ of a point from its numbers, for laws that do not find it with the weighted volume m alone.
    fn dilatation(&self, _numbers: &[f64]) -> Option<f64> {
        None
    }

    /// Kirchhoff stress across the plane (Pa) in plane strain, at a displacement gradient of the plane. `None` for
    /// ν (τ_xx + τ_yy), which holds for laws that are linear in the strain.
    fn stress_across(
        &self,
        _gradient: &SMatrix<f64, D, D>,
        _plastic: &PlasticState,
    ) -> Option<f64> {
        None
    }

    /// Contribution of a bond to the stress of [`Self::stress_across`] if [`Self::HAS_BOND_STRESS_ACROSS`], Pa/m³.
    #[inline(always)]
    fn bond_stress_across(&self, _bond: &Bond<D>, _end: &Self::Point) -> Lanes {
        Lanes::splat(0.0)
    }

    /// Stretch F_zz across the plane in plane stress, at a displacement gradient of the plane. `None` for Hooke's
    /// law with logarithmic strains.
    fn stretch_across(
        &self,
        _gradient: &SMatrix<f64, D, D>,
        _plastic: &PlasticState,
    ) -> Option<f64> {
        None
    }

    /// Whether points need enough bonds in all directions, compared with a family that pre-cracks do not cut.
    fn needs_shape(&self) -> bool {
        false
    }

    /// Whether a point has too few intact bonds for the law, so that it carries no force.
    fn is_singular(&self, _numbers: &[f64]) -> bool {
        false
    }

    /// Energy that a bond has dissipated at one end without the energy of breaking, J/m⁶; also for broken bonds.
    #[inline(always)]
    fn dissipated(&self, _length: Lanes, _history: &Self::BondHistory) -> Lanes {
        Lanes::splat(0.0)
    }

    /// Fraction of its stiffness that an intact bond has lost at one end, from 0 to 1. The damage of the point counts
    /// this fraction of the bond as broken.
    #[inline(always)]
    fn lost_stiffness(&self, _history: &Self::BondHistory) -> Lanes {
        Lanes::splat(0.0)
    }

    /// A spring constant (N/m⁷) that the bond's and point's energy at one end nowhere exceed:
    /// W ≤ ½ Σ k (|Y| − |ξ|)² Ṽ. For bond-based laws |∂T/∂η|.
    fn stiffness(&self, length: Lanes, end: &Self::Point) -> Lanes;

    /// Whether the springs of [`Self::stiffness`] resist motions across the bonds as well:
    /// W ≤ ½ Σ k |η|² Ṽ.
    fn resists_across(&self) -> bool {
        false
    }

    /// Energy per bond of a point over that of an interior point at the same strain, from the sums of
    /// [`Self::reference_contribution`]. Above 1 for a truncated family of a law whose points hold the energy; else 1.
    fn truncation_factor(&self, _sums: &[f64]) -> f64 {
        1.0
    }

    /// Factor on the critical stretch of a bond, from the numbers of points i and j and the law of point j. Both ends
    /// compute the same factor.
    #[inline(always)]
    fn toughness_scale(&self, _bond: &Bond<D>, _points: [&Self::Point; 2], _other: &Self) -> Lanes {
        Lanes::splat(1.0)
    }
}
