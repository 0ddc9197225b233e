//! The options of a tile beyond size and seed: each does what it says, and fails clearly.

use texforge::{
    Ctx, Encoding, Error, ErrorKind, Inputs, Mask, Method, Picture, Quality, Samples, Size, Tile,
    TileParams, tile, tiles,
};

use crate::support::Folder;
use crate::support::exemplar::{self, grain};

fn draft(width: usize, height: usize) -> TileParams {
    let size = Size::Pixels { width, height };
    TileParams { size, quality: Quality::Draft, ..Default::default() }
}

fn ctx() -> Ctx {
    Ctx::new(0, 2).expect("pool")
}

fn made(inputs: &Inputs<'_>, params: &TileParams) -> Tile {
    tiles(&ctx(), inputs, params, 1).expect("a tile").remove(0)
}

/// Positions of a tile that copies.
fn positions(tile: &Tile) -> &[[u32; 2]] {
    tile.source_map.as_ref().expect("a source map").positions()
}

/// `texforge tile photo.png -o tile.png`, quickly, and these.
fn quick<'a>(more: &[&'a str]) -> Vec<&'a str> {
    let mut args =
        vec!["tile", "photo.png", "-o", "tile.png", "--size", "48", "--quality", "draft"];
    args.extend(more);
    args
}

mod avoiding {
    use super::*;

    fn marks(side: usize, marked: impl Fn(usize, usize) -> bool) -> Mask {
        let marks = (0..side * side).map(|i| marked(i / side, i % side)).collect();
        Mask::new(side, side, marks).expect("marks")
    }

    #[test]
    fn nothing_near_a_mark_is_copied() {
        let photo = grain(80, 80, 1).picture();
        // A line and a dot; an earlier mark hides from the disc of a later one.
        let spots = marks(80, |y, x| (y == 30 && (20..50).contains(&x)) || (y, x) == (60, 9));
        let near = |&[y, x]: &[u32; 2]| {
            let to = |v: u32, u: u32| f64::from(y.abs_diff(v)).hypot(f64::from(x.abs_diff(u)));
            (20..50).map(|u| to(30, u)).fold(to(60, 9), f64::min)
        };
        let plain = made(&Inputs::new(&photo), &draft(64, 64));
        assert!(positions(&plain).iter().any(|p| near(p) <= 7.0), "the marks are in the way");
        for (avoid_grow, method) in [(0, Method::Stationary), (7, Method::WrapOnly)] {
            let params = TileParams { avoid_grow, method, ..draft(64, 64) };
            let inputs = Inputs { avoid: Some(&spots), ..Inputs::new(&photo) };
            let tile = made(&inputs, &params);
            assert!(positions(&tile).iter().all(|p| near(p) > avoid_grow as f64), "{avoid_grow}");
            // The same as the mask that says it in other words.
            let mask = spots.clear_of(avoid_grow);
            let params = TileParams { avoid_grow: 0, ..params };
            let same = made(&Inputs { mask: Some(&mask), ..Inputs::new(&photo) }, &params);
            assert!(positions(&tile) == positions(&same));
        }
    }

    #[test]
    fn both_masks_count() {
        let photo = grain(80, 80, 1).picture();
        let (left, top) = (marks(80, |_, x| x < 40), marks(80, |y, _| y < 40));
        let inputs = Inputs { mask: Some(&left), avoid: Some(&top), ..Inputs::new(&photo) };
        let tile = made(&inputs, &draft(48, 48));
        assert!(positions(&tile).iter().all(|&[y, x]| x < 40 && y >= 40));
    }

    #[test]
    fn what_leaves_nothing_or_does_not_fit() {
        let photo = grain(60, 60, 1).picture();
        let refusal = |avoid: Option<&Mask>, avoid_grow| {
            let inputs = Inputs { avoid, ..Inputs::new(&photo) };
            let params = TileParams { avoid_grow, ..draft(48, 48) };
            tiles(&ctx(), &inputs, &params, 1).expect_err("refused")
        };
        let dots = marks(60, |y, x| y % 20 == 10 && x % 20 == 10);
        assert!(tile(&ctx(), &photo, Some(&dots.clear_of(0)), &draft(48, 48)).is_ok());
        assert_eq!(refusal(Some(&dots), 12).kind(), ErrorKind::EmptyMask);
        assert_eq!(refusal(Some(&dots), 10_000).kind(), ErrorKind::EmptyMask);
        let error = refusal(Some(&marks(61, |_, _| false)), 0);
        assert_eq!(error.kind(), ErrorKind::SizeMismatch);
        assert!(error.to_string().starts_with("the avoid mask is 61x61"), "{error}");
        for (avoid, grow) in [(None, 3), (Some(&dots), 10_001)] {
            let error = refusal(avoid, grow);
            assert!(matches!(error, Error::Parameter { name: "avoid_grow", .. }), "{error}");
        }
    }

