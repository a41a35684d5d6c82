//! Surface correction from extensions along the coordinate axes. Each point has an ellipsoid. The factor of
//! the point for a bond is the radius that the ellipsoid has in the direction of the bond.
//!
//! Madenci & Oterkus 2014, ch. 4; Oterkus 2010. Consider a unit extension along a coordinate axis a. A
//! quantity of a point, such as the energy density, is then a sum over its family. The factor g_a scales this
//! sum to the value of the quantity in the classical solid. A bond of direction n has the factor
//! g(n) = (Σ n_a²/g_a²)^(−½), the radius of the ellipsoid with the semi-axes g_a.
//!
//! In the cited works, a bond has one ellipsoid. Each semi-axis is the mean of the values g_a of the points
//! at both ends. Here each end has its own ellipsoid, because the force state of a point depends on the
//! numbers of this point only. In bond-based laws, the factor of a bond is then the mean of the radii at both
//! ends. If the semi-axes at the two ends differ, this mean differs from the factor of the cited works. The
//! deviation is of second order in the difference of the semi-axes.
//!
//! The factors depend on the coordinate axes, so they are not exact for extensions along other directions.

use nalgebra::SMatrix;

use super::Bond;
use super::symmetric::{Symmetric, quadratic_form};
use crate::lanes::Lanes;

/// Largest allowed semi-axis. Without this limit, the stiffness of points whose few neighbours lie nearly in
/// one plane would be unbounded.
const LARGEST: f64 = 30.0;

/// Diagonal entry of the tensor of a point that has no bonds within its own horizon. With this entry, the
/// radii of the point's ellipsoid are nearly 0. Therefore the point contributes nothing to its bonds with
/// points that have a larger horizon.
pub const WITHOUT_BONDS: f64 = 1e300;

/// Return the semi-axis g_a = `wanted`/`found`, at most [`LARGEST`]. `wanted` is the value of the quantity in
/// the classical solid, and `found` is the sum over the family.
pub fn semi_axis(wanted: f64, found: f64) -> f64 {
    if found * LARGEST > wanted {
        wanted / found
    } else {
        LARGEST
    }
}

/// Return the tensor T of [`radius`], for an ellipsoid with the semi-axes g_a times `scale`.
pub fn tensor<const D: usize>(semi_axes: [f64; D], scale: f64) -> SMatrix<f64, D, D> {
    let entries = semi_axes.map(|axis| (scale * axis).powi(-2));
    SMatrix::from_fn(|a, b| if a == b { entries[a] } else { 0.0 })
}

/// Return the radii (n·T n)^(−½) of an ellipsoid in the directions n of eight bonds.
#[inline(always)]
pub fn radius<const D: usize>(bond: &Bond<D>, tensor: &Symmetric<D>) -> Lanes {
    radius_of(quadratic_form(bond, tensor))
}

/// Return the radii (n·T n)^(−½) of an ellipsoid from the values n·T n of eight bonds.
#[inline(always)]
pub fn radius_of(quadratic_form: Lanes) -> Lanes {
    // Padding bonds have n = 0. Without this limit, their radii would be infinite.
    let square = quadratic_form.max(Lanes::splat(f64::MIN_POSITIVE));
    Lanes::splat(1.0) / square.sqrt()
}
