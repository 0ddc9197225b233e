//! Sums of products of a picture and its moved copies, by Fourier transforms.

use std::sync::Arc;

use rayon::prelude::*;
use realfft::num_complex::Complex;
use realfft::{ComplexToReal, RealFftPlanner};
use rustfft::FftPlanner;

/// Columns that lie together: whole cache lines, and a band of them is a page.
const BLOCK: usize = 8;

/// Rows that lie together.
const BAND: usize = 32;

const ZERO: Complex<f64> = Complex::new(0.0, 0.0);

/// The sums over the overlap of the products of the picture and its copy, of all planes together, for
/// every displacement that is not upwards: transformed back but for the rows.
pub(super) struct Products {
    width: usize,
    /// Blocks of columns; of each, row by row, [`BLOCK`] bins.
    columns: Vec<[f64; 2]>,
    block_len: usize,
    backward: Arc<dyn ComplexToReal<f64>>,
}

impl Products {
    /// Of `planes` less their `means`.
    pub(super) fn new(planes: &[Vec<f32>], means: &[f64], (height, width): (usize, usize)) -> Self {
        // Room for the moved copy, so that nothing wraps onto the picture.
        let (half, cols) = (fast_size(height), fast_size(2 * width - 1));
        let mut reals = RealFftPlanner::<f64>::new();
        let forward = reals.plan_fft_forward(cols);
        let mut plain = FftPlanner::<f64>::new();
        let (down, up) = (plain.plan_fft_forward(half), plain.plan_fft_inverse(half));
        // Padded to twice its length, a column's even frequencies are those of the column alone, its odd
        // ones those of the column times these.
        let turns: Vec<Complex<f64>> = (0..half)
            .map(|y| {
                let angle = -std::f64::consts::PI * y as f64 / half as f64;
                Complex::new(libm::cos(angle), libm::sin(angle))
            })
            .collect();
        let bins = cols / 2 + 1;
        let blocks = bins.div_ceil(BLOCK);
        let bands = height.div_ceil(BAND);
        // Bands of rows; of each, blocks of columns: rows are written and columns read nearly in place.
        // Blocks that are read back a power of two apart would displace each other from the cache.
        let block_len = (height | 1) * BLOCK;
        let mut spectrum = vec![[0.0; 2]; (bands * BAND * BLOCK).max(block_len) * blocks];
        // Columns a power of two apart would displace each other from the cache.
        let stride = half + BLOCK;
        // Columns one after the other: even frequencies, then odd.
        let rows = 2 * half;
        // Touched by one thread: two that touch new pages side by side take several times as long.
        let mut power = Vec::new();
        power.resize(blocks * BLOCK * rows, 0.0);
        for (plane, mean) in planes.iter().zip(means) {
            // Rows; those of the padding are zero and stay out.
            let bands = spectrum.par_chunks_mut(BAND * blocks * BLOCK);
            bands.zip(plane.par_chunks(BAND * width)).for_each_init(
                || (forward.make_input_vec(), vec![ZERO; BAND * bins], forward.make_scratch_vec()),
                |(padded, local, scratch), (band, plane)| {
                    for (row, out) in plane.chunks(width).zip(local.chunks_mut(bins)) {
                        for (to, &from) in padded.iter_mut().zip(row) {
                            *to = f64::from(from) - mean;
                        }
                        padded[width..].fill(0.0);
                        let done = forward.process_with_scratch(padded, out, scratch);
                        debug_assert!(done.is_ok(), "buffers are of the planned lengths");
                    }
                    for (b, block) in band.chunks_mut(BAND * BLOCK).enumerate() {
                        for (to, from) in block.chunks_mut(BLOCK).zip(local.chunks(bins)) {
                            let from = &from[b * BLOCK..];
                            to.iter_mut().zip(from).for_each(|(to, v)| *to = [v.re, v.im]);
                        }
                    }
                },
            );
            power.par_chunks_mut(BLOCK * rows).enumerate().for_each_init(
                || (vec![ZERO; 2 * BLOCK * stride], vec![ZERO; down.get_inplace_scratch_len()]),
                |(columns, scratch), (b, power)| {
                    for (y, turn) in turns[..height].iter().enumerate() {
                        let at = ((y / BAND * blocks + b) * BAND + y % BAND) * BLOCK;
                        for (k, &[re, im]) in spectrum[at..][..BLOCK].iter().enumerate() {
                            let value = Complex::new(re, im);
                            columns[2 * k * stride + y] = value;
                            columns[(2 * k + 1) * stride + y] = value * turn;
                        }
                    }
                    for (column, power) in columns.chunks_mut(stride).zip(power.chunks_mut(half)) {
                        let column = &mut column[..half];
                        column[height..].fill(ZERO);
                        down.process_with_scratch(column, scratch);
                        power.iter_mut().zip(&*column).for_each(|(sum, v)| *sum += v.norm_sqr());
                    }
                },
            );
        }
        // Columns back. The power is real, so both halves can be transformed as one.
        let scale = 0.5 / (rows * cols) as f64;
        let mut columns = spectrum;
        columns.truncate(blocks * block_len);
        columns.par_chunks_mut(block_len).zip(power.par_chunks(BLOCK * rows)).for_each_init(
            || (vec![ZERO; half], vec![ZERO; up.get_inplace_scratch_len()]),
            |(both, scratch), (block, power)| {
                for (k, power) in power.chunks(rows).enumerate() {
                    let (even, odd) = power.split_at(half);
                    for (both, (&re, &im)) in both.iter_mut().zip(even.iter().zip(odd)) {
                        *both = Complex::new(re, im);
                    }
                    up.process_with_scratch(both, scratch);
                    let to = block[k..].iter_mut().step_by(BLOCK);
                    let mirrored = both[..1].iter().chain(both[1..].iter().rev());
                    for ((to, turn), (a, b)) in to.zip(&turns).zip(both.iter().zip(mirrored)) {
                        let b = b.conj();
                        let odd = a - b;
                        let v = a + b + Complex::new(odd.im, -odd.re) * turn.conj();
                        *to = [v.re * scale, v.im * scale];
                    }
                }
            },
        );
        Self { width, columns, block_len, backward: reals.plan_fft_inverse(cols) }
    }

