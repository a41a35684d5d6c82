//! Geometry of eight deformed bonds, without square roots and divisions at small strains.
//!
//! The deformed bond is Y = ξ + η. With γ = η·(2ξ + η) and x = γ/|ξ|², its squared length is
//! |Y|² = |ξ|² (1 + x). Laws need two functions of x:
//!
//! - the stretch Q(x) = √(1 + x) − 1;
//! - the extension divided by the deformed length, P(x) = 1 − (1 + x)^(−½). With the micromodulus c and the
//!   stretch s, a force c s Y/|Y| is (c/|ξ|) P(x) Y.
//!
//! For |x| ≤ [`NEAR`] both functions are computed as Taylor series. The first omitted term is below 6·10⁻¹⁸
//! times the result. For larger |x|, the code uses closed forms that avoid cancellation:
//! P = x/((1 + x) + √(1 + x)) and Q = x/(1 + √(1 + x)). Both ends of a bond compute bit-identical values of
//! x, and therefore also of P and Q.

use crate::lanes::simd::Task;
use crate::lanes::{LaneTuple, Lanes, Simd};

/// Largest |x| for which the Taylor series are used.
pub const NEAR: f64 = 1.0 / 256.0;

/// Coefficients of the series of P(x)/x.
const EXTENSION_OVER_DEFORMED: [f64; 7] = [
    0.5,
    -0.375,
    0.3125,
    -0.273_437_5,
    0.246_093_75,
    -0.225_585_937_5,
    0.209_472_656_25,
];

/// Coefficients of the series of Q(x)/x.
const STRETCH: [f64; 7] = [
    0.5,
    -0.125,
    0.0625,
    -0.039_062_5,
    0.027_343_75,
    -0.020_507_812_5,
    0.016_113_281_25,
];

/// Geometry of eight bonds.
#[derive(Debug, Clone, Copy)]
pub struct Bond<const D: usize> {
    /// ξ by component, m.
    pub reference: [Lanes; D],
    /// |ξ|, m.
    pub length: Lanes,
    /// 1/|ξ|, 1/m.
    pub inverse: Lanes,
    /// x = (|Y|² − |ξ|²)/|ξ|²; for linear laws ξ·η/|ξ|².
    pub relative_square_extension: Lanes,
    /// s = (|Y| − |ξ|)/|ξ|; for linear laws ξ·η/|ξ|². Valid for intact bonds if [`Wanted::stretch`] is set.
    pub stretch: Lanes,
    /// (|Y| − |ξ|)/|Y|; for linear laws ξ·η/|ξ|². Valid for intact bonds if
    /// [`Wanted::extension_over_deformed`] is set.
    pub extension_over_deformed: Lanes,
    /// η by component, m.
    pub eta: [Lanes; D],
    /// Y by component, m. For linear laws, ξ by component instead.
    pub deformed: [Lanes; D],
    /// Mask of the intact bonds whose |x| exceeds the `limit` of [`deform`]. For linear laws, mask of all
    /// intact bonds.
    pub beyond_series: u8,
}

/// Weights of a bond in the sums of its two ends: influence times volume correction.
#[derive(Debug, Clone, Copy)]
pub enum Weights {
    /// Both weights are 1.
    One,
    /// The same weight at both ends.
    Same(Lanes),
    /// The weights at point i and at neighbour j.
    Each([Lanes; 2]),
}

impl Weights {
    /// Return two masks, for points i and j. In the mask of a point, the bits of the bonds within the horizon
    /// of this point are set. The force state of the point acts only on these bonds. Broken bonds are
    /// included in the masks.
    #[inline(always)]
    pub fn acting(self) -> [u8; 2] {
        match self {
            Self::One | Self::Same(_) => [u8::MAX; 2],
            Self::Each([i, j]) => [i.above(0.0), j.above(0.0)],
        }
    }

    /// Return the weight at point i.
    #[inline(always)]
    pub fn at_i(self) -> Lanes {
        match self {
            Self::One => Lanes::splat(1.0),
            Self::Same(weight) | Self::Each([weight, _]) => weight,
        }
    }

