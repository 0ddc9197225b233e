//! Procedural textures by example: [`fit_noise`] and [`NoiseTexture`].

mod edit;
mod params;
mod sheet;
mod texture;

use std::time::Instant;

use serde::Serialize;

use crate::base::ctx::Ctx;
use crate::base::error::{Error, Result};
use crate::base::memory::ensure_available;
use crate::image::mask::Mask;
use crate::image::material::MapKind;
use crate::image::picture::{Encoding, Picture};
use crate::method::noise::document::MOST_CHANNELS;
use crate::method::noise::fit::{self, Exemplar};
use crate::method::noise::oriented;
use crate::method::noise::score::Structure;
use crate::method::noise::tiling;
use crate::method::noise::{BandShape, Document, MapSpec, Model, Score};

pub use edit::{NoiseEdit, NoiseEditParams};
pub use params::{Bands, Histogram, Kind, NoiseParams, Weights};
pub use texture::{NoiseTexture, RenderParams, RenderedMap, SampleType};

/// Shortest side of a photo that can be fitted: a few bands.
const SMALLEST: usize = 16;

/// A map of a material to fit: its name, what its numbers are, and its samples.
#[derive(Debug, Clone, Copy)]
pub struct NamedMap<'a> {
    /// Its name: `basecolor`, `roughness`, ...
    pub name: &'a str,
    /// What its numbers are.
    pub kind: MapKind,
    /// Its samples. All maps have one size.
    pub picture: &'a Picture,
}

