//! [`tile`]: a photo becomes a texture that repeats.

use std::time::{Duration, Instant};

use serde::Serialize;

use crate::analyze::{stationarity, texture};
use crate::base::ctx::Ctx;
use crate::base::error::{Error, Result};
use crate::base::memory::ensure_available;
use crate::base::params::Value as _;
use crate::image::color::ColorModel;
use crate::image::mask::Mask;
use crate::image::material::MapKind;
use crate::image::picture::Picture;
use crate::image::rect::Rect;
use crate::image::sigma_map::SigmaMap;
use crate::image::sourcemap::SourceMap;
use crate::method::make_seamless;
use crate::method::stationary::{self, Exemplar, Kept};
use crate::search::patchmatch::Wrap;
use crate::signal::measure::Statistic;
use crate::signal::window::Domain;
use crate::verb::inputs::Inputs;
use crate::verb::params::{Axis, Measure, Method, Quality, Size, Symmetries, TileParams};

/// Longest side of a tile, in pixels.
const MAX_TILE_SIDE: usize = 32_768;

/// Most tiles of one run.
pub const MAX_VARIANTS: usize = 1000;

/// Least radius of the flattening: what is smaller than this share of the photo is texture.
const LEAST_FLATTEN: f32 = 0.02;

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
    /// Width and height of the further photos.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub also_sizes: Vec<(usize, usize)>,
    /// Width and height of the tile in pixels.
    pub tile_size: (usize, usize),
    /// The costs.
    pub costs: Costs,
    /// The rectangle that was made anew, if the rest of the tile was given.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub redo: Option<Rect>,
    /// Wall time in seconds of each stage, in order; `analysis` is that of the photo, which the
    /// variants of a run share. The only part that differs between runs.
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
    /// The tile, in the photo's own sample type; of the flattened photo's pixels if it was flattened.
    pub picture: Picture,
    /// Which pixel of which photo each pixel of the tile is a copy of; `None` for
    /// [`Method::MakeSeamless`], which blends.
    pub source_map: Option<SourceMap>,
    /// How it was made and what it costs.
    pub report: Report,
    /// The costs of every iteration, coarse to fine; empty unless [`Inputs::trace`] is set, and with
    /// [`Method::MakeSeamless`], which has no iterations.
    pub trace: Vec<Step>,
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
/// [`Error::EmptyMask`], [`Error::SizeMismatch`] (masks), [`Error::NotFinite`], [`Error::Memory`]
/// (checked before anything is allocated), [`Error::Cancelled`].
pub fn tile(ctx: &Ctx, photo: &Picture, mask: Option<&Mask>, params: &TileParams) -> Result<Tile> {
    let one = tiles(ctx, &Inputs { mask, ..Inputs::new(photo) }, params, 1)?.pop();
    one.ok_or_else(|| Error::Internal { message: "no tile came back".into() })
}

