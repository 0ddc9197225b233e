//! Every measure against its definition: loops over all pixels and all pairs.

use super::*;
use crate::base::rng::Rng;
use crate::signal::histogram::{BINS, SOFT_BITS};
use crate::signal::steerable::{responses, transposed};

const TORUS: Domain = Domain { height: 30, width: 24, wrap_y: true, wrap_x: true };
const OPEN: Domain = Domain { wrap_y: false, wrap_x: false, ..TORUS };
const SIGMA: f64 = 3.5;

const ALL: [Statistic; 6] = [
    Statistic::Histogram,
    Statistic::Moments(Order::Mean),
    Statistic::Moments(Order::Variance),
    Statistic::Moments(Order::Skewness),
    Statistic::Moments(Order::Kurtosis),
    Statistic::Steerable,
];

/// Far from stationary: noise whose mean, strength and skewness differ from place to place.
fn uneven(domain: Domain, seed: u64) -> Vec<[f64; 3]> {
    let at = |i: usize| {
        let (y, x) = ((i / domain.width) as f64, (i % domain.width) as f64);
        let noise = |k: u64| Rng::new(seed, k as u32, 0, i as u64).below(1000) as f64 / 500.0 - 1.0;
        let (h, w) = (domain.height as f64, domain.width as f64);
        let wave = |t: f64| (t * std::f64::consts::TAU).sin();
        let (slow, other) = (wave(y / h), wave(x / w + 0.2));
        [
            60.0 + 12.0 * slow + (9.0 + 5.0 * other) * noise(0),
            50.0 + (8.0 + 6.0 * slow) * (noise(1) + 0.6 * other * noise(1).powi(2)),
            40.0 + 20.0 * (noise(2).powi(3) + 0.3 * other),
        ]
    };
    (0..domain.height * domain.width).map(at).collect()
}

fn soft(pixels: &[[f64; 3]]) -> Vec<Soft> {
    let code = |v: f64| rounded((v * f64::from(1 << SOFT_BITS)) as f32);
    pixels.iter().map(|&[a, b, c]| [code(a), code(b), code(c), code(7.0)]).collect()
}

/// Gaussian weights of all pixels around one; on the torus, of all images of each.
fn weights(d: Domain, sigma: f64, y: usize, x: usize) -> Vec<f64> {
    let axis = |i: usize, n: usize, wrap: bool| -> Vec<f64> {
        let images = if wrap { -4..=4 } else { 0..=0 };
        let one = |j: usize| {
            let of = |m: i64| {
                let far = (i as i64 - j as i64 + m * n as i64) as f64;
                (-far * far / (2.0 * sigma * sigma)).exp()
            };
            images.clone().map(of).sum()
        };
        (0..n).map(one).collect()
    };
    let (rows, cols) = (axis(y, d.height, d.wrap_y), axis(x, d.width, d.wrap_x));
    let all: Vec<f64> = rows.iter().flat_map(|r| cols.iter().map(move |c| r * c)).collect();
    let sum: f64 = all.iter().sum();
    all.iter().map(|w| w / sum).collect()
}

/// The mean over all pairs of pixels of a difference of what `of` says of their weights.
fn all_pairs<T>(d: Domain, of: impl Fn(&[f64]) -> T, difference: impl Fn(&T, &T) -> f64) -> f64 {
    let n = d.height * d.width;
    let all: Vec<T> = (0..n).map(|i| of(&weights(d, SIGMA, i / d.width, i % d.width))).collect();
    let sum: f64 = all.iter().map(|a| all.iter().map(|b| difference(a, b)).sum::<f64>()).sum();
    sum / (n * n) as f64
}

/// Eq. 1 with eq. 3 of one value a pixel.
fn histogram_by_definition(values: &[f64], d: Domain) -> f64 {
    let (low, high) = values.iter().fold((f64::MAX, f64::MIN), |(l, h), &v| (l.min(v), h.max(v)));
    let width = (high - low) / 127.0;
    let histogram = |weights: &[f64]| {
        let mut shares = vec![0.0; BINS];
        for (v, w) in values.iter().zip(weights) {
            shares[((v - low) / width + 0.5) as usize] += w;
        }
        shares
    };
    // How much must be carried over each border between two bins.
    let earth = |a: &Vec<f64>, b: &Vec<f64>| {
        let mut carried = 0.0;
        a.iter().zip(b).fold(0.0, |sum, (a, b)| {
            carried += a - b;
            sum + carried.abs() * width
        })
    };
    all_pairs(d, histogram, earth)
}

