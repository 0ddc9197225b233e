//! `regular` on photos whose lattice is known, on photos that will not do, and as a process.

use std::process::Command;

use assert_cmd::prelude::*;
use proptest::prelude::*;
use texforge::base::params::OrAuto;
use texforge::base::rng::Rng;
use texforge::verb::regular::{Matching, Seam, Straighten, Tileable};
use texforge::{
    Ctx, Encoding, Error, ErrorKind, Guide, LatticeParams, MapKind, Mask, Picture, Regular,
    RegularMaker, RegularParams, Samples, Size, detect_lattice, regular,
};

use crate::support::{Folder, PROGRAM};

/// Bricks of 24 x 12 pixels in running bond, each of a shade of its own, with grain.
const BRICKS: [[f64; 2]; 2] = [[12.0, 12.0], [12.0, -12.0]];

fn mortar(y: i64, x: i64) -> bool {
    let course = y.div_euclid(12);
    y.rem_euclid(12) < 2 || (x + 12 * (course % 2)).rem_euclid(24) < 2
}

/// `shift(row, column of a cell)` says how far bricks lie beside their place, to the right.
fn wall((h, w): (usize, usize), shift: impl Fn(i64) -> i64) -> Picture {
    let mut rng = Rng::new(5, 0, 0, 0);
    let mut samples = Vec::new();
    for (y, x) in (0..h as i64).flat_map(|y| (0..w as i64).map(move |x| (y, x))) {
        let x = x - shift(y);
        let course = y.div_euclid(12);
        let brick = (x + 12 * (course % 2)).div_euclid(24);
        let shade = Rng::new(9, 0, course as u32, brick as u64).below(40) as u8;
        let grain = rng.below(12) as u8;
        let [r, g, b] =
            if mortar(y, x) { [200, 195, 190] } else { [110 + shade, 60 + shade / 2, 40] };
        samples.extend([r + grain, g + grain, b + grain]);
    }
    Picture::new(h, w, 3, Samples::U8(samples), Encoding::Srgb).expect("valid")
}

fn straight() -> Picture {
    wall((144, 160), |_| 0)
}

/// Follows the bricks; every pixel is a copy, of the photo as it is.
fn params() -> RegularParams {
    RegularParams {
        size: Size::Pixels { width: 200, height: 180 },
        lattice: Guide::Vectors(BRICKS),
        block: OrAuto::Given(24),
        border: OrAuto::Given(8),
        feather: 0,
        flatten: OrAuto::Given(0.0),
        ..Default::default()
    }
}

fn ctx(seed: u64, threads: usize) -> Ctx {
    Ctx::new(seed, threads).expect("pool")
}

fn made(photo: &Picture, params: &RegularParams) -> Regular {
    regular(&ctx(0, 2), photo, None, params).expect("a texture")
}

fn pixel(picture: &Picture, y: usize, x: usize) -> [u8; 3] {
    let Samples::U8(v) = picture.samples() else { panic!("8 bits") };
    let at = (y * picture.width() + x) * 3;
    [v[at], v[at + 1], v[at + 2]]
}

/// The share of pixels that are mortar where mortar belongs, or brick where brick does, if the pattern
/// begins at its best place.
fn in_step(texture: &Picture) -> f64 {
    let light = |y: usize, x: usize| pixel(texture, y, x)[2] > 120;
    let (h, w) = (texture.height(), texture.width());
    let right = |(oy, ox): (i64, i64)| {
        let all = (0..h).flat_map(|y| (0..w).map(move |x| (y, x)));
        all.filter(|&(y, x)| light(y, x) == mortar(y as i64 + oy, x as i64 + ox)).count()
    };
    let best = (0..24).flat_map(|y| (0..24).map(move |x| (y, x))).map(right).max();
    best.unwrap_or(0) as f64 / (h * w) as f64
}

mod pixels {
    use super::*;

    #[test]
    fn every_pixel_is_a_copy_and_the_pattern_goes_on() {
        let photo = straight();
        for seam in [Seam::Graph, Seam::Cut] {
            for matching in [Matching::Color, Matching::Correlation] {
                let made = made(&photo, &RegularParams { seam, matching, ..params() });
                let texture = &made.picture;
                assert_eq!((texture.width(), texture.height()), (200, 180));
                assert_eq!(&made.source_map.apply(&photo, MapKind::Color).expect("fits"), texture);
                let right = in_step(texture);
                assert!(right > 0.985, "{seam:?} {matching:?}: {right}");
            }
        }
    }

