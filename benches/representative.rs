//! The representative tile's search over all positions, by wall time on all cores.
//!
//! `cargo bench --bench representative`.

#![expect(clippy::unwrap_used, reason = "a program that stops at the first surprise")]

use std::hint::black_box;

use criterion::{Criterion, Throughput};
use texforge::Ctx;
use texforge::base::params::Value as _;
use texforge::base::rng::Rng;
use texforge::method::representative::{Codes, Costs, Similarity};
use texforge::signal::self_difference::self_difference;

/// A picture that repeats by a cell of this size (height, width), with noise.
fn cloth((h, w): (usize, usize), (ch, cw): (usize, usize)) -> Vec<[f32; 3]> {
    let value = |stage: u32, i: usize, range: u32| {
        let mut rng = Rng::new(1, stage, 0, i as u64);
        [0; 3].map(|_: i32| rng.below(range) as f32)
    };
    let pixel = |i: usize| {
        let (cell, noise) = (value(0, i / w % ch * cw + i % w % cw, 200), value(1, i, 55));
        std::array::from_fn(|k| cell[k] + noise[k])
    };
    (0..h * w).map(pixel).collect()
}

/// The score of every position by the definition: the tiling is built and compared.
fn brute_force(codes: &Codes, (h, w): (usize, usize), (th, tw): (usize, usize)) -> (usize, usize) {
    let px = codes.pixels();
    let score = |ty: usize, tx: usize| -> i64 {
        (0..h * w)
            .map(|i| {
                let back = |i: usize, t: usize, n: usize| t + (i + n * i.max(t) - t) % n;
                let from = back(i / w, ty, th) * w + back(i % w, tx, tw);
                (0..3).map(|k| (i64::from(px[i][k]) - i64::from(px[from][k])).pow(2)).sum::<i64>()
            })
            .sum()
    };
    let places = (0..=h - th).flat_map(|y| (0..=w - tw).map(move |x| (y, x)));
    places.min_by_key(|&(y, x)| score(y, x)).unwrap()
}

fn main() {
    let ctx = Ctx::new(0, 0).unwrap();
    let search = |codes: &Codes, tile, similarity| {
        let costs = Costs::new(&ctx, codes, tile, similarity)?;
        let alpha = costs.balanced_weight();
        Ok((costs.best((alpha, 1.0), 1.0, 0.25, 4), costs))
    };

    // The answer first: resemblance alone, as brute force knows it.
    let (size, tile) = ((60, 90), (13, 17));
    let small = Codes::new(&cloth(size, tile), size, None);
    let costs = ctx.install(|| Costs::new(&ctx, &small, tile, Similarity::Squared)).unwrap();
    let found = costs.best((0.0, 1.0), 1.0, 0.0, 1)[0];
    assert_eq!((found.y, found.x), brute_force(&small, size, tile), "the best place");

    // The paper's Fig. 7 (a): 1200 x 600, a tile of 196 x 148, 212 s for a ten-thousandth of them.
    let (size, tile) = ((600, 1200), (148, 196));
    let pixels = cloth(size, tile);
    let codes = Codes::new(&pixels, size, None);
    let planes: Vec<Vec<f32>> = (0..3).map(|k| pixels.iter().map(|px| px[k]).collect()).collect();
    let mut bench = Criterion::default().without_plots().sample_size(20).configure_from_args();
    let mut group = bench.benchmark_group("representative tile 1200x600");
    group.throughput(Throughput::Elements(((600 - 147) * (1200 - 195)) as u64));
    for similarity in [Similarity::Squared, Similarity::Absolute] {
        let name = format!("all positions of a 196x148 tile, the best 4, {}", similarity.show());
        group.bench_function(name, |b| {
            b.iter(|| ctx.install(|| search(black_box(&codes), tile, similarity)).unwrap());
        });
    }
    group.bench_function("self-difference along the rows", |b| {
        b.iter(|| ctx.install(|| Ok(self_difference(black_box(&planes), size, None))).unwrap());
    });
    group.finish();
    bench.final_summary();
}