/// Eq. 1 with eq. 2 of values counted from their mean in tens.
fn moments_by_definition(values: &[f64], d: Domain, order: i32) -> f64 {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    let moments = |weights: &[f64]| -> Vec<f64> {
        let of = |p: i32| {
            let moment = |(v, w): (&f64, &f64)| ((v - mean) / 10.0).powi(p) * w;
            values.iter().zip(weights).map(moment).sum()
        };
        (1..=order).map(of).collect()
    };
    let squared = |a: &Vec<f64>, b: &Vec<f64>| a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum();
    100.0 * all_pairs(d, moments, squared)
}

/// The third derivatives of a Gaussian in four directions, as whole kernels, without normalization.
fn responses_by_definition(values: &[f64], d: Domain) -> Vec<Vec<f64>> {
    let beyond = |i: i64, n: usize, wrap: bool| {
        let n = n as i64;
        match i.rem_euclid(2 * n) {
            j if wrap => (j % n) as usize,
            j if j < n => j as usize,
            j => (2 * n - 1 - j) as usize,
        }
    };
    let response = |angle: f64, i: usize| {
        let (y, x) = ((i / d.width) as i64, (i % d.width) as i64);
        let mut sum = 0.0;
        for dy in -5..=5i64 {
            for dx in -5..=5i64 {
                let (u, v) = (dx as f64 / 1.1, dy as f64 / 1.1);
                let t = u * angle.cos() + v * angle.sin();
                let kernel = (3.0 * t - t.powi(3)) * (-0.5 * (u * u + v * v)).exp();
                let (row, col) =
                    (beyond(y + dy, d.height, d.wrap_y), beyond(x + dx, d.width, d.wrap_x));
                sum += kernel * values[row * d.width + col];
            }
        }
        sum
    };
    let angles = (0..4).map(|k| f64::from(k) * std::f64::consts::FRAC_PI_4);
    angles.map(|angle| (0..values.len()).map(|i| response(angle, i)).collect()).collect()
}

fn plane(pixels: &[[f64; 3]], k: usize) -> Vec<f64> {
    pixels.iter().map(|px| px[k]).collect()
}

fn single(pixels: &[[f64; 3]]) -> Vec<[f32; 3]> {
    pixels.iter().map(|px| px.map(|v| v as f32)).collect()
}

fn close(got: f64, want: f64, tolerance: f64, what: &str) {
    assert!((got / want - 1.0).abs() < tolerance, "{what}: {got}, by the definition {want}");
}

#[test]
fn costs_agree_with_their_definitions() {
    for (domain, tolerance) in [(TORUS, 0.05), (OPEN, 0.12)] {
        let pixels = uneven(domain, 1);
        let cost = |s: Statistic| s.cost(&single(&pixels), domain, &Window::even(SIGMA));
        let sum = |of: &dyn Fn(&[f64]) -> f64| (0..3).map(|k| of(&plane(&pixels, k))).sum::<f64>();
        let want = sum(&|values| histogram_by_definition(values, domain));
        close(cost(Statistic::Histogram), want, tolerance, "histogram");
        for (p, order) in (1..).zip(ORDERS) {
            let want = sum(&|values| moments_by_definition(values, domain, p));
            close(cost(Statistic::Moments(order)), want, 2.0 * tolerance, &format!("{order:?}"));
        }
        let responses = |values: &[f64]| -> f64 {
            let all = responses_by_definition(values, domain);
            // The same factor for all: that of the pyramid's filters.
            let single: Vec<f32> = values.iter().map(|&v| v as f32).collect();
            let bands = responses(&single, domain);
            let norm = |v: f64| v * v;
            let ours: f64 = bands.iter().flatten().map(|&v| norm(f64::from(v))).sum();
            let factor = (ours / all.iter().flatten().map(|&v| norm(v)).sum::<f64>()).sqrt();
            factor * all.iter().map(|r| histogram_by_definition(r, domain)).sum::<f64>()
        };
        close(cost(Statistic::Steerable), sum(&responses), tolerance, "steerable");
    }
}

#[test]
fn responses_agree_with_whole_kernels() {
    for domain in [TORUS, OPEN, Domain { height: 3, width: 4, ..OPEN }] {
        let values = plane(&uneven(domain, 2), 0);
        let single: Vec<f32> = values.iter().map(|&v| v as f32).collect();
        let bands = responses(&single, domain);
        let direct = responses_by_definition(&values, domain);
        let scale = f64::from(bands[0][5]) / direct[0][5];
        for (k, (band, direct)) in bands.iter().zip(&direct).enumerate() {
            for (i, (&got, want)) in band.iter().zip(direct).enumerate() {
                let far = (f64::from(got) - scale * want).abs();
                assert!(far < 2e-3, "orientation {k}, pixel {i}: {got}, not {}", scale * want);
            }
        }
    }
}

/// The share of the weights that lies below a value; of equal values, half.
fn share(values: &[f64], weights: &[f64], v: f64) -> f64 {
    let each = |(&other, w): (&f64, &f64)| match other.total_cmp(&v) {
        std::cmp::Ordering::Less => *w,
        std::cmp::Ordering::Equal => 0.5 * w,
        std::cmp::Ordering::Greater => 0.0,
    };
    values.iter().zip(weights).map(each).sum()
}