    #[test]
    fn pieces_come_from_all_over_the_photo() {
        let made = made(
            &straight(),
            &RegularParams { size: Size::Pixels { width: 600, height: 600 }, ..params() },
        );
        let mut used = [0; 16];
        for &[y, x] in made.source_map.positions() {
            used[(y as usize * 4 / 144) * 4 + x as usize * 4 / 160] += 1;
        }
        // Of 16 parts of the photo none gives less than a third of its share.
        let least = used.iter().min().copied().unwrap_or(0);
        assert!(least > 600 * 600 / 48, "{used:?}");
    }

    #[test]
    fn bricks_of_a_colour_come_to_lie_together() {
        // The left half is dark, the right half bright.
        let mut photo = straight();
        let Samples::U8(v) = photo.samples() else { panic!("8 bits") };
        let dark = |i: usize, v: u8| if i / 3 % 160 < 80 { v / 2 } else { v };
        let samples = v.iter().enumerate().map(|(i, &v)| dark(i, v)).collect();
        photo = Picture::new(144, 160, 3, Samples::U8(samples), Encoding::Srgb).expect("valid");
        // How often a pixel and the next in its row or column are from different halves.
        let changes = |sample_candidates: usize| {
            let size = Size::Pixels { width: 400, height: 400 };
            let made = made(&photo, &RegularParams { size, sample_candidates, ..params() });
            let halves: Vec<bool> =
                made.source_map.positions().iter().map(|&[_, x]| x < 80).collect();
            let dark = halves.iter().filter(|&&dark| dark).count();
            assert!((20_000..140_000).contains(&dark), "{sample_candidates}: {dark} dark");
            let changes =
                |step: usize| halves.windows(step + 1).filter(|w| w[0] != w[step]).count();
            changes(1) + changes(400)
        };
        let (by_chance, agreeing) = (changes(1), changes(16));
        assert!(5 * agreeing < 4 * by_chance, "{by_chance} became {agreeing}");
    }

    #[test]
    fn a_rare_brick_does_not_die_out() {
        // One of some 50 bricks is dark.
        let mut photo = straight();
        let Samples::U8(v) = photo.samples() else { panic!("8 bits") };
        let is_dark = |y: usize, x: usize| (64..80).contains(&y) && (56..84).contains(&x);
        let value = |i: usize, v: u8| if is_dark(i / 480, i / 3 % 160) { v / 4 } else { v };
        let samples = v.iter().enumerate().map(|(i, &v)| value(i, v)).collect();
        photo = Picture::new(144, 160, 3, Samples::U8(samples), Encoding::Srgb).expect("valid");
        let share = |sample_candidates: usize| {
            let size = Size::Pixels { width: 600, height: 600 };
            let params = RegularParams { size, sample_candidates, ..params() };
            let (mut dark, mut all) = (0, 0);
            for seed in 0..8 {
                let made = regular(&ctx(seed, 2), &photo, None, &params).expect("a texture");
                let from = made.source_map.positions();
                dark += from.iter().filter(|&&[y, x]| is_dark(y as usize, x as usize)).count();
                all += from.len();
            }
            dark as f64 / all as f64
        };
        let (by_chance, agreeing) = (share(1), share(16));
        assert!(2.0 * agreeing > by_chance, "{by_chance} became {agreeing}");
    }

    #[test]
    fn it_repeats_where_it_shall() {
        let photo = straight();
        for (tileable, width, height) in
            [(Tileable::Both, 192, 168), (Tileable::X, 192, 170), (Tileable::Y, 190, 168)]
        {
            let size = Size::Pixels { width, height };
            let made = made(&photo, &RegularParams { size, tileable, ..params() });
            let (h, w) = (made.picture.height(), made.picture.width());
            assert_eq!((w, h), (width, height));
            // Twice beside and below itself it is one wall.
            let (rows, columns) = match tileable {
                Tileable::Both => (2, 2),
                Tileable::X => (1, 2),
                _ => (2, 1),
            };
            let samples: Vec<u8> = (0..rows * h)
                .flat_map(|y| (0..columns * w).map(move |x| (y % h, x % w)))
                .flat_map(|(y, x)| pixel(&made.picture, y, x))
                .collect();
            let tiled =
                Picture::new(rows * h, columns * w, 3, Samples::U8(samples), Encoding::Srgb);
            let right = in_step(&tiled.expect("valid"));
            assert!(right > 0.985, "{tileable:?}: {right}");
        }
    }

