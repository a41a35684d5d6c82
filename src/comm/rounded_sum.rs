//! Sums of terms that are rounded to multiples of a common unit.
//!
//! A sum of integers does not depend on the order of the terms. A rounded sum is therefore bitwise the same
//! for any number of ranks and threads. A rounded sum needs 8 bytes, and an [`ExactSum`](super::ExactSum)
//! needs 552 bytes. The error of a rounded sum is at most half a unit per term. Use rounded sums if the sum
//! must be reproducible but need not be exact.

/// Number of bits for the magnitude of a sum.
const BITS: i32 = 62;

/// Largest allowed n for `Unit::factor` = 2ⁿ. With this limit, the factor and its inverse are finite.
const MOST: i32 = 1000;

/// The unit of the terms: a power of 2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Unit {
    /// Inverse of the unit.
    factor: f64,
    /// The unit.
    size: f64,
}

impl Unit {
    /// Return a unit for which the sum of `terms` terms does not overflow. The absolute value of a term must
    /// not exceed `magnitude`. The unit is a power of 2. It is close to the smallest unit that prevents
    /// overflow, but not below 2⁻¹⁰⁰⁰. `None` if the magnitude is 0 or not finite.
    pub fn of(magnitude: f64, terms: u64) -> Option<Self> {
        if magnitude == 0.0 || !magnitude.is_finite() {
            return None;
        }
        let (_, exponent) = libm::frexp(magnitude);
        let terms = (u64::BITS - terms.leading_zeros()) as i32;
        let exponent = (BITS - terms - exponent).min(MOST);
        Some(Self {
            factor: libm::scalbn(1.0, exponent),
            size: libm::scalbn(1.0, -exponent),
        })
    }

    /// Round a term to an integer number of units.
    #[inline]
    pub fn round(self, term: f64) -> i64 {
        libm::rint(term * self.factor) as i64
    }

    /// Return the value of a sum that is given as a number of units.
    #[inline]
    pub fn value(self, sum: i64) -> f64 {
        sum as f64 * self.size
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_are_close_and_do_not_overflow() {
        for magnitude in [1e-320, 1e-200, 3.7, 1e300] {
            for count in [1_u64, 1000, 1 << 20] {
                let unit = Unit::of(magnitude, count).unwrap();
                let terms = [magnitude, -0.3 * magnitude, 0.7 * magnitude];
                for term in terms {
                    let all = unit.round(term).checked_mul(count as i64).unwrap();
                    let exact = term * count as f64;
                    let error = (unit.value(all) - exact).abs();
                    let most = 1e-12 * magnitude * count as f64;
                    assert!(error <= most.max(1e-301), "{magnitude} {count} {error}");
                }
            }
        }
        assert_eq!(Unit::of(0.0, 3), None);
        assert_eq!(Unit::of(f64::NAN, 3), None);
    }
}
