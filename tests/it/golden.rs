//! Golden pictures: small tiles, compared as an eye would, not byte by byte.
//!
//! `TEXFORGE_BLESS=1 cargo test --test it golden` writes `tests/golden/*.png` anew and then fails,
//! so that nobody blesses by accident. A failure writes *expected | difference x8 | actual* to
//! `golden-failures` in the target folder.

use std::path::{Path, PathBuf};

use texforge::image::color::ColorModel;
use texforge::{Axis, Ctx, Encoding, Method, Picture, Samples, Size, TileParams, tile};

use crate::support::Pixels;
use crate::support::exemplar::{Exemplar, grain, pebbles, stained, stripes};

/// Side of the blocks that are compared, in pixels: an eye that is not looking for single pixels.
const BLOCK: usize = 4;

/// Most that the blocks' mean colours may differ on average, as a distance in L*a*b*. A tile made
/// with another seed differs by 10 and more.
const COLOR_TOLERANCE: f64 = 1.5;

/// Most that the blocks' contrasts (standard deviation of L*) may differ on average. Softening by
/// a 3x3 box costs 2 and more.
const CONTRAST_TOLERANCE: f64 = 1.0;

/// Most that a golden picture may weigh.
const MOST_BYTES: usize = 20 << 10;

/// Values in steps of an eighth of a bit less than a byte: small files.
fn posterized(exemplar: &Exemplar) -> Picture {
    const STEPS: f64 = 20.0;
    let step = |px: [f64; 3]| px.map(|v| (v * STEPS).round() / STEPS);
    let (height, width) = (exemplar.height, exemplar.width);
    Exemplar::from_fn(height, width, |y, x| step(exemplar.rgb[y * width + x])).picture()
}

fn check(name: &str, exemplar: &Exemplar, params: &TileParams) {
    let ctx = Ctx::new(0, 2).expect("pool");
    let size = Size::Pixels { width: 96, height: 96 };
    let params = TileParams { size, ..params.clone() };
    let photo = posterized(exemplar);
    let actual = tile(&ctx, &photo, None, &params).expect("a tile").picture;
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden").join(name);
    if std::env::var_os("TEXFORGE_BLESS").is_some() {
        let bytes = pixels(&actual).encode();
        assert!(bytes.len() < MOST_BYTES, "{name} would weigh {} bytes", bytes.len());
        std::fs::write(&path, bytes).expect("written");
        panic!("{name} is blessed; look at it, then run again without TEXFORGE_BLESS");
    }
    let bytes = std::fs::read(&path).expect("a golden picture (TEXFORGE_BLESS=1 makes it)");
    assert!(bytes.len() < MOST_BYTES, "{name} weighs {} bytes", bytes.len());
    let expected = picture(&Pixels::decode(&bytes));
    let (color, contrast) = difference(&expected, &actual);
    if color > COLOR_TOLERANCE || contrast > CONTRAST_TOLERANCE {
        let shown = shown(name, &expected, &actual);
        panic!(
            "{name}: colours differ by {color:.2} (at most {COLOR_TOLERANCE}), contrasts by \
             {contrast:.2} (at most {CONTRAST_TOLERANCE}); see {}",
            shown.display()
        );
    }
}

/// Mean differences of the blocks' mean colours and of their contrasts.
fn difference(expected: &Picture, actual: &Picture) -> (f64, f64) {
    let size = |p: &Picture| (p.height(), p.width(), p.channels());
    assert_eq!(size(expected), size(actual), "sizes");
    let blocks = |picture: &Picture| {
        let model = ColorModel::new(expected);
        let mut lab = model.averaging_pixels(picture);
        model.space().convert_row(&mut lab);
        let (rows, cols) = (picture.height() / BLOCK, picture.width() / BLOCK);
        let block = |i: usize| {
            let (y, x) = (i / cols * BLOCK, i % cols * BLOCK);
            let px = |k: usize| lab[(y + k / BLOCK) * picture.width() + x + k % BLOCK];
            let all = || (0..BLOCK * BLOCK).map(px);
            let n = (BLOCK * BLOCK) as f64;
            let mean: [f64; 3] =
                std::array::from_fn(|k| all().map(|px| f64::from(px[k])).sum::<f64>() / n);
            let variance = all().map(|px| (f64::from(px[0]) - mean[0]).powi(2)).sum::<f64>() / n;
            (mean, variance.sqrt())
        };
        (0..rows * cols).map(block).collect::<Vec<_>>()
    };
    let (e, a) = (blocks(expected), blocks(actual));
    let n = e.len() as f64;
    let far =
        |(e, a): (&[f64; 3], &[f64; 3])| (0..3).map(|k| (e[k] - a[k]).powi(2)).sum::<f64>().sqrt();
    let color = e.iter().zip(&a).map(|(e, a)| far((&e.0, &a.0))).sum::<f64>() / n;
    let contrast = e.iter().zip(&a).map(|(e, a)| (e.1 - a.1).abs()).sum::<f64>() / n;
    (color, contrast)
}

