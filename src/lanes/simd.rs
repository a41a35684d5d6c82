//! Operations for which the compiler does not select vector instructions, or that depend on the machine.
//!
//! All other operations on [`Lanes`] are written lane by lane, and the compiler vectorizes them. Every
//! operation in this module is correctly rounded, compares numbers, or moves numbers. Therefore all
//! implementations give bitwise the same results, except [`Portable`] without fused multiply-add.

use super::Lanes;

/// Proof that the machine has a particular instruction set. The methods are the operations that depend on
/// this instruction set.
pub trait Simd: Copy + Send + Sync + 'static {
    /// Return `a * b + c`. The result is rounded once, except by [`Portable`] without fused multiply-add.
    fn multiply_add(self, a: Lanes, b: Lanes, c: Lanes) -> Lanes;

    /// Return one bit per lane, set if `a` is at least as large as `b`.
    #[inline(always)]
    fn at_least(self, a: Lanes, b: Lanes) -> u8 {
        let mut bits = 0;
        for k in 0..8 {
            bits |= u8::from(a.0[k] >= b.0[k]) << k;
        }
        bits
    }

    /// Return the lanes of `a` whose bit is set, and the lanes of `otherwise` whose bit is not set.
    #[inline(always)]
    fn select(self, a: Lanes, bits: u8, otherwise: Lanes) -> Lanes {
        let mut result = otherwise;
        for k in 0..8 {
            if bits >> k & 1 == 1 {
                result.0[k] = a.0[k];
            }
        }
        result
    }

    /// Return the lanes of `a` whose bit is set, and 0 in the other lanes.
    #[inline(always)]
    fn keep(self, a: Lanes, bits: u8) -> Lanes {
        self.select(a, bits, Lanes::splat(0.0))
    }

    /// Run a rarely needed task out of line, so that the task uses no registers of the hot loop.
    fn aside<T: Task>(self, task: T) -> T::Output;

    /// Return `a`. With AVX2 and AVX-512, the compiler cannot see that the result is `a`. The compiler
    /// therefore keeps the operations before and after this call in whole vectors, instead of splitting these
    /// operations by lane.
    #[inline(always)]
    fn opaque(self, a: Lanes) -> Lanes {
        a
    }

    /// Return the transpose of eight rows of eight numbers: lane k of result j is number j of row k.
    #[inline(always)]
    fn transpose(self, rows: [&[f64; 8]; 8]) -> [Lanes; 8] {
        std::array::from_fn(|column| Lanes(std::array::from_fn(|row| rows[row][column])))
    }
}

/// Work that can run out of line, in a function that is compiled for an instruction set.
/// [`Self::run`] must be `#[inline(always)]`. A closure is not sufficient, because it is a separate function
/// that is compiled without the instruction set. If the compiler does not inline a large closure, every
/// vector operation in it is a call.
pub trait Task {
    /// Type of the result.
    type Output;

    /// Run the task.
    fn run<S: Simd>(self, simd: S) -> Self::Output;
}

/// Portable fallback. `FUSED` selects fused multiply-add, which is slow on processors without this
/// instruction.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Portable<const FUSED: bool>;

impl<const FUSED: bool> Simd for Portable<FUSED> {
    #[inline(always)]
    fn multiply_add(self, a: Lanes, b: Lanes, c: Lanes) -> Lanes {
        if !FUSED {
            return a * b + c;
        }
        let mut result = a;
        for k in 0..8 {
            result.0[k] = a.0[k].mul_add(b.0[k], c.0[k]);
        }
        result
    }

    #[cold]
    #[inline(never)]
    fn aside<T: Task>(self, task: T) -> T::Output {
        task.run(self)
    }
}

#[cfg(target_arch = "x86_64")]
pub use x86::{Avx2, Avx512};

#[cfg(target_arch = "x86_64")]
mod x86 {
    use std::arch::x86_64::*;

    use super::{Lanes, Simd, Task};

    /// Proof that this machine has AVX2, BMI2 and FMA. Only [`Avx2::detect`] and [`Avx512::avx2`] create the
    /// proof.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    pub struct Avx2(());

