//! [`tile`]: a photo becomes a texture that repeats.

use std::time::{Duration, Instant};

use serde::Serialize;

use crate::analyze::{stationarity, texture};
use crate::base::ctx::Ctx;
use crate::base::error::{Error, Result};
use crate::base::memory::ensure_available;
use crate::base::params::{Value, choice, params};
use crate::image::color::ColorModel;
use crate::image::mask::Mask;
use crate::image::material::MapKind;
use crate::image::picture::Picture;
use crate::image::sigma_map::SigmaMap;
use crate::image::sourcemap::SourceMap;
use crate::method::{make_seamless, stationary};
use crate::search::patchmatch::Wrap;
use crate::signal::measure::{ORDERS, Statistic};
use crate::signal::window::Domain;

/// Longest side of a tile, in pixels.
const MAX_TILE_SIDE: usize = 32_768;

/// Size of the tile.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Size {
    /// The largest power of two that is at most a tenth larger than the photo's shorter side, at
    /// most 2048; not square if the photo is at least twice as long as it is wide. With
    /// [`Method::MakeSeamless`], the photo's own size.
    Auto,
    /// This many pixels.
    Pixels {
        /// Width in pixels.
        width: usize,
        /// Height in pixels.
        height: usize,
    },
}

impl Value for Size {
    const KIND: &'static str = "size";

    fn parse(text: &str) -> Option<Self> {
        if text == "auto" {
            return Some(Self::Auto);
        }
        let (width, height) = text.split_once(['x', 'X']).unwrap_or((text, text));
        Some(Self::Pixels { width: width.parse().ok()?, height: height.parse().ok()? })
    }

    fn show(&self) -> String {
        match self {
            Self::Auto => "auto".into(),
            Self::Pixels { width, height } => format!("{width}x{height}"),
        }
    }

    fn expected() -> String {
        "a size as WIDTHxHEIGHT (one number for a square), or auto".into()
    }
}

choice! {
    /// In which directions the tile repeats.
    pub enum Axis {
        /// In both.
        Both = "both",
        /// Horizontally only (a trim sheet).
        X = "x",
        /// Vertically only.
        Y = "y",
    }
}

choice! {
    /// How the tile is made.
    pub enum Method {
        /// Toroidal PatchMatch with stationarity projection (Moritz et al. 2017).
        Stationary = "stationary",
        /// Baseline: toroidal PatchMatch without the projection.
        WrapOnly = "wrap-only",
        /// Baseline: PatchMatch that does not wrap at all.
        NoWrap = "no-wrap",
        /// Baseline: shift by half and blend over the seam, as image editors do.
        MakeSeamless = "make-seamless",
    }
}

choice! {
    /// The statistic that is made equal everywhere.
    pub enum Measure {
        /// Local histograms of each colour channel: the whole distribution.
        Histogram = "histogram",
        /// Local moments of each colour channel: mean, variance and so on, up to `order`.
        Moments = "moments",
        /// Local histograms of oriented filters' responses: only fine structure, no shades.
        Steerable = "steerable",
        /// None: the same as the method `wrap-only`.
        None = "none",
    }
}

choice! {
    /// How much time to spend.
    pub enum Quality {
        /// A quick look.
        Draft = "draft",
        /// The default.
        Normal = "normal",
        /// More iterations; about three times the time of normal.
        Best = "best",
    }
}