/// Writes *expected | difference x8 | actual*.
fn shown(name: &str, expected: &Picture, actual: &Picture) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).with_file_name("golden-failures");
    std::fs::create_dir_all(&folder).expect("folder");
    let (e, a) = (pixels(expected), pixels(actual));
    let apart = e.samples.iter().zip(&a.samples);
    let apart = apart.map(|(e, a)| e.abs_diff(*a).saturating_mul(8)).collect();
    let apart = Pixels { samples: apart, ..pixels(expected) };
    let row = |p: &Pixels, y: usize| p.samples[y * p.width * 3..(y + 1) * p.width * 3].to_vec();
    let rows = (0..e.height).flat_map(|y| [row(&e, y), row(&apart, y), row(&a, y)].concat());
    let all = Pixels { width: 3 * e.width, samples: rows.collect(), ..pixels(expected) };
    let path = folder.join(name);
    std::fs::write(&path, all.encode()).expect("written");
    path
}

fn pixels(picture: &Picture) -> Pixels {
    let Samples::U8(samples) = picture.samples() else { panic!("8 bits") };
    Pixels {
        width: picture.width(),
        height: picture.height(),
        channels: 3,
        deep: false,
        samples: samples.clone(),
    }
}

fn picture(pixels: &Pixels) -> Picture {
    let samples = Samples::U8(pixels.samples.clone());
    Picture::new(pixels.height, pixels.width, 3, samples, Encoding::Srgb).expect("picture")
}

/// Fine texture: does detail survive?
#[test]
fn fine_grain() {
    check("grain.png", &grain(128, 128, 21), &TileParams::default());
}

/// The main job: the stain must be gone.
#[test]
fn a_stain() {
    check("stain.png", &stained(144, 144, 22), &TileParams::default());
}

/// The same photo without the projection: the stain stays.
#[test]
fn a_stain_wrapped_only() {
    let params = TileParams { method: Method::WrapOnly, ..Default::default() };
    check("stain_wrap_only.png", &stained(144, 144, 22), &params);
}

/// Things with outlines: are they whole?
#[test]
fn whole_pebbles() {
    check("pebbles.png", &pebbles(144, 144, 23), &TileParams::default());
}

/// Lines that must meet over the seam, and a free axis.
#[test]
fn stripes_on_one_axis() {
    let params = TileParams { axis: Axis::X, ..Default::default() };
    check("stripes_x.png", &stripes(128, 128, 24), &params);
}

/// A new sample from all of them, row, column and channel.
type Change<'a> = dyn Fn(&[u8], usize, usize, usize) -> u8 + 'a;

/// The comparison forgives what nobody sees and nothing else.
#[test]
fn the_comparison_is_neither_blind_nor_fussy() {
    let golden = posterized(&pebbles(96, 96, 23));
    let passes = |other: &Picture| {
        let (color, contrast) = difference(&golden, other);
        color <= COLOR_TOLERANCE && contrast <= CONTRAST_TOLERANCE
    };
    let changed = |sample: &Change<'_>| {
        let pixels = pixels(&golden);
        let v = (0..96 * 96 * 3).map(|i| sample(&pixels.samples, i / 288, i / 3 % 96, i % 3));
        picture(&Pixels { samples: v.collect(), ..pixels })
    };
    let at = |v: &[u8], y: usize, x: usize, k: usize| v[(y % 96 * 96 + x % 96) * 3 + k];
    assert!(passes(&golden), "itself");
    let flicker = changed(&|v, y, x, k| at(v, y, x, k).saturating_add(((y + x) % 3) as u8));
    assert!(passes(&flicker), "one level of noise");
    let spot = changed(&|v, y, x, k| if y < 6 && x < 6 { 255 } else { at(v, y, x, k) });
    assert!(passes(&spot), "a seam that took another way");
    assert!(!passes(&changed(&|v, y, x, k| at(v, y, x + 4, k))), "moved by four pixels");
    assert!(!passes(&changed(&|v, y, x, k| at(v, y, x, k).saturating_add(9))), "brighter");
    let soft = changed(&|v, y, x, k| {
        let near = (0..9).map(|i| u32::from(at(v, y + 95 + i / 3, x + 95 + i % 3, k)));
        (near.sum::<u32>() / 9) as u8
    });
    assert!(!passes(&soft), "softened");
    assert!(!passes(&posterized(&pebbles(96, 96, 24))), "another picture");
}
