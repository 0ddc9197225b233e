//! `detect_lattice` on pictures whose lattice is known, and on pictures that have none.

use std::process::Command;

use assert_cmd::prelude::*;
use texforge::base::rng::Rng;
use texforge::{
    Ctx, Encoding, Error, Follow, Lattice, LatticeParams, Method, Picture, Samples, Size, Tile,
    TileParams, detect_lattice, lattice_autocorrelation, tile,
};

type Basis = [[f64; 2]; 2];

const SIZE: (usize, usize) = (220, 260);

fn uniform(rng: &mut Rng) -> f64 {
    f64::from(rng.next_u32()) / f64::from(u32::MAX)
}

/// A smooth random pattern that repeats by a basis: a few waves of random phases.
fn pattern(basis: Basis, seed: u64) -> impl Fn(f64, f64) -> f64 {
    let mut rng = Rng::new(seed, 0, 0, 0);
    let mut waves = Vec::new();
    for i in -3..=3 {
        for j in 0..=3 {
            let strength = 1.0 / f64::from(1 + i * i + j * j);
            waves.push((f64::from(i), f64::from(j), strength, uniform(&mut rng)));
        }
    }
    let [[a, b], [c, d]] = basis;
    let det = a * d - b * c;
    move |y, x| {
        let (u, v) = ((x * d - y * c) / det, (y * a - x * b) / det);
        let wave = |&(i, j, s, p): &(f64, f64, f64, f64)| {
            s * ((i * u + j * v + p) * std::f64::consts::TAU).cos()
        };
        waves.iter().map(wave).sum()
    }
}

/// A grey picture of what `value` (about -2 to 2) says, with noise.
fn picture((h, w): (usize, usize), noise: f64, value: impl Fn(f64, f64) -> f64) -> Picture {
    let mut rng = Rng::new(99, 0, 0, 0);
    let sample = |i: usize| {
        let v = value((i / w) as f64, (i % w) as f64) + noise * (uniform(&mut rng) - 0.5) * 3.46;
        (128.0 + 40.0 * v).clamp(0.0, 255.0) as u8
    };
    let samples = Samples::U8((0..h * w).map(sample).collect());
    Picture::new(h, w, 1, samples, Encoding::Srgb).expect("valid")
}

fn detect(picture: &Picture) -> Lattice {
    let ctx = Ctx::new(0, 2).expect("pool");
    detect_lattice(&ctx, picture, &LatticeParams::default()).expect("a lattice or a guess")
}

/// Whether both bases generate the same points: each vector of one is, within `tolerance`, a whole
/// combination of the other's, by a matrix of determinant 1 or -1.
fn same(got: &Lattice, [[a, b], [c, d]]: Basis, tolerance: f64) -> bool {
    let det = a * d - b * c;
    let whole = [got.v1, got.v2].map(|[x, y]| {
        let (u, v) = (((x * d - y * c) / det).round(), ((y * a - x * b) / det).round());
        let off = (u * a + v * c - x).hypot(u * b + v * d - y);
        (off <= tolerance).then_some((u, v))
    });
    matches!(whole, [Some((p, q)), Some((r, s))] if (p * s - q * r).abs() == 1.0)
}

const BASES: [Basis; 6] = [
    [[24.0, 0.0], [0.0, 31.0]],
    [[36.5, 0.0], [-8.9, 13.4]],
    [[16.3, 16.1], [-16.1, 16.3]],
    [[40.0, 7.0], [20.0, 38.3]],
    [[12.2, 3.1], [-4.4, 25.0]],
    // About 2.2 x 2 repeats.
    [[100.0, 10.0], [-9.0, 98.0]],
];

#[test]
fn known_lattices_are_found_to_a_fraction_of_a_pixel() {
    for (i, basis) in BASES.into_iter().enumerate() {
        for noise in [0.0, 0.5] {
            let got = detect(&picture(SIZE, noise, pattern(basis, i as u64)));
            assert!(got.found, "{basis:?}, noise {noise}: {got:?}");
            let exact = if basis[0][0] < 50.0 { 0.4 } else { 0.8 };
            assert!(same(&got, basis, exact), "{basis:?}, noise {noise}: {got:?}");
        }
    }
}

