//! [`regular`]: near-regular textures of any size.

use std::time::Instant;

use serde::Serialize;

use crate::analyze::lattice::snap::{self, MOST_SCALING};
use crate::base::ctx::Ctx;
use crate::base::error::{Error, Result};
use crate::base::memory::ensure_available;
use crate::base::params::{OrAuto, Value, choice, params};
use crate::image::blend;
use crate::image::color::{ColorModel, MatchSpace};
use crate::image::mask::Mask;
use crate::image::material::MapKind;
use crate::image::picture::Picture;
use crate::image::sourcemap::SourceMap;
use crate::method::flatten;
use crate::method::rsgf::{self, Exemplar, Mosaic, Plan};
use crate::search::patchmatch::Wrap;
use crate::signal::basis::{Basis, area, coefficients, combined, dot, reduced};
use crate::verb::lattice::{LatticeParams, detect_lattice};
use crate::verb::params::Size;

/// Longest side of a texture, in pixels.
const MAX_SIDE: usize = 1 << 20;

/// Least side of a block.
const LEAST_BLOCK: usize = 8;

/// Side of a block by itself: this share of the root of the cell's area (pieces smaller than a brick
/// are joined within bricks, larger ones repeat recognizably), but at least this many pixels.
const BLOCK_SHARE: f64 = 0.6;
const BLOCK_PIXELS: f64 = 64.0;

/// Border by itself, as a share of the block: up to a half gives the seams more room, and time.
const BORDER_SHARE: f64 = 0.375;

/// Pixels of a strip, about: what is held at a time when a large texture is made.
const STRIP_PIXELS: usize = 1 << 24;

/// Rows of blocks in a strip, at least: up to four more have to be looked at each time.
const STRIP_BLOCKS: usize = 8;

choice! {
    /// In which directions a near-regular texture repeats.
    pub enum Tileable {
        /// Nowhere.
        None = "none",
        /// In both.
        Both = "both",
        /// Horizontally only.
        X = "x",
        /// Vertically only.
        Y = "y",
    }
}

choice! {
    /// By what the patch for a gap is chosen.
    pub enum Matching {
        /// Squared differences of colour.
        Color = "color",
        /// Normalized cross-correlation: lines count more than brightness.
        Correlation = "correlation",
    }
}

choice! {
    /// How pieces are joined.
    pub enum Seam {
        /// Where the seam shows least, anywhere in the overlap (graph cut).
        Graph = "graph",
        /// Along the path of least difference across each side (minimum-error boundary cut).
        Cut = "cut",
        /// Faded over the whole overlap, as in the paper.
        Linear = "linear",
    }
}

choice! {
    /// Whether cells that lie beside their place are put into it.
    pub enum Straighten {
        /// They are taken as they lie.
        Off = "off",
        /// Each is moved to where it is most like the others.
        On = "on",
    }
}

/// Which lattice is followed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Guide {
    /// The one that [`detect_lattice`] finds.
    Auto,
    /// None: pieces come from anywhere.
    None,
    /// These two displacements, in pixels of the photo: to the right, downwards.
    Vectors(Basis),
}

impl Value for Guide {
    const KIND: &'static str = "lattice";

    fn parse(text: &str) -> Option<Self> {
        match text {
            "auto" => return Some(Self::Auto),
            "none" => return Some(Self::None),
            _ => {}
        }
        let numbers =
            text.split(',').map(|n| n.trim().parse::<f64>().ok().filter(|n| n.is_finite()));
        let [ax, ay, bx, by] = numbers.collect::<Option<Vec<_>>>()?.try_into().ok()?;
        Some(Self::Vectors([[ax, ay], [bx, by]]))
    }

    fn show(&self) -> String {
        match self {
            Self::Auto => "auto".into(),
            Self::None => "none".into(),
            Self::Vectors([[ax, ay], [bx, by]]) => format!("{ax},{ay},{bx},{by}"),
        }
    }

    fn expected() -> String {
        "auto, none, or two displacements as X1,Y1,X2,Y2 in pixels".into()
    }
}

