//! The kernels for x86-64, chosen at run time. The only file with `unsafe` code.
//!
//! Why not a safe wrapper crate: the hot load is an unaligned one at a computed offset, 11 of them
//! per comparison; one range check per comparison instead of one per load is worth a third of the
//! speed. The check is in `row_pointer`.

#![expect(unsafe_code, reason = "SIMD loads at computed offsets; each use has a SAFETY comment")]

use super::scalar::Scalar;
use super::{TAIL, WithKernel};
use crate::base::ctx::Simd;

/// What this CPU has.
pub(super) fn detect() -> Simd {
    #[cfg(target_arch = "x86_64")]
    {
        if is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512bw") {
            return if is_x86_feature_detected!("avx512vnni") {
                Simd::Avx512Vnni
            } else {
                Simd::Avx512
            };
        }
        if is_x86_feature_detected!("avx2") {
            return Simd::Avx2;
        }
    }
    Simd::Scalar
}

/// See [`super::with_kernel`].
pub(super) fn dispatch<W: WithKernel>(limit: Simd, patch: usize, work: W) -> W::Output {
    #[cfg(target_arch = "x86_64")]
    {
        // The default side gets code with its rows unrolled; 0 stands for "any side".
        let level = detect().min(limit);
        // SAFETY: `detect` has seen the features that each function is compiled for.
        unsafe {
            match (level, patch) {
                (Simd::Avx512Vnni, 11) => return x86::run_vnni::<11, W>(patch, work),
                (Simd::Avx512Vnni, _) => return x86::run_vnni::<0, W>(patch, work),
                (Simd::Avx512, 11) => return x86::run_avx512::<11, W>(patch, work),
                (Simd::Avx512, _) => return x86::run_avx512::<0, W>(patch, work),
                (Simd::Avx2, 11) => return x86::run_avx2::<11, W>(patch, work),
                (Simd::Avx2, _) => return x86::run_avx2::<0, W>(patch, work),
                (Simd::Scalar, _) => {}
            }
        }
    }
    work.run(Scalar { patch })
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use std::arch::x86_64::*;

    use super::super::{Kernel, MatchImage, PATCH_MAX, WithKernel};
    use super::TAIL;

    /// Bytes a held row takes: the longest patch row, rounded up to whole registers.
    const ROW: usize = 128;

    /// A patch whose rows are padded with zeros, so that kernels may multiply past its right end.
    #[derive(Debug, Clone)]
    #[repr(align(64))]
    pub(super) struct Held([[u8; ROW]; PATCH_MAX]);

    /// Pointer to the patch at pixel index `at`; all its rows, and 64 bytes from any place inside
    /// them, may be read.
    #[inline(always)]
    fn row_pointer(image: &MatchImage, at: usize, patch: usize) -> *const u8 {
        let last = (at + (patch - 1) * image.width + patch) * 4;
        assert!(last + TAIL <= image.codes.len(), "patch outside its picture");
        // SAFETY: `at * 4 <= last`, which lies inside the allocation by the line above.
        unsafe { image.codes.as_ptr().add(at * 4) }
    }

    macro_rules! kernel {
        ($name:ident, $features:literal, $run:ident, $dot_row:ident, $sum:ident, $zero:ident, $lanes:literal) => {
            /// `N`: patch side, or 0 for the side in `patch`.
            #[derive(Debug, Clone, Copy)]
            pub(super) struct $name<const N: usize> {
                patch: usize,
            }

            impl<const N: usize> $name<N> {
                #[inline(always)]
                fn side(self) -> usize {
                    if N == 0 { self.patch } else { N }
                }
            }

            impl<const N: usize> Kernel for $name<N> {
                type Query = Held;

                fn query(&self) -> Held {
                    Held([[0; ROW]; PATCH_MAX])
                }

                #[inline(always)]
                fn hold(&self, query: &mut Held, image: &MatchImage, at: usize) {
                    let n = self.side();
                    for row in 0..n {
                        let start = (at + row * image.width) * 4;
                        query.0[row][..4 * n].copy_from_slice(&image.codes[start..start + 4 * n]);
                    }
                }

                #[inline(always)]
                fn dot(&self, query: &Held, image: &MatchImage, at: usize) -> i32 {
                    let n = self.side();
                    let start = row_pointer(image, at, n);
                    let stride = image.width * 4;
                    // SAFETY: `row_pointer` checked the range that is read; a value of this type
                    // exists only inside `$run`, where the features are present.
                    unsafe {
                        let mut sum = $zero();
                        for row in 0..n {
                            let e = start.add(row * stride);
                            let f = query.0[row].as_ptr();
                            let mut i = 0;
                            while i < 4 * n {
                                sum = $dot_row(sum, f.add(i), e.add(i));
                                i += $lanes;
                            }
                        }
                        $sum(sum)
                    }
                }

                #[inline(always)]
                fn prefetch(&self, image: &MatchImage, at: usize) {
                    let n = self.side();
                    let start = row_pointer(image, at, n);
                    for row in 0..n {
                        // SAFETY: inside the picture by `row_pointer`.
                        unsafe {
                            _mm_prefetch::<_MM_HINT_T0>(start.add(row * image.width * 4).cast());
                        }
                    }
                }
            }

            /// Runs the work compiled for these features.
            #[target_feature(enable = $features)]
            pub(super) fn $run<const N: usize, W: WithKernel>(patch: usize, work: W) -> W::Output {
                work.run($name::<N> { patch })
            }
        };
    }

    #[inline(always)]
    unsafe fn vnni_row(sum: __m512i, f: *const u8, e: *const u8) -> __m512i {
        unsafe {
            _mm512_dpbusd_epi32(sum, _mm512_load_si512(f.cast()), _mm512_loadu_si512(e.cast()))
        }
    }

    #[inline(always)]
    unsafe fn avx512_row(sum: __m512i, f: *const u8, e: *const u8) -> __m512i {
        unsafe {
            let products =
                _mm512_maddubs_epi16(_mm512_load_si512(f.cast()), _mm512_loadu_si512(e.cast()));
            _mm512_add_epi32(sum, _mm512_madd_epi16(products, _mm512_set1_epi16(1)))
        }
    }

    #[inline(always)]
    unsafe fn avx2_row(sum: __m256i, f: *const u8, e: *const u8) -> __m256i {
        unsafe {
            let products =
                _mm256_maddubs_epi16(_mm256_load_si256(f.cast()), _mm256_loadu_si256(e.cast()));
            _mm256_add_epi32(sum, _mm256_madd_epi16(products, _mm256_set1_epi16(1)))
        }
    }

    #[inline(always)]
    unsafe fn sum512(v: __m512i) -> i32 {
        unsafe { _mm512_reduce_add_epi32(v) }
    }

    #[inline(always)]
    unsafe fn sum256(v: __m256i) -> i32 {
        unsafe {
            let v = _mm_add_epi32(_mm256_castsi256_si128(v), _mm256_extracti128_si256::<1>(v));
            let v = _mm_add_epi32(v, _mm_shuffle_epi32::<0b01_00_11_10>(v));
            let v = _mm_add_epi32(v, _mm_shuffle_epi32::<0b10_11_00_01>(v));
            _mm_cvtsi128_si32(v)
        }
    }

    kernel!(
        Vnni,
        "avx2,avx512f,avx512bw,avx512vnni",
        run_vnni,
        vnni_row,
        sum512,
        _mm512_setzero_si512,
        64
    );
    kernel!(
        Avx512,
        "avx2,avx512f,avx512bw",
        run_avx512,
        avx512_row,
        sum512,
        _mm512_setzero_si512,
        64
    );
    kernel!(Avx2, "avx2", run_avx2, avx2_row, sum256, _mm256_setzero_si256, 32);
}