    #[test]
    fn the_lattice_is_found_again_in_what_was_made() {
        let photo = wall((240, 264), |y| (y / 60) % 2);
        let auto = RegularParams {
            lattice: Guide::Auto,
            size: Size::Pixels { width: 480, height: 400 },
            ..params()
        };
        let made = made(&photo, &auto);
        let [v1, v2] = made.report.lattice.expect("followed");
        let again = detect_lattice(&ctx(0, 2), &made.picture, &LatticeParams::default());
        let again = again.expect("a lattice");
        assert!(again.found, "{again:?}");
        for (a, b) in [(v1, again.v1), (v2, again.v2)] {
            assert!((a[0] - b[0]).hypot(a[1] - b[1]) < 0.5, "{a:?} became {b:?}");
        }
    }

    #[test]
    fn crooked_courses_become_straight() {
        // Four courses to the left, four to the right, by up to two pixels.
        let photo = wall((192, 192), |y| [0, 1, 2, 1][(y as usize / 48) % 4]);
        let crooked = made(
            &photo,
            &RegularParams { straighten: Straighten::Off, deform: 0, tolerance: 0, ..params() },
        );
        let straight = made(&photo, &RegularParams { deform: 0, tolerance: 0, ..params() });
        let (before, after) = (in_step(&crooked.picture), in_step(&straight.picture));
        assert!(after > 0.98 && before < 0.97, "{before} became {after}");
        let (root, most) = straight.report.straightened;
        assert!((0.4..1.6).contains(&root) && (0.8..3.0).contains(&most), "{root} {most}");
        assert_eq!(crooked.report.straightened, (0.0, 0.0));
    }

    #[test]
    fn without_a_lattice_pieces_come_from_anywhere() {
        let made = made(&straight(), &RegularParams { lattice: Guide::None, ..params() });
        assert_eq!((made.report.lattice, made.report.confidence), (None, None));
        let right = in_step(&made.picture);
        assert!(right < 0.95, "that is no wall any more: {right}");
    }

    #[test]
    fn faded_seams_mix_what_lies_on_both_sides() {
        let photo = straight();
        let sharp = made(&photo, &params());
        for soft in [
            RegularParams { feather: 3, ..params() },
            RegularParams { seam: Seam::Linear, ..params() },
        ] {
            let made = made(&photo, &soft);
            let copied = made.source_map.apply(&photo, MapKind::Color).expect("fits");
            let differ = |a: &Picture, b: &Picture| {
                let all = (0..180).flat_map(|y| (0..200).map(move |x| (y, x)));
                all.filter(|&(y, x)| pixel(a, y, x) != pixel(b, y, x)).count()
            };
            let mixed = differ(&made.picture, &copied);
            assert!(mixed > 500 && mixed < 30_000, "{mixed} pixels are mixed");
            if soft.seam == Seam::Graph {
                let pairs = made.source_map.positions().iter().zip(sharp.source_map.positions());
                let other = pairs.filter(|(a, b)| a != b).count();
                assert!(
                    other < 2_000,
                    "the cut is only smoothed, yet {other} pixels changed sides"
                );
            }
        }
    }

    #[test]
    fn masked_pixels_are_never_copied() {
        let photo = straight();
        let usable: Vec<bool> = (0..144 * 160).map(|i| i % 160 >= 30 || i / 160 > 20).collect();
        let mask = Mask::new(144, 160, usable.clone()).expect("a mask");
        let made = regular(&ctx(1, 2), &photo, Some(&mask), &params()).expect("a texture");
        for &[y, x] in made.source_map.positions() {
            assert!(usable[y as usize * 160 + x as usize], "{y} {x}");
        }
    }

    #[test]
    fn maps_follow_the_photo() {
        let photo = straight();
        let height: Vec<u16> = (0..144 * 160).map(|i| i as u16).collect();
        let map = Picture::new(144, 160, 1, Samples::U16(height), Encoding::Data).expect("valid");
        let maker = RegularMaker::new(&ctx(0, 1), &photo, None, &params()).expect("a maker");
        let (made, maps) = maker.make(&ctx(0, 1), &[(&map, MapKind::Data)]).expect("a texture");
        let Samples::U16(got) = maps[0].samples() else { panic!("16 bits") };
        for (got, [y, x]) in got.iter().zip(made.source_map.positions()) {
            assert_eq!(u32::from(*got), y * 160 + x);
        }
    }
}

