//! The exemplar's pyramid in the matching space.

use crate::base::ctx::Ctx;
use crate::base::error::{Error, Result};
use crate::image::color::{ColorModel, MatchSpace};
use crate::image::mask::Mask;
use crate::image::picture::{Encoding, Picture, Samples};
use crate::image::symmetry::Symmetry;
use crate::method::stationary::{CONTRAST, Plan};
use rayon::prelude::*;

use crate::search::atlas::Atlas;
use crate::search::field::Pos;
use crate::search::patch::codes::Codes;
use crate::search::patch::{CODE_MAX, MatchImage};
use crate::search::place_cost::PlaceCost;
use crate::search::rarity::rarity;
use crate::search::source::Source;
use crate::signal::histogram::{Distribution, Quantiles, SOFT_BITS, Soft};
use crate::signal::localhist::LocalDistributions;
use crate::signal::resample::{resized, resized_mask};
use crate::signal::window::Domain;

/// Ratio of the sides of two neighbouring levels (the paper's).
const RATIO: f64 = 1.3;

/// Shorter side of the coarsest level, at most, in pixels. The paper starts at 64 or a quarter of the
/// output; from less, a patch spans a fifth of the output and larger features stay whole. From 32,
/// a few large features fill the tile.
const COARSEST: usize = 48;

/// Window of the exemplar's typical histogram, as a fraction of its shorter side. Smaller than the
/// texture's own features, it would call their colours untypical; larger than the stains' distances,
/// it would see stains everywhere.
const TYPICAL_WINDOW: f64 = 0.15;

/// Cost of using a patch as often as the average, as a share of the patch's own variance. More
/// drives neighbouring pixels to different places of the photo, and the vote blurs.
const USAGE_SHARE: f64 = 0.024;

/// Shorter side of the largest level at which rare places are looked for. A patch then spans a
/// twentieth of the photo; what is smaller than a tenth of a patch here, nobody notices in a tile.
const RARITY_SIDE: usize = 256;

/// How many pixels have each code, per channel.
type Counts = [[u32; CODE_MAX as usize + 1]; 4];
const NOTHING: Counts = [[0; CODE_MAX as usize + 1]; 4];
/// How many samples are counted at a time: the counts of a chunk are too large to be moved per sample.
const CHUNK: usize = 1 << 14;

/// One level of the pyramid.
#[derive(Debug)]
pub(super) struct Level {
    /// Height and width of the output.
    pub(super) size: (usize, usize),
    /// The exemplar.
    pub(super) source: Source,
    /// The exemplar's quantiles per channel.
    pub(super) quantiles: [Quantiles; 4],
    /// Uniformity cost of using a patch as often as the average, in squared codes.
    pub(super) usage_unit: f32,
    /// One code in units of L*a*b*.
    pub(super) unit: f32,
    /// The mean squared distance of a patch from the mean colour, in squared codes.
    pub(super) patch_variance: f64,
    /// What rare places cost.
    pub(super) rarity: PlaceCost,
    /// The photos, if somebody watches.
    pub(super) photos: Vec<Picture>,
}

/// A photo, as far as the pyramid has reduced it.
struct Reduced {
    /// Height and width of the photo itself.
    full: (usize, usize),
    /// Height and width now.
    size: (usize, usize),
    pixels: Vec<[f32; 3]>,
    usable: Option<Vec<bool>>,
}