    /// Return the weight at neighbour j.
    #[inline(always)]
    pub fn at_j(self) -> Lanes {
        match self {
            Self::One => Lanes::splat(1.0),
            Self::Same(weight) | Self::Each([_, weight]) => weight,
        }
    }

    /// Return the weights without volume correction and influence function: 1 at the ends whose force states
    /// act on the bond, and 0 at the other ends.
    #[inline(always)]
    pub fn uncorrected<S: Simd>(self, simd: S) -> Self {
        match self {
            Self::One | Self::Same(_) => Self::One,
            Self::Each(_) => {
                let ([i, j], one) = (self.acting(), Lanes::splat(1.0));
                Self::Each([simd.keep(one, i), simd.keep(one, j)])
            }
        }
    }

    /// Return the weighted sum of the contributions of i and j. The result has the same bits if i and j are
    /// exchanged.
    #[inline(always)]
    pub fn sum(self, here: Lanes, there: Lanes) -> Lanes {
        match self {
            Self::One => here + there,
            Self::Same(weight) => (here + there) * weight,
            Self::Each([own, far]) => here * own + there * far,
        }
    }
}

/// Elastic part of the relative displacements of eight bonds. Each bond has its own thermal stretch a.
#[derive(Debug, Clone, Copy)]
pub struct Elastic<const D: usize> {
    /// Elastic relative displacement Y/(1 + a) − ξ, m.
    pub eta: [Lanes; D],
    /// ∂(Y/(1 + a))/∂Y = 1/(1 + a).
    pub slope: Lanes,
}

/// Task that removes the thermal stretch from the relative displacement η (m) of bonds. Let a be the thermal
/// stretch of a bond.
///
/// Laws receive Y/(1 + a) instead of Y. Forces are multiplied by 1/(1 + a), the derivative of Y/(1 + a) with
/// respect to Y. Forces then remain the derivative of the energy with respect to Y.
/// A bond of length (1 + a)|ξ| is free of force.
pub struct SeparateThermal<const D: usize> {
    /// ξ by component, m.
    pub xi: [Lanes; D],
    /// η by component, m.
    pub eta: [Lanes; D],
    /// Thermal stretches of points i and j; a is their mean.
    pub stretches: [Lanes; 2],
}

impl<const D: usize> Task for SeparateThermal<D> {
    type Output = Elastic<D>;

    #[inline(always)]
    fn run<S: Simd>(self, _: S) -> Elastic<D> {
        let stretch = (self.stretches[0] + self.stretches[1]) * 0.5;
        let slope = Lanes::splat(1.0) / (Lanes::splat(1.0) + stretch);
        Elastic {
            eta: LaneTuple::each(|d| (self.eta[d] - self.xi[d] * stretch) * slope),
            slope,
        }
    }
}

/// Reference geometry of eight bonds.
#[derive(Debug, Clone, Copy)]
pub struct Reference<const D: usize> {
    /// ξ by component, m.
    pub xi: [Lanes; D],
    /// |ξ|, m.
    pub length: Lanes,
    /// 1/|ξ|, 1/m.
    pub inverse: Lanes,
    /// 1/|ξ|², 1/m².
    pub inverse_square: Lanes,
}

/// The quantities of deformed bonds that a loop reads.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Wanted {
    /// The law is linear in η.
    pub linear: bool,
    /// Compute [`Bond::stretch`].
    pub stretch: bool,
    /// Compute [`Bond::extension_over_deformed`].
    pub extension_over_deformed: bool,
}

