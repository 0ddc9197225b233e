//! Procedural textures: fitting, pictures, points; on one thread, and the picture on all cores too.
//!
//! `cargo bench --bench noise`. Rates are in values of one octave: divide by channels times octaves for
//! pixels.

#![expect(clippy::unwrap_used, reason = "a program that stops at the first surprise")]

use std::hint::black_box;

use criterion::{Criterion, Throughput};
use texforge::base::rng::Rng;
use texforge::{
    Ctx, Encoding, Filter, MapKind, NamedMap, NoiseParams, NoiseTexture, Picture, RenderParams,
    SampleType, Samples, fit_noise,
};

/// Grain of `channels` channels that share some of it.
fn sand(side: usize, channels: usize) -> Picture {
    let sample = |i: usize| {
        let (pixel, channel) = ((i / channels) as u64, i % channels);
        let shared = Rng::new(1, 0, 0, pixel).below(90) + Rng::new(1, 1, 0, pixel).below(90);
        (shared + Rng::new(2, channel as u32, 0, pixel).below(40)) as u8
    };
    let samples = Samples::U8((0..side * side * channels).map(sample).collect());
    Picture::new(side, side, channels, samples, Encoding::Srgb).unwrap()
}

fn fitted(ctx: &Ctx, photo: &Picture, model: &str) -> NoiseTexture {
    let mut params = NoiseParams::default();
    params.set("model", model).unwrap();
    let map = NamedMap { name: "basecolor", kind: MapKind::Color, picture: photo };
    fit_noise(ctx, &[map], None, &params).unwrap().0
}

fn main() {
    let (one, all) = (Ctx::new(0, 1).unwrap(), Ctx::new(0, 0).unwrap());
    let (grey, colour) = (sand(512, 1), sand(512, 3));
    let texture = fitted(&one, &grey, "wavelet");

    // The answer first: a picture is its points, bit for bit, on any number of threads.
    let small = RenderParams { samples: SampleType::F32, ..RenderParams::new((90, 70)) };
    let picture = texture.render(&one, &small).unwrap().remove(0).2;
    let middles: Vec<[f64; 2]> =
        (0..90 * 70).map(|i| [(i % 90) as f64 + 0.5, (i / 90) as f64 + 0.5]).collect();
    let values = texture.at(&one, &middles, Filter::NONE).unwrap();
    assert_eq!(*picture.samples(), Samples::F32(values));
    assert_eq!(texture.render(&all, &small).unwrap().remove(0).2, picture);

    let mut bench = Criterion::default().without_plots().sample_size(10).configure_from_args();
    let mut group = bench.benchmark_group("fit 512x512");
    group.bench_function("grey", |b| b.iter(|| fitted(&one, black_box(&grey), "wavelet")));
    group.bench_function("RGB", |b| b.iter(|| fitted(&one, black_box(&colour), "wavelet")));
    group.bench_function("RGB, all cores", |b| {
        b.iter(|| fitted(&all, black_box(&colour), "wavelet"));
    });
    group.bench_function("RGB, oriented", |b| {
        b.iter(|| fitted(&one, black_box(&colour), "oriented"));
    });
    group.bench_function("RGB, tiling", |b| {
        b.iter(|| fitted(&one, black_box(&colour), "tiling"));
    });
    group.bench_function("RGB, tiling, all cores", |b| {
        b.iter(|| fitted(&all, black_box(&colour), "tiling"));
    });
    group.finish();

    let octaves = texture.document().terms().len() as u64;
    let params = RenderParams { samples: SampleType::F32, ..RenderParams::new((1024, 1024)) };
    let mut group = bench.benchmark_group("grey 1024x1024, values of one octave");
    group.throughput(Throughput::Elements(octaves * 1024 * 1024));
    for (name, ctx) in [("one thread", &one), ("all cores", &all)] {
        group.bench_function(name, |b| b.iter(|| texture.render(ctx, &params).unwrap()));
    }
    group.finish();

    let tiles = fitted(&one, &colour, "tiling");
    let mut group = bench.benchmark_group("RGB 1024x1024 of tiles, pixels");
    group.throughput(Throughput::Elements(1024 * 1024));
    for (name, ctx) in [("one thread", &one), ("all cores", &all)] {
        group.bench_function(name, |b| b.iter(|| tiles.render(ctx, &params).unwrap()));
    }
    group.finish();

    let place = |i: u64, axis: u32| f64::from(Rng::new(3, axis, 0, i).next_u32()) / 1e5;
    let points: Vec<[f64; 2]> = (0..1 << 16).map(|i| [0, 1].map(|axis| place(i, axis))).collect();
    let space: Vec<[f64; 3]> = (0..1 << 14).map(|i| [0, 1, 2].map(|axis| place(i, axis))).collect();
    let mut group = bench.benchmark_group("scattered points, one thread, values of one octave");
    group.throughput(Throughput::Elements(octaves << 16));
    group.bench_function("on the plane", |b| {
        b.iter(|| texture.at(&one, black_box(&points), Filter::NONE).unwrap());
    });
    group.throughput(Throughput::Elements(octaves << 14));
    group.bench_function("in space", |b| {
        b.iter(|| texture.solid(&one, black_box(&space), None, Filter::NONE).unwrap());
    });
    group.finish();
}
