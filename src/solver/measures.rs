//! What is summed over a family at set-up and for output: constants, stiffness, stress, dilatation.

use crate::material::{Arithmetic, Lanes, Law};

use super::geometry::Loaded;
use super::kernels::{Kernel, Pick};

/// Sums what gives a point's constant, over its whole family.
#[derive(Clone, Copy)]
pub struct Constant<L> {
    /// The law of the own end.
    pub law: L,
}

impl<L: Law, const D: usize> Kernel<D> for Constant<L> {
    type Sums = Lanes;
    type Output = f64;
    const FILLED: bool = true;

    fn linear(&self) -> bool {
        L::LINEAR
    }

    #[inline(always)]
    fn start(&self) -> Lanes {
        Lanes::splat(0.0)
    }

    #[inline(always)]
    fn add<A: Arithmetic>(&self, bonds: &Loaded<D>, sum: &mut Lanes) -> u8 {
        let share = self.law.constant_share(bonds.bond.length) * bonds.volume;
        *sum += A::select(share * bonds.weights.own(), bonds.filled, 0.0);
        bonds.intact
    }

    #[inline(always)]
    fn finish(&self, sum: &Lanes, pick: &impl Pick, output: &mut f64) {
        *output += pick.sum(*sum);
    }
}

/// Sums the volume of the neighbours in each point's own family, m³.
#[derive(Clone, Copy)]
pub struct FamilyVolume;

impl<const D: usize> Kernel<D> for FamilyVolume {
    type Sums = Lanes;
    type Output = f64;

    fn linear(&self) -> bool {
        true
    }

    #[inline(always)]
    fn start(&self) -> Lanes {
        Lanes::splat(0.0)
    }

    #[inline(always)]
    fn add<A: Arithmetic>(&self, bonds: &Loaded<D>, sum: &mut Lanes) -> u8 {
        *sum += A::select(bonds.volume, bonds.family(), 0.0);
        bonds.intact
    }

    #[inline(always)]
    fn finish(&self, sum: &Lanes, pick: &impl Pick, output: &mut f64) {
        *output += pick.sum(*sum);
    }
}

/// Entries of a symmetric tensor in the order xx, yy, zz, xy, yz, xz.
const PAIRS: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)];

/// Adds strength · a⊗a of the intact bonds to the entries of a symmetric tensor.
#[inline(always)]
fn add_dyads<A: Arithmetic, const D: usize>(
    sums: &mut [Lanes; 6],
    strength: Lanes,
    along: &[Lanes; D],
    intact: u8,
) {
    for (sum, (a, b)) in sums.iter_mut().zip(PAIRS) {
        if a < D && b < D {
            *sum += A::select(strength * along[a] * along[b], intact, 0.0);
        }
    }
}

fn finish_tensor(sums: &[Lanes; 6], pick: &impl Pick, output: &mut [f64; 6]) {
    for (output, sum) in output.iter_mut().zip(sums) {
        *output += pick.sum(*sum);
    }
}

/// Sums D = Σ V C n⊗n over the intact bonds, undeformed (N/m⁴), as xx, yy, zz, xy, yz, xz; C adds up
/// [`Law::stiffness`] of both ends.
#[derive(Clone, Copy)]
pub struct Stiffness<L> {
    /// Laws of the own and of the far end.
    pub laws: [L; 2],
}

impl<L: Law, const D: usize> Kernel<D> for Stiffness<L> {
    type Sums = [Lanes; 6];
    type Output = [f64; 6];
    const CONSTANT: bool = L::CONSTANT;

    fn linear(&self) -> bool {
        L::LINEAR
    }

    #[inline(always)]
    fn start(&self) -> [Lanes; 6] {
        [Lanes::splat(0.0); 6]
    }

