//! `wang`: tiles that fit, planes that are what their numbers say, and the command as a process.

use texforge::base::rng::Rng;
use texforge::{
    Ctx, Encoding, Error, ErrorKind, MapKind, Mask, PeriodSource, Picture, Samples, Scaling,
    TileSet, WangParams, WangSet, wang,
};

use crate::support::Folder;

/// Cloth that repeats every `ph` x `pw` pixels, with noise.
fn cloth((h, w): (usize, usize), (ph, pw): (usize, usize), noise: u32) -> Picture {
    let cell = |y: usize, x: usize| Rng::new(3, 0, 0, (y % ph * pw + x % pw) as u64).below(200);
    let mut rng = Rng::new(4, 0, 0, 0);
    let sample = |i: usize| (cell(i / w, i % w) + rng.below(noise + 1)) as u8;
    let samples = Samples::U8((0..h * w).map(sample).collect());
    Picture::new(h, w, 1, samples, Encoding::Srgb).expect("valid")
}

fn ctx(threads: usize) -> Ctx {
    Ctx::new(0, threads).expect("pool")
}

fn given(width: f64, height: f64) -> WangParams {
    WangParams { period: PeriodSource::Pixels { width, height }, ..Default::default() }
}

fn of(photo: &Picture, params: &WangParams) -> WangSet {
    wang(&ctx(2), photo, None, params).expect("a set")
}

const BOTH: [TileSet; 2] = [TileSet::Complete, TileSet::Minimal];

mod sets {
    use super::*;

    #[test]
    fn one_piece_of_the_photo_goes_on_across_every_edge() {
        for (set, period) in [(TileSet::Complete, (12, 15)), (TileSet::Minimal, (11, 14))] {
            let photo = cloth((120, 150), period, 50);
            let params = WangParams { set, ..given(period.1 as f64, period.0 as f64) };
            let made = of(&photo, &params);
            let (w, h) = made.report.tile_size;
            let map = made.source_map().expect("not scaled");
            let (rows, columns) = (9, 8);
            let layout = made.layout(5, (rows, columns));
            let stride = map.width();
            // Tiles laid at random, and around: where a pixel comes from.
            let from = |y: usize, x: usize| {
                let tile = usize::from(layout[y / h % rows * columns + x / w % columns]);
                let in_atlas = made.report.atlas.0;
                let (v, u) = (tile / in_atlas * h + y % h, tile % in_atlas * w + x % w);
                map.positions()[v * stride + u]
            };
            for i in 1..=rows {
                for x in 0..columns * w {
                    let ([y0, x0], [y1, x1]) = (from(i * h - 1, x), from(i * h, x));
                    assert_eq!([y0 + 1, x0], [y1, x1], "{set:?}, below row {i} at {x}");
                }
            }
            for j in 1..=columns {
                // At a corner four samples meet: it is theirs of the horizontal edges.
                for y in (0..rows * h).filter(|y| (1..h - 1).contains(&(y % h))) {
                    let ([y0, x0], [y1, x1]) = (from(y, j * w - 1), from(y, j * w));
                    assert_eq!([y0, x0 + 1], [y1, x1], "{set:?}, right of column {j} at {y}");
                }
            }
        }
    }

    #[test]
    fn a_photo_without_flaws_goes_on_without_flaws() {
        let period = (13, 16);
        let photo = cloth((130, 160), period, 0);
        for set in BOTH {
            let made = of(&photo, &WangParams { set, ..given(16.0, 13.0) });
            let plane = made.plane(&made.atlas, (300, 400), 8).expect("plane");
            let Samples::U8(v) = plane.samples() else { panic!("8 bits") };
            let at = |y: usize, x: usize| v[y * 400 + x];
            for (y, x) in (0..300 - 13).flat_map(|y| (0..400 - 16).map(move |x| (y, x))) {
                assert_eq!((at(y, x), at(y, x)), (at(y + 13, x), at(y, x + 16)), "{y}, {x}");
            }
        }
    }

    #[test]
    fn all_threads_make_the_same_bytes_and_a_seed_the_same_plane() {
        let photo = cloth((150, 170), (14, 17), 60);
        let params = WangParams { periods: 3, ..given(17.3, 14.4) };
        let one = wang(&ctx(1), &photo, None, &params).expect("a set");
        for threads in [2, 5] {
            let other = wang(&ctx(threads), &photo, None, &params).expect("a set");
            assert_eq!(one.atlas, other.atlas);
        }
        let plane = |size, seed| one.plane(&one.atlas, size, seed).expect("plane");
        assert_eq!(plane((200, 300), 4), plane((200, 300), 4));
        assert_ne!(plane((200, 300), 4), plane((200, 300), 5));
        // A tile's cell of the atlas is the tile.
        let layout = one.layout(4, one.cells((200, 300)).expect("cells"));
        let (w, h) = one.report.tile_size;
        let first = one.tile(&one.atlas, usize::from(layout[0])).expect("tile");
        assert_eq!(plane((h, w), 4).height(), first.height());
        assert_eq!(one.tile(&first, 0).expect_err("no atlas").kind(), ErrorKind::BadPicture);
    }