params! {
    /// Parameters of [`regular`].
    pub struct RegularParams for "regular" {
        /// Size of the texture: WIDTHxHEIGHT, or auto for the photo's own (whole periods near it if it shall repeat).
        size: Size = Size::Auto, unit "px";
        /// In which directions the texture repeats. A size given must then be a whole number of the photo's periods within 3 %.
        tileable: Tileable = Tileable::None;
        /// The lattice that is followed: auto finds it, none takes pieces from anywhere (for textures without one), X1,Y1,X2,Y2 gives two displacements in pixels, to the right and downwards.
        lattice: Guide = Guide::Auto, unit "px";
        /// From which confidence on a lattice that was found is followed.
        min_confidence: f32 = 0.5, in 0.0..=1.0;
        /// Whether cells of the photo that lie beside their place on the lattice are put into it.
        straighten: Straighten = Straighten::On;
        /// Side of the blocks that the texture is made of: larger keeps more of the photo together, smaller mixes more.
        block: OrAuto<usize> = OrAuto::Auto, unit "px";
        /// How far pieces overlap with their neighbours, to either side; at most half a block.
        border: OrAuto<usize> = OrAuto::Auto, unit "px";
        /// How many pieces are tried for every gap between those that were drawn at random.
        candidates: usize = 64, in 1..=65536;
        /// How far from its place on the lattice a piece for a gap may come from.
        tolerance: usize = 3, in 0..=64, unit "px";
        /// By what a piece for a gap is chosen.
        matching: Matching = Matching::Color;
        /// How far such a piece may be bent so that lines meet; 0 switches it off.
        deform: usize = 2, in 0..=8, unit "px";
        /// How pieces are joined.
        seam: Seam = Seam::Graph;
        /// How far the two sides of a seam are faded into each other; with 0 every pixel is a copy of one of the photo's. Linear seams are as wide as the border.
        feather: usize = 4, in 0..=64, unit "px";
        /// Reach of the light flattening: differences of light that are wider are taken out of the photo first, as pieces from dark and from bright parts would lie side by side. Auto takes a quarter, or more where a period is longer; 0 switches it off.
        flatten: OrAuto<f32> = OrAuto::Auto, unit "fraction of the photo's shorter side";
    }
}

/// How a texture was made.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct RegularReport {
    /// Version of texforge.
    pub version: &'static str,
    /// Seed of all random choices.
    pub seed: u64,
    /// Every parameter as text, with sizes, lattice and all that was `auto` resolved.
    pub params: Vec<(&'static str, String)>,
    /// Width and height of the photo in pixels.
    pub photo_size: (usize, usize),
    /// Width and height of the texture in pixels.
    pub size: (usize, usize),
    /// The lattice in the photo: two displacements, to the right and downwards; `None` if none is
    /// followed.
    pub lattice: Option<Basis>,
    /// The same in the texture, where it may be a little stretched.
    pub lattice_of_texture: Option<Basis>,
    /// How sure the lattice is; `None` if it was given, or none is followed.
    pub confidence: Option<f64>,
    /// How far the photo's cells were moved into place, in pixels: the root of the mean square, and the
    /// most.
    pub straightened: (f64, f64),
    /// Wall time in seconds of each stage, in order. The only part that differs between runs.
    pub seconds: Vec<(&'static str, f64)>,
    /// What the user should know, one sentence each.
    pub notes: Vec<String>,
}

/// The result of [`regular`].
#[derive(Debug, Clone)]
pub struct Regular {
    /// The texture, in the photo's own sample type; of the flattened photo's pixels if it was flattened.
    pub picture: Picture,
    /// Which pixel of the photo each pixel of the texture is a copy of; where two are mixed, the one
    /// that there is more of.
    pub source_map: SourceMap,
    /// How it was made.
    pub report: RegularReport,
}

/// Makes a near-regular texture (bricks, tiles, cloth, windows) of any size from a photo of one.
///
/// `photo` is H x W x C: grey, RGB (each with or without alpha), or data of any number of channels;
/// `mask` (size of the photo) says where it may be used, and transparent pixels are never used. Every
/// second block of the texture is a piece of the photo drawn at random among those that lie at the same
/// place of a cell; the gaps between take the pieces that fit best.
///
/// # Paper
/// Near-Regular Texture Synthesis by Random Sampling and Gap Filling (2011), sec. 4. Past it: see
/// ARCHITECTURE.md.
///
/// # Determinism
/// Same photo, mask, parameters and `ctx.seed`: same bytes, for any thread count and SIMD level.
///
/// # Errors
/// [`Error::Parameter`], [`Error::BadPicture`] (constant; no lattice was found; no piece fits),
/// [`Error::TooSmall`] (smaller than a block), [`Error::SizeMismatch`] (mask), [`Error::NotFinite`],
/// [`Error::Memory`] (checked before anything is allocated), [`Error::Cancelled`].
pub fn regular(
    ctx: &Ctx,
    photo: &Picture,
    mask: Option<&Mask>,
    params: &RegularParams,
) -> Result<Regular> {
    let maker = RegularMaker::new(ctx, photo, mask, params)?;
    maker.make(ctx, &[]).map(|(texture, _)| texture)
}

/// Some rows of a texture.
#[derive(Debug)]
pub struct RegularStrip {
    /// The first row.
    pub first: usize,
    /// Which pixel of the photo each pixel is a copy of, or has most of.
    pub source_map: SourceMap,
    /// What it is mixed with, and how much of that there is at every pixel in 255ths, if anything is.
    mixed: Option<(SourceMap, Vec<u8>)>,
}

impl RegularStrip {
    /// What these rows are of a map of the photo, or of the photo itself, which `kind` says the numbers
    /// of.
    ///
    /// # Errors
    /// Those of [`SourceMap::apply`].
    pub fn picture(&self, map: &Picture, kind: MapKind) -> Result<Picture> {
        let picture = self.source_map.apply(map, kind)?;
        let Some((others, shares)) = &self.mixed else { return Ok(picture) };
        let other = others.apply(map, kind)?;
        blend::mixed(&picture, &other, kind, |i| f64::from(shares[i]) / 255.0)
    }
}

/// A photo that was checked and analysed, ready for a texture: at once, or strip by strip where that
/// is larger than memory.
#[derive(Debug)]
pub struct RegularMaker<'a> {
    photo: &'a Picture,
    /// The flattened photo, if it is used.
    flat: Option<Picture>,
    exemplar: Exemplar,
    plan: Plan,
    report: RegularReport,
}

