//! The exact texture cost against its definition, and the costs of every iteration.

use texforge::analyze::stationarity::histogram_cost;
use texforge::image::color::ColorModel;
use texforge::method::stationary::{self, Look};
use texforge::search::patchmatch::Wrap;
use texforge::signal::measure::Statistic;
use texforge::signal::window::Domain;
use texforge::{
    Axis, Ctx, Encoding, Error, Inputs, MapKind, Mask, Method, Picture, Quality, Result, Samples,
    Simd, Size, SourceMap, Symmetries, TextureCost, TextureCostParams, Tile, TileParams,
    texture_cost, tile, tiles,
};

use crate::support::exemplar::{grain, hash, pebbles, stained};

const ALL: usize = 1_000_000;

fn ctx(seed: u64) -> Ctx {
    Ctx::new(seed, 2).expect("pool")
}

/// L*a*b* as the photo's model has it.
fn lab(photo: &Picture, picture: &Picture) -> Vec<[f32; 3]> {
    let model = ColorModel::new(photo);
    let mut lab = model.averaging_pixels(picture);
    model.space().convert_row(&mut lab);
    lab
}

/// The mean distance of the patches of `tile` whose top left corners are below `rows`, `cols` to the
/// nearest patch of `photo` that `usable` allows: paper eq. 5 word by word.
fn naive(
    photo: &Picture,
    tile: &Picture,
    patch: usize,
    (rows, cols): (usize, usize),
    usable: &dyn Fn(usize, usize) -> bool,
) -> f64 {
    let (e, f) = (lab(photo, photo), lab(photo, tile));
    let (h, w, ew) = (tile.height(), tile.width(), photo.width());
    let offsets: Vec<_> = (0..patch * patch).map(|d| (d / patch, d % patch)).collect();
    let distance = |ty: usize, tx: usize, sy: usize, sx: usize| -> f64 {
        let pixel = |&(dy, dx): &(usize, usize)| {
            let (a, b) = (f[(ty + dy) % h * w + (tx + dx) % w], e[(sy + dy) * ew + sx + dx]);
            (0..3).map(|k| f64::from(a[k] - b[k]).powi(2)).sum::<f64>()
        };
        offsets.iter().map(pixel).sum()
    };
    let all = (0..=photo.height() - patch)
        .flat_map(|sy| (0..=ew - patch).map(move |sx| (sy, sx)))
        .filter(|&(sy, sx)| offsets.iter().all(|&(dy, dx)| usable(sy + dy, sx + dx)));
    let all: Vec<_> = all.collect();
    let nearest = |i: usize| {
        let distances = all.iter().map(|&(sy, sx)| distance(i / cols, i % cols, sy, sx));
        distances.fold(f64::MAX, f64::min)
    };
    (0..rows * cols).map(nearest).sum::<f64>() / (rows * cols * patch * patch) as f64
}

fn exact(photo: &Picture, tile: &Picture, mask: Option<&Mask>, patch: usize) -> TextureCost {
    let params = TextureCostParams { patch, samples: ALL, ..Default::default() };
    texture_cost(&ctx(0), tile, photo, None, mask, &params).expect("a cost")
}

fn close(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-9 * b.abs()
}

fn draft(width: usize, height: usize, patch: usize) -> TileParams {
    let size = Size::Pixels { width, height };
    TileParams { size, patch, quality: Quality::Draft, ..Default::default() }
}

mod nearest {
    use super::*;

    fn tiled(photo: &Picture, patch: usize) -> Tile {
        tile(&ctx(1), photo, None, &draft(22, 19, patch)).expect("a tile")
    }

