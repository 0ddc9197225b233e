//! Patch distance: the kernel everything waits for.
//!
//! A [`MatchImage`] holds 7-bit codes of the matching space, four bytes a pixel. The difference of
//! two codes below 128 fits into a signed byte, and its square's sums into every instruction set's
//! cheapest multiply-add (`vpdpbusd`, `vpmaddubsw` without saturation, plain Rust): one load and
//! three instructions per patch row, and all levels give the same integer. (`|e|^2 - 2 e.f` needs
//! only one instruction a row, but a table of `|e|^2`, and looking that up at random places costs
//! more than it saves.)

pub mod codes;
mod scalar;
mod simd;

pub use scalar::{distance_squared, squares};

use crate::base::ctx::Simd;

/// Bytes after the last pixel that kernels may read (and multiply by zero).
const TAIL: usize = 128;

/// Largest code.
pub const CODE_MAX: u8 = 127;

/// Largest patch side: with it, a sum of 7-bit codes over a patch still fits into 16 bits.
pub const PATCH_MAX: usize = 21;

/// A picture in the matching space: codes in `0..=127`, four bytes a pixel, row by row.
#[derive(Debug, Clone)]
pub struct MatchImage {
    height: usize,
    width: usize,
    stride: usize,
    codes: Vec<u8>,
}

impl MatchImage {
    /// A picture of zeros.
    pub fn new(height: usize, width: usize) -> Self {
        // An odd number of cache lines a row. With the even numbers that pictures of 512 or 1024
        // columns have, all rows of a patch would fall into the same few sets of the cache.
        const LINE: usize = 16;
        let stride = (width.div_ceil(LINE) | 1) * LINE;
        Self { height, width, stride, codes: vec![0; height * stride * 4 + TAIL] }
    }

    /// Height in pixels.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Width in pixels.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Pixels from one row to the next.
    pub fn stride(&self) -> usize {
        self.stride
    }

    /// Index of pixel (`y`, `x`).
    #[inline]
    pub fn at(&self, y: usize, x: usize) -> usize {
        y * self.stride + x
    }

    /// The codes of pixel (`y`, `x`).
    #[inline]
    pub fn pixel(&self, y: usize, x: usize) -> [u8; 4] {
        let at = self.at(y, x) * 4;
        [self.codes[at], self.codes[at + 1], self.codes[at + 2], self.codes[at + 3]]
    }

    /// The codes of row `y`, four a pixel.
    #[inline]
    pub fn row(&self, y: usize) -> &[u8] {
        &self.codes[self.at(y, 0) * 4..][..self.width * 4]
    }

    /// `n` codes from pixel index `at` on, in one row.
    #[inline]
    pub(crate) fn codes_from(&self, at: usize, n: usize) -> &[u8] {
        &self.codes[at * 4..at * 4 + n]
    }

    /// Writes rows of pixels through `fill(y, row)`; codes above 127 are cut to 127.
    pub fn fill_rows(&mut self, fill: impl Fn(usize, &mut [[u8; 4]]) + Sync) {
        use rayon::prelude::*;
        let (width, stride) = (self.width, self.stride);
        let rows = self.codes.par_chunks_mut(stride * 4).take(self.height);
        rows.enumerate().for_each(|(y, row)| {
            let row: &mut [[u8; 4]] = bytemuck::cast_slice_mut(&mut row[..width * 4]);
            fill(y, row);
            for code in row.as_flattened_mut() {
                *code = (*code).min(CODE_MAX);
            }
        });
    }
}

/// A patch distance of one instruction set, for patches of a fixed side.
pub trait Kernel: Copy + Send + Sync {
    /// The rows of one patch, held ready.
    type Query;
    /// Sums of squared differences, in parts.
    type Sums: Copy;

    /// An empty query, to be reused from patch to patch.
    fn query(&self) -> Self::Query;

    /// Holds the patch of `image` whose top left pixel has index `at` ready.
    fn hold(&self, query: &mut Self::Query, image: &MatchImage, at: usize);

    /// Nothing summed yet.
    fn nothing(&self) -> Self::Sums;

    /// Adds the squared differences of every sixth row, from row `first` on, of the held patch and the
    /// patch of `image` whose top left pixel has index `at`.
    fn add_rows(
        &self,
        sums: Self::Sums,
        query: &Self::Query,
        image: &MatchImage,
        at: usize,
        first: usize,
    ) -> Self::Sums;

    /// The sum of all parts.
    fn total(&self, sums: Self::Sums) -> i32;

    /// Squared distance between the held patch and the patch of `image` whose top left pixel has
    /// index `at`: the sum over rows, columns and channels.
    #[inline(always)]
    fn distance(&self, query: &Self::Query, image: &MatchImage, at: usize) -> i32 {
        let mut sums = self.nothing();
        for first in 0..6 {
            sums = self.add_rows(sums, query, image, at, first);
        }
        self.total(sums)
    }

    /// That distance if it is below `limit`; else some number from `limit` to the distance, mostly after a
    /// few rows.
    #[inline(always)]
    fn distance_below(
        &self,
        query: &Self::Query,
        image: &MatchImage,
        at: usize,
        limit: i32,
    ) -> i32 {
        let mut sums = self.add_rows(self.nothing(), query, image, at, 2);
        let part = self.total(sums);
        if part >= limit {
            return part;
        }
        for first in [0, 4] {
            sums = self.add_rows(sums, query, image, at, first);
        }
        let part = self.total(sums);
        if part >= limit {
            return part;
        }
        for first in [1, 3, 5] {
            sums = self.add_rows(sums, query, image, at, first);
        }
        self.total(sums)
    }

    /// How the squared distance of two patches changes when both move by a row: that of the rows
    /// that enter less that of the rows that leave. `a` and `b` are a picture with the pixel
    /// indices where its entering and its leaving row (of one patch side) begin.
    fn row_change(&self, a: (&MatchImage, [usize; 2]), b: (&MatchImage, [usize; 2])) -> i32;
}

/// Work that wants a [`Kernel`]; [`with_kernel`] calls it with the best one.
pub trait WithKernel {
    /// What the work returns.
    type Output;
    /// Does the work. Must be `#[inline(always)]`, so that it is compiled for the kernel's
    /// instruction set.
    fn run<K: Kernel>(self, kernel: K) -> Self::Output;
}

/// Runs `work` with the best kernel for patches of side `patch` that the CPU has, at most `limit`.
///
/// # Determinism
/// All kernels return the same integers.
pub fn with_kernel<W: WithKernel>(limit: Simd, patch: usize, work: W) -> W::Output {
    assert!((1..=PATCH_MAX).contains(&patch), "patch side {patch} is not in 1..={PATCH_MAX}");
    simd::dispatch(limit, patch, work)
}

/// The instruction set that [`with_kernel`] takes under `limit` on this CPU.
pub fn detected(limit: Simd) -> Simd {
    simd::detect().min(limit)
}
