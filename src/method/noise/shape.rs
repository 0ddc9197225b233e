//! [`Shape`]: a channel's histogram as a function of a normally distributed number.

use pulp::Simd;

use crate::signal::normal;

/// Where the knots lie, in standard deviations. Beyond the outermost the value stays.
pub const KNOTS: [f64; 11] = [-3.2, -2.3, -1.6, -1.0, -0.5, 0.0, 0.5, 1.0, 1.6, 2.3, 3.2];

/// A monotone piecewise cubic Hermite spline (Fritsch and Carlson 1980) through values at [`KNOTS`].
#[derive(Debug, Clone, PartialEq)]
pub struct Shape {
    knots: [f32; KNOTS.len()],
    /// Between two knots, with t from 0 to 1: c0 + t (c1 + t (c2 + t c3)); and 1 / distance.
    pieces: [[f32; 5]; KNOTS.len() - 1],
    ends: [f32; 2],
}

impl Shape {
    /// Through these values, which must not fall.
    pub fn new(values: &[f64; KNOTS.len()]) -> Self {
        let slopes = slopes(values);
        let pieces = std::array::from_fn(|i| {
            let h = KNOTS[i + 1] - KNOTS[i];
            let (rise, a, b) = (values[i + 1] - values[i], h * slopes[i], h * slopes[i + 1]);
            let piece = [values[i], a, 3.0 * rise - 2.0 * a - b, a + b - 2.0 * rise, 1.0 / h];
            piece.map(|c| c as f32)
        });
        let ends = [values[0] as f32, values[KNOTS.len() - 1] as f32];
        Self { knots: KNOTS.map(|u| u as f32), pieces, ends }
    }

    /// The knots, and between each two of them the coefficients of 1, t, t^2 and t^3, where t goes from 0
    /// to 1, and the factor from a difference to t.
    pub fn pieces(&self) -> impl Iterator<Item = (f32, [f32; 5])> {
        self.knots.into_iter().zip(self.pieces)
    }

    /// The value at `u` standard deviations.
    #[inline]
    pub fn at(&self, u: f32) -> f32 {
        if u <= self.knots[0] {
            return self.ends[0];
        }
        if u >= self.knots[KNOTS.len() - 1] {
            return self.ends[1];
        }
        let i = self.knots[1..KNOTS.len() - 1].iter().filter(|&&knot| u >= knot).count();
        let [c0, c1, c2, c3, per] = self.pieces[i];
        let t = (u - self.knots[i]) * per;
        c0 + t * (c1 + t * (c2 + t * c3))
    }

    /// Replaces numbers of standard deviations by their values: the same bits as [`Shape::at`] gives.
    #[inline(always)]
    pub(super) fn apply<S: Simd>(&self, simd: S, us: &mut [f32]) {
        // Every piece is tried in turn, which one lane alone does worse than finding it.
        let (vectors, rest) =
            if S::F32_LANES > 1 { S::as_mut_simd_f32s(us) } else { (&mut [][..], us) };
        let all = |value: f32| simd.splat_f32s(value);
        let last = KNOTS.len() - 1;
        for u in vectors {
            let mut knot = all(self.knots[0]);
            let mut piece = self.pieces[0].map(all);
            for i in 1..last {
                let above = simd.greater_than_or_equal_f32s(*u, all(self.knots[i]));
                knot = simd.select_f32s(above, all(self.knots[i]), knot);
                for (c, &next) in piece.iter_mut().zip(&self.pieces[i]) {
                    *c = simd.select_f32s(above, all(next), *c);
                }
            }
            let [c0, c1, c2, c3, per] = piece;
            let t = simd.mul_f32s(simd.sub_f32s(*u, knot), per);
            let value = simd.add_f32s(c2, simd.mul_f32s(t, c3));
            let value = simd.add_f32s(c1, simd.mul_f32s(t, value));
            let value = simd.add_f32s(c0, simd.mul_f32s(t, value));
            let below = simd.less_than_or_equal_f32s(*u, all(self.knots[0]));
            let value = simd.select_f32s(below, all(self.ends[0]), value);
            let beyond = simd.greater_than_or_equal_f32s(*u, all(self.knots[last]));
            *u = simd.select_f32s(beyond, all(self.ends[1]), value);
        }
        rest.iter_mut().for_each(|u| *u = self.at(*u));
    }

