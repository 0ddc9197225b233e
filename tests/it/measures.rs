//! The stationarity measures, end to end.

use texforge::{
    Axis, Ctx, Encoding, Error, Measure, Method, Picture, Quality, Samples, Simd, Size, Tile,
    TileParams, tile,
};

use crate::support::Folder;
use crate::support::exemplar::{Exemplar, grain, stained};

/// Every measure and order.
const MEASURES: [(Measure, usize); 6] = [
    (Measure::Histogram, 2),
    (Measure::Moments, 1),
    (Measure::Moments, 2),
    (Measure::Moments, 3),
    (Measure::Moments, 4),
    (Measure::Steerable, 2),
];

fn params(measure: Measure, order: usize, side: usize) -> TileParams {
    let size = Size::Pixels { width: side, height: side };
    TileParams { size, measure, order, ..Default::default() }
}

fn made(photo: &Picture, params: &TileParams) -> Tile {
    tile(&Ctx::new(0, 2).expect("pool"), photo, None, params).expect("a tile")
}

#[test]
fn same_bytes_for_any_number_of_threads_and_any_instructions() {
    let photo = stained(72, 80, 1).picture();
    for (measure, order) in MEASURES {
        for axis in [Axis::Both, Axis::X] {
            let quality = Quality::Draft;
            let params = TileParams { axis, quality, ..params(measure, order, 60) };
            let run = |threads: usize, simd: Simd| {
                let mut ctx = Ctx::new(3, threads).expect("pool");
                ctx.simd = simd;
                let tile = tile(&ctx, &photo, None, &params).expect("a tile");
                (tile.picture, tile.report.costs)
            };
            let want = run(1, Simd::Scalar);
            for (threads, simd) in
                [(2, Simd::Avx2), (5, Simd::Avx512), (1, Simd::Avx512Vnni), (5, Simd::Scalar)]
            {
                let got = run(threads, simd);
                assert!(got == want, "{measure:?} {order}, {axis:?}: {threads}, {simd:?}");
            }
        }
    }
}

/// A stain; for the filters, grain that gets rougher from left to right.
fn uneven(measure: Measure, seed: u64) -> Picture {
    if measure != Measure::Steerable {
        return stained(160, 160, seed).picture();
    }
    let fine = grain(160, 160, seed);
    let rough = |y: usize, x: usize| {
        fine.rgb[y * 160 + x].map(|v| 0.5 + (0.1 + 0.9 * x as f64 / 160.0) * (v - 0.5))
    };
    Exemplar::from_fn(160, 160, rough).picture()
}

/// Each measure lowers its own cost against the baseline without any. The filters do so the least:
/// within a window there are few patches, and they are copied whole.
#[test]
fn each_measure_evens_out_what_it_measures() {
    for (measure, order) in MEASURES {
        let mut ratios: Vec<f64> = (1..=5)
            .map(|seed| {
                let photo = uneven(measure, seed);
                let cost = |method| {
                    let params = TileParams { method, ..params(measure, order, 112) };
                    made(&photo, &params).report.costs.stationarity_by_measure.expect("a measure")
                };
                cost(Method::Stationary) / cost(Method::WrapOnly)
            })
            .collect();
        ratios.sort_by(f64::total_cmp);
        let most = if measure == Measure::Steerable { 0.9 } else { 0.5 };
        assert!(ratios[2] < most, "{measure:?} {order}: {ratios:.2?} of wrap-only's cost");
    }
}

#[test]
fn the_histogram_cost_is_always_there_and_always_the_same() {
    let photo = stained(96, 96, 1).picture();
    let cost = |method, measure, order| {
        let params = TileParams { method, ..params(measure, order, 64) };
        made(&photo, &params).report.costs
    };
    // The baseline's picture does not depend on the measure.
    let want = cost(Method::WrapOnly, Measure::Histogram, 2);
    assert_eq!(want.stationarity_by_measure, Some(want.stationarity));
    for (measure, order) in MEASURES {
        let costs = cost(Method::WrapOnly, measure, order);
        assert_eq!(costs.stationarity, want.stationarity, "{measure:?} {order}");
        let other = costs.stationarity_by_measure.expect("a measure");
        assert_eq!(other == want.stationarity, measure == Measure::Histogram, "{measure:?}");
    }
    assert_eq!(cost(Method::Stationary, Measure::None, 2).stationarity_by_measure, None);
}