/// Compute the geometry of bonds with the relative displacement η (m).
///
/// Stretches are computed for the bonds whose bit in `intact` is set. [`Bond::beyond_series`] marks the
/// intact bonds with |x| above `limit`. The `limit` must be at most [`NEAR`]. With `ONLY_NEAR`, the stretches
/// of bonds with |x| above [`NEAR`] are wrong, because the series are used for all bonds.
#[inline(always)]
pub fn deform<S: Simd, const ONLY_NEAR: bool, const D: usize>(
    simd: S,
    reference: &Reference<D>,
    eta: [Lanes; D],
    intact: u8,
    limit: f64,
    wanted: Wanted,
) -> Bond<D> {
    let linear = wanted.linear;
    let Reference {
        xi,
        length,
        inverse,
        inverse_square,
    } = *reference;
    let deformed: [Lanes; D] = LaneTuple::each(|d| xi[d] + eta[d]);
    let sum = |d: usize| if linear { xi[d] } else { xi[d] + deformed[d] };
    let mut relative_square_extension = eta[0] * sum(0);
    for d in 1..D {
        relative_square_extension = simd.multiply_add(eta[d], sum(d), relative_square_extension);
    }
    let relative_square_extension = simd.opaque(relative_square_extension * inverse_square);
    if linear {
        return Bond {
            reference: xi,
            length,
            inverse,
            relative_square_extension,
            stretch: relative_square_extension,
            extension_over_deformed: relative_square_extension,
            eta,
            deformed: xi,
            beyond_series: intact,
        };
    }
    // The bit of a bond with x = NaN is set, too.
    let beyond_series =
        intact & !simd.at_least(Lanes::splat(limit), relative_square_extension.abs());
    let (mut stretch, mut extension_over_deformed) =
        (relative_square_extension, relative_square_extension);
    if wanted.stretch {
        let near = series(simd, relative_square_extension, &STRETCH);
        stretch = if ONLY_NEAR {
            simd.opaque(near)
        } else {
            with_far(simd, relative_square_extension, beyond_series, near, |_| {
                (Lanes::splat(1.0), Lanes::splat(0.0))
            })
        };
    }
    if wanted.extension_over_deformed {
        let near = series(simd, relative_square_extension, &EXTENSION_OVER_DEFORMED);
        extension_over_deformed = if ONLY_NEAR {
            simd.opaque(near)
        } else {
            with_far(
                simd,
                relative_square_extension,
                beyond_series,
                near,
                |square| square,
            )
        };
    }
    Bond {
        reference: xi,
        length,
        inverse,
        relative_square_extension,
        stretch,
        extension_over_deformed,
        eta,
        deformed,
        beyond_series,
    }
}

impl<const D: usize> Bond<D> {
    /// Compute [`Self::stretch`]. For linear laws, [`deform`] has already set the stretch. Loops call this
    /// function only for the groups of bonds that need stretches.
    pub fn with_stretch(mut self, linear: bool) -> Self {
        if !linear {
            let one = Lanes::splat(1.0);
            self.stretch = self.relative_square_extension
                / (one + (one + self.relative_square_extension).sqrt());
        }
        self
    }
}

/// Return a + b and its rounding error (two-sum).
#[inline(always)]
fn sum_with_rest(a: Lanes, b: Lanes) -> (Lanes, Lanes) {
    let sum = a + b;
    let part = sum - a;
    (sum, (a - (sum - part)) + (b - part))
}

/// Return x/(√(1 + x) + o) in each lane whose bit in `beyond_series` is set and whose |x| is above [`NEAR`].
/// Return `near` in all other lanes. `other` computes o and the rounding error of o. Its input is 1 + x and
/// the rounding error of this sum.
#[inline(always)]
fn with_far<S: Simd, O: Fn((Lanes, Lanes)) -> (Lanes, Lanes)>(
    simd: S,
    relative_square_extension: Lanes,
    beyond_series: u8,
    near: Lanes,
    other: O,
) -> Lanes {
    if beyond_series == 0 {
        return simd.opaque(near);
    }
    simd.opaque(simd.aside(ClosedForm {
        relative_square_extension,
        beyond_series,
        near,
        other,
    }))
}

/// Task that [`with_far`] runs for the lanes with |x| above [`NEAR`], where x is `relative_square_extension`.
/// `other` receives and returns pairs of a number and its rounding error.
struct ClosedForm<O> {
    relative_square_extension: Lanes,
    beyond_series: u8,
    near: Lanes,
    other: O,
}

