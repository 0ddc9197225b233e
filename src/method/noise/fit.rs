//! [`fit`]: what of a photo becomes a procedural texture.

use rayon::prelude::*;

use crate::base::ctx::Ctx;
use crate::base::error::{Error, Result};
use crate::method::noise::document::{BandShape, Channel, MOST_LEVEL, Term};
use crate::method::noise::shape::{KNOTS, Shape};
use crate::signal::normal;
use crate::signal::power::power_spectrum;
use crate::signal::symmetric::eigen;
use crate::signal::wavelet_noise::LOWER_END;
use crate::signal::wavelet_noise::spectrum::{expected, signs};

/// Steps of progress that [`fit`] counts, but for one for each channel.
pub const STEPS: u64 = 2;

/// A channel whose variance is below this share of all is rounding error.
const LEAST_SHARE: f64 = 1e-7;

/// How channels are fitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Options {
    /// The shape of bands in the spectrum.
    pub shape: BandShape,
    /// Weights by the paper's formula, section 4.2, equation 9: as if no band leaked into others.
    pub direct: bool,
    /// Whether the channels' histograms are kept; else they become normal distributions.
    pub histogram: bool,
}

/// What was measured of all planes together.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// Mean of every plane.
    pub mean: Vec<f64>,
    /// What each independent channel adds to each plane: a row for each plane.
    pub matrix: Vec<Vec<f64>>,
    /// The independent channels, the strongest first.
    pub channels: Vec<Channel>,
}

/// Planes of one size, and where they are usable.
#[derive(Debug, Clone, Copy)]
pub struct Exemplar<'a> {
    /// Samples with full scale 1.
    pub planes: &'a [Vec<f32>],
    /// Rows and columns.
    pub shape: (usize, usize),
    /// Usable samples; `None` is all.
    pub usable: Option<&'a [bool]>,
}

/// Number of bands that a photo of this shape tells something about: of the coarsest, at least one wave
/// fits in.
pub fn levels((rows, cols): (usize, usize)) -> u32 {
    (rows.min(cols).ilog2() - 1).min(MOST_LEVEL + 1)
}

/// Fits isotropic wavelet noise to all planes together (sections 4 to 7).
///
/// The result depends on the planes alone. The last bits of the Fourier transforms, which may differ
/// between CPUs, are rounded away when the document is made.
///
/// # Errors
/// [`Error::BadPicture`] if all planes are constant; [`Error::Cancelled`].
pub fn fit(ctx: &Ctx, exemplar: &Exemplar, options: Options) -> Result<Fit> {
    let mean = means(exemplar);
    let axes = eigen(&covariance(exemplar, &mean));
    ctx.step(1)?;
    let total: f64 = axes.iter().map(|(variance, _)| variance.max(0.0)).sum();
    // Half a step of 16 bits is no texture.
    if total < 1e-10 {
        return Err(Error::BadPicture {
            what: "the photo".into(),
            reason:
                "has one colour only, there is no texture in it; choose another photo, or mask \
                     less of it out"
                    .into(),
        });
    }
    let chosen: Vec<_> = axes.iter().filter(|(v, _)| *v > LEAST_SHARE * total).collect();
    let levels = levels(exemplar.shape);
    // The paper's formula divides the spectrum as the paper does.
    let divided = if options.direct { BandShape::Square } else { options.shape };
    let bands = Bands::new(exemplar.shape, Division { shape: divided, levels }, options.shape);
    ctx.step(1)?;
    let channel = |(_, axis): &&(f64, Vec<f64>)| {
        let plane = along(exemplar, &mean, axis);
        let channel = fit_channel(plane, exemplar, &bands, options);
        ctx.step(1)?;
        Ok(channel)
    };
    let channels = chosen.iter().map(channel).collect::<Result<Vec<_>>>()?;
    let matrix =
        (0..mean.len()).map(|i| chosen.iter().map(|(_, axis)| axis[i]).collect()).collect();
    Ok(Fit { mean, matrix, channels })
}

/// Sums of `value` over the usable samples, in the same order for any number of threads.
fn sum(exemplar: &Exemplar, value: impl Fn(usize) -> f64 + Sync) -> f64 {
    let (_, cols) = exemplar.shape;
    let rows: Vec<f64> = (0..exemplar.shape.0)
        .into_par_iter()
        .map(|y| {
            let row = y * cols..(y + 1) * cols;
            row.filter(|&i| exemplar.usable.is_none_or(|u| u[i])).map(&value).sum()
        })
        .collect();
    rows.iter().sum()
}

fn means(exemplar: &Exemplar) -> Vec<f64> {
    let count = sum(exemplar, |_| 1.0);
    exemplar.planes.iter().map(|plane| sum(exemplar, |i| f64::from(plane[i])) / count).collect()
}

