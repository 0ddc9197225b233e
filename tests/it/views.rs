//! Several photos mixed, and patches mirrored and turned: every pixel says where it comes from and
//! how that lay, and all maps follow.

use proptest::prelude::*;
use texforge::base::rng::Rng;
use texforge::method::stationary::memory_bytes;
use texforge::{
    Ctx, Encoding, Error, ErrorKind, Inputs, MapKind, Mask, Method, Origin, Picture, Quality,
    Samples, Size, SourceMap, Symmetries, Symmetry, Tile, TileParams, tiles,
};

use crate::support::Folder;
use crate::support::exemplar::{Exemplar, grain, pebbles, stained};

const SYMMETRIES: [Symmetries; 4] =
    [Symmetries::None, Symmetries::Mirror, Symmetries::Rotate, Symmetries::All];

fn draft(symmetry: Symmetries, width: usize, height: usize) -> TileParams {
    let size = Size::Pixels { width, height };
    TileParams { size, symmetry, quality: Quality::Draft, patch: 7, ..Default::default() }
}

fn run(inputs: &Inputs<'_>, params: &TileParams, threads: usize) -> Tile {
    let ctx = Ctx::new(3, threads).expect("pool");
    tiles(&ctx, inputs, params, 1).expect("a tile").remove(0)
}

fn map_of(tile: &Tile) -> &SourceMap {
    tile.source_map.as_ref().expect("a source map")
}

/// The pixels that the source map names, one by one, of any picture of each photo.
fn gathered(photos: &[&Picture], map: &SourceMap) -> Vec<f64> {
    let c = photos[0].channels();
    let px = |(i, &[y, x]): (usize, &[u32; 2])| {
        let photo = photos[usize::from(map.origin(i).photo)];
        let at = (y as usize * photo.width() + x as usize) * c;
        (at..at + c).map(|k| photo.samples().unit(k)).collect::<Vec<f64>>()
    };
    map.positions().iter().enumerate().flat_map(px).collect()
}

fn units(picture: &Picture) -> Vec<f64> {
    (0..picture.samples().len()).map(|i| picture.samples().unit(i)).collect()
}

/// Where output pixel `i` lies in its photo as that was laid.
fn laid(map: &SourceMap, i: usize) -> (Origin, (isize, isize)) {
    let origin = map.origin(i);
    let [y, x] = map.positions()[i].map(|v| v as usize);
    let size = map.source_sizes()[usize::from(origin.photo)];
    let (y, x) = origin.symmetry.place((y, x), size);
    (origin, (y as isize, x as isize))
}

/// Whether output pixels `i` and `j`, (`dy`, `dx`) apart, continue each other in one view.
fn coherent(map: &SourceMap, i: usize, j: usize, (dy, dx): (isize, isize)) -> bool {
    let ((a, (ay, ax)), (b, (by, bx))) = (laid(map, i), laid(map, j));
    a == b && (by - ay, bx - ax) == (dy, dx)
}

mod gathering {
    use super::*;

    #[test]
    fn every_pixel_is_the_one_that_is_named_of_every_photo_in_every_symmetry() {
        let (a, b, c) = (grain(60, 72, 1), grain(80, 40, 2), grain(31, 90, 3));
        let deep = |e: &Exemplar| {
            let v = e.rgb.iter().flatten().map(|v| (v * 65_535.0) as u16).collect();
            e.with(3, Samples::U16(v), Encoding::Srgb)
        };
        let (photo, also) = (deep(&a), [deep(&b), deep(&c)]);
        for symmetry in SYMMETRIES {
            for method in [Method::Stationary, Method::NoWrap] {
                let params = TileParams { method, ..draft(symmetry, 70, 64) };
                let inputs = Inputs { also: &also, ..Inputs::new(&photo) };
                let tile = run(&inputs, &params, 2);
                let map = map_of(&tile);
                let want = gathered(&[&photo, &also[0], &also[1]], map);
                assert!(units(&tile.picture) == want, "{symmetry:?} {method:?}");
                let origins = map.origins().expect("origins");
                for photo in 0..3 {
                    let n = origins.iter().filter(|o| o.photo == photo).count();
                    assert!(n > 100, "{symmetry:?}: photo {photo} gives {n} pixels");
                }
                let listed = symmetry.list();
                assert!(origins.iter().all(|o| listed.contains(&o.symmetry)), "{symmetry:?}");
                let used = |s: &Symmetry| origins.iter().filter(|o| o.symmetry == *s).count();
                assert!(listed.iter().all(|s| used(s) > 20), "{symmetry:?}: a symmetry is unused");
                assert_eq!(tile.report.also_sizes, [(40, 80), (90, 31)]);
            }
        }
    }