#[test]
fn rows_of_bricks_are_not_taken_for_the_lattice() {
    // Running bond: mortar lines alone correlate along the whole rows.
    let mortar = |y: f64, x: f64| {
        let shift = if (y / 14.0) as i64 % 2 == 0 { 0.0 } else { 18.0 };
        if y % 14.0 < 2.5 || (x + shift) % 36.0 < 2.5 { 1.5 } else { -0.5 }
    };
    let got = detect(&picture(SIZE, 0.8, mortar));
    assert!(got.found && same(&got, [[36.0, 0.0], [18.0, 14.0]], 0.5), "{got:?}");
}

/// Fields of `basis`, each of a random color that `turns` raises, with joints between.
fn fields(basis: Basis, seed: u64, joints: f64, turns: impl Fn(i64, i64) -> f64) -> Picture {
    let mut grain = Rng::new(seed, 1, 0, 0);
    let [[a, b], [c, d]] = basis;
    let det = a * d - b * c;
    let sample = |i: usize| {
        let (y, x, channel) = ((i / 3 / 400) as f64, (i / 3 % 400) as f64, i % 3);
        let (u, v) = ((x * d - y * c) / det, (y * a - x * b) / det);
        let (column, row) = (u.floor() as i64, v.floor() as i64);
        let inside = |t: f64, length: f64| (t - t.floor()) * length > 3.0;
        let mut rng = Rng::new(seed, 2 + channel as u32, column as u32, row as u64);
        let stone = 80.0 + 60.0 * uniform(&mut rng) + turns(column, row);
        let joint = !(inside(u, a.hypot(b)) && inside(v, c.hypot(d)));
        let value = if joint { joints } else { stone } + 8.0 * uniform(&mut grain);
        value.clamp(0.0, 255.0) as u8
    };
    let samples = Samples::U8((0..360 * 400 * 3).map(sample).collect());
    Picture::new(360, 400, 3, samples, Encoding::Srgb).expect("valid")
}

#[test]
fn stones_of_random_colors_lie_on_the_lattice_of_their_joints() {
    // The joints are as light as the stones on average: of the colors nothing repeats.
    for (seed, basis) in (0..).zip([
        [[40.3, 0.0], [0.0, 24.7]],
        [[38.4, 0.0], [19.2, 17.3]],
        [[26.1, 4.0], [-5.2, 30.6]],
    ]) {
        let got = detect(&fields(basis, seed, 110.0, |_, _| 0.0));
        assert!(got.found && same(&got, basis, 0.5), "{basis:?}: {got:?}");
    }
}

#[test]
fn fields_of_two_colors_in_turns_are_a_cell_of_two() {
    let basis = [[30.2, 1.0], [-1.4, 28.6]];
    let two = [[30.2 - 1.4, 29.6], [30.2 + 1.4, 1.0 - 28.6]];
    for seed in 0..2 {
        let board = |column: i64, row: i64| if (column + row) % 2 == 0 { 70.0 } else { 0.0 };
        let got = detect(&fields(basis, seed, 0.0, board));
        assert!(got.found && same(&got, two, 0.5), "{got:?}");
        let rows = |_, row: i64| if row.rem_euclid(3) == 0 { 70.0 } else { 0.0 };
        let got = detect(&fields(basis, seed, 0.0, rows));
        assert!(got.found && same(&got, [basis[0], [-4.2, 85.8]], 0.7), "{got:?}");
    }
}

#[test]
fn gradients_stains_and_scratches_do_not_matter() {
    let basis = BASES[3];
    let plain = pattern(basis, 3);
    let dirty = |y: f64, x: f64| {
        let stain = if (y - 90.0).hypot(x - 60.0) < 40.0 { 0.4 } else { 1.0 };
        let scratch = if (y - 0.3 * x - 80.0).abs() < 2.0 { 3.0 } else { 0.0 };
        plain(y, x) * stain * (0.3 + 0.7 * x / 260.0) + 2.0 * y / 220.0 - 1.0 + scratch
    };
    let got = detect(&picture(SIZE, 0.3, dirty));
    assert!(got.found && same(&got, basis, 0.5), "{got:?}");
}