fn covariance(exemplar: &Exemplar, mean: &[f64]) -> Vec<Vec<f64>> {
    let count = sum(exemplar, |_| 1.0);
    let n = mean.len();
    let mut matrix = vec![vec![0.0; n]; n];
    for i in 0..n {
        for j in i..n {
            let (a, b) = (&exemplar.planes[i], &exemplar.planes[j]);
            let product = |k: usize| (f64::from(a[k]) - mean[i]) * (f64::from(b[k]) - mean[j]);
            matrix[i][j] = sum(exemplar, product) / count;
            matrix[j][i] = matrix[i][j];
        }
    }
    matrix
}

/// The planes along an axis of colours: of unusable samples 0, the mean.
fn along(exemplar: &Exemplar, mean: &[f64], axis: &[f64]) -> Vec<f32> {
    let (rows, cols) = exemplar.shape;
    let mut out = vec![0.0; rows * cols];
    out.par_chunks_mut(cols).enumerate().for_each(|(y, line)| {
        for (x, out) in line.iter_mut().enumerate() {
            let i = y * cols + x;
            if exemplar.usable.is_none_or(|u| u[i]) {
                let parts = exemplar.planes.iter().zip(mean).zip(axis);
                *out = parts.map(|((p, m), a)| (f64::from(p[i]) - m) * a).sum::<f64>() as f32;
            }
        }
    });
    out
}

/// The bands of a photo: what each sees of noise, and where it lies in the spectrum.
struct Bands {
    shape: (usize, usize),
    division: Division,
    /// Power that band b (row) sees of noise with unit weight in level j (column).
    leakage: Vec<Vec<f64>>,
}

/// How a spectrum is divided into octaves.
#[derive(Clone, Copy)]
struct Division {
    shape: BandShape,
    levels: u32,
}

impl Division {
    /// The octave of a frequency in cycles a pixel: the finest also has all above, the coarsest all below.
    fn band(self, fx: f64, fy: f64) -> usize {
        // Where the noise's own bands have half their power; or the paper's, equation 10.
        let (f, end) = match self.shape {
            BandShape::Round => ((fx * fx + fy * fy).sqrt(), LOWER_END),
            BandShape::Square => (fx.max(fy), 0.25),
        };
        let mut lower = end;
        let mut band = 0;
        while f < lower && band + 1 < self.levels {
            (lower, band) = (lower / 2.0, band + 1);
        }
        band as usize
    }
}

impl Bands {
    fn new(shape: (usize, usize), division: Division, noise: BandShape) -> Self {
        let (rows, cols) = shape;
        let levels = division.levels as usize;
        let of_level = |j: usize| {
            let Term { detail, levels: at } = noise.term(j as u32);
            let mut sums = vec![0.0; levels];
            let power = expected(detail, at, shape);
            for (r, line) in power.chunks(cols / 2 + 1).enumerate() {
                for (q, power) in line.iter().enumerate() {
                    // The mean is taken out.
                    if r + q > 0 {
                        let (fx, fy) = (q as f64 / cols as f64, r as f64 / rows as f64);
                        sums[division.band(fx, fy)] += power * signs(q, cols) * signs(r, rows);
                    }
                }
            }
            sums
        };
        let columns: Vec<_> = (0..levels).into_par_iter().map(of_level).collect();
        let row = |b: usize| columns.iter().map(|column| column[b]).collect();
        Self { shape, division, leakage: (0..levels).map(row).collect() }
    }

    /// The power of a plane in every band.
    fn powers(&self, plane: &[f32]) -> Vec<f64> {
        let (rows, cols) = self.shape;
        let power = power_spectrum(plane, self.shape);
        // A row's share, then all rows in order.
        let lines: Vec<Vec<f64>> = power
            .par_chunks(cols)
            .enumerate()
            .map(|(r, line)| {
                let fy = r.min(rows - r) as f64 / rows as f64;
                let mut sums = vec![0.0; self.leakage.len()];
                for (q, power) in line.iter().enumerate() {
                    sums[self.division.band(q.min(cols - q) as f64 / cols as f64, fy)] += power;
                }
                sums
            })
            .collect();
        (0..self.leakage.len()).map(|b| lines.iter().map(|l| l[b]).sum()).collect()
    }
}

/// Bands, histogram and weights of one independent channel.
fn fit_channel(
    mut plane: Vec<f32>,
    exemplar: &Exemplar,
    bands: &Bands,
    options: Options,
) -> Channel {
    let usable = exemplar.usable.map_or(plane.len(), |u| u.iter().filter(|u| **u).count());
    let variance = sum(exemplar, |i| f64::from(plane[i]).powi(2)) / usable as f64;
    let histogram = options.histogram.then(|| gaussianise(&mut plane, exemplar, variance));
    // What is masked out is the mean, and has no power.
    let gain = plane.len() as f64 / usable as f64;
    let powers: Vec<f64> = bands.powers(&plane).into_iter().map(|p| p * gain).collect();
    let squares = if options.direct { powers } else { least_squares(&bands.leakage, &powers) };
    Channel { weights: squares.into_iter().map(f64::sqrt).collect(), histogram }
}

