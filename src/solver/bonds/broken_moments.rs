//! Moments of all bonds of a point, and moments of the broken bonds of the point, in 3-D.

use nalgebra::{Matrix3, Vector3};

use crate::lanes::{IsaSet, Lanes, Simd};
use crate::material::bond::Wanted;

use super::kernel::{Group, Kernel};
use super::measures::{PAIRS, wanted};

type Vector = Vector3<f64>;

/// Fraction of the trace of C that is added to the diagonal of C, so that C is invertible for a single layer
/// of points. C = Σ ω (ξ − ξ̄)⊗(ξ − ξ̄) Ṽ is a sum over all bonds of a point, with the mean ξ̄ of
/// [`Moments::mean`].
const LAYER: f64 = 1e-9;

/// Kernel that computes moments of the bonds of each point, in 3-D. Some sums are over all bonds of the
/// point, and the others are over the broken bonds only. ω is the influence function of a bond, and Ṽ is the
/// volume of the neighbour times its volume correction. The sums are, by index:
///
/// - 0: Σ ω Ṽ over all bonds, m³;
/// - 1 to 3: Σ ω ξ Ṽ over all bonds, m⁴;
/// - 4 to 9: Σ ω ξ⊗ξ Ṽ over all bonds, m⁵, in the order of `PAIRS`;
/// - 10: Σ ω Ṽ over the broken bonds, m³;
/// - 11 to 13: Σ ω ξ Ṽ over the broken bonds, m⁴.
#[derive(Clone, Copy)]
pub struct MomentSums;

impl<const D: usize> Kernel<D> for MomentSums {
    type Sums = [Lanes; 14];
    type Point = [Lanes; 0];
    type PointJ = [Lanes; 0];
    type BondHistory = [Lanes; 0];
    type Rotation = [Lanes; 0];
    const EXISTS: bool = D == 3;
    const READS_BROKEN: bool = true;
    const ISA_SET: IsaSet = IsaSet::Avx2;
    const WANTED: Wanted = wanted(true);

    #[inline(always)]
    fn add<S: Simd>(&self, simd: S, group: &mut Group<'_, Self, D>, sums: &mut [Lanes; 14]) {
        let xi = &group.bond.reference;
        let volume = group.weighted_by_volume(Lanes::splat(1.0));
        let whole = simd.keep(volume, group.whole);
        let broken = simd.keep(volume, group.whole & !group.intact);
        sums[0] += whole;
        sums[10] += broken;
        for d in 0..D {
            sums[1 + d] += whole * xi[d];
            sums[11 + d] += broken * xi[d];
        }
        for (k, (a, b)) in PAIRS.into_iter().enumerate() {
            if a < D && b < D {
                sums[4 + k] += whole * xi[a] * xi[b];
            }
        }
    }
}

/// The sums that `MomentSums` computes for a point, in the same order.
pub struct Moments(pub(super) [f64; 14]);

impl Moments {
    fn vector(&self, first: usize) -> Vector {
        Vector::from_fn(|d, _| self.0[first + d])
    }

    /// Whether a bond within the horizon of the point is broken.
    pub fn has_broken(&self) -> bool {
        self.0[10] > 0.0
    }

    /// Mean ξ̄ (m) of the reference vectors of all bonds, weighted by ω Ṽ; 0 for a point without bonds.
    pub fn mean(&self) -> Vector {
        match self.0[0] {
            0.0 => Vector::zeros(),
            volume => self.vector(1) / volume,
        }
    }

    /// Compute the gradient (1/m) of a linear function of the neighbours' positions. The function is the best
    /// fit, by least squares with the weights ω Ṽ, to the value 1 at neighbours with a broken bond and 0 at
    /// the others. `LAYER` defines the matrix C of this fit. If C is not invertible, the gradient is 0.
    pub fn gradient(&self) -> Vector {
        let mean = self.mean();
        let [xx, yy, zz, xy, yz, xz] = std::array::from_fn(|k| self.0[4 + k]);
        let all = Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
        let spread = all - self.0[0] * mean * mean.transpose();
        let spread = spread + LAYER * spread.trace() * Matrix3::identity();
        let broken = self.vector(11) - self.0[10] * mean;
        let inverse = spread.try_inverse();
        inverse.map_or(Vector::zeros(), |inverse| inverse * broken)
    }
}
