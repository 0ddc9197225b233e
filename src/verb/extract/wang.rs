//! [`wang`]: a set of Wang tiles of a near-periodic photo.

use std::time::Instant;

use serde::Serialize;

use crate::base::ctx::Ctx;
use crate::base::error::{Error, Result};
use crate::base::memory::ensure_available;
use crate::image::color::ColorModel;
use crate::image::mask::Mask;
use crate::image::material::MapKind;
use crate::image::picture::{Encoding, Picture, Samples};
use crate::image::sourcemap::SourceMap;
use crate::method::representative::Frame;
use crate::method::wang::{self as method, Grid};
use crate::search::patch::codes::Codes;
use crate::signal::resample::resized;
use crate::verb::extract::params::{ExtractParams, WangParams};
use crate::verb::extract::prepare::{Prepared, prepare};
use crate::verb::extract::{FoundPeriod, map_in};

pub use crate::method::wang::{Edges, TileSet};
pub use crate::verb::extract::wang_files::{WangFile, WangFileContent, wang_file_names};

/// Least side of a tile: two samples have to be joined in a quarter of it.
const LEAST_TILE: usize = 8;

/// Pixels of a period, at most, when it is found out where tiles should begin.
const COARSE: usize = 64;

/// Most tiles of a plane.
const MOST_LAID: usize = 1 << 24;

/// How a set was made.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct WangReport {
    /// Version of texforge.
    pub version: &'static str,
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
    /// The colours of the tiles' edges, in the order of the atlas, row by row.
    pub tiles: Vec<Edges>,
    /// Columns and rows of the atlas.
    pub atlas: (usize, usize),
    /// Wall time in seconds of each stage, in order. The only part that differs between runs.
    pub seconds: Vec<(&'static str, f64)>,
    /// What the user should know, one sentence each.
    pub notes: Vec<String>,
}

/// The result of [`wang`].
#[derive(Debug, Clone)]
pub struct WangSet {
    /// All tiles in one picture, in the photo's own sample type. Neighbours in it fit, around its edges
    /// too.
    pub atlas: Picture,
    /// How it was made.
    pub report: WangReport,
    /// Which tiles there are.
    pub set: TileSet,
    /// Height and width of a tile.
    pub(super) tile: (usize, usize),
    /// Which pixel of the scaled photo each of the atlas is a copy of.
    map: SourceMap,
    frame: Frame,
}

/// Makes a set of Wang tiles of a near-periodic photo: laid at random such that the colours of their
/// edges agree, they fill a plane of any size that is as regular as the photo and does not repeat.
///
/// `photo` and `mask` as for [`extract`](crate::extract).
///
/// # Paper
/// Wang Tiles for Image and Texture Generation (Cohen et al. 2003), the future work of Representative
/// Tile Extraction; the atlas after Wei 2004. See ARCHITECTURE.md.
///
/// # Determinism
/// Same photo, mask and parameters: same bytes, for any thread count and SIMD level. Nothing is random.
///
/// # Errors
/// As of [`extract`](crate::extract), and [`Error::BadPicture`] if the photo has no room for the samples.
pub fn wang(
    ctx: &Ctx,
    photo: &Picture,
    mask: Option<&Mask>,
    params: &WangParams,
) -> Result<WangSet> {
    params.validate()?;
    let start = Instant::now();
    let of_extract = ExtractParams {
        period: params.period,
        periods: params.periods,
        scale: params.scale,
        min_confidence: params.min_confidence,
        flatten: params.flatten,
        ..ExtractParams::default()
    };
    let Prepared { found, frame, tile, scale, scaled, flags, notes } =
        prepare(ctx, photo, mask, &of_extract, method::STEPS)?;
    let (h, w) = tile;
    if h.min(w) < LEAST_TILE {
        let expected =
            format!("more, so that a tile ({w}x{h}) is at least {LEAST_TILE} pixels high and wide");
        return Err(Error::parameter("periods", expected, params.periods));
    }
    let (rows, columns) = params.set.atlas();
    let pixels = (rows * h * columns * w) as u64;
    let need = pixels * (16 + (photo.byte_len() / (photo.height() * photo.width())) as u64)
        + 200 * (h * w) as u64;
    ensure_available(&format!("the set of {w}x{h} tiles"), Some(need))?;
    let analysis = start.elapsed();

    let positions = ctx.install(|| {
        let model = ColorModel::new(&scaled);
        let pixels = model.averaging_pixels(&scaled);
        let (size, space) = (frame.size(), model.space());
        let codes = Codes::covering(&[(&pixels, flags.as_deref())], space);
        let image = codes.image(&pixels, size, space);
        let (periods, overlap) = (params.periods, f64::from(params.overlap));
        let grid = Grid { image: &image, usable: flags.as_deref(), tile, periods, overlap };
        // A period of a few pixels is enough to find out where tiles should begin.
        let coarse = |n: usize| (COARSE * periods).min(n);
        let coarse_tile = (coarse(h), coarse(w));
        let to = (size.0 * coarse_tile.0 / h, size.1 * coarse_tile.1 / w);
        let small = codes.image(&resized(&pixels, size, to), to, space);
        // What is not usable is found out exactly after that.
        let small_flags = flags.as_ref().map(|flags| {
            let at = |i: usize| (i / to.1 * size.0 / to.0) * size.1 + i % to.1 * size.1 / to.1;
            (0..to.0 * to.1).map(|i| flags[at(i)]).collect::<Vec<bool>>()
        });
        let usable = small_flags.as_deref();
        let phases =
            method::phases(ctx, &Grid { image: &small, usable, tile: coarse_tile, ..grid })?;
        let Some(samples) = method::choose(ctx, &grid, &phases)? else { return Ok(None) };
        method::atlas(ctx, &image, &samples, tile, params.set).map(Some)
    })?;
    let Some(positions) = positions else {
        let reason = format!(
            "it has no room for four usable pieces of {w}x{h} pixels, a tile, that lie in step and overlap \
             as little; choose fewer periods, allow a larger overlap, or take a photo of more periods"
        );
        return Err(Error::BadPicture { what: "the photo".into(), reason });
    };
    let map = SourceMap::new((rows * h, columns * w), frame.size(), positions)?;
    let atlas = map.apply(&scaled, MapKind::Color)?;
    let made = start.elapsed();
    let report = WangReport {
        version: env!("CARGO_PKG_VERSION"),
        params: params.show(),
        photo_size: (photo.width(), photo.height()),
        period: found,
        tile_size: (w, h),
        scale,
        tiles: params.set.tiles(),
        atlas: (columns, rows),
        seconds: vec![
            ("period", analysis.as_secs_f64()),
            ("tiles", made.saturating_sub(analysis).as_secs_f64()),
        ],
        notes,
    };
    Ok(WangSet { atlas, report, set: params.set, tile, map, frame })
}

