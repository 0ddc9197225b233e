//! Low frequencies of a picture that has holes.

use rayon::prelude::*;

/// Grid cells in one standard deviation. Fewer would show in the interpolation between them.
const CELLS: f64 = 4.0;

/// Standard deviations after which the Gaussian is cut.
const CUT: f64 = 3.0;

/// What keeps the slope of a neighbourhood without extent at zero, as a share of the window.
const RIDGE: f64 = 1e-9;

/// Sums of a cell, or of the window around it: mass, places, places squared, values, and values
/// times places.
type Moments = [f64; 15];

/// The low frequencies: at every place the plane that fits the usable pixels around it best, under
/// a Gaussian window, evaluated in its middle.
///
/// Unlike a plain mean this follows a slope up to the picture's border and to the rim of a hole.
#[derive(Debug)]
pub struct LowPass {
    side: usize,
    rows: usize,
    cols: usize,
    /// Of the picture, in pixels.
    width: usize,
    /// One value a cell, at its middle; `None` where no usable pixel is in reach.
    cells: Vec<Option<[f64; 3]>>,
}

impl LowPass {
    /// Of the picture (`height` x `width`) whose pixels, row by row, are those of `pixel`, where `usable`
    /// (`None`: everywhere), with a window of standard deviation `sigma` pixels. Each is asked for once.
    ///
    /// # Cost
    /// Linear in the pixels and independent of `sigma`: the window slides over cells of a quarter
    /// of it.
    ///
    /// # Determinism
    /// Same bytes for any thread count.
    pub fn new(
        pixel: impl Fn(usize) -> [f32; 3] + Sync,
        (height, width): (usize, usize),
        usable: Option<&[bool]>,
        sigma: f64,
    ) -> Self {
        let side = ((sigma / CELLS) as usize).max(1);
        let (rows, cols) = (height.div_ceil(side), width.div_ceil(side));
        let cell = |i: usize| {
            let (y0, x0) = (i / cols * side, i % cols * side);
            let (mut n, mut sum) = (0.0, [0.0; 5]);
            for y in y0..(y0 + side).min(height) {
                for x in x0..(x0 + side).min(width) {
                    if usable.is_none_or(|u| u[y * width + x]) {
                        let [a, b, c] = pixel(y * width + x).map(f64::from);
                        n += 1.0;
                        let terms = [y as f64, x as f64, a, b, c];
                        sum.iter_mut().zip(terms).for_each(|(sum, v)| *sum += v);
                    }
                }
            }
            // A cell counts as a point in the middle of its mass, in units of cells: what is
            // linear inside it stays exact.
            let [y, x, a, b, c] = sum.map(|v| if n > 0.0 { v / n } else { 0.0 });
            let (y, x) = (y / side as f64, x / side as f64);
            let m = n / (side * side) as f64;
            [1.0, y, x, y * y, y * x, x * x, a, b, c, y * a, y * b, y * c, x * a, x * b, x * c]
                .map(|v| m * v)
        };
        let sums: Vec<Moments> = (0..rows * cols).into_par_iter().map(cell).collect();
        let spread = sigma / side as f64;
        let reach = (CUT * spread).ceil() as usize;
        let taps: Vec<f64> =
            (0..=reach).map(|d| libm::exp(-0.5 * (d as f64 / spread).powi(2))).collect();
        let blurred = blur(&blur(&sums, rows, cols, &taps), cols, rows, &taps);
        let fit = |(i, m): (usize, &Moments)| {
            // Cells lie with their middles half a side less half a pixel behind their corners.
            let middle = 0.5 - 0.5 / side as f64;
            fitted(m, (i / cols) as f64 + middle, (i % cols) as f64 + middle, spread)
        };
        Self { side, rows, cols, width, cells: blurred.par_iter().enumerate().map(fit).collect() }
    }

    /// Calls `each` with the columns of a row of pixels and the values there; `None` where no usable pixel is
    /// in reach.
    pub fn row(&self, y: usize, mut each: impl FnMut(usize, Option<[f64; 3]>)) {
        let inverse = 1.0 / self.side as f64;
        // The cells before and after, and where between their middles it lies; beyond the outermost the line goes on.
        let at = (y as f64 + 0.5) * inverse - 0.5;
        let low = at.clamp(0.0, self.rows.saturating_sub(2) as f64) as usize;
        let line = |y: usize| &self.cells[y.min(self.rows - 1) * self.cols..][..self.cols];
        let t = at - low as f64;
        let cells: Vec<Option<[f64; 3]>> = line(low)
            .iter()
            .zip(line(low + 1))
            .map(|(a, b)| Some(between((*a)?, (*b)?, t)))
            .collect();
        let last = self.cols.saturating_sub(2);
        let mut from = 0;
        for low in 0..=last {
            let ends = cells[low].zip(cells[(low + 1).min(self.cols - 1)]);
            // Up to the middle of the cell after.
            let to = if low == last { self.width } else { ((2 * low + 3) * self.side).div_ceil(2) };
            for x in from..to {
                let t = (x as f64 + 0.5) * inverse - 0.5 - low as f64;
                each(x, ends.map(|(a, b)| between(a, b, t)));
            }
            from = to;
        }
    }
}

#[inline]
fn between(a: [f64; 3], b: [f64; 3], t: f64) -> [f64; 3] {
    std::array::from_fn(|k| a[k] + (b[k] - a[k]) * t)
}