impl<'a> RegularMaker<'a> {
    /// Checks that the texture can be made, and analyses the photo.
    ///
    /// # Errors
    /// As [`regular`].
    pub fn new(
        ctx: &Ctx,
        photo: &'a Picture,
        mask: Option<&Mask>,
        params: &RegularParams,
    ) -> Result<Self> {
        let start = Instant::now();
        params.validate()?;
        photo.ensure_finite("the photo")?;
        let (height, width) = (photo.height(), photo.width());
        if height.min(width) < LEAST_BLOCK {
            let (what, remedy) = ("the photo".into(), "a block would not fit into it".into());
            return Err(Error::TooSmall { what, width, height, need: LEAST_BLOCK, remedy });
        }
        let mut notes = Vec::new();
        let usable = usable(photo, mask)?;
        let (lattice, confidence) = lattice(ctx, photo, params)?;
        let seconds = vec![("lattice", start.elapsed().as_secs_f64())];
        let start = Instant::now();
        let wrap = match params.tileable {
            Tileable::None => Wrap { y: false, x: false },
            Tileable::Both => Wrap { y: true, x: true },
            Tileable::X => Wrap { y: false, x: true },
            Tileable::Y => Wrap { y: true, x: false },
        };
        let (size, output) = sized(params, (width, height), lattice, wrap)?;
        let source = lattice.unwrap_or([[1.0, 0.0], [0.0, 1.0]]);
        let (block, border) = blocks(params, (width, height), lattice)?;
        let flat = flattened(ctx, photo, usable.as_ref(), params, lattice, &mut notes)?;
        let straightened = lattice.filter(|_| params.straighten == Straighten::On);
        let exemplar = ctx.install(|| {
            Ok(Exemplar::new(flat.as_ref().unwrap_or(photo), usable.as_ref(), straightened))
        })?;
        let plan = Plan {
            size: (size.1, size.0),
            wrap,
            block,
            border,
            lattices: [source, output],
            candidates: params.candidates,
            // Where everything is allowed there is nothing to be off.
            tolerance: if lattice.is_some() { params.tolerance } else { 0 },
            matching: match params.matching {
                Matching::Color => rsgf::Matching::Color,
                Matching::Correlation => rsgf::Matching::Correlation,
            },
            deform: params.deform,
            seam: match params.seam {
                Seam::Graph => rsgf::Seam::Graph,
                Seam::Cut => rsgf::Seam::Cut,
                Seam::Linear => rsgf::Seam::Linear,
            },
            feather: params.feather,
        };
        let mut resolved = params.clone();
        resolved.size = Size::Pixels { width: size.0, height: size.1 };
        resolved.lattice = lattice.map_or(Guide::None, Guide::Vectors);
        (resolved.block, resolved.border) = (OrAuto::Given(block), OrAuto::Given(border));
        resolved.flatten = OrAuto::Given(match flat {
            Some(_) => flatten_share(params, (width, height), lattice),
            None => 0.0,
        });
        let report = RegularReport {
            version: env!("CARGO_PKG_VERSION"),
            seed: ctx.seed,
            params: resolved.show(),
            photo_size: (width, height),
            size,
            lattice,
            lattice_of_texture: lattice.map(|_| output),
            confidence,
            straightened: exemplar.drift().extent(),
            seconds: seconds
                .into_iter()
                .chain([("analysis", start.elapsed().as_secs_f64())])
                .collect(),
            notes,
        };
        Ok(Self { photo, flat, exemplar, plan, report })
    }