#[test]
fn what_has_no_lattice_gets_none() {
    // Bumps and dents at random places: blobs without order.
    let blobs = |seed: u64| {
        let mut rng = Rng::new(seed, 1, 0, 0);
        let mut bump =
            |_| [uniform(&mut rng) * 220.0, uniform(&mut rng) * 260.0, uniform(&mut rng) - 0.5];
        let bumps: Vec<[f64; 3]> = (0..700).map(&mut bump).collect();
        move |y: f64, x: f64| {
            let bump = |b: &[f64; 3]| {
                let far = (y - b[0]).powi(2) + (x - b[1]).powi(2);
                if far < 400.0 { 3.0 * b[2] * (-far / 50.0).exp() } else { 0.0 }
            };
            bumps.iter().map(bump).sum()
        }
    };
    for seed in 0..6 {
        let got = detect(&picture(SIZE, 0.3, blobs(seed)));
        assert!(!got.found, "blobs {seed}: {got:?}");
    }
    let noise = detect(&picture(SIZE, 1.0, |_, _| 0.0));
    assert!(!noise.found, "noise: {noise:?}");
    let stripes = detect(&picture(SIZE, 0.5, |y, x| ((y + 0.3 * x) / 4.0).sin()));
    assert!(!stripes.found, "stripes: {stripes:?}");
}

#[test]
fn several_lattices_get_no_confidence() {
    let parts = [BASES[0], BASES[2], BASES[3], [[29.0, 11.0], [-13.0, 27.0]]];
    let parts: Vec<_> = parts.into_iter().zip(7..).map(|(b, seed)| pattern(b, seed)).collect();
    let quarters =
        |y: f64, x: f64| parts[usize::from(y > 110.0) * 2 + usize::from(x > 130.0)](y, x);
    let whole = detect(&picture(SIZE, 0.0, &parts[0]));
    let got = detect(&picture(SIZE, 0.0, quarters));
    assert!(!got.found && got.confidence < 0.5 * whole.confidence, "{got:?}");
}

#[test]
fn a_transposed_picture_has_the_transposed_lattice() {
    let basis = BASES[1];
    let plain = pattern(basis, 1);
    let got = detect(&picture((SIZE.1, SIZE.0), 0.4, |y, x| plain(x, y)));
    assert!(got.found && same(&got, basis.map(|[x, y]| [y, x]), 0.4), "{got:?}");
}

#[test]
fn a_fine_pattern_can_be_left_out() {
    let (weave, print) =
        (pattern([[6.0, 0.0], [0.0, 6.0]], 1), pattern([[48.0, 0.0], [0.0, 42.0]], 2));
    let cloth = picture(SIZE, 0.1, |y, x| weave(y, x) + 0.3 * print(y, x));
    let ctx = Ctx::new(0, 2).expect("pool");
    let params = LatticeParams { min_period: 20.0, ..Default::default() };
    let got = detect_lattice(&ctx, &cloth, &params).expect("found");
    assert!(got.found && same(&got, [[48.0, 0.0], [0.0, 42.0]], 0.5), "{got:?}");
}

#[test]
fn any_number_of_threads_gives_the_same() {
    let photo = picture(SIZE, 0.4, pattern(BASES[3], 3));
    let with = |threads| {
        let ctx = Ctx::new(0, threads).expect("pool");
        let lattice = detect_lattice(&ctx, &photo, &LatticeParams::default()).expect("found");
        (lattice, lattice_autocorrelation(&ctx, &photo).expect("map"))
    };
    let one = with(1);
    assert!(one == with(2) && one == with(5));
}

#[test]
fn the_map_shows_the_lattice() {
    let photo = picture(SIZE, 0.2, pattern(BASES[0], 3));
    let (map, scale) =
        lattice_autocorrelation(&Ctx::new(0, 2).expect("pool"), &photo).expect("map");
    assert_eq!((map.height(), map.width(), map.channels()), (2 * SIZE.0 - 1, 2 * SIZE.1 - 1, 1));
    assert_eq!(scale, [1.0, 1.0]);
    let at = |dy: isize, dx: isize| {
        let (y, x) = (SIZE.0 as isize - 1 + dy, SIZE.1 as isize - 1 + dx);
        map.samples().unit(y as usize * map.width() + x as usize)
    };
    assert!(at(0, 0) > 0.999 && at(31, 24) > 0.7 && at(31, -48) > 0.7 && at(15, 12) < 0.5);
}