mod sameness {
    use super::*;

    #[test]
    fn same_seed_same_bytes_for_any_number_of_threads() {
        let photo = straight();
        for seam in [Seam::Graph, Seam::Cut, Seam::Linear] {
            let params = RegularParams {
                seam,
                tileable: Tileable::X,
                feather: 2,
                size: Size::Pixels { width: 192, height: 150 },
                ..params()
            };
            let of =
                |seed, threads| regular(&ctx(seed, threads), &photo, None, &params).expect("it");
            let one = of(3, 1);
            for threads in [2, 5] {
                assert_eq!(of(3, threads).picture, one.picture, "{seam:?}, {threads} threads");
            }
            assert_ne!(of(4, 1).picture, one.picture, "{seam:?}: another seed");
        }
    }

    #[test]
    fn same_bytes_without_simd() {
        let photo = straight();
        for matching in [Matching::Color, Matching::Correlation] {
            let params = RegularParams { matching, ..params() };
            let mut plain = ctx(0, 2);
            plain.simd = texforge::Simd::Scalar;
            let slow = regular(&plain, &photo, None, &params).expect("a texture");
            assert_eq!(slow.picture, made(&photo, &params).picture, "{matching:?}");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(8))]
        #[test]
        fn strips_are_the_whole(seed in 0..99u64, seam in 0..3usize, height in 30..220usize, wraps: bool, agreeing: bool) {
            let photo = straight();
            let seam = [Seam::Graph, Seam::Cut, Seam::Linear][seam];
            let height = if wraps { height / 24 * 24 + 24 } else { height };
            let params = RegularParams {
                seam,
                size: Size::Pixels { width: 96, height },
                tileable: if wraps { Tileable::Both } else { Tileable::None },
                block: OrAuto::Given(12),
                border: OrAuto::Given(4),
                feather: 1,
                sample_candidates: if agreeing { 5 } else { 1 },
                ..params()
            };
            let whole = regular(&ctx(seed, 1), &photo, None, &params).expect("a texture");
            let maker = RegularMaker::new(&ctx(seed, 2), &photo, None, &params).expect("a maker");
            let (mut samples, mut row, mut strips) = (Vec::new(), 0, 0);
            for strip in maker.strips(&ctx(seed, 2), 96 * 24).expect("memory") {
                let strip = strip.expect("a strip");
                prop_assert_eq!(strip.first, row);
                let piece = strip.picture(maker.photo(), MapKind::Color).expect("fits");
                row += piece.height();
                strips += 1;
                let Samples::U8(v) = piece.samples() else { panic!("8 bits") };
                samples.extend_from_slice(v);
            }
            prop_assert_eq!(&Samples::U8(samples), whole.picture.samples());
            prop_assert!(strips > height / 36, "{} strips", strips);
        }
    }
}

mod refusals {
    use super::*;

    fn refused(photo: &Picture, params: &RegularParams) -> Error {
        match regular(&ctx(0, 1), photo, None, params) {
            Ok(made) => panic!("not refused: {:?}", made.report),
            Err(error) => error,
        }
    }

    #[test]
    fn what_cannot_be_is_said_in_a_sentence() {
        let photo = straight();
        let with = |change: &dyn Fn(&mut RegularParams)| {
            let mut params = params();
            change(&mut params);
            params
        };
        let cases: [(RegularParams, &str); 9] = [
            (with(&|p| p.lattice = Guide::Vectors([[12.0, 6.0], [24.0, 12.0]])), "not parallel"),
            (with(&|p| p.lattice = Guide::Vectors([[0.0, 0.0], [24.0, 12.0]])), "not parallel"),
            (with(&|p| p.lattice = Guide::Vectors([[90.0, 0.0], [0.0, 12.0]])), "at most half"),
            (with(&|p| p.lattice = Guide::Vectors([[1.0, 0.0], [0.0, 12.0]])), "at least 2 pixels"),
            (with(&|p| p.block = OrAuto::Given(4)), "at least 8"),
            (with(&|p| p.border = OrAuto::Given(13)), "1 to 12"),
            (with(&|p| p.tileable = Tileable::Both), "whole number of periods"),
            (with(&|p| p.size = Size::Pixels { width: 0, height: 9 }), "1x1 to"),
            (with(&|p| p.flatten = OrAuto::Given(0.001)), "less is texture"),
        ];
        for (params, words) in cases {
            let error = refused(&photo, &params);
            assert_eq!(error.kind(), ErrorKind::Parameter, "{words}: {error}");
            assert!(error.to_string().contains(words), "{error}");
        }
        let error = refused(&photo, &with(&|p| p.tileable = Tileable::X)).to_string();
        assert!(error.contains("192 does"), "{error}");
        let block = with(&|p| p.block = OrAuto::Given(140));
        assert_eq!(refused(&photo, &block).kind(), ErrorKind::TooSmall);
        let huge = with(&|p| p.size = Size::Pixels { width: 1 << 20, height: 1 << 20 });
        assert_eq!(refused(&photo, &huge).kind(), ErrorKind::Memory);
    }

