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
        other.ensure_size(self.height, self.width)?;
        let usable = self.usable.iter().zip(&other.usable).map(|(&a, &b)| a && b).collect();
        Ok(Self { height: self.height, width: self.width, usable })
    }

    /// Fails unless the mask has this size.
    ///
    /// # Errors
    /// [`Error::SizeMismatch`].
    pub fn ensure_size(&self, height: usize, width: usize) -> Result<()> {
        if (self.height, self.width) == (height, width) {
            return Ok(());
        }
        Err(Error::SizeMismatch {
            what: "the mask".into(),
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
