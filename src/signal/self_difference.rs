//! How different a picture is from itself, moved along its rows.

use rayon::prelude::*;
use realfft::RealFftPlanner;
use realfft::num_complex::Complex;

/// Differences are rounded to this many steps of the picture's variance: transform libraries choose
/// instructions by the CPU, and the last bits must not decide anything.
const STEPS: f64 = (1 << 20) as f64;

/// Rows that are added up together; fixed, so that threads do not change the sums.
const BLOCK: usize = 32;

/// The mean squared difference between a picture and its copy moved to the right by k, for every k.
///
/// One or more `planes` of `height` x `width`, row by row, any range, finite; squared differences are
/// summed over the planes. Entry k (0 up to `width` - 1) is the mean over the pairs of `usable` pixels
/// (`None`: all) that lie k columns apart in the same row; `None` where there is no such pair. Also
/// returns the variance of the usable pixels, summed over the planes: unrelated pixels differ by
/// twice that.
///
/// # Paper
/// Representative Tile Extraction from near-periodic textures, sec. 3: g(k), with a mask.
///
/// # Determinism
/// Same bytes for any thread count. Rounded to 2^-20 of the variance, so that CPUs agree.
///
/// # Cost
/// O(n log n) for n pixels.
///
/// # Panics
/// If a plane or the mask has another size.
pub fn self_difference(
    planes: &[Vec<f32>],
    (height, width): (usize, usize),
    usable: Option<&[bool]>,
) -> (Vec<Option<f64>>, f64) {
    assert!(planes.iter().all(|p| p.len() == height * width), "planes do not fill the picture");
    assert!(usable.is_none_or(|u| u.len() == height * width), "the mask has another size");
    let ok = |i: usize| usable.is_none_or(|u| u[i]);
    let count = (0..height * width).filter(|&i| ok(i)).count();
    // Without their mean the squares are as small as can be.
    let means: Vec<f64> = planes
        .iter()
        .map(|p| p.iter().enumerate().filter(|(i, _)| ok(*i)).map(|(_, &v)| f64::from(v)).sum())
        .map(|sum: f64| sum / count.max(1) as f64)
        .collect();
    let value = |k: usize, i: usize| f64::from(planes[k][i]) - means[k];
    let square = |i: usize| (0..planes.len()).map(|k| value(k, i).powi(2)).sum::<f64>();
    let variance =
        (0..height * width).filter(|&i| ok(i)).map(square).sum::<f64>() / count.max(1) as f64;

    // Room for the moved copy, so that nothing wraps onto the picture.
    let length = (2 * width).next_power_of_two();
    let mut planner = RealFftPlanner::<f64>::new();
    let (forward, backward) = (planner.plan_fft_forward(length), planner.plan_fft_inverse(length));
    let bins = length / 2 + 1;
    // With the mask m and the sum of squares Q, the sum of (I(x) - I(x + k))^2 over pairs is that of
    // m Q and m at distance k, both ways round, less twice that of m I with itself. All three are
    // even in k, so their spectra are real and can be added over rows.
    let block = |b: usize| -> [Vec<f64>; 2] {
        let (mut differences, mut pairs) = (vec![0.0; bins], vec![0.0; bins]);
        let mut line = vec![0.0; length];
        let mut scratch = forward.make_scratch_vec();
        let mut transform = |of: &dyn Fn(usize) -> f64, y: usize| {
            let row = y * width..(y + 1) * width;
            line.fill(0.0);
            line.iter_mut().zip(row).for_each(|(v, i)| *v = if ok(i) { of(i) } else { 0.0 });
            let mut spectrum = forward.make_output_vec();
            let done = forward.process_with_scratch(&mut line, &mut spectrum, &mut scratch);
            debug_assert!(done.is_ok(), "buffers are of the planned lengths");
            spectrum
        };
        for y in b * BLOCK..((b + 1) * BLOCK).min(height) {
            let mask = transform(&|_| 1.0, y);
            let squares = transform(&square, y);
            for i in 0..bins {
                pairs[i] += mask[i].norm_sqr();
                differences[i] += 2.0 * (squares[i] * mask[i].conj()).re;
            }
            for k in 0..planes.len() {
                let plane = transform(&|i| value(k, i), y);
                for i in 0..bins {
                    differences[i] -= 2.0 * plane[i].norm_sqr();
                }
            }
        }
        [differences, pairs]
    };
    let blocks: Vec<[Vec<f64>; 2]> =
        (0..height.div_ceil(BLOCK)).into_par_iter().map(block).collect();
    let summed = |which: usize| {
        let mut spectrum = vec![Complex::new(0.0, 0.0); bins];
        for block in &blocks {
            spectrum.iter_mut().zip(&block[which]).for_each(|(sum, v)| sum.re += v);
        }
        let mut line = vec![0.0; length];
        let done = backward.process(&mut spectrum, &mut line);
        debug_assert!(done.is_ok(), "buffers are of the planned lengths");
        line.truncate(width);
        line.iter_mut().for_each(|v| *v /= length as f64);
        line
    };
    let unit = variance / STEPS;
    let mean = |(sum, pairs): (f64, f64)| {
        let pairs = pairs.round();
        let rounded = |v: f64| if unit > 0.0 { (v / unit).round().max(0.0) * unit } else { 0.0 };
        (pairs >= 1.0).then(|| rounded(sum / pairs))
    };
    (summed(0).into_iter().zip(summed(1)).map(mean).collect(), variance)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::rng::Rng;
    use proptest::prelude::*;

    /// By definition: all pairs.
    fn naive(planes: &[Vec<f32>], (h, w): (usize, usize), usable: &[bool]) -> Vec<Option<f64>> {
        let of = |k: usize| {
            let (mut sum, mut pairs) = (0.0, 0);
            for y in 0..h {
                for x in 0..w - k {
                    let (a, b) = (y * w + x, y * w + x + k);
                    if usable[a] && usable[b] {
                        pairs += 1;
                        sum += planes.iter().map(|p| f64::from(p[a] - p[b]).powi(2)).sum::<f64>();
                    }
                }
            }
            (pairs > 0).then(|| sum / f64::from(pairs))
        };
        (0..w).map(of).collect()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn it_is_what_its_definition_says(
            (h, w) in (1..70_usize, 1..24_usize),
            n in 1..4_usize,
            masked in 0..60_u32,
            seed: u64,
        ) {
            let mut rng = Rng::new(seed, 0, 0, 0);
            let planes: Vec<Vec<f32>> = (0..n)
                .map(|_| (0..h * w).map(|_| rng.below(256) as f32 / 255.0 + 7.0).collect())
                .collect();
            let usable: Vec<bool> = (0..h * w).map(|_| rng.below(100) >= masked).collect();
            let mask = (masked > 0).then_some(&usable[..]);
            let (got, variance) = self_difference(&planes, (h, w), mask);
            let want = naive(&planes, (h, w), &vec![true; h * w]);
            let want = if masked > 0 { naive(&planes, (h, w), &usable) } else { want };
            prop_assert_eq!(got.len(), want.len());
            for (k, (got, want)) in got.into_iter().zip(want).enumerate() {
                prop_assert_eq!(got.is_some(), want.is_some(), "distance {}", k);
                let off = (got.unwrap_or(0.0) - want.unwrap_or(0.0)).abs();
                prop_assert!(off <= 1e-5 * variance.max(1e-3), "distance {}: off by {}", k, off);
            }
        }
    }
}