    #[test]
    fn photos_that_will_not_do_are_refused() {
        let auto = RegularParams { lattice: Guide::Auto, ..params() };
        let of = |h: usize, w: usize, v: &dyn Fn(usize) -> f32| {
            let samples = Samples::F32((0..h * w).map(v).collect());
            Picture::new(h, w, 1, samples, Encoding::Linear).expect("valid")
        };
        let noise = of(128, 128, &|i| Rng::new(1, 0, 0, i as u64).below(1000) as f32 / 1000.0);
        assert_eq!(refused(&noise, &auto).kind(), ErrorKind::NoStructure);
        for params in [&auto, &params(), &RegularParams { lattice: Guide::None, ..params() }] {
            let constant = of(96, 96, &|_| 0.5);
            let error = refused(&constant, params);
            assert_eq!(error.kind(), ErrorKind::BadPicture);
            assert!(error.to_string().contains("alike"), "{error}");
            let mut nan = of(96, 96, &|i| i as f32);
            nan = match nan.samples() {
                Samples::F32(v) => {
                    let mut v = v.clone();
                    v[70] = f32::NAN;
                    Picture::new(96, 96, 1, Samples::F32(v), Encoding::Linear).expect("valid")
                }
                _ => nan,
            };
            assert_eq!(refused(&nan, params).kind(), ErrorKind::NotFinite);
            assert_eq!(refused(&of(5, 90, &|i| i as f32), params).kind(), ErrorKind::TooSmall);
        }
        // All usable pixels in a corner that no block fits into.
        let mask = Mask::new(144, 160, (0..144 * 160).map(|i| i / 160 < 12).collect());
        let error = regular(&ctx(0, 1), &straight(), Some(&mask.expect("a mask")), &params());
        let error = error.expect_err("too little");
        assert!(error.to_string().contains("choose a smaller block"), "{error}");
    }

    #[test]
    fn it_can_be_cancelled() {
        let ctx = ctx(0, 2);
        ctx.job().cancel();
        let error = regular(&ctx, &straight(), None, &params()).expect_err("cancelled");
        assert!(matches!(error, Error::Cancelled));
    }
}

mod program {
    use super::*;

    fn folder() -> Folder {
        let folder = Folder::new();
        let photo = straight();
        folder.rgb_from("wall.png", 160, 144, |x, y| pixel(&photo, y as usize, x as usize));
        folder
    }

    fn run(folder: &Folder, args: &[&str]) -> std::process::Output {
        let mut command = Command::new(PROGRAM);
        command.arg("regular").args(args).current_dir(folder.at("")).output().expect("it runs")
    }

    const LATTICE: &str = "12,12,12,-12";

    #[test]
    fn it_writes_the_same_picture_in_rows_and_at_once() {
        let folder = folder();
        folder.grey16("height.png", 160, 144, 1);
        let args = [
            "wall.png",
            "--lattice",
            LATTICE,
            "--size",
            "300x700",
            "--block",
            "16",
            "--map",
            "height=height.png",
        ];
        let rows = run(&folder, &[&args[..], &["-o", "rows.png", "--json"]].concat());
        rows.clone().assert().success();
        let whole = ["-o", "whole.png", "--save-source-map", "source.exr"];
        run(&folder, &[&args[..], &whole].concat()).assert().success();
        let (a, b) = (folder.png("rows.png"), folder.png("whole.png"));
        assert_eq!((a.width, a.height), (300, 700));
        assert_eq!(a.samples, b.samples);
        assert_eq!(folder.png("rows_height.png").samples, folder.png("whole_height.png").samples);
        assert!(folder.names().contains(&"source.exr".to_owned()));
        let json: serde_json::Value = serde_json::from_slice(&rows.stdout).expect("JSON");
        assert_eq!(json["verb"], "regular");
        assert_eq!(json["texture"]["width"], 300);
        assert_eq!(json["params"]["block"], 16);
        assert_eq!(json["params"]["lattice"], "12,12,12,-12");
        assert_eq!(json["files"].as_array().map(Vec::len), Some(2));
    }

