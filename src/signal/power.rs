//! The power spectrum of a plane that does not repeat.

use rayon::prelude::*;
use realfft::RealFftPlanner;
use rustfft::FftPlanner;
use rustfft::num_complex::Complex;

/// Share of a line that the window fades over, both ends together.
const TAPER: f64 = 0.25;

/// Weights of a line's samples: a Tukey window. It takes away the edge that a transform would see where
/// opposite ends of a photo meet.
pub fn window(n: usize) -> Vec<f64> {
    let fade = TAPER * n as f64 / 2.0;
    (0..n)
        .map(|i| {
            let inwards = i.min(n - 1 - i) as f64 + 0.5;
            if inwards >= fade {
                1.0
            } else {
                0.5 - 0.5 * libm::cos(std::f64::consts::PI * inwards / fade)
            }
        })
        .collect()
}

/// Power of a plane of `(height, width)` samples at every frequency of its discrete Fourier transform,
/// row by row, frequency 0 first and set to nothing; the sum of all is the plane's variance. The plane is
/// weighted by [`window`] along both axes and its weighted mean taken out.
///
/// Deterministic for any number of threads; the last bits may differ between CPUs.
pub fn power_spectrum(plane: &[f32], (height, width): (usize, usize)) -> Vec<f64> {
    let (down, along) = (window(height), window(width));
    let total = |weights: &[f64]| weights.iter().sum::<f64>();
    let rows = plane.chunks_exact(width).zip(&down);
    let row = |(row, wy): (&[f32], &f64)| -> f64 {
        wy * row.iter().zip(&along).map(|(&v, wx)| f64::from(v) * wx).sum::<f64>()
    };
    let mean = rows.map(row).sum::<f64>() / (total(&down) * total(&along));
    let weighted = |i: usize| {
        let (y, x) = (i / width, i % width);
        (f64::from(plane[i]) - mean) * (along[x] * down[y])
    };
    let samples = (0..plane.len()).into_par_iter().map(weighted).collect();
    let spectrum = transform(samples, (height, width));
    let square = |weights: &[f64]| weights.iter().map(|w| w * w).sum::<f64>();
    let scale = 1.0 / (square(&down) * square(&along) * plane.len() as f64);
    let half: Vec<f64> = spectrum.par_iter().map(|v| v.norm_sqr() * scale).collect();
    let mut power = whole(&half, (height, width));
    power[0] = 0.0;
    power
}

/// The transform of real samples that are the same at opposite places (of a plane that goes round): real
/// again, of which `value` is taken. So the correlation at every displacement follows from a spectrum of
/// powers, and the other way round, but for a factor of the number of samples.
pub fn transform_even(
    samples: &[f64],
    shape: (usize, usize),
    value: impl Fn(f64) -> f64 + Sync,
) -> Vec<f64> {
    let spectrum = transform(samples.to_vec(), shape);
    let half: Vec<f64> = spectrum.par_iter().map(|v| value(v.re)).collect();
    whole(&half, shape)
}

/// What is the same at opposite places, of its left half and the middle: row by row `width / 2 + 1`.
fn whole(half: &[f64], (height, width): (usize, usize)) -> Vec<f64> {
    let columns = width / 2 + 1;
    let mut out = vec![0.0; height * width];
    out.par_chunks_mut(width).enumerate().for_each(|(y, line)| {
        let row = |y: usize| &half[y * columns..][..columns];
        let (left, right) = line.split_at_mut(columns);
        left.copy_from_slice(row(y));
        let opposite = &row((height - y) % height)[1..=right.len()];
        right.iter_mut().rev().zip(opposite).for_each(|(to, from)| *to = *from);
    });
    out
}