    #[test]
    fn a_pixel_that_is_masked_out_is_never_copied() {
        let mut photo = cloth((150, 170), (14, 17), 60);
        let Samples::U8(v) = photo.samples() else { panic!("8 bits") };
        let hidden = |i: usize| (60..80).contains(&(i / 170)) && (70..100).contains(&(i % 170));
        let samples = v.iter().enumerate().map(|(i, v)| if hidden(i) { 255 } else { *v }).collect();
        photo = photo.with_samples(150, 170, 1, Samples::U8(samples)).expect("photo");
        let mask = Mask::new(150, 170, (0..150 * 170).map(|i| !hidden(i)).collect()).expect("mask");
        let params = WangParams { scale: Scaling::Off, ..given(17.0, 14.0) };
        let made = wang(&ctx(2), &photo, Some(&mask), &params).expect("a set");
        let map = made.source_map().expect("not scaled");
        let copied = |&[y, x]: &[u32; 2]| hidden(y as usize * 170 + x as usize);
        assert!(!map.positions().iter().any(copied));
    }

    #[test]
    fn maps_follow_in_any_resolution() {
        let photo = cloth((120, 150), (12, 15), 50);
        for params in [given(15.0, 12.0), given(15.4, 12.3)] {
            let made = of(&photo, &params);
            assert_eq!(made.atlas_of(&photo, MapKind::Color).expect("atlas"), made.atlas);
            let (h, w) = (made.atlas.height(), made.atlas.width());
            for scale in [1, 2] {
                let px = [0.9_f32, 0.5, 0.9].repeat(120 * 150 * scale * scale);
                let size = (120 * scale, 150 * scale);
                let map = Picture::new(size.0, size.1, 3, Samples::F32(px), Encoding::Data);
                let atlas = made.atlas_of(&map.expect("map"), MapKind::Normal).expect("atlas");
                assert_eq!((atlas.height(), atlas.width()), (h, w));
                let plane = made.plane(&atlas, (70, 90), 1).expect("plane");
                let n = [0, 1, 2].map(|k| plane.samples().unit(k) * 2.0 - 1.0);
                let length = n.iter().map(|v| v * v).sum::<f64>().sqrt();
                assert!((length - 1.0).abs() < 1e-5, "{n:?}");
            }
            let wrong = cloth((120, 100), (12, 15), 50);
            let refused = made.atlas_of(&wrong, MapKind::Data);
            assert!(matches!(refused, Err(Error::SizeMismatch { .. })), "another shape");
        }
    }

    #[test]
    fn what_cannot_be_made_is_said_in_a_sentence() {
        let photo = cloth((60, 75), (12, 15), 50);
        let error = |params: &WangParams| {
            wang(&ctx(1), &photo, None, params).expect_err("refused").to_string()
        };
        let text = error(&WangParams { periods: 4, ..given(15.0, 12.0) });
        assert!(text.contains("no room for four usable pieces of 60x48 pixels"), "{text}");
        let text = error(&WangParams { overlap: 0.0, periods: 3, ..given(15.0, 12.0) });
        assert!(text.contains("no room"), "{text}");
        let text = error(&WangParams { periods: 1, ..given(6.0, 5.0) });
        assert!(text.contains("`periods` must be more"), "{text}");
        let text = error(&given(70.0, 12.0));
        assert!(text.contains("half the photo"), "{text}");
        let made = of(&photo, &WangParams { periods: 1, ..given(15.0, 12.0) });
        for size in [(0, 5), (70_000, 5)] {
            let refused = made.plane(&made.atlas, size, 0).expect_err("refused");
            assert_eq!(refused.kind(), ErrorKind::Parameter, "{size:?}");
        }
    }
}

mod program {
    use super::*;

    /// A folder with `cloth.png`, which repeats every 12 x 10 pixels.
    fn folder() -> Folder {
        let folder = Folder::new();
        folder.rgb_from("cloth.png", 120, 96, |x, y| {
            let v = Rng::new(1, 0, 0, u64::from(y % 10 * 12 + x % 12)).below(200) as u8;
            [v, v / 2 + (x * 7 + y * 13) as u8 % 9, 255 - v]
        });
        folder
    }