params! {
    /// Parameters of [`tile`].
    pub struct TileParams for "tile" {
        /// Size of the tile: WIDTHxHEIGHT, or auto for the largest power of two that about fits into the photo.
        size: Size = Size::Auto, unit "px";
        /// In which directions the tile repeats.
        axis: Axis = Axis::Both;
        /// How the tile is made; all but stationary are baselines to compare with.
        method: Method = Method::Stationary;
        /// The statistic that is made equal everywhere in the tile.
        measure: Measure = Measure::Histogram;
        /// With the measure moments, how many of them: 1 the mean, 2 and the variance, 3 and the skewness, 4 and the kurtosis.
        order: usize = 2, in 1..=4;
        /// Reach of the stationarity measure: smaller evens out smaller stains, larger keeps more variety.
        sigma: f32 = 0.1, in 0.01..=1.0, unit "fraction of the tile's shorter side";
        /// Side of the patches that are compared; odd. Larger keeps larger features whole, smaller mixes more.
        patch: usize = 11, in 3..=21, unit "px";
        /// How strongly every part of the photo is made to contribute equally; 0 switches it off.
        uniformity: f32 = 1.0, in 0.0..=100.0;
        /// How strongly single things that catch the eye (a leaf, a nail, a dark spot) are held back; 0 treats them like the rest. For the method stationary.
        rarity: f32 = 1.0, in 0.0..=4.0;
        /// How much time to spend.
        quality: Quality = Quality::Normal;
    }
}

/// What the finished tile costs, measured on the delivered picture. Lower is better.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Costs {
    /// Texture cost: mean over pixels of the squared CIE L*a*b* distance per patch pixel between
    /// the tile's patch and the photo's patch named by the source map (paper eq. 5). An upper
    /// bound of the exact cost, which takes the best patch of the whole photo, averaged over an
    /// even grid of patches. `None` for [`Method::MakeSeamless`], whose pixels are not the photo's.
    pub texture: Option<f64>,
    /// Stationarity cost: mean earth mover's distance between the local histograms of two places,
    /// summed over L*, a* and b* (paper eq. 1 and 3), in L*a*b* units.
    pub stationarity: f64,
    /// The cost under the measure of the parameters: the same number for the histogram; for the
    /// moments, the mean squared difference of two places' moments (of values counted from the
    /// mean in tens of units), in L*a*b* units squared (paper eq. 2); for the steerable filters,
    /// the earth mover's distance summed over twelve responses, in L*a*b* units (paper eq. 4).
    /// `None` without a measure. Comparable between tiles of the same measure and order only.
    pub stationarity_by_measure: Option<f64>,
}

/// How a tile was made and what it costs.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// Version of texforge.
    pub version: &'static str,
    /// Seed of all random choices.
    pub seed: u64,
    /// Every parameter as text, with `size` resolved.
    pub params: Vec<(&'static str, String)>,
    /// Width and height of the photo in pixels.
    pub photo_size: (usize, usize),
    /// Width and height of the tile in pixels.
    pub tile_size: (usize, usize),
    /// The costs.
    pub costs: Costs,
    /// Wall time in seconds of each stage, in order. The only part that differs between runs.
    pub seconds: Vec<(&'static str, f64)>,
    /// What the user should know, one sentence each.
    pub notes: Vec<String>,
}

/// What an iteration has come to: one line of [`Tile::trace`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Step {
    /// Level of the pyramid: 0 has the tile's size, every further one is smaller by 1.3.
    pub level: usize,
    /// Iteration at this level, from 1. The last of level 0 is the delivered tile: one more than
    /// there are iterations, as the seams are settled after them.
    pub iteration: u32,
    /// The costs, as [`Report::costs`] has them, of the tile that would have been delivered if the
    /// work had stopped here before the seams are settled: the middles of the matched patches.
    /// Texture is compared with the photo at the level's resolution, and the window of the
    /// stationarity cost is a fraction of the level's own size. On the last line they are those of
    /// the report.
    pub costs: Costs,
}

/// The result of [`tile`].
#[derive(Debug, Clone)]
pub struct Tile {
    /// The tile, in the photo's own sample type.
    pub picture: Picture,
    /// Which photo pixel each pixel of the tile is a copy of; `None` for
    /// [`Method::MakeSeamless`], which blends.
    pub source_map: Option<SourceMap>,
    /// How it was made and what it costs.
    pub report: Report,
    /// The costs of every iteration, coarse to fine; empty unless [`Guides::trace`] is set, and with
    /// [`Method::MakeSeamless`], which has no iterations.
    pub trace: Vec<Step>,
}

