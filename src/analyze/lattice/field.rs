//! Where the autocorrelation is looked at: smoothed, and with its ridges taken away.

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
        // The upper half; the lower is its mirror image.
        excess[..(reach[0] + 1) * cols].par_chunks_mut(cols).enumerate().for_each(|(i, row)| {
            let y = i as f64 - reach[0] as f64;
            for (j, value) in row.iter_mut().enumerate() {
                let x = j as f64 - reach[1] as f64;
                let ridge = |&direction: &[f64; 2]| ridge(&smooth, [y, x], direction, half, lobe);
                let highest = directions.iter().map(ridge).fold(0.0, f64::max);
                *value = (f64::from(smooth.at(y as isize, x as isize)) - highest) as f32;
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
        let (y0, x0) = (y.floor(), x.floor());
        let (fy, fx) = (y - y0, x - x0);
        let i = self.index(y0 as isize, x0 as isize);
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
        let mut values = vec![0.0f32; (2 * reach[0] + 1) as usize * cols];
        // A picture of one row or column has no neighbours there.
        let (h, w) = (gamma.height() as isize - 1, gamma.width() as isize - 1);
        values.par_chunks_mut(cols).enumerate().for_each(|(i, row)| {
            let y = i as isize - reach[0];
            for (j, value) in row.iter_mut().enumerate() {
                let x = j as isize - reach[1];
                let mut sum = 0.0;
                for (dy, a) in [(-1, 0.25), (0, 0.5), (1, 0.25)] {
                    for (dx, b) in [(-1, 0.25), (0, 0.5), (1, 0.25)] {
                        sum += a * b * gamma.at((y + dy).clamp(-h, h), (x + dx).clamp(-w, w));
                    }
                }
                *value = sum;
            }
        });
        Self { reach, values }
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
fn floor(v: f64) -> isize {
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

/// The mean along the line through `middle`.
fn ridge(plane: &Plane, middle: [f64; 2], direction: [f64; 2], half: f64, lobe: f64) -> f64 {
    let (mut n, mut sum) = (0, 0.0);
    for i in -RIDGE_SAMPLES..=RIDGE_SAMPLES {
        let t = half * f64::from(i) / f64::from(RIDGE_SAMPLES);
        let (y, x) = (middle[0] + t * direction[0], middle[1] + t * direction[1]);
        if y * y + x * x > lobe * lobe
            && let Some(v) = plane.sample(y, x)
        {
            n += 1;
            sum += v;
        }
    }
    if n > 0 { sum / f64::from(n) } else { 0.0 }
}
