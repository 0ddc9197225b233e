//! `extract` on pictures whose period is known, on pictures that have none, and as a process.

use proptest::prelude::*;
use texforge::base::rng::Rng;
use texforge::{
    Ctx, Encoding, Error, ErrorKind, ExtractParams, Extraction, MapKind, Mask, PeriodSource,
    Picture, Samples, Scaling, Similarity, extract,
};

use crate::support::Folder;

/// A smooth random pattern that repeats by `sides`: a few waves of random phases, in 0..=1.
fn pattern([[ax, ay], [bx, by]]: [[f64; 2]; 2], seed: u64) -> impl Fn(f64, f64) -> f64 {
    let mut rng = Rng::new(seed, 0, 0, 0);
    let mut waves = Vec::new();
    for i in -3..=3_i32 {
        for j in 0..=3_i32 {
            let phase = f64::from(rng.next_u32()) / f64::from(u32::MAX);
            waves.push((f64::from(i), f64::from(j), 1.0 / f64::from(1 + i * i + j * j), phase));
        }
    }
    let det = ax * by - ay * bx;
    move |y, x| {
        let (u, v) = ((x * by - y * bx) / det, (y * ax - x * ay) / det);
        let wave = |&(i, j, s, p): &(f64, f64, f64, f64)| {
            s * ((i * u + j * v + p) * std::f64::consts::TAU).cos()
        };
        0.5 + 0.15 * waves.iter().map(wave).sum::<f64>()
    }
}

/// A grey picture of what `value` says, with noise.
fn grey((h, w): (usize, usize), noise: f64, value: impl Fn(f64, f64) -> f64) -> Picture {
    let mut rng = Rng::new(99, 0, 0, 0);
    let sample = |i: usize| {
        let grain = noise * (f64::from(rng.below(1001)) / 1000.0 - 0.5);
        let v = value((i / w) as f64, (i % w) as f64) + grain;
        (v * 255.0).clamp(0.0, 255.0) as u8
    };
    let samples = Samples::U8((0..h * w).map(sample).collect());
    Picture::new(h, w, 1, samples, Encoding::Srgb).expect("valid")
}

fn ctx(threads: usize) -> Ctx {
    Ctx::new(0, threads).expect("pool")
}

fn of(photo: &Picture, params: &ExtractParams) -> Extraction {
    extract(&ctx(2), photo, None, params).expect("tiles")
}

fn by(period: PeriodSource) -> ExtractParams {
    ExtractParams { period, ..Default::default() }
}

fn given(width: f64, height: f64) -> ExtractParams {
    by(PeriodSource::Pixels { width, height })
}

fn noise(h: usize, w: usize, seed: u64) -> Picture {
    let mut rng = Rng::new(seed, 5, 0, 0);
    let samples = Samples::U8((0..h * w).map(|_| rng.below(256) as u8).collect());
    Picture::new(h, w, 1, samples, Encoding::Data).expect("valid")
}

fn kind(photo: &Picture, params: &ExtractParams) -> ErrorKind {
    match extract(&ctx(1), photo, None, params) {
        Ok(found) => panic!("not refused: {:?}", found.report),
        Err(error) => error.kind(),
    }
}

mod periods {
    use super::*;

    #[test]
    fn a_known_period_comes_out_under_noise() {
        for (i, (w, h)) in [(37.3, 29.6), (51.0, 44.0), (23.7, 61.2)].into_iter().enumerate() {
            let value = pattern([[w, 0.0], [0.0, h]], i as u64);
            let photo = grey((260, 300), 0.5, value);
            for period in [PeriodSource::Ssd, PeriodSource::Lattice, PeriodSource::Auto] {
                let found = of(&photo, &by(period)).report.period;
                let [a, b] = found.sides;
                let off = (a[0] - w).abs().max((b[1] - h).abs());
                assert!(off < 0.15, "{w}x{h} by {period:?}: {found:?}");
                assert!(a[1].abs().max(b[0].abs()) < 0.3, "{w}x{h} by {period:?}: {found:?}");
            }
        }
    }

    #[test]
    fn an_oblique_lattice_becomes_its_smallest_rectangle() {
        // Running bond: the rows are shifted by half.
        let value = pattern([[48.0, 0.0], [24.0, 20.0]], 7);
        let found = of(&grey((240, 300), 0.3, value), &by(PeriodSource::Auto)).report;
        let [a, b] = found.period.sides;
        assert!((a[0] - 48.0).abs() < 0.2 && (b[1] - 40.0).abs() < 0.2, "{found:?}");
        assert_eq!(found.tile_size, (48, 40));
    }