    /// Proof that this machine has AVX-512 (F, DQ, VL and BW), and the instructions of [`Avx2`]. Only
    /// [`Avx512::detect`] creates the proof.
    #[derive(Debug, Clone, Copy, PartialEq, Eq)]
    pub struct Avx512(());

    impl Avx2 {
        /// Return the proof that this machine has AVX2, BMI2 and FMA; `None` if it lacks one of them.
        pub fn detect() -> Option<Self> {
            let has = is_x86_feature_detected!("avx2")
                && is_x86_feature_detected!("bmi2")
                && is_x86_feature_detected!("fma");
            has.then_some(Self(()))
        }
    }

    impl Avx512 {
        /// Return the proof that this machine has the instructions of [`Avx512`]; `None` if it lacks one of
        /// them.
        pub fn detect() -> Option<Self> {
            let has = Avx2::detect().is_some()
                && is_x86_feature_detected!("avx512f")
                && is_x86_feature_detected!("avx512dq")
                && is_x86_feature_detected!("avx512vl")
                && is_x86_feature_detected!("avx512bw");
            has.then_some(Self(()))
        }

        /// Return the proof that this machine has AVX2. Every machine with AVX-512 has AVX2.
        pub fn avx2(self) -> Avx2 {
            Avx2(())
        }
    }

    impl Simd for Avx2 {
        #[inline(always)]
        fn multiply_add(self, a: Lanes, b: Lanes, c: Lanes) -> Lanes {
            // SAFETY: `self` proves that the machine has AVX2 and FMA.
            unsafe { multiply_add_avx2(a, b, c) }
        }

        #[inline(always)]
        fn at_least(self, a: Lanes, b: Lanes) -> u8 {
            // SAFETY: `self` proves that the machine has AVX2.
            unsafe { at_least_avx2(a, b) }
        }

        #[inline(always)]
        fn select(self, a: Lanes, bits: u8, otherwise: Lanes) -> Lanes {
            // SAFETY: `self` proves that the machine has AVX2.
            unsafe { select_avx2(a, bits, otherwise) }
        }

        #[inline(always)]
        fn keep(self, a: Lanes, bits: u8) -> Lanes {
            // SAFETY: `self` proves that the machine has AVX2.
            unsafe { keep_avx2(a, bits) }
        }

        #[inline(always)]
        fn transpose(self, rows: [&[f64; 8]; 8]) -> [Lanes; 8] {
            // SAFETY: `self` proves that the machine has AVX2.
            unsafe { transpose_avx2(rows) }
        }

        #[inline(always)]
        fn aside<T: Task>(self, task: T) -> T::Output {
            // SAFETY: `self` proves that the machine has AVX2.
            unsafe { aside_avx2(self, task) }
        }

        #[inline(always)]
        fn opaque(self, a: Lanes) -> Lanes {
            // SAFETY: `self` proves that the machine has AVX2.
            unsafe {
                let [low, high] = halves(a);
                joined([opaque_half(low), opaque_half(high)])
            }
        }
    }

    impl Simd for Avx512 {
        #[inline(always)]
        fn multiply_add(self, a: Lanes, b: Lanes, c: Lanes) -> Lanes {
            // SAFETY: `self` proves that the machine has AVX-512.
            unsafe { multiply_add_avx512(a, b, c) }
        }

        #[inline(always)]
        fn at_least(self, a: Lanes, b: Lanes) -> u8 {
            // SAFETY: `self` proves that the machine has AVX-512.
            unsafe { at_least_avx512(a, b) }
        }

        #[inline(always)]
        fn select(self, a: Lanes, bits: u8, otherwise: Lanes) -> Lanes {
            // SAFETY: `self` proves that the machine has AVX-512.
            unsafe { select_avx512(a, bits, otherwise) }
        }

        #[inline(always)]
        fn keep(self, a: Lanes, bits: u8) -> Lanes {
            // SAFETY: `self` proves that the machine has AVX-512.
            unsafe { keep_avx512(a, bits) }
        }

        #[inline(always)]
        fn transpose(self, rows: [&[f64; 8]; 8]) -> [Lanes; 8] {
            // SAFETY: `self` proves that the machine has AVX-512.
            unsafe { transpose_avx512(rows) }
        }

