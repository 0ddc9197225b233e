//! The generalized normalized autocorrelation of a picture.

mod columns;
mod overlap;
mod products;

use pulp::{Arch, Simd, WithSimd};
use rayon::prelude::*;

use overlap::{Overlap, Side};
use products::Products;

/// Below this share of the whole picture's, an overlap's variance is rounding: it counts as flat.
/// Sums in double precision leave about 1e-15 of noise, so 1e-5 of a correlation is sure.
const FLAT: f64 = 1e-10;

/// Correlations are rounded to this many steps a unit. Transform libraries choose instructions by
/// the CPU, so the last bits differ between machines; they must not decide anything.
const STEPS: f64 = (1 << 20) as f64;

/// Added and taken away again it rounds to whole numbers: beyond it there are no fractions.
const WHOLE: f64 = 1.5 * (1u64 << 52) as f64;

/// Vertical displacements that are worked on together. More leave less to be done in parallel,
/// fewer cost sums to begin with.
const BAND: usize = 64;

/// How alike a picture is to itself at every displacement.
#[derive(Debug, Clone)]
pub struct Autocorrelation {
    height: usize,
    width: usize,
    /// The displacements that are not upwards: `height` rows of 2 `width` - 1.
    lower: Vec<f32>,
}

impl Autocorrelation {
    /// Of one to three `planes` of `height` x `width`, row by row, any range, finite.
    ///
    /// For the displacement d, over the N pixels where the picture and its copy moved by d overlap:
    /// the sum over the planes of the covariances of both, divided by the sum of the products of
    /// their standard deviations. 0 where no plane has any variance in the overlap.
    ///
    /// # Paper
    /// Near-Regular Texture Synthesis by Random Sampling and Gap Filling (2011), sec. 3.1 and 3.2,
    /// eq. 4 and 6. The weights of eq. 6 are the standard deviations by which eq. 4 divides, so the
    /// planes' spectra can be added before the one inverse transform.
    ///
    /// # Determinism
    /// Same bytes for any thread count. Rounded to 2^-20, so that CPUs agree as well but for a
    /// value that lies within 1e-13 of a step.
    ///
    /// # Cost
    /// O(n log n); of three planes about 60 bytes a pixel while it works, of one 30.
    ///
    /// # Panics
    /// If there are no planes, more than three, or one has another size.
    pub fn new(planes: &[Vec<f32>], (height, width): (usize, usize)) -> Self {
        assert!((1..=3).contains(&planes.len()), "{} planes", planes.len());
        assert!(planes.iter().all(|p| p.len() == height * width), "planes do not fill the picture");
        assert!(height > 0 && width > 0, "an empty picture");
        // Covariances do not depend on it, but sums of squares lose digits far from zero.
        let means: Vec<f64> = planes.iter().map(|plane| mean(plane)).collect();
        let products = Products::new(planes, &means, (height, width));
        let edges = edges(height);
        let (starts, squares): (Vec<_>, Vec<_>) = planes
            .iter()
            .zip(&means)
            .map(|(plane, mean)| Overlap::starts(plane, *mean, &edges))
            .unzip();
        let flat: Vec<f64> = squares.iter().map(|sum| FLAT * sum).collect();
        let cols = 2 * width - 1;
        // Of the overlaps of a row.
        let widths: Vec<f64> = (0..cols).map(|i| (width - i.abs_diff(width - 1)) as f64).collect();
        let mut lower = vec![0.0f32; height * cols];
        let mut rest = &mut lower[..];
        let mut bands = Vec::new();
        for (i, edge) in edges.windows(2).enumerate() {
            let (own, below) = rest.split_at_mut((edge[1] - edge[0]) * cols);
            let overlaps: Vec<Overlap> = starts.iter().map(|bands| bands[i].clone()).collect();
            bands.push((edge[0], own, overlaps));
            rest = below;
        }
        // With the CPU's widest instructions; the same bits, as no product and sum are joined.
        let arch = Arch::new();
        bands.into_par_iter().for_each_init(
            || (products.rows(), vec![0.0; cols], Line::new(width)),
            |(products, counts, line), (first, out, mut overlaps)| {
                for (i, out) in out.chunks_mut(cols).enumerate().rev() {
                    let dy = first + i;
                    for ((overlap, plane), mean) in overlaps.iter_mut().zip(planes).zip(&means) {
                        arch.dispatch(|| overlap.add(plane, *mean, dy));
                    }
                    for (count, columns) in counts.iter_mut().zip(&widths) {
                        *count = (height - dy) as f64 * columns;
                    }
                    let (left, right) = out.split_at_mut(width - 1);
                    let (left_counts, right_counts) = counts.split_at(width - 1);
                    let (left_products, right_products) = products.row(dy);
                    let sides = overlaps.iter().map(Overlap::to_the_right).zip(&flat);
                    let (counts, products) = (right_counts, right_products);
                    arch.dispatch(Correlated { line, out: right, counts, products, planes: sides });
                    if dy > 0 {
                        let sides = overlaps.iter().map(Overlap::to_the_left).zip(&flat);
                        let (counts, products) = (left_counts, left_products);
                        arch.dispatch(Correlated {
                            line,
                            out: left,
                            counts,
                            products,
                            planes: sides,
                        });
                    } else {
                        // Its own mirror image, up to rounding.
                        left.iter_mut().rev().zip(&right[1..]).for_each(|(to, from)| *to = *from);
                    }
                }
            },
        );
        Self { height, width, lower }
    }

