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
