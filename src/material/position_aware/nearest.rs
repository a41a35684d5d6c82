//! The functions ω = n·Λ n and σ = N·S N that satisfy all [`Conditions`] and are nearest to ω₀ and σ₀. n is
//! the direction of the bond, and N_a = n_a². The symmetric tensors Λ and S are fitted to the family of each
//! point. The dilatation is linear in the strain. It is therefore exact for every homogeneous strain, not
//! only for the probe strains.
//!
//! The distance of ω from ω₀ is Σ |ξ|² (ω − ω₀)² Ṽ, and that of σ from σ₀ is Σ |ξ|² (σ − σ₀)² Ṽ.

use nalgebra::{DMatrix, DVector, SMatrix};

use super::Fit;
use super::conditions::{Conditions, Quadratic, of_product, one_in_squares, product};
use crate::material::monomials::{least_squares, multiplicity};
use crate::material::symmetric::mixed;

/// Smallest allowed σ/σ₀; stretched bonds with σ < 0 would repel. For a horizon of 3 spacings, the smallest
/// σ/σ₀ at a corner of a cuboid is about 0.4.
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

/// Return the tensors Λ of ω and S of σ, and R, Q and τ for [`super::largest_ratio`]. The parameters of this
/// function are those of [`super::Form::fit`].
pub fn fit<const D: usize>(
    [of_directions, of_squares]: [&[f64]; 2],
    [dilatational, deviatoric]: [&Conditions<D>; 2],
    reference: f64,
) -> Fit<D> {
    let omega = nearest(dilatational, of_directions);
    let relative = limited(nearest(deviatoric, of_squares).tensor);
    let [least, _] = extremes(&relative);
    let sigma = relative * reference;
    let square = sigma_weighted_volume(of_squares, &sigma);
    Fit {
        omega: omega.tensor,
        sigma,
        products: [omega.square / (least * reference), square, omega.sum],
    }
}

/// The function of the bond direction that satisfies the conditions and is nearest to a constant.
struct Function<const D: usize> {
    /// Matrix T of the function. The function is n·T n for ω, and N·T N for σ/σ₀.
    tensor: SMatrix<f64, D, D>,
    /// Sum of the squared function over the family.
    square: f64,
    /// Sum of the function over the family.
    sum: f64,
}

/// Return the function g = c + Σ τ_k p_k, with c and p_k of `conditions`. The multipliers τ_k are fitted to
/// the conditions by least squares, because some families cannot meet all conditions.
/// `sums` are the sums, over the family, of the monomials of degree 4 in the components of n or N.
fn nearest<const D: usize>(conditions: &Conditions<D>, sums: &[f64]) -> Function<D> {
    let (each, count) = (&conditions.each, conditions.each.len());
    let matrix = DMatrix::from_fn(count, count, |r, c| product(sums, &each[r].0, &each[c].0));
    let missing = DVector::from_fn(count, |r, _| {
        let (polynomial, wanted) = &each[r];
        wanted - conditions.of_constant(sums, polynomial)
    });
    let multipliers = least_squares(matrix, &missing, RANK);
    let multipliers = multipliers.unwrap_or_else(|| DVector::zeros(count));
    let scaled = |polynomial: &Quadratic, factor: f64| -> Vec<_> {
        let each = polynomial.iter();
        each.map(|(exponents, value)| (*exponents, value * factor))
            .collect()
    };
    let mut function = scaled(&conditions.one, conditions.constant);
    for ((polynomial, _), multiplier) in each.iter().zip(multipliers.iter()) {
        function.extend(scaled(polynomial, *multiplier));
    }
    Function {
        tensor: SMatrix::from_fn(|a, b| {
            let wanted = of_product(a, b);
            let terms = function
                .iter()
                .filter(|(exponents, _)| *exponents == wanted);
            terms.map(|(_, value)| value).sum::<f64>() / multiplicity(wanted)
        }),
        square: product(sums, &function, &function),
        sum: product(sums, &function, &conditions.one),
    }
}

/// Return the smallest and the largest N·S N over all N with N_a ≥ 0 and Σ N_a = 1. These N form a triangle
/// in 3-D and a line segment in 2-D. The extremes lie at a corner of the triangle, on an edge or inside.
fn extremes<const D: usize>(tensor: &SMatrix<f64, D, D>) -> [f64; 2] {
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

/// Limit σ/σ₀ to the range from [`SMALLEST`] to [`LARGEST`], by scaling its difference from 1.
fn limited<const D: usize>(tensor: SMatrix<f64, D, D>) -> SMatrix<f64, D, D> {
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

/// Return Σ σ|ξ|² Ṽ for σ = N·S N, with S = `tensor`. `sums` are the sums of |ξ|² Ṽ times the monomials of
/// degree 4 in the components of N.
fn sigma_weighted_volume<const D: usize>(sums: &[f64], tensor: &SMatrix<f64, D, D>) -> f64 {
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
