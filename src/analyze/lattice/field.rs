//! Where the autocorrelation is looked at: smoothed, and with its ridges taken away.

use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use crate::signal::autocorrelation::Autocorrelation;

/// Largest displacement that counts, as a share of the side. Beyond, too little overlaps.
const REACH: f64 = 0.6;

/// Largest displacement in pixels. Periods that are longer were seen when the picture was smaller.
const LONGEST: usize = 320;

/// How far the picture's ridges are followed, as a share of the side: beyond `REACH`, but not up to
/// the border, where correlations of a few pixels are noise.
const RIDGE_REACH: f64 = 0.85;

/// How many directions of ridges are taken away.
const RIDGES: usize = 4;

/// Degrees between directions that are tried, and between those that are taken.
const ANGLE_STEP: f64 = 0.5;
const ANGLE_APART: usize = 10;

/// Half the length of a ridge, as a share of the shorter side: several periods, and no more than
/// rows stay straight in a photograph.
const RIDGE_HALF: f64 = 0.35;

/// Samples to either side along a ridge.
const RIDGE_SAMPLES: i32 = 16;

/// Radius around no displacement that is left out of ridges, as a share of the shorter side: there
/// every picture resembles itself.
const MAIN_LOBE: f64 = 0.03;

/// The correlations of the displacements that count.
#[derive(Debug)]
pub(super) struct Field {
    /// Height and width of the picture.
    pub(super) size: [f64; 2],
    /// Largest vertical and horizontal displacement.
    reach: [usize; 2],
    /// The correlation, slightly smoothed.
    correlation: Vec<f32>,
    /// By how much it exceeds the ridges through it.
    excess: Vec<f32>,
}

impl Field {
    /// Of an autocorrelation.
    pub(super) fn new(gamma: &Autocorrelation) -> Self {
        let size = [gamma.height() as f64, gamma.width() as f64];
        let shorter = size[0].min(size[1]);
        // One pixel less than the picture: the smoothing looks at neighbours.
        let within = |share: f64| size.map(|n| ((share * n) as usize).min((n as usize).max(2) - 2));
        let reach = within(REACH).map(|n| n.min(LONGEST));
        let half = (RIDGE_HALF * shorter).min(LONGEST as f64 / 2.0);
        let wide = [0, 1].map(|k| (reach[k] + half as usize + 1).min(within(RIDGE_REACH)[k]));
        let smooth = Plane::smoothed(gamma, wide);
        let lobe = (MAIN_LOBE * shorter).max(4.0);
        let directions = ridge_directions(&smooth, shorter, lobe);
        let mut correlation = Vec::new();
        for y in -(reach[0] as isize)..=reach[0] as isize {
            for x in -(reach[1] as isize)..=reach[1] as isize {
                correlation.push(smooth.at(y, x));
            }
        }
        let (rows, cols) = (2 * reach[0] + 1, 2 * reach[1] + 1);
        let mut excess = vec![0.0f32; rows * cols];
        let arch = Arch::new();
        // The upper half; the lower is its mirror image.
        excess[..(reach[0] + 1) * cols].par_chunks_mut(cols).enumerate().for_each(|(i, row)| {
            let y = i as isize - reach[0] as isize;
            let mut highest = vec![0.0f32; cols];
            for &direction in &directions {
                let at = (y, reach[1] as isize);
                let means = arch.dispatch(Ridges { plane: &smooth, at, direction, half, lobe });
                highest.iter_mut().zip(means).for_each(|(h, mean)| *h = h.max(mean));
            }
            for ((x, value), highest) in (-(reach[1] as isize)..).zip(row).zip(highest) {
                *value = smooth.at(y, x) - highest;
            }
        });
        for i in (reach[0] + 1) * cols..rows * cols {
            excess[i] = excess[rows * cols - 1 - i];
        }
        Self { size, reach, correlation, excess }
    }

    /// Whether correlations are known at this displacement and around it.
    pub(super) fn covers(&self, [x, y]: [f64; 2]) -> bool {
        y.abs() <= self.reach[0] as f64 - 1.0 && x.abs() <= self.reach[1] as f64 - 1.0
    }

    /// Largest vertical and horizontal displacement.
    pub(super) fn reach(&self) -> [isize; 2] {
        self.reach.map(|n| n as isize)
    }

    /// How much of the picture overlaps with its copy moved by this, in 0..=1.
    pub(super) fn overlap(&self, [x, y]: [f64; 2]) -> f64 {
        (1.0 - y.abs() / self.size[0]).max(0.0) * (1.0 - x.abs() / self.size[1]).max(0.0)
    }

    fn index(&self, y: isize, x: isize) -> usize {
        let (top, left) = (self.reach[0] as isize, self.reach[1] as isize);
        ((y + top) * (2 * left + 1) + x + left) as usize
    }

    /// The correlation at a whole displacement within reach.
    pub(super) fn correlation(&self, y: isize, x: isize) -> f64 {
        f64::from(self.correlation[self.index(y, x)])
    }

