//! Material laws. A law computes forces and energies of bonds, eight bonds at a time. Laws do not depend on
//! decks, points, ranks or fields.
//!
//! The force density that a bond exerts on point i, per volume of point j, is f = T_i⟨ξ⟩ − T_j⟨−ξ⟩ (Silling
//! et al. 2007). The force state T_i depends on three inputs:
//!
//! - the bond;
//! - the *numbers* of point i, which the law stores per point, such as the dilatation of its family;
//! - the *bond history*, which the law stores per bond and end, such as a plastic stretch.
//!
//! A law declares the counts of its point numbers and history values, and computes these values. An *end* of
//! a bond is point i or point j. An *untruncated* family is a full ball of neighbours, without surfaces or
//! cracks. The *initial* family of a point is its family before any bond breaks. It consists of the bonds
//! over which step 1 of [`Law`] sums. ξ is the undeformed bond, η the relative displacement of its ends, and
//! Y = ξ + η the deformed bond. ω is the influence function, and Ṽ the corrected volume of j.

mod any;
pub mod bond;
mod correspondence;
mod declaration;
mod elastic_plastic_pmb;
mod ellipsoid;
mod fatigue_pmb;
mod force_state;
mod influence;
mod linear_microelastic;
mod monomials;
mod normalised;
mod ordinary;
mod ordinary_plastic;
mod ordinary_viscoelastic;
mod plastic_state;
mod pmb;
mod position_aware;
mod registration;
pub mod rotation;
mod softening_pmb;
mod surface_pmb;
mod symmetric;

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

// All laws by file and type, in the order of the table of laws in the book.
registration::register! {
    $
    pmb::Pmb,
    elastic_plastic_pmb::ElasticPlasticPmb,
    softening_pmb::SofteningPmb,
    fatigue_pmb::FatiguePmb,
    normalised::Normalised,
    surface_pmb::SurfacePmb,
    linear_microelastic::LinearMicroelastic,
    ordinary::Ordinary,
    position_aware::PositionAware,
    ordinary_plastic::OrdinaryPlastic,
    position_aware::PositionAwarePlastic,
    ordinary_viscoelastic::OrdinaryViscoelastic,
    position_aware::PositionAwareViscoelastic,
    correspondence::Correspondence,
    correspondence::BondAssociated,
}

use std::fmt;

use nalgebra::SMatrix;

use crate::lanes::{IsaSet, LaneTuple, Lanes, Simd};
use bond::Weights;

