//! Filtering on a torus, the same on every machine.

use rustfft::num_complex::Complex;
use rustfft::{Fft, FftPlannerScalar};

use crate::signal::power::transposed_band;

/// What becomes of the strength that a wave has in the samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Strength {
    /// It counts.
    Kept,
    /// All waves get the same.
    Even,
}

/// Multiplies the spectrum of real samples on a torus of these sides (the last the fastest) by `gain`, a
/// function of how many waves go round each axis, without sign.
///
/// One thread, so that whoever computes something once for all may wait for it. The planner without
/// SIMD: with it the last bits depend on the CPU.
pub(super) fn filter<const N: usize>(
    samples: &mut [f64],
    sides: [usize; N],
    strength: Strength,
    gain: impl Fn([usize; N]) -> f64,
) {
    let mut planner = FftPlannerScalar::<f64>::new();
    let mut values: Vec<_> = samples.iter().map(|&v| Complex::new(v, 0.0)).collect();
    transform(&mut values, sides.map(|n| planner.plan_fft_forward(n)).as_ref());
    let scale = 1.0 / samples.len() as f64;
    // Gains of one sign of every axis.
    let table_sides = sides.map(|n| n / 2 + 1);
    let gains: Vec<f64> =
        (0..table_sides.iter().product()).map(|i| gain(places(i, table_sides)) * scale).collect();
    let last = sides[N - 1];
    for (line, values) in values.chunks_exact_mut(last).enumerate() {
        let at = places(line * last, sides);
        let start = at
            .iter()
            .zip(sides)
            .zip(table_sides)
            .fold(0, |start, ((&k, n), side)| start * side + k.min(n - k));
        for (k, value) in values.iter_mut().enumerate() {
            let gain = gains[start + k.min(last - k)];
            *value *= match strength {
                Strength::Kept => gain,
                Strength::Even => gain / value.norm_sqr().sqrt().max(f64::MIN_POSITIVE),
            };
        }
    }
    transform(&mut values, sides.map(|n| planner.plan_fft_inverse(n)).as_ref());
    samples.iter_mut().zip(&values).for_each(|(to, v)| *to = v.re);
}

/// Index along every axis of the `i`th value.
fn places<const N: usize>(i: usize, sides: [usize; N]) -> [usize; N] {
    let mut rest = i;
    let mut places = [0; N];
    for (place, side) in places.iter_mut().zip(sides).rev() {
        *place = rest % side;
        rest /= side;
    }
    places
}

/// Transforms along every axis, the first one first.
fn transform(values: &mut Vec<Complex<f64>>, plans: &[std::sync::Arc<dyn Fft<f64>>]) {
    const LINES: usize = 16;
    let mut turned = values.clone();
    for plan in plans {
        // The first axis becomes the last; after all of them it is the first again.
        let (rest, n) = (values.len() / plan.len(), plan.len());
        for (band, out) in turned.chunks_mut(LINES * n).enumerate() {
            transposed_band(values, rest, band * LINES, out);
        }
        std::mem::swap(values, &mut turned);
        plan.process(values);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A wave of as many turns along rows and columns.
    fn wave(i: usize, (rows, cols): (usize, usize), (r, q): (usize, usize)) -> f64 {
        let turns = (i / cols * r) as f64 / rows as f64 + (i % cols * q) as f64 / cols as f64;
        (std::f64::consts::TAU * turns).cos()
    }

    #[test]
    fn waves_are_multiplied() {
        let shape = (6, 10);
        let mut samples: Vec<f64> =
            (0..60).map(|i| 2.0 + wave(i, shape, (1, 3)) + wave(i, shape, (0, 5))).collect();
        // Rows first.
        let gain = |[y, x]: [usize; 2]| 1.0 + x as f64 + 10.0 * y as f64;
        filter(&mut samples, [6, 10], Strength::Kept, gain);
        for (i, got) in samples.iter().enumerate() {
            let expected = 2.0 + 14.0 * wave(i, shape, (1, 3)) + 6.0 * wave(i, shape, (0, 5));
            assert!((got - expected).abs() < 1e-9, "{i}: {got} for {expected}");
        }
    }

    #[test]
    fn waves_in_space_are_multiplied() {
        let sides = [2, 4, 6];
        let wave = |i: usize| {
            let [z, y, x] = places(i, sides);
            (std::f64::consts::TAU * (z as f64 / 2.0 + y as f64 / 4.0 + x as f64 / 3.0)).cos()
        };
        let mut samples: Vec<f64> = (0..48).map(wave).collect();
        let gain = |[z, y, x]: [usize; 3]| (100 * z + 10 * y + x) as f64;
        filter(&mut samples, sides, Strength::Kept, gain);
        for (i, got) in samples.iter().enumerate() {
            assert!((got - 112.0 * wave(i)).abs() < 1e-9, "{i}: {got}");
        }
    }

    #[test]
    fn waves_become_equally_strong() {
        let shape = (4, 6);
        let sum = |[a, b, c]: [f64; 3]| -> Vec<f64> {
            // The second goes down to the left.
            let waves = |i| [(1, 2), (1, 4), (1, 0)].map(|turns| wave(i, shape, turns));
            (0..24).map(waves).map(|[p, q, r]| a * p + b * q + c * r).collect()
        };
        let mut samples = sum([0.1, 5.0, -7.0]);
        filter(
            &mut samples,
            [4, 6],
            Strength::Even,
            |[y, x]| if y == 1 && x % 2 == 0 { 3.0 } else { 0.0 },
        );
        for (i, (got, expected)) in samples.iter().zip(sum([0.25, 0.25, -0.25])).enumerate() {
            assert!((got - expected).abs() < 1e-9, "{i}: {got} for {expected}");
        }
    }
}
