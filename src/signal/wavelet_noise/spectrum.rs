//! What power spectrum to expect of a photo of noise.

use std::f64::consts::TAU;
use std::sync::OnceLock;

use rayon::prelude::*;

use super::detail::{Frequency, knot_transfer, spline_transfer};
use super::{Detail, Part, spline};
use crate::signal::power::window;

/// Power to expect at the frequencies of the Fourier transform of `(rows, cols)` pixels of noise with
/// unit variance, whose coefficients are `2^levels` pixels apart along x and y, as
/// [`power_spectrum`](crate::signal::power::power_spectrum) sees it through its window: row by row, the
/// first `rows / 2 + 1` frequencies of y by the first `cols / 2 + 1` of x. Frequencies below zero have the
/// same.
pub fn expected(detail: Detail, levels: [u32; 2], (rows, cols): (usize, usize)) -> Vec<f64> {
    let (across, down) =
        (Axis::new(detail, 0, levels[0], cols), Axis::new(detail, 1, levels[1], rows));
    let (width, scale) = (across.transfer.len(), unit(detail, rows * cols));
    let mut power = vec![0.0; width * down.transfer.len()];
    power.par_chunks_mut(width).zip(&down.transfer).for_each(|(line, y)| {
        unwindowed(detail, &across.transfer, y, scale, line);
        across.blur(line);
    });
    let mut columns = transposed(&power, across.transfer.len());
    columns.par_chunks_mut(down.transfer.len()).for_each(|line| down.blur(line));
    transposed(&columns, down.transfer.len())
}

/// The same at one frequency of y, before the window.
fn unwindowed(
    detail: Detail,
    across: &[(Frequency, f64)],
    (fy, ty): &(Frequency, f64),
    scale: f64,
    line: &mut [f64],
) {
    for (power, (fx, tx)) in line.iter_mut().zip(across) {
        let transfer = tx * ty * scale;
        // Where the spline leaves nothing the coefficients do not matter.
        if transfer > 1e-7 * scale {
            *power = transfer * detail.power([fx, fy]);
        }
    }
}

/// What brings the noise to unit variance, for each frequency of a transform of so many pixels.
fn unit(detail: Detail, pixels: usize) -> f64 {
    1.0 / (continuous(detail) * pixels as f64)
}

fn transposed(plane: &[f64], width: usize) -> Vec<f64> {
    let height = plane.len() / width;
    (0..plane.len()).map(|i| plane[i % height * width + i / height]).collect()
}

/// Frequencies along an axis.
struct Axis {
    /// For each of the transform: the frequency in cycles a coefficient, within -0.5..=0.5, and the
    /// power that pixels of the spline have of one of the coefficients.
    transfer: Vec<(Frequency, f64)>,
    n: usize,
    /// What share of the power the window moves by so many frequencies.
    moved: Vec<f64>,
}

impl Axis {
    /// Of `n` pixels along an axis (0: x).
    fn new(detail: Detail, axis: usize, level: u32, n: usize) -> Self {
        let spacing = 1usize << level;
        let cosine: Vec<f64> = (0..n).map(|k| libm::cos(TAU * k as f64 / n as f64)).collect();
        // The spline at pixels: symmetric, so its transform is a sum of cosines.
        let taps: Vec<f64> =
            (0..=3 * spacing / 2).map(|p| spline(p as f64 / spacing as f64)).collect();
        let transfer = (0..=n / 2)
            .map(|k| {
                let sides = taps.iter().enumerate().skip(1);
                let sum: f64 = sides.map(|(p, tap)| 2.0 * tap * cosine[p * k % n]).sum();
                let f = k as f64 * spacing as f64 / n as f64;
                (
                    detail.frequency(axis, f - f.round()),
                    (taps[0] + sum) * (taps[0] + sum) / spacing as f64,
                )
            })
            .collect();
        Self { transfer, n, moved: moved(n) }
    }

    /// What the window makes of the powers along this axis.
    fn blur(&self, line: &mut [f64]) {
        let reach = self.moved.len() - 1;
        // With the frequencies before the first and after the last, which are theirs mirrored.
        let at = |k: usize| line[k.min(self.n - k)];
        let sides = || (1..=reach).map(|m| m % self.n);
        let padded: Vec<f64> = (sides().rev().map(at))
            .chain(line.iter().copied())
            .chain(sides().map(|m| at((line.len() - 1 + m) % self.n)))
            .collect();
        for (k, power) in line.iter_mut().enumerate() {
            let (below, above) = (&padded[k..=k + reach], &padded[k + reach..=k + 2 * reach]);
            let both = below.iter().rev().zip(above).zip(&self.moved).skip(1);
            *power = self.moved[0] * above[0] + both.map(|((b, a), w)| w * (a + b)).sum::<f64>();
        }
    }
}

