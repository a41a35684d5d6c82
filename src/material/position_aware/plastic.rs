//! Elastic–perfectly plastic solid with the influence functions of [`PositionAware`].
//!
//! Each bond has a plastic extension e_p per end. Energy and force are those of [`PositionAware`] at the
//! elastic extensions e − e_p. Let ε_d be the elastic extension minus |ξ| times the mean elastic stretch of
//! the intact bonds:
//!
//! ε_d = e − e_p − |ξ| Σ ω|ξ| (e − e_p) Ṽ/Σ ω|ξ|² Ṽ.
//!
//! This definition implies Σ ω|ξ| ε_d Ṽ = 0.
//!
//! A point yields if Σ σ ε_d² Ṽ > σ_y²/(3G). This limit is twice the deviatoric energy density at which the
//! equivalent stress of von Mises is the yield stress σ_y. Away from surfaces, the yield condition is that of
//! [`super::super::OrdinaryPlastic`]. The return is radial: e_p grows by (1 − r) ε_d, with r² Σ σ ε_d² Ṽ =
//! σ_y²/(3G). Because Σ ω|ξ| ε_d Ṽ = 0, plastic flow does not change θ.
//!
//! While all bonds are intact, ε_d equals the ε of [`PositionAware`] at the elastic extensions. If bonds are
//! broken, ε = ε_d + c|ξ|, where c has one value per point. The energy, as a function of 1 − r, then has its
//! minimum at 1 − r = Σ σ ε ε_d Ṽ/Σ σ ε_d² Ṽ, with ε and ε_d before the flow. A larger 1 − r would add
//! energy, so 1 − r is limited to this value.

use super::{
    Along, Bond, Declaration, Declared, Described, Functions, Law, MONOMIALS, OTHERS, PlasticState,
    PositionAware, Property,
};
use crate::lanes::{IsaSet, Lanes};

/// The constants of the law.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PositionAwarePlastic {
    elastic: PositionAware,
    /// σ_y²/(3G), Pa.
    limit: f64,
}

impl PositionAwarePlastic {
    /// Create the law from its elastic law, the yield stress (Pa) and the shear modulus (Pa).
    pub(in super::super) fn new(
        elastic: PositionAware,
        yield_stress: f64,
        shear_modulus: f64,
    ) -> Self {
        Self {
            elastic,
            limit: yield_stress * yield_stress / (3.0 * shear_modulus),
        }
    }
}

/// The law has no name of its own in decks. Decks select it with `ordinary_plastic` and a
/// `surface_correction`.
impl Declared for PositionAwarePlastic {
    const DECLARATIONS: &'static [Declaration] = &[];
}

impl Described for PositionAwarePlastic {
    fn described(&self) -> Vec<(&'static str, Property)> {
        let mut facts = self.elastic.described();
        facts.push(("yields", Property::Text("by each point's own family")));
        facts
    }
}

/// Return a bond with its stretch reduced by the plastic stretch.
#[inline(always)]
fn elastic<const D: usize>(bond: &Bond<D>, plastic: Lanes) -> Bond<D> {
    let mut bond = *bond;
    bond.stretch = bond.stretch - plastic;
    bond
}

impl<const D: usize> Law<D> for PositionAwarePlastic {
    /// The numbers of [`PositionAware`], then the mean elastic stretch Σ ω|ξ| (e − e_p) Ṽ/Σ ω|ξ|² Ṽ, and
    /// 1 − r.
    type Point = (Functions<D>, [Lanes; OTHERS + 4]);
    /// e_p/|ξ|, and the dissipated energy, J/m⁶.
    type BondHistory = [Lanes; 2];
    type ReferenceSum = [Lanes; 2 * MONOMIALS];
    type Sum = [Lanes; 3];
    type Force = Along;
    const ISA_SET: IsaSet = IsaSet::Avx2;
    const CONSTANTS: usize = 4 * D + OTHERS;
    const PASSES: usize = 3;
    const LEAST_DIMENSION: usize = 2;
    /// The only own number of a point is the dilatation θ.
    const OWN_NUMBERS: usize = 1;
    const SUM_READS_DIRECTION: bool = true;
    const FORCE_READS_STRETCH: bool = true;

    #[inline(always)]
    fn reference_contribution(&self, bond: &Bond<D>) -> Self::ReferenceSum {
        self.elastic.reference_contribution(bond)
    }

    fn constants(&self, sums: &[f64], numbers: &mut [f64]) {
        Law::<D>::constants(&self.elastic, sums, numbers);
    }