impl TileParams {
    /// Width and height of the tile for a photo of this size: `size`, or the default if it is
    /// [`Size::Auto`].
    pub fn resolved_size(&self, photo_width: usize, photo_height: usize) -> (usize, usize) {
        if let Size::Pixels { width, height } = self.size {
            return (width, height);
        }
        if self.method == Method::MakeSeamless {
            return (photo_width, photo_height);
        }
        let pow2 = |n: usize| (1 << (n.max(1) * 11 / 10).max(1).ilog2()).min(2048);
        let (w, h) = (photo_width.max(1), photo_height.max(1));
        if w >= 2 * h || h >= 2 * w {
            return (pow2(w), pow2(h));
        }
        (pow2(w.min(h)), pow2(w.min(h)))
    }

    /// What `measure`, `order` and `sigma`, or the map in its place, say.
    fn evenness(&self, sigma_map: Option<&SigmaMap>) -> Option<stationary::Evenness> {
        let statistic = match self.measure {
            Measure::Histogram => Statistic::Histogram,
            Measure::Moments => Statistic::Moments(ORDERS[self.order - 1]),
            Measure::Steerable => Statistic::Steerable,
            Measure::None => return None,
        };
        let sigma_map = sigma_map.cloned();
        Some(stationary::Evenness { statistic, sigma: self.sigma, sigma_map })
    }
}

/// Turns a photo into a tile that repeats without a seam and without a blob that gives the
/// repetition away.
///
/// `photo` is H x W x C: grey, RGB (each with or without alpha), or data of any number of channels.
/// `mask` (size of the photo) says where it may be used; transparent pixels are never used. Every
/// pixel of the tile is a copy of one pixel of the photo, except with [`Method::MakeSeamless`].
///
/// # Paper
/// Moritz, James, Haines, Ritschel, Weyrich: Texture Stationarization (2017), Algorithm 1.
///
/// # Determinism
/// Same photo, mask, parameters and `ctx.seed`: same bytes, for any thread count and SIMD level.
///
/// # Errors
/// [`Error::Parameter`], [`Error::TooSmall`] (patch larger than photo or tile),
/// [`Error::EmptyMask`], [`Error::SizeMismatch`] (mask), [`Error::NotFinite`], [`Error::Memory`]
/// (checked before anything is allocated), [`Error::Cancelled`].
pub fn tile(ctx: &Ctx, photo: &Picture, mask: Option<&Mask>, params: &TileParams) -> Result<Tile> {
    tile_guided(ctx, photo, Guides { mask, ..Guides::default() }, params)
}

/// What [`tile_guided`] may be given besides the photo.
#[derive(Debug, Clone, Copy, Default)]
pub struct Guides<'a> {
    /// Where the photo may be used; of the photo's size.
    pub mask: Option<&'a Mask>,
    /// How far the measure reaches at every pixel, in place of `sigma`; of the tile's size. The
    /// histogram's cost is measured with `sigma` still, that of the measure in use with the map.
    pub sigma_map: Option<&'a SigmaMap>,
    /// Whether every iteration's costs are measured too, see [`Tile::trace`]. Same bytes; the time
    /// that takes is listed apart in [`Report::seconds`].
    pub trace: bool,
}

