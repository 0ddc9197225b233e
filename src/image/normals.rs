//! Normal maps: kept at unit length, mirrored and turned with what they are the normals of.

use crate::base::error::Result;
use crate::image::material::MapKind;
use crate::image::picture::{Picture, Sample};
use crate::image::symmetry::Symmetry;
use crate::with_samples;

/// Gives every normal unit length. Vectors whose length is unit but for the rounding of their
/// storage keep their bits, so the function is idempotent; so do vectors that are zero but for
/// that rounding (undefined normals) and those with NaN.
///
/// The first three channels are the vector; others pass through.
///
/// # Errors
/// None at present; the signature leaves room for pictures that cannot be normals.
pub fn renormalize(picture: Picture) -> Result<Picture> {
    let (h, w, c) = (picture.height(), picture.width(), picture.channels());
    if c < 3 {
        return Ok(picture);
    }
    let samples = with_samples!(picture.samples(), v => {
        let mut v = v.clone();
        v.chunks_exact_mut(c).for_each(renormalize_pixel);
        Sample::wrap(v)
    });
    picture.with_samples(h, w, c, samples)
}

/// Mirrors and turns the normal of every pixel `i` as `symmetry(i)` says, with its photo.
///
/// The first two channels are to the right and up (down for [`MapKind::NormalDx`]); others pass
/// through, as do pictures of fewer.
///
/// # Errors
/// None that a valid picture can cause.
pub fn turn_normals(
    picture: &Picture,
    kind: MapKind,
    symmetry: impl Fn(usize) -> Symmetry,
) -> Result<Picture> {
    let (h, w, c) = (picture.height(), picture.width(), picture.channels());
    if c < 3 {
        return Ok(picture.clone());
    }
    let down = kind == MapKind::NormalDx;
    let samples = with_samples!(picture.samples(), v => {
        let mut v = v.clone();
        for (i, px) in v.chunks_exact_mut(c).enumerate() {
            turn_pixel(px, symmetry(i), down);
        }
        Sample::wrap(v)
    });
    picture.with_samples(h, w, c, samples)
}

/// Turns one normal; `down` says that green points down.
fn turn_pixel<T: Sample>(pixel: &mut [T], symmetry: Symmetry, down: bool) {
    let old = [pixel[0], pixel[1]];
    for (k, (from, negative)) in symmetry.direction().into_iter().enumerate() {
        // Where green points down, what goes from red to green or back changes its sign once more.
        let negative = negative != (down && from != k);
        // `-n` is stored as the mirror image of `n` about the middle of the range.
        pixel[k] = if negative { T::from_unit(1.0 - old[from].to_unit()) } else { old[from] };
    }
}

/// Distance of neighbouring values of the type in its upper half range.
fn storage_step<T: Sample>() -> f64 {
    match size_of::<T>() {
        _ if T::SCALE > 1.0 => 1.0 / T::SCALE,
        2 => 1.0 / 2048.0,
        _ => 1e-6,
    }
}

