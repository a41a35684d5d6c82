//! Conditions on the functions ω and σ of a point. n is the direction of a bond, and N has the components
//! N_a = n_a². Where a comment describes a sum over the family in words, each bond has the weight |ξ|² Ṽ.
//! Formulas contain this weight explicitly.

use crate::material::monomials::index_of;
use crate::material::symmetric::mixed;

/// The exponents and the coefficient of a monomial of degree 2 in the components of n or N.
pub(super) type Monomial = ([usize; 3], f64);

/// A polynomial of degree 2 in the components of n or N.
pub(super) type Quadratic = [Monomial];

/// Return the sum, over a family, of the product of two polynomials. `sums` are the sums of the monomials of
/// degree 4 over this family.
pub(super) fn product(sums: &[f64], first: &Quadratic, second: &Quadratic) -> f64 {
    let mut total = 0.0;
    for (a, of_a) in first {
        for (b, of_b) in second {
            let both: [usize; 3] = std::array::from_fn(|d| a[d] + b[d]);
            total += of_a * of_b * sums[index_of(both)];
        }
    }
    total
}

/// Return the exponents of the monomial that is the product of component `a` and component `b`.
pub(super) fn of_product(a: usize, b: usize) -> [usize; 3] {
    let mut exponents = [0; 3];
    exponents[a] += 1;
    exponents[b] += 1;
    exponents
}

/// The conditions on a function g of the bond direction. Condition k requires that the sum of p_k g over the
/// family is wanted_k. Here p_k is a polynomial, and wanted_k is the value of this sum in the solid.
pub struct Conditions<const D: usize> {
    /// The value c of g in an untruncated family of the continuum.
    pub(super) constant: f64,
    /// A polynomial of degree 2 in the components of n or N. Its value is 1 for every direction n. The
    /// polynomial is n·n, or (Σ N_a)² with N_a = n_a².
    pub(super) one: Vec<Monomial>,
    /// p_k and wanted_k of each condition. The conditions for unit extensions along the axes come first, then
    /// the conditions for shears between two axes.
    pub(super) each: Vec<(Vec<Monomial>, f64)>,
}

impl<const D: usize> Conditions<D> {
    /// Create the conditions Σ |ξ|² ω n_a n_b Ṽ = δ_ab on ω. `weighted_volume` is m = Σ |ξ|² Ṽ (m⁵). The
    /// constant c of these conditions is ω₀ = d/m.
    ///
    /// Conditions with a ≠ b have the weight √2, because each of them represents the components ab and ba.
    /// Therefore, if the family rotates, the function ω of [`Nearest`](super::Nearest) rotates in the same
    /// way.
    pub(super) fn dilatational(weighted_volume: f64) -> Self {
        let axes = (0..D).map(|a| (vec![(of_product(a, a), 1.0)], 1.0));
        let shears = mixed::<D>().map(|(a, b)| (vec![(of_product(a, b), 2_f64.sqrt())], 0.0));
        Self {
            constant: D as f64 / weighted_volume,
            one: one_in_directions::<D>(),
            each: axes.chain(shears).collect(),
        }
    }

    /// Create the conditions on g = σ/σ₀, with c = 1. Here σ₀ is A/m, and m = Σ |ξ|² Ṽ (m⁵) is
    /// `weighted_volume`. The condition for a probe strain H is
    /// Σ |ξ|² σ (n·dev H n)² Ṽ = 2G dev H : dev H.
    ///
    /// The probe strains H are unit strains H_aa = 1 along the axes, and pure shears H_ab = H_ba = 1/√2
    /// between the axes.
    pub(super) fn deviatoric(weighted_volume: f64) -> Self {
        let count = D as f64;
        let axes = (0..D).map(|k| {
            let part = |a: usize| {
                if a == k {
                    1.0 - 1.0 / count
                } else {
                    -1.0 / count
                }
            };
            let pairs = (0..D).flat_map(|a| (0..D).map(move |b| (a, b)));
            let square = pairs.map(|(a, b)| (of_product(a, b), part(a) * part(b)));
            (square.collect(), 1.0 - 1.0 / count)
        });
        let shears = mixed::<D>().map(|(a, b)| (vec![(of_product(a, b), 2.0)], 1.0));
        // The ratio 2G/σ₀ with σ₀ = A/m.
        let modulus = 2.0 / (count * (count + 2.0)) * weighted_volume;
        let conditions = axes.chain(shears);
        Self {
            constant: 1.0,
            one: one_in_squares::<D>(),
            each: conditions
                .map(|(square, norm)| (square, norm * modulus))
                .collect(),
        }
    }

    /// Return the sum of p_k c over the family. `polynomial` is p_k, and `sums` are the sums of the monomials
    /// of degree 4 over this family.
    pub(super) fn of_constant(&self, sums: &[f64], polynomial: &Quadratic) -> f64 {
        self.constant * product(sums, polynomial, &self.one)
    }
}

/// Return the polynomial n·n, which equals 1.
pub(super) fn one_in_directions<const D: usize>() -> Vec<Monomial> {
    (0..D).map(|a| (of_product(a, a), 1.0)).collect()
}

/// Return the polynomial (Σ N_a)², which equals 1.
pub(super) fn one_in_squares<const D: usize>() -> Vec<Monomial> {
    let pairs = (0..D).flat_map(|a| (0..D).map(move |b| (a, b)));
    pairs.map(|(a, b)| (of_product(a, b), 1.0)).collect()
}

/// Return the weighted volume Σ |ξ|² Ṽ (m⁵). `sums` contains Σ |ξ|² Ṽ p for each monomial p of degree 4 in
/// the components of n.
pub(super) fn weighted_volume<const D: usize>(sums: &[f64]) -> f64 {
    let one = one_in_directions::<D>();
    product(sums, &one, &one)
}