/// [`tile`], with further pictures that say what is wanted where.
///
/// # Paper
/// Moritz et al. 2017, Fig. 10: a locally prescribed reach. Statistics are computed under windows of a
/// few sizes and their mappings blended at every pixel.
///
/// # Errors
/// Those of [`tile`]; [`Error::SizeMismatch`] (sigma map).
pub fn tile_guided(
    ctx: &Ctx,
    photo: &Picture,
    guides: Guides<'_>,
    params: &TileParams,
) -> Result<Tile> {
    let Guides { mask, sigma_map, trace: traced } = guides;
    let start = Instant::now();
    let (width, height) = check(photo, sigma_map, params)?;
    let size = (height, width);
    let wrap = Wrap { y: params.axis != Axis::X, x: params.axis != Axis::Y };
    let mask = usable_mask(photo, mask)?;
    let mut notes = Vec::new();
    if mask.is_some() && params.method == Method::MakeSeamless {
        notes.push("the method make-seamless uses the whole photo; the mask is ignored".to_owned());
    }
    if sigma_map.is_some()
        && (params.method != Method::Stationary || params.measure == Measure::None)
    {
        notes.push("nothing is made stationary; the sigma map changes no pixel".to_owned());
    }

    let mut trace = Vec::new();
    let mut tracing = Duration::ZERO;
    let mut look = |look: &stationary::Look<'_>| {
        let since = Instant::now();
        let picture = look.map.apply(look.exemplar, MapKind::Color)?;
        let costs = costs(look.exemplar, &picture, Some(&look.map), params, sigma_map, wrap);
        trace.push(Step { level: look.level, iteration: look.iteration, costs });
        tracing += since.elapsed();
        Ok(())
    };
    let watch: Option<stationary::Watch<'_>> = if traced { Some(&mut look) } else { None };
    let (picture, source_map) = ctx.install(|| {
        if params.method == Method::MakeSeamless {
            return Ok((make_seamless::run(photo, size, wrap)?, None));
        }
        let plan = plan(params, sigma_map, size, wrap);
        let map = stationary::run(ctx, photo, mask.as_ref(), &plan, watch)?;
        Ok((map.apply(photo, MapKind::Color)?, Some(map)))
    })?;
    let made = start.elapsed();
    let synthesis = made.saturating_sub(tracing);
    let costs =
        ctx.install(|| Ok(costs(photo, &picture, source_map.as_ref(), params, sigma_map, wrap)))?;
    let mut resolved = params.clone();
    resolved.size = Size::Pixels { width, height };
    let report = Report {
        version: env!("CARGO_PKG_VERSION"),
        seed: ctx.seed,
        params: resolved.show(),
        photo_size: (photo.width(), photo.height()),
        tile_size: (width, height),
        costs,
        seconds: [
            Some(("synthesis", synthesis.as_secs_f64())),
            traced.then_some(("trace", tracing.as_secs_f64())),
            Some(("costs", start.elapsed().saturating_sub(made).as_secs_f64())),
        ]
        .into_iter()
        .flatten()
        .collect(),
        notes,
    };
    Ok(Tile { picture, source_map, report, trace })
}

