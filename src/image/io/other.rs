//! WebP, BMP, TGA, PNM and GIF, by the `image` crate.

use std::io::Cursor;

use image::codecs::{bmp, gif, pnm, tga, webp};
use image::{ColorType, ExtendedColorType, ImageDecoder, ImageEncoder, ImageError, ImageResult};

use super::{Format, Raw, Source, exif};
use crate::base::error::{Error, Result};
use crate::image::picture::{Encoding, Picture, Samples};

pub(super) fn decode(source: &Source, format: Format) -> Result<Raw> {
    let bytes = || Cursor::new(source.bytes);
    match format {
        Format::WebP => load(source, "WebP", webp::WebPDecoder::new(bytes()), None),
        Format::Bmp => load(source, "BMP", bmp::BmpDecoder::new(bytes()), Some(512)),
        Format::Tga => load(source, "TGA", tga::TgaDecoder::new(bytes()), Some(512)),
        Format::Gif => load(source, "GIF", gif::GifDecoder::new(bytes()), Some(1 << 15)),
        _ => load(source, "PNM", pnm::PnmDecoder::new(bytes()), Some(16)),
    }
}

fn load<D: ImageDecoder>(
    source: &Source,
    name: &str,
    decoder: ImageResult<D>,
    ratio: Option<u64>,
) -> Result<Raw> {
    let fault = |e: ImageError| -> Error {
        match e {
            ImageError::Unsupported(e) => source.unsupported(e),
            e => source.damaged(name, e),
        }
    };
    let mut decoder = decoder.map_err(fault)?;
    let (width, height) = decoder.dimensions();
    let size = (width as usize, height as usize);
    let color = decoder.color_type();
    source.check_size(size, color.bytes_per_pixel() as usize, ratio)?;

    let icc = decoder.icc_profile().map_err(fault)?;
    let exif = decoder.exif_metadata().map_err(fault)?;
    let n = size.0 * size.1 * color.channel_count() as usize;
    let samples = match color {
        ColorType::L8 | ColorType::La8 | ColorType::Rgb8 | ColorType::Rgba8 => {
            let mut v = vec![0_u8; n];
            decoder.read_image(&mut v).map_err(fault)?;
            Samples::U8(v)
        }
        ColorType::L16 | ColorType::La16 | ColorType::Rgb16 | ColorType::Rgba16 => {
            let mut v = vec![0_u16; n];
            decoder.read_image(bytemuck::cast_slice_mut(&mut v)).map_err(fault)?;
            Samples::U16(v)
        }
        ColorType::Rgb32F | ColorType::Rgba32F => {
            let mut v = vec![0_f32; n];
            decoder.read_image(bytemuck::cast_slice_mut(&mut v)).map_err(fault)?;
            Samples::F32(v)
        }
        other => return Err(source.unsupported(format!("{other:?} samples"))),
    };
    let mut raw = Raw::new(size, color.channel_count() as usize, samples);
    raw.icc = icc;
    if let Some(block) = exif {
        (raw.orientation, raw.pixels_per_metre) = exif::parse(&block);
    }
    Ok(raw)
}

/// Encodes 8-bit pictures of 1 to 4 channels as WebP, BMP or TGA.
pub(super) fn encode(picture: &Picture, format: Format) -> Result<Vec<u8>, String> {
    let name = match format {
        Format::WebP => "WebP",
        Format::Bmp => "BMP",
        _ => "TGA",
    };
    let expanded;
    let mut channels = picture.channels();
    let bytes = match picture.samples() {
        // The encoder would drop the alpha channel.
        Samples::U8(v) if format == Format::Bmp && channels == 2 => {
            channels = 4;
            expanded = v.chunks_exact(2).flat_map(|p| [p[0], p[0], p[0], p[1]]).collect();
            &expanded
        }
        Samples::U8(v) => v,
        Samples::U16(_) => {
            return Err(format!("{name} holds 8 bits only; use .png, .tif or .exr"));
        }
        _ => return Err(format!("{name} does not hold floats; use .exr or .tif")),
    };
    let color = match channels {
        1 => ExtendedColorType::L8,
        2 => ExtendedColorType::La8,
        3 => ExtendedColorType::Rgb8,
        4 => ExtendedColorType::Rgba8,
        n => return Err(format!("{name} holds 1 to 4 channels, not {n}; use .exr")),
    };
    refuse_unsaid(picture, name)?;
    if format == Format::WebP && picture.width().max(picture.height()) > 1 << 14 {
        return Err("WebP holds at most 16384x16384 pixels; use .png".into());
    }
    let (width, height) = (picture.width() as u32, picture.height() as u32);
    let mut out = Vec::new();
    let result = match format {
        Format::WebP => {
            let mut encoder = webp::WebPEncoder::new_lossless(&mut out);
            if let Some(profile) = &picture.meta.icc {
                encoder.set_icc_profile(profile.clone()).map_err(|e| e.to_string())?;
            }
            encoder.write_image(bytes, width, height, color)
        }
        Format::Bmp => bmp::BmpEncoder::new(&mut out).write_image(bytes, width, height, color),
        _ => tga::TgaEncoder::new(&mut out).write_image(bytes, width, height, color),
    };
    result.map_err(|e| e.to_string())?;
    Ok(out)
}

/// Formats that take every number for sRGB must not be given others.
fn refuse_unsaid(picture: &Picture, name: &str) -> Result<(), String> {
    if picture.encoding == Encoding::Linear {
        return Err(format!("{name} cannot say that its colors are linear; use .png or .exr"));
    }
    if picture.meta.icc.is_some() && picture.encoding == Encoding::Srgb && name != "WebP" {
        return Err(format!(
            "{name} cannot hold the color profile the samples are in; use .png or .tif"
        ));
    }
    Ok(())
}

/// Encodes 8 and 16 bits as Netpbm: grey and RGB as the classic P5 and P6, with alpha as PAM.
pub(super) fn encode_pnm(picture: &Picture) -> Result<Vec<u8>, String> {
    let (most, body) = match picture.samples() {
        Samples::U8(v) => (255, v.clone()),
        Samples::U16(v) => (65535, v.iter().flat_map(|s| s.to_be_bytes()).collect()),
        _ => return Err("PNM does not hold floats; use .exr or .tif".into()),
    };
    refuse_unsaid(picture, "PNM")?;
    let (w, h, c) = (picture.width(), picture.height(), picture.channels());
    let pam = |kind| {
        format!("P7\nWIDTH {w}\nHEIGHT {h}\nDEPTH {c}\nMAXVAL {most}\nTUPLTYPE {kind}\nENDHDR\n")
    };
    let mut out = match c {
        1 => format!("P5\n{w} {h}\n{most}\n"),
        2 => pam("GRAYSCALE_ALPHA"),
        3 => format!("P6\n{w} {h}\n{most}\n"),
        4 => pam("RGB_ALPHA"),
        n => return Err(format!("PNM holds 1 to 4 channels, not {n}; use .exr")),
    }
    .into_bytes();
    out.extend(body);
    Ok(out)
}
