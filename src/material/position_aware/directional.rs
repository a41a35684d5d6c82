//! Functions ω and σ of the bond direction. ω/ω₀ and σ/σ₀ are the radii of two ellipsoids in this direction.
//! The ellipsoid of ω/ω₀ has a semi-axis along each coordinate axis a. This semi-axis is a ratio of
//! dilatations at a unit strain along axis a: the dilatation of the solid, divided by the dilatation of the
//! family with ω₀. The ellipsoid of σ/σ₀ also has a semi-axis along each axis a. This semi-axis is a ratio of
//! deviatoric energies at the same strain: the energy of the solid, divided by the energy of the family with
//! σ₀.

use super::Fit;
use super::conditions::{Conditions, of_product, one_in_directions, product, weighted_volume};
use crate::material::ellipsoid;

/// Return the tensors of the ellipsoids, and R, Q and τ for [`super::largest_ratio`]. The parameters of this
/// function are those of [`super::Form::fit`].
pub fn fit<const D: usize>(
    [of_directions, of_squares]: [&[f64]; 2],
    [dilatational, deviatoric]: [&Conditions<D>; 2],
    reference: f64,
) -> Fit<D> {
    let omega = semi_axes(dilatational, of_directions);
    let sigma = semi_axes(deviatoric, of_squares);
    Fit {
        omega: ellipsoid::tensor(omega, dilatational.constant),
        sigma: ellipsoid::tensor(sigma, reference),
        products: bounds(of_directions, [omega, sigma], reference),
    }
}

/// Return the semi-axes of an ellipsoid, from the conditions for unit strains along the coordinate axes.
fn semi_axes<const D: usize>(conditions: &Conditions<D>, sums: &[f64]) -> [f64; D] {
    std::array::from_fn(|a| {
        let (polynomial, wanted) = &conditions.each[a];
        ellipsoid::semi_axis(*wanted, conditions.of_constant(sums, polynomial))
    })
}

/// Return bounds for [`super::largest_ratio`]: upper bounds of R and Q, and a lower bound of τ. `omega` and
/// `sigma` are the semi-axes of the ellipsoids of ω/ω₀ and σ/σ₀. `sums` are the sums of |ξ|² Ṽ times the
/// monomials of n. `reference` is σ₀, N/m⁷.
///
/// Let g be the radius, in the direction n of a bond, of an ellipsoid with the semi-axes g_a. Then g and g²
/// are convex functions of the numbers n_a², whose sum is 1. Therefore g ≤ Σ g_a n_a² and g² ≤ Σ g_a² n_a²
/// for each bond. With M_a = Σ |ξ|² n_a² Ṽ, Jensen's inequality for the sum over the family gives
/// Σ |ξ|² g Ṽ ≥ m (Σ (M_a/m)/g_a²)^(−½).
fn bounds<const D: usize>(sums: &[f64], [omega, sigma]: [[f64; D]; 2], reference: f64) -> [f64; 3] {
    let weighted_volume = weighted_volume::<D>(sums);
    let constant = D as f64 / weighted_volume;
    let one = one_in_directions::<D>();
    let moment = |a: usize| product(sums, &[(of_product(a, a), 1.0)], &one);
    let sum = |factor: &dyn Fn(usize) -> f64| (0..D).map(|a| factor(a) * moment(a)).sum::<f64>();
    let least = sigma.iter().copied().fold(f64::INFINITY, f64::min);
    let r = constant * constant * sum(&|a| omega[a] * omega[a]) / (least * reference);
    let q = reference * sum(&|a| sigma[a]);
    let mean = sum(&|a| (omega[a] * omega[a]).recip()) / weighted_volume;
    [r, q, D as f64 / mean.sqrt()]
}
