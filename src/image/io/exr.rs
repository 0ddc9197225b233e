//! `OpenEXR`, by the `exr` crate: half stays half, float stays float, values above 1 survive.

use std::borrow::Cow;
use std::io::{Cursor, Seek, Write};

use exr::block::writer::{ChunkWriter, ChunksWriter};
use exr::block::{BlockIndex, UncompressedBlock};
use exr::error::{Error as Fault, UnitResult};
use exr::image::FlatSamples;
use exr::io::Data;
use exr::math::Vec2;
use exr::meta::attribute::{AttributeValue, ChannelDescription, LineOrder, SampleType, Text};
use exr::meta::header::{Header, ImageAttributes, LayerAttributes};
use exr::meta::{BlockDescription, MetaData};
use exr::prelude::{Compression, ReadChannels, ReadLayers};
use half::f16;

use super::rows::{Frame, Pieces, Sink};
use super::{Raw, Source};
use crate::base::error::{Error, Result};
use crate::image::color::linear_from_srgb;
use crate::image::material::MapKind;
use crate::image::picture::{Encoding, Picture, Sample, Samples};

/// A flat layer as stored.
pub(super) struct Planes {
    pub(super) width: usize,
    pub(super) height: usize,
    /// Channels in the order of their names.
    pub(super) channels: Vec<(String, FlatSamples)>,
    /// Our own attribute.
    pub(super) record: Option<String>,
    attributes: LayerAttributes,
    notes: Vec<String>,
}

/// Reads the first flat layer at its largest resolution.
pub(super) fn read_planes(source: &Source) -> Result<Planes> {
    let fault = |e: Fault| -> Error {
        match e {
            Fault::NotSupported(what) => source.unsupported(what),
            e => source.damaged("EXR", e),
        }
    };
    let reader = exr::block::read(Cursor::new(source.bytes), false).map_err(fault)?;
    let headers = reader.headers();
    let Some(header) = headers.iter().find(|h| !h.deep) else {
        return Err(source.unsupported("deep data only"));
    };
    if header.channels.list.iter().any(|c| c.sampling.0 != 1 || c.sampling.1 != 1) {
        return Err(source.unsupported("channels of lower resolution (luma and chroma)"));
    }
    let size = (header.layer_size.0, header.layer_size.1);
    let bytes = header.channels.list.iter().map(|c| c.sample_type.bytes_per_sample()).sum();
    source.check_size(size, bytes, ratio(header))?;

    let mut notes = Vec::new();
    if headers.len() > 1 {
        notes.push(format!("the file has {} layers; the first flat one was read", headers.len()));
    }
    let image = exr::image::read::read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .first_valid_layer()
        .all_attributes()
        .non_parallel()
        .from_chunks(reader)
        .map_err(fault)?;
    if image.attributes.pixel_aspect != 1.0 {
        notes.push(format!(
            "the pixels are not square (aspect {}); they are used as if they were",
            image.attributes.pixel_aspect
        ));
    }
    let srgb_red = |x: f32| (x - 0.64).abs() < 0.005;
    if image.attributes.chromaticities.is_some_and(|c| !srgb_red(c.red.0)) {
        notes.push(
            "the file has other primaries than sRGB; its numbers are used as they are".into(),
        );
    }
    let text = |value: &AttributeValue| match value {
        AttributeValue::Text(text) => Some(text.to_string()),
        _ => None,
    };
    let layer = image.layer_data;
    // The crate files attributes it does not know under the layer.
    let record = layer.attributes.other.get(&Text::from("texforge")).and_then(text);
    let (width, height) = (layer.size.0, layer.size.1);
    let channels: Vec<_> = layer
        .channel_data
        .list
        .into_iter()
        .map(|channel| (channel.name.to_string(), channel.sample_data))
        .collect();
    if channels.is_empty() || channels.iter().any(|(_, plane)| plane.len() != width * height) {
        return Err(source.damaged("EXR", "there are too few samples"));
    }
    Ok(Planes { width, height, channels, record, attributes: layer.attributes, notes })
}