    /// Pass 0: Σ ω|ξ| (e − e_p) Ṽ and Σ ω|ξ|² Ṽ. Pass 1: Σ σ ε_d² Ṽ and Σ σ|ξ| ε_d Ṽ, Pa. Pass 2: the sums of
    /// [`PositionAware`] after the flow.
    #[inline(always)]
    fn pass_contribution<const S: usize>(
        &self,
        bond: &Bond<D>,
        (functions, [ratio, pressure, isotropic_stretch, mean, _]): &Self::Point,
        [plastic, _]: &[Lanes; 2],
    ) -> [Lanes; 3] {
        let bond = elastic(bond, *plastic);
        let square = bond.length * bond.length;
        let nothing = Lanes::splat(0.0);
        match S {
            0 => {
                let [omega, _] = self.elastic.form.of_bonds(&bond, functions);
                let weight = omega * square;
                [weight * bond.stretch, weight, nothing]
            }
            1 => {
                let part = bond.stretch - *mean;
                let weighted = self.elastic.form.sigma(&bond, &functions.1) * square * part;
                [weighted * part, weighted, nothing]
            }
            _ => {
                let point = (*functions, [*ratio, *pressure, *isotropic_stretch]);
                self.elastic.pass_contribution::<0>(&bond, &point, &[])
            }
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
        let changing = &mut numbers[4 * D + OTHERS..];
        match pass {
            0 => {
                let [sum, square] = [sums[0], sums[1]];
                changing[1] = sum / D as f64;
                changing[2] = if square > 0.0 { sum / square } else { 0.0 };
            }
            1 => {
                let [square, product] = [sums[0], sums[1]];
                // Without bonds the square is 0, so the point does not yield.
                changing[3] = if square > self.limit {
                    let most = 1.0 + (changing[2] - changing[1]) * product / square;
                    (1.0 - (self.limit / square).sqrt()).min(most).max(0.0)
                } else {
                    0.0
                };
            }
            _ => [changing[0], changing[1], changing[4]] = self.elastic.dilated(sums),
        }
    }

    fn reads_advanced_history(&self, pass: usize) -> bool {
        pass == 2
    }

    #[inline(always)]
    fn bond_history(
        &self,
        bond: &Bond<D>,
        (functions, [.., isotropic_stretch, mean, plastic_fraction]): &Self::Point,
        [plastic, loss]: &[Lanes; 2],
        _: f64,
    ) -> [Lanes; 2] {
        let stretch = bond.stretch - *plastic;
        let change = (stretch - *mean) * *plastic_fraction;
        let factor = self.elastic.form.sigma(bond, &functions.1) * (bond.length * bond.length);
        let dissipated = factor * (stretch - *isotropic_stretch - change) * change;
        [*plastic + change, *loss + dissipated]
    }

    #[inline(always)]
    fn force_state(
        &self,
        bond: &Bond<D>,
        (functions, [ratio, pressure, isotropic_stretch, ..]): &Self::Point,
        [plastic, _]: &[Lanes; 2],
    ) -> Along {
        let point = (
            *functions,
            [*ratio, *pressure, *isotropic_stretch + *plastic],
        );
        self.elastic.force_state(bond, &point, &[])
    }

    #[inline(always)]
    fn bond_energy(
        &self,
        bond: &Bond<D>,
        (functions, [ratio, pressure, isotropic_stretch, ..]): &Self::Point,
        [plastic, _]: &[Lanes; 2],
    ) -> Lanes {
        let point = (
            *functions,
            [*ratio, *pressure, *isotropic_stretch + *plastic],
        );
        self.elastic.bond_energy(bond, &point, &[])
    }

    fn point_energy(&self, numbers: &[f64]) -> f64 {
        self.elastic.dilatation_energy(numbers[4 * D + OTHERS + 4])
    }

    #[inline(always)]
    fn dissipated(&self, _: Lanes, [_, loss]: &[Lanes; 2]) -> Lanes {
        *loss
    }

    fn dilatation(&self, numbers: &[f64]) -> Option<f64> {
        Some(numbers[4 * D + OTHERS + 4])
    }

    fn truncation_factor(&self, sums: &[f64]) -> f64 {
        Law::<D>::truncation_factor(&self.elastic, sums)
    }

    #[inline(always)]
    fn stiffness(&self, bond: &Bond<D>, (functions, [ratio, ..]): &Self::Point) -> Lanes {
        self.elastic.form.sigma(bond, &functions.1) * *ratio
    }
}