/// A property of a law, for the reports that the command-line program prints.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Property {
    /// A number and its unit; the unit is empty for dimensionless numbers.
    Number(f64, &'static str),
    /// A text.
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

/// Deformation and stress of a point, for laws with a deformation gradient per point.
#[derive(Debug, Clone, Copy)]
pub struct FamilyStress<const D: usize> {
    /// Displacement gradient H = F − I.
    pub gradient: SMatrix<f64, D, D>,
    /// First Piola–Kirchhoff stress P, Pa.
    pub piola: SMatrix<f64, D, D>,
    /// Plastic state of the point after the plastic flow at this gradient.
    pub plastic: PlasticState,
}

/// Description of a law for reports.
pub trait Described {
    /// Return names and values of given and derived properties, for display.
    fn described(&self) -> Vec<(&'static str, Property)>;
}

/// A material law. It computes the numbers of each point from the bonds of the point. It also computes the
/// force states of bonds.
///
/// The loops over the bonds multiply the results of the law by ω and Ṽ, so the law contains neither factor.
/// The loops call a law in these steps:
///
/// 1. Once, over the bonds that pre-cracks do not cut (over all bonds if [`Self::needs_shape`]):
///    [`Self::reference_contribution`] → sums → [`Self::constants`], and [`Self::truncation_factor`] if a
///    damage criterion reads this factor.
/// 2. Before each force evaluation, in each of the [`Self::PASSES`] passes over the intact bonds:
///    [`Self::pass_contribution`] → sums → [`Self::update_point`]. After the last pass, the numbers are sent
///    to the ghosts.
/// 3. In the force evaluation: [`Self::bond_history`] and [`Self::force_state`] of both ends.
pub trait Law<const D: usize>: Copy + Send + Sync {
    /// Numbers of a point that the loops over bonds read for both ends of a bond. The
    /// [constants](Self::constants) come first. The other numbers are recomputed before each force
    /// evaluation.
    type Point: LaneTuple;

    /// Bond history: numbers that are stored for each end of a bond; initially 0.
    type BondHistory: LaneTuple;

    /// Sums over the initial family, computed once.
    type ReferenceSum: LaneTuple;

    /// Sums of a pass over the intact bonds. If a pass needs fewer sums than this type contains, it sets the
    /// other sums to 0.
    type Sum: LaneTuple;

    /// Type of the force state.
    type Force: ForceState<D>;

    /// Count of the constants among the numbers of a point.
    const CONSTANTS: usize = 0;

    /// Number of passes over the bonds before the pass that computes the forces.
    const PASSES: usize = 0;

    /// Count of a point's own numbers. Only functions that are called per point, such as
    /// [`Self::point_energy`], read the own numbers. The loops over bonds do not read the own numbers, and
    /// ghosts have none. The own numbers are stored after the numbers of [`Self::Point`].
    const OWN_NUMBERS: usize = 0;

    /// Whether [`Self::force_state`] or [`Self::bond_history`] reads [`Bond::stretch`].
    const FORCE_READS_STRETCH: bool = false;

    /// Whether [`Self::force_state`] reads [`Bond::extension_over_deformed`].
    const FORCE_READS_EXTENSION: bool = true;

    /// Smallest dimension of space that the law supports.
    const LEAST_DIMENSION: usize = 1;

    /// Whether [`Self::pass_contribution`] reads [`Bond::stretch`].
    const SUM_READS_STRETCH: bool = true;

    /// Whether [`Self::pass_contribution`] reads the direction or the length of bonds. Lanes without a bond
    /// have no direction and no length. The loops therefore set the contributions of these lanes to 0.
    const SUM_READS_DIRECTION: bool = false;

    /// Whether forces act along ξ and are linear in η. Otherwise forces depend on the deformed bonds.
    const LINEAR: bool = false;

    /// Instruction sets for which the loops that compute forces, sums and energies are compiled.
    const ISA_SET: IsaSet = IsaSet::Each;

    /// Whether the law overrides [`Self::toughness_scale`].
    const SCALED: bool = false;

    /// Whether the law overrides [`Self::lost_stiffness`].
    const SOFTENS: bool = false;

    /// Whether the law overrides [`Self::is_worn_out`].
    const WEARS_OUT: bool = false;

    /// Whether [`Self::force_state`] or [`Self::bond_energy`] reads the bond history. Otherwise, the history
    /// is computed only in evaluations that store the history.
    const FORCE_READS_HISTORY: bool = true;

    /// Whether the out-of-plane stress of a point is the mean of the stresses of its bonds. If so, the caller
    /// computes this mean: it sums the contributions that [`Self::out_of_plane_bond_stress`] returns for the
    /// bonds. This sum replaces the value of [`Self::out_of_plane_stress`], unless this value is `None`.
    const HAS_OUT_OF_PLANE_BOND_STRESS: bool = false;

    /// Return the contribution of an undeformed bond to the sums over the initial family.
    #[inline(always)]
    fn reference_contribution(&self, _bond: &Bond<D>) -> Self::ReferenceSum {
        Self::ReferenceSum::splat(0.0)
    }

    /// Compute the constants of a point from the sums over its initial family, and write them to the first
    /// entries of `_numbers`.
    fn constants(&self, _sums: &[f64], _numbers: &mut [f64]) {}

    /// Return the contribution of an intact bond to the sums of pass `S`. The contribution may depend on the
    /// numbers that earlier passes computed.
    #[inline(always)]
    fn pass_contribution<const S: usize>(
        &self,
        _bond: &Bond<D>,
        _own: &Self::Point,
        _history: &Self::BondHistory,
    ) -> Self::Sum {
        Self::Sum::splat(0.0)
    }

    /// Compute the numbers of a point from the sums of a pass. `_numbers` contains the numbers of
    /// [`Self::Point`], then the own numbers ([`Self::OWN_NUMBERS`]). Also update `_plastic`, the plastic
    /// state of the point. The caller stores an updated plastic state only at the end of a step. `_step` is
    /// the time (s) since the plastic state was stored; 0 if no time has passed.
    fn update_point(
        &self,
        _pass: usize,
        _sums: &[f64],
        _numbers: &mut [f64],
        _plastic: &mut PlasticState,
        _step: f64,
    ) {
    }

    /// Return the sizes of the data per point and per bond. An instance may need fewer passes and fewer own
    /// numbers ([`Self::OWN_NUMBERS`]) than its type declares.
    fn counts(&self) -> Counts {
        Counts::of::<Self, D>()
    }

    /// Test whether points store a [`PlasticState`].
    fn has_plasticity(&self) -> bool {
        false
    }

    /// Correct the plastic state of a point that is the mean of the states of other points.
    fn correct_mean(&self, _plastic: &mut PlasticState) {}

    /// Test whether a pass reads the advanced bond history, which belongs to the end of the step. Otherwise
    /// the pass reads the history that belongs to the start of the step.
    fn reads_advanced_history(&self, _pass: usize) -> bool {
        false
    }

    /// Return the bond history of one end after a time step of length `_step` (s). `before` is the history at
    /// the start of the step, and `_bond` has the deformation at the end of the step.
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

    /// Return the force state T of one end, N/m⁶. A force along the bond is returned as T/|Y|, or T/|ξ| for
    /// linear laws, N/m⁷.
    fn force_state(
        &self,
        bond: &Bond<D>,
        end: &Self::Point,
        history: &Self::BondHistory,
    ) -> Self::Force;

    /// Return the force density of bonds per volume of j, T_i⟨ξ⟩ − T_j⟨−ξ⟩ (N/m⁶), with the weights of both
    /// ends. If the force acts along the bond, the result is the force density divided by |Y|, or by |ξ| for
    /// linear laws (N/m⁷). The results for points i and j have the same bits, except for the sign. Laws may
    /// override this function to save operations.
    #[inline(always)]
    fn bond_force<S: Simd>(
        _simd: S,
        laws: &[Self; 2],
        bond: &Bond<D>,
        points: [&Self::Point; 2],
        history: &[Self::BondHistory; 2],
        weights: Weights,
    ) -> Self::Force {
        let force_state_i = laws[0].force_state(bond, points[0], &history[0]);
        let force_state_j = laws[1].force_state(bond, points[1], &history[1]);
        match weights {
            Weights::One => force_state_i.plus(force_state_j),
            Weights::Same(weight) => force_state_i.plus(force_state_j).times(weight),
            Weights::Each([own, far]) => force_state_i.times(own).plus(force_state_j.times(far)),
        }
    }

    /// Return the [work](ForceState::work) of the force state of one end, J/m⁶. `rotation` is the
    /// [`Self::rotation`] of the family of this end.
    #[inline(always)]
    fn end_work<S: Simd>(
        &self,
        simd: S,
        bond: &Bond<D>,
        end: &Self::Point,
        history: &Self::BondHistory,
        rotation: &<Self::Force as ForceState<D>>::Rotation,
    ) -> Lanes {
        let force = self.force_state(bond, end, history);
        force.work(simd, bond, Self::LINEAR, rotation)
    }

    /// Return the rotation of a family from the sums of the first pass. The default is the identity, for
    /// laws whose forces act along the bonds.
    fn rotation(&self, _sums: &[f64]) -> Rotation {
        rotation::IDENTITY
    }

    /// Compute the stress of a point, for laws with a deformation gradient per point. `None` for all other
    /// laws, and if the point carries no stress. The arguments are the sums of the first pass, the point
    /// numbers, and the plastic state. The plastic state may already include the plastic flow of the step.
    fn family_stress(
        &self,
        _sums: &[f64],
        _numbers: &[f64],
        _state: &PlasticState,
    ) -> Option<FamilyStress<D>> {
        None
    }

    /// Return the contribution of a bond to the strain energy density of one end, per volume of the point at
    /// the other end, J/m⁶.
    fn bond_energy(&self, bond: &Bond<D>, end: &Self::Point, history: &Self::BondHistory) -> Lanes;

    /// Return the part of a point's strain energy density (J/m³) that is not a sum over bonds.
    fn point_energy(&self, _numbers: &[f64]) -> f64 {
        0.0
    }

    /// Return the weighted volume m (m⁵) of a point from the numbers of this point; `None` if the law does
    /// not store m, or the point has no bonds.
    fn weighted_volume(&self, _numbers: &[f64]) -> Option<f64> {
        None
    }

    /// Return the dilatation θ of a point, without thermal strain, from the numbers of this point. If `None`,
    /// the caller computes θ = (d/m) Σ ω|ξ| e Ṽ, with the number of dimensions d, the weighted volume m and
    /// the extension e = |Y| − |ξ|.
    fn dilatation(&self, _numbers: &[f64]) -> Option<f64> {
        None
    }

    /// Return the out-of-plane Kirchhoff stress τ_zz (Pa) in plane strain, at an in-plane displacement
    /// gradient. If `None`, the caller uses ν (τ_xx + τ_yy), which is correct for laws that are linear in the
    /// strain.
    fn out_of_plane_stress(
        &self,
        _gradient: &SMatrix<f64, D, D>,
        _plastic: &PlasticState,
    ) -> Option<f64> {
        None
    }

    /// Return the contribution of a bond to the out-of-plane Kirchhoff stress, per volume of j, Pa/m³; for
    /// laws with [`Self::HAS_OUT_OF_PLANE_BOND_STRESS`].
    #[inline(always)]
    fn out_of_plane_bond_stress(&self, _bond: &Bond<D>, _end: &Self::Point) -> Lanes {
        Lanes::splat(0.0)
    }

    /// Return the out-of-plane stretch F_zz in plane stress, at an in-plane displacement gradient. If `None`,
    /// the caller computes F_zz from Hooke's law with logarithmic strains.
    fn out_of_plane_stretch(
        &self,
        _gradient: &SMatrix<f64, D, D>,
        _plastic: &PlasticState,
    ) -> Option<f64> {
        None
    }

    /// Test whether the law inverts the shape tensor of a point, and therefore needs bonds in all directions.
    /// The initial family of a point then includes the bonds that pre-cracks cut, so that the law can compare
    /// the intact bonds with all bonds of the point.
    fn needs_shape(&self) -> bool {
        false
    }

    /// Test whether a point carries no force. There are three possible causes:
    ///
    /// - The shape tensor of the intact bonds is nearly singular.
    /// - The intact part of the family is too stiff.
    /// - The law has no stress at the deformation of the point or of one of its bonds.
    fn is_singular(&self, _numbers: &[f64]) -> bool {
        false
    }

    /// Return the energy that an intact or broken bond has dissipated at one end, J/m⁶. The energy of
    /// breaking the bond is not included. `_length` is |ξ|, m.
    #[inline(always)]
    fn dissipated(&self, _length: Lanes, _history: &Self::BondHistory) -> Lanes {
        Lanes::splat(0.0)
    }

    /// Return the fraction of the stiffness that an intact bond has lost at one end, from 0 to 1. The
    /// damage of the point at this end counts this fraction of the bond as broken.
    #[inline(always)]
    fn lost_stiffness(&self, _history: &Self::BondHistory) -> Lanes {
        Lanes::splat(0.0)
    }

    /// Return one bit per bond, set if the bond breaks because of its history at one end. The bit counts only
    /// if the force state of this end acts on the bond. The bond breaks even if its body has no damage law.
    /// The bits are checked in each force evaluation that stores the history.
    #[inline(always)]
    fn is_worn_out<S: Simd>(&self, _simd: S, _history: &Self::BondHistory) -> u8 {
        0
    }

    /// Return a spring constant k (N/m⁷) per bond that bounds the strain energy density W (J/m³) of one end:
    /// W ≤ ½ Σ k (|Y| − |ξ|)² Ṽ. If [`Self::resists_across`] returns true, k satisfies only the weaker bound
    /// W ≤ ½ Σ k |η|² Ṽ. For bond-based laws k = |∂T/∂η|.
    fn stiffness(&self, bond: &Bond<D>, end: &Self::Point) -> Lanes;

    /// Test whether the springs of [`Self::stiffness`] must also resist displacements across the bonds. If
    /// they must, the bound of the strain energy density W is ½ Σ k |η|² Ṽ instead of ½ Σ k (|Y| − |ξ|)² Ṽ.
    fn resists_across(&self) -> bool {
        false
    }

    /// Return the energy per bond of a point, divided by the energy per bond in an untruncated family at the
    /// same strain. `_sums` are the sums of [`Self::reference_contribution`].
    ///
    /// Some laws give a truncated family the same energy density as an untruncated family. For truncated
    /// families, these laws return more than 1. All other laws return 1.
    fn truncation_factor(&self, _sums: &[f64]) -> f64 {
        1.0
    }

    /// Return the factor on the critical stretch of a bond. The factor is computed from the point numbers of
    /// i and j, and from the law of point j. Points i and j compute the same factor.
    #[inline(always)]
    fn toughness_scale(&self, _bond: &Bond<D>, _points: [&Self::Point; 2], _other: &Self) -> Lanes {
        Lanes::splat(1.0)
    }
}
