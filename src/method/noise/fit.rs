//! [`fit`]: what of a photo becomes a procedural texture.

use rayon::prelude::*;

use crate::base::ctx::Ctx;
use crate::base::error::{Error, Result};
use crate::method::noise::document::{BandShape, Channel, MOST_LEVEL, Term};
use crate::method::noise::ranks::Ranks;
use crate::method::noise::score::Structure;
use crate::method::noise::shape::Shape;
use crate::signal::power::{power_spectrum, transform_even};
use crate::signal::symmetric::eigen;
use crate::signal::wavelet_noise::spectrum::{expected, octave, signs};

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
    pub(super) fn counts(&self, i: usize) -> bool {
        self.usable.is_none_or(|usable| usable[i])
    }
}

/// Number of bands that a photo of this shape tells something about: of the coarsest, at least one wave
/// fits in.
pub fn levels((rows, cols): (usize, usize)) -> u32 {
    (rows.min(cols).ilog2() - 1).min(MOST_LEVEL + 1)
}

/// What the analysis of planes has in common, whatever noise is fitted to it.
#[derive(Debug)]
pub struct Analysis {
    mean: Vec<f64>,
    /// Unit vectors of the independent channels.
    axes: Vec<Vec<f64>>,
    /// Of every independent channel.
    pub(super) spectra: Vec<Spectrum>,
    /// What noise cannot hold of the strongest.
    pub structure: Structure,
}

/// The spectrum that a channel's noise shall have.
#[derive(Debug)]
pub(super) struct Spectrum {
    variance: f64,
    /// Power at every frequency of the transform.
    pub(super) power: Vec<f64>,
    /// The histogram's values at the knots.
    pub(super) histogram: Option<Vec<f64>>,
    /// What noise cannot hold of it; measured of the strongest channel alone.
    structure: Option<Structure>,
}

impl Analysis {
    /// The fit with these channels.
    pub(super) fn with_channels(&self, channels: Vec<Channel>) -> Fit {
        let row = |i: usize| self.axes.iter().map(|axis| axis[i]).collect();
        let matrix = (0..self.mean.len()).map(row).collect();
        Fit { mean: self.mean.clone(), matrix, channels }
    }

    /// Standard deviation and histogram of every independent channel.
    pub(super) fn channels(&self) -> impl Iterator<Item = (f64, Option<&Vec<f64>>)> {
        self.spectra.iter().map(|s| (s.variance.sqrt(), s.histogram.as_ref()))
    }

    /// The independent channels of the exemplar that was analysed.
    pub(super) fn planes(&self, exemplar: &Exemplar) -> Vec<Vec<f32>> {
        self.axes.iter().map(|axis| along(exemplar, &self.mean, axis)).collect()
    }
}

/// Independent channels and their spectra (sections 5 and 6); a step of progress to a plane and one more.
///
/// # Errors
/// [`Error::BadPicture`] if all planes are constant; [`Error::Cancelled`].
pub fn analyse(ctx: &Ctx, exemplar: &Exemplar, options: Options) -> Result<Analysis> {
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
    let chosen = axes.into_iter().filter(|(variance, _)| *variance > LEAST_SHARE * total);
    let axes: Vec<Vec<f64>> = chosen.map(|(_, axis)| axis).collect();
    let spectrum = |(k, axis): (usize, &Vec<f64>)| {
        let spectrum = spectrum(&along(exemplar, &mean, axis), exemplar, options, k == 0);
        ctx.step(1)?;
        Ok(spectrum)
    };
    let spectra = axes.iter().enumerate().map(spectrum).collect::<Result<Vec<_>>>()?;
    let structure = spectra[0].structure.unwrap_or(Structure::NONE);
    Ok(Analysis { mean, axes, spectra, structure })
}

/// Fits isotropic wavelet noise to all planes together (section 4).
///
/// The result depends on the planes alone. The last bits of the Fourier transforms, which may differ
/// between CPUs, are rounded away when the document is made.
pub fn fit(analysis: &Analysis, shape: (usize, usize), options: Options) -> Fit {
    let bands = Bands::new(shape, options.shape);
    let channel = |spectrum: &Spectrum| {
        let powers = bands.powers(&spectrum.power);
        let squares =
            if options.direct { powers } else { least_squares(&bands.leakage, &powers, 0.0) };
        let weights = squares.into_iter().map(f64::sqrt).collect();
        Channel { weights, histogram: spectrum.histogram.clone() }
    };
    analysis.with_channels(analysis.spectra.iter().map(channel).collect())
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
                    // The paper's octaves, equation 10. The mean is taken out.
                    if r + q > 0 {
                        let (fx, fy) = (q as f64 / cols as f64, r as f64 / rows as f64);
                        sums[octave(fx.max(fy), levels)] += power * signs(q, cols) * signs(r, rows);
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
                    sums[octave(fx.max(fy), levels)] += power;
                }
                sums
            })
            .collect();
        let sum = |b: usize| lines.iter().map(|l| l[b]).sum::<f64>();
        // Of a spectrum that was computed powers may be a little below nothing.
        (0..levels).map(|b| sum(b).max(0.0)).collect()
    }
}

