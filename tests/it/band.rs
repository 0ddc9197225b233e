//! Keep the middle: only a band along the edges is made anew.

use texforge::{
    Axis, Ctx, Error, Inputs, Mask, Method, Picture, Size, Tile, TileParams, tile, tiles,
};

use crate::support::exemplar::{grain, stained};

const BAND: usize = 20;

fn params() -> TileParams {
    TileParams { band: BAND, ..Default::default() }
}

fn made(photo: &Picture, params: &TileParams) -> Tile {
    tile(&Ctx::new(3, 2).expect("pool"), photo, None, params).expect("a tile")
}

/// Mean absolute difference of columns `x` and `x + 1` (around the end).
fn step(picture: &Picture, x: usize) -> f64 {
    let (h, w) = (picture.height(), picture.width());
    let at = |y: usize, x: usize| picture.samples().unit((y * w + x % w) * picture.channels());
    (0..h).map(|y| (at(y, x) - at(y, x + 1)).abs()).sum::<f64>() / h as f64
}

#[test]
fn the_middle_is_the_photos_and_the_border_is_not() {
    let photo = stained(112, 128, 1).picture();
    for (axis, size) in [
        (Axis::Both, Size::Auto),
        (Axis::X, Size::Auto),
        (Axis::Y, Size::Pixels { width: 100, height: 90 }),
    ] {
        let tile = made(&photo, &TileParams { axis, size, ..params() });
        let (h, w) = (tile.picture.height(), tile.picture.width());
        if size == Size::Auto {
            assert_eq!((h, w), (112, 128));
        }
        let (top, left) = ((112 - h) / 2, (128 - w) / 2);
        let map = tile.source_map.expect("copied");
        let mut anew = 0;
        for (i, &[sy, sx]) in map.positions().iter().enumerate() {
            let (y, x) = (i / w, i % w);
            let inside = |i: usize, n: usize, wraps: bool| !wraps || (BAND..n - BAND).contains(&i);
            let own = [(top + y) as u32, (left + x) as u32];
            if inside(y, h, axis != Axis::X) && inside(x, w, axis != Axis::Y) {
                assert_eq!([sy, sx], own, "{axis:?}: the middle at {y}, {x}");
            } else {
                anew += usize::from([sy, sx] != own);
            }
        }
        assert!(anew > BAND * h.min(w), "{axis:?}: only {anew} pixels are new");
    }
}

#[test]
fn edges_meet_and_the_band_joins_the_middle() {
    for seed in 0..4 {
        let photo = grain(112, 128, seed).picture();
        let tile = made(&photo, &params()).picture;
        let mean = (0..127).map(|x| step(&photo, x)).sum::<f64>() / 127.0;
        assert!(step(&photo, 127) > 1.3 * mean, "the photo's edges meet by themselves");
        for x in [127, BAND - 1, 127 - BAND] {
            let ratio = step(&tile, x) / mean;
            assert!(ratio < 1.25, "seed {seed}: column {x} steps {ratio:.2} times as usual");
        }
    }
}

#[test]
fn what_is_masked_in_the_middle_is_made_anew() {
    let photo = grain(100, 110, 2).picture();
    let hole = |i: usize| !((40..60).contains(&(i / 110)) && (50..66).contains(&(i % 110)));
    let mask = Mask::new(100, 110, (0..11_000).map(hole).collect()).expect("mask");
    let ctx = Ctx::new(0, 2).expect("pool");
    let inputs = Inputs { mask: Some(&mask), ..Inputs::new(&photo) };
    let tile = tiles(&ctx, &inputs, &params(), 1).expect("a tile").remove(0);
    let map = tile.source_map.expect("copied");
    assert_eq!(map.positions()[30 * 110 + 30], [30, 30], "beside the hole");
    for [y, x] in map.positions() {
        assert!(hole(*y as usize * 110 + *x as usize), "{y}, {x} is masked");
    }
}

#[test]
fn any_number_of_threads_gives_the_same() {
    let photo = stained(90, 96, 4).picture();
    let on = |threads: usize| {
        let ctx = Ctx::new(5, threads).expect("pool");
        tile(&ctx, &photo, None, &params()).expect("a tile").source_map.expect("copied")
    };
    let one = on(1);
    assert!([2, 5].into_iter().all(|n| on(n).positions() == one.positions()));
}

#[test]
fn a_band_that_does_not_fit_is_refused() {
    let photo = grain(64, 80, 1).picture();
    let error = |params: &TileParams| {
        let error = tile(&Ctx::new(0, 1).expect("pool"), &photo, None, params);
        match error.expect_err("refused") {
            Error::Parameter { name, expected, .. } => (name, expected),
            other => panic!("{other}"),
        }
    };
    let (name, expected) = error(&TileParams { band: 32, ..Default::default() });
    assert_eq!((name, expected.contains("11 (the patch side) to 31")), ("band", true));
    assert_eq!(error(&TileParams { band: 10, ..Default::default() }).0, "band");
    for method in [Method::NoWrap, Method::MakeSeamless] {
        assert_eq!(error(&TileParams { method, ..params() }).0, "band");
    }
    let size = Size::Pixels { width: 81, height: 64 };
    assert_eq!(error(&TileParams { size, ..params() }).0, "size");
}
