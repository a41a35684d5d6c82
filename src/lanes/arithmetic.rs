//! The operations whose rounding depends on the instructions of a machine.
//!
//! All other operations on [`Lanes`] round alike everywhere. A run uses one kind on all ranks, the
//! best that every one of them has, so that results do not depend on which rank found them.

use super::Lanes;

/// A way to carry out operations that differ between instruction sets in the last bits.
pub trait Arithmetic: Copy + Send + Sync {
    /// a b + c, rounded once or twice.
    fn multiply_add(a: Lanes, b: Lanes, c: Lanes) -> Lanes;

    /// 1/√a for a > 0, to within 2 units in the last place.
    fn inverse_sqrt(a: Lanes) -> Lanes;

    /// As [`Lanes::at_least`].
    #[inline(always)]
    fn at_least(a: Lanes, b: Lanes) -> u8 {
        a.at_least(b)
    }

    /// As [`Lanes::select`].
    #[inline(always)]
    fn select(a: Lanes, bits: u8, otherwise: f64) -> Lanes {
        a.select(bits, otherwise)
    }

    /// The transpose of eight rows of eight numbers: lane k of result j is number j of row k.
    #[inline(always)]
    fn transpose(rows: [&[f64; 8]; 8]) -> [Lanes; 8] {
        std::array::from_fn(|column| Lanes(std::array::from_fn(|row| rows[row][column])))
    }
}

/// What every machine has.
#[derive(Debug, Clone, Copy)]
pub struct Plain;

impl Arithmetic for Plain {
    #[inline(always)]
    fn multiply_add(a: Lanes, b: Lanes, c: Lanes) -> Lanes {
        a * b + c
    }

    #[inline(always)]
    fn inverse_sqrt(a: Lanes) -> Lanes {
        Lanes::splat(1.0) / a.sqrt()
    }
}

/// Products and sums rounded once; only within code compiled for machines that do this in one
/// instruction.
#[derive(Debug, Clone, Copy)]
pub struct Fused;

impl Arithmetic for Fused {
    #[inline(always)]
    fn multiply_add(a: Lanes, b: Lanes, c: Lanes) -> Lanes {
        Lanes(std::array::from_fn(|k| a.0[k].mul_add(b.0[k], c.0[k])))
    }

    #[inline(always)]
    fn inverse_sqrt(a: Lanes) -> Lanes {
        Plain::inverse_sqrt(a)
    }
}

/// As [`Fused`], with 1/√ from an estimate of 14 bits and two Newton steps; only within code compiled
/// for AVX-512.
#[cfg(target_arch = "x86_64")]
#[derive(Debug, Clone, Copy)]
pub struct Wide;

#[cfg(target_arch = "x86_64")]
mod wide {
    use std::arch::x86_64::*;

    use super::Lanes;

    /// # Safety
    /// The machine must have AVX-512F.
    #[inline]
    #[target_feature(enable = "avx512f")]
    pub unsafe fn multiply_add(a: Lanes, b: Lanes, c: Lanes) -> Lanes {
        store(_mm512_fmadd_pd(load(a), load(b), load(c)))
    }

    /// # Safety
    /// The machine must have AVX-512F.
    #[inline]
    #[target_feature(enable = "avx512f")]
    pub unsafe fn inverse_sqrt(a: Lanes) -> Lanes {
        let a = load(a);
        let half = _mm512_mul_pd(a, _mm512_set1_pd(0.5));
        let mut root = _mm512_rsqrt14_pd(a);
        for _ in 0..2 {
            let square = _mm512_mul_pd(root, root);
            let factor = _mm512_fnmadd_pd(half, square, _mm512_set1_pd(1.5));
            root = _mm512_mul_pd(root, factor);
        }
        store(root)
    }

    /// What [`super::Wide`] starts from: 1/√a to 14 bits, of which makers are free to choose.
    ///
    /// # Safety
    /// The machine must have AVX-512F.
    #[target_feature(enable = "avx512f")]
    pub unsafe fn estimate_of_inverse_sqrt(a: Lanes) -> Lanes {
        store(_mm512_rsqrt14_pd(load(a)))
    }

    /// # Safety
    /// The machine must have AVX-512F.
    #[inline]
    #[target_feature(enable = "avx512f")]
    pub unsafe fn at_least(a: Lanes, b: Lanes) -> u8 {
        _mm512_cmp_pd_mask::<_CMP_GE_OQ>(load(a), load(b))
    }

    /// # Safety
    /// The machine must have AVX-512F.
    #[inline]
    #[target_feature(enable = "avx512f")]
    pub unsafe fn select(a: Lanes, bits: u8, otherwise: f64) -> Lanes {
        store(_mm512_mask_blend_pd(
            bits,
            _mm512_set1_pd(otherwise),
            load(a),
        ))
    }