/// Beyond so many frequencies the window moves no power worth counting.
const REACH: usize = 8;

/// What share of a frequency's power the window of `n` samples moves by 0, 1, ... frequencies, to either
/// side.
fn moved(n: usize) -> Vec<f64> {
    let weights = window(n);
    let square: f64 = weights.iter().map(|w| w * w).sum();
    let share = |m: usize| {
        let angle = |x: usize| TAU * (x * m % n) as f64 / n as f64;
        let re: f64 = weights.iter().enumerate().map(|(x, w)| w * libm::cos(angle(x))).sum();
        let im: f64 = weights.iter().enumerate().map(|(x, w)| w * libm::sin(angle(x))).sum();
        (re * re + im * im) / (n as f64 * square)
    };
    (0..REACH.min(n.div_ceil(2))).map(share).collect()
}

/// Variance over all positions of the spline surface over coefficients of this detail.
fn continuous(detail: Detail) -> f64 {
    static KNOWN: [OnceLock<f64>; Detail::COUNT] = [const { OnceLock::new() }; Detail::COUNT];
    *KNOWN[detail.index()].get_or_init(|| measured_continuous(detail))
}

fn measured_continuous(detail: Detail) -> f64 {
    const N: usize = 128;
    // The spline's products with itself, as a function of frequency.
    let products =
        |f: f64| (66.0 + 52.0 * libm::cos(TAU * f) + 2.0 * libm::cos(2.0 * TAU * f)) / 120.0;
    let at = |i: usize| (i as f64 + 0.5) / N as f64 - 0.5;
    let axes = [0, 1].map(|axis| -> Vec<_> {
        (0..N).map(|i| (detail.frequency(axis, at(i)), products(at(i)))).collect()
    });
    let cell = |i: usize| {
        let [(fx, px), (fy, py)] = [&axes[0][i % N], &axes[1][i / N]];
        detail.power([fx, fy]) * px * py
    };
    (0..N * N).map(cell).sum::<f64>() / (N * N) as f64
}

/// From this level on, four pixels to a coefficient, [`at_pixels`] is taken to be the same.
pub const ALIKE: u32 = 2;

/// Variance, at the photo's pixels, of noise that has unit variance over all positions: the finest bands
/// are stronger at coefficients than between them.
pub fn at_pixels(detail: Detail, levels: [u32; 2]) -> f64 {
    const LEVELS: usize = ALIKE as usize + 1;
    static KNOWN: [[[OnceLock<f64>; LEVELS]; LEVELS]; Detail::COUNT] =
        [const { [const { [const { OnceLock::new() }; LEVELS] }; LEVELS] }; Detail::COUNT];
    let [x, y] = levels.map(|level| level.min(ALIKE));
    let known = &KNOWN[detail.index()][x as usize][y as usize];
    *known.get_or_init(|| measured_at_pixels(detail, [x, y]))
}

/// On one thread: others may be waiting.
fn measured_at_pixels(detail: Detail, levels: [u32; 2]) -> f64 {
    // So many coefficients tell all.
    const N: usize = 96;
    let [cols, rows] = levels.map(|level| N << level);
    let (across, down) =
        (Axis::new(detail, 0, levels[0], cols), Axis::new(detail, 1, levels[1], rows));
    // A part of the format: the analysis' window must not matter.
    let (width, scale) = (across.transfer.len(), unit(detail, rows * cols));
    let mut power = vec![0.0; width * down.transfer.len()];
    for (line, y) in power.chunks_exact_mut(width).zip(&down.transfer) {
        unwindowed(detail, &across.transfer, y, scale, line);
    }
    sum_both_signs(&power, (rows, cols), |_, _| true)
}

/// The octave of a frequency in cycles a pixel: 0 from a quarter on, 1 from an eighth on; the last of
/// `levels` has all below.
pub fn octave(f: f64, levels: usize) -> usize {
    let mut lower = 0.25;
    let mut octave = 0;
    while f < lower && octave + 1 < levels {
        (lower, octave) = (lower / 2.0, octave + 1);
    }
    octave
}

/// Power to expect, along one axis of `n` pixels, of noise with unit variance whose coefficients are
/// `2^level` pixels apart, in each of `levels` octaves, as seen through the window. `turned` is noise
/// whose axes are not the pixels'.
pub fn along_axis(part: Part, level: u32, levels: usize, turned: bool, n: usize) -> Vec<f64> {
    let spacing = f64::from(1u32 << level);
    let power = |k: usize| {
        let here = k as f64 / n as f64 * spacing;
        let transfer =
            if level == 0 && !turned { knot_transfer(here) } else { spline_transfer(here) };
        (part.amplitude((here - here.round()).abs()) * transfer).powi(2) * spacing / n as f64
    };
    let mut line: Vec<f64> = (0..=n / 2).map(power).collect();
    Axis { transfer: Vec::new(), n, moved: moved(n) }.blur(&mut line);
    let mut sums = vec![0.0; levels];
    for (k, power) in line.iter().enumerate() {
        sums[octave(k as f64 / n as f64, levels)] += power * signs(k, n);
    }
    let variance = continuous_axis(part);
    sums.iter().map(|sum| sum / variance).collect()
}