    /// Neighbours mostly continue each other in the photo as it was laid. Named with the inverse of
    /// its symmetry, a turned piece would not.
    #[test]
    fn pieces_are_whole_in_the_symmetry_that_is_named() {
        let photo = pebbles(90, 100, 5).picture();
        for symmetry in SYMMETRIES {
            let tile = run(&Inputs::new(&photo), &draft(symmetry, 64, 64), 2);
            let map = map_of(&tile);
            for wanted in symmetry.list() {
                let places = || {
                    let all = (0..64 * 63).map(|i| (i / 63) * 64 + i % 63);
                    all.filter(|&i| map.origin(i).symmetry == *wanted)
                };
                let n = places().count();
                let whole = places().filter(|&i| coherent(map, i, i + 1, (0, 1))).count();
                assert!(whole * 10 > n * 6, "{symmetry:?} {wanted:?}: {whole} of {n}");
            }
        }
    }

    #[test]
    fn one_photo_as_it_lies_has_no_origins() {
        let photo = grain(60, 60, 1).picture();
        let tile = run(&Inputs::new(&photo), &draft(Symmetries::None, 48, 48), 2);
        assert!(map_of(&tile).origins().is_none());
        assert!(tile.report.also_sizes.is_empty());
    }

    #[test]
    fn masks_and_alpha_hold_in_every_view() {
        let usable = |i: usize| !(20..30).contains(&(i / 72)) && i % 72 > 9;
        let mask = Mask::new(60, 72, (0..60 * 72).map(usable).collect()).expect("mask");
        let rgba = |e: &Exemplar, opaque: &dyn Fn(usize) -> bool| {
            let px = |(i, px): (usize, &[f64; 3])| {
                let alpha = if opaque(i) { 255 } else { 100 };
                let [r, g, b] = px.map(|v| (v * 255.0) as u8);
                [r, g, b, alpha]
            };
            let v = e.rgb.iter().enumerate().flat_map(px).collect();
            e.with(4, Samples::U8(v), Encoding::Srgb)
        };
        let hole = |i: usize| (10..25).contains(&(i / 50)) && (30..44).contains(&(i % 50));
        let photo = rgba(&grain(60, 72, 1), &|_| true);
        let also = [rgba(&grain(50, 50, 2), &|i| !hole(i))];
        let inputs = Inputs { also: &also, mask: Some(&mask), ..Inputs::new(&photo) };
        let tile = run(&inputs, &draft(Symmetries::All, 60, 60), 2);
        let map = map_of(&tile);
        for (i, &[y, x]) in map.positions().iter().enumerate() {
            let (y, x) = (y as usize, x as usize);
            match map.origin(i).photo {
                0 => assert!(usable(y * 72 + x), "masked: {y}, {x}"),
                _ => assert!(!hole(y * 50 + x), "transparent: {y}, {x}"),
            }
        }
    }

    #[test]
    fn same_bytes_for_any_number_of_threads() {
        let (photo, also) = (stained(60, 72, 1).picture(), [grain(64, 50, 2).picture()]);
        let inputs = Inputs { also: &also, ..Inputs::new(&photo) };
        for symmetry in [Symmetries::None, Symmetries::All] {
            let params = TileParams { flatten: 0.3, ..draft(symmetry, 52, 47) };
            let want = run(&inputs, &params, 1);
            for threads in [2, 5] {
                let got = run(&inputs, &params, threads);
                assert!(got.source_map == want.source_map, "{symmetry:?} {threads}");
                assert!(got.picture == want.picture && got.report.costs == want.report.costs);
            }
        }
    }

