//! The function h(n) that is the radius of an ellipsoid, in the direction n of the bond. The semi-axes are
//! fitted to the energy densities at unit extension along each axis a. These energy densities are half of the
//! components C_aaaa of the elastic tensor C. In the solid, these components are 3μ.

use nalgebra::SMatrix;

use crate::material::ellipsoid;
use crate::material::monomials::index_of;

/// Return the tensor of the ellipsoid whose radius in the direction n is ½ h(n). `sums` are those of
/// [`super::Form::fit`].
pub fn fit<const D: usize>(sums: &[f64]) -> SMatrix<f64, D, D> {
    let found: [f64; D] = std::array::from_fn(|a| {
        // n_a⁴ = n_a⁴ n·n, a sum of monomials of degree 6.
        let terms = (0..D).map(|b| {
            let mut exponents = [0; 3];
            exponents[a] += 4;
            exponents[b] += 2;
            sums[index_of(exponents)]
        });
        0.5 * terms.sum::<f64>()
    });
    if found.iter().all(|found| *found == 0.0) {
        return SMatrix::identity() * ellipsoid::WITHOUT_BONDS;
    }
    let semi_axes = found.map(|found| ellipsoid::semi_axis(3.0, found));
    ellipsoid::tensor(semi_axes, 0.5)
}

#[cfg(test)]
mod tests {
    use super::super::MONOMIALS;
    use super::*;

    #[test]
    fn a_point_without_bonds_has_no_share() {
        let tensor = fit::<3>(&[0.0; MONOMIALS]);
        let wanted = SMatrix::<f64, 3, 3>::identity() * ellipsoid::WITHOUT_BONDS;
        assert!(tensor == wanted, "{tensor}");
    }
}
