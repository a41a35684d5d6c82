//! Tensors of a family: the shape tensor, its inverse, and the rotation.

use nalgebra::{Matrix3, SMatrix};

use super::super::symmetric::{from_entries, mixed};
use super::super::{Bond, Rotation, rotation};
use crate::lanes::{LaneTuple, Lanes};

/// A shape tensor counts as nearly singular if its determinant is at most this fraction of the determinant of
/// an isotropic shape tensor with the same trace.
const SINGULAR: f64 = 1e-2;

/// Largest allowed stiffness of the intact part of a family, divided by the stiffness of the initial family.
/// If the intact part is stiffer, the point of the family carries no force.
///
/// The stable step is computed for initial families only. In tests without a limit, points of torn plates
/// moved without bound. A limit of 16 already prevented this.
const STIFFEST: f64 = 8.0;

/// Contribution of a bond to the shape tensor (diagonal and mixed entries) and to Σ ω η⊗ξ Ṽ (row by row). The
/// same type holds the sums of all contributions.
pub type FamilyShare<const D: usize> = (([Lanes; D], [Lanes; D]), [[Lanes; D]; D]);

/// Return the [`FamilyShare`] of a bond without the factors ω and Ṽ, m².
#[inline(always)]
pub fn family_share<const D: usize>(bond: &Bond<D>) -> FamilyShare<D> {
    let xi = &bond.reference;
    let motion = LaneTuple::each(|k| bond.eta[k / D] * xi[k % D]);
    (shape_share(xi), motion)
}

/// Return the diagonal and mixed entries of ξ⊗ξ.
#[inline(always)]
pub fn shape_share<const D: usize>(xi: &[Lanes; D]) -> ([Lanes; D], [Lanes; D]) {
    let mut others = [Lanes::splat(0.0); D];
    for (k, (a, b)) in mixed::<D>().enumerate() {
        others[k] = xi[a] * xi[b];
    }
    (LaneTuple::each(|d| xi[d] * xi[d]), others)
}

/// Create a tensor from its entries, which are given row by row.
pub fn from_rows<const D: usize>(entries: &[f64]) -> SMatrix<f64, D, D> {
    SMatrix::from_fn(|a, b| entries[D * a + b])
}

/// Write the entries of a tensor to a slice, row by row.
pub fn to_rows<const D: usize>(tensor: &SMatrix<f64, D, D>, entries: &mut [f64]) {
    for a in 0..D {
        for b in 0..D {
            entries[D * a + b] = tensor[(a, b)];
        }
    }
}

/// Shape tensor K = Σ ω ξ⊗ξ Ṽ of a point.
#[derive(Debug, Clone, Copy)]
pub struct ShapeTensor<const D: usize>(SMatrix<f64, D, D>);

impl<const D: usize> ShapeTensor<D> {
    /// Create K (m⁵) from its diagonal entries, followed by its mixed entries yz, xz, xy (xy in 2-D).
    pub fn new(entries: &[f64]) -> Self {
        Self(from_entries(entries))
    }

    /// Return K⁻¹ (m⁻⁵); `None` if K is nearly singular.
    pub fn inverse(&self) -> Option<SMatrix<f64, D, D>> {
        let mean = self.0.trace() / D as f64;
        // False for a family without bonds, too.
        if determinant(&self.0) > SINGULAR * mean.powi(D as i32) {
            self.0.try_inverse()
        } else {
            None
        }
    }

    /// Return K⁻¹ (m⁻⁵) of the intact part of a family; `None` if K is nearly singular, or if this part is
    /// stiffer than `STIFFEST` allows.
    ///
    /// `modulus` is the largest modulus of the solid (Pa), and `initial_spring_constant` the spring constant
    /// of the initial family (N/m⁷).
    pub fn inverse_of_rest(
        &self,
        modulus: f64,
        initial_spring_constant: f64,
    ) -> Option<SMatrix<f64, D, D>> {
        let least = SMatrix::from_diagonal_element(modulus / (STIFFEST * initial_spring_constant));
        if is_positive_definite(&(self.0 - least)) {
            self.inverse()
        } else {
            None
        }
    }

    /// Return the trace of K, Σ ω |ξ|² Ṽ, m⁵.
    pub fn trace(&self) -> f64 {
        self.0.trace()
    }

    /// Return the smallest eigenvalue of K, m⁵.
    pub fn smallest(&self) -> f64 {
        extremes(&self.0)[0]
    }
}

/// Compute the rotation of a family from the sums of its [`FamilyShare`]s; the identity if the shape tensor
/// is nearly singular.
pub fn family_rotation<const D: usize>(sums: &[f64]) -> Rotation {
    let inverse = ShapeTensor::<D>::new(sums).inverse();
    inverse.map_or(rotation::IDENTITY, |inverse| {
        let gradient = from_rows::<D>(&sums[2 * D..]) * inverse;
        rotation::of_gradient(&(SMatrix::identity() + gradient))
    })
}

/// Return the smallest and the largest eigenvalue of a symmetric matrix of at most three rows.
pub fn extremes<const D: usize>(m: &SMatrix<f64, D, D>) -> [f64; 2] {
    // The padding entries equal a diagonal entry, which lies between the extreme eigenvalues.
    let mut whole = Matrix3::from_diagonal_element(m[(0, 0)]);
    for a in 0..D {
        for b in 0..D {
            whole[(a, b)] = m[(a, b)];
        }
    }
    let all = whole.symmetric_eigenvalues();
    [all.min(), all.max()]
}

/// Test whether a symmetric matrix of at most three rows is positive definite, by Sylvester's criterion.
fn is_positive_definite<const D: usize>(m: &SMatrix<f64, D, D>) -> bool {
    let of_two = D < 2 || m[(0, 0)] * m[(1, 1)] > m[(0, 1)] * m[(1, 0)];
    m[(0, 0)] > 0.0 && of_two && determinant(m) > 0.0
}

/// Return the determinant of a matrix of at most three rows.
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
