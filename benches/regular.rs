//! A near-regular texture of 1024 x 1024 from a photo of 1024 x 1024, by wall time on all cores.
//!
//! `cargo bench --bench regular`.

#![expect(clippy::unwrap_used, reason = "a program that stops at the first surprise")]

use std::hint::black_box;

use criterion::Criterion;
use texforge::base::params::OrAuto;
use texforge::base::rng::Rng;
use texforge::{
    Ctx, Encoding, Guide, MapKind, Picture, RegularMaker, RegularParams, Samples, Size, regular,
};

/// Bricks of 64 x 32 pixels in running bond, each of a shade of its own, with grain.
fn wall(side: usize) -> Picture {
    let pixel = |i: usize| {
        let (y, x) = (i / side, i % side);
        let course = y / 32;
        let along = x + 32 * (course % 2);
        let grain = Rng::new(1, 0, 0, i as u64).below(16) as u8;
        let shade = Rng::new(2, 0, course as u32, (along / 64) as u64).below(50) as u8;
        let mortar = y % 32 < 4 || along % 64 < 4;
        if mortar { [200 + grain; 3] } else { [100 + shade + grain, 50 + shade, 40 + grain] }
    };
    let samples = Samples::U8((0..side * side).flat_map(pixel).collect());
    Picture::new(side, side, 3, samples, Encoding::Srgb).unwrap()
}

fn main() {
    let ctx = Ctx::new(0, 0).unwrap();
    let sized = |side| RegularParams {
        size: Size::Pixels { width: side, height: side },
        ..Default::default()
    };

    // The answer first: copies of the photo's pixels, the same on one thread.
    let photo = wall(256);
    let exact = RegularParams { feather: 0, flatten: OrAuto::Given(0.0), ..sized(300) };
    let made = regular(&ctx, &photo, None, &exact).unwrap();
    assert_eq!(made.source_map.apply(&photo, MapKind::Color).unwrap(), made.picture);
    let alone = regular(&Ctx::new(0, 1).unwrap(), &photo, None, &exact).unwrap();
    assert_eq!(alone.picture, made.picture);
    let [v1, v2] = made.report.lattice.unwrap();
    let cell = (v1[0] * v2[1] - v1[1] * v2[0]).abs();
    assert!((cell / (64.0 * 32.0) - 1.0).abs() < 0.02, "{v1:?} {v2:?}");

    let photo = wall(1024);
    let mut bench = Criterion::default().without_plots().sample_size(10).configure_from_args();
    let mut group = bench.benchmark_group("regular 1024x1024 from 1024x1024");
    group.bench_function("everything, the lattice to be found", |b| {
        b.iter(|| regular(&ctx, black_box(&photo), None, &sized(1024)).unwrap());
    });
    let given = RegularParams { lattice: Guide::Vectors([v1, v2]), ..sized(1024) };
    group.bench_function("everything, the lattice given", |b| {
        b.iter(|| regular(&ctx, black_box(&photo), None, &given).unwrap());
    });
    let maker = RegularMaker::new(&ctx, &photo, None, &given).unwrap();
    group.bench_function("synthesis alone", |b| b.iter(|| maker.make(&ctx, &[]).unwrap()));
    group.finish();
}
