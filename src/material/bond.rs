//! Eight bonds as laws see them: the geometry between their ends.

use crate::lanes::{Arithmetic, Lanes};

/// Eight bonds.
#[derive(Debug, Clone, Copy)]
pub struct Bond<const D: usize> {
    /// ξ by component, m.
    pub reference: [Lanes; D],
    /// |ξ|, m.
    pub length: Lanes,
    /// s = (|Y| − |ξ|)/|ξ|; for linear laws ξ·η/|ξ|².
    pub stretch: Lanes,
    /// Y by component, m; for linear laws ξ.
    pub along: [Lanes; D],
    /// Its inverse length, 1/m.
    pub inverse_length: Lanes,
}

/// ξ of eight bonds.
#[derive(Debug, Clone, Copy)]
pub struct Reference<const D: usize> {
    /// By component, m.
    pub along: [Lanes; D],
    /// |ξ|², m².
    pub square: Lanes,
    /// |ξ|, m.
    pub length: Lanes,
    /// 1/|ξ|, 1/m.
    pub inverse: Lanes,
    /// 1/|ξ|², 1/m².
    pub inverse_square: Lanes,
}

/// With γ = η·(2ξ + η), |Y|² = |ξ|² + γ and the stretch is s = γ/(|ξ|² (2 + s)), which loses no digits
/// when |Y| is close to |ξ| and is the same to the bit from both ends. `linear` takes what is linear
/// in η instead. η is the displacement of the far end relative to the own one, m.
#[inline(always)]
pub fn deform<A: Arithmetic, const D: usize>(
    reference: &Reference<D>,
    eta: [Lanes; D],
    linear: bool,
) -> Bond<D> {
    let Reference {
        along: xi,
        square,
        length,
        inverse,
        inverse_square,
    } = *reference;
    if linear {
        let mut growth = eta[0] * xi[0];
        for d in 1..D {
            growth = A::multiply_add(eta[d], xi[d], growth);
        }
        return Bond {
            reference: xi,
            length,
            stretch: growth * inverse_square,
            along: xi,
            inverse_length: inverse,
        };
    }
    let along: [Lanes; D] = std::array::from_fn(|d| xi[d] + eta[d]);
    let mut growth = eta[0] * (xi[0] + along[0]);
    for d in 1..D {
        growth = A::multiply_add(eta[d], xi[d] + along[d], growth);
    }
    let deformed = square + growth;
    let inverse_length = A::inverse_sqrt(deformed);
    // 1 + |Y|/|ξ| = 2 + s.
    let sum = A::multiply_add(deformed * inverse_length, inverse, Lanes::splat(1.0));
    Bond {
        reference: xi,
        length,
        stretch: growth * inverse_square / sum,
        along,
        inverse_length,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::arithmetic::{Fused, Plain};

    fn reference(xi: [f64; 2]) -> Reference<2> {
        let square = xi[0] * xi[0] + xi[1] * xi[1];
        Reference {
            along: xi.map(Lanes::splat),
            square: Lanes::splat(square),
            length: Lanes::splat(square.sqrt()),
            inverse: Lanes::splat(1.0 / square.sqrt()),
            inverse_square: Lanes::splat(1.0 / square),
        }
    }

    fn stretch<A: Arithmetic>(xi: [f64; 2], eta: [f64; 2]) -> f64 {
        let deformed = deform::<A, 2>(&reference(xi), eta.map(Lanes::splat), false);
        deformed.stretch.0[0]
    }

    #[test]
    fn small_and_large_stretches_keep_their_digits() {
        for s in [1e-14, -1e-9, 1e-5, -0.3, 0.5, 10.0_f64] {
            let xi = [0.3, 0.4];
            let eta = xi.map(|x| s * x);
            for found in [stretch::<Plain>(xi, eta), stretch::<Fused>(xi, eta)] {
                assert!((found / s - 1.0).abs() < 1e-15 * 4.0, "{s} {found}");
            }
        }
    }

    #[test]
    fn both_ends_see_the_same_bits() {
        let (xi, eta) = ([0.123, -0.456], [0.001, 0.0234]);
        let opposite = [xi.map(|x| -x), eta.map(|x| -x)];
        assert_eq!(
            stretch::<Fused>(xi, eta),
            stretch::<Fused>(opposite[0], opposite[1])
        );
    }
}