    /// # Safety
    /// The machine must have AVX-512F.
    #[inline]
    #[target_feature(enable = "avx512f")]
    pub unsafe fn transpose(rows: [&[f64; 8]; 8]) -> [Lanes; 8] {
        // SAFETY: each row has eight numbers.
        let r = rows.map(|row| unsafe { _mm512_loadu_pd(row.as_ptr()) });
        // Pairs of rows, then of pairs, then of fours.
        let low = |a, b| _mm512_unpacklo_pd(a, b);
        let high = |a, b| _mm512_unpackhi_pd(a, b);
        let p = [
            low(r[0], r[1]),
            high(r[0], r[1]),
            low(r[2], r[3]),
            high(r[2], r[3]),
            low(r[4], r[5]),
            high(r[4], r[5]),
            low(r[6], r[7]),
            high(r[6], r[7]),
        ];
        // Columns 0, 4 | 2, 6 of rows 0–3 lie in 128-bit parts 0, 2 | 1, 3.
        let even = |a, b| _mm512_shuffle_f64x2::<0b10_00_10_00>(a, b);
        let odd = |a, b| _mm512_shuffle_f64x2::<0b11_01_11_01>(a, b);
        let a = even(p[0], p[2]);
        let b = even(p[4], p[6]);
        let c = odd(p[0], p[2]);
        let d = odd(p[4], p[6]);
        let e = even(p[1], p[3]);
        let f = even(p[5], p[7]);
        let g = odd(p[1], p[3]);
        let h = odd(p[5], p[7]);
        let columns = [
            even(a, b),
            even(e, f),
            even(c, d),
            even(g, h),
            odd(a, b),
            odd(e, f),
            odd(c, d),
            odd(g, h),
        ];
        columns.map(|column| store(opaque(column)))
    }

    /// Keeps the compiler from merging the shuffles of a transpose with what follows, which it then
    /// does not carry out in whole vectors any more.
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn opaque(mut a: __m512d) -> __m512d {
        // SAFETY: does nothing.
        unsafe {
            std::arch::asm!("/* {0} */", inout(zmm_reg) a, options(pure, nomem, nostack, preserves_flags));
        }
        a
    }

    #[inline]
    #[target_feature(enable = "avx512f")]
    fn load(a: Lanes) -> __m512d {
        // SAFETY: eight numbers either way.
        unsafe { std::mem::transmute(a) }
    }

    #[inline]
    #[target_feature(enable = "avx512f")]
    fn store(a: __m512d) -> Lanes {
        // SAFETY: eight numbers either way.
        unsafe { std::mem::transmute(a) }
    }
}

#[cfg(target_arch = "x86_64")]
pub use wide::estimate_of_inverse_sqrt;

#[cfg(target_arch = "x86_64")]
impl Arithmetic for Wide {
    #[inline(always)]
    fn multiply_add(a: Lanes, b: Lanes, c: Lanes) -> Lanes {
        // SAFETY: only used within code compiled for these instructions.
        unsafe { wide::multiply_add(a, b, c) }
    }

    #[inline(always)]
    fn inverse_sqrt(a: Lanes) -> Lanes {
        // SAFETY: as above.
        unsafe { wide::inverse_sqrt(a) }
    }

    #[inline(always)]
    fn at_least(a: Lanes, b: Lanes) -> u8 {
        // SAFETY: as above.
        unsafe { wide::at_least(a, b) }
    }

    #[inline(always)]
    fn select(a: Lanes, bits: u8, otherwise: f64) -> Lanes {
        // SAFETY: as above.
        unsafe { wide::select(a, bits, otherwise) }
    }

    #[inline(always)]
    fn transpose(rows: [&[f64; 8]; 8]) -> [Lanes; 8] {
        // SAFETY: as above.
        unsafe { wide::transpose(rows) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check<A: Arithmetic>() {
        let a = Lanes([1e-30, 3.7e-9, 0.25, 0.999, 1.0, 2.0, 1e7, 1e30]);
        let root = A::inverse_sqrt(a);
        for k in 0..8 {
            let error = root.0[k] * a.0[k].sqrt() - 1.0;
            assert!(error.abs() < 3.0 * f64::EPSILON, "{}: {error:e}", a.0[k]);
        }
        let rows: [[f64; 8]; 8] =
            std::array::from_fn(|row| std::array::from_fn(|column| (10 * row + column) as f64));
        let columns = A::transpose(rows.each_ref());
        for (j, column) in columns.iter().enumerate() {
            for (k, value) in column.0.iter().enumerate() {
                assert_eq!(*value, (10 * k + j) as f64);
            }
        }
        assert_eq!(A::at_least(a, Lanes::splat(0.999)), 0b1111_1000);
        let chosen = A::select(a, 0b1000_0010, 5.0);
        assert_eq!(chosen.0, [5.0, 3.7e-9, 5.0, 5.0, 5.0, 5.0, 5.0, 1e30]);
        let sum = A::multiply_add(a, a, Lanes::splat(1.0));
        for k in 0..8 {
            let expected = a.0[k] * a.0[k] + 1.0;
            assert!((sum.0[k] / expected - 1.0).abs() < 2.0 * f64::EPSILON);
        }
    }

    #[test]
    fn every_kind_is_accurate() {
        check::<Plain>();
        check::<Fused>();
        #[cfg(target_arch = "x86_64")]
        if is_x86_feature_detected!("avx512f") {
            check::<Wide>();
        }
    }
}
