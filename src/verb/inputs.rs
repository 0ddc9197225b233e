//! What a tile is made from.

use crate::base::error::{Error, Result};
use crate::image::mask::Mask;
use crate::image::picture::Picture;
use crate::method::flatten::{self, Flat};
use crate::verb::tile::TileParams;

/// What a tile is made from.
#[derive(Debug, Clone, Copy)]
pub struct Inputs<'a> {
    /// The photo, H x W x C: grey, RGB (each with or without alpha), or data of any number of
    /// channels.
    pub photo: &'a Picture,
    /// Where it may be used (size of the photo).
    pub mask: Option<&'a Mask>,
    /// What must not be copied from it (size of the photo): marks, which
    /// [`TileParams::avoid_grow`] widens.
    pub avoid: Option<&'a Mask>,
}

impl<'a> Inputs<'a> {
    /// A photo alone.
    pub fn new(photo: &'a Picture) -> Self {
        Self { photo, mask: None, avoid: None }
    }

    /// Where the photo may be used: the caller's masks and the photo's own alpha; `None` is
    /// everywhere.
    pub(super) fn usable(&self, params: &TileParams) -> Result<Option<Mask>> {
        let (height, width) = (self.photo.height(), self.photo.width());
        let mut parts = Vec::new();
        if let Some(mask) = self.mask {
            mask.ensure_size("the mask", height, width)?;
            parts.push(mask.clone());
        }
        if let Some(marks) = self.avoid {
            marks.ensure_size("the avoid mask", height, width)?;
            parts.push(marks.clear_of(params.avoid_grow));
        } else if params.avoid_grow > 0 {
            let expected = "0 where there is no avoid mask to grow";
            return Err(Error::parameter("avoid_grow", expected, params.avoid_grow));
        }
        parts.extend(Mask::from_alpha(self.photo));
        let all = parts.into_iter().map(Ok).reduce(|a, b| a?.and(&b?)).transpose()?;
        Ok(all.filter(|m| m.count() < m.usable().len()))
    }
    /// The photo with its light flattened, if `params` want it; `notes` say what was done.
    pub(super) fn flattened(
        &self,
        mask: Option<&Mask>,
        params: &TileParams,
        notes: &mut Vec<String>,
    ) -> Result<Option<Picture>> {
        if params.flatten <= 0.0 {
            return Ok(None);
        }
        let sigma = f64::from(params.flatten) * self.photo.height().min(self.photo.width()) as f64;
        let Flat { picture, factors: (low, high), clipped } =
            flatten::run(self.photo, mask, sigma)?;
        notes.push(format!(
            "light flattened over {sigma:.0} pixels: multiplied by {low:.2} to {high:.2}, {:.1} % of \
             the samples cut off at full scale",
            clipped * 100.0
        ));
        Ok(Some(picture))
    }
}