    /// Photos are used in proportion to what they have to give. Left to itself, the search ends at
    /// the one that is easier to match.
    #[test]
    fn every_photo_has_its_share() {
        let photo = pebbles(100, 100, 5).picture();
        let also = [grain(60, 100, 2).picture(), stained(90, 60, 3).picture()];
        let areas = [94 * 94, 54 * 94, 84 * 54].map(f64::from);
        let inputs = Inputs { also: &also, ..Inputs::new(&photo) };
        let share = |uniformity: f32, photo: u16| {
            let quality = Quality::Normal;
            let params = TileParams { uniformity, quality, ..draft(Symmetries::None, 96, 96) };
            let tile = run(&inputs, &params, 2);
            let origins = map_of(&tile).origins().expect("origins").to_vec();
            origins.iter().filter(|o| o.photo == photo).count() as f64 / origins.len() as f64
        };
        let fair = |i: usize| areas[i] / areas.iter().sum::<f64>();
        for photo in 0..3 {
            let (got, want) = (share(1.0, photo), fair(usize::from(photo)));
            assert!((got / want - 1.0).abs() < 0.3, "photo {photo}: {got:.3}, fair {want:.3}");
        }
        let off = (0..3).map(|i| (share(0.0, i) / fair(usize::from(i)) - 1.0).abs());
        assert!(off.fold(0.0, f64::max) > 0.3, "not balanced if switched off");
    }

    /// A bright and a dark photo: both have a share in the pooled target.
    #[test]
    fn both_of_two_unlike_photos_are_used_everywhere() {
        let of = |light: f64, seed| {
            let grain = grain(80, 80, seed);
            let at = |y: usize, x: usize| grain.rgb[y * 80 + x].map(|v| light + 0.3 * v);
            Exemplar::from_fn(80, 80, at).picture()
        };
        let (photo, also) = (of(0.05, 1), [of(0.65, 2)]);
        let inputs = Inputs { also: &also, ..Inputs::new(&photo) };
        let tile = run(&inputs, &draft(Symmetries::None, 64, 64), 2);
        let map = map_of(&tile);
        for quarter in 0..4 {
            let inside = |i: &usize| (i / 64 / 32) * 2 + i % 64 / 32 == quarter;
            let n = (0..64 * 64).filter(inside).filter(|&i| map.origin(i).photo == 1).count();
            assert!((200..824).contains(&n), "quarter {quarter}: {n} of 1024 are bright");
        }
    }
}

mod maps {
    use super::*;

    /// Smooth heights without symmetry; steps of at most a third.
    fn heights(h: usize, w: usize, seed: u64) -> Vec<f64> {
        let noise = crate::support::exemplar::value_noise;
        let at = |i: usize| {
            let (y, x) = ((i / w) as f64, (i % w) as f64);
            2.0 * noise(seed, y, x, 6.0) + 1.5 * noise(seed + 1, y, x, 9.0)
        };
        (0..h * w).map(at).collect()
    }

    /// The normal at `i`, right and up (or down), by differences to the neighbours given.
    fn normal([right, left, above, below]: [f64; 4], down: bool) -> [f64; 3] {
        let (dx, dy_up) = ((right - left) / 2.0, (above - below) / 2.0);
        let n = [-dx, if down { dy_up } else { -dy_up }, 1.0];
        let length = n.iter().map(|v| v * v).sum::<f64>().sqrt();
        n.map(|v| f64::midpoint(v / length, 1.0))
    }

    fn normals(heights: &[f64], h: usize, w: usize, down: bool) -> Picture {
        let at = |y: usize, x: usize| heights[y.min(h - 1) * w + x.min(w - 1)];
        let px = |i: usize| {
            let (y, x) = (i / w, i % w);
            let around = [at(y, x + 1), at(y, x.max(1) - 1), at(y.max(1) - 1, x), at(y + 1, x)];
            normal(around, down)
        };
        let v = (0..h * w).flat_map(px).collect();
        Picture::new(h, w, 3, Samples::F64(v), Encoding::Data).expect("normals")
    }

