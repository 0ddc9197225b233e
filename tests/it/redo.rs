//! One rectangle of a finished tile made anew: all else stays, and the rectangle fits in.

use texforge::{
    Axis, Ctx, Error, ErrorKind, Inputs, Mask, Measure, Method, Origin, Picture, Rect, Redo,
    SigmaMap, Size, SourceMap, Symmetries, Tile, TileParams, tile, tiles,
};

use crate::support::Folder;
use crate::support::exemplar::{grain, stained};

const SIDE: usize = 96;

fn params() -> TileParams {
    let size = Size::Pixels { width: SIDE, height: SIDE };
    TileParams { size, patch: 7, ..Default::default() }
}

fn run(inputs: &Inputs<'_>, params: &TileParams, seed: u64) -> Tile {
    let ctx = Ctx::new(seed, 2).expect("pool");
    tiles(&ctx, inputs, params, 1).expect("a tile").remove(0)
}

fn map_of(tile: &Tile) -> &SourceMap {
    tile.source_map.as_ref().expect("copied")
}

fn rect(y: usize, x: usize, height: usize, width: usize) -> Rect {
    Rect { y, x, height, width }
}

/// Marks the rectangle's pixels of the tile one by one.
fn marked(rect: Rect) -> Vec<bool> {
    let mut marks = vec![false; SIDE * SIDE];
    for y in rect.y..rect.y + rect.height {
        (rect.x..rect.x + rect.width).for_each(|x| marks[y % SIDE * SIDE + x % SIDE] = true);
    }
    marks
}

/// The rectangle without a rim in which the old may pass into the new.
fn inner(rect: Rect) -> Rect {
    Rect {
        y: rect.y + 4,
        x: rect.x + 4,
        height: rect.height.saturating_sub(8),
        width: rect.width.saturating_sub(8),
    }
}

/// Asserts that nothing but the rectangle has changed, and nearly all of that but for its rim.
fn assert_redone(old: &Tile, new: &Tile, rect: Rect, what: &str) {
    let (marks, changed) = (marked(rect), marked(inner(rect)));
    let from = |tile: &Tile, i: usize| (map_of(tile).positions()[i], map_of(tile).origin(i));
    let mut same = 0;
    for i in 0..SIDE * SIDE {
        let unchanged = from(old, i) == from(new, i);
        assert!(marks[i] || unchanged, "{what}: {}, {} is outside", i / SIDE, i % SIDE);
        same += usize::from(changed[i] && unchanged);
        let c = old.picture.channels();
        let px = |t: &Tile| (i * c..i * c + c).map(|k| t.picture.samples().unit(k)).collect();
        let (a, b): (Vec<f64>, Vec<f64>) = (px(old), px(new));
        assert!(marks[i] || a == b, "{what}: the picture at {}, {}", i / SIDE, i % SIDE);
    }
    let area = changed.iter().filter(|&&changed| changed).count().max(1);
    assert!(same * 5 < area, "{what}: {same} of {area} pixels have come back");
}

#[test]
fn all_else_stays_and_the_rectangle_does_not_come_back() {
    let photo = stained(112, 128, 1).picture();
    for (method, axis, spots) in [
        (Method::Stationary, Axis::Both, &[rect(20, 30, 24, 32), rect(80, 70, 40, 50)][..]),
        (Method::WrapOnly, Axis::X, &[rect(0, 90, 30, 20), rect(40, 0, 20, 96)]),
        (Method::Stationary, Axis::Y, &[rect(90, 5, 20, 9), rect(3, 50, 1, 1)]),
        (Method::NoWrap, Axis::Both, &[rect(0, 0, 30, 30), rect(66, 66, 30, 30)]),
    ] {
        let params = TileParams { method, axis, ..params() };
        let old = run(&Inputs::new(&photo), &params, 0);
        for &spot in spots {
            let redo = Some(Redo { of: map_of(&old), rect: spot });
            // The same seed as before, and size left to the source map.
            let params = TileParams { size: Size::Auto, ..params.clone() };
            let new = run(&Inputs { redo, ..Inputs::new(&photo) }, &params, 0);
            assert_redone(&old, &new, spot, &format!("{method:?} {axis:?} {spot}"));
            assert_eq!((old.report.redo, new.report.redo), (None, Some(spot)));
            assert_eq!(new.report.tile_size, (SIDE, SIDE));
        }
    }
}