    #[test]
    fn the_program_takes_marks() {
        let folder = Folder::new();
        folder.rgb_from("photo.png", 96, 96, |x, y| {
            if x < 40 { [255, 0, 0] } else { [20, 100 + (x * y % 100) as u8, 100] }
        });
        folder.mask("left.png", 96, |x, _| x < 30);
        folder.does(&quick(&["--avoid", "left.png", "--avoid-grow", "10"]));
        let tile = folder.png("tile.png");
        assert!(tile.samples.chunks(3).all(|px| px[0] == 20), "an avoided pixel was used");
        folder.does(&quick(&["--avoid", "left.png", "--avoid-grow", "9", "--force"]));
        assert!(folder.png("tile.png") != tile, "one pixel less is another tile");
    }

    #[test]
    fn the_program_refuses_in_one_sentence() {
        let folder = Folder::with_photo();
        folder.mask("small.png", 50, |_, _| false);
        folder.mask("all.png", 96, |_, _| true);
        folder.mask("dot.png", 96, |x, y| (x, y) == (48, 48));
        folder.refuses(&quick(&["--avoid", "small.png"]), 1, "the avoid mask is 50x50");
        folder.refuses(&quick(&["--avoid", "all.png"]), 1, "the mask leaves no");
        let grown = ["--avoid", "dot.png", "--avoid-grow", "70"];
        folder.refuses(&quick(&grown), 1, "the mask leaves no");
        folder.refuses(&quick(&["--avoid-grow", "4"]), 2, "`avoid_grow` must be 0");
        folder.refuses(&quick(&["--avoid", "dot.png", "--avoid-grow", "-1"]), 2, "`avoid_grow`");
        folder.refuses(&quick(&["--avoid", "missing.png"]), 1, "missing.png");
        folder.refuses(
            &["tile", "photo.png", "--avoid", "dot.png", "-o", "dot.png"],
            1,
            "an input",
        );
    }
}

mod variants {
    use super::*;

    #[test]
    fn each_is_the_tile_of_its_seed_for_any_number_of_threads() {
        let photo = grain(70, 80, 1).picture();
        let params = TileParams { flatten: 0.3, ..draft(48, 40) };
        let run = |seed, threads, count| {
            let ctx = Ctx::new(seed, threads).expect("pool");
            tiles(&ctx, &Inputs::new(&photo), &params, count).expect("tiles")
        };
        let all = run(7, 2, 3);
        for (i, tile) in (0..).zip(&all) {
            let alone = &run(7 + i, 1, 1)[0];
            assert_eq!(tile.report.seed, 7 + i);
            assert!(tile.picture == alone.picture && tile.source_map == alone.source_map, "{i}");
            assert_eq!(tile.report.costs, alone.report.costs);
        }
        assert!(all[0].picture != all[1].picture && all[1].picture != all[2].picture);
        assert!(run(7, 5, 3).iter().zip(&all).all(|(a, b)| a.picture == b.picture), "5 threads");
    }

    #[test]
    fn counts_and_seeds_that_cannot_be() {
        let photo = grain(40, 40, 1).picture();
        let refusal = |seed, count, method| {
            let ctx = Ctx::new(seed, 1).expect("pool");
            let params = TileParams { method, ..draft(32, 32) };
            tiles(&ctx, &Inputs::new(&photo), &params, count).expect_err("refused")
        };
        let named = |error: &Error, wanted: &str| {
            assert!(matches!(error, Error::Parameter { name, .. } if *name == wanted), "{error}");
        };
        named(&refusal(0, 0, Method::Stationary), "variants");
        named(&refusal(0, 1001, Method::Stationary), "variants");
        named(&refusal(0, 2, Method::MakeSeamless), "variants");
        named(&refusal(u64::MAX - 1, 3, Method::Stationary), "seed");
    }

