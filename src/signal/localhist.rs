//! Local distributions: the histogram of a channel around every pixel, under a Gaussian window.
//!
//! A grid of histograms in (space x range), spread with a tent in space, blurred separably and
//! interpolated: linear in the pixels and independent of the window's size.

use rayon::prelude::*;

use crate::signal::histogram::{BINS, Distribution, Quantiles, Soft, bin_of, rounded};

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

/// Cells across one standard deviation of the window. Fewer and the window takes the grid's shape;
/// more and the blur costs more than the pixels.
const CELLS: f64 = 1.25;

/// Pixels looked at across a cell; the window then holds a few thousand.
const SAMPLES: usize = 20;

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
        let n = ((n_pixels as f64 * CELLS / sigma).ceil() as usize).clamp(1, n_pixels);
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
    /// `(row, column, edge)`: share of the window below each bin edge; all zeros where nothing is
    /// usable.
    cdf: Vec<f32>,
    global: Option<Distribution>,
}

impl std::fmt::Debug for LocalDistributions {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "LocalDistributions({}x{} cells)", self.rows.n, self.cols.n)
    }
}

impl LocalDistributions {
    /// Distributions of channel `k` of `pixels` (where `usable`) under a Gaussian of standard
    /// deviation `sigma` pixels, wrapped around on the axes that wrap and cut off on those that do
    /// not.
    ///
    /// # Paper
    /// Moritz et al. 2017, eq. 3, with a box of one code as range window.
    ///
    /// # Determinism
    /// Same bytes for any thread count.
    pub fn new(
        pixels: &[Soft],
        usable: Option<&[bool]>,
        k: usize,
        domain: Domain,
        sigma: f64,
    ) -> Self {
        let Domain { height, width, wrap_y, wrap_x } = domain;
        assert_eq!(pixels.len(), height * width, "pixels do not fill the domain");
        let rows = Axis::new(height, wrap_y, sigma);
        let cols = Axis::new(width, wrap_x, sigma);
        let step = |n: usize, cells: usize| (n / cells / SAMPLES).max(1);
        let (step_y, step_x) = (step(height, rows.n), step(width, cols.n));

        // Spread: each cell row gathers the pixel rows whose tent reaches it.
        let mut mass = vec![0f32; rows.n * cols.n * BINS];
        let pixel_rows = rows.pixels_of_cells(step_y);
        mass.par_chunks_mut(cols.n * BINS).zip(&pixel_rows).for_each(|(mass, pixel_rows)| {
            for &(y, weight_y) in pixel_rows {
                let row = &pixels[y * width..][..width];
                let usable = usable.map(|u| &u[y * width..][..width]);
                for (x, &(low, high, at)) in cols.place.iter().enumerate().step_by(step_x) {
                    if usable.is_some_and(|u| !u[x]) {
                        continue;
                    }
                    let bin = bin_of(row[x][k]).0;
                    mass[low * BINS + bin] += weight_y * (1.0 - at);
                    mass[high * BINS + bin] += weight_y * at;
                }
            }
        });
        let mut total = vec![0f64; BINS];
        for cell in mass.chunks_exact(BINS) {
            total.iter_mut().zip(cell).for_each(|(t, &m)| *t += m as f64);
        }

        // Blur along the columns, then along the rows.
        let row_len = cols.n * BINS;
        let mut blurred = vec![0f32; mass.len()];
        blurred.par_chunks_mut(row_len).zip(mass.par_chunks(row_len)).for_each(|(out, row)| {
            for (out, taps) in out.chunks_exact_mut(BINS).zip(&cols.blur) {
                for &(j, weight) in taps {
                    out.iter_mut()
                        .zip(&row[j * BINS..][..BINS])
                        .for_each(|(o, &m)| *o += weight * m);
                }
            }
        });
        let mut cdf = vec![0f32; rows.n * cols.n * (BINS + 1)];
        cdf.par_chunks_mut(cols.n * (BINS + 1)).zip(&rows.blur).for_each_init(
            || vec![0f32; row_len],
            |sum, (out, taps)| {
                sum.fill(0.0);
                for &(j, weight) in taps {
                    let row = &blurred[j * row_len..][..row_len];
                    sum.iter_mut().zip(row).for_each(|(s, &m)| *s += weight * m);
                }
                for (out, cell) in out.chunks_exact_mut(BINS + 1).zip(sum.chunks_exact(BINS)) {
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
                    out[BINS] = 1.0;
                }
            },
        );
        Self { rows, cols, cdf, global: Distribution::from_masses(&total) }
    }

    /// The distribution of the whole picture; `None` if none of it is usable.
    pub fn global(&self) -> Option<&Distribution> {
        self.global.as_ref()
    }

    /// The share of the window around (`y`, `x`) that lies below `v`.
    pub fn share_below(&self, y: usize, x: usize, v: u16) -> f32 {
        let (bin, at) = bin_of(v);
        let (y0, y1, fy) = self.rows.place[y];
        let (x0, x1, fx) = self.cols.place[x];
        let cell = |y: usize, x: usize| {
            let i = (y * self.cols.n + x) * (BINS + 1) + bin;
            self.cdf[i] + (self.cdf[i + 1] - self.cdf[i]) * at
        };
        let top = cell(y0, x0) + (cell(y0, x1) - cell(y0, x0)) * fx;
        let bottom = cell(y1, x0) + (cell(y1, x1) - cell(y1, x0)) * fx;
        top + (bottom - top) * fy
    }