    /// Height of the picture.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Width of the picture.
    pub fn width(&self) -> usize {
        self.width
    }

    /// The correlations at a vertical displacement smaller than the height: at 2 `width` - 1 horizontal
    /// ones, none in the middle. Upwards they are the same in reverse order.
    #[inline]
    pub fn row(&self, dy: usize) -> &[f32] {
        let cols = 2 * self.width - 1;
        &self.lower[dy * cols..][..cols]
    }

    /// All correlations: 2 `height` - 1 rows of 2 `width` - 1, that of no displacement in the middle.
    pub fn values(&self) -> Vec<f32> {
        let cols = 2 * self.width - 1;
        let upper = self.lower[cols..].iter().rev();
        upper.chain(&self.lower).copied().collect()
    }

    /// The correlation at a displacement smaller than the picture, in -1..=1.
    #[inline]
    pub fn at(&self, dy: isize, dx: isize) -> f32 {
        let dx = if dy < 0 { -dx } else { dx };
        self.row(dy.unsigned_abs())[(dx + self.width as isize - 1) as usize]
    }
}

/// The mean of a plane, summed in lanes.
fn mean(plane: &[f32]) -> f64 {
    let mut lanes = [0.0; 8];
    for values in plane.chunks(lanes.len()) {
        lanes.iter_mut().zip(values).for_each(|(lane, &v)| *lane += f64::from(v));
    }
    lanes.iter().sum::<f64>() / plane.len() as f64
}

/// Where bands of vertical displacements begin and end, from below the same as from above: their number
/// is odd, so that none lies on the middle.
fn edges(height: usize) -> Vec<usize> {
    let n = height.div_ceil(BAND) | 1;
    let edge = |i: usize| i * height / n;
    (0..=n).map(|i| if 2 * i < n { edge(i) } else { height - edge(n - i) }).collect()
}

/// What a row of displacements to one side needs beside the products.
struct Line {
    covariance: Vec<f64>,
    spread: Vec<f64>,
}

impl Line {
    fn new(width: usize) -> Self {
        Self { covariance: vec![0.0; width], spread: vec![0.0; width] }
    }
}

/// The correlations where overlaps have `counts` pixels and `products` as sums of products. Each plane's
/// `Side` comes with the variance, per pixel of both overlap and picture, that counts as flat.
struct Correlated<'a, I> {
    line: &'a mut Line,
    out: &'a mut [f32],
    counts: &'a [f64],
    products: &'a [f64],
    planes: I,
}