/// The discrete Fourier transform of real samples, unscaled: for every frequency of y, those of x from 0 to
/// `width / 2`.
fn transform(mut samples: Vec<f64>, (height, width): (usize, usize)) -> Vec<Complex<f64>> {
    let columns = width / 2 + 1;
    let plan = RealFftPlanner::<f64>::new().plan_fft_forward(width);
    let mut rows = vec![Complex::default(); height * columns];
    let lines = rows.par_chunks_mut(columns).zip(samples.par_chunks_mut(width));
    lines.for_each_init(
        || plan.make_scratch_vec(),
        |scratch, (to, from)| {
            // Fails only for slices of other lengths than the plan's.
            let done = plan.process_with_scratch(from, to, scratch);
            debug_assert!(done.is_ok(), "{done:?}");
        },
    );
    drop(samples);
    let mut turned = transposed(&rows, columns);
    drop(rows);
    let plan = FftPlanner::<f64>::new().plan_fft_forward(height);
    turned.par_chunks_mut(height).for_each_init(
        || vec![Complex::default(); plan.get_inplace_scratch_len()],
        |scratch, line| plan.process_with_scratch(line, scratch),
    );
    transposed(&turned, height)
}

/// A plane with lines of `length` turned into its columns.
fn transposed<T: Copy + Default + Send + Sync>(plane: &[T], length: usize) -> Vec<T> {
    const LINES: usize = 16;
    let lines = plane.len() / length;
    let mut out = vec![T::default(); plane.len()];
    out.par_chunks_mut(LINES * lines).enumerate().for_each(|(band, out)| {
        transposed_band(plane, length, band * LINES, out);
    });
    out
}

/// As many columns, from the `first` on, as `out` has room for as lines, of a plane with lines of
/// `length`.
pub(crate) fn transposed_band<T: Copy>(plane: &[T], length: usize, first: usize, out: &mut [T]) {
    let lines = plane.len() / length;
    for (line, from) in plane.chunks_exact(length).enumerate() {
        for (k, &v) in from[first..].iter().take(out.len() / lines).enumerate() {
            out[k * lines + line] = v;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_the_transform_of_the_weighted_plane() {
        for shape in [(12, 18), (5, 7), (1, 4), (4, 1)] {
            check(shape);
        }
    }

    fn check((h, w): (usize, usize)) {
        let plane: Vec<f32> = (0..h * w).map(|i| ((i * 37 + i / w * 11) % 17) as f32).collect();
        let (down, along) = (window(h), window(w));
        let weight = |i: usize| down[i / w] * along[i % w];
        let total: f64 = (0..h * w).map(weight).sum();
        let mean = (0..h * w).map(|i| weight(i) * f64::from(plane[i])).sum::<f64>() / total;
        let square: f64 = (0..h * w).map(|i| weight(i).powi(2)).sum();
        let got = power_spectrum(&plane, (h, w));
        assert_eq!(got[0], 0.0);
        for (i, &got) in got.iter().enumerate().skip(1) {
            let (r, q) = (i / w, i % w);
            let sum: Complex<f64> = (0..h * w)
                .map(|k| {
                    let turns = (q * (k % w)) as f64 / w as f64 + (r * (k / w)) as f64 / h as f64;
                    let value = weight(k) * (f64::from(plane[k]) - mean);
                    Complex::from_polar(value, -std::f64::consts::TAU * turns)
                })
                .sum();
            let expected = sum.norm_sqr() / (square * (h * w) as f64);
            assert!((got - expected).abs() < 1e-9, "{i}: {got} for {expected}");
        }
    }

    #[test]
    fn a_spectrum_and_its_correlation_are_transforms_of_each_other() {
        let (h, w) = (6, 9);
        let plane: Vec<f32> = (0..h * w).map(|i| ((i * 37) % 17) as f32).collect();
        let power = power_spectrum(&plane, (h, w));
        let correlation = transform_even(&power, (h, w), |v| v);
        // The variance at no displacement.
        assert!((correlation[0] - power.iter().sum::<f64>()).abs() < 1e-9);
        for (a, b) in power.iter().zip(transform_even(&correlation, (h, w), |v| v / (h * w) as f64))
        {
            assert!((a - b).abs() < 1e-9);
        }
    }

    #[test]
    fn a_ramp_has_no_power_at_high_frequencies() {
        let (h, w) = (64, 64);
        let plane: Vec<f32> = (0..h * w).map(|i| (i % w) as f32).collect();
        let power = power_spectrum(&plane, (h, w));
        let high: f64 = (16..48).map(|q| power[q]).sum();
        assert!(high < 1e-4 * power.iter().sum::<f64>(), "{high}");
    }
}
