//! Fracture energy that depends on the direction of a crack, for laminates and wood.
//!
//! Let a be a unit vector in the undeformed body, and n the direction of a bond. The critical work of the
//! bond is
//!
//! w_c(n) = w (p + q c^k).
//!
//! Cracks along the vector a have a normal perpendicular to this vector. Cracks across the vector a have the
//! normal a. The factor w is the critical work of a bond in an isotropic body. The fracture energy of this
//! body equals the fracture energy of cracks along a. If the fracture energy of cracks across a is at least
//! the fracture energy of cracks along a, c = (n·a)². Otherwise, c = 1 − (n·a)².
//!
//! A crack with the normal N breaks all bonds that cross its plane. The fracture energy of this crack is
//! proportional to a weighted mean of w_c(n): the mean is over all directions n, and the weight of a
//! direction is |n·N|. With the same weight, the mean of c^k is a product of k factors. The table gives the
//! factor j (j = 1 … k) for N parallel (∥) or perpendicular (⊥) to a:
//!
//! | c | N | plane | space |
//! |---|---|---|---|
//! | (n·a)² | ∥ a | 2j/(2j + 1) | j/(j + 1) |
//! | (n·a)² | ⊥ a | (2j − 1)/(2j + 1) | (2j − 1)/(2j + 2) |
//! | 1 − (n·a)² | ∥ a | (2j − 1)/(2j + 1) | j/(j + 1) |
//! | 1 − (n·a)² | ⊥ a | 2j/(2j + 1) | (2j + 1)/(2j + 2) |
//!
//! p and q follow from k and the fracture energies of cracks along and across a. k = 1 is used if it gives
//! p ≥ 0.1; otherwise k is 2. If k = 2 also gives p < 0.1, the fracture energies are rejected, because
//! bonds in the weak direction would break at small strains, far from any crack. A critical stretch is
//! multiplied by √(w_c/w).

use std::f64::consts::PI;

use crate::lanes::simd::Task;
use crate::lanes::{LaneTuple, Lanes, Simd};
use crate::material::Bond;

/// Maximum number of squarings of c, so k is at most 2. With k = 4 and a horizon of three spacings, only few
/// bonds would have a large critical work. These bonds would hold the faces of cracks together.
const MOST_SQUARINGS: u32 = 1;

/// Minimum of p.
const LEAST_CONSTANT_PART: f64 = 0.1;

/// Tolerance of [`LEAST_CONSTANT_PART`] for the round-off of p.
const ROUNDING: f64 = 1e-12;

/// Resolution of a sum over all directions: the number of azimuths per quarter of a circle. In 3-D, this
/// is also the number of z components between 0 and 1.
const DIRECTIONS: u32 = 256;

/// Factor w_c/w of the critical work of a bond, as a function of the bond's direction.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ToughnessByDirection {
    /// Unit vector a.
    axis: [f64; 3],
    /// Constant part p of w_c/w.
    constant_part: f64,
    /// Factor q of c^k in w_c/w.
    power_factor: f64,
    /// Binary logarithm of k.
    squarings: u32,
    /// Whether c is (n·a)². Otherwise, c is 1 − (n·a)².
    is_tough_across: bool,
}

impl ToughnessByDirection {
    /// The same fracture energy in all directions: w_c/w = 1.
    pub const NONE: Self = Self {
        axis: [0.0; 3],
        constant_part: 1.0,
        power_factor: 0.0,
        squarings: 0,
        is_tough_across: true,
    };

    /// Create the factor w_c/w in 2 or 3 dimensions. `axis` is the unit vector a. `ratio` is the fracture
    /// energy of cracks across this vector, divided by the fracture energy of cracks along this vector.
    /// `None` if `ratio` is outside [`Self::limits`].
    pub fn new(dimension: usize, axis: [f64; 3], ratio: f64) -> Option<Self> {
        let is_tough_across = ratio >= 1.0;
        (0..=MOST_SQUARINGS).find_map(|squarings| {
            let [across, along] = means(dimension, is_tough_across, squarings);
            let power_factor = (ratio - 1.0) / (across - along);
            let constant_part = 1.0 - power_factor * along;
            (constant_part >= LEAST_CONSTANT_PART - ROUNDING).then_some(Self {
                axis,
                constant_part,
                power_factor,
                squarings,
                is_tough_across,
            })
        })
    }

    /// Return the smallest and the largest `ratio` that [`Self::new`] accepts. For other ratios, the constant
    /// part p of w_c/w is below `LEAST_CONSTANT_PART`.
    pub fn limits(dimension: usize) -> [f64; 2] {
        [false, true].map(|is_tough_across| {
            let [across, along] = means(dimension, is_tough_across, MOST_SQUARINGS);
            LEAST_CONSTANT_PART + (1.0 - LEAST_CONSTANT_PART) * across / along
        })
    }

    /// Compute w_c/w of eight bonds from ξ and `inverse`, which is 1/|ξ|. The results at both ends are
    /// bit-identical.
    #[inline(always)]
    fn factor<S: Simd, const D: usize>(&self, simd: S, xi: [Lanes; D], inverse: Lanes) -> Lanes {
        let mut along = xi[0] * self.axis[0];
        for d in 1..D {
            along = simd.multiply_add(xi[d], Lanes::splat(self.axis[d]), along);
        }
        let cosine = along * inverse;
        let square = cosine * cosine;
        let mut power = if self.is_tough_across {
            square
        } else {
            (Lanes::splat(1.0) - square).max(Lanes::splat(0.0))
        };
        for _ in 0..self.squarings {
            power = power * power;
        }
        power * self.power_factor + Lanes::splat(self.constant_part)
    }