/// Checks everything that can be known before the work; returns the tile's width and height.
fn check(
    photo: &Picture,
    sigma_map: Option<&SigmaMap>,
    params: &TileParams,
) -> Result<(usize, usize)> {
    params.validate()?;
    if params.patch.is_multiple_of(2) {
        return Err(Error::parameter("patch", "odd, so that a patch has a middle", params.patch));
    }
    if params.measure != Measure::Moments && params.order != TileParams::default().order {
        let expected = "left out unless the measure is `moments`";
        return Err(Error::parameter("order", expected, params.order));
    }
    let (width, height) = params.resolved_size(photo.width(), photo.height());
    let sides = 1..=MAX_TILE_SIDE;
    if !sides.contains(&width) || !sides.contains(&height) {
        let expected = format!("1x1 to {MAX_TILE_SIDE}x{MAX_TILE_SIDE} pixels");
        return Err(Error::parameter("size", expected, format!("{width}x{height}")));
    }
    let too_small = |what: &str, width: usize, height: usize, remedy: &str| Error::TooSmall {
        what: what.into(),
        width,
        height,
        need: params.patch,
        remedy: remedy.into(),
    };
    let (pw, ph) = (photo.width(), photo.height());
    if params.method == Method::MakeSeamless {
        if width > pw || height > ph {
            let expected = format!("at most the photo's {pw}x{ph} with the method make-seamless");
            return Err(Error::parameter("size", expected, format!("{width}x{height}")));
        }
    } else if pw.min(ph) < params.patch {
        return Err(too_small("the photo", pw, ph, "choose a smaller patch or a larger photo"));
    } else if width.min(height) < params.patch {
        return Err(too_small(
            "the tile",
            width,
            height,
            "choose a smaller patch or a larger size",
        ));
    }
    photo.ensure_finite("the photo")?;
    if let Some(map) = sigma_map {
        map.ensure_size(height, width)?;
    }
    // A filtered channel is eleven planes of floats; a sigma map has up to eight planes of weights.
    let filtered = if params.measure == Measure::Steerable { 44 } else { 0 };
    let mapped = if sigma_map.is_some() { 48 } else { 0 };
    let pixel = filtered + mapped + (photo.byte_len() / (pw * ph)) as u64;
    let need = stationary::memory_bytes((ph, pw), (height, width))
        .checked_add((width * height) as u64 * pixel);
    ensure_available(&format!("a {width}x{height} tile from a {pw}x{ph} photo"), need)?;
    Ok((width, height))
}

/// Where the photo may be used: the caller's mask and the photo's own alpha; `None` is everywhere.
pub(super) fn usable_mask(photo: &Picture, mask: Option<&Mask>) -> Result<Option<Mask>> {
    if let Some(mask) = mask {
        mask.ensure_size(photo.height(), photo.width())?;
    }
    let both = match (mask, Mask::from_alpha(photo)) {
        (Some(mask), Some(alpha)) => Some(mask.and(&alpha)?),
        (Some(mask), None) => Some(mask.clone()),
        (None, alpha) => alpha,
    };
    Ok(both.filter(|m| m.count() < m.usable().len()))
}

fn plan(
    params: &TileParams,
    sigma_map: Option<&SigmaMap>,
    size: (usize, usize),
    wrap: Wrap,
) -> stationary::Plan {
    let even = params.method == Method::Stationary;
    let wraps = params.method != Method::NoWrap;
    let (coarse_iterations, fine_iterations) = match params.quality {
        Quality::Draft => (20, 1),
        Quality::Normal => (60, 2),
        Quality::Best => (120, 6),
    };
    stationary::Plan {
        size,
        wrap: Wrap { y: wrap.y && wraps, x: wrap.x && wraps },
        evenness: params.evenness(sigma_map).filter(|_| even),
        patch: params.patch,
        uniformity: params.uniformity,
        rarity: if even { params.rarity } else { 0.0 },
        coarse_iterations,
        fine_iterations,
    }
}

fn costs(
    photo: &Picture,
    picture: &Picture,
    map: Option<&SourceMap>,
    params: &TileParams,
    sigma_map: Option<&SigmaMap>,
    wrap: Wrap,
) -> Costs {
    let model = ColorModel::new(photo);
    let mut pixels = model.averaging_pixels(picture);
    model.space().convert_row(&mut pixels);
    let (height, width) = (picture.height(), picture.width());
    let domain = Domain { height, width, wrap_y: wrap.y, wrap_x: wrap.x };
    let sigma = f64::from(params.sigma) * height.min(width) as f64;
    let stationarity = stationarity::histogram_cost(&pixels, domain, sigma);
    let by_measure = |evenness: stationary::Evenness| match evenness.statistic {
        Statistic::Histogram if sigma_map.is_none() => stationarity,
        other => other.cost(&pixels, domain, &evenness.window((height, width), domain)),
    };
    Costs {
        texture: map.map(|map| texture::cost_bound(picture, photo, map, params.patch, wrap)),
        stationarity,
        stationarity_by_measure: params.evenness(sigma_map).map(by_measure),
    }
}