        #[inline(always)]
        fn aside<T: Task>(self, task: T) -> T::Output {
            // SAFETY: `self` proves that the machine has AVX-512.
            unsafe { aside_avx512(self, task) }
        }

        #[inline(always)]
        fn opaque(self, a: Lanes) -> Lanes {
            // SAFETY: `self` proves that the machine has AVX-512.
            unsafe { lanes(opaque(vector(a))) }
        }
    }

    #[cold]
    #[inline(never)]
    #[target_feature(enable = "avx2,bmi2,fma")]
    fn aside_avx2<T: Task>(simd: Avx2, task: T) -> T::Output {
        task.run(simd)
    }

    #[cold]
    #[inline(never)]
    #[target_feature(enable = "avx512f,avx512dq,avx512vl,avx512bw,avx2,bmi2,fma")]
    fn aside_avx512<T: Task>(simd: Avx512, task: T) -> T::Output {
        task.run(simd)
    }

    /// Return the two halves of a vector of eight numbers.
    #[inline(always)]
    fn halves(a: Lanes) -> [__m256d; 2] {
        // SAFETY: both types are eight numbers.
        unsafe { std::mem::transmute(a) }
    }

    #[inline(always)]
    fn joined(halves: [__m256d; 2]) -> Lanes {
        // SAFETY: both types are eight numbers.
        unsafe { std::mem::transmute(halves) }
    }

    #[inline(always)]
    fn vector(a: Lanes) -> __m512d {
        // SAFETY: both types are eight numbers.
        unsafe { std::mem::transmute(a) }
    }

    #[inline(always)]
    fn lanes(a: __m512d) -> Lanes {
        // SAFETY: both types are eight numbers.
        unsafe { std::mem::transmute(a) }
    }

    /// Masks of four lanes. The index has one bit per lane. If the bit of a lane is set, all 64 bits of this
    /// lane are set in the mask.
    static MASKS: [[u64; 4]; 16] = {
        let mut masks = [[0; 4]; 16];
        let mut bits = 0;
        while bits < 16 {
            let mut k = 0;
            while k < 4 {
                if bits >> k & 1 == 1 {
                    masks[bits][k] = u64::MAX;
                }
                k += 1;
            }
            bits += 1;
        }
        masks
    };

    #[inline]
    #[target_feature(enable = "avx2")]
    fn masks(bits: u8) -> [__m256d; 2] {
        // SAFETY: each row contains four numbers of 64 bits.
        let mask = |row: u8| unsafe { _mm256_loadu_pd(MASKS[row as usize].as_ptr().cast()) };
        [mask(bits & 15), mask(bits >> 4)]
    }

    #[inline]
    #[target_feature(enable = "avx2,fma")]
    fn multiply_add_avx2(a: Lanes, b: Lanes, c: Lanes) -> Lanes {
        let (a, b, c) = (halves(a), halves(b), halves(c));
        joined([
            _mm256_fmadd_pd(a[0], b[0], c[0]),
            _mm256_fmadd_pd(a[1], b[1], c[1]),
        ])
    }

    #[inline]
    #[target_feature(enable = "avx512f")]
    fn multiply_add_avx512(a: Lanes, b: Lanes, c: Lanes) -> Lanes {
        lanes(_mm512_fmadd_pd(vector(a), vector(b), vector(c)))
    }

