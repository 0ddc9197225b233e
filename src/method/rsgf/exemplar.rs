//! [`Exemplar`]: what pieces are taken from.

use crate::analyze::lattice::drift::Drift;
use crate::base::ctx::Simd;
use crate::image::color::ColorModel;
use crate::image::interpolate::{REACH, fraction, nearest};
use crate::image::mask::Mask;
use crate::image::picture::Picture;
use crate::method::rsgf::places::Offset;
use crate::search::patch::MatchImage;
use crate::search::patch::codes::Codes;
use crate::signal::basis::Basis;
use crate::signal::resample::resized;

/// The photo in the matching space.
#[derive(Debug)]
pub struct Exemplar {
    pub(super) image: MatchImage,
    /// How far its cells lie beside the lattice.
    pub(super) drift: Drift,
    /// How many pixels above and left of each are not usable; `None` if all are.
    unusable: Option<Vec<u32>>,
}

impl Exemplar {
    /// The photo, and where it may be used. With a lattice it is found out how far each of its cells
    /// lies beside its place, and patches are taken from where the cell is.
    pub fn new(
        simd: Simd,
        photo: &Picture,
        mask: Option<&Mask>,
        straightened: Option<Basis>,
    ) -> Self {
        let size = (photo.height(), photo.width());
        let model = ColorModel::new(photo);
        let pixels = model.averaging_pixels(photo);
        let usable = mask.map(Mask::usable);
        let codes = Codes::covering(&[(&pixels, usable)], model.space());
        let image = codes.image(&pixels, size, model.space());
        let drift = straightened.map_or_else(Drift::none, |basis| {
            Drift::measured(simd, basis, size, |scale| {
                let to = |n: usize| (n as f64 * scale).round().max(1.0) as usize;
                let to = (to(size.0), to(size.1));
                codes.image(&resized(&pixels, size, to), to, model.space())
            })
        });
        let unusable = usable.map(|usable| {
            let (h, w) = size;
            let mut sums = vec![0; (h + 1) * (w + 1)];
            for y in 0..h {
                let mut row = 0;
                for x in 0..w {
                    row += u32::from(!usable[y * w + x]);
                    sums[(y + 1) * (w + 1) + x + 1] = sums[y * (w + 1) + x + 1] + row;
                }
            }
            sums
        });
        Self { image, drift, unusable }
    }

    /// How far its cells lie beside the lattice.
    pub fn drift(&self) -> &Drift {
        &self.drift
    }

    /// Whether a window with this top left corner, and `margin` around it, can be copied; between pixels
    /// with those that it is made of.
    pub(super) fn fits(
        &self,
        place: Offset,
        (height, width): (usize, usize),
        margin: usize,
    ) -> bool {
        let (h, w) = (self.image.height() as i64, self.image.width() as i64);
        let [my, mx] = place.map(|v| margin + if fraction(v) == 0 { 0 } else { REACH });
        let (y, x) = (nearest(place[0]) - my as i64, nearest(place[1]) - mx as i64);
        let (height, width) = (height + 2 * my, width + 2 * mx);
        if y < 0 || x < 0 || y + height as i64 > h || x + width as i64 > w {
            return false;
        }
        let Some(sums) = &self.unusable else { return true };
        let at = |y: usize, x: usize| sums[y * (w as usize + 1) + x];
        let (y, x) = (y as usize, x as usize);
        at(y + height, x + width) + at(y, x) == at(y + height, x) + at(y, x + width)
    }
}
