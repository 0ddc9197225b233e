//! [`Solid`]: wavelet noise in space.

use std::sync::{Arc, OnceLock};

use super::filters::hold;
use super::fourier::{Strength, filter};
use super::places::{BEYOND, BLOCK, Places};
use super::{Detail, SPLINE_PRODUCTS, hash, quantised, spline, spline_weights, white, wrapped};

/// A torus of coefficients of wavelet noise in space, whose unit of length is one coefficient.
#[derive(Debug, Clone, PartialEq)]
pub struct Solid {
    integers: Vec<i16>,
    /// The integers, scaled, slice by slice (z), column by column (x), so that neighbours along y follow each
    /// other; the first of every axis once more beyond the last.
    values: Vec<f32>,
    scale: f32,
    /// What brings [`Solid::projected`] to unit variance.
    projected_scale: f64,
}

const N: usize = Solid::SIDE;

/// Values from a column to the next, and from a slice to the next.
const COLUMN: usize = N + BEYOND;
const SLICE: usize = (N + 2) * COLUMN;

impl Solid {
    /// Side of the torus.
    pub const SIDE: usize = 64;

    /// The coefficients of a detail that has no axes of its own, made once in a process.
    pub fn shared(detail: Detail) -> Arc<Self> {
        static MADE: [OnceLock<Arc<Solid>>; Detail::COUNT] =
            [const { OnceLock::new() }; Detail::COUNT];
        MADE[detail.index()].get_or_init(|| Arc::new(Self::new(detail))).clone()
    }

    /// The coefficients of a detail that has no axes of its own.
    pub fn new(detail: Detail) -> Self {
        let coefficients = if detail == Detail::Square {
            square()
        } else {
            let mut volume = white_volume(18);
            let along = detail.frequencies(0, N);
            filter(&mut volume, [N; 3], Strength::Kept, |at| {
                detail.amplitude(at.map(|k| &along[k])).unwrap_or(1.0)
            });
            volume
        };
        let (integers, scale) = quantised(&coefficients, variance);
        let mut values = Vec::with_capacity((N + 2) * SLICE);
        for i in 0..(N + 2) * SLICE {
            let (z, x, y) = (i / SLICE % N, i % SLICE / COLUMN % N, i % COLUMN % N);
            values.push(f32::from(integers[(z * N + y) * N + x]) * scale);
        }
        let mut solid = Self { integers, values, scale, projected_scale: 1.0 };
        solid.projected_scale = 1.0 / solid.projected_deviation();
        solid
    }

    /// The coefficients as the format has them, slice by slice (z), row by row (y).
    pub fn integers(&self) -> &[i16] {
        &self.integers
    }

    /// By what an integer is multiplied to become a coefficient of noise of unit variance.
    pub fn scale(&self) -> f32 {
        self.scale
    }

    #[inline]
    fn value(&self, x: i64, y: i64, z: i64) -> f32 {
        let [x, y, z] = [x, y, z].map(|v| v.rem_euclid(N as i64) as usize);
        self.values[z * SLICE + x * COLUMN + y]
    }

    /// The noise at a point (x, y, z): of mean 0 and, over all points, variance 1.
    #[inline]
    pub fn at(&self, point: [f64; 3]) -> f32 {
        let axes = point.map(spline_weights);
        let [x0, y0, z0] = axes.map(|(first, _)| i64::from(wrapped(first, N)));
        let [wx, wy, wz] = axes.map(|(_, weights)| weights);
        let mut sum = 0.0;
        for (z, wz) in (z0..).zip(wz) {
            let mut slice = 0.0;
            for (y, wy) in (y0..).zip(wy) {
                let v = [0, 1, 2].map(|k| self.value(x0 + k, y, z));
                slice += wy * ((wx[0] * v[0] + wx[1] * v[1]) + wx[2] * v[2]);
            }
            sum += wz * slice;
        }
        sum
    }