/// All levels, finest first, and where the finest one's source may be used (`None`: everywhere);
/// with the photos as pictures if they are `watched`.
///
/// # Errors
/// [`Error::EmptyMask`] if no whole patch is usable at full size.
pub(super) fn build(
    ctx: &Ctx,
    photos: &[(&Picture, Option<&Mask>)],
    symmetries: &[Symmetry],
    plan: &Plan,
    watched: bool,
) -> Result<(Vec<Level>, Option<Vec<bool>>)> {
    let (h, w) = plan.size;
    let model = ColorModel::new(photos[0].0);
    let reduced = |&(photo, mask): &(&Picture, Option<&Mask>)| {
        let size = (photo.height(), photo.width());
        let (pixels, usable) = (model.averaging_pixels(photo), mask.map(|m| m.usable().to_vec()));
        Reduced { full: size, size, pixels, usable }
    };
    let mut reduced: Vec<Reduced> = photos.iter().map(reduced).collect();
    ctx.step(0)?;
    let mut codes = None;
    let mut levels = Vec::new();
    let mut finest_usable = None;
    for j in 0.. {
        let at = |n: usize| (n as f64 / RATIO.powi(j)).round() as usize;
        if j > 0 {
            // The side before this one was still above the coarsest: go one below it.
            let above = (h.min(w) as f64 / RATIO.powi(j - 1)).round() as usize;
            if above <= COARSEST {
                break;
            }
            let small = |photo: &Reduced| at(photo.full.0.min(photo.full.1)) < 2 * plan.patch;
            if reduced.iter().any(small) || at(h.min(w)) < plan.patch {
                break;
            }
            for photo in &mut reduced {
                let to = (at(photo.full.0), at(photo.full.1));
                photo.pixels = resized(&photo.pixels, photo.size, to);
                ctx.step(0)?;
                photo.usable = photo.usable.take().map(|u| resized_mask(&u, photo.size, to));
                photo.size = to;
            }
        }
        let size = (at(h), at(w));
        match level(&reduced, model.space(), symmetries, size, plan.patch, &mut codes) {
            Some((mut level, usable)) => {
                if watched {
                    let shown = reduced.iter().map(|photo| shown(photo, model.space()));
                    level.photos = shown.collect::<Result<_>>()?;
                }
                levels.push(level);
                if j == 0 {
                    finest_usable = usable;
                }
            }
            // A thin mask leaves no patch at coarse levels: start with finer ones.
            None if j > 0 => break,
            None => {
                let count = |(photo, mask): &(&Picture, Option<&Mask>)| {
                    mask.map_or(photo.height() * photo.width(), Mask::count)
                };
                let usable = photos.iter().map(count).sum();
                return Err(Error::EmptyMask { usable, patch: plan.patch });
            }
        }
    }
    // Only the coarsest level matches colours; without projection it is the paper's plain target.
    if let (Some(coarsest), true) = (levels.last_mut(), plan.evenness.is_some()) {
        for (quantiles, typical) in
            coarsest.quantiles.iter_mut().zip(typical_quantiles(&coarsest.source))
        {
            if let Some(typical) = typical {
                *quantiles = typical;
            }
        }
    }
    if plan.rarity > 0.0 {
        rate(ctx, &mut levels);
    }
    Ok((levels, finest_usable))
}

/// Finds what is rare at the coarse levels; the finer ones take it over.
fn rate(ctx: &Ctx, levels: &mut [Level]) {
    for j in (0..levels.len()).rev() {
        let (fine, coarse) = levels.split_at_mut(j + 1);
        let level = &mut fine[j];
        let side = level.source.rows().min(level.source.cols());
        level.rarity = match coarse.first() {
            Some(coarser) if side > RARITY_SIDE => {
                coarser.rarity.resized(&coarser.source, &level.source)
            }
            _ => rarity(ctx, &level.source),
        };
    }
}

/// A level, and where its source may be used.
fn level(
    photos: &[Reduced],
    space: MatchSpace,
    symmetries: &[Symmetry],
    size: (usize, usize),
    patch: usize,
    codes: &mut Option<Codes>,
) -> Option<(Level, Option<Vec<bool>>)> {
    let codes = *codes.get_or_insert_with(|| {
        let sampled = photos.iter().map(|p| (&p.pixels[..], p.usable.as_deref()));
        Codes::covering(&sampled.collect::<Vec<_>>(), space)
    });
    let image = |photo: &Reduced| with_contrast(&codes.image(&photo.pixels, photo.size, space));
    let sizes: Vec<(usize, usize)> = photos.iter().map(|photo| photo.size).collect();
    let atlas = Atlas::new(&sizes, symmetries)?;
    let flags: Vec<Option<&[bool]>> = photos.iter().map(|photo| photo.usable.as_deref()).collect();
    let flags = atlas.flags(&flags);
    let usable = flags.as_deref();
    let image = atlas.image(photos.iter().map(image).collect());
    let (eh, ew) = (atlas.height(), atlas.width());
    let source = Source::of_atlas(image, patch, usable, atlas)?;
    let usable_pixel = |i: &usize| usable.is_none_or(|u| u[*i]);
    // An odd step visits every column of a picture of even width.
    let step = (eh * ew / 400_000) | 1;
    let n_samples = (eh * ew).div_ceil(step);
    let count = |chunk: usize| {
        let mut counts = NOTHING;
        for sample in chunk * CHUNK..((chunk + 1) * CHUNK).min(n_samples) {
            let i = sample * step;
            if usable_pixel(&i) {
                let px = source.image.pixel(i / ew, i % ew);
                counts.iter_mut().zip(px).for_each(|(counts, code)| counts[code as usize] += 1);
            }
        }
        counts
    };
    let masses = (0..n_samples.div_ceil(CHUNK))
        .into_par_iter()
        .map(count)
        .reduce(
            || NOTHING,
            |mut a, b| {
                let all = a.as_flattened_mut().iter_mut().zip(b.as_flattened());
                all.for_each(|(a, b)| *a += b);
                a
            },
        )
        .map(|counts| counts.map(f64::from).to_vec());
    // If the step has missed the few usable pixels, any usable patch's first pixel will do.
    let distribution = |k: usize| {
        Distribution::from_masses(&masses[k]).unwrap_or_else(|| {
            let some = (0..eh * ew).find(usable_pixel).unwrap_or(0);
            let code = source.image.pixel(some / ew, some % ew)[k];
            Distribution::of(std::iter::once((code as u16) << SOFT_BITS)).expect("one value")
        })
    };
    let quantiles = std::array::from_fn(|k| distribution(k).quantiles());
    let variance: f64 = masses[..CONTRAST]
        .iter()
        .map(|masses| {
            let total = masses.iter().sum::<f64>().max(1.0);
            let moment = |p: i32| {
                (0..).zip(masses).map(|(c, m)| f64::from(c).powi(p) * m).sum::<f64>() / total
            };
            moment(2) - moment(1) * moment(1)
        })
        .sum();
    let patch_variance = variance * (patch * patch) as f64;
    let usage_unit = (USAGE_SHARE * variance * (patch * patch) as f64) as f32;
    let rarity = PlaceCost::free(&source);
    let photos = Vec::new();
    let unit = codes.unit();
    let level = Level { size, source, quantiles, usage_unit, unit, patch_variance, rarity, photos };
    Some((level, flags))
}