/// Levels of a plane's histogram.
const STEPS_OF_VALUE: usize = 1 << 16;

/// Replaces the samples by normally distributed ones of the same order and variance; returns the
/// histogram's values at the knots, with exactly the samples' mean (0) and `variance`.
fn gaussianise(plane: &mut [f32], exemplar: &Exemplar, variance: f64) -> Vec<f64> {
    let usable = |i: usize| exemplar.usable.is_none_or(|u| u[i]);
    let values = || plane.iter().enumerate().filter(|(i, _)| usable(*i)).map(|(_, v)| *v);
    let (least, most) = values().fold((f32::MAX, f32::MIN), |(a, b), v| (a.min(v), b.max(v)));
    let per_step = (STEPS_OF_VALUE - 1) as f64 / f64::from(most - least).max(f64::MIN_POSITIVE);
    let step = |v: f32| (f64::from(v - least) * per_step).round() as usize;
    let (mut counts, mut sums) = (vec![0u32; STEPS_OF_VALUE], vec![0.0f64; STEPS_OF_VALUE]);
    for v in values() {
        counts[step(v)] += 1;
        sums[step(v)] += f64::from(v);
    }
    let total = f64::from(counts.iter().sum::<u32>());
    let deviation = variance.sqrt();
    // Equal samples share the middle of their ranks.
    let mut below = 0.0;
    let normals: Vec<f32> = counts
        .iter()
        .map(|&count| {
            let rank = below + 0.5 * f64::from(count);
            below += f64::from(count);
            if count == 0 { 0.0 } else { (normal::quantile(rank / total) * deviation) as f32 }
        })
        .collect();
    let histogram = knots(&counts, &sums, variance);
    for (i, v) in plane.iter_mut().enumerate() {
        if usable(i) {
            *v = normals[step(*v)];
        }
    }
    histogram
}

/// Values at the knots: the mean of the samples whose ranks lie around each, then moved and stretched so
/// that mean and variance are right.
fn knots(counts: &[u32], sums: &[f64], variance: f64) -> Vec<f64> {
    let total = f64::from(counts.iter().sum::<u32>());
    // From half-way to the knot before to half-way to the one after, weighted towards the knot alone:
    // a narrow window where the distribution is dense, a wide one in the tails.
    let window = |i: usize| {
        let u = KNOTS[i];
        let half = |j: usize| 0.15 * (KNOTS[j] - u).abs();
        let from = if i == 0 { 0.0 } else { normal::cumulative(u - half(i - 1)) };
        let to = if i + 1 == KNOTS.len() { 1.0 } else { normal::cumulative(u + half(i + 1)) };
        (from * total, to * total)
    };
    let mut values: [f64; KNOTS.len()] = std::array::from_fn(|i| {
        let (from, to) = window(i);
        let (mut below, mut sum) = (0.0, 0.0);
        for (&count, &value) in counts.iter().zip(sums).filter(|(c, _)| **c > 0) {
            let count = f64::from(count);
            let inside = (to.min(below + count) - from.max(below)).max(0.0);
            sum += inside * value / count;
            below += count;
        }
        sum / (to - from)
    });
    for i in 1..values.len() {
        values[i] = values[i].max(values[i - 1]);
    }
    let (mean, got) = Shape::new(&values).moments();
    let gain = if got > 0.0 { (variance / got).sqrt() } else { 1.0 };
    values.iter().map(|v| (v - mean) * gain).collect()
}

/// The non-negative x for which `matrix` x comes nearest to `target`, counted in shares of `target`: by
/// coordinate descent, which ends at the least for so few unknowns.
pub(super) fn least_squares(matrix: &[Vec<f64>], target: &[f64]) -> Vec<f64> {
    let most = target.iter().copied().fold(0.0, f64::max);
    // A band without power must not outweigh all others.
    let weights: Vec<f64> = target.iter().map(|t| 1.0 / t.max(1e-6 * most).max(1e-30)).collect();
    let n = matrix.first().map_or(0, Vec::len);
    let scaled: Vec<Vec<f64>> =
        matrix.iter().zip(&weights).map(|(row, w)| row.iter().map(|a| a * w).collect()).collect();
    let mut left: Vec<f64> = target.iter().zip(&weights).map(|(t, w)| t * w).collect();
    let mut x = vec![0.0; n];
    for _ in 0..SWEEPS {
        for j in 0..n {
            let square: f64 = scaled.iter().map(|row| row[j] * row[j]).sum();
            if square <= 0.0 {
                continue;
            }
            let slope: f64 = scaled.iter().zip(&left).map(|(row, l)| row[j] * l).sum();
            let to = (x[j] + slope / square).max(0.0);
            let by = to - x[j];
            x[j] = to;
            left.iter_mut().zip(&scaled).for_each(|(l, row)| *l -= by * row[j]);
        }
    }
    x
}

const SWEEPS: usize = 2000;