    /// A reader of rows with buffers of its own.
    pub(super) fn rows(&self) -> Rows<'_> {
        let full = self.backward.make_output_vec();
        let (bins, scratch) = (self.backward.make_input_vec(), self.backward.make_scratch_vec());
        Rows { of: self, bins, full, scratch }
    }
}

/// Transforms rows back.
pub(super) struct Rows<'a> {
    of: &'a Products,
    bins: Vec<Complex<f64>>,
    full: Vec<f64>,
    scratch: Vec<Complex<f64>>,
}

impl Rows<'_> {
    /// The sums for the vertical displacement `dy`: for the horizontal ones from 1 - width to -1, and for
    /// those from 0 to width - 1.
    pub(super) fn row(&mut self, dy: usize) -> (&[f64], &[f64]) {
        let Self { of, bins, full, scratch } = self;
        let (width, cols) = (of.width, full.len());
        for (to, block) in bins.chunks_mut(BLOCK).zip(of.columns.chunks(of.block_len)) {
            let row = &block[dy * BLOCK..];
            to.iter_mut().zip(row).for_each(|(to, &[re, im])| *to = Complex::new(re, im));
        }
        // A real row has real outermost bins; the transform insists.
        bins[0].im = 0.0;
        if cols.is_multiple_of(2) {
            bins[cols / 2].im = 0.0;
        }
        let done = of.backward.process_with_scratch(bins, full, scratch);
        debug_assert!(done.is_ok(), "buffers are of the planned lengths");
        (&full[cols + 1 - width..], &full[..width])
    }
}

/// The smallest length of at least `n` with the prime factors 2, 3 and 5 only.
fn fast_size(n: usize) -> usize {
    let smooth = |mut m: usize| {
        for p in [2, 3, 5] {
            while m.is_multiple_of(p) {
                m /= p;
            }
        }
        m == 1
    };
    // There is a power of two.
    (n..=n.next_power_of_two()).find(|&m| smooth(m)).unwrap_or(n)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_are_smooth_and_not_shorter() {
        let got: Vec<_> = [1, 7, 11, 31, 127, 2047].map(fast_size).into();
        assert_eq!(got, [1, 8, 12, 32, 128, 2048]);
    }
}
