//! Vectors of eight numbers: the same quantity of eight bonds or points.
//!
//! The operations are IEEE operations on plain arrays, and functions of `libm`. The compiler does not fuse
//! multiplications and additions. Therefore all instruction sets give bitwise the same results. Operations
//! that depend on the instruction set, such as fused multiply-adds, are in [`simd`].

mod column;
pub mod instructions;
mod isa_set;
pub mod lane_tuple;
pub mod simd;

pub use column::Column;
pub use instructions::Instructions;
pub use isa_set::IsaSet;
pub use lane_tuple::{LaneTuple, UpTo};
pub use simd::Simd;

use std::ops::{Add, AddAssign, Div, Mul, Sub};

/// Number of lanes: eight bonds are computed together.
pub const WIDTH: usize = 8;

/// One number for each of eight bonds or points.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(align(64))]
pub struct Lanes(pub [f64; WIDTH]);

impl Lanes {
    /// Create a vector with the same number in all lanes.
    #[inline(always)]
    pub fn splat(value: f64) -> Self {
        Self([value; WIDTH])
    }

    /// Apply a function to each lane. The code has one call per lane instead of a loop, because this method
    /// is inlined at very many places and a loop takes longer to compile.
    #[inline(always)]
    fn map(self, of: impl Fn(f64) -> f64) -> Self {
        let [a, b, c, d, e, f, g, h] = self.0;
        Self([of(a), of(b), of(c), of(d), of(e), of(f), of(g), of(h)])
    }

    /// Apply a function to each pair of lanes. The code has one call per pair instead of a loop, for the same
    /// reason as in [`Self::map`].
    #[inline(always)]
    fn zip(self, other: Self, of: impl Fn(f64, f64) -> f64) -> Self {
        let (a, b) = (self.0, other.0);
        Self([
            of(a[0], b[0]),
            of(a[1], b[1]),
            of(a[2], b[2]),
            of(a[3], b[3]),
            of(a[4], b[4]),
            of(a[5], b[5]),
            of(a[6], b[6]),
            of(a[7], b[7]),
        ])
    }

    /// Return the square root of each lane.
    #[inline(always)]
    pub fn sqrt(self) -> Self {
        self.map(f64::sqrt)
    }

    /// Return the exponential of each lane, computed by `libm::exp`, which gives the same result on every
    /// processor.
    #[inline(always)]
    pub fn exp(self) -> Self {
        self.map(libm::exp)
    }

    /// Raise each lane to the power `exponent` by `libm::pow`, which gives the same result on every
    /// processor.
    #[inline(always)]
    pub fn pow(self, exponent: f64) -> Self {
        self.map(|base| libm::pow(base, exponent))
    }

    /// Return the smaller lane of each pair. If one of the lanes is NaN, the result is the lane of `other`.
    #[inline(always)]
    pub fn min(self, other: Self) -> Self {
        self.zip(other, |a, b| if a < b { a } else { b })
    }

    /// Return the larger lane of each pair. If one of the lanes is NaN, the result is the lane of `other`.
    #[inline(always)]
    pub fn max(self, other: Self) -> Self {
        self.zip(other, |a, b| if a > b { a } else { b })
    }

    /// Return the absolute value of each lane.
    #[inline(always)]
    pub fn abs(self) -> Self {
        self.map(f64::abs)
    }

    /// Return one bit per lane, set if the lane is larger than `limit`.
    #[inline(always)]
    pub fn above(self, limit: f64) -> u8 {
        let mut bits = 0;
        for k in 0..WIDTH {
            bits |= u8::from(self.0[k] > limit) << k;
        }
        bits
    }

    /// Return the sum of all lanes, added in a fixed order.
    #[inline(always)]
    pub fn sum(self) -> f64 {
        let [a, b, c, d, e, f, g, h] = self.0;
        ((a + e) + (c + g)) + ((b + f) + (d + h))
    }

    /// Return the smallest lane. No lane may be NaN.
    #[inline(always)]
    pub fn smallest(self) -> f64 {
        let mut smallest = self.0[0];
        for k in 1..WIDTH {
            if self.0[k] < smallest {
                smallest = self.0[k];
            }
        }
        smallest
    }
}

impl Add for Lanes {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.zip(other, |a, b| a + b)
    }
}

impl AddAssign for Lanes {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl Sub for Lanes {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.zip(other, |a, b| a - b)
    }
}

impl Mul for Lanes {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.zip(other, |a, b| a * b)
    }
}

impl Mul<f64> for Lanes {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: f64) -> Self {
        self.map(|a| a * factor)
    }
}

impl Div for Lanes {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        self.zip(other, |a, b| a / b)
    }
}