    /// Adds `weight` times the noise at a block of points to `sums`: the same bits as [`Solid::at`] gives.
    #[inline(always)]
    pub fn add_block(&self, [xs, ys, zs]: &[Places; 3], weight: f32, sums: &mut [f32; BLOCK]) {
        let mut noise = [0.0; BLOCK];
        for (slice, wz) in zs.weights.iter().enumerate() {
            // Along x, four places along y at a time, of which the last has no weight.
            let mut columns = [[0.0; 4]; BLOCK];
            let [w0, w1, w2] = &xs.weights;
            for i in 0..BLOCK {
                let column = (zs.first[i] as usize + slice) * SLICE + xs.first[i] as usize * COLUMN;
                let at = column + ys.first[i] as usize;
                let a = &self.values[at..][..4];
                let b = &self.values[at + COLUMN..][..4];
                let c = &self.values[at + 2 * COLUMN..][..4];
                for k in 0..4 {
                    columns[i][k] = (w0[i] * a[k] + w1[i] * b[k]) + w2[i] * c[k];
                }
            }
            let [w0, w1, w2] = &ys.weights;
            for (i, (noise, v)) in noise.iter_mut().zip(&columns).enumerate() {
                *noise += wz[i] * (((0.0 + w0[i] * v[0]) + w1[i] * v[1]) + w2[i] * v[2]);
            }
        }
        sums.iter_mut().zip(&noise).for_each(|(sum, noise)| *sum += weight * noise);
    }

    /// Standard deviation of the projected noise before it is scaled, over points and normals that are
    /// spread evenly.
    fn projected_deviation(&self) -> f64 {
        const POINTS: u32 = 4096;
        let number = |i: u32| f64::from(hash(i) >> 8) / 16_777_216.0;
        let square = |i: u32| {
            let point = [0, 1, 2].map(|k| number(5 * i + k) * N as f64);
            let (z, angle) =
                (2.0 * number(5 * i + 3) - 1.0, std::f64::consts::TAU * number(5 * i + 4));
            let r = (1.0 - z * z).sqrt();
            let value = self.projected(point, [r * libm::cos(angle), r * libm::sin(angle), z]);
            f64::from(value * value)
        };
        ((0..POINTS).map(square).sum::<f64>() / f64::from(POINTS)).sqrt()
    }

    /// The noise at a point of a surface with unit `normal`, integrated along that: unlike a plane cut
    /// out of space it has no frequencies lower than the band's (Cook and DeRose 2005, section 3.4).
    /// Mean 0, variance about 1.
    pub fn projected(&self, point: [f64; 3], normal: [f64; 3]) -> f32 {
        // The spline's extent when it is projected along the normal.
        let reach = normal.map(|n| 3.0 * n.abs() + 3.0 * ((1.0 - n * n).max(0.0) / 2.0).sqrt());
        let lowest: [i64; 3] = std::array::from_fn(|i| (point[i] - reach[i]).ceil() as i64);
        let highest: [i64; 3] = std::array::from_fn(|i| (point[i] + reach[i]).floor() as i64);
        let mut sum = 0.0f64;
        for z in lowest[2]..=highest[2] {
            for y in lowest[1]..=highest[1] {
                for x in lowest[0]..=highest[0] {
                    let c = [x, y, z].map(|v| v as f64);
                    let ahead: f64 = (0..3).map(|i| normal[i] * (point[i] - c[i])).sum();
                    let mut weight = 1.0;
                    for i in 0..3 {
                        let t = c[i] + normal[i] * ahead / 2.0 - (point[i] - 1.5);
                        weight *= spline(t - 1.5);
                        if weight == 0.0 {
                            break;
                        }
                    }
                    if weight != 0.0 {
                        sum += weight * f64::from(self.value(x, y, z));
                    }
                }
            }
        }
        (sum * self.projected_scale) as f32
    }
}

fn white_volume(stream: u32) -> Vec<f64> {
    (0..(N * N * N) as u32).map(|i| f64::from(white(stream, i))).collect()
}

/// Coefficients of Cook and DeRose's noise: as those of the plane.
fn square() -> Vec<f64> {
    let [first, second] = [16, 17].map(|stream| {
        let white = white_volume(stream);
        let mut held = white.clone();
        for stride in [1, N, N * N] {
            hold_along(&mut held, stride);
        }
        white.iter().zip(&held).map(|(w, h)| w - h).collect::<Vec<_>>()
    });
    let moved = |i: usize| (i + N / 2 + 1) % N;
    let place = |i: usize| (moved(i / (N * N)) * N + moved(i / N % N)) * N + moved(i % N);
    (0..N * N * N).map(|i| first[i] + second[place(i)]).collect()
}

