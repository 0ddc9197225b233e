//! JPEG, by `zune-jpeg`: grey, color, and the four inks of print.

use std::io::Cursor;

use image::codecs::jpeg::{JpegEncoder, PixelDensity, PixelDensityUnit};
use image::{ExtendedColorType, ImageEncoder};
use zune_core::colorspace::ColorSpace;
use zune_core::options::DecoderOptions;
use zune_jpeg::JpegDecoder;

use super::{Raw, Source, exif, icc};
use crate::base::error::Result;
use crate::image::material::MapKind;
use crate::image::picture::{Encoding, Picture, Samples};

/// A progressive file of one color takes two bits a block of 64 samples.
const RATIO: u64 = 2048;

/// Quality of the encoder, 1..=100: no visible loss, a quarter of the size of 100.
const QUALITY: u8 = 95;

pub(super) fn decode(source: &Source) -> Result<Raw> {
    if !has_end(source.bytes) {
        return Err(source.damaged("JPEG", "its end is missing"));
    }
    let options = DecoderOptions::default()
        .set_strict_mode(false)
        .set_max_width(Picture::MAX_SIDE)
        .set_max_height(Picture::MAX_SIDE);
    let mut decoder = JpegDecoder::new_with_options(Cursor::new(source.bytes), options);
    decoder.decode_headers().map_err(|e| source.damaged("JPEG", e))?;
    let (Some(info), Some(space)) = (decoder.info(), decoder.input_colorspace()) else {
        return Err(source.damaged("JPEG", "it has no header"));
    };
    let size = (info.width as usize, info.height as usize);
    // 16-bit coefficients of all components may be held at once.
    source.check_size(size, 2 * info.components.max(1) as usize, Some(RATIO))?;

    // Broken data is an error; harmless oddities between the headers are not, but then damage
    // cannot be told from them.
    let stored = match space {
        ColorSpace::Luma | ColorSpace::CMYK | ColorSpace::YCCK => space,
        _ => ColorSpace::RGB,
    };
    let strict = options.jpeg_set_out_colorspace(stored).set_strict_mode(true);
    let mut notes = Vec::new();
    let decoded = match JpegDecoder::new_with_options(Cursor::new(source.bytes), strict).decode() {
        Ok(v) => v,
        Err(e) if e.to_string().contains("Extra bytes between headers") => {
            notes.push(
                "the JPEG file has stray bytes between its headers; they were skipped".into(),
            );
            let lenient = strict.set_strict_mode(false);
            JpegDecoder::new_with_options(Cursor::new(source.bytes), lenient)
                .decode()
                .map_err(|e| source.damaged("JPEG", e))?
        }
        Err(e) => return Err(source.damaged("JPEG", e)),
    };

    let mut profile = decoder.icc_profile();
    let (channels, pixels) = match space {
        ColorSpace::Luma => (1, decoded),
        ColorSpace::CMYK | ColorSpace::YCCK => {
            let inks = if space == ColorSpace::YCCK { inks_from_ycck(decoded) } else { decoded };
            (3, rgb_from_inks(source, &inks, &mut profile, &mut notes))
        }
        _ => (3, decoded),
    };
    if pixels.len() != size.0 * size.1 * channels {
        return Err(source.damaged("JPEG", "its components do not make a picture"));
    }
    let mut raw = Raw::new(size, channels, Samples::U8(pixels));
    raw.icc = profile;
    raw.notes = notes;
    raw.pixels_per_metre = jfif_resolution(source.bytes);
    if let Some(block) = decoder.exif() {
        let (orientation, resolution) = exif::parse(block);
        raw.orientation = orientation;
        raw.pixels_per_metre = raw.pixels_per_metre.or(resolution);
    }
    Ok(raw)
}

/// Whether the end marker follows the first scan. Within scans 0xFF is always followed by zero or
/// a restart marker, and the headers before it (thumbnails!) are skipped by their lengths.
fn has_end(bytes: &[u8]) -> bool {
    let mut at = 2;
    while let Some(&[0xFF, marker, high, low]) = bytes.get(at..at + 4) {
        at += match marker {
            0xFF => 1,
            0x01 | 0xD0..=0xD8 => 2,
            _ => 2 + usize::from(u16::from_be_bytes([high, low])),
        };
        if marker == 0xDA {
            break;
        }
    }
    bytes.get(at.min(bytes.len())..).is_some_and(|rest| rest.windows(2).any(|w| w == [0xFF, 0xD9]))
}

/// The resolution in the JFIF header, which comes first if there is one.
fn jfif_resolution(bytes: &[u8]) -> Option<(u32, u32)> {
    let header = bytes.get(2..18)?;
    if !(header.starts_with(&[0xFF, 0xE0]) && header[4..].starts_with(b"JFIF\0")) {
        return None;
    }
    let number = |at: usize| f64::from(u16::from_be_bytes([header[at], header[at + 1]]));
    // Units: 0 none, 1 per inch, 2 per centimetre; one more in EXIF.
    exif::per_metre(Some((number(12), number(14))), u16::from(header[11]) + 1)
}

