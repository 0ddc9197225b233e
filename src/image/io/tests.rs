//! Round trips of every format against what it is documented to keep, and hostile files.

use ::exr::image::write::WritableImage;
use ::exr::image::{AnyChannel, AnyChannels, Encoding as Packing, FlatSamples, Image, Layer};
use ::exr::meta::attribute::{AttributeValue, LineOrder};
use ::exr::meta::header::LayerAttributes;
use ::exr::prelude::{Blocks, Compression};
use half::f16;
use proptest::prelude::*;

use super::*;
use crate::base::error::ErrorKind;
use crate::image::color::{linear_from_srgb, srgb_from_linear};
use crate::image::picture::Sample;
use crate::with_samples;

const FORMATS: [(Format, &str); 8] = [
    (Format::Png, "a.png"),
    (Format::Jpeg, "a.jpg"),
    (Format::Tiff, "a.tif"),
    (Format::WebP, "a.webp"),
    (Format::Exr, "a.exr"),
    (Format::Bmp, "a.bmp"),
    (Format::Tga, "a.tga"),
    (Format::Pnm, "a.pam"),
];

fn lossless() -> impl Iterator<Item = (Format, &'static str)> {
    FORMATS.into_iter().filter(|(format, _)| *format != Format::Jpeg)
}

/// A picture of this type with well mixed values of `0..=1`, alpha 0 or 1.
pub(super) fn picture<T: Sample>(
    (h, w, c): (usize, usize, usize),
    encoding: Encoding,
    seed: u64,
) -> Picture {
    let value = |i: usize| {
        let mixed = (i as u64 + 1 + seed).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 40;
        let value = mixed as f64 / f64::from(1 << 24);
        let is_alpha = encoding != Encoding::Data && c % 2 == 0 && i % c == c - 1;
        T::from_unit(if is_alpha { value.round() } else { value })
    };
    let samples = T::wrap((0..h * w * c).map(value).collect());
    Picture::new(h, w, c, samples, encoding).expect("picture")
}

pub(super) fn all_types(size: (usize, usize, usize), color: bool, seed: u64) -> [Picture; 5] {
    let (int, float) =
        if color { (Encoding::Srgb, Encoding::Linear) } else { (Encoding::Data, Encoding::Data) };
    [
        picture::<u8>(size, int, seed),
        picture::<u16>(size, int, seed),
        picture::<f16>(size, float, seed),
        picture::<f32>(size, float, seed),
        picture::<f64>(size, float, seed),
    ]
}