    /// Inside whole pieces the normals of the tile are those of its heights, whichever way the
    /// pieces were mirrored and turned: green up or down.
    #[test]
    fn normals_turn_with_what_they_are_the_normals_of() {
        let sizes = [(70, 80), (64, 64)];
        let all: Vec<Vec<f64>> =
            sizes.iter().zip([1, 9]).map(|(&(h, w), seed)| heights(h, w, seed)).collect();
        let photos: Vec<Picture> = all
            .iter()
            .zip(sizes)
            .map(|(v, (h, w))| {
                Picture::new(h, w, 1, Samples::F64(v.clone()), Encoding::Data).expect("heights")
            })
            .collect();
        let inputs = Inputs { also: &photos[1..], ..Inputs::new(&photos[0]) };
        let tile = run(&inputs, &draft(Symmetries::All, 72, 72), 2);
        let map = map_of(&tile);
        let flat = units(&tile.picture);
        for (kind, down) in [(MapKind::NormalGl, false), (MapKind::NormalDx, true)] {
            let maps: Vec<Picture> =
                all.iter().zip(sizes).map(|(v, (h, w))| normals(v, h, w, down)).collect();
            let out = map.apply_all(&[&maps[0], &maps[1]], kind).expect("normals");
            let mut seen = [0; 8];
            for i in
                (0..72 * 72).filter(|i| (1..71).contains(&(i / 72)) && (1..71).contains(&(i % 72)))
            {
                let beside =
                    [(i + 1, (0, 1)), (i - 1, (0, -1)), (i - 72, (-1, 0)), (i + 72, (1, 0))];
                if !beside.iter().all(|&(j, step)| coherent(map, i, j, step)) {
                    continue;
                }
                let want = normal(beside.map(|(j, _)| flat[j]), down);
                for (k, want) in want.into_iter().enumerate() {
                    let off = (out.samples().unit(i * 3 + k) - want).abs();
                    assert!(off < 1e-6, "{kind:?} {:?} channel {k}: {off}", map.origin(i));
                }
                seen[usize::from(map.origin(i).symmetry.code())] += 1;
            }
            assert!(seen.iter().all(|&n| n > 10), "symmetries inside pieces: {seen:?}");
        }
        let maps: Vec<Picture> =
            all.iter().zip(sizes).map(|(v, (h, w))| normals(v, h, w, false)).collect();
        let error = map.apply_all(&[&maps[0], &maps[1]], MapKind::Normal).expect_err("turned");
        assert!(matches!(error, Error::Parameter { name: "map", .. }), "{error}");
    }

    #[test]
    fn mirrors_and_half_turns_need_not_know_which_way_green_points() {
        let origin = |code| Origin { photo: 0, symmetry: Symmetry::ALL[code] };
        let v = Samples::U8(vec![200, 90, 225, 7]);
        let map = Picture::new(1, 1, 4, v, Encoding::Data).expect("a normal");
        for (code, want) in [(0, [200, 90]), (4, [55, 90]), (2, [55, 165]), (6, [200, 165])] {
            let source =
                SourceMap::of_views((1, 1), vec![(1, 1)], vec![[0, 0]], vec![origin(code)]);
            let source = source.expect("map");
            for kind in [MapKind::Normal, MapKind::NormalGl, MapKind::NormalDx] {
                let out = source.apply(&map, kind).expect("applied");
                let want = Samples::U8(vec![want[0], want[1], 225, 7]);
                assert_eq!(out.samples(), &want, "{kind:?} {code}");
            }
        }
    }

    #[test]
    fn each_map_keeps_its_depth_and_may_have_another_resolution() {
        let (photo, also) = (grain(40, 60, 1).picture(), [grain(50, 50, 2).picture()]);
        let inputs = Inputs { also: &also, ..Inputs::new(&photo) };
        let tile = run(&inputs, &draft(Symmetries::All, 48, 48), 2);
        let map = map_of(&tile);
        let ramp = |h: usize, w: usize| {
            let v = (0..h * w).map(|i| ((i % w) as f64 + 0.5) as f32 / w as f32).collect();
            Picture::new(h, w, 1, Samples::F32(v), Encoding::Data).expect("ramp")
        };
        let (full, double) = ([ramp(40, 60), ramp(50, 50)], ramp(80, 120));
        let exact = map.apply_all(&[&full[0], &full[1]], MapKind::Data).expect("full size");
        assert!(units(&exact) == gathered(&[&full[0], &full[1]], map));
        let mixed = map.apply_all(&[&double, &full[1]], MapKind::Data).expect("double size");
        let off = units(&mixed).into_iter().zip(units(&exact)).map(|(a, b)| (a - b).abs());
        assert!(off.fold(0.0, f64::max) < 1e-6, "the ramp is the same at any resolution");
        assert_eq!(exact.samples().dtype(), "float32");
    }