    #[test]
    fn every_patch_compared_is_the_definition() {
        let photos = [grain(31, 36, 1), pebbles(31, 36, 2), stained(31, 36, 3)];
        for (patch, photo) in [3, 5, 7].into_iter().zip(photos) {
            let photo = photo.picture();
            let tile = tiled(&photo, patch);
            let cost = exact(&photo, &tile.picture, None, patch);
            let naive = naive(&photo, &tile.picture, patch, (19, 22), &|_, _| true);
            assert!(close(cost.mean, naive), "{cost:?} is not {naive}");
            assert_eq!((cost.margin, cost.samples), (0.0, 19 * 22));
            // With the source map, only what is not wholly copied needs a search.
            let params = TextureCostParams { patch, samples: ALL, ..Default::default() };
            let map = tile.source_map.as_ref();
            let cost = texture_cost(&ctx(0), &tile.picture, &photo, map, None, &params);
            let cost = cost.expect("a cost");
            assert!(close(cost.mean, naive), "with a map: {cost:?} is not {naive}");
            assert!(cost.margin == 0.0 && (patch > 3 || cost.samples < 19 * 22), "{cost:?}");
        }
    }

    #[test]
    fn a_strip_counts_whole_patches_only() {
        let photo = pebbles(31, 36, 4).picture();
        let tile = tiled(&photo, 5);
        for (axis, places) in [(Axis::X, (15, 22)), (Axis::Y, (19, 18))] {
            let params = TextureCostParams { axis, patch: 5, samples: ALL };
            let naive = naive(&photo, &tile.picture, 5, places, &|_, _| true);
            for map in [None, tile.source_map.as_ref()] {
                let cost = texture_cost(&ctx(0), &tile.picture, &photo, map, None, &params);
                let cost = cost.expect("a cost");
                assert!(close(cost.mean, naive), "{axis:?}: {cost:?} is not {naive}");
            }
        }
    }

    #[test]
    fn masked_and_transparent_patches_are_no_candidates() {
        let exemplar = grain(31, 36, 5);
        let (photo, hole) =
            (exemplar.picture(), |y: usize, x: usize| !(y / 6 + x / 8).is_multiple_of(3));
        let tile = tiled(&photo, 3);
        let usable = (0..31 * 36).map(|i| hole(i / 36, i % 36)).collect();
        let mask = Mask::new(31, 36, usable).expect("mask");
        let cost = exact(&photo, &tile.picture, Some(&mask), 3);
        let masked = naive(&photo, &tile.picture, 3, (19, 22), &hole);
        assert!(close(cost.mean, masked), "{cost:?} is not {masked}");
        // The tile was made without the mask: its source map names patches that it forbids.
        let params = TextureCostParams { patch: 3, samples: ALL, ..Default::default() };
        let map = tile.source_map.as_ref();
        let named = texture_cost(&ctx(0), &tile.picture, &photo, map, Some(&mask), &params);
        let named = named.expect("a cost");
        assert!(close(named.mean, masked), "{named:?} is not {masked}");
        let alpha = |photo: &Picture, visible: &dyn Fn(usize) -> bool| {
            let Samples::U8(rgb) = photo.samples() else { panic!("8 bits") };
            let rgba = |(i, px): (usize, &[u8])| [px[0], px[1], px[2], u8::from(visible(i)) * 255];
            let samples = rgb.chunks_exact(3).enumerate().flat_map(rgba).collect();
            let (h, w) = (photo.height(), photo.width());
            Picture::new(h, w, 4, Samples::U8(samples), Encoding::Srgb).expect("RGBA")
        };
        let cut = alpha(&photo, &|i| hole(i / 36, i % 36));
        assert_eq!(exact(&cut, &alpha(&tile.picture, &|_| true), None, 3), cost);
    }

    #[test]
    fn colours_that_the_photo_has_not_are_measured() {
        let photo = grain(31, 36, 6).picture();
        let white = Picture::new(9, 12, 3, Samples::U8(vec![255; 9 * 12 * 3]), Encoding::Srgb);
        let white = white.expect("white");
        let cost = exact(&photo, &white, None, 5);
        let naive = naive(&photo, &white, 5, (9, 12), &|_, _| true);
        assert!(close(cost.mean, naive), "{cost:?} is not {naive}");
    }