    /// Width and height of the texture.
    pub fn size(&self) -> (usize, usize) {
        self.report.size
    }

    /// The photo that is copied from: flattened, if it was.
    pub fn photo(&self) -> &Picture {
        self.flat.as_ref().unwrap_or(self.photo)
    }

    /// How the texture is made; `seconds` are those of the analysis.
    pub fn report(&self) -> &RegularReport {
        &self.report
    }

    /// Makes the whole texture, and what belongs to it of further maps of the photo, of these kinds.
    ///
    /// # Errors
    /// [`Error::Memory`], [`Error::BadPicture`] if no piece fits at some place, those of
    /// [`SourceMap::apply`], [`Error::Cancelled`].
    pub fn make(self, ctx: &Ctx, maps: &[(&Picture, MapKind)]) -> Result<(Regular, Vec<Picture>)> {
        let (width, height) = self.size();
        let of = |map: &Picture| map.byte_len().div_ceil(map.height() * map.width()) as u64;
        // Places and what they are mixed with, and the same as source maps; a picture, and its twin
        // while they are mixed.
        let maps_bytes = maps.iter().map(|(map, _)| of(map)).sum::<u64>();
        let each = 40 + 3 * of(self.photo) + maps_bytes + 4 * PIECES;
        let need = (width as u64 * height as u64).checked_mul(each);
        ensure_available(&format!("a texture of {width}x{height}, as a whole,"), need)?;
        let start = Instant::now();
        let whole = self.divided(ctx, usize::MAX).next();
        let whole = whole.ok_or_else(|| Error::Internal { message: "no rows".into() })??;
        let (picture, maps) = ctx.install(|| {
            let maps = maps.iter().map(|(map, kind)| whole.picture(map, *kind));
            let maps = maps.collect::<Result<Vec<_>>>()?;
            Ok((whole.picture(self.photo(), MapKind::Color)?, maps))
        })?;
        let mut report = self.report;
        report.seconds.push(("synthesis", start.elapsed().as_secs_f64()));
        Ok((Regular { picture, source_map: whole.source_map, report }, maps))
    }

    /// The texture from top to bottom, some rows at a time: the same pixels as
    /// [`make`](Self::make), for textures larger than memory. Errors are those of it.
    pub fn strips(&self, ctx: &Ctx) -> impl Iterator<Item = Result<RegularStrip>> + use<'_, 'a> {
        let rows = (STRIP_PIXELS / (self.size().0 * self.plan.block)).max(STRIP_BLOCKS);
        self.divided(ctx, rows)
    }

    /// The same, `rows` rows of blocks at a time.
    fn divided(
        &self,
        ctx: &Ctx,
        rows: usize,
    ) -> impl Iterator<Item = Result<RegularStrip>> + use<'_, 'a> {
        let mosaic = Mosaic::new(&self.exemplar, &self.plan);
        let all = mosaic.block_rows();
        let strips = (0..all).step_by(rows).map(move |i| i..i.saturating_add(rows).min(all));
        let strips: Vec<_> = strips.collect();
        ctx.begin(strips.iter().map(|strip| mosaic.work(strip.clone())).sum());
        let photo = (self.photo.height(), self.photo.width());
        let (width, ctx) = (self.size().0, ctx.clone());
        strips.into_iter().map(move |blocks| {
            ctx.install(|| {
                let rsgf::Strip { first, from, mixed } = mosaic.strip(&ctx, blocks)?;
                let size = (from.len() / width, width);
                let source_map = SourceMap::new(size, photo, from)?;
                let mixed = if mixed.is_empty() {
                    None
                } else {
                    let (others, shares) = mixed.into_iter().unzip();
                    Some((SourceMap::new(size, photo, others)?, shares))
                };
                Ok(RegularStrip { first, source_map, mixed })
            })
        })
    }
}

/// Bytes a pixel that filled gaps hold until they are painted: place and share, twice over as their
/// windows overlap.
const PIECES: u64 = 10;

