//! The exemplar's pyramid in the matching space.

use crate::base::error::{Error, Result};
use crate::image::color::{ColorModel, MatchSpace};
use crate::image::mask::Mask;
use crate::image::picture::Picture;
use crate::method::stationary::{CONTRAST, Plan};
use crate::search::patch::{CODE_MAX, MatchImage};
use crate::search::source::Source;
use crate::signal::histogram::{Bins, Distribution, Quantiles};
use crate::signal::localhist::{Domain, LocalDistributions, Pixel};
use crate::signal::resample::{resized, resized_mask};

/// Ratio of the sides of two neighbouring levels (the paper's).
const RATIO: f64 = 1.3;

/// Shorter side of the coarsest level, at least (the paper's).
const COARSEST: f64 = 48.0;

/// Window of the exemplar's typical histogram, as a fraction of its shorter side. Smaller than the
/// texture's own features, it would call their colours untypical; larger than the stains' distances,
/// it would see stains everywhere.
const TYPICAL_WINDOW: f64 = 0.1;

/// Cost of using a patch as often as the average, as a share of the patch's own variance. More
/// drives neighbouring pixels to different places of the photo, and the vote blurs.
const USAGE_SHARE: f64 = 0.006;

/// Affine map between L*a*b* and 7-bit codes, the same scale for all channels, so that distances
/// of codes are Euclidean distances of colours.
#[derive(Debug, Clone, Copy)]
pub(super) struct Codes {
    low: Pixel,
    /// Codes per unit.
    pub(super) scale: f32,
}

impl Codes {
    /// Covers 99.8 % of each channel's usable values.
    fn covering(pixels: &[Pixel], usable: Option<&[bool]>) -> Self {
        // A hundred thousand samples fix the ends well enough.
        let step = (pixels.len() / 100_000).max(1);
        let mut low = [0.0; 4];
        let mut range = 0f32;
        for k in 0..3 {
            let mut values: Vec<f32> = (0..pixels.len())
                .step_by(step)
                .filter(|&i| usable.is_none_or(|u| u[i]))
                .map(|i| pixels[i][k])
                .collect();
            if values.is_empty() {
                values.push(0.0);
            }
            values.sort_unstable_by(f32::total_cmp);
            let cut = values.len() / 1000;
            low[k] = values[cut];
            range = range.max(values[values.len() - 1 - cut] - low[k]);
        }
        Self { low, scale: CODE_MAX as f32 / range.max(1.0) }
    }

    /// The codes of a colour, rounded; colours outside the range are cut.
    #[inline]
    pub(super) fn encode(&self, lab: Pixel) -> [u8; 4] {
        let code = |k: usize| {
            ((lab[k] - self.low[k]) * self.scale + 0.5).clamp(0.0, CODE_MAX as f32) as u8
        };
        [code(0), code(1), code(2), code(3)]
    }

    /// The colour of codes (or means of codes).
    #[inline]
    pub(super) fn lab(&self, code: [f32; 4]) -> Pixel {
        std::array::from_fn(|k| self.low[k] + code[k] / self.scale)
    }
}

/// One level of the pyramid.
#[derive(Debug)]
pub(super) struct Level {
    /// Height and width of the output.
    pub(super) size: (usize, usize),
    /// The exemplar.
    pub(super) source: Source,
    /// Between colours and codes.
    pub(super) codes: Codes,
    /// The exemplar's quantiles per channel.
    pub(super) quantiles: [Quantiles; 4],
    /// Uniformity cost of using a patch as often as the average, in squared codes.
    pub(super) usage_unit: f32,
}

/// All levels, finest first.
///
/// # Errors
/// [`Error::EmptyMask`] if no whole patch is usable at full size.
pub(super) fn build(photo: &Picture, mask: Option<&Mask>, plan: &Plan) -> Result<Vec<Level>> {
    let (h, w) = plan.size;
    let (mut eh, mut ew) = (photo.height(), photo.width());
    let model = ColorModel::new(photo);
    let mut pixels = model.averaging_pixels(photo);
    let mut usable = mask.map(|m| m.usable().to_vec());
    let n_usable = mask.map_or(eh * ew, Mask::count);
    let coarsest = COARSEST;
    let n_levels = ((h.min(w) as f64 / coarsest).ln() / RATIO.ln()).ceil().max(0.0) as usize + 1;
    let mut codes = None;
    let mut levels = Vec::new();
    for j in 0..n_levels {
        let at = |n: usize| (n as f64 / RATIO.powi(j as i32)).round() as usize;
        if j > 0 {
            let to = (at(photo.height()), at(photo.width()));
            if to.0 < 2 * plan.patch || to.1 < 2 * plan.patch || at(h.min(w)) < plan.patch {
                break;
            }
            pixels = resized(&pixels, (eh, ew), to);
            usable = usable.map(|u| resized_mask(&u, (eh, ew), to));
            (eh, ew) = to;
        }
        let size = (at(h), at(w));
        match level(
            &pixels,
            model.space(),
            (eh, ew),
            usable.as_deref(),
            size,
            (plan.patch, plan.sigma.is_some()),
            &mut codes,
        ) {
            Some(level) => levels.push(level),
            // A thin mask leaves no patch at coarse levels: start with finer ones.
            None if j > 0 => break,
            None => return Err(Error::EmptyMask { usable: n_usable, patch: plan.patch }),
        }
    }
    Ok(levels)
}

