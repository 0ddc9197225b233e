//! What the benchmarks share: a clock that counts CPU time, pictures, and the error of a field.

#![allow(dead_code, reason = "each benchmark uses its own part")]

pub(crate) mod barnes;

use criterion::Throughput;
use criterion::measurement::{Measurement, ValueFormatter, WallTime};
use texforge::base::rng::Rng;
use texforge::search::field::{Field, Pos};
use texforge::search::patch::{Kernel, MatchImage, WithKernel, with_kernel};
use texforge::search::patchmatch::{Search, Wrap, pass};
use texforge::search::place_cost::PlaceCost;
use texforge::search::source::Source;
use texforge::{Ctx, Result, Simd};

/// No axis wraps.
pub(crate) const OPEN: Wrap = Wrap { y: false, x: false };

/// CPU time of the calling thread in seconds: other processes on the machine do not count.
pub(crate) fn cpu_seconds() -> f64 {
    #[cfg(unix)]
    {
        let now = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
        now.tv_sec as f64 + now.tv_nsec as f64 * 1e-9
    }
    #[cfg(not(unix))]
    wall_seconds()
}

/// CPU time of all threads of this process in seconds.
pub(crate) fn process_cpu_seconds() -> f64 {
    #[cfg(unix)]
    {
        let now = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
        now.tv_sec as f64 + now.tv_nsec as f64 * 1e-9
    }
    #[cfg(not(unix))]
    wall_seconds()
}

/// Seconds that went by.
pub(crate) fn wall_seconds() -> f64 {
    use std::sync::OnceLock;
    use std::time::Instant;
    static START: OnceLock<Instant> = OnceLock::new();
    START.get_or_init(Instant::now).elapsed().as_secs_f64()
}

/// CPU seconds that `work` takes on this thread.
pub(crate) fn timed<T>(work: impl FnOnce() -> T) -> (f64, T) {
    let start = cpu_seconds();
    let result = work();
    (cpu_seconds() - start, result)
}

/// Criterion's measurement: CPU time of this thread, in nanoseconds.
#[derive(Debug)]
pub(crate) struct CpuTime;

impl Measurement for CpuTime {
    type Intermediate = f64;
    type Value = f64;

    fn start(&self) -> f64 {
        cpu_seconds()
    }

    fn end(&self, start: f64) -> f64 {
        (cpu_seconds() - start) * 1e9
    }

    fn add(&self, a: &f64, b: &f64) -> f64 {
        a + b
    }

    fn zero(&self) -> f64 {
        0.0
    }

    fn to_f64(&self, value: &f64) -> f64 {
        *value
    }

    fn formatter(&self) -> &dyn ValueFormatter {
        WallTime.formatter()
    }
}

/// `n` things a repetition.
pub(crate) fn each(n: usize) -> Throughput {
    Throughput::Elements(n as u64)
}

/// Median.
pub(crate) fn median(mut values: Vec<f64>) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    values[values.len() / 2]
}

/// Random codes.
pub(crate) fn noise_codes(height: usize, width: usize) -> MatchImage {
    codes(height, width, |y, x| {
        let bits = Rng::new(1, 0, 0, (y * width + x) as u64).next_u32().to_le_bytes();
        bits.map(|b| b & 127)
    })
}

/// Codes by a formula.
pub(crate) fn codes(
    height: usize,
    width: usize,
    at: impl Fn(usize, usize) -> [u8; 4] + Sync,
) -> MatchImage {
    let mut image = MatchImage::new(height, width);
    image.fill_rows(|y, row| {
        for (x, px) in row.iter_mut().enumerate() {
            *px = at(y, x);
        }
    });
    image
}

/// Something like a photo of pebbles: cells of different brightness and tint with dark borders,
/// uneven light, fine grain. `seed` chooses the pebbles. Codes, the fourth one zero.
pub(crate) fn pebbles(height: usize, width: usize, seed: u64) -> MatchImage {
    const CELL: f32 = 14.0;
    codes(height, width, |y, x| {
        let (u, v) = (x as f32 / CELL, y as f32 / CELL);
        let (mut near, mut second, mut id) = (f32::MAX, f32::MAX, 0u64);
        for cy in v as i64 - 1..=v as i64 + 1 {
            for cx in u as i64 - 1..=u as i64 + 1 {
                let key = ((cy + 8) * 4096 + cx + 8) as u64;
                let mut rng = Rng::new(seed, 7, 0, key);
                let mut unit = || rng.below(1000) as f32 / 1000.0;
                let (py, px) = (cy as f32 + unit(), cx as f32 + unit());
                let distance = (py - v).hypot(px - u);
                if distance < near {
                    (second, near, id) = (near, distance, key);
                } else {
                    second = second.min(distance);
                }
            }
        }
        let mut tint = Rng::new(seed, 8, 0, id);
        let light = 10.0 * ((x as f32 / 170.0).sin() + (y as f32 / 230.0).cos());
        let grain = Rng::new(seed, 9, 0, (y * width + x) as u64).below(9) as f32;
        let edge = ((second - near) * 6.0).min(1.0);
        let mut channel = || {
            let base = 45.0 + tint.below(50) as f32;
            (base * (0.35 + 0.65 * edge) + light + grain).clamp(0.0, 127.0) as u8
        };
        [channel(), channel(), channel(), 0]
    })
}

/// A nearest-neighbour field of every patch of `target` in `source` from random positions.
///
/// # Errors
/// Cancelled (never here).
pub(crate) fn nearest(
    ctx: &Ctx,
    target: &MatchImage,
    source: &Source,
    passes: u32,
    n_random: u32,
) -> Result<Field> {
    let (h, w) = (target.height() - source.patch + 1, target.width() - source.patch + 1);
    let mut field = Field::random(h, w, source, ctx.seed);
    let usage = PlaceCost::free(source);
    for i in 0..passes {
        let search = Search { pass: i, radius: 0, n_random, phase: None };
        pass(ctx, target, source, &usage, OPEN, search, &mut field)?;
    }
    Ok(field)
}

/// The source patch nearest to the patch of `target` at (`y`, `x`), by trying all.
pub(crate) fn exhaustive(
    simd: Simd,
    target: &MatchImage,
    source: &Source,
    y: usize,
    x: usize,
) -> Pos {
    struct Exhaustive<'a>(&'a MatchImage, &'a Source, usize);
    impl WithKernel for Exhaustive<'_> {
        type Output = Pos;
        #[inline(always)]
        fn run<K: Kernel>(self, kernel: K) -> Pos {
            let Self(target, source, at) = self;
            let mut query = kernel.query();
            kernel.hold(&mut query, target, at);
            let mut best = (i32::MAX, Pos::new(0, 0));
            for y in 0..source.rows() {
                for x in 0..source.cols() {
                    let pos = Pos::new(y, x);
                    best = best.min((kernel.distance(&query, &source.image, source.at(pos)), pos));
                }
            }
            best.1
        }
    }
    with_kernel(simd, source.patch, Exhaustive(target, source, target.at(y, x)))
}

/// Positions spread evenly over a field (pixel indices into it).
pub(crate) fn samples(field_len: usize, n: usize) -> impl Iterator<Item = usize> {
    (0..n).map(move |i| (i * 2 + 1) * field_len / (2 * n))
}
