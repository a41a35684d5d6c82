//! The function h = n·H n with a symmetric tensor H. H is a least-squares fit to all components of the
//! elastic tensor, so it does not depend on the coordinate axes. In an untruncated family H is nearly I. Near
//! a surface H is larger normal to the surface than along it.

use nalgebra::{DMatrix, DVector, SMatrix, SymmetricEigen};

use crate::material::monomials::{exponents, index_of, least_squares, multiplicity};

/// Smallest allowed eigenvalue of H. Without this limit, stretched bonds would repel in bodies that are two
/// or three points thick.
const SMALLEST: f64 = 0.2;

/// Largest allowed eigenvalue of H. Without this limit, the stiffness of points whose few neighbours lie
/// nearly in one plane would be unbounded.
const LARGEST: f64 = 30.0;

/// Singular values below this fraction of the largest singular value are dropped; the solution of smallest
/// norm is used.
///
/// For a horizon of 3 spacings, the ratio of the smallest to the largest singular value is 0.23 at a corner
/// of a plate, 0.14 at a corner of a cuboid, and 0.1 in a strip two points wide. The ratio is below 1e-4 in a
/// slightly bent strip one point wide.
const RANK: f64 = 1e-2;

/// Return the tensor ½ H of a point. `sums` are those of [`super::Form::fit`].
pub fn fit<const D: usize>(sums: &[f64]) -> SMatrix<f64, D, D> {
    limited(least_squares_fit::<D>(sums)) * 0.5
}

/// Return a component of δ_ab δ_cd + δ_ac δ_bd + δ_ad δ_bc. The exponents say how many of the indices abcd
/// are x, y and z.
fn isotropic(exponents: [usize; 3]) -> f64 {
    let odd = exponents.iter().any(|exponent| exponent % 2 == 1);
    match exponents.iter().max() {
        _ if odd => 0.0,
        Some(4) => 3.0,
        _ => 1.0,
    }
}

/// Fit H of a point in `D` dimensions: the least-squares solution of
/// ½ Σ (c/μ) |ξ| (n·H n) n⊗n⊗n⊗n Ṽ = δ_ab δ_cd + δ_ac δ_bd + δ_ad δ_bc.
/// `sums` has an entry for each monomial of degree 6 in the components of n. The entry is the sum of
/// |ξ| Ṽ c/μ times this monomial over the family.
fn least_squares_fit<const D: usize>(sums: &[f64]) -> SMatrix<f64, D, D> {
    let exists = |exponents: &[usize; 3]| exponents[D..].iter().all(|exponent| *exponent == 0);
    let rows: Vec<_> = exponents(4).filter(exists).collect();
    let columns: Vec<_> = exponents(2).filter(exists).collect();
    // A row stands for several equal tensor components. The weight of the row is the square root of the
    // number of these components, so that the fit does not depend on the axes. Columns have the same weights;
    // then the solution of smallest norm is independent of the axes, too.
    let matrix = DMatrix::from_fn(rows.len(), columns.len(), |r, c| {
        let both = std::array::from_fn(|d| rows[r][d] + columns[c][d]);
        let weight = (multiplicity(rows[r]) * multiplicity(columns[c])).sqrt();
        0.5 * sums[index_of(both)] * weight
    });
    let wanted = DVector::from_fn(rows.len(), |r, _| {
        isotropic(rows[r]) * multiplicity(rows[r]).sqrt()
    });
    let Some(solution) = least_squares(matrix, &wanted, RANK) else {
        return SMatrix::zeros();
    };
    let mut tensor = SMatrix::zeros();
    for (column, value) in columns.iter().zip(solution.iter()) {
        let entry = value / multiplicity(*column).sqrt();
        let mut axes = (0..D).flat_map(|d| std::iter::repeat_n(d, column[d]));
        let (a, b) = axes.next().zip(axes.next()).expect("two axes");
        (tensor[(a, b)], tensor[(b, a)]) = (entry, entry);
    }
    tensor
}

/// Clamp the eigenvalues to the range from [`SMALLEST`] to [`LARGEST`].
fn limited<const D: usize>(tensor: SMatrix<f64, D, D>) -> SMatrix<f64, D, D> {
    let whole = DMatrix::from_fn(D, D, |a, b| tensor[(a, b)]);
    let SymmetricEigen {
        eigenvectors,
        eigenvalues,
    } = SymmetricEigen::new(whole);
    let range = SMALLEST..=LARGEST;
    if eigenvalues.iter().all(|value| range.contains(value)) {
        return tensor;
    }
    SMatrix::from_fn(|a, b| {
        let each = eigenvalues.iter().enumerate();
        each.map(|(k, value)| {
            eigenvectors[(a, k)] * value.clamp(SMALLEST, LARGEST) * eigenvectors[(b, k)]
        })
        .sum()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Return H of a point with neighbours of unit volume at these offsets, for c/μ = 1/5. H in the middle of
    /// a disc with a radius of 3 is then of the order of I.
    fn tensor(offsets: &[[f64; 2]]) -> SMatrix<f64, 2, 2> {
        let mut sums = [0.0; super::super::MONOMIALS];
        for [x, y] in offsets {
            let length = x.hypot(*y);
            for (sum, [a, b, c]) in sums.iter_mut().zip(exponents(6)) {
                if c == 0 {
                    let power = |value: f64, n: usize| (value / length).powi(n as i32);
                    *sum += 0.2 * length * power(*x, a) * power(*y, b);
                }
            }
        }
        limited(least_squares_fit::<2>(&sums))
    }

    #[test]
    fn it_turns_with_the_family() {
        let half: Vec<[f64; 2]> = (-3..=3)
            .flat_map(|a| (0..=3).map(move |b| [f64::from(a), f64::from(b)]))
            .filter(|[a, b]| a.hypot(*b) < 3.1 && (*a, *b) != (0.0, 0.0))
            .collect();
        let (sin, cos) = 0.7_f64.sin_cos();
        let turned: Vec<[f64; 2]> = (half.iter())
            .map(|[x, y]| [cos * x - sin * y, sin * x + cos * y])
            .collect();
        let turn = nalgebra::Matrix2::new(cos, -sin, sin, cos);
        let wanted = turn * tensor(&half) * turn.transpose();
        assert!((tensor(&turned) - wanted).norm() < 1e-9 * wanted.norm());
        // The corrected family is stiffer normal to the surface than along it.
        let of_half = tensor(&half);
        assert!(of_half[(1, 1)] > of_half[(0, 0)], "{of_half}");
    }

    #[test]
    fn nearly_straight_families_have_no_huge_micromoduli() {
        for height in [0.0, 1e-6, 1e-3, 0.03, 0.1] {
            let offsets: Vec<[f64; 2]> = [-3.0, -2.0, -1.0, 1.0, 2.0, 3.0]
                .map(|x: f64| [x + 0.3 * height, height * libm::sin(5.0 * x)])
                .to_vec();
            let values = tensor(&offsets).symmetric_eigenvalues();
            let is_bounded = values.iter().all(|value| (0.0..=LARGEST).contains(value));
            assert!(is_bounded, "{height}: {values}");
        }
    }
}
