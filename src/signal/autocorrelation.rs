//! The generalized normalized autocorrelation of a picture.

use rayon::prelude::*;
use realfft::RealFftPlanner;
use realfft::num_complex::Complex;

/// Below this share of the whole picture's, an overlap's variance is rounding: it counts as flat.
/// Sums in double precision leave about 1e-15 of noise, so 1e-5 of a correlation is sure.
const FLAT: f64 = 1e-10;

/// Correlations are rounded to this many steps a unit. Transform libraries choose instructions by
/// the CPU, so the last bits differ between machines; they must not decide anything.
const STEPS: f64 = (1 << 20) as f64;

/// Columns transformed together: whole cache lines of the row spectra are read.
const BLOCK: usize = 8;

/// How alike a picture is to itself at every displacement.
#[derive(Debug, Clone)]
pub struct Autocorrelation {
    height: usize,
    width: usize,
    values: Vec<f32>,
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
    /// O(n log n); of each pixel about 48 bytes a plane and 130 more.
    ///
    /// # Panics
    /// If there are no planes, more than three, or one has another size.
    pub fn new(planes: &[Vec<f32>], (height, width): (usize, usize)) -> Self {
        assert!((1..=3).contains(&planes.len()), "{} planes", planes.len());
        assert!(planes.iter().all(|p| p.len() == height * width), "planes do not fill the picture");
        assert!(height > 0 && width > 0, "an empty picture");
        let planes: Vec<Vec<f64>> = planes.iter().map(|p| without_mean(p)).collect();
        let products = products(&planes, (height, width));
        let sums: Vec<Sums> = planes.iter().map(|p| Sums::new(p, (height, width))).collect();
        let (rows, cols) = (2 * height - 1, 2 * width - 1);
        let mut values = vec![0.0f32; rows * cols];
        // The lower half; the upper is its mirror image.
        values[(height - 1) * cols..].par_chunks_mut(cols).enumerate().for_each(|(dy, row)| {
            for (i, value) in row.iter_mut().enumerate() {
                let dx = i as isize - (width as isize - 1);
                let n = ((height - dy) * (width - dx.unsigned_abs())) as f64;
                let mut covariance = n * products[dy * cols + i];
                let mut spread = 0.0;
                for sums in &sums {
                    let ((f, ff), (g, gg)) = (sums.still(dy, dx), sums.moved(dy, dx));
                    covariance -= f * g;
                    let (vf, vg) = (n * ff - f * f, n * gg - g * g);
                    let flat = n * FLAT * sums.energy;
                    if vf > flat && vg > flat {
                        spread += (vf * vg).sqrt();
                    }
                }
                if spread > 0.0 {
                    let gamma = (covariance / spread).clamp(-1.0, 1.0);
                    *value = ((gamma * STEPS).round() / STEPS) as f32;
                }
            }
        });
        for dy in 1..height {
            let (upper, lower) = values.split_at_mut((height - 1) * cols);
            let from = &lower[dy * cols..][..cols];
            let to = &mut upper[(height - 1 - dy) * cols..][..cols];
            to.iter_mut().zip(from.iter().rev()).for_each(|(to, from)| *to = *from);
        }
        // The row of no vertical displacement is its own mirror image, up to rounding.
        for dx in 0..width {
            values[(height - 1) * cols + dx] = values[(height - 1) * cols + cols - 1 - dx];
        }
        Self { height, width, values }
    }

    /// Height of the picture.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Width of the picture.
    pub fn width(&self) -> usize {
        self.width
    }

    /// All correlations: 2 `height` - 1 rows of 2 `width` - 1, that of no displacement in the middle.
    pub fn values(&self) -> &[f32] {
        &self.values
    }

    /// The correlation at a displacement smaller than the picture, in -1..=1.
    #[inline]
    pub fn at(&self, dy: isize, dx: isize) -> f32 {
        let y = (dy + self.height as isize - 1) as usize;
        let x = (dx + self.width as isize - 1) as usize;
        self.values[y * (2 * self.width - 1) + x]
    }
}

fn without_mean(plane: &[f32]) -> Vec<f64> {
    let mean = plane.iter().map(|&v| f64::from(v)).sum::<f64>() / plane.len() as f64;
    plane.iter().map(|&v| f64::from(v) - mean).collect()
}

/// Sums over corners of the picture, of values and of their squares.
struct Sums {
    height: usize,
    width: usize,
    /// (`height` + 1) x (`width` + 1): over all above and to the left.
    integral: Vec<(f64, f64)>,
    /// The sum of all squares.
    energy: f64,
}

impl Sums {
    fn new(plane: &[f64], (height, width): (usize, usize)) -> Self {
        let stride = width + 1;
        let mut integral = vec![(0.0, 0.0); (height + 1) * stride];
        for y in 0..height {
            let mut row = (0.0, 0.0);
            for x in 0..width {
                let v = plane[y * width + x];
                row = (row.0 + v, row.1 + v * v);
                let above = integral[y * stride + x + 1];
                integral[(y + 1) * stride + x + 1] = (above.0 + row.0, above.1 + row.1);
            }
        }
        let energy = integral[integral.len() - 1].1;
        Self { height, width, integral, energy }
    }

    /// Over the pixels onto which the moved copy falls (`dy` not negative).
    #[inline]
    fn still(&self, dy: usize, dx: isize) -> (f64, f64) {
        let left = dx.max(0) as usize;
        self.rect((dy, self.height), (left, self.width - (-dx).max(0) as usize))
    }

