//! [`fit`]: what of a photo becomes a procedural texture.

use rayon::prelude::*;

use crate::base::ctx::Ctx;
use crate::base::error::{Error, Result};
use crate::method::noise::document::{BandShape, Channel, MOST_LEVEL, Term};
use crate::method::noise::shape::{KNOTS, Shape};
use crate::signal::normal;
use crate::signal::power::{power_spectrum, transform_even};
use crate::signal::symmetric::eigen;
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

impl Exemplar<'_> {
    /// Whether sample `i` is usable.
    fn counts(&self, i: usize) -> bool {
        self.usable.is_none_or(|usable| usable[i])
    }
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
    let bands = Bands::new(exemplar.shape, options.shape);
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
            row.filter(|&i| exemplar.counts(i)).map(&value).sum()
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
            if exemplar.counts(i) {
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
    /// Power that band b (row) sees of noise with unit weight in level j (column).
    leakage: Vec<Vec<f64>>,
}

/// The octave of a frequency in cycles a pixel (the paper's equation 10): of `levels`, the finest also has
/// all above, the coarsest all below.
fn octave(fx: f64, fy: f64, levels: usize) -> usize {
    let f = fx.max(fy);
    let mut lower = 0.25;
    let mut octave = 0;
    while f < lower && octave + 1 < levels {
        (lower, octave) = (lower / 2.0, octave + 1);
    }
    octave
}

impl Bands {
    fn new(shape: (usize, usize), noise: BandShape) -> Self {
        let (rows, cols) = shape;
        let levels = levels(shape) as usize;
        let of_level = |j: usize| {
            let Term { detail, levels: at } = noise.term(j as u32);
            let mut sums = vec![0.0; levels];
            let power = expected(detail, at, shape);
            for (r, line) in power.chunks(cols / 2 + 1).enumerate() {
                for (q, power) in line.iter().enumerate() {
                    // The mean is taken out.
                    if r + q > 0 {
                        let (fx, fy) = (q as f64 / cols as f64, r as f64 / rows as f64);
                        sums[octave(fx, fy, levels)] += power * signs(q, cols) * signs(r, rows);
                    }
                }
            }
            sums
        };
        let columns: Vec<_> = (0..levels).into_par_iter().map(of_level).collect();
        let row = |b: usize| columns.iter().map(|column| column[b]).collect();
        Self { shape, leakage: (0..levels).map(row).collect() }
    }

    /// The power of a spectrum in every band.
    fn powers(&self, power: &[f64]) -> Vec<f64> {
        let (rows, cols) = self.shape;
        let levels = self.leakage.len();
        // A row's share, then all rows in order.
        let lines: Vec<Vec<f64>> = power
            .par_chunks(cols)
            .enumerate()
            .map(|(r, line)| {
                let fy = r.min(rows - r) as f64 / rows as f64;
                let mut sums = vec![0.0; levels];
                for (q, power) in line.iter().enumerate() {
                    let fx = q.min(cols - q) as f64 / cols as f64;
                    sums[octave(fx, fy, levels)] += power;
                }
                sums
            })
            .collect();
        let sum = |b: usize| lines.iter().map(|l| l[b]).sum::<f64>();
        // Of a spectrum that was computed powers may be a little below nothing.
        (0..levels).map(|b| sum(b).max(0.0)).collect()
    }
}

/// Histogram and weights of one independent channel.
fn fit_channel(
    mut plane: Vec<f32>,
    exemplar: &Exemplar,
    bands: &Bands,
    options: Options,
) -> Channel {
    let usable = exemplar.usable.map_or(plane.len(), |u| u.iter().filter(|u| **u).count());
    let variance = sum(exemplar, |i| f64::from(plane[i]).powi(2)) / usable as f64;
    let ranks = options.histogram.then(|| Ranks::new(&plane, exemplar, variance));
    if let Some(ranks) = ranks.as_ref().filter(|_| options.direct) {
        ranks.gaussianise(&mut plane, exemplar);
    }
    // What is masked out is the mean, and has no power.
    let gain = plane.len() as f64 / usable as f64;
    let mut power = power_spectrum(&plane, exemplar.shape);
    power.iter_mut().for_each(|p| *p *= gain);
    if let Some(ranks) = ranks.as_ref().filter(|_| !options.direct) {
        power = before_shape(&ranks.shape(), &power, exemplar.shape);
    }
    let powers = bands.powers(&power);
    let squares = if options.direct { powers } else { least_squares(&bands.leakage, &powers) };
    let weights = squares.into_iter().map(f64::sqrt).collect();
    Channel { weights, histogram: ranks.map(|ranks| ranks.knots.to_vec()) }
}