/// How much smaller than its samples a file can be; unknown for the wavelet and cosine methods.
fn ratio(header: &Header) -> Option<u64> {
    match header.compression {
        Compression::Uncompressed
        | Compression::RLE
        | Compression::ZIP1
        | Compression::ZIP16
        | Compression::PXR24 => Some(1100),
        _ => None,
    }
}

pub(super) fn decode(source: &Source) -> Result<Raw> {
    let mut planes = read_planes(source)?;
    strip_layer_name(&mut planes.channels);
    let find = |name: &str| planes.channels.iter().position(|(n, _)| n == name);
    let alpha = find("A");
    let named = |names: &[&str]| names.iter().map(|n| find(n)).collect::<Option<Vec<_>>>();
    let is_luma = find("X").is_none() && find("Z").is_none();
    let mut order = named(&["R", "G", "B"]).or_else(|| named(&["Y"]).filter(|_| is_luma));
    let is_color = order.is_some();
    let order = match &mut order {
        Some(order) => {
            order.extend(alpha);
            order.clone()
        }
        None => (0..planes.channels.len()).collect(),
    };
    let left: Vec<&str> = (0..planes.channels.len())
        .filter(|i| !order.contains(i))
        .map(|i| planes.channels[i].0.as_str())
        .collect();
    if !left.is_empty() {
        planes.notes.push(format!("the channels {} were left out", left.join(", ")));
    }
    let chosen: Vec<&FlatSamples> = order.iter().map(|&i| &planes.channels[i].1).collect();
    let samples = interleaved(&chosen, planes.width * planes.height);
    let mut raw = Raw::new((planes.width, planes.height), chosen.len(), samples);
    if !is_color {
        raw.encoding = Encoding::Data;
        if source.kind == MapKind::Color {
            let names: Vec<_> = planes.channels.iter().map(|(name, _)| name.as_str()).collect();
            let note =
                format!("the channels {} are no colors; they are used as data", names.join(", "));
            planes.notes.push(note);
        }
    }
    if is_color && alpha.is_some() && source.kind == MapKind::Color && divide(&mut raw) {
        planes
            .notes
            .push("the colors were stored multiplied by alpha and have been divided by it".into());
    }
    let density = planes.attributes.horizontal_density.map(f64::from);
    raw.pixels_per_metre = super::exif::per_metre(density.zip(density), 2);
    raw.notes = planes.notes;
    Ok(raw)
}

/// Removes the layer's name (`diffuse.R`) if all channels have the same.
fn strip_layer_name(channels: &mut [(String, FlatSamples)]) {
    let layer = |name: &str| name.rsplit_once('.').map(|(layer, _)| layer.to_owned());
    let first = channels.first().and_then(|(name, _)| layer(name));
    if let Some(first) = first
        && channels.iter().all(|(name, _)| layer(name).as_ref() == Some(&first))
    {
        for (name, _) in channels {
            name.drain(..=first.len());
        }
    }
}

/// Pixels in the widest type of the planes (double for 32-bit integers, which single cannot hold).
fn interleaved(planes: &[&FlatSamples], n: usize) -> Samples {
    fn collect<T: Sample>(
        planes: &[&FlatSamples],
        n: usize,
        of: impl Fn(&FlatSamples, usize) -> T,
    ) -> Samples {
        let pixels = (0..n).flat_map(|i| planes.iter().map(move |plane| (*plane, i)));
        T::wrap(pixels.map(|(plane, i)| of(plane, i)).collect())
    }
    if planes.iter().all(|p| matches!(p, FlatSamples::F16(_))) {
        collect(planes, n, |plane, i| match plane {
            FlatSamples::F16(v) => v[i],
            _ => f16::ZERO,
        })
    } else if planes.iter().any(|p| matches!(p, FlatSamples::U32(_))) {
        collect(planes, n, |plane, i| match plane {
            FlatSamples::F16(v) => v[i].to_f64(),
            FlatSamples::F32(v) => f64::from(v[i]),
            FlatSamples::U32(v) => f64::from(v[i]),
        })
    } else {
        collect(planes, n, |plane, i| match plane {
            FlatSamples::F16(v) => v[i].to_f32(),
            FlatSamples::F32(v) => v[i],
            FlatSamples::U32(v) => v[i] as f32,
        })
    }
}