    #[inline(always)]
    fn add<A: Arithmetic>(&self, bonds: &Loaded<D>, sums: &mut [Lanes; 6]) -> u8 {
        let length = bonds.bond.length;
        let own = self.laws[0].stiffness(length, &bonds.ends[0]) * bonds.weights.own();
        let far = self.laws[1].stiffness(length, &bonds.ends[1]) * bonds.weights.far();
        let weight = (own + far) * bonds.volume / (length * length);
        add_dyads::<A, D>(sums, weight, &bonds.reference, bonds.intact);
        bonds.intact
    }

    #[inline(always)]
    fn finish(&self, sums: &[Lanes; 6], pick: &impl Pick, output: &mut [f64; 6]) {
        finish_tensor(sums, pick, output);
    }
}

/// Sums the stress Σ T⊗Y Ṽ over the intact bonds (Pa) as xx, yy, zz, xy, yz, xz.
///
/// Silling & Lehoucq 2008 give the first Piola–Kirchhoff stress of a homogeneous motion as
/// Σ T⊗ξ Ṽ; times Fᵀ it is this, the Kirchhoff stress, symmetric and turning with the body. Linear
/// laws have ξ in place of Y.
#[derive(Clone, Copy)]
pub struct Stress<L> {
    /// Law of the own end.
    pub law: L,
}

impl<L: Law, const D: usize> Kernel<D> for Stress<L> {
    type Sums = [Lanes; 6];
    type Output = [f64; 6];
    const CONSTANT: bool = L::CONSTANT;
    const STATE: bool = L::STATE;

    fn linear(&self) -> bool {
        L::LINEAR
    }

    #[inline(always)]
    fn start(&self) -> [Lanes; 6] {
        [Lanes::splat(0.0); 6]
    }

    #[inline(always)]
    fn add<A: Arithmetic>(&self, bonds: &Loaded<D>, sums: &mut [Lanes; 6]) -> u8 {
        let strength = self.law.force(&bonds.bond, &bonds.ends[0]) * bonds.weights.own();
        let strength = strength * bonds.volume * bonds.inverse_length;
        add_dyads::<A, D>(sums, strength, &bonds.along, bonds.intact);
        bonds.intact
    }

    #[inline(always)]
    fn finish(&self, sums: &[Lanes; 6], pick: &impl Pick, output: &mut [f64; 6]) {
        finish_tensor(sums, pick, output);
    }
}

/// The sums of a dilatation.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Expansion {
    /// Weighted volume m = Σ ω|ξ|²Ṽ of the whole family, m⁵.
    pub weighted_volume: f64,
    /// Σ ω|ξ|εṼ over the intact bonds, m⁵.
    pub growth: f64,
}

/// Sums what gives the dilatation θ = (d/m) Σ ω|ξ|εṼ.
#[derive(Clone, Copy)]
pub struct Dilatation {
    /// Whether to take ε linear in η.
    pub linear: bool,
}

impl<const D: usize> Kernel<D> for Dilatation {
    type Sums = [Lanes; 2];
    type Output = Expansion;
    const FILLED: bool = true;

    fn linear(&self) -> bool {
        self.linear
    }

    #[inline(always)]
    fn start(&self) -> [Lanes; 2] {
        [Lanes::splat(0.0); 2]
    }

    #[inline(always)]
    fn add<A: Arithmetic>(&self, bonds: &Loaded<D>, sums: &mut [Lanes; 2]) -> u8 {
        let length = bonds.bond.length;
        let weight = length * length * bonds.volume * bonds.weights.own();
        let growth = weight * bonds.bond.stretch;
        sums[0] += A::select(weight, bonds.filled, 0.0);
        sums[1] += A::select(growth, bonds.intact, 0.0);
        bonds.intact
    }

    #[inline(always)]
    fn finish(&self, sums: &[Lanes; 2], pick: &impl Pick, output: &mut Expansion) {
        output.weighted_volume += pick.sum(sums[0]);
        output.growth += pick.sum(sums[1]);
    }
}