    #[test]
    fn a_leaning_photo_is_put_upright() {
        let (sin, cos) = 0.03_f64.sin_cos();
        let value = pattern([[40.0 * cos, 40.0 * sin], [-34.0 * sin, 34.0 * cos]], 3);
        let photo = grey((250, 280), 0.1, &value);
        let leaning =
            of(&photo, &ExtractParams { scale: Scaling::Off, ..by(PeriodSource::Lattice) });
        let upright = of(&photo, &by(PeriodSource::Lattice));
        assert_eq!(upright.report.tile_size, (40, 34));
        assert!(upright.report.notes.iter().any(|n| n.contains("put upright")));
        let [before, after] = [&leaning, &upright].map(|found| found.tiles[0].place.resemblance);
        assert!(after < 0.3 * before, "unlike by {before} leaning, by {after} upright");
        // The tile lies where it is said to lie.
        let [x, y] = upright.tiles[0].photo_place;
        let Samples::U8(tile) = upright.tiles[0].picture.samples() else { panic!("8 bits") };
        let (dx, dy) = (20.5, 17.5);
        let at = value(y + dx * sin + dy * cos - 0.5, x + dx * cos - dy * sin - 0.5);
        let got = f64::from(tile[17 * 40 + 20]) / 255.0;
        assert!((got - at).abs() < 0.06, "{got}, not {at}");
    }

    #[test]
    fn a_missing_period_does_not_hide_the_others() {
        let value = pattern([[30.0, 0.0], [0.0, 26.0]], 5);
        // A plaster over one column of cells.
        let photo =
            grey(
                (260, 330),
                0.2,
                |y, x| {
                    if (90.0..120.0).contains(&x) { 0.5 } else { value(y, x) }
                },
            );
        let [a, b] = of(&photo, &by(PeriodSource::Ssd)).report.period.sides;
        assert!((a[0] - 30.0).abs() < 0.2 && (b[1] - 26.0).abs() < 0.2, "{a:?} {b:?}");
    }

    #[test]
    fn a_strong_harmonic_is_not_the_period() {
        // Every second stripe is narrower: the first minimum is that of the half period.
        let photo = grey((200, 320), 0.2, |y, x| {
            let width = if ((x / 20.0) as usize).is_multiple_of(2) { 0.5 } else { 0.2 };
            let stripe = if (x / 20.0).fract() < width { 0.4 } else { 0.0 };
            let row = if (y / 25.0).fract() < 0.3 { 0.3 } else { 0.0 };
            0.5 + stripe - row
        });
        let [a, b] = of(&photo, &by(PeriodSource::Ssd)).report.period.sides;
        assert!((a[0] - 40.0).abs() < 0.3 && (b[1] - 25.0).abs() < 0.3, "{a:?} {b:?}");
    }

    #[test]
    fn what_does_not_repeat_is_refused() {
        for seed in 0..4 {
            for period in [PeriodSource::Auto, PeriodSource::Ssd, PeriodSource::Lattice] {
                let photo = noise(120, 150, seed);
                assert_eq!(kind(&photo, &by(period)), ErrorKind::NoStructure, "{seed} {period:?}");
            }
        }
        // Rows repeat, columns do not.
        let photo = grey((120, 150), 0.0, |y, x| (y / 20.0).fract() * 0.5 + x * 0.003);
        assert_eq!(kind(&photo, &by(PeriodSource::Ssd)), ErrorKind::NoStructure);
    }
}

mod tiles {
    use super::*;