    fn count(folder: &Folder, below: &str) -> usize {
        std::fs::read_dir(folder.at(below)).expect("folder").count()
    }

    #[test]
    fn tiles_atlas_plane_and_index_agree() {
        let folder = folder();
        folder.grey16("bumps.png", 120, 96, 3);
        let args = ["wang", "cloth.png", "-o", "out", "--period", "12x10", "--seed", "7"];
        let more = ["--plane", "100x70", "--map", "height=bumps.png", "--json"];
        let output = folder.run(args.iter().chain(&more));
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
        assert_eq!(
            (&json["verb"], &json["tile_size"]),
            (&"wang".into(), &serde_json::json!([24, 20]))
        );
        assert_eq!(json["files"].as_array().map(Vec::len), Some(2 * 18 + 2));
        assert_eq!(count(&folder, "out"), 2 * 18 + 2);
        let text = std::fs::read_to_string(folder.at("out/wang.json")).expect("document");
        let document: serde_json::Value = serde_json::from_str(&text).expect("JSON");
        assert_eq!(document["made"]["seed"], 7);
        assert_eq!(document["tiles"].as_array().map(Vec::len), Some(16));
        assert_eq!(
            (&document["index"]["columns"], &document["index"]["rows"]),
            (&5.into(), &4.into())
        );
        let (atlas, plane) = (folder.png("out/atlas.png"), folder.png("out/plane.png"));
        let (index, tile) = (folder.png("out/index.png"), folder.png("out/tile_07.png"));
        assert_eq!((atlas.width, atlas.height, plane.width, plane.height), (96, 80, 100, 70));
        let pixel = |p: &[u8], w: usize, y: usize, x: usize| p[(y * w + x) * 3..][..3].to_vec();
        for (y, x) in (0..70).flat_map(|y| (0..100).map(move |x| (y, x))) {
            let at = pixel(&index.samples, 5, y / 20, x / 24);
            let (v, u) = (usize::from(at[1]) * 20 + y % 20, usize::from(at[0]) * 24 + x % 24);
            assert_eq!(pixel(&plane.samples, 100, y, x), pixel(&atlas.samples, 96, v, u));
        }
        for (y, x) in (0..20).flat_map(|y| (0..24).map(move |x| (y, x))) {
            // The seventh: second row, third column.
            assert_eq!(pixel(&tile.samples, 24, y, x), pixel(&atlas.samples, 96, 20 + y, 48 + x));
        }
    }

    #[test]
    fn nothing_is_overwritten_and_equal_runs_are_equal() {
        let folder = folder();
        let args = ["wang", "cloth.png", "-o", "out", "--period", "12x10", "--set", "minimal"];
        let said = folder.does(&args);
        assert!(said.contains("8 tiles of 24x20, a plane of 144x120 pixels"), "{said}");
        assert_eq!(count(&folder, "out"), 8 + 4);
        let before = std::fs::read(folder.at("out/plane.png")).expect("plane");
        folder.refuses(&args, 1, "exists already");
        for name in ["atlas.png", "plane.png", "index.png", "tile_01.png"] {
            std::fs::remove_file(folder.at(format!("out/{name}"))).expect("removed");
        }
        folder.refuses(&args, 1, "exists already");
        assert_eq!(count(&folder, "out"), 8);
        folder.does(&[&args[..], &["--force"]].concat());
        assert!(std::fs::read(folder.at("out/plane.png")).expect("plane") == before);
    }

    #[test]
    fn bad_input_is_refused() {
        let folder = folder();
        folder.rgb("noise.png", 96, 96, 1);
        let wang = |args: &[&'static str]| [&["wang"], args, &["-o", "out"]].concat();
        for (args, status, needle) in [
            (vec!["noise.png"], 1, "no clear period"),
            (vec!["cloth.png", "--period", "12x10", "--periods", "7"], 1, "no room"),
            (vec!["cloth.png", "--period", "12x10", "--plane", "0x5"], 2, "`plane`"),
            (vec!["cloth.png", "--period", "12x10", "--plane", "large"], 2, "`plane`"),
            (vec!["cloth.png", "--overlap", "2"], 2, "`overlap`"),
            (vec!["cloth.png", "--period", "3x3", "--periods", "1"], 2, "`periods`"),
        ] {
            folder.refuses(&wang(&args), status, needle);
            assert!(!folder.at("out").exists(), "{args:?}");
        }
        folder.refuses(&["wang", "cloth.png", "-o", "-"], 2, "a folder");
    }
}
