//! Speed of the kernels, by CPU time on one thread. Each first proves its answer.
//!
//! `make bench`. With `TEXFORGE_BENCH_TABLE=FILE` the table of shares of the machine's limit is
//! also written to FILE.

#![expect(
    clippy::print_stdout,
    clippy::unwrap_used,
    reason = "a program that prints measurements and stops at the first surprise"
)]

mod common;

use std::fmt::Write as _;
use std::hint::black_box;

use common::{
    CpuTime, barnes, codes, each, exhaustive, median, nearest, noise_codes, pebbles, samples, timed,
};
use criterion::{BatchSize, BenchmarkId, Criterion};
use texforge::base::rng::Rng;
use texforge::search::field::{Field, Pos};
use texforge::search::patch::{
    Kernel, MatchImage, WithKernel, detected, distance_squared, with_kernel,
};
use texforge::search::patchmatch::{Search, Wrap, distances, pass};
use texforge::search::place_cost::PlaceCost;
use texforge::search::seams::{self, Canvas};
use texforge::search::source::Source;
use texforge::search::vote::vote;
use texforge::signal::autocorrelation::Autocorrelation;
use texforge::signal::histogram::{SOFT_BITS, SOFT_MAX, Soft};
use texforge::signal::measure::{Order, Statistic};
use texforge::signal::window::{Domain, Window};
use texforge::{Ctx, Simd};

type Bench = Criterion<CpuTime>;

const N: usize = 11;
const SIDE: usize = 512;
const TORUS: Wrap = Wrap { y: true, x: true };
const LEVELS: [Simd; 4] = [Simd::Scalar, Simd::Avx2, Simd::Avx512, Simd::Avx512Vnni];

fn main() {
    let ctx = Ctx::new(0, 1).unwrap();
    // Everything on the one worker of the pool, whose CPU time is measured.
    ctx.install(|| {
        let mut bench = Criterion::default()
            .with_measurement(CpuTime)
            .without_plots()
            .sample_size(20)
            .warm_up_time(std::time::Duration::from_millis(500))
            .measurement_time(std::time::Duration::from_secs(2))
            .configure_from_args();
        patch_distances(&mut bench);
        passes(&mut bench, &ctx);
        votes(&mut bench, &ctx);
        projection(&mut bench);
        settling(&mut bench, &ctx);
        autocorrelations(&mut bench);
        bench.final_summary();
        if !std::env::args().any(|a| a == "--test") {
            let table = limits(&ctx) + &quality(&ctx);
            println!("\n{table}");
            if let Some(file) = std::env::var_os("TEXFORGE_BENCH_TABLE") {
                std::fs::write(file, table).unwrap();
            }
        }
        Ok(())
    })
    .unwrap();
}

// ---------------------------------------------------------------------------------------------
// Patch distances

/// One held patch against the patches at many places of a picture.
struct Distances {
    image: MatchImage,
    /// Pixel indices.
    at: Vec<u32>,
}

impl Distances {
    /// Every position of a picture that fits into the first-level cache, round and round.
    fn hot() -> Self {
        let image = noise_codes(24, 24);
        let side = 24 - N + 1;
        let all: Vec<u32> = (0..side * side).map(|i| image.at(i / side, i % side) as u32).collect();
        let at = all.iter().copied().cycle().take(1 << 14).collect();
        Self { image, at }
    }

    /// Random positions.
    fn random(side: usize) -> Self {
        let image = noise_codes(side, side);
        let place = |i| {
            let mut rng = Rng::new(2, 0, 0, i);
            let n = (side - N + 1) as u32;
            image.at(rng.below(n) as usize, rng.below(n) as usize) as u32
        };
        let at = (0..1 << 14).map(place).collect();
        Self { image, at }
    }