/// An EXR file of two pixels by the crate's own writer of whole images.
pub(super) fn exr_of_planes(
    channels: impl IntoIterator<Item = (&'static str, FlatSamples)>,
    record: Option<&str>,
) -> Vec<u8> {
    let channels = channels.into_iter().map(|(name, plane)| AnyChannel::new(name, plane));
    let packing = Packing {
        compression: Compression::ZIP16,
        blocks: Blocks::ScanLines,
        line_order: LineOrder::Increasing,
    };
    let channels = AnyChannels::sort(channels.collect());
    let mut image =
        Image::from_layer(Layer::new((2, 1), LayerAttributes::default(), packing, channels));
    if let Some(record) = record {
        let text = AttributeValue::Text(record.into());
        image.attributes.other.insert("texforge".into(), text);
    }
    let mut out = std::io::Cursor::new(Vec::new());
    image.write().non_parallel().to_buffered(&mut out).expect("EXR");
    out.into_inner()
}

#[test]
fn exr_files_are_those_of_the_crate_s_own_writer() {
    let samples = Samples::F32(vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
    let picture = Picture::new(1, 2, 3, samples, Encoding::Linear).expect("picture");
    let options = WriteOptions { record: Some("{}".into()), ..WriteOptions::new(MapKind::Color) };
    let plane = |a, b| FlatSamples::F32(vec![a, b]);
    let planes = [("R", plane(1.0, 4.0)), ("G", plane(2.0, 5.0)), ("B", plane(3.0, 6.0))];
    let bytes = encode(&picture, Format::Exr, &options).expect("exr");
    assert!(bytes == exr_of_planes(planes, Some("{}")));
}

fn units(picture: &Picture) -> Vec<f64> {
    with_samples!(picture.samples(), v => v.iter().map(|s| s.to_unit()).collect())
}

/// What the documentation of [`write`] promises: the samples that come back, or a refusal.
fn promised(picture: &Picture, format: Format) -> Option<Samples> {
    let (c, samples) = (picture.channels(), picture.samples());
    let alpha = picture.alpha_channel();
    let curve = |f: fn(f64) -> f64, i: usize, v: f64| if alpha == Some(i % c) { v } else { f(v) };
    let narrow = match samples {
        Samples::U8(v) if c <= 4 => Some(v),
        _ => None,
    };
    let doubled = |v: &Vec<u8>| {
        let pixels = v.chunks_exact(c).flat_map(|p| match c {
            1 => vec![p[0]; 3],
            2 => vec![p[0], p[0], p[0], p[1]],
            _ => p.to_vec(),
        });
        Samples::U8(pixels.collect())
    };
    match format {
        Format::Png if c <= 4 && samples.is_float() => {
            let bits = units(picture).into_iter().enumerate().map(|(i, v)| {
                let linear = picture.encoding == Encoding::Linear;
                u16::from_unit(if linear { curve(srgb_from_linear, i, v) } else { v })
            });
            Some(Samples::U16(bits.collect()))
        }
        Format::Png => (c <= 4).then(|| samples.clone()),
        Format::Tiff => match samples {
            Samples::F16(v) => Some(Samples::F32(v.iter().map(|s| s.to_f32()).collect())),
            other => Some(other.clone()),
        }
        .filter(|_| c <= 4),
        Format::WebP | Format::Bmp => narrow.map(doubled),
        Format::Tga => narrow.map(|v| Samples::U8(v.clone())),
        Format::Pnm => (c <= 4 && !samples.is_float()).then(|| samples.clone()),
        Format::Exr => Some(match samples {
            Samples::F16(_) | Samples::F32(_) => samples.clone(),
            _ => {
                let srgb = picture.encoding == Encoding::Srgb;
                let values = units(picture).into_iter().enumerate();
                let floats = values
                    .map(|(i, v)| (if srgb { curve(linear_from_srgb, i, v) } else { v }) as f32);
                Samples::F32(floats.collect())
            }
        }),
        Format::Jpeg | Format::Gif => None,
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn every_format_keeps_what_it_promises(
        h in 1..9_usize, w in 1..9_usize, c in 1..6_usize, color: bool, seed: u64,
    ) {
        // Five channels are data.
        let color = color && c <= 4;
        let kind = if color { MapKind::Color } else { MapKind::Data };
        for picture in all_types((h, w, c), color, seed) {
            for (format, name) in lossless() {
                let label = format!("{h}x{w}x{c} {} as {name}", picture.samples().dtype());
                let encoded = encode(&picture, format, &WriteOptions::new(kind));
                let Some(want) = promised(&picture, format) else {
                    let error = encoded.expect_err(&label);
                    prop_assert_eq!(error.kind(), ErrorKind::Format, "{}", label);
                    continue;
                };
                let bytes = encoded.expect(&label);
                let again = encode(&picture, format, &WriteOptions::new(kind)).expect(&label);
                prop_assert_eq!(&bytes, &again, "{}: same bytes each time", label);
                let back = read_bytes(&bytes, name, kind).expect(&label);
                prop_assert_eq!((back.height(), back.width()), (h, w), "{}", label);
                prop_assert!(back.samples() == &want, "{}: {:?} != {:?}", label, back.samples(), want);
                let linear = color && want.is_float();
                let encoding = match (color, linear) {
                    (false, _) => Encoding::Data,
                    (true, true) => Encoding::Linear,
                    (true, false) => Encoding::Srgb,
                };
                prop_assert_eq!(back.encoding, encoding, "{}", label);
                prop_assert_eq!(&back.meta.notes, &Vec::<String>::new(), "{}", label);
            }
        }
    }

    #[test]
    fn damaged_files_are_errors_or_pictures_never_panics(seed: u64) {
        for (format, name) in FORMATS {
            let small = picture::<u8>((7, 5, 3), Encoding::Srgb, seed);
            let options = WriteOptions::new(MapKind::Color);
            let mut bytes = encode(&small, format, &options).expect(name);
            for k in 0..3 {
                let mixed = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15).rotate_left(13 * k);
                let at = (mixed % bytes.len() as u64) as usize;
                bytes[at] ^= (mixed >> 56) as u8 | 1;
                if let Ok(picture) = read_bytes(&bytes, name, MapKind::Color) {
                    prop_assert!(picture.byte_len() < 1 << 26, "{}: grew to {}", name, picture.byte_len());
                }
            }
        }
    }
}

#[test]
fn jpeg_keeps_smooth_pictures_and_refuses_the_rest() {
    let ramp = |c: usize| {
        let value = |i: usize| (i / c % 32 * 4 + i / c / 32 * 2 + i % c * 40) as u8;
        let samples = Samples::U8((0..32 * 24 * c).map(value).collect());
        Picture::new(24, 32, c, samples, Encoding::Srgb).expect("ramp")
    };
    let options = WriteOptions::new(MapKind::Color);
    for c in [1, 3] {
        let picture = ramp(c);
        let bytes = encode(&picture, Format::Jpeg, &options).expect("encode");
        let back = read_bytes(&bytes, "a.jpg", MapKind::Color).expect("read");
        assert_eq!((back.height(), back.width(), back.channels()), (24, 32, c));
        let pairs = units(&picture).into_iter().zip(units(&back));
        let worst = pairs.map(|(a, b)| (a - b).abs() * 255.0).fold(0.0, f64::max);
        assert!(worst <= 6.0, "{c} channels: {worst} levels off");
    }
    for c in [2, 4] {
        let error = encode(&ramp(c), Format::Jpeg, &options).expect_err("alpha");
        assert!(error.to_string().contains("transparency"), "{error}");
    }
    let wide = picture::<u16>((2, 2, 3), Encoding::Srgb, 0);
    let error = encode(&wide, Format::Jpeg, &options).expect_err("16 bits");
    assert!(error.to_string().contains("8 bits only; use .png, .tif or .exr"), "{error}");
}

#[test]
fn every_truncation_is_an_error() {
    for (format, name) in FORMATS {
        let small = picture::<u8>((7, 5, 3), Encoding::Srgb, 3);
        let bytes = encode(&small, format, &WriteOptions::new(MapKind::Color)).expect(name);
        for n in 0..bytes.len() {
            match read_bytes(&bytes[..n], name, MapKind::Color) {
                Err(e) => assert!(
                    matches!(e.kind(), ErrorKind::Decode | ErrorKind::Format),
                    "{name}, {n} of {} bytes: {e}",
                    bytes.len()
                ),
                // TGA ends in a footer, and a few formats in padding, that nobody needs.
                Ok(_) => assert!(
                    n + 30 > bytes.len(),
                    "{name}: {n} of {} bytes passed for a picture",
                    bytes.len()
                ),
            }
        }
    }
}

pub(super) fn crc(bytes: &[u8]) -> u32 {
    !bytes.iter().fold(!0_u32, |crc, b| {
        (0..8).fold(
            crc ^ u32::from(*b),
            |c, _| if c & 1 == 1 { c >> 1 ^ 0xEDB8_8320 } else { c >> 1 },
        )
    })
}

#[test]
fn headers_that_lie_about_the_size_are_refused_before_allocating() {
    let small = picture::<u8>((7, 5, 3), Encoding::Srgb, 3);
    let encoded =
        |format| encode(&small, format, &WriteOptions::new(MapKind::Color)).expect("encode");
    let mut lies: Vec<(&str, Vec<u8>)> = Vec::new();
    for side in [60_000_u32, 70_000, u32::MAX >> 1] {
        let mut png = encoded(Format::Png);
        png[16..20].copy_from_slice(&side.to_be_bytes());
        png[20..24].copy_from_slice(&side.to_be_bytes());
        let sum = crc(&png[12..29]);
        png[29..33].copy_from_slice(&sum.to_be_bytes());
        lies.push(("a.png", png));
        let mut bmp = encoded(Format::Bmp);
        bmp[18..22].copy_from_slice(&side.to_le_bytes());
        bmp[22..26].copy_from_slice(&side.to_le_bytes());
        lies.push(("a.bmp", bmp));
        lies.push(("a.ppm", format!("P6 {side} {side} 255\nabc").into_bytes()));
        let mut exr = encoded(Format::Exr);
        let window = exr.windows(18).position(|w| w == b"dataWindow\0box2i\0\x10").expect("window");
        exr[window + 29..window + 33].copy_from_slice(&side.to_le_bytes());
        exr[window + 33..window + 37].copy_from_slice(&side.to_le_bytes());
        lies.push(("a.exr", exr));
        let mut tiff = encoded(Format::Tiff);
        let entry = |tag: u8| [tag, 1, 4, 0, 1, 0, 0, 0];
        for tag in [0, 1] {
            let at = tiff.windows(8).position(|w| w == entry(tag)).expect("entry");
            tiff[at + 8..at + 12].copy_from_slice(&side.to_le_bytes());
        }
        lies.push(("a.tif", tiff));
    }
    let mut jpeg = encoded(Format::Jpeg);
    let frame = jpeg.windows(2).position(|w| w == [0xFF, 0xC0]).expect("frame");
    jpeg[frame + 5..frame + 9].copy_from_slice(&[0xF0; 4]);
    lies.push(("a.jpg", jpeg));
    let mut tga = encoded(Format::Tga);
    tga[12..16].copy_from_slice(&[0xF0; 4]);
    lies.push(("a.tga", tga));
    for (name, lie) in lies {
        let error = read_bytes(&lie, name, MapKind::Color).expect_err(name);
        assert_eq!(error.kind(), ErrorKind::Decode, "{name}: {error}");
    }
}

#[test]
fn unknown_and_missing_files_are_told_apart() {
    let error = read_bytes(b"hello, world", "a.png", MapKind::Color).expect_err("text");
    assert_eq!(error.kind(), ErrorKind::Format);
    assert!(error.to_string().contains("PNG, JPEG, TIFF"), "{error}");
    let error = read_bytes(b"", "a.png", MapKind::Color).expect_err("empty");
    assert!(error.to_string().contains("empty"), "{error}");
    let error = read(Path::new("no/such/file.png"), MapKind::Color).expect_err("missing");
    assert_eq!(error.kind(), ErrorKind::Io);
}

#[test]
fn content_decides_not_the_extension() {
    let small = picture::<u8>((3, 2, 3), Encoding::Srgb, 0);
    let bytes = encode(&small, Format::Png, &WriteOptions::new(MapKind::Color)).expect("png");
    let back = read_bytes(&bytes, "wrong.jpg", MapKind::Color).expect("read");
    assert_eq!(back.samples(), small.samples());
}

#[test]
fn what_comes_along_comes_back() {
    let mut small = picture::<u8>((3, 2, 3), Encoding::Srgb, 0);
    small.meta.pixels_per_metre = Some((11811, 5900));
    let options = WriteOptions {
        record: Some("{\"seed\":7,\"name\":\"Stra\u{df}e\n\"}".into()),
        ..WriteOptions::new(MapKind::Color)
    };
    for (format, name) in FORMATS {
        let bytes = encode(&small, format, &options).expect(name);
        let has = |text: &str| bytes.windows(text.len()).any(|w| w == text.as_bytes());
        if matches!(format, Format::Png | Format::Jpeg | Format::Tiff | Format::Exr) {
            assert!(has("{\"seed\":7,\"name\":\"Stra\\u00dfe \"}"), "{name}: the record");
        }
        let back = read_bytes(&bytes, name, MapKind::Color).expect(name);
        if matches!(format, Format::Png | Format::Jpeg | Format::Tiff) {
            let (x, y) = back.meta.pixels_per_metre.expect(name);
            assert!(x.abs_diff(11811) < 20 && y.abs_diff(5900) < 20, "{name}: {x} {y}");
        }
        if format == Format::Png {
            assert_eq!(back.meta, small.meta, "exactly");
        }
    }
    let png = |kind, has: &[u8]| {
        let bytes = encode(&small, Format::Png, &WriteOptions::new(kind)).expect("png");
        bytes.windows(4).any(|w| w == has)
    };
    assert!(png(MapKind::Color, b"sRGB") && !png(MapKind::Data, b"sRGB"));
    assert!(!png(MapKind::Normal, b"gAMA") && !png(MapKind::Color, b"tIME"));
}

#[test]
fn linear_integers_stay_linear() {
    let small = picture::<u16>((3, 2, 3), Encoding::Linear, 0);
    let options = WriteOptions::new(MapKind::Color);
    let bytes = encode(&small, Format::Png, &options).expect("png");
    let back = read_bytes(&bytes, "a.png", MapKind::Color).expect("read");
    assert_eq!((back.encoding, back.samples()), (Encoding::Linear, small.samples()));
    for format in [Format::Tiff, Format::Jpeg, Format::Pnm] {
        assert!(encode(&small, format, &options).is_err(), "{format:?} cannot say so");
    }
}

#[test]
fn floats_that_do_not_fit_are_refused_not_clipped() {
    for bad in [1.5, -0.1, f32::NAN, f32::INFINITY] {
        let samples = Samples::F32(vec![0.0, bad, 1.0]);
        let picture = Picture::new(1, 1, 3, samples, Encoding::Linear).expect("picture");
        let options = WriteOptions::new(MapKind::Color);
        let error = encode(&picture, Format::Png, &options).expect_err("too bright");
        assert!(error.to_string().contains(".exr"), "{error}");
        let bytes = encode(&picture, Format::Exr, &options).expect("exr");
        let back = read_bytes(&bytes, "a.exr", MapKind::Color).expect("read");
        assert_eq!(format!("{:?}", back.samples()), format!("{:?}", picture.samples()));
    }
}

#[test]
fn partial_alpha_survives_exr_within_rounding() {
    let samples = Samples::F32(vec![0.5, 2.0, 8.0, 0.25, 3.0, 4.0, 5.0, 0.0]);
    let picture = Picture::new(1, 2, 4, samples, Encoding::Linear).expect("picture");
    let bytes = encode(&picture, Format::Exr, &WriteOptions::new(MapKind::Color)).expect("exr");
    let stored = read_bytes(&bytes, "a.exr", MapKind::Data).expect("as data");
    assert_eq!(units(&stored), [0.125, 0.5, 2.0, 0.25, 3.0, 4.0, 5.0, 0.0], "premultiplied");
    let back = read_bytes(&bytes, "a.exr", MapKind::Color).expect("read");
    assert_eq!(back.samples(), picture.samples());
    assert!(back.meta.notes[0].contains("alpha"), "{:?}", back.meta.notes);
}
