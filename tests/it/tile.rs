//! What [`tile`] promises, whatever the picture: reproducible, made of usable source pixels, every
//! sample type, one clear error.

use proptest::prelude::*;
use texforge::base::memory::available_bytes;
use texforge::{
    Axis, Ctx, Encoding, Error, ErrorKind, Mask, Method, Picture, Quality, Result, Samples, Simd,
    Size, Tile, TileParams, tile,
};

use crate::support::exemplar::{Exemplar, grain, hash, pebbles, stained, stripes};

const METHODS: [Method; 4] =
    [Method::Stationary, Method::WrapOnly, Method::NoWrap, Method::MakeSeamless];
const COPYING: [Method; 3] = [Method::Stationary, Method::WrapOnly, Method::NoWrap];

fn draft(width: usize, height: usize) -> TileParams {
    let size = Size::Pixels { width, height };
    TileParams { size, quality: Quality::Draft, ..Default::default() }
}

fn ctx() -> Ctx {
    Ctx::new(0, 2).expect("pool")
}

fn made(photo: &Picture, mask: Option<&Mask>, params: &TileParams) -> Tile {
    tile(&ctx(), photo, mask, params).expect("a tile")
}

/// Positions of a tile that copies.
fn positions(tile: &Tile) -> &[[u32; 2]] {
    tile.source_map.as_ref().expect("a source map").positions()
}

/// The pixels that the source map names, one by one.
fn gathered(photo: &Picture, tile: &Tile) -> Samples {
    fn pick<T: Copy>(v: &[T], photo: &Picture, tile: &Tile) -> Vec<T> {
        let c = photo.channels();
        let at = |&[y, x]: &[u32; 2]| (y as usize * photo.width() + x as usize) * c;
        positions(tile).iter().flat_map(|p| v[at(p)..at(p) + c].to_vec()).collect()
    }
    match photo.samples() {
        Samples::U8(v) => Samples::U8(pick(v, photo, tile)),
        Samples::U16(v) => Samples::U16(pick(v, photo, tile)),
        Samples::F16(v) => Samples::F16(pick(v, photo, tile)),
        Samples::F32(v) => Samples::F32(pick(v, photo, tile)),
        Samples::F64(v) => Samples::F64(pick(v, photo, tile)),
    }
}

/// `c` channels made of an exemplar's three: each is a mix of its own.
fn channels(exemplar: &Exemplar, c: usize) -> Vec<f64> {
    let mix = |[r, g, b]: [f64; 3], k: usize| match k % 3 {
        0 => r,
        1 => g * 0.9,
        _ => (b + r * k as f64) / (k + 1) as f64,
    };
    exemplar.rgb.iter().flat_map(|&px| (0..c).map(move |k| mix(px, k))).collect()
}

mod reproducible {
    use super::*;

    #[test]
    fn same_bytes_for_any_number_of_threads_and_any_instructions() {
        let photo = stained(72, 80, 1).picture();
        for method in METHODS {
            for axis in [Axis::Both, Axis::X, Axis::Y] {
                let params = TileParams { method, axis, ..draft(52, 47) };
                let run = |threads: usize, simd: Simd| {
                    let mut ctx = Ctx::new(3, threads).expect("pool");
                    ctx.simd = simd;
                    let tile = tile(&ctx, &photo, None, &params).expect("a tile");
                    (tile.picture, tile.source_map, tile.report.costs)
                };
                let want = run(1, Simd::Scalar);
                for (threads, simd) in [
                    (2, Simd::Scalar),
                    (5, Simd::Avx2),
                    (1, Simd::Avx512),
                    (1, Simd::Avx512Vnni),
                    (5, Simd::Avx512Vnni),
                ] {
                    let got = run(threads, simd);
                    assert!(got == want, "{method:?} {axis:?}: {threads} threads, {simd:?}");
                }
            }
        }
    }

    #[test]
    fn another_seed_is_another_tile() {
        let photo = grain(64, 64, 1).picture();
        let run = |seed| {
            let ctx = Ctx::new(seed, 2).expect("pool");
            tile(&ctx, &photo, None, &draft(40, 40)).expect("a tile").picture
        };
        assert_eq!(run(1), run(1));
        assert_ne!(run(1), run(2));
    }

