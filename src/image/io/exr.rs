//! `OpenEXR`, by the `exr` crate: half stays half, float stays float, values above 1 survive.

use std::io::Cursor;

use exr::image::write::WritableImage;
use exr::image::{AnyChannel, AnyChannels, Encoding as Packing, FlatSamples, Image, Layer};
use exr::meta::attribute::{AttributeValue, LineOrder, Text};
use exr::meta::header::{Header, LayerAttributes};
use exr::prelude::{Blocks, Compression, ReadChannels, ReadLayers};
use half::f16;

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
    let fault = |e: exr::error::Error| -> Error {
        match e {
            exr::error::Error::NotSupported(what) => source.unsupported(what),
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

/// Encodes any number of channels. Half and single floats keep their bits; doubles are rounded to
/// the nearest single float; integers become linear light (colors) or `v / full scale` (data) in
/// single floats, from which the integers can be had back exactly. Colors are multiplied by alpha.
pub(super) fn encode(picture: &Picture, record: Option<&str>) -> Result<Vec<u8>, String> {
    if picture.meta.icc.is_some() && picture.encoding == Encoding::Srgb {
        return Err("EXR cannot hold the color profile the samples are in; use .png or .tif".into());
    }
    let c = picture.channels();
    let alpha = picture.alpha_channel();
    let mut samples = match picture.samples() {
        Samples::F16(_) | Samples::F32(_) => picture.samples().clone(),
        Samples::F64(v) => Samples::F32(v.iter().map(|s| *s as f32).collect()),
        Samples::U8(v) => Samples::F32(floats(v, c, picture.encoding, alpha)),
        Samples::U16(v) => Samples::F32(floats(v, c, picture.encoding, alpha)),
    };
    if alpha.is_some() {
        by_alpha(&mut samples, c, |color, alpha| color * alpha);
    }
    let names: Vec<String> = match c {
        1 => vec!["Y".into()],
        2 => vec!["Y".into(), "A".into()],
        3 => ["R", "G", "B"].map(String::from).to_vec(),
        4 => ["R", "G", "B", "A"].map(String::from).to_vec(),
        n => (0..n).map(|i| format!("C{i:04}")).collect(),
    };
    let plane = |k: usize| match &samples {
        Samples::F16(v) => FlatSamples::F16(v.iter().skip(k).step_by(c).copied().collect()),
        Samples::F32(v) => FlatSamples::F32(v.iter().skip(k).step_by(c).copied().collect()),
        _ => FlatSamples::F32(Vec::new()),
    };
    let channels = names.into_iter().enumerate().map(|(k, name)| (name, plane(k))).collect();
    let density = picture.meta.pixels_per_metre.map(|(x, _)| (f64::from(x) * 0.0254) as f32);
    encode_planes((picture.width(), picture.height()), channels, density, record)
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

/// An EXR file of these channels, in blocks of ZIP. The record is its only attribute of ours: more
/// than one would come out in random order.
pub(super) fn encode_planes(
    size: (usize, usize),
    channels: Vec<(String, FlatSamples)>,
    density: Option<f32>,
    record: Option<&str>,
) -> Result<Vec<u8>, String> {
    let mut list = Vec::with_capacity(channels.len());
    for (name, plane) in channels {
        let name = Text::new_or_none(&name).ok_or("a channel name is not plain text")?;
        list.push(AnyChannel::new(name, plane));
    }
    let packing = Packing {
        compression: Compression::ZIP16,
        blocks: Blocks::ScanLines,
        line_order: LineOrder::Increasing,
    };
    let attributes = LayerAttributes { horizontal_density: density, ..LayerAttributes::default() };
    let layer =
        Layer::new(size, attributes, packing, AnyChannels::sort(list.into_iter().collect()));
    let mut image = Image::from_layer(layer);
    if let Some(record) = record {
        let text = Text::new_or_none(record).ok_or("the record is not plain text")?;
        image.attributes.other.insert(Text::from("texforge"), AttributeValue::Text(text));
    }
    let mut out = Cursor::new(Vec::new());
    image.write().non_parallel().to_buffered(&mut out).map_err(|e| e.to_string())?;
    Ok(out.into_inner())
}
