//! Sums of products of a picture and its moved copies, by Fourier transforms.

use std::sync::Arc;

use rayon::prelude::*;
use realfft::num_complex::Complex;
use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};

use super::columns::{BLOCK, Bins, Columns};

/// Rows that lie together. Of a block of columns they are nearly a page; not a power of two, as blocks
/// that far apart would displace each other from the cache.
const BAND: usize = 31;

const ZERO: Complex<f64> = Complex::new(0.0, 0.0);

/// Some rows of a spectrum: blocks of columns one after the other, of each its rows.
type Band = Vec<Bins>;

/// The sums over the overlap of the products of the picture and its copy, of all planes together, for
/// every displacement that is not upwards: transformed back but for the rows.
pub(super) struct Products {
    width: usize,
    bands: Vec<Band>,
    backward: Arc<dyn ComplexToReal<f64>>,
}

impl Products {
    /// Of `planes` less their `means`.
    pub(super) fn new(planes: &[Vec<f32>], means: &[f64], (height, width): (usize, usize)) -> Self {
        // Room for the moved copy, so that nothing wraps onto the picture.
        let cols = fast_size(2 * width - 1);
        let mut reals = RealFftPlanner::<f64>::new();
        let forward = reals.plan_fft_forward(cols);
        let mut spectra: Vec<Vec<Band>> =
            planes.iter().zip(means).map(|(p, mean)| rows(p, *mean, width, &*forward)).collect();
        // The sums take the place of the last plane's spectrum, block by block.
        let mut bands = spectra.pop().unwrap_or_default();
        let blocks = (cols / 2 + 1).div_ceil(BLOCK);
        let mut own: Vec<Vec<&mut [Bins]>> = Vec::new();
        own.resize_with(blocks, Vec::new);
        for band in &mut bands {
            let len = band.len() / blocks;
            own.iter_mut().zip(band.chunks_mut(len)).for_each(|(own, rows)| own.push(rows));
        }
        let columns = Columns::new(fast_size(height), height, cols);
        own.into_par_iter().enumerate().for_each_init(
            || columns.buffers(),
            |buffers, (block, mut own)| {
                for spectrum in &spectra {
                    let rows = spectrum.iter().map(|band| {
                        let len = band.len() / blocks;
                        &band[block * len..][..len]
                    });
                    columns.add_power(buffers, rows);
                }
                columns.add_power(buffers, own.iter().map(|rows| &**rows));
                columns.back(buffers, own.iter_mut().map(|rows| &mut **rows));
            },
        );
        Self { width, bands, backward: reals.plan_fft_inverse(cols) }
    }

    /// A reader of rows with buffers of its own.
    pub(super) fn rows(&self) -> Rows<'_> {
        let full = self.backward.make_output_vec();
        let (bins, scratch) = (self.backward.make_input_vec(), self.backward.make_scratch_vec());
        Rows { of: self, bins, full, scratch }
    }
}

/// Transforms the rows of a plane; those of the padding are zero and stay out.
fn rows(plane: &[f32], mean: f64, width: usize, forward: &dyn RealToComplex<f64>) -> Vec<Band> {
    let bins = forward.complex_len();
    let blocks = bins.div_ceil(BLOCK);
    let buffers = || {
        let local = vec![[ZERO; BLOCK]; BAND * blocks];
        (forward.make_input_vec(), local, forward.make_scratch_vec())
    };
    let bands = plane.par_chunks(BAND * width);
    let band = |(padded, local, scratch): &mut (Vec<f64>, Band, Vec<_>), rows: &[f32]| {
        let local = &mut local[..rows.len() / width * blocks];
        for (row, out) in rows.chunks(width).zip(local.chunks_mut(blocks)) {
            for (to, &from) in padded.iter_mut().zip(row) {
                *to = f64::from(from) - mean;
            }
            padded[width..].fill(0.0);
            let out = &mut out.as_flattened_mut()[..bins];
            let done = forward.process_with_scratch(padded, out, scratch);
            debug_assert!(done.is_ok(), "buffers are of the planned lengths");
        }
        let mut band = Vec::with_capacity(local.len());
        for block in 0..blocks {
            band.extend(local[block..].iter().step_by(blocks));
        }
        band
    };
    bands.map_init(buffers, band).collect()
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
        let band = &of.bands[dy / BAND];
        let rows = band.len() / bins.len().div_ceil(BLOCK);
        let blocks = band[dy % BAND..].iter().step_by(rows);
        for (to, block) in bins.chunks_mut(BLOCK).zip(blocks) {
            to.copy_from_slice(&block[..to.len()]);
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
