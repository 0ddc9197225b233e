//! What the numbers of a file mean: profiles, code points, gamma, palettes, few bits.

use moxcms::{ColorProfile, ToneReprCurve};

use super::*;
use crate::image::color::{linear_from_srgb, srgb_from_linear};
use crate::image::picture::Sample;

const LEVELS: [[f64; 3]; 6] = [
    [0.5, 0.5, 0.5],
    [0.8, 0.3, 0.2],
    [0.2, 0.6, 0.3],
    [0.3, 0.4, 0.7],
    [0.02, 0.03, 0.01],
    [1.0, 1.0, 1.0],
];

fn colors<T: Sample>(encoding: Encoding) -> Picture {
    let samples = LEVELS.iter().flatten().map(|v| T::from_unit(*v)).collect();
    Picture::new(2, 3, 3, T::wrap(samples), encoding).expect("picture")
}

fn with_profile(mut picture: Picture, profile: &ColorProfile, format: Format) -> Vec<u8> {
    picture.meta.icc = Some(profile.encode().expect("profile"));
    encode(&picture, format, &WriteOptions::new(MapKind::Color)).expect("encode")
}

fn unit(picture: &Picture) -> Vec<f64> {
    (0..picture.samples().len()).map(|i| picture.samples().unit(i)).collect()
}

/// sRGB from Display P3 by the published matrix: the slow, obvious way.
fn srgb_from_p3(p3: [f64; 3]) -> [f64; 3] {
    let m = [
        [1.224_940_2, -0.224_940_2, 0.0],
        [-0.042_056_9, 1.042_056_9, 0.0],
        [-0.019_637_6, -0.078_636_1, 1.098_273_6],
    ];
    let light = p3.map(linear_from_srgb);
    m.map(|row| {
        let v: f64 = row.iter().zip(light).map(|(a, b)| a * b).sum();
        srgb_from_linear(v.clamp(0.0, 1.0))
    })
}

#[test]
fn other_profiles_are_converted_at_the_depth_of_the_samples() {
    let p3 = ColorProfile::new_display_p3();
    let want: Vec<f64> = LEVELS.iter().flat_map(|c| srgb_from_p3(*c)).collect();
    for (bytes, name, tolerance) in [
        (with_profile(colors::<u8>(Encoding::Srgb), &p3, Format::Png), "a.png", 1.6 / 255.0),
        (with_profile(colors::<u8>(Encoding::Srgb), &p3, Format::WebP), "a.webp", 1.6 / 255.0),
        (with_profile(colors::<u8>(Encoding::Srgb), &p3, Format::Tiff), "a.tif", 1.6 / 255.0),
        (with_profile(colors::<u16>(Encoding::Srgb), &p3, Format::Png), "a.png", 1.0 / 1000.0),
        (with_profile(colors::<u16>(Encoding::Srgb), &p3, Format::Tiff), "a.tif", 1.0 / 1000.0),
    ] {
        let back = read_bytes(&bytes, name, MapKind::Color).expect(name);
        assert_eq!((back.encoding, &back.meta.icc), (Encoding::Srgb, &None), "{name}");
        assert!(back.meta.notes[0].contains("converted"), "{name}: {:?}", back.meta.notes);
        let pairs = unit(&back).into_iter().zip(&want);
        let worst = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(worst <= tolerance, "{name}: {worst}");
    }
}

#[test]
fn srgb_profiles_are_dropped_and_data_is_never_converted() {
    let picture = colors::<u8>(Encoding::Srgb);
    let srgb = with_profile(picture.clone(), &ColorProfile::new_srgb(), Format::Png);
    let back = read_bytes(&srgb, "a.png", MapKind::Color).expect("read");
    assert_eq!((back.samples(), &back.meta), (picture.samples(), &Meta::default()));
    let p3 = with_profile(picture.clone(), &ColorProfile::new_display_p3(), Format::Png);
    let back = read_bytes(&p3, "a.png", MapKind::Normal).expect("read");
    assert_eq!((back.samples(), back.encoding), (picture.samples(), Encoding::Data));
    assert!(back.meta.notes[0].contains("ignored"), "{:?}", back.meta.notes);
}

