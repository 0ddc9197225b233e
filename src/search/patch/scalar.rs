//! The kernel in plain Rust: the definition the others are tested against.

use super::{Kernel, MatchImage};

/// Plain Rust, for any patch side.
#[derive(Debug, Clone, Copy)]
pub(super) struct Scalar {
    pub(super) patch: usize,
}

impl Kernel for Scalar {
    type Query = Vec<u8>;
    type Sums = i32;

    fn query(&self) -> Vec<u8> {
        vec![0; 4 * self.patch * self.patch]
    }

    #[inline]
    fn hold(&self, query: &mut Vec<u8>, image: &MatchImage, at: usize) {
        let n = self.patch;
        for (row, held) in query.chunks_exact_mut(4 * n).enumerate() {
            let start = (at + row * image.stride) * 4;
            held.copy_from_slice(&image.codes[start..start + 4 * n]);
        }
    }

    fn nothing(&self) -> i32 {
        0
    }

    #[inline]
    fn add_rows(
        &self,
        sums: i32,
        query: &Vec<u8>,
        image: &MatchImage,
        at: usize,
        first: usize,
    ) -> i32 {
        let n = 4 * self.patch;
        let rows = query.chunks_exact(n).enumerate().skip(first).step_by(6);
        let row = |(row, held)| squares(held, image.codes_from(at + row * image.stride, n));
        sums + rows.map(row).sum::<i32>()
    }

    fn total(&self, sums: i32) -> i32 {
        sums
    }

    #[inline]
    fn row_change(&self, a: (&MatchImage, [usize; 2]), b: (&MatchImage, [usize; 2])) -> i32 {
        let distance = |i: usize| {
            let [a, b] = [a, b].map(|(image, at)| image.codes_from(at[i], 4 * self.patch));
            squares(a, b)
        };
        distance(0) - distance(1)
    }
}

/// Sum of the squared differences of as many codes as both have. In a [`WithKernel`](super::WithKernel) it is
/// compiled for its instruction set.
#[inline(always)]
pub fn squares(a: &[u8], b: &[u8]) -> i32 {
    let mut sum = 0;
    for (&a, &b) in a.iter().zip(b) {
        let d = i32::from(i16::from(a) - i16::from(b));
        sum += d * d;
    }
    sum
}

/// Squared distance of two patches by its definition: the sum over rows, columns and channels of
/// the squared difference of the codes. `a_at` and `b_at` are pixel indices of the top left.
pub fn distance_squared(
    a: &MatchImage,
    a_at: usize,
    b: &MatchImage,
    b_at: usize,
    patch: usize,
) -> i32 {
    let mut sum = 0;
    for row in 0..patch {
        for i in 0..4 * patch {
            let u = a.codes[(a_at + row * a.stride) * 4 + i] as i32;
            let v = b.codes[(b_at + row * b.stride) * 4 + i] as i32;
            sum += (u - v) * (u - v);
        }
    }
    sum
}