    #[test]
    fn maps_that_do_not_fit_the_photos() {
        let (photo, also) = (grain(40, 60, 1).picture(), [grain(50, 50, 2).picture()]);
        let inputs = Inputs { also: &also, ..Inputs::new(&photo) };
        let of = |h: usize, w: usize, samples: Samples| {
            Picture::new(h, w, 1, samples, Encoding::Data).expect("map")
        };
        let byte = |h: usize, w: usize| of(h, w, Samples::U8(vec![9; h * w]));
        let (a, b, flat) = (byte(40, 60), byte(50, 50), byte(20, 90));
        let deep = of(50, 50, Samples::U16(vec![9; 2500]));
        let params = draft(Symmetries::Rotate, 48, 48);
        let refusal = |maps: &[&Picture], kind| {
            inputs.ensure_maps_fit("blorb", maps, kind, &params).expect_err("refused")
        };
        assert!(inputs.ensure_maps_fit("blorb", &[&a, &b], MapKind::Data, &params).is_ok());
        for (maps, kind, says) in [
            (&[&a][..], ErrorKind::BadPicture, "the maps `blorb`: 1 given, 2 needed"),
            (&[&a, &flat], ErrorKind::SizeMismatch, "map 2 `blorb` is 90x20"),
            (
                &[&a, &deep],
                ErrorKind::BadPicture,
                "map 2 `blorb`: it is uint16 of 1 channels, data",
            ),
        ] {
            let error = refusal(maps, MapKind::Data);
            assert!(error.kind() == kind && error.to_string().starts_with(says), "{error}");
        }
        let error = refusal(&[&a, &b], MapKind::Normal);
        assert!(error.to_string().contains("normal_gl (green points up)"), "{error}");
        let params = draft(Symmetries::Mirror, 48, 48);
        assert!(inputs.ensure_maps_fit("blorb", &[&a, &b], MapKind::Normal, &params).is_ok());
    }
}

mod refused {
    use super::*;

    #[test]
    fn photos_that_do_not_go_together() {
        let photo = grain(60, 60, 1).picture();
        let refusal = |also: Picture, params: &TileParams| {
            let also = [also];
            let ctx = Ctx::new(0, 1).expect("pool");
            let inputs = Inputs { also: &also, ..Inputs::new(&photo) };
            tiles(&ctx, &inputs, params, 1).expect_err("refused")
        };
        let params = draft(Symmetries::None, 48, 48);
        let gray = Picture::new(60, 60, 1, Samples::U8(vec![7; 3600]), Encoding::Srgb);
        let deep = Samples::U16(vec![7; 60 * 60 * 3]);
        let deep = Picture::new(60, 60, 3, deep, Encoding::Srgb).expect("deep");
        for (other, says) in [(gray.expect("gray"), "1 channels"), (deep, "uint16")] {
            let error = refusal(other, &params);
            assert_eq!(error.kind(), ErrorKind::BadPicture, "{error}");
            let text = error.to_string();
            assert!(text.starts_with("photo 2: it is ") && text.contains(says), "{text}");
        }
        let error = refusal(grain(6, 60, 1).picture(), &params);
        assert_eq!(error.kind(), ErrorKind::TooSmall);
        assert!(error.to_string().starts_with("photo 2 is 60x6"), "{error}");
        let blend = TileParams { method: Method::MakeSeamless, ..params };
        let error = refusal(photo.clone(), &blend);
        assert!(matches!(error, Error::Parameter { name: "also", .. }), "{error}");
        let turned = TileParams { symmetry: Symmetries::Rotate, ..blend };
        let ctx = Ctx::new(0, 1).expect("pool");
        let error = tiles(&ctx, &Inputs::new(&photo), &turned, 1).expect_err("blends");
        assert!(matches!(error, Error::Parameter { name: "symmetry", .. }), "{error}");
    }