#[test]
fn masks_rule_the_rectangle_and_leave_the_rest_alone() {
    let photo = grain(112, 128, 2).picture();
    let old = run(&Inputs::new(&photo), &params(), 1);
    let usable: Vec<bool> = (0..112 * 128).map(|i| i % 128 < 60).collect();
    let mask = Mask::new(112, 128, usable).expect("mask");
    let spot = rect(70, 60, 50, 60);
    let redo = Some(Redo { of: map_of(&old), rect: spot });
    let new = run(&Inputs { mask: Some(&mask), redo, ..Inputs::new(&photo) }, &params(), 1);
    assert_redone(&old, &new, spot, "masked");
    let marks = marked(spot);
    let masked = |inside: bool| {
        let all = map_of(&new).positions().iter().zip(&marks);
        all.filter(|&(p, &m)| m == inside && p[1] >= 60).count()
    };
    assert_eq!(masked(true), 0, "copied from where the mask is black");
    assert!(masked(false) > 1000, "the mask would matter outside");
}

/// Mean absolute difference of neighbours across the rectangle's border over that of all neighbours.
fn border(picture: &Picture, rect: Rect) -> f64 {
    let marks = marked(rect);
    let at = |i: usize| picture.samples().unit(i * picture.channels());
    let mut sums = [(0.0, 0.0); 2];
    for i in 0..SIDE * SIDE {
        let right = i / SIDE * SIDE + (i + 1) % SIDE;
        for j in [right, (i + SIDE) % (SIDE * SIDE)] {
            let sum = &mut sums[usize::from(marks[i] != marks[j])];
            *sum = (sum.0 + (at(i) - at(j)).abs(), sum.1 + 1.0);
        }
    }
    let [all, across] = sums.map(|(sum, n)| sum / n);
    across / all
}

#[test]
fn the_border_steps_as_the_rest_does_wherever_it_lies() {
    let (mut redone, mut pasted) = (Vec::new(), Vec::new());
    for seed in 0..3 {
        let photo = grain(112, 128, seed).picture();
        let old = run(&Inputs::new(&photo), &params(), seed);
        // In the middle, over an edge, and over the corner.
        for spot in [rect(20, 30, 30, 40), rect(80, 30, 30, 40), rect(75, 70, 30, 40)] {
            let redo = Some(Redo { of: map_of(&old), rect: spot });
            let new = run(&Inputs { redo, ..Inputs::new(&photo) }, &params(), seed);
            redone.push(border(&new.picture, spot));
            // Against filling the rectangle with the photo's corner.
            let (from, marks) = (map_of(&old).positions(), marked(spot));
            let place = |i: usize| [(i / SIDE) as u32, (i % SIDE) as u32];
            let yx = (0..SIDE * SIDE).map(|i| if marks[i] { place(i) } else { from[i] }).collect();
            let paste = SourceMap::new((SIDE, SIDE), (112, 128), yx).expect("map");
            let paste = paste.apply(&photo, texforge::MapKind::Color).expect("picture");
            pasted.push(border(&paste, spot));
        }
    }
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    assert!(mean(&redone) < 1.3, "the border steps {redone:.2?} times as usual");
    assert!(mean(&pasted) > 1.8, "pasted, it would step {pasted:.2?} times as usual");
}

#[test]
fn any_number_of_threads_gives_the_same_and_seeds_differ() {
    let photo = stained(90, 100, 4).picture();
    let old = run(&Inputs::new(&photo), &params(), 5);
    let spot = rect(80, 10, 30, 24);
    let redo = Some(Redo { of: map_of(&old), rect: spot });
    let on = |threads: usize| {
        let ctx = Ctx::new(5, threads).expect("pool");
        tiles(&ctx, &Inputs { redo, ..Inputs::new(&photo) }, &params(), 4).expect("tiles")
    };
    let one = on(1);
    for threads in [2, 5] {
        assert!(on(threads).iter().zip(&one).all(|(a, b)| map_of(a) == map_of(b)), "{threads}");
    }
    for (i, a) in one.iter().enumerate() {
        for b in &one[..i] {
            assert_redone(a, b, spot, &format!("seeds {} {}", a.report.seed, b.report.seed));
        }
    }
}

