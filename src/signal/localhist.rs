//! Local distributions: the histogram of a value around every pixel, under a Gaussian window.

use rayon::prelude::*;

use crate::signal::histogram::{BINS, Distribution, Quantiles, bin_of};
use crate::signal::window::{Domain, Grid};

/// Edges of the bins.
pub const EDGES: usize = BINS + 1;

/// The cumulative distribution of a value around every pixel of a picture.
#[derive(Debug)]
pub struct LocalDistributions {
    grid: Grid,
    /// `(cell, edge)`: share of the window below each bin edge; all zeros where nothing is usable.
    cdf: Vec<f32>,
    global: Option<Distribution>,
}

impl LocalDistributions {
    /// Distributions of the soft codes `code(pixel)` (`None`: not usable) under a Gaussian of
    /// standard deviation `sigma` pixels, wrapped around on the axes that wrap and cut off on
    /// those that do not.
    ///
    /// # Paper
    /// Moritz et al. 2017, eq. 3, with a box of one code as range window.
    ///
    /// # Determinism
    /// Same bytes for any thread count.
    pub fn new(code: impl Fn(usize) -> Option<u16> + Sync, domain: Domain, sigma: f64) -> Self {
        let grid = Grid::new(domain, sigma);
        let bin = |i: usize| code(i).map(|v| bin_of(v).0);
        let mass = grid.spread(BINS, bin, |mass: &mut [f32], &bin, weight| mass[bin] += weight);
        let mut total = vec![0f64; BINS];
        for cell in mass.chunks_exact(BINS) {
            total.iter_mut().zip(cell).for_each(|(t, &m)| *t += m as f64);
        }
        let mut cdf = vec![0f32; grid.cells() * EDGES];
        let blurred = grid.blurred(&mass, BINS);
        cdf.par_chunks_exact_mut(EDGES).zip(blurred.par_chunks_exact(BINS)).for_each(
            |(out, cell)| {
                let total = cell.iter().sum::<f32>();
                if total < 1e-6 {
                    return;
                }
                let scale = 1.0 / total;
                let mut below = 0.0;
                for (out, &m) in out[1..].iter_mut().zip(cell) {
                    below += m;
                    *out = (below * scale).min(1.0);
                }
                out[BINS] = 1.0;
            },
        );
        Self { grid, cdf, global: Distribution::from_masses(&total) }
    }

    /// The cells, and of each the shares below the [`EDGES`] edges of the bins.
    pub fn into_parts(self) -> (Grid, Vec<f32>) {
        (self.grid, self.cdf)
    }

    /// The distribution of the whole picture; `None` if none of it is usable.
    pub fn global(&self) -> Option<&Distribution> {
        self.global.as_ref()
    }

    /// The share of the window around (`y`, `x`) that lies below `v`.
    pub fn share_below(&self, y: usize, x: usize, v: u16) -> f32 {
        let (bin, at) = bin_of(v);
        self.grid.between(y, x, |cell| {
            let i = cell * EDGES + bin;
            self.cdf[i] + (self.cdf[i + 1] - self.cdf[i]) * at
        })
    }

    /// The typical local distribution: the median over all places of each quantile. `None` if
    /// no place has a usable sample.
    pub fn typical(&self) -> Option<Quantiles> {
        let places: Vec<Quantiles> = self
            .cdf
            .par_chunks_exact(EDGES)
            .filter(|cdf| cdf[BINS] > 0.0)
            .map(|cdf| Distribution::from_cumulative(cdf.to_vec()).quantiles())
            .collect();
        Quantiles::median(&places)
    }
}