    #[test]
    fn the_program_numbers_every_output() {
        let folder = Folder::with_photo();
        folder.grey16("photo_height.png", 96, 96, 2);
        let more = ["--variants", "2", "--preview", "--save-source-map", "src.exr", "--seed", "4"];
        let output = folder.run(quick(&[&more[..], &["--json"]].concat()));
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{said}");
        for (line, seed) in [("tile-1.png  48x48, seed 4,", 4), ("tile-2.png  48x48, seed 5,", 5)] {
            assert!(said.contains(line), "{seed}: {said}");
        }
        let outputs = ["src-1.exr", "src-2.exr", "tile-1.png", "tile-1.preview.png"];
        let outputs = [&outputs[..], &["tile-1_height.png", "tile-2.png"]].concat();
        let outputs = [&outputs[..], &["tile-2.preview.png", "tile-2_height.png"]].concat();
        let inputs = ["photo.png", "photo_height.png"];
        assert_eq!(folder.names(), [&inputs[..], &outputs].concat());
        let v: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
        assert_eq!(v["files"].as_array().map(Vec::len), Some(outputs.len()));
        let listed = v["variants"].as_array().expect("a list");
        assert_eq!(listed[1]["seed"], 5);
        assert_eq!(listed[1]["tile"]["path"], "tile-2.png");
        assert_ne!(listed[0]["costs"], listed[1]["costs"]);
        assert_eq!((&v["seed"], &v["tile"]["path"]), (&4.into(), &"tile-1.png".into()));
        folder.does(&quick(&["--seed", "5", "--no-maps"]));
        assert!(folder.png("tile.png") == folder.png("tile-2.png"), "the tile of its seed");
    }

    #[test]
    fn the_program_writes_all_or_none() {
        let folder = Folder::with_photo();
        folder.rgb("tile-2.png", 8, 8, 1);
        folder.refuses(&quick(&["--variants", "2"]), 1, "tile-2.png exists already");
        let own = ["tile", "tile-2.png", "-o", "tile.png", "--variants", "3", "--force"];
        folder.refuses(&own, 1, "also an input");
        folder.refuses(&quick(&["--variants", "0"]), 2, "--variants");
        folder.refuses(&quick(&["--variants", "99999999999"]), 2, "--variants");
        let last = u64::MAX.to_string();
        let args = ["tile", "photo.png", "-o", "b.png", "--variants", "3", "--seed", &last];
        folder.refuses(&args, 2, "`seed`");
        let args = ["tile", "photo.png", "-o", "-", "--variants", "2"];
        folder.refuses(&args, 2, "standard output");
        let clash = ["tile", "photo.png", "-o", "a.png", "--variants", "2"];
        let clash = [&clash[..], &["--save-source-map", "a.png"]].concat();
        folder.refuses(&clash, 2, "twice");
    }
}

mod flattening {
    use super::*;

    /// Light over a picture of 96 x 128: a slope, warmer on the left.
    fn light(y: usize, x: usize) -> [f64; 3] {
        let (v, u) = (y as f64 / 96.0, x as f64 / 128.0);
        let slope = 0.35 + 0.4 * v + 0.4 * u;
        [slope * (1.2 - 0.4 * u), slope, slope * (0.8 + 0.4 * u)]
    }

    /// Linear light: grain under that light; its pixels and the picture.
    fn lit() -> (Vec<[f64; 3]>, Picture) {
        let grain = grain(96, 128, 3);
        let lit = |i: usize| {
            let light = light(i / 128, i % 128);
            std::array::from_fn(|k| grain.rgb[i][k] * light[k])
        };
        let pixels: Vec<[f64; 3]> = (0..96 * 128).map(lit).collect();
        let samples = pixels.iter().flatten().map(|&v| v as f32).collect();
        (pixels, grain.with(3, Samples::F32(samples), Encoding::Linear))
    }

    /// Mean of a channel over one of 4 x 4 blocks.
    fn block(pixels: &[f64], k: usize, by: usize, bx: usize) -> f64 {
        let rows = by * 24..(by + 1) * 24;
        let places = rows.flat_map(|y| (bx * 32..(bx + 1) * 32).map(move |x| y * 128 + x));
        places.map(|i| pixels[i * 3 + k]).sum::<f64>() / (24.0 * 32.0)
    }

    fn units(picture: &Picture) -> Vec<f64> {
        (0..picture.samples().len()).map(|i| picture.samples().unit(i)).collect()
    }

    /// Largest block mean over the smallest.
    fn unevenness(pixels: &[f64]) -> f64 {
        let of = |k: usize| {
            let means: Vec<f64> = (0..16).map(|b| block(pixels, k, b / 4, b % 4)).collect();
            means.iter().fold(0.0, |a: f64, &b| a.max(b))
                / means.iter().fold(9.0, |a: f64, &b| a.min(b))
        };
        (0..3).map(of).fold(0.0, f64::max)
    }