    /// The typical local distribution: the median over all places of each quantile. `None` if
    /// no place has a usable sample.
    pub fn typical(&self) -> Option<Quantiles> {
        let places: Vec<Quantiles> = self
            .cdf
            .par_chunks_exact(BINS + 1)
            .filter(|cdf| cdf[BINS] > 0.0)
            .map(|cdf| Distribution::from_cumulative(cdf.to_vec()).quantiles())
            .collect();
        Quantiles::median(&places)
    }

    /// Mean earth mover's distance between the distributions of two cells, over all pairs, in codes.
    ///
    /// In one dimension the distance is the L1 distance of the two cumulative distributions, and
    /// for sorted values `mean |F_i - F_j| = 2 / n^2 * sum_k (2 k - n - 1) F_(k)`.
    pub fn mean_distance(&self) -> f64 {
        let cells = self.rows.n * self.cols.n;
        let edges = BINS + 1;
        let per_edge: Vec<f64> = (1..BINS)
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
        per_edge.iter().sum()
    }
}

/// Projects a picture onto textures whose local histograms are the same everywhere: each channel's
/// value c moves by `share` (1: all the way) towards `G^-1(F_x(c))`, `F_x` the local distribution
/// around its pixel, `G` the global one.
///
/// # Paper
/// Moritz et al. 2017, Sec. 4.3. A grid of cells replaces the paper's overlapping blocks; as there,
/// each cell's own mapping is computed and the mappings are blended.
///
/// # Determinism
/// Same bytes for any thread count.
pub fn project(pixels: &mut [Soft], domain: Domain, sigma: f64, share: f32) {
    for k in 0..4 {
        let first = pixels[0][k];
        if pixels.iter().all(|px| px[k] == first) {
            continue;
        }
        let local = LocalDistributions::new(pixels, None, k, domain, sigma);
        let quantiles = local.global().expect("some pixels").quantiles();
        let mapped: Vec<f32> = local.cdf.par_iter().map(|&share| quantiles.at(share)).collect();
        let row_len = local.cols.n * (BINS + 1);
        pixels.par_chunks_mut(domain.width).enumerate().for_each_init(
            || vec![0f32; row_len],
            |tables, (y, row)| {
                // The mappings of the two cell rows, blended once for the whole pixel row.
                let (y0, y1, fy) = local.rows.place[y];
                let (upper, lower) = (&mapped[y0 * row_len..], &mapped[y1 * row_len..]);
                for ((t, &a), &b) in tables.iter_mut().zip(upper).zip(lower) {
                    *t = a + (b - a) * fy;
                }
                for (px, &(x0, x1, fx)) in row.iter_mut().zip(&local.cols.place) {
                    let (bin, at) = bin_of(px[k]);
                    let value = |cell: usize| {
                        let i = cell * (BINS + 1) + bin;
                        tables[i] + (tables[i + 1] - tables[i]) * at
                    };
                    let even = value(x0) + (value(x1) - value(x0)) * fx;
                    px[k] = rounded(px[k] as f32 + share * (even - px[k] as f32));
                }
            },
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::rng::Rng;
    use crate::signal::histogram::SOFT_BITS;

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
            let local = LocalDistributions::new(&px, None, 0, domain, sigma);
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
        let local = LocalDistributions::new(&picture(DOMAIN), None, 0, DOMAIN, 5.0);
        let cells: Vec<&[f32]> = local.cdf.chunks_exact(BINS + 1).collect();
        let mut sum = 0.0;
        for a in &cells {
            for b in &cells {
                sum += a.iter().zip(*b).map(|(u, v)| (u - v).abs() as f64).sum::<f64>();
            }
        }
        let direct = sum / (cells.len() * cells.len()) as f64;
        assert!((local.mean_distance() - direct).abs() < 1e-6 * direct, "{direct}");
    }

    #[test]
    fn projection_evens_out_and_keeps_the_global_histogram() {
        let mut px = picture(DOMAIN);
        let before = LocalDistributions::new(&px, None, 0, DOMAIN, 5.0);
        project(&mut px, DOMAIN, 5.0, 1.0);
        let after = LocalDistributions::new(&px, None, 0, DOMAIN, 5.0);
        let (was, is) = (before.mean_distance(), after.mean_distance());
        assert!(is < 0.5 * was, "{was} -> {is}");
        for v in [45, 60, 80].map(|v| v << SOFT_BITS) {
            let share = |d: &LocalDistributions| d.global().expect("some").share_below(v);
            let change = share(&before) - share(&after);
            assert!(change.abs() < 0.04, "share below {v} moved by {change}");
        }
        assert!(px.iter().all(|p| p[2] == 7 << SOFT_BITS), "a constant channel must not move");
    }

    #[test]
    fn rolling_the_torus_rolls_the_result() {
        // By whole cells, so that the grid sees the same samples.
        let px = picture(DOMAIN);
        let (dy, dx) = (20, 28);
        let rolled = |px: &[Soft]| -> Vec<Soft> {
            let from = |i: usize| {
                let (y, x) = (i / DOMAIN.width, i % DOMAIN.width);
                (y + dy) % DOMAIN.height * DOMAIN.width + (x + dx) % DOMAIN.width
            };
            (0..px.len()).map(|i| px[from(i)]).collect()
        };
        let (mut straight, mut shifted) = (px.clone(), rolled(&px));
        // Four and six cells.
        project(&mut straight, DOMAIN, 12.5, 1.0);
        project(&mut shifted, DOMAIN, 12.5, 1.0);
        for (i, (got, want)) in shifted.iter().zip(rolled(&straight)).enumerate() {
            assert!(got[0].abs_diff(want[0]) < 8, "pixel {i}: {} != {}", got[0], want[0]);
        }
    }
}