    #[test]
    fn same_bytes_for_any_number_of_threads_and_any_instructions() {
        let photo = pebbles(31, 36, 7).picture();
        let tile = tiled(&photo, 11);
        let params = TextureCostParams { samples: 60, ..Default::default() };
        let cost = |threads: usize, simd: Simd| {
            let mut ctx = Ctx::new(3, threads).expect("pool");
            ctx.simd = simd;
            let map = tile.source_map.as_ref();
            texture_cost(&ctx, &tile.picture, &photo, map, None, &params).expect("a cost")
        };
        let expected = cost(1, Simd::Scalar);
        for simd in [Simd::Scalar, Simd::Avx2, Simd::Avx512, Simd::Avx512Vnni] {
            assert_eq!(cost(3, simd), expected, "{simd:?}");
        }
    }

    #[test]
    fn samples_estimate_the_whole_without_bias_and_say_how_well() {
        let photo = stained(60, 64, 8).picture();
        let tile = tile(&ctx(1), &photo, None, &draft(44, 40, 7)).expect("a tile");
        let whole = exact(&photo, &tile.picture, None, 7).mean;
        let params = TextureCostParams { patch: 7, samples: 80, ..Default::default() };
        let mut margins = Vec::new();
        for map in [None, tile.source_map.as_ref()] {
            let cost = |seed: u64| {
                let cost = texture_cost(&ctx(seed), &tile.picture, &photo, map, None, &params);
                cost.expect("a cost")
            };
            let costs: Vec<TextureCost> = (0..400).map(cost).collect();
            let n = costs.len() as f64;
            let mean = costs.iter().map(|c| c.mean).sum::<f64>() / n;
            let spread = (costs.iter().map(|c| (c.mean - mean).powi(2)).sum::<f64>() / n).sqrt();
            // Four standard errors of the mean of 400.
            assert!((mean - whole).abs() < 4.0 * spread / n.sqrt(), "{mean} for {whole}");
            let inside = costs.iter().filter(|c| (c.mean - whole).abs() <= c.margin).count();
            // 380 expected, standard deviation 4.4, and some fewer as costs are skewed.
            assert!((355..=396).contains(&inside), "{inside} of 400 intervals hold it");
            assert!(costs.iter().all(|c| c.samples == 80), "as many as asked for");
            margins.push(costs.iter().map(|c| c.margin).sum::<f64>() / n);
        }
        assert!(margins[1] < 0.7 * margins[0], "a source map narrows little: {margins:?}");
    }

    #[test]
    fn what_cannot_be_compared_is_refused() {
        let photo = grain(31, 36, 9).picture();
        let default = TextureCostParams::default();
        let refused = |tile: &Picture, mask: Option<&Mask>, params: &TextureCostParams| {
            texture_cost(&ctx(0), tile, &photo, None, mask, params).expect_err("refused")
        };
        for (patch, samples) in [(4, 500), (23, 500), (5, 1), (5, 0), (5, 1_000_001)] {
            let params = TextureCostParams { patch, samples, ..default };
            let error = refused(&photo, None, &params);
            assert!(matches!(error, Error::Parameter { .. }), "{error}");
        }
        let grey =
            Picture::new(20, 20, 1, Samples::U8(vec![7; 400]), Encoding::Srgb).expect("grey");
        let deep = Picture::new(20, 20, 3, Samples::U16(vec![7; 1200]), Encoding::Srgb);
        for other in [grey, deep.expect("16 bits")] {
            let error = refused(&other, None, &default);
            assert!(matches!(error, Error::BadPicture { .. }), "{error}");
        }
        let small =
            Picture::new(8, 20, 3, Samples::U8(vec![7; 480]), Encoding::Srgb).expect("small");
        let error = refused(&small, None, &default);
        assert!(matches!(error, Error::TooSmall { height: 8, need: 11, .. }), "{error}");
        let nan = |v: f32| Picture::new(20, 20, 1, Samples::F32(vec![v; 400]), Encoding::Srgb);
        let error = texture_cost(
            &ctx(0),
            &nan(f32::NAN).expect("floats"),
            &nan(0.5).expect("floats"),
            None,
            None,
            &default,
        );
        assert!(matches!(error, Err(Error::NotFinite { .. })), "{error:?}");
        let map = SourceMap::new((31, 36), (31, 37), vec![[0, 0]; 31 * 36]).expect("map");
        let error = texture_cost(&ctx(0), &photo, &photo, Some(&map), None, &default);
        assert!(matches!(error, Err(Error::BadPicture { .. })), "{error:?}");
        let mask = |h: usize, w: usize, ok: bool| Mask::new(h, w, vec![ok; h * w]).expect("mask");
        let error = refused(&photo, Some(&mask(9, 9, true)), &default);
        assert!(matches!(error, Error::SizeMismatch { .. }), "{error}");
        let error = refused(&photo, Some(&mask(31, 36, false)), &default);
        assert!(matches!(error, Error::EmptyMask { usable: 0, patch: 11 }), "{error}");
        let stopped = ctx(0);
        stopped.job().cancel();
        let result = texture_cost(&stopped, &photo, &photo, None, None, &default);
        assert!(matches!(result, Err(Error::Cancelled)), "{result:?}");
    }
}

