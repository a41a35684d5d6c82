//! Symmetric tensors of one point or of eight bonds, stored as diagonal and mixed entries.

use nalgebra::SMatrix;

use super::Bond;
use crate::lanes::Lanes;

/// Diagonal and mixed entries of eight tensors. In 3-D, all three mixed entries are used. In 2-D, the second
/// mixed entry is unused; in 1-D, the only mixed entry is unused.
pub type Symmetric<const D: usize> = ([Lanes; D], [Lanes; D]);

/// Return the indices of the mixed entries of a symmetric tensor in storage order: yz, xz, xy in space and xy
/// in the plane.
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

/// Return an entry of a symmetric tensor.
#[inline(always)]
pub fn symmetric<const D: usize>((diagonal, others): &Symmetric<D>, a: usize, b: usize) -> Lanes {
    if a == b {
        return diagonal[a];
    }
    // In space, mixed entry (a, b) is stored at the index of the third direction.
    if D == 3 { others[3 - a - b] } else { others[0] }
}

/// Create a symmetric tensor from its diagonal entries, followed by its mixed entries.
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

/// Write the diagonal entries of a symmetric tensor, then its mixed entries, to a slice.
pub fn to_entries<const D: usize>(tensor: &SMatrix<f64, D, D>, entries: &mut [f64]) {
    for a in 0..D {
        entries[a] = tensor[(a, a)];
    }
    for (k, (a, b)) in mixed::<D>().enumerate() {
        entries[D + k] = tensor[(a, b)];
    }
}

/// Return n·T n for the directions n of eight bonds.
#[inline(always)]
pub fn quadratic_form<const D: usize>(bond: &Bond<D>, tensor: &Symmetric<D>) -> Lanes {
    quadratic_form_of(&bond.reference, tensor) * (bond.inverse * bond.inverse)
}

/// Return v·T v for eight vectors v.
#[inline(always)]
pub fn quadratic_form_of<const D: usize>(
    vector: &[Lanes; D],
    (diagonal, others): &Symmetric<D>,
) -> Lanes {
    let mut sum = diagonal[0] * (vector[0] * vector[0]);
    for d in 1..D {
        sum += diagonal[d] * (vector[d] * vector[d]);
    }
    for (k, (a, b)) in mixed::<D>().enumerate() {
        sum += others[k] * (vector[a] * vector[b] * 2.0);
    }
    sum
}