#[test]
fn several_photos_mirrored_and_turned_stay_what_they_are() {
    let (photo, also) = (grain(90, 100, 1).picture(), [grain(80, 70, 2).picture()]);
    let params = TileParams { symmetry: Symmetries::All, ..params() };
    let inputs = Inputs { also: &also, ..Inputs::new(&photo) };
    let old = run(&inputs, &params, 2);
    let spot = rect(70, 80, 44, 40);
    let redo = Some(Redo { of: map_of(&old), rect: spot });
    let new = run(&Inputs { redo, ..inputs }, &params, 2);
    assert_redone(&old, &new, spot, "views");
    // What was there does not come back mirrored or turned either.
    let origins = map_of(&old).origins().expect("origins");
    let was = |i: usize| (origins[i].photo, map_of(&old).positions()[i]);
    let is = |i: usize| (map_of(&new).origin(i).photo, map_of(&new).positions()[i]);
    let marks = marked(spot);
    let before: std::collections::HashSet<_> =
        (0..SIDE * SIDE).filter(|&i| marks[i]).map(was).collect();
    let marks = marked(inner(spot));
    let area = marks.iter().filter(|&&marked| marked).count();
    let again = (0..SIDE * SIDE).filter(|&i| marks[i] && before.contains(&is(i))).count();
    assert!(again * 5 < area, "{again} of {area} pixels were in the rectangle before");
}

#[test]
fn with_all_that_a_tile_can_be_made_from() {
    let photo = stained(112, 128, 3).picture();
    let gray = vec![0.2; SIDE * SIDE];
    let sigma = SigmaMap::from_picture(
        &Picture::new(SIDE, SIDE, 1, texforge::Samples::F32(gray), texforge::Encoding::Data)
            .expect("picture"),
    );
    let sigma = sigma.expect("sigma map");
    for measure in [Measure::Moments, Measure::Steerable] {
        let params = TileParams { measure, flatten: 0.3, ..params() };
        let inputs = Inputs { sigma_map: Some(&sigma), trace: true, ..Inputs::new(&photo) };
        let old = run(&inputs, &params, 0);
        let spot = rect(30, 85, 40, 30);
        let redo = Some(Redo { of: map_of(&old), rect: spot });
        let new = run(&Inputs { redo, ..inputs }, &params, 0);
        assert_redone(&old, &new, spot, &format!("{measure:?}"));
        assert_eq!(new.trace.len(), old.trace.len());
        assert_eq!(new.trace.last().map(|step| step.costs), Some(new.report.costs));
    }
}

#[test]
fn what_cannot_be_redone_is_refused() {
    let photo = grain(100, 110, 1).picture();
    let old = run(&Inputs::new(&photo), &params(), 0);
    let of = map_of(&old);
    let refusal = |of: &SourceMap, rect: Rect, params: &TileParams, photo: &Picture| {
        let inputs = Inputs { redo: Some(Redo { of, rect }), ..Inputs::new(photo) };
        tiles(&Ctx::new(0, 1).expect("pool"), &inputs, params, 1).expect_err("refused")
    };
    let named = |error: &Error, wanted: &str, word: &str| {
        assert!(matches!(error, Error::Parameter { name, .. } if *name == wanted), "{error}");
        assert!(error.to_string().contains(word), "{error}");
    };
    let bad = |rect: Rect| refusal(of, rect, &params(), &photo);
    named(&bad(rect(0, 0, 0, 5)), "redo", "at least one pixel");
    named(&bad(rect(0, 0, 5, 0)), "redo", "at least one pixel");
    named(&bad(rect(96, 0, 5, 5)), "redo", "begins in the 96x96 tile");
    named(&bad(rect(0, usize::MAX, 5, 5)), "redo", "begins in");
    named(&bad(rect(1, 1, usize::MAX, 5)), "redo", "at most 96x89 or 89x96");
    named(&bad(rect(0, 0, 90, 90)), "redo", "at most 96x89 or 89x96");
    for (axis, spot) in [(Axis::X, rect(90, 3, 7, 5)), (Axis::Y, rect(3, 90, 5, 7))] {
        let params = TileParams { axis, ..params() };
        named(&refusal(of, spot, &params, &photo), "redo", "does not repeat");
    }
    let spot = rect(10, 10, 20, 20);
    let with = |params: TileParams| refusal(of, spot, &params, &photo);
    named(&with(TileParams { band: 12, ..params() }), "band", "redone");
    named(&with(TileParams { method: Method::MakeSeamless, ..params() }), "method", "redone");
    let size = Size::Pixels { width: SIDE, height: 95 };
    named(&with(TileParams { size, ..params() }), "size", "96x96 of the tile");
    let error = refusal(of, spot, &params(), &grain(100, 111, 1).picture());
    assert_eq!(error.kind(), ErrorKind::SizeMismatch, "{error}");
    let turned = Origin { photo: 0, symmetry: Symmetries::All.list()[7] };
    let origins = vec![turned; SIDE * SIDE];
    let yx = of.positions().to_vec();
    let views = SourceMap::of_views((SIDE, SIDE), vec![(100, 110)], yx.clone(), origins);
    let mirror = TileParams { symmetry: Symmetries::Mirror, ..params() };
    let error = refusal(&views.expect("map"), spot, &mirror, &photo);
    named(&error, "symmetry", "got mirror");
    let two = vec![(100, 110); 2];
    let two = SourceMap::of_views((SIDE, SIDE), two, yx, vec![Origin::default(); SIDE * SIDE]);
    named(&refusal(&two.expect("map"), spot, &params(), &photo), "redo", "a tile of 2 and 1");
    // A patch's side of rows is enough to fit to.
    let inputs =
        Inputs { redo: Some(Redo { of, rect: rect(0, 0, 89, 96) }), ..Inputs::new(&photo) };
    assert!(tiles(&Ctx::new(0, 2).expect("pool"), &inputs, &params(), 1).is_ok());
    assert!(tile(&Ctx::new(0, 2).expect("pool"), &photo, None, &params()).is_ok());
}

