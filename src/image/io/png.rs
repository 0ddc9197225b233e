//! PNG, by the `png` crate: all depths, and the chunks that say what the numbers mean.

use std::borrow::Cow;
use std::io::{Cursor, Seek, Write};

use moxcms::{CicpColorPrimaries, CicpProfile, ColorProfile, MatrixCoefficients};
use png::{
    BitDepth, ColorType, Compression, Encoder, EncodingError, Filter, PixelDimensions,
    Transformations,
};

use super::rows::{Frame, Pieces, Sink};
use super::{Raw, Source, exif, icc};
use crate::base::error::Result;
use crate::image::color::srgb_from_linear;
use crate::image::picture::{Encoding, Picture, Sample, Samples};

/// Deflate cannot do better than 1032 to 1, and a sample has at least one bit.
const RATIO: u64 = 8 * 1100;

pub(super) fn decode(source: &Source) -> Result<Raw> {
    let mut decoder =
        png::Decoder::new_with_limits(Cursor::new(source.bytes), png::Limits { bytes: 256 << 20 });
    decoder.set_transformations(Transformations::EXPAND);
    let header = decoder.read_header_info().map_err(|e| source.damaged("PNG", e))?;
    let size = (header.width as usize, header.height as usize);
    source.check_size(size, header.bytes_per_pixel().max(1), Some(RATIO))?;

    let mut reader = decoder.read_info().map_err(|e| source.damaged("PNG", e))?;
    let (color, depth) = reader.output_color_type();
    let channels = color.samples();
    let bytes = channels * if depth == BitDepth::Sixteen { 2 } else { 1 };
    source.check_size(size, bytes, None)?;
    let mut buffer = vec![0; reader.output_buffer_size().unwrap_or(size.0 * size.1 * bytes)];
    reader.next_frame(&mut buffer).map_err(|e| source.damaged("PNG", e))?;
    reader.finish().map_err(|e| source.damaged("PNG", e))?;
    let samples = if depth == BitDepth::Sixteen {
        let pairs = buffer.chunks_exact(2);
        Samples::U16(pairs.map(|b| u16::from_be_bytes([b[0], b[1]])).collect())
    } else {
        Samples::U8(buffer)
    };

    let mut raw = Raw::new(size, channels, samples);
    let info = reader.info();
    if let Some(block) = &info.exif_metadata {
        (raw.orientation, raw.pixels_per_metre) = exif::parse(block);
    }
    if let Some(dims) = info.pixel_dims
        && dims.unit == png::Unit::Meter
    {
        raw.pixels_per_metre = Some((dims.xppu, dims.yppu));
    }
    color_meaning(info, &mut raw);
    Ok(raw)
}

/// What the numbers mean as colours: the chunk of highest rank decides (cICP, iCCP, sRGB, gAMA).
fn color_meaning(info: &png::Info, raw: &mut Raw) {
    let linear = |g: f32| (g - 1.0).abs() < 0.01;
    if let Some(cicp) = info.coding_independent_code_points {
        match (cicp.color_primaries, cicp.transfer_function) {
            (1, 13) => {}
            (1, 8) => raw.encoding = Encoding::Linear,
            (primaries, transfer) => match cicp_profile(primaries, transfer) {
                Some(profile) => raw.icc = Some(profile),
                None => raw.notes.push(format!(
                    "the cICP chunk (primaries {primaries}, transfer {transfer}) is not \
                     understood; the colors are taken as sRGB"
                )),
            },
        }
    } else if let Some(profile) = &info.icc_profile {
        raw.icc = Some(profile.to_vec());
    } else if info.srgb.is_none() {
        if let Some(gamma) = info.gama_chunk.map(png::ScaledFloat::into_value) {
            if linear(gamma) {
                raw.encoding = Encoding::Linear;
            } else if (gamma - 0.45455).abs() > 0.01 {
                raw.notes.push(format!(
                    "the gAMA chunk says {gamma}, neither sRGB nor linear; the colors are taken \
                     as sRGB"
                ));
            }
        }
        let srgb_red = |red: f32| (red - 0.64).abs() < 0.005;
        if info.chrm_chunk.is_some_and(|c| !srgb_red(c.red.0.into_value())) {
            raw.notes.push("the cHRM chunk (other primaries than sRGB's) is ignored".into());
        }
    }
}

/// An ICC profile for code points whose curve is that of a display, not of a television signal.
fn cicp_profile(primaries: u8, transfer: u8) -> Option<Vec<u8>> {
    if !matches!(transfer, 4 | 5 | 8 | 13) {
        return None;
    }
    let profile = ColorProfile::new_from_cicp(CicpProfile {
        color_primaries: CicpColorPrimaries::try_from(primaries).ok()?,
        transfer_characteristics: moxcms::TransferCharacteristics::try_from(transfer).ok()?,
        matrix_coefficients: MatrixCoefficients::Identity,
        full_range: true,
    });
    let bytes = profile.encode().ok()?;
    icc::is_usable(&bytes).then_some(bytes)
}

