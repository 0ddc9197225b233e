//! [`NoiseTexture`]: a fitted texture, evaluated, rendered, changed.

use std::ops::Range;
use std::sync::Arc;

use rayon::prelude::*;

use crate::base::ctx::Ctx;
use crate::base::error::{Error, Result};
use crate::base::memory::ensure_available;
use crate::base::params::Value as _;
use crate::export::Program;
use crate::image::material::MapKind;
use crate::image::picture::{Encoding, Picture, Sample as _, Samples};
use crate::method::noise::raster::{self, View};
use crate::method::noise::{Document, Evaluator, Filter, MapSpec, Model};

/// A procedural texture, ready to be evaluated. Cloning is cheap.
#[derive(Debug, Clone)]
pub struct NoiseTexture {
    evaluator: Arc<Evaluator>,
}

/// The type of a rendered picture's samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SampleType {
    /// 8 bits.
    U8,
    /// 16 bits.
    U16,
    /// Single floats, not clipped.
    F32,
}

/// A map's name, kind and picture.
pub type RenderedMap = (String, MapKind, Picture);

/// What part of a texture is rendered, and how.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RenderParams {
    /// Width and height in pixels.
    pub size: (usize, usize),
    /// Distance of pixels in pixels of the photo: 0.5 magnifies twice.
    pub scale: f64,
    /// Where the upper left corner lies (x, y), in pixels of the photo.
    pub origin: [f64; 2],
    /// Whether right fits left, and bottom top.
    pub tileable: bool,
    /// Whether what `scale` takes away is made up for, so that the contrast stays.
    pub keep_contrast: bool,
    /// The type of the samples.
    pub samples: SampleType,
}

impl RenderParams {
    /// Of this width and height, at the photo's scale, in 8 bits.
    pub fn new(size: (usize, usize)) -> Self {
        let (scale, origin, samples) = (1.0, [0.0; 2], SampleType::U8);
        Self { size, scale, origin, tileable: false, keep_contrast: false, samples }
    }
}

/// Most tiles that are chosen for a picture that goes round: about a minute.
const MOST_TILES: usize = 1 << 16;

/// Points that a thread evaluates at a time.
const CHUNK: usize = 4096;

impl NoiseTexture {
    /// Of a valid document.
    pub(super) fn new(document: Document) -> Self {
        Self { evaluator: Arc::new(Evaluator::new(document)) }
    }

    /// Reads a texture from the text of its document.
    ///
    /// # Errors
    /// [`Error::Document`] if the text is damaged or of a later version.
    pub fn from_json(text: &str) -> Result<Self> {
        Document::from_json(text).map(Self::new)
    }

    /// The text of its document: JSON in one line.
    pub fn to_json(&self) -> String {
        self.document().to_json()
    }

    /// What the texture consists of.
    pub fn document(&self) -> &Document {
        self.evaluator.document()
    }

    /// The numbers that a shader needs to compute it.
    pub fn program(&self) -> Program {
        Program::new(&self.evaluator)
    }

    /// Number of channels of a value: those of all maps, one after the other.
    pub fn channels(&self) -> usize {
        self.evaluator.channels()
    }

    /// Values at points (x, y) in pixels of the photo: for each all channels, with full scale 1, not
    /// clipped, in the maps' encodings. `footprint` is the distance of samples to filter for, 0 is not at
    /// all.
    ///
    /// A value depends on its point alone, not on the others or their order. At the middles of the pixels
    /// that [`NoiseTexture::render`] makes it has the same bits.
    ///
    /// # Errors
    /// [`Error::Parameter`] for points that are not finite or a bad footprint; [`Error::Memory`];
    /// [`Error::Cancelled`].
    pub fn at(&self, ctx: &Ctx, points: &[[f64; 2]], filter: Filter) -> Result<Vec<f32>> {
        ensure_points(points, filter)?;
        self.chunked(ctx, points, |_, points, out| self.evaluator.plane(points, filter, out))
    }