#[test]
fn constant_and_enormous_pictures_do_no_harm() {
    let exemplar = grain(40, 44, 3);
    for (measure, order) in MEASURES {
        let params = TileParams { quality: Quality::Draft, ..params(measure, order, 32) };
        let gray = exemplar.with(1, Samples::U8(vec![77; 40 * 44]), Encoding::Srgb);
        let tile = made(&gray, &params);
        assert_eq!(tile.picture.samples(), &Samples::U8(vec![77; 32 * 32]));
        let cost = tile.report.costs.stationarity_by_measure.expect("a measure");
        assert!((0.0..1e-4).contains(&cost), "{measure:?} {order}: {cost}");
        let huge = exemplar.rgb.iter().map(|px| px[0] * 1e30).collect();
        let tile = made(&exemplar.with(1, Samples::F64(huge), Encoding::Linear), &params);
        let cost = tile.report.costs.stationarity_by_measure.expect("a measure");
        assert!(cost.is_finite(), "{measure:?} {order}: {cost}");
    }
}

#[test]
fn orders_that_are_none_and_orders_of_nothing_are_refused() {
    let photo = grain(48, 48, 1).picture();
    let refusal = |measure, order| {
        tile(&Ctx::new(0, 1).expect("pool"), &photo, None, &params(measure, order, 32))
            .expect_err("refused")
    };
    for order in [0, 5] {
        let error = refusal(Measure::Moments, order);
        assert!(matches!(error, Error::Parameter { name: "order", .. }), "{error}");
        assert_eq!(error.to_string(), format!("`order` must be 1 to 4, got {order}"));
    }
    for measure in [Measure::Histogram, Measure::Steerable, Measure::None] {
        let error = refusal(measure, 3);
        let said = "`order` must be left out unless the measure is `moments`, got 3";
        assert_eq!(error.to_string(), said, "{measure:?}");
    }
}

#[test]
fn the_command_line_knows_them() {
    let folder = Folder::with_photo();
    let args = |more: &[&'static str]| {
        let tile = ["tile", "photo.png", "-o", "tile.png", "--size", "48", "--force", "--measure"];
        [&tile[..], more].concat()
    };
    let said = folder.does(&args(&["moments", "--order", "4"]));
    assert!(said.contains("stationarity cost") && said.contains(" (by moments: "), "{said}");
    let said = folder.does(&args(&["steerable"]));
    assert!(said.contains(" (by steerable: "), "{said}");
    let refused = folder.run(args(&["moments", "--order", "5"]));
    let said = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert!(!refused.status.success() && said.contains("`order` must be 1 to 4, got 5"), "{said}");
}

mod sigma_map {
    use super::*;
    use texforge::image::color::ColorModel;
    use texforge::signal::measure::Statistic;
    use texforge::signal::window::{Domain, Window};
    use texforge::{ErrorKind, Inputs, SigmaMap, tiles};

    const SIDE: usize = 128;

    fn map(side: usize, sigma: impl Fn(usize) -> f32) -> SigmaMap {
        let values = (0..side * side).map(|i| sigma(i % side)).collect();
        let picture = Picture::new(side, side, 1, Samples::F32(values), Encoding::Data);
        SigmaMap::from_picture(&picture.expect("picture")).expect("a map")
    }

    fn guided(photo: &Picture, map: &SigmaMap, seed: u64, params: &TileParams) -> Tile {
        let inputs = Inputs { sigma_map: Some(map), ..Inputs::new(photo) };
        let ctx = Ctx::new(seed, 2).expect("pool");
        tiles(&ctx, &inputs, params, 1).expect("a tile").remove(0)
    }

