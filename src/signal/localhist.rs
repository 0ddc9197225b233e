//! Local distributions: the histogram of a channel around every pixel, under a Gaussian window.
//!
//! A grid of histograms in (space x range), spread with a tent in space, blurred separably and
//! interpolated: linear in the pixels and independent of the window's size.

use rayon::prelude::*;

use crate::signal::histogram::{Bins, Distribution, Quantiles};

/// Channels that are evened out together, each by itself: L*, a*, b* and local contrast.
pub type Pixel = [f32; 4];

/// A picture's size and whether each axis wraps around.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Domain {
    /// Rows.
    pub height: usize,
    /// Columns.
    pub width: usize,
    /// Whether the rows wrap.
    pub wrap_y: bool,
    /// Whether the columns wrap.
    pub wrap_x: bool,
}

/// One axis of the grid.
struct Axis {
    n: usize,
    /// For each pixel: lower cell, upper cell, weight of the upper one.
    place: Vec<(usize, usize, f32)>,
    /// Blur: weights of the cells around each cell, as (cell, weight).
    blur: Vec<Vec<(usize, f32)>>,
}

impl Axis {
    fn new(n_pixels: usize, wrap: bool, sigma: f64) -> Self {
        // Cells of half a sigma: the Gaussian is then two cells wide and its samples are exact
        // to a fraction of a percent.
        let n = ((n_pixels as f64 / (sigma / 2.0)).ceil() as usize).clamp(1, n_pixels);
        let cell = n_pixels as f64 / n as f64;
        let place = (0..n_pixels)
            .map(|p| {
                let at = (p as f64 + 0.5) / cell - 0.5;
                let low = at.floor();
                let wrapped = |i: f64| {
                    let i = i as isize;
                    if wrap { i.rem_euclid(n as isize) } else { i.clamp(0, n as isize - 1) }
                };
                (wrapped(low) as usize, wrapped(low + 1.0) as usize, (at - low) as f32)
            })
            .collect();
        // Spreading and interpolating each convolve with a tent of variance cell^2 / 6.
        let variance = (sigma * sigma - cell * cell / 3.0).max(0.0) / (cell * cell);
        let reach = (3.5 * variance.sqrt()).ceil() as isize;
        let blur = (0..n)
            .map(|i| {
                let mut weights = vec![0.0f64; n];
                for d in -reach..=reach {
                    let j = i as isize + d;
                    let inside = (0..n as isize).contains(&j);
                    if inside || wrap {
                        let weight = if d == 0 {
                            1.0
                        } else {
                            libm::exp(-((d * d) as f64) / (2.0 * variance))
                        };
                        weights[j.rem_euclid(n as isize) as usize] += weight;
                    }
                }
                let sum: f64 = weights.iter().sum();
                let some = weights.iter().enumerate().filter(|&(_, &w)| w > 0.0);
                some.map(|(j, &w)| (j, (w / sum) as f32)).collect()
            })
            .collect();
        Self { n, place, blur }
    }

    /// The pixels whose tent reaches each cell, every `step`-th, as (pixel, weight).
    fn pixels_of_cells(&self, step: usize) -> Vec<Vec<(usize, f32)>> {
        let mut pixels = vec![Vec::new(); self.n];
        for (p, &(low, high, at)) in self.place.iter().enumerate().step_by(step) {
            pixels[low].push((p, 1.0 - at));
            pixels[high].push((p, at));
        }
        pixels
    }
}

/// The cumulative distribution of one channel around every pixel of a picture.
pub struct LocalDistributions {
    rows: Axis,
    cols: Axis,
    bins: Bins,
    /// `(row, column, edge)`: share of the window below each bin edge.
    cdf: Vec<f32>,
    global: Distribution,
}

impl std::fmt::Debug for LocalDistributions {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "LocalDistributions({}x{} cells, {:?})", self.rows.n, self.cols.n, self.bins)
    }
}

