//! `regular` with pieces between pixels, on pictures that are known there.

use std::process::Command;

use assert_cmd::prelude::*;
use texforge::base::params::OrAuto;
use texforge::base::rng::Rng;
use texforge::verb::regular::{Seam, Straighten, Subpixel, Tileable};
use texforge::{
    Ctx, Encoding, Guide, MapKind, Mask, Picture, Regular, RegularMaker, RegularParams, Samples,
    Size, regular,
};

use crate::support::{Folder, PROGRAM};

/// A lattice of fractions of pixels, and one of whole ones.
const FINE: [[f64; 2]; 2] = [[20.37, 0.21], [0.4, 17.63]];
const WHOLE: [[f64; 2]; 2] = [[20.0, 0.0], [1.0, 17.0]];

/// What repeats with a lattice, without anything finer than a third of it, at any place: its value.
fn pattern([a, b]: [[f64; 2]; 2], y: f64, x: f64) -> f64 {
    let area = a[0] * b[1] - a[1] * b[0];
    let (u, v) = ((x * b[1] - y * b[0]) / area, (a[0] * y - a[1] * x) / area);
    let wave = |p: f64, q: f64, phase: f64| (std::f64::consts::TAU * (p * u + q * v + phase)).cos();
    let waves =
        wave(1.0, 0.0, 0.1) + wave(0.0, 1.0, 0.7) + wave(2.0, -1.0, 0.3) + wave(1.0, 3.0, 0.9);
    0.5 + 0.1 * waves
}

/// The picture of it, `scale` pixels to one of the photo's.
fn picture(basis: [[f64; 2]; 2], scale: usize) -> Picture {
    let (h, w) = (150 * scale, 160 * scale);
    let place = |i: usize| (i as f64 + 0.5) / scale as f64 - 0.5;
    let all = (0..h).flat_map(|y| (0..w).map(move |x| (y, x)));
    let samples = all.map(|(y, x)| pattern(basis, place(y), place(x)) as f32).collect();
    Picture::new(h, w, 1, Samples::F32(samples), Encoding::Linear).expect("valid")
}

fn params(basis: [[f64; 2]; 2], subpixel: Subpixel) -> RegularParams {
    RegularParams {
        size: Size::Pixels { width: 230, height: 210 },
        lattice: Guide::Vectors(basis),
        block: OrAuto::Given(24),
        border: OrAuto::Given(8),
        flatten: OrAuto::Given(0.0),
        straighten: Straighten::Off,
        tolerance: 0,
        subpixel,
        ..Default::default()
    }
}

fn made(photo: &Picture, params: &RegularParams) -> Regular {
    regular(&Ctx::new(0, 2).expect("pool"), photo, None, params).expect("a texture")
}

/// How far a texture is from the pattern, root of the mean square.
fn off(texture: &Picture, basis: [[f64; 2]; 2]) -> f64 {
    let n = texture.width() * texture.height();
    let square = |i: usize| {
        let (y, x) = ((i / texture.width()) as f64, (i % texture.width()) as f64);
        (texture.samples().unit(i) - pattern(basis, y, x)).powi(2)
    };
    ((0..n).map(square).sum::<f64>() / n as f64).sqrt()
}

#[test]
fn the_pattern_goes_on_between_pixels() {
    let photo = picture(FINE, 1);
    for (straighten, tolerance, gain) in [(Straighten::Off, 0, 15.0), (Straighten::On, 3, 4.0)] {
        let of = |subpixel| {
            let params = RegularParams { straighten, tolerance, ..params(FINE, subpixel) };
            off(&made(&photo, &params).picture, FINE)
        };
        let (copied, between) = (of(Subpixel::Off), of(Subpixel::On));
        assert!(gain * between < copied, "{straighten:?}: {between} for {copied}");
    }
}

#[test]
fn whole_places_stay_copies() {
    let photo = picture(WHOLE, 1);
    let of = |subpixel| made(&photo, &params(WHOLE, subpixel)).picture;
    assert_eq!(of(Subpixel::On), of(Subpixel::Off));
}

#[test]
fn without_a_lattice_it_makes_no_difference() {
    let photo = picture(FINE, 1);
    let of = |subpixel| {
        let params = RegularParams { lattice: Guide::None, tolerance: 3, ..params(FINE, subpixel) };
        made(&photo, &params).picture
    };
    assert_eq!(of(Subpixel::On), of(Subpixel::Off));
}

/// Maps of the photo's size and of others show the same places of the material.
#[test]
fn maps_follow_between_pixels() {
    let photo = picture(FINE, 1);
    let data = |scale| {
        let mut map = picture(FINE, scale);
        map.encoding = Encoding::Data;
        map
    };
    let (same, finer) = (data(1), data(4));
    for seam in [Seam::Graph, Seam::Linear] {
        let ctx = Ctx::new(0, 2).expect("pool");
        let params = RegularParams { seam, ..params(FINE, Subpixel::On) };
        let maker = RegularMaker::new(&ctx, &photo, None, &params).expect("a maker");
        let maps = [(&same, MapKind::Data), (&finer, MapKind::Data)];
        let (texture, maps) = maker.make(&ctx, &maps).expect("a texture");
        assert_eq!(maps[0].samples(), texture.picture.samples(), "light is linear here");
        assert!(off(&maps[1], FINE) < 0.003, "{seam:?}: {}", off(&maps[1], FINE));
    }
}