fn renormalize_pixel<T: Sample>(pixel: &mut [T]) {
    let n: [f64; 3] = std::array::from_fn(|k| pixel[k].to_unit() * 2.0 - 1.0);
    let length = (n[0] * n[0] + n[1] * n[1] + n[2] * n[2]).sqrt();
    // Rounding moves a stored component by half a step at most, so a component of the vector by
    // one, and the length by sqrt(3).
    let rounding = 2.0 * storage_step::<T>();
    if !length.is_finite() || length <= rounding || (length - 1.0).abs() <= rounding {
        return;
    }
    for k in 0..3 {
        pixel[k] = T::from_unit(f64::midpoint(n[k] / length, 1.0));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::picture::{Encoding, Samples};
    use half::f16;
    use proptest::prelude::*;

    /// A hill, rendered to heights and from them to normals, then laid in every symmetry: its
    /// normals turned are the normals of the turned hill.
    #[test]
    fn turned_normals_are_the_normals_of_what_is_turned() {
        const N: usize = 9;
        let hill = |y: f64, x: f64| 2.0 * y + 0.2 * x * x + 0.05 * x * y * y - 3.0 * x;
        let heights = |symmetry: Symmetry| {
            let at = move |i: usize| {
                let (y, x) = symmetry.source((i / N, i % N), (N, N));
                hill(y as f64, x as f64)
            };
            (0..N * N).map(at).collect::<Vec<_>>()
        };
        // Inner pixels only, by central differences; rows count down.
        let normal = |heights: &[f64], i: usize, down: bool| {
            let right = (heights[i + 1] - heights[i - 1]) / 2.0;
            let up = (heights[i - N] - heights[i + N]) / 2.0;
            let n = [-right, if down { up } else { -up }, 1.0];
            let length = n.iter().map(|v| v * v).sum::<f64>().sqrt();
            n.map(|v| f64::midpoint(v / length, 1.0))
        };
        let inner = |i: &usize| (1..N - 1).contains(&(i / N)) && (1..N - 1).contains(&(i % N));
        let plain = heights(Symmetry::default());
        for (kind, down) in [(MapKind::NormalGl, false), (MapKind::NormalDx, true)] {
            for symmetry in Symmetry::ALL {
                let turned = heights(symmetry);
                for i in (0..N * N).filter(inner) {
                    let (y, x) = symmetry.source((i / N, i % N), (N, N));
                    let before = Samples::F64(normal(&plain, y * N + x, down).to_vec());
                    let map = Picture::new(1, 1, 3, before, Encoding::Data).expect("pixel");
                    let after = turn_normals(&map, kind, |_| symmetry).expect("turned");
                    let want = normal(&turned, i, down);
                    for (k, want) in want.into_iter().enumerate() {
                        let off = (after.samples().unit(k) - want).abs();
                        assert!(off < 1e-12, "{kind:?} {symmetry:?} channel {k}");
                    }
                }
            }
        }
    }

    #[test]
    fn turning_keeps_every_bit_of_integers() {
        let map = |v: [u8; 3]| {
            Picture::new(1, 1, 3, Samples::U8(v.to_vec()), Encoding::Data).expect("pixel")
        };
        for v in 0..=255 {
            let out = turn_normals(&map([v, 9, 7]), MapKind::Normal, |_| Symmetry::ALL[2]);
            assert_eq!(out.expect("turned").samples(), &Samples::U8(vec![255 - v, 246, 7]));
        }
    }

    fn length(pixel: &[f64]) -> f64 {
        pixel.iter().map(|v| (v * 2.0 - 1.0).powi(2)).sum::<f64>().sqrt()
    }

    fn check<T: Sample + std::fmt::Debug>(pixel: [f64; 3]) {
        let stored: Vec<T> = pixel.iter().map(|v| T::from_unit(*v)).collect();
        let units = |s: &Samples| (0..3).map(|i| s.unit(i)).collect::<Vec<f64>>();
        let before = T::wrap(stored);
        let picture = Picture::new(1, 1, 3, before.clone(), Encoding::Data).expect("picture");
        let once = renormalize(picture).expect("once");
        let step = 2.0 * storage_step::<T>();
        if length(&units(&before)) > step {
            let after = length(&units(once.samples()));
            assert!((after - 1.0).abs() <= step, "length {after}");
        } else {
            assert_eq!(once.samples(), &before, "undefined normals stay");
        }
        let twice = renormalize(once.clone()).expect("twice");
        assert_eq!(once, twice, "unit vectors keep their bits");
    }

    proptest! {
        #[test]
        fn normals_come_out_with_unit_length(x in 0.0..=1.0, y in 0.0..=1.0, z in 0.0..=1.0) {
            let pixel = [x, y, z];
            check::<u8>(pixel);
            check::<u16>(pixel);
            check::<f16>(pixel);
            check::<f32>(pixel);
            check::<f64>(pixel);
        }

        #[test]
        fn stored_unit_vectors_keep_their_bits(a in 0.0..std::f64::consts::TAU, z in -1.0..=1.0_f64) {
            let r = (1.0 - z * z).sqrt();
            let n = [r * a.cos(), r * a.sin(), z].map(|v| f64::midpoint(v, 1.0));
            let bits = n.map(u8::from_unit).to_vec();
            let picture = Picture::new(1, 1, 3, Samples::U8(bits.clone()), Encoding::Data).expect("u8");
            prop_assert_eq!(renormalize(picture).expect("u8").into_samples(), Samples::U8(bits));
            let bits = n.map(f16::from_f64).to_vec();
            let picture = Picture::new(1, 1, 3, Samples::F16(bits.clone()), Encoding::Data).expect("f16");
            prop_assert_eq!(renormalize(picture).expect("f16").into_samples(), Samples::F16(bits));
        }
    }

    #[test]
    fn undefined_and_further_channels_pass() {
        let v = vec![128, 128, 128, 7, 127, 128, 127, 8, 255, 255, 128, 9];
        let picture = Picture::new(1, 3, 4, Samples::U8(v), Encoding::Data).expect("picture");
        let want = vec![128, 128, 128, 7, 127, 128, 127, 8, 218, 218, 128, 9];
        assert_eq!(renormalize(picture).expect("run").into_samples(), Samples::U8(want));
        let nan = Samples::F32(vec![f32::NAN, 0.5, 1.0]);
        let picture = Picture::new(1, 1, 3, nan, Encoding::Data).expect("picture");
        let Samples::F32(out) = renormalize(picture).expect("run").into_samples() else {
            panic!("type kept")
        };
        assert!(out[0].is_nan() && out[1..] == [0.5, 1.0]);
    }
}