    /// Values at points (x, y, z) of a solid texture; with the unit normals of a surface at the points,
    /// values on that: they lack the lower frequencies that a cut through a solid has.
    ///
    /// # Errors
    /// Those of [`NoiseTexture::at`]; [`Error::Parameter`] also if there is not one normal to a point, if
    /// one is no direction, and for a texture that is not isotropic noise: it has no third axis.
    pub fn solid(
        &self,
        ctx: &Ctx,
        points: &[[f64; 3]],
        normals: Option<&[[f64; 3]]>,
        filter: Filter,
    ) -> Result<Vec<f32>> {
        ensure_points(points, filter)?;
        self.ensure_solid("points")?;
        let normals = normals.map(|normals| unit(normals, points.len())).transpose()?;
        self.chunked(ctx, points, |first, points, out| {
            let normals = normals.as_ref().map(|n| &n[first..][..points.len()]);
            self.evaluator.solid(points, normals, filter, out);
        })
    }

    /// A block of the solid texture: (depth, height, width) voxels, `scale` pixels of the photo apart, with
    /// a corner at `origin` (x, y, z); for every voxel all channels, at its middle the bits of
    /// [`NoiseTexture::solid`].
    ///
    /// # Errors
    /// [`Error::Parameter`] for a side of 0 or more than 65536 voxels, a scale or an origin out of range, and
    /// for a texture that is not isotropic noise; [`Error::Memory`]; [`Error::Cancelled`].
    pub fn volume(
        &self,
        ctx: &Ctx,
        shape: [usize; 3],
        scale: f64,
        origin: [f64; 3],
        keep_contrast: bool,
    ) -> Result<Vec<f32>> {
        let [depth, height, width] = shape;
        if shape.iter().any(|n| !(1..=Picture::MAX_SIDE).contains(n)) {
            let expected = format!("1 to {} voxels a side", Picture::MAX_SIDE);
            return Err(Error::parameter("shape", expected, format!("{depth}x{height}x{width}")));
        }
        ensure_place(scale, &origin)?;
        self.ensure_solid("shape")?;
        let channels = self.channels();
        let voxels = shape.iter().try_fold(1_usize, |n, &side| n.checked_mul(side));
        // The values, and a copy for whoever asked.
        let bytes = voxels.and_then(|n| n.checked_mul(channels * 8));
        ensure_available("the volume", bytes.map(|n| n as u64))?;
        let mut out = vec![0.0; depth * height * width * channels];
        let filter = Filter { footprint: footprint(scale), keep_contrast };
        let at = |i: usize, axis: usize| origin[axis] + (i as f64 + 0.5) * scale;
        ctx.begin((depth * height) as u64);
        ctx.install(|| {
            let rows = out.par_chunks_mut(width * channels).enumerate();
            rows.try_for_each(|(row, out)| {
                let (z, y) = (at(row / height, 2), at(row % height, 1));
                let points: Vec<_> = (0..width).map(|x| [at(x, 0), y, z]).collect();
                self.evaluator.solid(&points, None, filter, out);
                ctx.step(1)
            })
        })?;
        Ok(out)
    }

    /// Fails, about parameter `name`, if the texture has no third axis.
    fn ensure_solid(&self, name: &'static str) -> Result<()> {
        if matches!(self.document().model, Model::Wavelet { .. }) {
            return Ok(());
        }
        let expected = "of two axes (x, y) for this texture, which lies on the plane";
        Err(Error::parameter(name, expected, "three"))
    }

    fn chunked<P: Sync>(
        &self,
        ctx: &Ctx,
        points: &[P],
        evaluate: impl Fn(usize, &[P], &mut [f32]) + Sync,
    ) -> Result<Vec<f32>> {
        let channels = self.channels();
        let len = points.len().checked_mul(channels);
        ensure_available("the values", len.and_then(|n| n.checked_mul(4)).map(|n| n as u64))?;
        let mut out = vec![0.0; points.len() * channels];
        ctx.begin(points.len() as u64);
        ctx.install(|| {
            let chunks = points.par_chunks(CHUNK).zip(out.par_chunks_mut(CHUNK * channels));
            chunks.enumerate().try_for_each(|(i, (points, out))| {
                evaluate(i * CHUNK, points, out);
                ctx.step(points.len() as u64)
            })
        })?;
        Ok(out)
    }

