//! [`Frame`]: a photo read such that its period is a whole number of pixels, along the axes.

use std::sync::LazyLock;

use rayon::prelude::*;

use crate::base::error::Result;
use crate::image::color::{linear_from_srgb, srgb_from_linear};
use crate::image::mask::Mask;
use crate::image::material::MapKind;
use crate::image::normals::renormalize;
use crate::image::picture::{Encoding, Picture, Sample, Samples};
use crate::signal::basis::{Basis, Vector, coefficients};
use crate::with_samples;

/// Lobes of the Lanczos window to either side. Two blur, more ring.
const LOBES: usize = 3;

/// Steps of the filter's table a pixel; interpolated, it errs by less than 1e-6.
const TABLE_STEPS: usize = 1024;

static LANCZOS: LazyLock<Vec<f64>> = LazyLock::new(|| {
    let sinc = |t: f64| {
        let a = std::f64::consts::PI * t;
        if t == 0.0 { 1.0 } else { libm::sin(a) / a }
    };
    let value = |i: usize| {
        let t = i as f64 / TABLE_STEPS as f64;
        if t < LOBES as f64 { sinc(t) * sinc(t / LOBES as f64) } else { 0.0 }
    };
    (0..=LOBES * TABLE_STEPS + 1).map(value).collect()
});

fn lanczos(t: f64) -> f64 {
    let at = t.abs().min(LOBES as f64) * TABLE_STEPS as f64;
    let i = at as usize;
    LANCZOS[i] + (LANCZOS[i + 1] - LANCZOS[i]) * (at - i as f64)
}

/// A photo scaled, and sheared or turned a little, so that it repeats by whole pixels to the right and
/// downwards.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Frame {
    /// Height and width of the photo.
    photo: (usize, usize),
    /// The photo's displacement by one pixel to the right and by one downwards.
    unit: Basis,
    /// The photo's place of the upper left corner.
    corner: Vector,
    /// Height and width of what comes out.
    size: (usize, usize),
}

impl Frame {
    /// The photo as it is, of this size (height, width).
    pub fn plain(photo: (usize, usize)) -> Self {
        Self { photo, unit: [[1.0, 0.0], [0.0, 1.0]], corner: [0.0, 0.0], size: photo }
    }

    /// A photo of this size (height, width) in which the displacements `sides`, the first nearly to the
    /// right and the second nearly downwards, become `tile` (height, width) whole pixels. All of the
    /// photo comes out, and where it does not fill the picture, pixels that are not usable.
    pub fn new(photo: (usize, usize), sides: Basis, tile: (usize, usize)) -> Self {
        let unit = [sides[0].map(|v| v / tile.1 as f64), sides[1].map(|v| v / tile.0 as f64)];
        let (h, w) = (photo.0 as f64, photo.1 as f64);
        let corners = [[0.0, 0.0], [w, 0.0], [0.0, h], [w, h]].map(|v| coefficients(unit, v));
        let bounds = |k: usize| {
            let all = corners.map(|c| c[k]);
            // A whole pixel is not lost to rounding.
            let low = (all.into_iter().fold(f64::MAX, f64::min) - 1e-9).ceil();
            let high = (all.into_iter().fold(f64::MIN, f64::max) + 1e-9).floor();
            (low, (high - low).max(1.0) as usize)
        };
        let ((left, width), (top, height)) = (bounds(0), bounds(1));
        let corner = std::array::from_fn(|k| left * unit[0][k] + top * unit[1][k]);
        Self { photo, unit, corner, size: (height, width) }
    }

    /// Height and width of what comes out.
    pub fn size(&self) -> (usize, usize) {
        self.size
    }

    /// Whether the photo comes out as it is, bit for bit.
    pub fn is_plain(&self) -> bool {
        *self == Self::plain(self.photo)
    }

    /// The photo's displacement by one pixel to the right and by one downwards.
    pub fn unit(&self) -> Basis {
        self.unit
    }

    /// The photo's place of a corner between pixels: (0, 0) is the upper left of the first.
    pub fn place(&self, [x, y]: Vector) -> Vector {
        let [a, b] = self.unit;
        std::array::from_fn(|k| self.corner[k] + x * a[k] + y * b[k])
    }

    /// What comes out of the photo, or of a map of it in any resolution: its own type and encoding.
    /// Colours are averaged in linear light, normals come out with unit length. Where the filter
    /// would reach over the edge, the edge goes on.
    ///
    /// # Determinism
    /// Same bytes for any thread count.
    ///
    /// # Errors
    /// None that a valid picture can cause.
    pub fn read(&self, picture: &Picture, kind: MapKind) -> Result<Picture> {
        let same = (picture.height(), picture.width()) == self.photo;
        let out = if same && self.is_plain() { picture.clone() } else { self.resampled(picture)? };
        if kind.is_normal() { renormalize(out) } else { Ok(out) }
    }

