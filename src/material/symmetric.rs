//! Symmetric tensors by diagonal and mixed entries, of one point or of eight bonds.

use nalgebra::SMatrix;

use crate::lanes::Lanes;

/// Diagonal and mixed entries of eight tensors. In space there are as many mixed entries as diagonal ones; in the plane the
/// second, and on a line the only one, is unused.
pub type Symmetric<const D: usize> = ([Lanes; D], [Lanes; D]);

/// The mixed entries of a symmetric tensor in the order in which they are kept: yz, xz, xy in space and
/// xy in the plane.
#[inline(always)]
pub fn mixed<const D: usize>() -> impl Iterator<Item = (usize, usize)> {
    const SPACE: [(usize, usize); 3] = [(1, 2), (0, 2), (0, 1)];
    let skipped = match D {
        3 => 0,
        2 => 2,
        _ => 3,
    };
    SPACE.into_iter().skip(skipped)
}

/// An entry of a symmetric tensor that is kept by diagonal and mixed entries.
#[inline(always)]
pub fn symmetric<const D: usize>((diagonal, others): &Symmetric<D>, a: usize, b: usize) -> Lanes {
    if a == b {
        return diagonal[a];
    }
    // In space the mixed entry of two directions has the place of the third.
    if D == 3 { others[3 - a - b] } else { others[0] }
}

/// A symmetric tensor from its diagonal and mixed entries.
pub fn from_entries<const D: usize>(entries: &[f64]) -> SMatrix<f64, D, D> {
    let mut tensor = SMatrix::zeros();
    for a in 0..D {
        tensor[(a, a)] = entries[a];
    }
    for (k, (a, b)) in mixed::<D>().enumerate() {
        tensor[(a, b)] = entries[D + k];
        tensor[(b, a)] = entries[D + k];
    }
    tensor
}

/// Writes the diagonal and mixed entries of a symmetric tensor.
pub fn to_entries<const D: usize>(tensor: &SMatrix<f64, D, D>, entries: &mut [f64]) {
    for a in 0..D {
        entries[a] = tensor[(a, a)];
    }
    for (k, (a, b)) in mixed::<D>().enumerate() {
        entries[D + k] = tensor[(a, b)];
    }
}

/// Exponents of x, y and z in the monomials of a degree, in the order in which they are summed.
pub fn exponents(degree: usize) -> impl Iterator<Item = [usize; 3]> {
    (0..=degree).flat_map(move |z| (0..=degree - z).map(move |y| [degree - z - y, y, z]))
}

/// How many components of a symmetric tensor have the same exponents.
pub fn multiplicity(exponents: [usize; 3]) -> f64 {
    let factorial = |n: usize| (1..=n).product::<usize>();
    let all = factorial(exponents.iter().sum());
    (all / exponents.map(factorial).iter().product::<usize>()) as f64
}
