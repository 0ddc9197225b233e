//! The filters between a resolution and half of it, on a torus.

/// Half of the symmetric filter that takes a quadratic B-spline surface to half the resolution with the
/// least squared error (the appendix of Cook and DeRose 2005), from its middle outwards.
pub(super) const DOWN: [f64; 16] = [
    0.655_340, 0.033_979, -0.243_780, -0.025_936, 0.103_311, 0.011_655, -0.044_412, -0.005_040,
    0.019_120, 0.002_172, -0.008_233, -0.000_938, 0.003_546, 0.000_410, -0.001_528, 0.000_334,
];

/// The refinement of the quadratic B-spline: a coefficient of half the resolution in terms of four.
pub(super) const UP: [f64; 4] = [0.25, 0.75, 0.75, 0.25];

/// What half the resolution can hold of a line of even length, in place: down, and up again.
///
/// `half` is scratch space.
pub(super) fn hold(line: &mut [f64], half: &mut Vec<f64>) {
    let n = line.len();
    debug_assert!(n.is_multiple_of(2), "halves need even lengths");
    half.clear();
    half.extend((0..n / 2).map(|k| {
        let middle = 2 * k;
        DOWN.iter().enumerate().fold(0.0, |sum, (m, a)| {
            // The filter is longer than short lines: it goes round them more than once.
            let below = (middle + DOWN.len() * n - m) % n;
            let above = (middle + 1 + m) % n;
            sum + a * (line[below] + line[above])
        })
    }));
    line.fill(0.0);
    for (k, &c) in half.iter().enumerate() {
        for (m, p) in UP.into_iter().enumerate() {
            line[(2 * k + m + n - 1) % n] += p * c;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_half_the_resolution_holds_stays() {
        // A line that is an upsampled one.
        let coarse =
            [3.0, -1.0, 4.0, 1.0, -5.0, 9.0, 2.0, 6.0, -5.0, 3.0, 5.0, 8.0, 0.0, 1.0, 2.0, 7.0];
        let n = 2 * coarse.len();
        let mut line = vec![0.0; n];
        for (k, c) in coarse.into_iter().enumerate() {
            for (m, p) in UP.into_iter().enumerate() {
                line[(2 * k + m + n - 1) % n] += p * c;
            }
        }
        let mut held = line.clone();
        hold(&mut held, &mut Vec::new());
        // The taps are cut off after 32, and written with six digits.
        for (a, b) in line.iter().zip(&held) {
            assert!((a - b).abs() < 0.02, "{a} became {b}");
        }
    }

    #[test]
    fn constants_stay_on_any_length() {
        for n in [2, 4, 6, 32, 50] {
            let mut line = vec![1.0; n];
            hold(&mut line, &mut Vec::new());
            assert!(line.iter().all(|v| (v - 1.0).abs() < 1e-4), "{line:?}");
        }
    }
}