    #[test]
    fn a_known_slope_goes_and_detail_and_brightness_stay() {
        let (before, photo) = lit();
        let flat = texforge::method::flatten::run(&photo, None, 30.0).expect("flat");
        let after = units(&flat.picture);
        let before: Vec<f64> = before.into_iter().flatten().collect();
        assert!(unevenness(&before) > 2.5, "{}", unevenness(&before));
        let clean: Vec<f64> = grain(96, 128, 3).rgb.into_iter().flatten().collect();
        let (after_all, clean) = (unevenness(&after), unevenness(&clean));
        assert!(after_all < clean + 0.02, "{after_all}, the grain itself {clean}");
        let n = (96 * 128) as f64;
        for k in 0..3 {
            let mean = |v: &[f64]| v.iter().skip(k).step_by(3).sum::<f64>() / n;
            assert!((mean(&after) / mean(&before) - 1.0).abs() < 1e-5, "mean of channel {k}");
        }
        // The grain under the light, up to one factor: its steps from pixel to pixel.
        let grain = grain(96, 128, 3);
        for k in 0..3 {
            let ratio = |i: usize| (after[(i + 1) * 3 + k] / after[i * 3 + k]).ln();
            let want = |i: usize| (grain.rgb[i + 1][k] / grain.rgb[i][k]).ln();
            let off =
                (0..96 * 128 - 1).filter(|i| i % 128 != 127).map(|i| (ratio(i) - want(i)).abs());
            let worst = off.fold(0.0, f64::max);
            assert!(worst < 0.02, "detail of channel {k} is off by {worst}");
        }
    }

    #[test]
    fn what_is_masked_or_not_opaque_has_no_say() {
        let (_, photo) = lit();
        let hole = |i: usize| (30..60).contains(&(i / 128)) && (40..90).contains(&(i % 128));
        let mask = Mask::new(96, 128, (0..96 * 128).map(|i| !hole(i)).collect()).expect("mask");
        let Samples::F32(clean) = photo.samples() else { panic!("floats") };
        let dirty = |value: f32| {
            let v = clean.iter().enumerate().map(|(i, &v)| if hole(i / 3) { value } else { v });
            Samples::F32(v.collect())
        };
        let flat = |samples: Samples, mask: Option<&Mask>| {
            let photo = Picture::new(96, 128, 3, samples, Encoding::Linear).expect("photo");
            units(&texforge::method::flatten::run(&photo, mask, 30.0).expect("flat").picture)
        };
        let (bright, dark) = (flat(dirty(50.0), Some(&mask)), flat(dirty(0.0), Some(&mask)));
        let differ = |a: &[f64], b: &[f64]| (0..a.len()).any(|i| !hole(i / 3) && a[i] != b[i]);
        assert!(!differ(&bright, &dark), "the hole is seen");
        assert!(differ(&bright, &flat(dirty(50.0), None)), "and it would matter");
        assert!(unevenness(&dark[..]) > 0.0 && bright.iter().all(|v| v.is_finite()));
        // Through the verb, where alpha is the mask; alpha itself is not touched.
        let rgba = clean.chunks(3).enumerate().flat_map(|(i, px)| {
            let (scale, alpha) = if hole(i) { (90.0, 0.4) } else { (1.0, 1.0) };
            [px[0] * scale, px[1] * scale, px[2] * scale, alpha]
        });
        let rgba = Samples::F32(rgba.collect());
        let photo = Picture::new(96, 128, 4, rgba, Encoding::Linear).expect("photo");
        let params = TileParams { flatten: 30.0 / 96.0, ..draft(64, 48) };
        let tile = made(&Inputs::new(&photo), &params);
        for (i, &[y, x]) in positions(&tile).iter().enumerate() {
            let at = y as usize * 128 + x as usize;
            let px: [f64; 4] = std::array::from_fn(|k| tile.picture.samples().unit(i * 4 + k));
            assert_eq!(px[3], 1.0);
            let same = (0..3).all(|k| (px[k] - dark[at * 3 + k]).abs() < 1e-6);
            assert!(same, "{px:?} at {y}, {x}");
        }
    }

