//! The function h that is the radius of an ellipsoid. Its semi-axes are fitted to the energy densities at unit
//! extension along each axis, which are half of the components aaaa of the elastic tensor.

use nalgebra::SMatrix;

use super::Form;
use crate::lanes::{IsaSet, Lanes};
use crate::material::monomials::index_of;
use crate::material::symmetric::Symmetric;
use crate::material::{Bond, ellipsoid};

/// `surface_correction = "directional"`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Directional;

impl Form for Directional {
    const ISA_SET: IsaSet = IsaSet::Each;

    /// Return the tensor of the ellipsoid with the radius ½ h.
    fn fit<const D: usize>(
        sums: &[f64],
        micromodulus: f64,
        shear_modulus: f64,
    ) -> SMatrix<f64, D, D> {
        let semi_axes = std::array::from_fn(|a| {
            // n_a⁴ = n_a⁴ n·n, a sum of monomials of degree 6.
            let with_square = (0..D).map(|b| {
                let mut exponents = [0; 3];
                exponents[a] += 4;
                exponents[b] += 2;
                sums[index_of(exponents)]
            });
            let found = 0.5 * micromodulus * with_square.sum::<f64>();
            ellipsoid::semi_axis(3.0 * shear_modulus, found)
        });
        ellipsoid::tensor::<D>(semi_axes, 0.5)
    }

    #[inline(always)]
    fn half<const D: usize>(bond: &Bond<D>, tensor: &Symmetric<D>) -> Lanes {
        ellipsoid::radius(bond, tensor)
    }
}