    fn sum(&self, simd: Simd) -> i64 {
        struct Sum<'a>(&'a Distances);
        impl WithKernel for Sum<'_> {
            type Output = i64;
            #[inline(always)]
            fn run<K: Kernel>(self, kernel: K) -> i64 {
                let Distances { image, at } = self.0;
                let mut query = kernel.query();
                kernel.hold(&mut query, image, 0);
                at.iter().map(|&at| kernel.distance(&query, image, at as usize) as i64).sum()
            }
        }
        with_kernel(simd, N, Sum(self))
    }

    /// The same sum by the definition.
    fn expected(&self) -> i64 {
        let distance = |&at: &u32| distance_squared(&self.image, 0, &self.image, at as usize, N);
        self.at.iter().map(|at| i64::from(distance(at))).sum()
    }
}

fn levels() -> impl Iterator<Item = Simd> {
    LEVELS.into_iter().filter(|&simd| detected(simd) == simd)
}

fn patch_distances(bench: &mut Bench) {
    let mut group = bench.benchmark_group("patch distance 11x11");
    for (place, places) in [
        ("hot in L1", Distances::hot()),
        ("random in 512x512", Distances::random(512)),
        ("random in 2048x2048", Distances::random(2048)),
    ] {
        let expected = places.expected();
        group.throughput(each(places.at.len()));
        for simd in levels() {
            assert_eq!(places.sum(simd), expected, "{simd:?}, {place}");
            group.bench_function(BenchmarkId::new(format!("{simd:?}"), place), |b| {
                b.iter(|| black_box(&places).sum(simd));
            });
        }
    }
}

// ---------------------------------------------------------------------------------------------
// PatchMatch

/// A source, an output made of its pieces, and what is searched.
struct Scene {
    source: Source,
    target: MatchImage,
    usage: PlaceCost,
    wrap: Wrap,
    search: Search,
    field: Field,
}

impl Scene {
    /// The output is a quilt of pieces of the source, each pixel off by a little; the field is
    /// either the quilt's own or random.
    fn new(coherent: bool) -> Self {
        const PIECE: usize = 40;
        let source = Source::new(pebbles(SIDE, SIDE, 3), N, None).unwrap();
        let piece = |y: usize, x: usize| {
            let mut rng = Rng::new(4, 0, 0, ((y / PIECE) * SIDE + x / PIECE) as u64);
            let n = (source.rows() - PIECE) as u32;
            Pos::new(rng.below(n) as usize + y % PIECE, rng.below(n) as usize + x % PIECE)
        };
        let pos = (0..SIDE * SIDE).map(|i| piece(i / SIDE, i % SIDE)).collect();
        let quilt = Field { height: SIDE, width: SIDE, pos };
        let half = N / 2;
        let target = codes(SIDE + N - 1, SIDE + N - 1, |y, x| {
            let (y, x) = ((y + SIDE - half) % SIDE, (x + SIDE - half) % SIDE);
            let from = piece(y, x);
            let noise = Rng::new(5, 0, 0, (y * SIDE + x) as u64).next_u32().to_le_bytes();
            let px = source.image.pixel(from.y() + half, from.x() + half);
            std::array::from_fn(|k| px[k] + noise[k] % 4)
        });
        let field = if coherent { quilt } else { Field::random(SIDE, SIDE, &source, 6) };
        let usage = PlaceCost::of_usage(&field, &source, 500.0);
        let search = Search { pass: 0, radius: 32, n_random: 2, phase: None };
        Self { source, target, usage, wrap: TORUS, search, field }
    }

    fn pass(&self, ctx: &Ctx) -> Field {
        let mut field = self.field.clone();
        pass(ctx, &self.target, &self.source, &self.usage, self.wrap, self.search, &mut field)
            .unwrap();
        field
    }