    /// The mean difference to this power of two pictures of grey data, full scale 100.
    fn apart(a: &Picture, b: &Picture, power: i32, usable: impl Fn(usize) -> bool) -> f64 {
        let (a, b) = (a.samples(), b.samples());
        let all: Vec<usize> = (0..a.len()).filter(|&i| usable(i)).collect();
        let one = |&i: &usize| (100.0 * (a.unit(i) - b.unit(i))).abs().powi(power);
        all.iter().map(one).sum::<f64>() / all.len() as f64
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]
        #[test]
        fn costs_are_those_of_the_tiling_that_is_delivered(
            (h, w) in (17..40_usize, 17..40_usize),
            (ph, pw) in (2.0..8.0_f64, 2.0..8.0_f64),
            (whole, robust) in (any::<bool>(), any::<bool>()),
            masked in 0..4_u32,
            seed: u64,
        ) {
            let (ph, pw) = if whole { (ph.floor(), pw.floor()) } else { (ph, pw) };
            let photo = noise(h, w, seed);
            let mut rng = Rng::new(seed, 6, 0, 0);
            let flags: Vec<bool> = (0..h * w).map(|_| rng.below(200) >= masked).collect();
            let mask = Mask::new(h, w, flags.clone()).expect("mask");
            let (similarity, power) =
                if robust { (Similarity::Absolute, 1) } else { (Similarity::Squared, 2) };
            let params = ExtractParams { count: 3, scale: Scaling::Off, similarity, ..given(pw, ph) };
            let Ok(found) = extract(&ctx(2), &photo, Some(&mask), &params) else {
                return Ok(());
            };
            let (tw, th) = found.report.tile_size;
            for (i, tile) in found.tiles.iter().enumerate() {
                let tiling = found.tiling(i).expect("tiling");
                let want = apart(&photo, &tiling, power, |i| flags[i]);
                let got = tile.place.resemblance;
                prop_assert!((got - want).abs() < 0.01 * want.max(1.0), "{} for {}", got, want);
                let at = |y: usize, x: usize| 100.0 * tile.picture.samples().unit(y * tw + x);
                let across: f64 = (0..th).map(|y| (at(y, tw - 1) - at(y, 0)).abs().powi(power)).sum();
                let down: f64 =
                    (0..tw).map(|x| (at(th - 1, x) - at(0, x)).abs().powi(power)).sum();
                let want = (across + down) / (2 * (tw + th - 1)) as f64;
                let got = tile.place.continuity;
                prop_assert!((got - want).abs() < 0.01 * want.max(1.0), "{} for {}", got, want);
                // The tile is where it is said to be, and holds nothing unusable.
                for y in 0..th {
                    for x in 0..tw {
                        let from = (tile.place.y + y) * w + tile.place.x + x;
                        prop_assert!(flags[from]);
                        prop_assert_eq!(at(y, x), 100.0 * photo.samples().unit(from));
                    }
                }
            }
        }
    }

    #[test]
    fn a_scaled_photo_repeats_by_whole_pixels() {
        let (w, h) = (31.62, 27.45);
        let photo = grey((240, 300), 0.0, pattern([[w, 0.0], [0.0, h]], 2));
        let scaled = of(&photo, &given(w, h));
        let rounded = of(&photo, &ExtractParams { scale: Scaling::Off, ..given(w, h) });
        assert_eq!(scaled.report.tile_size, (31, 27));
        assert!((scaled.report.scale.0 - 31.0 / w).abs() < 1e-9);
        assert_eq!(rounded.report.scale, (1.0, 1.0));
        assert!(scaled.source_map(0).is_none() && rounded.source_map(0).is_some());
        let [good, bad] = [&scaled, &rounded].map(|found| found.tiles[0].place.resemblance);
        assert!(good < 0.5 && good < 0.1 * bad, "unlike by {good} scaled, by {bad} rounded");
    }

    #[test]
    fn a_whole_period_leaves_the_photo_alone() {
        let photo = grey((100, 120), 0.2, pattern([[20.0, 0.0], [0.0, 25.0]], 2));
        let found = of(&photo, &given(20.0, 25.0));
        let map = found.source_map(0).expect("not scaled");
        assert_eq!(map.apply(&photo, MapKind::Color).expect("tile"), found.tiles[0].picture);
        let two = of(&photo, &ExtractParams { periods: 2, ..given(20.0, 25.0) });
        assert_eq!(two.report.tile_size, (40, 50));
    }

    #[test]
    fn all_threads_make_the_same_bytes() {
        let photo = grey((150, 170), 0.4, pattern([[28.3, 0.7], [-0.5, 24.6]], 8));
        let params = ExtractParams { band: 6, ..by(PeriodSource::Auto) };
        let one = extract(&ctx(1), &photo, None, &params).expect("tiles");
        for threads in [2, 5] {
            let other = extract(&ctx(threads), &photo, None, &params).expect("tiles");
            assert_eq!(one.tiles.len(), other.tiles.len());
            for (a, b) in one.tiles.iter().zip(&other.tiles) {
                assert_eq!(
                    (&a.picture, a.place, a.photo_place),
                    (&b.picture, b.place, b.photo_place)
                );
            }
            assert_eq!(one.report.period, other.report.period);
            assert_eq!(one.report.alpha.to_bits(), other.report.alpha.to_bits());
        }
    }

    #[test]
    fn weights_choose_between_edges_and_likeness() {
        let photo = grey((150, 170), 1.0, pattern([[28.0, 0.0], [0.0, 24.0]], 8));
        let with = |alpha, beta, keep| {
            let params = ExtractParams { alpha, beta, keep, count: 1, ..given(28.0, 24.0) };
            of(&photo, &params).tiles[0].place
        };
        let (smooth, like) = (with(Some(1.0), 0.0, 1.0), with(Some(0.0), 1.0, 1.0));
        let both = with(None, 1.0, 1.0);
        assert!(smooth.continuity < both.continuity && both.continuity < like.continuity);
        assert!(like.resemblance < both.resemblance && both.resemblance < smooth.resemblance);
        // The paper's p: hardly any position is left but the smoothest.
        assert_eq!(with(Some(0.0), 1.0, 1e-6).continuity, smooth.continuity);
    }

    #[test]
    fn a_stain_misleads_squares_and_not_absolute_differences() {
        // 6 x 6 cells, weathered differently; something dark over nine of them.
        let value = pattern([[30.0, 0.0], [0.0, 26.0]], 4);
        let mut rng = Rng::new(7, 0, 0, 0);
        let weather: Vec<f64> = (0..36).map(|_| f64::from(rng.below(201)) / 1000.0 - 0.1).collect();
        let photo = |stained: bool| {
            grey((156, 180), 0.05, |y, x| {
                let (i, j) = ((y / 26.0) as usize, (x / 30.0) as usize);
                let stain = if stained && i >= 3 && j >= 3 { -0.4 } else { 0.0 };
                0.3 + 0.6 * value(y, x) + weather[i * 6 + j] + stain
            })
        };
        let brightness = |stained, similarity| {
            let params = ExtractParams { similarity, count: 1, ..given(30.0, 26.0) };
            let tile = of(&photo(stained), &params).tiles.remove(0).picture;
            let n = tile.samples().len();
            (0..n).map(|i| tile.samples().unit(i)).sum::<f64>() / n as f64
        };
        let darker =
            |similarity| (brightness(false, similarity) - brightness(true, similarity)).abs();
        let (squared, absolute) = (darker(Similarity::Squared), darker(Similarity::Absolute));
        assert!(squared > 0.03 && absolute < 0.2 * squared, "by {squared} and {absolute}");
    }

    #[test]
    fn a_band_closes_the_seam() {
        // Light that slopes: the tile's edges cannot fit.
        let value = pattern([[36.0, 0.0], [0.0, 32.0]], 4);
        let photo = grey((160, 180), 0.1, |y, x| 0.6 * value(y, x) + 0.002 * (x + y));
        let step = |found: &Extraction| {
            let tile = &found.tiles[0].picture;
            let at = |y: usize, x: usize| tile.samples().unit(y * 36 + x);
            (0..32).map(|y| (at(y, 35) - at(y, 0)).abs()).sum::<f64>()
        };
        let params = |band| ExtractParams { band, count: 1, ..given(36.0, 32.0) };
        let (plain, banded) = (of(&photo, &params(0)), of(&photo, &params(8)));
        // What a band holds is drawn: a single one says little.
        let steps = (0..12).map(|seed| {
            let ctx = Ctx::new(seed, 2).expect("pool");
            step(&extract(&ctx, &photo, None, &params(8)).expect("tiles"))
        });
        let (before, after) = (step(&plain), steps.sum::<f64>() / 12.0);
        assert!(after < 0.75 * before, "steps of {before} before, of {after} after");
        let middle = |found: &Extraction| {
            let Samples::U8(v) = found.tiles[0].picture.samples().clone() else { panic!("8 bits") };
            (8..24).flat_map(|y| v[y * 36 + 8..y * 36 + 28].to_vec()).collect::<Vec<u8>>()
        };
        assert_eq!(middle(&plain), middle(&banded));
    }

    #[test]
    fn a_band_is_in_phase_wherever_the_tile_lies() {
        // A chequerboard whose best tile lies anywhere but at whole periods.
        let photo = grey((170, 190), 0.1, |y, x| {
            let dark = ((x + 13.0) / 20.0) as usize % 2 == ((y + 7.0) / 20.0) as usize % 2;
            0.5 + if dark { -0.25 } else { 0.25 }
        });
        let params = ExtractParams { band: 8, count: 3, ..given(40.0, 40.0) };
        let found = of(&photo, &params);
        assert!(found.tiles.iter().any(|t| t.place.y % 40 > 5 || t.place.x % 40 > 5), "no test");
        for (i, tile) in found.tiles.iter().enumerate() {
            let unlike = apart_as_seen(&photo, &found.tiling(i).expect("tiling"));
            assert!(unlike < 0.01, "tile {i} at {:?}: {unlike}", tile.place);
        }
    }

    /// The mean squared difference of two grey pictures, full scale 1.
    fn apart_as_seen(a: &Picture, b: &Picture) -> f64 {
        let n = a.samples().len();
        (0..n).map(|i| (a.samples().unit(i) - b.samples().unit(i)).powi(2)).sum::<f64>() / n as f64
    }

    #[test]
    fn maps_of_any_resolution_follow_and_normals_stay_normals() {
        let photo = grey((120, 140), 0.2, pattern([[30.4, 0.0], [0.0, 24.7]], 6));
        let found = of(&photo, &given(30.4, 24.7));
        let flat = |h: usize, w: usize| {
            let px = [0.9_f32, 0.5, 0.9];
            let samples = Samples::F32(px.repeat(h * w));
            Picture::new(h, w, 3, samples, Encoding::Data).expect("map")
        };
        for (h, w) in [(120, 140), (240, 280), (60, 70)] {
            let map = &found.tiles_of(&flat(h, w), MapKind::Normal).expect("tiles")[0];
            assert_eq!((map.height(), map.width()), (24, 30));
            let n = [0, 1, 2].map(|k| map.samples().unit(k) * 2.0 - 1.0);
            let length = n.iter().map(|v| v * v).sum::<f64>().sqrt();
            assert!((length - 1.0).abs() < 1e-5, "{n:?}");
        }
        let wrong = flat(120, 100);
        let refused = found.tiles_of(&wrong, MapKind::Data);
        assert!(matches!(refused, Err(Error::SizeMismatch { .. })), "another shape");
    }
}

