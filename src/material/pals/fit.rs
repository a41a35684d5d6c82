//! The fits of ω and σ of [`Pals`](super::Pals) to the family of a point. n is the direction of a bond, and N
//! has the components N_a = n_a². A sum over the family has the weight |ξ|² Ṽ per bond, unless a formula
//! gives the terms.

use nalgebra::{DMatrix, DVector, SMatrix};

use crate::material::monomials::{index_of, least_squares, multiplicity};
use crate::material::symmetric::mixed;

/// Smallest allowed σ/σ₀; bonds with σ ≤ 0 would repel when stretched. For a horizon of 3 spacings, the
/// smallest σ/σ₀ at a corner of a cuboid is about 0.4.
const SMALLEST: f64 = 0.1;

/// Largest allowed σ/σ₀. Without a limit and for a horizon of 3 spacings, σ/σ₀ reaches 1.8 at edges of a
/// cuboid, 12 in bars that are three points thick, and 30 in sheets of two layers.
const LARGEST: f64 = 30.0;

/// Singular values below this fraction of the largest singular value are dropped; the solution of smallest
/// norm is used.
///
/// For a horizon of 3 spacings, the ratio of the smallest to the largest singular value is 0.08 at a corner
/// of a cuboid, 0.007 in a sheet of two layers, and 0 in a single layer.
const RANK: f64 = 5e-3;

/// The exponents and the coefficient of a monomial of degree 2 in the components of n or N.
type Monomial = ([usize; 3], f64);

/// A polynomial of degree 2 in the components of n or N.
type Quadratic = [Monomial];

/// Return the sum of the product of two polynomials over a family, from the sums of the monomials of degree
/// 4.
fn product(sums: &[f64], first: &Quadratic, second: &Quadratic) -> f64 {
    let mut total = 0.0;
    for (a, of_a) in first {
        for (b, of_b) in second {
            let both: [usize; 3] = std::array::from_fn(|d| a[d] + b[d]);
            total += of_a * of_b * sums[index_of(both)];
        }
    }
    total
}

/// Return the exponents of the product of the components with the indices `a` and `b`.
fn of_product(a: usize, b: usize) -> [usize; 3] {
    let mut exponents = [0; 3];
    exponents[a] += 1;
    exponents[b] += 1;
    exponents
}

/// Result of a fit: among all functions of the bond direction with prescribed sums over the family, the
/// function nearest to a constant.
pub(super) struct Fit<const D: usize> {
    /// Matrix of the function: T in n·T n or N·T N.
    pub(super) tensor: SMatrix<f64, D, D>,
    /// Sum of the squared function over the family.
    pub(super) square: f64,
    /// Sum of the function over the family.
    pub(super) sum: f64,
}

/// Fit the function g = c + Σ τ_k p_k, a sum over the conditions k with the multipliers τ_k. For each
/// condition k, the sum of p_k g over the family must be wanted_k, as far as the family allows. c is
/// `constant`; p_k and wanted_k are the entries of `conditions`.
///
/// `sums` are the sums of the monomials of degree 4, in the components of n or N, over the family.
/// `one` is the polynomial of degree 2 that equals 1: n·n, or (Σ N_a)².
fn nearest<const D: usize>(
    sums: &[f64],
    constant: f64,
    one: &Quadratic,
    conditions: &[(Vec<Monomial>, f64)],
) -> Fit<D> {
    let count = conditions.len();
    let matrix = DMatrix::from_fn(count, count, |r, c| {
        product(sums, &conditions[r].0, &conditions[c].0)
    });
    let missing = DVector::from_fn(count, |r, _| {
        let (polynomial, wanted) = &conditions[r];
        wanted - constant * product(sums, polynomial, one)
    });
    let multipliers = least_squares(matrix, &missing, RANK);
    let multipliers = multipliers.unwrap_or_else(|| DVector::zeros(count));
    let scaled = |polynomial: &Quadratic, factor: f64| -> Vec<_> {
        let each = polynomial.iter();
        each.map(|(exponents, value)| (*exponents, value * factor))
            .collect()
    };
    let mut function = scaled(one, constant);
    for ((polynomial, _), multiplier) in conditions.iter().zip(multipliers.iter()) {
        function.extend(scaled(polynomial, *multiplier));
    }
    Fit {
        tensor: SMatrix::from_fn(|a, b| {
            let wanted = of_product(a, b);
            let terms = function
                .iter()
                .filter(|(exponents, _)| *exponents == wanted);
            terms.map(|(_, value)| value).sum::<f64>() / multiplicity(wanted)
        }),
        square: product(sums, &function, &function),
        sum: product(sums, &function, one),
    }
}