impl WangSet {
    /// Which pixel of the photo each pixel of the atlas is a copy of; `None` if the photo was scaled.
    pub fn source_map(&self) -> Option<&SourceMap> {
        self.frame.is_plain().then_some(&self.map)
    }

    /// The atlas of another map of the photo's material, of any resolution, in the map's own type.
    ///
    /// # Errors
    /// [`Error::SizeMismatch`] if the map has another aspect ratio than the photo.
    pub fn atlas_of(&self, map: &Picture, kind: MapKind) -> Result<Picture> {
        map_in(&self.frame, self.report.photo_size, map, kind, |read| self.map.apply(read, kind))
    }

    /// Tile `k` of an atlas, the set's or that of a map.
    ///
    /// # Errors
    /// [`Error::BadPicture`] if the picture is no atlas of this set, or there is no such tile.
    pub fn tile(&self, atlas: &Picture, k: usize) -> Result<Picture> {
        self.laid(atlas, self.tile, (1, 1), &[k])
    }

    /// How many rows and columns of tiles fill a plane of this height and width in pixels.
    ///
    /// # Errors
    /// [`Error::Parameter`] if that is none, or too many.
    pub fn cells(&self, (height, width): (usize, usize)) -> Result<(usize, usize)> {
        let (rows, columns) = (height.div_ceil(self.tile.0), width.div_ceil(self.tile.1));
        let sides = height.min(width) > 0 && height.max(width) <= Picture::MAX_SIDE;
        if !sides || rows * columns > MOST_LAID {
            let expected = format!("1x1 to {0}x{0} pixels", Picture::MAX_SIDE);
            return Err(Error::parameter("plane", expected, format!("{width}x{height}")));
        }
        Ok((rows, columns))
    }

    /// Which tile lies where: [`TileSet::layout`].
    pub fn layout(&self, seed: u64, cells: (usize, usize)) -> Vec<u8> {
        self.set.layout(seed, cells)
    }

    /// The same as a picture for a shader, a pixel a tile: the tile's column in the atlas in the first
    /// channel, its row in the second, the third 0.
    ///
    /// # Errors
    /// None that cells of ours can cause.
    pub fn index(&self, seed: u64, cells: (usize, usize)) -> Result<Picture> {
        let columns = self.set.atlas().1 as u8;
        let place = |k: u8| [k % columns, k / columns, 0];
        let samples = self.layout(seed, cells).into_iter().flat_map(place).collect();
        Picture::new(cells.0, cells.1, 3, Samples::U8(samples), Encoding::Data)
    }

    /// A plane of this height and width in pixels, of the tiles of an atlas. It repeats if both are whole
    /// tiles.
    ///
    /// # Errors
    /// As [`WangSet::cells`] and [`WangSet::tile`]; [`Error::Memory`].
    pub fn plane(&self, atlas: &Picture, size: (usize, usize), seed: u64) -> Result<Picture> {
        let cells = self.cells(size)?;
        let of_pixel = atlas.byte_len() / (atlas.height() * atlas.width());
        let need = (size.0 * size.1) as u64 * (8 + of_pixel as u64);
        ensure_available(&format!("a plane of {}x{} pixels", size.1, size.0), Some(need))?;
        let layout: Vec<usize> = self.layout(seed, cells).into_iter().map(usize::from).collect();
        self.laid(atlas, size, cells, &layout)
    }

    /// Tiles of an atlas side by side.
    fn laid(
        &self,
        atlas: &Picture,
        (height, width): (usize, usize),
        (_, columns): (usize, usize),
        layout: &[usize],
    ) -> Result<Picture> {
        let ((h, w), in_atlas) = (self.tile, self.set.atlas().1);
        let from = |p: usize| {
            let (y, x) = (p / width, p % width);
            let k = layout[y / h * columns + x / w];
            [(k / in_atlas * h + y % h) as u32, (k % in_atlas * w + x % w) as u32]
        };
        let size = (self.map.height(), self.map.width());
        if (atlas.height(), atlas.width()) != size {
            let reason =
                format!("it is no atlas of this set, which is {}x{} pixels", size.1, size.0);
            return Err(Error::BadPicture { what: "the atlas".into(), reason });
        }
        let positions = (0..height * width).map(from).collect();
        // The atlas of normals holds unit vectors already: nothing but a copy is wanted.
        SourceMap::new((height, width), size, positions)?.apply(atlas, MapKind::Data)
    }
}