    #[test]
    fn nan_in_a_further_photo() {
        let of = |bad: f32| {
            let mut v = vec![0.5_f32; 3600];
            v[61] = bad;
            Picture::new(60, 60, 1, Samples::F32(v), Encoding::Linear).expect("photo")
        };
        let (photo, also) = (of(0.4), [of(f32::NAN)]);
        let inputs = Inputs { also: &also, ..Inputs::new(&photo) };
        let ctx = Ctx::new(0, 1).expect("pool");
        let error = tiles(&ctx, &inputs, &draft(Symmetries::None, 48, 48), 1).expect_err("NaN");
        assert!(matches!(error, Error::NotFinite { y: 1, x: 1, .. }), "{error}");
        assert!(error.to_string().starts_with("photo 2 holds"), "{error}");
    }

    #[test]
    fn the_memory_of_all_views_is_reckoned_with() {
        let photo = [(4000, 6000)];
        let of = |n: usize| memory_bytes(&photo, &Symmetry::ALL[..n], (2048, 2048)).expect("fits");
        // Codes of every view at every level, and what of them is usable: 20 bytes a pixel.
        assert!(of(8) > 4 * of(1) && of(8) > 20 * 24_000_000 * 8, "{} MiB", of(8) >> 20);
        assert!(of(4) > of(2) && of(2) > of(1));
        let many = vec![(60_000, 60_000); 2];
        assert!(memory_bytes(&many, &Symmetry::ALL[..1], (64, 64)).is_none());
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]
        /// Whatever is asked: a tile of named, usable pixels, or an error that is the asker's.
        #[test]
        fn whatever_is_asked(
            sizes in prop::collection::vec((3..40_usize, 3..40_usize), 1..4),
            size in (3..50_usize, 3..50_usize),
            symmetry in prop::sample::select(SYMMETRIES.to_vec()),
            patch in (1..4_usize).prop_map(|n| 2 * n + 1),
            seed: u64,
        ) {
            let photo = |(i, &(h, w)): (usize, &(usize, usize))| {
                let v = (0..h * w * 3).map(|k| Rng::new(seed, 5, i as u32, k as u64).next_u32() as u8);
                Picture::new(h, w, 3, Samples::U8(v.collect()), Encoding::Srgb).expect("photo")
            };
            let photos: Vec<Picture> = sizes.iter().enumerate().map(photo).collect();
            let params = TileParams { patch, ..draft(symmetry, size.1, size.0) };
            let inputs = Inputs { also: &photos[1..], ..Inputs::new(&photos[0]) };
            let ctx = Ctx::new(seed, 2).expect("pool");
            match tiles(&ctx, &inputs, &params, 1) {
                Ok(tiles) => {
                    let all: Vec<&Picture> = photos.iter().collect();
                    let map = map_of(&tiles[0]);
                    prop_assert!(units(&tiles[0].picture) == gathered(&all, map));
                }
                Err(error) => {
                    let sides = sizes.iter().chain([&size]).map(|s| s.0.min(s.1));
                    let small = sides.min().is_some_and(|side| side < patch);
                    prop_assert!(small && error.kind() == ErrorKind::TooSmall, "{}", error);
                }
            }
        }
    }
}

mod program {
    use super::*;