    /// Squares of the coefficients of the 1st, 2nd, ... normalised Hermite polynomial, whose sum is the
    /// variance of the value of a standard normal number, but for what higher ones hold.
    pub fn hermite_squares(&self) -> [f64; 12] {
        const STEPS: i32 = 2000;
        let mut sums = [0.0; 12];
        let mut weights = 0.0;
        for i in -STEPS..=STEPS {
            let u = 6.0 * f64::from(i) / f64::from(STEPS);
            let (weight, value) = (normal::density(u), f64::from(self.at(u as f32)));
            weights += weight;
            // h_k+1 = (u h_k - sqrt(k) h_k-1) / sqrt(k + 1).
            let (mut before, mut here) = (1.0, u);
            for (k, sum) in (1..).map(f64::from).zip(&mut sums) {
                *sum += weight * value * here;
                (before, here) = (here, (u * here - k.sqrt() * before) / (k + 1.0).sqrt());
            }
        }
        sums.map(|sum| (sum / weights).powi(2))
    }

    /// Mean and variance of the value of a standard normal number.
    pub fn moments(&self) -> (f64, f64) {
        const STEPS: i32 = 2000;
        let (mut weights, mut sum, mut squares) = (0.0, 0.0, 0.0);
        for i in -STEPS..=STEPS {
            let u = 6.0 * f64::from(i) / f64::from(STEPS);
            let (weight, value) = (normal::density(u), f64::from(self.at(u as f32)));
            weights += weight;
            sum += weight * value;
            squares += weight * value * value;
        }
        let mean = sum / weights;
        (mean, squares / weights - mean * mean)
    }
}

/// Slopes at the knots with which the cubic pieces do not overshoot.
fn slopes(values: &[f64; KNOTS.len()]) -> [f64; KNOTS.len()] {
    const LAST: usize = KNOTS.len() - 1;
    let secants: [f64; LAST] =
        std::array::from_fn(|i| (values[i + 1] - values[i]) / (KNOTS[i + 1] - KNOTS[i]));
    let mut slopes = std::array::from_fn(|i| match i {
        0 => secants[0],
        LAST => secants[LAST - 1],
        i => 0.5 * (secants[i - 1] + secants[i]),
    });
    for (i, &secant) in secants.iter().enumerate() {
        if secant <= 0.0 {
            slopes[i] = 0.0;
            slopes[i + 1] = 0.0;
            continue;
        }
        let (a, b) = (slopes[i] / secant, slopes[i + 1] / secant);
        let length = (a * a + b * b).sqrt();
        if length > 3.0 {
            slopes[i] = 3.0 * a / length * secant;
            slopes[i + 1] = 3.0 * b / length * secant;
        }
    }
    slopes
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn it_passes_its_values_and_never_falls(steps in prop::array::uniform11(0.0..1.0f64)) {
            let mut sum = -2.0;
            let values = steps.map(|step| {
                // Flat pieces, too.
                sum += if step < 0.2 { 0.0 } else { step * step };
                sum
            });
            let shape = Shape::new(&values);
            for (u, v) in KNOTS.into_iter().zip(values) {
                prop_assert!((f64::from(shape.at(u as f32)) - v).abs() < 1e-5);
            }
            let mut before = f32::MIN;
            for i in -400..=400 {
                let value = shape.at(i as f32 * 0.01);
                prop_assert!(value >= before - 1e-6, "falls at {i}");
                before = value;
            }
        }
    }

    struct Apply<'a>(&'a Shape, Vec<f32>);

    impl pulp::WithSimd for Apply<'_> {
        type Output = Vec<f32>;

        #[inline(always)]
        fn with_simd<S: Simd>(mut self, simd: S) -> Vec<f32> {
            self.0.apply(simd, &mut self.1);
            self.1
        }
    }

    #[test]
    fn many_values_have_the_bits_of_one() {
        let shape = Shape::new(&KNOTS.map(|u| u + 0.3 * (2.0 * u).sin()));
        let ends = [f32::NEG_INFINITY, f32::INFINITY, -0.0, 1e-40];
        let mut us: Vec<f32> = (-4000..=4000).map(|i| i as f32 * 0.001).chain(ends).collect();
        us.extend(
            KNOTS.iter().flat_map(|&u| [u as f32, (u as f32).next_up(), (u as f32).next_down()]),
        );
        for arch in [pulp::Arch::new(), pulp::Arch::Scalar] {
            let values = arch.dispatch(Apply(&shape, us.clone()));
            for (&u, value) in us.iter().zip(values) {
                assert_eq!(value.to_bits(), shape.at(u).to_bits(), "{u}");
            }
        }
    }

    #[test]
    fn a_straight_line_keeps_the_normal_distribution() {
        let shape = Shape::new(&KNOTS.map(|u| 3.0 + 0.5 * u));
        let (mean, variance) = shape.moments();
        assert!((mean - 3.0).abs() < 1e-6);
        // What lies beyond 3.2 deviations is lost.
        assert!((variance - 0.25).abs() < 1e-3, "{variance}");
        let squares = shape.hermite_squares();
        assert!(
            (squares[0] - 0.25).abs() < 2e-3 && squares[1..].iter().all(|c| *c < 1e-4),
            "{squares:?}"
        );
    }
}
