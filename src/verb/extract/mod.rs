//! [`extract`]: the representative tile of a near-periodic photo.

mod params;
mod period;
mod prepare;
pub mod wang;
mod wang_files;

use std::time::Instant;

use serde::Serialize;
use serde_json::json;

use crate::base::ctx::Ctx;
use crate::base::error::{Error, Result};
use crate::base::memory::ensure_available;
use crate::base::record::{record_of, typed_params};
use crate::image::mask::Mask;
use crate::image::material::MapKind;
use crate::image::picture::Picture;
use crate::image::sheet;
use crate::image::sourcemap::SourceMap;
use crate::image::symmetry::Symmetry;
use crate::method::representative::{self, Codes, Costs, Frame, Place};
use crate::method::stationary::{self, Exemplar, Kept, Periods};
use crate::search::patchmatch::Wrap;
use crate::signal::basis::Basis;
use crate::verb::params::TileParams;

pub use params::{ExtractParams, PeriodSource, Scaling, WangParams};
use period::colors;
use prepare::{Prepared, prepare};

/// Longest side of a cell of the contact sheet, in pixels.
const SHOWN: usize = 384;

/// Patch side of the band, at most and at least.
const MOST_PATCH: usize = 11;
const LEAST_PATCH: usize = 5;

/// Where a photo's period was found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FoundPeriod {
    /// Displacements, in pixels of the photo to the right and downwards, after which it is nearly the
    /// same: one nearly to the right, one nearly downwards.
    pub sides: Basis,
    /// `ssd`, `lattice`, or `given`.
    pub by: &'static str,
    /// How sure it is that the photo repeats so, in 0..=1; `None` if the period was given.
    pub confidence: Option<f64>,
}

