//! Eight bonds as the kernels see them: what is read of both ends, and the geometry between them.

use crate::material::{Arithmetic, Bond, End, Lanes};

/// The influence and the share of the volume that a bond has in the sums of its two ends.
#[derive(Debug, Clone, Copy)]
pub enum Weights {
    /// 1.
    One,
    /// The same at both ends.
    Same(Lanes),
    /// Those of the own and of the far end.
    Each([Lanes; 2]),
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

/// Eight bonds.
pub struct Loaded<const D: usize> {
    /// What laws see.
    pub bond: Bond,
    /// ξ by component, m.
    pub reference: [Lanes; D],
    /// What the force is along by component, m: Y, or ξ for linear laws.
    pub along: [Lanes; D],
    /// Its inverse length, 1/m.
    pub inverse_length: Lanes,
    /// Volumes of the own ends, m³.
    pub own_volume: Lanes,
    /// Volumes of the far ends, m³.
    pub volume: Lanes,
    /// What volumes are multiplied by.
    pub weights: Weights,
    /// What the own and the far ends know of their families.
    pub ends: [End; 2],
    /// Stretches at which the bonds of the own and the far ends break.
    pub thresholds: [Lanes; 2],
    /// A bit for each bond that is intact.
    pub intact: u8,
    /// A bit for each bond, broken or not; only for kernels that want it.
    pub filled: u8,
    /// A bit for each bond that can break.
    pub breakable: u8,
}

impl Weights {
    /// That of the own end.
    #[inline(always)]
    pub fn own(self) -> Lanes {
        match self {
            Self::One => Lanes::splat(1.0),
            Self::Same(own) | Self::Each([own, _]) => own,
        }
    }

    /// That of the far end.
    #[inline(always)]
    pub fn far(self) -> Lanes {
        match self {
            Self::One => Lanes::splat(1.0),
            Self::Same(far) | Self::Each([_, far]) => far,
        }
    }
}

impl<const D: usize> Loaded<D> {
    /// A bit for each intact bond that counts in the own end's sums.
    #[inline(always)]
    pub fn family(&self) -> u8 {
        match self.weights {
            Weights::One => self.intact,
            weights => self.intact & weights.own().above(0.0),
        }
    }
}

/// What bonds look like whose ends move by η (m) against one another.
#[derive(Debug, Clone, Copy)]
pub struct Deformed<const D: usize> {
    /// What laws see.
    pub bond: Bond,
    /// See [`Loaded::along`].
    pub along: [Lanes; D],
    /// See [`Loaded::inverse_length`].
    pub inverse_length: Lanes,
}

/// With γ = η·(2ξ + η), |Y|² = |ξ|² + γ and the stretch is s = γ/(|ξ|² (2 + s)), which loses no digits
/// when |Y| is close to |ξ| and is the same to the bit from both ends. `linear` takes what is linear
/// in η instead.
#[inline(always)]
pub fn deform<A: Arithmetic, const D: usize>(
    reference: &Reference<D>,
    eta: [Lanes; D],
    linear: bool,
) -> Deformed<D> {
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
        return Deformed {
            bond: Bond {
                length,
                stretch: growth * inverse_square,
            },
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
    Deformed {
        bond: Bond {
            length,
            stretch: growth * inverse_square / sum,
        },
        along,
        inverse_length,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::material::arithmetic::{Fused, Plain};

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
        deformed.bond.stretch.0[0]
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