impl<O: Fn((Lanes, Lanes)) -> (Lanes, Lanes)> Task for ClosedForm<O> {
    type Output = Lanes;

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) -> Lanes {
        let x = self.relative_square_extension;
        let far = self.beyond_series & !simd.at_least(Lanes::splat(NEAR), x.abs());
        let (square, lost) = sum_with_rest(Lanes::splat(1.0), x);
        let root = square.sqrt();
        let rest = simd.multiply_add(root * -1.0, root, square) + lost;
        // If the ends of the bond coincide, the root is 0 and needs no correction.
        let root_lost = simd.keep(rest / (root + root), root.above(0.0));
        let (other, other_lost) = (self.other)((square, lost));
        let (divisor, sum_lost) = sum_with_rest(other, root);
        let divisor = divisor + (sum_lost + (other_lost + root_lost));
        simd.select(x / divisor, far, self.near)
    }
}

#[inline(always)]
fn series<S: Simd>(simd: S, x: Lanes, coefficients: &[f64; 7]) -> Lanes {
    let mut sum = Lanes::splat(coefficients[6]);
    for k in (0..6).rev() {
        sum = simd.multiply_add(sum, x, Lanes::splat(coefficients[k]));
    }
    sum * x
}

/// Return x = (1 + s)² − 1 of a stretch s. x grows with s, so two stretches can be compared by their x.
#[inline(always)]
pub fn relative_square_extension_of(stretch: f64) -> f64 {
    stretch * (2.0 + stretch)
}