/// What half the resolution along the axis with this stride can hold.
fn hold_along(volume: &mut [f64], stride: usize) {
    let (mut line, mut half) = (Vec::new(), Vec::new());
    for start in (0..volume.len()).filter(|i| (i / stride).is_multiple_of(N)) {
        line.clear();
        line.extend((0..N).map(|i| volume[start + i * stride]));
        hold(&mut line, &mut half);
        for (i, v) in line.iter().enumerate() {
            volume[start + i * stride] = *v;
        }
    }
}

/// Variance of the spline over these coefficients, averaged over all points: separable sums.
fn variance(integers: &[i16]) -> f64 {
    // The coefficients filtered by the spline's products with itself, against themselves.
    let mut filtered: Vec<i64> = integers.iter().map(|&v| i64::from(v)).collect();
    for stride in [1, N, N * N] {
        let before = filtered.clone();
        for (i, out) in filtered.iter_mut().enumerate() {
            let at = (i / stride) % N;
            *out = (0..5)
                .map(|k| {
                    SPLINE_PRODUCTS[k] * before[i - at * stride + (at + N + k - 2) % N * stride]
                })
                .sum();
        }
    }
    let total: i128 =
        integers.iter().zip(&filtered).map(|(&a, &b)| i128::from(a) * i128::from(b)).sum();
    total as f64 / (120.0f64.powi(3) * integers.len() as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn its_variance_is_one_in_space_and_on_surfaces() {
        for detail in [Detail::Square, Detail::Round, Detail::RoundFine] {
            let solid = Solid::new(detail);
            let n = 20_000;
            let point =
                |i: u32| [0, 1, 2].map(|k| f64::from(hash(3 * i + k + 99) >> 8) / 262_144.0);
            let variance = |value: &dyn Fn(u32) -> f32| {
                (0..n).map(|i| f64::from(value(i)).powi(2)).sum::<f64>() / f64::from(n)
            };
            let space = variance(&|i| solid.at(point(i)));
            let side = 0.5f64.sqrt();
            for normal in [[0.0, 0.0, 1.0], [side, 0.0, -side], [0.6, 0.48, 0.64]] {
                let surface = variance(&|i| solid.projected(point(i), normal));
                // Directions differ a little.
                assert!((surface - 1.0).abs() < 0.3, "{detail:?} {normal:?}: {surface}");
            }
            assert!((space - 1.0).abs() < 0.04, "{detail:?}: {space}");
        }
    }

    #[test]
    fn a_block_has_the_same_bits_as_its_points() {
        let solid = Solid::new(Detail::Round);
        let point = |i: usize| [i as f64 * 0.37 - 1e9, 63.0 - i as f64, (i * i) as f64 * 0.71];
        let mut places = [const { Places::NONE }; 3];
        (0..3).for_each(|axis| places[axis].set(N, |i| point(i)[axis]));
        let mut sums = [0.5; BLOCK];
        solid.add_block(&places, 0.7, &mut sums);
        for (i, &sum) in sums.iter().enumerate() {
            assert_eq!(sum, 0.5 + 0.7 * solid.at(point(i)), "point {i}");
        }
    }

    #[test]
    fn it_goes_round() {
        let solid = Solid::new(Detail::Round);
        for i in 0..50 {
            let point = [f64::from(i) * 0.7, f64::from(i) * -3.1, f64::from(i * i)];
            let moved = [point[0] + 64.0, point[1] - 128.0, point[2] + 6400.0];
            assert!((solid.at(point) - solid.at(moved)).abs() < 1e-4);
        }
    }

    #[test]
    fn the_coefficients_never_change() {
        // Documents made by older versions depend on them.
        let sums = [Detail::Square, Detail::Round, Detail::RoundFine].map(|detail| {
            let solid = Solid::new(detail);
            let fold = |sum: u32, &v: &i16| hash(sum ^ u32::from(v as u16));
            let at = solid.at([3.3, -7.1, 1e6 + 0.7]).to_bits();
            let on = solid.projected([3.3, -7.1, 50.7], [0.6, 0.0, 0.8]).to_bits();
            [solid.integers().iter().fold(0, fold), solid.scale().to_bits(), at, on]
        });
        assert_eq!(
            sums,
            [
                [619_731_280, 977_272_868, 1_057_555_096, 3_173_336_399],
                [2_481_073_840, 972_688_724, 1_038_719_816, 1_066_694_695],
                [3_878_518_687, 981_350_170, 3_174_213_708, 1_054_669_596]
            ]
        );
    }
}