    /// Patch comparisons that the pass cannot do without: for each output pixel its own match
    /// (the target has changed), the different positions that its two neighbours propose, and the
    /// random ones. (A position tried twice counts once; that a random one equals the best has a
    /// chance of some thousandths and is not subtracted.)
    fn comparisons(&self, after: &Field) -> usize {
        let mut count = 0;
        for y in 0..SIDE {
            for x in 0..SIDE {
                let own = self.field.pos[y * SIDE + x];
                // Pass 0 scans forward: left and upper neighbour are those of the new field.
                let beside =
                    after.pos[y * SIDE + (x + SIDE - 1) % SIDE].shifted(0, 1, &self.source);
                let above = after.pos[(y + SIDE - 1) % SIDE * SIDE + x].shifted(1, 0, &self.source);
                count += 1 + self.search.n_random as usize;
                count += usize::from(beside.is_some_and(|p| p != own));
                count += usize::from(above.is_some_and(|p| p != own && above != beside));
            }
        }
        count
    }

    /// Sum of the scores that the search minimizes, without the usage (which is kept equal by
    /// `PlaceCost::free` where this is asserted).
    fn cost(&self, field: &Field) -> i64 {
        let each = distances(Simd::default(), &self.target, &self.source, field);
        each.into_iter().map(i64::from).sum()
    }
}

fn passes(bench: &mut Bench, ctx: &Ctx) {
    let mut group = bench.benchmark_group("PatchMatch pass 512x512");
    for (name, coherent) in [("coherent field", true), ("random field", false)] {
        let mut scene = Scene::new(coherent);
        let usage = std::mem::replace(&mut scene.usage, PlaceCost::free(&scene.source));
        let before = distances(Simd::default(), &scene.target, &scene.source, &scene.field);
        let after = distances(Simd::default(), &scene.target, &scene.source, &scene.pass(ctx));
        assert!(before.iter().zip(&after).all(|(b, a)| a <= b), "{name}: a match got worse");
        let two = Ctx::new(0, 2).unwrap();
        let other = two.install(|| Ok(scene.pass(&two))).unwrap();
        assert_eq!(other.pos, scene.pass(ctx).pos, "{name}: depends on the number of threads");
        if !coherent {
            assert!(scene.cost(&other) * 2 < scene.cost(&scene.field), "{name}: hardly better");
        }
        scene.usage = usage;
        group.throughput(each(SIDE * SIDE));
        group.bench_function(name, |b| b.iter(|| scene.pass(ctx)));
    }
}

// ---------------------------------------------------------------------------------------------
// The other stages of an iteration

fn votes(bench: &mut Bench, ctx: &Ctx) {
    let mut group = bench.benchmark_group("vote 512x512");
    group.throughput(each(SIDE * SIDE));
    for (name, coherent) in [("coherent field", true), ("random field", false)] {
        let scene = Scene::new(coherent);
        let run = || vote(ctx.simd, &scene.field, &scene.source, TORUS);
        let votes = run();
        for i in samples(SIDE * SIDE, 200) {
            let (y, x) = (i / SIDE, i % SIDE);
            let mut sum = [0u32; 4];
            for dy in 0..N {
                for dx in 0..N {
                    // The patch whose pixel (dy, dx) lies here has its middle at:
                    let (cy, cx) = ((y + SIDE + N / 2 - dy) % SIDE, (x + SIDE + N / 2 - dx) % SIDE);
                    let from = scene.field.pos[cy * SIDE + cx];
                    let px = scene.source.image.pixel(from.y() + dy, from.x() + dx);
                    sum.iter_mut().zip(px).for_each(|(s, p)| *s += u32::from(p));
                }
            }
            let mean = sum.map(|s| f64::from(s) * f64::from(1u32 << SOFT_BITS) / (N * N) as f64);
            let near =
                votes.soft[i].iter().zip(mean).all(|(&s, m)| (f64::from(s) - m).abs() <= 1.0);
            assert!(near, "{name}: {:?}, not {mean:?} at {y}, {x}", votes.soft[i]);
        }
        group.bench_function(name, |b| b.iter(run));
    }
}