/// Divides colors by alpha where it is neither 0 (the color stays: light that does not cover) nor
/// 1; says whether there was such a pixel.
fn divide(raw: &mut Raw) -> bool {
    let mut any = false;
    by_alpha(&mut raw.samples, raw.channels, |color, alpha| {
        any = true;
        color / alpha
    });
    any
}

fn by_alpha(samples: &mut Samples, c: usize, mut f: impl FnMut(f64, f64) -> f64) {
    crate::with_samples!(samples, v => for p in v.chunks_exact_mut(c) {
        let alpha = p[c - 1].to_unit();
        if alpha != 0.0 && alpha != 1.0 && alpha.is_finite() {
            for s in &mut p[..c - 1] {
                *s = Sample::from_unit(f(s.to_unit(), alpha));
            }
        }
    });
}

/// Writes any number of channels. Half and single floats keep their bits; doubles are rounded to
/// the nearest single float; integers become linear light (colors) or `v / full scale` (data) in
/// single floats, from which the integers can be had back exactly. Colors are multiplied by alpha.
pub(super) fn write<W: Write + Seek>(
    out: &mut Sink<'_, W>,
    frame: &Frame,
    pieces: &mut Pieces,
) -> Result<()> {
    if frame.pixel.meta.icc.is_some() && frame.pixel.encoding == Encoding::Srgb {
        return Err(
            frame.refused("EXR cannot hold the color profile the samples are in; use .png or .tif")
        );
    }
    match frame.pixel.samples() {
        Samples::F16(_) => write_floats::<f16>(out, frame, pieces, SampleType::F16),
        _ => write_floats::<f32>(out, frame, pieces, SampleType::F32),
    }
}

fn write_floats<T: Sample + Data>(
    out: impl Write + Seek,
    frame: &Frame,
    pieces: &mut Pieces,
    kind: SampleType,
) -> Result<()> {
    let pixel = &frame.pixel;
    let c = pixel.channels();
    let names: Vec<String> = match c {
        1 => vec!["Y".into()],
        2 => vec!["Y".into(), "A".into()],
        3 => ["R", "G", "B"].map(String::from).to_vec(),
        4 => ["R", "G", "B", "A"].map(String::from).to_vec(),
        n => (0..n).map(|i| format!("C{i:04}")).collect(),
    };
    let density = pixel.meta.pixels_per_metre.map(|(x, _)| (f64::from(x) * 0.0254) as f32);
    let mut result = Ok(());
    let file = File {
        size: (frame.width, frame.height),
        channels: names.iter().map(|name| (name.as_str(), kind)).collect(),
        density,
        record: frame.record.as_deref(),
    };
    let written = file.write(out, |blocks| {
        result = pieces.bands::<T>(
            BLOCK,
            |samples| stored(samples, pixel),
            |band| blocks.push(|channel, i| band[i * c + channel]).map_err(|e| e.to_string()),
        );
        Ok(())
    });
    result.and(written.map_err(|e| frame.refused(e)))
}

/// Samples of a picture like `pixel` as the file holds them.
fn stored<'a>(samples: &'a Samples, pixel: &Picture) -> Cow<'a, Samples> {
    let (c, alpha) = (pixel.channels(), pixel.alpha_channel());
    let mut stored = match samples {
        Samples::F16(_) | Samples::F32(_) => Cow::Borrowed(samples),
        Samples::F64(v) => Cow::Owned(Samples::F32(v.iter().map(|s| *s as f32).collect())),
        Samples::U8(v) => Cow::Owned(Samples::F32(floats(v, c, pixel.encoding, alpha))),
        Samples::U16(v) => Cow::Owned(Samples::F32(floats(v, c, pixel.encoding, alpha))),
    };
    if alpha.is_some() {
        by_alpha(stored.to_mut(), c, |color, alpha| color * alpha);
    }
    stored
}