/// A photo as a picture that has the same colours to match.
fn shown(photo: &Reduced, space: MatchSpace) -> Result<Picture> {
    let encoding = match space {
        MatchSpace::Lab => Encoding::Linear,
        MatchSpace::Data => Encoding::Data,
    };
    let (h, w) = photo.size;
    Picture::new(h, w, 3, Samples::F32(photo.pixels.as_flattened().to_vec()), encoding)
}

/// The exemplar's typical local histogram of each colour: the median over all places of a photo of
/// each quantile, those of several photos pooled. Rare stains are in few windows and drop out of it.
fn typical_quantiles(source: &Source) -> [Option<Quantiles>; CONTRAST] {
    let mut all = [const { Vec::new() }; CONTRAST];
    for (i, view) in source.atlas.views().iter().enumerate() {
        // Its other symmetries say the same of a photo.
        if source.atlas.views()[..i].iter().any(|before| before.picture == view.picture) {
            continue;
        }
        let height = view.size.0 - source.patch + 1;
        let width = view.size.1 - source.patch + 1;
        let half = source.patch / 2;
        // The middles of all patches, and which of the patches are usable.
        let (soft, usable): (Vec<Soft>, Vec<bool>) = (0..height * width)
            .into_par_iter()
            .map(|i| {
                let (y, x) = (view.corner.0 + i / width, view.corner.1 + i % width);
                let px = source.image.pixel(y + half, x + half);
                (px.map(|c| u16::from(c) << SOFT_BITS), source.is_usable(Pos::new(y, x)))
            })
            .unzip();
        let domain = Domain { height, width, wrap_y: false, wrap_x: false };
        let sigma = TYPICAL_WINDOW * height.min(width) as f64;
        let weight = usable.iter().filter(|&&ok| ok).count() as f64;
        all.par_iter_mut().enumerate().for_each(|(k, all)| {
            let code = |i: usize| usable[i].then_some(soft[i][k]);
            let local = LocalDistributions::new(code, domain, sigma);
            all.extend(local.typical().map(|typical| (typical, weight)));
        });
    }
    all.map(|all| Quantiles::pooled(&all))
}

/// The codes with local contrast as the fourth: the standard deviation of the colour over the 5 x 5
/// pixels around each pixel, in codes.
fn with_contrast(colors: &MatchImage) -> MatchImage {
    const REACH: usize = 2;
    let (h, w) = (colors.height(), colors.width());
    let mut image = MatchImage::new(h, w);
    image.fill_rows(|y, row| {
        let rows = y.saturating_sub(REACH)..(y + REACH + 1).min(h);
        let n_rows = rows.len();
        // Per column: sums of the three colours, and of all their squares.
        let mut columns = vec![[0u32; 4]; w];
        for y in rows {
            let codes = colors.row(y);
            for (sum, px) in columns.iter_mut().zip(codes.chunks_exact(4)) {
                let [a, b, c] = [px[0] as u32, px[1] as u32, px[2] as u32];
                sum[0] += a;
                sum[1] += b;
                sum[2] += c;
                sum[3] += a * a + b * b + c * c;
            }
        }
        let codes = colors.row(y);
        for (x, (out, px)) in row.iter_mut().zip(codes.chunks_exact(4)).enumerate() {
            let cols = &columns[x.saturating_sub(REACH)..(x + REACH + 1).min(w)];
            let mut sum = [0u32; 4];
            for column in cols {
                (0..4).for_each(|k| sum[k] += column[k]);
            }
            let n = (n_rows * cols.len()) as f32;
            let means: f32 = sum[..3].iter().map(|&s| (s as f32 / n) * (s as f32 / n)).sum();
            let contrast = (sum[3] as f32 / n - means).max(0.0).sqrt();
            *out = [px[0], px[1], px[2], (contrast + 0.5) as u8];
        }
    });
    image
}