/// The spectrum that noise must have for its values to have the spectrum `power` once `shape` has brought
/// them into the photo's histogram: shaping moves power between octaves.
///
/// If two normal numbers have correlation r, their shaped values have the correlation
/// sum of `c_k`^2 r^k, where `c_k` are the shape's coefficients in normalised Hermite polynomials. That is
/// inverted at every displacement.
fn before_shape(shape: &Shape, power: &[f64], size: (usize, usize)) -> Vec<f64> {
    const STEPS: usize = 2000;
    let squares = shape.hermite_squares();
    let total: f64 = squares.iter().sum();
    let shaped = |r: f64| squares.iter().rev().fold(0.0, |sum, c| (sum + c / total) * r);
    // Both are in -1..=1; where the shape cannot make so strong an opposite, -1.
    let table: Vec<f64> =
        (0..=STEPS).map(|i| shaped(2.0 * i as f64 / STEPS as f64 - 1.0)).collect();
    let unshaped = |s: f64| {
        let above = table.partition_point(|&t| t < s).clamp(1, STEPS);
        let (low, high) = (table[above - 1], table[above]);
        let part = if high > low { ((s - low) / (high - low)).clamp(0.0, 1.0) } else { 0.0 };
        2.0 * ((above - 1) as f64 + part) / STEPS as f64 - 1.0
    };
    let mut correlation = transform_even(power, size);
    let variance = correlation[0];
    if variance <= 0.0 {
        return power.to_vec();
    }
    correlation.par_iter_mut().for_each(|c| *c = unshaped(*c / variance));
    let scale = variance / power.len() as f64;
    transform_even(&correlation, size).iter().map(|p| p * scale).collect()
}

/// Levels of a plane's histogram.
const STEPS_OF_VALUE: usize = 1 << 16;

/// A plane's histogram.
struct Ranks {
    least: f32,
    per_step: f64,
    /// For every step of value, a normally distributed number of the same rank and the plane's variance.
    normals: Vec<f32>,
    /// The histogram's values at the knots, of mean 0 and exactly the plane's variance.
    knots: [f64; KNOTS.len()],
}

impl Ranks {
    fn new(plane: &[f32], exemplar: &Exemplar, variance: f64) -> Self {
        let values =
            || plane.iter().enumerate().filter(|(i, _)| exemplar.counts(*i)).map(|(_, v)| *v);
        let (least, most) = values().fold((f32::MAX, f32::MIN), |(a, b), v| (a.min(v), b.max(v)));
        let per_step = (STEPS_OF_VALUE - 1) as f64 / f64::from(most - least).max(f64::MIN_POSITIVE);
        let mut ranks = Self { least, per_step, normals: Vec::new(), knots: [0.0; KNOTS.len()] };
        let (mut counts, mut sums) = (vec![0u32; STEPS_OF_VALUE], vec![0.0f64; STEPS_OF_VALUE]);
        for v in values() {
            counts[ranks.step(v)] += 1;
            sums[ranks.step(v)] += f64::from(v);
        }
        ranks.knots = knots(&counts, &sums, variance);
        let total = f64::from(counts.iter().sum::<u32>());
        let deviation = variance.sqrt();
        // Equal samples share the middle of their ranks.
        let mut below = 0.0;
        let normal = |&count: &u32| {
            let rank = below + 0.5 * f64::from(count);
            below += f64::from(count);
            if count == 0 { 0.0 } else { (normal::quantile(rank / total) * deviation) as f32 }
        };
        ranks.normals = counts.iter().map(normal).collect();
        ranks
    }

    fn step(&self, value: f32) -> usize {
        (f64::from(value - self.least) * self.per_step).round() as usize
    }

    fn shape(&self) -> Shape {
        Shape::new(&self.knots)
    }

    /// Replaces the samples by normally distributed ones (section 5).
    fn gaussianise(&self, plane: &mut [f32], exemplar: &Exemplar) {
        for (_, v) in plane.iter_mut().enumerate().filter(|(i, _)| exemplar.counts(*i)) {
            *v = self.normals[self.step(*v)];
        }
    }
}

/// Values at the knots: the mean of the samples whose ranks lie around each, then moved and stretched so
/// that mean and variance are right.
fn knots(counts: &[u32], sums: &[f64], variance: f64) -> [f64; KNOTS.len()] {
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
    values.map(|v| (v - mean) * gain)
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
