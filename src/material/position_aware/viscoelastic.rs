//! Standard linear solid with the influence functions of [`PositionAware`]: the deviatoric part of the force
//! relaxes.
//!
//! Each bond has a back extension e_b per end, which follows the deviatoric extension ε of [`PositionAware`].
//! With the relaxing fraction λ ([`Relaxation`]),
//!
//! W = ½ k′θ² + ½ Σ σ (ε² + λ (e_b² − 2 ε e_b)) Ṽ,
//!
//! t = (k′θ − (1/d) Σ σ|ξ| (ε − λ e_b) Ṽ) ω|ξ| + σ (ε − λ e_b).

use super::super::ordinary_viscoelastic::Relaxation;
use super::{
    Along, Bond, Declaration, Declared, Described, Functions, Law, MONOMIALS, OTHERS, PlasticState,
    PositionAware, Property,
};
use crate::lanes::{IsaSet, Lanes};

/// The constants of the law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PositionAwareViscoelastic {
    elastic: PositionAware,
    relaxation: Relaxation,
}

impl PositionAwareViscoelastic {
    /// Create the law from its elastic law and its relaxation.
    pub(in super::super) fn new(elastic: PositionAware, relaxation: Relaxation) -> Self {
        Self {
            elastic,
            relaxation,
        }
    }
}

/// The law has no name of its own in decks. Decks select it with `ordinary_viscoelastic` and a
/// `surface_correction`.
impl Declared for PositionAwareViscoelastic {
    const DECLARATIONS: &'static [Declaration] = &[];
}

impl Described for PositionAwareViscoelastic {
    fn described(&self) -> Vec<(&'static str, Property)> {
        let mut facts = self.elastic.described();
        facts.extend(self.relaxation.described());
        facts
    }
}

impl<const D: usize> Law<D> for PositionAwareViscoelastic {
    /// The numbers of [`PositionAware`], but k′θ − (1/d) Σ σ|ξ| (ε − λ e_b) Ṽ (Pa) replaces
    /// k′θ − (1/d) Σ σ|ξ| ε Ṽ.
    type Point = (Functions<D>, [Lanes; OTHERS + 2]);
    /// e_b/|ξ|, ε/|ξ|, and the dissipated energy, J/m⁶.
    type BondHistory = [Lanes; 3];
    type ReferenceSum = [Lanes; 2 * MONOMIALS];
    type Sum = [Lanes; 3];
    type Force = Along;
    const ISA_SET: IsaSet = IsaSet::Avx2;
    const CONSTANTS: usize = 4 * D + OTHERS;
    const PASSES: usize = 2;
    const LEAST_DIMENSION: usize = 2;
    /// The only own number of a point is the dilatation θ.
    const OWN_NUMBERS: usize = 1;
    const SUM_READS_DIRECTION: bool = true;
    const FORCE_READS_STRETCH: bool = true;
    const SCALED: bool = true;

    #[inline(always)]
    fn reference_contribution(&self, bond: &Bond<D>) -> Self::ReferenceSum {
        self.elastic.reference_contribution(bond)
    }

    fn constants(&self, sums: &[f64], numbers: &mut [f64]) {
        Law::<D>::constants(&self.elastic, sums, numbers);
    }

    /// Pass 0: the sums of [`PositionAware`]. Pass 1: Σ σ|ξ| e_b Ṽ, Pa.
    #[inline(always)]
    fn pass_contribution<const S: usize>(
        &self,
        bond: &Bond<D>,
        point: &Self::Point,
        [back, ..]: &[Lanes; 3],
    ) -> [Lanes; 3] {
        if S == 0 {
            return self.elastic.pass_contribution::<0>(bond, point, &[]);
        }
        let factor = self.elastic.form.sigma(bond, &point.0.1) * (bond.length * bond.length);
        let nothing = Lanes::splat(0.0);
        [factor * *back, nothing, nothing]
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
        let changing = &mut numbers[4 * D + OTHERS..];
        if pass == 0 {
            changing[..3].copy_from_slice(&self.elastic.dilated(sums));
        } else {
            changing[0] += self.relaxation.share() / D as f64 * sums[0];
        }
    }

    fn reads_advanced_history(&self, pass: usize) -> bool {
        pass == 1
    }

    #[inline(always)]
    fn bond_history(
        &self,
        bond: &Bond<D>,
        (functions, [_, _, isotropic_stretch]): &Self::Point,
        history: &[Lanes; 3],
        step: f64,
    ) -> [Lanes; 3] {
        let factor = self.elastic.form.sigma(bond, &functions.1) * (bond.length * bond.length);
        (self.relaxation).after(bond.stretch - *isotropic_stretch, history, factor, step)
    }

    #[inline(always)]
    fn force_state(
        &self,
        bond: &Bond<D>,
        (functions, [ratio, pressure, isotropic_stretch]): &Self::Point,
        [back, ..]: &[Lanes; 3],
    ) -> Along {
        let isotropic_and_relaxed = *isotropic_stretch + *back * self.relaxation.share();
        (self.elastic).force_state(
            bond,
            &(*functions, [*ratio, *pressure, isotropic_and_relaxed]),
            &[],
        )
    }

    #[inline(always)]
    fn bond_energy(
        &self,
        bond: &Bond<D>,
        (functions, [_, _, isotropic_stretch]): &Self::Point,
        [back, ..]: &[Lanes; 3],
    ) -> Lanes {
        let part = bond.stretch - *isotropic_stretch;
        let square = part * part + self.relaxation.change_of_square(part, *back);
        square * (bond.length * bond.length) * self.elastic.form.sigma(bond, &functions.1) * 0.5
    }

    fn point_energy(&self, numbers: &[f64]) -> f64 {
        Law::<D>::point_energy(&self.elastic, numbers)
    }

    #[inline(always)]
    fn dissipated(&self, _: Lanes, [.., loss]: &[Lanes; 3]) -> Lanes {
        *loss
    }

    fn dilatation(&self, numbers: &[f64]) -> Option<f64> {
        Law::<D>::dilatation(&self.elastic, numbers)
    }

    fn truncation_factor(&self, sums: &[f64]) -> f64 {
        Law::<D>::truncation_factor(&self.elastic, sums)
    }

    #[inline(always)]
    fn stiffness(&self, bond: &Bond<D>, (functions, [ratio, ..]): &Self::Point) -> Lanes {
        self.elastic.form.sigma(bond, &functions.1) * *ratio
    }

    #[inline(always)]
    fn toughness_scale(&self, bond: &Bond<D>, points: [&Self::Point; 2], other: &Self) -> Lanes {
        (self.elastic).toughness_scale(bond, points, &other.elastic)
    }
}
