//! Voting: every output pixel becomes the mean of the source pixels that the patches over it hold.

use rayon::prelude::*;

use crate::search::field::Field;
use crate::search::patch::{Kernel, WithKernel, with_kernel};
use crate::search::patchmatch::Wrap;
use crate::search::source::Source;

/// Sums of codes over the patches that cover each pixel, and how many patches these are.
#[derive(Debug, Clone)]
pub struct Votes {
    /// Rows: the output's, plus an apron of `patch - 1` on the axis that does not wrap.
    pub height: usize,
    /// Columns, likewise.
    pub width: usize,
    /// Sum of the codes, four a pixel.
    pub sums: Vec<[u16; 4]>,
    wrap: Wrap,
    patch: usize,
}

impl Votes {
    /// Number of patches over pixel (`y`, `x`).
    #[inline]
    pub fn count(&self, y: usize, x: usize) -> u32 {
        let axis = |i: usize, n: usize, wrap: bool| {
            if wrap { self.patch } else { self.patch.min(i + 1).min(n - i) }
        };
        (axis(y, self.height, self.wrap.y) * axis(x, self.width, self.wrap.x)) as u32
    }
}

/// Lets every matched patch vote. On an axis that wraps, row 0 is the output's row 0; on one that
/// does not, the output starts after half an apron.
///
/// # Determinism
/// Sums of integers: any order gives the same bytes.
pub fn vote(simd: crate::Simd, field: &Field, source: &Source, wrap: Wrap) -> Votes {
    let n = source.patch;
    let height = field.height + if wrap.y { 0 } else { n - 1 };
    let width = field.width + if wrap.x { 0 } else { n - 1 };
    let mut sums = vec![[0u16; 4]; height * width];
    sums.par_chunks_mut(width).enumerate().for_each_init(
        // One row on the canvas with its apron.
        || vec![0u16; (field.width + n - 1) * 4],
        |row, (y, out)| {
            with_kernel(simd, n, VoteRow { field, source, wrap, y, row });
            let sums: &[[u16; 4]] = bytemuck::cast_slice(row);
            if wrap.x {
                // The canvas starts half a patch left of the output; fold its apron back.
                let half = n / 2;
                out.fill([0; 4]);
                for (i, sum) in sums.iter().enumerate() {
                    let at = (i + field.width * n - half) % field.width;
                    for k in 0..4 {
                        out[at][k] += sum[k];
                    }
                }
            } else {
                out.copy_from_slice(sums);
            }
        },
    );
    Votes { height, width, sums, wrap, patch: n }
}

struct VoteRow<'a> {
    field: &'a Field,
    source: &'a Source,
    wrap: Wrap,
    y: usize,
    row: &'a mut [u16],
}

impl WithKernel for VoteRow<'_> {
    type Output = ();

    #[inline(always)]
    fn run<K: Kernel>(self, _kernel: K) {
        let Self { field, source, wrap, y, row } = self;
        // The default side with its length known to the compiler.
        if source.patch == 11 {
            vote_row::<11>(field, source, wrap, y, row);
        } else {
            vote_row::<0>(field, source, wrap, y, row);
        }
    }
}

#[inline(always)]
fn vote_row<const N: usize>(field: &Field, source: &Source, wrap: Wrap, y: usize, row: &mut [u16]) {
    let n = if N == 0 { source.patch } else { N };
    let (height, width) = (field.height as isize, field.width);
    let codes = source.image.codes();
    row.fill(0);
    for d in 0..n {
        // The patches whose row `d` lies on this row of the output (or canvas).
        let anchor = y as isize - d as isize + if wrap.y { (n / 2) as isize } else { 0 };
        let anchor = if wrap.y { anchor.rem_euclid(height) } else { anchor };
        if !(0..height).contains(&anchor) {
            continue;
        }
        let matches = &field.pos[anchor as usize * width..][..width];
        // Every n-th patch in turn: their segments do not overlap, so that no sum waits for the
        // one just stored.
        for phase in 0..n.min(width) {
            for x in (phase..width).step_by(n) {
                let at = (source.at(matches[x]) + d * source.image.width()) * 4;
                let from = &codes[at..at + 4 * n];
                let to = &mut row[4 * x..4 * x + 4 * n];
                for (to, &from) in to.iter_mut().zip(from) {
                    *to += from as u16;
                }
            }
        }
    }
}
