//! Filtering on a torus, the same on every machine.

use rustfft::num_complex::Complex;
use rustfft::{Fft, FftPlannerScalar};
use std::sync::Arc;

/// Multiplies the spectrum of real samples on a torus of these sides (the last the fastest) by `gain`, a
/// function of frequencies in cycles a sample that is the same for opposite ones.
///
/// The planner without SIMD: with it the last bits depend on the CPU.
pub(super) fn filter<const N: usize>(
    samples: &mut [f64],
    sides: [usize; N],
    gain: impl Fn([f64; N]) -> f64,
) {
    let mut planner = FftPlannerScalar::<f64>::new();
    let mut values: Vec<_> = samples.iter().map(|&v| Complex::new(v, 0.0)).collect();
    let mut along = |values: &mut [Complex<f64>], axis: usize, forward: bool| {
        let n = sides[axis];
        let plan = if forward { planner.plan_fft_forward(n) } else { planner.plan_fft_inverse(n) };
        let stride = sides[axis + 1..].iter().product();
        lines(values, n, stride, &plan);
    };
    (0..N).for_each(|axis| along(&mut values, axis, true));
    let scale = 1.0 / samples.len() as f64;
    for (i, value) in values.iter_mut().enumerate() {
        let mut rest = i;
        let mut f = [0.0; N];
        for axis in (0..N).rev() {
            let (k, n) = (rest % sides[axis], sides[axis]);
            rest /= n;
            f[axis] = k.min(n - k) as f64 / n as f64;
        }
        *value *= gain(f) * scale;
    }
    (0..N).for_each(|axis| along(&mut values, axis, false));
    samples.iter_mut().zip(&values).for_each(|(to, v)| *to = v.re);
}

/// Transforms every line of `n` values that are `stride` apart.
fn lines(values: &mut [Complex<f64>], n: usize, stride: usize, plan: &Arc<dyn Fft<f64>>) {
    let mut line = vec![Complex::default(); n];
    let mut scratch = vec![Complex::default(); plan.get_inplace_scratch_len()];
    for start in (0..values.len()).filter(|i| (i / stride).is_multiple_of(n)) {
        let places = || (0..n).map(|k| start + k * stride);
        line.iter_mut().zip(places()).for_each(|(to, i)| *to = values[i]);
        plan.process_with_scratch(&mut line, &mut scratch);
        line.iter().zip(places()).for_each(|(from, i)| values[i] = *from);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waves_are_multiplied() {
        let (rows, cols) = (6, 10);
        let wave = |i: usize, (r, q): (usize, usize)| {
            let turns = (i / cols * r) as f64 / rows as f64 + (i % cols * q) as f64 / cols as f64;
            (std::f64::consts::TAU * turns).cos()
        };
        let mut samples: Vec<f64> =
            (0..rows * cols).map(|i| 2.0 + wave(i, (1, 3)) + wave(i, (0, 5))).collect();
        // Rows first.
        filter(&mut samples, [rows, cols], |[fy, fx]| 1.0 + 10.0 * fx + 100.0 * fy);
        for (i, got) in samples.iter().enumerate() {
            let expected =
                2.0 + (1.0 + 3.0 + 100.0 / 6.0) * wave(i, (1, 3)) + 6.0 * wave(i, (0, 5));
            assert!((got - expected).abs() < 1e-9, "{i}: {got} for {expected}");
        }
    }
}