    /// What it exceeds the ridges by.
    pub(super) fn excess(&self, y: isize, x: isize) -> f64 {
        f64::from(self.excess[self.index(y, x)])
    }

    /// Both, between displacements (linear); `covers` must hold.
    pub(super) fn sample(&self, [x, y]: [f64; 2]) -> (f64, f64) {
        let (y0, x0) = (floor(y), floor(x));
        let (fy, fx) = (y - y0 as f64, x - x0 as f64);
        let i = self.index(y0, x0);
        let stride = 2 * self.reach[1] + 1;
        let between = |plane: &[f32]| {
            let at = |i: usize| f64::from(plane[i]);
            let top = at(i) + (at(i + 1) - at(i)) * fx;
            let bottom = at(i + stride) + (at(i + stride + 1) - at(i + stride)) * fx;
            top + (bottom - top) * fy
        };
        (between(&self.correlation), between(&self.excess))
    }
}

/// Smoothed correlations within a rectangle of displacements.
struct Plane {
    reach: [isize; 2],
    values: Vec<f32>,
}

impl Plane {
    /// With the weights 1, 2, 1 in both directions: peaks of one pixel are noise or compression.
    fn smoothed(gamma: &Autocorrelation, reach: [usize; 2]) -> Self {
        let reach = reach.map(|n| n as isize);
        let cols = (2 * reach[1] + 1) as usize;
        let upper = reach[0] as usize * cols;
        let mut values = vec![0.0f32; 2 * upper + cols];
        // A picture of one row or column has no neighbours there.
        let (h, w) = (gamma.height() as isize - 1, gamma.width() as isize - 1);
        values[upper..].par_chunks_mut(cols).enumerate().for_each_init(
            || vec![0.0; cols + 2],
            |column, (y, row)| {
                let y = y as isize;
                for (x, value) in (-reach[1] - 1..).zip(&mut *column) {
                    let at = |y: isize| gamma.at(y.min(h).max(-h), x.min(w).max(-w));
                    *value = 0.25 * at(y - 1) + 0.5 * at(y) + 0.25 * at(y + 1);
                }
                for (value, near) in row.iter_mut().zip(column.windows(3)) {
                    *value = 0.25 * near[0] + 0.5 * near[1] + 0.25 * near[2];
                }
            },
        );
        // Upwards it is its own mirror image.
        let (above, below) = values.split_at_mut(upper);
        above.iter_mut().rev().zip(&below[cols..]).for_each(|(to, from)| *to = *from);
        Self { reach, values }
    }

    /// All displacements of a row.
    fn row(&self, y: isize) -> &[f32] {
        let cols = (2 * self.reach[1] + 1) as usize;
        &self.values[(y + self.reach[0]) as usize * cols..][..cols]
    }

    fn at(&self, y: isize, x: isize) -> f32 {
        self.values[((y + self.reach[0]) * (2 * self.reach[1] + 1) + x + self.reach[1]) as usize]
    }

    /// Linear between displacements; `None` beyond the rectangle.
    fn sample(&self, y: f64, x: f64) -> Option<f64> {
        let (y0, x0) = (floor(y), floor(x));
        let known = |v: isize, n: isize| -n <= v && v < n;
        if !known(y0, self.reach[0]) || !known(x0, self.reach[1]) {
            return None;
        }
        let (fy, fx) = (y - y0 as f64, x - x0 as f64);
        let at = |dy, dx| f64::from(self.at(y0 + dy, x0 + dx));
        let top = at(0, 0) + (at(0, 1) - at(0, 0)) * fx;
        let bottom = at(1, 0) + (at(1, 1) - at(1, 0)) * fx;
        Some(top + (bottom - top) * fy)
    }
}

/// The largest whole number that is not above `v`. Without the call that `f64::floor` is where the
/// processor is not known.
#[inline]
pub(super) fn floor(v: f64) -> isize {
    let toward_zero = v as isize;
    toward_zero - isize::from(toward_zero as f64 > v)
}

/// The directions, as unit vectors (y, x), in which lines through the middle correlate best.
fn ridge_directions(plane: &Plane, shorter: f64, lobe: f64) -> Vec<[f64; 2]> {
    let count = (180.0 / ANGLE_STEP) as usize;
    let unit = |i: usize| {
        let angle = (i as f64 * ANGLE_STEP).to_radians();
        [libm::sin(angle), libm::cos(angle)]
    };
    let (from, to) = ((0.03 * shorter).max(lobe) as usize, (0.45 * shorter).min(LONGEST as f64));
    let mean = |i: usize| {
        let [y, x] = unit(i);
        let on = |r: usize| plane.sample(y * r as f64, x * r as f64);
        let (n, sum) =
            (from..=to as usize).filter_map(on).fold((0, 0.0), |s, v| (s.0 + 1, s.1 + v));
        if n > 0 { sum / f64::from(n) } else { 0.0 }
    };
    let means: Vec<f64> = (0..count).into_par_iter().map(mean).collect();
    let highest = |i: &usize| {
        let i = *i;
        means[i] > means[(i + count - 1) % count] && means[i] >= means[(i + 1) % count]
    };
    let mut order: Vec<usize> = (0..count).filter(highest).collect();
    order.sort_by(|&a, &b| means[b].total_cmp(&means[a]).then(a.cmp(&b)));
    let mut taken: Vec<usize> = Vec::new();
    for i in order {
        let apart = |&j: &usize| i.abs_diff(j).min(count - i.abs_diff(j)) >= ANGLE_APART;
        if taken.len() < RIDGES && taken.iter().all(apart) {
            taken.push(i);
        }
    }
    taken.into_iter().map(unit).collect()
}

