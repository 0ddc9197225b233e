//! A sheet to look at: the photo, the texture, its octaves.

use crate::base::ctx::Ctx;
use crate::base::error::Result;
use crate::image::picture::{Picture, Samples};
use crate::image::sheet::{grid, repeated};
use crate::verb::noise::{NoiseEdit, NoiseTexture, RenderParams, SampleType};

/// Longest side of a picture on the sheet.
const SIDE: usize = 384;

/// Octaves to a row.
const IN_ROW: usize = 4;

impl NoiseTexture {
    /// A picture of 8 bits to look at, of the first map: in the first row the photo (its middle, if one is
    /// given), the texture and the texture four times as large, then each octave of noise alone, the finest
    /// first.
    ///
    /// # Errors
    /// [`Error::Memory`](crate::Error::Memory), [`Error::Cancelled`](crate::Error::Cancelled); of a photo
    /// with other channels than the map [`Error::BadPicture`](crate::Error::BadPicture).
    pub fn sheet(&self, ctx: &Ctx, photo: Option<&Picture>) -> Result<Picture> {
        let side = |axis: usize| SIDE.min(self.document().size[axis] as usize);
        let size = (side(0), side(1));
        let of = |texture: &Self, scale: f64| -> Result<Picture> {
            let params =
                RenderParams { scale, samples: SampleType::F32, ..RenderParams::new(size) };
            // There is no texture without a map.
            shown(&texture.render(ctx, &params)?.remove(0).2, size)
        };
        let mut rows = vec![Vec::new()];
        if let Some(photo) = photo {
            rows[0].push(shown(photo, size)?);
        }
        rows[0].extend([of(self, 1.0)?, of(self, 0.25)?]);
        let octaves = self.document().octaves();
        let alone = |octave: usize| -> Result<Picture> {
            let gains = (0..octaves).map(|i| f64::from(u8::from(i == octave))).collect();
            of(&self.edit(ctx, &NoiseEdit { gains, ..Default::default() })?, 1.0)
        };
        let octaves = (0..octaves).map(alone).collect::<Result<Vec<_>>>()?;
        rows.extend(octaves.chunks(IN_ROW).map(<[Picture]>::to_vec));
        grid(&rows)
    }
}

/// The middle of a picture, without alpha, in 8 bits as a screen shows it.
fn shown(picture: &Picture, (width, height): (usize, usize)) -> Result<Picture> {
    let (h, w) = (picture.height().min(height), picture.width().min(width));
    let (top, left) = ((picture.height() - h) / 2, (picture.width() - w) / 2);
    let all = picture.channels();
    let kept = all - usize::from(picture.alpha_channel().is_some());
    let sample = |i: usize| {
        let (pixel, c) = (i / kept, i % kept);
        let at = (top + pixel / w) * picture.width() + left + pixel % w;
        picture.samples().unit(at * all + c) as f32
    };
    let samples = Samples::F32((0..h * w * kept).map(sample).collect());
    repeated(&Picture::new(h, w, kept, samples, picture.encoding)?, 1, SIDE)
}