    /// Fracture energy of cracks across the axis a, divided by the fracture energy of cracks along this axis.
    pub fn ratio(&self, dimension: usize) -> f64 {
        let [across, _] = means(dimension, self.is_tough_across, self.squarings);
        self.constant_part + self.power_factor * across
    }

    /// Fracture energy of cracks with this unit normal, divided by the fracture energy of cracks along the
    /// axis a. The quotient is computed as a sum over bond directions.
    pub fn relative_fracture_energy(&self, dimension: usize, normal: [f64; 3]) -> f64 {
        let quarter = f64::from(DIRECTIONS);
        let mut sums = [0.0; 2];
        let mut add = |n: [f64; 3], solid_angle: f64| {
            let dot = |v: [f64; 3]| (0..3).map(|d| n[d] * v[d]).sum::<f64>();
            let weight = dot(normal).abs() * solid_angle;
            let square = dot(self.axis).powi(2);
            let c = if self.is_tough_across {
                square
            } else {
                1.0 - square
            };
            sums[0] +=
                weight * (self.constant_part + self.power_factor * c.powi(1 << self.squarings));
            sums[1] += weight;
        };
        for k in 0..2 * DIRECTIONS {
            let azimuth = (f64::from(k) + 0.5) * 0.5 * PI / quarter;
            let in_plane = [libm::cos(azimuth), libm::sin(azimuth)];
            if dimension == 2 {
                add([in_plane[0], in_plane[1], 0.0], 1.0);
                continue;
            }
            for j in 0..2 * DIRECTIONS {
                let height = (f64::from(j) + 0.5) / quarter - 1.0;
                let radius = (1.0 - height * height).sqrt();
                add([radius * in_plane[0], radius * in_plane[1], height], 1.0);
            }
        }
        sums[0] / sums[1]
    }
}

/// Return the means of c^k, k = 2^squarings, over the bonds that cross a plane. The first mean is for a plane
/// whose normal is parallel to a, the second for a plane whose normal is perpendicular to a.
fn means(dimension: usize, is_tough_across: bool, squarings: u32) -> [f64; 2] {
    let mut means = [1.0; 2];
    for j in 1..=1_u32 << squarings {
        let j = f64::from(j);
        let factors = match (dimension, is_tough_across) {
            (3, true) => [j / (j + 1.0), (2.0 * j - 1.0) / (2.0 * j + 2.0)],
            (3, false) => [j / (j + 1.0), (2.0 * j + 1.0) / (2.0 * j + 2.0)],
            (_, true) => [2.0 * j / (2.0 * j + 1.0), (2.0 * j - 1.0) / (2.0 * j + 1.0)],
            (_, false) => [(2.0 * j - 1.0) / (2.0 * j + 1.0), 2.0 * j / (2.0 * j + 1.0)],
        };
        for (mean, factor) in means.iter_mut().zip(factors) {
            *mean *= factor;
        }
    }
    means
}

/// Computation of the factors w_c/w at points i and j, from the directions of eight bonds.
pub(super) struct DirectionFactors<'a, const D: usize> {
    directions: &'a [ToughnessByDirection; 2],
    xi: [Lanes; D],
    inverse: Lanes,
}

impl<'a, const D: usize> DirectionFactors<'a, D> {
    /// Copy ξ and 1/|ξ| of the bonds. A reference to the bonds would keep all their data in memory instead of
    /// registers.
    #[inline(always)]
    pub(super) fn new<S: Simd>(
        simd: S,
        directions: &'a [ToughnessByDirection; 2],
        bond: &Bond<D>,
    ) -> Self {
        Self {
            directions,
            xi: LaneTuple::each(|d| simd.opaque(bond.reference[d])),
            inverse: simd.opaque(bond.inverse),
        }
    }
}

impl<const D: usize> Task for DirectionFactors<'_, D> {
    type Output = [Lanes; 2];

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> [Lanes; 2] {
        let [i, j] = self.directions;
        [
            i.factor(simd, self.xi, self.inverse),
            j.factor(simd, self.xi, self.inverse),
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_bonds_across_an_area_take_the_energy_of_its_direction() {
        let axis = [0.6, 0.8, 0.0];
        let normals_along: &[[f64; 3]] = &[[-0.8, 0.6, 0.0], [0.0, 0.0, 1.0]];
        for dimension in [2, 3] {
            let [least, most] = ToughnessByDirection::limits(dimension);
            for ratio in [least, 0.5 * (1.0 + least), 1.0, 1.4, 2.4, most] {
                let toughness = ToughnessByDirection::new(dimension, axis, ratio).unwrap();
                let across = toughness.relative_fracture_energy(dimension, axis);
                assert!(
                    (across / ratio - 1.0).abs() < 1e-4,
                    "{dimension} {ratio}: {across}"
                );
                for normal in &normals_along[..dimension - 1] {
                    let along = toughness.relative_fracture_energy(dimension, *normal);
                    assert!((along - 1.0).abs() < 1e-4, "{dimension} {ratio}: {along}");
                }
                assert!(toughness.constant_part > 0.099 && toughness.power_factor >= 0.0);
                assert!((toughness.ratio(dimension) / ratio - 1.0).abs() < 1e-12);
            }
            for beyond in [0.999 * least, 1.001 * most] {
                assert_eq!(ToughnessByDirection::new(dimension, axis, beyond), None);
            }
        }
    }
}