/// Histogram and spectrum of one independent channel, and on demand what noise cannot hold of it.
fn spectrum(
    plane: &[f32],
    exemplar: &Exemplar,
    options: Options,
    with_structure: bool,
) -> Spectrum {
    let usable = exemplar.usable.map_or(plane.len(), |u| u.iter().filter(|u| **u).count());
    let variance = sum(exemplar, |i| f64::from(plane[i]).powi(2)) / usable as f64;
    // What is masked out is the mean, and has no power.
    let gain = plane.len() as f64 / usable as f64;
    let power = |plane: &[f32]| {
        let mut power = power_spectrum(plane, exemplar.shape);
        power.iter_mut().for_each(|p| *p *= gain);
        power
    };
    let (ranks, plain) = rayon::join(
        || Ranks::new(plane, exemplar, variance),
        || (!(options.direct && options.histogram)).then(|| power(plane)),
    );
    let normal = (with_structure || options.direct).then(|| ranks.gaussianised(plane, exemplar));
    let power = match (&normal, plain) {
        (_, Some(plain)) if options.direct || !options.histogram => plain,
        (_, Some(plain)) => before_shape(&Shape::new(&ranks.knots), &plain, exemplar.shape),
        (normal, None) => power(normal.as_deref().unwrap_or(plane)),
    };
    let structure = normal
        .filter(|_| with_structure)
        .map(|normal| Structure::of(&normal, exemplar.shape, &power));
    let histogram = options.histogram.then(|| ranks.knots.to_vec());
    Spectrum { variance, power, histogram, structure }
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
    let variance: f64 = power.iter().sum();
    if variance <= 0.0 {
        return power.to_vec();
    }
    let correlation = transform_even(power, size, |c| unshaped(c / variance));
    let scale = variance / power.len() as f64;
    transform_even(&correlation, size, |p| p * scale)
}

/// The non-negative x for which `matrix` x comes nearest to `target`, counted in shares of `target` (but
/// of `least` times the largest at least): by coordinate descent, which ends at the least for so few
/// unknowns.
pub(super) fn least_squares(matrix: &[Vec<f64>], target: &[f64], least: f64) -> Vec<f64> {
    let most = target.iter().copied().fold(0.0, f64::max);
    // A band without power must not outweigh all others.
    let weights: Vec<f64> =
        target.iter().map(|t| 1.0 / t.max(least.max(1e-6) * most).max(1e-30)).collect();
    let n = matrix.first().map_or(0, Vec::len);
    let column =
        |j: usize| -> Vec<f64> { matrix.iter().zip(&weights).map(|(row, w)| row[j] * w).collect() };
    let columns: Vec<Vec<f64>> = (0..n).map(column).collect();
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let products: Vec<Vec<f64>> =
        columns.iter().map(|a| columns.iter().map(|b| dot(a, b)).collect()).collect();
    let scaled: Vec<f64> = target.iter().zip(&weights).map(|(t, w)| t * w).collect();
    // How fast half the squared error falls with each unknown.
    let mut slopes: Vec<f64> = columns.iter().map(|column| dot(column, &scaled)).collect();
    let mut x = vec![0.0; n];
    for _ in 0..SWEEPS {
        let mut moved = false;
        for j in 0..n {
            let square = products[j][j];
            if square <= 0.0 {
                continue;
            }
            let to = (x[j] + slopes[j] / square).max(0.0);
            let by = to - x[j];
            if by != 0.0 {
                moved = true;
                x[j] = to;
                slopes.iter_mut().zip(&products[j]).for_each(|(slope, p)| *slope -= by * p);
            }
        }
        if !moved {
            break;
        }
    }
    x
}

