//! The texture cost by its definition, estimated: for a random sample of the texture's patches the
//! nearest of all the photo's is found by comparing with every one of them.

use rayon::prelude::*;

use crate::base::ctx::Ctx;
use crate::base::error::{Error, Result};
use crate::base::rng::Rng;
use crate::image::color::ColorModel;
use crate::image::mask::Mask;
use crate::image::picture::Picture;
use crate::image::sourcemap::SourceMap;
use crate::search::field::Pos;
use crate::search::patch::{CODE_MAX, Kernel, MatchImage, WithKernel, with_kernel};
use crate::search::patchmatch::Wrap;
use crate::search::source::Source;

/// Which patches are drawn.
#[derive(Debug, Clone, Copy)]
pub struct Sampling {
    /// Patch side, at most 21.
    pub patch: usize,
    /// How many of the texture's patches are drawn; all of them if there are no more.
    pub samples: usize,
    /// Which axes of the texture wrap. On one that does not, only whole patches count.
    pub wrap: Wrap,
}

/// A mean that was estimated from a sample.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// The estimate.
    pub mean: f64,
    /// Its standard error; 0 if nothing was left to chance.
    pub error: f64,
    /// How many patches were compared with all of the photo's.
    pub compared: usize,
}

/// Mean over the patches of `texture` of the squared L*a*b* distance, per pixel, to the nearest
/// usable patch of `photo`.
///
/// The distances to the patches that `map` names are known everywhere. Where one is 0, so is that to
/// the nearest patch, and nothing is drawn there; the others tell by regression whether the draw
/// was a cheap or an expensive one. The bias of that is of the order of 1 / samples.
///
/// # Paper
/// Moritz et al. 2017, eq. 5.
///
/// # Determinism
/// `ctx.seed` draws the patches; same bytes for any thread count and SIMD level.
///
/// # Cost
/// One inner product of patches for every drawn patch and every patch of the photo.
///
/// # Errors
/// [`Error::EmptyMask`], [`Error::Cancelled`].
pub fn mean_nearest(
    ctx: &Ctx,
    texture: &Picture,
    photo: &Picture,
    map: Option<&SourceMap>,
    mask: Option<&Mask>,
    sampling: Sampling,
) -> Result<Estimate> {
    let Sampling { patch, samples, wrap } = sampling;
    let model = ColorModel::new(photo);
    let colors = |picture: &Picture| {
        let pixels = model.matching_pixels(picture);
        Colors { pixels, height: picture.height(), width: picture.width() }
    };
    let photo = colors(photo);
    // The texture as a canvas that holds every patch whole.
    let canvas = colors(texture).extended(patch, wrap);
    let codes = Codes::covering([&photo, &canvas]);
    let source = Source::new(codes.encode(&photo), patch, mask.map(Mask::usable))
        .ok_or(Error::EmptyMask { usable: mask.map_or(0, Mask::count), patch })?;
    let target = codes.encode(&canvas);
    let (rows, cols) = (canvas.height + 1 - patch, canvas.width + 1 - patch);
    let scan = Scan { photo: &photo, source: &source, canvas: &canvas, target: &target, codes };
    let known = |i: usize| {
        let (y, x) = (i / cols, i % cols);
        map.and_then(|map| scan.known(y, x, named(map, y, x, &source)))
    };
    let known: Vec<Option<f64>> = (0..rows * cols).into_par_iter().map(known).collect();
    let open: Vec<usize> = (0..known.len()).filter(|&i| known[i] != Some(0.0)).collect();
    let drawn: Vec<usize> =
        drawn(open.len(), samples, ctx.seed).into_iter().map(|i| open[i]).collect();
    ctx.begin(drawn.len() as u64);
    let nearest = |&i: &usize| {
        let best = known[i].unwrap_or(f64::INFINITY);
        let nearest = Nearest { scan: &scan, y: i / cols, x: i % cols, best };
        let nearest = with_kernel(ctx.simd, patch, nearest);
        ctx.step(1)?;
        Ok(nearest)
    };
    let found = drawn.par_iter().map(nearest).collect::<Result<Vec<f64>>>()?;
    let helper = |&i: &usize| known[i].unwrap_or(0.0);
    let all = open.iter().map(helper).sum::<f64>() / open.len().max(1) as f64;
    let (mean, error) = regressed(&drawn.iter().map(helper).collect::<Vec<_>>(), all, &found);
    // Drawn without putting back: nothing is left to chance once all are drawn.
    let left = 1.0 - found.len() as f64 / open.len().max(1) as f64;
    let share = open.len() as f64 / known.len() as f64 / (patch * patch) as f64;
    Ok(Estimate { mean: mean * share, error: error * left.sqrt() * share, compared: found.len() })
}