/// `G^-1(F_x(c))` at every pixel.
fn matched_by_definition(values: &[f64], d: Domain) -> Vec<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let each = |i: usize| {
        let u = share(values, &weights(d, SIGMA, i / d.width, i % d.width), values[i]);
        sorted[((u * sorted.len() as f64) as usize).min(sorted.len() - 1)]
    };
    (0..values.len()).map(each).collect()
}

/// Shifts (order 1) or shifts and stretches (order 2) so that every window has the moments of all.
fn fitted_by_definition(values: &[f64], d: Domain, order: usize) -> Vec<f64> {
    let moments = |weights: &[f64]| {
        let mean: f64 = values.iter().zip(weights).map(|(v, w)| v * w).sum();
        let square = |(v, w): (&f64, &f64)| (v - mean).powi(2) * w;
        (mean, values.iter().zip(weights).map(square).sum::<f64>().sqrt())
    };
    let all = vec![1.0 / values.len() as f64; values.len()];
    let (mean, deviation) = moments(&all);
    let each = |i: usize| {
        let (m, s) = moments(&weights(d, SIGMA, i / d.width, i % d.width));
        if order == 1 { values[i] - m + mean } else { mean + (values[i] - m) * deviation / s }
    };
    (0..values.len()).map(each).collect()
}

fn mean_distance_of(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).sum::<f64>() / a.len() as f64
}

#[test]
fn projections_agree_with_their_definitions() {
    for domain in [TORUS, OPEN] {
        let before = soft(&uneven(domain, 3));
        let values = |px: &[Soft], k: usize| -> Vec<f64> {
            px.iter().map(|px| f64::from(px[k]) / f64::from(1 << SOFT_BITS)).collect()
        };
        let check = |statistic: Statistic, of: &dyn Fn(&[f64]) -> Vec<f64>| {
            let mut px = before.clone();
            statistic.project(&mut px, domain, &Window::even(SIGMA), 1.0);
            assert!(px.iter().all(|px| px[3] == 7 << SOFT_BITS), "a constant channel moved");
            for k in 0..3 {
                let (from, got) = (values(&before, k), values(&px, k));
                let want = of(&from);
                let (off, moved) = (mean_distance_of(&got, &want), mean_distance_of(&from, &want));
                let what = format!("{statistic:?}, channel {k}, wrap {}", domain.wrap_x);
                assert!(off < 0.2 * moved, "{what}: {off} off a move of {moved}");
            }
        };
        check(Statistic::Histogram, &|values| matched_by_definition(values, domain));
        for (order, statistic) in [(1, ALL[1]), (2, ALL[2])] {
            check(statistic, &|values| fitted_by_definition(values, domain, order));
        }
    }
}

/// A response moved by its definition, filtered once more and added, is the projection.
#[test]
fn the_steerable_projection_agrees_with_its_definition() {
    for domain in [TORUS, OPEN] {
        let before = soft(&uneven(domain, 4));
        let mut px = before.clone();
        Statistic::Steerable.project(&mut px, domain, &Window::even(SIGMA), 1.0);
        for k in 0..3 {
            let values: Vec<f32> = before.iter().map(|px| f32::from(px[k])).collect();
            let mut bands = responses(&values, domain);
            let lacking = values.iter().zip(transposed(&bands, domain)).map(|(v, b)| v - b);
            let lacking: Vec<f32> = lacking.collect();
            for band in &mut bands {
                let response: Vec<f64> = band.iter().map(|&v| f64::from(v)).collect();
                let even = matched_by_definition(&response, domain);
                band.iter_mut().zip(even).for_each(|(v, even)| *v = even as f32);
            }
            let want = lacking.iter().zip(transposed(&bands, domain));
            let want: Vec<f64> = want.map(|(l, b)| f64::from(l + b)).collect();
            let got: Vec<f64> = px.iter().map(|px| f64::from(px[k])).collect();
            let from: Vec<f64> = values.iter().map(|&v| f64::from(v)).collect();
            let (off, moved) = (mean_distance_of(&got, &want), mean_distance_of(&from, &want));
            assert!(off < 0.25 * moved, "channel {k}: {off} off a move of {moved}");
        }
    }
}

fn colors(px: &[Soft]) -> Vec<[f32; 3]> {
    px.iter().map(|px| [0, 1, 2].map(|k| f32::from(px[k]) / f32::from(1u16 << SOFT_BITS))).collect()
}