/// The means along the lines in a direction through all displacements of a row, `y` and from -`reach`
/// to `reach` (`at` has both); 0 where nothing is known. What lies within `lobe` of no displacement does not count.
struct Ridges<'a> {
    plane: &'a Plane,
    at: (isize, isize),
    direction: [f64; 2],
    half: f64,
    lobe: f64,
}

impl WithSimd for Ridges<'_> {
    type Output = Vec<f32>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> Vec<f32> {
        let Self { plane, at: (y, reach), direction: [dy, dx], half, lobe } = self;
        let cols = (2 * reach + 1) as usize;
        let (mut sum, mut n) = (vec![0.0f32; cols], vec![0.0f32; cols]);
        for i in -RIDGE_SAMPLES..=RIDGE_SAMPLES {
            // A sample lies alike between displacements for the whole row.
            let t = half * f64::from(i) / f64::from(RIDGE_SAMPLES);
            let (at_y, by_x) = (y as f64 + t * dy, t * dx);
            let (y0, x0) = (floor(at_y), floor(by_x));
            let (fy, fx) = ((at_y - y0 as f64) as f32, (by_x - x0 as f64) as f32);
            if y0 < -plane.reach[0] || y0 >= plane.reach[0] {
                continue;
            }
            // The columns whose sample has known neighbours.
            let first = (-reach).max(-plane.reach[1] - x0);
            let last = reach.min(plane.reach[1] - 1 - x0);
            if first > last {
                continue;
            }
            let (from, count) = ((first + reach) as usize, (last - first + 1) as usize);
            let line = |y: isize| &plane.row(y)[(first + x0 + plane.reach[1]) as usize..][..=count];
            let (upper, lower) = (line(y0), line(y0 + 1));
            let (sum, n) = (&mut sum[from..][..count], &mut n[from..][..count]);
            let pairs = upper.windows(2).zip(lower.windows(2)).map(|(upper, lower)| {
                let between = |ends: &[f32]| ends[0] + (ends[1] - ends[0]) * fx;
                let (top, bottom) = (between(upper), between(lower));
                top + (bottom - top) * fy
            });
            let all = sum.iter_mut().zip(n.iter_mut()).zip(pairs);
            if at_y.abs() > lobe {
                all.for_each(|((sum, n), value)| {
                    *sum += value;
                    *n += 1.0;
                });
                continue;
            }
            for (k, ((sum, n), value)) in all.enumerate() {
                let x = (first + k as isize) as f64 + by_x;
                let counts = f32::from(u8::from(at_y * at_y + x * x > lobe * lobe));
                *sum += counts * value;
                *n += counts;
            }
        }
        sum.iter().zip(n).map(|(sum, n)| if n > 0.0 { sum / n } else { 0.0 }).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::rng::Rng;

    /// The mean along one line, sample by sample.
    fn ridge(plane: &Plane, [y, x]: [f64; 2], [dy, dx]: [f64; 2], half: f64, lobe: f64) -> f64 {
        let on = |i: i32| {
            let t = half * f64::from(i) / f64::from(RIDGE_SAMPLES);
            let (y, x) = (y + t * dy, x + t * dx);
            if y.hypot(x) > lobe { plane.sample(y, x) } else { None }
        };
        let known: Vec<f64> = (-RIDGE_SAMPLES..=RIDGE_SAMPLES).filter_map(on).collect();
        if known.is_empty() { 0.0 } else { known.iter().sum::<f64>() / known.len() as f64 }
    }

    #[test]
    fn ridges_of_a_row_are_those_of_its_displacements() {
        let mut rng = Rng::new(8, 0, 0, 0);
        let reach = [30isize, 41];
        let values = (0..61 * 83).map(|_| rng.below(1000) as f32 / 500.0 - 1.0).collect();
        let plane = Plane { reach, values };
        for direction in [[0.0, 1.0], [1.0, 0.0], [0.6, 0.8], [-0.28, 0.96]] {
            for y in [-30isize, -17, -3, 0, 12, 30] {
                let row = Ridges { plane: &plane, at: (y, 35), direction, half: 19.3, lobe: 4.1 };
                let row = Arch::new().dispatch(row);
                assert_eq!(row.len(), 71);
                for (x, got) in (-35..).zip(row) {
                    let want = ridge(&plane, [y as f64, f64::from(x)], direction, 19.3, 4.1);
                    // A few dozen values of single precision.
                    assert!(
                        (f64::from(got) - want).abs() < 1e-6,
                        "{direction:?}, {y}, {x}: {got}, {want}"
                    );
                }
            }
        }
    }
}