mod refusals {
    use super::*;

    #[test]
    fn senseless_photos_and_periods_are_refused() {
        let fine = grey((100, 120), 0.2, pattern([[20.0, 0.0], [0.0, 25.0]], 2));
        let none = by(PeriodSource::Auto);
        let flat = Picture::new(64, 64, 1, Samples::U8(vec![9; 4096]), Encoding::Srgb);
        assert_eq!(kind(&flat.expect("flat"), &none), ErrorKind::BadPicture);
        assert_eq!(kind(&noise(15, 100, 0), &none), ErrorKind::TooSmall);
        let mut samples = vec![0.5_f32; 4096];
        samples[77] = f32::NAN;
        let holed = Picture::new(64, 64, 1, Samples::F32(samples), Encoding::Linear);
        assert_eq!(kind(&holed.expect("holed"), &none), ErrorKind::NotFinite);
        let parameter = |params: &ExtractParams| {
            assert_eq!(kind(&fine, params), ErrorKind::Parameter, "{params:?}");
        };
        for (w, h) in [(61.0, 25.0), (20.0, 50.1), (0.0, 25.0), (f64::NAN, 25.0), (1.0, 1.0)] {
            parameter(&given(w, h));
        }
        parameter(&ExtractParams { periods: 5, ..given(20.0, 25.0) });
        parameter(&ExtractParams { band: 12, ..given(20.0, 25.0) });
        parameter(&ExtractParams { band: 3, ..given(20.0, 25.0) });
        parameter(&ExtractParams { alpha: Some(f32::NAN), ..given(20.0, 25.0) });
        parameter(&ExtractParams { flatten: 0.01, ..given(20.0, 25.0) });
        let nothing = Mask::new(100, 120, vec![false; 12000]).expect("mask");
        let error =
            extract(&ctx(1), &fine, Some(&nothing), &given(20.0, 25.0)).expect_err("masked");
        assert!(error.to_string().contains("no piece of 20x25"), "{error}");
    }
}

