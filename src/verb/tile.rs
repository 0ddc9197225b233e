//! [`tile`]: a photo becomes a texture that repeats.

use std::time::Instant;

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
use crate::image::sourcemap::SourceMap;
use crate::image::symmetry::Symmetry;
use crate::method::make_seamless;
use crate::method::stationary::{self, Exemplar};
use crate::search::patchmatch::Wrap;
use crate::signal::localhist::Domain;
use crate::verb::inputs::Inputs;

/// Longest side of a tile, in pixels.
const MAX_TILE_SIDE: usize = 32_768;

/// Most tiles of one run.
pub const MAX_VARIANTS: usize = 1000;

/// Least radius of the flattening: what is smaller than this share of the photo is texture.
const LEAST_FLATTEN: f32 = 0.02;

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
        /// Local histograms of each colour channel.
        Histogram = "histogram",
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

choice! {
    /// In which symmetries the photo's patches are used.
    pub enum Symmetries {
        /// As they lie.
        None = "none",
        /// Mirrored left to right as well.
        Mirror = "mirror",
        /// In all four quarter turns.
        Rotate = "rotate",
        /// Mirrored and turned: all eight.
        All = "all",
    }
}

impl Symmetries {
    /// All that are in it; the first is the photo as it lies.
    pub fn list(self) -> &'static [Symmetry] {
        const MIRROR: [Symmetry; 2] = [Symmetry::ALL[0], Symmetry::ALL[4]];
        match self {
            Self::None => &Symmetry::ALL[..1],
            Self::Mirror => &MIRROR,
            Self::Rotate => &Symmetry::ALL[..4],
            Self::All => &Symmetry::ALL,
        }
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
        /// Reach of the stationarity measure: smaller evens out smaller stains, larger keeps more variety.
        sigma: f32 = 0.1, in 0.01..=1.0, unit "fraction of the tile's shorter side";
        /// Side of the patches that are compared; odd. Larger keeps larger features whole, smaller mixes more.
        patch: usize = 11, in 3..=21, unit "px";
        /// How strongly every part of the photo is made to contribute equally; 0 switches it off.
        uniformity: f32 = 1.0, in 0.0..=100.0;
        /// How much time to spend.
        quality: Quality = Quality::Normal;
        /// How far the marks of the avoid mask are grown: nothing this near to a mark is copied.
        avoid_grow: usize = 0, in 0..=10000, unit "px";
        /// Reach of the light flattening, 0.02 or more: differences of light that are wider are taken out of the photo first; 0 switches it off.
        flatten: f32 = 0.0, in 0.0..=1.0, unit "fraction of the photo's shorter side";
        /// Whether patches are also used mirrored left to right, turned by quarters, or both: more to choose from, but light then falls from several sides.
        symmetry: Symmetries = Symmetries::None;
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
    /// Wall time in seconds of each stage, in order; `analysis` is that of the photo, which the
    /// variants of a run share. The only part that differs between runs.
    pub seconds: Vec<(&'static str, f64)>,
    /// What the user should know, one sentence each.
    pub notes: Vec<String>,
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
/// # Errors
/// As [`tile`]; [`Error::Parameter`] for a `count` that is not 1 to 1000 (1 with
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
    let plan = plan(params, (height, width), wrap);
    let (flat, exemplar) = ctx.install(|| {
        let flat = inputs.flattened(&masks, params, &mut notes)?;
        if params.method == Method::MakeSeamless {
            return Ok((flat, None));
        }
        let photos = inputs.photos(flat.as_deref());
        let photos: Vec<_> = photos.into_iter().zip(masks.iter().map(Option::as_ref)).collect();
        let exemplar = Exemplar::new(ctx, &photos, params.symmetry.list(), &plan)?;
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
        let (picture, source_map) = ctx.install(|| match &exemplar {
            None => Ok((make_seamless::run(photos[0], (height, width), wrap)?, None)),
            Some(exemplar) => {
                let map = stationary::run(&ctx, exemplar, &plan)?;
                Ok((map.apply_all(&photos, MapKind::Color)?, Some(map)))
            }
        })?;
        let made = start.elapsed();
        let costs =
            ctx.install(|| Ok(costs(&photos, &picture, source_map.as_ref(), params, wrap)))?;
        let report = Report {
            version: env!("CARGO_PKG_VERSION"),
            seed,
            params: resolved.show(),
            photo_size: (photos[0].width(), photos[0].height()),
            also_sizes: photos[1..].iter().map(|p| (p.width(), p.height())).collect(),
            tile_size: (width, height),
            costs,
            seconds: vec![
                ("analysis", analysed.as_secs_f64()),
                ("synthesis", made.as_secs_f64()),
                ("costs", start.elapsed().saturating_sub(made).as_secs_f64()),
            ],
            notes: notes.clone(),
        };
        Ok(Tile { picture, source_map, report })
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
    let photo = inputs.photo;
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
    } else if width.min(height) < params.patch {
        return Err(too_small(
            "the tile",
            width,
            height,
            "choose a smaller patch or a larger size",
        ));
    }
    let photos = inputs.photos(None);
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
    // Every tile with its source map stays until the last is made; flattened photos are copies.
    let tile = (width * height) as u64 * (photo.byte_len() / (pw * ph)) as u64;
    let others = (tile + 12 * (width * height) as u64).checked_mul(count as u64 - 1);
    let bytes: u64 = photos.iter().map(|photo| photo.byte_len() as u64).sum();
    let flat = if params.flatten > 0.0 { bytes } else { 0 };
    let sizes: Vec<_> = photos.iter().map(|photo| (photo.height(), photo.width())).collect();
    let symmetries = params.symmetry.list();
    let work = stationary::memory_bytes(&sizes, symmetries, (height, width));
    let need = others.zip(work).and_then(|(others, work)| work.checked_add(tile + flat + others));
    let what = if count > 1 { format!("{count} tiles of") } else { "a tile of".to_owned() };
    let from = match photos.len() * symmetries.len() {
        1 => format!("a {pw}x{ph} photo"),
        views => format!("{views} views of photos of {pw}x{ph} and so on"),
    };
    ensure_available(&format!("{what} {width}x{height} from {from}"), need)?;
    Ok((width, height))
}

fn plan(params: &TileParams, size: (usize, usize), wrap: Wrap) -> stationary::Plan {
    let even = params.method == Method::Stationary && params.measure != Measure::None;
    let wraps = params.method != Method::NoWrap;
    let (coarse_iterations, fine_iterations) = match params.quality {
        Quality::Draft => (12, 1),
        Quality::Normal => (30, 2),
        Quality::Best => (60, 6),
    };
    stationary::Plan {
        size,
        wrap: Wrap { y: wrap.y && wraps, x: wrap.x && wraps },
        sigma: even.then_some(params.sigma),
        patch: params.patch,
        uniformity: params.uniformity,
        coarse_iterations,
        fine_iterations,
    }
}

fn costs(
    photos: &[&Picture],
    picture: &Picture,
    map: Option<&SourceMap>,
    params: &TileParams,
    wrap: Wrap,
) -> Costs {
    let model = ColorModel::new(photos[0]);
    let mut pixels = model.averaging_pixels(picture);
    model.space().convert_row(&mut pixels);
    let (height, width) = (picture.height(), picture.width());
    let domain = Domain { height, width, wrap_y: wrap.y, wrap_x: wrap.x };
    let sigma = f64::from(params.sigma) * height.min(width) as f64;
    Costs {
        texture: map.map(|map| texture::cost_bound(picture, photos, map, params.patch, wrap)),
        stationarity: stationarity::histogram_cost(&pixels, domain, sigma),
    }
}