/// Return the stretch √(1 + x) − 1.
pub fn stretch_of(relative_square_extension: f64) -> f64 {
    relative_square_extension / (1.0 + (1.0 + relative_square_extension).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::simd::Portable;

    const ALL: Wanted = Wanted {
        linear: false,
        stretch: true,
        extension_over_deformed: true,
    };

    /// Return bonds with exactly the given values of x = (|Y|² − |ξ|²)/|ξ|². The fields of `reference` are
    /// chosen only to give these values, and do not belong to any real ξ.
    fn of_growth(simd: impl Simd, relative_square_extension: [f64; 8]) -> Bond<1> {
        let one = Lanes::splat(1.0);
        let reference = Reference {
            xi: [Lanes::splat(0.0)],
            length: one,
            inverse: one,
            inverse_square: Lanes(relative_square_extension),
        };
        // γ = η (2ξ + η) = 1, and `inverse_square` is x.
        deform::<_, false, 1>(simd, &reference, [one], u8::MAX, NEAR, ALL)
    }

    fn bond(xi: [f64; 2], eta: [f64; 2]) -> Bond<2> {
        let square = xi[0] * xi[0] + xi[1] * xi[1];
        let reference = Reference {
            xi: xi.map(Lanes::splat),
            length: Lanes::splat(square.sqrt()),
            inverse: Lanes::splat(1.0 / square.sqrt()),
            inverse_square: Lanes::splat(1.0 / square),
        };
        deform::<_, false, 2>(
            Portable::<true>,
            &reference,
            eta.map(Lanes::splat),
            u8::MAX,
            NEAR,
            ALL,
        )
    }

    #[test]
    fn small_and_large_stretches_keep_their_digits() {
        for s in [1e-14, -1e-9, 1e-5, 1e-3, -0.3, 0.5, 10.0_f64] {
            let xi = [0.3, 0.4];
            let bond = bond(xi, xi.map(|x| s * x));
            let [stretch, extension_over_deformed] =
                [bond.stretch, bond.extension_over_deformed].map(|lanes| lanes.0[0]);
            assert!((stretch / s - 1.0).abs() < 4e-15, "{s} {stretch}");
            assert!(
                (extension_over_deformed * (1.0 + s) / s - 1.0).abs() < 4e-15,
                "{s} {extension_over_deformed}"
            );
        }
    }

    #[test]
    fn both_ends_see_the_same_bits() {
        let (xi, eta) = ([0.123, -0.456], [0.001, 0.0234]);
        let opposite = bond(xi.map(|x| -x), eta.map(|x| -x));
        assert_eq!(
            bond(xi, eta).relative_square_extension,
            opposite.relative_square_extension
        );
        assert_eq!(bond(xi, eta).stretch, opposite.stretch);
    }

    /// A number as the sum of two `f64`, accurate to about 10⁻³².
    #[derive(Clone, Copy)]
    struct Double(f64, f64);

    impl Double {
        fn sum(a: f64, b: f64) -> Self {
            let sum = a + b;
            let part = sum - a;
            Self(sum, (a - (sum - part)) + (b - part))
        }

        fn plus(self, other: Self) -> Self {
            let Self(high, low) = Self::sum(self.0, other.0);
            Self::sum(high, low + self.1 + other.1)
        }

        fn root(self) -> Self {
            let first = self.0.sqrt();
            let rest = (-first).mul_add(first, self.0) + self.1;
            Self::sum(first, rest / (2.0 * first))
        }

        /// Return `number`/`self`.
        fn under(self, number: f64) -> Self {
            let first = number / self.0;
            let rest = (-first).mul_add(self.0, number) - first * self.1;
            Self::sum(first, rest / self.0)
        }
    }

    /// Return the error of a number in units in the last place.
    fn error(found: f64, exact: Double) -> f64 {
        let unit = exact.0.abs().next_up() - exact.0.abs();
        ((found - exact.0) - exact.1).abs() / unit
    }

    #[test]
    fn no_value_is_off_by_more_than_two_units() {
        #[cfg(not(target_arch = "x86_64"))]
        check_ten_million(Portable::<true>);
        #[cfg(target_arch = "x86_64")]
        {
            use crate::lanes::simd::{Avx2, Avx512};
            Avx2::detect().into_iter().for_each(check_ten_million);
            Avx512::detect().into_iter().for_each(check_ten_million);
        }
    }

    fn check_ten_million(simd: impl Simd) {
        let mut worst = [0.0_f64; 2];
        let mut check = |relative_square_extension: [f64; 8]| {
            let bond = of_growth(simd, relative_square_extension);
            for (k, x) in relative_square_extension.into_iter().enumerate() {
                let square = Double::sum(1.0, x);
                let root = square.root();
                let stretch = Double(1.0, 0.0).plus(root).under(x);
                let extension_over_deformed = square.plus(root).under(x);
                worst[0] = worst[0].max(error(bond.stretch.0[k], stretch));
                worst[1] = worst[1].max(error(
                    bond.extension_over_deformed.0[k],
                    extension_over_deformed,
                ));
            }
        };
        let tiny = f64::MIN_POSITIVE;
        let almost = (-1.0_f64).next_up();
        check([
            NEAR,
            NEAR.next_up(),
            NEAR.next_down(),
            1e-300,
            0.5,
            1e6,
            3.0,
            1.0,
        ]);
        check([
            -NEAR,
            (-NEAR).next_up(),
            (-NEAR).next_down(),
            -1e-300,
            -0.5,
            -0.75,
            almost,
            -0.999,
        ]);
        check([
            1e-16,
            -1e-16,
            1e-8,
            -1e-8,
            4.0 * tiny,
            -4.0 * tiny,
            1e15,
            1e100,
        ]);
        let zero = of_growth(simd, [0.0; 8]);
        assert_eq!(
            (zero.stretch, zero.extension_over_deformed),
            (Lanes::splat(0.0), Lanes::splat(0.0))
        );
        // Ten million numbers: of all sizes up to 1, near the limit of the series, at usual strains, and at
        // large strains.
        let mut state = 0x9e37_79b9_7f4a_7c15_u64;
        let mut random = || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 11) as f64 / (1_u64 << 53) as f64
        };
        for round in 0..1_250_000 {
            check(std::array::from_fn(|_| {
                let sign = if random() < 0.5 { -1.0 } else { 1.0 };
                match round % 4 {
                    0 => sign * libm::pow(10_f64, -20.0 * random()),
                    1 => sign * NEAR * (0.9 + 0.2 * random()),
                    2 => 0.02 * (random() - 0.5),
                    _ => 5.0 * random() - 0.999_999,
                }
            }));
        }
        assert!(worst[0] <= 2.0 && worst[1] <= 2.0, "{worst:?}");
    }
}