/// Integers as floats, each value looked up in a table made once.
fn floats<T: Sample + Into<usize>>(
    v: &[T],
    c: usize,
    encoding: Encoding,
    alpha: Option<usize>,
) -> Vec<f32> {
    let plain = |i: usize| (i as f64 / T::SCALE) as f32;
    let curved = |i: usize| linear_from_srgb(i as f64 / T::SCALE) as f32;
    let n = T::SCALE as usize + 1;
    let straight: Vec<f32> = (0..n).map(plain).collect();
    let table: Vec<f32> =
        if encoding == Encoding::Srgb { (0..n).map(curved).collect() } else { straight.clone() };
    let value = |(i, s): (usize, &T)| {
        let table = if alpha == Some(i % c) { &straight } else { &table };
        table[(*s).into()]
    };
    v.iter().enumerate().map(value).collect()
}

const PACKING: Compression = Compression::ZIP16;
/// Rows in a block.
pub(super) const BLOCK: usize = PACKING.scan_lines_per_block();

/// An EXR file, written block by block. The record is its only attribute of ours: more than one
/// would come out in random order.
pub(super) struct File<'a> {
    /// Width and height.
    pub(super) size: (usize, usize),
    pub(super) channels: Vec<(&'a str, SampleType)>,
    /// Pixels per inch.
    pub(super) density: Option<f32>,
    pub(super) record: Option<&'a str>,
}

impl File<'_> {
    /// Writes the file; `fill` is to push all blocks.
    pub(super) fn write<W: Write + Seek>(
        &self,
        out: W,
        fill: impl FnOnce(&mut BlockWriter<'_, W>) -> UnitResult,
    ) -> UnitResult {
        let text = |text| {
            Text::new_or_none(text)
                .ok_or(Fault::Invalid("a name or the record is not plain text".into()))
        };
        // The format wants the channels in the order of their names.
        let mut order: Vec<usize> = (0..self.channels.len()).collect();
        order.sort_by_key(|&k| self.channels[k].0);
        let describe = |&k: &usize| {
            let (name, kind) = self.channels[k];
            Ok(ChannelDescription::named(text(name)?, kind))
        };
        let channels = order.iter().map(describe).collect::<exr::error::Result<_>>()?;
        let mut attributes = ImageAttributes::with_size(self.size);
        if let Some(record) = self.record {
            attributes.other.insert(Text::from("texforge"), AttributeValue::Text(text(record)?));
        }
        let own =
            LayerAttributes { horizontal_density: self.density, ..LayerAttributes::default() };
        let header = Header::new(Text::default(), self.size, channels)
            .with_encoding(PACKING, BlockDescription::ScanLines, LineOrder::Increasing)
            .with_attributes(own)
            .with_shared_attributes(attributes);
        exr::block::write(out, std::iter::once(header).collect(), true, |meta, chunks| {
            fill(&mut BlockWriter { meta: &meta, chunks, order: &order, y: 0 })
        })
    }
}

/// Takes the rows of a [`File`] from the top.
pub(super) struct BlockWriter<'a, W> {
    meta: &'a MetaData,
    chunks: &'a mut ChunkWriter<W>,
    /// Our number of each channel of the file.
    order: &'a [usize],
    y: usize,
}

impl<W: Write + Seek> BlockWriter<'_, W> {
    /// Writes the next [`BLOCK`] rows, or those that are left; `value` tells the sample of a channel
    /// at a pixel, counted from the first of these rows.
    pub(super) fn push<T: Data>(&mut self, value: impl Fn(usize, usize) -> T) -> UnitResult {
        let header = &self.meta.headers[0];
        let Vec2(width, height) = header.layer_size;
        let y = self.y;
        let index = BlockIndex {
            layer: 0,
            pixel_position: Vec2(0, y),
            pixel_size: Vec2(width, BLOCK.min(height - y)),
            level: Vec2(0, 0),
        };
        let mut lines = Ok(());
        let block = UncompressedBlock::from_lines(&header.channels, index, |line| {
            let channel = self.order[line.location.channel];
            let start = (line.location.position.1 - y) * width;
            let written = line.write_samples(|x| value(channel, start + x));
            lines = std::mem::replace(&mut lines, Ok(())).and(written);
        });
        lines?;
        self.y += BLOCK;
        self.chunks.sequential_blocks_compressor(self.meta).compress_block(y / BLOCK, block)
    }
}
