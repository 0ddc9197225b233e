//! [`shares`]: how much of each of three tiles a blend takes.

/// A weight to the power of `sharpness`, the same bits on every machine.
#[inline]
pub(super) fn powers(weight: f32, sharpness: u32) -> f32 {
    (1..sharpness).fold(weight, |power, _| power * weight)
}

/// The shares of three tiles of standard normal numbers with which their sum is a standard normal number,
/// too (Heitz and Neyret 2018, equation 5; the weights' powers: Burley 2019, section 4).
///
/// `alike` are the correlations of tiles 0 and 1, 0 and 2, 1 and 2, which they take for 0: tiles that go
/// on into each other would gain contrast where they meet.
#[inline]
pub(super) fn shares(weights: [f32; 3], alike: [f32; 3], sharpness: u32) -> [f32; 3] {
    let w = weights.map(|weight| powers(weight, sharpness));
    let squares = w[0] * w[0] + w[1] * w[1] + w[2] * w[2];
    let products = w[0] * w[1] * alike[0] + w[0] * w[2] * alike[1] + w[1] * w[2] * alike[2];
    let scale = (squares + 2.0 * products).sqrt().recip();
    w.map(|w| w * scale)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn blends_have_variance_one(
            a in 0.0..1.0f32, b in 0.0..1.0f32, alike in prop::array::uniform3(0.0..1.0f32),
            sharpness in 1u32..17,
        ) {
            let (a, b) = if a + b > 1.0 { (1.0 - a, 1.0 - b) } else { (a, b) };
            let s = shares([1.0 - a - b, a, b], alike, sharpness).map(f64::from);
            let [r01, r02, r12] = alike.map(f64::from);
            // The quadratic form of the covariance matrix.
            let matrix = [[1.0, r01, r02], [r01, 1.0, r12], [r02, r12, 1.0]];
            let mut variance = 0.0;
            for i in 0..3 {
                for j in 0..3 {
                    variance += s[i] * matrix[i][j] * s[j];
                }
            }
            prop_assert!((variance - 1.0).abs() < 1e-5, "{variance}");
        }
    }

    #[test]
    fn a_vertex_shows_its_tile_alone() {
        assert_eq!(shares([0.0, 1.0, 0.0], [0.5; 3], 4), [0.0, 1.0, 0.0]);
    }
}