const SWEEPS: usize = 2000;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::method::noise::{
        Document, Evaluator, Filter, MapSpec, Model, Score, oriented, raster,
    };

    /// A grey photo of the noise of a model.
    fn photo(model: Model, (rows, cols): (usize, usize)) -> Vec<Vec<f32>> {
        let map = MapSpec {
            name: "basecolor".into(),
            kind: "color".into(),
            encoding: "linear".into(),
            channels: 1,
        };
        let score = Score { fit: 1.0, recommended: "wavelet".into() };
        let document = Document::new(
            5,
            [cols as u32, rows as u32],
            vec![map],
            vec![0.3],
            vec![vec![1.0]],
            model,
            score,
        );
        let ctx = Ctx::new(0, 1).expect("a context");
        let view =
            raster::View { size: (rows, cols), scale: 1.0, origin: [77.0, 5.0], tileable: false };
        let evaluator = Evaluator::new(document);
        vec![raster::render(&ctx, &evaluator, &view, 0..rows, Filter::NONE).expect("a picture")]
    }

    fn analysed(planes: &[Vec<f32>], shape: (usize, usize), options: Options) -> Analysis {
        let ctx = Ctx::new(0, 1).expect("a context");
        let exemplar = Exemplar { planes, shape, usable: None };
        analyse(&ctx, &exemplar, options).expect("an analysis")
    }

    #[test]
    fn weights_of_noise_are_found_again() {
        // The paper's figure 5; the coarsest bands have few coefficients to tell their weight by.
        let weights = vec![0.03, 0.05, 0.01, 0.06, 0.04, 0.02, 0.05];
        let size = (300, 517);
        for shape in [BandShape::Round, BandShape::Square] {
            let channel = Channel { weights: weights.clone(), histogram: None };
            let planes = photo(Model::Wavelet { bands: shape, channels: vec![channel] }, size);
            let off = |direct: bool| {
                let options = Options { shape, direct, histogram: false };
                let found = fit(&analysed(&planes, size, options), size, options);
                assert!((found.mean[0] - 0.3).abs() < 0.02);
                let found = &found.channels[0].weights;
                let pairs = found.iter().zip(&weights).take(5);
                pairs.map(|(f, w)| (f / w).ln().abs()).fold(0.0, f64::max)
            };
            let (corrected, direct) = (off(false), off(true));
            assert!(corrected < 0.2, "{shape:?}: {corrected}");
            assert!(
                corrected < 0.5 * direct,
                "{shape:?}: {corrected}, {direct} by the paper's formula"
            );
        }
    }

    #[test]
    fn shaped_noise_has_the_spectrum_that_was_asked_for() {
        // Noise brought into a skewed histogram, fitted, and made again: octaves agree.
        let knots = crate::method::noise::KNOTS.map(|u| 0.1 * libm::exp(0.8 * u));
        let weights = vec![0.02, 0.05, 0.06, 0.03, 0.03, 0.03, 0.02];
        let size = (512, 512);
        let model = |weights, histogram| Model::Wavelet {
            bands: BandShape::Round,
            channels: vec![Channel { weights, histogram }],
        };
        let planes = photo(model(weights, Some(knots.to_vec())), size);
        let off = |direct: bool| {
            let options = Options { shape: BandShape::Round, direct, histogram: true };
            let found = fit(&analysed(&planes, size, options), size, options).channels.remove(0);
            let again = photo(model(found.weights, found.histogram), size);
            let bands = Bands::new(size, BandShape::Round);
            let powers = [&planes, &again].map(|p| bands.powers(&power_spectrum(&p[0], size)));
            let pairs = powers[0].iter().zip(&powers[1]).take(5);
            let decibels = pairs.map(|(a, b)| 10.0 * (a / b).log10().abs());
            decibels.sum::<f64>() / 5.0
        };
        let (corrected, direct) = (off(false), off(true));
        assert!(corrected < 0.4, "{corrected} dB");
        assert!(corrected < 0.5 * direct, "{corrected} dB, {direct} dB by the paper's formula");
    }

    #[test]
    fn grain_is_found_again() {
        use crate::method::noise::Band;
        use crate::signal::wavelet_noise::Part;
        let size = (256, 320);
        for angle in [0.0, 25.0, -60.0] {
            let band = |levels, parts| Band { levels, parts };
            let bands = vec![
                band([1, 4], [Part::Band, Part::Band]),
                band([2, 5], [Part::Band, Part::Band]),
            ];
            let channel = Channel { weights: vec![0.05, 0.08], histogram: None };
            let planes = photo(Model::Oriented { angle, bands, channels: vec![channel] }, size);
            let options = Options { shape: BandShape::Round, direct: false, histogram: false };
            let analysis = analysed(&planes, size, options);
            let structure = analysis.structure;
            assert!(structure.oriented_fit() > 3.0 * structure.isotropic_fit(), "{structure:?}");
            let found = oriented::fit(&analysis, size);
            assert!((found.angle - angle).abs() < 2.0, "{} for {angle}", found.angle);
            let weights = &found.fit.channels[0].weights;
            let of = |levels: [u32; 2]| -> f64 {
                let all = found.bands.iter().zip(weights);
                all.filter(|(b, _)| b.levels == levels).map(|(_, w)| *w).sum()
            };
            assert!((of([1, 4]) / 0.05 - 1.0).abs() < 0.25, "{angle}: {}", of([1, 4]));
            assert!((of([2, 5]) / 0.08 - 1.0).abs() < 0.25, "{angle}: {}", of([2, 5]));
        }
    }

    #[test]
    fn least_squares_are_least() {
        let matrix = vec![vec![1.0, 0.2, 0.0], vec![0.3, 1.0, 0.1], vec![0.0, 0.4, 1.0]];
        let x = least_squares(&matrix, &[1.4, 2.6, 3.8], 0.0);
        for (x, expected) in x.iter().zip([1.0, 2.0, 3.0]) {
            assert!((x - expected).abs() < 1e-9, "{x} for {expected}");
        }
        // Where the solution would be negative, it is 0 and the others make the best of it.
        let x = least_squares(&matrix, &[1.0, 0.1, 1.0], 0.0);
        assert!(x.iter().all(|x| *x >= 0.0) && x[1] == 0.0, "{x:?}");
    }
}
