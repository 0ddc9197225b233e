//! [`Codes`]: colours as the small integers that patches are compared in.

use super::{CODE_MAX, MatchImage};
use crate::image::color::MatchSpace;

/// Pixels where averages are right, and where they may be used (`None`: everywhere).
pub type Sampled<'a> = (&'a [[f32; 3]], Option<&'a [bool]>);

/// Affine map from L*a*b* to 7-bit codes, the same scale for all channels, so that distances of
/// codes are Euclidean distances of colours.
#[derive(Debug, Clone, Copy)]
pub struct Codes {
    low: [f32; 3],
    /// Codes per unit.
    scale: f32,
}

impl Codes {
    /// Covers 99.8 % of each channel's usable values in these photos, whose colours are matched in
    /// `space`.
    pub fn covering(photos: &[Sampled<'_>], space: MatchSpace) -> Self {
        let take = |step: fn(usize) -> usize| {
            let each = |&(pixels, usable): &Sampled<'_>| {
                let all = (0..pixels.len()).step_by(step(pixels.len()));
                let usable = all.filter(|&i| usable.is_none_or(|u| u[i]));
                usable.map(|i| pixels[i]).collect::<Vec<_>>()
            };
            photos.iter().flat_map(each).collect::<Vec<_>>()
        };
        // Twenty thousand samples of a photo fix the ends well enough.
        let mut sample = take(|n| (n / 20_000).max(1));
        if sample.is_empty() {
            // A few usable pixels between the samples: take them all.
            sample = take(|_| 1);
        }
        space.convert_row(&mut sample);
        let cut = sample.len() / 1000;
        let ends = |k: usize| {
            let mut values: Vec<f32> = sample.iter().map(|px| px[k]).collect();
            values.sort_unstable_by(f32::total_cmp);
            match values.len() {
                0 => (0.0, 0.0),
                n => (values[cut], values[n - 1 - cut]),
            }
        };
        let ends: [(f32, f32); 3] = std::array::from_fn(ends);
        let range = ends.iter().map(|(low, high)| high - low).fold(1.0, f32::max);
        Self { low: ends.map(|(low, _)| low), scale: CODE_MAX as f32 / range }
    }

    /// One code in units of L*a*b*.
    pub fn unit(&self) -> f32 {
        1.0 / self.scale
    }

    /// The codes of a colour, rounded; colours outside the range are cut.
    #[inline]
    fn encode(&self, lab: [f32; 3]) -> [u8; 3] {
        std::array::from_fn(|k| {
            ((lab[k] - self.low[k]) * self.scale + 0.5).clamp(0.0, CODE_MAX as f32) as u8
        })
    }

    /// A picture of `pixels` (`height` x `width`, where averages are right); the fourth code is 0.
    pub fn image(
        &self,
        pixels: &[[f32; 3]],
        (height, width): (usize, usize),
        space: MatchSpace,
    ) -> MatchImage {
        let mut colors = MatchImage::new(height, width);
        colors.fill_rows(|y, row| {
            let mut lab = pixels[y * width..][..width].to_vec();
            space.convert_row(&mut lab);
            for (px, lab) in row.iter_mut().zip(lab) {
                let [l, a, b] = self.encode(lab);
                *px = [l, a, b, 0];
            }
        });
        colors
    }
}
