//! [`Mask`]: where the photo may be used.

use crate::base::error::{Error, Result};
use crate::image::picture::Picture;

/// One flag a pixel: `true` where the photo may be used.
#[derive(Debug, Clone, PartialEq)]
pub struct Mask {
    height: usize,
    width: usize,
    usable: Vec<bool>,
}

impl Mask {
    /// A mask from its flags, row by row.
    ///
    /// # Errors
    /// [`Error::BadPicture`] if the number of flags is not `height * width`.
    pub fn new(height: usize, width: usize, usable: Vec<bool>) -> Result<Self> {
        if usable.len() != height * width || usable.is_empty() {
            return Err(Error::BadPicture {
                what: "mask".into(),
                reason: format!("{} flags do not make {width}x{height} pixels", usable.len()),
            });
        }
        Ok(Self { height, width, usable })
    }

    /// The mask of a grey (or colour) picture: usable where the first channel is at least half of
    /// full scale and, if there is an alpha channel, alpha is too.
    ///
    /// # Errors
    /// [`Error::NotFinite`] if the picture holds NaN.
    pub fn from_picture(picture: &Picture) -> Result<Self> {
        picture.ensure_finite("the mask")?;
        let (c, alpha) = (picture.channels(), picture.alpha_channel());
        let usable = (0..picture.height() * picture.width())
            .map(|i| {
                let at = |channel: usize| picture.samples().unit(i * c + channel) >= 0.5;
                at(0) && alpha.is_none_or(at)
            })
            .collect();
        Self::new(picture.height(), picture.width(), usable)
    }

    /// Where `photo` is opaque: alpha at full scale. Half-transparent pixels hold the colour of
    /// something else as well and are never used. `None` if the photo has no alpha channel.
    pub fn from_alpha(photo: &Picture) -> Option<Self> {
        let (c, alpha) = (photo.channels(), photo.alpha_channel()?);
        let usable = (0..photo.height() * photo.width())
            .map(|i| photo.samples().unit(i * c + alpha) >= 1.0)
            .collect();
        Some(Self { height: photo.height(), width: photo.width(), usable })
    }

    /// Usable in both.
    ///
    /// # Errors
    /// [`Error::SizeMismatch`].
    pub fn and(&self, other: &Self) -> Result<Self> {
        other.ensure_size("the other mask", self.height, self.width)?;
        let usable = self.usable.iter().zip(&other.usable).map(|(&a, &b)| a && b).collect();
        Ok(Self { height: self.height, width: self.width, usable })
    }

    /// Usable wherever no flag of `self` is set within `radius` pixels, as the crow flies: the
    /// opposite of a mask of marks that are grown by a disc. A radius of 0 only turns the flags
    /// round.
    ///
    /// # Cost
    /// Linear in the pixels, whatever the radius.
    #[must_use]
    pub fn clear_of(&self, radius: usize) -> Self {
        let (h, w) = (self.height, self.width);
        // Pixels to the nearest mark of the same column, as far as it matters.
        let far = radius as u32 + 1;
        let mut gap = vec![far; h * w];
        let mut sweep = |rows: &mut dyn Iterator<Item = usize>| {
            let mut last = vec![far; w];
            for y in rows {
                let marks = &self.usable[y * w..][..w];
                for ((last, gap), &mark) in last.iter_mut().zip(&mut gap[y * w..][..w]).zip(marks) {
                    *last = if mark { 0 } else { (*last + 1).min(far) };
                    *gap = (*gap).min(*last);
                }
            }
        };
        sweep(&mut (0..h));
        sweep(&mut (0..h).rev());
        // A mark `gap` rows away hides as much of this row as the disc is wide there.
        let halves: Vec<usize> =
            (0..=radius).map(|dy| (radius * radius - dy * dy).isqrt()).collect();
        let mut usable = vec![true; h * w];
        for (usable, gap) in usable.chunks_exact_mut(w).zip(gap.chunks_exact(w)) {
            // How far the marks passed so far still reach, in either direction.
            let mut hide = |columns: &mut dyn Iterator<Item = usize>| {
                let mut reach = 0;
                for x in columns {
                    let half = halves.get(gap[x] as usize).map_or(0, |half| half + 1);
                    reach = half.max(reach);
                    usable[x] &= reach == 0;
                    reach = reach.saturating_sub(1);
                }
            };
            hide(&mut (0..w));
            hide(&mut (0..w).rev());
        }
        Self { height: h, width: w, usable }
    }

    /// Fails unless the mask, called `what` in the message, has this size.
    ///
    /// # Errors
    /// [`Error::SizeMismatch`].
    pub fn ensure_size(&self, what: &str, height: usize, width: usize) -> Result<()> {
        if (self.height, self.width) == (height, width) {
            return Ok(());
        }
        Err(Error::SizeMismatch {
            what: what.to_owned(),
            got_w: self.width,
            got_h: self.height,
            want_w: width,
            want_h: height,
            remedy: "a mask must have the size of the photo (after its orientation is applied)"
                .into(),
        })
    }

    /// Height in pixels.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Width in pixels.
    pub fn width(&self) -> usize {
        self.width
    }

    /// The flags, row by row.
    pub fn usable(&self) -> &[bool] {
        &self.usable
    }

    /// Number of usable pixels.
    pub fn count(&self) -> usize {
        self.usable.iter().filter(|&&u| u).count()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// By definition: every pixel looks at all marks.
    fn naive(marks: &Mask, radius: usize) -> Vec<bool> {
        let (h, w) = (marks.height, marks.width);
        let near = |i: usize, j: usize| {
            let (dy, dx) = ((i / w).abs_diff(j / w), (i % w).abs_diff(j % w));
            dy * dy + dx * dx <= radius * radius
        };
        (0..h * w).map(|i| !(0..h * w).any(|j| marks.usable[j] && near(i, j))).collect()
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(256))]
        #[test]
        fn growing_marks_is_what_its_definition_says(
            (height, width) in (1..24_usize, 1..24_usize),
            radius in 0..40_usize,
            share in 0..9_u32,
            seed: u32,
        ) {
            let mark = |i: usize| (i as u32 + 1).wrapping_mul(seed | 1) >> 24 < share;
            let marks = (0..height * width).map(mark).collect();
            let marks = Mask::new(height, width, marks).expect("marks");
            prop_assert_eq!(marks.clear_of(radius).usable, naive(&marks, radius));
        }
    }
}