impl LocalDistributions {
    /// Distributions of channel `k` of `pixels` under a Gaussian of standard deviation `sigma`
    /// pixels, wrapped around on the axes that wrap and cut off on those that do not.
    ///
    /// # Paper
    /// Moritz et al. 2017, eq. 3, with a box as range window.
    ///
    /// # Determinism
    /// Same bytes for any thread count.
    pub fn new(
        pixels: &[Pixel],
        usable: Option<&[bool]>,
        k: usize,
        domain: Domain,
        sigma: f64,
        bins: Bins,
    ) -> Self {
        let Domain { height, width, wrap_y, wrap_x } = domain;
        assert_eq!(pixels.len(), height * width, "pixels do not fill the domain");
        let rows = Axis::new(height, wrap_y, sigma);
        let cols = Axis::new(width, wrap_x, sigma);
        // Sixteen samples across a cell are plenty: the window holds thousands.
        let step = |n: usize, cells: usize| (n / cells / 16).max(1);
        let (step_y, step_x) = (step(height, rows.n), step(width, cols.n));
        let n = bins.n;

        // Spread: each cell row gathers the pixel rows whose tent reaches it.
        let mut mass = vec![0f32; rows.n * cols.n * n];
        let pixel_rows = rows.pixels_of_cells(step_y);
        mass.par_chunks_mut(cols.n * n).zip(&pixel_rows).for_each(|(mass, pixel_rows)| {
            for &(y, weight_y) in pixel_rows {
                let row = &pixels[y * width..][..width];
                let usable = usable.map(|u| &u[y * width..][..width]);
                for (x, &(low, high, at)) in cols.place.iter().enumerate().step_by(step_x) {
                    if usable.is_some_and(|u| !u[x]) {
                        continue;
                    }
                    let px = row[x];
                    let bin = bins.place(px[k]).0;
                    mass[low * n + bin] += weight_y * (1.0 - at);
                    mass[high * n + bin] += weight_y * at;
                }
            }
        });
        let mut total = vec![0f64; n];
        for cell in mass.chunks_exact(n) {
            total.iter_mut().zip(cell).for_each(|(t, &m)| *t += m as f64);
        }

        // Blur along the columns, then along the rows.
        let mut blurred = vec![0f32; mass.len()];
        blurred.par_chunks_mut(cols.n * n).zip(mass.par_chunks(cols.n * n)).for_each(
            |(out, row)| {
                for (out, taps) in out.chunks_exact_mut(n).zip(&cols.blur) {
                    for &(j, weight) in taps {
                        out.iter_mut().zip(&row[j * n..][..n]).for_each(|(o, &m)| *o += weight * m);
                    }
                }
            },
        );
        let mut cdf = vec![0f32; rows.n * cols.n * (n + 1)];
        cdf.par_chunks_mut(cols.n * (n + 1)).zip(&rows.blur).for_each_init(
            || vec![0f32; cols.n * n],
            |sum, (out, taps)| {
                sum.fill(0.0);
                for &(j, weight) in taps {
                    let row = &blurred[j * cols.n * n..][..cols.n * n];
                    sum.iter_mut().zip(row).for_each(|(s, &m)| *s += weight * m);
                }
                for (out, cell) in out.chunks_exact_mut(n + 1).zip(sum.chunks_exact(n)) {
                    // Where nothing is usable the distribution is undefined: all zeros.
                    let total = cell.iter().sum::<f32>();
                    if total < 1e-6 {
                        continue;
                    }
                    let scale = 1.0 / total;
                    let mut below = 0.0;
                    for (out, &m) in out[1..].iter_mut().zip(cell) {
                        below += m;
                        *out = (below * scale).min(1.0);
                    }
                    out[n] = 1.0;
                }
            },
        );
        Self { rows, cols, bins, cdf, global: Distribution::from_masses(bins, &total) }
    }

    /// The distribution of the whole picture.
    pub fn global(&self) -> &Distribution {
        &self.global
    }

