//! Voting: every output pixel becomes the mean of the source pixels that the patches over it hold.

use rayon::prelude::*;

use crate::base::ctx::Simd;
use crate::search::field::Field;
use crate::search::patch::{Kernel, WithKernel, with_kernel};
use crate::search::patchmatch::Wrap;
use crate::search::source::Source;
use crate::signal::histogram::{SOFT_BITS, Soft};

/// The means that the patches vote for.
#[derive(Debug, Clone)]
pub struct Votes {
    /// Rows: the output's, plus an apron of `patch - 1` on the axis that does not wrap (the output
    /// starts after half of it).
    pub height: usize,
    /// Columns, likewise.
    pub width: usize,
    /// Means of the codes, row by row.
    pub soft: Vec<Soft>,
}

/// Neighbouring output pixels of one row that are matched to neighbouring source patches.
struct Run {
    /// First output column.
    x: usize,
    /// Number of columns.
    len: usize,
    /// Pixel index of the first patch's top left corner in the source.
    at: usize,
}

/// Lets every matched patch vote.
///
/// # Determinism
/// Sums of integers: any order gives the same bytes.
pub fn vote(simd: Simd, field: &Field, source: &Source, wrap: Wrap) -> Votes {
    let n = source.patch;
    let height = field.height + if wrap.y { 0 } else { n - 1 };
    let width = field.width + if wrap.x { 0 } else { n - 1 };
    let runs: Vec<Vec<Run>> =
        field.pos.par_chunks(field.width).map(|row| runs(row, source)).collect();
    let mut soft = vec![[0; 4]; height * width];
    soft.par_chunks_mut(width).enumerate().for_each_init(
        // One row on the canvas with its apron.
        || vec![0u16; (field.width + n - 1) * 4],
        |row, (y, out)| {
            with_kernel(simd, n, VoteRow { runs: &runs, source, wrap, y, row, out });
        },
    );
    Votes { height, width, soft }
}

fn runs(row: &[crate::search::field::Pos], source: &Source) -> Vec<Run> {
    let mut runs: Vec<Run> = Vec::new();
    for (x, &pos) in row.iter().enumerate() {
        match runs.last_mut() {
            Some(run) if x > 0 && row[x - 1].shifted(0, 1, source) == Some(pos) => run.len += 1,
            _ => runs.push(Run { x, len: 1, at: source.at(pos) }),
        }
    }
    runs
}

struct VoteRow<'a> {
    runs: &'a [Vec<Run>],
    source: &'a Source,
    wrap: Wrap,
    y: usize,
    row: &'a mut [u16],
    out: &'a mut [Soft],
}

impl WithKernel for VoteRow<'_> {
    type Output = ();

    #[inline(always)]
    fn run<K: Kernel>(self, _kernel: K) {
        let Self { runs, source, wrap, y, row, out } = self;
        let n = source.patch;
        let height = runs.len() as isize;
        row.fill(0);
        let mut n_rows = 0;
        for d in 0..n {
            // The patches whose row `d` lies on this row of the output (or canvas).
            let anchor = y as isize - d as isize + if wrap.y { (n / 2) as isize } else { 0 };
            let anchor = if wrap.y { anchor.rem_euclid(height) } else { anchor };
            if !(0..height).contains(&anchor) {
                continue;
            }
            n_rows += 1;
            for run in &runs[anchor as usize] {
                let at = run.at + d * source.image.stride();
                let len = 4 * (run.len + n - 1);
                add_run(
                    source.image.codes_from(at, len),
                    &mut row[4 * run.x..4 * run.x + len],
                    run.len,
                    n,
                );
            }
        }
        let half = n / 2;
        let width = out.len();
        if wrap.x {
            // The canvas starts half a patch left of the output; its apron folds back.
            let scale = scale(n_rows * n);
            let columns = row.len() / 4;
            for (x, out) in out.iter_mut().enumerate() {
                let mut sum = [0u32; 4];
                let mut i = (x + half) % width;
                while i < columns {
                    (0..4).for_each(|k| sum[k] += row[4 * i + k] as u32);
                    i += width;
                }
                *out = sum.map(|s| mean(s, scale));
            }
        } else {
            for (x, out) in out.iter_mut().enumerate() {
                let n_cols = n.min(x + 1).min(width - x);
                let scale = scale(n_rows * n_cols);
                *out = std::array::from_fn(|k| mean(row[4 * x + k] as u32, scale));
            }
        }
    }
}

/// Adds one row of each of `len` overlapping patches of side `n`: column c of their union lies
/// under `min(c + 1, len, n, ...)` of them, rising at the start, falling at the end.
#[inline(always)]
fn add_run(from: &[u8], to: &mut [u16], len: usize, n: usize) {
    let peak = len.min(n);
    let ramp = 4 * (peak - 1);
    let end = from.len() - ramp;
    for (i, (to, &from)) in to[..ramp].iter_mut().zip(&from[..ramp]).enumerate() {
        *to += from as u16 * (i as u16 / 4 + 1);
    }
    for (to, &from) in to[ramp..end].iter_mut().zip(&from[ramp..end]) {
        *to += from as u16 * peak as u16;
    }
    for (i, (to, &from)) in to[end..].iter_mut().zip(&from[end..]).enumerate() {
        *to += from as u16 * (peak as u16 - 1 - i as u16 / 4);
    }
}

/// 2^16 soft units over the number of patches.
#[inline(always)]
fn scale(n_patches: usize) -> u32 {
    (1 << (16 + SOFT_BITS)) / n_patches as u32
}

#[inline(always)]
fn mean(sum: u32, scale: u32) -> u16 {
    ((sum * scale + (1 << 15)) >> 16) as u16
}
