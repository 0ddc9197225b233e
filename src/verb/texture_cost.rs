//! [`texture_cost`]: how much a texture looks like its photo, by the definition.

use serde::Serialize;

use crate::analyze::nearest::{Sampling, mean_nearest};
use crate::base::ctx::Ctx;
use crate::base::error::{Error, Result};
use crate::base::memory::ensure_available;
use crate::base::params::params;
use crate::image::mask::Mask;
use crate::image::picture::Picture;
use crate::image::sourcemap::SourceMap;
use crate::search::patchmatch::Wrap;
use crate::verb::inputs::Inputs;
use crate::verb::params::{Axis, TileParams};

params! {
    /// Parameters of [`texture_cost`].
    pub struct TextureCostParams for "texture_cost" {
        /// In which directions the texture repeats.
        axis: Axis = TileParams::default().axis;
        /// Side of the patches that are compared; odd.
        patch: usize = TileParams::default().patch, in 3..=21, unit "px";
        /// How many of the texture's patches are drawn at random; all of them if there are no more.
        samples: usize = 500, in 2..=1_000_000;
    }
}

/// The texture cost, estimated from a random sample of patches.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct TextureCost {
    /// Mean squared CIE L*a*b* distance, per pixel of a patch, between the texture's patches and
    /// the nearest of all the photo's patches: an estimate of the mean over all patches, with a bias
    /// far below its margin.
    pub mean: f64,
    /// Half the width of the 95 % confidence interval around `mean`, by the normal distribution; 0
    /// if nothing was left to chance.
    pub margin: f64,
    /// How many patches were compared with all of the photo's. Fewer than were asked for if there
    /// are no more whose cost is not known to be 0 from the source map.
    pub samples: usize,
}

/// Measures how much `texture` looks like `photo`: for patches drawn at random, the distance to
/// the nearest of all patches of the photo, found by comparing with every one.
///
/// `texture` has the photo's type and channels (as tiles have). Its source map narrows the margin
/// by much, as the distances to the patches that it names are known everywhere (regression
/// estimator); it does not change what is estimated. Where `mask` or the photo's own alpha forbids it, a photo's patch is no
/// candidate.
///
/// # Paper
/// Moritz et al. 2017, eq. 5. [`Costs::texture`](crate::Costs) is an upper bound of it.
///
/// # Determinism
/// `ctx.seed` draws the patches. Same bytes for any thread count and SIMD level.
///
/// # Cost
/// Proportional to `samples` times the photo's pixels: every pair of patches is compared.
///
/// # Errors
/// [`Error::Parameter`], [`Error::TooSmall`], [`Error::BadPicture`] if the texture is not of the
/// photo's type or the source map not of their sizes, [`Error::SizeMismatch`] for a mask of another
/// size than the photo, [`Error::EmptyMask`], [`Error::NotFinite`], [`Error::Memory`],
/// [`Error::Cancelled`].
pub fn texture_cost(
    ctx: &Ctx,
    texture: &Picture,
    photo: &Picture,
    map: Option<&SourceMap>,
    mask: Option<&Mask>,
    params: &TextureCostParams,
) -> Result<TextureCost> {
    check(texture, photo, map, params)?;
    let inputs = Inputs { mask, ..Inputs::new(photo) };
    let mask = inputs.usable(&TileParams::default())?.remove(0);
    let wrap = Wrap { y: params.axis != Axis::X, x: params.axis != Axis::Y };
    let sampling = Sampling { patch: params.patch, samples: params.samples, wrap };
    let measure = || mean_nearest(ctx, texture, photo, map, mask.as_ref(), sampling);
    let estimate = ctx.install(measure)?;
    let margin = 1.96 * estimate.error;
    Ok(TextureCost { mean: estimate.mean, margin, samples: estimate.compared })
}

fn check(
    texture: &Picture,
    photo: &Picture,
    map: Option<&SourceMap>,
    params: &TextureCostParams,
) -> Result<()> {
    params.validate()?;
    if params.patch.is_multiple_of(2) {
        return Err(Error::parameter("patch", "odd, so that a patch has a middle", params.patch));
    }
    for (what, picture) in [("the photo", photo), ("the texture", texture)] {
        let (width, height) = (picture.width(), picture.height());
        if width.min(height) < params.patch {
            let (what, remedy) = (what.into(), "choose a smaller patch".into());
            return Err(Error::TooSmall { what, width, height, need: params.patch, remedy });
        }
        picture.ensure_finite(what)?;
    }
    let kind = |p: &Picture| (p.channels(), p.samples().dtype(), p.encoding);
    if kind(texture) != kind(photo) {
        let (channels, dtype, encoding) = kind(photo);
        return Err(Error::BadPicture {
            what: "texture".into(),
            reason: format!(
                "it must be what the photo is: {channels} channels of {dtype}, encoding {encoding:?}"
            ),
        });
    }
    let size = |p: &Picture| (p.height(), p.width());
    let fits = |map: &SourceMap| {
        (map.height(), map.width()) == size(texture)
            && map.source_size() == size(photo)
            && map.origins().is_none()
    };
    if !map.is_none_or(fits) {
        return Err(Error::BadPicture {
            what: "source map".into(),
            reason:
                "it must be of the sizes of the texture and the photo, and of one photo as it lies"
                    .into(),
        });
    }
    // Of each pixel: colours (12), codes (4), what is usable (8), what is known and what is drawn (32).
    let pixels = |p: &Picture| p.width() as u64 * p.height() as u64;
    let canvas = (texture.width() + params.patch) as u64 * (texture.height() + params.patch) as u64;
    let need = 24 * pixels(photo) + 12 * pixels(texture) + 48 * canvas;
    ensure_available("the texture cost", Some(need))
}