/// Where the photo may be used, by mask and alpha (`None`: everywhere); checked to hold something that
/// is not all alike.
fn usable(photo: &Picture, mask: Option<&Mask>) -> Result<Option<Mask>> {
    let (height, width) = (photo.height(), photo.width());
    if let Some(mask) = mask {
        mask.ensure_size("the mask", height, width)?;
    }
    let alpha = Mask::from_alpha(photo);
    let usable = match (mask, alpha) {
        (Some(mask), Some(alpha)) => Some(mask.and(&alpha)?),
        (Some(mask), None) => Some(mask.clone()),
        (None, alpha) => alpha,
    };
    let usable = usable.filter(|mask| mask.count() < mask.usable().len());
    let c = photo.channels();
    let pixel = |i: usize| (0..c).map(move |k| photo.samples().unit(i * c + k));
    let mut all = (0..height * width).filter(|&i| usable.as_ref().is_none_or(|m| m.usable()[i]));
    let first = all.next();
    if first.is_none_or(|first| all.all(|i| pixel(i).eq(pixel(first)))) {
        return Err(Error::BadPicture {
            what: "the photo".into(),
            reason: "all its usable pixels are alike, so there is no pattern to continue".into(),
        });
    }
    Ok(usable)
}

/// The lattice to follow, and how sure it is if it was looked for.
fn lattice(
    ctx: &Ctx,
    photo: &Picture,
    params: &RegularParams,
) -> Result<(Option<Basis>, Option<f64>)> {
    let basis = match params.lattice {
        Guide::None => return Ok((None, None)),
        Guide::Vectors(basis) => basis,
        Guide::Auto => {
            let asked =
                LatticeParams { min_confidence: params.min_confidence, ..Default::default() };
            let found = detect_lattice(ctx, photo, &asked)?;
            if !found.found {
                return Err(Error::NoStructure {
                    what: "lattice".into(),
                    confidence: found.confidence,
                    least: f64::from(params.min_confidence),
                    remedy: "give its two displacements, or take `lattice` none for a texture \
                             without one"
                        .into(),
                });
            }
            return Ok((Some([found.v1, found.v2]), Some(found.confidence)));
        }
    };
    let refused = |expected: String| Error::parameter("lattice", expected, params.lattice.show());
    let [a, b] = basis;
    let sine = (a[0] * b[1] - a[1] * b[0]).abs() / (dot(a, a) * dot(b, b)).sqrt();
    if sine.is_nan() || sine < 1e-3 {
        return Err(refused("two displacements that are not parallel, nor zero".into()));
    }
    let basis = reduced(basis);
    let (w, h) = (photo.width() as f64, photo.height() as f64);
    if basis.iter().any(|v| 2.0 * v[0].abs() > w || 2.0 * v[1].abs() > h) {
        let expected =
            "displacements of at most half the photo's width and height, or nothing repeats";
        return Err(refused(expected.into()));
    }
    if basis.iter().any(|v| dot(*v, *v) < 4.0) {
        return Err(refused("displacements of at least 2 pixels".into()));
    }
    Ok((Some(basis), None))
}

/// Width and height of the texture, and the lattice in it.
fn sized(
    params: &RegularParams,
    photo: (usize, usize),
    lattice: Option<Basis>,
    wrap: Wrap,
) -> Result<((usize, usize), Basis)> {
    let wish = match params.size {
        Size::Auto => photo,
        Size::Pixels { width, height } => (width, height),
    };
    let sides = 1..=MAX_SIDE;
    if !sides.contains(&wish.0) || !sides.contains(&wish.1) {
        let expected = format!("1x1 to {MAX_SIDE}x{MAX_SIDE} pixels");
        return Err(Error::parameter("size", expected, format!("{}x{}", wish.0, wish.1)));
    }
    let Some(basis) = lattice else { return Ok((wish, [[1.0, 0.0], [0.0, 1.0]])) };
    // On an axis that does not repeat the texture is as it is in the photo.
    let free = |axis: usize, length: usize| {
        let mut v = [0.0; 2];
        v[axis] = length as f64;
        (length, v)
    };
    let side = |axis: usize, wraps: bool, length: usize| {
        if !wraps {
            return Ok(free(axis, length));
        }
        let turned = basis.map(|[x, y]| if axis == 0 { [x, y] } else { [y, x] });
        let found = snap::side(turned, length, MOST_SCALING);
        let found = found.filter(|s| params.size == Size::Auto || s.length == length);
        match found {
            Some(s) => Ok((s.length, combined(basis, s.periods[0] as f64, s.periods[1] as f64))),
            None => {
                let near = snap::side(turned, length, MOST_SCALING);
                let does = near.map_or(String::new(), |s| format!("; {} does", s.length));
                let name = if axis == 0 { "width" } else { "height" };
                Err(Error::parameter(
                    "size",
                    format!(
                        "a whole number of periods within 3 % where the texture repeats{does} \
                         (or auto)"
                    ),
                    format!("a {name} of {length}"),
                ))
            }
        }
    };
    let (width, across) = side(0, wrap.x, wish.0)?;
    let (height, down) = side(1, wrap.y, wish.1)?;
    // What is across and down in the photo becomes the texture's width and height.
    let output = basis.map(|v| {
        let [a, b] = coefficients([across, down], v);
        [a * width as f64, b * height as f64]
    });
    Ok(((width, height), output))
}