    fn resampled(&self, picture: &Picture) -> Result<Picture> {
        let (h, w, c) = (picture.height(), picture.width(), picture.channels());
        let alpha = picture.alpha_channel();
        let is_light = |k: usize| picture.encoding == Encoding::Srgb && alpha != Some(k);
        let table: Vec<f32> = match picture.samples() {
            Samples::U8(_) => levels(256),
            Samples::U16(_) => levels(65536),
            _ => Vec::new(),
        };
        let light = |i: usize| -> f32 {
            let v = picture.samples().unit(i);
            if !v.is_finite() {
                // Only what is hidden may be so, and that is never used.
                return 0.0;
            }
            if !is_light(i % c) {
                return v as f32;
            }
            match picture.samples() {
                Samples::U8(v) => table[usize::from(v[i])],
                Samples::U16(v) => table[usize::from(v[i])],
                _ => linear_from_srgb(v) as f32,
            }
        };
        let values: Vec<f32> = (0..h * w * c).into_par_iter().map(light).collect();
        let (out_h, out_w) = self.size;
        let mut sums = vec![0.0f32; out_h * out_w * c];
        sums.par_chunks_mut(out_w * c).enumerate().for_each(|(y, row)| {
            let mut taps = [Vec::new(), Vec::new()];
            for (x, out) in row.chunks_exact_mut(c).enumerate() {
                self.taps((y, x), (h, w), &mut taps);
                let [across, down] = &taps;
                for &(v, weight) in down {
                    for &(u, share) in across {
                        let weight = (weight * share) as f32;
                        let from = &values[(v * w + u) * c..][..c];
                        out.iter_mut().zip(from).for_each(|(sum, v)| *sum += weight * v);
                    }
                }
            }
        });
        let encoded = |(i, &v): (usize, &f32)| {
            let v = f64::from(v);
            // The filter may overshoot below black.
            if is_light(i % c) { srgb_from_linear(v.max(0.0)) } else { v }
        };
        let samples = with_samples!(picture.samples(), v => like(v, &sums, encoded));
        picture.with_samples(out_h, out_w, c, samples)
    }

    /// Which columns and rows of a picture of size `from` a pixel is made of, and how much of each.
    fn taps(
        &self,
        (y, x): (usize, usize),
        (h, w): (usize, usize),
        taps: &mut [Vec<(usize, f64)>; 2],
    ) {
        let place = self.place([x as f64 + 0.5, y as f64 + 0.5]);
        for (k, (n, of)) in [(w, self.photo.1), (h, self.photo.0)].into_iter().enumerate() {
            // Maps may be finer or coarser than the photo.
            let ratio = n as f64 / of as f64;
            // What is made smaller is blurred, what is made larger is not.
            let wide = (self.unit[k][k] * ratio).max(1.0);
            let center = place[k] * ratio - 0.5;
            let reach = wide * LOBES as f64;
            let (first, last) = ((center - reach).ceil() as i64, (center + reach).floor() as i64);
            let weights = (first..=last).map(|i| (i, lanczos((i as f64 - center) / wide)));
            taps[k].clear();
            taps[k].extend(
                weights
                    .filter(|(_, weight)| *weight != 0.0)
                    .map(|(i, weight)| (i.clamp(0, n as i64 - 1) as usize, weight)),
            );
            let sum: f64 = taps[k].iter().map(|(_, weight)| weight).sum();
            taps[k].iter_mut().for_each(|(_, weight)| *weight /= sum);
        }
    }

    /// Where what comes out may be used: in the photo, and made of pixels all of which may. `None` is
    /// everywhere.
    pub fn usable(&self, mask: Option<&Mask>) -> Option<Vec<bool>> {
        let (h, w) = self.photo;
        if self.is_plain() {
            return mask.map(|mask| mask.usable().to_vec());
        }
        let (out_h, out_w) = self.size;
        let is_usable = |taps: &mut [Vec<(usize, f64)>; 2], y: usize, x: usize| {
            let [px, py] = self.place([x as f64 + 0.5, y as f64 + 0.5]);
            if px < 0.0 || py < 0.0 || px > w as f64 || py > h as f64 {
                return false;
            }
            let Some(mask) = mask else { return true };
            self.taps((y, x), (h, w), taps);
            let [across, down] = taps;
            down.iter().all(|(v, _)| across.iter().all(|(u, _)| mask.usable()[v * w + u]))
        };
        let row = |y: usize| {
            let mut taps = [Vec::new(), Vec::new()];
            (0..out_w).map(|x| is_usable(&mut taps, y, x)).collect::<Vec<bool>>()
        };
        let flags: Vec<Vec<bool>> = (0..out_h).into_par_iter().map(row).collect();
        let flags = flags.concat();
        flags.contains(&false).then_some(flags)
    }
}

/// The linear value of every integer sample.
fn levels(count: usize) -> Vec<f32> {
    (0..count).map(|i| linear_from_srgb(i as f64 / (count - 1) as f64) as f32).collect()
}

/// Samples of the type of `of`, one for each value.
fn like<T: Sample>(
    _of: &[T],
    values: &[f32],
    encoded: impl Fn((usize, &f32)) -> f64 + Sync,
) -> Samples {
    T::wrap(values.par_iter().enumerate().map(|v| T::from_unit(encoded(v))).collect())
}