/// Blurs `rows` x `cols` cells along the columns' direction and transposes them.
fn blur(cells: &[Moments], rows: usize, cols: usize, taps: &[f64]) -> Vec<Moments> {
    let item = |i: usize| {
        let (x, y) = (i / rows, i % rows);
        let mut sum = [0.0; 15];
        for from in y.saturating_sub(taps.len() - 1)..(y + taps.len()).min(rows) {
            let weight = taps[from.abs_diff(y)];
            let cell = &cells[from * cols + x];
            sum.iter_mut().zip(cell).for_each(|(sum, v)| *sum += weight * v);
        }
        sum
    };
    (0..rows * cols).into_par_iter().map(item).collect()
}

/// The plane through the moments, least squares, at (`y`, `x`).
fn fitted(m: &Moments, y: f64, x: f64, spread: f64) -> Option<[f64; 3]> {
    let mass = m[0];
    // Less than what a thousandth of a pixel at the rim of the window weighs.
    if mass <= 1e-9 {
        return None;
    }
    let (my, mx) = (m[1] / mass, m[2] / mass);
    let ridge = RIDGE * spread * spread;
    let (yy, yx, xx) =
        (m[3] / mass - my * my + ridge, m[4] / mass - my * mx, m[5] / mass - mx * mx + ridge);
    let det = yy * xx - yx * yx;
    Some(std::array::from_fn(|k| {
        let mean = m[6 + k] / mass;
        let (yv, xv) = (m[9 + k] / mass - my * mean, m[12 + k] / mass - mx * mean);
        let (slope_y, slope_x) = ((yv * xx - xv * yx) / det, (xv * yy - yv * yx) / det);
        mean + slope_y * (y - my) + slope_x * (x - mx)
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(low: &LowPass, y: usize, x: usize) -> Option<[f64; 3]> {
        let mut row = Vec::new();
        low.row(y, |x, value| {
            assert_eq!(x, row.len());
            row.push(value);
        });
        row[x]
    }

    /// By definition: every pixel looks at all pixels in reach of the window and fits its plane.
    fn naive(
        pixels: &[[f32; 3]],
        (h, w): (usize, usize),
        usable: &[bool],
        sigma: f64,
        at: (usize, usize),
    ) -> Option<[f64; 3]> {
        let mut m = [0.0; 15];
        for i in (0..h * w).filter(|&i| usable[i]) {
            let (dy, dx) = ((i / w) as f64 - at.0 as f64, (i % w) as f64 - at.1 as f64);
            let weight = libm::exp(-0.5 * (dy * dy + dx * dx) / (sigma * sigma));
            let [a, b, c] = pixels[i].map(f64::from);
            let terms = [
                1.0,
                dy,
                dx,
                dy * dy,
                dy * dx,
                dx * dx,
                a,
                b,
                c,
                dy * a,
                dy * b,
                dy * c,
                dx * a,
                dx * b,
                dx * c,
            ];
            m.iter_mut().zip(terms).for_each(|(m, v)| *m += weight * v);
        }
        fitted(&m, 0.0, 0.0, sigma)
    }

    fn holes(h: usize, w: usize) -> Vec<bool> {
        (0..h * w).map(|i| (i / w).abs_diff(20) > 6 || (i % w).abs_diff(15) > 5).collect()
    }

    #[test]
    fn the_grid_agrees_with_the_definition() {
        let (h, w) = (50, 61);
        let value = |i: usize, k: usize| {
            let (y, x) = ((i / w) as f32 / h as f32, (i % w) as f32 / w as f32);
            0.5 + 0.3 * y - 0.2 * x * y + 0.1 * ((i * 7919 + k * 31) % 101) as f32 / 101.0
        };
        let pixels: Vec<[f32; 3]> =
            (0..h * w).map(|i| std::array::from_fn(|k| value(i, k))).collect();
        let usable = holes(h, w);
        for sigma in [4.0, 9.0, 17.0] {
            let low = LowPass::new(|i| pixels[i], (h, w), Some(&usable), sigma);
            for (y, x) in [(0, 0), (3, 58), (20, 15), (25, 30), (49, 60), (14, 9)] {
                let got = at(&low, y, x).expect("in reach");
                let want = naive(&pixels, (h, w), &usable, sigma, (y, x)).expect("in reach");
                for k in 0..3 {
                    let off = (got[k] - want[k]).abs();
                    assert!(off < 0.006, "sigma {sigma} at {y}, {x}: {got:?} {want:?}");
                }
            }
        }
    }

    #[test]
    fn a_slope_is_itself_up_to_the_border_and_across_holes() {
        let (h, w) = (50, 61);
        let slope = |y: usize, x: usize| 0.2 + 0.01 * y as f64 - 0.003 * x as f64;
        let pixels: Vec<[f32; 3]> = (0..h * w).map(|i| [slope(i / w, i % w) as f32; 3]).collect();
        let low = LowPass::new(|i| pixels[i], (h, w), Some(&holes(h, w)), 12.0);
        for i in 0..h * w {
            let off = at(&low, i / w, i % w).expect("in reach")[1] - slope(i / w, i % w);
            assert!(off.abs() < 1e-5, "at {}, {}: {off}", i / w, i % w);
        }
    }

    #[test]
    fn nothing_usable_gives_nothing() {
        let low = LowPass::new(|_| [1.0; 3], (8, 8), Some(&[false; 64]), 2.0);
        assert!(at(&low, 3, 3).is_none());
    }
}