    #[inline]
    #[target_feature(enable = "avx2")]
    fn at_least_avx2(a: Lanes, b: Lanes) -> u8 {
        let (a, b) = (halves(a), halves(b));
        let bits = |k: usize| _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_GE_OQ>(a[k], b[k]));
        (bits(0) | bits(1) << 4) as u8
    }

    #[inline]
    #[target_feature(enable = "avx2")]
    fn select_avx2(a: Lanes, bits: u8, otherwise: Lanes) -> Lanes {
        let (a, b, masks) = (halves(a), halves(otherwise), masks(bits));
        joined([
            _mm256_blendv_pd(b[0], a[0], masks[0]),
            _mm256_blendv_pd(b[1], a[1], masks[1]),
        ])
    }

    #[inline]
    #[target_feature(enable = "avx2")]
    fn keep_avx2(a: Lanes, bits: u8) -> Lanes {
        let (a, masks) = (halves(a), masks(bits));
        joined([_mm256_and_pd(a[0], masks[0]), _mm256_and_pd(a[1], masks[1])])
    }

    #[inline]
    #[target_feature(enable = "avx2")]
    fn transpose_avx2(rows: [&[f64; 8]; 8]) -> [Lanes; 8] {
        // Transpose four blocks of four by four numbers.
        let block = |first: usize, column: usize| -> [__m256d; 4] {
            let load = |k: usize| {
                let row: &[f64; 4] = rows[first + k][column..column + 4]
                    .try_into()
                    .expect("four");
                // SAFETY: the row has four numbers.
                unsafe { _mm256_loadu_pd(row.as_ptr()) }
            };
            let (a, b, c, d) = (load(0), load(1), load(2), load(3));
            let (ab_even, ab_odd) = (_mm256_unpacklo_pd(a, b), _mm256_unpackhi_pd(a, b));
            let (cd_even, cd_odd) = (_mm256_unpacklo_pd(c, d), _mm256_unpackhi_pd(c, d));
            [
                _mm256_permute2f128_pd::<0x20>(ab_even, cd_even),
                _mm256_permute2f128_pd::<0x20>(ab_odd, cd_odd),
                _mm256_permute2f128_pd::<0x31>(ab_even, cd_even),
                _mm256_permute2f128_pd::<0x31>(ab_odd, cd_odd),
            ]
        };
        let (a, b, c, d) = (block(0, 0), block(4, 0), block(0, 4), block(4, 4));
        [
            joined([a[0], b[0]]),
            joined([a[1], b[1]]),
            joined([a[2], b[2]]),
            joined([a[3], b[3]]),
            joined([c[0], d[0]]),
            joined([c[1], d[1]]),
            joined([c[2], d[2]]),
            joined([c[3], d[3]]),
        ]
    }

    #[inline]
    #[target_feature(enable = "avx512f")]
    fn at_least_avx512(a: Lanes, b: Lanes) -> u8 {
        _mm512_cmp_pd_mask::<_CMP_GE_OQ>(vector(a), vector(b))
    }

    #[inline]
    #[target_feature(enable = "avx512f")]
    fn select_avx512(a: Lanes, bits: u8, otherwise: Lanes) -> Lanes {
        lanes(_mm512_mask_blend_pd(bits, vector(otherwise), vector(a)))
    }

    #[inline]
    #[target_feature(enable = "avx512f")]
    fn keep_avx512(a: Lanes, bits: u8) -> Lanes {
        lanes(_mm512_maskz_mov_pd(bits, vector(a)))
    }

    #[inline]
    #[target_feature(enable = "avx512f")]
    fn transpose_avx512(rows: [&[f64; 8]; 8]) -> [Lanes; 8] {
        // Four numbers of row `a` from column `first` on, then four of row `b`. The insertion reads the
        // numbers of `b` directly from memory, so it needs no shuffle.
        let halves = |a: usize, b: usize, first: usize| {
            // SAFETY: each row has eight numbers, and `first` is 0 or 4.
            let half = |row: usize| unsafe { _mm256_loadu_pd(rows[row].as_ptr().add(first)) };
            _mm512_insertf64x4::<1>(_mm512_castpd256_pd512(half(a)), half(b))
        };
        let columns = |first: usize| {
            let [a, b] = [halves(0, 2, first), halves(1, 3, first)];
            let [c, d] = [halves(4, 6, first), halves(5, 7, first)];
            // `ab` has rows 0 and 1, then rows 2 and 3, of the columns `first` and `first` + 2. `cd` has rows
            // 4 to 7 in the same order. `ab_next` and `cd_next` have the columns `first` + 1 and `first` + 3.
            let [ab, cd] = [_mm512_unpacklo_pd(a, b), _mm512_unpacklo_pd(c, d)];
            let [ab_next, cd_next] = [_mm512_unpackhi_pd(a, b), _mm512_unpackhi_pd(c, d)];
            [
                _mm512_shuffle_f64x2::<0b10_00_10_00>(ab, cd),
                _mm512_shuffle_f64x2::<0b10_00_10_00>(ab_next, cd_next),
                _mm512_shuffle_f64x2::<0b11_01_11_01>(ab, cd),
                _mm512_shuffle_f64x2::<0b11_01_11_01>(ab_next, cd_next),
            ]
        };
        let ([a, b, c, d], [e, f, g, h]) = (columns(0), columns(4));
        let column = |column| lanes(opaque(column));
        [
            column(a),
            column(b),
            column(c),
            column(d),
            column(e),
            column(f),
            column(g),
            column(h),
        ]
    }

    /// Return the value, but hide from the compiler that it is unchanged. The compiler then keeps the
    /// operations before and after this call in whole vectors, instead of splitting them by lane. The speed
    /// without this call was measured with rustc 1.95 on AMD Zen 3 (AVX2), as a fraction of the speed with
    /// this call. It is 0.68 for the law `pmb` with bonds in lists, and 0.75 for the law `ordinary` with
    /// bonds in lattices. `pmb` in lattices does not need the call, and `correspondence` is faster without
    /// the call.
    #[inline]
    #[target_feature(enable = "avx2")]
    fn opaque_half(mut a: __m256d) -> __m256d {
        // SAFETY: the assembly has no instructions.
        unsafe {
            std::arch::asm!("/* {0} */", inout(ymm_reg) a, options(pure, nomem, nostack, preserves_flags));
        }
        a
    }

    /// Same as [`opaque_half`], for AVX-512.
    #[inline]
    #[target_feature(enable = "avx512f")]
    fn opaque(mut a: __m512d) -> __m512d {
        // SAFETY: the assembly has no instructions.
        unsafe {
            std::arch::asm!("/* {0} */", inout(zmm_reg) a, options(pure, nomem, nostack, preserves_flags));
        }
        a
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check(simd: impl Simd) {
        let a = Lanes([1e-30, 3.7e-9, 0.25, 0.999, 1.0, 2.0, 1e7, f64::NAN]);
        let rows: [[f64; 8]; 8] =
            std::array::from_fn(|row| std::array::from_fn(|column| (10 * row + column) as f64));
        let columns = simd.transpose(rows.each_ref());
        for (j, column) in columns.iter().enumerate() {
            for (k, value) in column.0.iter().enumerate() {
                assert_eq!(*value, (10 * k + j) as f64);
            }
        }
        assert_eq!(simd.at_least(a, Lanes::splat(0.999)), 0b0111_1000);
        let chosen = simd.select(a, 0b0100_0010, Lanes::splat(5.0));
        assert_eq!(chosen.0, [5.0, 3.7e-9, 5.0, 5.0, 5.0, 5.0, 1e7, 5.0]);
        assert_eq!(
            simd.keep(a, 0b0000_0100).0,
            [0.0, 0.0, 0.25, 0.0, 0.0, 0.0, 0.0, 0.0]
        );
    }

    #[test]
    fn every_kind_moves_numbers_alike() {
        check(Portable::<false>);
        check(Portable::<true>);
        #[cfg(target_arch = "x86_64")]
        {
            Avx2::detect().into_iter().for_each(check);
            Avx512::detect().into_iter().for_each(check);
        }
    }

    /// Check that an implementation uses fused multiply-add.
    fn rounds_once(simd: impl Simd) {
        // (1 + e)² − 1 − 2e = e². This result is lost if multiplication and addition are rounded separately.
        let a = Lanes::splat(1.0 + f64::EPSILON);
        let c = Lanes::splat(-1.0 - 2.0 * f64::EPSILON);
        let e = f64::EPSILON;
        assert_eq!(simd.multiply_add(a, a, c).0, [e * e; 8]);
    }

    #[test]
    fn fused_kinds_round_once() {
        rounds_once(Portable::<true>);
        #[cfg(target_arch = "x86_64")]
        {
            Avx2::detect().into_iter().for_each(rounds_once);
            Avx512::detect().into_iter().for_each(rounds_once);
        }
    }
}