/// Return the polynomial n·n = 1. The matrix of c n·n is Λ = c I.
fn one_in_directions<const D: usize>() -> Vec<([usize; 3], f64)> {
    (0..D).map(|a| (of_product(a, a), 1.0)).collect()
}

/// Return the polynomial (Σ N_a)² = 1. The matrix of c (Σ N_a)² is S with S_ab = c.
fn one_in_squares<const D: usize>() -> Vec<([usize; 3], f64)> {
    let pairs = (0..D).flat_map(|a| (0..D).map(move |b| (a, b)));
    pairs.map(|(a, b)| (of_product(a, b), 1.0)).collect()
}

/// Fit ω with the conditions Σ |ξ|² ω n_a n_b Ṽ = δ_ab, from the sums of |ξ|² Ṽ times the monomials of n.
/// `weighted_volume` is m = Σ |ξ|² Ṽ (m⁵), which gives ω₀ = d/m.
///
/// Mixed conditions have the weight √2, because each represents two components. Therefore the fitted function
/// rotates with the family.
pub(super) fn dilatational_fit<const D: usize>(sums: &[f64], weighted_volume: f64) -> Fit<D> {
    let axes = (0..D).map(|a| (vec![(of_product(a, a), 1.0)], 1.0));
    let shears = mixed::<D>().map(|(a, b)| (vec![(of_product(a, b), 2_f64.sqrt())], 0.0));
    let conditions: Vec<_> = axes.chain(shears).collect();
    let one = one_in_directions::<D>();
    nearest(sums, D as f64 / weighted_volume, &one, &conditions)
}

/// Fit σ/σ₀ with the conditions Σ |ξ|² σ (n·dev H n)² Ṽ = 2G dev H : dev H, from the sums of |ξ|² Ṽ times the
/// monomials of N.
///
/// The probe strains H are unit strains H_aa = 1 along the axes, and pure shears H_ab = H_ba = 1/√2 between
/// the axes.
pub(super) fn deviatoric_fit<const D: usize>(sums: &[f64], weighted_volume: f64) -> Fit<D> {
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
    let conditions: Vec<_> = axes
        .chain(shears)
        .map(|(square, norm)| (square, norm * modulus))
        .collect();
    nearest(sums, 1.0, &one_in_squares::<D>(), &conditions)
}

/// Return the smallest and the largest N·S N over all N with N_a ≥ 0 and Σ N_a = 1. These N form a triangle
/// in 3-D and a line segment in 2-D. The extremes lie at a corner of the triangle, on an edge or inside.
pub(super) fn extremes<const D: usize>(tensor: &SMatrix<f64, D, D>) -> [f64; 2] {
    let mut values: Vec<f64> = tensor.diagonal().iter().copied().collect();
    for (a, b) in mixed::<D>() {
        // On an edge N = (t, 1 − t), so N·S N is a parabola in t.
        let [first, second, both] = [tensor[(a, a)], tensor[(b, b)], tensor[(a, b)]];
        let t = (second - both) / (first + second - 2.0 * both);
        if (0.0..=1.0).contains(&t) {
            let u = 1.0 - t;
            values.push(first * t * t + 2.0 * both * t * u + second * u * u);
        }
    }
    // At an extreme inside the triangle all components of S N are equal, and N·S N equals this component.
    if D == 3
        && let Some(inverse) = DMatrix::from_fn(D, D, |a, b| tensor[(a, b)]).try_inverse()
    {
        let rows: Vec<f64> = inverse.row_iter().map(|row| row.sum()).collect();
        let value = 1.0 / rows.iter().sum::<f64>();
        if rows.iter().all(|row| row * value >= 0.0) {
            values.push(value);
        }
    }
    let each = values.into_iter().filter(|value| value.is_finite());
    each.fold(
        [f64::INFINITY, f64::NEG_INFINITY],
        |[least, most], value| [least.min(value), most.max(value)],
    )
}

