//! Baseline "make seamless", as image editors do it: the photo over itself shifted by half,
//! blended so that neither's border shows. Double exposure and all.

use crate::base::error::Result;
use crate::image::color::{linear_from_srgb, srgb_from_linear};
use crate::image::picture::{Encoding, Picture, Sample};
use crate::search::patchmatch::Wrap;
use crate::with_samples;

/// The centre `size` (height, width) of the photo, made seamless on the axes of `wrap`. Blends in
/// linear light.
///
/// # Errors
/// None for a `size` that fits into the photo.
pub fn run(photo: &Picture, size: (usize, usize), wrap: Wrap) -> Result<Picture> {
    let samples = with_samples!(photo.samples(), v => blended(photo, v, size, wrap));
    photo.with_samples(size.0, size.1, photo.channels(), samples)
}

fn blended<T: Sample>(
    photo: &Picture,
    v: &[T],
    (h, w): (usize, usize),
    wrap: Wrap,
) -> crate::image::picture::Samples {
    let (c, ew) = (photo.channels(), photo.width());
    let (y0, x0) = ((photo.height() - h) / 2, (ew - w) / 2);
    // How much of the unshifted picture: none at its own border, all in the middle.
    let share = |i: usize, n: usize, wrap: bool| {
        let at = (i as f64 + 0.5) / n as f64;
        if wrap { 1.0 - (2.0 * at - 1.0).abs() } else { 1.0 }
    };
    let srgb = photo.encoding == Encoding::Srgb;
    let alpha = photo.alpha_channel();
    let mut out = Vec::with_capacity(h * w * c);
    for y in 0..h {
        for x in 0..w {
            let near = share(y, h, wrap.y) * share(x, w, wrap.x);
            let far = (1.0 - share(y, h, wrap.y)).max(1.0 - share(x, w, wrap.x));
            let near = near / (near + far);
            let shift = |i: usize, n: usize, wrap: bool| if wrap { (i + n / 2) % n } else { i };
            let (sy, sx) = (shift(y, h, wrap.y), shift(x, w, wrap.x));
            for k in 0..c {
                let at = |y: usize, x: usize| v[((y0 + y) * ew + x0 + x) * c + k].to_unit();
                let curved = srgb && Some(k) != alpha;
                let mix = |a: f64, b: f64| near * a + (1.0 - near) * b;
                out.push(T::from_unit(if curved {
                    srgb_from_linear(mix(linear_from_srgb(at(y, x)), linear_from_srgb(at(sy, sx))))
                } else {
                    mix(at(y, x), at(sy, sx))
                }));
            }
        }
    }
    T::wrap(out)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Samples;

    #[test]
    fn the_ends_of_a_ramp_meet() {
        let ramp = (0..64 * 64).map(|i| (i % 64) as f32 / 64.0).collect();
        let photo = Picture::new(64, 64, 1, Samples::F32(ramp), Encoding::Linear).expect("valid");
        let tile = run(&photo, (64, 64), Wrap { y: true, x: true }).expect("tile");
        let at = |x: usize| tile.samples().unit(32 * 64 + x);
        let largest = (0..63).map(|x| (at(x + 1) - at(x)).abs()).fold(0.0, f64::max);
        assert!((at(63) - at(0)).abs() <= 1.5 * largest, "seam {} {}", at(63), at(0));
    }
}