#[test]
fn gray_profiles_and_alpha_are_handled() {
    let gray = Samples::U8(vec![0, 255, 128, 7, 200, 0]);
    let gray = Picture::new(1, 3, 2, gray, Encoding::Srgb).expect("gray");
    let bytes = with_profile(gray, &ColorProfile::new_gray_with_gamma(1.0), Format::Png);
    let back = read_bytes(&bytes, "a.png", MapKind::Color).expect("read");
    let Samples::U8(v) = back.samples() else { panic!("type kept") };
    assert_eq!([v[1], v[3], v[5]], [255, 7, 0], "alpha is no color");
    let want = [0.0, 128.0, 200.0].map(|g| srgb_from_linear(g / 255.0) * 255.0);
    let got = [v[0], v[2], v[4]].map(f64::from);
    assert!(got.iter().zip(want).all(|(a, b)| (a - b).abs() < 1.6), "{got:?} {want:?}");
}

#[test]
fn float_files_come_out_linear() {
    let picture = colors::<f32>(Encoding::Linear);
    let bytes = with_profile(picture.clone(), &ColorProfile::new_srgb(), Format::Tiff);
    let back = read_bytes(&bytes, "a.tif", MapKind::Color).expect("read");
    assert_eq!(back.encoding, Encoding::Linear);
    for (got, coded) in unit(&back).into_iter().zip(LEVELS.iter().flatten()) {
        assert!((got - linear_from_srgb(*coded)).abs() < 1e-4, "{got} from {coded}");
    }
    let mut linear = ColorProfile::new_srgb();
    linear.cicp = None;
    let curve = || Some(ToneReprCurve::Parametric(vec![1.0]));
    (linear.red_trc, linear.green_trc, linear.blue_trc) = (curve(), curve(), curve());
    let bytes = with_profile(picture.clone(), &linear, Format::Tiff);
    let back = read_bytes(&bytes, "a.tif", MapKind::Color).expect("read");
    let pairs = unit(&back).into_iter().zip(unit(&picture));
    let worst = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(worst < 1e-4, "{worst}");
}

#[test]
fn profiles_that_cannot_be_used_stay_with_the_picture() {
    let mut picture = colors::<u8>(Encoding::Srgb);
    picture.meta.icc = Some(b"this is no profile at all".to_vec());
    let options = WriteOptions::new(MapKind::Color);
    let bytes = encode(&picture, Format::Png, &options).expect("encode");
    let back = read_bytes(&bytes, "a.png", MapKind::Color).expect("read");
    assert_eq!((back.samples(), &back.meta.icc), (picture.samples(), &picture.meta.icc));
    assert!(back.meta.notes[0].contains("stays with"), "{:?}", back.meta.notes);
    for (format, name) in [(Format::Png, "a.png"), (Format::Jpeg, "a.jpg"), (Format::Tiff, "a.tif")]
    {
        let again = encode(&back, format, &options).expect("encode");
        let again = read_bytes(&again, name, MapKind::Color).expect("read");
        assert_eq!(again.meta.icc, picture.meta.icc, "{name}: written again");
    }
    for format in [Format::Exr, Format::Bmp, Format::Tga, Format::Pnm] {
        assert!(encode(&back, format, &options).is_err(), "{format:?} would lose it");
    }
}

/// A PNG of 4 x 1 pixels by the `png` crate.
fn png(
    color: png_crate::ColorType,
    depth: png_crate::BitDepth,
    data: &[u8],
    change: impl FnOnce(&mut png_crate::Info),
) -> Vec<u8> {
    let mut info = png_crate::Info::with_size(4, 1);
    info.color_type = color;
    info.bit_depth = depth;
    change(&mut info);
    let mut out = Vec::new();
    let encoder = png_crate::Encoder::with_info(&mut out, info).expect("info");
    let mut writer = encoder.write_header().expect("header");
    writer.write_image_data(data).expect("data");
    writer.finish().expect("end");
    out
}

use ::png as png_crate;

#[test]
fn small_depths_palettes_and_transparent_colors_are_expanded() {
    use png_crate::{BitDepth, ColorType};
    let read = |bytes: &[u8]| {
        let picture = read_bytes(bytes, "a.png", MapKind::Color).expect("read");
        (picture.channels(), picture.into_samples())
    };
    let one = png(ColorType::Grayscale, BitDepth::One, &[0b1010_0000], |_| {});
    assert_eq!(read(&one), (1, Samples::U8(vec![255, 0, 255, 0])));
    let two = png(ColorType::Grayscale, BitDepth::Two, &[0b0001_1011], |_| {});
    assert_eq!(read(&two), (1, Samples::U8(vec![0, 85, 170, 255])));
    let palette = |info: &mut png_crate::Info| {
        info.palette = Some(vec![1, 2, 3, 40, 50, 60].into());
    };
    let indexed = png(ColorType::Indexed, BitDepth::One, &[0b0110_0000], palette);
    let want = vec![1, 2, 3, 40, 50, 60, 40, 50, 60, 1, 2, 3];
    assert_eq!(read(&indexed), (3, Samples::U8(want)));
    let clear = |info: &mut png_crate::Info| {
        palette(info);
        info.trns = Some(vec![0].into());
    };
    let indexed = png(ColorType::Indexed, BitDepth::One, &[0b0110_0000], clear);
    let want = vec![1, 2, 3, 0, 40, 50, 60, 255, 40, 50, 60, 255, 1, 2, 3, 0];
    assert_eq!(read(&indexed), (4, Samples::U8(want)));
}

