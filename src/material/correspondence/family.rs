//! Tensors of a family: the shape tensor and what follows from it.

use nalgebra::{Matrix3, SMatrix};

use super::super::symmetric::{from_entries, mixed};
use super::super::{Bond, Rotation, rotation};
use crate::lanes::{LaneTuple, Lanes};

/// A shape tensor is singular where its determinant is below this share of that of a family of the same
/// size that looks alike in all directions.
const SINGULAR: f64 = 1e-2;

/// What is left of a family carries no force where it is so many times as stiff as the whole family: the time
/// step is that of whole families. Torn plates ran away without a bound, and not with one of 16.
const STIFFEST: f64 = 8.0;

/// What a bond adds to the shape tensor, by diagonal and mixed entries, and to Σ ω η⊗ξ Ṽ, row by row.
pub type FamilyShare<const D: usize> = (([Lanes; D], [Lanes; D]), [[Lanes; D]; D]);

/// See [`FamilyShare`]; m², by weight and volume.
#[inline(always)]
pub fn family_share<const D: usize>(bond: &Bond<D>) -> FamilyShare<D> {
    let xi = &bond.reference;
    let motion = LaneTuple::each(|k| bond.eta[k / D] * xi[k % D]);
    (shape_share(xi), motion)
}

/// ξ⊗ξ by diagonal and mixed entries.
#[inline(always)]
pub fn shape_share<const D: usize>(xi: &[Lanes; D]) -> ([Lanes; D], [Lanes; D]) {
    let mut others = [Lanes::splat(0.0); D];
    for (k, (a, b)) in mixed::<D>().enumerate() {
        others[k] = xi[a] * xi[b];
    }
    (LaneTuple::each(|d| xi[d] * xi[d]), others)
}

/// A tensor from its entries, row by row.
pub fn from_rows<const D: usize>(entries: &[f64]) -> SMatrix<f64, D, D> {
    SMatrix::from_fn(|a, b| entries[D * a + b])
}

/// Writes the entries of a tensor, row by row.
pub fn to_rows<const D: usize>(tensor: &SMatrix<f64, D, D>, entries: &mut [f64]) {
    for a in 0..D {
        for b in 0..D {
            entries[D * a + b] = tensor[(a, b)];
        }
    }
}

/// K = Σ ω ξ⊗ξ Ṽ of a point.
#[derive(Debug, Clone, Copy)]
pub struct ShapeTensor<const D: usize>(SMatrix<f64, D, D>);

impl<const D: usize> ShapeTensor<D> {
    /// From its diagonal and mixed entries, m⁵.
    pub fn new(entries: &[f64]) -> Self {
        Self(from_entries(entries))
    }

    /// K⁻¹ (m⁻⁵), unless K is nearly singular.
    pub fn inverse(&self) -> Option<SMatrix<f64, D, D>> {
        let mean = self.0.trace() / D as f64;
        // The comparison is false for a family without bonds, too.
        if determinant(&self.0) > SINGULAR * mean.powi(D as i32) {
            self.0.try_inverse()
        } else {
            None
        }
    }

    /// K⁻¹ (m⁻⁵) of what is left of a family, unless K is nearly singular or the family too stiff, with the largest
    /// modulus of its solid (Pa) and the spring constant of the whole family (N/m⁷).
    pub fn inverse_of_rest(&self, modulus: f64, whole: f64) -> Option<SMatrix<f64, D, D>> {
        let least = SMatrix::from_diagonal_element(modulus / (STIFFEST * whole));
        if is_positive_definite(&(self.0 - least)) {
            self.inverse()
        } else {
            None
        }
    }

    /// Σ ω |ξ|² Ṽ, m⁵.
    pub fn trace(&self) -> f64 {
        self.0.trace()
    }

    /// The smallest eigenvalue, m⁵.
    pub fn smallest(&self) -> f64 {
        extremes(&self.0)[0]
    }
}

/// Rotation of a family whose sums are a [`FamilyShare`]; none where its shape tensor is singular.
pub fn family_rotation<const D: usize>(sums: &[f64]) -> Rotation {
    let inverse = ShapeTensor::<D>::new(sums).inverse();
    inverse.map_or(rotation::IDENTITY, |inverse| {
        let gradient = from_rows::<D>(&sums[2 * D..]) * inverse;
        rotation::of_gradient(&(SMatrix::identity() + gradient))
    })
}

/// The smallest and the largest eigenvalue of a symmetric matrix of at most three rows.
pub fn extremes<const D: usize>(m: &SMatrix<f64, D, D>) -> [f64; 2] {
    // What the first axis alone gives lies between them.
    let mut whole = Matrix3::from_diagonal_element(m[(0, 0)]);
    for a in 0..D {
        for b in 0..D {
            whole[(a, b)] = m[(a, b)];
        }
    }
    let all = whole.symmetric_eigenvalues();
    [all.min(), all.max()]
}

/// Whether all eigenvalues of a symmetric matrix of at most three rows are above 0, by Sylvester's criterion.
fn is_positive_definite<const D: usize>(m: &SMatrix<f64, D, D>) -> bool {
    let of_two = D < 2 || m[(0, 0)] * m[(1, 1)] > m[(0, 1)] * m[(1, 0)];
    m[(0, 0)] > 0.0 && of_two && determinant(m) > 0.0
}

/// The determinant of a matrix of at most three rows.
pub fn determinant<const D: usize>(m: &SMatrix<f64, D, D>) -> f64 {
    match D {
        1 => m[(0, 0)],
        2 => m[(0, 0)] * m[(1, 1)] - m[(0, 1)] * m[(1, 0)],
        _ => {
            let minor = |a: usize, b: usize| m[(1, a)] * m[(2, b)] - m[(1, b)] * m[(2, a)];
            m[(0, 0)] * minor(1, 2) - m[(0, 1)] * minor(0, 2) + m[(0, 2)] * minor(0, 1)
        }
    }
}
