//! [`tile`]: a photo becomes a texture that repeats.

use serde::Serialize;

use crate::base::ctx::Ctx;
use crate::base::error::{Error, Result};
use crate::base::params::{Value, choice, params};
use crate::image::mask::Mask;
use crate::image::picture::Picture;
use crate::image::sourcemap::SourceMap;
use crate::method::stationary;
use crate::search::patchmatch::Wrap;

/// Size of the tile.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Size {
    /// The largest power of two that fits into the photo, at most 2048; square unless the photo
    /// is at least twice as long as it is wide.
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

params! {
    /// Parameters of [`tile`].
    pub struct TileParams for "tile" {
        /// Size of the tile: WIDTHxHEIGHT, or auto for the largest power of two that fits into the photo.
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
    }
}

/// What the finished tile costs, measured on the delivered picture. Lower is better.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Costs {
    /// Texture cost: mean over pixels of the squared CIE L*a*b* distance per patch pixel between
    /// the tile's patch and the photo's patch named by the source map (paper eq. 5). An upper
    /// bound of the exact cost, which takes the best patch of the whole photo.
    pub texture: f64,
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
    /// Width and height of the tile in pixels.
    pub tile_size: (usize, usize),
    /// The costs.
    pub costs: Costs,
    /// Wall time in seconds of each stage, in order. The only part that differs between runs.
    pub seconds: Vec<(&'static str, f64)>,
    /// What the user should know, one sentence each.
    pub notes: Vec<String>,
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
}

impl TileParams {
    /// Width and height of the tile for a photo of this size: `size`, or the default if it is
    /// [`Size::Auto`].
    pub fn resolved_size(&self, photo_width: usize, photo_height: usize) -> (usize, usize) {
        if let Size::Pixels { width, height } = self.size {
            return (width, height);
        }
        let pow2 = |n: usize| (1 << n.max(1).ilog2()).min(2048);
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
/// [`Error::EmptyMask`], [`Error::SizeMismatch`] (mask), [`Error::NotFinite`], [`Error::Memory`]
/// (checked before anything is allocated), [`Error::Cancelled`].
pub fn tile(ctx: &Ctx, photo: &Picture, mask: Option<&Mask>, params: &TileParams) -> Result<Tile> {
    params.validate()?;
    let (width, height) = params.resolved_size(photo.width(), photo.height());
    let plan = stationary::Plan {
        size: (height, width),
        wrap: Wrap { y: params.axis != Axis::X, x: params.axis != Axis::Y },
        sigma: (params.method == Method::Stationary && params.measure != Measure::None)
            .then_some(params.sigma),
        patch: params.patch,
        uniformity: params.uniformity,
        coarse_iterations: 30,
        fine_iterations: 2,
    };
    let output = ctx.install(|| stationary::run(ctx, photo, mask, &plan))?;
    let picture = output.source_map.apply(photo, crate::MapKind::Data)?;
    let report = Report {
        version: env!("CARGO_PKG_VERSION"),
        seed: ctx.seed,
        params: params.show(),
        photo_size: (photo.width(), photo.height()),
        tile_size: (width, height),
        costs: Costs { texture: 0.0, stationarity: 0.0 },
        seconds: vec![],
        notes: vec![],
    };
    Ok(Tile { picture, source_map: Some(output.source_map), report })
}