/// Samples of a picture up to this size in bytes are gathered and compressed in one go, which takes
/// the better of two ways; those of a larger one row by row, which cannot know what is to come.
const AT_ONCE: usize = 64 << 20;

/// Size of the chunks in bytes if rows are compressed one by one.
const CHUNK: usize = 1 << 20;

/// Writes pictures of 1 to 4 channels: integers as they are, floats as 16 bits.
///
/// Level and filter were chosen by measuring photographs of 1024 x 1024 RGB pixels, one thread:
/// `Fast` with Paeth 8 ms for 43 % of the raw size; with the adaptive filter 16 to 25 ms for 42 %;
/// `Balanced` 240 to 380 ms for 25 to 37 %. A smaller file can be had later, waiting cannot be undone.
pub(super) fn write<W: Write + Seek>(
    out: &mut Sink<'_, W>,
    frame: &Frame,
    pieces: &mut Pieces,
) -> Result<()> {
    let pixel = &frame.pixel;
    let float = pixel.samples().is_float();
    if float {
        bytes(pixel.samples(), pixel).map_err(|e| frame.refused(e))?;
    }
    let mut info = png::Info::with_size(frame.width as u32, frame.height as u32);
    info.color_type = match pixel.channels() {
        1 => ColorType::Grayscale,
        2 => ColorType::GrayscaleAlpha,
        3 => ColorType::Rgb,
        4 => ColorType::Rgba,
        n => return Err(frame.refused(format!("PNG holds 1 to 4 channels, not {n}; use .exr"))),
    };
    let narrow = matches!(pixel.samples(), Samples::U8(_));
    info.bit_depth = if narrow { BitDepth::Eight } else { BitDepth::Sixteen };
    info.pixel_dims = pixel.meta.pixels_per_metre.map(|(xppu, yppu)| PixelDimensions {
        xppu,
        yppu,
        unit: png::Unit::Meter,
    });
    match (&pixel.meta.icc, pixel.encoding) {
        (_, Encoding::Data) => {}
        (Some(profile), _) => info.icc_profile = Some(profile.as_slice().into()),
        // Floats have been given the curve.
        (None, Encoding::Linear) if !float => info.source_gamma = Some(png::ScaledFloat::new(1.0)),
        (None, _) => info.srgb = Some(png::SrgbRenderingIntent::Perceptual),
    }
    let begin = || -> Result<_, EncodingError> {
        let mut encoder = Encoder::with_info(out, info)?;
        encoder.set_compression(Compression::Fast);
        encoder.set_filter(Filter::Paeth);
        if let Some(record) = &frame.record {
            encoder.add_text_chunk("texforge".into(), record.clone())?;
        }
        encoder.write_header()
    };
    let failed = |e: EncodingError| frame.refused(e);
    let mut writer = begin().map_err(failed)?;
    let size = frame.height * frame.row_len() * if narrow { 1 } else { 2 };
    if size <= AT_ONCE {
        let mut gathered = Vec::new();
        while let Some(samples) = pieces.next()? {
            let piece = bytes(samples, pixel).map_err(|e| frame.refused(e))?;
            // A picture that comes whole is not copied.
            if piece.len() == size {
                writer.write_image_data(&piece).map_err(failed)?;
                continue;
            }
            gathered.extend_from_slice(&piece);
            if gathered.len() == size {
                writer.write_image_data(&gathered).map_err(failed)?;
            }
        }
    } else {
        let mut stream = writer.stream_writer_with_size(CHUNK).map_err(failed)?;
        while let Some(samples) = pieces.next()? {
            let bytes = bytes(samples, pixel).map_err(|e| frame.refused(e))?;
            stream.write_all(&bytes).map_err(|e| frame.refused(e))?;
        }
        stream.finish().map_err(failed)?;
    }
    writer.finish().map_err(failed)
}

/// Samples as PNG has them, from a picture like `pixel`. Floats become 16 bits if nothing but
/// rounding is lost: linear light gets the sRGB curve.
fn bytes<'a>(samples: &'a Samples, pixel: &Picture) -> Result<Cow<'a, [u8]>, String> {
    match samples {
        Samples::U8(v) => return Ok(v.into()),
        Samples::U16(v) => return Ok(v.iter().flat_map(|s| s.to_be_bytes()).collect()),
        _ => {}
    }
    let (alpha, c) = (pixel.alpha_channel(), pixel.channels());
    let mut out = Vec::with_capacity(2 * samples.len());
    for i in 0..samples.len() {
        let value = samples.unit(i);
        if !(0.0..=1.0).contains(&value) {
            return Err(format!(
                "a sample is {value}, this format holds 0 to 1 only; use .exr or .tif to keep it"
            ));
        }
        let curved = pixel.encoding == Encoding::Linear && alpha != Some(i % c);
        let stored = u16::from_unit(if curved { srgb_from_linear(value) } else { value });
        out.extend(stored.to_be_bytes());
    }
    Ok(out.into())
}