    /// A mask that allows everything, an alpha that hides nothing and more bits per sample change
    /// nothing.
    #[test]
    fn what_says_nothing_changes_nothing() {
        let exemplar = pebbles(70, 66, 2);
        let photo = exemplar.picture();
        let params = draft(48, 40);
        let want = made(&photo, None, &params);
        let same = |photo: &Picture, mask: Option<&Mask>, what: &str| {
            assert!(positions(&made(photo, mask, &params)) == positions(&want), "{what}");
        };
        let all = Mask::new(70, 66, vec![true; 70 * 66]).expect("mask");
        same(&photo, Some(&all), "a mask of nothing but usable pixels");
        let Samples::U8(bytes) = photo.samples() else { panic!("8 bits") };
        let rgba = bytes.chunks(3).flat_map(|px| [px[0], px[1], px[2], 255]).collect();
        same(&exemplar.with(4, Samples::U8(rgba), Encoding::Srgb), None, "opaque alpha");
        let deep = bytes.iter().map(|&v| u16::from(v) * 257).collect();
        same(&exemplar.with(3, Samples::U16(deep), Encoding::Srgb), None, "16 bits");
    }

    #[test]
    fn grey_is_rgb_with_equal_channels() {
        let exemplar = stained(70, 66, 2);
        let grey: Vec<u8> = exemplar.rgb.iter().map(|px| (px[1] * 255.0) as u8).collect();
        let rgb = grey.iter().flat_map(|&v| [v; 3]).collect();
        let grey = exemplar.with(1, Samples::U8(grey), Encoding::Srgb);
        let rgb = exemplar.with(3, Samples::U8(rgb), Encoding::Srgb);
        let (grey, rgb) = (made(&grey, None, &draft(48, 40)), made(&rgb, None, &draft(48, 40)));
        assert!(positions(&grey) == positions(&rgb), "other source maps");
        assert_eq!(grey.report.costs, rgb.report.costs);
    }
}

mod copied {
    use super::*;
    use half::f16;

