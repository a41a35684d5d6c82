//! What is summed over a family at set-up and for output: constants, stiffness, stress, dilatation.

use crate::families::Row;
use crate::material::{Lanes, Law};

use super::geometry::Geometry;
use super::kernels::{Bonded, Kernel};

/// Sums what gives a point's constant, over its whole family.
pub struct Constant<'a, L, const D: usize> {
    /// The points.
    pub geometry: Geometry<'a, D>,
    /// The law of the own end.
    pub law: L,
}

impl<L: Law, const D: usize> Kernel for Constant<'_, L, D> {
    type Output = f64;

    fn points(&self) -> usize {
        self.geometry.points()
    }

    #[inline(always)]
    unsafe fn row(&self, row: Row<'_>, output: &mut f64) {
        for (group, neighbours) in row.neighbours.iter().enumerate() {
            // SAFETY: passed on to the caller.
            let loaded = unsafe { self.geometry.load(row.point, neighbours, L::LINEAR) };
            let share = self.law.constant_share(loaded.bond.length) * loaded.volume;
            let share = share * row.weight_here(group);
            *output += share.select(row.filled(group), 0.0).sum();
        }
    }
}

/// Entries of a symmetric tensor in the order xx, yy, zz, xy, yz, xz.
const PAIRS: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2)];

/// Sums D = Σ V C n⊗n over the intact bonds, undeformed (N/m⁴), as xx, yy, zz, xy, yz, xz; C adds up
/// [`Law::stiffness`] of both ends.
pub struct Stiffness<'a, L, const D: usize> {
    /// The bonds; states are not read.
    pub bonded: Bonded<'a, L, D>,
}

impl<L: Law, const D: usize> Kernel for Stiffness<'_, L, D> {
    type Output = [f64; 6];

    fn points(&self) -> usize {
        self.bonded.points()
    }

    #[inline(always)]
    unsafe fn row(&self, row: Row<'_>, output: &mut [f64; 6]) {
        let bonded = &self.bonded;
        let here = bonded.shared.here::<L>(row.point);
        for (group, neighbours) in row.neighbours.iter().enumerate() {
            // SAFETY: passed on to the caller.
            let loaded = unsafe { bonded.geometry.load(row.point, neighbours, L::LINEAR) };
            // SAFETY: as above.
            let there = unsafe { bonded.shared.there::<L>(neighbours) };
            let length = loaded.bond.length;
            let own = bonded.laws[0].stiffness(length, &here) * row.weight_here(group);
            let far = bonded.laws[1].stiffness(length, &there) * row.weight_there(group);
            let weight = (own + far) * loaded.volume / (length * length);
            for (sum, (a, b)) in output.iter_mut().zip(PAIRS) {
                if a < D && b < D {
                    let entry = weight * loaded.reference[a] * loaded.reference[b];
                    *sum += entry.select(row.intact[group], 0.0).sum();
                }
            }
        }
    }
}

/// Sums the stress Σ T⊗Y Ṽ over the intact bonds (Pa) as xx, yy, zz, xy, yz, xz.
///
/// Silling & Lehoucq 2008 give the first Piola–Kirchhoff stress of a homogeneous motion as
/// Σ T⊗ξ Ṽ; times Fᵀ it is this, the Kirchhoff stress, symmetric and turning with the body. Linear
/// laws have ξ in place of Y.
pub struct Stress<'a, L, const D: usize> {
    /// The bonds.
    pub bonded: Bonded<'a, L, D>,
}

impl<L: Law, const D: usize> Kernel for Stress<'_, L, D> {
    type Output = [f64; 6];

    fn points(&self) -> usize {
        self.bonded.points()
    }

    #[inline(always)]
    unsafe fn row(&self, row: Row<'_>, output: &mut [f64; 6]) {
        let bonded = &self.bonded;
        let here = bonded.shared.here::<L>(row.point);
        for (group, neighbours) in row.neighbours.iter().enumerate() {
            // SAFETY: passed on to the caller.
            let loaded = unsafe { bonded.geometry.load(row.point, neighbours, L::LINEAR) };
            let strength = bonded.laws[0].force(&loaded.bond, &here) * row.weight_here(group);
            let strength = strength * loaded.volume * loaded.inverse_length;
            for (sum, (a, b)) in output.iter_mut().zip(PAIRS) {
                if a < D && b < D {
                    let entry = strength * loaded.along[a] * loaded.along[b];
                    *sum += entry.select(row.intact[group], 0.0).sum();
                }
            }
        }
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
pub struct Dilatation<'a, const D: usize> {
    /// The points.
    pub geometry: Geometry<'a, D>,
    /// Whether to take ε linear in η.
    pub linear: bool,
}

impl<const D: usize> Kernel for Dilatation<'_, D> {
    type Output = Expansion;

    fn points(&self) -> usize {
        self.geometry.points()
    }

    #[inline(always)]
    unsafe fn row(&self, row: Row<'_>, output: &mut Expansion) {
        for (group, neighbours) in row.neighbours.iter().enumerate() {
            // SAFETY: passed on to the caller.
            let loaded = unsafe { self.geometry.load(row.point, neighbours, self.linear) };
            let length = loaded.bond.length;
            let weight: Lanes = length * length * loaded.volume * row.weight_here(group);
            let growth = weight * loaded.bond.stretch;
            output.weighted_volume += weight.select(row.filled(group), 0.0).sum();
            output.growth += growth.select(row.intact[group], 0.0).sum();
        }
    }
}
