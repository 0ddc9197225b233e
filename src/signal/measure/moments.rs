//! Local moments: mean, and up to deviation, skewness and kurtosis, are made the same everywhere.

use rayon::prelude::*;

use crate::signal::histogram::{BINS, SOFT_BITS, Soft, edge};
use crate::signal::localhist::EDGES;
use crate::signal::measure::pearson::Pearson;
use crate::signal::measure::{Mapping, at_places, project_channels};
use crate::signal::window::{Domain, Grid, Window};

/// How many moments are made equal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Order {
    /// The mean.
    Mean,
    /// Mean and variance.
    Variance,
    /// And skewness.
    Skewness,
    /// And kurtosis.
    Kurtosis,
}

/// Orders, lowest first.
pub const ORDERS: [Order; 4] = [Order::Mean, Order::Variance, Order::Skewness, Order::Kurtosis];

/// Smallest local deviation that is stretched wholly, in soft codes: half a code. What is smaller is
/// the rounding of the photo's pixels, and nothing must be made of it.
const LEAST_DEVIATION: f64 = 0.5 * (1 << SOFT_BITS) as f64;

/// Mean and deviation of all values, on which a channel is normalized: `z = (v - mean) / deviation`.
#[derive(Debug, Clone, Copy)]
struct Scale {
    mean: f64,
    deviation: f64,
}

impl Scale {
    fn of(values: impl Iterator<Item = f64>) -> Self {
        // In pixel order on one thread: a sum of floats depends on its order.
        let (mut n, mut sum, mut squares, mut first) = (0.0, 0.0, 0.0, None);
        for v in values {
            let d = v - *first.get_or_insert(v);
            n += 1.0;
            sum += d;
            squares += d * d;
        }
        let mean = sum / n;
        let deviation = (squares / n - mean * mean).max(0.0).sqrt();
        Self { mean: mean + first.unwrap_or_default(), deviation }
    }

    fn normalized(self, v: f64) -> f64 {
        (v - self.mean) / self.deviation
    }
}

/// The raw moments of orders 0 to 4 of normalized values, unnormalized by the weight.
type Sums = [f64; 5];

/// The sums under the window around each cell's middle, and those of the whole picture.
fn local(z: impl Fn(usize) -> f64 + Sync, domain: Domain, sigma: f64) -> (Grid, Vec<Sums>, Sums) {
    let grid = Grid::new(domain, sigma);
    let add = |sums: &mut [f64], &z: &f64, weight: f32| {
        let mut term = f64::from(weight);
        for sum in sums {
            *sum += term;
            term *= z;
        }
    };
    let spread = grid.spread(5, |i| Some(z(i)), add);
    let sums = |flat: &[f64]| -> Vec<Sums> { flat.as_chunks().0.to_vec() };
    let mut total = [0.0; 5];
    for cell in sums(&spread) {
        (0..5).for_each(|p| total[p] += cell[p]);
    }
    let blurred = sums(&grid.blurred(&spread, 5));
    (grid, blurred, total)
}

/// In the cost, values are counted from the picture's mean in tens of the pixels' units (L*a*b*):
/// the orders' sums are then of like size. A fixed unit, so that tiles can be compared.
const UNIT: f64 = 10.0;

/// Mean squared difference of the local moments of two places, summed over the orders up to `order`
/// and the channels, in the pixels' units squared. With one moment it is the mean squared difference
/// of local means; higher ones count as [`UNIT`] says.
pub(super) fn cost(order: Order, pixels: &[[f32; 3]], domain: Domain, window: &Window) -> f64 {
    let n_moments = order as usize + 1;
    let channel = |k: usize| {
        let value = |i: usize| f64::from(pixels[i][k]);
        let mean = Scale::of((0..pixels.len()).map(value)).mean;
        let places = at_places(n_moments, domain, window, |sigma| {
            let (grid, sums, _) = local(|i| (value(i) - mean) / UNIT, domain, sigma);
            let moments = |s: &Sums| (1..=n_moments).map(|p| s[p] / s[0]).collect::<Vec<_>>();
            (grid, sums.iter().flat_map(moments).collect())
        });
        let n = (places.len() / n_moments) as f64;
        let pairs = |p: usize| {
            let of = || places.iter().skip(p).step_by(n_moments);
            // The mean squared difference of all pairs is twice the variance.
            let mean = of().sum::<f64>() / n;
            2.0 * of().map(|m| (m - mean) * (m - mean)).sum::<f64>() / n
        };
        UNIT * UNIT * (0..n_moments).map(pairs).sum::<f64>()
    };
    (0..3).map(channel).sum()
}

/// What the moments of a distribution say of it.
struct Shape {
    mean: f64,
    deviation: f64,
    skewness: f64,
    kurtosis: f64,
}

impl Shape {
    fn of(sums: &Sums, order: Order) -> Self {
        let [m, second, third, fourth] = [1, 2, 3, 4].map(|p| sums[p] / sums[0]);
        let variance = (second - m * m).max(0.0);
        let deviation = variance.sqrt();
        let third = third - 3.0 * m * second + 2.0 * m * m * m;
        let fourth = fourth - m * (4.0 * third + m * (6.0 * variance + m * m));
        let skewness = third / (variance * deviation).max(1e-12);
        let kurtosis = if order == Order::Kurtosis {
            fourth / (variance * variance).max(1e-12)
        } else {
            // Pearson's type III: the gamma distribution, which has three parameters.
            3.0 + 1.5 * skewness * skewness
        };
        Self { mean: m, deviation, skewness, kurtosis }
    }

    fn pearson(&self) -> Pearson {
        Pearson::new(self.skewness, self.kurtosis)
    }
}

/// Each channel's value c moves towards `G^-1(F_x(c))` as with histograms, where `F_x` and `G` are
/// made from the local and the global moments: a shift with one moment, Gaussians with two, Pearson's
/// distributions with three and four.
pub(super) fn project(
    order: Order,
    pixels: &mut [Soft],
    domain: Domain,
    window: &Window,
    share: f32,
) {
    project_channels(pixels, 0..4, domain, window, share, |code, sigma| {
        mapping(order, code, domain, sigma)
    });
}

fn mapping(
    order: Order,
    code: &(dyn Fn(usize) -> u16 + Sync),
    domain: Domain,
    sigma: f64,
) -> Mapping {
    let value = |i: usize| f64::from(code(i));
    let scale = Scale::of((0..domain.height * domain.width).map(value));
    let (grid, sums, total) = local(|i| scale.normalized(value(i)), domain, sigma);
    let global = Shape::of(&total, order);
    let wanted = global.pearson();
    let least = (LEAST_DEVIATION / scale.deviation).min(global.deviation);
    let table = |sums: &Sums| -> [f32; EDGES] {
        let own = Shape::of(sums, order);
        let deviation = own.deviation.max(least);
        let stretched = |z: f64| global.mean + z * global.deviation;
        let distribution = (order >= Order::Skewness).then(|| own.pearson());
        std::array::from_fn(|bin| {
            let z = scale.normalized(f64::from(edge(bin as f32)));
            let there = match order {
                Order::Mean => z - own.mean + global.mean,
                Order::Variance => stretched((z - own.mean) / deviation),
                Order::Skewness | Order::Kurtosis => {
                    let at = (z - own.mean) / deviation;
                    stretched(distribution.as_ref().map_or(at, |own| own.matched(&wanted, at)))
                }
            };
            let inside = (there * scale.deviation + scale.mean) as f32;
            inside.clamp(edge(0.0), edge(BINS as f32))
        })
    };
    Mapping { grid, tables: sums.par_iter().flat_map_iter(table).collect() }
}