#[test]
fn masked_pixels_do_not_shine_through() {
    let mut photo = picture(FINE, 1);
    let Samples::F32(v) = photo.samples() else { panic!("floats") };
    let mut v = v.clone();
    let usable: Vec<bool> = (0..v.len()).map(|i| !(i / 160 < 11 || i % 160 >= 151)).collect();
    v.iter_mut().zip(&usable).filter(|(_, usable)| !**usable).for_each(|(v, _)| *v = 1e6);
    photo = Picture::new(150, 160, 1, Samples::F32(v), Encoding::Linear).expect("valid");
    let mask = Mask::new(150, 160, usable).expect("a mask");
    for (straighten, tolerance, deform) in [(Straighten::Off, 0, 0), (Straighten::On, 3, 2)] {
        let params = RegularParams { straighten, tolerance, deform, ..params(FINE, Subpixel::On) };
        let ctx = Ctx::new(0, 2).expect("pool");
        let made = regular(&ctx, &photo, Some(&mask), &params).expect("a texture");
        let most = (0..210 * 230).map(|i| made.picture.samples().unit(i)).fold(0.0, f64::max);
        assert!(most < 1.0, "{most}");
    }
}

/// Colours with grain, all of them opaque.
fn grainy() -> Picture {
    let mut rng = Rng::new(8, 0, 0, 0);
    let all = (0..150).flat_map(|y| (0..160).map(move |x| (y, x)));
    let samples = all.flat_map(|(y, x)| {
        let value = (200.0 * pattern(FINE, f64::from(y), f64::from(x))) as u8;
        [value + rng.below(30) as u8, value, value / 2 + rng.below(9) as u8, 255]
    });
    Picture::new(150, 160, 4, Samples::U8(samples.collect()), Encoding::Srgb).expect("valid")
}

#[test]
fn same_bytes_for_any_threads_kernels_and_strips() {
    let photo = grainy();
    for (seam, tileable) in [(Seam::Graph, Tileable::None), (Seam::Linear, Tileable::Both)] {
        let size = match tileable {
            Tileable::None => Size::Pixels { width: 130, height: 190 },
            _ => Size::Auto,
        };
        let params = RegularParams {
            seam,
            tileable,
            size,
            tolerance: 2,
            straighten: Straighten::On,
            ..params(FINE, Subpixel::On)
        };
        let mut contexts: Vec<Ctx> =
            [1, 2, 5].into_iter().map(|n| Ctx::new(3, n).expect("pool")).collect();
        contexts[2].simd = texforge::Simd::Scalar;
        let of = |ctx: &Ctx| regular(ctx, &photo, None, &params).expect("a texture").picture;
        let whole = of(&contexts[0]);
        let (width, height) = (whole.width(), whole.height());
        assert!((0..width * height).all(|i| whole.samples().unit(4 * i + 3) == 1.0), "opaque");
        for ctx in &contexts[1..] {
            assert_eq!(of(ctx), whole, "{seam:?}");
        }
        let maker = RegularMaker::new(&contexts[1], &photo, None, &params).expect("a maker");
        let mut samples = Vec::new();
        for strip in maker.pictures(&contexts[1], width * 24, &[]).expect("memory") {
            let Samples::U8(v) = strip.expect("a strip")[0].samples().clone() else {
                panic!("8 bits")
            };
            samples.extend(v);
        }
        assert_eq!(&Samples::U8(samples), whole.samples(), "{seam:?}");
    }
}

#[test]
fn a_source_map_of_whole_pixels_is_refused() {
    let folder = Folder::new();
    let photo = grainy();
    folder.rgb_from("wall.png", 160, 150, |x, y| {
        [0, 1, 2].map(|k| (255.0 * photo.samples().unit((y * 160 + x) as usize * 4 + k)) as u8)
    });
    let run = |more: &[&str]| {
        let args = ["regular", "wall.png", "--lattice", "20.37,0.21,0.4,17.63", "--subpixel", "on"];
        let mut command = Command::new(PROGRAM);
        command.args(args).args(more).current_dir(folder.at("")).output().expect("it runs")
    };
    run(&["-o", "a.png"]).assert().success();
    let refused = run(&["-o", "b.png", "--save-source-map", "b.exr"]);
    let message = String::from_utf8_lossy(&refused.stderr).into_owned();
    refused.assert().code(2);
    assert!(message.contains("`subpixel` on") && message.contains("`--map`"), "{message}");
    assert!(folder.names().iter().all(|name| !name.starts_with('b')), "{:?}", folder.names());
}
