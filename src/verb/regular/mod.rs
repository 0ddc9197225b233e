//! [`regular`]: near-regular textures of any size.

mod params;
mod resolve;

use std::time::Instant;

use serde::Serialize;

use crate::base::ctx::Ctx;
use crate::base::error::{Error, Result};
use crate::base::memory::ensure_available;
use crate::base::params::OrAuto;
use crate::image::blend;
use crate::image::mask::Mask;
use crate::image::material::MapKind;
use crate::image::picture::Picture;
use crate::image::sourcemap::SourceMap;
use crate::method::rsgf::{self, Exemplar, Mosaic, Plan};
use crate::search::patchmatch::Wrap;
use crate::signal::basis::Basis;
use crate::verb::params::Size;
pub use params::{Guide, Matching, RegularParams, Seam, Straighten, Subpixel, Tileable};
use resolve::{LEAST_BLOCK, blocks, flatten_share, flattened, lattice, sized, usable};

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
/// [`Error::Parameter`], [`Error::BadPicture`] (constant; no piece fits), [`Error::NoStructure`] (no lattice was found),
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
        let (lattice, confidence) = lattice(ctx, photo, usable.as_ref(), params)?;
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
            Ok(Exemplar::new(
                ctx.simd,
                flat.as_ref().unwrap_or(photo),
                usable.as_ref(),
                straightened,
            ))
        })?;
        let plan = Plan {
            size: (size.1, size.0),
            wrap,
            block,
            border,
            lattices: [source, output],
            sample_candidates: params.sample_candidates,
            candidates: params.candidates,
            // Where everything is allowed there is nothing to be off.
            tolerance: if lattice.is_some() { params.tolerance } else { 0 },
            subpixel: params.subpixel == Subpixel::On,
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
    pub fn make(&self, ctx: &Ctx, maps: &[(&Picture, MapKind)]) -> Result<(Regular, Vec<Picture>)> {
        let start = Instant::now();
        let maps_bytes = maps.iter().map(|(map, _)| bytes_per_pixel(map)).sum();
        let whole = self.divided(ctx, usize::MAX, maps_bytes)?.next();
        let whole = whole.ok_or_else(|| Error::Internal { message: "no rows".into() })??;
        let (picture, maps) = ctx.install(|| {
            let maps = maps.iter().map(|(map, kind)| whole.picture(map, *kind));
            let maps = maps.collect::<Result<Vec<_>>>()?;
            Ok((whole.picture(self.photo(), MapKind::Color)?, maps))
        })?;
        let mut report = self.report.clone();
        report.seconds.push(("synthesis", start.elapsed().as_secs_f64()));
        Ok((Regular { picture, source_map: whole.source_map, report }, maps))
    }

    /// The texture from top to bottom, about so many pixels at a time: the same ones as
    /// [`make`](Self::make) gives, for textures larger than memory. Every strip looks at up to four
    /// rows of blocks besides its own, so few make much more work.
    ///
    /// # Errors
    /// [`Error::Memory`]; the strips' are as of [`make`](Self::make).
    pub fn strips(
        &self,
        ctx: &Ctx,
        pixels: usize,
    ) -> Result<impl Iterator<Item = Result<RegularStrip>> + use<'_, 'a>> {
        self.divided(ctx, (pixels / (self.size().0 * self.plan.block)).max(1), 0)
    }

    /// The same as pictures: of every strip the rows of the texture, then those of each of these maps of
    /// the photo.
    ///
    /// # Errors
    /// As [`strips`](Self::strips), those of [`RegularStrip::picture`].
    pub fn pictures<'b>(
        &'b self,
        ctx: &Ctx,
        pixels: usize,
        maps: &'b [(&'b Picture, MapKind)],
    ) -> Result<impl Iterator<Item = Result<Vec<Picture>>> + use<'a, 'b>> {
        let strips = self.strips(ctx, pixels)?;
        let ctx = ctx.clone();
        Ok(strips.map(move |strip| {
            let strip = strip?;
            let all = [(self.photo(), MapKind::Color)].into_iter().chain(maps.iter().copied());
            ctx.install(|| all.map(|(map, kind)| strip.picture(map, kind)).collect())
        }))
    }

    /// The same, `rows` rows of blocks at a time; `more` bytes a pixel are held besides.
    fn divided(
        &self,
        ctx: &Ctx,
        rows: usize,
        more: u64,
    ) -> Result<impl Iterator<Item = Result<RegularStrip>> + use<'_, 'a>> {
        let (width, height) = self.size();
        let tall = rows.saturating_mul(self.plan.block).min(height) + 4 * self.plan.block;
        // Places and what they are mixed with; a picture, its twin and the mixture.
        let each = 44 + PIECES + 3 * bytes_per_pixel(self.photo) + more;
        let need = (width as u64).checked_mul(tall as u64).and_then(|n| n.checked_mul(each));
        ensure_available(&format!("a texture of {width}x{height}, {tall} rows at a time,"), need)?;
        let mosaic = Mosaic::new(&self.exemplar, &self.plan);
        let all = mosaic.block_rows();
        let strips = (0..all).step_by(rows).map(move |i| i..i.saturating_add(rows).min(all));
        let strips: Vec<_> = strips.collect();
        ctx.begin(strips.iter().map(|strip| mosaic.work(strip.clone())).sum());
        let photo = (self.photo.height(), self.photo.width());
        let ctx = ctx.clone();
        Ok(strips.into_iter().map(move |blocks| {
            ctx.install(|| {
                let rsgf::Strip { first, from, beside, mixed, mixed_beside } =
                    mosaic.strip(&ctx, blocks)?;
                let size = (from.len() / width, width);
                let source_map = |from, beside: Vec<_>| {
                    let map = SourceMap::new(size, photo, from)?;
                    if beside.is_empty() { Ok(map) } else { map.between(beside) }
                };
                let mixed = if mixed.is_empty() {
                    None
                } else {
                    let (others, shares) = mixed.into_iter().unzip();
                    Some((source_map(others, mixed_beside)?, shares))
                };
                Ok(RegularStrip { first, source_map: source_map(from, beside)?, mixed })
            })
        }))
    }
}

/// Bytes a pixel that filled gaps hold until they are painted: place and share, on windows up to twice as
/// wide and high as their blocks.
const PIECES: u64 = 24;

fn bytes_per_pixel(picture: &Picture) -> u64 {
    picture.byte_len().div_ceil(picture.height() * picture.width()) as u64
}