fn projection(bench: &mut Bench) {
    let domain = Domain { height: SIDE, width: SIDE, wrap_y: true, wrap_x: true };
    let window = Window::even(0.1 * SIDE as f64);
    let image = pebbles(SIDE, SIDE, 3);
    let pixels: Vec<Soft> = (0..SIDE * SIDE)
        .map(|i| {
            let (y, x) = (i / SIDE, i % SIDE);
            // A stain, as in a photo.
            let stain = if (y as f32 - 200.0).hypot(x as f32 - 300.0) < 80.0 { -20.0 } else { 0.0 };
            let [a, b, c, _] = image.pixel(y, x).map(f32::from);
            let soft = |v: f32| (v * (1 << SOFT_BITS) as f32).clamp(0.0, SOFT_MAX as f32) as u16;
            [a + stain, b, c, (a - b).abs()].map(soft)
        })
        .collect();
    let mut group = bench.benchmark_group("projection 512x512");
    group.throughput(each(SIDE * SIDE));
    for (name, statistic, left) in [
        ("histogram", Statistic::Histogram, 0.5),
        ("moments, order 1", Statistic::Moments(Order::Mean), 0.5),
        ("moments, order 2", Statistic::Moments(Order::Variance), 0.5),
        ("moments, order 3", Statistic::Moments(Order::Skewness), 0.5),
        ("moments, order 4", Statistic::Moments(Order::Kurtosis), 0.5),
        // Its responses overlap: one projection goes part of the way.
        ("steerable", Statistic::Steerable, 0.9),
    ] {
        let project = |pixels: &mut Vec<Soft>| statistic.project(pixels, domain, &window, 1.0);
        let uneven = |pixels: &[Soft]| {
            let colors: Vec<[f32; 3]> =
                pixels.iter().map(|px| [px[0], px[1], px[2]].map(f32::from)).collect();
            statistic.cost(&colors, domain, &window)
        };
        let mut even = pixels.clone();
        project(&mut even);
        let (before, after) = (uneven(&pixels), uneven(&even));
        assert!(after < left * before, "{name}: projected from {before} to {after} only");
        group.bench_function(name, |b| {
            b.iter_batched_ref(|| pixels.clone(), project, BatchSize::LargeInput);
        });
    }
}

fn settling(bench: &mut Bench, ctx: &Ctx) {
    const SWEEPS: u32 = 4;
    let mut scene = Scene::new(true);
    // Ragged borders between the pieces, as a search leaves them.
    scene.field = scene.pass(ctx);
    let half = (N / 2) as u32;
    let from: Vec<seams::From> =
        scene.field.pos.iter().map(|p| [p.y() as u32 + half, p.x() as u32 + half]).collect();
    let target = codes(SIDE, SIDE, |y, x| scene.target.pixel(y + N / 2, x + N / 2));
    let canvas = Canvas {
        source: &scene.source.image,
        atlas: &scene.source.atlas,
        usable: None,
        fixed: None,
        target: &target,
        wrap: scene.wrap,
    };
    let run = |from: &mut Vec<seams::From>| seams::settle(ctx, &canvas, from, SWEEPS).unwrap();
    // The number of neighbours from different pieces, weighted by how much they differ.
    let seam = |from: &[seams::From]| -> i64 {
        let color = |[y, x]: seams::From| {
            canvas.source.pixel((y as usize).min(SIDE - 1), (x as usize).min(SIDE - 1))
        };
        let difference = |a: [u8; 4], b: [u8; 4]| -> i64 {
            a.iter().zip(b).map(|(&a, b)| (a as i64 - b as i64).pow(2)).sum()
        };
        (0..SIDE * (SIDE - 1))
            .filter(|i| i % SIDE > 0)
            .map(|i| {
                let [y, x] = from[i];
                let right =
                    difference(color([y, x + 1]), color(from[i - i % SIDE + (i + 1) % SIDE]));
                right + difference(color([y + 1, x]), color(from[i + SIDE]))
            })
            .sum()
    };
    let mut settled = from.clone();
    run(&mut settled);
    assert!(settled != from, "nothing moved");
    assert!(seam(&settled) < seam(&from), "seams got worse");
    let mut group = bench.benchmark_group("seams 512x512");
    group.throughput(each(SIDE * SIDE));
    group.bench_function("4 sweeps", |b| {
        b.iter_batched_ref(|| from.clone(), run, BatchSize::LargeInput);
    });
}