#[test]
fn gamma_says_linear_or_is_noted() {
    use png_crate::{BitDepth, ColorType, ScaledFloat};
    let with = |gamma: f32| {
        let data = [0, 1, 0, 2, 0, 3, 0, 4];
        let set = |info: &mut png_crate::Info| info.source_gamma = Some(ScaledFloat::new(gamma));
        let bytes = png(ColorType::Grayscale, BitDepth::Sixteen, &data, set);
        let color = read_bytes(&bytes, "a.png", MapKind::Color).expect("read");
        let data = read_bytes(&bytes, "a.png", MapKind::Data).expect("read");
        assert_eq!(data.encoding, Encoding::Data);
        (color.encoding, color.meta.notes.len())
    };
    assert_eq!(with(1.0), (Encoding::Linear, 0));
    assert_eq!(with(0.45455), (Encoding::Srgb, 0));
    assert_eq!(with(0.7), (Encoding::Srgb, 1));
}

#[test]
fn code_points_outrank_everything() {
    let picture = colors::<u16>(Encoding::Srgb);
    let plain = encode(&picture, Format::Png, &WriteOptions::new(MapKind::Color)).expect("png");
    let with = |points: [u8; 4]| {
        // Behind the signature and IHDR.
        let mut chunk = [&b"cICP"[..], &points].concat();
        let sum = tests::crc(&chunk);
        chunk.extend(sum.to_be_bytes());
        let bytes = [&plain[..33], &4_u32.to_be_bytes(), &chunk, &plain[33..]].concat();
        read_bytes(&bytes, "a.png", MapKind::Color).expect("read")
    };
    assert_eq!(with([1, 13, 0, 1]).samples(), picture.samples());
    assert_eq!(with([1, 8, 0, 1]).encoding, Encoding::Linear);
    let p3 = with([12, 13, 0, 1]);
    let want: Vec<f64> = LEVELS.iter().flat_map(|c| srgb_from_p3(*c)).collect();
    let worst = unit(&p3).iter().zip(&want).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(worst < 1e-3, "{worst}, {:?}", p3.meta.notes);
    let pq = with([9, 16, 0, 1]);
    assert_eq!(pq.samples(), picture.samples());
    assert!(pq.meta.notes[0].contains("cICP"), "{:?}", pq.meta.notes);
}

#[test]
fn exr_channels_are_colors_or_data_by_their_names() {
    let plane = |v: f32| ::exr::image::FlatSamples::F32(vec![v, v + 10.0]);
    let read = |names: &[(&'static str, f32)]| {
        let channels = names.iter().map(|(name, v)| (*name, plane(*v)));
        let bytes = tests::exr_of_planes(channels, None);
        read_bytes(&bytes, "a.exr", MapKind::Color).expect("read")
    };
    let color = read(&[("R", 1.0), ("G", 2.0), ("B", 3.0), ("Z", 9.0)]);
    assert_eq!(color.samples(), &Samples::F32(vec![1.0, 2.0, 3.0, 11.0, 12.0, 13.0]));
    assert_eq!(color.encoding, Encoding::Linear);
    assert!(color.meta.notes[0].contains('Z'), "{:?}", color.meta.notes);
    let layer = read(&[("base.R", 1.0), ("base.G", 2.0), ("base.B", 3.0)]);
    assert_eq!((layer.channels(), layer.encoding), (3, Encoding::Linear));
    assert_eq!(layer.samples(), &Samples::F32(vec![1.0, 2.0, 3.0, 11.0, 12.0, 13.0]));
    let gray = read(&[("Y", 1.0)]);
    assert_eq!((gray.channels(), gray.encoding), (1, Encoding::Linear));
    let vector = read(&[("Z", 3.0), ("X", 1.0), ("Y", 2.0)]);
    assert_eq!(vector.samples(), &Samples::F32(vec![1.0, 2.0, 3.0, 11.0, 12.0, 13.0]));
    assert_eq!(vector.encoding, Encoding::Data);
}
