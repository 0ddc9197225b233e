//! Mixing two pictures pixel by pixel.

use rayon::prelude::*;

use crate::base::error::{Error, Result};
use crate::image::color::{SrgbTables, linear_from_srgb, srgb_from_linear};
use crate::image::material::MapKind;
use crate::image::normals::renormalize;
use crate::image::picture::{Encoding, Picture, Sample, Samples};
use crate::with_samples;

/// `a` with `share(i)` (0..=1) of `b` at every pixel `i`: colours are mixed in linear light, alpha and
/// data as they are, normals keep unit length. Where nothing of `b` is wanted the pixel keeps its bits.
///
/// # Errors
/// [`Error::SizeMismatch`], [`Error::BadPicture`] for pictures of different size or type.
pub fn mixed(
    a: &Picture,
    b: &Picture,
    kind: MapKind,
    share: impl Fn(usize) -> f64 + Sync,
) -> Result<Picture> {
    b.ensure_like(a, "the second picture")?;
    let (h, w, c) = (a.height(), a.width(), a.channels());
    if (b.height(), b.width()) != (h, w) {
        let (what, remedy) = ("the second picture".into(), "give two of the same size".into());
        let (got_w, got_h) = (b.width(), b.height());
        return Err(Error::SizeMismatch { what, got_w, got_h, want_w: w, want_h: h, remedy });
    }
    let curved = a.encoding == Encoding::Srgb && kind == MapKind::Color;
    let alpha = a.alpha_channel();
    let samples =
        with_samples!(a.samples(), v => mixed_samples(v, b.samples(), (c, alpha, curved), &share));
    let picture = a.with_samples(h, w, c, samples)?;
    if kind.is_normal() { renormalize(picture) } else { Ok(picture) }
}

fn mixed_samples<T: Sample>(
    a: &[T],
    b: &Samples,
    (c, alpha, curved): (usize, Option<usize>, bool),
    share: &(impl Fn(usize) -> f64 + Sync),
) -> Samples {
    let b = T::slice(b).unwrap_or(a);
    // Rounding hides the tables' errors; floats would show them where both are alike.
    let tables = (T::SCALE > 1.0).then(SrgbTables::get);
    let linear = |v| tables.map_or_else(|| linear_from_srgb(v), |t| t.linear(v));
    let display = |v| tables.map_or_else(|| srgb_from_linear(v), |t| t.display(v));
    let mut out = a.to_vec();
    out.par_chunks_exact_mut(c).enumerate().for_each(|(i, px)| {
        let share = share(i);
        if share <= 0.0 {
            return;
        }
        for (k, v) in px.iter_mut().enumerate() {
            let (near, far) = (v.to_unit(), b[i * c + k].to_unit());
            let mix = |near: f64, far: f64| (1.0 - share) * near + share * far;
            *v = T::from_unit(if curved && Some(k) != alpha {
                display(mix(linear(near), linear(far)))
            } else {
                mix(near, far)
            });
        }
    });
    T::wrap(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grey(values: [u8; 2], encoding: Encoding) -> Picture {
        Picture::new(1, 2, 1, Samples::U8(values.to_vec()), encoding).expect("a picture")
    }

    #[test]
    fn colors_are_mixed_in_linear_light_and_data_as_they_are() {
        let share = |i| if i == 0 { 0.5 } else { 0.0 };
        for (encoding, want) in
            [(Encoding::Srgb, 188), (Encoding::Linear, 128), (Encoding::Data, 128)]
        {
            let (a, b) = (grey([0, 7], encoding), grey([255, 9], encoding));
            let mixed = mixed(&a, &b, MapKind::Color, share).expect("they fit");
            assert_eq!(mixed.samples(), &Samples::U8(vec![want, 7]), "{encoding:?}");
        }
    }

    #[test]
    fn normals_keep_their_length() {
        let normal = |x: f32, y: f32| {
            let v = [x, y, 0.0].map(|v| 0.5 + 0.5 * v);
            Picture::new(1, 1, 3, Samples::F32(v.to_vec()), Encoding::Data).expect("a picture")
        };
        let mixed = mixed(&normal(1.0, 0.0), &normal(0.0, 1.0), MapKind::Normal, |_| 0.5);
        let mixed = mixed.expect("they fit");
        let length: f64 = (0..3).map(|k| (2.0 * mixed.samples().unit(k) - 1.0).powi(2)).sum();
        assert!((length - 1.0).abs() < 1e-6, "{length}");
    }

    #[test]
    fn pictures_that_do_not_fit_are_refused() {
        let a = grey([0, 7], Encoding::Srgb);
        let wide = Picture::new(1, 3, 1, Samples::U8(vec![0; 3]), Encoding::Srgb).expect("valid");
        let deep = Picture::new(1, 2, 1, Samples::U16(vec![0; 2]), Encoding::Srgb).expect("valid");
        for b in [wide, deep] {
            assert!(mixed(&a, &b, MapKind::Color, |_| 0.5).is_err());
        }
    }
}