    /// Over those pixels of the copy.
    #[inline]
    fn moved(&self, dy: usize, dx: isize) -> (f64, f64) {
        let left = (-dx).max(0) as usize;
        self.rect((0, self.height - dy), (left, self.width - dx.max(0) as usize))
    }

    #[inline]
    fn rect(&self, (y0, y1): (usize, usize), (x0, x1): (usize, usize)) -> (f64, f64) {
        let at = |y: usize, x: usize| self.integral[y * (self.width + 1) + x];
        let (a, b, c, d) = (at(y0, x0), at(y0, x1), at(y1, x0), at(y1, x1));
        (d.0 - b.0 - c.0 + a.0, d.1 - b.1 - c.1 + a.1)
    }
}

/// The sums over the overlap of the products of the picture and its moved copy, of all planes
/// together: `height` rows (no negative vertical displacements) of 2 `width` - 1.
fn products(planes: &[Vec<f64>], (height, width): (usize, usize)) -> Vec<f64> {
    // Room for the displaced copy, so that nothing wraps onto the picture.
    let (rows, cols) = (fast_size(2 * height - 1), fast_size(2 * width - 1));
    let mut reals = RealFftPlanner::<f64>::new();
    let (forward, backward) = (reals.plan_fft_forward(cols), reals.plan_fft_inverse(cols));
    let mut plain = rustfft::FftPlanner::<f64>::new();
    let (down, up) = (plain.plan_fft_forward(rows), plain.plan_fft_inverse(rows));
    let bins = cols / 2 + 1;
    let zero = Complex::new(0.0, 0.0);

    // Rows of each plane; those of the padding are zero and stay out.
    let spectra: Vec<Vec<Complex<f64>>> = planes
        .iter()
        .map(|plane| {
            let mut spectrum = vec![zero; height * bins];
            spectrum.par_chunks_mut(bins).zip(plane.par_chunks(width)).for_each_init(
                || (vec![0.0; cols], forward.make_scratch_vec()),
                |(padded, scratch), (out, row)| {
                    padded[..width].copy_from_slice(row);
                    padded[width..].fill(0.0);
                    let done = forward.process_with_scratch(padded, out, scratch);
                    debug_assert!(done.is_ok(), "buffers are of the planned lengths");
                },
            );
            spectrum
        })
        .collect();

    // Columns: the power of all planes, and back. `columns` holds `height` values of each bin.
    let mut columns = vec![zero; bins * height];
    columns.par_chunks_mut(BLOCK * height).enumerate().for_each_init(
        || {
            let scratch = down.get_inplace_scratch_len().max(up.get_inplace_scratch_len());
            (vec![zero; BLOCK * rows], vec![zero; BLOCK * rows], vec![zero; scratch])
        },
        |(block, power, scratch), (i, out)| {
            let n = out.len() / height;
            let (block, power) = (&mut block[..n * rows], &mut power[..n * rows]);
            power.fill(zero);
            for spectrum in &spectra {
                block.fill(zero);
                for y in 0..height {
                    let from = &spectrum[y * bins + i * BLOCK..][..n];
                    from.iter().enumerate().for_each(|(k, v)| block[k * rows + y] = *v);
                }
                down.process_with_scratch(block, scratch);
                power.iter_mut().zip(&*block).for_each(|(sum, v)| sum.re += v.norm_sqr());
            }
            up.process_with_scratch(power, scratch);
            for (out, column) in out.chunks_mut(height).zip(power.chunks(rows)) {
                out.copy_from_slice(&column[..height]);
            }
        },
    );

    let mut products = vec![0.0; height * (2 * width - 1)];
    let scale = 1.0 / (rows * cols) as f64;
    products.par_chunks_mut(2 * width - 1).enumerate().for_each_init(
        || (vec![zero; bins], vec![0.0; cols], backward.make_scratch_vec()),
        |(row, full, scratch), (dy, out)| {
            row.iter_mut().enumerate().for_each(|(k, v)| *v = columns[k * height + dy]);
            // A real row has real outermost bins; the transform insists.
            row[0].im = 0.0;
            if cols.is_multiple_of(2) {
                row[bins - 1].im = 0.0;
            }
            let done = backward.process_with_scratch(row, full, scratch);
            debug_assert!(done.is_ok(), "buffers are of the planned lengths");
            let negative = &full[cols - (width - 1)..];
            out.iter_mut()
                .zip(negative.iter().chain(&full[..width]))
                .for_each(|(out, v)| *out = v * scale);
        },
    );
    products
}

/// The smallest length of at least `n` with the prime factors 2, 3 and 5 only.
fn fast_size(n: usize) -> usize {
    let smooth = |mut m: usize| {
        for p in [2, 3, 5] {
            while m.is_multiple_of(p) {
                m /= p;
            }
        }
        m == 1
    };
    // There is a power of two.
    (n..=n.next_power_of_two()).find(|&m| smooth(m)).unwrap_or(n)
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
        for (i, (h, w)) in
            [(9, 12), (7, 7), (1, 10), (11, 1), (1, 1), (2, 5)].into_iter().enumerate()
        {
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
            pool.install(|| Autocorrelation::new(&planes, (h, w)).values().to_vec())
        };
        let one = with(1);
        assert!(one == with(2) && one == with(5));
    }

    #[test]
    fn lengths_are_smooth_and_not_shorter() {
        let got: Vec<_> = [1, 7, 11, 31, 127, 2047].map(fast_size).into();
        assert_eq!(got, [1, 8, 12, 32, 128, 2048]);
    }
}
