//! Material laws, one a file. A law knows one bond, eight at a time, and nothing of decks, points,
//! ranks or fields.
//!
//! The force density that a bond exerts on point i is f = T_i⟨ξ⟩ − T_j⟨−ξ⟩ (Silling et al. 2007). The
//! force state T_i of an end depends on the bond, on numbers of the end's whole family (such as a
//! dilatation) and on numbers that the bond keeps from step to step (such as a plastic stretch). How
//! many there are of each, and how they are found, the law declares.

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
pub use correspondence::{FamilyShare, ShapeTensor, determinant, family_share};
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

/// What can be told of a law without bonds.
pub trait Described {
    /// Names and values of what it was given or has found, for people to read.
    fn described(&self) -> Vec<(&'static str, Property)>;
}

/// A material law: what bonds add to the numbers of a point, and the force state that follows.
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
    /// The numbers of a point that bonds read at both ends: first the constants, then those that are
    /// found anew before each sum of forces.
    type Point: LaneTuple;

    /// The numbers that a bond keeps for each of its ends; 0 at the start.
    type BondHistory: LaneTuple;

    /// What is summed over the whole family, once.
    type ReferenceSum: LaneTuple;

    /// What a pass sums over the intact bonds; passes that sum less leave the rest at 0.
    type Sum: LaneTuple;

    /// The force state's form.
    type Force: ForceState<D>;

    /// How many of the numbers of a point are constants.
    const CONSTANTS: usize = 0;

    /// How many sums over the bonds come before that of the forces.
    const PASSES: usize = 0;

    /// Numbers of a point that only its own law reads, after those of [`Self::Point`].
    const OWN_NUMBERS: usize = 0;

    /// Whether [`Self::force`] or [`Self::bond_history`] read the stretch of bonds.
    const FORCE_READS_STRETCH: bool = false;

    /// Whether [`Self::force`] reads the shortening of bonds.
    const FORCE_READS_EXTENSION: bool = true;

    /// How many dimensions there must be for bodies of the law.
    const LEAST_DIMENSION: usize = 1;

    /// Whether [`Self::pass_contribution`] reads the stretch of bonds.
    const SUM_READS_STRETCH: bool = true;

    /// Whether [`Self::pass_contribution`] reads the direction or the length of bonds, which those that only fill up a group
    /// do not have.
    const SUM_READS_DIRECTION: bool = false;

    /// Whether forces act along ξ and are linear in η; else bonds are those of the deformed body.
    const LINEAR: bool = false;

    /// For which vector instructions the loops of its forces, sums and energies are compiled.
    const ISA_SET: IsaSet = IsaSet::Each;

    /// Whether [`Self::toughness_scale`] is not 1.
    const SCALED: bool = false;

    /// Whether [`Self::lost_stiffness`] is not 0.
    const SOFTENS: bool = false;

    /// Whether the stress of a point is the mean of stresses of its bonds, and so is [`Self::stress_across`].
    const HAS_BOND_STRESS_ACROSS: bool = false;

    /// What a bond of the undeformed body adds to the sums over the whole family.
    #[inline(always)]
    fn reference_contribution(&self, _bond: &Bond<D>) -> Self::ReferenceSum {
        Self::ReferenceSum::splat(0.0)
    }

    /// The constants of a point from the sums over its whole family.
    fn constants(&self, _sums: &[f64], _numbers: &mut [f64]) {}

    /// What an intact bond adds to the sums of pass `S`, which may use the numbers found by the
    /// passes before.
    #[inline(always)]
    fn pass_contribution<const S: usize>(
        &self,
        _bond: &Bond<D>,
        _own: &Self::Point,
        _history: &Self::BondHistory,
    ) -> Self::Sum {
        Self::Sum::splat(0.0)
    }

    /// The numbers of a point from the sums of a pass: those of [`Self::Point`], then its own ones. What
    /// flow adds to the plastic state is kept in a step alone.
    fn update_point(
        &self,
        _pass: usize,
        _sums: &[f64],
        _numbers: &mut [f64],
        _plastic: &mut PlasticState,
    ) {
    }

    /// How many numbers points and bonds have. A law may need fewer passes and own numbers than its type declares.
    fn counts(&self) -> Counts {
        Counts::of::<Self, D>()
    }

    /// Whether points keep a [`PlasticState`].
    fn has_plasticity(&self) -> bool {
        false
    }

    /// Whether a pass sums the history of bonds as it is at the end of the step; else as it was at its beginning.
    fn reads_advanced_history(&self, _pass: usize) -> bool {
        false
    }

    /// What a bond keeps for an end when it has come to this deformation in a step (s).
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

    /// The force density of bonds by volume, T_i⟨ξ⟩ − T_j⟨−ξ⟩, with the weights of the ends; the same
    /// to the bit from both ends, up to its sign. Laws may find it in fewer operations.
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

    /// What a bond adds to the strain energy density of one end, J/m⁶.
    fn bond_energy(&self, bond: &Bond<D>, end: &Self::Point, history: &Self::BondHistory) -> Lanes;

    /// The part of a point's strain energy density (J/m³) that belongs to no single bond.
    fn point_energy(&self, _numbers: &[f64]) -> f64 {
        0.0
    }

    /// The weighted volume m (m⁵) of a point from its numbers, for laws that keep it.
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

    /// What a bond adds to the stress of [`Self::stress_across`], where [`Self::HAS_BOND_STRESS_ACROSS`], Pa/m³.
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

    /// Whether a point has too few bonds left for the law, and carries no force.
    fn is_singular(&self, _numbers: &[f64]) -> bool {
        false
    }

    /// What a bond, broken or not, has dissipated at one end without breaking, J/m⁶.
    #[inline(always)]
    fn dissipated(&self, _length: Lanes, _history: &Self::BondHistory) -> Lanes {
        Lanes::splat(0.0)
    }

    /// The share of its stiffness that an intact bond has lost at one end, from 0 to 1: it counts as broken to that
    /// share in the damage of the point.
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

    /// What the critical stretch of a bond is multiplied by, from the numbers of points i and j and the law of point j; the
    /// same from both ends.
    #[inline(always)]
    fn toughness_scale(&self, _bond: &Bond<D>, _points: [&Self::Point; 2], _other: &Self) -> Lanes {
        Lanes::splat(1.0)
    }
}
