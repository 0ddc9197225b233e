//! TIFF, by the `tiff` crate: integers of 8 and 16 bits, floats, palettes, any number of channels.

use std::borrow::Cow;
use std::io::{Cursor, Seek, Write};

use bytemuck::NoUninit;
use flate2::Compression;
use flate2::write::ZlibEncoder;
use tiff::decoder::{Decoder, DecodingResult, Limits};
use tiff::encoder::{
    DirectoryEncoder, Predictor, Rational, TiffEncoder, TiffKind, TiffKindBig, TiffKindStandard,
};
use tiff::tags::{
    CompressionMethod, ExtraSamples, PhotometricInterpretation, ResolutionUnit, SampleFormat, Tag,
};
use tiff::{ColorType, TiffError, TiffResult};

use super::rows::{Frame, Pieces, Sink};
use super::{Raw, Source, exif};
use crate::base::error::{Error, Result};
use crate::image::material::MapKind;
use crate::image::picture::{Encoding, Sample, Samples};

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

/// Bytes of gray or color samples in a strip, rounded up to whole rows.
const STRIP: usize = 1_000_000;

/// From this many bytes of samples on the file is a `BigTIFF`, as its size might not fit into 32 bits:
/// what cannot be compressed becomes a little longer, and profile and record come on top.
const BIG: u64 = (1 << 32) - (1 << 26);

/// Writes every sample type (half floats as single) with 1 to 4 channels, in strips.
pub(super) fn write<W: Write + Seek>(
    out: &mut Sink<'_, W>,
    frame: &Frame,
    pieces: &mut Pieces,
) -> Result<()> {
    let bits = bits_per_sample(frame.pixel.samples());
    let size = frame.height as u64 * frame.row_len() as u64 * u64::from(bits / 8);
    if size < BIG {
        write_kind::<W, TiffKindStandard>(out, frame, pieces)
    } else {
        write_kind::<W, TiffKindBig>(out, frame, pieces)
    }
}

/// As [`write()`], as a TIFF or a `BigTIFF`.
pub(super) fn write_kind<W: Write + Seek, K: TiffKind>(
    out: &mut Sink<'_, W>,
    frame: &Frame,
    pieces: &mut Pieces,
) -> Result<()> {
    match frame.pixel.samples() {
        Samples::U8(_) => write_strips::<u8, K>(out, frame, pieces),
        Samples::U16(_) => write_strips::<u16, K>(out, frame, pieces),
        Samples::F16(_) | Samples::F32(_) => write_strips::<f32, K>(out, frame, pieces),
        Samples::F64(_) => write_strips::<f64, K>(out, frame, pieces),
    }
}

fn bits_per_sample(samples: &Samples) -> u16 {
    8 * stored(samples).bytes_per_sample() as u16
}

/// Samples as the file holds them.
fn stored(samples: &Samples) -> Cow<'_, Samples> {
    match samples {
        Samples::F16(v) => Cow::Owned(Samples::F32(v.iter().map(|s| s.to_f32()).collect())),
        other => Cow::Borrowed(other),
    }
}

