//! The search against its definition.

use super::*;
use crate::base::rng::Rng;
use proptest::prelude::*;

const BOTH: [Similarity; 2] = [Similarity::Squared, Similarity::Absolute];

fn ctx(threads: usize) -> Ctx {
    Ctx::new(0, threads).expect("pool")
}

fn random(h: usize, w: usize, masked: u32, seed: u64) -> Codes {
    let mut rng = Rng::new(seed, 0, 0, 0);
    let mut value = || rng.below(4000) as f32 / 17.0 - 40.0;
    let pixels: Vec<[f32; 3]> = (0..h * w).map(|_| [value(), value(), value()]).collect();
    let mut rng = Rng::new(seed, 1, 0, 0);
    let usable = (masked > 0).then(|| (0..h * w).map(|_| rng.below(100) >= masked).collect());
    Codes::new(&pixels, (h, w), usable)
}

/// By definition: h from the tile's pixels, SSDN from the tiling that is really built.
fn naive(
    codes: &Codes,
    (th, tw): (usize, usize),
    (ty, tx): (usize, usize),
    similarity: Similarity,
) -> Option<[u64; 2]> {
    let (h, w) = (codes.height, codes.width);
    let tile = |y: usize, x: usize| codes.pixels[(ty + y) * w + tx + x];
    let apart = |a: [i16; 3], b: [i16; 3]| -> u64 {
        let power = if similarity == Similarity::Squared { 2 } else { 1 };
        (0..3).map(|k| (i64::from(a[k]) - i64::from(b[k])).unsigned_abs().pow(power)).sum()
    };
    if (0..th * tw).any(|i| !codes.is_usable((ty + i / tw) * w + tx + i % tw)) {
        return None;
    }
    let mut seam = 0;
    (0..tw).for_each(|x| seam += apart(tile(th - 1, x), tile(0, x)));
    (0..th).for_each(|y| seam += apart(tile(y, tw - 1), tile(y, 0)));
    let from = |i: usize, t: usize, n: usize| (i as i64 - t as i64).rem_euclid(n as i64) as usize;
    let tiling: Vec<[i16; 3]> =
        (0..h * w).map(|i| tile(from(i / w, ty, th), from(i % w, tx, tw))).collect();
    let unlike =
        (0..h * w).filter(|&i| codes.is_usable(i)).map(|i| apart(codes.pixels[i], tiling[i])).sum();
    Some([seam, unlike])
}

fn ensure_as_defined(codes: &Codes, tile: (usize, usize), similarity: Similarity) {
    let costs = Costs::new(&ctx(2), codes, tile, similarity).expect("costs");
    for i in 0..costs.rows * costs.cols {
        let got = [costs.seams[i], costs.unlike[i]];
        let at = (i / costs.cols, i % costs.cols);
        match naive(codes, tile, at, similarity) {
            Some(want) => assert_eq!(got, want, "{tile:?} at {at:?}"),
            None => assert_eq!(got[0], NOWHERE, "{tile:?} at {at:?}"),
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]
    #[test]
    fn every_position_costs_what_its_tiling_costs(
        (h, w) in (1..24_usize, 1..24_usize),
        (th, tw) in (1..24_usize, 1..24_usize),
        masked in 0..12_u32,
        seed: u64,
    ) {
        for similarity in BOTH {
            ensure_as_defined(&random(h, w, masked, seed), (th.min(h), tw.min(w)), similarity);
        }
    }

    #[test]
    fn the_best_are_those_of_a_sorted_list(
        (h, w) in (4..20_usize, 4..20_usize),
        (th, tw) in (2..8_usize, 2..8_usize),
        masked in 0..8_u32,
        (alpha, keep, overlap) in (0..4_u32, 1..11_u32, 0..5_u32),
        similarity in prop::sample::select(&BOTH[..]),
        seed: u64,
    ) {
        let codes = random(h, w, masked, seed);
        let tile @ (th, tw) = (th.min(h), tw.min(w));
        let costs = Costs::new(&ctx(2), &codes, tile, similarity).expect("costs");
        let (keep, overlap) = (f64::from(keep) / 10.0, f64::from(overlap) / 4.0);
        let got = costs.best((f64::from(alpha), 1.0), keep, overlap, 5);
        // All by the definition, sorted.
        let places = (0..(h - th + 1) * (w - tw + 1)).map(|i| (i / (w - tw + 1), i % (w - tw + 1)));
        let n = (0..h * w).filter(|&i| codes.is_usable(i)).count() as f64;
        let mut all: Vec<_> = places
            .filter_map(|at| naive(&codes, tile, at, similarity).map(|[seam, unlike]| (seam, unlike, at)))
            .collect();
        all.sort_unstable_by_key(|&(seam, _, at)| (seam, at));
        all.truncate(((all.len() as f64 * keep).ceil() as usize).max(1));
        let unit = similarity.unit(codes.step());
        let score = |&(seam, unlike, _): &(u64, u64, (usize, usize))| {
            let h = seam as f64 * (unit / (2 * (tw + th - 1)) as f64);
            f64::from(alpha) * h + unlike as f64 * (unit / n)
        };
        all.sort_by(|a, b| score(a).total_cmp(&score(b)).then(a.2.cmp(&b.2)));
        let mut want: Vec<(usize, usize)> = Vec::new();
        for (_, _, (y, x)) in all {
            let common = |&(v, u): &(usize, usize)| {
                let (dy, dx) = (y.abs_diff(v).min(th), x.abs_diff(u).min(tw));
                ((th - dy) * (tw - dx)) as f64 / (th * tw) as f64
            };
            if want.len() < 5 && want.iter().all(|other| common(other) <= overlap) {
                want.push((y, x));
            }
        }
        let got: Vec<_> = got.iter().map(|place| (place.y, place.x)).collect();
        prop_assert_eq!(got, want);
    }
}

#[test]
fn sums_that_run_over_still_differ_right() {
    // The extremes of the codes, so many that the integral runs over 2^64 several times.
    let (h, w) = (700, 900);
    let value =
        |y: usize, x: usize| (u64::MAX / 3).wrapping_mul((y * w + x) as u64 | 1) >> ((y + x) % 3);
    let sums = box_sums(&integral(&value, (h, w)), w, (h - 1, w - 2), (2, 3));
    for (y, x) in [(0, 0), (698, 897), (350, 1), (17, 500)] {
        let want = (0..6).fold(0u64, |s, i| s.wrapping_add(value(y + i / 3, x + i % 3)));
        assert_eq!(sums[y * (w - 2) + x], want, "{y}, {x}");
    }
}

#[test]
fn a_periodic_picture_costs_nothing_and_the_first_place_is_taken() {
    let cell = random(5, 7, 0, 3);
    let pixels: Vec<[f32; 3]> =
        (0..23 * 40).map(|i| cell.pixels[i / 40 % 5 * 7 + i % 40 % 7].map(f32::from)).collect();
    let codes = Codes::new(&pixels, (23, 40), None);
    for similarity in BOTH {
        let costs = Costs::new(&ctx(1), &codes, (5, 7), similarity).expect("costs");
        assert!(costs.unlike.iter().all(|&v| v == 0));
        let best = costs.best((0.0, 1.0), 1.0, 0.0, 100);
        assert_eq!((best[0].y, best[0].x), (0, 0));
        assert_eq!(best.len(), 4 * 5, "as many as fit side by side");
    }
}