mod trace {
    use super::*;

    const METHODS: [Method; 3] = [Method::Stationary, Method::WrapOnly, Method::NoWrap];

    fn traced(photo: &Picture, params: &TileParams) -> Tile {
        tiles(&ctx(2), &Inputs { trace: true, ..Inputs::new(photo) }, params, 1)
            .expect("a tile")
            .remove(0)
    }

    #[test]
    fn watching_changes_nothing_and_ends_with_the_report() {
        let photo = stained(90, 100, 1).picture();
        for method in METHODS {
            for axis in [Axis::Both, Axis::X] {
                let params = TileParams { method, axis, ..draft(70, 64, 5) };
                let (on, off) =
                    (traced(&photo, &params), tile(&ctx(2), &photo, None, &params).expect("tile"));
                assert!(on.picture == off.picture, "{method:?}: other pixels");
                assert!(on.source_map == off.source_map, "{method:?}: other positions");
                assert_eq!(on.report.costs, off.report.costs, "{method:?}");
                assert!(off.trace.is_empty(), "not asked for");
                assert!(off.report.seconds.iter().all(|(stage, _)| *stage != "trace"));
                let last = on.trace.last().expect("steps");
                assert_eq!(last.costs, on.report.costs, "{method:?}, {axis:?}");
                // 64, 49, 38 pixels; several iterations at the coarsest level, 1 at each other.
                let steps: Vec<_> = on.trace.iter().map(|s| (s.level, s.iteration)).collect();
                let n = on.trace.iter().filter(|s| s.level == 2).count() as u32;
                assert!(n > 5, "{n} iterations");
                let coarsest = (1..=n).map(|i| (2, i));
                let expected: Vec<_> = coarsest.chain([(1, 1), (0, 1), (0, 2)]).collect();
                assert_eq!(steps, expected, "{method:?}");
            }
        }
    }

    #[test]
    fn pictures_of_every_kind_end_with_the_report() {
        let exemplar = grain(60, 64, 2);
        let mixed = |n: usize| -> Vec<u16> {
            let value = |i: usize| (hash(5, (i / n / 64) as i64, i as i64) * 65535.0) as u16;
            (0..60 * 64 * n).map(value).collect()
        };
        for (channels, encoding) in
            [(1, Encoding::Srgb), (2, Encoding::Data), (3, Encoding::Linear), (6, Encoding::Data)]
        {
            let photo = exemplar.with(channels, Samples::U16(mixed(channels)), encoding);
            let tile = traced(&photo, &draft(52, 50, 5));
            let last = tile.trace.last().expect("steps");
            assert_eq!(last.costs, tile.report.costs, "{channels} channels, {encoding:?}");
        }
        let blended = TileParams { method: Method::MakeSeamless, ..draft(50, 50, 5) };
        assert!(traced(&exemplar.picture(), &blended).trace.is_empty(), "no iterations");
    }

    fn watched(
        ctx: &Ctx,
        photo: &Picture,
        plan: &stationary::Plan,
        watch: stationary::Watch<'_>,
    ) -> Result<SourceMap> {
        let photos = [(photo, None)];
        let exemplar =
            stationary::Exemplar::new(ctx, &photos, Symmetries::None.list(), plan, true)?;
        stationary::run(ctx, &exemplar, plan, Some(watch))
    }

