//! Gaussian windows around every pixel of a picture.
//!
//! What is summed under the window of every pixel is summed on a grid: spread into cells with a tent,
//! blurred separably, interpolated. Linear in the pixels and independent of the window's size.

use std::ops::{Add, AddAssign, Mul, Sub};

use rayon::prelude::*;

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

/// Most that two neighbouring windows of a prescription differ, as a factor.
const STEP: f64 = 2.0;

/// The standard deviation of the window around each pixel.
#[derive(Debug, Clone, PartialEq)]
pub struct Window {
    scales: Vec<Scale>,
}

/// One size of window, and how much it counts at every pixel.
#[derive(Debug, Clone, PartialEq)]
pub struct Scale {
    /// Standard deviation in pixels.
    pub sigma: f64,
    /// Weight at every pixel; `None` is 1 everywhere.
    pub weight: Option<Vec<f32>>,
}

impl Window {
    /// The same standard deviation everywhere, in pixels.
    pub fn even(sigma: f64) -> Self {
        Self { scales: vec![Scale { sigma, weight: None }] }
    }

    /// A standard deviation for every pixel, in pixels, all above 0.
    ///
    /// Windows of a few sizes (each at most twice the one before) are blended: at every pixel the
    /// next smaller and the next larger, such that the blend has the variance prescribed.
    pub fn prescribed(sigmas: &[f32]) -> Self {
        let ends = (f32::MAX, f32::MIN);
        let (low, high) = sigmas.iter().fold(ends, |(l, h), &s| (l.min(s), h.max(s)));
        assert!(low > 0.0 && high.is_finite(), "standard deviations from {low} to {high}");
        if low == high {
            return Self::even(f64::from(low));
        }
        let (low, high) = (f64::from(low), f64::from(high));
        let mut n_steps = 1;
        while low * STEP.powi(n_steps) < high {
            n_steps += 1;
        }
        let factor = libm::pow(high / low, 1.0 / f64::from(n_steps));
        let sizes: Vec<f64> = (0..=n_steps).map(|i| low * factor.powi(i)).collect();
        let weight = |i: usize| {
            let square = |j: usize| sizes[j] * sizes[j];
            let of = |&sigma: &f32| {
                let variance = f64::from(sigma) * f64::from(sigma);
                let up = |j: usize| {
                    ((variance - square(j)) / (square(j + 1) - square(j))).clamp(0.0, 1.0)
                };
                let above = if i > 0 { up(i - 1) } else { 1.0 };
                let beyond = if i + 1 < sizes.len() { up(i) } else { 0.0 };
                (above - beyond) as f32
            };
            Some(sigmas.iter().map(of).collect())
        };
        let scales = (0..sizes.len()).map(|i| Scale { sigma: sizes[i], weight: weight(i) });
        Self { scales: scales.collect() }
    }

    /// The sizes, smallest first; their weights add up to 1 at every pixel.
    pub fn scales(&self) -> &[Scale] {
        &self.scales
    }
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

/// The cells on which sums under a window are kept, row by row.
pub struct Grid {
    rows: Axis,
    cols: Axis,
}

impl std::fmt::Debug for Grid {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "Grid({}x{} cells)", self.rows.n, self.cols.n)
    }
}

/// A number that is summed under the window.
pub trait Summed:
    Copy
    + Default
    + Send
    + Sync
    + From<f32>
    + AddAssign
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
{
}
impl Summed for f32 {}
impl Summed for f64 {}

impl Grid {
    /// Cells for a Gaussian of standard deviation `sigma` pixels, wrapped around on the axes that
    /// wrap and cut off on those that do not.
    pub fn new(domain: Domain, sigma: f64) -> Self {
        let rows = Axis::new(domain.height, domain.wrap_y, sigma);
        Self { rows, cols: Axis::new(domain.width, domain.wrap_x, sigma) }
    }

    /// Number of cells.
    pub fn cells(&self) -> usize {
        self.rows.n * self.cols.n
    }

    /// Adds up `n` numbers of every cell's tent: `add` is called with the cell's sums, what `value`
    /// says of a pixel (`None`: not usable), and the pixel's weight.
    ///
    /// # Determinism
    /// Same bytes for any thread count.
    pub fn spread<T: Summed, V>(
        &self,
        n: usize,
        value: impl Fn(usize) -> Option<V> + Sync,
        add: impl Fn(&mut [T], &V, f32) + Sync,
    ) -> Vec<T> {
        let (height, width) = (self.rows.place.len(), self.cols.place.len());
        let step = |n: usize, cells: usize| (n / cells / SAMPLES).max(1);
        let (step_y, step_x) = (step(height, self.rows.n), step(width, self.cols.n));
        let mut sums = vec![T::default(); self.cells() * n];
        // Each cell row gathers the pixel rows whose tent reaches it.
        let pixel_rows = self.rows.pixels_of_cells(step_y);
        sums.par_chunks_mut(self.cols.n * n).zip(&pixel_rows).for_each(|(sums, pixel_rows)| {
            for &(y, weight_y) in pixel_rows {
                for (x, &(low, high, at)) in self.cols.place.iter().enumerate().step_by(step_x) {
                    if let Some(value) = value(y * width + x) {
                        add(&mut sums[low * n..][..n], &value, weight_y * (1.0 - at));
                        add(&mut sums[high * n..][..n], &value, weight_y * at);
                    }
                }
            }
        });
        sums
    }

