//! The kernels for x86-64, chosen at run time. The only file with `unsafe` code.
//!
//! Why not a safe wrapper crate: the hot load is an unaligned one at a computed offset, 11 of them
//! per comparison, and the hottest loop there is. So one range check per comparison replaces one per
//! load; it is in `checked`.

#![expect(unsafe_code, reason = "SIMD loads at computed offsets; each use has a SAFETY comment")]

use super::scalar::Scalar;
use super::{TAIL, WithKernel};
use crate::base::ctx::Simd;

/// What this CPU has.
pub(super) fn detect() -> Simd {
    #[cfg(target_arch = "x86_64")]
    {
        let avx512 = is_x86_feature_detected!("avx512f")
            && is_x86_feature_detected!("avx512bw")
            && is_x86_feature_detected!("avx512dq");
        if avx512 {
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
        // SAFETY: `detect` has seen the features that each function is compiled for.
        unsafe {
            match detect().min(limit) {
                Simd::Avx512Vnni => return x86::run_vnni(patch, work),
                Simd::Avx512 => return x86::run_avx512(patch, work),
                Simd::Avx2 => return x86::run_avx2(patch, work),
                Simd::Scalar => {}
            }
        }
    }
    work.run(Scalar { patch })
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    #[allow(clippy::wildcard_imports, reason = "two dozen intrinsics with names of their own")]
    use std::arch::x86_64::*;

    use super::super::{Kernel, MatchImage, PATCH_MAX, WithKernel};
    use super::TAIL;

    /// Panics unless `rows` rows of `patch` pixels at pixel index `at`, and 64 bytes from any place
    /// inside them, may be read; returns a pointer to the first pixel.
    #[inline(always)]
    fn checked(image: &MatchImage, at: usize, patch: usize, rows: usize) -> *const u8 {
        let end = (at + (rows - 1) * image.stride + patch) * 4;
        assert!(end + TAIL <= image.codes.len(), "patch outside its picture");
        // SAFETY: `at * 4 <= end`, which lies inside the allocation by the line above.
        unsafe { image.codes.as_ptr().add(at * 4) }
    }

    /// Sum of products of codes, with and without the VNNI instruction.
    trait MultiplyAdd512: Copy + Send + Sync {
        /// `sum + f * e`, in groups of four.
        ///
        /// # Safety
        /// The CPU must have the features of the kernel that uses this.
        unsafe fn multiply_add(sum: __m512i, f: __m512i, e: __m512i) -> __m512i;
    }

    #[derive(Debug, Clone, Copy)]
    pub(super) struct Vnni;

    impl MultiplyAdd512 for Vnni {
        #[inline(always)]
        unsafe fn multiply_add(sum: __m512i, f: __m512i, e: __m512i) -> __m512i {
            // SAFETY: the caller's promise.
            unsafe { _mm512_dpbusd_epi32(sum, f, e) }
        }
    }

    #[derive(Debug, Clone, Copy)]
    pub(super) struct NoVnni;

    impl MultiplyAdd512 for NoVnni {
        #[inline(always)]
        unsafe fn multiply_add(sum: __m512i, f: __m512i, e: __m512i) -> __m512i {
            // SAFETY: the caller's promise. Two products of 7-bit codes fit into 16 bits.
            unsafe {
                let pairs = _mm512_maddubs_epi16(f, e);
                _mm512_add_epi32(sum, _mm512_madd_epi16(pairs, _mm512_set1_epi16(1)))
            }
        }
    }

    /// `sum` plus the squared differences of the bytes that `inside` selects, in groups of four.
    ///
    /// # Safety
    /// The CPU must have the features of `M`.
    #[inline(always)]
    unsafe fn add_squares<M: MultiplyAdd512>(
        sum: __m512i,
        f: __m512i,
        e: __m512i,
        inside: __mmask64,
    ) -> __m512i {
        // SAFETY: the caller's promise. Codes have seven bits: their difference fits into eight.
        unsafe {
            let difference = _mm512_abs_epi8(_mm512_maskz_sub_epi8(inside, f, e));
            M::multiply_add(sum, difference, difference)
        }
    }

    /// Bytes of a patch row of `patch` pixels that fall into its first 16 pixels, and those that
    /// fall into the next.
    #[inline(always)]
    fn inside(patch: usize) -> [__mmask64; 2] {
        let bits = (1u128 << (4 * patch)) - 1;
        [bits as u64, (bits >> 64) as u64]
    }

    /// The default patch side: a row is one register, and all rows stay in registers.
    #[derive(Debug, Clone, Copy)]
    struct Eleven<M> {
        inside: __mmask64,
        method: std::marker::PhantomData<M>,
    }

    impl<M: MultiplyAdd512> Kernel for Eleven<M> {
        type Query = [__m512i; 11];
        type Sums = [__m512i; 2];

        #[inline(always)]
        fn query(&self) -> [__m512i; 11] {
            // SAFETY: a value of this type exists only inside `run_*`, where the features are.
            [unsafe { _mm512_setzero_si512() }; 11]
        }

        #[inline(always)]
        fn hold(&self, query: &mut [__m512i; 11], image: &MatchImage, at: usize) {
            let start = checked(image, at, 11, 11);
            for (row, held) in query.iter_mut().enumerate() {
                // SAFETY: inside the picture, or its tail, by `checked`; features as above.
                *held = unsafe { _mm512_loadu_si512(start.add(row * image.stride * 4).cast()) };
            }
        }

        #[inline(always)]
        fn nothing(&self) -> [__m512i; 2] {
            // SAFETY: as above.
            [unsafe { _mm512_setzero_si512() }; 2]
        }

        #[inline(always)]
        fn add_rows(
            &self,
            mut sums: [__m512i; 2],
            query: &[__m512i; 11],
            image: &MatchImage,
            at: usize,
            first: usize,
        ) -> [__m512i; 2] {
            let start = checked(image, at, 11, 11);
            let stride = image.stride * 4;
            for row in (first..11).step_by(6) {
                // Two sums, so that no multiply-add waits for the one before it.
                let sum = &mut sums[row / 6];
                // SAFETY: inside the picture, or its tail, by `checked`; features as above.
                unsafe {
                    let e = _mm512_loadu_si512(start.add(row * stride).cast());
                    *sum = add_squares::<M>(*sum, query[row], e, self.inside);
                }
            }
            sums
        }

        #[inline(always)]
        fn total(&self, sums: [__m512i; 2]) -> i32 {
            total_512(sums)
        }

        #[inline(always)]
        fn row_change(&self, a: (&MatchImage, [usize; 2]), b: (&MatchImage, [usize; 2])) -> i32 {
            row_change_512::<M>(11, a, b)
        }
    }

    /// See [`Kernel::total`].
    #[inline(always)]
    fn total_512(sums: [__m512i; 2]) -> i32 {
        // SAFETY: a kernel exists only inside `run_*`, where the features are.
        unsafe { _mm512_reduce_add_epi32(_mm512_add_epi32(sums[0], sums[1])) }
    }

    /// See [`Kernel::row_change`].
    #[inline(always)]
    fn row_change_512<M: MultiplyAdd512>(
        patch: usize,
        a: (&MatchImage, [usize; 2]),
        b: (&MatchImage, [usize; 2]),
    ) -> i32 {
        let inside = inside(patch);
        // No closures: they would not be compiled for the instruction set.
        // SAFETY: a kernel exists only inside `run_*`, where the features are.
        let mut sums = [unsafe { _mm512_setzero_si512() }; 2];
        for (i, sum) in sums.iter_mut().enumerate() {
            let (a, b) = (checked(a.0, a.1[i], patch, 1), checked(b.0, b.1[i], patch, 1));
            // SAFETY: inside the pictures, or their tails, by `checked`; features as above.
            unsafe {
                let (f, e) = (_mm512_loadu_si512(a.cast()), _mm512_loadu_si512(b.cast()));
                *sum = add_squares::<M>(*sum, f, e, inside[0]);
                if patch > 16 {
                    let f = _mm512_loadu_si512(a.add(64).cast());
                    let e = _mm512_loadu_si512(b.add(64).cast());
                    *sum = add_squares::<M>(*sum, f, e, inside[1]);
                }
            }
        }
        // SAFETY: features as above.
        unsafe { _mm512_reduce_add_epi32(_mm512_sub_epi32(sums[0], sums[1])) }
    }

    /// Any patch side: a row is one register or two.
    #[derive(Debug, Clone, Copy)]
    struct Any512<M> {
        patch: usize,
        method: std::marker::PhantomData<M>,
    }

    impl<M: MultiplyAdd512> Kernel for Any512<M> {
        type Query = [[__m512i; 2]; PATCH_MAX];
        type Sums = [__m512i; 2];

        #[inline(always)]
        fn query(&self) -> Self::Query {
            // SAFETY: a value of this type exists only inside `run_*`, where the features are.
            [[unsafe { _mm512_setzero_si512() }; 2]; PATCH_MAX]
        }

        #[inline(always)]
        fn hold(&self, query: &mut Self::Query, image: &MatchImage, at: usize) {
            let start = checked(image, at, self.patch, self.patch);
            for (row, held) in query[..self.patch].iter_mut().enumerate() {
                // SAFETY: inside the picture, or its tail, by `checked`; features as above.
                *held = unsafe {
                    let row = start.add(row * image.stride * 4);
                    [_mm512_loadu_si512(row.cast()), _mm512_loadu_si512(row.add(64).cast())]
                };
            }
        }

        #[inline(always)]
        fn nothing(&self) -> [__m512i; 2] {
            // SAFETY: as above.
            [unsafe { _mm512_setzero_si512() }; 2]
        }

        #[inline(always)]
        fn add_rows(
            &self,
            mut sums: [__m512i; 2],
            query: &Self::Query,
            image: &MatchImage,
            at: usize,
            first: usize,
        ) -> [__m512i; 2] {
            let start = checked(image, at, self.patch, self.patch);
            let stride = image.stride * 4;
            let inside = inside(self.patch);
            for (row, held) in query[..self.patch].iter().enumerate().skip(first).step_by(6) {
                // SAFETY: inside the picture, or its tail, by `checked`; features as above.
                unsafe {
                    let row = start.add(row * stride);
                    let e = _mm512_loadu_si512(row.cast());
                    sums[0] = add_squares::<M>(sums[0], held[0], e, inside[0]);
                    if self.patch > 16 {
                        let e = _mm512_loadu_si512(row.add(64).cast());
                        sums[1] = add_squares::<M>(sums[1], held[1], e, inside[1]);
                    }
                }
            }
            sums
        }

        #[inline(always)]
        fn total(&self, sums: [__m512i; 2]) -> i32 {
            total_512(sums)
        }

        #[inline(always)]
        fn row_change(&self, a: (&MatchImage, [usize; 2]), b: (&MatchImage, [usize; 2])) -> i32 {
            row_change_512::<M>(self.patch, a, b)
        }
    }

    /// AVX2, any patch side: a row is one to three registers. `N` is the side if it is known to
    /// the compiler, else 0.
    #[derive(Debug, Clone, Copy)]
    struct Any256<const N: usize> {
        patch: usize,
    }

    impl<const N: usize> Any256<N> {
        #[inline(always)]
        fn side(self) -> usize {
            if N == 0 { self.patch } else { N }
        }

        /// Squared differences of the `i`-th eight pixels of two rows, in groups of four; zero
        /// beyond the patch's right end.
        ///
        /// # Safety
        /// The CPU has AVX2.
        #[inline(always)]
        unsafe fn squares(self, f: __m256i, e: __m256i, i: usize) -> __m256i {
            let inside = self.side() as i32 - 8 * i as i32;
            // SAFETY: the caller's promise. Codes have seven bits: their difference fits into
            // eight, and two squares of it into sixteen.
            unsafe {
                let mut difference = _mm256_abs_epi8(_mm256_sub_epi8(f, e));
                if inside < 8 {
                    let lanes = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
                    let mask = _mm256_cmpgt_epi32(_mm256_set1_epi32(inside), lanes);
                    difference = _mm256_and_si256(difference, mask);
                }
                let pairs = _mm256_maddubs_epi16(difference, difference);
                _mm256_madd_epi16(pairs, _mm256_set1_epi16(1))
            }
        }

        /// Sum of the eight numbers.
        ///
        /// # Safety
        /// The CPU has AVX2.
        #[inline(always)]
        unsafe fn sum(sum: __m256i) -> i32 {
            // SAFETY: the caller's promise.
            unsafe {
                let sum =
                    _mm_add_epi32(_mm256_castsi256_si128(sum), _mm256_extracti128_si256::<1>(sum));
                let sum = _mm_add_epi32(sum, _mm_shuffle_epi32::<0b01_00_11_10>(sum));
                let sum = _mm_add_epi32(sum, _mm_shuffle_epi32::<0b10_11_00_01>(sum));
                _mm_cvtsi128_si32(sum)
            }
        }
    }

    impl<const N: usize> Kernel for Any256<N> {
        type Query = [[__m256i; 3]; PATCH_MAX];
        type Sums = [__m256i; 3];

        #[inline(always)]
        fn query(&self) -> Self::Query {
            // SAFETY: a value of this type exists only inside `run_avx2`, where the feature is.
            [[unsafe { _mm256_setzero_si256() }; 3]; PATCH_MAX]
        }

        #[inline(always)]
        fn hold(&self, query: &mut Self::Query, image: &MatchImage, at: usize) {
            let n = self.side();
            let start = checked(image, at, n, n);
            for (row, held) in query[..n].iter_mut().enumerate() {
                for (i, held) in held.iter_mut().enumerate().take(n.div_ceil(8)) {
                    // SAFETY: inside the picture, or its tail, by `checked`; feature as above.
                    *held = unsafe {
                        _mm256_loadu_si256(start.add(row * image.stride * 4 + 32 * i).cast())
                    };
                }
            }
        }

        #[inline(always)]
        fn nothing(&self) -> [__m256i; 3] {
            // SAFETY: as above.
            [unsafe { _mm256_setzero_si256() }; 3]
        }

        #[inline(always)]
        fn add_rows(
            &self,
            mut sums: [__m256i; 3],
            query: &Self::Query,
            image: &MatchImage,
            at: usize,
            first: usize,
        ) -> [__m256i; 3] {
            let n = self.side();
            let start = checked(image, at, n, n);
            let stride = image.stride * 4;
            for (row, held) in query[..n].iter().enumerate().skip(first).step_by(6) {
                for (i, &f) in held.iter().enumerate().take(n.div_ceil(8)) {
                    // SAFETY: inside the picture, or its tail, by `checked`; feature as above.
                    unsafe {
                        let e = _mm256_loadu_si256(start.add(row * stride + 32 * i).cast());
                        sums[i] = _mm256_add_epi32(sums[i], self.squares(f, e, i));
                    }
                }
            }
            sums
        }

        #[inline(always)]
        fn total(&self, [a, b, c]: [__m256i; 3]) -> i32 {
            // SAFETY: feature as above.
            unsafe { Self::sum(_mm256_add_epi32(_mm256_add_epi32(a, b), c)) }
        }

        #[inline(always)]
        fn row_change(&self, a: (&MatchImage, [usize; 2]), b: (&MatchImage, [usize; 2])) -> i32 {
            let n = self.side();
            // No closures: they would not be compiled for the instruction set.
            // SAFETY: feature as above.
            let mut sums = [unsafe { _mm256_setzero_si256() }; 2];
            for (k, sum) in sums.iter_mut().enumerate() {
                let (a, b) = (checked(a.0, a.1[k], n, 1), checked(b.0, b.1[k], n, 1));
                for i in 0..n.div_ceil(8) {
                    // SAFETY: inside the pictures, or their tails, by `checked`; feature as above.
                    unsafe {
                        let f = _mm256_loadu_si256(a.add(32 * i).cast());
                        let e = _mm256_loadu_si256(b.add(32 * i).cast());
                        *sum = _mm256_add_epi32(*sum, self.squares(f, e, i));
                    }
                }
            }
            // SAFETY: feature as above.
            unsafe { Self::sum(_mm256_sub_epi32(sums[0], sums[1])) }
        }
    }

    /// Runs the work compiled for AVX-512 with VNNI.
    #[target_feature(enable = "avx2,avx512f,avx512bw,avx512dq,avx512vnni")]
    pub(super) fn run_vnni<W: WithKernel>(patch: usize, work: W) -> W::Output {
        run512::<Vnni, W>(patch, work)
    }

    /// Runs the work compiled for AVX-512.
    #[target_feature(enable = "avx2,avx512f,avx512bw,avx512dq")]
    pub(super) fn run_avx512<W: WithKernel>(patch: usize, work: W) -> W::Output {
        run512::<NoVnni, W>(patch, work)
    }

    #[inline(always)]
    fn run512<M: MultiplyAdd512, W: WithKernel>(patch: usize, work: W) -> W::Output {
        let method = std::marker::PhantomData::<M>;
        if patch == 11 {
            // Of a mask that it knows the compiler makes a further instruction a row.
            let inside = std::hint::black_box(inside(11)[0]);
            work.run(Eleven { inside, method })
        } else {
            work.run(Any512 { patch, method })
        }
    }

    /// Runs the work compiled for AVX2.
    #[target_feature(enable = "avx2")]
    pub(super) fn run_avx2<W: WithKernel>(patch: usize, work: W) -> W::Output {
        if patch == 11 { work.run(Any256::<11> { patch }) } else { work.run(Any256::<0> { patch }) }
    }
}