/// Each projection lowers the cost of its own measure, and half of it lies between. The responses
/// overlap, and one that is moved moves the others: there it takes a few times.
#[test]
fn a_projection_lowers_its_own_cost() {
    let window = Window::even(SIGMA);
    for statistic in ALL {
        let times = if statistic == Statistic::Steerable { 4 } else { 1 };
        let before = soft(&uneven(TORUS, 5));
        let cost = |share: f32| {
            let mut px = before.clone();
            (0..times).for_each(|_| statistic.project(&mut px, TORUS, &window, share));
            statistic.cost(&colors(&px), TORUS, &window)
        };
        let (was, half, is) = (cost(0.0), cost(0.5), cost(1.0));
        assert!(is < 0.5 * was, "{statistic:?}: {was} -> {is}");
        assert!(half < was && half > is, "{statistic:?}: {was}, {half}, {is}");
    }
}

/// Higher moments see what lower ones do not: places of equal mean and variance.
#[test]
fn orders_see_what_they_name() {
    let domain = Domain { height: 48, width: 48, wrap_y: true, wrap_x: true };
    // Left and right half: both of mean 50, in the second case of the same variance too.
    let picture = |left: &dyn Fn(usize) -> f32, right: &dyn Fn(usize) -> f32| -> Vec<[f32; 3]> {
        let half = |i: usize| if i % 48 < 24 { left(i) } else { right(i) };
        (0..48 * 48).map(|i| [50.0 + half(i), 0.0, 0.0]).collect()
    };
    let sign = |i: usize| if i.is_multiple_of(2) { 1.0 } else { -1.0 };
    let variance = picture(&|i| 3.0 * sign(i), &|i| 9.0 * sign(i));
    // One value in ten far away, to the one or the other side.
    let rare = |i: usize| if (i * 7).is_multiple_of(10) { 9.0 } else { -1.0 };
    let skewness = picture(&rare, &|i| -rare(i));
    let kurtosis = picture(&|i| 10.0 * sign(i), &|i| match i % 8 {
        0 => 20.0,
        4 => -20.0,
        _ => 0.0,
    });
    for (sees, picture) in [(2, &variance), (3, &skewness), (4, &kurtosis)] {
        let cost =
            |order: Order| Statistic::Moments(order).cost(picture, domain, &Window::even(5.0));
        let (blind, seeing) = (cost(ORDERS[sees - 2]), cost(ORDERS[sees - 1]));
        assert!(seeing > 10.0 * blind, "order {sees} sees {seeing}, the one before {blind}");
    }
}

/// What is rolled on the torus is projected as before and rolled.
#[test]
fn rolling_the_torus_rolls_the_result() {
    // By whole cells, so that the grid sees the same samples.
    let domain = Domain { height: 40, width: 56, ..TORUS };
    let px = soft(&uneven(domain, 6));
    let rolled = |px: &[Soft]| -> Vec<Soft> {
        let from = |i: usize| {
            let (y, x) = (i / domain.width, i % domain.width);
            (y + 20) % domain.height * domain.width + (x + 28) % domain.width
        };
        (0..px.len()).map(|i| px[from(i)]).collect()
    };
    for statistic in ALL {
        let (mut straight, mut shifted) = (px.clone(), rolled(&px));
        // Four and six cells.
        statistic.project(&mut straight, domain, &Window::even(12.5), 1.0);
        statistic.project(&mut shifted, domain, &Window::even(12.5), 1.0);
        for (i, (got, want)) in shifted.iter().zip(rolled(&straight)).enumerate() {
            for k in 0..3 {
                let far = got[k].abs_diff(want[k]);
                assert!(far < 8, "{statistic:?}, pixel {i}: {} != {}", got[k], want[k]);
            }
        }
    }
}

/// A gradient, a blob and noise.
fn stained(domain: Domain) -> Vec<Soft> {
    (0..domain.height * domain.width)
        .map(|i| {
            let (y, x) = ((i / domain.width) as f32, (i % domain.width) as f32);
            let noise = Rng::new(5, 0, 0, i as u64).below(1000) as f32 / 25.0;
            let blob = if (y - 12.0).hypot(x - 20.0) < 8.0 { -30.0 } else { 0.0 };
            [60.0 + noise + blob, noise + 0.4 * x, 7.0, 0.0].map(|v| rounded(v * 64.0))
        })
        .collect()
}

#[test]
fn the_histogram_projection_keeps_the_global_histogram() {
    let domain = Domain { height: 40, width: 56, ..TORUS };
    let mut px = stained(domain);
    let share = |px: &[Soft], v: u16| {
        px.iter().filter(|px| px[0] < v << SOFT_BITS).count() as f64 / px.len() as f64
    };
    let before = px.clone();
    Statistic::Histogram.project(&mut px, domain, &Window::even(5.0), 1.0);
    for v in [45, 60, 80] {
        let change = share(&px, v) - share(&before, v);
        assert!(change.abs() < 0.04, "share below {v} moved by {change}");
    }
}