/// Side of the blocks and their border.
fn blocks(
    params: &RegularParams,
    (width, height): (usize, usize),
    lattice: Option<Basis>,
) -> Result<(usize, usize)> {
    let short = width.min(height) as f64;
    // Some place of every phase lies in a rectangle as large as the cell's bounding box.
    let cell = lattice.map_or(0.0, |[a, b]| (a[0].abs() + b[0].abs()).max(a[1].abs() + b[1].abs()));
    let slack = (params.deform + params.tolerance) as f64;
    let room = (short - cell - 2.0 * slack) / (1.0 + 2.0 * BORDER_SHARE);
    let wish =
        lattice.map_or(short / 8.0, |basis| (BLOCK_SHARE * area(basis).sqrt()).max(BLOCK_PIXELS));
    let block = match params.block {
        OrAuto::Given(block) => block,
        OrAuto::Auto => wish.min(room).max(LEAST_BLOCK as f64) as usize,
    };
    if block < LEAST_BLOCK {
        let expected = format!("at least {LEAST_BLOCK} pixels");
        return Err(Error::parameter("block", expected, block));
    }
    let border = match params.border {
        OrAuto::Given(border) => border,
        OrAuto::Auto => ((BORDER_SHARE * block as f64) as usize).max(1),
    };
    if !(1..=block / 2).contains(&border) {
        let expected = format!("1 to {} (half the block)", block / 2);
        return Err(Error::parameter("border", expected, border));
    }
    let need = block + 2 * border + 2 * params.deform;
    if width.min(height) < need {
        let what = "the photo".into();
        let remedy = format!(
            "that is a block of {block} with a border of {border}: choose smaller ones, or a larger \
             photo"
        );
        return Err(Error::TooSmall { what, width, height, need, remedy });
    }
    Ok((block, border))
}

/// Reach of the flattening as a share of the photo's shorter side; 0 for none.
fn flatten_share(
    params: &RegularParams,
    (width, height): (usize, usize),
    lattice: Option<Basis>,
) -> f32 {
    match params.flatten {
        OrAuto::Given(share) => share,
        OrAuto::Auto => {
            // Wider than a cell: narrower, the pattern itself would be taken for light.
            let cell = lattice.map_or(0.0, |[_, b]| dot(b, b).sqrt());
            (cell / width.min(height) as f64).max(FLATTEN_SHARE) as f32
        }
    }
}

/// Least share that the flattening takes by itself: less would take colours of single bricks for light.
const FLATTEN_SHARE: f64 = 0.25;

/// The photo with its light flattened, if it is to be; `notes` say what was done.
fn flattened(
    ctx: &Ctx,
    photo: &Picture,
    usable: Option<&Mask>,
    params: &RegularParams,
    lattice: Option<Basis>,
    notes: &mut Vec<String>,
) -> Result<Option<Picture>> {
    let size = (photo.width(), photo.height());
    let share = flatten_share(params, size, lattice);
    if params.flatten == OrAuto::Auto && ColorModel::new(photo).space() == MatchSpace::Data {
        return Ok(None);
    }
    flatten::check_reach(share)?;
    if !(0.0..=1.0).contains(&share) {
        return Err(Error::parameter("flatten", "0 (off) to 1", share));
    }
    if share == 0.0 {
        return Ok(None);
    }
    let sigma = f64::from(share) * size.0.min(size.1) as f64;
    ctx.install(|| {
        let flat = flatten::run(photo, usable, sigma)?;
        notes.push(flat.note(sigma));
        Ok(Some(flat.picture))
    })
}