    #[test]
    fn maps_beside_the_photo_come_along() {
        let folder = folder();
        folder.grey16("wall_height.png", 160, 144, 1);
        folder.grey16("wall_ao.png", 160, 40, 1);
        let args = ["wall.png", "--lattice", LATTICE, "--size", "96x80", "--block", "16"];
        let made = |more: &[&str]| {
            let output = run(&folder, &[&args[..], more].concat());
            let said = String::from_utf8_lossy(&output.stderr).into_owned();
            assert!(output.status.success(), "{more:?}: {said}");
            (output.stdout, said)
        };
        let bytes = |name: &str| std::fs::read(folder.at(name)).expect("a file");

        // As they were typed, in rows as well as at once.
        made(&["-o", "typed.png", "--map", "height=wall_height.png", "--no-maps"]);
        let (stdout, said) = made(&["-o", "rows.png", "--json"]);
        assert!(said.contains("wall_height.png: taken as the photo's height map"), "{said}");
        assert!(said.contains("note: wall_ao.png was left alone: the map"), "{said}");
        assert!(said.contains("rows_height.png  96x80 (height map)"), "{said}");
        made(&["-o", "whole.png", "--save-source-map", "source.exr"]);
        for name in ["rows_height.png", "whole_height.png"] {
            assert!(bytes(name) == bytes("typed_height.png"), "{name}");
        }
        let json: serde_json::Value = serde_json::from_slice(&stdout).expect("JSON");
        let files = json["files"].as_array().expect("a list");
        let names = files.iter().map(|f| [&f["role"], &f["path"]].map(|v| v.as_str().expect("it")));
        let want = [["texture", "rows.png"], ["map", "rows_height.png"]];
        assert_eq!(names.collect::<Vec<_>>(), want);
        assert!(json["notes"][0].as_str().is_some_and(|n| n.contains("wall_ao.png")), "{json}");

        // Left alone when asked to, and where there is no place for them.
        let before = folder.names();
        let (_, said) = made(&["-o", "bare.png", "--no-maps"]);
        assert!(!said.contains("wall_height.png"), "{said}");
        made(&["-o", "-"]);
        assert_eq!(folder.names().len(), before.len() + 1, "bare.png alone");
        // The texture's height map would be the photo's.
        let (_, said) = made(&["-o", "wall_color.png"]);
        let own = "wall_height.png was left alone: it is where this run's map goes";
        assert!(said.contains(own), "{said}");

        // What would be overwritten is found before the work.
        std::fs::remove_file(folder.at("rows.png")).expect("removed");
        let args = ["wall.png", "--lattice", LATTICE, "--block", "999", "-o", "rows.png"];
        let output = run(&folder, &args);
        let said = String::from_utf8_lossy(&output.stderr);
        assert!(said.contains("rows_height.png exists already"), "{said}");
        assert!(!folder.at("rows.png").exists());
    }

    #[test]
    fn bad_input_leaves_nothing_behind() {
        let folder = folder();
        folder.rgb_from("grey.png", 96, 96, |_, _| [90, 90, 90]);
        let before = folder.contents();
        for (args, status, words) in [
            (&["grey.png", "-o", "a.png"][..], 1, "alike"),
            (&["wall.png", "-o", "a.png", "--lattice", "1,2,3"][..], 2, "X1,Y1,X2,Y2"),
            (&["wall.png", "-o", "a.png", "--lattice", "-3,2,6,-4"][..], 2, "parallel"),
            (&["wall.png", "-o", "wall.png"][..], 1, "also an input"),
            (
                &["wall.png", "-o", "a.png", "--block", "999", "--lattice", LATTICE][..],
                1,
                "smaller ones",
            ),
            (&["wall.png", "-o", "a.xyz", "--lattice", LATTICE][..], 1, "a.xyz"),
            (&["wall.png", "-o", "-", "--json"][..], 2, "`json`"),
        ] {
            let output = run(&folder, args);
            let said = String::from_utf8_lossy(&output.stderr);
            assert_eq!(output.status.code(), Some(status), "{args:?}: {said}");
            assert!(said.contains(words), "{args:?}: {said}");
            assert_eq!(folder.contents(), before, "{args:?}");
        }
    }
}