/// The mean of `y` over all that it was drawn from, given the mean `all` over all of `x`, which goes
/// up and down with it; and its standard error but for the share that was drawn. The regression
/// estimator (Cochran, Sampling Techniques, ch. 7).
fn regressed(x: &[f64], all: f64, y: &[f64]) -> (f64, f64) {
    let n = y.len().max(1) as f64;
    let mean = |v: &[f64]| v.iter().sum::<f64>() / n;
    let (mean_x, mean_y) = (mean(x), mean(y));
    let moments = x.iter().zip(y).fold((0.0, 0.0, 0.0), |(xx, xy, yy), (x, y)| {
        let (x, y) = (x - mean_x, y - mean_y);
        (xx + x * x, xy + x * y, yy + y * y)
    });
    let (xx, xy, yy) = moments;
    let slope = if xx > 0.0 { xy / xx } else { 0.0 };
    let variance = (yy - slope * xy).max(0.0) / (n - 2.0).max(1.0);
    (mean_y + slope * (all - mean_x), (variance / n).sqrt())
}

/// The patch of the source around the pixel that `map` names for the middle of the texture's patch
/// at (`y`, `x`), moved inside.
fn named(map: &SourceMap, y: usize, x: usize, source: &Source) -> Pos {
    let half = source.patch / 2;
    let (y, x) = ((y + half) % map.height(), (x + half) % map.width());
    let [sy, sx] = map.positions()[y * map.width() + x].map(|i| (i as usize).saturating_sub(half));
    Pos::new(sy.min(source.rows() - 1), sx.min(source.cols() - 1))
}

/// At most `samples` of the numbers below `n`, each subset equally likely; sorted.
fn drawn(n: usize, samples: usize, seed: u64) -> Vec<usize> {
    const STAGE: u32 = 4;
    let mut all: Vec<usize> = (0..n).collect();
    // The first steps of Fisher and Yates' shuffle.
    for i in 0..samples.min(n) {
        let other = Rng::new(seed, STAGE, 0, i as u64).below((n - i) as u32) as usize;
        all.swap(i, i + other);
    }
    all.truncate(samples);
    all.sort_unstable();
    all
}

/// Colours to match, row by row.
struct Colors {
    pixels: Vec<[f32; 3]>,
    height: usize,
    width: usize,
}

impl Colors {
    /// With as many rows and columns repeated behind the wrapping axes as a patch reaches over.
    fn extended(&self, patch: usize, wrap: Wrap) -> Self {
        let apron = |wraps: bool| if wraps { patch - 1 } else { 0 };
        let (height, width) = (self.height + apron(wrap.y), self.width + apron(wrap.x));
        let at = |i: usize| {
            let (y, x) = (i / width % self.height, i % width % self.width);
            self.pixels[y * self.width + x]
        };
        Self { pixels: (0..height * width).map(at).collect(), height, width }
    }
}

/// Colours as 7-bit codes, one scale for all channels, none cut off: no colour is further from its
/// code's than half a step in any channel.
#[derive(Clone, Copy)]
struct Codes {
    low: [f32; 3],
    /// Colour units per code.
    step: f32,
}

impl Codes {
    fn covering(pictures: [&Colors; 2]) -> Self {
        let (mut low, mut high) = ([f32::MAX; 3], [f32::MIN; 3]);
        for px in pictures.iter().flat_map(|picture| &picture.pixels) {
            for k in 0..3 {
                low[k] = low[k].min(px[k]);
                high[k] = high[k].max(px[k]);
            }
        }
        let range = (0..3).map(|k| high[k] - low[k]).fold(0.0, f32::max);
        Self { low, step: if range > 0.0 { range / f32::from(CODE_MAX) } else { 1.0 } }
    }

    fn encode(&self, colors: &Colors) -> MatchImage {
        let mut image = MatchImage::new(colors.height, colors.width);
        image.fill_rows(|y, row| {
            for (out, px) in row.iter_mut().zip(&colors.pixels[y * colors.width..]) {
                let code = |k: usize| ((px[k] - self.low[k]) / self.step + 0.5) as u8;
                *out = [code(0), code(1), code(2), 0];
            }
        });
        image
    }

    /// Code distances that a patch may have whose colours are nearer than `distance` (squared):
    /// each of the two patches may be away from its codes by half a step in every number.
    fn reach(&self, distance: f64, patch: usize) -> i32 {
        let off = patch as f64 * 3.0_f64.sqrt() * 0.5;
        // A little more, for the rounding of single floats.
        let reach = (distance.sqrt() / f64::from(self.step) + 2.0 * off) * 1.0001;
        // No distance of codes is larger: 21 x 21 x 3 codes differ by less than 2.2e7.
        (reach * reach).min(1e9) as i32 + 1
    }
}