/// How tiles were extracted.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ExtractReport {
    /// Version of texforge.
    pub version: &'static str,
    /// Seed of the band's random choices; nothing else is random.
    pub seed: u64,
    /// Every parameter as text.
    pub params: Vec<(&'static str, String)>,
    /// Width and height of the photo in pixels.
    pub photo_size: (usize, usize),
    /// The period of the photo.
    pub period: FoundPeriod,
    /// Width and height of a tile in pixels.
    pub tile_size: (usize, usize),
    /// By what the photo's width and height were multiplied: 1 if it was left as it is.
    pub scale: (f64, f64),
    /// Width and height of the photo after that, in which positions are counted.
    pub scaled_size: (usize, usize),
    /// The weight of continuity that was used.
    pub alpha: f64,
    /// That of resemblance.
    pub beta: f64,
    /// How many positions were possible.
    pub positions: usize,
    /// Wall time in seconds of each stage, in order. The only part that differs between runs.
    pub seconds: Vec<(&'static str, f64)>,
    /// What the user should know, one sentence each.
    pub notes: Vec<String>,
}

/// One tile of [`extract`].
#[derive(Debug, Clone)]
pub struct ExtractedTile {
    /// The tile, in the photo's own sample type.
    pub picture: Picture,
    /// Where it lies in the scaled photo, and how good it is there, in CIE L*a*b* units, squared unless
    /// the similarity is absolute. Of the tile as cut out: a band is made anew after that.
    pub place: Place,
    /// Where its upper left corner lies in the photo as it is: pixels to the right and downwards.
    pub photo_place: [f64; 2],
    /// Which pixel of the scaled photo each of its pixels is a copy of.
    map: SourceMap,
}

/// The result of [`extract`].
#[derive(Debug, Clone)]
pub struct Extraction {
    /// The tiles, the best first.
    pub tiles: Vec<ExtractedTile>,
    /// How they were made.
    pub report: ExtractReport,
    frame: Frame,
}

impl Extraction {
    /// Which pixel of the photo each pixel of tile `i` is a copy of; `None` if the photo was scaled.
    pub fn source_map(&self, i: usize) -> Option<&SourceMap> {
        self.frame.is_plain().then_some(&self.tiles[i].map)
    }

    /// The tiling of tile `i`: as large as the scaled photo, the tile where it was found.
    ///
    /// # Errors
    /// None that a tile of ours can cause.
    pub fn tiling(&self, i: usize) -> Result<Picture> {
        let ExtractedTile { picture, place, .. } = &self.tiles[i];
        let size @ (h, w) = self.frame.size();
        let (th, tw) = (picture.height(), picture.width());
        let from = |i: usize, at: usize, n: usize| ((i + n - at % n) % n) as u32;
        let yx = (0..h * w).map(|i| [from(i / w, place.y, th), from(i % w, place.x, tw)]);
        SourceMap::new(size, (th, tw), yx.collect())?.apply(picture, MapKind::Color)
    }

    /// How tile `i` was made, for its file: JSON that holds nothing that differs between equal runs.
    pub(crate) fn record(&self, i: usize) -> String {
        let report = &self.report;
        let params = typed_params(&ExtractParams::schema(), &report.params);
        let mut record = record_of(ExtractParams::VERB, report.version, report.seed, &params);
        record["period"] = json!(report.period.sides);
        record["scale"] = json!(report.scale);
        record["photo_place"] = json!(self.tiles[i].photo_place);
        record.to_string()
    }

    /// Another map of the photo's material, of any resolution, cut at the places of the tiles: their
    /// size and the map's own type.
    ///
    /// # Errors
    /// [`Error::SizeMismatch`] if the map has another aspect ratio than the photo.
    pub fn tiles_of(&self, map: &Picture, kind: MapKind) -> Result<Vec<Picture>> {
        map_in(&self.frame, self.report.photo_size, map, kind, |read| {
            self.tiles.iter().map(|tile| tile.map.apply(read, kind)).collect()
        })
    }

    /// All tiles over all their tilings in one picture, 8 bits a sample, the best on the left.
    ///
    /// # Errors
    /// None that tiles of ours can cause.
    pub fn sheet(&self) -> Result<Picture> {
        let cell = |picture: &Picture| sheet::repeated(picture, 1, SHOWN);
        let tiles = self.tiles.iter().map(|tile| cell(&tile.picture));
        let tilings = (0..self.tiles.len()).map(|i| cell(&self.tiling(i)?));
        sheet::grid(&[tiles.collect::<Result<Vec<_>>>()?, tilings.collect::<Result<Vec<_>>>()?])
    }
}

/// Cuts the tile out of a near-periodic photo that stands best for all of it: repeated, it is most
/// like the photo, and its edges fit each other.
///
/// `photo` is H x W x C: grey, RGB (each with or without alpha), or data of any number of channels.
/// `mask` (size of the photo) says where it may be used; transparent pixels are never used, and what
/// may not be used is not compared.
///
/// # Paper
/// Representative Tile Extraction from near-periodic textures, sec. 3 and 4. All positions are tried
/// (p = 1). Past it, see ARCHITECTURE.md.
///
/// # Determinism
/// Same photo, mask, parameters and `ctx.seed`: same bytes, for any thread count and SIMD level. Only
/// a band makes random choices.
///
/// # Errors
/// [`Error::NoStructure`] if the photo has no period that is sure enough; [`Error::Parameter`],
/// [`Error::TooSmall`] below 16 pixels, [`Error::BadPicture`] if all usable pixels are alike or no
/// tile is wholly usable, [`Error::SizeMismatch`] (mask), [`Error::NotFinite`], [`Error::Memory`],
/// [`Error::Cancelled`].
pub fn extract(
    ctx: &Ctx,
    photo: &Picture,
    mask: Option<&Mask>,
    params: &ExtractParams,
) -> Result<Extraction> {
    let start = Instant::now();
    let Prepared { found, frame, tile, scale, scaled, flags, mut notes } =
        prepare(ctx, photo, mask, params, representative::STEPS)?;
    let analysis = start.elapsed();

    let costs = ctx.install(|| {
        let codes = Codes::new(&colors(&scaled), frame.size(), flags.clone());
        Costs::new(ctx, &codes, tile, params.similarity)
    })?;
    let positions = costs.count();
    if positions == 0 {
        let (h, w) = tile;
        let reason = format!(
            "no piece of {w}x{h} pixels, a tile, is wholly usable; mark more of the photo as usable"
        );
        return Err(Error::BadPicture { what: "the mask".into(), reason });
    }
    let alpha = params.alpha.map_or_else(|| costs.balanced_weight(), f64::from);
    let weights = (alpha, f64::from(params.beta));
    let places = ctx.install(|| {
        Ok(costs.best(weights, f64::from(params.keep), f64::from(params.overlap), params.count))
    })?;
    if places.len() < params.count {
        notes.push(format!(
            "{} of {} tiles: there are no more that overlap as little",
            places.len(),
            params.count
        ));
    }
    let searched = start.elapsed();
    let tiles = cut(ctx, &scaled, flags, &frame, tile, &places, params)?;
    let made = start.elapsed();

    let report = ExtractReport {
        version: env!("CARGO_PKG_VERSION"),
        seed: ctx.seed,
        params: params.show(),
        photo_size: (photo.width(), photo.height()),
        period: found,
        tile_size: (tile.1, tile.0),
        scale,
        scaled_size: (frame.size().1, frame.size().0),
        alpha,
        beta: weights.1,
        positions,
        seconds: vec![
            ("period", analysis.as_secs_f64()),
            ("search", searched.saturating_sub(analysis).as_secs_f64()),
            ("tiles", made.saturating_sub(searched).as_secs_f64()),
        ],
        notes,
    };
    Ok(Extraction { tiles, report, frame })
}

/// What is gathered from another map of the photo (width, height) as the photo was read.
fn map_in<T>(
    frame: &Frame,
    (width, height): (usize, usize),
    map: &Picture,
    kind: MapKind,
    gather: impl FnOnce(&Picture) -> Result<T>,
) -> Result<T> {
    if frame.is_plain() {
        return gather(map);
    }
    // One pixel is gathered: the rules are those of the source map.
    SourceMap::new((1, 1), (height, width), vec![[0, 0]])?.apply(map, kind)?;
    gather(&frame.read(map, kind)?)
}

/// Cuts the tiles out at their places, and makes their border anew if that is asked for.
fn cut(
    ctx: &Ctx,
    scaled: &Picture,
    flags: Option<Vec<bool>>,
    frame: &Frame,
    tile: (usize, usize),
    places: &[Place],
    params: &ExtractParams,
) -> Result<Vec<ExtractedTile>> {
    let (size, wrap) = (frame.size(), Wrap { y: true, x: true });
    let usable = flags.map(|flags| Mask::new(size.0, size.1, flags)).transpose()?;
    let band = params.band;
    let (th, tw) = tile;
    let plan = stationary::Plan {
        size: tile,
        wrap,
        evenness: None,
        // As large as fits the band, and odd.
        patch: (band.saturating_sub(1) / 2 * 2 + 1).clamp(LEAST_PATCH, MOST_PATCH),
        uniformity: TileParams::default().uniformity,
        rarity: 0.0,
        // The band comes from the same place of other periods.
        periods: Some(Periods::Lattice {
            vectors: [[tw as f64, 0.0], [0.0, th as f64]],
            of_output: [[1.0, 0.0], [0.0, 1.0]],
        }),
        kept: None,
        coarse_iterations: 30,
        fine_iterations: 2,
    };
    let whole = |place: &Place| {
        let yx = |i: usize| [(place.y + i / tw) as u32, (place.x + i % tw) as u32];
        SourceMap::new(tile, size, (0..th * tw).map(yx).collect())
    };
    if band > 0 {
        let need = stationary::memory_bytes(&[size], &Symmetry::ALL[..1], tile);
        ensure_available("the band", need)?;
    }
    let banded = |i: usize, place: &Place| {
        // The search holds that the first pixels of output and source are in phase, so the source
        // begins whole tiles before the place.
        let (top, left) = (place.y % th, place.x % tw);
        let (h, w) = (size.0 - top, size.1 - left);
        let from = |i: usize| [top + i / w, left + i % w];
        let yx = (0..h * w).map(|i| from(i).map(|v| v as u32)).collect();
        let piece = SourceMap::new((h, w), size, yx)?.apply(scaled, MapKind::Color)?;
        let flag = |mask: &Mask| {
            (0..h * w).map(|i| mask.usable()[from(i)[0] * size.1 + from(i)[1]]).collect()
        };
        let mask = usable.as_ref().map(|mask| Mask::new(h, w, flag(mask))).transpose()?;
        let corner = (place.y - top, place.x - left);
        let kept = Kept::cutout((h, w), corner, None, tile, band, wrap)?;
        let plan = stationary::Plan { kept: Some(kept), ..plan.clone() };
        let map = ctx.install(|| {
            let photos = [(&piece, mask.as_ref())];
            let exemplar = Exemplar::new(ctx, &photos, &Symmetry::ALL[..1], &plan, false)?;
            if i == 0 {
                ctx.begin(exemplar.work(&plan) * places.len() as u64);
            }
            stationary::run(ctx, &exemplar, &plan, None)
        })?;
        let moved = map.positions().iter().map(|[y, x]| [y + top as u32, x + left as u32]);
        SourceMap::new(tile, size, moved.collect())
    };
    let cut = |(i, place): (usize, &Place)| {
        let map = if band > 0 { banded(i, place)? } else { whole(place)? };
        let picture = map.apply(scaled, MapKind::Color)?;
        let photo_place = frame.place([place.x as f64, place.y as f64]);
        Ok(ExtractedTile { picture, place: *place, photo_place, map })
    };
    places.iter().enumerate().map(cut).collect()
}