/// Limit σ/σ₀ to the range from [`SMALLEST`] to [`LARGEST`], by a factor on its difference from 1.
pub(super) fn limited<const D: usize>(tensor: SMatrix<f64, D, D>) -> SMatrix<f64, D, D> {
    let [least, most] = extremes(&tensor);
    let share = |value: f64, limit: f64| {
        let beyond = (value - limit) * (limit - 1.0) > 0.0;
        if beyond {
            (limit - 1.0) / (value - 1.0)
        } else {
            1.0
        }
    };
    let share = share(least, SMALLEST).min(share(most, LARGEST));
    tensor.map(|entry| 1.0 + share * (entry - 1.0))
}

/// Return the smallest λ with k′θ² + Σ σ ε² Ṽ ≤ λ Σ σ e² Ṽ for all extensions e, in `d` dimensions.
///
/// In the scalar product ⟨a, b⟩ = Σ σ a b Ṽ, θ = ⟨r, e⟩ with r = ω|ξ|/σ, and ε = e − (θ/d)|ξ|.
/// The inputs are R ≥ ⟨r, r⟩, Q = ⟨|ξ|, |ξ|⟩ and τ = ⟨r, |ξ|⟩ = Σ ω|ξ|² Ṽ. These give the components of ε
/// along r and normal to r.
/// λ is the larger eigenvalue of [[k′R + (1 − τ/d)² + g², −g], [−g, 1]] with g² = (RQ − τ²)/d². λ grows with
/// R.
pub(super) fn largest_ratio(bulk_modulus: f64, d: f64, [r, q, tau]: [f64; 3]) -> f64 {
    let across = (r * q - tau * tau).max(0.0) / (d * d);
    let determinant = bulk_modulus * r + (1.0 - tau / d).powi(2);
    let trace = determinant + across + 1.0;
    0.5 * (trace + (trace * trace - 4.0 * determinant).max(0.0).sqrt())
}

/// Return the weighted volume Σ |ξ|² Ṽ (m⁵) from the sums of |ξ|² Ṽ times the monomials of n.
pub(super) fn weighted_volume<const D: usize>(sums: &[f64]) -> f64 {
    let one = one_in_directions::<D>();
    product(sums, &one, &one)
}

/// Return the sum Σ σ|ξ|² Ṽ for σ = N·S N, from the sums of |ξ|² Ṽ times the monomials of N.
pub(super) fn sum_of_squares<const D: usize>(sums: &[f64], tensor: &SMatrix<f64, D, D>) -> f64 {
    let pairs = (0..D).flat_map(|a| (0..D).map(move |b| (a, b)));
    let polynomial: Vec<_> = pairs
        .map(|(a, b)| (of_product(a, b), tensor[(a, b)]))
        .collect();
    product(sums, &polynomial, &one_in_squares::<D>())
}

#[cfg(test)]
mod tests {
    use nalgebra::Vector3;

    use super::*;
    use crate::material::symmetric::from_entries;

    #[test]
    fn extremes_are_those_of_a_fine_grid() {
        for entries in [
            [1.0, 2.0, 3.0, 0.5, -0.4, 0.2],
            [1.0, 1.0, 1.0, 3.0, 2.0, 2.5],
            [2.0, 1.0, 1.5, 0.1, 0.2, -0.9],
            [1.0, 1.0, 1.0, 1.0, 1.0, 1.0],
        ] {
            let tensor = from_entries::<3>(&entries);
            let (mut least, mut most) = (f64::INFINITY, f64::NEG_INFINITY);
            let count = 300;
            for a in 0..=count {
                for b in 0..=count - a {
                    let n =
                        Vector3::new(a, b, count - a - b).map(|k| f64::from(k) / f64::from(count));
                    let value = n.dot(&(tensor * n));
                    (least, most) = (least.min(value), most.max(value));
                }
            }
            let [exact_least, exact_most] = extremes(&tensor);
            assert!(
                (exact_least - least).abs() < 1e-4,
                "{entries:?}: {exact_least} {least}"
            );
            assert!(
                (exact_most - most).abs() < 1e-4,
                "{entries:?}: {exact_most} {most}"
            );
        }
    }
}