    #[test]
    fn every_sample_type_stays_and_full_scale_holds() {
        let (pixels, photo) = lit();
        let of = |samples, encoding| Picture::new(96, 128, 3, samples, encoding).expect("photo");
        let all = || pixels.iter().flatten();
        let deep = Samples::U16(all().map(|v| (v * 65_535.0) as u16).collect());
        let bytes = Samples::U8(all().map(|v| (v * 400.0).min(255.0) as u8).collect());
        let half = Samples::F16(all().map(|&v| half::f16::from_f64(v * 60_000.0)).collect());
        for (photo, clips) in [
            (of(deep, Encoding::Srgb), false),
            (of(bytes, Encoding::Srgb), true),
            (of(half, Encoding::Linear), false),
            (photo, false),
        ] {
            let flat = texforge::method::flatten::run(&photo, None, 30.0).expect("flat");
            assert_eq!(flat.picture.samples().dtype(), photo.samples().dtype());
            assert_eq!(flat.clipped > 0.0, clips, "{}", photo.samples().dtype());
            assert!(units(&flat.picture).iter().all(|v| v.is_finite()));
            assert!(flat.factors.0 < 0.8 && flat.factors.1 > 1.3, "{:?}", flat.factors);
        }
    }

    #[test]
    fn a_flat_photo_stays_and_off_is_off() {
        let gray = Picture::new(40, 40, 1, Samples::U8(vec![77; 1600]), Encoding::Srgb);
        let gray = gray.expect("gray");
        let flat = texforge::method::flatten::run(&gray, None, 8.0).expect("flat");
        assert_eq!(flat.picture.samples(), gray.samples());
        let black = Picture::new(40, 40, 1, Samples::U8(vec![0; 1600]), Encoding::Srgb);
        let black = black.expect("black");
        let flat = texforge::method::flatten::run(&black, None, 8.0).expect("flat");
        assert_eq!(flat.picture.samples(), black.samples());
        let (_, photo) = lit();
        let plain = tile(&ctx(), &photo, None, &draft(48, 48)).expect("a tile");
        assert!(plain.report.notes.is_empty(), "{:?}", plain.report.notes);
    }

    #[test]
    fn the_program_flattens_the_photo_and_no_map() {
        let folder = Folder::new();
        let grain = grain(96, 96, 5);
        folder.rgb_from("photo.png", 96, 96, |x, y| {
            let light = 0.3 + 0.7 * f64::from(x) / 96.0;
            grain.rgb[(y * 96 + x) as usize].map(|v| (v * light * 255.0) as u8)
        });
        // The photo itself as a map: it shows what was there before.
        std::fs::copy(folder.at("photo.png"), folder.at("copy.png")).expect("copy");
        let more = ["--flatten", "0.3", "--map", "emission=copy.png", "--save-source-map", "s.exr"];
        let said = folder.does(&quick(&more));
        assert!(said.contains("note: light flattened over 29 pixels"), "{said}");
        assert!(folder.png("tile.png") != folder.png("tile_emission.png"));
        let args = ["apply", "s.exr", "copy.png", "-o", "late.png", "--kind", "color"];
        folder.does(&args);
        assert!(folder.png("late.png") == folder.png("tile_emission.png"), "maps are as they were");
        folder.refuses(
            &quick(&["--force", "--flatten", "0.001"]),
            2,
            "`flatten` must be 0 (off) or",
        );
        folder.refuses(&quick(&["--force", "--flatten", "2"]), 2, "`flatten`");
        folder.refuses(&quick(&["--force", "--flatten", "nan"]), 2, "`flatten`");
    }
}

mod the_dial {
    use super::*;
    use texforge::palette;

    /// Noise with a dark stain in the middle.
    fn stained() -> Picture {
        let (mut photo, noise) = (Vec::new(), grain(96, 96, 4).picture());
        let Samples::U8(noise) = noise.samples() else { panic!("8 bits") };
        let channels = noise.len() / (96 * 96);
        for (i, &v) in noise.iter().enumerate() {
            let (y, x) = (i / channels / 96, i / channels % 96);
            let dark = (30..60).contains(&y) && (20..55).contains(&x);
            photo.push(if dark { v / 3 } else { v });
        }
        Picture::new(96, 96, channels, Samples::U8(photo), Encoding::Srgb).expect("photo")
    }

