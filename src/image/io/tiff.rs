//! TIFF, by the `tiff` crate: integers of 8 and 16 bits, floats, palettes, any number of channels.

use std::io::Cursor;

use tiff::ColorType;
use tiff::TiffError;
use tiff::decoder::{Decoder, DecodingResult, Limits};
use tiff::encoder::colortype::{
    Gray8, Gray16, Gray32Float, Gray64Float, RGB8, RGB16, RGB32Float, RGB64Float,
};
use tiff::encoder::{Compression, DeflateLevel, Rational, TiffEncoder, TiffValue, colortype};
use tiff::tags::{ExtraSamples, ResolutionUnit, Tag};

use super::{Raw, Source, exif};
use crate::base::error::{Error, Result};
use crate::image::material::MapKind;
use crate::image::picture::{Encoding, Picture, Samples};

pub(super) fn decode(source: &Source) -> Result<Raw> {
    let fault = |e: TiffError| -> Error {
        match e {
            TiffError::UnsupportedError(e) => source.unsupported(e),
            e => source.damaged("TIFF", e),
        }
    };
    let mut decoder = Decoder::new(Cursor::new(source.bytes)).map_err(fault)?;
    let (width, height) = decoder.dimensions().map_err(fault)?;
    let size = (width as usize, height as usize);
    let color = decoder.colortype().map_err(fault)?;
    let (stored, bits) = match color {
        ColorType::Gray(bits) => (1, bits),
        ColorType::GrayA(bits) => (2, bits),
        ColorType::RGB(bits) => (3, bits),
        ColorType::RGBA(bits) | ColorType::CMYK(bits) => (4, bits),
        ColorType::Multiband { bit_depth, num_samples } => (num_samples as usize, bit_depth),
        other => return Err(source.unsupported(format!("{other:?} colors"))),
    };
    let most = decoder.find_tag_unsigned(Tag::Compression).ok().flatten();
    // A byte may come from one bit.
    let most = shrink(most.unwrap_or(1)).map(|ratio| 24 * ratio);
    source.check_size(size, stored.max(3) * usize::from(bits.div_ceil(8)), most)?;
    let need = size.0 * size.1 * stored * usize::from(bits.div_ceil(8));
    let mut limits = Limits::default();
    // Lists of values (profiles, offsets) take many times the bytes they are read from.
    limits.ifd_value_size = source.bytes.len().saturating_mul(64);
    limits.decoding_buffer_size = need.max(limits.ifd_value_size);
    limits.intermediate_buffer_size = need + (1 << 20);
    let mut decoder = decoder.with_limits(limits);

    let profile = decoder.get_tag_u8_vec(Tag::IccProfile).ok();
    let number = |tag, decoder: &mut Decoder<_>| -> Option<u16> {
        Decoder::find_tag_unsigned(decoder, tag).ok().flatten()
    };
    let orientation = number(Tag::Orientation, &mut decoder).unwrap_or(1);
    let unit = number(Tag::ResolutionUnit, &mut decoder).unwrap_or(2);
    let mut resolution = |tag| decoder.get_tag(tag).ok().and_then(ratio);
    let resolution = resolution(Tag::XResolution).zip(resolution(Tag::YResolution));
    let in_file = number(Tag::SamplesPerPixel, &mut decoder).unwrap_or(1);
    let extra = decoder.find_tag_unsigned_vec::<u16>(Tag::ExtraSamples).ok().flatten();
    let extra = extra.and_then(|list| list.first().copied()).unwrap_or(0);
    // The crate does not tell grey with alpha from two bands of data.
    let gray_alpha = stored == 2 && matches!(extra, 1 | 2);

    let mut buffer = DecodingResult::U8(Vec::new());
    let layout = decoder.read_image_to_buffer(&mut buffer).map_err(fault)?;
    let planes = layout.planes;
    let samples = match buffer {
        DecodingResult::U8(v) if bits < 8 => Samples::U8(unpack(&v, size.0 * stored, bits)),
        DecodingResult::U8(v) => Samples::U8(interleaved(v, planes)),
        DecodingResult::U16(v) => Samples::U16(interleaved(v, planes)),
        DecodingResult::F16(v) => Samples::F16(interleaved(v, planes)),
        DecodingResult::F32(v) => Samples::F32(interleaved(v, planes)),
        DecodingResult::F64(v) => Samples::F64(interleaved(v, planes)),
        _ => return Err(source.unsupported("signed or 32-bit integers")),
    };
    if samples.len() != size.0 * size.1 * stored {
        return Err(source.damaged("TIFF", "there are too few samples"));
    }

    let (channels, samples) = match (color, samples) {
        (ColorType::CMYK(_), Samples::U8(v)) => (3, Samples::U8(rgb_from_cmyk(&v))),
        (ColorType::CMYK(_), _) => {
            return Err(source.unsupported(format!("{color:?} colors")));
        }
        (_, Samples::U8(v)) if bits < 8 => {
            let scale = 255 / ((1_u16 << bits) - 1);
            (stored, Samples::U8(v.iter().map(|s| (u16::from(*s) * scale) as u8).collect()))
        }
        (_, samples) => (stored, samples),
    };
    let mut raw = Raw::new(size, channels, samples);
    if usize::from(in_file) > stored {
        raw.notes.push(format!("{} extra channels were left out", usize::from(in_file) - stored));
    }
    match color {
        ColorType::Multiband { .. } if !gray_alpha => raw.encoding = Encoding::Data,
        ColorType::CMYK(_) => {
            raw.notes.push("the colors were converted from CMYK to RGB without a profile".into());
        }
        _ => raw.icc = profile,
    }
    if extra == 1 && matches!(channels, 2 | 4) && source.kind == MapKind::Color {
        unassociate(&mut raw);
    }
    raw.orientation = u8::try_from(orientation).ok().filter(|o| (1..=8).contains(o)).unwrap_or(1);
    raw.pixels_per_metre = exif::per_metre(resolution, unit);
    Ok(raw)
}

