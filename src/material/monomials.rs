//! Monomials of the bond directions, for sums over a family. The module also solves linear least-squares
//! problems.

use nalgebra::{DMatrix, DVector};

use crate::lanes::Lanes;

/// Return the exponents of x, y and z in each monomial of a degree, in the order in which all sums of
/// monomials are stored.
pub fn exponents(degree: usize) -> impl Iterator<Item = [usize; 3]> {
    (0..=degree).flat_map(move |z| (0..=degree - z).map(move |y| [degree - z - y, y, z]))
}

/// Return the index of the monomial with these exponents among all monomials of its degree.
pub fn index_of(wanted: [usize; 3]) -> usize {
    let mut all = exponents(wanted.iter().sum());
    let found = all.position(|exponents| exponents == wanted);
    found.expect("the degree is the sum of the exponents")
}

/// Return the number of components of a symmetric tensor that have these exponents. The exponents of a
/// component say how often x, y and z occur among its indices. For example, the components xy and yx have the
/// exponents (1, 1, 0), so the result is 2.
pub fn multiplicity(exponents: [usize; 3]) -> f64 {
    let factorial = |n: usize| (1..=n).product::<usize>();
    let all = factorial(exponents.iter().sum());
    (all / exponents.map(factorial).iter().product::<usize>()) as f64
}

/// Compute the monomials of a degree in the components of `base`. Write each monomial, multiplied by
/// `factor`, to `sums`. Monomials with a component beyond the `D` components of `base` are not written.
#[inline(always)]
pub fn write_monomials<const D: usize>(
    degree: usize,
    base: [Lanes; D],
    factor: Lanes,
    sums: &mut [Lanes],
) {
    for (sum, exponents) in sums.iter_mut().zip(exponents(degree)) {
        if exponents[D..].iter().any(|exponent| *exponent > 0) {
            continue;
        }
        *sum = factor;
        for d in 0..D {
            for _ in 0..exponents[d] {
                *sum = *sum * base[d];
            }
        }
    }
}

/// Return the solution of smallest norm of a linear least-squares problem. Singular values below `rank` times
/// the largest singular value are dropped. `None` if an input is not finite.
pub fn least_squares(
    matrix: DMatrix<f64>,
    wanted: &DVector<f64>,
    rank: f64,
) -> Option<DVector<f64>> {
    // The decomposition of a matrix with NaN or infinity would not terminate.
    if matrix.iter().chain(wanted.iter()).any(|x| !x.is_finite()) {
        return None;
    }
    let decomposition = matrix.svd(true, true);
    let limit = rank * decomposition.singular_values.max();
    decomposition.solve(wanted, limit).ok()
}