    /// Renders a part of the texture: every map's name, kind and picture.
    ///
    /// # Errors
    /// [`Error::Parameter`] for a size of 0 or more than 65536, a scale or an origin out of range, or a
    /// tileable texture with turned directions or more than 65536 tiles; [`Error::Memory`]; [`Error::Cancelled`].
    pub fn render(&self, ctx: &Ctx, params: &RenderParams) -> Result<Vec<RenderedMap>> {
        let (width, height) = params.size;
        let mut strips = self.strips(ctx, params, width.saturating_mul(height))?;
        strips.next().unwrap_or_else(|| Ok(Vec::new()))
    }

    /// The same pictures from top to bottom, about so many pixels of each at a time, for those larger than
    /// memory: every strip has the rows that [`NoiseTexture::render`] gives.
    ///
    /// # Errors
    /// Those of [`NoiseTexture::render`].
    pub fn strips(
        &self,
        ctx: &Ctx,
        params: &RenderParams,
        pixels: usize,
    ) -> Result<impl Iterator<Item = Result<Vec<RenderedMap>>> + use<>> {
        let (width, height) = params.size;
        if [width, height].iter().any(|n| !(1..=Picture::MAX_SIDE).contains(n)) {
            return Err(Error::parameter(
                "size",
                format!("1x1 to {0}x{0} pixels", Picture::MAX_SIDE),
                format!("{width}x{height}"),
            ));
        }
        ensure_place(params.scale, &params.origin)?;
        let matches = |m: &Model| matches!(m, Model::Oriented { angle, .. } if *angle != 0.0);
        if params.tileable && matches(&self.document().model) {
            let expected = "off for this texture, whose directions are turned";
            return Err(Error::parameter("tileable", expected, "on"));
        }
        let rows = (pixels / width).clamp(1, height);
        let bytes = (width * rows).checked_mul(self.channels() * 8);
        ensure_available("the picture", bytes.map(|n| n as u64))?;
        let period = params.tileable.then(|| [width, height].map(|n| n as f64 * params.scale));
        let tiles = period.map_or(0, |period| self.evaluator.periodic_tiles(period));
        if tiles > MOST_TILES {
            let expected = format!("off for so large a part: at most {MOST_TILES} tiles go round");
            return Err(Error::parameter("tileable", expected, format!("on with {tiles}")));
        }
        let steps = period.map_or(0, |period| self.evaluator.periodic_steps(period));
        ctx.begin(height as u64 + steps);
        let texture = match period.filter(|_| steps > 0) {
            None => self.clone(),
            Some(period) => {
                let evaluator = ctx.install(|| self.evaluator.periodic(ctx, period))?;
                Self { evaluator: Arc::new(evaluator) }
            }
        };
        let (ctx, params) = (ctx.clone(), *params);
        let strip =
            move |first: usize| texture.strip(&ctx, &params, first..(first + rows).min(height));
        Ok((0..height).step_by(rows).map(strip))
    }

    /// Some rows of all maps.
    fn strip(
        &self,
        ctx: &Ctx,
        params: &RenderParams,
        rows: Range<usize>,
    ) -> Result<Vec<RenderedMap>> {
        let (width, height) = params.size;
        let view = View {
            size: (height, width),
            scale: params.scale,
            origin: params.origin,
            tileable: params.tileable,
        };
        let filter =
            Filter { footprint: footprint(params.scale), keep_contrast: params.keep_contrast };
        let size = (rows.len(), width);
        let mut values =
            ctx.install(|| raster::render(ctx, &self.evaluator, &view, rows, filter))?;
        let mut first = 0;
        let maps = self.document().maps.iter().map(|map| {
            let kind = MapKind::parse(&map.kind).unwrap_or(MapKind::Data);
            let range = first..first + map.channels;
            first += map.channels;
            let picture = ctx.install(|| {
                let pixels = if range.len() == self.channels() {
                    std::mem::take(&mut values)
                } else {
                    gathered(&values, self.channels(), range)
                };
                picture(pixels, map, kind, size, params.samples)
            })?;
            Ok((map.name.clone(), kind, picture))
        });
        maps.collect()
    }
}

