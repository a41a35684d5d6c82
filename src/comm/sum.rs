//! An exact floating-point sum, independent of the order of its terms.
//!
//! Every finite `f64` is an integer multiple of 2⁻¹⁰⁷⁴, so a wide fixed-point integer represents any sum
//! exactly. Integer addition is associative, so the result is bitwise the same for any number of ranks and
//! threads. At the end, the integer is converted to `f64`, with an error of at most one unit in the last
//! place.

use super::Communicator;

const LIMB_BITS: usize = 32;
/// The range 2⁻¹⁰⁷⁴ … 2¹⁰²³ needs 2098 bits. Two more limbs hold the carries of up to 2⁶³ terms.
const LIMBS: usize = 2098_usize.div_ceil(LIMB_BITS) + 2;
/// Number of terms after which carries must be propagated. Each term adds less than 2³² to a limb, so 2³⁰
/// terms do not overflow its `i64`.
const TERMS_BEFORE_CARRY: u32 = 1 << 30;

/// An exact accumulator of finite `f64` terms.
#[derive(Clone, Debug)]
pub struct ExactSum {
    limbs: [i64; LIMBS],
    pending: u32,
    finite: bool,
}

impl ExactSum {
    /// The empty sum.
    pub const ZERO: Self = Self {
        limbs: [0; LIMBS],
        pending: 0,
        finite: true,
    };
}

impl Default for ExactSum {
    fn default() -> Self {
        Self::ZERO
    }
}

impl ExactSum {
    /// Add one term. A term that is not finite makes the sum NaN.
    pub fn add(&mut self, term: f64) {
        let bits = term.to_bits();
        let exponent = (bits >> 52 & 0x7ff) as usize;
        if exponent == 0x7ff {
            self.finite = false;
            return;
        }
        let fraction = bits & ((1 << 52) - 1);
        let (mantissa, shift) = if exponent == 0 {
            (fraction, 0)
        } else {
            (fraction | 1 << 52, exponent - 1)
        };
        let wide = u128::from(mantissa) << (shift % LIMB_BITS);
        let sign = if term.is_sign_negative() { -1 } else { 1 };
        for (k, limb) in self.limbs[shift / LIMB_BITS..]
            .iter_mut()
            .take(3)
            .enumerate()
        {
            *limb += sign * (wide >> (k * LIMB_BITS) & 0xffff_ffff) as i64;
        }
        self.pending += 1;
        if self.pending >= TERMS_BEFORE_CARRY {
            self.carry();
        }
    }

    /// Add another sum.
    pub fn merge(&mut self, other: &Self) {
        let mut other = other.clone();
        other.carry();
        self.carry();
        for (limb, more) in self.limbs.iter_mut().zip(other.limbs) {
            *limb += more;
        }
        self.finite &= other.finite;
        self.carry();
    }

    /// Propagate carries, so that every limb except the highest is in 0 … 2³² − 1.
    fn carry(&mut self) {
        let mut carry = 0;
        for limb in &mut self.limbs[..LIMBS - 1] {
            let value = *limb + carry;
            *limb = value & 0xffff_ffff;
            carry = value >> LIMB_BITS;
        }
        self.limbs[LIMBS - 1] += carry;
        self.pending = 1;
    }

    /// The sum of the terms, rounded to `f64`; NaN if a term was not finite.
    pub fn value(&self) -> f64 {
        if !self.finite {
            return f64::NAN;
        }
        let mut magnitude = self.clone();
        magnitude.carry();
        let negative = magnitude.limbs[LIMBS - 1] < 0;
        if negative {
            magnitude.limbs.iter_mut().for_each(|limb| *limb = -*limb);
            magnitude.carry();
        }
        let Some(top) = magnitude.limbs.iter().rposition(|limb| *limb != 0) else {
            return 0.0;
        };
        // The four highest limbs are the whole sum, or contain at least 97 significant bits. The conversion
        // rounds once, to 53 bits.
        let lowest = top.saturating_sub(3);
        let head = magnitude.limbs[lowest..=top]
            .iter()
            .rev()
            .fold(0_u128, |head, limb| head << LIMB_BITS | *limb as u128);
        let value = scale(head as f64, (lowest * LIMB_BITS) as i32 - 1074);
        if negative { -value } else { value }
    }
}

/// Return `value` · 2^`exponent`. The power is applied as two factors, because 2^`exponent` can underflow.
fn scale(value: f64, exponent: i32) -> f64 {
    let half = exponent / 2;
    value * 2_f64.powi(half) * 2_f64.powi(exponent - half)
}

/// Sum each accumulator over all ranks; the results are bit-identical on any number of ranks. Collective.
pub fn reduce(comm: &dyn Communicator, sums: &mut [ExactSum]) -> Vec<f64> {
    let mut words = Vec::with_capacity(sums.len() * (LIMBS + 1));
    for sum in sums.iter_mut() {
        sum.carry();
        words.extend(sum.limbs.iter().map(|limb| *limb as u64));
        words.push(u64::from(!sum.finite));
    }
    comm.sum(&mut words);
    words
        .chunks_exact(LIMBS + 1)
        .map(|chunk| {
            let mut sum = ExactSum::default();
            for (limb, word) in sum.limbs.iter_mut().zip(chunk) {
                *limb = *word as i64;
            }
            sum.finite = chunk[LIMBS] == 0;
            sum.value()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comm::threads;
    use proptest::prelude::*;

    fn exact(terms: &[f64]) -> f64 {
        let mut sum = ExactSum::default();
        terms.iter().for_each(|term| sum.add(*term));
        sum.value()
    }

    #[test]
    fn cancellation_loses_nothing() {
        assert_eq!(exact(&[1e300, 1.0, -1e300]), 1.0);
        assert_eq!(exact(&[f64::MIN_POSITIVE, -1.0, 1.0]), f64::MIN_POSITIVE);
        assert_eq!(exact(&[5e-324, 5e-324]), 1e-323);
        assert_eq!(exact(&[-0.1, -0.2]), -0.1 - 0.2);
        assert_eq!(exact(&[]), 0.0);
        assert!(exact(&[1.0, f64::INFINITY]).is_nan());
    }

    proptest! {
        #[test]
        fn the_sum_is_independent_of_order_and_ranks(
            terms in prop::collection::vec(-1e20..1e20_f64, 0..40),
            small in prop::collection::vec(-1e-20..1e-20_f64, 0..40),
            ranks in 1_usize..5,
        ) {
            let all: Vec<f64> = terms.iter().chain(&small).copied().collect();
            let mut reversed = all.clone();
            reversed.reverse();
            let expected = exact(&all);
            prop_assert_eq!(expected.to_bits(), exact(&reversed).to_bits());
            let split = threads::run(ranks, |comm| {
                let mut sums = [ExactSum::default()];
                for term in all.iter().skip(comm.rank()).step_by(comm.size()) {
                    sums[0].add(*term);
                }
                reduce(comm, &mut sums)[0]
            });
            for value in split {
                prop_assert_eq!(expected.to_bits(), value.to_bits());
            }
        }

        #[test]
        fn one_term_is_itself(term in prop::num::f64::NORMAL | prop::num::f64::SUBNORMAL) {
            prop_assert_eq!(exact(&[term]).to_bits(), term.to_bits());
        }
    }
}