    #[test]
    fn a_place_on_the_dial_is_a_step_of_the_palette_at_any_thread_count() {
        let photo = stained();
        let inputs = Inputs::new(&photo);
        let params = draft(48, 40);
        let steps = palette(&ctx(), &inputs, &params, 3).expect("a palette");
        let sigmas: Vec<f32> = steps.tiles.iter().map(|tile| tile.report.sigma).collect();
        assert_eq!((sigmas[0], sigmas[2]), (0.5, 0.02));
        assert!(sigmas[1] < 0.5 && sigmas[1] > 0.02, "{sigmas:?}");
        for threads in [1, 2, 5] {
            let ctx = Ctx::new(0, threads).expect("pool");
            let params = TileParams { stationarity: Some(0.5), ..params.clone() };
            let tile = tiles(&ctx, &inputs, &params, 1).expect("a tile").remove(0);
            assert!(tile.picture.samples() == steps.tiles[1].picture.samples(), "{threads}");
            assert_eq!(tile.report.stationarity, Some(0.5));
        }
        let sheet = steps.picture().expect("a sheet");
        assert!(sheet.width() > 3 * 2 * 48 && sheet.height() > 2 * 40);
    }

    #[test]
    fn it_depends_on_the_photo() {
        let sigmas = |photo: &Picture| {
            let all = palette(&ctx(), &Inputs::new(photo), &draft(48, 48), 5).expect("a palette");
            all.tiles.iter().map(|tile| tile.report.sigma).collect::<Vec<_>>()
        };
        let stained = exemplar::stained(96, 96, 1).picture();
        let (stained, clean) = (sigmas(&stained), sigmas(&grain(96, 96, 4).picture()));
        assert_eq!((stained[0], stained[4]), (clean[0], clean[4]));
        let apart = |i: usize| (stained[i] / clean[i]).max(clean[i] / stained[i]) > 1.2;
        assert!((1..4).any(apart), "{stained:?} and {clean:?}");
    }

    #[test]
    fn the_command_writes_every_step_and_all_in_one() {
        let folder = Folder::with_photo();
        let command = ["palette", "photo.png", "-o", "wall.png", "--size", "48"];
        let command = [&command[..], &["--steps", "2", "--quality", "draft"]].concat();
        let said = folder.does(&command);
        assert!(said.contains("stationarity 0.00, sigma 0.5"), "{said}");
        assert!(said.contains("stationarity 1.00, sigma 0.02"), "{said}");
        let names = ["photo.png", "wall-1.png", "wall-2.png", "wall.palette.png"];
        assert_eq!(folder.names(), names);
        // The second is what its place on the dial makes.
        let tile = ["--stationarity", "1", "--size", "48", "--quality", "draft"];
        folder.does(&[&["tile", "photo.png", "-o", "again.png"][..], &tile].concat());
        assert_eq!(folder.png("again.png").samples, folder.png("wall-2.png").samples);
        // Nothing is overwritten, and a refusal leaves nothing.
        let again = folder.run(&command);
        assert_eq!(again.status.code(), Some(1));
        let json = folder.run([&command[..], &["--force", "--json", "-q"]].concat());
        let json: serde_json::Value = serde_json::from_slice(&json.stdout).expect("JSON");
        assert_eq!(json["steps"][1]["sigma"].to_string(), "0.02");
        assert_eq!(json["differences"].as_array().expect("a list").len(), 1);
    }

    #[test]
    fn what_would_turn_nothing_is_refused() {
        let photo = stained();
        let refused = |inputs: &Inputs<'_>, params: &TileParams| {
            let error = tiles(&ctx(), inputs, params, 1).expect_err("refused");
            assert!(matches!(error, Error::Parameter { name: "stationarity", .. }), "{error}");
            error.to_string()
        };
        let params = TileParams { stationarity: Some(0.5), ..draft(48, 48) };
        let inputs = Inputs::new(&photo);
        let both = TileParams { sigma: 0.2, ..params.clone() };
        assert!(refused(&inputs, &both).contains("with `sigma`"));
        for stationarity in [-0.1, 1.1, f32::NAN] {
            let params = TileParams { stationarity: Some(stationarity), ..params.clone() };
            assert!(refused(&inputs, &params).contains("0 to 1"));
        }
        for method in [Method::WrapOnly, Method::NoWrap, Method::MakeSeamless] {
            refused(&inputs, &TileParams { method, ..params.clone() });
        }
        let error = palette(&ctx(), &inputs, &draft(48, 48), 1).expect_err("one step");
        assert!(matches!(error, Error::Parameter { name: "steps", .. }), "{error}");
        let error = palette(&ctx(), &inputs, &TileParams { sigma: 0.2, ..draft(48, 48) }, 3);
        let error = error.expect_err("sigma");
        assert!(matches!(error, Error::Parameter { name: "sigma", .. }), "{error}");
    }
}