// ---------------------------------------------------------------------------------------------
// Tables

/// Label, comparisons and work of one row of the table.
type Row<'a> = (String, usize, Box<dyn Fn() + 'a>);

/// The autocorrelation of a megapixel in color, beside the bare transforms that it needs: of three
/// planes and back, padded to twice the side, without moving rows to columns.
fn autocorrelations(bench: &mut Bench) {
    const SIDE: usize = 1024;
    let mut rng = Rng::new(1, 0, 0, 0);
    let cell: Vec<f32> = (0..3 * 32 * 32).map(|_| rng.below(256) as f32).collect();
    let value = |i: usize, k: usize| cell[(i / SIDE % 32 * 32 + i % 32) * 3 + k];
    let planes: Vec<Vec<f32>> =
        (0..3).map(|k| (0..SIDE * SIDE).map(|i| value(i, k)).collect()).collect();
    // Freed memory is kept, as in the program (`cli::keep_memory`): new pages would cost a fifth more.
    drop(black_box(Vec::<u8>::with_capacity(31 << 20)));
    let gamma = Autocorrelation::new(&planes, (SIDE, SIDE));
    assert!(gamma.at(32, -64) > 0.9999 && gamma.at(16, 7) < 0.9, "a period of 32");
    let mut group = bench.benchmark_group("autocorrelation");
    group.bench_function("1024x1024 RGB", |b| {
        b.iter(|| Autocorrelation::new(black_box(&planes), (SIDE, SIDE)));
    });
    let rows = realfft::RealFftPlanner::<f64>::new().plan_fft_forward(2 * SIDE);
    let columns = rustfft::FftPlanner::<f64>::new().plan_fft_forward(2 * SIDE);
    let (mut real, mut bins) = (rows.make_input_vec(), rows.make_output_vec());
    let mut column = vec![realfft::num_complex::Complex::new(0.0, 0.0); 2 * SIDE];
    group.bench_function("bare transforms", |b| {
        b.iter(|| {
            for _ in 0..4 * 2 * SIDE {
                rows.process(black_box(&mut real), &mut bins).unwrap();
            }
            for _ in 0..4 * (SIDE + 1) {
                columns.process(black_box(&mut column));
            }
        });
    });
    group.finish();
}