fn write_strips<T: Sample + NoUninit, K: TiffKind>(
    out: impl Write + Seek,
    frame: &Frame,
    pieces: &mut Pieces,
) -> Result<()> {
    let pixel = &frame.pixel;
    let float = pixel.samples().is_float();
    if pixel.encoding == Encoding::Linear && !float {
        let reason = "TIFF cannot say that its integers are linear; use .png or .exr";
        return Err(frame.refused(reason));
    }
    let n = pixel.channels();
    if n > 4 {
        let reason = format!("TIFF is written with 1 to 4 channels, not {n}; use .exr");
        return Err(frame.refused(reason));
    }
    let failed = |e: TiffError| frame.refused(e);
    let mut encoder = TiffEncoder::<_, K>::new_generic(out).map_err(failed)?;
    // Strips are compressed here: the crate's own encoder of images compresses whole ones only.
    let mut directory = encoder.image_directory().map_err(failed)?;
    let colors = if n < 3 { 1 } else { 3 };
    let rows = STRIP.div_ceil(frame.width * colors * size_of::<T>());
    write_tags(&mut directory, frame, rows).map_err(failed)?;

    let (mut offsets, mut counts) = (Vec::new(), Vec::new());
    pieces.bands::<T>(rows, stored, |strip| {
        let mut packed = ZlibEncoder::new(Vec::new(), Compression::default());
        packed.write_all(bytemuck::cast_slice(strip)).map_err(|e| e.to_string())?;
        let packed = packed.finish().map_err(|e| e.to_string())?;
        let at = directory.write_data(&packed[..]).map_err(|e| e.to_string())?;
        offsets.push(K::convert_offset(at).map_err(|e| e.to_string())?);
        counts.push(K::convert_offset(packed.len() as u64).map_err(|e| e.to_string())?);
        Ok(())
    })?;
    let bits = bits_per_sample(pixel.samples());
    let format = if float { SampleFormat::IEEEFP } else { SampleFormat::Uint };
    directory.write_tag(Tag::BitsPerSample, &vec![bits; n][..]).map_err(failed)?;
    directory.write_tag(Tag::SampleFormat, &vec![format.to_u16(); n][..]).map_err(failed)?;
    directory.write_tag(Tag::StripOffsets, K::convert_slice(&offsets)).map_err(failed)?;
    directory.write_tag(Tag::StripByteCounts, K::convert_slice(&counts)).map_err(failed)?;
    directory.finish().map_err(failed)
}

/// All that is known before the strips.
fn write_tags<W: Write + Seek, K: TiffKind>(
    directory: &mut DirectoryEncoder<'_, W, K>,
    frame: &Frame,
    rows_per_strip: usize,
) -> TiffResult<()> {
    let pixel = &frame.pixel;
    let n = pixel.channels();
    let color =
        if n < 3 { PhotometricInterpretation::BlackIsZero } else { PhotometricInterpretation::RGB };
    let (unit, x, y) = match pixel.meta.pixels_per_metre {
        Some((x, y)) => {
            (ResolutionUnit::Centimeter, Rational { n: x, d: 100 }, Rational { n: y, d: 100 })
        }
        None => (ResolutionUnit::None, Rational { n: 1, d: 1 }, Rational { n: 1, d: 1 }),
    };
    directory.write_tag(Tag::ImageWidth, frame.width as u32)?;
    directory.write_tag(Tag::ImageLength, frame.height as u32)?;
    directory.write_tag(Tag::Compression, CompressionMethod::Deflate.to_u16())?;
    directory.write_tag(Tag::Predictor, Predictor::None.to_u16())?;
    directory.write_tag(Tag::PhotometricInterpretation, color.to_u16())?;
    directory.write_tag(Tag::RowsPerStrip, rows_per_strip as u32)?;
    directory.write_tag(Tag::SamplesPerPixel, n as u16)?;
    directory.write_tag(Tag::XResolution, x)?;
    directory.write_tag(Tag::YResolution, y)?;
    directory.write_tag(Tag::ResolutionUnit, unit.to_u16())?;
    if n.is_multiple_of(2) {
        // Data of 2 or 4 channels too: readers drop extra samples that are not called alpha.
        let alpha = ExtraSamples::UnassociatedAlpha.to_u16();
        directory.write_tag(Tag::ExtraSamples, &[alpha][..])?;
    }
    if let Some(record) = &frame.record {
        directory.write_tag(Tag::Software, format!("texforge {record}").as_str())?;
    }
    if let Some(profile) = &pixel.meta.icc
        && pixel.encoding != Encoding::Data
    {
        directory.write_tag(Tag::IccProfile, profile.as_slice())?;
    }
    Ok(())
}