/// Variance over all positions of the spline over coefficients of this part on a line.
fn continuous_axis(part: Part) -> f64 {
    const N: usize = 4096;
    let products =
        |f: f64| (66.0 + 52.0 * libm::cos(TAU * f) + 2.0 * libm::cos(2.0 * TAU * f)) / 120.0;
    let at = |i: usize| (i as f64 + 0.5) / N as f64 - 0.5;
    (0..N).map(|i| part.amplitude(at(i).abs()).powi(2) * products(at(i))).sum::<f64>() / N as f64
}

/// How many frequencies of a transform of `n` samples the `k`th stands for: its negative one too.
pub fn signs(k: usize, n: usize) -> f64 {
    if k == 0 || 2 * k == n { 1.0 } else { 2.0 }
}

/// Sum of a spectrum, given as by [`expected`], over the frequencies (x, y; cycles a pixel) that `chosen`
/// takes, both signs of each.
fn sum_both_signs(
    power: &[f64],
    (rows, cols): (usize, usize),
    chosen: impl Fn(f64, f64) -> bool,
) -> f64 {
    let width = cols / 2 + 1;
    let entries = power.iter().enumerate().map(|(i, power)| {
        let (r, q) = (i / width, i % width);
        if chosen(q as f64 / cols as f64, r as f64 / rows as f64) {
            power * signs(q, cols) * signs(r, rows)
        } else {
            0.0
        }
    });
    entries.sum()
}

#[cfg(test)]
mod tests {
    use super::super::{Torus, hash};
    use super::*;
    use crate::signal::power::power_spectrum;

    #[test]
    fn it_is_the_spectrum_of_noise() {
        let ranges = [(0.0, 0.0625), (0.0625, 0.125), (0.125, 0.25), (0.25, 0.51)];
        for (detail, level) in [
            (Detail::Square, 0),
            (Detail::Square, 1),
            (Detail::Square, 2),
            (Detail::RoundFine, 0),
            (Detail::Round, 1),
            (Detail::Round, 2),
            (Detail::Axes([Part::Band, Part::Band]), 1),
            (Detail::Axes([Part::Low, Part::Fine]), 1),
        ] {
            // A piece that does not go round, of an odd number of columns.
            let (rows, cols) = (192usize, 201usize);
            let torus = Torus::new((256, 256), detail);
            let at = |i: usize| i as f64 / f64::from(1 << level);
            let plane: Vec<f32> =
                (0..rows * cols).map(|i| torus.at(at(i % cols), at(i / cols))).collect();
            let power = power_spectrum(&plane, (rows, cols));
            let all = expected(detail, [level; 2], (rows, cols));
            for (x0, x1) in ranges {
                for (y0, y1) in ranges {
                    let chosen = |fx: f64, fy: f64| fx >= x0 && fx < x1 && fy >= y0 && fy < y1;
                    let f = |k: usize, n: usize| k.min(n - k) as f64 / n as f64;
                    let inside = |i: &usize| chosen(f(i % cols, cols), f(i / cols, rows));
                    let measured: f64 = (0..rows * cols).filter(inside).map(|i| power[i]).sum();
                    let expected = sum_both_signs(&all, (rows, cols), chosen);
                    let off = (measured - expected).abs();
                    // One draw.
                    assert!(
                        off < 0.15 * expected + 0.004,
                        "{detail:?} {level} {x0} {y0}: {measured} for {expected}"
                    );
                }
            }
        }
    }

    #[test]
    fn variances_at_pixels_never_change() {
        // Documents made by older versions depend on them.
        let mut sum = 0;
        let parts = [Part::Low, Part::Band, Part::Fine];
        let axes = (0..9).map(|i| Detail::Axes([parts[i % 3], parts[i / 3]]));
        for detail in [Detail::Square, Detail::Round, Detail::RoundFine].into_iter().chain(axes) {
            for levels in [[0, 0], [0, 1], [0, 2], [1, 0], [1, 1], [2, 2], [9, 2]] {
                let bits = at_pixels(detail, levels).to_bits();
                sum = hash(hash(sum ^ bits as u32) ^ (bits >> 32) as u32);
            }
        }
        assert_eq!(sum, 873_516_221);
    }
}