#[test]
fn bad_pictures_are_refused_with_the_reason() {
    let ctx = Ctx::new(0, 1).expect("pool");
    let error = |picture: &Picture| {
        detect_lattice(&ctx, picture, &LatticeParams::default()).expect_err("refused")
    };
    let constant = picture(SIZE, 0.0, |_, _| 0.3);
    assert!(matches!(error(&constant), Error::BadPicture { .. }));
    assert!(matches!(lattice_autocorrelation(&ctx, &constant), Err(Error::BadPicture { .. })));
    assert!(matches!(error(&picture((15, 80), 1.0, |_, _| 0.0)), Error::TooSmall { need: 16, .. }));
    let mut samples = vec![0.5f32; 40 * 40];
    samples[7] = f32::NAN;
    let nan = Picture::new(40, 40, 1, Samples::F32(samples), Encoding::Linear).expect("valid");
    assert!(matches!(error(&nan), Error::NotFinite { count: 1, .. }));
    let params = LatticeParams { min_confidence: 1.5, ..Default::default() };
    let photo = picture(SIZE, 0.2, pattern(BASES[0], 3));
    assert!(matches!(detect_lattice(&ctx, &photo, &params), Err(Error::Parameter { .. })));
    ctx.job().cancel();
    let cancelled = detect_lattice(&ctx, &photo, &LatticeParams::default());
    assert!(matches!(cancelled, Err(Error::Cancelled)));
}

#[test]
fn transparent_pixels_do_not_count() {
    let basis = BASES[3];
    let photo = picture(SIZE, 0.2, pattern(basis, 3));
    let Samples::U8(grey) = photo.samples() else { unreachable!("8-bit") };
    // A third is hidden, and another lattice painted there.
    let hidden = |i: usize| i % SIZE.1 < 90;
    let other = picture(SIZE, 0.0, pattern(BASES[0], 5));
    let pixel = |i: usize| {
        if hidden(i) { [(other.samples().unit(i) * 255.0) as u8, 0] } else { [grey[i], 255] }
    };
    let samples = Samples::U8((0..grey.len()).flat_map(pixel).collect());
    let masked = Picture::new(SIZE.0, SIZE.1, 2, samples, Encoding::Srgb).expect("valid");
    let got = detect(&masked);
    assert!(got.found && same(&got, basis, 0.5), "{got:?}");
}

#[test]
fn the_program_tells_and_draws() {
    use texforge::image::io::{self, WriteOptions};
    let folder = tempfile::tempdir().expect("folder");
    let write = |name: &str, picture: &Picture| {
        let path = folder.path().join(name);
        io::write(&path, picture, &WriteOptions::new(texforge::MapKind::Color)).expect("written");
    };
    write("wall.png", &picture(SIZE, 0.2, pattern(BASES[0], 3)));
    write("noise.png", &picture(SIZE, 1.0, |_, _| 0.0));
    write("flat.png", &picture(SIZE, 0.0, |_, _| 0.0));
    let run = |args: &[&str]| {
        let mut command = Command::cargo_bin("texforge").expect("built");
        let output =
            command.current_dir(folder.path()).arg("lattice").args(args).output().expect("ran");
        let text = String::from_utf8(output.stdout).expect("UTF-8");
        (output.status.code(), text, String::from_utf8(output.stderr).expect("UTF-8"))
    };
    let (status, text, _) =
        run(&["wall.png", "--overlay", "drawn.png", "--autocorrelation", "map.png"]);
    assert_eq!(status, Some(0));
    assert!(
        text.starts_with("lattice     found\n") && text.contains("\nv1          24.0"),
        "{text}"
    );
    let sides = |name: &str| {
        let read = io::read(&folder.path().join(name), texforge::MapKind::Data).expect("readable");
        (read.height(), read.width(), read.channels())
    };
    assert_eq!(sides("drawn.png"), (SIZE.0, SIZE.1, 3));
    assert_eq!(sides("map.png"), (2 * SIZE.0 - 1, 2 * SIZE.1 - 1, 1));
    let (status, _, message) = run(&["wall.png", "--overlay", "drawn.png"]);
    assert!(status == Some(1) && message.contains("exists already"), "{message}");

    let (status, text, _) = run(&["noise.png"]);
    assert!(status == Some(0) && text.contains("none found"), "{text}");
    let (status, text, _) = run(&["noise.png", "--json"]);
    let report: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    assert!(status == Some(0) && report["found"] == false && report["v1"].is_array(), "{report}");
    let (status, _, message) = run(&["flat.png"]);
    assert!(status == Some(1) && message.contains("all its usable pixels are alike"), "{message}");
    let (status, _, _) = run(&["wall.png", "--min-confidence", "2"]);
    assert_eq!(status, Some(2));
}

mod following {
    use super::*;

    /// Courses of bricks, each shifted by half a brick, with a stain.
    const BRICKS: Basis = [[37.0, 0.0], [18.5, 21.0]];

    fn wall() -> Picture {
        let clean = pattern(BRICKS, 3);
        picture(SIZE, 0.2, |y, x| {
            let stain = if (y - 90.0).hypot(x - 160.0) < 30.0 { 1.2 } else { 0.0 };
            clean(y, x) - stain
        })
    }