/// Comparisons per second of everything, against the hot kernel's, measured in turns.
fn limits(ctx: &Ctx) -> String {
    const TURNS: usize = 15;
    let best = detected(Simd::default());
    let hot = Distances::hot();
    let scenes = [Scene::new(true), Scene::new(false)];
    let counts = [0, 1].map(|i| scenes[i].comparisons(&scenes[i].pass(ctx)));
    let random = [Distances::random(512), Distances::random(2048)];
    let rate = |n: usize, work: &dyn Fn()| n as f64 / timed(work).0 / 1e6;
    let hot_rate = || {
        rate(hot.at.len() * 64, &|| {
            (0..64).for_each(|_| {
                black_box(hot.sum(best));
            });
        })
    };
    // What, comparisons, work.
    let mut rows: Vec<Row<'_>> = Vec::new();
    for (name, places) in ["random in 512x512", "random in 2048x2048"].iter().zip(&random) {
        let n = places.at.len() * 32;
        let work = move || {
            (0..32).for_each(|_| {
                black_box(places.sum(best));
            });
        };
        rows.push((format!("kernel, {name}"), n, Box::new(work)));
    }
    for ((name, scene), n) in ["coherent", "random"].iter().zip(&scenes).zip(counts) {
        let a_pixel = n as f64 / (SIDE * SIDE) as f64;
        let name = format!("PatchMatch pass, {name} field ({a_pixel:.1} comparisons a pixel)");
        rows.push((name, n, Box::new(move || drop(black_box(scene.pass(ctx))))));
    }
    let mut table = format!(
        "| {best:?}, 11 x 11, one thread | million comparisons/s | share of the L1 limit |\n\
         | --- | ---: | ---: |\n"
    );
    let hot_best = median((0..TURNS).map(|_| hot_rate()).collect());
    writeln!(table, "| kernel, hot in L1: the limit | {hot_best:.1} | 100 % |").unwrap();
    for (name, n, work) in rows {
        let (mut rates, mut shares) = (Vec::new(), Vec::new());
        for _ in 0..TURNS {
            let (before, achieved, after) = (hot_rate(), rate(n, &*work), hot_rate());
            rates.push(achieved);
            shares.push(100.0 * achieved / (0.5 * (before + after)));
        }
        let (rate, share) = (median(rates), median(shares));
        writeln!(table, "| {name} | {rate:.1} | {share:.0} % |").unwrap();
    }
    table
}

/// Error and time of nearest-neighbour fields against the exact ones.
fn quality(ctx: &Ctx) -> String {
    let target = pebbles(SIDE, SIDE, 11);
    let source = Source::new(pebbles(SIDE, SIDE, 3), N, None).unwrap();
    let width = SIDE - N + 1;
    // Root of the mean squared difference per channel, in 8-bit units (a code is two of them).
    let squared = |i: usize, pos: Pos| {
        let at = target.at(i / width, i % width);
        f64::from(distance_squared(&target, at, &source.image, source.at(pos), N)) * 4.0
    };
    let chosen: Vec<usize> = samples(width * width, 500).collect();
    let rms = |pos: &dyn Fn(usize) -> Pos| {
        let sum: f64 = chosen.iter().map(|&i| squared(i, pos(i))).sum();
        (sum / (chosen.len() * N * N * 3) as f64).sqrt()
    };
    let (seconds, exact) = timed(|| {
        let at = |&i: &usize| exhaustive(ctx.simd, &target, &source, i / width, i % width);
        chosen.iter().map(at).collect::<Vec<_>>()
    });
    let seconds = seconds * (width * width) as f64 / chosen.len() as f64;
    let floor = rms(&|i| exact[chosen.iter().position(|&c| c == i).unwrap()]);
    let mut table = format!(
        "\n| nearest-neighbour field, 512 x 512, 11 x 11, one thread | rms error a channel (0..255) | CPU s |\n\
         | --- | ---: | ---: |\n\
         | exact, by trying all (error from 500 positions, time scaled up) | {floor:.2} | {seconds:.0} |\n"
    );
    for (passes, n_random) in [(2, 8), (3, 8), (5, 4), (5, 8), (7, 8), (10, 8), (20, 8)] {
        let (seconds, field) = timed(|| nearest(ctx, &target, &source, passes, n_random).unwrap());
        let error = rms(&|i| field.pos[i]);
        assert!(error >= floor, "better than exact: {error} < {floor}");
        let name = format!("{passes} passes, {n_random} random candidates");
        writeln!(table, "| {name} | {error:.2} | {seconds:.2} |").unwrap();
    }
    let (seconds, field) = timed(|| barnes::field(&target, &source.image, N, 5, ctx.seed));
    let error = rms(&|i| Pos::new(field[i].0, field[i].1));
    assert!(error >= floor, "better than exact: {error} < {floor}");
    let name = "PatchMatch as published (Barnes et al. 2009), 5 iterations";
    writeln!(table, "| {name} | {error:.2} | {seconds:.2} |").unwrap();
    table
}