#[test]
fn the_program_redoes_a_rectangle_and_says_so() {
    let folder = Folder::with_photo();
    folder.grey16("photo_height.png", 96, 96, 2);
    let first = ["tile", "photo.png", "-o", "tile.png", "--size", "64", "--patch", "7"];
    folder.does(&[&first[..], &["--save-source-map", "tile.exr"]].concat());
    let redo = ["tile", "photo.png", "--patch", "7", "--redo", "30x20+50+10", "--redo-of"];
    let redo = [&redo[..], &["tile.exr", "-o", "new.png"]].concat();
    let more = ["--variants", "2", "--save-source-map", "new.exr", "--json"];
    let output = folder.run([&redo[..], &more].concat());
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && !said.contains("default size"), "{said}");
    let v: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let rect = serde_json::json!({ "y": 10, "x": 50, "height": 20, "width": 30 });
    assert_eq!((&v["redo"], &v["params"]["size"]), (&rect, &"64x64".into()));
    let info = folder.run(["info", "new-1.png", "--json"]);
    let info: serde_json::Value = serde_json::from_slice(&info.stdout).expect("JSON");
    assert_eq!(info["record"]["redo"], rect);
    for suffix in [".png", "_height.png"] {
        let name = |tile: &str| folder.png(&format!("{tile}{suffix}"));
        let (old, one, two) = (name("tile"), name("new-1"), name("new-2"));
        let inside = |x: usize, y: usize| (10..30).contains(&y) && !(16..50).contains(&x);
        let all = || (0..64 * 64).map(|i| (i % 64, i / 64));
        let apart = |a: &crate::support::Pixels, b: &crate::support::Pixels| {
            all().filter(|&(x, y)| a.at(x, y) != b.at(x, y)).collect::<Vec<_>>()
        };
        for (a, b) in [(&old, &one), (&old, &two), (&one, &two)] {
            let apart = apart(a, b);
            assert!(apart.len() > 250, "{suffix}: {} pixels differ", apart.len());
            assert!(apart.into_iter().all(|(x, y)| inside(x, y)), "{suffix}: outside");
        }
    }
    // The result can be redone in turn.
    let again = ["tile", "photo.png", "--redo", "9x9+0+0", "--redo-of", "new-2.exr"];
    folder.does(&[&again[..], &["-o", "again.png"]].concat());

    folder.refuses(&["tile", "photo.png", "-o", "a.png", "--redo", "9x9+0+0"], 2, "--redo-of");
    folder.refuses(&["tile", "photo.png", "-o", "a.png", "--redo-of", "tile.exr"], 2, "--redo");
    let refuses = |rect: &str, of: &str, status: i32, needle: &str| {
        let args = ["tile", "photo.png", "-o", "a.png", "--redo", rect, "--redo-of", of];
        folder.refuses(&args, status, needle);
    };
    refuses("9,9", "tile.exr", 2, "WIDTHxHEIGHT+X+Y");
    refuses("9x9+0+64", "tile.exr", 2, "begins in the 64x64 tile");
    refuses("9x9+0+0", "missing.exr", 1, "missing.exr");
    refuses("9x9+0+0", "photo.png", 1, "no source map");
    let own = [&redo[..7], &["tile.exr", "-o", "b.png", "--save-source-map", "tile.exr"]].concat();
    folder.refuses(&own, 1, "also an input");
}
