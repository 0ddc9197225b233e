//! Wavelet noise (Cook and DeRose 2005): band-limited noise that can be evaluated anywhere.
//!
//! A band is a quadratic B-spline surface over a torus of coefficients. The coefficients are Gaussian
//! white noise less what half the resolution can hold of it; so of the frequencies of a band hardly any
//! are an octave lower, and the spline leaves hardly any an octave higher. Other shapes of bands
//! ([`Detail`]) are cut out of the spectrum instead.
//!
//! The coefficients are a part of texforge's noise format: they are made of integers and of doubles in a
//! fixed order of operations, and rounded to 16 bits, so that every machine has the same. Versions of
//! texforge never change them.

mod detail;
mod filters;
mod fourier;
mod places;
mod solid;
pub mod spectrum;
mod torus;

pub use detail::{Detail, LOWER_END, Part};
pub use places::{BLOCK, Places};
pub use solid::Solid;
pub use torus::{Row, Torus};

/// Weights of the three coefficients around a position on an axis, and the first of them.
///
/// Coefficient `i` is the middle of the quadratic B-spline over `i - 1.5..i + 1.5`.
#[inline(always)]
pub fn spline_weights(position: f64) -> (f64, [f32; 3]) {
    let middle = -floor(-(position - 0.5));
    let t = (middle - (position - 0.5)) as f32;
    let first = t * t * 0.5;
    let last = (1.0 - t) * (1.0 - t) * 0.5;
    (middle - 1.0, [first, 1.0 - first - last, last])
}

/// The largest whole number that is not above `x`, which lies within 2^51 of 0. Unlike [`f64::floor`] it is
/// no call of a function on CPUs without an instruction for it, and is done for many at a time.
#[inline(always)]
fn floor(x: f64) -> f64 {
    let nearest = (x + LARGE) - LARGE;
    if nearest > x { nearest - 1.0 } else { nearest }
}

/// Beside it there is no room for fractions: 1.5 * 2^52.
const LARGE: f64 = 6_755_399_441_055_744.0;

/// A whole number within 2^51 of 0, but for multiples of 2^32: as a cast, done for many at a time.
#[inline(always)]
fn low_bits(whole: f64) -> u32 {
    (whole + LARGE).to_bits() as u32
}

/// A whole number within 2^51 of 0 on a torus of `n`.
#[inline(always)]
fn wrapped(position: f64, n: usize) -> u32 {
    let side = n as f64;
    let rest = position - floor(position * (1.0 / side)) * side;
    // The quotient may have been rounded over a whole number.
    let rest = if rest < 0.0 { rest + side } else { rest };
    let rest = if rest >= side { rest - side } else { rest };
    low_bits(rest)
}

/// The quadratic B-spline around 0.
fn spline(x: f64) -> f64 {
    let x = x.abs();
    if x < 0.5 {
        0.75 - x * x
    } else if x < 1.5 {
        0.5 * (1.5 - x) * (1.5 - x)
    } else {
        0.0
    }
}

/// Gaussian white noise of variance 2^32 as an integer: the sum of the twelve halves of six hashed words
/// (Irwin-Hall), of counter `index` and stream `stream`.
#[inline]
pub(crate) fn white(stream: u32, index: u32) -> i32 {
    let key = hash(stream.wrapping_add(0x9e37_79b9)).wrapping_add(index.wrapping_mul(6));
    let sum: u32 =
        (0..6).map(|i| hash(key.wrapping_add(i))).map(|word| (word & 0xffff) + (word >> 16)).sum();
    sum as i32 - 6 * 65535
}

/// A hash of 32 bits that uses nothing that a shader lacks: the mixer "lowbias32" of C. Wellons.
#[inline]
pub fn hash(mut x: u32) -> u32 {
    x = (x ^ (x >> 16)).wrapping_mul(0x7feb_352d);
    x = (x ^ (x >> 15)).wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

/// Coefficients rounded to 16 bits and the factor that gives the noise unit variance.
///
/// `variance` measures the integers' spline surface, averaged over all positions.
fn quantised(coefficients: &[f64], variance: impl FnOnce(&[i16]) -> f64) -> (Vec<i16>, f32) {
    let square: f64 = coefficients.iter().map(|v| v * v).sum();
    let step = (square / coefficients.len() as f64).sqrt() / STEPS;
    // Away from zero at halves; eight deviations do not occur, but a constant torus is all zeros.
    let integer =
        |v: f64| if step > 0.0 { (v / step).round().clamp(-32767.0, 32767.0) } else { 0.0 };
    let integers: Vec<i16> = coefficients.iter().map(|&v| integer(v) as i16).collect();
    let variance = variance(&integers);
    let scale = if variance > 0.0 { variance.sqrt().recip() as f32 } else { 0.0 };
    (integers, scale)
}

/// Integers to a standard deviation of the coefficients.
const STEPS: f64 = 4096.0;

/// How the quadratic B-spline correlates with itself at lags -2..=2, times 120.
const SPLINE_PRODUCTS: [i64; 5] = [1, 26, 66, 26, 1];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_weights_are_the_spline() {
        for i in -40..40 {
            let at = f64::from(i) * 0.173;
            let (first, weights) = spline_weights(at);
            for (k, w) in weights.into_iter().enumerate() {
                let expected = spline(at - (first + k as f64));
                assert!((f64::from(w) - expected).abs() < 1e-6, "{at}: {w} for {expected}");
            }
        }
    }

    #[test]
    fn positions_go_round() {
        for n in [1, 2, 6, 10, 256, 257, 65_536] {
            for at in [0.0, 1.0, 9.0, 255.0, 256.0, 1e6, 1e9 + 7.0, 1e15, 2.0f64.powi(51) - 1.0] {
                for at in [at, -at, at * n as f64 % 1e15, -(at * n as f64 % 1e15)] {
                    assert_eq!(f64::from(wrapped(at, n)), at.rem_euclid(n as f64), "{at} on {n}");
                }
            }
        }
        for x in [0.0, -0.0, 0.5, -0.5, 0.999_999, -1e-300, 7.0, -7.0, 1e9 + 0.25, -1e9 - 0.25] {
            assert_eq!(floor(x), x.floor());
            assert_eq!(i64::from(low_bits(x.floor())), (x.floor() as i64).rem_euclid(1 << 32));
        }
    }

    #[test]
    fn white_noise_is_white_and_gaussian() {
        let n = 40_000;
        let v: Vec<f64> = (0..n).map(|i| f64::from(white(3, i)) / 65536.0).collect();
        let mean = |f: &dyn Fn(usize) -> f64| (0..v.len() - 1).map(f).sum::<f64>() / v.len() as f64;
        assert!(mean(&|i| v[i]).abs() < 0.02);
        assert!((mean(&|i| v[i] * v[i]) - 1.0).abs() < 0.03);
        assert!(mean(&|i| v[i] * v[i + 1]).abs() < 0.02);
        // Twelve uniform numbers: excess kurtosis -0.1.
        assert!((mean(&|i| v[i].powi(4)) - 2.9).abs() < 0.2);
    }

    #[test]
    fn the_hash_never_changes() {
        // Documents made by older versions depend on these.
        assert_eq!([0, 1, 0xffff_ffff].map(hash), [0, 1_753_845_952, 1_734_902_346]);
        assert_eq!([white(0, 0), white(0, 1), white(7, 12_345)], [60069, -62452, 37357]);
    }
}