    fn quick<'a>(more: &[&'a str]) -> Vec<&'a str> {
        let mut args =
            vec!["tile", "photo.png", "-o", "tile.png", "--size", "48", "--quality", "draft"];
        args.extend(more);
        args
    }

    fn folder() -> Folder {
        let folder = Folder::with_photo();
        folder.rgb("b.png", 80, 70, 7);
        folder.rgb("n1.png", 96, 96, 3);
        folder.rgb("n2.png", 80, 70, 4);
        folder
    }

    #[test]
    fn photos_are_mixed_and_maps_follow_now_and_later() {
        let folder = folder();
        let mixed = ["--also", "b.png", "--symmetry", "all", "--save-source-map", "s.exr"];
        // The photos themselves as maps: they must agree with the tile pixel by pixel.
        let maps = ["--map", "emission=photo.png", "--map", "emission=b.png"];
        let normals = ["--map", "normal_gl=n1.png", "--map", "nor_gl=n2.png", "--json"];
        let output = folder.run(quick(&[&mixed[..], &maps, &normals].concat()));
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let v: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
        assert_eq!((&v["also"][0]["path"], &v["also"][0]["width"]), (&"b.png".into(), &80.into()));
        assert_eq!(v["params"]["symmetry"], "all");
        assert!(folder.png("tile.png") == folder.png("tile_emission.png"));
        let apply = ["apply", "s.exr", "photo.png", "--also", "b.png", "-o", "late.png"];
        folder.does(&[&apply[..], &["--kind", "color"]].concat());
        assert!(folder.png("late.png") == folder.png("tile.png"));
        let apply = ["apply", "s.exr", "n1.png", "--also", "n2.png", "-o", "late_n.png"];
        folder.does(&[&apply[..], &["--kind", "normal_gl"]].concat());
        assert!(folder.png("late_n.png") == folder.png("tile_normal_gl.png"));
        folder.does(&[&apply[..5], &["-o", "dx.png", "--kind", "normal_dx"]].concat());
        assert!(folder.png("dx.png") != folder.png("late_n.png"), "green the other way");
        folder.refuses(
            &[&apply[..5], &["-o", "x.png", "--kind", "normal"]].concat(),
            2,
            "normal_gl",
        );
        let alone = ["apply", "s.exr", "n1.png", "-o", "x.png", "--kind", "data"];
        folder.refuses(&alone, 1, "1 given, 2 needed");
    }

    #[test]
    fn one_photo_turned_is_another_tile() {
        let folder = Folder::with_photo();
        folder.does(&quick(&[]));
        let plain = folder.png("tile.png");
        for word in ["mirror", "rotate", "all"] {
            folder.does(&quick(&["--force", "--symmetry", word]));
            assert!(folder.png("tile.png") != plain, "{word}");
        }
        folder.does(&quick(&["--force", "--symmetry", "none"]));
        assert!(folder.png("tile.png") == plain);
    }

    #[test]
    fn maps_beside_the_photos_are_taken_if_all_have_them() {
        let folder = folder();
        folder.grey16("photo_height.png", 96, 96, 2);
        folder.grey16("b_height.png", 80, 70, 2);
        folder.grey16("photo_rough.png", 96, 96, 2);
        folder.rgb("photo_normal.png", 96, 96, 2);
        folder.rgb("b_normal.png", 80, 70, 2);
        let said = folder.does(&quick(&["--also", "b.png", "--symmetry", "rotate"]));
        assert!(said.contains("photo_rough.png was left alone: not every photo has"), "{said}");
        assert!(
            said.contains("photo_normal.png was left alone: `map` must be normal_gl"),
            "{said}"
        );
        assert!(folder.png("tile_height.png").deep);
        assert!(!folder.at("tile_roughness.png").exists());
        assert!(!folder.at("tile_normal.png").exists());
    }

    #[test]
    fn what_cannot_be_is_refused_in_one_sentence() {
        let folder = folder();
        folder.grey16("grey.png", 96, 96, 1);
        folder.rgb("tiny.png", 9, 9, 1);
        folder.refuses(&quick(&["--also", "grey.png"]), 1, "photo 2: it is uint16 of 1 channels");
        folder.refuses(&quick(&["--also", "missing.png"]), 1, "missing.png");
        folder.refuses(&quick(&["--also", "tiny.png"]), 1, "photo 2 is 9x9");
        folder.refuses(&quick(&["--symmetry", "some"]), 2, "--symmetry");
        let blend = ["--method", "make-seamless"];
        folder.refuses(&quick(&[&blend[..], &["--also", "b.png"]].concat()), 2, "`also`");
        folder.refuses(&quick(&[&blend[..], &["--symmetry", "all"]].concat()), 2, "`symmetry`");
        let once = ["--also", "b.png", "--map", "height=n1.png"];
        folder.refuses(&quick(&once), 2, "so height twice, got once");
        let turned = ["--symmetry", "rotate", "--map", "normal=n1.png"];
        folder.refuses(&quick(&turned), 2, "normal_gl (green points up)");
        let own = ["tile", "photo.png", "--also", "b.png", "-o", "b.png", "--force"];
        folder.refuses(&own, 1, "also an input");
    }
}