    /// The share of the window around (`y`, `x`) that lies below `v`.
    #[inline]
    pub fn share_below(&self, y: usize, x: usize, v: f32) -> f32 {
        let (bin, at) = self.bins.place(v);
        let (y0, y1, fy) = self.rows.place[y];
        let (x0, x1, fx) = self.cols.place[x];
        let cell = |y: usize, x: usize| {
            let i = (y * self.cols.n + x) * (self.bins.n + 1) + bin;
            self.cdf[i] + (self.cdf[i + 1] - self.cdf[i]) * at
        };
        let top = cell(y0, x0) + (cell(y0, x1) - cell(y0, x0)) * fx;
        let bottom = cell(y1, x0) + (cell(y1, x1) - cell(y1, x0)) * fx;
        top + (bottom - top) * fy
    }

    /// The typical local distribution: the median over all places of each quantile. `None` if
    /// no place has a usable sample.
    pub fn typical(&self) -> Option<Quantiles> {
        let edges = self.bins.n + 1;
        let places: Vec<Quantiles> = self
            .cdf
            .par_chunks_exact(edges)
            .filter(|cdf| cdf[edges - 1] > 0.0)
            .map(|cdf| Distribution::from_cumulative(self.bins, cdf.to_vec()).quantiles())
            .collect();
        (!places.is_empty()).then(|| Quantiles::median(&places))
    }

    /// Mean earth mover's distance between the distributions of two cells, over all pairs.
    ///
    /// In one dimension the distance is the L1 distance of the two cumulative distributions, and
    /// for sorted values `mean |F_i - F_j| = 2 / n^2 * sum_k (2 k - n - 1) F_(k)`.
    pub fn mean_distance(&self) -> f64 {
        let cells = self.rows.n * self.cols.n;
        let edges = self.bins.n + 1;
        let per_edge: Vec<f64> = (1..self.bins.n)
            .into_par_iter()
            .map(|edge| {
                let mut shares: Vec<f32> = (0..cells).map(|c| self.cdf[c * edges + edge]).collect();
                shares.sort_unstable_by(f32::total_cmp);
                let n = cells as f64;
                let sum: f64 = (1..)
                    .zip(&shares)
                    .map(|(k, &f)| (2 * k - cells as i64 - 1) as f64 * f as f64)
                    .sum();
                2.0 * sum / (n * n)
            })
            .collect();
        per_edge.iter().sum::<f64>() * self.bins.width as f64
    }
}

