//! Maps of a material: what each is, by which names it goes, and how normals are kept unit length.

use crate::base::error::Result;
use crate::image::picture::{Picture, Sample};
use crate::with_samples;

/// What a map's numbers are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum MapKind {
    /// Colours (base colour, emission).
    Color,
    /// Numbers without a gamma curve (roughness, height, occlusion, ...).
    Data,
    /// Unit vectors, stored as `(n + 1) / 2`.
    Normal,
}

/// Gives every normal unit length. Vectors that are within one storage step of it already keep
/// their bits; the zero vector (an undefined normal) is kept too.
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

fn renormalize_pixel<T: Sample>(pixel: &mut [T]) {
    let n: [f64; 3] = std::array::from_fn(|k| pixel[k].to_unit() * 2.0 - 1.0);
    let length = (n[0] * n[0] + n[1] * n[1] + n[2] * n[2]).sqrt();
    if !(length > 0.0 && length.is_finite()) {
        return;
    }
    // A component moves by at most |length - 1|; in storage half of that.
    let step = if T::SCALE > 1.0 { 1.0 / T::SCALE } else { 1e-6 };
    if (length - 1.0).abs() / 2.0 <= step {
        return;
    }
    for k in 0..3 {
        pixel[k] = T::from_unit((n[k] / length + 1.0) / 2.0);
    }
}
