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