/// As [`tile`], with everything that a tile can be made from, and several times: `count` tiles
/// whose seeds are `ctx.seed` and those after it. What is learnt about the photo is learnt once.
///
/// # Paper
/// Moritz et al. 2017, Fig. 10: with a sigma map, a locally prescribed reach. Statistics are computed
/// under windows of a few sizes and their mappings blended at every pixel.
///
/// # Errors
/// As [`tile`]; [`Error::SizeMismatch`] (sigma map); [`Error::Parameter`] for a `count` that is not 1 to 1000 (1 with
/// [`Method::MakeSeamless`], which makes no random choices) and for seeds beyond the last one.
pub fn tiles(
    ctx: &Ctx,
    inputs: &Inputs<'_>,
    params: &TileParams,
    count: usize,
) -> Result<Vec<Tile>> {
    let start = Instant::now();
    let (width, height) = check(inputs, params, count)?;
    let last = ctx.seed.checked_add(count as u64 - 1);
    if last.is_none() {
        let expected = format!("at most {} with {count} variants", u64::MAX - (count as u64 - 1));
        return Err(Error::parameter("seed", expected, ctx.seed));
    }
    let wrap = Wrap { y: params.axis != Axis::X, x: params.axis != Axis::Y };
    let masks = inputs.usable(params)?;
    let mut notes = Vec::new();
    if masks[0].is_some() && params.method == Method::MakeSeamless {
        notes.push("the method make-seamless uses the whole photo; the mask is ignored".to_owned());
    }
    if inputs.sigma_map.is_some()
        && (params.method != Method::Stationary || params.measure == Measure::None)
    {
        notes.push("nothing is made stationary; the sigma map changes no pixel".to_owned());
    }
    let mut plan = plan(params, inputs.sigma_map, (height, width), wrap);
    if params.band > 0 {
        let photo = (inputs.photo.height(), inputs.photo.width());
        let usable = masks[0].as_ref().map(Mask::usable);
        plan.kept = Some(Kept::middle(photo, usable, (height, width), params.band, wrap)?);
    }
    if let Some(redo) = &inputs.redo {
        plan.kept = Some(Kept::outside(redo.of.clone(), redo.rect));
    }
    let (flat, exemplar) = ctx.install(|| {
        let flat = inputs.flattened(&masks, params, &mut notes)?;
        if params.method == Method::MakeSeamless {
            return Ok((flat, None));
        }
        let photos = inputs.photos(flat.as_deref());
        let photos: Vec<_> = photos.into_iter().zip(masks.iter().map(Option::as_ref)).collect();
        let exemplar = Exemplar::new(ctx, &photos, params.symmetry.list(), &plan, inputs.trace)?;
        Ok((flat, Some(exemplar)))
    })?;
    let photos = inputs.photos(flat.as_deref());
    let analysed = start.elapsed();
    ctx.begin(exemplar.as_ref().map_or(0, |e| e.work(&plan) * count as u64));
    let mut resolved = params.clone();
    resolved.size = Size::Pixels { width, height };
    let make = |seed: u64| {
        let start = Instant::now();
        let ctx = ctx.with_seed(seed);
        let measured = |photos: &[&Picture], picture: &Picture, map: Option<&SourceMap>| {
            costs(photos, picture, map, params, inputs.sigma_map, wrap)
        };
        let (mut trace, mut tracing) = (Vec::new(), Duration::ZERO);
        let mut look = |look: &stationary::Look<'_>| {
            let since = Instant::now();
            let photos: Vec<&Picture> = look.photos.iter().collect();
            let picture = look.map.apply_all(&photos, MapKind::Color)?;
            let costs = measured(&photos, &picture, Some(&look.map));
            trace.push(Step { level: look.level, iteration: look.iteration, costs });
            tracing += since.elapsed();
            Ok(())
        };
        let watch: Option<stationary::Watch<'_>> =
            if inputs.trace { Some(&mut look) } else { None };
        let (picture, source_map) = ctx.install(|| match &exemplar {
            None => Ok((make_seamless::run(photos[0], (height, width), wrap)?, None)),
            Some(exemplar) => {
                let map = stationary::run(&ctx, exemplar, &plan, watch)?;
                Ok((map.apply_all(&photos, MapKind::Color)?, Some(map)))
            }
        })?;
        let made = start.elapsed();
        let costs = ctx.install(|| Ok(measured(&photos, &picture, source_map.as_ref())))?;
        let report = Report {
            version: env!("CARGO_PKG_VERSION"),
            seed,
            params: resolved.show(),
            photo_size: (photos[0].width(), photos[0].height()),
            also_sizes: photos[1..].iter().map(|p| (p.width(), p.height())).collect(),
            tile_size: (width, height),
            redo: inputs.redo.map(|redo| redo.rect),
            costs,
            seconds: [
                Some(("analysis", analysed.as_secs_f64())),
                Some(("synthesis", made.saturating_sub(tracing).as_secs_f64())),
                inputs.trace.then_some(("trace", tracing.as_secs_f64())),
                Some(("costs", start.elapsed().saturating_sub(made).as_secs_f64())),
            ]
            .into_iter()
            .flatten()
            .collect(),
            notes: notes.clone(),
        };
        Ok(Tile { picture, source_map, report, trace })
    };
    (0..count as u64).map(|i| make(ctx.seed + i)).collect()
}