mod program {
    use super::*;

    /// A folder with `cloth.png`, which repeats every 24 x 16 pixels.
    fn folder() -> Folder {
        let folder = Folder::new();
        let value = pattern([[24.0, 0.0], [0.0, 16.0]], 1);
        folder.rgb_from("cloth.png", 120, 96, |x, y| {
            let v = (value(f64::from(y), f64::from(x)) * 255.0).clamp(0.0, 255.0) as u8;
            [v, v / 2 + (x * 7 + y * 13) as u8 % 9, 255 - v]
        });
        folder
    }

    fn names(folder: &Folder, below: &str) -> Vec<String> {
        let entries = std::fs::read_dir(folder.at(below)).expect("folder");
        let name = |e: std::io::Result<std::fs::DirEntry>| e.expect("entry").file_name();
        let mut names: Vec<String> =
            entries.map(|e| name(e).to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    #[test]
    fn a_folder_of_tiles_tilings_and_maps_is_written() {
        let folder = folder();
        folder.grey16("bumps.png", 120, 96, 3);
        let args = ["extract", "cloth.png", "-o", "out", "--count", "2", "--period", "24x16"];
        let more = ["--map", "height=bumps.png", "--save-source-maps", "--json"];
        let output = folder.run(args.iter().chain(&more));
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let want = [
            "sheet.png",
            "tile_01.png",
            "tile_01_height.png",
            "tile_01_source.exr",
            "tile_02.png",
            "tile_02_height.png",
            "tile_02_source.exr",
            "tiling_01.png",
            "tiling_02.png",
        ];
        assert_eq!(names(&folder, "out"), want);
        let json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
        assert_eq!((&json["verb"], &json["schema_version"]), (&"extract".into(), &1.into()));
        assert_eq!(json["params"]["period"], "24x16");
        assert_eq!(json["tile_size"], serde_json::json!([24, 16]));
        let at = |k: &str| json["tiles"][0][k].as_u64().expect("a place") as usize;
        let (photo, tile) = (folder.png("cloth.png"), folder.png("out/tile_01.png"));
        let map = folder.png("out/tile_01_height.png");
        assert_eq!((tile.width, tile.height, map.width, map.deep), (24, 16, 24, true));
        for y in 0..16 {
            let from = ((at("y") + y) * 120 + at("x")) * 3;
            assert_eq!(tile.samples[y * 72..][..72], photo.samples[from..][..72], "row {y}");
        }
        let tiling = folder.png("out/tiling_01.png");
        assert_eq!((tiling.width, tiling.height), (120, 96));
        // The source map replays.
        folder.does(&[
            "apply",
            "out/tile_01_source.exr",
            "bumps.png",
            "-o",
            "again.png",
            "--kind",
            "data",
        ]);
        assert_eq!(folder.png("again.png"), map);
        let said = folder.does(&["info", "out/tile_01.png"]);
        assert!(said.is_empty(), "{said}");
    }

    #[test]
    fn maps_beside_the_photo_come_along() {
        let folder = folder();
        folder.grey16("cloth_height.png", 120, 96, 3);
        folder.grey16("cloth_ao.png", 120, 40, 3);
        let args = ["extract", "cloth.png", "--count", "2", "--period", "24x16"];
        let to = |more: &[&'static str]| [&args[..], more].concat();
        folder.does(&to(&["-o", "typed", "--map", "height=cloth_height.png", "--no-maps"]));
        let said = folder.does(&to(&["-o", "found"]));
        assert!(said.contains("cloth_height.png: taken as the photo's height map"), "{said}");
        assert!(said.contains("note: cloth_ao.png was left alone: the map"), "{said}");
        assert_eq!(names(&folder, "found"), names(&folder, "typed"));
        let bytes = |name: &str| std::fs::read(folder.at(name)).expect("a file");
        for name in ["tile_01_height.png", "tile_02_height.png"] {
            assert!(bytes(&format!("found/{name}")) == bytes(&format!("typed/{name}")), "{name}");
        }
        let said = folder.does(&to(&["-o", "bare", "--no-maps"]));
        assert!(!said.contains("cloth_height.png"), "{said}");
        assert!(!folder.at("bare/tile_01_height.png").exists());
        // What would be overwritten is found before the work.
        std::fs::rename(
            folder.at("found/tile_02_height.png"),
            folder.at("bare/tile_02_height.png"),
        )
        .expect("moved");
        for name in ["sheet.png", "tile_01.png", "tile_02.png", "tiling_01.png", "tiling_02.png"] {
            std::fs::remove_file(folder.at(format!("bare/{name}"))).expect("removed");
        }
        let args = ["extract", "cloth.png", "-o", "bare", "--period", "70x16"];
        folder.refuses(&args, 1, "tile_02_height.png exists already");
    }

    #[test]
    fn a_map_of_the_photo_is_not_where_a_tiles_goes() {
        let folder = folder();
        std::fs::rename(folder.at("cloth.png"), folder.at("tile_02_color.png")).expect("moved");
        folder.grey16("tile_02_height.png", 120, 96, 3);
        let args = ["extract", "tile_02_color.png", "-o", ".", "--period", "24x16", "--force"];
        let before = std::fs::read(folder.at("tile_02_height.png")).expect("a map");
        let said = folder.does(&args);
        let own = "tile_02_height.png was left alone: it is where this run's map goes";
        assert!(said.contains(own), "{said}");
        assert!(std::fs::read(folder.at("tile_02_height.png")).expect("a map") == before);
        assert!(!folder.at("tile_01_height.png").exists());
    }

    #[test]
    fn nothing_is_overwritten_and_nothing_is_left_behind() {
        let folder = folder();
        let args = ["extract", "cloth.png", "-o", "out", "--count", "1"];
        let said = folder.does(&args);
        assert!(said.contains("tile_01.png  24x16 from "), "{said}");
        let before = std::fs::read(folder.at("out/sheet.png")).expect("sheet");
        folder.refuses(&args, 1, "exists already");
        std::fs::remove_file(folder.at("out/tile_01.png")).expect("removed");
        folder.refuses(&args, 1, "exists already");
        assert_eq!(names(&folder, "out"), ["sheet.png", "tiling_01.png"]);
        folder.does(&["extract", "cloth.png", "-o", "out", "--count", "1", "--force"]);
        assert_eq!(std::fs::read(folder.at("out/sheet.png")).expect("sheet"), before, "same bytes");
    }

    #[test]
    fn what_cannot_be_done_is_said_in_a_sentence() {
        let folder = folder();
        folder.rgb("photo.png", 96, 96, 1);
        folder.rgb_from("flat.png", 64, 64, |_, _| [9; 3]);
        folder.rgb("tiny.png", 10, 40, 1);
        let extract = |args: &[&'static str]| [&["extract"], args, &["-o", "out"]].concat();
        for (args, status, needle) in [
            (vec!["photo.png"], 1, "no clear period"),
            (vec!["flat.png"], 1, "alike"),
            (vec!["tiny.png"], 1, "at least 16x16"),
            (vec!["nowhere.png"], 1, "nowhere.png"),
            (vec!["cloth.png", "--period", "0x5"], 2, "`period`"),
            (vec!["cloth.png", "--period", "70x16"], 2, "half the photo"),
            (vec!["cloth.png", "--period", "24"], 2, "WIDTHxHEIGHT"),
            (vec!["cloth.png", "--count", "0"], 2, "1 to 100"),
            (vec!["cloth.png", "--alpha", "-1"], 2, "`alpha`"),
            (vec!["cloth.png", "--band", "8"], 2, "`band`"),
            (vec!["cloth.png", "--map", "height=flat.png"], 1, "aspect ratio"),
            (vec!["cloth.png", "--mask", "flat.png"], 1, "the mask"),
            (vec!["cloth.png", "--period", "23.3x16", "--save-source-maps"], 2, "`scale`"),
        ] {
            folder.refuses(&extract(&args), status, needle);
            assert!(!folder.at("out").exists(), "{args:?}");
        }
        folder.refuses(&["extract", "cloth.png", "-o", "-"], 2, "a folder");
        folder.refuses(&["extract", "cloth.png", "-o", "a/b/c"], 1, "a/b/c");
        folder.refuses(&["extract", "cloth.png", "-o", "photo.png"], 1, "exists already");
        let output = folder.run(["params", "extract", "--json"]);
        let json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
        assert_eq!(json["extract"].as_array().map(Vec::len), Some(ExtractParams::schema().len()));
    }
}