    fn made(photo: &Picture, params: &TileParams, threads: usize) -> Tile {
        tile(&Ctx::new(0, threads).expect("pool"), photo, None, params).expect("a tile")
    }

    /// The share of pixels whose match lies at the same place of a brick, within two pixels.
    fn in_step(tile: &Tile) -> f64 {
        let map = tile.source_map.as_ref().expect("a source map");
        let (w, h) = (map.width() as f64, map.height() as f64);
        // The lattice stretched to whole periods of the tile.
        let (sx, sy) = (w / ((w / 37.0).round() * 37.0), h / ((h / 42.0).round() * 42.0));
        let near = |(i, &[y, x]): (usize, &[u32; 2])| {
            let (oy, ox) = ((i / map.width()) as f64 / sy, (i % map.width()) as f64 / sx);
            let (dy, dx) = (f64::from(y) - oy, f64::from(x) - ox);
            let course = (dy / 21.0).round();
            let (off_y, along) = (dy - 21.0 * course, dx - 18.5 * course);
            off_y.hypot(along - 37.0 * (along / 37.0).round()) <= 2.0
        };
        let positions = map.positions();
        positions.iter().enumerate().filter(|&p| near(p)).count() as f64 / positions.len() as f64
    }

    #[test]
    fn a_tile_of_bricks_holds_whole_bricks_in_step() {
        let photo = wall();
        let tile = made(&photo, &TileParams::default(), 2);
        let (w, h) = tile.report.tile_size;
        let whole = |n: usize, period: f64| {
            let times = (n as f64 / period).round();
            times >= 1.0 && (n as f64 / (times * period) - 1.0).abs() < 0.031
        };
        assert!(whole(w, 37.0) && whole(h, 42.0), "{w}x{h}");
        assert!(tile.report.notes.iter().any(|n| n.contains("whole periods")), "it is said");
        // Bricks of neighbouring phase fit as well when nothing holds them: a few do by themselves.
        let size = Size::Pixels { width: w, height: h };
        let off = TileParams { lattice: Follow::Off, size, ..Default::default() };
        let free = in_step(&made(&photo, &off, 2));
        assert!(in_step(&tile) > 0.9, "in step: {}", in_step(&tile));
        assert!(free < 0.5, "in step without: {free}");
        // The tile's own lattice is the photo's.
        let found = detect(&tile.picture);
        let stretched = BRICKS.map(|[x, y]| {
            let (w, h) = (w as f64, h as f64);
            [x * w / ((w / 37.0).round() * 37.0), y * h / ((h / 42.0).round() * 42.0)]
        });
        assert!(found.found && same(&found, stretched, 0.5), "{found:?}");
        // That size asked for is the same tile, at any thread count.
        for threads in [1, 5] {
            let again = made(&photo, &TileParams { size, ..Default::default() }, threads);
            assert!(again.picture.samples() == tile.picture.samples(), "{threads} threads");
        }
    }

    #[test]
    fn a_size_that_cuts_bricks_is_made_and_said() {
        let photo = wall();
        // Half a brick, and four courses and a half.
        let size = Size::Pixels { width: 20, height: 94 };
        let params = TileParams { size, ..Default::default() };
        let tile = made(&photo, &params, 2);
        assert_eq!(tile.report.tile_size, (20, 94));
        let said = tile.report.notes.iter().find(|note| note.contains("some are cut"));
        assert!(said.is_some_and(|note| note.contains("x84 does")), "{:?}", tile.report.notes);
        let off = made(&photo, &TileParams { lattice: Follow::Off, ..params }, 2);
        assert!(off.picture.samples() == tile.picture.samples());
        assert!(off.report.notes.is_empty());
    }

    #[test]
    fn a_size_between_whole_numbers_of_bricks_holds_narrower_or_wider_ones() {
        let photo = wall();
        // Bricks and pairs of courses: 2 and a quarter of both; 3 and a half, 1 and two thirds.
        for (width, height) in [(83, 94), (130, 70)] {
            let size = Size::Pixels { width, height };
            let params = TileParams { size, ..Default::default() };
            let tile = made(&photo, &params, 2);
            assert_eq!(tile.report.tile_size, (width, height));
            let said = |n: &String| n.contains("whole periods, scaled by up to");
            assert!(tile.report.notes.iter().any(said), "{:?}", tile.report.notes);
            let free = made(&photo, &TileParams { lattice: Follow::Off, ..params }, 2);
            let (held, free) = (in_step(&tile), in_step(&free));
            assert!(held > 0.9, "{width}x{height}: {held} in step");
            assert!(free < 0.5, "{width}x{height}: {free} in step without");
        }
    }