    /// The sums of `n` numbers a cell under the window around each cell's middle.
    ///
    /// # Determinism
    /// Same bytes for any thread count.
    pub fn blurred<T: Summed>(&self, sums: &[T], n: usize) -> Vec<T> {
        let row_len = self.cols.n * n;
        let add = |out: &mut [T], from: &[T], weight: f32| {
            out.iter_mut().zip(from).for_each(|(o, &v)| *o += T::from(weight) * v);
        };
        let mut along = vec![T::default(); sums.len()];
        along.par_chunks_mut(row_len).zip(sums.par_chunks(row_len)).for_each(|(out, row)| {
            for (out, taps) in out.chunks_exact_mut(n).zip(&self.cols.blur) {
                taps.iter().for_each(|&(j, weight)| add(out, &row[j * n..][..n], weight));
            }
        });
        let mut both = vec![T::default(); sums.len()];
        both.par_chunks_mut(row_len).zip(&self.rows.blur).for_each(|(out, taps)| {
            taps.iter().for_each(|&(j, weight)| add(out, &along[j * row_len..][..row_len], weight));
        });
        both
    }

    /// Interpolates between the four cells around (`y`, `x`).
    #[inline]
    pub fn between<T: Summed>(&self, y: usize, x: usize, cell: impl Fn(usize) -> T) -> T {
        let (y0, y1, fy) = self.rows.place[y];
        let (x0, x1, fx) = self.cols.place[x];
        let (fy, fx) = (T::from(fy), T::from(fx));
        let row = |y: usize| {
            let (left, right) = (cell(y * self.cols.n + x0), cell(y * self.cols.n + x1));
            left + (right - left) * fx
        };
        let (top, bottom) = (row(y0), row(y1));
        top + (bottom - top) * fy
    }

    /// For every pixel of row `y` what its code becomes by the tables of the cells around it, blended:
    /// `put(column, value)`. A table holds `n` values, at the edges of the codes' bins; `place` says in
    /// which bin the pixel of a column lies and where in it. `blended` is room for a row of tables.
    #[inline]
    pub fn look_up(
        &self,
        tables: &[f32],
        n: usize,
        y: usize,
        place: impl Fn(usize) -> (usize, f32),
        blended: &mut Vec<f32>,
        mut put: impl FnMut(usize, f32),
    ) {
        let row_len = self.cols.n * n;
        // The tables of the two cell rows, blended once for the whole pixel row.
        let (y0, y1, fy) = self.rows.place[y];
        let (upper, lower) = (&tables[y0 * row_len..][..row_len], &tables[y1 * row_len..]);
        blended.clear();
        blended.extend(upper.iter().zip(lower).map(|(&a, &b)| a + (b - a) * fy));
        for (x, &(x0, x1, fx)) in self.cols.place.iter().enumerate() {
            let (bin, at) = place(x);
            let value = |cell: usize| {
                let i = cell * n + bin;
                blended[i] + (blended[i + 1] - blended[i]) * at
            };
            put(x, value(x0) + (value(x1) - value(x0)) * fx);
        }
    }

    /// The pixel at the middle of every cell.
    pub fn middles(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        let middle = |i: usize, cells: usize, n: usize| (2 * i + 1) * n / (2 * cells);
        (0..self.cells()).map(move |i| {
            let (y, x) = (i / self.cols.n, i % self.cols.n);
            (
                middle(y, self.rows.n, self.rows.place.len()),
                middle(x, self.cols.n, self.cols.place.len()),
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_prescription_is_a_blend_of_a_few_windows_with_its_variance() {
        let sigmas: Vec<f32> = (0..200).map(|i| 2.0 + 0.1 * i as f32).collect();
        let window = Window::prescribed(&sigmas);
        let sizes: Vec<f64> = window.scales().iter().map(|s| s.sigma).collect();
        assert_eq!(sizes.len(), 5, "{sizes:?}");
        assert!(sizes.windows(2).all(|s| s[1] / s[0] <= 2.0 && s[1] > s[0]), "{sizes:?}");
        for (i, &sigma) in sigmas.iter().enumerate() {
            let weights: Vec<f64> = window
                .scales()
                .iter()
                .map(|s| f64::from(s.weight.as_ref().expect("a weight")[i]))
                .collect();
            assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-5, "{sigma}: {weights:?}");
            assert!(weights.iter().filter(|&&w| w > 1e-6).count() <= 2, "{sigma}: {weights:?}");
            let variance: f64 = weights.iter().zip(&sizes).map(|(w, s)| w * s * s).sum();
            assert!((variance.sqrt() - f64::from(sigma)).abs() < 1e-3, "{sigma}: {variance}");
        }
    }

    #[test]
    fn a_constant_prescription_is_an_even_window() {
        assert_eq!(Window::prescribed(&[3.5; 9]), Window::even(3.5));
    }
}