/// How many times smaller than its samples the data of a compression method can be.
fn shrink(method: u16) -> Option<u64> {
    match method {
        1 => Some(1),
        5 => Some(4096),
        8 | 32946 => Some(1100),
        32773 => Some(128),
        _ => None,
    }
}

fn ratio(value: tiff::decoder::ifd::Value) -> Option<f64> {
    use tiff::decoder::ifd::Value;
    match value {
        Value::Rational(n, d) => Some(f64::from(n) / f64::from(d)),
        Value::List(list) => list.into_iter().next().and_then(ratio),
        _ => None,
    }
}

/// Planes one after the other to pixels.
fn interleaved<T: Copy>(v: Vec<T>, planes: usize) -> Vec<T> {
    if planes <= 1 {
        return v;
    }
    let n = v.len() / planes;
    (0..n * planes).map(|i| v[i % planes * n + i / planes]).collect()
}

/// Samples of 1, 2 or 4 bits, rows padded to bytes, as bytes.
fn unpack(packed: &[u8], row_samples: usize, bits: u8) -> Vec<u8> {
    let bits = usize::from(bits.max(1));
    let mask = ((1_u16 << bits.min(8)) - 1) as u8;
    let row_bytes = (row_samples * bits).div_ceil(8).max(1);
    let sample = |row: &[u8], i: usize| {
        let bit = i * bits;
        row[bit / 8] >> 8_usize.saturating_sub(bits + bit % 8) & mask
    };
    packed
        .chunks_exact(row_bytes)
        .flat_map(|row| (0..row_samples).map(move |i| sample(row, i)))
        .collect()
}

/// Each color is what the ink and the black leave of white.
fn rgb_from_cmyk(v: &[u8]) -> Vec<u8> {
    let left = |ink: u8, black: u8| ((255 - u32::from(ink)) * (255 - u32::from(black)) + 127) / 255;
    v.chunks_exact(4)
        .flat_map(|p| [left(p[0], p[3]), left(p[1], p[3]), left(p[2], p[3])])
        .map(|v| v as u8)
        .collect()
}