/// Mean earth mover's distance between two of these distributions (shares below the [`EDGES`]
/// edges of the bins), over all pairs, in codes.
///
/// In one dimension the distance is the L1 distance of the two cumulative distributions, and
/// for sorted values `mean |F_i - F_j| = 2 / n^2 * sum_k (2 k - n - 1) F_(k)`.
pub fn mean_distance(distributions: &[f32]) -> f64 {
    let n = distributions.len() / EDGES;
    let per_edge: Vec<f64> = (1..BINS)
        .into_par_iter()
        .map(|edge| {
            let mut shares: Vec<f32> = (0..n).map(|c| distributions[c * EDGES + edge]).collect();
            shares.sort_unstable_by(f32::total_cmp);
            let sum: f64 =
                (1..).zip(&shares).map(|(k, &f)| (2 * k - n as i64 - 1) as f64 * f as f64).sum();
            2.0 * sum / (n as f64 * n as f64)
        })
        .collect();
    per_edge.iter().sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::rng::Rng;
    use crate::signal::histogram::{SOFT_BITS, Soft, rounded};

    const DOMAIN: Domain = Domain { height: 40, width: 56, wrap_y: true, wrap_x: true };

    fn picture(domain: Domain) -> Vec<Soft> {
        // A gradient, a blob and noise: far from stationary.
        (0..domain.height * domain.width)
            .map(|i| {
                let (y, x) = ((i / domain.width) as f32, (i % domain.width) as f32);
                let noise = Rng::new(5, 0, 0, i as u64).below(1000) as f32 / 25.0;
                let blob = if (y - 12.0).hypot(x - 20.0) < 8.0 { -30.0 } else { 0.0 };
                [60.0 + noise + blob, noise + 0.4 * x, 7.0, 0.0].map(|v| rounded(v * 64.0))
            })
            .collect()
    }

    /// The definition: Gaussian weights over all pixels (on the torus, over all images of each).
    fn share_below_direct(px: &[Soft], d: Domain, sigma: f64, y: usize, x: usize, v: u16) -> f64 {
        let axis = |i: usize, j: usize, n: usize, wrap: bool| -> f64 {
            let images = if wrap { -3..=3 } else { 0..=0 };
            images
                .map(|m: i64| {
                    let distance = (i as i64 - j as i64 + m * n as i64) as f64;
                    (-distance * distance / (2.0 * sigma * sigma)).exp()
                })
                .sum()
        };
        let (mut below, mut all) = (0.0, 0.0);
        for j in 0..d.height {
            let weight_y = axis(y, j, d.height, d.wrap_y);
            for i in 0..d.width {
                let weight = weight_y * axis(x, i, d.width, d.wrap_x);
                all += weight;
                if px[j * d.width + i][0] <= v {
                    below += weight;
                }
            }
        }
        below / all
    }

    #[test]
    fn the_grid_agrees_with_the_definition() {
        for (sigma, wrap) in [(4.0, true), (6.5, true), (15.0, true), (6.5, false)] {
            let domain = Domain { wrap_y: wrap, wrap_x: wrap, ..DOMAIN };
            let px = picture(domain);
            let local = LocalDistributions::new(|i| Some(px[i][0]), domain, sigma);
            let (mut worst, mut sum, mut n) = (0f64, 0f64, 0);
            for y in (0..domain.height).step_by(3) {
                for x in (0..domain.width).step_by(3) {
                    for v in [40, 55, 70, 80, 92].map(|v| v << SOFT_BITS) {
                        let direct = share_below_direct(&px, domain, sigma, y, x, v);
                        let error = (direct - local.share_below(y, x, v) as f64).abs();
                        worst = worst.max(error);
                        sum += error;
                        n += 1;
                    }
                }
            }
            // The definition's steps have the height of a pixel's share of the window, and a bin
            // holds a few. At cut ends the grid's window is a little wider than the pixels'.
            let pixel = 1.0 / (4.0 * std::f64::consts::PI * sigma * sigma);
            let limit = if wrap { 0.03 } else { 0.08 } + 2.0 * pixel;
            let mean = sum / f64::from(n);
            assert!(
                worst < limit && mean < limit / 3.0,
                "sigma {sigma}, wrap {wrap}: off by up to {worst}, mean {mean}"
            );
        }
    }

    #[test]
    fn the_mean_distance_agrees_with_all_pairs() {
        let px = picture(DOMAIN);
        let local = LocalDistributions::new(|i| Some(px[i][0]), DOMAIN, 5.0);
        let cells: Vec<&[f32]> = local.cdf.chunks_exact(EDGES).collect();
        let mut sum = 0.0;
        for a in &cells {
            for b in &cells {
                sum += a.iter().zip(*b).map(|(u, v)| (u - v).abs() as f64).sum::<f64>();
            }
        }
        let direct = sum / (cells.len() * cells.len()) as f64;
        assert!((mean_distance(&local.cdf) - direct).abs() < 1e-6 * direct, "{direct}");
    }
}