struct Scan<'a> {
    photo: &'a Colors,
    /// The photo in codes.
    source: &'a Source,
    canvas: &'a Colors,
    /// The canvas in codes.
    target: &'a MatchImage,
    codes: Codes,
}

impl Scan<'_> {
    /// The distance to a patch of the photo, if that may be used.
    fn known(&self, y: usize, x: usize, pos: Pos) -> Option<f64> {
        self.source.is_usable(pos).then(|| self.distance((y, x), (pos.y(), pos.x()), f64::INFINITY))
    }

    /// Squared distance of the colours of two patches (their top left corners), or something that is
    /// at least `best`.
    fn distance(&self, (y, x): (usize, usize), (sy, sx): (usize, usize), best: f64) -> f64 {
        let n = self.source.patch;
        let mut sum = 0.0;
        for d in 0..n {
            let a = &self.canvas.pixels[(y + d) * self.canvas.width + x..][..n];
            let b = &self.photo.pixels[(sy + d) * self.photo.width + sx..][..n];
            for (a, b) in a.iter().zip(b) {
                sum += (0..3).map(|k| f64::from(a[k] - b[k]).powi(2)).sum::<f64>();
            }
            if sum >= best {
                break;
            }
        }
        sum
    }
}

/// The distance of the texture's patch at (`y`, `x`) to the nearest one of the photo, if there is one
/// nearer than `best`; else `best`.
struct Nearest<'a> {
    scan: &'a Scan<'a>,
    y: usize,
    x: usize,
    best: f64,
}

impl WithKernel for Nearest<'_> {
    type Output = f64;

    #[inline(always)]
    fn run<K: Kernel>(self, kernel: K) -> f64 {
        let Self { scan, y, x, mut best } = self;
        let (source, target) = (scan.source, scan.target);
        let mut query = kernel.query();
        kernel.hold(&mut query, target, target.at(y, x));
        let mut reach = scan.codes.reach(best, source.patch);
        for sy in 0..source.rows() {
            for sx in 0..source.cols() {
                let pos = Pos::new(sy, sx);
                let codes = kernel.distance(&query, &source.image, source.at(pos));
                // Codes sort out nearly all; colours decide.
                if codes < reach && source.is_usable(pos) {
                    let distance = scan.distance((y, x), (sy, sx), best);
                    if distance < best {
                        best = distance;
                        reach = scan.codes.reach(best, source.patch);
                    }
                }
            }
        }
        best
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn draws_are_distinct_and_every_number_is_as_likely() {
        let mut counts = [0_u32; 10];
        for seed in 0..10_000 {
            let drawn = drawn(10, 3, seed);
            assert!(drawn.len() == 3 && drawn.is_sorted_by(|a, b| a < b), "{drawn:?}");
            drawn.iter().for_each(|&i| counts[i] += 1);
        }
        // 3000 expected each, standard deviation 46: five of them.
        assert!(counts.iter().all(|c| c.abs_diff(3000) < 230), "{counts:?}");
        assert_eq!(drawn(4, 9, 1), [0, 1, 2, 3]);
    }

    #[test]
    fn regression_knows_what_a_line_tells_and_no_more() {
        let x = [1.0, 2.0, 4.0, 5.0];
        assert_eq!(regressed(&x, 10.0, &x.map(|x| 3.0 * x + 1.0)), (31.0, 0.0));
        // Nothing to be learned from x: the plain mean, one degree of freedom given away.
        let (mean, error) = regressed(&[0.0; 4], 0.0, &[1.0, 2.0, 3.0, 6.0]);
        assert_eq!((mean, error), (3.0, (14.0_f64 / 2.0 / 4.0).sqrt()));
        assert_eq!(regressed(&[], 0.0, &[]), (0.0, 0.0));
    }

    #[test]
    fn no_colour_within_reach_is_out_of_the_codes_reach() {
        // Two pixels whose codes are as far apart as can be for their colours.
        let codes = Codes { low: [0.0; 3], step: 2.0 };
        let colors = |v: f32| Colors { pixels: vec![[v; 3]; 9], height: 3, width: 3 };
        let (a, b) = (codes.encode(&colors(0.99)), codes.encode(&colors(3.01)));
        let apart = crate::search::patch::distance_squared(&a, 0, &b, 0, 3);
        let distance = 27.0 * (3.01_f64 - 0.99).powi(2);
        assert_eq!(apart, 27 * 4);
        assert!(apart < codes.reach(distance, 3), "{} cuts off {apart}", codes.reach(distance, 3));
    }
}