    #[test]
    fn every_sample_type_and_number_of_channels_is_gathered_bit_for_bit() {
        let exemplar = stripes(48, 52, 4);
        for c in [1, 2, 3, 4, 5, 9] {
            let mut v = channels(&exemplar, c);
            let color = c <= 4;
            if matches!(c, 2 | 4) {
                // Opaque but for one corner.
                v.chunks_mut(c).enumerate().for_each(|(i, px)| {
                    px[c - 1] = if i / 52 < 9 && i % 52 < 9 { 0.3 } else { 1.0 };
                });
            }
            let to = |scale: f64| v.iter().map(move |u| u * scale + 0.5).map(f64::floor);
            // Floats go beyond 1.
            let bright = if color && !matches!(c, 2 | 4) { 3.7 } else { 1.0 };
            for samples in [
                Samples::U8(to(255.0).map(|u| u as u8).collect()),
                Samples::U16(to(65535.0).map(|u| u as u16).collect()),
                Samples::F16(v.iter().map(|&u| f16::from_f64(u * bright)).collect()),
                Samples::F32(v.iter().map(|&u| (u * bright) as f32).collect()),
                Samples::F64(v.iter().map(|&u| u * bright).collect()),
            ] {
                let encoding = match (color, samples.is_float()) {
                    (false, _) => Encoding::Data,
                    (true, true) => Encoding::Linear,
                    (true, false) => Encoding::Srgb,
                };
                let what = format!("{c} channels of {}", samples.dtype());
                let photo = exemplar.with(c, samples, encoding);
                for method in METHODS {
                    let params = TileParams { method, patch: 7, ..draft(33, 28) };
                    let tile = made(&photo, None, &params);
                    let picture = &tile.picture;
                    assert_eq!((picture.height(), picture.width()), (28, 33), "{what}");
                    assert_eq!(picture.encoding, encoding, "{what}");
                    assert_eq!(picture.samples().dtype(), photo.samples().dtype(), "{what}");
                    if method == Method::MakeSeamless {
                        assert!(tile.source_map.is_none(), "{what}: it blends");
                    } else {
                        assert!(*picture.samples() == gathered(&photo, &tile), "{what} {method:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn masked_and_transparent_pixels_are_never_used() {
        let (h, w) = (72_usize, 80_usize);
        let exemplar = stained(h, w, 5);
        let hole = |y: usize, x: usize| (y % 36 < 9 && x % 40 < 10) || (y > 60 && x > 50);
        let thin = |y: usize, x: usize| x == 37 || y == 20;
        let mask = Mask::new(h, w, (0..h * w).map(|i| !hole(i / w, i % w)).collect());
        let mask = mask.expect("mask");
        let rgba = (0..h * w).flat_map(|i| {
            let [r, g, b] = exemplar.rgb[i].map(|v| (v * 255.0) as u8);
            // What must not be used looks like the rest: only the rule keeps it out.
            [r, g, b, if thin(i / w, i % w) { 128 } else { 255 }]
        });
        let photo = exemplar.with(4, Samples::U8(rgba.collect()), Encoding::Srgb);
        for method in COPYING {
            for patch in [3, 7] {
                for axis in [Axis::Both, Axis::X] {
                    let params = TileParams { method, axis, patch, ..draft(64, 50) };
                    let tile = made(&photo, Some(&mask), &params);
                    let bad = positions(&tile).iter().filter(|[y, x]| {
                        hole(*y as usize, *x as usize) || thin(*y as usize, *x as usize)
                    });
                    assert_eq!(bad.count(), 0, "{method:?} {axis:?} patch {patch}");
                }
            }
        }
    }

    /// What is fully transparent may hold anything, even NaN.
    #[test]
    fn nan_under_transparency_does_no_harm() {
        let exemplar = grain(40, 40, 1);
        let v = exemplar.rgb.iter().enumerate().flat_map(|(i, px)| {
            let hidden = i / 40 > 30;
            let [r, g, b] = px.map(|v| if hidden { f32::NAN } else { v as f32 });
            [r, g, b, if hidden { 0.0 } else { 1.0 }]
        });
        let photo = exemplar.with(4, Samples::F32(v.collect()), Encoding::Linear);
        let tile = made(&photo, None, &draft(32, 32));
        let finite = (0..32 * 32 * 4).all(|i| tile.picture.samples().unit(i).is_finite());
        assert!(finite, "NaN got into the tile");
        assert!(tile.report.costs.stationarity.is_finite(), "{:?}", tile.report.costs);
        assert!(tile.report.costs.texture.expect("copied").is_finite(), "{:?}", tile.report.costs);
    }

    #[test]
    fn a_constant_picture_stays_constant_and_costs_nothing() {
        let exemplar = Exemplar::from_fn(40, 50, |_, _| [0.8, 0.5, 0.2]);
        let photo = exemplar.picture();
        for method in METHODS {
            let tile = made(&photo, None, &TileParams { method, ..draft(36, 30) });
            let Samples::U8(v) = tile.picture.samples() else { panic!("8 bits") };
            assert!(v.chunks(3).all(|px| px == [204, 128, 51]), "{method:?}");
            let costs = tile.report.costs;
            assert!(costs.texture.unwrap_or(0.0) == 0.0, "{method:?} {costs:?}");
            assert!(costs.stationarity < 1e-4, "{method:?} {costs:?}");
        }
    }

    /// The shares shift with the projection: 0.63 for 0.50 on these pebbles.
    #[test]
    fn two_levels_stay_two_levels_in_about_their_shares() {
        let exemplar = pebbles(96, 96, 3);
        let v: Vec<u8> = exemplar.rgb.iter().map(|px| if px[1] > 0.35 { 255 } else { 0 }).collect();
        let share = |v: &[u8]| v.iter().filter(|&&v| v > 127).count() as f64 / v.len() as f64;
        let want = share(&v);
        let photo = exemplar.with(1, Samples::U8(v), Encoding::Srgb);
        for method in COPYING {
            let tile = made(&photo, None, &TileParams { method, ..draft(64, 64) });
            let Samples::U8(v) = tile.picture.samples() else { panic!("8 bits") };
            assert!(v.iter().all(|v| matches!(v, 0 | 255)), "{method:?}");
            let most = if method == Method::Stationary { 0.17 } else { 0.12 };
            assert!((share(v) - want).abs() < most, "{method:?}: {} for {want}", share(v));
        }
    }
}

mod extremes {
    use super::*;

    #[test]
    fn tiles_may_be_much_larger_or_thinner_than_the_photo() {
        for (photo, patch, width, height) in [
            ((21, 21), 21, 21, 21),
            ((21, 21), 21, 50, 30),
            ((3, 3), 3, 3, 3),
            ((3, 200), 3, 40, 40),
            ((200, 3), 3, 3, 90),
            ((30, 30), 5, 400, 5),
            ((11, 40), 11, 11, 300),
            ((40, 11), 11, 131, 73),
        ] {
            let exemplar = grain(photo.0, photo.1, 1);
            let picture = exemplar.picture();
            for method in COPYING {
                for axis in [Axis::Both, Axis::X, Axis::Y] {
                    let params = TileParams { method, axis, patch, ..draft(width, height) };
                    let tile = made(&picture, None, &params);
                    let same = *tile.picture.samples() == gathered(&picture, &tile);
                    assert!(same, "{width}x{height} of {photo:?}, {method:?} {axis:?}");
                }
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(128))]
        /// Whatever is asked: a tile of usable pixels, or an error that is the asker's.
        #[test]
        fn whatever_is_asked(
            photo in (1..48_usize, 1..48_usize),
            size in (1..60_usize, 1..60_usize),
            patch in (1..8_usize).prop_map(|n| 2 * n + 1),
            method in 0..4_usize,
            axis in prop::sample::select(vec![Axis::Both, Axis::X, Axis::Y]),
            sigma in 0.01..1.0_f32,
            uniformity in 0.0..100.0_f32,
            holes in prop::option::of(0.0..0.05_f64),
            seed: u64,
        ) {
            let method = METHODS[method];
            let params =
                TileParams { method, axis, patch, sigma, uniformity, ..draft(size.1, size.0) };
            let exemplar = stained(photo.0, photo.1, 1);
            let picture = exemplar.picture();
            let usable = |i: usize| holes.is_none_or(|p| hash(seed, 0, i as i64) >= p);
            let mask = Mask::new(photo.0, photo.1, (0..photo.0 * photo.1).map(usable).collect());
            let ctx = Ctx::new(seed, 2).expect("pool");
            match tile(&ctx, &picture, holes.map(|_| mask.as_ref().expect("mask")), &params) {
                Ok(tile) => {
                    prop_assert_eq!((tile.picture.height(), tile.picture.width()), size);
                    prop_assert!(tile.report.costs.stationarity.is_finite());
                    if method != Method::MakeSeamless {
                        prop_assert!(*tile.picture.samples() == gathered(&picture, &tile));
                        let at = |p: &[u32; 2]| p[0] as usize * photo.1 + p[1] as usize;
                        prop_assert!(positions(&tile).iter().all(|p| usable(at(p))));
                    }
                }
                Err(error) => {
                    let small = photo.0.min(photo.1).min(size.0).min(size.1) < patch;
                    match error.kind() {
                        ErrorKind::TooSmall => prop_assert!(small, "{}", error),
                        ErrorKind::EmptyMask => prop_assert!(holes.is_some(), "{}", error),
                        // Make-seamless cannot enlarge.
                        ErrorKind::Parameter => prop_assert!(
                            method == Method::MakeSeamless
                                && (size.0 > photo.0 || size.1 > photo.1), "{}", error),
                        _ => prop_assert!(false, "{}", error),
                    }
                }
            }
        }
    }
}

mod refused {
    use super::*;

    fn refusal(photo: &Picture, mask: Option<&Mask>, params: &TileParams) -> Error {
        tile(&ctx(), photo, mask, params).expect_err("refused")
    }

    #[test]
    fn pictures_and_sizes_below_one_patch() {
        for (height, width) in [(1, 1), (1, 200), (200, 1), (10, 200)] {
            let photo = grain(height, width, 1).picture();
            let error = refusal(&photo, None, &draft(64, 64));
            assert_eq!(error.kind(), ErrorKind::TooSmall, "{error}");
            assert!(error.to_string().contains("the photo"), "{error}");
        }
        let photo = grain(64, 64, 1).picture();
        for (width, height) in [(1, 1), (200, 1), (1, 200), (10, 64)] {
            let error = refusal(&photo, None, &draft(width, height));
            assert_eq!(error.kind(), ErrorKind::TooSmall, "{error}");
            assert!(error.to_string().contains("the tile"), "{error}");
        }
    }

    #[test]
    fn sizes_and_patches_that_are_none() {
        let photo = grain(64, 64, 1).picture();
        for (width, height) in [(0, 64), (64, 0), (32_769, 64), (usize::MAX, usize::MAX)] {
            let error = refusal(&photo, None, &draft(width, height));
            assert_eq!(error.kind(), ErrorKind::Parameter, "{error}");
        }
        for patch in [0, 1, 2, 10, 23, usize::MAX] {
            let error = refusal(&photo, None, &TileParams { patch, ..draft(64, 64) });
            assert!(matches!(error, Error::Parameter { name: "patch", .. }), "{error}");
        }
        for sigma in [0.0, -1.0, 1.5, f32::NAN, f32::INFINITY] {
            let error = refusal(&photo, None, &TileParams { sigma, ..draft(64, 64) });
            assert!(matches!(error, Error::Parameter { name: "sigma", .. }), "{error}");
        }
        let large = TileParams { method: Method::MakeSeamless, ..draft(65, 64) };
        let error = refusal(&photo, None, &large);
        assert!(error.to_string().contains("64x64"), "{error}");
    }

    #[test]
    #[expect(clippy::print_stderr, reason = "a test that does nothing must say so")]
    fn more_memory_than_there_is() {
        const PIXELS: u64 = 32_768 * 32_768;
        if available_bytes() > 60 * PIXELS {
            eprintln!("skipped: this machine has memory for the largest tile");
            return;
        }
        let photo = grain(64, 64, 1).picture();
        let error = refusal(&photo, None, &draft(32_768, 32_768));
        assert_eq!(error.kind(), ErrorKind::Memory, "{error}");
    }

    #[test]
    fn numbers_that_are_none() {
        let exemplar = grain(40, 40, 1);
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let mut v: Vec<f32> = exemplar.rgb.iter().flatten().map(|&v| v as f32).collect();
            v[(7 * 40 + 9) * 3 + 1] = bad;
            for encoding in [Encoding::Linear, Encoding::Data] {
                let photo = exemplar.with(3, Samples::F32(v.clone()), encoding);
                for method in METHODS {
                    let params = TileParams { method, ..draft(32, 32) };
                    let error = refusal(&photo, None, &params);
                    let right = matches!(error, Error::NotFinite { count: 1, y: 7, x: 9, .. });
                    assert!(right, "{bad} {method:?}: {error}");
                }
            }
        }
    }

    #[test]
    fn masks_that_leave_nothing_or_do_not_fit() {
        let photo = grain(40, 40, 1).picture();
        let mask = |h: usize, w: usize, usable: &dyn Fn(usize) -> bool| {
            Mask::new(h, w, (0..h * w).map(usable).collect()).expect("mask")
        };
        for method in COPYING {
            let params = TileParams { method, ..draft(32, 32) };
            let nothing = mask(40, 40, &|_| false);
            let lattice = mask(40, 40, &|i| !(i % 40).is_multiple_of(8));
            for mask in [nothing, lattice] {
                let error = refusal(&photo, Some(&mask), &params);
                assert_eq!(error.kind(), ErrorKind::EmptyMask, "{error}");
            }
            let error = refusal(&photo, Some(&mask(40, 41, &|_| true)), &params);
            assert_eq!(error.kind(), ErrorKind::SizeMismatch, "{error}");
        }
    }

    /// Extreme but finite floats: a tile or an error, no panic, no NaN.
    #[test]
    fn enormous_and_tiny_numbers() {
        let exemplar = grain(40, 40, 1);
        for scale in [1e-300, 1e-30, -1.0, 1e30, 1e300] {
            let v = exemplar.rgb.iter().flatten().map(|v| v * scale).collect();
            for encoding in [Encoding::Linear, Encoding::Data] {
                let photo = exemplar.with(3, Samples::F64(Vec::clone(&v)), encoding);
                let tile = made(&photo, None, &draft(32, 32));
                assert!(*tile.picture.samples() == gathered(&photo, &tile), "{scale}");
                let costs = tile.report.costs;
                assert!(costs.stationarity.is_finite(), "{scale} {encoding:?} {costs:?}");
            }
        }
    }
}

mod cancelled {
    use super::*;

    fn is_cancelled(result: &Result<Tile>) -> bool {
        matches!(result, Err(Error::Cancelled))
    }

    #[test]
    fn before_it_begins() {
        let photo = grain(64, 64, 1).picture();
        for method in COPYING {
            let ctx = ctx();
            ctx.job().cancel();
            let result = tile(&ctx, &photo, None, &TileParams { method, ..draft(48, 48) });
            assert!(is_cancelled(&result), "{method:?}");
        }
    }

    /// A run of minutes is cancelled as soon as it has begun, and ends without doing much more.
    #[test]
    fn from_another_thread() {
        let photo = grain(400, 400, 1).picture();
        let ctx = ctx();
        let job = ctx.job();
        let params = TileParams { quality: Quality::Best, ..draft(1024, 1024) };
        std::thread::scope(|scope| {
            let run = scope.spawn(|| tile(&ctx, &photo, None, &params));
            while job.fraction() == 0.0 && !run.is_finished() {
                std::thread::yield_now();
            }
            job.cancel();
            assert!(is_cancelled(&run.join().expect("no panic")), "not cancelled");
        });
        assert!(job.fraction() < 0.5, "went on to {}", job.fraction());
    }
}