    #[test]
    fn every_step_has_the_costs_of_its_picture() {
        let photo = pebbles(80, 84, 3).picture();
        let params = TileParams { sigma: 0.2, ..draft(56, 52, 5) };
        let trace = traced(&photo, &params).trace;
        let plan = stationary::Plan {
            size: (52, 56),
            wrap: Wrap { y: true, x: true },
            evenness: Some(stationary::Evenness {
                statistic: Statistic::Histogram,
                sigma: 0.2,
                sigma_map: None,
            }),
            patch: 5,
            uniformity: params.uniformity,
            rarity: params.rarity,
            coarse_iterations: trace.iter().filter(|s| s.level == 1).count() as u32,
            periods: None,
            kept: None,
            fine_iterations: 1,
        };
        let mut seen = Vec::new();
        let mut watch = |look: &Look<'_>| {
            seen.push((look.level, look.iteration, measured(look)?));
            Ok(())
        };
        watched(&ctx(2), &photo, &plan, &mut watch).expect("a map");
        assert_eq!(seen.len(), trace.len());
        for ((level, iteration, (texture, stationarity)), step) in seen.iter().zip(&trace) {
            assert_eq!((*level, *iteration), (step.level, step.iteration));
            let costs = step.costs;
            assert!(close(costs.texture.expect("copied"), *texture), "{step:?} is not {texture}");
            assert!(close(costs.stationarity, *stationarity), "{step:?} is not {stationarity}");
        }
        assert!(
            seen[0].2.0 > 1.5 * seen[seen.len() - 3].2.0,
            "no iteration makes it like the photo: {seen:?}"
        );
    }

    /// Both costs of a look: distances of patches of 5 x 5 to those that the map names, window of a
    /// fifth of the shorter side.
    fn measured(look: &Look<'_>) -> Result<(f64, f64)> {
        let photo = &look.photos[0];
        let tile = look.map.apply(photo, MapKind::Color)?;
        let (e, f) = (lab(photo, photo), lab(photo, &tile));
        let (h, w) = (tile.height() as i64, tile.width() as i64);
        let (eh, ew) = (photo.height() as i64, photo.width() as i64);
        let mut sum = 0.0;
        for i in 0..h * w {
            let [sy, sx] = look.map.positions()[i as usize].map(i64::from);
            let (sy, sx) = (sy.clamp(2, eh - 3), sx.clamp(2, ew - 3));
            for d in 0..25 {
                let (dy, dx) = (d / 5 - 2, d % 5 - 2);
                let a = f[((i / w + dy).rem_euclid(h) * w + (i % w + dx).rem_euclid(w)) as usize];
                let b = e[((sy + dy) * ew + sx + dx) as usize];
                sum += (0..3).map(|k| f64::from(a[k] - b[k]).powi(2)).sum::<f64>();
            }
        }
        let (height, width) = (h as usize, w as usize);
        let domain = Domain { height, width, wrap_y: true, wrap_x: true };
        let sigma = f64::from(0.2_f32) * h.min(w) as f64;
        Ok((sum / (25 * h * w) as f64, histogram_cost(&f, domain, sigma)))
    }

    #[test]
    fn whoever_watches_can_end_it() {
        let photo = grain(60, 64, 4).picture();
        let plan = stationary::Plan {
            size: (40, 40),
            wrap: Wrap { y: true, x: true },
            evenness: None,
            patch: 5,
            uniformity: 1.0,
            rarity: 0.0,
            coarse_iterations: 5,
            periods: None,
            kept: None,
            fine_iterations: 1,
        };
        let mut looks = 0;
        let mut watch = |_: &Look<'_>| {
            looks += 1;
            if looks == 3 { Err(Error::Cancelled) } else { Ok(()) }
        };
        let result = watched(&ctx(0), &photo, &plan, &mut watch);
        assert!(matches!(result, Err(Error::Cancelled)), "{result:?}");
        assert_eq!(looks, 3);
    }
}