/// Print files store the inks inverted (0 is full ink), a convention of Adobe's that everybody
/// follows; the first three may be rotated to luma and chroma.
fn inks_from_ycck(mut pixels: Vec<u8>) -> Vec<u8> {
    for p in pixels.chunks_exact_mut(4) {
        let (y, b, r) = (f32::from(p[0]), f32::from(p[1]) - 128.0, f32::from(p[2]) - 128.0);
        p[0] = 255 - (y + 1.402 * r + 0.5) as u8;
        p[1] = 255 - (y - 0.344_136 * b - 0.714_136 * r + 0.5) as u8;
        p[2] = 255 - (y + 1.772 * b + 0.5) as u8;
    }
    pixels
}

/// RGB from inverted inks: by the profile if it is a color picture and has one, else each
/// color is what the ink and the black leave of white.
fn rgb_from_inks(
    source: &Source,
    inks: &[u8],
    profile: &mut Option<Vec<u8>>,
    notes: &mut Vec<String>,
) -> Vec<u8> {
    if let Some(profile) = profile.take()
        && source.kind == MapKind::Color
    {
        let amounts: Vec<u8> = inks.iter().map(|v| 255 - v).collect();
        match icc::srgb_from_cmyk(&amounts, &profile) {
            Ok(rgb) => {
                notes.push(
                    "the colors were converted from the embedded CMYK profile to sRGB".into(),
                );
                return rgb;
            }
            Err(reason) => {
                notes.push(format!("the embedded CMYK profile is not usable ({reason})"));
            }
        }
    }
    notes.push("the colors were converted from CMYK to RGB without a profile".into());
    let left = |ink: u8, black: u8| (u32::from(ink) * u32::from(black) + 127) / 255;
    inks.chunks_exact(4)
        .flat_map(|p| [left(p[0], p[3]), left(p[1], p[3]), left(p[2], p[3])])
        .map(|v| v as u8)
        .collect()
}

/// Encodes 8-bit grey and RGB pictures.
pub(super) fn encode(picture: &Picture, record: Option<&str>) -> Result<Vec<u8>, String> {
    let Samples::U8(pixels) = picture.samples() else {
        return Err("JPEG holds 8 bits only; use .png, .tif or .exr".into());
    };
    let color = match picture.channels() {
        1 => ExtendedColorType::L8,
        3 => ExtendedColorType::Rgb8,
        2 | 4 if picture.encoding != Encoding::Data => {
            return Err("JPEG does not hold transparency; use .png, .webp or .tif".into());
        }
        n => return Err(format!("JPEG holds 1 or 3 channels, not {n}; use .png, .tif or .exr")),
    };
    if picture.encoding == Encoding::Linear {
        return Err("JPEG cannot say that its colors are linear; use .png or .exr".into());
    }
    let mut out = Vec::new();
    let mut encoder = JpegEncoder::new_with_quality(&mut out, QUALITY);
    if let Some((x, y)) = picture.meta.pixels_per_metre {
        let inches = |v: u32| (f64::from(v) * 0.0254).round().clamp(1.0, 65535.0) as u16;
        let unit = PixelDensityUnit::Inches;
        encoder.set_pixel_density(PixelDensity { density: (inches(x), inches(y)), unit });
    }
    if let Some(profile) = &picture.meta.icc {
        encoder.set_icc_profile(profile.clone()).map_err(|e| e.to_string())?;
    }
    let (width, height) = (picture.width() as u32, picture.height() as u32);
    encoder.write_image(pixels, width, height, color).map_err(|e| e.to_string())?;
    if let Some(record) = record
        && let Ok(length) = u16::try_from(record.len() + 11)
    {
        // A comment segment, right behind the start marker and the JFIF header.
        let at = 4 + usize::from(u16::from_be_bytes([out[4], out[5]]));
        let mut comment = vec![0xFF, 0xFE];
        comment.extend(length.to_be_bytes());
        comment.extend(b"texforge\0");
        comment.extend(record.as_bytes());
        out.splice(at..at, comment);
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn inks_come_out_of_luma_and_chroma_inverted() {
        // No ink at all is luma 0 in these files, and black is kept.
        assert_eq!(inks_from_ycck(vec![0, 128, 128, 255]), [255, 255, 255, 255]);
        assert_eq!(inks_from_ycck(vec![100, 128, 128, 7]), [155, 155, 155, 7]);
        // Full cyan alone: the rotated color is pure red.
        assert_eq!(inks_from_ycck(vec![76, 85, 255, 255]), [1, 255, 255, 255]);
    }

    #[test]
    fn the_end_is_looked_for_behind_the_headers_only() {
        let thumbnail = [0xFF, 0xD8, 0xFF, 0xE1, 0, 6, 0xFF, 0xD9, 0, 0];
        let scan = [0xFF, 0xDA, 0, 4, 0, 0, 1, 2, 0xFF, 0];
        let cut = [&thumbnail[..], &scan].concat();
        assert!(!has_end(&cut), "the thumbnail's end is not the picture's");
        assert!(has_end(&[&cut[..], &[0xFF, 0xD9]].concat()), "but this is");
    }
}