/// How a texture was fitted.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NoiseReport {
    /// Version of texforge.
    pub version: &'static str,
    /// Every parameter as text.
    pub params: Vec<(&'static str, String)>,
    /// Width and height of the photo in pixels.
    pub photo_size: (usize, usize),
    /// Number of bands; 0 of a tiled texture.
    pub bands: usize,
    /// How well noise of the kind that was fitted fits, in 0..=1; from 0.5 on it can be taken for the
    /// photo at a glance.
    pub fit: f64,
    /// Which kind fits best: `wavelet`, `oriented`, `tiling` or `none`; noise first, as it is smaller.
    pub recommended: String,
    /// Excess kurtosis of the photo's octaves: edges and marks, which noise lacks.
    pub kurtosis: f64,
    /// By how much the photo's detail varies from place to place, more than noise's does.
    pub patchiness: f64,
    /// Share of the photo's power that lies in other directions than if all were alike.
    pub anisotropy: f64,
    /// How strongly the photo repeats, as bricks do.
    pub periodicity: f64,
    /// Bytes of the document.
    pub bytes: usize,
    /// Wall time in seconds of each stage, in order. The only part that differs between runs.
    pub seconds: Vec<(&'static str, f64)>,
    /// What the user should know, one sentence each.
    pub notes: Vec<String>,
}

/// Fits a procedural texture to a photo, or to all maps of a material together: what remains is about a
/// kilobyte from which values are evaluated anywhere.
///
/// The maps' channels are made independent of each other by the eigenvectors of their covariance, each
/// is given the photo's histogram and the power of each octave of its spectrum (Lagae et al. 2009,
/// sections 4 to 7). So maps stay correlated as they are in the photo. Transparent and masked pixels do
/// not count; alpha itself is not fitted.
///
/// With [`Kind::Tiling`] a part of the photo is kept instead, whose pieces are blended (Heitz and Neyret
/// 2018; [`tiling`](crate::method::noise::tiling) says how, and what is different).
///
/// The same maps, mask and parameters give the same document on any number of threads.
///
/// # Errors
/// [`Error::Parameter`] for a parameter out of range, cells too large for the photo, a seed of more than
/// 32 bits, no map or two of one name; [`Error::TooSmall`] below 16 x 16 pixels, for tiles below 32 x 32
/// without holes; [`Error::SizeMismatch`] if a map or the mask has another size than the first map;
/// [`Error::NotFinite`]; [`Error::EmptyMask`]; [`Error::BadPicture`] if all is of one colour;
/// [`Error::Memory`]; [`Error::Cancelled`].
pub fn fit_noise(
    ctx: &Ctx,
    maps: &[NamedMap],
    mask: Option<&Mask>,
    params: &NoiseParams,
) -> Result<(NoiseTexture, NoiseReport)> {
    params.validate()?;
    if ctx.seed > u64::from(u32::MAX) {
        return Err(Error::parameter("seed", format!("at most {}", u32::MAX), ctx.seed));
    }
    ctx.install(|| run(ctx, maps, mask, params))
}

fn run(
    ctx: &Ctx,
    maps: &[NamedMap],
    mask: Option<&Mask>,
    params: &NoiseParams,
) -> Result<(NoiseTexture, NoiseReport)> {
    let begun = Instant::now();
    let (height, width) = checked(maps, params)?;
    let mut notes = Vec::new();
    let usable = usable(maps, mask)?;
    let planes: Vec<Vec<f32>> = maps.iter().flat_map(|map| planes(map.picture)).collect();
    let prepared = begun.elapsed().as_secs_f64();
    let tiles = if params.model == Kind::Tiling { tiling::steps() } else { 0 };
    ctx.begin(2 + planes.len() as u64 + tiles);
    let exemplar = Exemplar {
        planes: &planes,
        shape: (height, width),
        usable: usable.as_ref().map(Mask::usable),
    };
    let shape = match params.bands {
        Bands::Round => BandShape::Round,
        Bands::Square => BandShape::Square,
    };
    let options = fit::Options {
        shape,
        direct: params.weights == Weights::Direct,
        histogram: params.histogram == Histogram::Kept,
    };
    let analysis = fit::analyse(ctx, &exemplar, options)?;
    let structure = analysis.structure;
    let kind = match params.model {
        Kind::Auto if structure.anisotropy > DIRECTED => Kind::Oriented,
        Kind::Auto => Kind::Wavelet,
        kind => kind,
    };
    let (fitted, model) = match kind {
        Kind::Tiling => {
            let (fit, layout) = tiling::fit::fit(ctx, &analysis, &exemplar, tiled(params))?;
            let channels = fit.channels.clone();
            (fit, Model::Tiling { layout, channels })
        }
        Kind::Oriented => {
            let oriented::Oriented { angle, bands, fit } = oriented::fit(&analysis, exemplar.shape);
            let channels = fit.channels.clone();
            (fit, Model::Oriented { angle, bands, channels })
        }
        Kind::Wavelet | Kind::Auto => {
            let fit = fit::fit(&analysis, exemplar.shape, options);
            let channels = fit.channels.clone();
            (fit, Model::Wavelet { bands: shape, channels })
        }
    };
    let score = score(&structure, kind);
    notes.extend(advice(&structure, &score, kind));
    ctx.step(1)?;
    if maps.iter().any(|map| map.picture.alpha_channel().is_some()) {
        notes.push("alpha says where the photo counts; the texture has none".into());
    }
    let document = Document::new(
        ctx.seed as u32,
        [width as u32, height as u32],
        maps.iter().map(spec).collect(),
        fitted.mean,
        fitted.matrix,
        model,
        score,
    );
    let texture = NoiseTexture::new(document);
    let report = NoiseReport {
        version: env!("CARGO_PKG_VERSION"),
        params: params.show(),
        photo_size: (width, height),
        bands: texture.document().terms().len(),
        fit: texture.document().score.fit,
        recommended: texture.document().score.recommended.clone(),
        kurtosis: structure.kurtosis,
        patchiness: structure.patchiness,
        anisotropy: structure.anisotropy,
        periodicity: structure.periodicity,
        bytes: texture.to_json().len(),
        seconds: vec![("read", prepared), ("fit", begun.elapsed().as_secs_f64() - prepared)],
        notes,
    };
    Ok((texture, report))
}

/// From which anisotropy on noise has directions unless it is asked for otherwise.
const DIRECTED: f64 = 0.2;

/// From which periodicity on a photo is one of bricks, weave or the like.
const REPEATS: f64 = 0.25;

/// From which fit on a texture is recommended.
const GOOD: f64 = 0.5;

fn score(structure: &Structure, kind: Kind) -> Score {
    let fits = [
        ("wavelet", structure.isotropic_fit()),
        ("oriented", structure.oriented_fit()),
        ("tiling", structure.tiling_fit()),
    ];
    let good = fits.into_iter().find(|(_, fit)| *fit >= GOOD);
    let fit = match kind {
        Kind::Wavelet | Kind::Auto => fits[0].1,
        Kind::Oriented => fits[1].1,
        Kind::Tiling => fits[2].1,
    };
    Score { fit, recommended: good.map_or("none", |(name, _)| name).into() }
}

/// What the user should know about the fit.
fn advice(structure: &Structure, score: &Score, kind: Kind) -> Option<String> {
    let fit = score.fit;
    let reason = if structure.kurtosis > 2.0 * structure.patchiness {
        "it has edges or marks"
    } else {
        "its detail varies from place to place"
    };
    let (verb, keeps) = if structure.periodicity > REPEATS {
        ("regular", "what repeats in step")
    } else {
        ("tile", "shapes")
    };
    match (score.recommended.as_str(), kind) {
        ("none", Kind::Tiling) => {
            Some(format!("tiling fits this photo badly ({fit:.2} of 1); `{verb}` keeps {keeps}"))
        }
        ("none", _) => Some(format!(
            "noise fits this photo badly ({fit:.2} of 1): {reason}, which noise does not have; \
             `{verb}` keeps {keeps}"
        )),
        ("tiling", Kind::Wavelet | Kind::Oriented | Kind::Auto) => Some(format!(
            "noise fits this photo badly ({fit:.2} of 1): {reason}, which noise does not have; \
             the model `tiling` keeps them"
        )),
        ("oriented", Kind::Wavelet) => Some(format!(
            "the photo has a direction, and this noise has none ({fit:.2} of 1); oriented noise fits \
             better"
        )),
        _ => None,
    }
}

/// How tiles are made.
fn tiled(params: &NoiseParams) -> tiling::fit::Options {
    let [cell, sharpness, longest] = [params.cell, params.sharpness, params.keep].map(|n| n as u32);
    tiling::fit::Options { cell, sharpness, longest }
}

/// The size that all maps have.
fn checked(maps: &[NamedMap], params: &NoiseParams) -> Result<(usize, usize)> {
    let Some(first) = maps.first() else {
        return Err(Error::parameter("maps", "at least one map", "none"));
    };
    let (height, width) = (first.picture.height(), first.picture.width());
    if height.min(width) < SMALLEST {
        let (what, remedy) = ("the photo".into(), "take a larger one".into());
        return Err(Error::TooSmall { what, width, height, need: SMALLEST, remedy });
    }
    let mut channels = 0;
    for (i, map) in maps.iter().enumerate() {
        if maps[..i].iter().any(|other| other.name == map.name) {
            return Err(Error::parameter(
                "maps",
                "maps of different names",
                format!("two called `{}`", map.name),
            ));
        }
        let (got_h, got_w) = (map.picture.height(), map.picture.width());
        if (got_h, got_w) != (height, width) {
            return Err(Error::SizeMismatch {
                what: format!("the map `{}`", map.name),
                got_w,
                got_h,
                want_w: width,
                want_h: height,
                remedy: "maps are fitted pixel by pixel: scale it".into(),
            });
        }
        map.picture.ensure_finite(&format!("the map `{}`", map.name))?;
        channels += colour_channels(map.picture);
    }
    if channels > MOST_CHANNELS {
        let expected = format!("maps of at most {MOST_CHANNELS} channels in all");
        return Err(Error::parameter("maps", expected, channels));
    }
    // Planes, their projection, and complex numbers of double width twice for a transform.
    let mut need = (channels * 4 + 4 + 2 * 16 + 8) * height * width;
    if params.model == Kind::Tiling {
        // The channels again; of the part that is kept the pictures, their levels, and what is compared.
        let kept = height.min(params.keep) * width.min(params.keep);
        need += channels * 4 * height * width + (channels * 24 + 80) * kept;
    }
    let need = Some(need as u64);
    ensure_available("the analysis of the photo", need)?;
    Ok((height, width))
}

/// Where all maps and the mask say that the photo counts; `None` is everywhere.
fn usable(maps: &[NamedMap], mask: Option<&Mask>) -> Result<Option<Mask>> {
    let (height, width) = (maps[0].picture.height(), maps[0].picture.width());
    if let Some(mask) = mask {
        mask.ensure_size("the mask", height, width)?;
    }
    let alphas = maps.iter().filter_map(|map| Mask::from_alpha(map.picture));
    let all = mask.cloned().into_iter().chain(alphas).map(Ok);
    let usable = all.reduce(|a, b| a?.and(&b?)).transpose()?;
    if let Some(mask) = usable.as_ref().filter(|mask| mask.count() < SMALLEST * SMALLEST) {
        return Err(Error::EmptyMask { usable: mask.count(), patch: SMALLEST });
    }
    Ok(usable.filter(|mask| mask.count() < mask.usable().len()))
}

/// Number of channels without alpha.
fn colour_channels(picture: &Picture) -> usize {
    picture.channels() - usize::from(picture.alpha_channel().is_some())
}

fn planes(picture: &Picture) -> Vec<Vec<f32>> {
    let (n, channels) = (picture.height() * picture.width(), picture.channels());
    let plane = |c| (0..n).map(|i| picture.samples().unit(i * channels + c) as f32).collect();
    (0..colour_channels(picture)).map(plane).collect()
}

fn spec(map: &NamedMap) -> MapSpec {
    use crate::base::params::Value;
    let encoding = match map.picture.encoding {
        Encoding::Srgb => "srgb",
        Encoding::Linear => "linear",
        Encoding::Data => "data",
    };
    MapSpec {
        name: map.name.to_owned(),
        kind: map.kind.show(),
        encoding: encoding.into(),
        channels: colour_channels(map.picture),
    }
}