    #[test]
    fn an_axis_that_does_not_repeat_scales_nothing() {
        let photo = wall();
        let size = Size::Pixels { width: 148, height: 94 };
        let params = TileParams { size, axis: texforge::Axis::X, ..Default::default() };
        let tile = made(&photo, &params, 2);
        let said = |n: &String| n.contains("whole periods") && !n.contains("scaled");
        assert!(tile.report.notes.iter().any(said), "{:?}", tile.report.notes);
        // Four bricks; courses as high as in the photo: a pixel below another comes from below it.
        let map = tile.source_map.expect("a source map");
        let near = |(i, &[y, x]): (usize, &[u32; 2])| {
            let (dy, dx) = (f64::from(y) - (i / 148) as f64, f64::from(x) - (i % 148) as f64);
            let course = (dy / 21.0).round();
            let along = dx - 18.5 * course;
            (dy - 21.0 * course).hypot(along - 37.0 * (along / 37.0).round()) <= 2.0
        };
        let in_step = map.positions().iter().enumerate().filter(|&p| near(p)).count();
        assert!(in_step as f64 > 0.9 * (148 * 94) as f64, "{in_step} in step");
    }

    #[test]
    fn courses_stay_in_step_where_only_they_fit() {
        let photo = wall();
        // The share of pixels whose match lies as far from a course as they do, within two pixels.
        let in_step = |tile: &Tile| {
            let map = tile.source_map.as_ref().expect("a source map");
            let stretch = map.height() as f64 / ((map.height() as f64 / 21.0).round() * 21.0);
            let near = |(i, &[y, _]): (usize, &[u32; 2])| {
                let off = (f64::from(y) - (i / map.width()) as f64 / stretch) / 21.0;
                (off - off.round()).abs() * 21.0 <= 2.0
            };
            let positions = map.positions();
            positions.iter().enumerate().filter(|&p| near(p)).count() as f64
                / positions.len() as f64
        };
        // Half a brick; four courses a little stretched, or five, which turns the bond over.
        for (width, height) in [(19, 86), (19, 105)] {
            let size = Size::Pixels { width, height };
            let params = TileParams { size, ..Default::default() };
            let tile = made(&photo, &params, 2);
            assert_eq!(tile.report.tile_size, (width, height));
            let said = |n: &String| n.contains("whole rows") && n.contains("some are cut");
            assert!(tile.report.notes.iter().any(said), "{:?}", tile.report.notes);
            let off = made(&photo, &TileParams { lattice: Follow::Off, ..params.clone() }, 2);
            let (held, free) = (in_step(&tile), in_step(&off));
            assert!(held > 0.9, "{width}x{height}: {held} in step, {free} without");
            assert!(free < 0.8, "{width}x{height}: {free} in step without");
            for threads in [1, 5] {
                let again = made(&photo, &params, threads);
                assert!(again.picture.samples() == tile.picture.samples(), "{threads} threads");
            }
        }
        // Where nothing repeats downwards, any height will do.
        let size = Size::Pixels { width: 19, height: 94 };
        let params = TileParams { size, axis: texforge::Axis::X, ..Default::default() };
        let tile = made(&photo, &params, 2);
        let said = |n: &String| n.contains("whole rows");
        assert!(tile.report.notes.iter().any(said), "{:?}", tile.report.notes);
    }

    #[test]
    fn where_nothing_repeats_or_nothing_can_follow_nothing_changes() {
        let noise = picture(SIZE, 1.0, |_, _| 0.0);
        let draft = TileParams { quality: texforge::Quality::Draft, ..Default::default() };
        let off = TileParams { lattice: Follow::Off, ..draft.clone() };
        let (auto, plain) = (made(&noise, &draft, 2), made(&noise, &off, 2));
        assert!(auto.picture.samples() == plain.picture.samples());
        assert!(auto.report.notes.is_empty(), "{:?}", auto.report.notes);
        // Baselines are not helped.
        let photo = wall();
        for method in [Method::WrapOnly, Method::NoWrap, Method::MakeSeamless] {
            let tile = made(&photo, &TileParams { method, ..draft.clone() }, 2);
            let plain = made(&photo, &TileParams { method, ..off.clone() }, 2);
            assert!(tile.picture.samples() == plain.picture.samples(), "{method:?}");
        }
    }
}