fn level(
    pixels: &[[f32; 3]],
    space: MatchSpace,
    (eh, ew): (usize, usize),
    usable: Option<&[bool]>,
    size: (usize, usize),
    (patch, typical): (usize, bool),
    codes: &mut Option<Codes>,
) -> Option<Level> {
    use rayon::prelude::*;
    let mut lab = pixels.to_vec();
    lab.par_chunks_mut(ew).for_each(|row| space.convert_row(row));
    let contrast = contrast(&lab, eh, ew);
    let lab: Vec<Pixel> =
        lab.par_iter().zip(&contrast).map(|(px, &c)| [px[0], px[1], px[2], c]).collect();
    let codes = *codes.get_or_insert_with(|| Codes::covering(&lab, usable));
    let mut image = MatchImage::new(eh, ew);
    image.fill_rows(|y, row| {
        row.iter_mut().zip(&lab[y * ew..]).for_each(|(px, &lab)| *px = codes.encode(lab));
    });
    let source = Source::new(image, patch, usable)?;
    let usable_pixels: Vec<usize> =
        (0..lab.len()).filter(|&i| usable.is_none_or(|u| u[i])).collect();
    let step = (usable_pixels.len() / 200_000).max(1);
    let sample: Vec<Pixel> = usable_pixels.iter().step_by(step).map(|&i| lab[i]).collect();
    let quantiles = std::array::from_fn(|k| {
        let bins = Bins::covering(sample.iter().map(|px| px[k]), 256);
        let typical = (typical && k < CONTRAST).then(|| {
            let domain = Domain { height: eh, width: ew, wrap_y: false, wrap_x: false };
            let sigma = TYPICAL_WINDOW * eh.min(ew) as f64;
            LocalDistributions::new(&lab, usable, k, domain, sigma, bins).typical()
        });
        typical
            .flatten()
            .unwrap_or_else(|| Distribution::of(sample.iter().map(|px| px[k]), bins).quantiles())
    });
    let variance: f64 = (0..3)
        .map(|k| {
            let mean =
                sample.iter().map(|px| px[k] as f64).sum::<f64>() / sample.len().max(1) as f64;
            sample.iter().map(|px| (px[k] as f64 - mean).powi(2)).sum::<f64>()
                / sample.len().max(1) as f64
        })
        .sum();
    let usage_unit =
        (USAGE_SHARE * variance * (codes.scale * codes.scale) as f64 * (patch * patch) as f64)
            as f32;
    Some(Level { size, source, codes, quantiles, usage_unit })
}

/// Local contrast: standard deviation of the colour over the 5 x 5 pixels around each pixel.
fn contrast(lab: &[[f32; 3]], h: usize, w: usize) -> Vec<f32> {
    use rayon::prelude::*;
    const REACH: usize = 2;
    let mut out = vec![0f32; h * w];
    out.par_chunks_mut(w).enumerate().for_each_init(
        || vec![[0f32; 6]; w],
        |columns, (y, out)| {
            let rows = y.saturating_sub(REACH)..(y + REACH + 1).min(h);
            let n_rows = rows.len();
            columns.fill([0.0; 6]);
            for row in rows {
                for (sum, px) in columns.iter_mut().zip(&lab[row * w..][..w]) {
                    for k in 0..3 {
                        sum[k] += px[k];
                        sum[3 + k] += px[k] * px[k];
                    }
                }
            }
            for (x, out) in out.iter_mut().enumerate() {
                let cols = &columns[x.saturating_sub(REACH)..(x + REACH + 1).min(w)];
                let n = (n_rows * cols.len()) as f32;
                let mut variance = 0.0;
                for k in 0..3 {
                    let sum: f32 = cols.iter().map(|c| c[k]).sum();
                    let squares: f32 = cols.iter().map(|c| c[3 + k]).sum();
                    variance += squares / n - (sum / n) * (sum / n);
                }
                *out = variance.max(0.0).sqrt();
            }
        },
    );
    out
}