impl<'a, I: Iterator<Item = (Side<'a>, &'a f64)>> WithSimd for Correlated<'_, I> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { line, out, counts, products, planes } = self;
        let covariance = &mut line.covariance[..out.len()];
        let spread = &mut line.spread[..out.len()];
        spread.fill(0.0);
        for ((covariance, product), n) in covariance.iter_mut().zip(products).zip(counts) {
            *covariance = n * product;
        }
        for (Side { whole, sign, ends }, flat) in planes {
            let sums = covariance.iter_mut().zip(&mut *spread).zip(ends);
            for (((covariance, spread), ends), n) in sums.zip(counts) {
                let sum = |k: usize| whole[k] + sign * ends[k];
                let (f, ff, g, gg) = (sum(0), sum(1), sum(2), sum(3));
                *covariance -= f * g;
                let (vf, vg) = (n * ff - f * f, n * gg - g * g);
                let uneven = vf.min(vg) > n * flat;
                *spread += if uneven { (vf * vg).sqrt() } else { 0.0 };
            }
        }
        for ((out, covariance), &spread) in out.iter_mut().zip(covariance).zip(&*spread) {
            let covariance = if spread > 0.0 { *covariance } else { 0.0 };
            let gamma = (covariance / spread.max(f64::MIN_POSITIVE)).clamp(-1.0, 1.0);
            *out = ((gamma * STEPS + WHOLE - WHOLE) / STEPS) as f32;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::rng::Rng;

    /// By definition: loops over the overlap, two passes, for one displacement.
    fn naive(planes: &[Vec<f32>], (h, w): (usize, usize), dy: isize, dx: isize) -> f64 {
        let (mut top, mut bottom) = (0.0, 0.0);
        for plane in planes {
            let at = |y: isize, x: isize| f64::from(plane[y as usize * w + x as usize]);
            let mut pairs = Vec::new();
            for y in 0..h as isize {
                for x in 0..w as isize {
                    let (v, u) = (y - dy, x - dx);
                    if (0..h as isize).contains(&v) && (0..w as isize).contains(&u) {
                        pairs.push((at(y, x), at(v, u)));
                    }
                }
            }
            let n = pairs.len() as f64;
            let (f, g) = pairs.iter().fold((0.0, 0.0), |s, p| (s.0 + p.0 / n, s.1 + p.1 / n));
            let sum = |term: &dyn Fn(&(f64, f64)) -> f64| pairs.iter().map(term).sum::<f64>();
            let covariance = sum(&|p| (p.0 - f) * (p.1 - g));
            let deviation = |v: f64| (v / n).sqrt();
            let (sf, sg) =
                (deviation(sum(&|p| (p.0 - f).powi(2))), deviation(sum(&|p| (p.1 - g).powi(2))));
            // gamma_i s_fi s_gi, which is the covariance, or nothing where the plane is flat.
            if sf * sg > 1e-9 {
                top += covariance / (n * sf * sg) * sf * sg;
                bottom += sf * sg;
            }
        }
        if bottom > 0.0 { top / bottom } else { 0.0 }
    }

    fn random(n: usize, seed: u64) -> Vec<f32> {
        let mut rng = Rng::new(seed, 0, 0, 0);
        (0..n).map(|_| rng.below(256) as f32 / 255.0).collect()
    }

    fn ensure_as_defined(planes: &[Vec<f32>], (h, w): (usize, usize), what: &str) {
        let gamma = Autocorrelation::new(planes, (h, w));
        assert_eq!(gamma.values().len(), (2 * h - 1) * (2 * w - 1), "{what}");
        for dy in -(h as isize - 1)..h as isize {
            for dx in -(w as isize - 1)..w as isize {
                let (got, want) = (f64::from(gamma.at(dy, dx)), naive(planes, (h, w), dy, dx));
                assert!((got - want).abs() < 2e-6, "{what} at {dy}, {dx}: {got}, not {want}");
            }
        }
    }

    #[test]
    fn it_agrees_with_the_definition() {
        // The last ones have several bands of rows and of displacements, and blocks of columns.
        let sizes =
            [(9, 12), (7, 7), (1, 10), (11, 1), (1, 1), (2, 5), (33, 17), (65, 4), (131, 9)];
        for (i, (h, w)) in sizes.into_iter().enumerate() {
            let planes: Vec<_> = (0..3).map(|k| random(h * w, (i * 3 + k) as u64)).collect();
            for n in 1..=3 {
                ensure_as_defined(&planes[..n], (h, w), &format!("{n} planes of {h}x{w}"));
            }
        }
    }

    #[test]
    fn flat_regions_and_planes_give_zero_never_nan() {
        let (h, w) = (10, 13);
        // Flat but for a corner: most overlaps at large displacements are flat.
        let mut corner = vec![0.25; h * w];
        corner[0] = 1.0;
        corner[1] = 0.5;
        let half: Vec<f32> = random(h * w, 5)
            .iter()
            .enumerate()
            .map(|(i, &v)| if i % w < 6 { 0.7 } else { v })
            .collect();
        let flat = vec![0.1; h * w];
        ensure_as_defined(std::slice::from_ref(&corner), (h, w), "a corner");
        ensure_as_defined(std::slice::from_ref(&half), (h, w), "half flat");
        ensure_as_defined(&[flat.clone(), half, corner], (h, w), "three planes");
        let gamma = Autocorrelation::new(&[flat.clone(), flat], (h, w));
        assert!(gamma.values().iter().all(|&v| v == 0.0), "flat everywhere");
    }

    #[test]
    fn a_period_correlates_wholly_at_its_multiples_only() {
        let (h, w) = (40, 60);
        let cell = random(5 * 7, 3);
        let plane: Vec<f32> = (0..h * w).map(|i| cell[i / w % 5 * 7 + i % w % 7]).collect();
        let gamma = Autocorrelation::new(&[plane], (h, w));
        for (dy, dx) in [(0, 0), (5, 0), (-5, 7), (10, 21), (-30, -49)] {
            assert!(gamma.at(dy, dx) > 0.99999, "{dy}, {dx}: {}", gamma.at(dy, dx));
        }
        assert!(gamma.at(2, 3) < 0.7 && gamma.at(5, 3) < 0.7);
    }

    #[test]
    fn any_number_of_threads_gives_the_same_bytes() {
        let (h, w) = (37, 50);
        let planes = [random(h * w, 8), random(h * w, 9)];
        let with = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("pool");
            pool.install(|| Autocorrelation::new(&planes, (h, w)).values())
        };
        let one = with(1);
        assert!(one == with(2) && one == with(5));
    }
}