/// Checks everything that can be known before the work; returns the tile's width and height.
fn check(inputs: &Inputs<'_>, params: &TileParams, count: usize) -> Result<(usize, usize)> {
    params.validate()?;
    if !(1..=MAX_VARIANTS).contains(&count) {
        return Err(Error::parameter("variants", format!("1 to {MAX_VARIANTS}"), count));
    }
    if count > 1 && params.method == Method::MakeSeamless {
        let expected = "1 with the method make-seamless, which makes no random choices";
        return Err(Error::parameter("variants", expected, count));
    }
    if params.flatten > 0.0 && params.flatten < LEAST_FLATTEN {
        let expected = format!("0 (off) or {LEAST_FLATTEN} to 1; less is texture, not light");
        return Err(Error::parameter("flatten", expected, params.flatten));
    }
    if params.patch.is_multiple_of(2) {
        return Err(Error::parameter("patch", "odd, so that a patch has a middle", params.patch));
    }
    if params.measure != Measure::Moments && params.order != TileParams::default().order {
        let expected = "left out unless the measure is `moments`";
        return Err(Error::parameter("order", expected, params.order));
    }
    let photo = inputs.photo;
    let (width, height) = match &inputs.redo {
        Some(redo) => redo.tile_size(params)?,
        None => params.resolved_size(photo.width(), photo.height()),
    };
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
    } else if width.min(height) < params.patch {
        return Err(too_small(
            "the tile",
            width,
            height,
            "choose a smaller patch or a larger size",
        ));
    }
    if params.band > 0 {
        check_band(params, (pw, ph), (width, height))?;
    }
    let photos = inputs.photos(None);
    if let Some(redo) = &inputs.redo {
        redo.check(&photos, params)?;
    }
    for (i, photo) in photos.iter().enumerate() {
        let what = if i == 0 { "the photo".to_owned() } else { format!("photo {}", i + 1) };
        let (pw, ph) = (photo.width(), photo.height());
        if params.method != Method::MakeSeamless && pw.min(ph) < params.patch {
            return Err(too_small(&what, pw, ph, "choose a smaller patch or a larger photo"));
        }
        photo.ensure_like(photos[0], &what)?;
        photo.ensure_finite(&what)?;
    }
    if params.method == Method::MakeSeamless {
        let expected = "left out with the method make-seamless, which uses one photo as it lies";
        if photos.len() > 1 {
            return Err(Error::parameter("also", expected, photos.len() - 1));
        }
        if params.symmetry != Symmetries::None {
            return Err(Error::parameter("symmetry", expected, params.symmetry.show()));
        }
    }
    if let Some(map) = inputs.sigma_map {
        map.ensure_size(height, width)?;
    }
    // A filtered channel is eleven planes of floats; a sigma map has up to eight planes of weights.
    let filtered = if params.measure == Measure::Steerable { 44 } else { 0 };
    let mapped = if inputs.sigma_map.is_some() { 48 } else { 0 };
    // What is kept: the source map (12), and at a level its pixels and patches (20).
    let kept = if inputs.redo.is_some() { 32 } else { 0 };
    let measured = (width * height) as u64 * (filtered + mapped + kept);
    // Every tile with its source map stays until the last is made; flattened photos are copies.
    let tile = (width * height) as u64 * (photo.byte_len() / (pw * ph)) as u64;
    let others = (tile + 12 * (width * height) as u64).checked_mul(count as u64 - 1);
    let bytes: u64 = photos.iter().map(|photo| photo.byte_len() as u64).sum();
    let flat = if params.flatten > 0.0 { bytes } else { 0 };
    let sizes: Vec<_> = photos.iter().map(|photo| (photo.height(), photo.width())).collect();
    let symmetries = params.symmetry.list();
    let work = stationary::memory_bytes(&sizes, symmetries, (height, width));
    let need = others
        .zip(work)
        .and_then(|(others, work)| work.checked_add(tile + flat + measured + others));
    let what = if count > 1 { format!("{count} tiles of") } else { "a tile of".to_owned() };
    let from = match photos.len() * symmetries.len() {
        1 => format!("a {pw}x{ph} photo"),
        views => format!("{views} views of photos of {pw}x{ph} and so on"),
    };
    ensure_available(&format!("{what} {width}x{height} from {from}"), need)?;
    Ok((width, height))
}

/// Checks that a border of `params.band` pixels leaves a middle that the photo has.
fn check_band(
    params: &TileParams,
    (photo_width, photo_height): (usize, usize),
    (width, height): (usize, usize),
) -> Result<()> {
    if !matches!(params.method, Method::Stationary | Method::WrapOnly) {
        let expected = "0 unless the method is stationary or wrap-only";
        return Err(Error::parameter("band", expected, params.band));
    }
    if width > photo_width || height > photo_height {
        let expected = format!("at most the photo's {photo_width}x{photo_height} with a band");
        return Err(Error::parameter("size", expected, format!("{width}x{height}")));
    }
    let side = match params.axis {
        Axis::Both => width.min(height),
        Axis::X => width,
        Axis::Y => height,
    };
    let most = side.saturating_sub(1) / 2;
    if params.band < params.patch || params.band > most {
        let least = params.patch;
        let expected = format!(
            "{least} (the patch side) to {most}, which leaves a middle of {width}x{height}"
        );
        return Err(Error::parameter("band", expected, params.band));
    }
    Ok(())
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
        Quality::Draft => (12, 1),
        Quality::Normal => (30, 2),
        Quality::Best => (60, 6),
    };
    stationary::Plan {
        size,
        wrap: Wrap { y: wrap.y && wraps, x: wrap.x && wraps },
        evenness: params.evenness(sigma_map).filter(|_| even),
        patch: params.patch,
        uniformity: params.uniformity,
        rarity: if even { params.rarity } else { 0.0 },
        kept: None,
        coarse_iterations,
        fine_iterations,
    }
}

fn costs(
    photos: &[&Picture],
    picture: &Picture,
    map: Option<&SourceMap>,
    params: &TileParams,
    sigma_map: Option<&SigmaMap>,
    wrap: Wrap,
) -> Costs {
    let model = ColorModel::new(photos[0]);
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
        texture: map.map(|map| texture::cost_bound(picture, photos, map, params.patch, wrap)),
        stationarity,
        stationarity_by_measure: params.evenness(sigma_map).map(by_measure),
    }
}