/// A range of all pixels' channels.
fn gathered(values: &[f32], channels: usize, range: Range<usize>) -> Vec<f32> {
    let mut out = vec![0.0; values.len() / channels * range.len()];
    let pixels = out.par_chunks_exact_mut(range.len()).zip(values.par_chunks_exact(channels));
    pixels.for_each(|(out, values)| out.copy_from_slice(&values[range.clone()]));
    out
}

/// The pixels of a map as a picture.
fn picture(
    mut pixels: Vec<f32>,
    map: &MapSpec,
    kind: MapKind,
    (height, width): (usize, usize),
    samples: SampleType,
) -> Result<Picture> {
    if kind.is_normal() && map.channels == 3 {
        pixels.par_chunks_exact_mut(3).for_each(upright);
    }
    let unit = |v: &f32| f64::from(*v);
    let samples = match samples {
        SampleType::U8 => Samples::U8(pixels.par_iter().map(|v| u8::from_unit(unit(v))).collect()),
        SampleType::U16 => {
            Samples::U16(pixels.par_iter().map(|v| u16::from_unit(unit(v))).collect())
        }
        SampleType::F32 => Samples::F32(pixels),
    };
    let encoding = match map.encoding.as_str() {
        "srgb" => Encoding::Srgb,
        "linear" => Encoding::Linear,
        _ => Encoding::Data,
    };
    Picture::new(height, width, map.channels, samples, encoding)
}

/// A normal stored as `(n + 1) / 2`, brought to unit length.
fn upright(stored: &mut [f32]) {
    let n: [f32; 3] = std::array::from_fn(|i| 2.0 * stored[i] - 1.0);
    let length = (n[0] * n[0] + n[1] * n[1] + n[2] * n[2]).sqrt();
    let unit = if length > 1e-6 { n.map(|v| v / length) } else { [0.0, 0.0, 1.0] };
    stored.iter_mut().zip(unit).for_each(|(s, v)| *s = 0.5 * (v + 1.0));
}

/// Beyond so many pixels neighbouring points are no longer told apart well.
const FARTHEST: f64 = 1e9;

/// Pixels as near to each other as the photo's, or nearer, hold all bands.
fn footprint(scale: f64) -> f64 {
    if scale > 1.0 { scale } else { 0.0 }
}

fn ensure_place(scale: f64, origin: &[f64]) -> Result<()> {
    if !(1e-3..=1e4).contains(&scale) {
        return Err(Error::parameter("scale", "0.001 to 10000", scale));
    }
    if let Some(bad) = origin.iter().find(|v| v.is_nan() || v.abs() > FARTHEST) {
        return Err(Error::parameter("origin", format!("within {FARTHEST:e} pixels"), bad));
    }
    Ok(())
}

fn ensure_points<const N: usize>(points: &[[f64; N]], filter: Filter) -> Result<()> {
    if let Some(bad) = points.iter().flatten().find(|v| v.is_nan() || v.abs() > FARTHEST) {
        return Err(Error::parameter(
            "points",
            format!("finite and within {FARTHEST:e} pixels"),
            bad,
        ));
    }
    if !(0.0..=1e6).contains(&filter.footprint) {
        return Err(Error::parameter("footprint", "0 to 1000000", filter.footprint));
    }
    Ok(())
}

/// Normals of unit length, one for each of `count` points.
fn unit(normals: &[[f64; 3]], count: usize) -> Result<Vec<[f64; 3]>> {
    if normals.len() != count {
        return Err(Error::parameter(
            "normals",
            format!("one for each of {count} points"),
            normals.len(),
        ));
    }
    let one = |n: &[f64; 3]| {
        let length = n.iter().map(|v| v * v).sum::<f64>().sqrt();
        if !(1e-9..1e9).contains(&length) {
            return Err(Error::parameter("normals", "vectors of some length", format!("{n:?}")));
        }
        Ok(n.map(|v| v / length))
    };
    normals.iter().map(one).collect()
}