/// Divides colors by alpha, as our pictures have it straight.
fn unassociate(raw: &mut Raw) {
    use crate::image::picture::Sample;
    let c = raw.channels;
    crate::with_samples!(&mut raw.samples, v => for p in v.chunks_exact_mut(c) {
        let alpha = p[c - 1].to_unit();
        if alpha > 0.0 && alpha < 1.0 {
            for s in &mut p[..c - 1] {
                *s = Sample::from_unit(s.to_unit() / alpha);
            }
        }
    });
    raw.notes.push("the colors were stored multiplied by alpha and have been divided by it".into());
}

/// Encodes every sample type (half floats as single) with 1 to 4 channels.
pub(super) fn encode(picture: &Picture, record: Option<&str>) -> Result<Vec<u8>, String> {
    let singles;
    match picture.samples() {
        Samples::U8(v) => save::<Gray8, RGB8>(picture, v, record),
        Samples::U16(v) => save::<Gray16, RGB16>(picture, v, record),
        Samples::F16(v) => {
            singles = v.iter().map(|s| s.to_f32()).collect::<Vec<f32>>();
            save::<Gray32Float, RGB32Float>(picture, &singles, record)
        }
        Samples::F32(v) => save::<Gray32Float, RGB32Float>(picture, v, record),
        Samples::F64(v) => save::<Gray64Float, RGB64Float>(picture, v, record),
    }
}

fn save<Gray, Rgb>(
    picture: &Picture,
    samples: &[Gray::Inner],
    record: Option<&str>,
) -> Result<Vec<u8>, String>
where
    Gray: colortype::ColorType,
    Rgb: colortype::ColorType<Inner = Gray::Inner>,
    [Gray::Inner]: TiffValue,
{
    if picture.encoding == Encoding::Linear && !picture.samples().is_float() {
        return Err("TIFF cannot say that its integers are linear; use .png or .exr".into());
    }
    let channels = picture.channels();
    // Data of 2 or 4 channels too: readers drop extra samples that are not called alpha.
    let alpha = match channels {
        1 | 3 => None,
        2 | 4 => Some(ExtraSamples::UnassociatedAlpha),
        _ => return Err(format!("TIFF is written with 1 to 4 channels, not {channels}; use .exr")),
    };
    let write = if channels < 3 { write_as::<Gray> } else { write_as::<Rgb> };
    write(picture, samples, alpha, record).map_err(|e| e.to_string())
}

fn write_as<C: colortype::ColorType>(
    picture: &Picture,
    samples: &[C::Inner],
    alpha: Option<ExtraSamples>,
    record: Option<&str>,
) -> Result<Vec<u8>, TiffError>
where
    [C::Inner]: TiffValue,
{
    let mut out = Cursor::new(Vec::new());
    let mut encoder =
        TiffEncoder::new(&mut out)?.with_compression(Compression::Deflate(DeflateLevel::Balanced));
    let mut image = encoder.new_image::<C>(picture.width() as u32, picture.height() as u32)?;
    if let Some(alpha) = alpha {
        image.extra_samples(&[alpha])?;
        // The count of samples does not follow from the color type any more.
        let bits = C::BITS_PER_SAMPLE[0];
        let format = C::SAMPLE_FORMAT[0].to_u16();
        let n = picture.channels();
        image.encoder().write_tag(Tag::BitsPerSample, &vec![bits; n][..])?;
        image.encoder().write_tag(Tag::SampleFormat, &vec![format; n][..])?;
        image.encoder().write_tag(Tag::SamplesPerPixel, n as u16)?;
    }
    if let Some((x, y)) = picture.meta.pixels_per_metre {
        image.resolution_unit(ResolutionUnit::Centimeter);
        image.x_resolution(Rational { n: x, d: 100 });
        image.y_resolution(Rational { n: y, d: 100 });
    }
    if let Some(record) = record {
        image.encoder().write_tag(Tag::Software, format!("texforge {record}").as_str())?;
    }
    if let Some(profile) = &picture.meta.icc
        && picture.encoding != Encoding::Data
    {
        image.encoder().write_tag(Tag::IccProfile, profile.as_slice())?;
    }
    image.write_data(samples)?;
    Ok(out.into_inner())
}