/// Projects a picture onto textures whose local histograms are the same everywhere: each channel's
/// value c becomes `G^-1(F_x(c))`, `F_x` the local distribution around its pixel, `G` the global one.
///
/// # Paper
/// Moritz et al. 2017, Sec. 4.3. The grid replaces the paper's overlapping blocks.
///
/// # Determinism
/// Same bytes for any thread count.
pub fn project(pixels: &mut [Pixel], domain: Domain, sigma: f64) {
    /// Fewer would round the colours, more would starve the bins.
    const BINS: usize = 96;
    for k in 0..4 {
        let bins = Bins::covering(pixels.iter().map(|px| px[k]), BINS);
        if pixels.iter().all(|px| px[k] == bins.low) {
            continue;
        }
        let local = LocalDistributions::new(pixels, None, k, domain, sigma, bins);
        let quantiles = local.global().quantiles();
        pixels.par_chunks_mut(domain.width).enumerate().for_each(|(y, row)| {
            for (x, px) in row.iter_mut().enumerate() {
                px[k] = quantiles.at(local.share_below(y, x, px[k]));
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::rng::Rng;

    const DOMAIN: Domain = Domain { height: 40, width: 56, wrap_y: true, wrap_x: true };

    fn picture(domain: Domain) -> Vec<Pixel> {
        // A gradient, a blob and noise: far from stationary.
        (0..domain.height * domain.width)
            .map(|i| {
                let (y, x) = ((i / domain.width) as f32, (i % domain.width) as f32);
                let noise = Rng::new(5, 0, 0, i as u64).below(1000) as f32 / 50.0;
                let blob = if (y - 12.0).hypot(x - 20.0) < 8.0 { -15.0 } else { 0.0 };
                [40.0 + noise + blob, noise - 0.2 * x, 7.0, 0.0]
            })
            .collect()
    }

    /// The definition: Gaussian weights over all pixels (on the torus, over all images of each).
    fn share_below_direct(px: &[Pixel], d: Domain, sigma: f64, y: usize, x: usize, v: f32) -> f64 {
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
        for (sigma, wrap) in [(3.0, true), (6.5, true), (15.0, true), (6.5, false)] {
            let domain = Domain { wrap_y: wrap, wrap_x: wrap, ..DOMAIN };
            let px = picture(domain);
            let bins = Bins::covering(px.iter().map(|p| p[0]), 96);
            let local = LocalDistributions::new(&px, None, 0, domain, sigma, bins);
            let mut worst = 0f64;
            for y in (0..domain.height).step_by(3) {
                for x in (0..domain.width).step_by(3) {
                    for v in [25.0, 35.0, 45.0, 52.0, 58.0] {
                        let direct = share_below_direct(&px, domain, sigma, y, x, v);
                        worst = worst.max((direct - local.share_below(y, x, v) as f64).abs());
                    }
                }
            }
            // The definition's steps have the height of a pixel's share of the window, and a bin
            // holds a few. At cut ends the grid's window is a little wider than the pixels'.
            let pixel = 1.0 / (4.0 * std::f64::consts::PI * sigma * sigma);
            let limit = if wrap { 0.02 } else { 0.08 } + 2.0 * pixel;
            assert!(worst < limit, "sigma {sigma}, wrap {wrap}: off by {worst}");
        }
    }

    #[test]
    fn the_mean_distance_agrees_with_all_pairs() {
        let px = picture(DOMAIN);
        let bins = Bins::covering(px.iter().map(|p| p[0]), 64);
        let local = LocalDistributions::new(&px, None, 0, DOMAIN, 5.0, bins);
        let cells: Vec<&[f32]> = local.cdf.chunks_exact(65).collect();
        let mut sum = 0.0;
        for a in &cells {
            for b in &cells {
                sum += a.iter().zip(*b).map(|(u, v)| (u - v).abs() as f64).sum::<f64>();
            }
        }
        let direct = sum / (cells.len() * cells.len()) as f64 * bins.width as f64;
        assert!((local.mean_distance() - direct).abs() < 1e-6 * direct, "{direct}");
    }

    #[test]
    fn projection_evens_out_and_keeps_the_global_histogram() {
        let mut px = picture(DOMAIN);
        let bins = Bins::covering(px.iter().map(|p| p[0]), 64);
        let before = LocalDistributions::new(&px, None, 0, DOMAIN, 5.0, bins);
        project(&mut px, DOMAIN, 5.0);
        let after = LocalDistributions::new(&px, None, 0, DOMAIN, 5.0, bins);
        assert!(
            after.mean_distance() < 0.5 * before.mean_distance(),
            "{} -> {}",
            before.mean_distance(),
            after.mean_distance()
        );
        for v in [30.0, 40.0, 50.0] {
            let change = before.global().share_below(v) - after.global().share_below(v);
            assert!(change.abs() < 0.04, "share below {v} moved by {change}");
        }
        assert!(px.iter().all(|p| p[2] == 7.0), "a constant channel must not move");
    }

    #[test]
    fn rolling_the_torus_rolls_the_result() {
        // By whole cells, so that the grid sees the same samples.
        let sigma = 8.0;
        let px = picture(DOMAIN);
        let (dy, dx) = (20, 28);
        let mut rolled: Vec<Pixel> = (0..px.len())
            .map(|i| {
                let (y, x) = (i / DOMAIN.width, i % DOMAIN.width);
                px[(y + dy) % DOMAIN.height * DOMAIN.width + (x + dx) % DOMAIN.width]
            })
            .collect();
        let mut px = px;
        project(&mut px, DOMAIN, sigma);
        project(&mut rolled, DOMAIN, sigma);
        for (i, got) in rolled.iter().enumerate() {
            let (y, x) = (i / DOMAIN.width, i % DOMAIN.width);
            let want = px[(y + dy) % DOMAIN.height * DOMAIN.width + (x + dx) % DOMAIN.width];
            assert!((got[0] - want[0]).abs() < 0.05, "at {y}, {x}: {} != {}", got[0], want[0]);
        }
    }
}