    /// How uneven the left and the right half are within a small window.
    fn halves(photo: &Picture, tile: &Picture) -> [f64; 2] {
        let model = ColorModel::new(photo);
        let mut lab = model.averaging_pixels(tile);
        model.space().convert_row(&mut lab);
        [0, SIDE / 2].map(|x0| {
            let rows = (0..SIDE).flat_map(|y| &lab[y * SIDE + x0..][..SIDE / 2]);
            let half: Vec<[f32; 3]> = rows.copied().collect();
            let domain = Domain { height: SIDE, width: SIDE / 2, wrap_y: true, wrap_x: false };
            Statistic::Histogram.cost(&half, domain, &Window::even(0.05 * SIDE as f64))
        })
    }

    #[test]
    fn where_sigma_is_small_small_things_are_evened_out() {
        let small_left = map(SIDE, |x| if x < SIDE / 2 { 0.04 } else { 0.6 });
        let small_right = map(SIDE, |x| if x < SIDE / 2 { 0.6 } else { 0.04 });
        for (measure, order) in [(Measure::Histogram, 2), (Measure::Moments, 2)] {
            let mut ratios: Vec<f64> = (0..5)
                .map(|seed| {
                    let photo = stained(176, 176, seed + 1).picture();
                    let params = params(measure, order, SIDE);
                    let left_to_right = |map: &SigmaMap| {
                        let tile = guided(&photo, map, seed, &params);
                        let [left, right] = halves(&photo, &tile.picture);
                        left / right
                    };
                    left_to_right(&small_left) / left_to_right(&small_right)
                })
                .collect();
            ratios.sort_by(f64::total_cmp);
            assert!(ratios[2] < 0.7, "{measure:?}: {ratios:.2?} of the unevenness");
        }
    }

    #[test]
    fn same_bytes_for_any_number_of_threads_and_any_instructions() {
        let photo = stained(72, 80, 1).picture();
        let map = map(60, |x| 0.03 + 0.005 * x as f32);
        for (measure, order) in [MEASURES[0], MEASURES[4], MEASURES[5]] {
            // The axis that does not wrap has an apron, which the map must follow.
            let axis = Axis::Y;
            let params = TileParams { axis, quality: Quality::Draft, ..params(measure, order, 60) };
            let run = |threads: usize, simd: Simd| {
                let mut ctx = Ctx::new(3, threads).expect("pool");
                ctx.simd = simd;
                let inputs = Inputs { sigma_map: Some(&map), ..Inputs::new(&photo) };
                let tile = tiles(&ctx, &inputs, &params, 1).expect("a tile").remove(0);
                (tile.picture, tile.report.costs)
            };
            let want = run(1, Simd::Scalar);
            for (threads, simd) in [(2, Simd::Avx2), (5, Simd::Avx512Vnni)] {
                assert!(run(threads, simd) == want, "{measure:?} {order}");
            }
        }
    }

    #[test]
    fn a_map_of_another_size_is_refused() {
        let photo = grain(64, 64, 1).picture();
        let map = map(31, |_| 0.1);
        let inputs = Inputs { sigma_map: Some(&map), ..Inputs::new(&photo) };
        let ctx = Ctx::new(0, 1).expect("pool");
        let params = params(Measure::Histogram, 2, 32);
        let error = tiles(&ctx, &inputs, &params, 1).expect_err("refused");
        assert_eq!(error.kind(), ErrorKind::SizeMismatch);
        let said = "the sigma map is 31x31 pixels, expected 32x32; \
                    a sigma map must have the size of the tile";
        assert_eq!(error.to_string(), said);
    }

    #[test]
    fn on_the_command_line() {
        let folder = Folder::with_photo();
        folder.mask("halves.png", 48, |x, _| x >= 24);
        folder.mask("small.png", 47, |x, _| x >= 24);
        folder.mask("black.png", 48, |_, _| false);
        let args = |map: &'static str| {
            ["tile", "photo.png", "-o", "tile.png", "--size", "48", "--sigma-map", map]
        };
        folder.refuses(&args("small.png"), 1, "the sigma map is 47x47");
        folder.refuses(&args("black.png"), 1, "the sigma map: it is black everywhere");
        folder.refuses(&args("nowhere.png"), 1, "nowhere.png");
        folder.does(&args("halves.png"));
        assert_eq!(folder.png("tile.png").width, 48);
    }
}
